#!/usr/bin/python3
"""A server under everything at once for minutes: does memory or latency grow beyond what the data's growth explains?

    tests/bench/endurance.py --build build/release [--minutes 10] [--robots 8] [--readers 4] [--planners 2] [--step-s 30]

A real stratad in a folder of its own. Robots upload scans of a floor with boxes as fast as they are acknowledged, over
and over the same square, so that the map's content stops growing soon and its scans go on; readers fetch what changed;
planners ask for paths; all in processes of their own. Every step prints what the server holds and how long calls took.
Two numbers are judged, of the second half of the run against the first: the slope of the resident set (above what the
points of pending scans explain) and the 95th percentiles of latency. Exits 1 where the resident set grows by more than
10 % or 32 MB, whichever is larger, or a percentile doubles (and grows by more than 20 ms).
"""
import argparse
import multiprocessing
import os
import pathlib
import queue
import subprocess
import sys
import tempfile
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
HALF_M = 40.0  # of the square
MAP = "world"
KINDS = ("upload", "fetch", "plan")


def scan_at(random, x, y):
    """(n, 3) points of a floor with boxes within 12 m of a robot at (x, y), in its frame, 1 m above the floor."""
    polar = random.uniform((0.5, 0), (12, 2 * np.pi), (12_000, 2))
    seen = np.stack([polar[:, 0] * np.cos(polar[:, 1]), polar[:, 0] * np.sin(polar[:, 1])], axis=1)
    on_box = (np.mod(seen + (x, y), 9.0) < 1.5).all(axis=1)
    z = np.where(on_box, 0.8, 0.0) + random.normal(0, 0.01, len(seen)) - 1.0
    return np.column_stack([seen, z]).astype(np.float32)


def robot(world, seed, tell):
    random = np.random.default_rng(seed)
    while True:
        x, y = random.uniform(-HALF_M, HALF_M, 2)
        points = scan_at(random, x, y)
        begun = time.monotonic()
        world.upload(points, ([x, y, 1], [0, 0, 0, 1]), trajectory=f"robot{seed}", align=False)
        tell("upload", begun)


def reader(world, seed, tell):
    held = {}  # versions only: decoding would measure this program
    from strata.blocking import iterate
    from strata.v1 import tiles_pb2
    calls = world._asynchronous
    while True:
        request = tiles_pb2.FetchTilesRequest(map=MAP, held=held.values())
        begun = time.monotonic()
        for answer in iterate(calls._connection.stream(calls._tiles.Fetch, request)):
            held[answer.tile.key.SerializeToString()] = tiles_pb2.HeldTile(key=answer.tile.key,
                                                                          version=answer.tile.version)
        tell("fetch", begun)


def planner(world, seed, tell):
    random = np.random.default_rng(seed)
    while True:
        start, goal = random.uniform(-HALF_M, HALF_M, (2, 2))
        begun = time.monotonic()
        world.plan(start, goal)
        tell("plan", begun)


def work(role, build, address, seed, told, over):
    sys.path.append(str(build / "client/python"))
    import strata

    class Over(Exception):
        pass

    def tell(kind, begun):
        told.put((kind, time.monotonic() - begun))
        if over.is_set():
            raise Over

    with strata.connect(address) as db:
        try:
            {"robot": robot, "reader": reader, "planner": planner}[role](db.map(MAP), seed, tell)
        except Over:
            pass
    told.cancel_join_thread()


def kilobytes(pid, field):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(f"{field}:"):
            return int(line.split()[1])
    raise KeyError(field)


def step(told, seconds):
    """Latencies by kind [s] of what ended in the next seconds."""
    latencies = {kind: [] for kind in KINDS}
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        try:
            kind, took = told.get(timeout=left)
            latencies[kind].append(took)
        except queue.Empty:
            pass
    return latencies


def judge(rows):
    """Complaints about the second half against the first; the first quarter is warming up."""
    rows = rows[len(rows) // 4:]
    if len(rows) < 4:
        return ["too few steps to judge"]
    first, second = rows[:len(rows) // 2], rows[len(rows) // 2:]
    complaints = []

    def medians(value):
        return (float(np.median([value(row) for row in half])) for half in (first, second))

    before, after = medians(lambda row: row["rss_mb"])
    if after - before > max(0.1 * before, 32):
        complaints.append(f"the resident set grows from {before:.0f} to {after:.0f} MB")
    for kind in KINDS:
        before, after = medians(lambda row: row[f"{kind}_ms"])
        if after > 2 * before and after - before > 20:
            complaints.append(f"p95 of {kind} grows from {before:.0f} to {after:.0f} ms")
    return complaints


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--robots", type=int, default=8)
    parser.add_argument("--readers", type=int, default=4)
    parser.add_argument("--planners", type=int, default=2)
    parser.add_argument("--step-s", type=float, default=30)
    options = parser.parse_args()
    build = options.build.resolve()
    sys.path.append(str(build / "client/python"))
    multiprocessing.set_start_method("spawn")  # gRPC does not outlive a fork
    with tempfile.TemporaryDirectory() as folder, subprocess.Popen(
            [build / "server/stratad", "--data", folder, "--listen", "127.0.0.1:0"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        workers = []
        over = multiprocessing.Event()
        try:
            address = server.stdout.readline().split()[1]
            import strata
            db = strata.connect(address)
            world = db.create_map(MAP)
            world.upload(scan_at(np.random.default_rng(0), 0, 0), ([0, 0, 1], [0, 0, 0, 1]), align=False)
            world.wait()
            told = multiprocessing.Queue()
            for role, count in (("robot", options.robots), ("reader", options.readers), ("planner", options.planners)):
                for i in range(count):
                    workers.append(multiprocessing.Process(target=work, daemon=True, args=(
                        role, build, address, i + 1, told, over)))
                    workers[-1].start()
            rows = []
            print("   min   scans pending    file MB   RSS MB threads " +
                  " ".join(f"{kind + '/s':>9} p50 ms p95 ms" for kind in KINDS))
            begun = time.monotonic()
            while time.monotonic() - begun < 60 * options.minutes:
                latencies = step(told, options.step_s)
                stats = world.stats()
                row = {"rss_mb": kilobytes(server.pid, "VmRSS") / 1024}
                file_mb = sum(file.stat().st_size for file in pathlib.Path(folder).iterdir()) / 1e6
                cells = []
                for kind in KINDS:
                    took = np.array(latencies[kind] or [np.nan]) * 1e3
                    row[f"{kind}_ms"] = np.percentile(took, 95)
                    cells.append(f"{len(latencies[kind]) / options.step_s:9.1f} {np.median(took):6.0f}"
                                 f" {row[f'{kind}_ms']:6.0f}")
                rows.append(row)
                print(f"{(time.monotonic() - begun) / 60:6.1f} {stats.scans:7} {stats.scans_pending:7} {file_mb:10.1f}"
                      f" {row['rss_mb']:8.1f} {kilobytes(server.pid, 'Threads'):7} " + " ".join(cells), flush=True)
            over.set()
            print(f"peak {kilobytes(server.pid, 'VmHWM') / 1024:.0f} MB")
            dead = [worker for worker in workers if worker.exitcode not in (None, 0)]
            complaints = judge(rows) + [f"{len(dead)} workers ended by themselves"] * bool(dead)
            db.close()
        finally:
            over.set()
            deadline = time.monotonic() + 10
            for worker in workers:
                worker.join(max(0.1, deadline - time.monotonic()))
                if worker.is_alive():
                    worker.terminate()
            server.terminate()
    print("\n".join(complaints) or "no growth beyond the data's own")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
