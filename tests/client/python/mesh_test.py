"""Map.mesh against a real stratad: what comes back is the surface that was uploaded."""
import os
import unittest

import numpy as np

import strata
from support import ServerTest, grid

PROGRAM = os.environ["STRATA_PROGRAM"]


class MeshTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.db.create_map("floor")
        # 6 × 4 m at z = 1.5, seen from 2 m above its middle.
        points = grid((-3, 3), (-2, 2), lambda x, y: 0 * x - 2.0, step=0.03)
        cls.map.upload(points, pose=((0, 0, 3.5), (0, 0, 0, 1)), align=False)
        cls.map.wait(timeout=60)

    def test_the_floor_comes_back_as_triangles(self):
        mesh = self.map.mesh(program=PROGRAM)
        self.assertEqual((mesh.vertices.shape[1], mesh.normals.shape), (3, mesh.vertices.shape))
        np.testing.assert_allclose(mesh.vertices[:, 2], 1.5, atol=0.01)
        self.assertAlmostEqual(mesh.area_m2, 24, delta=2)
        self.assertFalse(mesh.closed)
        self.assertGreater(mesh.boundary_edges, 100)
        self.assertLess(mesh.triangles.max(), len(mesh.vertices))
        a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
        cross = np.cross(b - a, c - a)
        self.assertAlmostEqual(np.linalg.norm(cross, axis=1).sum() / 2, mesh.area_m2, places=3)
        self.assertTrue((cross[:, 2] > 0).all(), "faces up, to the sensor")
        self.assertTrue((mesh.normals[:, 2] > 0.9).all())

    def test_a_part_of_it_with_fewer_triangles_and_another_method(self):
        part = self.map.mesh(((-1, -1), (1, 1)), simplify=200, program=PROGRAM)
        self.assertLessEqual(len(part.triangles), 200)
        self.assertAlmostEqual(part.area_m2, 4, delta=1)
        closed = self.map.mesh(((-1, -1, 1), (1, 1, 2)), method="contour", voxel=0.1, program=PROGRAM)
        self.assertTrue(closed.closed)
        self.assertEqual(closed.boundary_edges, 0)

    def test_what_cannot_be_meshed_says_why(self):
        with self.assertRaisesRegex(strata.StrataError, "the map lies within"):
            self.map.mesh(((100, 100), (110, 110)), program=PROGRAM)
        with self.assertRaisesRegex(strata.StrataError, "no integrated scans"):
            self.db.create_map("empty").mesh(program=PROGRAM)
        with self.assertRaises(ValueError):
            self.map.mesh(method="poisson", program=PROGRAM)
        with self.assertRaises(FileNotFoundError):
            self.map.mesh(program="no-such-strata")


if __name__ == "__main__":
    unittest.main()
