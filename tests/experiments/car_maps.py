#!/usr/bin/python3
"""A car's drive of 2.3 km mapped: how far off its way is, and how large its map (thesis 10.3).

    tests/experiments/car_maps.py --build build/release [--only loops,memory] [--seed 1] [--step 4] [--data …]

`car record` simulates five loops among houses and trees on 300 × 250 m, with a garage and bridges without GPS and walls
that reflect it. `strata egomotion --smooth` makes of its log the poses that its scans, one every 4 m, are imported by:

    odometry  fixes of the first 30 s, then none; no priors
    gps       all fixes; a pose every 10 s with its covariance is a prior that may be false

loops: error of the way (ATE) uploaded, after ingest and after optimize. Ingest matches a scan to all around it, what was
there a loop ago too, so it closes loops by itself. For figure 10.4's comparison, odometry and local matching alone, each
100 m of the way are a map of their own, and their ways are put end to end. With closures the error is to be at most
0.3 m, and that of figure 10.4 at least five times as large.
memory: the table of 10.3 at cells of 0.5 m, beside the recorded campus: at most the thesis' bytes a cell.
Exits 1 where a bound does not hold, 77 where recorded data are asked for and absent. Needs python3-numpy.
"""
import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np

from real_data import ROOT, ate, load_tum

CAMPUS = "nclt_campus_loop"
CELL_M, SENSOR_M = 0.5, 1.8
LOCAL_M = 100.0
WITH_M, TIMES_WORSE = 0.3, 5.0
# clouds, points, cells of the area, share of them occupied, bytes of the map, bytes of the points
THESIS = {"thesis, 374 clouds": (374, 27_264_000, 300_000, 0.34, 55.16e6, 654.33e6),
          "thesis, 312 clouds": (312, 22_700_000, 200_300, 0.36, 17.15e6, 544.8e6)}
BOUND_BYTES = 55.16e6 / (0.34 * 300_000)  # a cell


def way_of(path):
    """T_map_scan by time [µs]."""
    return {round(1e6 * stamp): T for stamp, T in load_tum(path)}


class Maps:
    """Embedded databases in a folder, each with one map, "world"."""

    def __init__(self, build, work):
        self.build, self.work = build, work

    def run(self, *arguments):
        done = subprocess.run([self.build / "client/cli/strata", "--output", "json", *map(str, arguments)], check=True,
                              stdout=subprocess.PIPE, stderr=open(self.work / "strata.log", "a"), text=True)
        return json.loads(done.stdout) if done.stdout.strip() else None

    def __call__(self, database, *arguments):
        return self.run("--embedded", self.work / database, *arguments)

    def make(self, database, *scans_and_poses):
        (self.work / database).mkdir()
        self(database, "map", "create", "world", "--cell-size", CELL_M)
        return self(database, "scan", "import", "world", *scans_and_poses, "--trajectory", "car", "--wait")

    def way(self, database, which="current"):
        path = self.work / "way.txt"
        self(database, "pose", "export", "world", "--format", "tum", "--which", which, "--out", path)
        return way_of(path)


class Car:
    """The drive, and the maps of it."""

    def __init__(self, maps, seed, step_m):
        self.maps, self.drive, self.local_scans = maps, maps.work / "drive", round(LOCAL_M / step_m)
        done = subprocess.run([maps.build / "tests/experiments/car", "record", self.drive, str(seed), str(step_m)],
                              stdout=subprocess.PIPE, text=True)
        print(done.stdout.replace(str(maps.work), "…").rstrip(), flush=True)
        self.fixes_hold = done.returncode == 0
        self.truth = way_of(self.drive / "truth.txt")

    def make(self, name, log, priors):
        """A map of the scans at the poses that egomotion gives; what import said."""
        run = self.maps.work / f"{name}.csv"
        self.maps.run("egomotion", self.drive / log, "--out", run, "--rig", self.drive / "rig.yaml", "--smooth")
        if not priors:  # without an origin on earth poses are not known by themselves
            run.write_text("".join(line for line in open(run, encoding="utf-8") if not line.startswith("# origin")))
        return self.maps.make(name, self.drive / "scans", *self.placed(name))

    def placed(self, name):
        return "--poses", self.maps.work / f"{name}.csv", "--sensor", f"0,0,{SENSOR_M}"

    def error_of(self, way):
        return ate(*zip(*((way[time], self.truth[time]) for time in sorted(way))))

    def error(self, database, which="current"):
        return self.error_of(self.maps.way(database, which))

    def chained(self, name):
        """Error where a scan is matched to those of its own 100 m only; how many pieces there are."""
        scans, way, end = sorted((self.drive / "scans").iterdir()), {}, np.eye(4)
        pieces = range(0, len(scans) - 1, self.local_scans)
        for begin in pieces:
            piece = f"{name}_{begin}"
            self.maps.make(piece, *scans[begin:begin + self.local_scans + 1], *self.placed(name))
            local = self.maps.way(piece)
            shift = end @ np.linalg.inv(local[min(local)])
            way.update((time, shift @ T) for time, T in local.items())
            end = way[max(way)]
        return self.error_of(way), len(pieces)

    def optimized(self, name, copy, *parameters):
        """Error and metrics of a job on a copy."""
        shutil.copytree(self.maps.work / name, self.maps.work / copy)
        job = self.maps(copy, "job", "start", "world", "optimize", *parameters, "--wait")
        return self.error(copy), job


