"""Every RPC of the contract has a Python method: a scenario calls them all, and gRPC itself says which were called."""
import os
import subprocess
import unittest
from unittest import mock

import grpc
import numpy as np
import xxhash

import strata
from strata import aio, maps
from strata.v1 import (classifiers_pb2, jobs_pb2, maps_pb2, models_pb2, objects_pb2, planning_pb2, posegraph_pb2, scans_pb2,
                       tiles_pb2)
from support import ServerTest, grid

CONTRACT = {f"/{service.full_name}/{method.name}"
            for module in (classifiers_pb2, jobs_pb2, maps_pb2, models_pb2, objects_pb2, planning_pb2, posegraph_pb2,
                           scans_pb2, tiles_pb2)
            for service in module.DESCRIPTOR.services_by_name.values() for method in service.methods}


class Recorder(grpc.UnaryUnaryClientInterceptor, grpc.UnaryStreamClientInterceptor, grpc.StreamUnaryClientInterceptor,
               grpc.StreamStreamClientInterceptor):
    """Notes which methods are called."""

    def __init__(self):
        self.called = set()

    def _note(self, continuation, details, request):
        self.called.add(details.method if isinstance(details.method, str) else details.method.decode())
        return continuation(details, request)

    intercept_unary_unary = intercept_unary_stream = intercept_stream_unary = intercept_stream_stream = _note


def walls(at=0.0):
    """(n, 3) points of a floor with two walls and a pillar: something to align, find and stand on."""
    floor = grid((-6, 6), (-6, 6), step=0.1)
    wall = grid((-6, 6), (0, 2.5), step=0.1)
    along = np.column_stack([wall[:, 0], np.full(len(wall), 6.0), wall[:, 1]])
    across = np.column_stack([np.full(len(wall), -6.0), wall[:, 0], wall[:, 1]])
    pillar = grid((2, 2.6), (0, 1.5), step=0.05)
    pillar = np.column_stack([pillar[:, 0], np.full(len(pillar), 2.0), pillar[:, 1]])
    points = np.concatenate([floor, along, across, pillar])
    return points + [at, 0, 0], np.where(points[:, 2] > 0.05, 2, 1)


