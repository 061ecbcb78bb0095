#!/usr/bin/python3
"""Keeps the console lines of README.md and of pages in docs/ true.

    tests/readme_test.py --build build/release

Runs every line that starts with "$ " in a page's ```console blocks, in order, in an empty folder with the built
programs and tests/support on the PATH, and compares what it prints with what the page shows. "…" in the page stands for any text
within a line (times, ports); blanks of such a line may be more or fewer. Pages of one tour go on in one folder, with the maps of those before. What is started in the background
and leaves its number in a .pid file ends with the folder. Exits 1 with the difference.

    tests/readme_test.py --build build/release --only docs/quickstart.md    that page, with the rest of its tour
    tests/readme_test.py --list                                             the first page of each tour, one a line

Each tour is a test of ctest's (`ctest -L pages`): they have folders, servers and addresses of their own.

Pages that name STRATA_DATABASE get a PostgreSQL server of their own; without PostgreSQL 15 on the machine they are left out.
"""
import argparse
import os
import pathlib
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests/support"))

from postgres_database import Database  # noqa: E402, from the folder above

TOUR = ["docs/quickstart.md", "docs/concepts.md", "docs/profiles.md", "docs/howto/georeference.md", "docs/howto/floorplan.md",
        "docs/howto/mesh.md", "docs/howto/label.md", "docs/howto/fleet.md", "docs/errors.md"]
DATABASE_PAGE = "docs/howto/postgresql.md"


def console_lines(text):
    """[(command, expected lines)] of all console blocks."""
    steps = []
    for indent, block in re.findall(r"^( *)```console\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE):
        for line in block.splitlines():
            line = line.removeprefix(indent)
            if line.startswith("$ "):
                steps.append((line[2:], []))
            else:
                steps[-1][1].append(line)
    return steps


def matches(expected, printed):
    if "…" in expected:  # columns are as wide as their numbers, which the page leaves open
        expected, printed = " ".join(expected.split()), " ".join(printed.split())
    pattern = ".*".join(re.escape(piece) for piece in expected.rstrip().split("…"))
    return re.fullmatch(pattern, printed.rstrip()) is not None


def page_with_database_holds(page, environment):
    with Database() as database:
        if database.address is None:
            print(f"{page}: left out, PostgreSQL 15 is not installed")
            return True
        return holds([page], {**environment, "STRATA_DATABASE": database.address, "ONE": free_address(), "TWO": free_address(), "THREE": free_address()})


def free_address():
    """One that nobody gets who asks for any: a tour's servers begin and end, and between that it has to stay free."""
    lowest = int(pathlib.Path("/proc/sys/net/ipv4/ip_local_port_range").read_text().split()[0])
    while True:
        address = ("127.0.0.1", random.randrange(lowest // 2, lowest))
        with socket.socket() as free:
            try:
                free.bind(address)
                return "{}:{}".format(*address)
            except OSError:
                continue


def end_what_was_begun(folder):
    for file in pathlib.Path(folder).glob("*.pid"):
        try:
            os.kill(int(file.read_text()), signal.SIGKILL)
        except (ProcessLookupError, ValueError):
            pass


def holds(tour, environment):
    with tempfile.TemporaryDirectory() as folder:
        own = {"XDG_CONFIG_HOME": f"{folder}/.config"}  # no contexts of who runs this
        try:
            return all(page_holds(page, folder, {**environment, **own}) for page in tour)
        finally:
            end_what_was_begun(folder)


def page_holds(page, folder, environment):
    steps = console_lines((ROOT / page).read_text(encoding="utf-8"))
    if len(steps) < 3:
        print(f"{page} shows {len(steps)} commands, at least 3 are expected", file=sys.stderr)
        return False
    return all(step_holds(page, command, expected, folder, environment) for command, expected in steps)


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
    parser.add_argument("--only", metavar="PAGE", help="only the tour that has this page")
    parser.add_argument("--list", action="store_true", help="print the first page of each tour")
    options = parser.parse_args()
    build = options.build.resolve()
    programs = {folder: build / folder for folder in ("client/cli", "client/ros2", "server", "tests/support", "tests/support/ros2")}
    programs["scripts"] = ROOT / "tests/support"
    programs["backup"] = ROOT / "deploy/backup"
    environment = dict(os.environ, PATH=os.pathsep.join([*map(str, programs.values()), os.environ["PATH"]]))
    # Domains of DDS from 201 on are those of no test.
    own = {"STRATA_SERVER": free_address(), "ROS_LOCALHOST_ONLY": "1", "ROS_DOMAIN_ID": str(201 + os.getpid() % 30)}
    web = {"STRATA_SERVER": free_address(), "STRATA_WEB": free_address()}
    tours = [(["README.md"], {}), (TOUR, {"STRATA_SERVER": free_address()}), (["docs/exports.md"], {}), (["docs/command-line.md"], {}), (["docs/recordings.md"], {}),
             (["docs/explore.md", "docs/shapes.md"], {}), (["docs/surveys.md"], {}), (["docs/objects.md"], {}),
             (["docs/ros2.md"], own), (["docs/web.md"], web)]
    if options.list:
        print(*(tour[0] for tour, _ in tours), DATABASE_PAGE, sep="\n")
        return 0
    if options.only == DATABASE_PAGE:
        return 0 if page_with_database_holds(DATABASE_PAGE, environment) else 1
    if options.only:
        tours = [(tour, more) for tour, more in tours if options.only in tour]
    if not tours or not all(holds(tour, {**environment, **more}) for tour, more in tours):
        return 1
    return 0 if options.only or page_with_database_holds(DATABASE_PAGE, environment) else 1


sys.exit(main())
