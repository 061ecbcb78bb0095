#!/usr/bin/python3
"""Well-behaved clients beside hostile ones: does the server stay up, healthy, within its memory, and quick?

    tests/experiments/hostile_clients.py --build build/release [--seconds 15] [--connections 10000] [--only garbage,claims]
                                         [--limit-mb 512] [--period-s 0.2] [--seed 1] [--proxy] [-- STRATAD OPTIONS]

A real stratad with tokens. Robots upload, readers fetch and planners plan at a steady pace, first alone and then beside
each attack; the attackers have a token of their own, and run at low priority so that their own work weighs less. A row
an attack: p99 of the well-behaved calls (the tiles they fetch are not decoded) and its ratio to the median of the p99s
alone (measured before and after, too), the peak of the resident set during the attack (VmHWM), what health checks say
after it, and how many connections, threads and megabytes are left. Exits 1 where the server dies, is not healthy, takes
more than --limit-mb, refuses a well-behaved client for good, or a ratio is above 2 (and the p99 grows by more than 20 ms).
With --proxy all go through HAProxy as deploy/haproxy.cfg has it, without TLS. Attackers that speak HTTP/2 by hand come
from 127.0.0.2. Needs python3-grpcio, python3-numpy and, with --proxy, haproxy.
"""
import argparse
import multiprocessing
import os
import pathlib
import queue
import re
import resource
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.append(str(ROOT / "tests/bench"))
from endurance import HALF_M, MAP, scan_at  # pylint: disable=wrong-import-position
from stratad import Stratad  # pylint: disable=wrong-import-position

GOOD = ("upload", "upload", "fetch", "plan")
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"


# The well-behaved.

def good_client(kind, build, address, token, seed, period_s, told, over):
    sys.path.append(str(build / "client/python"))
    import strata
    import strata.aio.surfaces
    # Decoding is work of the client's own machine, which here is the server's, too.
    strata.aio.surfaces.decode_tile = lambda data, cell_size: data
    random = np.random.default_rng(seed)
    with strata.connect(address, token=token) as db:
        world = db.map(MAP)
        points = scan_at(random, 0, 0)[:4000]
        while not over.is_set():
            begun = time.monotonic()
            try:
                x, y = random.uniform(-HALF_M, HALF_M, 2)
                if kind == "upload":
                    world.upload(points, ([x, y, 1], [0, 0, 0, 1]), trajectory=f"good{seed}", align=False)
                elif kind == "fetch":
                    world.fetch((x, y, x + 20, y + 20))
                else:
                    world.plan((x, y), random.uniform(-HALF_M, HALF_M, 2))
                told.put((kind, time.monotonic() - begun, ""))
            except strata.StrataError as error:
                told.put((kind, time.monotonic() - begun, f"{type(error).__name__}: {error}"))
            time.sleep(max(0.0, period_s - (time.monotonic() - begun)))
    told.cancel_join_thread()


# HTTP/2 by hand.

def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + struct.pack(">BBI", kind, flags, stream) + payload


def header(name, value):
    """Literal, never indexed."""
    name, value = name.encode(), value.encode()
    return b"\x10" + bytes([len(name)]) + name + bytes([len(value)]) + value


def call_headers(stream, path, token):
    block = b"".join(header(*item) for item in (
        (":method", "POST"), (":scheme", "http"), (":path", path), (":authority", "x"), ("te", "trailers"),
        ("content-type", "application/grpc"), ("authorization", f"Bearer {token}")))
    return frame(1, 4, stream, block)


def connect(address):
    host, port = address.rsplit(":", 1)
    return socket.create_connection((host, int(port)), timeout=5, source_address=("127.0.0.2", 0))


def swallow(peer):
    peer.setblocking(False)
    try:
        while peer.recv(1 << 16):
            pass
    except OSError:
        pass
    peer.setblocking(True)
    peer.settimeout(5)


def repeat_on_sockets(address, until, body):
    """body(peer) over and over, each time on a new connection."""
    while time.monotonic() < until:
        try:
            with connect(address) as peer:
                body(peer)
        except OSError:
            time.sleep(0.01)


# The attacks: each runs until `until` against `a` (address, token, build, random, options).

