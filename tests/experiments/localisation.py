#!/usr/bin/python3
"""Where was this scan taken? Scans of one part of a drive asked for in a map of the other, without a guess.

    tests/experiments/localisation.py --build build/release [--data ../shared/data] [--only nclt,building] [--most 30]

Maps are made at the true poses without alignment, on a server, and asked through the command line: of recorded drives,
and of drawn worlds that repeat themselves (rooms and corridors of a building, storeys of a car park, streets). An answer
is right within 0.5 m and 0.05 rad of the truth. Scans of other recordings and of worlds of another seed have no place in
a map: any answer is wrong; so is one off the truth for a scan of the same drive beyond the mapped part. --most N asks
for at most N scans a row, evenly spread. Prints a table and exits 1 if an answer is wrong (77 where recorded data are
asked for and absent). Needs python3-numpy.
"""
import argparse
import concurrent.futures
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

from real_data import ROOT, Strata, angle_deg, load_poses, rotation

RIGHT_M, RIGHT_DEG = 0.5, np.degrees(0.05)
NEAR_M = 12
RECORDED = {"nclt": ("nclt_campus_loop", "poses_reference.txt"), "hall": ("hall_livox_loop", "poses_reference.txt"),
            "kitti": ("kitti_city_drive", "poses_reference_icp.txt"), "facade": ("eth_facade_tls", "poses_reference.txt")}
DRAWN = {"building": "round", "campus": "north_loop", "city": "robot0", "car_park": "visitor"}


class Recording:
    def __init__(self, folder, poses):
        self.poses_file = folder / poses
        self.poses = {i: T for i, (_, T) in load_poses(self.poses_file).items()}
        digits = lambda path: int("".join(c if c.isdigit() else " " for c in path.stem).split()[-1])
        self.scans = {digits(path): path for path in (folder / "scans").iterdir()}
        self.indices = sorted(self.scans)

    def files(self, indices):
        return [self.scans[i] for i in indices]


def pose_of(answer):
    T = np.eye(4)
    T[:3, :3] = rotation(np.array(answer["pose"][3:]))
    T[:3, 3] = answer["pose"][:3]
    return T


class Count:
    def __init__(self):
        self.right, self.unknown, self.metres, self.degrees = 0, 0, [], []
        self.wrong = []  # their confidence

    def add(self, answer, truth):
        """`truth`: None where the map has no such place."""
        if not answer["found"]:
            self.unknown += 1
            return
        if truth is not None:
            error = np.linalg.inv(truth) @ pose_of(answer)
            metres, degrees = np.linalg.norm(error[:3, 3]), angle_deg(error[:3, :3])
            if metres < RIGHT_M and degrees < RIGHT_DEG:
                self.right += 1
                self.metres.append(metres)
                self.degrees.append(degrees)
                return
        self.wrong.append(answer["confidence"])

    def print(self, name, queries):
        error = f"{np.median(self.metres):8.3f} {max(self.metres):7.3f} {np.median(self.degrees):8.2f}" \
            if self.metres else f"{'–':>8} {'–':>7} {'–':>8}"
        sure = " ".join(f"{confidence:.2f}" for confidence in sorted(self.wrong, reverse=True))
        print(f"{name:34} {queries:>40} {self.right:6} {len(self.wrong):6} {self.unknown:8} {error}  {sure}", flush=True)
        return self


def make_map(strata, name, recording, indices):
    strata.import_scans(name, *recording.files(indices), "--poses", recording.poses_file, "--pose-format", "index-tum",
                        "--align", "off", "--trajectory", "map", create=("--cell-size", "0.1"))


