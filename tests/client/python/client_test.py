"""The Python client against a real stratad: what goes up comes back, and what a map answers."""
import contextlib
import datetime
import io
import pathlib
import re
import unittest

import numpy as np

import strata
from support import DECK_M, ServerTest, bridge, grid

README = pathlib.Path(__file__).resolve().parents[3] / "client/python/README.md"


class UploadTest(ServerTest):
    def setUp(self):
        self.map = self.db.create_map(self.id().rpartition(".")[2])

    def test_every_column_comes_back(self):
        random = np.random.default_rng(1)
        points = random.uniform(-20, 20, (90_001, 3)).astype(np.float32)  # three chunks
        intensity = random.uniform(0, 1, len(points)).astype(np.float32)
        rgb = random.integers(0, 256, points.shape, np.uint8)
        labels = random.integers(0, 4, len(points))
        pose = np.array([[0, -1, 0, 7], [1, 0, 0, -8], [0, 0, 1, 0.5], [0, 0, 0, 1.0]])
        time = datetime.datetime(2026, 5, 4, 3, 2, 1, 123456, datetime.timezone.utc)
        ack = self.map.upload(points, pose, trajectory="run", sequence=5, time=time, intensity=intensity, rgb=rgb,
                              labels=labels, sensor_origin=(0.1, 0.2, 0.3), align=False)
        self.assertEqual((ack.trajectory, ack.sequence, ack.already_present), ("run", 5, False))
        self.map.wait(timeout=60)
        scan, = self.map.scans()
        self.assertEqual((scan.state, scan.point_count, scan.message), ("integrated", len(points), ""))
        self.assertAlmostEqual(scan.time, time.timestamp(), places=5)
        np.testing.assert_allclose(scan.pose, pose, atol=1e-12)
        for which in (ack, scan, ("run", 5)):
            stored = self.map.points(which)
            np.testing.assert_array_equal(stored.xyz, points)
            np.testing.assert_array_equal(stored.intensity, intensity)
            np.testing.assert_array_equal(stored.rgb, rgb)
            np.testing.assert_array_equal(stored.labels, labels)

    def test_the_same_again_changes_nothing_and_another_is_refused(self):
        points = grid((0, 1), (0, 1))
        first = self.map.upload(points, trajectory="run", sequence=1)
        again = self.map.upload(points, trajectory="run", sequence=1)
        self.assertFalse(first.already_present)
        self.assertTrue(again.already_present)
        self.assertEqual(first.commit_sequence, again.commit_sequence)
        with self.assertRaises(strata.AlreadyExists):
            self.map.upload(points + 1, trajectory="run", sequence=1)
        self.assertEqual(self.map.stats().scans, 1)

    def test_sequences_go_on_by_themselves_in_another_program_too(self):
        points = grid((0, 1), (0, 1))
        acks = [self.map.upload(points, trajectory="run") for _ in range(2)]
        other = self.db.map(self.map.name)
        acks.append(other.upload(points, trajectory="run"))
        self.assertEqual([ack.sequence for ack in acks], [1, 2, 3])
        self.assertEqual(self.map.last_sequence("run"), 3)
        self.assertEqual(self.map.last_sequence("nobody"), 0)
        self.assertNotEqual(self.map.upload(points).trajectory, other.upload(points).trajectory)

    def test_coordinates_far_from_zero_keep_their_millimetres(self):
        random = np.random.default_rng(2)
        utm = np.array([448_262.0, 5_955_431.0, 12.0])
        local = random.uniform(-9, 9, (1000, 3))
        turned = ([10.0, 20.0, 0.0], [0, 0, np.sqrt(0.5), np.sqrt(0.5)])
        ack = self.map.upload(utm + local, turned, align=False)
        self.map.wait(timeout=60)
        scan, = self.map.scans()
        stored = self.map.points(ack).xyz
        in_map = stored @ scan.pose[:3, :3].T + scan.pose[:3, 3]
        rotation = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
        np.testing.assert_allclose(in_map, (utm + local) @ rotation.T + turned[0], atol=1e-5)
        self.assertLess(np.abs(stored).max(), 200)

    def test_organised_scans_keep_their_holes(self):
        image = np.dstack([np.ones((4, 6)), *np.mgrid[0:4, 0:6]]).astype(np.float32)
        image[1, 2] = [np.nan, 0, np.inf]  # as some drivers say "no return"
        points = self.map.points(self.map.upload(image)).xyz.reshape(4, 6, 3)
        self.assertTrue(np.isnan(points[1, 2]).all())
        image[1, 2] = np.nan
        np.testing.assert_array_equal(points, image)

    def test_what_is_no_scan_is_refused_before_it_is_sent(self):
        good = grid((0, 1), (0, 1))
        bad = good.copy()
        bad[3, 1] = np.nan
        reflection = np.diag([1, 1, -1, 1.0])
        for message, arguments, more in (
                ("1 of 400 points are not finite", (bad,), {}),
                ("shape", (good[:, :2],), {}),
                ("shape", ("points",), {}),
                ("no finite point", (np.full((2, 2, 3), np.nan),), {}),
                ("not rigid", (good, reflection), {}),
                ("not finite", (good, ([0, 0, np.inf], [0, 0, 0, 1])), {}),
                ("length 2", (good, ([0, 0, 0], [0, 0, 0, 2])), {}),
                ("intensity", (good,), {"intensity": [1, 2, 3]}),
                ("rgb", (good,), {"rgb": good}),
                ("labels", (good,), {"labels": np.full(400, 65536)}),
                ("labels", (good,), {"labels": np.full(400, -1)}),
                ("time", (good,), {"time": np.nan})):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                self.map.upload(*arguments, **more)
        self.assertEqual(self.map.stats().scans, 0)

    def test_what_the_server_refuses_says_why(self):
        good = grid((0, 1), (0, 1))
        with self.assertRaises(strata.InvalidArgument) as caught:
            self.map.upload(good, trajectory="no/name", sequence=1)
        self.assertEqual(caught.exception.reason, "REQUEST")
        self.assertTrue(caught.exception.request_id)
        with self.assertRaises(strata.InvalidArgument):
            self.map.upload(good, labels=np.full(400, 300))
        with self.assertRaises(strata.NotFound):
            self.map.points(("nobody", 1))

    def test_a_deleted_scan_is_gone(self):
        ack = self.map.upload(grid((0, 1), (0, 1)))
        self.map.wait(timeout=60)
        self.map.delete_scan(ack)
        self.assertEqual((self.map.scans(), self.map.fetch()), ([], {}))
        with self.assertRaises(strata.NotFound):
            self.map.delete_scan(ack)


