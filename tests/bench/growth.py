#!/usr/bin/python3
"""How what a map costs grows with the map: at 100, 1,000, 10,000 and 50,000 scans, through a real server.

    tests/bench/growth.py --build build/release [--sizes 100,1000,10000,50000] [--keep DIR] [--picture growth.svg]

One district of a drawn city (strata-simulate city), of 2,000 scans of some 5,000 points, is uploaded over and over, each
time as a robot of its own and a district further on. At every size the server is started anew and asked: what opening the map
takes, showing it, listing the scans of a place, 40 m of the surface, a path of 40 m, 20 scans more (aligned). Times are processor
time of the server (what others do on the machine has no say in it), of many calls each; memory is the server's after them.

Each is held against its share of what the map grew by: opening and showing not at all, what concerns one place not at
all, all scans n log n. Exits 1 where one grows faster. Needs python3-numpy.
"""
import argparse
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.append(str(ROOT / "tests/experiments"))
from stratad import Stratad

DISTRICT = 2000  # scans
RANGE_M = 40.0   # what districts lie apart
MAP = "city"
# name: (unit, calls, what it may grow by from n to m scans)
CONSTANT, N_LOG_N = (lambda n, m: 1.0), (lambda n, m: m * math.log(m) / (n * math.log(n)))
MEASURES = {"upload all": ("s", N_LOG_N), "open": ("ms", CONSTANT), "show": ("ms", CONSTANT), "list scans": ("ms", CONSTANT),
            "fetch": ("ms", CONSTANT), "plan": ("ms", CONSTANT), "ingest a scan": ("ms", CONSTANT), "memory": ("MB", CONSTANT),
            "file": ("MB", N_LOG_N)}
SLACK = 1.5  # of places that differ, and clocks of 10 ms


class City:
    """A district as files, its poses, and where the k-th copy lies."""

    def __init__(self, build, folder):
        self.scans = folder / "city/robot0/scans"
        if not self.scans.exists():
            subprocess.run([build / "tests/support/strata-simulate", "city", folder / "city", "--scans", str(DISTRICT), "--step", "2.5",
                            "--rings", "18", "--columns", "400", "--noise-m", "0", "--noise-rad", "0"],
                           check=True, stdout=subprocess.DEVNULL)
        self.poses = np.loadtxt(folder / "city/robot0/poses_truth.txt")
        self.files = sorted(self.scans.iterdir())
        self.width_m = np.ptp(self.poses[:, 2]) + 2 * RANGE_M

    def part(self, folder, district, first, count):
        """Scans first to first + count of a district, and their poses, for an import."""
        part = folder / f"part_{district}_{first}_{count}"
        (part / "scans").mkdir(parents=True)
        poses = self.poses[first:first + count].copy()
        poses[:, 0] = np.arange(len(poses))
        poses[:, 2] += district * self.width_m
        for k, file in enumerate(self.files[first:first + count]):
            (part / "scans" / f"{k:06d}{file.suffix}").symlink_to(file)
        np.savetxt(part / "poses.txt", poses, fmt=["%d"] + ["%.9g"] * (poses.shape[1] - 1))
        return part


