#!/usr/bin/python3
"""Recorded scans through a real server: import, align, render, plan; our poses beside the references.

    tests/experiments/real_data.py --build build/release [--data ../shared/data] [--only nclt,kitti] [--out DIR]
                                   [--peers] [--crispness]

--peers adds the ATE of a chain of PCL's pairwise ICP and GICP, --crispness how well the scans agree at the uploaded
poses, after ingest, after optimize and at the reference poses (crispness.cc). Starts stratad on port 0, drives it with
the command line client as a user would, prints a table and exits 1 if a bound does not hold (77 where the data are
absent). Needs python3-numpy.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

import trajectory_error

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def rotation(q):
    x, y, z, w = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def quaternion(R):
    w, v = np.linalg.eigh(np.array([
        [R[0, 0] - R[1, 1] - R[2, 2], R[1, 0] + R[0, 1], R[2, 0] + R[0, 2], R[2, 1] - R[1, 2]],
        [R[1, 0] + R[0, 1], R[1, 1] - R[0, 0] - R[2, 2], R[2, 1] + R[1, 2], R[0, 2] - R[2, 0]],
        [R[2, 0] + R[0, 2], R[2, 1] + R[1, 2], R[2, 2] - R[0, 0] - R[1, 1], R[1, 0] - R[0, 1]],
        [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], R[0, 0] + R[1, 1] + R[2, 2]]]) / 3)
    return v[:, np.argmax(w)]


def load_poses(path):
    """index-tum: {index: (time, 4×4 T_map_scan)}"""
    poses = {}
    for line in open(path, encoding="utf-8"):
        if line.strip() and not line.startswith("#"):
            f = [float(x) for x in line.split()]
            T = np.eye(4)
            T[:3, :3] = rotation(np.array(f[5:9]))
            T[:3, 3] = f[2:5]
            poses[int(f[0])] = (f[1], T)
    return poses


def load_tum(path):
    rows = np.loadtxt(path, ndmin=2)
    poses = []
    for row in rows:
        T = np.eye(4)
        T[:3, :3] = rotation(row[4:8])
        T[:3, 3] = row[1:4]
        poses.append((row[0], T))
    return poses


def write_index_tum(path, poses):
    with open(path, "w", encoding="utf-8") as out:
        for index, (stamp, T) in sorted(poses.items()):
            q = quaternion(T[:3, :3])
            print(index, f"{stamp:.6f}", *(f"{v:.9f}" for v in (*T[:3, 3], *q)), file=out)


def ate(estimate, reference):
    """RMSE [m] of positions after rigid alignment; both lists of 4×4."""
    return trajectory_error.ate(*(np.array([T[:3, 3] for T in poses]) for poses in (estimate, reference)))


def angle_deg(R):
    return float(np.degrees(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1))))


class Strata:
    """A server of our own and the command line client against it."""

    def __init__(self, build, out, optimize_every=0):
        self.build = build
        self.cli = build / "client/cli/strata"
        self.out = out
        self.dir = tempfile.TemporaryDirectory()
        self.server = subprocess.Popen([build / "server/stratad", "--data", self.dir.name, "--listen", "127.0.0.1:0",
                                        "--optimize-every", str(optimize_every)],
                                       stdout=subprocess.PIPE, stderr=open(out / "stratad.log", "a"), text=True)
        self.address = self.server.stdout.readline().split()[1]

    def __call__(self, *arguments, check=True):
        done = subprocess.run([self.cli, "--server", self.address, "--output", "json", *map(str, arguments)],
                              stdout=subprocess.PIPE, stderr=open(self.out / "strata.log", "a"), text=True)
        if check and done.returncode != 0:
            raise RuntimeError(f"strata {' '.join(map(str, arguments))}: exit {done.returncode}: {done.stdout[-500:]}")
        return json.loads(done.stdout) if done.stdout.strip() else None

    def import_scans(self, name, *arguments, create=()):
        self("map", "create", name, *create)
        start = time.time()
        self("scan", "import", name, *arguments, "--wait")
        stats = self("map", "show", name)
        stats["seconds"] = time.time() - start
        return stats

    def poses(self, name):
        path = self.out / f"{name}_current.tum"
        self("pose", "export", name, "--format", "tum", "--which", "current", "--out", path)
        return load_tum(path)

    def optimize(self, name, *parameters):
        """Makes the world consistent; the poses afterwards, and the job."""
        start = time.time()
        job = self("job", "start", name, "optimize", *parameters, "--wait")
        job["seconds"] = time.time() - start
        return [T for _, T in self.poses(name)], job

    def render(self, name, *arguments):
        self("map", "render", name, self.out / f"{name}.png", *arguments)

    def plan(self, name, start, goal, *arguments):
        at = lambda p: ",".join(f"{v:.3f}" for v in p)
        return self("plan", name, "--from", at(start), "--to", at(goal), *arguments)

    def surfaces(self, name, points):
        """The columns at `points` (their x and y)."""
        path = self.out / "points.csv"
        path.write_text("".join(f"{p[0]:.3f},{p[1]:.3f}\n" for p in points))
        done = subprocess.run([self.cli, "--server", self.address, "--output", "json", "surface", name, "--points", path],
                              stdout=subprocess.PIPE, text=True, check=True)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def stop(self):
        self.server.terminate()
        self.server.wait(60)
        self.dir.cleanup()


class Table:
    def __init__(self, peers=False, crispness=False):
        self.bad = 0
        self.peers = peers
        self.crispness = crispness

    def row(self, data, what, value, bound=None, ok=True):
        self.bad += not ok
        limit = "" if bound is None else f"{bound}  {'ok' if ok else 'NOT REACHED'}"
        print(f"{data:8} {what:58} {value:>22} {limit}", flush=True)

    def imported(self, data, stats):
        self.row(data, f"{stats['scans']} scans, {stats['points']} points, {stats['patches']} patches, "
                       f"{stats['tiles']} tiles: import and alignment", f"{stats['seconds']:.1f} s",
                 "every scan", stats.get("scans_failed", 0) == 0 and stats.get("scans_pending", 0) == 0)


def nclt(strata, table, data):
    folder = data / "nclt_campus_loop"
    stats = strata.import_scans("nclt", folder / "scans", "--poses", folder / "poses_initial.txt",
                                "--pose-format", "index-tum", create=("--cell-size", "0.1"))
    table.imported("nclt", stats)
    strata.render("nclt")
    current = strata.poses("nclt")
    indices = sorted(load_poses(folder / "poses_initial.txt"))
    by_index = dict(zip(indices, (T for _, T in current)))
    T_900_0 = np.linalg.inv(by_index[900]) @ by_index[0]
    difference = np.linalg.inv(np.loadtxt(folder / "loop_edge_0_900.txt")) @ T_900_0
    metres, degrees = np.linalg.norm(difference[:3, 3]), angle_deg(difference[:3, :3])
    table.row("nclt", "scan 900 relative to scan 0, no loop closing", f"{metres:.2f} m / {degrees:.2f}°", "≤ 1 m / 2°",
              metres <= 1.0 and degrees <= 2.0)
    reference = load_poses(folder / "poses_reference.txt")
    table.row("nclt", "ATE uploaded", f"{ate([load_poses(folder / 'poses_initial.txt')[i][1] for i in indices], [reference[i][1] for i in indices]):.3f} m")
    table.row("nclt", "ATE after ingest", f"{ate([by_index[i] for i in indices], [reference[i][1] for i in indices]):.3f} m")
    after = optimized(strata, table, "nclt", [reference[i][1] for i in indices], 0.15)
    nclt_plan(strata, table, after)
    beside(strata, table, "nclt", folder, [by_index[i] for i in indices], after)


def beside(strata, table, name, folder, ingested, optimized_poses):
    """What others reach, and how well the scans agree, before, after and at the reference poses."""
    reference = load_poses(folder / "poses_reference.txt")
    indices = sorted(load_poses(folder / "poses_initial.txt"))
    if table.peers:
        for method in ("icp", "gicp"):
            path, start = strata.out / f"{name}_pcl_{method}.txt", time.time()
            subprocess.run([strata.build / "tests/experiments/icp_chain", folder, path, "--method", method], check=True)
            chain = load_poses(path)
            error = ate([chain[i][1] for i in indices], [reference[i][1] for i in indices])
            table.row(name, f"ATE of a chain of PCL's pairwise {method.upper()}, {time.time() - start:.1f} s",
                      f"{error:.4f} m")
    if table.crispness:
        files = [folder / "poses_initial.txt"]
        for what, poses in (("ingest", ingested), ("optimize", optimized_poses)):
            files.append(strata.out / f"{name}_after_{what}.txt")
            write_index_tum(files[-1], {i: (reference[i][0], T) for i, T in zip(indices, poses)})
        files.append(folder / "poses_reference.txt")
        done = subprocess.run([strata.build / "tests/experiments/crispness", folder / "scans", *files], check=True,
                              stdout=subprocess.PIPE, text=True)
        for line in done.stdout.splitlines():
            crisp = json.loads(line)
            table.row(name, f"{crisp['poses']}: spread rms, median; two levels < 0.5 m",
                      f"{1000 * crisp['spread_m']:.1f}, {1000 * crisp['median_spread_m']:.1f} mm;"
                      f" {100 * crisp['double_share']:.2f} %")


def optimized(strata, table, name, reference, bound, *parameters):
    """Loops closed and planes held without a hand; the poses afterwards."""
    poses, job = strata.optimize(name, *parameters)
    metrics = job["metrics"]
    after = ate(poses, reference)
    table.row(name, f"ATE after optimize: {metrics.get('closures', 0):.0f} closures, {metrics['planes']:.0f} planes, "
                    f"{job['seconds']:.1f} s", f"{after:.4f} m", f"≤ {bound} m", after <= bound)
    return poses


def by_itself(strata, table, data, name, folder, bound):
    """The server closes the loop without being asked."""
    folder = data / folder
    own = Strata(strata.build, strata.out, optimize_every=1)
    try:
        own.import_scans(name, folder / "scans", "--poses", folder / "poses_initial.txt", "--pose-format", "index-tum")
        jobs, deadline = [], time.time() + 120
        while not any(job["state"] == "succeeded" for job in jobs) and time.time() < deadline:
            time.sleep(0.5)
            jobs = [job for job in own("job", "list", name) if job["kind"] == "optimize"]
        reference = load_poses(folder / "poses_reference.txt")
        uploaded = sorted(load_poses(folder / "poses_initial.txt"))
        after = ate([T for _, T in own.poses(name)], [reference[i][1] for i in uploaded])
        table.row(name, f"ATE by itself: {len(jobs)} jobs nobody asked for", f"{after:.4f} m", f"≤ {bound} m",
                  len(jobs) > 0 and after <= bound)
    finally:
        own.stop()


def disturbed(strata, table, data, name, folder, bound, seed=1):
    """Uploaded poses disturbed by 0.3 m and 3° each."""
    folder = data / folder
    random = np.random.default_rng(seed)
    noisy = {}
    for index, (stamp, T) in sorted(load_poses(folder / "poses_initial.txt").items()):
        noise = np.eye(4)
        v = np.radians(3.0) / np.sqrt(3) * random.standard_normal(3)
        noise[:3, :3] = rotation(np.array([*(v / 2), 1.0]))
        noise[:3, 3] = 0.3 / np.sqrt(3) * random.standard_normal(3)
        noisy[index] = (stamp, T @ noise)
    path = strata.out / f"{name}_disturbed.txt"
    write_index_tum(path, noisy)
    map_name = f"{name}_disturbed"
    strata.import_scans(map_name, folder / "scans", "--poses", path, "--pose-format", "index-tum")
    reference = load_poses(folder / "poses_reference.txt")
    optimized(strata, table, map_name, [reference[i][1] for i in sorted(noisy)], bound)


def facade_halved(strata, table, data):
    """Every other scan: little overlap; with planes no worse than without."""
    folder = data / "eth_facade_tls"
    scans = sorted((folder / "scans").iterdir())[::2]
    reference = [T for i, (_, T) in sorted(load_poses(folder / "poses_reference.txt").items()) if i % 2 == 0]
    errors = []
    for planes in (0, 1):
        name = f"facade_half_{planes}"
        strata.import_scans(name, *scans, "--poses", folder / "poses_initial.txt", "--pose-format", "index-tum",
                            "--trajectory", "half")
        poses, _ = strata.optimize(name, f"planes={planes}")
        errors.append(ate(poses, reference))
    table.row("facade", f"every other scan, ATE with planes (local alone: {errors[0]:.4f} m)", f"{errors[1]:.4f} m",
              "≤ local, tie below 2 mm", errors[1] <= errors[0] + 0.002)


def ground_below(strata, name, T):
    """The driven place on the ground: below the sensor, at the median height of what the map has around it."""
    around = []
    for angle in np.radians(np.arange(0, 360, 30)):
        x, y = T[:2, 3] + 1.5 * np.array([np.cos(angle), np.sin(angle)])
        surfaces = strata("surface", name, "--at", f"{x:.3f},{y:.3f}")["surfaces"]
        around += [s["z"] for s in surfaces if 1.5 < T[2, 3] - s["z"] < 4.0]
    return np.array([*T[:2, 3], np.median(around) if around else T[2, 3] - 2.7])


def nclt_plan(strata, table, route, gap=0.7, step=0.25):
    """Plans along 320 m of the driven route: in legs of about 40 m, and at once.

    The author of the data thinned the scans, so the ground has unobserved stretches: `gap` is what it takes to cross
    them, `step` to cross its kerbs. Ends are the driven positions; a sensor does not see the ground that it stands
    over, so the planner may move them. The loop has to be closed: before, where the drive begins, there is ground
    twice, and the scans that came last are a kerb across the way.
    """
    limits = ("--max-gap", gap, "--max-step", step)
    driven = np.concatenate([[0], np.cumsum([np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in zip(route, route[1:])])])
    begin = int(np.searchsorted(driven, 10.0))
    # Straight to the goal would be shorter than the driven route: the path is asked for along it, in legs.
    marks = [int(np.searchsorted(driven, driven[begin] + s)) for s in range(0, 321, 40)]
    feet = [ground_below(strata, "nclt", route[mark]) for mark in marks]
    legs = [strata.plan("nclt", a, b, *limits) for a, b in zip(feet, feet[1:])]
    for leg, mark in zip(legs, marks):
        if not leg["found"]:
            print(f"   leg from {driven[mark]:.0f} m: {leg['reason']}: {leg.get('message')}", file=sys.stderr)
    length = sum(leg["length_m"] for leg in legs if leg["found"])
    way = driven[marks[-1]] - driven[begin]
    moved = sum("moved" in leg.get("message", "") for leg in legs)
    said = f"max_gap {gap} max_step {step} m"
    table.row("nclt", f"plan along the route, {len(legs)} legs ({moved} with moved ends), {said}", f"{length:.1f} m",
              f"300 to {1.25 * way:.0f} m, all found", all(leg["found"] for leg in legs) and 300 <= length <= 1.25 * way)
    whole = strata.plan("nclt", feet[0], feet[-1], *limits)
    if not whole["found"]:
        print("   at once:", whole["reason"], whole.get("message"), file=sys.stderr)
    table.row("nclt", f"plan over {way:.0f} m of driving at once, {said}: {whole['reason']}",
              f"{whole['length_m']:.1f} m / {whole['elapsed_ms']:.0f} ms", "found", whole["found"])


def ate_against_uploaded(strata, table, data, name, folder, *extra):
    folder = data / folder
    stats = strata.import_scans(name, folder / "scans", "--poses", folder / "poses_initial.txt",
                                "--pose-format", "index-tum", *extra)
    table.imported(name, stats)
    strata.render(name)
    reference = load_poses(folder / "poses_reference.txt")
    uploaded = load_poses(folder / "poses_initial.txt")
    indices = sorted(uploaded)
    before = ate([uploaded[i][1] for i in indices], [reference[i][1] for i in indices])
    ingested = [T for _, T in strata.poses(name)]
    after = ate(ingested, [reference[i][1] for i in indices])
    table.row(name, "ATE after ingest", f"{after:.4f} m", f"≤ {before:.4f} m uploaded", after <= before)
    return [reference[i][1] for i in indices], ingested


def hall(strata, table, data):
    reference, ingested = ate_against_uploaded(strata, table, data, "hall", "hall_livox_loop")
    after = optimized(strata, table, "hall", reference, 0.04)
    beside(strata, table, "hall", data / "hall_livox_loop", ingested, after)
    disturbed(strata, table, data, "hall", "hall_livox_loop", 0.04)
    by_itself(strata, table, data, "hall", "hall_livox_loop", 0.04)
    folder = data / "hall_livox_loop"
    stats = strata.import_scans("hall_level", folder / "scans", "--poses", folder / "poses_initial.txt",
                                "--pose-format", "index-tum", "--level", create=("--cell-size", "0.2"))
    strata.render("hall_level")
    levels = stats["patches"] - stats["occupied_cells"]
    table.row("hall", "levels beyond the first in a cell, levelled, 20 cm", levels, "thousands", levels >= 2000)
    poses = strata.poses("hall_level")
    feet = [T[:3, 3] - [0, 0, 1.7] for _, T in poses]
    far = max(feet, key=lambda p: np.linalg.norm(p - feet[0]))
    plan = strata.plan("hall_level", feet[0], far, "--radius", "0.25", "--height", "1.2")
    on_floor = plan["found"] and max(abs(w[2] - feet[0][2]) for w in plan["waypoints"]) < 1.0
    table.row("hall", f"plan on the floor: {plan['reason']}", f"{plan['length_m']:.1f} m",
              "found, within 1 m of the floor", on_floor)
    hall_under_gallery(strata, table)


def hall_under_gallery(strata, table, floor=-1.55):
    """A plan along the hall's end beneath the gallery.

    The floor is 1.55 m below the first sensor, the gallery some 5.5 m above it; one is as traversable as the other.
    """
    plan = strata.plan("hall_level", (-12.0, 11.4, floor), (4.0, 10.6, floor), "--radius", "0.25", "--height", "1.2")
    points = []
    for a, b in zip(plan["waypoints"], plan["waypoints"][1:]):
        steps = max(1, int(np.ceil(np.linalg.norm(np.subtract(b, a)) / 0.25)))
        points += [np.add(a, np.subtract(b, a) * i / steps) for i in range(steps)]
    off_floor = max((abs(p[2] - floor) for p in points), default=np.inf)
    gallery = [any(4.5 < s["z"] - p[2] < 7.0 for s in column["surfaces"])
               for p, column in zip(points, strata.surfaces("hall_level", points))]
    share = float(np.mean(gallery)) if gallery else 0.0
    table.row("hall", f"plan with the gallery above {100 * share:.0f} % of it: {plan['reason']}, off the floor by",
              f"{plan['length_m']:.1f} m / {off_floor:.2f} m", "found, ≤ 0.25 m, ≥ 80 %",
              plan["found"] and 15 < plan["length_m"] < 20 and off_floor <= 0.25 and share >= 0.8)


def facade(strata, table, data):
    reference, ingested = ate_against_uploaded(strata, table, data, "facade", "eth_facade_tls")
    after = optimized(strata, table, "facade", reference, 0.02)
    beside(strata, table, "facade", data / "eth_facade_tls", ingested, after)
    disturbed(strata, table, data, "facade", "eth_facade_tls", 0.02)
    facade_halved(strata, table, data)


def kitti(strata, table, data):
    folder = data / "kitti_city_drive"
    reference = load_poses(folder / "poses_reference_icp.txt")
    random = np.random.default_rng(20261121)
    indices = sorted(reference)
    noisy, T = {}, reference[indices[0]][1]
    for k, index in enumerate(indices):
        if k > 0:
            step = np.linalg.inv(reference[indices[k - 1]][1]) @ reference[index][1]
            v = np.radians(0.5) * random.standard_normal(3)
            noise = np.eye(4)
            noise[:3, :3] = rotation(np.array([*(v / 2), 1.0]))
            noise[:3, 3] = 0.05 * random.standard_normal(3)
            T = T @ step @ noise
        noisy[index] = (reference[index][0], T)
    path = strata.out / "kitti_noisy.txt"
    write_index_tum(path, noisy)
    stats = strata.import_scans("kitti", folder / "scans", "--poses", path, "--pose-format", "index-tum")
    table.imported("kitti", stats)
    strata.render("kitti")
    truth = [reference[i][1] for i in indices]
    after = ate([T for _, T in strata.poses("kitti")], truth)
    before = ate([noisy[i][1] for i in indices], truth)
    table.row("kitti", f"ATE after ingest (uploaded with seeded noise: {before:.3f} m)", f"{after:.4f} m", "≤ 0.10 m",
              after <= 0.10)


def isprs(strata, table, data):
    stats = strata.import_scans("isprs", data / "isprs_als_filter/samp71-utm.pcd", "--align", "off",
                                create=("--cell-size", "3", "--thickness", "0.5"))
    table.imported("isprs", stats)
    strata.render("isprs")
    levels = stats["patches"] - stats["occupied_cells"]
    table.row("isprs", "samp71: cells with deck and road at the deck's edges", levels, "≥ 10", levels >= 10)


def others(strata, table, data):
    sets = {
        "corridor": (data / "slam6d_corridor", "--format", "3dtk"),
        "kitti00": (data / "kitti00_gt/velodyne", "--poses", data / "kitti00_gt/poses_00_velo.txt", "--pose-format",
                    "index-tum"),
        "vtk": (data / "libpointmatcher_scans/cloud_0.vtk", data / "libpointmatcher_scans/cloud_1.vtk", "--poses", "none"),
        "pair": (data / "registration_pairs/small_gicp/target.ply",),
        "lille": (data / "lille_facade",),
    }
    for name, arguments in sets.items():
        table.imported(name, strata.import_scans(name, *arguments))
        strata.render(name)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--data", type=pathlib.Path, default=os.environ.get("STRATA_DATA", ROOT / "../shared/data"))
    parser.add_argument("--only", default="nclt,hall,facade,kitti,isprs,others")
    parser.add_argument("--out", type=pathlib.Path, default=None, help="pictures, poses and logs (default: a temporary folder)")
    parser.add_argument("--peers", action="store_true")
    parser.add_argument("--crispness", action="store_true")
    options = parser.parse_args()
    data = pathlib.Path(options.data)
    if not data.is_dir():
        print(f"real_data: no recorded data at {data}; set STRATA_DATA", file=sys.stderr)
        return 77
    with tempfile.TemporaryDirectory() as scratch:
        out = options.out or pathlib.Path(scratch)
        out.mkdir(parents=True, exist_ok=True)
        strata, table = Strata(options.build.resolve(), out), Table(options.peers, options.crispness)
        try:
            for name in options.only.split(","):
                globals()[name](strata, table, data)
        finally:
            strata.stop()
    return 1 if table.bad else 0


if __name__ == "__main__":
    sys.exit(main())
