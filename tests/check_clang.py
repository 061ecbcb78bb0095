#!/usr/bin/env python3
"""Shows every source to clang 14, its warnings and its thread-safety analysis as errors.

    tests/check_clang.py           as the compiler sees it
    tests/check_clang.py --tidy    by clang-tidy, with its checks besides: some ten times slower

Most of the time goes into headers, so sources that are compiled alike share them: one generated file includes several,
as long as no two keep the same name to themselves. A batch that does not pass is taken apart and its sources are
looked at alone, so a report is always about a single source.
"""

import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "dev"
MAX_BATCH = 16
# Too slow for every run; tests/run_tidy.sh has them. A batch includes sources by its nature.
LEFT_OUT = (
    "clang-analyzer-*",
    "performance-unnecessary-value-param",
    "bugprone-reserved-identifier",
    "bugprone-stringview-nullptr",
    "bugprone-suspicious-include",
)
TIDY = "clang-tidy --quiet --checks=" + ",".join("-" + check for check in LEFT_OUT)
TIDY += " '--header-filter=/(core|server|client|proto)/.*[.](h|cc)$'"
HIDDEN = re.compile(r"^namespace \{\n(.*?)^\}  // namespace\n", re.M | re.S)
NOT_CODE = re.compile(r'//[^\n]*|"(?:[^"\\\n]|\\.)*"')
TYPES = [
    re.compile(r"^(?:struct|class|enum class|enum|union)\s+(\w+)", re.M),
    re.compile(r"^using\s+(\w+)\s*=", re.M),
]
VALUES = [re.compile(r"^(?!using)[A-Za-z].*?\b(\w+)\s*[({=;[]", re.M), re.compile(r"^\s+(k[A-Z]\w*)(?:,| =|$)", re.M)]


def declared(patterns, code):
    """Names declared at the left margin, and enumerators."""
    code = NOT_CODE.sub("", code)
    return {name for pattern in patterns for name in pattern.findall(code)}


def tracked(*patterns):
    files = subprocess.run(["git", "ls-files", *patterns], cwd=ROOT, check=True, capture_output=True, text=True)
    return files.stdout.split()


def batches_of(paths, flags):
    """Groups of sources that share compiler flags and no hidden name; first fit. A type that hides a public one keeps
    its source alone."""
    public = declared(TYPES, "".join((ROOT / header).read_text() for header in tracked("*.h")))
    batches = []
    for path in paths:
        hidden_code = "".join(HIDDEN.findall((ROOT / path).read_text()))
        hidden = declared(TYPES + VALUES, hidden_code)
        alone = declared(TYPES, hidden_code) & public
        key = None if alone else flags(path)
        for batch in batches if key else []:
            if batch["key"] == key and len(batch["paths"]) < MAX_BATCH and not batch["hidden"] & hidden:
                batch["paths"].append(path)
                batch["hidden"] |= hidden
                break
        else:
            batches.append({"key": key, "paths": [path], "hidden": hidden})
    return [batch["paths"] for batch in batches]


def write_batches(paths, commands):
    """Writes one file a batch; from the command that compiles it to the sources it includes."""

    def flags(path):
        return path.split("/")[0], commands[str(ROOT / path)].split(" -o ")[0]

    folder = BUILD / "batches"
    folder.mkdir(exist_ok=True)
    batches = {}
    for number, batch in enumerate(batches_of(paths, flags)):
        file = folder / f"batch_{number}.cc"
        file.write_text("".join(f'#include "{path}"\n' for path in batch))
        batches[f"{flags(batch[0])[1]} -c {file}"] = batch
    return batches


def faults(command, tidy):
    """What clang, or clang-tidy, says of one compile command; nothing if all is well."""
    words = re.sub(r" -o \S+", "", command[command.index("clang++") :])
    flags, file = words.split(" -c ")
    look = f"{TIDY} {file} -- {flags.split(' ', 1)[1]}" if tidy else f"{flags} -fsyntax-only {file}"
    run = subprocess.run(look, shell=True, cwd=BUILD, capture_output=True, text=True)
    return run.stdout + run.stderr if run.returncode else ""


def main():
    tidy = sys.argv[1:] == ["--tidy"]
    if sys.argv[1:] and not tidy:
        sys.exit(__doc__)
    for step in (["--preset", "dev"], ["--build", "--preset", "dev", "--target", "strata_proto_code"]):
        subprocess.run(["cmake", *step], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    commands = {entry["file"]: entry["command"] for entry in json.loads((BUILD / "compile_commands.json").read_text())}
    paths = tracked(*(f"{folder}/*.cc" for folder in ("core", "server", "client", "proto")))
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        batches = write_batches(paths, commands)
        passed = list(pool.map(lambda command: not faults(command, tidy), batches))
        again = [path for good, batch in zip(passed, batches.values()) if not good for path in batch]
        found = [text for text in pool.map(lambda path: faults(commands[str(ROOT / path)], tidy), again) if text]
    nothing = f"{'clang-tidy' if tidy else 'clang'}: {len(paths)} files in {len(batches)} batches, nothing found"
    print("".join(found) or nothing)
    return 1 if found else 0


sys.exit(main())
