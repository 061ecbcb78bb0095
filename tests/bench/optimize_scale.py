#!/usr/bin/python3
"""How an optimize job grows with the map, through server and command line: time and memory by number of scans.

    tests/bench/optimize_scale.py --build build/release [--sizes 2000,20000] [--job threads=1] [--keep DIR]

Draws a city of one district for every 2,000 scans (strata-simulate city): in each a robot takes a scan of some 5,000
points every 2.5 m, 5 km in all. Poses are odometry that drifts by metres. Relative poses between scans that follow each
other, and from every tenth scan to one of an earlier pass where there is one, are imported as constraints: as many a
scan at any size. The time is the processor time of a server started for the job, of all its threads; the memory is that
server's peak. Needs python3-numpy.
"""
import argparse
import collections
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.append(str(ROOT / "tests/experiments"))
from trajectory_error import ate

SCANS_A_ROBOT = 2000
LOOP_EVERY, LOOP_RADIUS_M, LOOP_MIN_STEPS = 10, 4.0, 100
SIGMA_M, SIGMA_RAD = 0.02, 0.001  # of the constraints


def multiply(p, q):
    (x1, y1, z1, w1), (x2, y2, z2, w2) = p, q
    return np.array([w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2, w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
                     w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2, w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2])


def conjugate(q):
    return q * np.array([-1, -1, -1, 1])


def rotate(q, v):
    return multiply(multiply(q, np.append(v, 0.0)), conjugate(q))[:3]


def load(path):
    """index-tum: rows of x y z qx qy qz qw"""
    return np.loadtxt(path, ndmin=2)[:, 2:9]


def edge(i, j, truth, random):
    q_i = conjugate(truth[i, 3:])
    t = rotate(q_i, truth[j, :3] - truth[i, :3]) + random.normal(0.0, SIGMA_M, 3)
    q = multiply(multiply(q_i, truth[j, 3:]), np.append(random.normal(0.0, SIGMA_RAD / 2, 3), 1.0))
    numbers = " ".join(f"{v:.9g}" for v in (*t, *(q / np.linalg.norm(q))))
    diagonal = [1 / SIGMA_M**2] * 3 + [4 / SIGMA_RAD**2] * 3  # g2o's rotation error is half the angle
    upper = " ".join(f"{diagonal[r] if r == c else 0:g}" for r in range(6) for c in range(r, 6))
    return f"EDGE_SE3:QUAT {i} {j} {numbers} {upper}\n"


