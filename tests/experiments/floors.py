#!/usr/bin/python3
"""Floors of maps through a real server: how many there are, how long that takes, and whether the planner agrees.

    PYTHONPATH=build/release/client/python tests/experiments/floors.py --build build/release --maps DIR NAME=LEAST:MOST…
        [--samples 10000] [--seconds 1]

DIR holds maps, which are not changed; NAME=LEAST:MOST says how many floors the map has. Free cells drawn from each floor
are asked for as goals of plans from its place: a cell that no level of is reached is a contradiction. Exits 1 where the
number is another, a cell contradicts, or the floors of prepared tiles take longer than --seconds. Needs python3-numpy.
"""
import argparse
import os
import pathlib
import sys
import time

import numpy as np

import strata
from strata import floors as grids
from stratad import Stratad


def contradictions(world, told, samples, random):
    """(asked, contradicted), samples spread over the floors by area."""
    total = sum(floor.area for floor in told.floors)
    asked = wrong = 0
    for floor in told.floors:
        rows, columns = np.nonzero(floor.grid == grids.FREE)
        drawn = random.choice(len(rows), max(1, round(samples * floor.area / total)))
        places = (np.stack([columns[drawn], rows[drawn]], axis=1) + 0.5) * told.cell_size + floor.origin
        for (x, y), levels in zip(places, world.surfaces(places)):
            asked += 1
            wrong += not any(world.plan(floor.place, (x, y, z)) for z in levels["z"])
    return asked, wrong


def measure(world, least, most, options, random):
    begin = time.monotonic()
    world.floors()
    cold = time.monotonic() - begin
    warm = []
    for _ in range(5):
        begin = time.monotonic()
        told = world.floors()
        warm.append(time.monotonic() - begin)
    asked, wrong = contradictions(world, world.floors(cells=True), options.samples, random)
    count = len(told.floors)
    good = least <= count <= most and wrong == 0 and min(warm) <= options.seconds
    print(f"| {world.name} | {count} | {least} to {most} | {len(told.links)} | {cold:.2f} | {min(warm):.3f} | {asked} | {wrong} "
          f"| {'yes' if good else 'NO'} |", flush=True)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--maps", type=pathlib.Path, required=True)
    parser.add_argument("--samples", type=int, default=10000)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("expected", nargs="+", metavar="NAME=LEAST:MOST")
    options = parser.parse_args()
    server = Stratad(options.build, options.maps, log=os.devnull)
    try:
        random = np.random.default_rng(1)
        print("| map | floors | expected | links | first call [s] | prepared [s] | cells asked | contradictions | holds |")
        print("|---|---|---|---|---|---|---|---|---|")
        good = True
        with strata.connect(server.address) as db:
            for text in options.expected:
                name, _, bounds = text.partition("=")
                least, _, most = bounds.partition(":")
                good &= measure(db.map(name), int(least), int(most or least), options, random)
        return 0 if good else 1
    finally:
        server.stop()


if __name__ == "__main__":
    sys.exit(main())
