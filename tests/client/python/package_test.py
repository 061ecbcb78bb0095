"""The package as it is handed on: a wheel and an sdist that pip installs, and types that mypy holds to."""
import os
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
import textwrap
import unittest
import zipfile

import strata
from support import Stratad

TREE = pathlib.Path(strata.__file__).resolve().parent.parent
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


def run(*command, folder=None):
    done = subprocess.run(list(map(str, command)), cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{command} ends with {done.returncode}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def built(kind, folder):
    """What setuptools makes of a copy of the build tree, by the hook that pip and `python3 -m build` call."""
    tree = pathlib.Path(folder) / "tree"
    if not tree.exists():
        shutil.copytree(TREE, tree, ignore=shutil.ignore_patterns("CMakeFiles", "__pycache__", ".mypy_cache", "build", "*.egg-info"))
    run(sys.executable, "-c", f"import setuptools.build_meta as b; b.build_{kind}('..')", folder=tree)
    made, = pathlib.Path(folder).glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return made


class WheelTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        try:
            import setuptools  # noqa: F401
            import venv  # noqa: F401
            import wheel  # noqa: F401
        except ImportError as missing:
            raise unittest.SkipTest(f"{missing}; apt install python3-setuptools python3-wheel python3-pip python3-venv")
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.wheel = built("wheel", cls.folder)

    def installed(self, what, name):
        """The python of a bare venv with it, and with Debian's packages."""
        folder = self.folder / name
        run(sys.executable, "-m", "venv", "--system-site-packages", folder)
        python = folder / "bin/python"
        # --no-index: everything that it needs is there, by its own words.
        run(python, "-m", "pip", "install", "--no-index", "--no-build-isolation", "--disable-pip-version-check", what)
        return python

    def test_the_wheel_holds_the_package_its_messages_and_its_types(self):
        names = zipfile.ZipFile(self.wheel).namelist()
        for name in ("strata/__init__.py", "strata/aio/__init__.py", "strata/py.typed", "strata/_tiles.so",
                     "strata/v1/maps_pb2.py", "strata/v1/maps_pb2.pyi", "strata/v1/maps_pb2_grpc.pyi"):
            self.assertIn(name, names)
        self.assertEqual({name.split("/")[0] for name in names if ".dist-info" not in name}, {"strata"})
        self.assertIn("py3-none-linux", self.wheel.name)

    def test_a_bare_venv_has_a_client_after_pip_install(self):
        python = self.installed(self.wheel, "venv")
        server = Stratad(self.folder / "maps")
        server.start()
        self.addCleanup(server.stop)
        told = run(python, "-c", textwrap.dedent(f"""
            import numpy, strata, strata.native
            with strata.connect("{server.address}") as db:
                campus = db.create_map("campus")
                campus.upload(numpy.random.default_rng(1).uniform(-1, 1, (1000, 3)))
                campus.wait()
                print(strata.__file__, len(campus.fetch()), strata.native.LIBRARY is not None)
            """), folder=self.folder)
        file, tiles, native = told.split()
        self.assertTrue(file.startswith(str(self.folder / "venv")), file)
        self.assertEqual((tiles, native), ("4", "True"))

    def test_the_sdist_installs_anywhere_without_protoc(self):
        sdist = built("sdist", self.folder)
        with tarfile.open(sdist) as tar:
            names = [name.partition("/")[2] for name in tar.getnames()]
        self.assertIn("strata/v1/maps_pb2.py", names)
        self.assertFalse([name for name in names if name.endswith(".so")])
        python = self.installed(sdist, "venv-of-sdist")
        self.assertEqual(run(python, "-c", "import strata, strata.native as n; print(n.LIBRARY)", folder=self.folder), "None\n")


@unittest.skipUnless(shutil.which("mypy"), "mypy is not here: apt install mypy")
class TypesTest(unittest.TestCase):
    def check(self, *arguments):
        return subprocess.run(["mypy", "--config-file", TREE / "pyproject.toml", "--cache-dir", self.cache, *arguments],
                              cwd=TREE, env=ENVIRONMENT, capture_output=True, text=True, check=False)

    @classmethod
    def setUpClass(cls):
        # Kept beside the package: mypy looks again only at what has changed.
        cls.cache = TREE / ".mypy_cache"
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))

    def test_the_package_passes_mypy_strict(self):
        checked = self.check("--strict", "-p", "strata")
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    def test_programs_that_use_it_are_checked(self):
        program = self.folder / "program.py"
        program.write_text(textwrap.dedent("""
            import strata
            async def main() -> None:
                async with await strata.aio.connect() as db:
                    stats: strata.Stats = await (await db.map("campus")).stats()
                    print(stats.scans)
            with strata.connect() as db:
                path: strata.Path = db.map("campus").plan((0, 0), (1, 1, 3))
                path.lenght
                db.map("campus").plan((0, 0), (1, 1), profile=3)
                stats: strata.Path = db.map("campus").stats()
                for change in db.map("campus").watch():
                    change.epoch.real
            """))
        told = self.check(program).stdout
        self.assertEqual([line.split(":")[1] for line in told.splitlines() if ": error: " in line], ["9", "10", "11"], told)


if __name__ == "__main__":
    unittest.main()
