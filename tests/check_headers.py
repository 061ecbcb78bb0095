#!/usr/bin/env python3
"""Holds every header self-contained: it compiles as the first thing of a source.

A header with a source of its own name is proved by a build without STRATA_BATCHES, so of those this only sees that the
source includes it first; the others are compiled alone. Needs a configured and built build/release, and build/dev.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r'^#include (\S+)', re.MULTILINE)


def compiler() -> list[str]:
    """g++ with every include folder that some target of the build sees."""
    commands = json.loads((ROOT / "build/release/compile_commands.json").read_text())
    folders = {flag: None for entry in commands for flag in re.findall(r"(?:-I|-isystem )\S+", entry["command"])}
    return ["g++", "-std=gnu++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror",
            *(word for flag in folders for word in flag.split()), "-x", "c++", "-"]


def fault(header: str, command: list[str]) -> str:
    source = ROOT / header.replace(".h", ".cc")
    if source.is_file():
        first = INCLUDE.search(source.read_text(encoding="utf-8"))
        own = first is not None and first.group(1) == f'"{header}"'
        return "" if own else f"{source.relative_to(ROOT)}: its first include is not {header}\n"
    run = subprocess.run(command, cwd=ROOT, input=f'#include "{header}"\n', capture_output=True, text=True)
    return "" if run.returncode == 0 else run.stderr


def main() -> int:
    patterns = [f"{folder}/*.h" for folder in ("core", "server", "client", "proto", "tests")]
    listed = subprocess.run(["git", "ls-files", *patterns], cwd=ROOT, check=True, capture_output=True, text=True)
    headers = listed.stdout.split()
    command = compiler()
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        faults = [text for text in pool.map(lambda header: fault(header, command), headers) if text]
    print("".join(faults) if faults else f"headers: {len(headers)} files, all self-contained")
    return 1 if faults else 0


sys.exit(main())
