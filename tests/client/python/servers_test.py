"""The Python client with several servers on one database."""
import concurrent.futures
import contextlib
import pathlib
import signal
import sys
import tempfile
import time
import unittest

import grpc
import numpy as np

import strata
from strata import aio
from strata.v1 import error_pb2, maps_pb2, maps_pb2_grpc
from support import Stratad, grid

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))

from postgres_database import Database  # noqa: E402, from the folder above


class OwningMaps(maps_pb2_grpc.MapsServicer):
    """Has the maps, or says that another server has them."""

    def __init__(self, name, owner):
        self.name, self.owner, self.asked, self.deleted = name, owner, 0, 0

    def _refuse_unless_here(self, context):
        self.asked += 1
        if self.owner == self.name:
            return
        detail = error_pb2.ErrorDetail(reason="OTHER_SERVER", metadata={"owner": self.owner, "retry_delay_ms": "1000"})
        status = error_pb2.ErrorStatus(code=grpc.StatusCode.UNAVAILABLE.value[0])
        status.details.add().Pack(detail)
        context.set_trailing_metadata([("grpc-status-details-bin", status.SerializeToString())])
        context.abort(grpc.StatusCode.UNAVAILABLE, f"in use by server {self.owner}")

    def List(self, request, context):  # noqa: N802, gRPC's name
        self._refuse_unless_here(context)
        return maps_pb2.ListMapsResponse(maps=[maps_pb2.MapInfo(name=self.name)])

    def Delete(self, request, context):  # noqa: N802
        self._refuse_unless_here(context)
        self.deleted += 1
        return maps_pb2.DeleteMapResponse()


@contextlib.contextmanager
def serving(maps):
    server = grpc.server(concurrent.futures.ThreadPoolExecutor(4))
    maps_pb2_grpc.add_MapsServicer_to_server(maps, server)
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    try:
        yield f"127.0.0.1:{port}"
    finally:
        server.stop(None).wait()


class OwnerTest(unittest.TestCase):
    def setUp(self):
        self.a, self.b = OwningMaps("a", "b"), OwningMaps("b", "b")
        self.addresses = ",".join(self.enterContext(serving(maps)) for maps in (self.a, self.b))

    def test_calls_go_to_the_server_that_has_the_map(self):
        with strata.connect(self.addresses) as db:
            begun = time.monotonic()
            for _ in range(6):
                self.assertEqual(db.maps(), ["b"])
                db.delete_map("any")  # what must not happen twice, too: it has not happened
            self.assertLess(time.monotonic() - begun, 1)  # nobody waited for the delay of a server that has not the map
        self.assertGreater(self.a.asked, 0)
        self.assertEqual(self.b.deleted, 6)

    def test_who_knows_one_server_is_sent_to_the_one_that_has_the_map(self):
        one, other = self.addresses.split(",")
        self.a.owner = other
        with strata.connect(one, patience=5) as db:
            for _ in range(3):
                self.assertEqual(db.maps(), ["b"])
                db.delete_map("any")
            self.assertEqual((self.a.asked, self.b.deleted), (1, 3))
            self.b.owner, self.a.owner = one, "a"  # it has moved
            self.assertEqual(db.maps(), ["a"])

    def test_one_that_is_named_and_away_holds_up_nobody(self):
        self.a.owner = "127.0.0.1:1"
        with strata.connect(self.addresses.split(",")[0], patience=20) as db:
            with concurrent.futures.ThreadPoolExecutor() as pool:
                asking = pool.submit(db.maps)
                while self.a.asked < 2:
                    time.sleep(0.01)
                self.a.owner = "a"
                self.assertEqual(asking.result(), ["a"])

    def test_a_token_is_not_carried_in_plain_text_to_whoever_is_named(self):
        self.a.owner = "192.0.2.1:50051"  # an address of nobody
        with strata.connect(self.addresses.split(",")[0], token="secret", patience=0.5) as db:
            with self.assertRaises(strata.Unavailable) as caught:
                db.maps()
        self.assertEqual(caught.exception.owner, self.a.owner)

    def test_one_that_nobody_has_is_told_of(self):
        self.a.owner = self.b.owner = "c"
        with strata.connect(self.addresses, patience=0) as db:
            with self.assertRaises(strata.Unavailable) as caught:
                db.delete_map("any")
        self.assertEqual((caught.exception.reason, caught.exception.owner), ("OTHER_SERVER", "c"))

    def test_addresses_that_are_none(self):
        with self.assertRaisesRegex(ValueError, "expected HOST:PORT"):
            strata.connect("127.0.0.1:50051,nowhere")
        with self.assertRaisesRegex(strata.Unavailable, "no IPv4 address"):
            strata.connect("127.0.0.1:50051,no.such.host.invalid:1")


