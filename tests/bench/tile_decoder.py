#!/usr/bin/python3
"""Surfaces a second out of served tiles in Python: by the library, by numpy, and by two peers that do less.

    tests/bench/tile_decoder.py --build build/release [--data ../shared/data] [--repeats 7] [--smoke]

The peers get rows of the same surfaces: numpy.frombuffer of them as they are and one copy, which is the physical limit, and the
same out of zstd 3, which is what a plain program would send. All take turns; the least times count. NCLT's scans at reference
poses, or with --smoke a simulated bridge, and then nothing is held but that all say the same. Else exits 1 below 2 M surfaces/s
by the library, 77 where the data are absent. Needs python3-numpy, -grpcio, -zstandard, -xxhash.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import zstandard

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.append(str(ROOT / "tests/experiments"))
from stratad import Stratad  # noqa: E402  pylint: disable=wrong-import-position

BOUND_PER_S = 2e6
CELL_M = 0.1


def nclt(data):
    """Scans, poses, their format."""
    folder = data / "nclt_campus_loop"
    return folder / "scans", folder / "poses_reference.txt", None


def bridge(build, folder):
    subprocess.run([build / "tests/support/strata-simulate", "bridge", folder, "--step", "4"], check=True,
                   stdout=subprocess.DEVNULL)
    return folder / "over/scans", folder / "over/poses_initial.txt", "index-tum"


def tiles_of(build, folder, scans, poses, pose_format):
    """The tiles as served."""
    import strata
    from strata.v1 import tiles_pb2, tiles_pb2_grpc
    server = Stratad(build, folder)
    try:
        with strata.connect(server.address) as db:
            world = db.create_map("world", cell_size=CELL_M)
            subprocess.run([build / "client/cli/strata", "--server", server.address, "scan", "import", "world", scans, "--poses",
                            poses, *(["--pose-format", pose_format] if pose_format else []), "--align", "off", "--wait"],
                           check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            world.wait()
            stub = tiles_pb2_grpc.TilesStub(db.channel)
            return [answer.tile.bytes for answer in stub.Fetch(tiles_pb2.FetchTilesRequest(map="world"))]
    finally:
        server.stop()


def best_seconds(ways, repeats):
    """By name, the least of `repeats` runs that take turns."""
    best = dict.fromkeys(ways, float("inf"))
    for _ in range(repeats):
        for name, way in ways.items():
            begun = time.perf_counter()
            way()
            best[name] = min(best[name], time.perf_counter() - begun)
    return best


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--data", type=pathlib.Path, default=ROOT.parent / "shared/data")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--smoke", action="store_true")
    options = parser.parse_args()
    build = options.build.resolve()
    sys.path.insert(0, str(build / "client/python"))
    from strata import SURFACE, decode_tile, native, tiles
    if not options.smoke and not options.data.exists():
        sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        source = bridge(build, folder / "bridge") if options.smoke else nclt(options.data)
        (folder / "maps").mkdir()
        encoded = tiles_of(build, folder / "maps", *source)
    assert native.LIBRARY is not None, "the library is not built"
    decoded = [decode_tile(blob, CELL_M).surfaces for blob in encoded]
    for blob, surfaces in zip(encoded, decoded):
        np.testing.assert_array_equal(tiles.decode_tile_in_numpy(blob, CELL_M).surfaces, surfaces)
    rows = [surfaces.tobytes() for surfaces in decoded]
    packed = [zstandard.compress(row, 3) for row in rows]
    ways = {
        "library": lambda: [decode_tile(blob, CELL_M) for blob in encoded],
        "numpy": lambda: [tiles.decode_tile_in_numpy(blob, CELL_M) for blob in encoded],
        "rows, zstd 3": lambda: [np.frombuffer(zstandard.decompress(blob), SURFACE).copy() for blob in packed],
        "rows as they are": lambda: [np.frombuffer(row, SURFACE).copy() for row in rows],
    }
    count = sum(map(len, decoded))
    sizes = {"library": encoded, "numpy": encoded, "rows, zstd 3": packed, "rows as they are": rows}
    print(f"{len(encoded)} tiles, {count} surfaces")
    rates = {}
    for name, seconds in best_seconds(ways, 1 if options.smoke else options.repeats).items():
        rates[name] = count / seconds
        print(f"{name:18} {rates[name] / 1e6:8.2f} M surfaces/s {sum(map(len, sizes[name])) / count:7.2f} bytes/surface")
    sys.exit(not options.smoke and rates["library"] < BOUND_PER_S)


if __name__ == "__main__":
    main()
