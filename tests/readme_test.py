#!/usr/bin/python3
"""Keeps the console lines of README.md and of pages in docs/ true.

    tests/readme_test.py --build build/release

Runs every line that starts with "$ " in a page's ```console blocks, in order, in an empty folder with the built
programs and tests/support on the PATH, and compares what it prints with what the page shows. "…" in the page stands for any text
within a line (times, ports). What a page starts in the background and leaves the number of in a .pid file ends with the
page. Exits 1 with the difference.
"""
import argparse
import os
import pathlib
import re
import signal
import socket
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


def free_address():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{free.getsockname()[1]}"


def end_what_was_begun(folder):
    for file in pathlib.Path(folder).glob("*.pid"):
        try:
            os.kill(int(file.read_text()), signal.SIGKILL)
        except (ProcessLookupError, ValueError):
            pass


def holds(page, environment):
    steps = console_lines((ROOT / page).read_text(encoding="utf-8"))
    if len(steps) < 5:
        print(f"{page} shows {len(steps)} commands, at least 5 are expected", file=sys.stderr)
        return False
    with tempfile.TemporaryDirectory() as folder:
        try:
            return all(step_holds(page, command, expected, folder, environment) for command, expected in steps)
        finally:
            end_what_was_begun(folder)


def step_holds(page, command, expected, folder, environment):
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
    programs = {folder: build / folder for folder in ("client/cli", "client/ros2", "server", "tests/support", "tests/support/ros2")}
    programs["scripts"] = ROOT / "tests/support"
    environment = dict(os.environ, PATH=os.pathsep.join([*map(str, programs.values()), os.environ["PATH"]]))
    # Domains of DDS from 201 on are those of no test.
    own = {"STRATA_SERVER": free_address(), "ROS_LOCALHOST_ONLY": "1", "ROS_DOMAIN_ID": str(201 + os.getpid() % 30)}
    web = {"STRATA_SERVER": free_address(), "STRATA_WEB": free_address()}
    pages = {"README.md": {}, "docs/exports.md": {}, "docs/recordings.md": {}, "docs/ros2.md": own, "docs/web.md": web}
    return 0 if all(holds(page, {**environment, **more}) for page, more in pages.items()) else 1


sys.exit(main())
