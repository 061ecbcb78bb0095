#!/usr/bin/python3
"""Makes the pictures of docs/ again, from a drawn world and the built programs.

    docs/pictures/draw.py --build build/release

Writes them beside itself. The points of the simulated bridge get colours here, by what they are of. Needs python3-numpy and
rsvg-convert (librsvg2-bin).
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent / "tests/experiments"))
from underpass import write_png  # noqa: E402

# Of ground, wall, window, stairs, vegetation, pole: the labels of simulated points.
COLOURS = np.array([[90, 90, 90], [150, 140, 120], [180, 95, 70], [90, 120, 160], [150, 150, 150], [70, 130, 60],
                    [220, 190, 60]])


def paint(path):
    """Gives a labelled PCD file of x y z label the column rgb."""
    head, _, body = path.read_bytes().partition(b"DATA binary\n")
    lines = dict(line.split(maxsplit=1) for line in head.decode().splitlines() if line and not line.startswith("#"))
    names, sizes, kinds = (lines[key].split() for key in ("FIELDS", "SIZE", "TYPE"))
    code = {("F", "4"): "<f4", ("U", "2"): "<u2", ("U", "4"): "<u4", ("U", "1"): "u1"}
    points = np.frombuffer(body, dtype=[(n, code[k, s]) for n, s, k in zip(names, sizes, kinds)])
    painted = np.zeros(len(points), dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
    for axis in "xyz":
        painted[axis] = points[axis]
    red, green, blue = COLOURS[np.minimum(points["label"], len(COLOURS) - 1)].T.astype("<u4")
    painted["rgb"] = red << 16 | green << 8 | blue
    path.write_bytes(f"VERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\n"
                     f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n".encode() + painted.tobytes())


def draw_mesh(vertices, normals, triangles, scale=16.0, tilt=0.45, lift=0.85):
    """Seen from the south and above, lit from the south-west."""
    random = np.random.default_rng(1)
    light = np.array([-0.4, -0.6, 0.7])
    points, shades = [], []
    for _ in range(8):      # samples a triangle, each some pixels
        weights = random.dirichlet((1, 1, 1), len(triangles))[..., None]
        points.append((vertices[triangles] * weights).sum(axis=1))
        shades.append((normals[triangles] * weights).sum(axis=1) @ light)
    points, shades = np.concatenate(points), np.concatenate(shades)
    low, high = points.min(axis=0), points.max(axis=0)
    across = ((points[:, 0] - low[0]) * scale).astype(int)
    down = ((high[1] - points[:, 1]) * tilt * scale + (high[2] - points[:, 2]) * lift * scale).astype(int)
    near = np.argsort(points[:, 2] * tilt - points[:, 1] * lift)
    image = np.full((down.max() + 1, across.max() + 1, 3), 255.0)
    colour = np.array([205, 200, 185]) * (0.35 + 0.65 * np.clip(shades, 0, 1))[:, None]
    image[down[near], across[near]] = colour[near]
    return image


def read_pgm(path):
    kind, size, _, body = path.read_bytes().split(b"\n", 3)
    assert kind == b"P5"
    width, height = map(int, size.split())
    return np.frombuffer(body, dtype=np.uint8).reshape(height, width)


def draw_grids(paths):
    """Side by side, a grey line between them."""
    grids = [read_pgm(path) for path in paths]
    height = max(len(grid) for grid in grids)
    columns = []
    for grid in grids:
        above = (height - len(grid)) // 2
        columns.append(np.pad(grid, ((above, height - len(grid) - above), (6, 6)), constant_values=205))
    return np.repeat(np.concatenate(columns, axis=1)[..., None], 3, axis=2)


class Maps:
    """Of drawn worlds, a map each."""

    def __init__(self, build, folder):
        self.build, self.folder = build, folder

    def simulate(self, name, world, *options):
        self.run("tests/support/strata-simulate", world, self.folder / name, *options)
        return sorted(path for path in (self.folder / name).iterdir() if path.is_dir())

    def add(self, name, robots):
        self.strata("map", "create", name)
        for robot in robots:
            self.strata("scan", "import", name, robot / "scans", "--poses", robot / "poses_truth.txt", "--trajectory", robot.name,
                        "--align", "off", "--wait")

    def floorplan(self, name, storey, picture, *options):
        self.strata("planes", "find", name, "--wait")
        self.strata("map", "floorplan", name, self.folder / f"{name}.svg", "--storey", storey, *options)
        subprocess.run(["rsvg-convert", "--width", "900", "--output", picture, self.folder / f"{name}.svg"], check=True)

    def explore(self, name, robots, start, picture):
        """Three views of a map of the first third of the scans, and the ways to them."""
        for robot in robots:
            scans = sorted((robot / "scans").iterdir())
            for scan in scans[len(scans) // 3:]:
                scan.unlink()
        self.add(name, robots)
        words = ["explore", name, "--from", ",".join(map(str, start)), "--count", 3, "--range", 10, "--output", "json"]
        told = json.loads(self.tell("client/cli/strata", "--embedded", self.folder / "maps", *words))
        ways = []
        for i, view in enumerate(told["views"]):
            way = self.folder / f"way-{i}.ply"
            self.strata("plan", name, "--from", ",".join(map(str, start)), "--to", ",".join(map(str, view["place"])), "--out", way)
            ways += ["--path", way]
            start = view["place"]
        self.strata("map", "render", name, picture, "--slice=-1,1.8", "--size", "800x520", *ways)

    def tour(self):
        """The bridge of the quickstart, with its two paths, and the floor of its deck for two robots."""
        robots = self.simulate("yard", "bridge", "--step", 2, "--noise-m", 0.02, "--noise-rad", 0.003)
        self.strata("map", "create", "yard")
        for robot in robots:
            self.strata("scan", "import", "yard", robot / "scans", "--poses", robot / "poses_initial.txt", "--trajectory", robot.name,
                        "--wait")
        ways = []
        for name, start, goal in (("over", "-26,0,0", "26,0,0"), ("under", "0,-20,0", "0,20,0")):
            ways += ["--path", self.folder / f"{name}.ply"]
            self.strata("plan", "yard", "--from", start, "--to", goal, "--out", ways[-1])
        self.strata("map", "render", "yard", HERE / "quickstart.png", "--view", "oblique", "--size", "460x300", *ways)
        self.strata("profile", "set", "yard", "wheelchair", "--radius", 0.35, "--max-step", 0.03, "--max-slope", "0.1rad", "--height", 1.5)
        for profile in ("default", "wheelchair"):
            self.strata("map", "render", "yard", HERE / f"floor-{profile}.png", "--profile", profile, "--at", "0,0,3.4", "--size", "560x300")

    def nodding(self):
        bag, urdf = self.folder / "nodding.bag", self.folder / "robot.urdf"
        subprocess.run([HERE.parent.parent / "tests/support/write_laser_bag.py", bag, urdf], check=True, stdout=subprocess.DEVNULL)
        self.strata("map", "create", "room")
        self.strata("scan", "import", "room", bag, "--urdf", urdf, "--sweep", 2, "--wait")
        self.strata("map", "render", "room", HERE / "nodding.png", "--view", "oblique", "--size", "460x320")

    def tell(self, program, *words):
        return subprocess.run([self.build / program, *map(str, words)], check=True, stdout=subprocess.PIPE, text=True).stdout

    def run(self, program, *words):
        subprocess.run([self.build / program, *map(str, words)], check=True, stdout=subprocess.DEVNULL)

    def strata(self, *words):
        self.run("client/cli/strata", "--embedded", self.folder / "maps", *words)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    build = parser.parse_args().build.resolve()
    sys.path.insert(0, str(build / "client/python"))
    from strata.mesh import read_ply
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        maps = Maps(build, folder)
        robots = maps.simulate("bridge", "bridge", "--seed", 1, "--labels")
        for path in folder.glob("bridge/*/scans/*.pcd"):
            paint(path)
        maps.add("bridge", robots)
        maps.strata("map", "render", "bridge", HERE / "colour.png", "--layer", "colour", "--view", "oblique", "--size", "460x290")
        maps.strata("map", "mesh", "bridge", folder / "mesh.ply", "--region=-24,-12,24,12,-0.5,6.8", "--voxel", "0.1")
        write_png(HERE / "mesh.png", draw_mesh(*read_ply(folder / "mesh.ply")))
        maps.strata("map", "export", "bridge", "--format", "nav2", "--out", folder / "floor")
        write_png(HERE / "floors.png", draw_grids(sorted(folder.glob("floor-*.pgm"))))
        maps.add("flat", maps.simulate("flat", "rooms", "--seed", 4, "--step", 2))
        maps.floorplan("flat", 0, HERE / "floorplan.png")
        maps.tour()
        maps.nodding()
        maps.explore("half", maps.simulate("half", "rooms", "--seed", 4, "--step", 2), (1, -1, 0), HERE / "explore.png")
    subprocess.run([sys.executable, HERE.parent.parent / "tests/experiments/underpass.py", "--build", build, "--seeds", "1",
                    "--picture", HERE / "underpass.png"], check=True)


if __name__ == "__main__":
    main()
