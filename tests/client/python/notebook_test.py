"""The notebooks of client/python/examples run from top to bottom against a real stratad, and give the outputs that they show.

    notebook_test.py [--write]    puts the outputs of this run into the notebooks
A runner of its own: Debian's nbclient and ipykernel are thirty packages, and what is needed is to run cells and to compare text.
"""
import ast
import asyncio
import contextlib
import importlib.util
import inspect
import io
import json
import os
import pathlib
import sys
import tempfile
import unittest

from support import Stratad

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "client/python/examples"
NEEDS = ("xarray",)


def evaluated(tree, mode, names):
    """The value of a piece of a cell, awaited where it awaits."""
    value = eval(compile(tree, "<cell>", mode, flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT), names)  # noqa: S307, our own cells
    return asyncio.run(value) if inspect.iscoroutine(value) else value


def outputs_of(source, names):
    """As Jupyter: what is printed, and the value of a last line that is an expression."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        evaluated(tree, "exec", names)
        value = None if last is None else evaluated(ast.Expression(last.value), "eval", names)
    outputs = []
    if printed.getvalue():
        outputs.append({"name": "stdout", "output_type": "stream", "text": printed.getvalue().splitlines(True)})
    if value is not None:
        outputs.append({"data": {"text/plain": repr(value).splitlines(True)}, "execution_count": None, "metadata": {},
                        "output_type": "execute_result"})
    return outputs


def run(notebook):
    """The notebook with the outputs of this run."""
    with tempfile.TemporaryDirectory() as folder:
        server = Stratad(folder)
        server.start()
        os.environ["STRATA_SERVER"] = server.address
        names = {"__name__": "__main__"}
        try:
            for cell in notebook["cells"]:
                if cell["cell_type"] == "code":
                    cell["outputs"] = outputs_of("".join(cell["source"]), names)
        finally:
            server.stop()
    return notebook


class NotebookTest(unittest.TestCase):
    def test_notebooks_give_what_they_show(self):
        missing = [library for library in NEEDS if not importlib.util.find_spec(library)]
        if missing:
            self.skipTest(f"apt install python3-{' python3-'.join(missing)}")
        paths = sorted(EXAMPLES.glob("*.ipynb"))
        self.assertTrue(paths)
        for path in paths:
            with self.subTest(path.name):
                shown = json.loads(path.read_text(encoding="utf-8"))
                got = run(json.loads(path.read_text(encoding="utf-8")))
                for cell, again in zip(shown["cells"], got["cells"]):
                    self.assertEqual(cell, again)
                self.assertTrue(any(cell.get("outputs") for cell in shown["cells"]))


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        for notebook_path in EXAMPLES.glob("*.ipynb"):
            notebook_path.write_text(json.dumps(run(json.loads(notebook_path.read_text(encoding="utf-8"))), indent=1,
                                                ensure_ascii=False) + "\n", encoding="utf-8")
    else:
        unittest.main()
