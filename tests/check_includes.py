#!/usr/bin/env python3
"""Holds every #include of the tree against the table of allowed arrows, and every folder to a size.

A room may include itself and the rooms named beside it, nothing else of ours; of the rooms inside it each may include
itself and those below. External headers that only one room may know are listed below. Prints each wrong arrow, and each
folder where nobody finds anything by its name any more, and exits 1.
"""
import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# room: rooms it may include. The rows of core are those of core/README.md; a change here is a decision.
ARROWS = {
    "core/common": [],
    "core/geometry": ["core/common"],
    "core/cloud": ["core/geometry", "core/common"],
    "core/mesh": ["core/cloud", "core/geometry", "core/common"],
    "core/occupancy": ["core/mesh", "core/cloud", "core/geometry", "core/common"],
    "core/mls": ["core/cloud", "core/geometry", "core/common"],
    "core/world": ["core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/egomotion": ["core/world", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/codec": ["core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/planes": ["core/world", "core/codec", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/registration": ["core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/posegraph": ["core/registration", "core/planes", "core/world", "core/mls", "core/cloud", "core/geometry",
                       "core/common"],
    "core/tracking": ["core/posegraph", "core/registration", "core/egomotion", "core/world", "core/mls", "core/cloud",
                      "core/geometry", "core/common"],
    "core/classification": ["core/planes", "core/world", "core/codec", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/collision": ["core/world", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/completion": ["core/registration", "core/occupancy", "core/mesh", "core/world", "core/codec", "core/mls", "core/cloud", "core/geometry",
                        "core/common"],
    "core/planning": ["core/occupancy", "core/mesh", "core/cloud", "core/world", "core/mls", "core/geometry", "core/common"],
    "core/storage": ["core/world", "core/codec", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/api": ["core/world", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/engine": ["core/"],
    "proto": ["core/api", "core/world", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "server": ["proto", "core/api", "core/engine", "core/world", "core/mls", "core/cloud", "core/geometry",
               "core/common"],
    "client/python": ["core/codec", "core/mls"],
    "client/sdk": ["proto", "core/api", "core/codec", "core/world", "core/mls", "core/cloud", "core/geometry",
                   "core/common"],
    "client/formats": ["core/occupancy", "core/posegraph", "core/egomotion", "core/world", "core/mls", "core/mesh", "core/cloud", "core/geometry", "core/common"],
    "client/cli": ["client/sdk", "client/formats", "core/api", "core/engine", "core/completion", "core/codec", "core/registration",
                   "core/classification", "core/posegraph", "core/egomotion", "core/occupancy", "core/world", "core/mls", "core/mesh", "core/cloud", "core/geometry",
                   "core/common"],
    "client/ros2": ["client/sdk", "client/formats", "client/cli/terminal", "core/api", "core/codec", "core/world",
                    "core/mls", "core/cloud", "core/geometry", "core/common"],
}

# room: the rooms inside it, highest first, as in core/README.md; HERE: the files of the folder itself.
HERE = "."
STOREYS = {
    "core/mls": ["elevation", HERE],
    "core/world": ["things", HERE],
    "core/classification": [HERE, "places", "learners", "amn", "features"],
    "core/egomotion": ["smoothing", HERE],
    "core/planning": ["floors", HERE, "ground"],
    "core/planes": ["models", HERE],
    "core/registration": ["clouds", HERE],
    "core/posegraph": ["alignment", "closures", "solver", "costs", HERE],
    "core/storage": ["postgresql", "sqlite", HERE],
    "core/engine": [HERE, "doors", "jobs", "repair", "consistency", "labels", "plans", "objects", "models", "ingest", "tiles", "scans", "map"],
    "client/formats": ["planes", "foxglove", "bags", "motion", "shapes", HERE, "packets", "survey", "laz", "parsing", "grid"],
    "client/cli": [HERE, "completion", "context", "map", "scan", "posegraph", "plan", "classifier", "planes", "objects", "egomotion", "job", "heights", "mesh", "picture", "terminal"],
}

# Sources a folder may hold.
MOST_FILES = 40

# external header pattern: rooms that may include it
EXTERNAL = {
    r"sqlite3\.h": ["core/storage/sqlite", "client/formats/bags"],
    r"libpq-fe\.h": ["core/storage/postgresql"],
    r"ceres/.*": ["core/posegraph/costs", "core/posegraph/solver", "core/egomotion/smoothing"],
    r"(grpc|grpcpp)/.*|google/protobuf/.*|.*\.pb\.h": ["proto", "server", "client/sdk"],
    r"openssl/.*": ["server"],
    r"boost/(asio|beast)/.*": ["server/web"],
    r"prometheus/.*": ["server/metrics"],
    r"pcl/.*": ["core/registration", "core/planes", "core/classification", "core/mesh", "client/formats"],
    r"fcl/.*": ["core/collision"],
    r"assimp/.*|urdf_.*/.*": ["client/formats/shapes"],
    r"libqhull_r/.*|meshoptimizer\.h": ["core/mesh"],
    r"GeographicLib/.*": ["core/egomotion"],
    r"yaml-cpp/.*": ["client/formats/motion"],
    r"tiffio\.h": ["client/formats/grid"],
    r"expat\.h": ["client/formats/survey"],
    r"pcap/.*": ["client/formats/packets"],
    r"dds/.*|ros_messages\.h": ["client/ros2"],
    r"(bzlib|lz4frame|zlib)\.h": ["client/formats/bags"],
    r"(thread|mutex|condition_variable)": ["core/engine", "server", "client", "core/common", "core/storage/postgresql"],
}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
OURS = re.compile(r"^(core|client|server|proto|tests|deploy)/")


def room_of(path: str) -> str | None:
    rooms = [room for room in ARROWS if path.startswith(room + "/")]
    return max(rooms, key=len) if rooms else None


def storey_of(room: str, path: str) -> str:
    """Which of STOREYS[room] the file is in."""
    inside = path.removeprefix(room + "/")
    return inside.split("/")[0] if "/" in inside else HERE


def points_up(room: str, name: str, target: str) -> bool:
    """Whether a room inside `room` includes one that stands above it, or one of the two is in no list."""
    storeys = STOREYS.get(room)
    if storeys is None or not target.startswith(room + "/"):
        return False
    own, other = storey_of(room, name), storey_of(room, target)
    return own not in storeys or other not in storeys or storeys.index(other) < storeys.index(own)


def crowded(files: list[pathlib.Path]) -> list[str]:
    sizes = collections.Counter(path.parent.relative_to(ROOT).as_posix() for path in files)
    return [f"{folder}: {size} files, more than {MOST_FILES}: divide it into rooms"
            for folder, size in sizes.items() if size > MOST_FILES]


def check(path: pathlib.Path) -> list[str]:
    name = path.relative_to(ROOT).as_posix()
    room = room_of(name)
    if room is None:
        return [f"{name}: lies in no room of the table in tests/check_includes.py"]
    allowed = [room, *ARROWS[room]]
    faults = []
    for bracket, target in INCLUDE.findall(path.read_text(encoding="utf-8")):
        if OURS.match(target):
            generated = target.startswith("proto/") and target.endswith(".pb.h")
            if not any(target.startswith(a if a.endswith("/") else a + "/") for a in allowed):
                faults.append(f"{name}: {room} may not include {target}")
            elif points_up(room, name, target):
                faults.append(f"{name}: {target} stands above it, or one of them in no room of STOREYS")
            elif bracket == "<":
                faults.append(f"{name}: write \"{target}\", it is ours")
            elif not generated and not (ROOT / target).is_file():
                faults.append(f"{name}: {target} does not exist")
        for pattern, rooms in EXTERNAL.items():
            if re.fullmatch(pattern, target) and not any(name.startswith(r + "/") for r in rooms):
                faults.append(f"{name}: only {', '.join(rooms)} may include {target}")
    return faults


def main() -> int:
    files = [p for top in ("core", "client", "server", "proto") for p in sorted((ROOT / top).rglob("*"))
             if p.suffix in (".h", ".cc")]
    tests = [p for p in sorted((ROOT / "tests").rglob("*")) if p.suffix in (".h", ".cc", ".py", ".cmake")]
    faults = [fault for path in files for fault in check(path)] + crowded(files + tests)
    print("\n".join(faults) if faults else f"include arrows: {len(files)} files, all as in the table")
    return 1 if faults else 0


sys.exit(main())
