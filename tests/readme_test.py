#!/usr/bin/python3
"""Keeps the console lines of README.md, docs/exports.md and docs/recordings.md true.

    tests/readme_test.py --build build/release

Runs every line that starts with "$ " in a page's ```console blocks, in order, in an empty folder with the built
programs and tests/support on the PATH, and compares what it prints with what the page shows. "…" in the page stands for any text
within a line (times, ports). Exits 1 with the difference.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent


def console_lines(text):
    """[(command, expected lines)] of all console blocks."""
    steps = []
    for block in re.findall(r"```console\n(.*?)```", text, re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ "):
                steps.append((line[2:], []))
            else:
                steps[-1][1].append(line)
    return steps


def matches(expected, printed):
    pattern = ".*".join(re.escape(piece) for piece in expected.rstrip().split("…"))
    return re.fullmatch(pattern, printed.rstrip()) is not None


def holds(page, environment):
    steps = console_lines((ROOT / page).read_text(encoding="utf-8"))
    if len(steps) < 5:
        print(f"{page} shows {len(steps)} commands, at least 5 are expected", file=sys.stderr)
        return False
    with tempfile.TemporaryDirectory() as folder:
        for command, expected in steps:
            done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, text=True, timeout=300,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            printed = done.stdout.splitlines()
            same = len(printed) == len(expected) and all(map(matches, expected, printed))
            if done.returncode != 0 or not same:
                print(f"$ {command}\nexit {done.returncode}, {page} shows:", *expected, "printed:", done.stdout,
                      done.stderr, sep="\n", file=sys.stderr)
                return False
            print(f"ok: {command}")
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    build = parser.parse_args().build.resolve()
    programs = {folder: build / folder for folder in ("client/cli", "server", "tests/support")}
    programs["scripts"] = ROOT / "tests/support"
    environment = dict(os.environ, PATH=os.pathsep.join([*map(str, programs.values()), os.environ["PATH"]]))
    return 0 if all(holds(page, environment) for page in ("README.md", "docs/exports.md", "docs/recordings.md")) else 1


sys.exit(main())
