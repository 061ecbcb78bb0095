"""A stratad of its own for experiments, and what it takes."""
import pathlib
import subprocess
import sys
import time


class Stratad:
    """`log`: the file that its log is added to; else stratad.log in `folder`."""

    def __init__(self, build, folder, *arguments, log=None):
        begun, log = time.monotonic(), log or pathlib.Path(folder) / "stratad.log"
        self.process = subprocess.Popen(
            [build / "server/stratad", "--data", folder, "--listen", "127.0.0.1:0", *map(str, arguments)],
            stdout=subprocess.PIPE, stderr=open(log, "a"), text=True)
        line = self.process.stdout.readline().split()
        if len(line) < 2:
            sys.exit(f"stratad does not start; see {log}")
        self.address, self.opened_s = line[1], time.monotonic() - begun

    def status(self, field):
        """Of /proc/PID/status, as a number (kB of memory)."""
        for line in pathlib.Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith(f"{field}:"):
                return int(line.split()[1])
        raise KeyError(field)

    def peak_mb(self):
        return self.status("VmHWM") / 1024

    def forget_peak(self):
        pathlib.Path(f"/proc/{self.process.pid}/clear_refs").write_text("5")

    def files(self):
        return len(list(pathlib.Path(f"/proc/{self.process.pid}/fd").iterdir()))

    def alive(self):
        return self.process.poll() is None

    def stop(self):
        self.process.terminate()
        self.process.wait()
