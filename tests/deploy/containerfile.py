"""What a container of deploy/container/Containerfile runs."""
import json
import os
import pathlib
import re
import subprocess

CONTAINERFILE = pathlib.Path(__file__).resolve().parents[2] / "deploy/container/Containerfile"


def check(arguments, config):
    """`stratad check` on what the image begins with and these arguments behind it, with its configuration read from `config`."""
    program, *entry = json.loads(re.search(r"^ENTRYPOINT (.*)$", CONTAINERFILE.read_text(), re.M)[1])
    assert program == "stratad", program
    here = [str(config) if argument == "/etc/strata/stratad.conf" else argument for argument in [*entry, *arguments]]
    return subprocess.run([os.environ["STRATA_STRATAD"], "check", *here], capture_output=True, text=True, check=False)