class ServicesTest(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.recorder = Recorder()
        insecure = grpc.insecure_channel

        with mock.patch.object(grpc, "insecure_channel", lambda *arguments: _Recorded(insecure(*arguments), cls.recorder)):
            cls.db = cls.enterClassContext(strata.connect(cls.server.address))
        cls.map = cls.db.create_map("all")
        points, labels = walls()
        cls.points = points
        for sequence in (1, 2, 3):
            cls.map.upload(points, ([0.01 * sequence, 0, 0], [0, 0, 0, 1]), trajectory="run", sequence=sequence,
                           labels=labels, sensor_origin=(0, 0, 1.0), time=1000.0 + sequence, align=False)
        cls.map.wait(timeout=60)

    def test_a_map(self):
        self.assertIn("all", self.db.maps())
        self.db.create_map("gone")
        self.db.delete_map("gone")
        self.map.set_origin(51, 13, 100)
        self.assertEqual(self.map.stats().scans, 3)
        current, = [epoch for epoch in self.map.history() if epoch.current]
        self.assertEqual((current.epoch, current.kept), (self.map.stats().epoch, True))
        self.map.set_class(1, "floor", (255, 128, 0))
        self.map.set_class(2, "wall", (0, 1, 2))
        self.assertEqual(self.map.classes(), [strata.MapClass(1, "floor", (255, 128, 0)),
                                              strata.MapClass(2, "wall", (0, 1, 2))])
        with self.assertRaises(strata.AlreadyExists):
            self.map.set_class(3, "wall", (0, 0, 0))
        with self.assertRaises(ValueError):
            self.map.set_class(3, "red", (256, 0, 0))
        changes = self.map.watch(once=True)
        self.assertTrue(next(changes).whole)
        changes.close()

    def test_a_backup_is_the_map_and_appears_whole_or_not_at_all(self):
        path = self.folder / "all.strata"
        self.map.backup(path)
        content = path.read_bytes()
        self.assertTrue(content.startswith(b"SQLite format 3"))
        with self.assertRaises(FileExistsError):
            self.map.backup(path)
        with self.assertRaises(OSError):
            self.map.backup(self.folder / "nowhere" / "x.strata")
        path.write_bytes(b"old")
        self.map.backup(path, force=True)
        self.assertEqual(len(path.read_bytes()), len(content))
        self.assertEqual([file.name for file in self.folder.iterdir() if "backup" in file.name], [])
        verified = subprocess.run([os.environ["STRATA_STRATAD"], "check", "--data", self.folder, "--maps"],
                                  capture_output=True, text=True, check=False)
        self.assertEqual(verified.returncode, 0, verified.stdout + verified.stderr)

    def test_a_damaged_backup_is_told_and_leaves_nothing(self):
        path = self.folder / "damaged.strata"
        with self.assertRaisesRegex(strata.DataLoss, "take it once more"), maps.backup_file(path, False) as file:
            file.write(maps_pb2.BackupMapResponse(bytes=b"half"))
            file.write(maps_pb2.BackupMapResponse(bytes=b"", content_hash=xxhash.xxh3_128_hexdigest(b"whole")))
        self.assertFalse(path.exists())
        self.assertEqual(list(self.folder.glob(".strata-backup-*")), [])

    def test_scans(self):
        self.assertEqual([scan.sequence for scan in self.map.scans("run")], [1, 2, 3])
        scan = self.map.scan(("run", 2))
        self.assertEqual((scan.sequence, scan.state, scan.time), (2, "integrated", 1002.0))
        with self.assertRaises(strata.NotFound):
            self.map.scan(("run", 9))
        self.assertEqual(self.map.last_sequence("run"), 3)
        self.assertEqual(len(self.map.points(scan).xyz), len(self.points))
        self.assertEqual(len(self.map.faded(scan)), 0)
        other = self.db.create_map("labelled")
        ack = other.upload(self.points, align=False)
        other.wait(timeout=60)
        self.assertIsNone(other.points(ack).labels)
        labels = np.arange(len(self.points)) % 3
        other.set_labels(ack, labels)
        np.testing.assert_array_equal(other.points(ack).labels, labels)
        other.set_labels(ack, np.where(labels == 0, 7, 0), update=True)
        np.testing.assert_array_equal(other.points(ack).labels, np.where(labels == 0, 7, labels))
        with self.assertRaises(strata.InvalidArgument):
            other.set_labels(ack, labels[1:])
        with self.assertRaisesRegex(ValueError, "labels"):
            other.set_labels(ack, [-1])
        other.delete_scan(ack)

    def test_scans_on_one_stream_are_answered_in_order_and_one_by_one(self):
        other = self.db.create_map("stream")
        drive = [{"points": self.points + [0.1 * k, 0, 0], "align": False} for k in range(12)]
        drive[5]["labels"] = np.full(len(self.points), 300)  # 16 bits, but no class
        answers = list(other.ingest(drive))
        self.assertEqual([getattr(answer, "sequence", 0) for answer in answers], [1, 2, 3, 4, 5, 0, 7, 8, 9, 10, 11, 12])
        self.assertIsInstance(answers[5], strata.InvalidArgument)
        other.wait(timeout=60)
        self.assertEqual(len(other.scans()), 11)
        with self.assertRaisesRegex(ValueError, "speed"):
            next(other.ingest([{"points": self.points, "speed": 3}]))
        some = other.ingest({"points": self.points, "trajectory": "left", "sequence": k} for k in range(1, 100))
        next(some)
        some.close()
        self.assertLess(other.last_sequence("left"), 99)

    def test_local_maps_are_bytes_of_the_robot(self):
        with self.assertRaises(strata.InvalidArgument):
            self.map.upload_local_map(b"no local map", trajectory="local", sequence=1)
        with self.assertRaisesRegex(strata.InvalidArgument, "gap"):
            self.map.upload_local_map(b"", gap_size=0.5, trajectory="local", sequence=1)

    def test_tiles(self):
        listed = self.map.tiles()
        fetched = self.map.fetch()
        self.assertEqual({key: (info.version, info.surfaces) for key, info in listed.items()},
                         {key: (tile.version, len(tile.surfaces)) for key, tile in fetched.items()})
        self.assertEqual(list(self.map.tiles((1, 1, 2, 2))), [strata.TileKey(0, 0, 0)])
        tile = self.map.tile(strata.TileKey(0, 0, 0))
        np.testing.assert_array_equal(tile.surfaces, fetched[tile.key].surfaces)
        with self.assertRaises(strata.NotFound):
            self.map.tile(strata.TileKey(0, 99, 0))
        self.assertEqual(len(self.map.surfaces([(0, 0)])[0]), 1)

    def test_planning(self):
        path = self.map.plan((0, 0), (4, 0))
        self.assertTrue(path, path.message)
        check = self.map.check_path(path)
        self.assertTrue(check, check.message)
        self.assertAlmostEqual(check.valid_length, path.length, places=6)
        self.assertEqual(self.map.check_path(path, known=check), check)
        through = self.map.check_path([(2.3, 0, 0), (2.3, 4, 0)])
        self.assertFalse(through)
        self.assertGreater(through.where[1], 1)
        self.assertTrue(through.obstruction)
        with self.assertRaisesRegex(ValueError, "way"):
            self.map.check_path([(1, 2)])
        watch = self.map.watch_path(path)
        self.assertTrue(next(watch))
        barrier = grid((-1, 1), (0, 1.5), step=0.02)
        ack = self.map.upload(np.column_stack([np.full(len(barrier), 2.0), barrier[:, :2]]), trajectory="barrier", align=False)
        blocked = next(watch)
        self.assertFalse(blocked)
        watch.close()
        self.map.wait(timeout=60)
        self.map.delete_scan(ack)
        self.map.floors(min_area=1)
        self.map.places()
        self.map.explore((0, 0), count=1, resolution=0.5)
        self.map.check_shape(path, parts=[strata.shape.sphere(0.1, (0, 0, 0.5))])
        self.map.set_profile("small", {"radius": 0.1})
        self.assertEqual(sorted(self.map.profiles()), ["default", "small"])

    def test_the_pose_graph(self):
        graph = self.map.pose_graph()
        self.assertEqual([(node.trajectory, node.sequence) for node in graph.nodes[:3]], [("run", k) for k in (1, 2, 3)])
        poses = graph.poses()[:3]
        np.testing.assert_allclose(poses["T_map_scan"][:, 0, 3], [0.01, 0.02, 0.03])
        np.testing.assert_array_equal(poses["time"], [1001, 1002, 1003])
        np.testing.assert_array_equal(strata.poses_of(self.map.scans("run")), poses)
        where = self.map.lookup_pose(("run", 1))
        self.assertTrue(where)
        moved = where.pose.copy()
        moved[0, 3] += 0.005
        self.map.set_pose(("run", 1), moved)
        np.testing.assert_allclose(self.map.lookup_pose(("run", 1)).pose, moved)
        self.map.set_pose(("run", 1), where.pose)
        information = np.diag([0, 0, 0, 4, 5, 6.0])
        made = self.map.add_constraint(("run", 2), ([1, 2, 3], [0, 0, 0, 1]), information, note="GPS", may_be_false=True)
        kept, = [one for one in self.map.pose_graph().constraints if one.id == made.id]
        self.assertEqual((kept.i, kept.j, kept.origin, kept.enabled, kept.note, kept.may_be_false),
                         (None, ("run", 2), "person", True, "GPS", True))
        np.testing.assert_array_equal(kept.information, information)
        np.testing.assert_array_equal(kept.pose[:3, 3], [1, 2, 3])
        self.map.enable_constraint(made.id, False)
        self.assertFalse([one for one in self.map.pose_graph().constraints if one.id == made.id][0].enabled)
        self.map.remove_constraint(made.id)
        with self.assertRaises(strata.NotFound):
            self.map.remove_constraint(made.id)
        with self.assertRaisesRegex(ValueError, "information"):
            self.map.add_constraint(("run", 2), None, np.eye(3))

    def test_localizing(self):
        away = np.array([5_000.0, 0, 0])
        for shift in (np.zeros(3), away):  # far points travel relative to an origin of their own
            guess = np.eye(4)
            guess[:3, 3] = [0.1, 0.1, 0] - shift
            found = self.map.localize(self.points + shift, guess, guess_radius=5, sensor_origin=shift + [0, 0, 1.0])
            self.assertTrue(found, found.message)
            np.testing.assert_allclose(found.best.pose[:3, 3], [0.02, 0, 0] - shift, atol=0.05)
            self.assertEqual(found.covariance.shape, (6, 6))
        nowhere = self.map.localize(np.random.default_rng(5).uniform(-1, 1, (2000, 3)))
        self.assertFalse(nowhere)
        self.assertIsNone(nowhere.best)
        with self.map.follow(guess_radius=5) as robot:
            robot.step(self.points, None, sensor_origin=(0, 0, 1))

    def test_jobs(self):
        other = self.db.create_map("jobs")
        job = other.start_job("rebuild")
        self.assertEqual(other.follow_job(job).state, "succeeded")
        self.assertEqual(other.find_job(job.id).kind, "rebuild")
        with self.assertRaises(strata.NotFound):
            other.find_job(99)
        self.assertEqual([one.id for one in other.jobs()], [job.id])
        other.cancel_job(job)
        for refused in (other.accept_job, other.revert_job):
            with self.assertRaises(strata.FailedPrecondition):
                refused(job)

    def test_things_and_planes(self):
        for ask in (self.map.planes, self.map.objects, self.map.inferred):
            with self.assertRaises(strata.NotFound):
                ask()
        self.assertEqual(self.map.kinds(), [])
        self.map.set_class(2, "wall", (0, 1, 2))
        kind = self.map.import_kind("box", "wall", np.random.default_rng(4).uniform(-1, 1, (500, 3)))
        self.assertEqual(self.map.rename_kind(kind.id, "crate").name, "crate")
        self.assertEqual(len(self.map.kind("crate").points), 500)
        self.map.delete_kind("crate")

    def test_classifiers_go_from_map_to_map(self):
        self.map.set_class(1, "floor", (255, 128, 0))
        self.map.set_class(2, "wall", (0, 1, 2))
        self.map.job("train", name="first", folds=0)
        one, = self.map.classifiers()
        self.assertEqual(self.map.classifier("first"), one)
        content = self.map.export_classifier("first")
        self.assertEqual(len(content), one.bytes)
        other = self.db.create_map("learner")
        with self.assertRaises(strata.InvalidArgument):
            other.import_classifier("second", content[:-1])
        second = other.import_classifier("second", content)
        self.assertEqual((second.job, second.bytes, second.scores), (0, one.bytes, one.scores))
        with self.assertRaises(strata.AlreadyExists):
            other.import_classifier("second", content)
        other.delete_classifier("second")
        with self.assertRaises(strata.NotFound):
            other.classifier("second")

    def test_zz_every_method_was_called(self):
        """By the tests above, which come before it in the alphabet."""
        self.assertGreater(len(CONTRACT), 55)
        self.assertEqual(CONTRACT - self.recorder.called, set())


class _Recorded:
    """A channel whose calls are recorded; what waits for it to be ready gets it as it is."""

    def __init__(self, channel, recorder):
        self._channel = channel
        self._calls = grpc.intercept_channel(channel, recorder)

    def __getattr__(self, name):
        return getattr(self._calls if name.startswith(("unary", "stream")) else self._channel, name)


class BothFormsTest(unittest.TestCase):
    def test_what_one_form_has_the_other_has(self):
        for blocking, asynchronous in ((strata.Map, aio.Map), (strata.Database, aio.Database),
                                       (strata.Tracking, aio.Tracking)):
            names = {name for name in dir(asynchronous) if not name.startswith("_")} - {"begin"}
            self.assertEqual(names, {name for name in dir(blocking) if not name.startswith("_")} - {
                "name", "cell_size", "trajectory"})
            for name in names - {"channel"}:
                self.assertEqual(getattr(blocking, name).__doc__, getattr(asynchronous, name).__doc__)


if __name__ == "__main__":
    unittest.main()
