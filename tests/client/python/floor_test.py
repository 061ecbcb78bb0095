"""Floors of a bridge: as the client has them, and as nav2's map_server would read what the command line wrote."""
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

import strata
from strata import floors
from support import DECK_M, ServerTest, bridge

UNKNOWN = -1


def read_nav2(path):
    """(ny, nx) occupancies 0 to 100 or -1, row 0 the lowest y, and the header: as map_server's documentation has it."""
    header = {}
    for line in path.read_text().splitlines():
        key, _, value = line.partition(":")
        header[key.strip()] = value.strip()
    origin = [float(number) for number in header["origin"].strip("[]").split(",")]
    data = (path.parent / header["image"].strip('"')).read_bytes()
    magic, width, height, most, pixels = data.split(maxsplit=4)
    width, height = int(width), int(height)
    assert magic == b"P5" and int(most) == 255 and header["negate"] == "0"
    start = len(data) - width * height  # pixels may begin with what looks like white space
    pixels = np.frombuffer(data[start:], np.uint8).reshape(height, width)[::-1]
    occupancy = (255 - pixels.astype(float)) / 255
    free, occupied = float(header["free_thresh"]), float(header["occupied_thresh"])
    between = UNKNOWN if header["mode"] == "trinary" else np.rint((occupancy - free) / (occupied - free) * 100)
    values = np.where(occupancy > occupied, 100, np.where(occupancy < free, 0, between)).astype(int)
    return values, origin, float(header["resolution"])


class FloorTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.db.create_map("bridge")
        points = bridge()
        parapet = points[(points[:, 2] > DECK_M - 0.01) & (np.abs(points[:, 1]) > 1.8)]
        rise = np.linspace(0.1, 1.0, 10)
        points = np.concatenate([points, *(parapet + (0, 0, z) for z in rise)])
        cls.map.upload(points, trajectory="run", sequence=1)
        cls.map.wait(timeout=120)
        cls.out = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))

    def export(self, *words, expect=0):
        done = subprocess.run([os.environ["STRATA_PROGRAM"], "--server", self.server.address, "map", "export", "bridge",
                               "--format", "nav2", *words], capture_output=True, text=True)
        self.assertEqual(done.returncode, expect, done.stderr)
        return done

    def value(self, read, x, y):
        values, origin, resolution = read
        column, row = int((x - origin[0]) // resolution), int((y - origin[1]) // resolution)
        inside = 0 <= row < values.shape[0] and 0 <= column < values.shape[1]
        return values[row, column] if inside else UNKNOWN

    def test_the_deck_is_one_floor_and_what_is_below_another(self):
        over = self.map.floors((0, 0, DECK_M))
        under = self.map.floors((0, 0, 0))
        self.assertEqual(len(over.floors), 2)
        self.assertEqual({over.at, under.at}, {0, 1})
        self.assertGreaterEqual(len(over.links), 1)
        for link in over.links:
            self.assertEqual(link.floors, (0, 1))
            self.assertGreater(link.slope, 0.1)
        self.assertIsNone(self.map.floors((100, 100, 0)).at)
        self.assertEqual(self.map.floors(profile={"radius": 5}).floors, [])
        with self.assertRaises(strata.InvalidArgument):
            self.map.floors(profile={"radius": float("nan")})

    def test_what_was_inferred_is_minded_if_asked_to(self):
        self.assertEqual(self.map.floors().message, "")
        self.assertIn("nothing is inferred", self.map.floors(inferred="obstacle").message)
        self.assertIn("nothing is inferred", self.map.places(inferred="obstacle").message)
        with self.assertRaises(ValueError):
            self.map.floors(inferred="wall")

    def test_files_say_what_the_map_says(self):
        self.export("--at", f"0,0,{DECK_M}", "--out", str(self.out / "over.yaml"))
        self.export("--at", "0,0,0", "--out", str(self.out / "under"))
        over, under = read_nav2(self.out / "over.yaml"), read_nav2(self.out / "under.yaml")
        self.assertEqual(self.value(over, 0, 0), 0)
        self.assertEqual(self.value(over, 0, 1.9), 100)   # the parapet
        self.assertEqual(self.value(over, 0, 5), UNKNOWN)  # beside and below the deck
        self.assertEqual(self.value(under, 0, 0), 0)
        self.assertEqual(self.value(under, 0, 5), 0)
        self.assertEqual(self.value(under, 0, 1.9), 0)
        self.assertEqual(self.value(under, 0, 30), UNKNOWN)
        for (values, origin, resolution), z in ((over, DECK_M), (under, 0)):
            told = self.map.floors((0, 0, z), cells=True)
            floor = told.floors[told.at]
            np.testing.assert_allclose(floor.origin, origin[:2], atol=1e-6)
            self.assertEqual(resolution, told.cell_size)
            np.testing.assert_array_equal(values == 0, floor.grid == floors.FREE)
            np.testing.assert_array_equal(values == 100, floor.grid == floors.OCCUPIED)
            self.assertAlmostEqual(floor.area, (values == 0).sum() * resolution ** 2, places=6)

    def test_free_cells_are_reached(self):
        random = np.random.default_rng(1)
        told = self.map.floors(cells=True)
        for floor in told.floors:
            rows, columns = np.nonzero(floor.grid == floors.FREE)
            for i in random.choice(len(rows), 50):
                x, y = (np.array([columns[i], rows[i]]) + 0.5) * told.cell_size + floor.origin
                levels = self.map.surfaces([(x, y)])[0]
                self.assertTrue(any(self.map.plan(floor.place, (x, y, z)) for z in levels["z"]), (x, y))

    def test_costs_and_all_floors_at_once(self):
        self.export("--mode", "scale", "--out", str(self.out / "all"))
        files = sorted(file.name for file in self.out.glob("all*"))
        self.assertEqual(files, ["all-0.pgm", "all-0.yaml", "all-1.pgm", "all-1.yaml"])
        values = read_nav2(self.out / "all-0.yaml")[0]
        self.assertEqual(set(np.unique(values)) - {0, 100, 48, 82}, set())
        self.assertIn(82, values)

    def test_what_is_not_there(self):
        self.assertIn("no floor 7", self.export("--floor", "7", "--out", str(self.out / "x"), expect=1).stderr)
        self.assertIn("no floor at", self.export("--at", "90,0,0", "--out", str(self.out / "x"), expect=1).stderr)
        self.assertFalse(list(self.out.glob("x*")))


if __name__ == "__main__":
    unittest.main()
