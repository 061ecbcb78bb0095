#!/usr/bin/python3
"""Where was this recorded scan taken? Scans of one part of a recording asked for in a map of the other, without a guess.

    tests/experiments/localisation.py --build build/release [--data ../shared/data] [--only nclt,hall] [--most 30]

Maps are made at the reference poses without alignment, on a server, and asked through the command line. An answer is
right within 0.5 m and 0.05 rad of the reference. Queries of other recordings have no place in a map: any answer is
wrong. --most N asks for at most N scans a row, evenly spread. Prints a table and exits 1 if an answer is wrong (77 where
the data are absent). Needs python3-numpy.

The matcher's thresholds (core/registration/place_match.h) were set on the loops of NCLT and the hall and on simulated
worlds; KITTI, the facade and all strangers are data that they have not seen.
"""
import argparse
import os
import pathlib
import sys
import tempfile

import numpy as np

from real_data import ROOT, Strata, angle_deg, load_poses, rotation

RIGHT_M, RIGHT_DEG = 0.5, np.degrees(0.05)


class Recording:
    def __init__(self, data, folder, poses="poses_reference.txt"):
        self.poses_file = data / folder / poses
        self.poses = {i: T for i, (_, T) in load_poses(self.poses_file).items()}
        digits = lambda path: int("".join(c if c.isdigit() else " " for c in path.stem).split()[-1])
        self.scans = {digits(path): path for path in (data / folder / "scans").iterdir()}
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
        self.right, self.wrong, self.unknown, self.metres, self.degrees = 0, 0, 0, [], []

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
        self.wrong += 1

    def print(self, name, queries):
        error = f"{np.median(self.metres):8.3f} {max(self.metres):7.3f} {np.median(self.degrees):8.2f}" \
            if self.metres else f"{'–':>8} {'–':>7} {'–':>8}"
        print(f"{name:34} {queries:>40} {self.right:6} {self.wrong:6} {self.unknown:8} {error}", flush=True)
        return self.wrong


def make_map(strata, name, recording, indices):
    strata.import_scans(name, *recording.files(indices), "--poses", recording.poses_file, "--pose-format", "index-tum",
                        "--align", "off", "--trajectory", "map", create=("--cell-size", "0.1"))


def ask(strata, name, title, what, recording, indices, known=True):
    count = Count()
    indices = indices[:: max(1, -(-len(indices) // strata.most))]
    for index in indices:
        answer = strata("localize", name, recording.scans[index])
        count.add(answer, recording.poses[index] if known else None)
    return count.print(title, f"{len(indices)} {what}")


def way(recording, indices):
    steps = [np.linalg.norm(recording.poses[b][:3, 3] - recording.poses[a][:3, 3]) for a, b in zip(indices, indices[1:])]
    return np.concatenate([[0], np.cumsum(steps)])


def interleaved(strata, name, recording):
    make_map(strata, f"{name}_even", recording, recording.indices[::2])
    return ask(strata, f"{name}_even", f"{name}, every other scan", "scans between", recording, recording.indices[1::2])


def second_pass(strata, name, recording, share):
    """The end of a loop in a map of its beginning: only what comes back within 12 m of a scan of the map."""
    cut = int(np.searchsorted(way(recording, recording.indices), share * way(recording, recording.indices)[-1]))
    first, rest = recording.indices[:cut], recording.indices[cut:]
    near = lambda i: min(np.linalg.norm(recording.poses[i][:3, 3] - recording.poses[k][:3, 3]) for k in first) < 12
    make_map(strata, f"{name}_first", recording, first)
    back = [i for i in rest if near(i)]
    away = [i for i in rest if not near(i)]
    title = f"{name}, first {100 * share:.0f} % of the way"
    wrong = ask(strata, f"{name}_first", title, "later scans within 12 m of it", recording, back)
    return wrong + ask(strata, f"{name}_first", title, "later scans elsewhere", recording, away)


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
    parser.add_argument("--only", default="nclt,hall,kitti,facade")
    parser.add_argument("--most", type=int, default=1000)
    options = parser.parse_args()
    data = pathlib.Path(options.data)
    if not data.is_dir():
        print(f"localisation: no recorded data at {data}; set STRATA_DATA", file=sys.stderr)
        return 77
    recordings = {"nclt": Recording(data, "nclt_campus_loop"), "hall": Recording(data, "hall_livox_loop"),
                  "kitti": Recording(data, "kitti_city_drive", "poses_reference_icp.txt"),
                  "facade": Recording(data, "eth_facade_tls")}
    wanted = options.only.split(",")
    wrong = 0
    with tempfile.TemporaryDirectory() as out:
        strata = Strata(options.build.resolve(), pathlib.Path(out))
        strata.most = options.most
        try:
            print(f"{'map':34} {'queries':>40}  right  wrong  unknown  median     max  [deg]")
            for name in wanted:
                recording = recordings[name]
                if name == "facade":
                    wrong += one_left_out(strata, name, recording)
                    continue
                wrong += interleaved(strata, name, recording)
                if name != "kitti":
                    wrong += second_pass(strata, name, recording, 0.5)
                for other, strange in recordings.items():
                    if other != name:
                        wrong += ask(strata, f"{name}_even", f"{name}, every other scan", f"scans of {other}", strange,
                                     strange.indices, known=False)
        finally:
            strata.stop()
    return 1 if wrong else 0


sys.exit(main())
