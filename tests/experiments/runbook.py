#!/usr/bin/python3
"""deploy/RUNBOOK.md tried: each fault is made on a real server, its alert fires, and the page's steps end with a healthy one.

    tests/experiments/runbook.py --build build/release [--only "full disk"] [--keep]

The server is scraped as it goes; what was scraped is handed to promtool (Debian's prometheus), which says when the rules of
deploy/alerts.yml fire: a scrape every fifth of a second here stands for one every 15 s there. Needs root (a full disk
is a small tmpfs). Prints a row a step; exits 1 where a step or an alert is not as the page says.
"""
import argparse
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

from stratad import Stratad

ROOT = pathlib.Path(__file__).resolve().parents[2]
MAP = "campus"
SCRAPE_S = 15           # of the alert rules' time
QUIET_SCRAPES = 4 * 70  # after the last step: longer than any rule looks back
PATIENCE_S = 120        # a hang, not a slow machine
REVOKED = "the token is unknown or revoked"


class Failed(Exception):
    pass


def expect(holds, what):
    if not holds:
        raise Failed(what)


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def floor_pcd(path, side, x0=0.0):
    """A floor with one point in every cell of 10 cm: large ones take a while to integrate."""
    points = b"".join(struct.pack("<fff", x0 + 0.1 * x, 0.1 * y, 0.0) for y in range(side) for x in range(side))
    header = (f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {side * side}\nHEIGHT 1\n"
              f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {side * side}\nDATA binary\n")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(header.encode() + points)
    return path


class Timeline:
    """What Prometheus would have kept, and what it should have made of it."""

    def __init__(self):
        self.scrapes, self.expected = [], []

    def add(self, text):
        """`text`: of /metrics; None where nobody answered."""
        found = {"up": "1" if text is not None else "0"}
        for line in (text or "").splitlines():
            if line and not line.startswith("#"):
                name, _, value = line.rpartition(" ")
                found[name] = value
        self.scrapes.append(found)

    def fires(self, alert, since, goes_out=True):
        """By now, and not before scrape `since`; no more a while after the last step."""
        self.expected.append((alert, max(since - 1, 0), len(self.scrapes) - 1, goes_out))

    def series(self):
        names = sorted({name for scrape in self.scrapes for name in scrape})
        for name in names:
            metric, _, labels = name.partition("{")
            label_text = ",".join(filter(None, [labels.rstrip("}").rstrip(","), 'job="stratad",instance="maps"']))
            values = [scrape.get(name, "_") for scrape in self.scrapes]
            rest = f"{values[-1]}+{SCRAPE_S if metric == 'strata_uptime_seconds' else 0}x{QUIET_SCRAPES}"
            yield {"series": f"{metric}{{{label_text}}}", "values": " ".join(values + ([] if values[-1] == "_" else [rest]))}

    def check(self, folder):
        def asked(alert, scrape, fires):
            expr = f'max by (alertname) (ALERTS{{alertname="{alert}",alertstate="firing"}})'
            samples = [{"labels": f'{{alertname="{alert}"}}', "value": 1}] if fires else []
            return {"expr": expr, "eval_time": f"{scrape * SCRAPE_S}s", "exp_samples": samples}

        end = len(self.scrapes) + QUIET_SCRAPES - 1
        tests = [asked(alert, at, fires) for alert, before, then, goes_out in self.expected
                 for at, fires in ((before, False), (then, True), (end, not goes_out))]
        file = folder / "alerts_test.yml"  # JSON is YAML
        file.write_text(json.dumps({
            "rule_files": [str(ROOT / "deploy/alerts.yml")], "evaluation_interval": f"{SCRAPE_S}s",
            "tests": [{"interval": f"{SCRAPE_S}s", "input_series": list(self.series()), "promql_expr_test": tests}]}))
        ran = subprocess.run(["promtool", "test", "rules", file], capture_output=True, text=True)
        expect(ran.returncode == 0, f"alerts are not as expected:\n{ran.stdout}{ran.stderr}")


class Site:
    """One page's server, files and time."""

    def __init__(self, build, folder):
        self.build, self.folder, self.data = build, folder, folder / "maps"
        self.data.mkdir(parents=True)
        self.options, self.server, self.timeline = [], None, Timeline()
        self.metrics, self.token = free_port(), None

    def start(self):
        self.server = Stratad(self.build, self.data, "--metrics", f"127.0.0.1:{self.metrics}", "--optimize-every", "0",
                              *self.options, log=self.folder / "stratad.log")
        self.look()

    def stop(self):
        self.server.stop()
        self.look()

    def die(self):
        self.look()
        self.server.process.send_signal(signal.SIGSEGV)
        self.server.process.wait()

    def look(self, times=1):
        for i in range(times):
            if i > 0:
                time.sleep(0.2)
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{self.metrics}/metrics", timeout=10) as answer:
                    self.timeline.add(answer.read().decode())
            except (urllib.error.URLError, ConnectionError):
                self.timeline.add(None)

    def now(self):
        return len(self.timeline.scrapes)

    def ready(self, cause):
        self.look()
        return self.timeline.scrapes[-1].get(f'strata_ready{{cause="{cause}"}}') == "1"

    def healthy(self):
        self.look()
        red = [name for name, value in self.timeline.scrapes[-1].items() if name.startswith("strata_ready") and value != "1"]
        return self.timeline.scrapes[-1]["up"] == "1" and not red

    def await_(self, holds, what):
        until = time.monotonic() + PATIENCE_S
        while not holds():
            expect(time.monotonic() < until, f"{what}: not within {PATIENCE_S} s")
            time.sleep(0.2)

    def strata(self, *words, code=0, timeout=PATIENCE_S):
        env = dict(os.environ, STRATA_SERVER=self.server.address)
        if self.token:
            env["STRATA_TOKEN"] = self.token
        ran = subprocess.run([self.build / "client/cli/strata", *map(str, words)], env=env, capture_output=True, text=True, timeout=timeout)
        text = ran.stdout + ran.stderr
        expect(code is None or ran.returncode == code, f"strata {' '.join(map(str, words))}: exit {ran.returncode}\n{text}")
        return text

    def stratad(self, *words):
        ran = subprocess.run([self.build / "server/stratad", *map(str, words)], capture_output=True, text=True, timeout=PATIENCE_S)
        expect(ran.returncode == 0, f"stratad {' '.join(map(str, words))}: exit {ran.returncode}\n{ran.stdout}{ran.stderr}")
        return ran.stdout

    def state(self, scan):
        return json.loads(self.strata("--output", "json", "scan", "show", MAP, scan))["state"]

    def failed(self):
        return self.strata("scan", "list", MAP, "--state", "failed")

    def import_(self, path, *options, trajectory="robot", code=0):
        return self.strata("scan", "import", MAP, path, "--trajectory", trajectory, *options, code=code)

    def verify(self, code=0):
        return self.strata("map", "verify", MAP, code=code)

    def log(self):
        return (self.folder / "stratad.log").read_text()

    def sql(self, text):
        with sqlite3.connect(self.data / f"{MAP}.strata") as connection:
            expect(connection.execute(text).rowcount > 0, f"nothing to damage: {text}")
        connection.close()


def die_while_it_joins(site, scan, deaths):
    """Faults until the server has died `deaths` times with the scan under way; it is down then."""
    says = re.compile(rf"scan {scan} .*under way +{deaths}\b")
    wait_s = 0.02
    while True:
        time.sleep(wait_s)
        site.die()
        if says.search(site.stratad("quarantine", "list", MAP, "--data", site.data)):
            return
        expect(wait_s < 5, f"{scan} is not met while it is joined")
        wait_s *= 1.6
        site.start()


def crash_loop(site, step):
    floor_pcd(site.folder / "big/7.pcd", 1500)
    floor_pcd(site.folder / "big/8.pcd", 1500, 200.0)
    floor_pcd(site.folder / "small/1.pcd", 50)
    site.start()
    site.look(4)
    site.strata("map", "create", MAP)
    site.import_(site.folder / "big/7.pcd")
    site.import_(site.folder / "small/1.pcd", trajectory="other")
    begun = site.now()
    for death in (1, 2):
        die_while_it_joins(site, "robot/7", death)
        site.start()
    site.look(2)
    site.timeline.fires("StrataCrashLoop", begun)
    step("two deaths by the same scan: it is aside, the third start serves")
    site.await_(lambda: site.state("other/1") == "integrated", "the scan behind it")
    expect("quarantined: the server died 2 times" in site.failed(), site.failed())
    expect(re.search("event=quarantine", site.log()), "the log names it")
    site.stop()
    listed = site.stratad("quarantine", "list", MAP, "--data", site.data)
    expect("robot/7" in listed, listed)
    step("quarantine list names it")
    site.start()
    site.import_(site.folder / "big/8.pcd")
    die_while_it_joins(site, "robot/8", 1)
    site.stratad("quarantine", "add", MAP, "scan", "robot/8", "--data", site.data)
    site.start()
    expect(site.state("robot/8") == "failed", "put aside by hand")
    step("quarantine add before it kills once more")
    site.strata("scan", "export", MAP, "robot/7", "--out", site.folder / "evidence.pcd")
    step("its points are exported for the report")
    site.stop()
    for scan in ("robot/7", "robot/8"):
        site.stratad("quarantine", "release", MAP, "scan", scan, "--data", site.data)
    site.start()
    for scan in ("robot/7", "robot/8"):
        site.await_(lambda s=scan: site.state(s) == "integrated", scan)
    site.verify()
    step("released once the cause is mended: joined, and the map verifies")


def full_disk(site, step):
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300m", "tmpfs", site.data], check=True)
    site.start()
    site.look(4)
    site.strata("map", "create", MAP)
    floor_pcd(site.folder / "scans/1.pcd", 300)
    floor_pcd(site.folder / "scans/2.pcd", 300, 5.0)
    site.import_(site.folder / "scans/1.pcd", "--wait")
    begun = site.now()
    old_backup = site.data / "old-backup"
    with open(old_backup, "wb") as file:
        room = os.statvfs(site.data)
        file.write(bytes(room.f_bavail * room.f_frsize - (1 << 20)))
    site.await_(lambda: not site.ready("disk"), "readiness is red")
    site.look(45)
    site.timeline.fires("StrataNotReady", begun)
    site.timeline.fires("StrataDiskFillsUp", 0, goes_out=False)  # less than 5 GB is all there is of this disk
    said = site.import_(site.folder / "scans/2.pcd", code=1)
    expect("MiB free" in said, said)
    step("uploads are refused and say why")
    expect("traversable" in site.strata("surface", MAP, "--at", "5,5"), "what is there is served")
    site.die()
    site.start()
    step("killed and started on the full disk")
    site.await_(lambda: site.strata("scan", "list", MAP, code=None).count("robot/1") > 0, "the map opens")
    site.strata("scan", "delete", MAP, "robot/1")
    step("a scan is deleted on it")
    old_backup.unlink()
    site.await_(site.healthy, "it goes on by itself")
    site.import_(site.folder / "scans", "--wait")
    site.verify()
    step("room is made: scans are taken, the map verifies")
    site.stop()


def stolen_token(site, step):
    tokens = site.folder / "tokens"
    add = lambda name, right, *maps: site.stratad("token", "add", "--tokens", tokens, name, "--right", right, *maps).strip()
    owner = add("owner", "admin", "--all-maps")
    stolen = add("robot-7", "write", "--map", MAP)
    site.options = ["--tokens", tokens]
    site.start()
    site.token = owner
    site.strata("map", "create", MAP)
    floor_pcd(site.folder / "scans/1.pcd", 100)
    site.import_(site.folder / "scans/1.pcd", "--wait")
    backup = site.folder / "campus.strata"
    site.strata("map", "backup", MAP, backup)
    site.token = stolen
    site.strata("scan", "delete", MAP, "robot/1")
    with open(site.folder / "watch.log", "w") as out:
        watch = subprocess.Popen([site.build / "client/cli/strata", "map", "watch", MAP], stdout=out, stderr=out,
                                 env=dict(os.environ, STRATA_SERVER=site.server.address, STRATA_TOKEN=stolen))
    time.sleep(1)
    expect(watch.poll() is None, "the thief watches")
    expect("robot-7" in site.stratad("token", "list", "--tokens", tokens), "token list")
    site.stratad("token", "revoke", "robot-7", "--tokens", tokens)
    begun = time.monotonic()
    watch.wait(timeout=PATIENCE_S)
    took_s = time.monotonic() - begun
    said = (site.folder / "watch.log").read_text()
    expect(watch.returncode != 0 and REVOKED in said, said)
    step(f"revoked: its watch ended after {took_s:.1f} s")
    expect(REVOKED in site.strata("scan", "list", MAP, code=1), "its calls are refused")
    new = add("robot-7", "write", "--map", MAP, "--expires", "90d")
    expect(new != stolen, "another token")
    site.token = new
    site.await_(lambda: REVOKED not in site.strata("scan", "list", MAP, code=None), "the new one holds")
    for said in (("principal=robot-7", "method=Scans.Delete", "object=robot/1"), ("tokens=removed", "object=robot-7"),
                 ("tokens=added", "object=robot-7")):
        wanted = ("event=audit", *said)
        site.await_(lambda: any(all(word in line for word in wanted) for line in site.log().splitlines()), " ".join(wanted))
    expect(stolen not in site.log() and new not in site.log(), "no token is in the log")
    step("the log says what was done with it, and who was let in")
    site.token = owner
    site.stop()
    shutil.copyfile(backup, site.folder / "before.strata")
    (site.data / f"{MAP}.strata").unlink()
    shutil.copyfile(backup, site.data / f"{MAP}.strata")
    site.start()
    expect(site.state("robot/1") == "integrated", "the backup has the scan")
    site.verify()
    step("what it deleted comes back from the backup")
    site.stop()


def damaged_map(site, step):
    floor_pcd(site.folder / "scans/1.pcd", 100)
    floor_pcd(site.folder / "scans/2.pcd", 100, 5.0)
    site.start()
    site.look(4)
    site.strata("map", "create", MAP)
    site.import_(site.folder / "scans", "--wait")
    site.stop()
    flipped = "CAST(substr(bytes, 1, 40) || x'5a5a' || substr(bytes, 43) AS BLOB)"
    site.sql(f"UPDATE derived_surface_tile SET bytes = {flipped} WHERE level = 0")
    site.start()
    site.look(4)
    begun = site.now()
    said = site.strata("tile", "get", MAP, "0/0/0", "--out", site.folder / "tile.bin", code=None)
    site.strata("map", "export", MAP, site.folder / "campus.ply", code=None)
    site.look(2)
    site.timeline.fires("StrataDamage", begun)
    named = site.verify(code=1)
    expect("tile 0/0/0 (served)" in named, f"{said}\n{named}")
    step("a damaged tile: readers are told, verify names it")
    site.strata("map", "rebuild", MAP)
    site.verify()
    step("only tiles: rebuilt, verifies")
    site.stop()
    site.sql(f"UPDATE truth_chunk SET bytes = {flipped} WHERE upload = (SELECT upload FROM truth_scan WHERE sequence = 2)")
    site.start()
    named = site.verify(code=1)
    expect("robot/2" in named and "robot/1" not in named, named)
    step("a damaged scan: verify names it and no other")
    site.strata("scan", "delete", MAP, "robot/2")
    site.import_(site.folder / "scans", "--wait")
    site.verify()
    expect(site.healthy(), "ready")
    step("deleted and uploaded again from the robot: verifies")
    site.look(2)
    site.stop()


def map_taken_away(site, step):
    floor_pcd(site.folder / "scans/1.pcd", 100)
    site.start()
    site.look(4)
    site.strata("map", "create", MAP)
    site.import_(site.folder / "scans", "--wait")
    site.strata("map", "backup", MAP, site.folder / "backup.strata")
    begun = site.now()
    file = site.data / f"{MAP}.strata"
    file.rename(site.folder / "moved.strata")
    site.await_(lambda: not site.ready("maps"), "readiness is red")
    site.look(8)
    site.timeline.fires("StrataNotReady", begun)
    expect("put the file back" in site.log(), "the log says what to do")
    step("a map's file is moved away under the server")
    site.stop()
    (site.folder / "moved.strata").rename(file)
    site.start()
    expect(site.healthy(), "ready")
    site.verify()
    step("put back, started: verifies")
    site.stop()
    raw = bytearray(file.read_bytes())
    raw[18:60] = bytes(42)
    file.write_bytes(raw)
    begun = site.now()
    site.start()
    site.look(8)
    site.timeline.fires("StrataMapNotOpened", begun)
    said = subprocess.run([site.build / "server/stratad", "check", "--maps", "--data", site.data], capture_output=True, text=True)
    expect(said.returncode != 0 and f"map {MAP}" in said.stdout, said.stdout)
    step("a map that does not open: check --maps says why")
    site.stop()
    for suffix in ("", "-wal", "-shm"):
        pathlib.Path(f"{file}{suffix}").unlink(missing_ok=True)
    shutil.copyfile(site.folder / "backup.strata", file)
    site.start()
    expect(site.healthy(), "ready")
    site.verify()
    step("the backup is put back: verifies")
    site.stop()


PAGES = {"crash loop": crash_loop, "full disk": full_disk, "stolen token": stolen_token, "damaged map": damaged_map,
         "map taken away": map_taken_away}


def run(page, build, folder):
    site, begun = Site(build, folder), time.monotonic()
    step = lambda what: print(f"  {page:<15} {time.monotonic() - begun:6.1f} s  {what}", flush=True)
    try:
        PAGES[page](site, step)
        if site.timeline.expected:
            if not site.server.alive():
                site.start()
            site.look(4)
            site.timeline.check(folder)
            step("alerts as they should be: " + ", ".join(alert for alert, *_ in site.timeline.expected))
        return True
    except Failed as failed:
        step(f"FAILED: {failed}")
        return False
    finally:
        if site.server is not None and site.server.alive():
            site.server.stop()
        if os.path.ismount(site.data):
            subprocess.run(["umount", "--lazy", site.data], check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--only", choices=PAGES)
    parser.add_argument("--keep", action="store_true", help="leave the files")
    arguments = parser.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp(prefix="runbook-"))
    pages = [arguments.only] if arguments.only else list(PAGES)
    good = [run(page, arguments.build.resolve(), folder / page.replace(" ", "_")) for page in pages]
    if arguments.keep:
        print(folder)
    else:
        shutil.rmtree(folder)
    print(f"{sum(good)} of {len(pages)} pages hold")
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
