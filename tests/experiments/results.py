#!/usr/bin/python3
"""RESULTS.md: the tables of the thesis and of the README beside ours, each with its command and commit.

    tests/experiments/results.py --build build/release [NAME…]   runs experiments anew and writes what they print there
    tests/experiments/results.py --check                         names results older than the sources they measure

Without NAME all are run; benchmarks want a machine that does nothing else. A result is old when one of its sources has
been committed to since. --check says so and ends with 0: a table may be old, but not unnoticed. Exits 1 where an
experiment's own bound does not hold.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FILE = pathlib.Path(__file__).with_name("RESULTS.md")

POSES = ("core/posegraph", "core/planes", "core/registration")
LABELS = ("core/classification",)
PLANES_SEED = 1105530  # drawn after the last change of what it judges
EXPLORE_SEED = 70291129  # so was this one

# name: (title, command, sources that it measures)
RESULTS = {
    "table_7_1": ("Thesis, table 7.1: four views of a small house", "experiments/global_constraints table_7_1", POSES),
    "fig_7_9": ("Thesis, figure 7.9: two to six views", "experiments/global_constraints fig_7_9", POSES),
    "directions": ("Main directions at two and three views", "experiments/global_constraints directions", POSES),
    "sigma_alpha": ("Thesis, 7.4.4: deviation from planes on a large building", "experiments/global_constraints sigma_alpha",
                    POSES),
    "facade_planes": ("Thesis, 7.4.4: a recorded facade", "experiments/global_constraints facade 4", POSES),
    "table_5_1": ("Thesis, table 5.1: planes of drawn rooms, with and without main directions", "experiments/plane_models rooms",
                  ("core/planes/models",)),
    **{f"planes_{what}": (f"Thesis, {title}", f"experiments/plane_models {what} {PLANES_SEED}", ("core/planes/models",))
       for what, title in (("walls", "figure 5.3: parallel walls"), ("rack", "figures 5.4 and 5.5: a rack"),
                           ("boxes", "figure 5.7: two boxes"), ("corridor", "figure 5.9: doors by their colours"),
                           ("jacket", "figure 5.10: a jacket on a desk"), ("carpet", "figure 5.11: a carpet"))},
    "planes_thin": ("Planes of partitions of 8 to 15 cm between rooms", f"experiments/plane_models thin {PLANES_SEED}", ("core/planes/models",)),
    "building": ("Planes of a recorded building", "experiments/plane_models building", ("core/planes/models",)),
    "planes_hall": ("Planes of a recorded hall", "experiments/plane_models hall", ("core/planes/models",)),
    "table_4_1": ("Thesis, table 4.1: triangulations of a piano stool", "experiments/mesh_methods stool", ("core/mesh",)),
    "table_4_2": ("Thesis, table 4.2: bytes of representations", "experiments/mesh_methods memory", ("core/mesh", "core/mls")),
    "meshes": ("Meshes of recorded scans", "experiments/mesh_methods recorded", ("core/mesh",)),
    **{f"thesis_{what}": (f"Thesis, 9.3 and 9.4: {what}", f"experiments/classification_thesis {what}", LABELS)
       for what in ("facade", "depths", "transform", "objects", "people", "places")},
    "recorded_places": ("Thesis, 9.4.4: places of a recorded building", "experiments/recorded_places", LABELS),
    "oakland": ("Recorded streets named", "experiments/labelled_clouds --data oakland", LABELS),
    "recordings": ("Recorded drives through a real server",
                   "/usr/bin/python3 tests/experiments/real_data.py --build {build}", ("core", "server", "client")),
    "subsets": ("Recorded drives in parts, backwards, by two robots, with more noise",
                "/usr/bin/python3 tests/experiments/subsets.py --build {build}", ("core",)),
    "fleet": ("Several robots in one world, with frames that agree, nearly or not", "experiments/fleet --seed 1 --draws 3",
              ("core/posegraph", "core/registration", "core/engine/consistency", "core/engine/ingest")),
    "path_uncertainty": ("What the pose graph says of its own uncertainty along the way",
                         "experiments/path_uncertainty --seed 8105 --draws 3",
                         ("core/posegraph/closures", "core/registration", "core/engine/consistency", "core/engine/ingest")),
    "tracking": ("A robot followed through maps that others have made", "experiments/tracking",
                 ("core/tracking", "core/registration", "core/engine/consistency")),
    "two_sides": ("Decks and walls seen from both sides", "/usr/bin/python3 tests/experiments/two_sides.py --build {build}",
                  ("core/registration", "core/planes", "core/engine")),
    "localisation": ("Scans asked for in maps of the same place and of others",
                     "/usr/bin/python3 tests/experiments/localisation.py --build {build}", ("core",)),
    "hidden_windows": ("Thesis, 11.3: windows that a tree hides", "experiments/hidden_windows --seed 40009711",
                       ("core/completion", "core/engine/objects")),
    "stool": ("Thesis, 4.4.2: a piano stool explored by a manipulator", "experiments/explore_stool", ("core/occupancy",)),
    "explore": ("Where to look next, on recorded drives", "experiments/explore", ("core/occupancy",)),
    "explore_worlds": ("Drawn worlds explored by a robot", f"experiments/explore_worlds --seed {EXPLORE_SEED} --draws 3",
                       ("core/occupancy", "core/planning", "core/engine/plans")),
    "posegraphs": ("Recorded pose graphs", "/usr/bin/python3 tests/experiments/pose_graphs.py --build {build}",
                   ("core/posegraph", "client/formats")),
    "fig_6_1": ("Thesis, figure 6.1: a bridge as elevation map, extended elevation map and multi-level map",
                "/usr/bin/python3 tests/experiments/underpass.py --build {build}", ("core/mls", "core/planning")),
    "husky": ("A recorded robot with IMU, wheels and GPS", "experiments/car husky", ("core/egomotion",)),
    "dresden": ("A recorded car with IMU and GPS", "experiments/car dresden", ("core/egomotion",)),
    "simulated_car": ("A simulated car among walls, with IMU, wheels and GPS", "experiments/car simulated", ("core/egomotion",)),
    "car_loops": ("Thesis, figure 10.4: a simulated car's drive of 2.3 km, mapped",
                  "/usr/bin/python3 tests/experiments/car_maps.py --build {build} --only loops",
                  ("core/egomotion", "core/engine", "core/planes", "core/posegraph", "core/registration")),
    "car_memory": ("Thesis, 10.3: memory at cells of 0.5 m", "/usr/bin/python3 tests/experiments/car_maps.py --build {build} --only memory",
                   ("core/codec", "core/mls", "core/engine/tiles", "core/engine/ingest")),
    "paced": ("Thesis, 10.3: a drive in real time while loops are closed", "/usr/bin/python3 tests/experiments/paced.py --build {build}",
              ("core/engine", "core/posegraph", "core/registration", "server")),
    "mls": ("Points to maps beside OctoMap", "bench/mls_benchmark 5 3", ("core/mls",)),
    "registration": ("Registration beside PCL", "bench/registration_benchmark --pairs 60", ("core/registration", "core/mls")),
    "planes": ("Planes beside PCL, CGAL and what the thesis sets before its own", "bench/planes_benchmark", ("core/planes",)),
    "posegraph": ("Our use of Ceres beside a plain one", "bench/posegraph_benchmark 5", ("core/posegraph",)),
    "planning": ("Warm plans beside boost::astar_search", "bench/planning_benchmark 60 3", ("core/planning",)),
    "shapes": ("A shape over a million patches", "bench/collision_benchmark 200", ("core/collision",)),
    "cuts": ("Features, cuts, training and scans beside CGAL", "bench/classification_benchmark --rounds 3", LABELS),
    "codec": ("Bytes and time a tile", "bench/codec_benchmark", ("core/codec",)),
    "uploads": ("Durable uploads beside a bare program", "bench/durable_upload_benchmark", ("core/engine", "core/storage", "server")),
    "tiles": ("Tiles read beside a bare service", "bench/tile_read_benchmark", ("core/engine", "server")),
}

SECTION = re.compile(r"^## (?P<title>[^\n]*) \(`(?P<name>\w+)`\)\n\n`(?P<command>[^`]*)` at (?P<commit>\w+)[^\n]*\n\n```\n"
                     r"(?P<text>.*?)```\n", re.M | re.S)
HEAD = """# Results