def processor_s(server):
    fields = pathlib.Path(f"/proc/{server.process.pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def import_part(build, server, part, robot, align):
    done = subprocess.run([build / "client/cli/strata", "--server", server.address, "scan", "import", MAP, part / "scans", "--trajectory", robot,
                           "--poses", part / "poses.txt", "--pose-format", "index-tum", "--align", align, "--wait"],
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"scan import: {done.stderr}")


def grow(build, server, city, scratch, have, size):
    """Uploads what is missing; the districts' names go on where the last size ended."""
    while have < size:
        district, first = divmod(have, DISTRICT)
        count = min(DISTRICT - first, size - have)
        import_part(build, server, city.part(scratch, district, first, count), f"robot{district}_{first}", "off")
        have += count


def a_call(server, calls, call):
    """Processor milliseconds of one of many."""
    call(0)
    begun = processor_s(server)
    for k in range(calls):
        call(k)
    return 1e3 * (processor_s(server) - begun) / calls


def opened(build, folder):
    """A server that has just opened the map, and the processor milliseconds that took, its start among them."""
    import strata
    server = Stratad(build, folder, "--optimize-every", "0")
    with strata.connect(server.address) as db:
        db.map(MAP).stats()
    return server, 1e3 * processor_s(server)


def measure(build, folder, city, scratch, stage):
    import strata
    starts = []
    for _ in range(4):
        server, took = opened(build, folder)
        starts.append(took)
        server.stop()
    server, took = opened(build, folder)
    with strata.connect(server.address) as db:
        world = db.map(MAP)
        row = {"open": float(np.median([*starts, took])), "show": a_call(server, 300, lambda _: (world.stats(), db.map(MAP)))}
        x, y = city.poses[40, 2:4]
        box = [x - 20, y - 20, x + 20, y + 20]
        row["list scans"] = a_call(server, 100, lambda _: list(world.scans(box=box)))
        row["fetch"] = a_call(server, 30, lambda _: world.fetch(box))
        start, goal = city.poses[40, 2:5], city.poses[56, 2:5]
        if not world.plan(start, goal):
            sys.exit(f"no path from {start} to {goal}")
        row["plan"] = a_call(server, 30, lambda _: world.plan(start, goal))
        part = city.part(scratch, 0, 20 * stage, 20)
        begun = processor_s(server)
        import_part(build, server, part, f"again{stage}", "on")
        row["ingest a scan"] = 1e3 * (processor_s(server) - begun) / 20
        row["memory"] = server.status("VmRSS") / 1024
    server.stop()
    row["file"] = sum(file.stat().st_size for file in folder.iterdir()) / 1e6
    return row


def judge(rows):
    """Complaints, of each size against the one before it."""
    complaints = []
    for before, after in zip(rows, rows[1:]):
        for name, (unit, allowed) in MEASURES.items():
            grown, may = after[name] / max(before[name], 1e-3), allowed(before["scans"], after["scans"])
            if grown > SLACK * may:
                complaints.append(f"{name}: {before[name]:.3g} {unit} of {before['scans']} scans, {after[name]:.3g} of {after['scans']}:"
                                  f" {grown:.1f} times, may be {may:.1f}")
    return complaints


def table(rows):
    print(f"{'scans':<18}" + "".join(f"{row['scans']:>12}" for row in rows))
    for name, (unit, _) in MEASURES.items():
        print(f"{name + ' [' + unit + ']':<18}" + "".join(f"{row[name]:12.4g}" for row in rows))


def draw(rows, path):
    """What each measure grew by since the first size, over scans, both axes logarithmic, as SVG."""
    width, height, left, top = 640, 360, 60, 20
    sizes = np.log10([row["scans"] for row in rows])
    names = list(MEASURES)
    grown = {name: np.log10([max(row[name], 1e-3) / max(rows[0][name], 1e-3) for row in rows]) for name in names}
    most = max(1.0, math.ceil(max(values.max() for values in grown.values())))
    least = min(-0.5, min(values.min() for values in grown.values()))

    def place(size, value):
        across = left + (size - sizes[0]) / (sizes[-1] - sizes[0]) * (width - left - 150)
        return f"{across:.1f},{top + (most - value) / (most - least) * (height - top - 40):.1f}"

    lines = []
    for k, name in enumerate(names):
        colour = f"hsl({360 * k // len(names)},70%,40%)"
        points = " ".join(place(size, value) for size, value in zip(sizes, grown[name]))
        x, y = place(sizes[-1], grown[name][-1]).split(",")
        lines.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>'
                     f'<text x="{float(x) + 6:.1f}" y="{y}" fill="{colour}">{name}, {10**grown[name][-1]:.3g} ×</text>')
    for decade in range(int(most) + 1):
        x, y = place(sizes[0], decade).split(",")
        lines.append(f'<line x1="{x}" y1="{y}" x2="{width - 150}" y2="{y}" stroke="#ddd"/><text x="8" y="{y}">{10**decade} ×</text>')
    for row, size in zip(rows, sizes):
        lines.append(f'<text x="{place(size, least).split(",")[0]}" y="{height - 8}" text-anchor="middle">{row["scans"]:,} scans</text>')
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="11">'
                    f'<rect width="{width}" height="{height}" fill="white"/>{"".join(lines)}</svg>\n', encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--sizes", default="100,1000,10000,50000")
    parser.add_argument("--keep", type=pathlib.Path, help="the city is drawn there and used again")
    parser.add_argument("--picture", type=pathlib.Path, help="written there as SVG")
    options = parser.parse_args()
    build = options.build.resolve()
    sys.path.append(str(build / "client/python"))
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        scratch = pathlib.Path(temporary)
        folder = scratch / "maps"
        folder.mkdir()
        city = City(build, options.keep or scratch)
        have, spent = 0, 0.0
        for stage, size in enumerate(map(int, options.sizes.split(","))):
            server = Stratad(build, folder, "--optimize-every", "0", log=scratch / "log")
            if have == 0:
                subprocess.run([build / "client/cli/strata", "--server", server.address, "map", "create", MAP, "--cell-size", "0.2"],
                               check=True, stdout=subprocess.DEVNULL)
            grow(build, server, city, scratch, have, size)
            spent, have = spent + processor_s(server), size
            server.stop()
            rows.append({"scans": size, "upload all": spent, **measure(build, folder, city, scratch, stage)})
            print(f"{size} scans: " + ", ".join(f"{name} {rows[-1][name]:.4g} {unit}" for name, (unit, _) in MEASURES.items()), flush=True)
    table(rows)
    if options.picture:
        draw(rows, options.picture)
    complaints = judge(rows)
    print("\n".join(f"FAILS: {complaint}" for complaint in complaints) or "nothing grows faster than it may")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
