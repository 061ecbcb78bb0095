"""Where to look next, on a bridge that was seen from one end."""
import unittest

import numpy as np

import strata
from support import DECK_M, ServerTest, bridge


class ExploreTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.db.create_map("bridge")
        points = bridge() - (-15, 0, 1)
        cls.map.upload(points, ((-15, 0, 1), (0, 0, 0, 1)), trajectory="run", sequence=1, align=False)
        cls.map.wait(timeout=120)

    def test_views_are_where_nobody_looked(self):
        told = self.map.explore((-15, 0, 0), count=3, max_range=8, min_bits=20)
        self.assertTrue(told, told.message)
        self.assertEqual(told.reason, "views")
        self.assertLessEqual(len(told), 3)
        self.assertEqual(told.scans, 1)
        self.assertEqual(told.region.shape, (2, 3))
        for view in told:
            self.assertEqual(view.pose.shape, (4, 4))
            self.assertAlmostEqual(view.pose[2, 3], view.place[2] + 1, places=6)
            self.assertGreater(view.gain_bits, 20)
            self.assertTrue(self.map.plan((-15, 0, 0), view.place))
        up = self.map.explore((-15, 0, 0), count=1, max_range=4, min_bits=5, bits_per_m=0,
                              region=[(-4, -2, DECK_M + 0.3), (4, 2, DECK_M + 2)])
        self.assertTrue(up, up.message)

    def test_what_is_not_possible_says_why(self):
        self.assertEqual(self.map.explore((500, 0)).reason, "start_not_on_surface")
        self.assertFalse(self.map.explore((-15, 0, 0), min_bits=1e8))
        with self.assertRaisesRegex(ValueError, "rnage"):
            self.map.explore((-15, 0, 0), rnage=3)
        with self.assertRaisesRegex(ValueError, "region"):
            self.map.explore((-15, 0, 0), region=[1, 2, 3])
        with self.assertRaisesRegex(strata.InvalidArgument, "count"):
            self.map.explore((-15, 0, 0), count=0)
        with self.assertRaisesRegex(strata.InvalidArgument, "resolution"):
            self.map.explore((-15, 0, 0), resolution=0.01)
        with self.assertRaises(strata.InvalidArgument):
            self.map.explore((np.nan, 0, 0))


if __name__ == "__main__":
    unittest.main()
