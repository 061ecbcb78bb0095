"""strata.aio against a real stratad: many calls in one thread, and how they end."""
import asyncio
import logging
import signal
import tempfile
import threading
import time
import unittest

import numpy as np

import strata
from strata import aio
from strata.blocking import run
from support import DECK_M, Stratad, bridge, grid


class AioTest(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        logging.getLogger("asyncio").setLevel(logging.ERROR)  # debug mode tells of every slow step of the tests themselves
        folder = self.enterContext(tempfile.TemporaryDirectory())
        self.server = Stratad(folder)
        self.server.start()
        self.addCleanup(self.server.stop)
        self.db = await self.enterAsyncContext(await aio.connect(self.server.address))

    async def bridge(self):
        world = await self.db.create_map("bridge")
        await world.upload(bridge(), trajectory="run", sequence=1)
        await world.wait(timeout=120)
        return world

    async def test_calls_run_beside_each_other_in_one_thread(self):
        world = await self.bridge()
        threads = threading.active_count()
        goals = [((-15, 0), (0, 0, DECK_M)), ((0, -6), (0, 6))] * 20
        tiles, *paths = await asyncio.gather(world.fetch(), *(world.plan(*pair) for pair in goals))
        self.assertTrue(all(paths))
        self.assertLess(threading.active_count() - threads, 10)
        with strata.connect(self.server.address) as db:  # the blocking client works beside an event loop, too
            same = db.map("bridge").fetch()
        self.assertEqual(list(tiles), list(same))
        for key, tile in tiles.items():
            np.testing.assert_array_equal(tile.surfaces, same[key].surfaces)
        stats = await world.stats()
        self.assertEqual((stats.scans, [scan.sequence for scan in await world.scans()]), (1, [1]))

    async def test_the_loop_is_free_while_calls_wait(self):
        world = await self.bridge()
        ticks = 0

        async def tick():
            nonlocal ticks
            while True:
                await asyncio.sleep(0.005)
                ticks += 1

        ticking = asyncio.create_task(tick())
        await world.job("rebuild")
        begun = time.monotonic()
        changes = world.watch()
        await anext(changes)
        with self.assertRaises(asyncio.TimeoutError):
            await asyncio.wait_for(anext(changes), 0.5)
        self.assertLess(time.monotonic() - begun, 5)
        ticking.cancel()
        self.assertGreater(ticks, 50)

    async def test_a_watch_ends_when_its_task_is_cancelled(self):
        world = await self.db.create_map("watched")
        seen = asyncio.Event()

        async def follow():
            async for _ in world.watch():
                seen.set()

        following = asyncio.create_task(follow())
        await seen.wait()
        following.cancel()
        with self.assertRaises(asyncio.CancelledError):
            await following
        self.assertEqual(await self.db.maps(), ["watched"])

    async def test_closing_ends_calls_as_cancelled(self):
        world = await self.db.create_map("closed")
        changes = world.watch()
        await anext(changes)
        waiting = asyncio.ensure_future(anext(changes))
        await asyncio.sleep(0.1)
        await self.db.close()
        with self.assertRaises(strata.Cancelled):
            await waiting

    async def test_uploads_and_watches_survive_a_server_that_is_killed(self):
        world = await self.db.create_map("uploads")
        scans = [grid((0, 1), (0, 1)) + [k, 0, 0] for k in range(30)]
        answers = []

        async def restart():
            while len(answers) < 5:
                await asyncio.sleep(0.01)
            self.server.stop(signal.SIGKILL)
            await asyncio.sleep(0.2)
            await asyncio.to_thread(self.server.start)

        restarting = asyncio.create_task(restart())
        async for answer in world.ingest({"points": points, "trajectory": "run", "sequence": k + 1, "align": False}
                                         for k, points in enumerate(scans)):
            answers.append(answer)
            await asyncio.sleep(0.02)
        await restarting
        self.assertEqual([answer.sequence for answer in answers], list(range(1, 31)))
        await world.wait(timeout=60)
        self.assertEqual([scan.sequence for scan in await world.scans()], list(range(1, 31)))

    async def test_a_robot_is_followed(self):
        world = await self.bridge()
        odometry = np.eye(4)
        async with await world.follow((np.zeros(3), [0, 0, 0, 1])) as robot:
            first = await robot.step(bridge(), odometry, sensor_origin=(0, 0, 6))
            blind = await robot.step(None, odometry)
        self.assertIn(first.state, ("tracked", "lost"))
        self.assertEqual((blind.score, blind.epoch), (0, first.epoch))

    async def test_nobody_answers(self):
        with self.assertRaisesRegex(strata.Unavailable, "is stratad running"):
            await aio.connect("127.0.0.1:1", timeout=0.2)

    async def test_a_blocking_connection_refuses_to_wait_for_a_loop(self):
        with self.assertRaisesRegex(RuntimeError, "event loop"):
            run(asyncio.sleep(1))


if __name__ == "__main__":
    unittest.main()
