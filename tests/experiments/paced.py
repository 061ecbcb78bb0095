#!/usr/bin/python3
"""A drive in real time: how long after its upload a scan is in the map, while loops are closed again and again.

    tests/experiments/paced.py --build build/release [--every 2] [--scans N] [--data ../shared/data]

Uploads the recorded campus to a real stratad, a scan every 2 s as the thesis' car made its clouds (10.3; there loop
closing did not keep up), while another client starts `optimize` with closures whenever none runs. A watch of the map
tells when a scan is integrated. The whole drive takes 7.5 minutes; --scans N ends it earlier, --every makes it faster.
99 of 100 scans are to be in the map within 2 s. How old the last closure is, is printed: time since the start of the
last job that has ended, which is what its closures know; and for how long the server's threads ran, and waited for
processors that others had. Exits 1 where the bound does not hold, 77 without the data. Needs python3-numpy and
python3-grpcio.
"""
import argparse
import os
import pathlib
import sys
import tempfile
import threading
import time

import numpy as np

from larger_than_memory import read_pcd
from real_data import ROOT, load_poses
from stratad import Stratad

DRIVE = "nclt_campus_loop"
BOUND_S, SHARE = 2.0, 99
PATIENCE_S = 120  # for the last scan


class Integrated:
    """When scans came into the map, by their sequence; a thread that watches."""

    def __init__(self, world, errors):
        self.at, self.failed = {}, []
        self.changed = threading.Condition()
        threading.Thread(target=self._watch, args=(world, errors), daemon=True).start()

    def _watch(self, world, errors):
        try:
            self._follow(world)
        except errors.Cancelled:  # the connection is closed
            pass

    def _follow(self, world):
        for change in world.watch(trajectory="car", tiles=False):
            now = time.monotonic()
            with self.changed:
                for scan in change.scans:
                    if scan.state == "failed":
                        self.failed.append(scan.sequence)
                    if scan.state != "pending":
                        self.at.setdefault(scan.sequence, now)
                self.changed.notify_all()

    def wait(self, sequences):
        with self.changed:
            return self.changed.wait_for(lambda: set(sequences) <= set(self.at), PATIENCE_S)


class Optimizer:
    """Jobs one after the other, each as soon as the one before has ended: (started, ended, job). The last one starts after
    stop(), and knows all scans."""

    def __init__(self, world, errors):
        self.jobs, self.ends = [], threading.Event()  # when the drive is at its end
        self._thread = threading.Thread(target=self._run, args=(world, errors))
        self._thread.start()

    def _run(self, world, errors):
        last = False
        while not last:
            last, started = self.ends.is_set(), time.monotonic()
            try:
                job = world.optimize(closures=1)
            except errors.FailedPrecondition as failure:  # nothing there yet
                print(f"optimize: {failure}", file=sys.stderr)
                time.sleep(0.5)
                continue
            self.jobs.append((started, time.monotonic(), job))

    def stop(self):
        self.ends.set()
        self._thread.join()

    def ages(self, begin, end):
        """Of the last closure, sampled ten times a second from the first one on."""
        ended = np.array([job[1] for job in self.jobs])
        times = np.arange(max(begin, ended[0]), end, 0.1)
        last = np.searchsorted(ended, times, side="right") - 1
        return times - np.array([job[0] for job in self.jobs])[last]


def scheduled_s(process):
    """For how long its living threads ran, and waited for a processor."""
    ran, waited = np.sum([[int(word) for word in (task / "schedstat").read_text().split()[:2]]
                          for task in pathlib.Path(f"/proc/{process.pid}/task").iterdir()], axis=0) / 1e9
    return ran, waited


def upload(world, scans, every_s):
    """Sends each at its time; when it was sent, by sequence, and how late at most."""
    begun, sent, late = time.monotonic(), {}, 0.0
    for sequence, (points, T_map_scan) in enumerate(scans):
        due = begun + sequence * every_s
        time.sleep(max(0.0, due - time.monotonic()))
        sent[sequence] = time.monotonic()
        late = max(late, sent[sequence] - due)
        world.upload(points, T_map_scan, trajectory="car", sequence=sequence)
    return sent, late


def quantiles(values, unit="s"):
    p50, p99, most = np.percentile(values, [50, SHARE, 100])
    return f"p50 {p50:.3f}, p{SHARE} {p99:.3f}, max {most:.3f} {unit}"


def drive(world, errors, scans, every_s):
    """Prints what was measured; whether the bound holds."""
    integrated = Integrated(world, errors)
    optimizer = Optimizer(world, errors)
    try:
        sent, late = upload(world, scans, every_s)
        ended = time.monotonic()
        arrived = integrated.wait(sent)
    finally:
        optimizer.stop()
    if not arrived or integrated.failed:
        print(f"FAILS: {len(set(sent) - set(integrated.at))} scans are not in the map, {len(integrated.failed)} failed")
        return False
    latency = np.array([integrated.at[sequence] - sent[sequence] for sequence in sent])
    print(f"{len(sent)} scans, one every {every_s:g} s, at most {late:.2f} s late; {ended - sent[0]:.0f} s")
    print(f"upload to integrated: {quantiles(latency)}")
    report_closures(optimizer, sent[0], ended)
    slow = np.percentile(latency, SHARE)
    print(f"{'holds' if slow < BOUND_S else 'FAILS'}: {SHARE} % of the scans are in the map within {BOUND_S:g} s: {slow:.3f}")
    return slow < BOUND_S


def report_closures(optimizer, begin, end):
    jobs = optimizer.jobs
    if not jobs:
        print("no optimize job ended")
        return
    print(f"{len(jobs)} optimize jobs, {sum(job.state == 'succeeded' for _, _, job in jobs)} applied, "
          f"{sum(job.metrics.get('closures', 0) for _, _, job in jobs):.0f} closures found, "
          f"{jobs[-1][2].metrics.get('scans_moved', 0):.0f} scans moved by the last one, after the drive; each took "
          f"{quantiles([b - a for a, b, _ in jobs])}")
    print(f"age of the last closure: {quantiles(optimizer.ages(begin, end))}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--data", type=pathlib.Path,
                        default=pathlib.Path(os.environ.get("STRATA_DATA", ROOT.parent / "shared/data")))
    parser.add_argument("--every", type=float, default=2.0)
    parser.add_argument("--scans", type=int)
    options = parser.parse_args()
    folder, build = options.data / DRIVE, options.build.resolve()
    if not folder.exists():
        return 77
    sys.path.append(str(build / "client/python"))
    import strata
    files = sorted((folder / "scans").glob("*.pcd"))
    poses = load_poses(folder / "poses_initial.txt")
    scans = [(read_pcd(file), poses[int(file.stem.lstrip("s"))][1]) for file in files][:options.scans]
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as data:
        server = Stratad(build, data, "--optimize-every", 0)
        try:
            with strata.connect(server.address) as db:
                world = db.create_map("campus", cell_size=0.1)
                holds = drive(world, strata.errors, scans, options.every)
            ran, waited = scheduled_s(server.process)
        finally:
            server.stop()
    print(f"stratad ran for {ran:.0f} s and waited {waited:.0f} s for a processor")
    print(f"{os.cpu_count()} processors; load of the machine before {load:.1f}, after {os.getloadavg()[0]:.1f}")
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
