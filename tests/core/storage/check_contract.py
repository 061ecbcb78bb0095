#!/usr/bin/env python3
"""Holds the contract suite against core/storage/storage.h: each function there is called by a test, or its name is printed
and the check exits 1."""
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
HEADER = HERE.parents[2] / "core/storage/storage.h"
CLASS = re.compile(r"^class (\w+) \{(.*?)^\};", re.M | re.S)
FUNCTION = re.compile(r"\bvirtual\b[^;=]*?\b(\w+)\((?!\))|\bvirtual\b[^;=]*?\b(\w+)\(\)")


def main() -> int:
    suite = "\n".join(path.read_text(encoding="utf-8") for path in sorted((HERE / "contract").glob("*")))
    called = set(re.findall(r"(?:\)\.|->|\.)(\w+)\(", suite))
    functions = {f"{name}::{function}": function
                 for name, body in CLASS.findall(HEADER.read_text(encoding="utf-8"))
                 for pair in FUNCTION.findall(re.sub(r"//.*", "", body))
                 for function in pair if function and function != name}
    if len(functions) < 70:
        print(f"check_contract: {len(functions)} functions found in {HEADER.name}: they are written otherwise now")
        return 1
    missing = [name for name, function in functions.items() if function not in called]
    for name in missing:
        print(f"check_contract: no test of the contract suite calls {name}")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
