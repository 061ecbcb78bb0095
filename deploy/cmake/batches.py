#!/usr/bin/env python3
"""Says which sources of a target are compiled as one: those that keep no name to themselves that another has, too.

    batches.py ROOT < targets.txt > batches.cmake

A line of the input is a target, a tab and a path below ROOT; the output sets UNITY_GROUP of the sources. Most of the
time of a build goes into the headers of others, so sources that share them are built several times faster.
"""

import collections
import pathlib
import re
import sys

MAX_BATCH = 12
HIDDEN = re.compile(r"^namespace \{\n(.*?)^\}  // namespace\n", re.M | re.S)
NOT_CODE = re.compile(r'//[^\n]*|"(?:[^"\\\n]|\\.)*"')
DEFINITION = re.compile(r"^#define ", re.M)
ALIAS = re.compile(r"^using\s+(\w+)\s*=\s*([^;]+);", re.M)
TYPES = [re.compile(r"^(?:struct|class|enum class|enum|union)\s+(\w+)", re.M), re.compile(r"^using\s+(\w+)\s*=", re.M)]
VALUES = [
    re.compile(r"^namespace (\w+) =", re.M),
    re.compile(r"^(?!using|namespace|class|struct|enum|union|template)[A-Za-z].*?\b(\w+)\s*[({=;[]", re.M),
    re.compile(r"^\s+(k[A-Z]\w*)(?:,| =|$)", re.M),
]


def declared(patterns, code):
    """Names declared at the left margin, and enumerators."""
    code = NOT_CODE.sub("", code)
    return {name for pattern in patterns for name in pattern.findall(code)}


def hidden_names(path, code):
    """From each name the source keeps to itself to what it is; an alias is the same wherever it says the same."""
    aliases = dict(ALIAS.findall(code))
    return {name: aliases.get(name, path) for name in declared(TYPES + VALUES, code)}


def fits(batch, hidden):
    return len(batch["paths"]) < MAX_BATCH and all(batch["hidden"].get(name, what) == what for name, what in hidden.items())


def public_types(root):
    """Types of all headers: a source that hides one of them may not be joined with a source that means the public one."""
    headers = [path for folder in ("core", "server", "client", "proto", "tests")
               for path in pathlib.Path(root, folder).rglob("*.h")]
    return declared(TYPES, "".join(path.read_text() for path in headers))


def batches_of(paths, public):
    """Groups of sources that share no hidden name; first fit."""
    batches = []
    for path in paths:
        code = pathlib.Path(path).read_text()
        hidden_code = "".join(HIDDEN.findall(code))
        hidden = hidden_names(path, hidden_code)
        alone = DEFINITION.search(code) or declared(TYPES, hidden_code) & public
        if alone:
            continue
        batch = next((batch for batch in batches if fits(batch, hidden)), None)
        if batch is None:
            batches.append({"paths": [path], "hidden": hidden})
        else:
            batch["paths"].append(path)
            batch["hidden"].update(hidden)
    return [batch["paths"] for batch in batches if len(batch["paths"]) > 1]


def main():
    targets = collections.defaultdict(list)
    uses = collections.Counter()
    for line in sys.stdin:
        target, path = line.rstrip("\n").split("\t")
        targets[target].append(path)
        uses[path] += 1
    public = public_types(sys.argv[1])
    for target, paths in targets.items():
        own = [path for path in paths if uses[path] == 1]  # a source has one group, whichever target it is in
        for number, batch in enumerate(batches_of(own, public)):
            files = "\n  ".join(f'"{path}"' for path in batch)
            print(f"set_source_files_properties(\n  {files}\n  TARGET_DIRECTORY {target} PROPERTIES UNITY_GROUP {number})")


main()