def ask(strata, name, title, what, recording, indices, known=True):
    count = Count()
    indices = indices[:: max(1, -(-len(indices) // strata.most))]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        answers = pool.map(lambda index: strata("localize", name, recording.scans[index]), indices)
        for index, answer in zip(indices, answers):
            count.add(answer, recording.poses[index] if known else None)
    return count.print(title, f"{len(indices)} {what}")


def way(recording, indices):
    steps = [np.linalg.norm(recording.poses[b][:3, 3] - recording.poses[a][:3, 3]) for a, b in zip(indices, indices[1:])]
    return np.concatenate([[0], np.cumsum(steps)])


def draw(strata, world, seed):
    """The drive of one robot through it."""
    folder = strata.out / f"{world}_{seed}"
    subprocess.run([strata.build / "tests/support/strata-simulate", world, folder, "--seed", str(seed), "--robot",
                    DRAWN[world], "--scans", "90"], check=True, stdout=subprocess.DEVNULL)
    return Recording(folder / DRAWN[world], "poses_truth.txt")


def interleaved(strata, name, recording):
    make_map(strata, f"{name}_even", recording, recording.indices[::2])
    return ask(strata, f"{name}_even", f"{name}, every other scan", "scans between", recording, recording.indices[1::2])


def beyond(strata, name, recording, share):
    """The end of a drive in a map of its beginning: what comes back near a scan of the map, and what does not."""
    cut = int(np.searchsorted(way(recording, recording.indices), share * way(recording, recording.indices)[-1]))
    first, rest = recording.indices[:cut], recording.indices[cut:]
    near = lambda i: min(np.linalg.norm(recording.poses[i][:3, 3] - recording.poses[k][:3, 3]) for k in first) < NEAR_M
    make_map(strata, f"{name}_first", recording, first)
    title = f"{name}, first {100 * share:.0f} % of the way"
    back, away = [i for i in rest if near(i)], [i for i in rest if not near(i)]
    return (ask(strata, f"{name}_first", title, f"later scans within {NEAR_M} m of it", recording, back),
            ask(strata, f"{name}_first", title, "later scans elsewhere", recording, away))


def one_left_out(strata, name, recording):
    count = Count()
    for index in recording.indices:
        make_map(strata, f"{name}_{index}", recording, [i for i in recording.indices if i != index])
        count.add(strata("localize", f"{name}_{index}", recording.scans[index]), recording.poses[index])
    return count.print(f"{name}, all but one scan", f"{len(recording.indices)} scans left out")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--data", type=pathlib.Path, default=os.environ.get("STRATA_DATA", ROOT / "../shared/data"))
    parser.add_argument("--only", default=",".join([*RECORDED, *DRAWN]))
    parser.add_argument("--most", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    wanted = options.only.split(",")
    data = pathlib.Path(options.data)
    if not data.is_dir() and any(name in RECORDED for name in wanted):
        print(f"localisation: no recorded data at {data}; set STRATA_DATA", file=sys.stderr)
        return 77
    here, elsewhere = [], []  # rows
    with tempfile.TemporaryDirectory() as out:
        strata = Strata(options.build.resolve(), pathlib.Path(out))
        strata.most = options.most
        drives = {name: Recording(data / RECORDED[name][0], RECORDED[name][1])
                  for name in RECORDED if RECORDED.keys() & set(wanted)}
        drives |= {name: draw(strata, name, options.seed) for name in DRAWN if name in wanted}
        try:
            print(f"{'map':34} {'queries':>40}  right  wrong  unknown  median     max  [deg]  confidence of wrong ones")
            for name in wanted:
                drive = drives[name]
                if name == "facade":
                    here.append(one_left_out(strata, name, drive))
                    continue
                here.append(interleaved(strata, name, drive))
                if name != "kitti":
                    back, away = beyond(strata, name, drive, 0.5)
                    here.append(back)
                    elsewhere.append(away)
                others = {f"scans of {other}": strange for other, strange in drives.items() if other != name}
                if name in DRAWN and name != "car_park":  # its noise alone has a seed
                    others["scans of another seed"] = draw(strata, name, options.seed + 1000)
                for what, strange in others.items():
                    elsewhere.append(ask(strata, f"{name}_even", f"{name}, every other scan", what, strange,
                                         strange.indices, known=False))
        finally:
            strata.stop()
    of = lambda rows, of_row: sum(of_row(row) for row in rows)
    asked = lambda row: row.right + len(row.wrong) + row.unknown
    for title, rows in (("mapped places", here), ("elsewhere", elsewhere)):
        print(f"{title}: {of(rows, asked)} asked, {of(rows, lambda row: row.right)} right, "
              f"{of(rows, lambda row: len(row.wrong))} wrong")
    return 1 if any(row.wrong for row in here + elsewhere) else 0


sys.exit(main())
