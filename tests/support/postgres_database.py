"""A PostgreSQL server of a test's own."""
import os
import pathlib
import subprocess
import tempfile


class Database:
    """An empty database in a folder, on a unix socket there; None as its address where PostgreSQL 15 is not installed."""

    PROGRAMS = pathlib.Path("/usr/lib/postgresql/15/bin")

    def __enter__(self):
        self.address = None
        self.folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        if not (self.PROGRAMS / "initdb").exists():
            return self
        self.user = {"user": "postgres", "group": "postgres", "extra_groups": []} if os.geteuid() == 0 else {}
        os.chmod(self.folder.name, 0o777)
        self.run("initdb", "-D", "db", "-E", "UTF8", "-A", "trust", "-U", "strata")
        self.run("pg_ctl", "-D", "db", "-w", "-l", "log", "-o", f"-k {self.folder.name} -c listen_addresses=''", "start")
        self.address = f"postgresql://strata@/postgres?host={self.folder.name}"
        return self

    def run(self, program, *arguments):
        subprocess.run([self.PROGRAMS / program, *arguments], cwd=self.folder.name, check=True, stdout=subprocess.DEVNULL, **self.user)

    def __exit__(self, *_):
        if self.address:
            self.run("pg_ctl", "-D", "db", "-m", "immediate", "stop")
        self.folder.cleanup()
