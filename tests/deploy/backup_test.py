"""deploy/backup/backup-maps on a real server: what the timer of every night runs."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy as np

import strata
from support import Stratad

DEPLOY = pathlib.Path(__file__).resolve().parents[2] / "deploy"
SCRIPT = DEPLOY / "backup/backup-maps"


class BackupTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.backups = self.folder / "backups"
        self.backups.mkdir()
        self.server = Stratad(self.folder / "maps")
        self.server.start()
        self.addCleanup(self.server.stop)
        self.db = self.enterContext(strata.connect(self.server.address))
        self.digests = {}
        for k, name in enumerate(("campus", "campus.old", "b-1")):
            world = self.db.create_map(name)
            world.upload(np.random.default_rng(k).uniform(-1, 1, (1000, 3)), align=False)
            self.digests[name] = world.wait().content_digest

    def run_script(self, **environment):
        return subprocess.run([SCRIPT], capture_output=True, text=True, check=False, env={
            **os.environ, "STRATA_PROGRAM": os.environ["STRATA_PROGRAM"], "STRATA_SERVER": self.server.address,
            "STRATA_BACKUP_DIR": str(self.backups), **environment})

    def copies(self):
        return sorted(file.name for file in self.backups.iterdir())

    def test_every_map_is_copied_and_a_server_takes_the_copies(self):
        for _ in range(2):  # twice a day is once
            done = self.run_script()
            self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual({name.partition("@")[0] for name in self.copies()}, {"b-1", "campus", "campus.old"})
        self.assertEqual((self.backups / self.copies()[0]).stat().st_mode & 0o077, 0)
        put_back = self.folder / "put_back"
        put_back.mkdir()
        for name in self.copies():
            shutil.copy(self.backups / name, put_back / f"{name.partition('@')[0]}.strata")
        other = Stratad(put_back)
        other.start()
        self.addCleanup(other.stop)
        with strata.connect(other.address) as db:
            self.assertEqual({name: db.map(name).stats().content_digest for name in db.maps()}, self.digests)

    def test_old_nights_go_and_nothing_else(self):
        old = [f"campus@2020-01-0{day}.strata" for day in range(1, 6)]
        others = ["campus.old@2020-01-01.strata", "campusXold@2020-01-01.strata", "campus@notes.txt", "other@2020-01-01.strata"]
        for name in old + others:
            (self.backups / name).write_text("x")
        self.assertEqual(self.run_script(STRATA_BACKUP_KEEP="3").returncode, 0)
        left = self.copies()
        self.assertEqual([name for name in old if name in left], old[-2:])
        self.assertEqual([name for name in others if name in left], others)

    def test_what_fails_is_told_and_older_copies_stay(self):
        (self.backups / "campus@2020-01-01.strata").write_text("x")
        self.assertEqual(self.run_script(STRATA_BACKUP_KEEP="0").returncode, 2)
        self.assertIn("expected 1 or more", self.run_script(STRATA_BACKUP_KEEP="some").stderr)
        self.assertEqual(self.run_script(STRATA_BACKUP_DIR="/nonexistent").returncode, 2)
        self.assertEqual(self.run_script(STRATA_SERVER="127.0.0.1:1").returncode, 1)
        failing = self.folder / "strata"
        failing.write_text(f'#!/bin/sh\n[ "$2" = backup ] && [ "$4" = campus ] && exit 1\nexec {os.environ["STRATA_PROGRAM"]} "$@"\n')
        failing.chmod(0o755)
        self.assertEqual(self.run_script(STRATA_PROGRAM=str(failing), STRATA_BACKUP_KEEP="1").returncode, 1)
        self.assertEqual({name.partition("@")[0] for name in self.copies()}, {"b-1", "campus", "campus.old"})
        self.assertIn("campus@2020-01-01.strata", self.copies())

    @unittest.skipUnless(shutil.which("systemd-analyze"), "systemd-analyze is not here")
    def test_the_timer_comes_every_night(self):
        timer = (DEPLOY / "systemd/strata-backup.timer").read_text()
        calendar, = [line.partition("=")[2] for line in timer.splitlines() if line.startswith("OnCalendar=")]
        subprocess.run(["systemd-analyze", "calendar", calendar], capture_output=True, check=True)
        self.assertRegex(calendar, r"^\*-\*-\* \d\d:\d\d:\d\d$")


if __name__ == "__main__":
    unittest.main()
