#!/usr/bin/python3
"""Thesis, figure 6.1: what an elevation map, an extended elevation map and a multi-level map make of an underpass.

    tests/experiments/underpass.py --build build/release [--seeds 3] [--picture underpass.png]

Two robots drive over a bridge and under it, with noisy poses that ingest aligns, and upload to a real server. `map export`
writes the highest surfaces and the ground; a walk over neighbouring cells that differ by at most 0.2 m (of the ground only
those that a robot may be on) says which ways each has, plans say which the map has. Exits 1 unless the highest surfaces
close the underpass, the ground opens it and closes the bridge, and the map has both. The picture has all three, seen from
aside. Needs python3-numpy.
"""
import argparse
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

import numpy as np

from stratad import Stratad

STEP_M = 0.2
OVER = ((-25.95, 0.05), (25.95, 0.05), (30.0, 1.5))     # from, to, and the strip to stay in: |x|, |y|
UNDER = ((0.05, -18.95), (0.05, 18.95), (5.0, 30.0))
PASSABLE = (1, 4)                                       # classes: traversable, and below or above something
EXPECTED = {"highest": (True, False), "ground": (False, True), "map": (True, True)}
SHOWN = (24.0, 12.0)                                    # |x|, |y| in the picture


class Grid:
    """An ESRI ASCII grid; rows from the south."""

    def __init__(self, path):
        with open(path, encoding="ascii") as file:
            head = dict(file.readline().split() for _ in range(6))
            self.values = np.loadtxt(file, ndmin=2)[::-1]
        self.values[self.values == float(head["NODATA_value"])] = np.nan
        self.cell, self.corner = float(head["cellsize"]), (float(head["xllcorner"]), float(head["yllcorner"]))

    def middles(self):
        rows, columns = self.values.shape
        return np.meshgrid(self.corner[0] + (np.arange(columns) + 0.5) * self.cell,
                           self.corner[1] + (np.arange(rows) + 0.5) * self.cell)

    def cell_at(self, x, y):
        return int((y - self.corner[1]) // self.cell), int((x - self.corner[0]) // self.cell)


def joined(grid, let, way):
    begin, end, strip = way
    x, y = grid.middles()
    let = let & np.isfinite(grid.values) & (abs(x) < strip[0]) & (abs(y) < strip[1])
    begin, end = grid.cell_at(*begin), grid.cell_at(*end)
    seen, waiting = {begin}, [begin]
    while waiting:
        row, column = waiting.pop()
        if (row, column) == end:
            return True
        for near in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            if near not in seen and let[near] and abs(grid.values[near] - grid.values[row, column]) <= STEP_M:
                seen.add(near)
                waiting.append(near)
    return False


class World:
    def __init__(self, build, folder, seed):
        self.build, self.folder = build, folder
        self.run("tests/support/strata-simulate", "bridge", folder / "world", "--seed", seed, "--noise-m", "0.02",
                 "--noise-rad", "0.003")
        self.server = Stratad(build, folder / "maps", "--optimize-every", "0", log=os.devnull)
        self.strata("map", "create", "bridge")
        for robot in ("over", "under"):
            drive = folder / "world" / robot
            self.strata("scan", "import", "bridge", drive / "scans", "--poses", drive / "poses_initial.txt",
                        "--trajectory", robot, "--wait")

    def run(self, program, *words):
        return subprocess.run([self.build / program, *map(str, words)], check=True, capture_output=True, text=True).stdout

    def strata(self, *words):
        return json.loads(self.run("client/cli/strata", *words, "--server", self.server.address, "--output", "json"))

    def export(self, surface):
        file = self.folder / f"{surface}.asc"
        self.strata("map", "export", "bridge", "--format", "asc", "--surface", surface, "--out", file)
        return Grid(file)

    def ways(self):
        """{what: (over, under)}, the grids, and the ground's classes."""
        grids = {surface: self.export(surface) for surface in ("highest", "ground")}
        classes = Grid(self.folder / "ground-class.asc")
        let = {"highest": np.isfinite(grids["highest"].values), "ground": np.isin(classes.values, PASSABLE)}
        ways = {what: (joined(grid, let[what], OVER), joined(grid, let[what], UNDER)) for what, grid in grids.items()}
        sys.path.insert(0, str(self.build / "client/python"))
        import strata
        with strata.connect(self.server.address) as db:
            world = db.map("bridge")
            ways["map"] = (bool(world.plan((-26, 0, 0), (26, 0, 0))), bool(world.plan((0, -19, 0), (0, 19, 0))))
            tiles = world.fetch(area=(-SHOWN[0], -SHOWN[1], *SHOWN))
        return ways, grids, classes, tiles


def spans_of_grid(grid, classes):
    """(x, y, bottom, top, class) of each cell: filled down to the lowest ground."""
    x, y = grid.middles()
    known = np.isfinite(grid.values)
    return x[known], y[known], np.full(known.sum(), -0.3), grid.values[known], classes[known]


def spans_of_map(tiles):
    kind = {1: 1, 2: 2}
    parts = []
    for tile in tiles.values():
        s = tile.surfaces
        classes = np.array([kind.get(int(t), 2) for t in s["traversability"]])
        classes[(s["depth"] > 0) & (classes != 1)] = 3
        parts.append((s["x"], s["y"], s["z"] - np.maximum(s["depth"], 0.1), s["z"], classes))
    return [np.concatenate(column) for column in zip(*parts)]


COLOURS = np.array([[205, 205, 200], [235, 205, 90], [200, 70, 50], [70, 100, 170], [110, 180, 110]], float)


def drawn(spans, cell):
    """Seen from the south and above: each cell a post, the far ones first."""
    x, y, bottom, top, kind = spans
    keep = (abs(x) < SHOWN[0]) & (abs(y) < SHOWN[1]) & (top < 7)
    x, y, bottom, top, kind = (np.asarray(a)[keep] for a in (x, y, bottom, top, kind))
    scale, tilt, lift = 16.0, 0.45, 0.85                # pixels a metre, and of north and up
    height = int((2 * SHOWN[1] * tilt + 8 * lift) * scale)
    image = np.full((height, int(2 * SHOWN[0] * scale), 3), 255.0)
    wide = int(np.ceil(cell * scale))
    for i in np.lexsort((top, -y)):
        left = int((x[i] - cell / 2 + SHOWN[0]) * scale)
        base = height - ((y[i] + SHOWN[1]) * tilt + 0.5 * lift) * scale
        roof, foot = int(base - top[i] * lift * scale), int(base - bottom[i] * lift * scale)
        colour = COLOURS[int(kind[i])] * (0.8 + 0.06 * np.clip(top[i], -1, 4))
        image[max(roof, 0):max(foot, 0), left:left + wide] = 0.55 * colour
        image[max(roof, 0):max(roof + 1, 0), left:left + wide] = colour
    return image


def write_png(path, image):
    raw = b"".join(b"\0" + row.astype(np.uint8).tobytes() for row in np.clip(image, 0, 255))
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", image.shape[1], image.shape[0], 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def draw(path, grids, classes, tiles):
    cell = grids["highest"].cell
    everywhere = np.full(grids["highest"].values.shape, 0)
    panels = [drawn(spans_of_grid(grids["highest"], everywhere), cell),
              drawn(spans_of_grid(grids["ground"], np.nan_to_num(classes.values)), cell), drawn(spans_of_map(tiles), cell)]
    write_png(path, np.concatenate(panels))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--picture", type=pathlib.Path)
    options = parser.parse_args()
    print("| seed | highest: over, under | ground: over, under | map: over, under | holds |\n|---|---|---|---|---|")
    good = True
    for seed in range(1, options.seeds + 1):
        with tempfile.TemporaryDirectory() as folder:
            world = World(options.build, pathlib.Path(folder), seed)
            try:
                ways, grids, classes, tiles = world.ways()
            finally:
                world.server.stop()
        holds = ways == EXPECTED
        good &= holds
        said = " | ".join(", ".join("yes" if way else "no" for way in ways[what]) for what in EXPECTED)
        print(f"| {seed} | {said} | {'yes' if holds else 'NO'} |", flush=True)
        if options.picture and seed == 1:
            draw(options.picture, grids, classes, tiles)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