class MapsTest(ServerTest):
    def test_a_map_is_told_where_on_earth_it_is(self):
        made = self.db.create_map("on_earth")
        self.assertIsNone(made.origin())
        for place in ((51.05, 13.73, 113.5), (-33.9, -70.6, -2.0)):
            made.set_origin(*place)
            np.testing.assert_allclose(self.db.map("on_earth").origin(), place, atol=1e-9)
        with self.assertRaises(strata.InvalidArgument):
            made.set_origin(91.0, 0.0, 0.0)
        np.testing.assert_allclose(made.origin(), (-33.9, -70.6, -2.0), atol=1e-9)

    def test_maps_are_made_found_and_deleted(self):
        made = self.db.create_map("made", cell_size=0.2, gap_size=0.8, thickness=0.2, profile={"radius": 0.5})
        self.assertEqual(made.cell_size, 0.2)
        self.assertEqual(self.db.map("made").profiles()["default"]["radius"], 0.5)
        with self.assertRaises(strata.AlreadyExists):
            self.db.create_map("made")
        self.assertEqual(self.db.create_map("made", exist_ok=True).cell_size, 0.2)
        self.assertIn("made", self.db.maps())
        self.db.delete_map("made")
        self.assertNotIn("made", self.db.maps())
        with self.assertRaises(strata.NotFound):
            self.db.map("made")
        with self.assertRaisesRegex(ValueError, "cell_size"):
            self.db.create_map("wrong", cell_size=-1)
        with self.assertRaisesRegex(ValueError, "no size"):
            self.db.create_map("wrong", profile={"size": 1})


