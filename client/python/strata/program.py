"""What the program `strata`, which must be installed, answers."""
import json
import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from typing import Any

from strata import errors


def run(program: str, arguments: Sequence[str], environment: Mapping[str, str] | None = None) -> Any:
    """The JSON that `program` prints for `arguments`; `environment`: added to this process's. Raises StrataError in its
    words, and FileNotFoundError where it is not installed."""
    found = shutil.which(program)
    if found is None:
        raise FileNotFoundError(f"{program} is not on the PATH; install the package strata, or name the program")
    done = subprocess.run([found, *arguments, "--output", "json"], capture_output=True, text=True, check=False,
                          env={**os.environ, **(environment or {})})
    if done.returncode != 0:
        raise errors.StrataError(done.stderr.strip() or f"{program} ended with {done.returncode}")
    return json.loads(done.stdout)