def write_graph(path, robots):
    """robots: {name: true poses}. Returns the number of loops."""
    random = np.random.default_rng(1)
    truth = np.concatenate(list(robots.values()))
    names = [f"{name}/{k}" for name, poses in robots.items() for k in range(len(poses))]
    first = {names.index(f"{name}/0") for name in robots}
    pairs = [(k - 1, k) for k in range(1, len(truth)) if k not in first]
    cells = collections.defaultdict(list)  # scans so far, so that the way through them stays short
    loops = 0
    for k, p in enumerate(truth[:, :2]):
        cell = tuple((p // LOOP_RADIUS_M).astype(int))
        if k % LOOP_EVERY == 0:
            near = [n for dx in (-1, 0, 1) for dy in (-1, 0, 1) for n in cells[cell[0] + dx, cell[1] + dy]
                    if k - n >= LOOP_MIN_STEPS and np.hypot(*(truth[n, :2] - p)) <= LOOP_RADIUS_M]
            if near:
                pairs.append((min(near, key=lambda n: np.hypot(*(truth[n, :2] - p))), k))
                loops += 1
        cells[cell].append(k)
    with open(path, "w", encoding="utf-8") as out:
        for k, (name, row) in enumerate(zip(names, truth)):
            out.write(f"# {k} {name}\nVERTEX_SE3:QUAT {k} {' '.join(f'{v:.9g}' for v in row)}\n")
        for i, j in pairs:
            out.write(edge(i, j, truth, random))
    return loops


class Server:
    def __init__(self, build, data):
        self.process = subprocess.Popen([build / "server/stratad", "--data", data, "--listen", "127.0.0.1:0",
                                         "--optimize-every", "0"],
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.address = self.process.stdout.readline().split()[1]
        self.cli = build / "client/cli/strata"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()

    def strata(self, *arguments):
        done = subprocess.run([self.cli, "--server", self.address, "--output", "json", *map(str, arguments)],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"strata {' '.join(map(str, arguments))}: {done.stderr}")
        return json.loads(done.stdout) if done.stdout.strip() else None

    def seconds(self):
        """Of processor time so far."""
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def peak_mb(self):
        for line in pathlib.Path(f"/proc/{self.process.pid}/status").read_text(encoding="utf-8").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
        return 0.0


def robot_names(size):
    return [f"robot{k}" for k in range(-(-size // SCANS_A_ROBOT))]


def prepare(build, work, size):
    """Draws `size` scans and makes a map of them and their constraints in work/map."""
    count = len(robot_names(size))
    subprocess.run([build / "tests/support/strata-simulate", "city", work / "city", "--districts", str(count),
                    "--scans", str(size // count), "--step", "2.5", "--rings", "18", "--columns", "400",
                    "--noise-m", "0.01", "--noise-rad", "0.0001"], check=True, stdout=subprocess.DEVNULL)
    folders = [work / "city" / name for name in robot_names(size)]
    robots = {folder.name: load(folder / "poses_truth.txt") for folder in folders}
    loops = write_graph(work / "graph.g2o", robots)
    (work / "made").mkdir()
    with Server(build, work / "made") as server:
        server.strata("map", "create", "city", "--cell-size", "0.2")
        for folder in folders:
            server.strata("scan", "import", "city", folder / "scans", "--trajectory", folder.name, "--poses",
                          folder / "poses_initial.txt", "--pose-format", "index-tum", "--align", "off", "--wait")
        server.strata("posegraph", "import", "city", work / "graph.g2o")
    truth = np.concatenate([poses[:, :3] for poses in robots.values()])
    start = np.concatenate([load(folder / "poses_initial.txt")[:, :3] for folder in folders])
    np.savez(work / "poses.npz", truth=truth, start=start, loops=loops)
    (work / "made").rename(work / "map")


def positions(server, work, robots):
    """Of the scans of one robot after the other."""
    rows = []
    for robot in robots:
        server.strata("pose", "export", "city", "--format", "tum", "--trajectory", robot, "--out", work / "poses.txt")
        rows.append(np.loadtxt(work / "poses.txt", ndmin=2)[:, 1:4])
    return np.concatenate(rows)


def measure(build, work, size, parameters):
    work.mkdir(parents=True, exist_ok=True)
    if not (work / "map").exists():
        prepare(build, work, size)
    poses = np.load(work / "poses.npz")
    truth, start, loops = poses["truth"], poses["start"], int(poses["loops"])
    shutil.rmtree(work / "run", ignore_errors=True)
    shutil.copytree(work / "map", work / "run")
    phases = collections.Counter()
    with Server(build, work / "run") as server:
        begin, wall = server.seconds(), time.monotonic()
        job = server.strata("job", "start", "city", "optimize", *parameters)
        last = begin
        while job["state"] in ("queued", "running"):
            time.sleep(2)
            phase = job["phase"] or "start"
            job = server.strata("job", "show", "city", job["id"])
            now = server.seconds()
            phases[phase] += now - last
            last = now
        if job["state"] != "succeeded":
            sys.exit(f"{size} scans: {job['state']}: {job['message']}")
        row = {"scans": size, "loops": loops, "seconds": last - begin, "wall": time.monotonic() - wall,
               "mb": server.peak_mb(), "phases": phases, "metrics": job["metrics"],
               "before_m": ate(start, truth), "after_m": ate(positions(server, work, robot_names(size)), truth)}
    print(f"{size:6} scans, {loops} loops: {row['seconds']:8.1f} s ({row['wall']:.0f} s by the clock), peak"
          f" {row['mb']:7.1f} MB; error {row['before_m']:.3f} m before, {row['after_m']:.3f} m after; {job['message']}",
          flush=True)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--sizes", default="2000,20000")
    parser.add_argument("--job", default="threads=1", help="its parameters")
    parser.add_argument("--keep", type=pathlib.Path, help="maps are made there and used again")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        for size in map(int, options.sizes.split(",")):
            work = (options.keep or pathlib.Path(scratch)) / str(size)
            rows.append(measure(options.build.resolve(), work, size, options.job.split(",")))
    small, large = rows[0], rows[-1]
    print("\nphase                              " + "".join(f"{row['scans']:>12}" for row in rows) + "   ratio")
    for phase in large["phases"]:
        print(f"{phase:35}" + "".join(f"{row['phases'][phase]:10.1f} s" for row in rows)
              + f"{large['phases'][phase] / max(small['phases'][phase], 0.01):8.1f}")
    print(f"\n{large['scans'] / small['scans']:.1f} x the scans: {large['seconds'] / small['seconds']:.1f} x the time,"
          f" {large['mb'] / small['mb']:.1f} x the memory")


main()