class AioOwnerTest(unittest.IsolatedAsyncioTestCase):
    async def test_calls_go_to_the_server_that_has_the_map(self):
        a, b = OwningMaps("a", "b"), OwningMaps("b", "b")
        with serving(a) as one, serving(b) as other:
            async with await aio.connect(f"{one},{other}") as db:
                for _ in range(6):
                    self.assertEqual(await db.maps(), ["b"])
                    await db.delete_map("any")
        self.assertGreater(a.asked, 0)
        self.assertEqual(b.deleted, 6)


    async def test_who_knows_one_server_is_sent_to_the_one_that_has_the_map(self):
        a, b = OwningMaps("a", "b"), OwningMaps("b", "b")
        with serving(a) as one, serving(b) as other:
            a.owner = other
            async with await aio.connect(one) as db:
                self.assertEqual(await db.maps(), ["b"])
                await db.delete_map("any")
        self.assertEqual((a.asked, b.deleted), (1, 1))


class TwoServersTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        database = cls.enterClassContext(Database())
        if database.address is None:
            raise unittest.SkipTest("PostgreSQL 15 is not installed")
        cls.servers = []
        for name in ("one", "two"):
            folder = cls.enterClassContext(tempfile.TemporaryDirectory())
            server = Stratad(folder, "--store", database.address, "--server-name", name, "--map-lease", 1)
            server.start()
            cls.addClassCleanup(server.stop)
            cls.servers.append(server)
        cls.addresses = ",".join(server.address for server in cls.servers)

    def test_everything_goes_on_when_the_server_that_has_the_map_is_killed(self):
        with strata.connect(self.addresses) as db:
            world = db.create_map("shared")
            seen, changes = set(), world.watch()
            scans = [np.random.default_rng(k).uniform(-5, 5, (2_000, 3)) for k in range(12)]
            for k, points in enumerate(scans):
                if k == 6:
                    owner = self.servers[self._owner_of("shared")]
                    owner.stop(signal.SIGKILL)
                ack = world.upload(points, trajectory="run", align=False)
                self.assertEqual(ack.sequence, k + 1)
                if k == 9:
                    owner.start()
                while ack.sequence not in seen:
                    seen |= {scan.sequence for scan in next(changes).scans}
            changes.close()
            acks = list(world.ingest({"points": points, "trajectory": "more", "align": False} for points in scans))
            self.assertEqual([ack.sequence for ack in acks], list(range(1, 13)))
            world.wait(timeout=120)
            self.assertEqual(world.job("verify").metrics["mismatches"], 0)
            self.assertEqual(len(world.scans()), 24)
            with tempfile.TemporaryDirectory() as folder:
                world.backup(f"{folder}/shared.strata")

    def _owner_of(self, name):
        """By asking one of them for what only the server that has the map does."""
        with strata.connect(self.servers[0].address, patience=0) as db:
            try:
                db.map(name).set_class(1, "ground", (0, 0, 0))
            except strata.Unavailable as refused:
                self.assertEqual(refused.owner, "two")
                return 1
        return 0


if __name__ == "__main__":
    unittest.main()
