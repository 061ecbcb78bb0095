#!/usr/bin/env python3
"""Shows every source of the product to clang 14, its warnings and its thread-safety analysis as errors.

    tests/check_clang.py           as the compiler sees it
    tests/check_clang.py --tidy    by clang-tidy, with its checks besides: some ten times slower

Looks at the batches of deploy/cmake/batches.py: most of the time goes into headers, so sources share them.
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
OBJECT = re.compile(r" -o ((?:core|server|client|proto/translate)/(?!.*verify_interface)\S+)")


def faults(command, tidy):
    """What clang, or clang-tidy, says of one compile command; nothing if all is well."""
    flags, file = OBJECT.sub("", command[command.index("clang++") :]).split(" -c ")
    look = f"{TIDY} {file} -- {flags.split(' ', 1)[1]}" if tidy else f"{flags} -fsyntax-only {file}"
    run = subprocess.run(look, shell=True, cwd=BUILD, capture_output=True, text=True)
    return run.stdout + run.stderr if run.returncode else ""


def main():
    if sys.argv[1:] not in ([], ["--tidy"]):
        sys.exit(__doc__)
    tidy = "--tidy" in sys.argv
    targets = ["strata_proto_code", "strata_large_headers"]
    for step in (["--preset", "dev", "-DSTRATA_BATCHES=ON"], ["--build", "--preset", "dev", "--target", *targets]):
        subprocess.run(["cmake", *step], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    entries = json.loads((BUILD / "compile_commands.json").read_text())
    commands = [*dict.fromkeys(entry["command"] for entry in entries if OBJECT.search(entry["command"]))]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        found = [text for text in pool.map(lambda command: faults(command, tidy), commands) if text]
    print("".join(found) or f"{'clang-tidy' if tidy else 'clang'}: {len(commands)} batches, nothing found")
    return 1 if found else 0


sys.exit(main())
