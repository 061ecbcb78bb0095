#!/usr/bin/python3
"""Simulated loops with noisy odometry, closed without a hand: how far off, uploaded, after ingest and after optimize.

    tests/experiments/loops.py --build build/release [--seeds 1,2,3] [--only campus_loop,car_park,bridge]

Drives the command line client on an embedded database, prints a table and exits 1 if a bound does not hold. The worlds
and robots are those of tests/support/worlds.h, the noise per step and axis is 0.03 m and 0.005 rad. Needs
python3-numpy.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
# world, robot that comes back to its start, bound of the error after optimize [m]
LOOPS = [("campus_loop", "loop", 0.10), ("car_park", "loop", 0.10), ("bridge", "eight", 0.10)]


def positions(path):
    """x y z of a pose file; index-tum has a number before the time."""
    rows = [line.split() for line in open(path, encoding="utf-8") if line.strip() and not line.startswith("#")]
    return np.array([[float(v) for v in row[-7:-4]] for row in rows])


def ate(estimate, truth):
    """RMSE [m] after rigid alignment (Umeyama without scale)."""
    e, g = estimate - estimate.mean(0), truth - truth.mean(0)
    U, _, Vt = np.linalg.svd(g.T @ e)
    R = U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return float(np.sqrt((np.linalg.norm(g - e @ R.T, axis=1) ** 2).mean()))


def run_loop(build, world, robot, seed, align):
    with tempfile.TemporaryDirectory() as scratch:
        work = pathlib.Path(scratch)
        subprocess.run([build / "tests/support/strata-simulate", world, work / "world", "--seed", str(seed), "--robot",
                        robot, "--noise-m", "0.03", "--noise-rad", "0.005"], check=True, stdout=subprocess.DEVNULL)
        drive = work / "world" / robot
        (work / "db").mkdir()

        def strata(*arguments):
            done = subprocess.run([build / "client/cli/strata", "--embedded", work / "db", "--output", "json",
                                   *map(str, arguments)], check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            return json.loads(done.stdout) if done.stdout.strip() else None

        def error():
            strata("pose", "export", "world", "--format", "tum", "--out", work / "poses.txt")
            return ate(positions(work / "poses.txt"), truth)

        truth = positions(drive / "poses_truth.txt")
        strata("map", "create", "world", "--cell-size", "0.1")
        strata("scan", "import", "world", drive / "scans", "--poses", drive / "poses_initial.txt", "--pose-format",
               "index-tum", "--align", align, "--wait")
        uploaded, ingested = ate(positions(drive / "poses_initial.txt"), truth), error()
        job = strata("job", "start", "world", "optimize", "--wait")
        return uploaded, ingested, error(), job["metrics"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--seeds", default="1")
    parser.add_argument("--only", default=",".join(loop[0] for loop in LOOPS))
    options = parser.parse_args()
    bad = 0
    print("world        robot  seed align  uploaded  ingest  optimize  closures  planes")
    for world, robot, bound in LOOPS:
        if world not in options.only.split(","):
            continue
        for seed in options.seeds.split(","):
            for align in ("on", "off"):
                uploaded, ingested, after, metrics = run_loop(options.build.resolve(), world, robot, seed, align)
                ok = after <= bound
                bad += not ok
                print(f"{world:12} {robot:6} {seed:>4} {align:5} {uploaded:8.3f} {ingested:7.3f} {after:9.3f}"
                      f" {metrics['closures']:9.0f} {metrics['planes']:7.0f}  ≤ {bound} {'ok' if ok else 'NOT REACHED'}",
                      flush=True)
    return 1 if bad else 0


sys.exit(main())
