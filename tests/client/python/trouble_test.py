"""The Python client where servers are killed, busy, or ask who one is."""
import concurrent.futures
import contextlib
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest

import grpc
import numpy as np

import strata
from strata.v1 import error_pb2, maps_pb2, maps_pb2_grpc
from support import ServerTest, grid


class RestartTest(ServerTest):
    def restart(self):
        self.server.stop(signal.SIGKILL)
        time.sleep(0.2)
        self.server.start()

    def test_uploads_survive_a_server_that_is_killed(self):
        world = self.db.create_map("uploads")
        scans = [np.random.default_rng(k).uniform(-5, 5, (20_000, 3)) for k in range(20)]
        acks, begun = [], threading.Event()

        def upload():
            for points in scans:
                acks.append(world.upload(points, trajectory="run", align=False))
                begun.set()

        with concurrent.futures.ThreadPoolExecutor() as pool:
            uploading = pool.submit(upload)
            begun.wait(timeout=60)
            for _ in range(2):
                self.restart()
            uploading.result()
        self.assertEqual([ack.sequence for ack in acks], list(range(1, len(scans) + 1)))
        world.wait(timeout=120)
        self.assertEqual([scan.sequence for scan in world.scans()], list(range(1, len(scans) + 1)))
        for ack, points in list(zip(acks, scans))[::7]:
            np.testing.assert_array_equal(world.points(ack).xyz, points.astype(np.float32))
        self.assertEqual(world.job("verify").metrics["mismatches"], 0)

    def test_watches_come_back_and_miss_nothing(self):
        world = self.db.create_map("watched")
        seen, changes = set(), world.watch()
        next(changes)
        for sequence in (1, 2, 3):
            world.upload(grid((0, 1), (0, 1)), trajectory="run", sequence=sequence)
            while sequence not in seen:
                seen |= {scan.sequence for scan in next(changes).scans}
            self.restart()
        changes.close()
        self.assertEqual(seen, {1, 2, 3})

    def test_jobs_are_followed_over_a_restart(self):
        world = self.db.create_map("followed")
        world.upload(grid((-20, 20), (-20, 20)), align=False)
        world.wait(timeout=120)
        job = world.start_job("rebuild")
        self.restart()
        self.assertEqual(world.follow_job(job).state, "succeeded")

    def test_patience_ends(self):
        with strata.connect(self.server.address, patience=0) as hasty:
            self.server.stop()
            try:
                with self.assertRaises(strata.Unavailable):
                    hasty.maps()
                with self.assertRaises(ConnectionError):
                    hasty.create_map("lost")
            finally:
                self.server.start()
            self.assertNotIn("lost", self.db.maps())


def status_details(code, reason, retry_delay_ms=None):
    detail = error_pb2.ErrorDetail(reason=reason, metadata={"request_id": "7-1"})
    if retry_delay_ms is not None:
        detail.metadata["retry_delay_ms"] = str(retry_delay_ms)
    status = error_pb2.ErrorStatus(code=code)
    status.details.add().Pack(detail)
    return ("grpc-status-details-bin", status.SerializeToString())


class ToldMaps(maps_pb2_grpc.MapsServicer):
    """Refuses List as often as told, then answers with the token that came."""

    def __init__(self):
        self.refusals = []
        self.calls = []
        self.thinks_s = 0

    def List(self, request, context):  # noqa: N802, gRPC's name
        self.calls.append(time.monotonic())
        time.sleep(self.thinks_s)
        if self.refusals:
            code, *detail = self.refusals.pop()
            context.set_trailing_metadata([status_details(code.value[0], *detail)])
            context.abort(code, "not now")
        token = dict(context.invocation_metadata()).get("authorization", "nobody")
        return maps_pb2.ListMapsResponse(maps=[maps_pb2.MapInfo(name=token)])


@contextlib.contextmanager
def serving(maps, credentials=None):
    server = grpc.server(concurrent.futures.ThreadPoolExecutor(4))
    maps_pb2_grpc.add_MapsServicer_to_server(maps, server)
    port = (server.add_secure_port("127.0.0.1:0", credentials) if credentials
            else server.add_insecure_port("127.0.0.1:0"))
    server.start()
    try:
        yield f"127.0.0.1:{port}"
    finally:
        server.stop(None).wait()


