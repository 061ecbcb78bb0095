#!/usr/bin/python3
"""What watchers of a map that does not change cost a server: threads, memory, processor time.

    tests/bench/idle_watchers.py --build build/release [--watchers 1,10,100,1000]

Watchers on one connection each, then all on one; of a real stratad. Memory is the growth of the resident set over that
with no watcher. Exits 1 beyond 32 threads.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
MOST_THREADS = 32
IDLE_S = 3.0


def status(pid, field):
    """A number of /proc/PID/status."""
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(f"{field}:"):
            return int(line.split()[1])
    raise KeyError(field)


def cpu_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def measure(build, watchers, own_connections):
    """Threads, growth of the resident set [kB], share of a core."""
    import grpc
    from strata.v1 import maps_pb2, maps_pb2_grpc
    with tempfile.TemporaryDirectory() as folder, subprocess.Popen(
            [build / "server/stratad", "--data", folder, "--listen", "127.0.0.1:0"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        try:
            address = server.stdout.readline().split()[1]
            channels = [grpc.insecure_channel(address, [("grpc.use_local_subchannel_pool", 1)])
                        for _ in range(watchers if own_connections else 1)]
            maps_pb2_grpc.MapsStub(channels[0]).Create(maps_pb2.CreateMapRequest(name="world"))
            time.sleep(0.5)
            before = status(server.pid, "VmRSS")
            watches = []
            for i in range(watchers):
                watches.append(maps_pb2_grpc.MapsStub(channels[i % len(channels)]).Watch(
                    maps_pb2.WatchMapRequest(name="world")))
                next(watches[-1])
            begun, cpu = time.monotonic(), cpu_seconds(server.pid)
            time.sleep(IDLE_S)
            share = (cpu_seconds(server.pid) - cpu) / (time.monotonic() - begun)
            result = status(server.pid, "Threads"), status(server.pid, "VmRSS") - before, share
            for watch in watches:
                watch.cancel()
            for channel in channels:
                channel.close()
            return result
        finally:
            server.terminate()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--watchers", default="1,10,100,1000")
    options = parser.parse_args()
    build = options.build.resolve()
    sys.path.append(str(build / "client/python"))
    most = 0
    print("connections  watchers  threads  memory kB  kB a watcher  share of a core")
    for own_connections in (True, False):
        for watchers in map(int, options.watchers.split(",")):
            threads, memory, share = measure(build, watchers, own_connections)
            most = max(most, threads)
            print(f"{'each its own' if own_connections else 'one':12} {watchers:8} {threads:8} {memory:10}"
                  f" {memory / watchers:13.1f} {share:16.3f}", flush=True)
    return 1 if most > MOST_THREADS else 0


sys.exit(main())