class Bounds:
    def __init__(self):
        self.failed = 0

    def expect(self, holds, what):
        self.failed += not holds
        print(f"{'holds' if holds else 'FAILS'}: {what}", flush=True)


def print_row(what, error, job=None):
    said = ""
    if job is not None:
        metrics = job["metrics"]
        said = f"{metrics.get('closures', 0):8.0f} {metrics.get('planes', 0):7.0f} {metrics.get('constraints_rejected', 0):9.0f}"
        said += "" if job["state"] == "succeeded" else f"  {job['state']}: {job.get('message', '')}"
    print(f"{what:64} {error:8.3f} {said}", flush=True)


def loops(car, bounds):
    print(f"{'':64} {'ATE [m]':>8} {'closures':>8} {'planes':>7} {'rejected':>9}")
    imported = car.make("odometry", "odometry", priors=False)
    print_row(f"odometry: uploaded, {imported['uploaded']} scans", car.error("odometry", "uploaded"))
    print_row(f"odometry: ingest, {imported['aligned']} aligned", car.error("odometry"))
    local, pieces = car.chained("odometry")
    print_row(f"odometry: matched to the same 100 m alone, {pieces} pieces", local)
    print_row("odometry: optimize without closures", *car.optimized("odometry", "without", "closures=0"))
    with_closures, job = car.optimized("odometry", "with")
    print_row("odometry: optimize with closures", with_closures, job)
    imported = car.make("gps", "log", priors=True)
    print_row(f"gps: uploaded, {imported['gps_priors']} priors", car.error("gps", "uploaded"))
    print_row(f"gps: ingest, {imported['aligned']} aligned", car.error("gps"))
    with_priors, job = car.optimized("gps", "priors")
    print_row("gps: optimize with closures and priors", with_priors, job)
    bounds.expect(with_closures <= WITH_M, f"with closures at most {WITH_M} m: {with_closures:.3f}")
    bounds.expect(with_priors <= WITH_M, f"with closures and priors at most {WITH_M} m: {with_priors:.3f}")
    bounds.expect(local >= TIMES_WORSE * with_closures,
                  f"odometry and local matching alone at least {TIMES_WORSE:.0f} times worse: {local / with_closures:.1f}")


# ---- memory ----

def print_memory(what, clouds, points, patches, area_cells, cells, map_bytes, point_bytes):
    print(f"{what:28} {clouds:6} {points:11,} {patches:>9} {area_cells:9,.0f} {100 * cells / area_cells:5.0f} % {cells:9,.0f} "
          f"{map_bytes / 1e6:9.2f} {map_bytes / cells:8.1f} {point_bytes / 1e6:9.2f} {point_bytes / points:7.1f}", flush=True)


def map_row(maps, database, what, bounds):
    stats = maps(database, "map", "show", "world")
    low, high = np.array(stats["box_min"]), np.array(stats["box_max"])
    area = float(np.prod(np.ceil((high - low)[:2] / CELL_M)))
    cells = stats["occupied_cells"]
    print_memory(what, stats["scans"], stats["points"], f"{stats['patches']:,}", area, cells, stats["tile_bytes"],
                 stats["point_bytes"])
    each = stats["tile_bytes"] / cells
    bounds.expect(stats["scans_failed"] == 0 and each < BOUND_BYTES,
                  f"{what}: {each:.1f} bytes a cell, less than the thesis' {BOUND_BYTES:.0f}")


def memory(maps, car, data, bounds):
    print(f"{'':28} {'clouds':>6} {'points':>11} {'patches':>9} {'of cells':>9} {'':>7} {'occupied':>9} {'map [MB]':>9} {'B a cell':>8} "
          f"{'points':>9} {'B each':>7}")
    for what, (clouds, points, area, share, map_bytes, point_bytes) in THESIS.items():
        print_memory(what, clouds, points, "–", area, share * area, map_bytes, point_bytes)
    if not (maps.work / "gps").exists():
        car.make("gps", "log", priors=True)
    map_row(maps, "priors" if (maps.work / "priors").exists() else "gps", "simulated car", bounds)
    if not (data / CAMPUS).exists():
        return 77
    maps.make("campus", data / CAMPUS / "scans", "--poses", data / CAMPUS / "poses_initial.txt", "--pose-format", "index-tum")
    map_row(maps, "campus", "recorded campus (NCLT)", bounds)
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--data", type=pathlib.Path,
                        default=pathlib.Path(os.environ.get("STRATA_DATA", ROOT.parent / "shared/data")))
    parser.add_argument("--only", default="loops,memory")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--step", type=float, default=4.0)
    options = parser.parse_args()
    bounds, absent = Bounds(), 0
    with tempfile.TemporaryDirectory() as work:
        maps = Maps(options.build.resolve(), pathlib.Path(work))
        car = Car(maps, options.seed, options.step)
        bounds.expect(car.fixes_hold, "bad fixes are rejected and good ones are not, see above")
        if "loops" in options.only.split(","):
            loops(car, bounds)
        if "memory" in options.only.split(","):
            absent = memory(maps, car, options.data, bounds)
    return 1 if bounds.failed else absent


if __name__ == "__main__":
    sys.exit(main())
