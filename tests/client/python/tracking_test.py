"""A robot followed through a corner of a room, of which the map has one scan."""
import unittest

import numpy as np

import strata
from support import ServerTest, grid


def corner():
    """(n, 3) points of a floor and four things that stand on it, seen from 1.5 m above its middle."""
    floor = grid((-8, 8), (-8, 8), step=0.06)
    walls = [np.stack([at[0] + 0 * u if along else u, u if along else at[1] + 0 * u, z], axis=-1)
             for at, along in (((6, 0), True), ((0, -7), False), ((-5, 0), True))
             for u, z in [np.array([(u, z) for u in np.arange(-4, 3, 0.05) for z in np.arange(0.05, 2.5, 0.05)]).T]]
    return np.concatenate([floor, *walls]) - (0, 0, 1.5)


def moved(x, y, yaw):
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    pose[:2, 3] = x, y
    return pose


def seen_from(pose):
    return (corner() - pose[:3, 3]) @ pose[:3, :3]


class TrackingTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.db.create_map("room")
        cls.map.upload(corner(), trajectory="run", sequence=1)
        cls.map.wait(timeout=120)

    def test_steps_come_back_as_poses(self):
        with self.map.follow(guess=moved(0.2, -0.1, 0.02), guess_radius=3.0) as robot:
            for k in range(4):
                truth = moved(0.3 * k, 0.1 * k, 0.05 * k)
                pose = robot.step(seen_from(truth), moved(50, 3, 1) @ truth @ moved(0.01 * k, 0, 0))
                self.assertEqual(pose.state, "tracked", pose.message)
                self.assertEqual(pose.found, k == 0)
                self.assertEqual(pose.epoch, 1)
                self.assertLess(np.linalg.norm((pose.T_map_scan - truth)[:3, 3]), 0.1)
                self.assertGreater(np.linalg.eigvalsh(pose.covariance).min(), 0)
                self.assertGreater(pose.score, 0.5)
            alone = robot.step(None, moved(50, 3, 1) @ truth @ moved(1, 0, 0), covariance=0.01 * np.eye(6))
            self.assertEqual(alone.state, "predicted")
            self.assertLess(np.linalg.norm((alone.T_map_scan - truth @ moved(1, 0, 0))[:3, 3]), 0.15)
            self.assertGreater(alone.covariance[3, 3], 0.01)

    def test_nowhere_is_an_answer_and_what_is_wrong_is_named(self):
        with self.map.follow(guess=moved(500, 0, 0)) as robot:
            pose = robot.step(corner(), None)
            self.assertEqual((pose.state, pose.T_map_scan), ("lost", None))
            with self.assertRaises(ValueError):
                robot.step(corner(), None, covariance=np.eye(3))
            with self.assertRaises(strata.InvalidArgument):
                robot.step(None, None, covariance=-np.eye(6))
            with self.assertRaises(strata.StrataError):
                robot.step(None, None)
        with self.assertRaises(strata.InvalidArgument):
            self.map.follow(guess_radius=-1.0)


if __name__ == "__main__":
    unittest.main()
