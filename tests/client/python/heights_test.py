"""Map.heights against a real stratad: a floor with a table on it."""
import os
import unittest

import numpy as np

import strata
from support import ServerTest, grid

PROGRAM = os.environ["STRATA_PROGRAM"]


class HeightsTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.db.create_map("room")
        floor = grid((-3, 3), (-2, 2), lambda x, y: 0 * x, step=0.03)
        roof = grid((-1, 1), (-1, 1), lambda x, y: 0 * x + 2.5, step=0.03)
        cls.map.upload(np.concatenate([floor, roof]), pose=((0, 0, 0), (0, 0, 0, 1)), align=False)
        cls.map.wait(timeout=60)

    def at(self, heights, values, x, y):
        column, row = np.floor((np.array([x, y]) - heights.origin) / heights.cell_size).astype(int)
        return values[row, column]

    def test_highest_and_ground(self):
        highest = self.map.heights(program=PROGRAM)
        ground = self.map.heights("ground", program=PROGRAM)
        self.assertEqual(highest.z.shape, ground.z.shape)
        self.assertAlmostEqual(self.at(highest, highest.z, 0.05, 0.05), 2.5, delta=0.01)
        self.assertAlmostEqual(self.at(highest, highest.z, 2.05, 0.05), 0.0, delta=0.01)
        self.assertAlmostEqual(self.at(ground, ground.z, 0.05, 0.05), 0.0, delta=0.01)
        self.assertGreater(self.at(ground, ground.sigma, 0.05, 0.05), 0.0)
        self.assertEqual(self.at(ground, ground.classes, 0.05, 0.05), strata.heights.GAP)
        self.assertEqual(self.at(ground, ground.classes, 2.05, 0.05), strata.heights.TRAVERSABLE)
        self.assertIsNone(highest.classes)
        self.assertIsNone(highest.projection)

    def test_a_part(self):
        part = self.map.heights("kalman", ((-2, -1), (2, 1)), program=PROGRAM)
        self.assertEqual(part.z.shape, (20, 40))
        np.testing.assert_allclose(part.origin, (-2, -1))
        self.assertEqual(self.map.heights(level=1, program=PROGRAM).cell_size, 0.2)

    def test_what_has_no_heights_says_why(self):
        with self.assertRaisesRegex(strata.StrataError, "the map lies within"):
            self.map.heights(region=((100, 100), (110, 110)), program=PROGRAM)
        with self.assertRaisesRegex(strata.StrataError, "no surfaces"):
            self.db.create_map("empty").heights(program=PROGRAM)
        with self.assertRaises(ValueError):
            self.map.heights("lowest", program=PROGRAM)


if __name__ == "__main__":
    unittest.main()
