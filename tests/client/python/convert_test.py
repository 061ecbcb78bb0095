"""Maps as objects of other libraries."""
import importlib.util
import os
import subprocess
import sys
import unittest

import numpy as np

import strata
from strata import convert
from support import DECK_M, ServerTest, bridge


def needs(library):
    return unittest.skipUnless(importlib.util.find_spec(library), f"{library} is not here: apt install python3-{library}")


class ConvertTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.db.create_map("bridge")
        cls.points = bridge()
        cls.rgb = np.where(cls.points[:, 2:] > 0.1, [200, 30, 10], 0).astype(np.uint8)
        cls.ack = cls.map.upload(cls.points, rgb=cls.rgb, trajectory="run", sequence=1, align=False)
        cls.map.wait(timeout=60)
        cls.tiles = cls.map.fetch()

    def test_importing_strata_imports_none_of_them(self):
        loaded = subprocess.run([sys.executable, "-c", "import sys, strata; print([m for m in ('open3d', 'xarray') if m in sys.modules])"],
                                capture_output=True, text=True, check=True, env=os.environ).stdout
        self.assertEqual(loaded, "[]\n")

    def test_points_with_all_columns_in_one(self):
        points = self.map.points(self.ack).structured()
        self.assertEqual(points.dtype, strata.POINT)
        np.testing.assert_array_equal(convert.xyz(points), self.points.astype(np.float32))
        np.testing.assert_array_equal(points["rgb"], self.rgb)
        self.assertTrue(np.isnan(points["intensity"]).all())
        self.assertFalse(points["label"].any())

    def test_surfaces_of_what_a_map_gives(self):
        every = convert.surfaces_of(self.tiles)
        self.assertEqual(len(every), sum(len(tile.surfaces) for tile in self.tiles.values()))
        one = next(iter(self.tiles.values()))
        self.assertIs(convert.surfaces_of(one), one.surfaces)
        self.assertEqual(len(convert.surfaces_of({})), 0)
        with self.assertRaisesRegex(ValueError, "SURFACE"):
            convert.surfaces_of(np.zeros((3, 3)))

    @needs("xarray")
    def test_a_grid_has_the_deck_above_the_ground(self):
        grid = convert.xarray_surfaces(self.tiles, self.map.cell_size)
        under = grid.sel(x=0.05, y=0.05, method="nearest")
        np.testing.assert_allclose(under.z.values[:2], [0, DECK_M], atol=0.01)
        beside = grid.sel(x=0.05, y=6.05, method="nearest")
        self.assertEqual(int(beside.z.notnull().sum()), 1)
        every = convert.surfaces_of(self.tiles)
        self.assertEqual(int(grid.z.notnull().sum()), len(every))
        self.assertAlmostEqual(float(grid.z.sum()), float(every["z"].astype(float).sum()), places=1)
        self.assertEqual((grid.z.units, grid.traversability.dtype), ("m", np.uint8))
        np.testing.assert_allclose(np.diff(grid.x), 0.1, atol=1e-9)
        for _, surface in zip(range(200), np.random.default_rng(3).permutation(every)):
            column = grid.sel(x=surface["x"], y=surface["y"], method="nearest")
            self.assertLess(abs(float(column.x) - surface["x"]) + abs(float(column.y) - surface["y"]), 1e-6)
            self.assertIn(surface["z"], column.z.values)
        with self.assertRaisesRegex(ValueError, "nothing"):
            convert.xarray_surfaces({}, 0.1)
        with self.assertRaisesRegex(ValueError, "coarser"):
            convert.xarray_surfaces(every, 1e-4)

    @needs("xarray")
    def test_heights_as_a_grid(self):
        heights = self.map.heights("ground", program=os.environ["STRATA_PROGRAM"])
        grid = convert.xarray_heights(heights)
        self.assertAlmostEqual(float(grid.z.sel(x=0.05, y=6.05, method="nearest")), 0, delta=0.01)
        self.assertEqual(grid.classes.dims, ("y", "x"))
        self.assertEqual(grid.attrs, {})

    @needs("open3d")
    def test_clouds_and_meshes_for_open3d(self):
        cloud = convert.open3d_cloud(self.tiles)
        every = convert.surfaces_of(self.tiles)
        np.testing.assert_array_equal(np.asarray(cloud.points), convert.xyz(every))
        red = np.asarray(cloud.colors)[every["z"] > 1]
        np.testing.assert_allclose(red, np.tile(np.array([200, 30, 10]) / 255, (len(red), 1)), atol=0.02)
        moved = np.eye(4)
        moved[0, 3] = 5
        scan = convert.open3d_cloud(self.map.points(self.ack), moved)
        np.testing.assert_allclose(np.asarray(scan.points), self.points + [5, 0, 0], atol=1e-5)
        mesh = self.map.mesh([(-3, -1, 2), (3, 1, 4)], voxel=0.2, program=os.environ["STRATA_PROGRAM"])
        made = convert.open3d_mesh(mesh)
        self.assertEqual((len(made.vertices), len(made.triangles)), (len(mesh.vertices), len(mesh.triangles)))


if __name__ == "__main__":
    unittest.main()
