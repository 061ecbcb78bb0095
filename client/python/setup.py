"""Says that a wheel with the library _tiles.so in it is for this kind of machine, and any Python 3; all else is in pyproject.toml."""
import pathlib

from setuptools import Distribution, setup

try:
    from setuptools.command.bdist_wheel import bdist_wheel
except ImportError:  # setuptools before 70, as Debian 12's
    from wheel.bdist_wheel import bdist_wheel

NATIVE = (pathlib.Path(__file__).parent / "strata/_tiles.so").exists()


class Package(Distribution):
    def has_ext_modules(self):
        return NATIVE


class AnyPython(bdist_wheel):
    def get_tag(self):
        return ("py3", "none", super().get_tag()[2])


setup(distclass=Package, cmdclass={"bdist_wheel": AnyPython} if NATIVE else {})
