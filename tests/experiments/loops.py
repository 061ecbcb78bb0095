#!/usr/bin/python3
"""Simulated loops with noisy odometry, closed without a hand: how far off, uploaded, after ingest and after optimize.

    tests/experiments/loops.py --build build/release [--seeds 1,2,3] [--only campus_loop,car_park,bridge] [--align on]

Drives the command line client on an embedded database, prints a table and exits 1 if a bound does not hold. The worlds
and robots are those of tests/support/simulator/worlds.h, the noise per step and axis is 0.03 m and 0.005 rad.

Each loop is optimized a second time with planted false closures: as many that they are 20 % of the closures that the
first run found and them together, and ten at least (alignment at ingest may have closed a loop already), imported as
constraints that may be false. The error may grow by half. Needs python3-numpy.
"""
import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np

from trajectory_error import ate

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
# world, robot that comes back to its start, bound of the error after optimize [m]
LOOPS = [("campus_loop", "loop", 0.10), ("car_park", "loop", 0.10), ("bridge", "eight", 0.10)]
FALSE_SHARE = 0.2  # of all closures
LEAST_FALSE = 10
FAR_M = 10.0       # scans farther apart have little in common


def positions(path):
    """x y z of a pose file; index-tum has a number before the time."""
    rows = [line.split() for line in open(path, encoding="utf-8") if line.strip() and not line.startswith("#")]
    return np.array([[float(v) for v in row[-7:-4]] for row in rows])


class Loop:
    """One robot's way through a simulated world, imported into a database of its own."""

    def __init__(self, build, work, world, robot, seed, align):
        self.cli, self.work, self.seed = build / "client/cli/strata", work, seed
        subprocess.run([build / "tests/support/strata-simulate", world, work / "world", "--seed", str(seed), "--robot",
                        robot, "--noise-m", "0.03", "--noise-rad", "0.005"], check=True, stdout=subprocess.DEVNULL)
        drive = work / "world" / robot
        self.truth = positions(drive / "poses_truth.txt")
        self.uploaded = ate(positions(drive / "poses_initial.txt"), self.truth)
        (work / "ingested").mkdir()
        self.strata("ingested", "map", "create", "world", "--cell-size", "0.1")
        self.strata("ingested", "scan", "import", "world", drive / "scans", "--poses", drive / "poses_initial.txt",
                    "--pose-format", "index-tum", "--align", align, "--wait")
        self.ingested = self.error("ingested")

    def strata(self, database, *arguments):
        done = subprocess.run([self.cli, "--embedded", self.work / database, "--output", "json", *map(str, arguments)],
                              check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        return json.loads(done.stdout) if done.stdout.strip() else None

    def error(self, database):
        self.strata(database, "pose", "export", "world", "--format", "tum", "--out", self.work / "poses.txt")
        return ate(positions(self.work / "poses.txt"), self.truth)

    def optimized(self, name, graph=None):
        """Error and metrics of a job on a copy of what was imported, with the edges of `graph` as doubtful ones."""
        shutil.copytree(self.work / "ingested", self.work / name)
        if graph:
            self.strata(name, "posegraph", "import", "world", graph, "--may-be-false")
        job = self.strata(name, "job", "start", "world", "optimize", "--wait")
        return self.error(name), job["metrics"]

    def false_closures(self, count):
        """A g2o file that says of pairs of scans that are FAR_M apart, drawn at random, that they are at one place.

        Each at an offset of its own: 1 m per axis, any heading, 0.05 m and 0.01 rad sure of it.
        """
        random = np.random.default_rng(self.seed)
        scans = self.strata("ingested", "scan", "list", "world")
        edges = set()
        while len(edges) < count:
            i, j = sorted(random.integers(len(scans), size=2).tolist())
            if np.linalg.norm(self.truth[i] - self.truth[j]) > FAR_M:
                edges.add((i, j))
        information = [0.0 if a != b else 1 / 0.05**2 if a < 3 else 4 / 0.01**2 for a in range(6) for b in range(a, 6)]
        path = self.work / "false.g2o"
        with open(path, "w", encoding="utf-8") as out:
            for node in sorted({node for edge in edges for node in edge}):
                print(f"# {node} {scans[node]['id']}", file=out)
            for i, j in sorted(edges):
                half = random.uniform(-np.pi, np.pi) / 2
                print("EDGE_SE3:QUAT", i, j, *random.standard_normal(3), 0, 0, np.sin(half), np.cos(half), *information,
                      file=out)
        return path


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--seeds", default="1")
    parser.add_argument("--only", default=",".join(loop[0] for loop in LOOPS))
    parser.add_argument("--align", default="on,off")
    options = parser.parse_args()
    bad = 0
    print("world        robot  seed align  uploaded  ingest  optimize  closures  planes  planted  rejected  optimize")
    for world, robot, bound in LOOPS:
        if world not in options.only.split(","):
            continue
        for seed in options.seeds.split(","):
            for align in options.align.split(","):
                with tempfile.TemporaryDirectory() as work:
                    loop = Loop(options.build.resolve(), pathlib.Path(work), world, robot, int(seed), align)
                    after, metrics = loop.optimized("clean")
                    planted = max(LEAST_FALSE, round(metrics["closures"] * FALSE_SHARE / (1 - FALSE_SHARE)))
                    misled, doubtful = loop.optimized("planted", loop.false_closures(planted))
                ok = after <= bound and misled <= 1.5 * after
                bad += not ok
                print(f"{world:12} {robot:6} {seed:>4} {align:5} {loop.uploaded:8.3f} {loop.ingested:7.3f} {after:9.3f}"
                      f" {metrics['closures']:9.0f} {metrics['planes']:7.0f} {planted:8}"
                      f" {doubtful['constraints_rejected']:9.0f} {misled:9.3f}"
                      f"  ≤ {bound}, × 1.5 {'ok' if ok else 'NOT REACHED'}", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
