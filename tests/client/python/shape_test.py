"""Shapes over and under a bridge."""
import unittest

import numpy as np

import strata
from strata import shape
from support import DECK_M, ServerTest, bridge


def box_mesh(size, low):
    size, low = np.asarray(size, float), np.asarray(low, float)
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]) * size + low
    sides = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6),
             (1, 3, 5), (3, 7, 5)]
    return corners, np.array(sides)


class ShapeTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.db.create_map("bridge")
        cls.map.upload(bridge(), trajectory="run", sequence=1)
        cls.map.wait(timeout=120)
        cls.under = cls.map.plan((0, -6, 0), (0, 6, 0))

    def test_a_cart_goes_under_the_bridge_and_a_mast_does_not(self):
        cart = shape.box((1.2, 0.6, 1.0), (0, 0, 0.5))
        free = self.map.check_shape(self.under, parts=[cart])
        self.assertTrue(free, free.message)
        self.assertAlmostEqual(free.length, self.under.length, places=6)
        mast = self.map.check_shape(self.under, parts=[cart, shape.cylinder(0.05, 4.0, (0, 0, 2.0))])
        self.assertFalse(mast)
        self.assertAlmostEqual(mast.contacts[0].where[2], DECK_M, delta=0.2)
        self.assertLess(mast.free_length, mast.length)
        self.assertGreater(mast.contacts[0].depth, 0.01)

    def test_meshes_are_as_solid_as_boxes(self):
        for height, free in ((2.5, True), (3.5, False)):
            mesh = self.map.check_shape(self.under, box_mesh((1.0, 0.5, height - 0.2), (-0.5, -0.25, 0.2)))
            solid = self.map.check_shape(self.under, parts=[shape.box((1.0, 0.5, height - 0.2), (0, 0, 0.1 + height / 2))])
            self.assertEqual(bool(mesh), free, mesh.message)
            self.assertEqual(bool(solid), free, solid.message)
            self.assertAlmostEqual(mesh.free_length, solid.free_length, delta=0.03)  # a step

    def test_poses_and_unknown_ground(self):
        pose = np.eye(4)
        pose[:3, 3] = (0, 0, DECK_M)
        cart = shape.box((1.2, 0.6, 1.0), (0, 0, 0.5))
        self.assertTrue(self.map.check_shape([pose], parts=[cart]))
        pose[:3, 3] = (0, 30, 0)
        self.assertTrue(self.map.check_shape([pose], parts=[cart]))
        blocked = self.map.check_shape([pose], parts=[cart], unknown="blocked")
        self.assertFalse(blocked)
        self.assertTrue(blocked.contacts[0].unknown)

    def test_what_is_not_possible_says_why(self):
        cart = shape.box((1.2, 0.6, 1.0))
        with self.assertRaisesRegex(ValueError, "places"):
            self.map.check_shape([1, 2, 3], parts=[cart])
        with self.assertRaisesRegex(ValueError, "vertex beyond"):
            self.map.check_shape(self.under, (np.zeros((3, 3)), [(0, 1, 3)]))
        with self.assertRaisesRegex(ValueError, "blocked"):
            self.map.check_shape(self.under, parts=[cart], unknown="maybe")
        with self.assertRaisesRegex(strata.InvalidArgument, "neither triangles"):
            self.map.check_shape(self.under)
        with self.assertRaisesRegex(strata.InvalidArgument, "millimetres"):
            self.map.check_shape(self.under, box_mesh((1200, 600, 1000), (0, 0, 0)))


if __name__ == "__main__":
    unittest.main()