What experiments and benchmarks printed, with command and commit; `tests/experiments/results.py` writes this file, and
`--check` names what is older than the sources that it measures. Times are of whatever machine ran them: what counts is the
ratio to the peer in the same run.
"""


def git(*words):
    return subprocess.run(["git", "-C", ROOT, *words], check=True, capture_output=True, text=True).stdout.strip()


def read():
    text = FILE.read_text(encoding="utf-8") if FILE.exists() else ""
    return {match["name"]: match for match in SECTION.finditer(text)}


def write(sections):
    ordered = [sections[name] for name in RESULTS if name in sections]
    FILE.write_text("\n".join([HEAD, *ordered]), encoding="utf-8")


def run(name, build):
    """(its section, whether its bound holds); no section where its data are absent."""
    title, command, _ = RESULTS[name]
    words = command.format(build=build).split()
    if "/" in words[0] and not words[0].startswith("/"):
        words[0] = str(build / "tests" / words[0])
    done = subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode == 77:
        return None, True
    commit, date = git("log", "-1", "--format=%h %cs").split()
    dirty = " with changes" if git("status", "--porcelain", "--untracked-files=no", "--", ".", f":!{FILE.relative_to(ROOT)}") else ""
    section = f"## {title} (`{name}`)\n\n`{command.format(build='build/release')}` at {commit}{dirty}, {date}\n\n```\n{done.stdout.rstrip()}\n```\n"
    return section, done.returncode == 0


def old_results():
    """Lines that say which results are absent or older than what they measure."""
    known = read()
    for name, (_, _, sources) in RESULTS.items():
        if name not in known:
            yield f"{name}: never run"
            continue
        commit = known[name]["commit"]
        if subprocess.run(["git", "-C", ROOT, "cat-file", "-e", commit], stderr=subprocess.DEVNULL, check=False).returncode != 0:
            yield f"{name}: of {commit}, which this clone does not have"
            continue
        since = git("log", "--oneline", f"{commit}..HEAD", "--", *sources).splitlines()
        if since:
            yield f"{name}: of {commit}; since then {len(since)} commits to {', '.join(sources)}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(RESULTS))
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    unknown = set(options.names) - set(RESULTS)
    if unknown:
        parser.error(f"no result {', '.join(sorted(unknown))}; there are {', '.join(RESULTS)}")
    if options.check:
        print("\n".join(old_results()) or "all results are as new as their sources")
        return 0
    subprocess.run(["cmake", "--build", options.build, "--target", "experiments"], check=True)
    sections = {name: match[0] for name, match in read().items()}
    holds = True
    for name in options.names or RESULTS:
        print(f"== {name}", file=sys.stderr, flush=True)
        section, bound = run(name, options.build.absolute())
        if section is None:
            print("skipped: its data are not there, what was known of it stays", file=sys.stderr, flush=True)
            continue
        sections[name] = section
        print(f"{'holds' if bound else 'DOES NOT HOLD'}", file=sys.stderr, flush=True)
        holds = holds and bound
        write(sections)
    return 0 if holds else 1


if __name__ == "__main__":
    os.environ.setdefault("STRATA_DATA", str(ROOT.parent / "shared/data"))
    sys.exit(main())
