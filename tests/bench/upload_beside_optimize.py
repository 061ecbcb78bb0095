#!/usr/bin/python3
"""How fast scans are uploaded beside an optimiser on another core: the rate with it over the rate without.

    tests/bench/upload_beside_optimize.py --build build/release [--pairs 5] [--base 90] [--scans 60] [--repeats 5]

The optimiser's threads (`job`, and those it starts) are pinned to one core, all other threads of a real stratad and the
client to another, in all cases. Every run begins with a copy of one map, and runs with and without take turns; the
medians are compared. It says nothing unless the optimiser gets most of its core (the last column), so nothing else may
run on the machine; the CPU time that the upload's core spends on a million points suffers less from others and is
printed beside the rates. Exits 1 below the bound.
"""
import argparse
import json
import os
import pathlib
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BOUND = 0.8
JOBS = 40  # one after the other, more than a run has time for
# What runs beside the upload: nothing; jobs that compute all the time; jobs that also wait for the thread that
# integrates scans and have it make their epochs, on the upload's core.
CASES = {"without": None, "computing": ["dry_run=1"], "epochs": []}
OPTIMIZER_CORE, UPLOAD_CORE = sorted(os.sched_getaffinity(0))[:2]


class Server:
    """stratad on a folder; its threads where they belong."""

    def __init__(self, build, data):
        self.build = build
        self.process = subprocess.Popen(
            [build / "server/stratad", "--data", data, "--listen", "127.0.0.1:0", "--optimize-every", "0"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.address = self.process.stdout.readline().split()[1]

    def strata(self, *arguments):
        done = subprocess.run(
            [self.build / "client/cli/strata", "--server", self.address, "--output", "json", *map(str, arguments)],
            check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            preexec_fn=lambda: os.sched_setaffinity(0, {UPLOAD_CORE}))
        return json.loads(done.stdout)

    def pin(self):
        """Threads to come inherit their core from those that start them."""
        tasks = pathlib.Path(f"/proc/{self.process.pid}/task")
        for task in tasks.iterdir():
            name = (task / "comm").read_text().strip()
            os.sched_setaffinity(int(task.name), {OPTIMIZER_CORE if name == "job" else UPLOAD_CORE})

    def cpu_seconds(self):
        """Of the optimiser's thread, and of the whole process."""
        hertz = os.sysconf("SC_CLK_TCK")
        ticks = {}
        for task in [pathlib.Path(f"/proc/{self.process.pid}"),
                     *pathlib.Path(f"/proc/{self.process.pid}/task").iterdir()]:
            name, _, rest = (task / "stat").read_text().partition("(")[2].rpartition(")")
            ticks[name] = ticks.get(name, 0) + sum(map(int, rest.split()[11:13]))
            if "task" not in task.parts:
                whole = ticks.pop(name)
        return ticks.get("job", 0) / hertz, whole / hertz

    def stop(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


def run(options, drive, base, wait, job_parameters):
    """Of some imports: points a second; the optimiser's CPU seconds a second; the others' a million points."""
    with tempfile.TemporaryDirectory() as scratch:
        data = pathlib.Path(scratch) / "maps"
        shutil.copytree(base, data)
        server = Server(options.build, data)
        try:
            server.strata("map", "show", "world")  # opens it
            server.pin()
            if job_parameters is not None:
                for _ in range(JOBS):
                    server.strata("job", "start", "world", "optimize", "rounds=20", "threads=1", *job_parameters)
                while server.cpu_seconds()[0] < 0.3:
                    time.sleep(0.05)
            job_before, all_before = server.cpu_seconds()
            client_before, begun = os.times(), time.monotonic()
            imports = [server.strata("scan", "import", "world", drive / "some", "--poses", drive / "poses_initial.txt",
                                     "--pose-format", "index-tum", "--trajectory", f"more{k}", "--align", options.align,
                                     *(["--wait"] if wait else []))
                       for k in range(1 if wait else options.repeats)]
            seconds = time.monotonic() - begun
            client = os.times()
            job, everything = server.cpu_seconds()
            job, everything = job - job_before, everything - all_before
            others = everything - job + (client.children_user - client_before.children_user +
                                         client.children_system - client_before.children_system)
        finally:
            server.stop()
        points = sum(done["points"] for done in imports)
        return points / seconds, job / seconds, others / points * 1e6


def make_base(options, drive, base):
    base.mkdir()
    server = Server(options.build, base)
    server.strata("map", "create", "world")
    for name, count in (("first", options.base), ("some", options.scans)):
        (drive / name).mkdir()
        for scan in sorted((drive / "scans").iterdir())[:count]:
            (drive / name / scan.name).symlink_to(scan)
    server.strata("scan", "import", "world", drive / "first", "--poses", drive / "poses_initial.txt", "--pose-format",
                  "index-tum", "--trajectory", "first", "--align", "off", "--wait")
    server.process.terminate()
    server.process.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--pairs", type=int, default=5, help="runs with and without the optimiser")
    parser.add_argument("--base", type=int, default=90, help="scans that are optimised")
    parser.add_argument("--scans", type=int, default=60, help="scans that are uploaded meanwhile")
    parser.add_argument("--repeats", type=int, default=5, help="uploads of them, where nothing is waited for")
    parser.add_argument("--align", default="on")
    options = parser.parse_args()
    options.build = options.build.resolve()
    bad = 0
    with tempfile.TemporaryDirectory() as scratch:
        work = pathlib.Path(scratch)
        subprocess.run([options.build / "tests/support/strata-simulate", "campus_loop", work / "world",
                        "--robot", "loop", "--step", "2"], check=True, stdout=subprocess.DEVNULL)
        drive, base = work / "world/loop", work / "base"
        make_base(options, drive, base)
        print(f"optimiser on core {OPTIMIZER_CORE}, server and client on core {UPLOAD_CORE}; {options.base} scans are"
              f" optimised, {options.scans} uploaded; load {os.getloadavg()[0]:.1f}")
        for wait in (False, True):
            runs = {case: [] for case in CASES}
            for _ in range(options.pairs):
                for case in CASES:
                    runs[case].append(run(options, drive, base, wait, CASES[case]))
            print("integrated" if wait else "acknowledged", flush=True)
            for case, results in runs.items():
                rate, busy, cost = map(statistics.median, zip(*results))
                if CASES[case] is None:
                    rate_without, cost_without = rate, cost
                bad += rate < BOUND * rate_without
                each = " ".join(f"{rate / 1e6:.2f}" for rate, _, _ in results)
                print(f"  {case:9} {rate / 1e6:6.3f} million points/s (×{rate / rate_without:.2f}),"
                      f" {cost:.2f} CPU s a million (×{cost / cost_without:.2f}),"
                      f" optimiser {busy:4.0%} of a core; {each}", flush=True)
    return 1 if bad else 0


sys.exit(main())