def slow_senders(a, until):
    wire = PREFACE + frame(4, 0, 0) + call_headers(1, "/strata.v1.Scans/Upload", a.token) + frame(0, 0, 1, bytes(4096))
    peers = [connect(a.address) for _ in range(200)]
    for i in range(len(wire)):
        for peer in peers:
            try:
                peer.send(wire[i:i + 1])
            except OSError:
                pass
        time.sleep(1)
        if time.monotonic() > until:
            return


def silent_streams(a, until):
    from strata.v1 import scans_pb2
    calls = []
    for i in range(600):
        def silence(number=i):
            if number % 2:
                yield scans_pb2.UploadScanRequest(start=scans_pb2.ScanStart(map=MAP, header=scans_pb2.ScanHeader(
                    id=scans_pb2.ScanId(trajectory="silent", sequence=number + 1), point_count=10)))
            while time.monotonic() < until:
                time.sleep(0.5)
        method = a.scans.Ingest if i % 3 == 0 else a.scans.Upload
        if i % 3 == 0:
            calls.append(method(iter(scans_pb2.IngestScansRequest(start=m.start) for m in silence()),
                                metadata=a.metadata))
        elif i < 300:  # a Python stream holds a thread
            calls.append(method.future(silence(), metadata=a.metadata))
    time.sleep(max(0.0, until - time.monotonic()))


def connections(first):
    def attack(a, until):
        peers = []
        while len(peers) < a.options.connections and time.monotonic() < until:
            try:
                peers.append(connect(a.address))
                if first:
                    peers[-1].send(first)
            except OSError:
                time.sleep(0.05)
        print(f"  {len(peers)} connections", file=sys.stderr)
        time.sleep(max(0.0, until - time.monotonic()))
    return attack


def garbage(a, until):
    repeat_on_sockets(a.address, until, lambda peer: (
        peer.send(PREFACE if a.random.integers(2) else b""), peer.send(a.random.bytes(int(a.random.integers(1, 5000)))),
        swallow(peer)))


