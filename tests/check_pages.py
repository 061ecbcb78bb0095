#!/usr/bin/env python3
"""Holds the pages together without mkdocs: every relative link of a Markdown file leads to a file that is there and, where it has an
anchor, to a heading; every page of docs/ but the decisions is in mkdocs.yml's navigation, and what that names is there.

What docs/reference/make.py makes is held by itself (--check), since it asks the built programs.
"""
import functools
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LINK = re.compile(r"\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^()\s]+)\)")
CODE = re.compile(r"^ *```.*?^ *```|`[^`\n]+`|<!--.*?-->", re.DOTALL | re.MULTILINE)


def pages():
    return sorted(path for path in ROOT.rglob("*.md") if not {"build", ".git"} & set(path.relative_to(ROOT).parts))


@functools.cache
def headings(path):
    """The anchors of a page's headings, as both mkdocs and forges make them of ours."""
    text = re.sub(r"^ *```.*?^ *```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^#+ +(.*)$", text, re.MULTILINE)
    return {re.sub(r" +", "-", re.sub(r"[^\w\- ]", "", title).strip().lower()) for title in titles}


def faults_of_links(page):
    for target in LINK.findall(CODE.sub("", page.read_text(encoding="utf-8"))):
        path, _, anchor = target.partition("#")
        if re.match(r"[a-z]+:", target):
            continue
        file = (page.parent / path).resolve() if path else page
        if not file.exists():
            yield f"links to {target}, which is not there"
        elif anchor and file.suffix == ".md" and anchor not in headings(file):
            yield f"links to {target}, but {file.relative_to(ROOT)} has no such heading"


def faults_of_navigation():
    named = set(re.findall(r"^ +- [^:\n]+: (\S+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE))
    outside = set(re.findall(r'^    "[^"]+": "(\S+\.md)",$', (ROOT / "docs/site.py").read_text(encoding="utf-8"), re.MULTILINE))
    inside = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    inside = {path for path in inside if not path.startswith("decisions/")}
    yield from (f"mkdocs.yml does not name {path}" for path in sorted((inside | outside) - named))
    yield from (f"mkdocs.yml names {path}, which is not there" for path in sorted(named - inside - outside))


def main():
    faults = [f"{page.relative_to(ROOT)} {fault}" for page in pages() for fault in faults_of_links(page)]
    faults += faults_of_navigation()
    print(*faults, sep="\n", end="\n" if faults else "")
    return 1 if faults else 0


sys.exit(main())
