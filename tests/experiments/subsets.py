#!/usr/bin/python3
"""Recordings as nobody tuned to: parts of them, backwards, by two robots, with more noise on the uploaded motion.

    tests/experiments/subsets.py --build build/release [--data ../shared/data] [--only nclt,hall] [--variants third,turned]
                                 [--seed 1] [--optimize KEY=VALUE …] [--jobs 2]

Each variant of a recording becomes a map of its own by the command line client on an embedded database: imported with
alignment, then optimised. Prints how far positions are from the reference, uploaded, after ingest and after optimize, and
what optimize said; exits 1 if the worst variant of a recording is beyond its bound (77 where the data are absent). Two
robots that stay apart are as good, if optimize says so and each is within the bound by itself. Noise and offsets come from
--seed, by default the day's number, so that every day draws its own. Needs python3-numpy.
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

from real_data import ROOT, ate, load_poses, rotation, write_index_tum

# folder, file of uploaded poses, of reference poses, bound of the worst variant [m]
RECORDINGS = {
    "nclt": ("nclt_campus_loop", "poses_initial.txt", "poses_reference.txt", 0.25),
    "hall": ("hall_livox_loop", "poses_initial.txt", "poses_reference.txt", 0.03),
    "facade": ("eth_facade_tls", "poses_initial.txt", "poses_reference.txt", 0.01),
    "kitti": ("kitti_city_drive", "poses_reference_icp.txt", "poses_reference_icp.txt", 0.02),
}


class Recording:
    def __init__(self, data, name):
        folder, uploaded, reference, self.bound = RECORDINGS[name]
        self.files = sorted((data / folder / "scans").iterdir())
        digits = lambda path: int("".join(c for c in path.stem if c.isdigit()))
        poses, truth = load_poses(data / folder / uploaded), load_poses(data / folder / reference)
        self.uploaded = [poses[digits(f)][1] for f in self.files]
        self.truth = [truth[digits(f)][1] for f in self.files]


def step(turn_rad, move_m):
    T = np.eye(4)
    T[:3, :3] = rotation(np.array([*(np.asarray(turn_rad) / 2), 1.0]))
    T[:3, 3] = move_m
    return T


def frame(degrees, metres, random):
    """T_said_true of a robot that believes in a frame of its own, turned and moved in the plane."""
    yaw, way = np.radians(degrees), random.uniform(0, 2 * np.pi)
    T = step(np.array([0.0, 0.0, 0.0]), [metres * np.cos(way), metres * np.sin(way), 0.0])
    T[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    return T


def noisy(poses, metres, degrees, random):
    """The same motion with an error in each step."""
    out = [poses[0]]
    for a, b in zip(poses, poses[1:]):
        error = step(np.radians(degrees) * random.standard_normal(3), metres * random.standard_normal(3))
        out.append(out[-1] @ np.linalg.inv(a) @ b @ error)
    return out


# Each takes a recording and a random number generator; robots: lists of (number of the scan, uploaded pose).
def part(select):
    return lambda r, random: [[(k, r.uploaded[k]) for k in range(len(r.files)) if select(k)]]


def backwards(r, random):
    return [[(k, r.uploaded[k]) for k in reversed(range(len(r.files)))]]


def shaken(metres, degrees):
    return lambda r, random: [list(enumerate(noisy(r.uploaded, metres, degrees, random)))]


def two_robots(metres, degrees):
    """The second half by another robot, which begins off by so much."""
    def robots(r, random):
        half = len(r.files) // 2
        begin = r.uploaded[half]  # the frame is turned about where the robot is
        T_said_true = begin @ frame(degrees, metres, random) @ np.linalg.inv(begin)
        return [[(k, r.uploaded[k]) for k in range(half)],
                [(k, T_said_true @ r.uploaded[k]) for k in range(half, len(r.files))]]
    return robots


VARIANTS = {
    "all": part(lambda k: True),
    "coarse": part(lambda k: True),  # cells of 0.5 m
    "even": part(lambda k: k % 2 == 0),
    "odd": part(lambda k: k % 2 == 1),
    "third0": part(lambda k: k % 3 != 0),
    "third1": part(lambda k: k % 3 != 1),
    "third2": part(lambda k: k % 3 != 2),
    "backwards": backwards,
    "shaken": shaken(0.05, 0.5),
    "two": two_robots(0.0, 0.0),
    "two_0.5m": two_robots(0.5, 3.0),
    "two_3m": two_robots(3.0, 15.0),
    "two_10m": two_robots(10.0, 20.0),
    "two_30m": two_robots(30.0, 90.0),
    "two_400m": two_robots(400.0, 180.0),
}


class Map:
    def __init__(self, build, folder, cell):
        self.cli, self.folder, self.cell = build / "client/cli/strata", folder, cell
        self.strata("map", "create", "m", "--cell-size", self.cell)

    def strata(self, *arguments):
        done = subprocess.run([self.cli, "--embedded", self.folder / "db", "--output", "json", *map(str, arguments)],
                              check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        return json.loads(done.stdout) if done.stdout.strip() else None

    def upload(self, recording, robot, scans, stamp):
        folder = self.folder / f"robot{robot}"
        folder.mkdir()
        poses = {}
        for at, (k, T) in enumerate(scans):
            (folder / f"s{at:05}{recording.files[k].suffix}").symlink_to(recording.files[k].resolve())
            poses[at] = (stamp + at, T)
        write_index_tum(self.folder / f"robot{robot}.txt", poses)
        self.strata("scan", "import", "m", folder, "--poses", self.folder / f"robot{robot}.txt", "--pose-format",
                    "index-tum", "--wait")

    def poses(self):
        self.strata("pose", "export", "m", "--format", "tum", "--out", self.folder / "poses.txt")
        rows = np.loadtxt(self.folder / "poses.txt", ndmin=2)
        return {int(row[0]): step(np.zeros(3), row[1:4]) for row in rows}


def run(build, data, name, variant, seed, parameters):
    recording = Recording(data, name)
    robots = VARIANTS[variant](recording, np.random.default_rng([seed, list(VARIANTS).index(variant)]))
    with tempfile.TemporaryDirectory(dir="/dev/shm" if pathlib.Path("/dev/shm").is_dir() else None) as folder:
        world = Map(build, pathlib.Path(folder), 0.5 if variant == "coarse" else 0.1)
        stamp, truth, uploaded, ways = 0, {}, {}, []
        for robot, scans in enumerate(robots):
            world.upload(recording, robot, scans, stamp)
            for at, (k, T) in enumerate(scans):
                truth[stamp + at], uploaded[stamp + at] = recording.truth[k], T
            ways.append(range(stamp, stamp + len(scans)))
            stamp += len(scans)

        def error(poses, stamps):
            stamps = [s for s in stamps if s in poses]
            return ate([poses[s] for s in stamps], [truth[s] for s in stamps])
        ingested = error(world.poses(), range(stamp))
        job = world.strata("job", "start", "m", "optimize", *parameters, "--wait")
        poses = world.poses()
        after = error(poses, range(stamp))
        apart = "Nothing joins" in job["message"] and max(error(poses, way) for way in ways) <= recording.bound
        verdict = "ok" if after <= recording.bound else "apart" if apart else "NOT REACHED"
        return {"recording": name, "variant": variant, "uploaded": error(uploaded, range(stamp)), "ingested": ingested,
                "after": after, "job": job, "verdict": verdict}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--data", type=pathlib.Path, default=ROOT.parent / "shared/data")
    parser.add_argument("--only", default=",".join(RECORDINGS))
    parser.add_argument("--variants", default=",".join(VARIANTS))
    parser.add_argument("--seed", type=int, default=datetime.date.today().toordinal())
    parser.add_argument("--optimize", nargs="*", default=[])
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    if not (arguments.data / "nclt_campus_loop").is_dir():
        print(f"subsets: no recordings in {arguments.data}, skipped")
        return 77
    print(f"subsets: seed {arguments.seed}")
    bad = 0
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        runs = [pool.submit(run, arguments.build, arguments.data, name, variant, arguments.seed, arguments.optimize)
                for name in arguments.only.split(",") for variant in arguments.variants.split(",")]
        for done in runs:
            row = done.result()
            metrics = row["job"]["metrics"]
            bad += row["verdict"] == "NOT REACHED"
            print(f"{row['recording']:7} {row['variant']:10} uploaded {row['uploaded']:8.3f} ingest {row['ingested']:8.4f} "
                  f"optimize {row['after']:8.4f} m {row['verdict']:11} "
                  f"closures {metrics.get('closures', 0):.0f} of {metrics.get('closures_tried', 0):.0f} tried; "
                  f"{row['job']['message']}", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
