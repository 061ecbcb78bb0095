#!/usr/bin/env python3
"""Hostile clients at the door for browsers, beside one that asks for the list of maps twenty times a second.

    tests/experiments/hostile_door.py --build build/release [--seconds 15] [--connections 10000] [--only "slow headers"]

Of each attack: answers of the good client, its median and worst time, memory of the server, connections that were open at most. Exits 1 where the
good client went without an answer, the server ended, or a forged Host or Origin was let in.
"""
import argparse
import asyncio
import json
import os
import pathlib
import re
import resource
import statistics
import subprocess
import tempfile
import time

WATCH = b'{"name": "yard"}'
ANSWER_S = 30


def head(method, path, host, *lines):
    return "\r\n".join([f"{method} {path} HTTP/1.1", f"Host: {host}", *lines, "", ""]).encode()


def post(host, path, body, *lines, length=None):
    return head("POST", path, host, f"Content-Length: {len(body) if length is None else length}", *lines) + body


def envelope(body):
    return b"\0" + len(body).to_bytes(4, "big") + body


async def status_of(reader):
    line = await asyncio.wait_for(reader.readline(), ANSWER_S)
    return int(line.split()[1]) if line.startswith(b"HTTP/") else 0


class Attack:
    def __init__(self, address, options):
        self.host, port = address.rsplit(":", 1)
        self.port, self.address, self.options = int(port), address, options
        self.open = self.most = 0
        self.complaints = []

    async def connect(self):
        return await asyncio.open_connection(self.host, self.port)

    # `count` connections at once, each anew when it has ended.
    async def repeat(self, count, body, until):
        async def one():
            while time.monotonic() < until:
                try:
                    reader, writer = await self.connect()
                except OSError:
                    await asyncio.sleep(0.2)
                    continue
                self.open += 1
                self.most = max(self.most, self.open)
                try:
                    await asyncio.wait_for(body(reader, writer), max(0.1, until - time.monotonic()))
                except (OSError, asyncio.TimeoutError, asyncio.IncompleteReadError, ConnectionError):
                    pass
                self.open -= 1
                writer.close()
                await asyncio.sleep(0.05)
        await asyncio.gather(*[one() for _ in range(count)])

    async def slow_headers(self, until):
        async def body(reader, writer):
            writer.write(b"GET / HTTP/1.1\r\nHost: " + self.address.encode() + b"\r\n")
            while True:
                writer.write(b"X-a: b\r\n")
                await writer.drain()
                await asyncio.sleep(1)
                if reader.at_eof():
                    return
        await self.repeat(self.options.connections // 4, body, until)

    async def slow_bodies(self, until):
        async def body(reader, writer):
            writer.write(post(self.address, "/strata.v1.Maps/List", b"", "Content-Type: application/json", length=1000))
            while True:
                writer.write(b" ")
                await writer.drain()
                await asyncio.sleep(1)
                if reader.at_eof():
                    return
        await self.repeat(self.options.connections // 4, body, until)

    async def idle_watches(self, until):
        async def body(reader, writer):
            writer.write(post(self.address, "/strata.v1.Maps/Watch", envelope(WATCH), "Content-Type: application/connect+json", "Connect-Protocol-Version: 1"))
            while await reader.read(4096):
                pass
        await self.repeat(self.options.connections, body, until)

    async def huge_bodies(self, until):
        async def body(reader, writer):
            writer.write(post(self.address, "/strata.v1.Maps/List", b"", "Content-Type: application/json", length=10 ** 11))
            for _ in range(1024):
                writer.write(b" " * 65536)
                await writer.drain()
            await status_of(reader)
        await self.repeat(16, body, until)

    async def endless_chunks(self, until):
        async def body(reader, writer):
            writer.write(head("POST", "/strata.v1.Maps/List", self.address, "Content-Type: application/json", "Transfer-Encoding: chunked"))
            for _ in range(4096):
                writer.write(b"10000\r\n" + b" " * 65536 + b"\r\n")
                await writer.drain()
            await status_of(reader)
        await self.repeat(16, body, until)

    # Each must be refused, whatever else is asked.
    async def forged(self, until):
        json_type = "Content-Type: application/json"
        port = self.port
        forgeries = [
            post("evil.example", "/strata.v1.Maps/List", b"{}", json_type),
            post(f"evil.example:{port}", "/strata.v1.Maps/List", b"{}", json_type),
            post(f"localhost.evil.example:{port}", "/strata.v1.Maps/List", b"{}", json_type),
            post(f"127.0.0.1.evil.example:{port}", "/strata.v1.Maps/List", b"{}", json_type),
            post("", "/strata.v1.Maps/List", b"{}", json_type),
            post(self.address, "/strata.v1.Maps/List", b"{}", json_type, "Origin: http://evil.example"),
            post(self.address, "/strata.v1.Maps/List", b"{}", json_type, "Origin: null"),
            post(self.address, "/strata.v1.Maps/List", b"{}", json_type, f"Origin: http://127.0.0.1:{port + 1}"),
            post(self.address, "/strata.v1.Maps/List", b"{}", json_type, "Sec-Fetch-Site: cross-site"),
            post(self.address, "/strata.v1.Maps/List", b"{}", json_type, f"Host: evil.example:{port}"),
            post(self.address, "/strata.v1.Maps/Delete", b"{}", "Content-Type: text/plain"),
            head("GET", "/strata.v1.Maps/List", self.address),
            head("OPTIONS", "/strata.v1.Maps/List", self.address, "Origin: http://evil.example", "Access-Control-Request-Method: POST"),
        ]
        while time.monotonic() < until and not self.complaints:
            for forgery in forgeries:
                reader, writer = await self.connect()
                writer.write(forgery)
                status = await status_of(reader)
                if not 400 <= status < 500:
                    self.complaints.append(f"{status} for {forgery!r}")
                answer = await asyncio.wait_for(reader.read(4096), ANSWER_S)
                if b"access-control-allow" in answer.lower():
                    self.complaints.append(f"CORS for {forgery!r}")
                writer.close()
            await asyncio.sleep(0.1)


ATTACKS = {"forged host and origin": Attack.forged, "slow headers": Attack.slow_headers, "slow bodies": Attack.slow_bodies,
           "huge bodies": Attack.huge_bodies, "endless chunks": Attack.endless_chunks, "idle watches": Attack.idle_watches}


# Asks until then, on a connection of its own that it opens anew when it is ended.
async def good_client(address, until):
    host, port = address.rsplit(":", 1)
    times, failed, link = [], 0, None
    request = post(address, "/strata.v1.Maps/List", b"{}", "Content-Type: application/json")
    while time.monotonic() < until:
        begun = time.monotonic()
        try:
            link = link or await asyncio.wait_for(asyncio.open_connection(host, int(port)), ANSWER_S)
            link[1].write(request)
            answer = await asyncio.wait_for(link[0].readuntil(b"\r\n\r\n"), ANSWER_S)
            await link[0].readexactly(int(re.search(rb"(?i)content-length: (\d+)", answer)[1]))
            if not answer.startswith(b"HTTP/1.1 200"):
                raise OSError(answer[:40])
            times.append(time.monotonic() - begun)
        except (OSError, asyncio.IncompleteReadError, asyncio.TimeoutError, ConnectionError):
            failed += 1
            link = None
        await asyncio.sleep(0.05)
    return times, failed


def memory_mb(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{pid}/status").read_text())[1]) / 1024


# The attacker is a process of its own: it must not slow the good client down.
def run(name, web, server, options):
    attacker = os.fork()
    until = time.monotonic() + options.seconds
    if attacker == 0:
        os.nice(10)
        attack = Attack(web, options)
        try:
            asyncio.run(ATTACKS[name](attack, until))
        except Exception as error:  # pylint: disable=broad-except
            attack.complaints.append(repr(error))
        print(f"{name}: at most {attack.most} connections {' '.join(attack.complaints)}", flush=True)
        os._exit(bool(attack.complaints))
    most = [0.0]

    async def look():
        while time.monotonic() < until:
            most[0] = max(most[0], memory_mb(server.pid))
            await asyncio.sleep(0.2)

    async def both():
        return (await asyncio.gather(good_client(web, until), look()))[0]
    times, failed = asyncio.run(both())
    bad = os.waitstatus_to_exitcode(os.waitpid(attacker, 0)[1])
    times = sorted(times) or [float("inf")]
    holds = not bad and server.poll() is None and failed <= 2 and len(times) > 1
    print(f"{name:24} {len(times):5} answers, {failed} without; median {1e3 * statistics.median(times):.1f} ms, worst {1e3 * times[-1]:.0f} ms; at most {most[0]:.0f} MiB: "
          f"{'ok' if holds else 'NOT HELD'}", flush=True)
    return holds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--seconds", type=float, default=15)
    parser.add_argument("--connections", type=int, default=10000)
    parser.add_argument("--only", action="append", choices=list(ATTACKS))
    options = parser.parse_args()
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    with tempfile.TemporaryDirectory() as folder:
        log = open(f"{folder}/log", "wb")
        server = subprocess.Popen([options.build / "server/stratad", "--data", f"{folder}/maps", "--listen", "127.0.0.1:0", "--web", "127.0.0.1:0"], stdout=subprocess.PIPE, stderr=log, text=True)
        try:
            grpc = server.stdout.readline().split()[1]
            web = server.stdout.readline().split()[1].replace("http://", "")
            subprocess.run([options.build / "client/cli/strata", "--server", grpc, "map", "create", "yard"], check=True, stdout=subprocess.DEVNULL)
            print(json.dumps({"seconds": options.seconds, "connections": options.connections, "idle_mib": round(memory_mb(server.pid))}))
            held = [run(name, web, server, options) for name in options.only or ATTACKS]
            print(f"after all: {memory_mb(server.pid):.0f} MiB")
        finally:
            server.terminate()
            server.wait()
    return 0 if all(held) else 1


if __name__ == "__main__":
    raise SystemExit(main())
