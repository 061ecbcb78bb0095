"""A real stratad for tests of the Python client, and a small world."""
import contextlib
import os
import pathlib
import signal
import subprocess
import tempfile
import unittest

import numpy as np

import strata


class Stratad:
    """stratad on a folder; started again, it is at the same address."""

    def __init__(self, folder, *arguments):
        self.address = "127.0.0.1:0"
        self._folder = folder
        self._arguments = list(map(str, arguments))
        self._process = None

    def start(self):
        with contextlib.ExitStack() as stack:
            self._process = stack.enter_context(subprocess.Popen(
                [os.environ["STRATA_STRATAD"], "--data", self._folder, "--listen", self.address,
                 *self._arguments],
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True))
            line = self._process.stdout.readline()
            assert line.startswith("listening "), line
            self.address = line.split()[1]
            stack.pop_all()

    def stop(self, how=signal.SIGTERM):
        self._process.send_signal(how)
        self._process.wait()
        self._process.stdout.close()


class ServerTest(unittest.TestCase):
    """A server of the class's own, and a connection to it."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.server = Stratad(cls.folder / "maps")
        cls.server.start()
        cls.addClassCleanup(cls.server.stop)
        cls.db = cls.enterClassContext(strata.connect(cls.server.address))


def grid(x, y, z_of=lambda x, y: 0 * x, step=0.05):
    """(n, 3) points over the middle of x × y, half a step from the borders."""
    xs, ys = np.meshgrid(np.arange(x[0] + step / 2, x[1], step), np.arange(y[0] + step / 2, y[1], step))
    return np.stack([xs, ys, z_of(xs, ys)], axis=-1).reshape(-1, 3)


DECK_M = 3.0


def bridge():
    """(n, 3) points of a bridge along x over a plain: deck |x| ≤ 4, |y| ≤ 2 at 3 m, a ramp at either end."""
    ground = grid((-16, 16), (-8, 8))
    ramp_or_below = (np.abs(ground[:, 0]) > 4) & (np.abs(ground[:, 0]) < 14) & (np.abs(ground[:, 1]) < 2)
    ramps = [grid((min(a, b), max(a, b)), (-2, 2), lambda x, y: DECK_M * (14 - np.abs(x)) / 10)
             for a, b in ((-14, -4), (4, 14))]
    return np.concatenate([ground[~ramp_or_below], *ramps, grid((-4, 4), (-2, 2), lambda x, y: 0 * x + DECK_M)])
