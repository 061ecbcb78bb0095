#!/usr/bin/python3
"""Two sides of a thing are two things: thin decks between storeys and thin walls between rooms, drawn anew each time.

    tests/experiments/two_sides.py --build build/release [--worlds 10] [--seed 1] [--only deck,wall] [--thickness 0.08,0.15]
                                   [--poses exact,noisy] [--jobs 2]

A robot drives on both storeys of a car park, or through four rooms, and uploads its scans with exact poses and with noisy
ones (0.03 m and 0.005 rad a step and axis). Both sides of the deck and of the walls were seen, each from its own. After
ingest and after optimize the table has, of the worst world: the bias of each storey's or room's scans (mean error of their
positions: across the deck, or across the walls), how far the thickness of the deck or wall in the map is from the truth,
and the error of all positions, each after rigid alignment with the truth, and the last one without it, too: the first
scan's turn moves all others and says nothing of sides. Exits 1 if a bias exceeds 1 cm. Worlds come from --seed, by default
the day's number. Needs python3-numpy.
"""
import argparse
import concurrent.futures
import datetime
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

from real_data import rotation

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
THICKNESS = {"deck": (0.15, 0.2, 0.25, 0.4), "wall": (0.08, 0.15)}
NOISE = {"exact": ("0", "0"), "noisy": ("0.03", "0.005")}
BOUND_M = 0.01
FLOOR_M = 3.2      # of the upper storey


def poses_of(path):
    """4 × 4 matrices of a pose file; index-tum has a number before the time."""
    poses = []
    for line in open(path, encoding="utf-8"):
        if line.strip() and not line.startswith("#"):
            values = [float(v) for v in line.split()[-7:]]
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = rotation(np.array(values[3:])), values[:3]
            poses.append(T)
    return np.array(poses)


def points_of(path):
    head, body = path.read_bytes().split(b"DATA binary\n", 1)
    count = int(next(line.split()[1] for line in head.splitlines() if line.startswith(b"POINTS")))
    points = np.frombuffer(body, np.float32).reshape(count, -1)[:, :3].astype(float)
    return points[np.isfinite(points).all(1)]


def fitted(estimate, truth):
    """The estimate, moved rigidly onto the truth by its positions (Umeyama without scale)."""
    e, g = estimate[:, :3, 3], truth[:, :3, 3]
    U, _, Vt = np.linalg.svd((g - g.mean(0)).T @ (e - e.mean(0)))
    T = np.eye(4)
    T[:3, :3] = U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    T[:3, 3] = g.mean(0) - T[:3, :3] @ e.mean(0)
    return T @ estimate


class Drive:
    """A robot's way through a drawn world, and the faces of what it saw from both sides."""

    def __init__(self, build, folder, kind, thickness, poses, seed):
        self.kind, random = kind, np.random.default_rng([seed, int(1000 * thickness)])
        world = ["car_park", "--robot", "visitor", "--slab", thickness] if kind == "deck" else ["rooms", "--wall", thickness]
        step, height = random.uniform(*((0.9, 1.3) if kind == "deck" else (0.6, 0.9))), random.uniform(0.9, 1.4)
        noise_m, noise_rad = NOISE[poses]
        subprocess.run([build / "tests/support/strata-simulate", world[0], folder, *map(str, world[1:]), "--seed", str(seed),
                        "--step", str(step), "--height", str(height), "--noise-m", noise_m, "--noise-rad", noise_rad],
                       check=True, stdout=subprocess.DEVNULL)
        self.folder = folder / ("visitor" if kind == "deck" else "round")
        self.truth = poses_of(self.folder / "poses_truth.txt")
        self.clouds = [points_of(path) for path in sorted((self.folder / "scans").iterdir())]
        at = self.truth[:, :3, 3]
        if kind == "deck":  # storeys; scans on the ramp belong to none
            self.groups = {"below": at[:, 2] < height + 0.05, "above": at[:, 2] > FLOOR_M + height - 0.05}
            self.axes, self.half = [2], [FLOOR_M - thickness, FLOOR_M]
        else:
            quadrant = (at[:, 0] > 0) + 2 * (at[:, 1] > 0)
            self.groups = {f"room {q}": quadrant == q for q in range(4)}
            self.axes, self.half = [0, 1], [-thickness / 2, thickness / 2]
        self.faces = [self.face(axis, side) for axis in self.axes for side in (0, 1)]

    def face(self, axis, side):
        """Of each scan on that side, the points that truly lie on this face of the deck or wall."""
        found = {}
        for k, (T, cloud) in enumerate(zip(self.truth, self.clouds)):
            if (T[axis, 3] > self.half[side]) != bool(side):
                continue
            p = cloud @ T[:3, :3].T + T[:3, 3]
            near = np.abs(p[:, axis] - self.half[side]) < 0.03
            if self.kind == "wall":  # not floor, ceiling, the other wall and doors' sides
                other = 1 - axis
                near &= (p[:, 2] > 0.2) & (p[:, 2] < 2.6) & (np.abs(p[:, other]) > 0.4) & (np.abs(p[:, other]) < 4.5)
            else:
                near &= (np.abs(p[:, 0]) < 19.5) & (np.abs(p[:, 1]) < 11.5) & (np.abs(p[:, 1]) > 3.0)
            if near.sum() >= 50:
                found[k] = np.c_[cloud[near][::7], np.ones(len(cloud[near][::7]))]
        return found

    def thickness_error(self, estimate):
        """The greatest difference between how far the two faces of a deck or wall have moved."""
        errors = []
        for i, axis in enumerate(self.axes):
            moved = [np.mean([((estimate[k] - self.truth[k])[axis] @ q.T).mean() for k, q in self.faces[2 * i + side].items()])
                     for side in (0, 1)]
            errors.append(abs(moved[1] - moved[0]))
        return max(errors)

    def judged(self, estimate):
        moved = np.sqrt(((estimate - self.truth)[:, :3, 3] ** 2).sum(1).mean())
        estimate = fitted(estimate, self.truth)
        error = (estimate - self.truth)[:, :3, 3]
        means = {name: error[group].mean(0)[self.axes] for name, group in self.groups.items()}
        worst = max(means, key=lambda name: np.abs(means[name]).max())
        return {"bias": float(np.abs(means[worst]).max()), "where": worst, "thickness": float(self.thickness_error(estimate)),
                "ate": float(np.sqrt((error**2).sum(1).mean())), "unfitted": float(moved)}


