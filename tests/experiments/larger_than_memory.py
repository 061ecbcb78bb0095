#!/usr/bin/python3
"""A map larger than memory: made, opened, served, planned on, verified and backed up. How much memory does stratad take?

    tests/experiments/larger_than_memory.py --build build/release [--data ../shared/data] [--out /tmp/big] [--file-mb 4096]
                                            [--limit-mb 512] [--keep] [--seed 1] [-- STRATAD OPTIONS]

Scans recorded in a street, pooled, are uploaded over and over, each time where the one before ended, until the map's file
has the size asked for. An OUT that holds such a map already is taken as it is (--keep leaves it). Every step is a row: how
long it took and the peak of the resident set (VmHWM, begun anew at every step). Exits 1 where a peak is above --limit-mb
or a step fails, 77 where the data are absent. Needs python3-grpcio and python3-numpy.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import threading
import time

import numpy as np

from real_data import ROOT, load_poses
from stratad import Stratad

MAP = "street"
STREET = "kitti_city_drive"
AREA_READS, PLANS, REACH = 200, 20, 20
CAR_M, CAR_TOP_M = 1.5, -1.65  # what stood beside and above the sensor's way cannot have stayed: the car went through


def read_pcd(path):
    """(n, 3) float32 of a binary PCD with fields x y z …, all 4-byte floats."""
    raw = path.read_bytes()
    header, _, body = raw.partition(b"DATA binary\n")
    fields = next(line for line in header.decode().splitlines() if line.startswith("FIELDS")).split()[1:]
    rows = np.frombuffer(body, "<f4", count=len(body) // (4 * len(fields)) * len(fields)).reshape(-1, len(fields))
    return rows[np.isfinite(rows[:, :3]).all(axis=1), :3]


def upright(T):
    """The transform's translation and its turn about z."""
    yaw = np.arctan2(T[1, 0], T[0, 0])
    U = np.eye(4)
    U[:2, :2] = (np.cos(yaw), -np.sin(yaw)), (np.sin(yaw), np.cos(yaw))
    U[:3, 3] = T[:3, 3]
    return U


class Street:
    """Scans pooled from where the drive began to where it ended, and what of them lies between: piece after piece, every
    other one mirrored so that the bends cancel, makes one street that can be driven along."""

    def __init__(self, data):
        folder = data / STREET
        poses = {i: T for i, (_, T) in load_poses(folder / "poses_reference_icp.txt").items()}
        end = upright(poses[max(poses)])
        scans = [read_pcd(folder / "scans" / f"{i:03d}.pcd") @ T[:3, :3].T + T[:3, 3] for i, T in poses.items()]
        points = np.concatenate(scans)
        behind = (points - end[:3, 3]) @ end[:3, 0] < 0
        drivable = np.ones(len(points), bool)
        for T in poses.values():
            rest = points - T[:3, 3]
            drivable &= (np.linalg.norm(rest[:, :2], axis=1) > CAR_M) | (rest[:, 2] < CAR_TOP_M)
        points = points[(points[:, 0] >= 0) & behind & drivable].astype(np.float32)
        mirror = np.diag([1.0, -1.0, 1.0, 1.0])
        self.pieces = [points, points * np.float32((1, -1, 1))]
        self.steps = [end, mirror @ end @ mirror]
        self.poses = [np.eye(4)]

    def points(self, n):
        return self.pieces[n % 2]

    def pose(self, n):
        """T_map_scan of upload n: where the car was when it came into the piece."""
        while len(self.poses) <= n:
            self.poses.append(self.poses[-1] @ self.steps[(len(self.poses) - 1) % 2])
        return self.poses[n]


def file_mb(out):
    return sum(path.stat().st_size for path in out.glob(f"{MAP}.strata*")) / 2**20


def upload(world, street, first, count=None, until=lambda: False):
    """Uploads from number `first` on; returns the next number."""
    n = first
    while (count is None or n < first + count) and not until():
        world.upload(street.points(n), street.pose(n), trajectory="car", sequence=n + 1, align=False)
        n += 1
    return n