@contextlib.contextmanager
def dropping_streams():
    """A server that drops every stream as gRPC's does where it is short of memory; its address and the streams."""
    dropped = []

    def serve(listener):
        with listener.accept()[0] as peer, peer.makefile("rb") as wire:
            wire.read(len(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"))
            peer.sendall(struct.pack(">IBI", 4, 0, 0))  # no settings
            while len(head := wire.read(9)) == 9:
                size_and_kind, _, stream = struct.unpack(">IBI", head)
                body = wire.read(size_and_kind >> 8)
                if size_and_kind & 255 == 1:  # HEADERS
                    dropped.append(stream)
                    peer.sendall(struct.pack(">IBII", 4 << 8 | 3, 0, stream, 11))
                elif size_and_kind & 255 == 6:  # PING
                    peer.sendall(struct.pack(">IBI", 8 << 8 | 6, 1, 0) + body)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=serve, args=(listener,), daemon=True).start()
        yield f"127.0.0.1:{listener.getsockname()[1]}", dropped


class BusyTest(unittest.TestCase):
    def setUp(self):
        self.maps = ToldMaps()
        self.db = self.enterContext(strata.connect(self.enterContext(serving(self.maps))))

    def test_a_busy_server_is_tried_again_when_it_says_so(self):
        self.maps.refusals = [(grpc.StatusCode.RESOURCE_EXHAUSTED, "SERVER_BUSY", 700)] * 2
        self.assertEqual(self.db.maps(), ["nobody"])
        self.assertEqual(len(self.maps.calls), 3)
        self.assertTrue((np.diff(self.maps.calls) >= 0.7).all())

    def test_a_stream_that_was_dropped_for_memory_is_tried_again(self):
        address, dropped = self.enterContext(dropping_streams())
        db = self.enterContext(strata.connect(address, patience=1.0))
        with self.assertRaisesRegex(strata.Unavailable, "short of memory"):
            db.maps()
        self.assertGreater(len(dropped), 2)

    def test_what_a_server_that_ends_cancels_is_asked_for_again(self):
        self.maps.refusals = [(grpc.StatusCode.CANCELLED, "")] * 2
        self.assertEqual(self.db.maps(), ["nobody"])
        self.assertEqual(len(self.maps.calls), 3)

    def test_a_call_ends_when_the_database_is_closed(self):
        self.maps.refusals = [(grpc.StatusCode.UNAVAILABLE, "")] * 100
        with concurrent.futures.ThreadPoolExecutor() as pool:
            asking = pool.submit(self.db.maps)
            while not self.maps.calls:
                time.sleep(0.01)
            self.db.close()
            with self.assertRaises((strata.Unavailable, strata.Cancelled)):
                asking.result()

    def test_what_will_not_pass_is_told_at_once(self):
        for code, kind in ((grpc.StatusCode.RESOURCE_EXHAUSTED, strata.ResourceExhausted),
                           (grpc.StatusCode.PERMISSION_DENIED, strata.PermissionDenied),
                           (grpc.StatusCode.DATA_LOSS, strata.DataLoss),
                           (grpc.StatusCode.INTERNAL, strata.StrataError)):
            self.maps.calls, self.maps.refusals = [], [(code, "DATABASE")]
            with self.assertRaises(kind) as caught:
                self.db.maps()
            error = caught.exception
            self.assertEqual((str(error), error.code, error.reason, error.request_id, error.retry_delay),
                             ("not now", code, "DATABASE", "7-1", None))
            self.assertEqual(len(self.maps.calls), 1)

    def test_a_timeout_ends_a_call(self):
        self.maps.thinks_s = 1
        with serving(self.maps) as address, strata.connect(address, timeout=0.2) as hurried:
            with self.assertRaises(TimeoutError):
                hurried.maps()


class DoorTest(unittest.TestCase):
    """TLS of gRPC's own server, with a certificate that signs itself."""

    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.certificate, cls.key = f"{folder}/certificate.pem", f"{folder}/key.pem"
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                        "-keyout", cls.key, "-out", cls.certificate, "-days", "2", "-subj", "/CN=localhost",
                        "-addext", "subjectAltName=IP:127.0.0.1"], check=True, stderr=subprocess.DEVNULL)

    def serving(self, mutual=False):
        with open(self.key, "rb") as key, open(self.certificate, "rb") as certificate:
            pair = key.read(), certificate.read()
        return serving(ToldMaps(), grpc.ssl_server_credentials([pair], pair[1] if mutual else None, mutual))

    def test_tokens_go_with_every_call(self):
        with self.serving() as address, strata.connect(address, ca=self.certificate, token="secret") as db:
            self.assertEqual(db.maps(), ["Bearer secret"])
        with self.serving() as address, strata.connect(address, ca=self.certificate) as db:
            self.assertEqual(db.maps(), ["nobody"])

    def test_both_sides_show_a_certificate(self):
        with self.serving(mutual=True) as address:
            with strata.connect(address, ca=self.certificate, certificate=self.certificate, key=self.key) as db:
                self.assertEqual(db.maps(), ["nobody"])

    def test_options_that_make_no_sense(self):
        with self.assertRaisesRegex(ValueError, "roots to trust"):
            strata.connect("127.0.0.1:1", certificate=self.certificate, key=self.key)
        with self.assertRaisesRegex(ValueError, "go together"):
            strata.connect("127.0.0.1:1", ca=self.certificate, key=self.key)
        with self.assertRaises(FileNotFoundError):
            strata.connect("127.0.0.1:1", ca="nowhere.pem")

    def test_a_server_that_is_not_trusted_is_not_talked_to(self):
        with self.serving() as address, self.assertRaisesRegex(strata.Unavailable, "with or without TLS"):
            strata.connect(address, ca=True, timeout=1)


if __name__ == "__main__":
    unittest.main()
