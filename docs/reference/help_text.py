"""What the built programs say of themselves with --help."""
import concurrent.futures
import os
import re
import subprocess


def help_of(program, words):
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("STRATA_", "ROS_"))}
    return subprocess.run([program, *words, "--help"], env=clean, text=True, check=True, timeout=60,
                          stdout=subprocess.PIPE).stdout


def subcommands(text):
    listed = re.search(r"^Subcommands:\n((?:  .*\n)*)", text, re.MULTILINE)
    return re.findall(r"^  (\S+)", listed.group(1), re.MULTILINE) if listed else []


def walk(program, words=()):
    """[(words, help)] of a program and all that is below it, as it lists them."""
    text = help_of(program, words)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        below = list(pool.map(lambda word: walk(program, (*words, word)), subcommands(text)))
    return [(words, text), *(entry for entries in below for entry in entries)]