def make(db, out, street, mb):
    world = db.create_map(MAP)
    n, begun = 0, time.monotonic()
    while file_mb(out) < mb:
        n = upload(world, street, n, 10)
        world.wait()
        rate = n / (time.monotonic() - begun)
        print(f"\r{n} scans, {file_mb(out):.0f} of {mb} MB, {rate:.1f} scans/s ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return f"{n} scans, {world.stats().patches} patches, {file_mb(out):.0f} MB"


def fetch(world, area, level=0):
    """(tiles, bytes): decoding would measure this program."""
    from strata.blocking import iterate
    from strata.v1 import tiles_pb2
    calls = world._asynchronous
    request = tiles_pb2.FetchTilesRequest(map=MAP, area=calls._area(area, level))
    sizes = [len(answer.tile.bytes) for answer in iterate(calls._connection.stream(calls._tiles.Fetch, request))]
    return len(sizes), sum(sizes)


def fetch_all(world):
    fetched = [fetch(world, None, level) for level in (0, 1, 4)]
    return f"{sum(tiles for tiles, _ in fetched)} tiles, {sum(size for _, size in fetched) / 2**20:.0f} MB"


def read_areas(world, street, scans, random):
    took, tiles = [], 0
    for n in random.integers(0, scans, AREA_READS):
        x, y = street.pose(int(n))[:2, 3]
        begun = time.monotonic()
        tiles += fetch(world, (x - 40, y - 40, x + 40, y + 40))[0]
        took.append(time.monotonic() - begun)
    return f"{AREA_READS} areas of 80 m, {tiles} tiles, p50 {1e3 * np.median(took):.0f} ms, max {1e3 * max(took):.0f} ms"


def stand(world, place):
    """Where a robot can stand near a place: there are no returns from below a car."""
    nearest = world.plan(place, place).nearest
    return place if nearest is None else nearest


def pairs(random, scans):
    """Where plans begin and end: up to half a kilometre of street apart, anywhere in the map."""
    starts = random.integers(0, scans, PLANS)
    return np.column_stack([starts, np.clip(starts + random.integers(-REACH, REACH + 1, PLANS), 0, scans - 1)])


def plan_along(world, street, ends):
    took, found, metres = [], 0, 0.0
    for a, b in ends:
        start, goal = (stand(world, street.pose(int(n))[:2, 3]) for n in (a, b))
        begun = time.monotonic()
        path = world.plan(start, goal)
        took.append(time.monotonic() - begun)
        found += bool(path)
        metres += path.length
    return (f"{found} of {len(took)} found, {metres / max(found, 1):.0f} m on average, p50 {np.median(took):.2f} s, "
            f"max {max(took):.2f} s")


def backup(build, out, server):
    copy = out / "copy.backup"
    copy.unlink(missing_ok=True)
    subprocess.run([build / "client/cli/strata", "--server", server.address, "map", "backup", MAP, copy], check=True,
                   stdout=subprocess.DEVNULL)
    size = copy.stat().st_size
    copy.unlink()
    return f"{size / 2**20:.0f} MB"


def everything(world, street, scans, random):
    """Uploads, area reads and plans at the same time."""
    told, failed = {}, []

    def run(name, body):
        try:
            told[name] = body()
        except Exception as error:  # pylint: disable=broad-except
            failed.append(f"{name}: {error}")

    threads = [threading.Thread(target=run, args=item) for item in (
        ("upload", lambda: upload(world, street, scans, 10)),
        ("areas", lambda: read_areas(world, street, scans, np.random.default_rng(random.integers(1 << 30)))),
        ("plans", lambda: plan_along(world, street, pairs(random, scans))))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    world.wait()
    if failed:
        raise RuntimeError("; ".join(failed))
    return f"10 scans more; {told['areas']}; {told['plans']}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--data", type=pathlib.Path, default=pathlib.Path(
        os.environ.get("STRATA_DATA", ROOT / "../shared/data")))
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("/tmp/big"))
    parser.add_argument("--file-mb", type=int, default=4096)
    parser.add_argument("--limit-mb", type=float, default=512)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--only", help="steps, comma-separated")
    parser.add_argument("stratad", nargs="*", help="options of the server")
    options = parser.parse_args()
    if not (options.data / STREET).is_dir():
        print(f"{options.data / STREET} is not there", file=sys.stderr)
        return 77
    build = options.build.resolve()
    sys.path.append(str(build / "client/python"))
    import strata
    options.out.mkdir(parents=True, exist_ok=True)
    print(f"seed {options.seed}", file=sys.stderr)
    street = Street(options.data)
    rows = []

    def step(server, name, body):
        if options.only and name not in options.only.split(","):
            return
        server.forget_peak()
        begun = time.monotonic()
        try:
            what = body()
        except Exception as error:  # pylint: disable=broad-except
            what = f"FAILED: {type(error).__name__}: {error}"
        rows.append({"step": name, "seconds": round(time.monotonic() - begun, 1), "peak_mb": round(server.peak_mb()),
                     "what": what, "failed": str(what).startswith("FAILED")})
        print(json.dumps(rows[-1]), file=sys.stderr, flush=True)

    if not (options.out / f"{MAP}.strata").exists():
        server = Stratad(build, options.out, *options.stratad)
        with strata.connect(server.address) as db:
            step(server, "make", lambda: make(db, options.out, street, options.file_mb))
        server.stop()
    server = Stratad(build, options.out, *options.stratad)
    with strata.connect(server.address, patience=600) as db:
        rows.append({"step": "open", "seconds": round(server.opened_s, 2), "peak_mb": round(server.peak_mb()),
                     "what": f"{file_mb(options.out):.0f} MB", "failed": False})
        world = db.map(MAP)
        scans = world.last_sequence("car")
        random = np.random.default_rng(options.seed)
        step(server, "stats", lambda: str(world.stats().patches) + " patches")
        step(server, "fetch all", lambda: fetch_all(world))
        step(server, "areas", lambda: read_areas(world, street, scans, random))
        step(server, "plans", lambda: plan_along(world, street, pairs(random, scans)))
        step(server, "all at once", lambda: everything(world, street, scans, random))
        step(server, "backup", lambda: backup(build, options.out, server))
        step(server, "verify", lambda: world.job("verify").message)
    server.stop()
    if not options.keep:
        for path in options.out.glob(f"{MAP}.strata*"):
            path.unlink()
    print(f"{'step':<14}{'s':>8}{'peak MB':>9}  what")
    for row in rows:
        print(f"{row['step']:<14}{row['seconds']:>8}{row['peak_mb']:>9}  {row['what']}")
    bad = [row["step"] for row in rows if row["failed"] or row["peak_mb"] > options.limit_mb]
    print(f"bound {options.limit_mb:.0f} MB: " + (f"not held by {', '.join(bad)}" if bad else "held by every step"))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
