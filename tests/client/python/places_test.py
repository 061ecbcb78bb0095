"""Map.places against a real stratad: two rooms on a corridor, drawn as points."""
import math
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

import strata
from strata import places
from support import ServerTest

STEP_M = 0.04


def plate(x, y, z):
    """Points over two ranges and at one value; `x`, `y`, `z` are (low, high) or a number."""
    axes = [np.arange(v[0], v[1], STEP_M) if isinstance(v, tuple) else np.array([v]) for v in (x, y, z)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def storey():
    """A corridor of 16 m × 2 m along x, and two rooms of 6 m × 5 m to its north, each with a door of 1 m."""
    height = (0.1, 1.6)
    ground = plate((0, 16), (-1, 6.2), 0.0)
    walls = [plate((0, 16), -1.0, height), plate((0, 16), 6.2, height), plate(0.0, (-1, 6.2), height),
             plate(16.0, (-1, 6.2), height), plate(8.0, (1, 6.2), height)]
    for low, high in ((0, 3.5), (4.5, 11.5), (12.5, 16)):
        walls.append(plate((low, high), 1.0, height))
        walls.append(plate((low, high), 1.15, height))
    return np.concatenate([ground, *walls]).astype(np.float32)


class PlacesTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.db.create_map("storey")
        cls.map.upload(storey() - (8.0, 0.0, 1.0), pose=((8.0, 0.0, 1.0), (0, 0, 0, 1)), align=False)
        cls.map.wait(timeout=120)

    def test_rooms_hang_on_the_corridor_by_doorways(self):
        told = self.map.places(cells=True)
        self.assertEqual(told.floor, 0)
        kind = {}
        for name, at in {"west": (4, 4), "east": (12, 4), "corridor": (8, 0)}.items():
            column, row = ((np.array(at) - told.origin) / told.cell_size).astype(int)
            kind[name] = told.places[told.grid[row, column]].kind
        self.assertEqual(kind, {"west": "room", "east": "room", "corridor": "corridor"})
        free = np.count_nonzero(told.grid != places.NO_PLACE)
        self.assertAlmostEqual(sum(place.area for place in told.places), free * told.cell_size ** 2, places=6)
        floor = self.map.floors(cells=True).floors[0]
        self.assertAlmostEqual(floor.area, free * told.cell_size ** 2, places=6)
        for place in told.places:
            for other in place.neighbours:
                self.assertNotEqual(told.places[other].kind, place.kind)

    def test_what_is_not_there_is_said(self):
        with self.assertRaisesRegex(strata.NotFound, "no floor 9"):
            self.map.places(9)
        with self.assertRaises(strata.NotFound):
            self.map.places(at=(100, 100))
        with self.assertRaises(strata.InvalidArgument):
            self.map.places(profile={"radius": math.nan})
        self.assertEqual(self.map.places(profile={"radius": 5}).places, [])
        self.assertIsNone(self.map.places().grid)

    def test_the_command_line_draws_them(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "places.png"
            done = subprocess.run([os.environ["STRATA_PROGRAM"], "--server", self.server.address, "map", "places", "storey",
                                   str(out)], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("corridor", done.stdout)
            self.assertEqual(out.read_bytes()[:4], b"\x89PNG")


if __name__ == "__main__":
    unittest.main()
