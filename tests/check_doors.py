#!/usr/bin/env python3
"""Holds every source to a door: whatever no program of ours and no client of the SDK can come to is named, and exits 1.

From the mains and the headers of the SDK along the includes. A source is reached with the header of its name, or with a
reached header that it includes and that declares a function or class of it: words are compared, not meaning, so that
what is named has no door, while a single function may still have none. What only a linked program calls is listed below.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# header: why it needs no door of ours.
LINKED = {
    "core/mls/update.h": "single measurements as they come (thesis 6.5.3), for a robot that links strata::mls",
}

INCLUDE = re.compile(r'^#include "([^"]+)"', re.M)
HIDDEN = re.compile(r"^namespace \{$.*?^\}  // namespace$", re.M | re.S)
DEFINED = re.compile(r"^[A-Za-z][^\n;{}=#]*?\b([A-Z]\w+)(?:::~?\w+)?\(", re.M)


def texts() -> dict[str, str]:
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
            for top in ("core", "client", "server", "proto") for path in (ROOT / top).rglob("*")
            if path.suffix in (".h", ".cc")}


class Tree:
    def __init__(self, files: dict[str, str]):
        self.files = files
        self.includes = {name: [i for i in INCLUDE.findall(text) if i in files] for name, text in files.items()}
        self.defined = {name: set(DEFINED.findall(HIDDEN.sub("", text)))
                        for name, text in files.items() if name.endswith(".cc")}

    def has_door(self, source: str, reached: set[str]) -> bool:
        own = source[:-len(".cc")] + ".h"
        if own in self.files:
            return own in reached
        words = self.defined[source]
        return any(words & set(re.findall(r"\w+", self.files[header]))
                   for header in self.includes[source] if header in reached)

    def reached_from(self, roots: list[str]) -> set[str]:
        reached: set[str] = set()
        waiting = roots
        while waiting:
            while waiting:
                name = waiting.pop()
                if name not in reached:
                    reached.add(name)
                    waiting += self.includes[name]
            waiting = [s for s in self.defined if s not in reached and self.has_door(s, reached)]
        return reached


def main() -> int:
    tree = Tree(texts())
    # What is loaded has C functions for a main (client/python/native).
    programs = [name for name, text in tree.files.items() if re.search(r'^int main\(|^extern "C" \{', text, re.M)]
    roots = programs + [name for name in tree.files if re.fullmatch(r"client/sdk/\w+\.h", name)]
    reached = tree.reached_from(list(roots))
    faults = [f"{name}: has a door by now, strike it from LINKED in tests/check_doors.py" for name in LINKED if name in reached]
    reached |= tree.reached_from([*roots, *LINKED])
    faults += [f"{name}: no main and no header of the SDK leads here" for name in sorted(tree.files) if name not in reached]
    print("\n".join(faults) if faults else f"doors: {len(tree.files)} files, {len(LINKED)} headers for programs that link them")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