class BridgeTest(ServerTest):
    """One map with a bridge that nobody changes."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.db.create_map("bridge")
        cls.points = bridge()
        cls.map.upload(cls.points, labels=np.where(cls.points[:, 2] > 0, 2, 1), trajectory="run", sequence=1)
        cls.map.wait(timeout=120)

    def test_paths_lead_over_and_under(self):
        over = self.map.plan((-15, 0), (0, 0, DECK_M))
        self.assertTrue(over, over.message)
        self.assertAlmostEqual(over.points[-1, 2], DECK_M, places=1)
        np.testing.assert_allclose(over.points[[0, -1], :2], [(-15, 0), (0, 0)], atol=0.1)
        steps = np.linalg.norm(np.diff(over.points, axis=0), axis=1)
        self.assertAlmostEqual(over.length, steps.sum(), places=6)
        self.assertIn(strata.TileKey(0, -1, 0), over.tiles)
        under = self.map.plan((0, -6), (0, 6))
        self.assertTrue(under, under.message)
        self.assertLess(under.points[:, 2].max(), 0.2)
        self.assertGreater(over.cost, over.length)

    def test_no_path_says_why(self):
        giant = self.map.plan((0, -6), (0, 0), profile={"height": 4})
        self.assertFalse(giant)
        self.assertEqual((giant.reason, giant.obstruction, len(giant.points)), ("goal_not_on_surface", "clearance", 0))
        self.assertAlmostEqual(giant.obstruction_value, DECK_M, places=1)
        self.assertIsNotNone(giant.nearest)
        outside = self.map.plan((100, 100), (0, 0))
        self.assertEqual(outside.reason, "start_not_on_surface")
        with self.assertRaises(strata.InvalidArgument):
            self.map.plan((0, np.nan), (0, 0))
        with self.assertRaisesRegex(ValueError, "place"):
            self.map.plan((0,), (0, 0))

    def test_profiles_and_classes_count(self):
        self.map.set_profile("giant", {"height": 4})
        self.assertEqual(self.map.plan((0, -6), (0, 0), profile="giant").reason, "goal_not_on_surface")
        with self.assertRaises(strata.NotFound):
            self.map.plan((0, -6), (0, 0), profile="dwarf")
        plain = self.map.plan((-15, 0), (0, 0, DECK_M))
        dear = self.map.plan((-15, 0), (0, 0, DECK_M), class_costs={2: 10})
        self.assertGreater(dear.cost, 5 * plain.cost)
        self.assertFalse(self.map.plan((-15, 0), (0, 0, DECK_M), class_costs={2: None}))

    def test_all_levels_at_places(self):
        both, nothing = self.map.surfaces([(0.05, 0.05), (500, 500)])
        np.testing.assert_allclose(both["z"], [0, DECK_M], atol=0.02)
        self.assertEqual(both["class_id"].tolist(), [1, 2])
        self.assertEqual((both.dtype, len(nothing)), (strata.SURFACE, 0))

    def test_areas_are_fetched_alone(self):
        edge = 256 * self.map.cell_size
        tiles = self.map.fetch()
        self.assertEqual({key[1:] for key in tiles}, {(x, y) for x in (-1, 0) for y in (-1, 0)})
        south_west = self.map.fetch(area=(-edge, -edge, -0.01, -0.01))
        self.assertEqual(list(south_west), [strata.TileKey(0, -1, -1)])
        np.testing.assert_array_equal(south_west[0, -1, -1].surfaces, tiles[0, -1, -1].surfaces)
        self.assertEqual(self.map.fetch(area=(1000, 1000, 1001, 1001)), {})
        everything = (-1e300, -1e300, 1e300, 1e300)
        self.assertEqual(self.map.fetch(area=everything).keys(), tiles.keys())
        coarse = self.map.fetch(level=3)
        self.assertEqual({tile.cell_size for tile in coarse.values()}, {8 * self.map.cell_size})
        with self.assertRaises(strata.InvalidArgument):
            self.map.fetch(level=13)

    def test_points_of_the_world_are_on_surfaces(self):
        surfaces = np.concatenate([tile.surfaces for tile in self.map.fetch().values()])
        cells = {}
        for surface in surfaces:
            cells.setdefault((round(surface["x"] * 100), round(surface["y"] * 100)), []).append(surface)
        middle = (np.floor(self.points[:, :2] / 0.1) * 10 + 5).round().astype(int)
        for (x, y), z in list(zip(middle.tolist(), self.points[:, 2]))[::97]:
            levels = cells[x, y]
            self.assertLess(min(abs(level["z"] - z) for level in levels), 0.05, (x, y, z))
        self.assertEqual(set(surfaces["class_id"]), {1, 2})
        self.assertEqual(set(surfaces["confidence"][surfaces["class_id"] > 0]) & {0}, set())
        flat = surfaces[(surfaces["z"] < 0.1) & (np.abs(surfaces["y"]) > 4) & (np.abs(surfaces["y"]) < 7)]
        inner = flat[np.abs(flat["x"]) < 15]
        self.assertEqual(set(inner["traversability"]), {strata.TRAVERSABLE})

    def test_jobs_are_followed_to_their_end(self):
        seen = []
        done = self.map.job("verify", progress=seen.append, threads=1)
        self.assertEqual((done.state, done.metrics["mismatches"], done.parameters), ("succeeded", 0, {"threads": "1"}))
        self.assertEqual(seen[-1].state, "succeeded")
        self.assertEqual([job.id for job in self.map.jobs()][-1], done.id)
        self.assertEqual(self.map.optimize(dry_run=True).state, "proposed")
        self.assertEqual(self.map.revert_job(self.map.jobs()[-1]).state, "cancelled")
        with self.assertRaises(strata.InvalidArgument):
            self.map.start_job("dance")
        with self.assertRaises(strata.NotFound):
            self.map.start_job("classify", model="nobody")
        with self.assertRaisesRegex(strata.FailedPrecondition, "train job 1 failed: "):
            self.db.create_map("unlabelled").job("train", name="nothing", method="bayes")


class ChangesTest(ServerTest):
    def test_only_what_changed_is_fetched_and_watched(self):
        changing = self.db.create_map("changing")
        west = changing.upload(grid((-20, -18), (0, 2)), align=False)
        changing.upload(grid((18, 20), (0, 2)), align=False)
        changing.wait(timeout=60)
        first = changing.fetch()
        self.assertEqual({key.x for key in first}, {-1, 0})
        self.assertEqual(list(changing.changes(held=first)), [])
        *_, last = changing.watch(once=True)
        self.assertTrue(last.whole)
        self.assertEqual({scan.state for scan in last.scans}, {"integrated"})
        self.assertEqual(set(last.tiles), set(first))

        changing.upload(grid((18, 20), (4, 6)), align=False)
        changing.wait(timeout=60)
        changed = dict(changing.changes(held=first))
        self.assertEqual([key.x for key in changed], [0])
        second = changing.fetch(held=first)
        self.assertIs(second[0, -1, 0], first[0, -1, 0])
        self.assertGreater(len(second[0, 0, 0].surfaces), len(first[0, 0, 0].surfaces))

        changing.delete_scan(west)
        third = changing.fetch(held=second)
        self.assertEqual(list(third), [strata.TileKey(0, 0, 0)])
        told = list(changing.watch(last.commit_sequence, epoch=last.epoch, once=True))
        self.assertFalse(any(change.whole for change in told))
        scans = {(scan.trajectory, scan.sequence): scan for change in told for scan in change.scans}
        self.assertTrue(scans[west.trajectory, west.sequence].gone)
        tiles = {key: version for change in told for key, version in change.tiles.items()}
        self.assertEqual(tiles, {(0, -1, 0): None, (0, 0, 0): third[0, 0, 0].version})


class FadeTest(ServerTest):
    def test_what_later_scans_look_through_fades(self):
        world = self.db.create_map("fading", fade_after=0)
        floor = grid((-2, 10), (-3, 3)) - (0, 0, 1)  # seen from 1 m above
        _, y, z = grid((-1, 1), (-0.5, 0.5), lambda x, y: 0.6 * y + 0.35).T
        box = np.stack([np.full_like(y, 3.0), y, z - 1], axis=1)
        hidden = (floor[:, 0] > 3) & (np.abs(floor[:, 1]) < 0.2 * floor[:, 0])
        first = world.upload(np.concatenate([floor[~hidden], box]), align=False)
        for _ in range(3):
            world.upload(floor, align=False)
        world.wait(timeout=60)
        self.assertEqual(len(world.faded(first)), 0)
        world.job("fade", scans=2)
        count = world.faded(first)
        scan = world.scans()[0]
        self.assertEqual(len(count), scan.point_count)
        self.assertEqual(scan.faded_points, np.count_nonzero(count))
        self.assertEqual(np.count_nonzero(count[:-len(box)]), 0)
        self.assertGreater(np.count_nonzero(count[-len(box):]), len(box) / 4)  # not what is close to the floor
        self.assertEqual(set(count) - {0}, {3})


class PlanesTest(ServerTest):
    def test_walls_and_floors_are_polygons(self):
        world = self.db.create_map("room")
        with self.assertRaises(strata.NotFound):
            world.planes()
        floor = grid((-3, 3), (-3, 3)) - (0, 0, 1)
        _, y, z = grid((-1, 1), (-2, 2), lambda x, y: x).T
        wall = np.stack([np.full_like(y, 2.5), y, z + 0.2], axis=1)
        rgb = np.concatenate([np.full(floor.shape, 150), np.full(wall.shape, 60) + (100, 0, 0)])
        world.upload(np.concatenate([floor, wall]), rgb=rgb, align=False)
        world.wait(timeout=60)
        world.job("planes", colour=1)
        self.assertEqual([plane.rgb for plane in world.planes().planes], [(150, 150, 150), (160, 60, 60)])
        self.assertTrue(world.job("planes").metrics["planes"] == 2)
        model = world.planes()
        self.assertIsNone(model.planes[0].rgb)
        self.assertEqual([plane.kind for plane in model.planes], ["level", "wall"])
        np.testing.assert_allclose(model.planes[0].normal, (0, 0, 1), atol=0.01)
        self.assertAlmostEqual(model.planes[0].polygons[0].area, 36, delta=2)
        np.testing.assert_allclose(model.planes[1].normal, (-1, 0, 0), atol=0.01)
        self.assertAlmostEqual(model.planes[1].distance, -2.5, delta=0.01)
        self.assertEqual(model.planes[1].polygons[0].outer.shape[1], 3)
        self.assertEqual(model.epoch, 1)


class ObjectsTest(ServerTest):
    def test_things_have_boxes(self):
        world = self.db.create_map("crates")
        with self.assertRaises(strata.NotFound):
            world.objects()
        floor = grid((-3, 3), (-3, 3)) - (0, 0, 1)
        _, y, z = grid((-0.5, 0.5), (0, 1), lambda x, y: x).T
        crate = np.stack([np.full_like(y, 1.5), y, z], axis=1)
        labels = np.concatenate([np.full(len(floor), 1), np.full(len(crate), 2)])
        world.upload(np.concatenate([floor, crate]), labels=labels, align=False)
        world.wait(timeout=60)
        self.assertEqual(world.job("objects").metrics["entities"], 2)
        things = world.objects()
        self.assertEqual([thing.class_id for thing in things], [1, 2])
        found, = world.objects(class_id=2, region=(1, -1, 2, 2))
        self.assertAlmostEqual(found.centre[0], 1.5, delta=0.01)
        self.assertAlmostEqual(found.size[0], 1, delta=0.1)
        self.assertEqual(sum(found.scans.values()), found.points)
        self.assertEqual(len(world.objects(region=(100, 100, 0, 101, 101, 1))), 0)
        self.assertGreater(things.distances[2], 0.05)
        self.assertEqual(things.epoch, 1)

    def test_what_nobody_saw_is_inferred_from_others_of_the_kind(self):
        def side(count, step=0.05):
            return np.arange(count + 1) * step
        x, y, z = np.meshgrid(side(16), side(12), 0.1 + side(18), indexing="ij")
        block = np.stack([x, y, z], axis=-1).reshape(-1, 3)
        on_it = (block[:, :2] < 0.001).any(axis=1) | (block[:, 0] > 0.799) | (block[:, 1] > 0.599) | (block[:, 2] > 0.999)
        block = block[on_it]
        world = self.db.create_map("halves")
        with self.assertRaises(strata.NotFound):
            world.inferred()
        points = np.concatenate([block + (2, 2, 0), block[block[:, 0] < 0.55] + (2, -3, 0)])
        world.upload(points, labels=np.full(len(points), 2), align=False)
        world.wait(timeout=60)
        world.job("objects")
        whole, part = world.objects()
        self.assertEqual(whole.kind.id, part.kind.id)
        self.assertEqual(world.job("complete").metrics["entities"], 2)
        parts = world.inferred()
        self.assertEqual([each.entity for each in parts], [whole.id, part.id])
        self.assertEqual({each.kind for each in parts}, {whole.kind.id})
        added = parts[1].points
        self.assertGreater(len(added), 100)
        self.assertTrue(((added > (2.5, -3.1, 0)) & (added < (2.9, -2.3, 1.1))).all())
        self.assertGreater(parts[1].agreeing, 4 * parts[1].contradicting)
        found, = world.inferred(region=(2.6, -4, 3, -2))  # beyond what was measured of it
        self.assertEqual(found.entity, part.id)
        self.assertEqual(world.inferred(region=(5, 5, 6, 6)), [])

    def test_plans_keep_out_of_what_was_inferred_if_asked_to(self):
        def side(count, step=0.05):
            return np.arange(count + 1) * step
        x, y, z = np.meshgrid(side(16), side(12), 0.1 + side(18), indexing="ij")
        block = np.stack([x, y, z], axis=-1).reshape(-1, 3)
        on_it = (block[:, :2] < 0.001).any(axis=1) | (block[:, 0] > 0.799) | (block[:, 1] > 0.599) | (block[:, 2] > 0.999)
        block = block[on_it]
        world = self.db.create_map("hidden")
        things = np.concatenate([block + (2, 2, 0), block[block[:, 0] < 0.55] + (2, -3, 0)])
        world.upload(things, labels=np.full(len(things), 2), align=False)
        world.upload(grid((-1, 4), (-4, 0)), trajectory="floor", sensor_origin=(0, 0, 1), align=False)
        world.wait(timeout=60)
        robot = {"radius": 0.08, "height": 0.5, "max_gap": 0}
        way = world.plan((2.75, -3.5), (2.75, -2.1), profile=robot)
        self.assertTrue(way, way.message)
        straight = [(2.75, -3.5, 0), (2.75, -2.1, 0)]
        before = world.check_path(straight, profile=robot, inferred="obstacle")
        self.assertTrue(before, before.message)
        self.assertIn("nothing is inferred", before.message)
        world.job("objects")
        world.job("complete")
        self.assertTrue(world.check_path(straight, profile=robot))
        blocked = world.check_path(straight, profile=robot, inferred="obstacle", known=before)
        self.assertFalse(blocked)
        self.assertTrue(blocked.inferred)
        self.assertIn("inferred obstacle", blocked.message)
        goal = (2.75, -2.7)
        self.assertTrue(world.plan((2.75, -3.5), goal, profile=robot))
        refused = world.plan((2.75, -3.5), goal, profile=robot, inferred="obstacle")
        self.assertFalse(refused)
        self.assertTrue(refused.inferred, refused.message)
        cart = [strata.shape.box((0.1, 0.1, 0.4), (0, 0, 0.3))]
        self.assertTrue(world.check_shape(straight, parts=cart))
        touched = world.check_shape(straight, parts=cart, inferred="obstacle")
        self.assertTrue(touched.contacts[0].inferred, touched.message)
        with self.assertRaises(ValueError):
            world.plan((2.75, -3.5), goal, inferred="blocked")

    def test_kinds_go_into_the_library(self):
        world = self.db.create_map("kinds")
        self.assertEqual(world.kinds(), [])
        points = grid((0, 1), (0, 1))
        box = world.import_kind("box", "crate", points, [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        self.assertEqual((box.name, box.origin, len(box.id)), ("box", "imported", 12))
        read = world.kind(box.id[:6])
        np.testing.assert_allclose(read.points, points, atol=1e-6)
        self.assertEqual(read.triangles.tolist(), [[0, 1, 2]])
        self.assertEqual(world.rename_kind("box", "tray").id, box.id)
        self.assertEqual([kind.name for kind in world.kinds()], ["tray"])
        with self.assertRaises(strata.InvalidArgument):
            world.import_kind("far", "crate", points + (1e9, 0, 0))
        world.delete_kind("tray")
        with self.assertRaises(strata.NotFound):
            world.kind("tray")


class ReadmeTest(ServerTest):
    def test_its_examples_run(self):
        examples = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            for example in examples:
                exec(compile(example.replace("127.0.0.1:50051", self.server.address), str(README), "exec"), {})
        lines = printed.getvalue().splitlines()
        self.assertEqual(lines[:4], ["durable", "10000 surfaces, 0.00 to 0.00 m", "8.5 m", "2 found"])
        self.assertTrue(all(line.isdigit() for line in lines[4:]), lines)


if __name__ == "__main__":
    unittest.main()