def run(build, kind, thickness, poses, seed):
    with tempfile.TemporaryDirectory(dir="/dev/shm" if pathlib.Path("/dev/shm").is_dir() else None) as folder:
        folder = pathlib.Path(folder)
        drive = Drive(build, folder / "world", kind, thickness, poses, seed)

        def strata(*arguments):
            done = subprocess.run([build / "client/cli/strata", "--embedded", folder / "db", "--output", "json",
                                   *map(str, arguments)], check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            return json.loads(done.stdout) if done.stdout.strip() else None

        def judged():
            strata("pose", "export", "m", "--format", "tum", "--out", folder / "poses.txt")
            return drive.judged(poses_of(folder / "poses.txt"))
        strata("map", "create", "m", "--cell-size", 0.1)
        strata("scan", "import", "m", drive.folder / "scans", "--poses", drive.folder / "poses_initial.txt", "--pose-format",
               "index-tum", "--wait")
        ingested = judged()
        job = strata("job", "start", "m", "optimize", "--wait")
        return {"ingest": ingested, "optimize": judged(), "message": job["message"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--worlds", type=int, default=10)
    parser.add_argument("--seed", type=int, default=datetime.date.today().toordinal())
    parser.add_argument("--only", default=",".join(THICKNESS))
    parser.add_argument("--thickness", type=lambda s: [float(v) for v in s.split(",")])
    parser.add_argument("--poses", default=",".join(NOISE))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--verbose", action="store_true", help="a line for every world")
    options = parser.parse_args()
    if unknown := set(options.only.split(",")) - set(THICKNESS):
        parser.error(f"--only {','.join(sorted(unknown))}: use {','.join(THICKNESS)}")
    print(f"two_sides: seed {options.seed}, {options.worlds} worlds each; errors of the worst one, of all in the mean [mm]")
    print("                           bias           thickness      positions      unfitted")
    bad = 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for kind in options.only.split(","):
            for thickness in options.thickness or THICKNESS[kind]:
                for poses in options.poses.split(","):
                    seeds = [1000 * options.seed + k for k in range(options.worlds)]
                    rows = list(pool.map(lambda seed: run(options.build.resolve(), kind, thickness, poses, seed), seeds))
                    for seed, row in zip(seeds, rows):
                        if options.verbose:
                            print(f"  {seed}", json.dumps(row))
                    over = [sum(row[when]["bias"] > BOUND_M for row in rows) for when in ("ingest", "optimize")]
                    bad += sum(over)
                    for when, beyond in zip(("ingest", "optimize"), over):
                        cells = [f"{1000 * max(row[when][v] for row in rows):6.1f} {1000 * np.mean([row[when][v] for row in rows]):6.1f}"
                                 for v in ("bias", "thickness", "ate", "unfitted")]
                        print(f"{kind} {thickness:4.2f} m {poses:5} {when:8}", "  ".join(cells),
                              "ok" if not beyond else f" NOT REACHED in {beyond} of {len(rows)}", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
