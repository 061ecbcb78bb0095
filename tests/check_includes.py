#!/usr/bin/env python3
"""Holds every #include of the tree against the table of allowed arrows.

A room may include itself and the rooms named beside it, nothing else of ours; external headers that only one room
may know are listed below. Prints each wrong arrow and exits 1.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# room: rooms it may include. The same table as in README.md and core/README.md; a change here is a decision.
ARROWS = {
    "core/common": [],
    "core/geometry": ["core/common"],
    "core/cloud": ["core/geometry", "core/common"],
    "core/mls": ["core/cloud", "core/geometry", "core/common"],
    "core/world": ["core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/codec": ["core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/planes": ["core/codec", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/registration": ["core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/posegraph": ["core/registration", "core/planes", "core/world", "core/mls", "core/cloud", "core/geometry",
                       "core/common"],
    "core/classification": ["core/planes", "core/codec", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/planning": ["core/world", "core/mls", "core/geometry", "core/common"],
    "core/storage": ["core/world", "core/codec", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/api": ["core/world", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "core/engine": ["core/"],
    "proto": ["core/api", "core/world", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "server": ["proto", "core/api", "core/engine", "core/world", "core/mls", "core/cloud", "core/geometry",
               "core/common"],
    "client/sdk": ["proto", "core/api", "core/codec", "core/world", "core/mls", "core/cloud", "core/geometry",
                   "core/common"],
    "client/formats": ["core/posegraph", "core/mls", "core/cloud", "core/geometry", "core/common"],
    "client/cli": ["client/sdk", "client/formats", "core/api", "core/engine", "core/codec", "core/registration",
                   "core/classification", "core/posegraph", "core/world", "core/mls", "core/cloud", "core/geometry",
                   "core/common"],
}

# external header pattern: rooms that may include it
EXTERNAL = {
    r"sqlite3\.h": ["core/storage/sqlite"],
    r"ceres/.*": ["core/posegraph/costs", "core/posegraph/solver"],
    r"(grpc|grpcpp)/.*|google/protobuf/.*|.*\.pb\.h": ["proto", "server", "client/sdk"],
    r"openssl/.*": ["server"],
    r"prometheus/.*": ["server/metrics"],
    r"pcl/.*": ["core/registration", "core/planes", "core/classification", "client/formats"],
    r"(thread|mutex|condition_variable)": ["core/engine", "server", "client", "core/common"],
}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
OURS = re.compile(r"^(core|client|server|proto|tests|deploy)/")


def room_of(path: str) -> str | None:
    rooms = [room for room in ARROWS if path.startswith(room + "/")]
    return max(rooms, key=len) if rooms else None


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
    faults = [fault for path in files for fault in check(path)]
    print("\n".join(faults) if faults else f"include arrows: {len(files)} files, all as in the table")
    return 1 if faults else 0


sys.exit(main())
