"""Tokens and certificates are taken up by a running stratad, as deploy/README.md and RUNBOOK.md say."""
import os
import pathlib
import shutil
import tempfile
import time
import unittest

import strata
from secure import SecureStratad, authority, certificate

PATIENCE_S = 60


def within_patience(succeeds):
    """Seconds until it does; the last error after PATIENCE_S."""
    begun = time.monotonic()
    while True:
        try:
            succeeds()
            return time.monotonic() - begun
        except (strata.StrataError, AssertionError):
            if time.monotonic() - begun > PATIENCE_S:
                raise
            time.sleep(0.1)


class ReloadTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.server = SecureStratad(self.folder)
        self.addCleanup(self.server.stop)

    def test_tokens_come_and_go(self):
        with self.server.connect() as owner:
            owner.create_map("campus")
            token = self.server.new_token("robot", "--right", "read", "--map", "campus")

            def ask():
                with self.server.connect(token=token, patience=0) as robot:
                    robot.map("campus").stats()

            print(f"token added: {within_patience(ask):.1f} s")
            self.server.token_command("revoke", "robot")

            def is_refused():
                with self.assertRaises(strata.Unauthenticated):
                    ask()

            print(f"token revoked: {within_patience(is_refused):.1f} s")
            self.assertEqual(owner.maps(), ["campus"])  # who stays notices nothing

    def test_a_new_certificate_is_taken_up(self):
        other_ca = authority(self.folder, "other")
        with self.assertRaises(strata.Unavailable):
            self.server.connect(ca=other_ca, timeout=1)
        with self.server.connect() as before:
            before.create_map("campus")
            key, made = certificate(self.folder, other_ca, "renewed")
            for new, old in ((key, self.server.key), (made, self.server.certificate)):  # the key first
                shutil.copy(new, f"{old}.new")
                os.replace(f"{old}.new", old)

            def ask():
                with self.server.connect(ca=other_ca, timeout=1) as after:
                    self.assertEqual(after.maps(), ["campus"])

            print(f"certificate taken up: {within_patience(ask):.1f} s")
            self.assertEqual(before.maps(), ["campus"])  # a connection that is there keeps its own
        with self.assertRaises(strata.Unavailable):
            self.server.connect(timeout=1)


if __name__ == "__main__":
    unittest.main()