def http1(a, until):
    repeat_on_sockets(a.address, until, lambda peer: (peer.send(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"), peer.recv(100)))


def floods(a, until):
    def flood(peer):
        peer.send(PREFACE + frame(4, 0, 0))
        burst = b"".join(frame(6, 0, 0, bytes(8)) + frame(4, 0, 0, struct.pack(">HI", 4, 65535 + i)) for i in range(500))
        while time.monotonic() < until:
            peer.sendall(burst)
            swallow(peer)
    repeat_on_sockets(a.address, until, flood)


def rapid_resets(path, known=True):
    """RPCs begun and cancelled at once, all on one connection after another."""
    def attack(a, until):
        def reset(peer):
            peer.send(PREFACE + frame(4, 0, 0))
            for stream in range(1, 200_001, 2):
                peer.sendall(call_headers(stream, path, a.token if known else "") +
                             frame(3, 0, stream, struct.pack(">I", 8)))
                if stream % 512 == 1:
                    swallow(peer)
                if time.monotonic() > until:
                    return
        repeat_on_sockets(a.address, until, reset)
    return attack


def stranger_bodies(path):
    """Requests of 4 MB of empty items, without a token."""
    def attack(a, until):
        import grpc
        with grpc.insecure_channel(a.address) as channel:
            call = channel.unary_unary(path)
            in_parallel(40, until, lambda: call(b"\x1a\x00" * 2_000_000, timeout=20))
    return attack


def cancelled(a, until):
    from strata.v1 import maps_pb2
    while time.monotonic() < until:
        calls = [a.maps.Stats.future(maps_pb2.GetMapStatsRequest(name=MAP), metadata=a.metadata) for _ in range(200)]
        for call in calls:
            call.cancel()


def refused(call):
    """Waits for the error that a bad request must get; RuntimeError if it gets none."""
    import grpc
    try:
        call()
    except (grpc.RpcError, ValueError):
        return
    raise RuntimeError("a bad request was answered OK")


def big_headers(a, until):
    from strata.v1 import maps_pb2
    while time.monotonic() < until:
        for size in (10_000, 30_000, 1_000_000):
            refused(lambda n=size: a.maps.List(maps_pb2.ListMapsRequest(), timeout=5,
                                               metadata=(("x-big", "a" * n),)))


def names(a, until):
    from strata.v1 import maps_pb2
    while time.monotonic() < until:
        for name in ("../../etc/passwd", "a\0b", "/", "..", "", "x" * 1_000_000, "\u202e", "a/b", "con\n"):
            refused(lambda n=name: a.maps.Get(maps_pb2.GetMapRequest(name=n), metadata=a.metadata, timeout=5))
            refused(lambda n=name: a.maps.Create(maps_pb2.CreateMapRequest(name=n), metadata=a.metadata, timeout=5))


def tokens(a, until):
    from strata.v1 import maps_pb2
    while time.monotonic() < until:
        wrong = (("authorization", f"Bearer {a.random.bytes(20).hex()}"),)
        calls = [a.maps.List.future(maps_pb2.ListMapsRequest(), metadata=wrong, timeout=5) for _ in range(100)]
        for call in calls:
            refused(call.result)


def scan_messages(points, sequence, **fields):
    from strata.v1 import scans_pb2
    head = scans_pb2.ScanHeader(id=scans_pb2.ScanId(trajectory="bad", sequence=sequence),
                                point_count=fields.pop("point_count", len(points)), **fields)
    yield scans_pb2.UploadScanRequest(start=scans_pb2.ScanStart(map=MAP, header=head))
    for begin in range(0, len(points), 40_000):
        yield scans_pb2.UploadScanRequest(chunk=scans_pb2.PointChunk(
            xyz=np.ascontiguousarray(points[begin:begin + 40_000], "<f4").tobytes()))


def bad_numbers(a, until):
    from strata.v1 import geometry_pb2, planning_pb2
    good = scan_at(a.random, 0, 0)
    sequence = 0
    while time.monotonic() < until:
        for value in (np.nan, np.inf, -np.inf, 1e30, 2e6):
            points = good.copy()
            points[a.random.integers(len(points)), a.random.integers(3)] = value
            sequence += 1
            refused(lambda p=points, s=sequence: a.scans.Upload(scan_messages(p, s), metadata=a.metadata))
        for value in (np.nan, np.inf, 1e300, -1e300):
            pose = geometry_pb2.Pose(translation=geometry_pb2.Vector3(x=value),
                                     rotation=geometry_pb2.Quaternion(w=1))
            refused(lambda p=pose: a.scans.Upload(scan_messages(good, 1, pose=p), metadata=a.metadata))
            to = planning_pb2.PlanEndpoint(x_m=value, y_m=value)
            refused(lambda t=to: a.planning.PlanPath(planning_pb2.PlanPathRequest(map=MAP, to=t, **{"from": t}),
                                                     metadata=a.metadata))


def absurd_extents(a, until):
    """Each point in a tile of its own, all over the map; taken in, so deleted again."""
    from strata.v1 import scans_pb2, sensor_model_pb2
    sequence = 10_000
    while time.monotonic() < until:
        sequence += 1
        points = a.random.uniform(-1e6, 1e6, (40_000, 3)).astype(np.float32)
        points[:, 2] = a.random.uniform(-1000, 1000, len(points))
        sensor = sensor_model_pb2.SensorModel(sigma_m=0.05, max_range_m=1e6)
        try:
            a.scans.Upload(scan_messages(points, sequence, alignment=scans_pb2.ALIGNMENT_OFF, sensor=sensor),
                           metadata=a.metadata, timeout=60)
        except Exception as error:  # pylint: disable=broad-except
            print(f"  {str(error)[:300]}", file=sys.stderr)
        time.sleep(5)


def claims(a, until):
    good = scan_at(a.random, 0, 0)
    while time.monotonic() < until:
        for count in (10**9, 10**12, 2**64 - 1):
            refused(lambda c=count: a.scans.Upload(scan_messages(good, 1, point_count=c), metadata=a.metadata, timeout=20))
        refused(lambda: a.scans.Upload(scan_messages(good, 1, point_count=90_000_000), metadata=a.metadata, timeout=20))


def disorder(a, until):
    good = scan_at(a.random, 0, 0)
    while time.monotonic() < until:
        messages = list(scan_messages(good, 2))
        for order in ([1], [1, 0], [0, 0], [0, 1, 1], [0, 1, 0], []):
            refused(lambda o=order: a.scans.Upload(iter(messages[i] for i in o), metadata=a.metadata, timeout=20))
        refused(lambda: a.scans.Upload(scan_messages(good, 3, content_hash="0" * 32), metadata=a.metadata, timeout=20))


def big_messages(a, until):
    from strata.v1 import scans_pb2
    chunk = scans_pb2.UploadScanRequest(chunk=scans_pb2.PointChunk(xyz=bytes(60 << 20)))
    while time.monotonic() < until:
        refused(lambda: a.scans.Upload(iter([next(scan_messages(np.zeros((1, 3)), 4)), chunk]), metadata=a.metadata,
                                       timeout=20))


def bombs(a, until):
    import grpc
    from strata.v1 import scans_pb2
    for size in (3 << 20, 60 << 20, 500 << 20):
        chunk = scans_pb2.UploadScanRequest(chunk=scans_pb2.PointChunk(xyz=bytes(size)))
        for _ in range(20):
            if time.monotonic() > until:
                return
            refused(lambda c=chunk: a.scans.Upload(iter([next(scan_messages(np.zeros((1, 3)), 4)), c]), timeout=20,
                                                   metadata=a.metadata, compression=grpc.Compression.Gzip))


def own_map(a, name, scans, half_m, cell_size, count):
    """A map of the attacker's with `scans` floors of `count` points; made once."""
    import strata
    with strata.connect(a.address, token=a.token) as db:
        try:
            world = db.create_map(name, cell_size=cell_size)
        except strata.AlreadyExists:
            return
        for _ in range(scans):
            points = a.random.uniform(-half_m, half_m, (count, 3)).astype(np.float32)
            points[:, 2] = a.random.normal(-1, 0.01, count)
            world.upload(points, ([0, 0, 1], [0, 0, 0, 1]), trajectory="bad", align=False)
        world.wait()


def in_parallel(count, until, body):
    """body() over and over on `count` threads; what it is refused does not matter."""
    import grpc

    def repeat():
        while time.monotonic() < until:
            try:
                body()
            except grpc.RpcError:
                time.sleep(0.01)
    threads = [threading.Thread(target=repeat, daemon=True) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def waiting_edits(a, until):
    """Edits behind rebuilds, each of which has the map to itself."""
    from strata.v1 import geometry_pb2, jobs_pb2, posegraph_pb2, scans_pb2
    own_map(a, "edited", 12, 10, 0.1, 60_000)
    scan = scans_pb2.ScanId(trajectory="bad", sequence=1)
    pose = geometry_pb2.Pose(translation=geometry_pb2.Vector3(z=1), rotation=geometry_pb2.Quaternion(w=1))
    for _ in range(200):
        a.jobs.Start(jobs_pb2.StartJobRequest(map="edited", kind="rebuild"), metadata=a.metadata)
    in_parallel(64, until, lambda: a.posegraph.SetPose(
        posegraph_pb2.SetPoseRequest(map="edited", id=scan, pose=pose), metadata=a.metadata, timeout=20))


def long_plans(a, until):
    """Each robot is another one, so that nothing is prepared for it."""
    from strata.v1 import planning_pb2
    own_map(a, "wide", 1, 50, 0.05, 4_000_000)

    def plan():
        query = planning_pb2.PlanPathRequest(map="wide", to=planning_pb2.PlanEndpoint(x_m=48, y_m=48))
        getattr(query, "from").x_m, getattr(query, "from").y_m = -48, -48
        query.profile.radius_m = 0.3 + 0.1 * np.random.random()
        a.planning.PlanPath(query, metadata=a.metadata, timeout=60)
    in_parallel(16, until, plan)


def idle_readers(a, until):
    """Downloads of which a message is read now and then."""
    from strata.v1 import scans_pb2
    own_map(a, "downloaded", 2, 20, 0.1, 1_000_000)
    request = scans_pb2.GetScanPointsRequest(map="downloaded", id=scans_pb2.ScanId(trajectory="bad", sequence=1))

    def read():
        for _ in a.scans.GetPoints(request, metadata=a.metadata):
            time.sleep(min(20.0, max(0.0, until - time.monotonic())))
    in_parallel(64, until, read)


ATTACKS = {
    "waiting edits": waiting_edits, "long plans": long_plans, "idle readers": idle_readers,
    "slow senders": slow_senders, "silent streams": silent_streams, "connections": connections(b""),
    "connections h2": connections(PREFACE + frame(4, 0, 0)), "garbage": garbage, "http1": http1, "floods": floods,
    "rapid resets": rapid_resets("/strata.v1.Maps/List"),
    "upload resets": rapid_resets("/strata.v1.Scans/Upload"),
    "stranger resets": rapid_resets("/strata.v1.Scans/Upload", known=False),
    "health resets": rapid_resets("/grpc.health.v1.Health/Check", known=False),
    "stranger bodies": stranger_bodies("/strata.v1.Tiles/Fetch"),
    "health bodies": stranger_bodies("/grpc.health.v1.Health/Check"),
    "cancelled": cancelled, "big headers": big_headers, "names": names, "tokens": tokens,
    "bad numbers": bad_numbers, "absurd extents": absurd_extents, "claims": claims, "disorder": disorder,
    "big messages": big_messages, "bombs": bombs,
}


class Attacker:
    def __init__(self, build, address, token, options):
        sys.path.append(str(build / "client/python"))
        import grpc
        from strata.v1 import jobs_pb2_grpc, maps_pb2_grpc, planning_pb2_grpc, posegraph_pb2_grpc, scans_pb2_grpc
        self.address, self.token, self.options = address, token, options
        self.random = np.random.default_rng(options.seed)
        self.metadata = (("authorization", f"Bearer {token}"),)
        channel = grpc.insecure_channel(address, [("grpc.max_send_message_length", -1)])
        self.maps = maps_pb2_grpc.MapsStub(channel)
        self.scans = scans_pb2_grpc.ScansStub(channel)
        self.jobs = jobs_pb2_grpc.JobsStub(channel)
        self.posegraph = posegraph_pb2_grpc.PoseGraphStub(channel)
        self.planning = planning_pb2_grpc.PlanningStub(channel)


def attack(name, build, address, token, seconds, options, failed):
    os.nice(10)
    raise_files()
    try:
        ATTACKS[name](Attacker(build, address, token, options), time.monotonic() + seconds)
    except Exception as error:  # pylint: disable=broad-except
        failed.put(f"{type(error).__name__}: {str(error)[:300]}")


def raise_files():
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def healthy(address):
    import grpc
    with grpc.insecure_channel(address) as channel:
        check = channel.unary_unary("/grpc.health.v1.Health/Check")
        try:
            return "SERVING" if check(b"", timeout=10) == b"\x08\x01" else "NOT SERVING"
        except grpc.RpcError as error:
            return f"no answer ({error.code().name})"


def drain(told):
    while True:
        try:
            told.get_nowait()
        except queue.Empty:
            return


def measure(told, seconds):
    """(p99 [ms], calls, errors) of what ends in the next seconds; and the median and greatest [ms] of each kind."""
    drain(told)
    took, errors, kinds = [], [], {}
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        try:
            kind, seconds_taken, error = told.get(timeout=left)
            took.append(seconds_taken)
            kinds.setdefault(kind, []).append(1e3 * seconds_taken)
            if error:
                errors.append(error)
        except queue.Empty:
            pass
    kinds = {kind: (round(float(np.median(ms))), round(max(ms))) for kind, ms in sorted(kinds.items())}
    return 1e3 * float(np.percentile(took or [seconds], 99)), len(took), errors, kinds


def add_token(build, file, name, right):
    line = subprocess.run([build / "server/stratad", "token", "add", "--tokens", file, name, "--right", right,
                           "--all-maps"], check=True, capture_output=True, text=True).stdout
    return line.split()[-1]


def start_proxy(folder, server):
    """Puts HAProxy before `server`, whose address becomes the proxy's; its process."""
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{unused.getsockname()[1]}"
    config = (ROOT / "deploy/haproxy.cfg").read_text()
    config = re.sub(r"bind .*", f"bind {address} proto h2", config)
    config = re.sub(r"server local \S+", f"server local {server.address}", config)
    (folder / "haproxy.cfg").write_text(config)
    proxy = subprocess.Popen(["haproxy", "-f", folder / "haproxy.cfg"])
    time.sleep(1)
    server.address = address
    return proxy


def campaign(build, options, folder):
    import strata
    tokens_file = folder / "tokens"
    good, bad = (add_token(build, tokens_file, name, "admin") for name in ("good", "bad"))
    server = Stratad(build, folder, "--tokens", tokens_file, *options.stratad)
    proxy = start_proxy(folder, server) if options.proxy else None
    told, over = multiprocessing.Queue(), multiprocessing.Event()
    rows, workers = [], []
    try:
        with strata.connect(server.address, token=good) as db:
            world = db.create_map(MAP)
            random = np.random.default_rng(options.seed)
            for x, y in random.uniform(-HALF_M, HALF_M, (60, 2)):
                world.upload(scan_at(random, x, y), ([x, y, 1], [0, 0, 0, 1]), trajectory="first", align=False)
            world.wait()
        for i, kind in enumerate(GOOD):
            workers.append(multiprocessing.Process(target=good_client, daemon=True, args=(
                kind, build, server.address, good, i, options.period_s, told, over)))
            workers[-1].start()
        measure(told, 5)  # warming up
        before, _, _, kinds = measure(told, options.seconds)
        print(f"alone, median and greatest [ms]: {kinds}", file=sys.stderr, flush=True)
        chosen = options.only.split(",") if options.only else [*ATTACKS, "all at once"]
        for name in chosen:
            rows.append(beside(name, build, server, bad, told, options))
            print(rows[-1], file=sys.stderr, flush=True)
            if not server.alive():
                break
        alone = (before, measure(told, options.seconds)[0])
    finally:
        over.set()
        for worker in workers:
            worker.join(10)
        if server.alive():
            server.stop()
        if proxy:
            proxy.kill()
    return alone, rows


def beside(name, build, server, token, told, options):
    failed = multiprocessing.Queue()
    names_now = list(ATTACKS) if name == "all at once" else [name]
    server.forget_peak()
    attackers = [multiprocessing.Process(target=attack, daemon=True, args=(
        each, build, server.address, token, options.seconds + 3, options, failed)) for each in names_now]
    for attacker in attackers:
        attacker.start()
    time.sleep(2)
    p99, calls, errors, kinds = measure(told, options.seconds)
    for attacker in attackers:
        attacker.join(10)
        if attacker.is_alive():
            attacker.kill()
    row = {"attack": name, "p99_ms": p99, "calls": calls, "errors": errors[:1], "alive": server.alive(), "kinds": kinds}
    if row["alive"]:
        row |= {"peak_mb": server.peak_mb(), "health": healthy(server.address)}
        time.sleep(1)
        row |= {"files": server.files(), "threads": server.status("Threads"), "rss_mb": server.status("VmRSS") / 1024}
    try:
        row["attacker"] = failed.get(timeout=0.2)
    except queue.Empty:
        row["attacker"] = ""
    return row


def judge(row, alone, limit_mb):
    if not row["alive"]:
        return "died"
    complaints = []
    if row["health"] != "SERVING":
        complaints.append(row["health"])
    if row["peak_mb"] > limit_mb:
        complaints.append("memory")
    if row["p99_ms"] > 2 * alone and row["p99_ms"] - alone > 20:
        complaints.append("slow")
    if row["errors"]:
        complaints.append(f"refused: {row['errors'][0][:80]}")
    if row["attacker"]:
        complaints.append(f"attacker: {row['attacker'][:120]}")
    return ", ".join(complaints)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--seconds", type=float, default=15)
    parser.add_argument("--connections", type=int, default=10_000)
    parser.add_argument("--limit-mb", type=float, default=512)
    parser.add_argument("--only", help="attacks, comma-separated")
    parser.add_argument("--period-s", type=float, default=0.2, help="of the calls of a well-behaved client")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--proxy", action="store_true", help="through HAProxy")
    parser.add_argument("stratad", nargs="*", help="options of the server")
    options = parser.parse_args()
    if options.proxy and not shutil.which("haproxy"):
        sys.exit("hostile_clients: --proxy needs haproxy: apt install haproxy")
    build = options.build.resolve()
    sys.path.append(str(build / "client/python"))
    raise_files()
    multiprocessing.set_start_method("spawn")  # gRPC does not outlive a fork
    print(f"seed {options.seed}", file=sys.stderr)
    with tempfile.TemporaryDirectory() as folder:
        alone, rows = campaign(build, options, pathlib.Path(folder))
    base = float(np.median(alone))
    print(f"alone: p99 {alone[0]:.0f} ms before, {alone[1]:.0f} ms after")
    print(f"{'attack':<16}{'calls':>6}{'p99 ms':>8}{'ratio':>7}{'peak MB':>9}{'MB after':>9}{'files':>7}{'threads':>8}  state")
    bad = 0
    for row in rows:
        verdict = judge(row, base, options.limit_mb)
        bad += bool(verdict)
        print(f"{row['attack']:<16}{row['calls']:>6}{row['p99_ms']:>8.0f}{row['p99_ms'] / base:>7.2f}"
              f"{row.get('peak_mb', 0):>9.0f}{row.get('rss_mb', 0):>9.0f}{row.get('files', 0):>7}"
              f"{row.get('threads', 0):>8}  {verdict or row['health']}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
