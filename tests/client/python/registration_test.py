"""strata.register against motions that are known."""
import os
import pathlib
import tempfile
import unittest
from unittest import mock

import numpy as np

import strata

PROGRAM = os.environ["STRATA_PROGRAM"]


def room(seed):
    """(n, 3) points of a floor, three walls and a chest, drawn anew: nothing is left undetermined, and no point is there twice."""
    random = np.random.default_rng(seed)

    def rectangle(corner, along, across, density=150):
        along, across = np.array(along), np.array(across)
        n = int(density * np.linalg.norm(along) * np.linalg.norm(across))
        u, v = random.uniform(0, 1, (2, n, 1))
        return np.array(corner) + u * along + v * across

    points = np.concatenate([
        rectangle((0, 0, 0), (8, 0, 0), (0, 6, 0)), rectangle((0, 0, 0), (8, 0, 0), (0, 0, 3)),
        rectangle((0, 0, 0), (0, 6, 0), (0, 0, 3)), rectangle((8, 0, 0), (0, 6, 0), (0, 0, 3)),
        rectangle((2, 4, 0.9), (3, 0, 0), (0, 1, 0)), rectangle((2, 4, 0), (3, 0, 0), (0, 0, 0.9))])
    return points + random.normal(0, 0.005, points.shape) - (3.03, 2.04, 1)


def turned(angle_rad, translation):
    T = np.eye(4)
    T[:2, :2] = [[np.cos(angle_rad), -np.sin(angle_rad)], [np.sin(angle_rad), np.cos(angle_rad)]]
    T[:3, 3] = translation
    return T


def apply(T, points):
    return points @ T[:3, :3].T + T[:3, 3]


class RegisterTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.target = room(1)
        self.T = turned(0.05, (0.3, -0.2, 0.05))
        self.source = apply(np.linalg.inv(self.T), room(2))

    def test_every_method_finds_the_motion(self):
        for method in ("mls", "icp", "plane", "trimmed", "gicp"):
            with self.subTest(method):
                found = strata.register(self.source, self.target, method=method, program=PROGRAM)
                self.assertTrue(found.converged, found.termination)
                np.testing.assert_allclose(found.T_target_source, self.T, atol=0.03)
                self.assertGreater(found.overlap, 0.65)  # trimmed keeps 0.7

    def test_a_guess_leads_from_afar_and_a_picture_is_drawn(self):
        far = self.source + (500_000, 0, 0)
        guess = turned(0.04, (0.25, -0.2, 0)) @ turned(0, (-500_000, 0, 0))
        picture = self.folder / "both.png"
        found = strata.register(far, self.target, guess, method="plane", picture=picture, program=PROGRAM)
        np.testing.assert_allclose(apply(found.T_target_source, far), apply(self.T, self.source), atol=0.03)
        self.assertEqual(picture.read_bytes()[:4], b"\x89PNG")

    def test_files_are_read_where_they_are(self):
        file = self.folder / "source.xyz"
        np.savetxt(file, self.source)
        found = strata.register(file, self.target, program=PROGRAM)
        np.testing.assert_allclose(found.T_target_source, self.T, atol=0.03)

    def test_what_is_wrong_is_said(self):
        with self.assertRaisesRegex(ValueError, "'best'; expected one of mls"):
            strata.register(self.source, self.target, method="best", program=PROGRAM)
        with self.assertRaisesRegex(ValueError, r"source of shape \(3,\); expected"):
            strata.register(np.zeros(3), self.target, program=PROGRAM)
        with self.assertRaisesRegex(strata.StrataError, "missing.pcd"):
            strata.register(self.folder / "missing.pcd", self.target, program=PROGRAM)
        with mock.patch.dict(os.environ, {"PATH": ""}), self.assertRaisesRegex(FileNotFoundError, "package strata"):
            strata.register(self.source, self.target)


if __name__ == "__main__":
    unittest.main()
