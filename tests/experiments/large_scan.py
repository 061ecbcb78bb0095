#!/usr/bin/python3
"""One scan of two gigabytes: how much memory does stratad take to receive and to integrate it?

    tests/experiments/large_scan.py --build build/release [--points 170000000] [--limit-mb 256] [--seed 1] [--align]
                                    [-- STRATAD OPTIONS]

Points of a yard of 120 m with walls and boxes are drawn and sent piece by piece, so that the client never has them all.
--align registers the scan to a small one that was there before. A row a step: how long it took and the peak of the
resident set (VmHWM, begun anew at every step). Exits 1 where a peak is above --limit-mb or the scan does not reach the
map. Needs python3-grpcio and python3-numpy.
"""
import argparse
import pathlib
import resource
import sys
import tempfile
import time

import numpy as np

from stratad import Stratad

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
MAP, CHUNK = "yard", 40_000


def points(random, count):
    """(count, 3) float32: ground with boxes on it, and a wall around."""
    xyz = np.empty((count, 3), np.float32)
    xyz[:, :2] = random.uniform(-60, 60, (count, 2))
    xyz[:, 2] = np.where((np.mod(xyz[:, :2], 15) < 3).all(axis=1), 1.5, 0)
    wall = random.random(count) < 0.2
    xyz[wall, 0] = 60
    xyz[wall, 2] = random.uniform(0, 5, np.count_nonzero(wall))
    return xyz + random.normal(0, 0.01, xyz.shape).astype(np.float32)


def messages(seed, sequence, count, align):
    from strata.v1 import scans_pb2
    random = np.random.default_rng(seed)
    header = scans_pb2.ScanHeader(id=scans_pb2.ScanId(trajectory="scanner", sequence=sequence), point_count=count,
                                  alignment=scans_pb2.ALIGNMENT_ON if align else scans_pb2.ALIGNMENT_OFF)
    yield scans_pb2.UploadScanRequest(start=scans_pb2.ScanStart(map=MAP, header=header))
    for begin in range(0, count, CHUNK):
        piece = points(random, min(CHUNK, count - begin))
        yield scans_pb2.UploadScanRequest(chunk=scans_pb2.PointChunk(xyz=piece.tobytes()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--points", type=int, default=170_000_000)
    parser.add_argument("--limit-mb", type=float, default=256)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--align", action="store_true")
    parser.add_argument("stratad", nargs="*", help="options of the server")
    options = parser.parse_args()
    build = options.build.resolve()
    sys.path.append(str(build / "client/python"))
    import strata
    from strata.blocking import run
    print(f"seed {options.seed}", file=sys.stderr)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        server = Stratad(build, folder, "--max-scan-points", 10**9, *options.stratad)
        with strata.connect(server.address, patience=600) as db:
            world = db.create_map(MAP)

            def send(sequence, count):
                calls = world._asynchronous
                run(calls._connection.send(calls._scans.Upload,
                                           messages(options.seed + sequence, sequence, count, options.align)))

            def step(name, body):
                server.forget_peak()
                begun = time.monotonic()
                body()
                rows.append((name, time.monotonic() - begun, server.peak_mb()))
                print(f"{rows[-1][0]}: {rows[-1][1]:.0f} s, {rows[-1][2]:.0f} MB", file=sys.stderr, flush=True)

            step("small scan", lambda: (send(1, 200_000), world.wait()))
            step("upload", lambda: send(2, options.points))
            step("integration", world.wait)
            stats = world.stats()
        file_mb = sum(path.stat().st_size for path in pathlib.Path(folder).glob(f"{MAP}*")) / 2**20
        server.stop()
    print(f"{options.points} points, {12 * options.points / 1e9:.2f} GB as sent, {file_mb:.0f} MB as a file with "
          f"{stats.patches} patches")
    print(f"{'step':<14}{'s':>8}{'peak MB':>9}")
    for name, seconds, peak in rows:
        print(f"{name:<14}{seconds:>8.1f}{peak:>9.0f}")
    print(f"the client took {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    good = stats.scans == 2 and stats.scans_failed == 0 and all(peak <= options.limit_mb for _, _, peak in rows)
    print(f"bound {options.limit_mb:.0f} MB: {'held' if good else 'not held'}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
