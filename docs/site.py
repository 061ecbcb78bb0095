"""What mkdocs does to the pages on their way into the site (mkdocs.yml, "hooks").

Links in the repository are relative, as a code forge follows them. Some leave docs/: those to pages in OUTSIDE are on the site, too,
under a name of its own; others, to sources and tools, are text there. A link to a file that is not there fails the build.
"""
import logging
import os
import pathlib
import posixpath
import re

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parent.parent
LOG = logging.getLogger("mkdocs.hooks.site")
OUTSIDE = {  # of the repository: of the site
    "README.md": "overview.md",
    "CHANGELOG.md": "changelog.md",
    "SECURITY.md": "security.md",
    "deploy/README.md": "running.md",
    "deploy/RUNBOOK.md": "runbook.md",
    "deploy/bridge.png": "pictures/readme-bridge.png",
    "client/python/README.md": "python.md",
    "proto/README.md": "contract.md",
    "tests/README.md": "tests.md",
    "tests/experiments/RESULTS.md": "results.md",
    "core/README.md": "core.md",
    "core/storage/FORMAT.md": "file-format.md",
    "core/codec/FORMAT.md": "wire-format.md",
}
INSIDE = {site: repository for repository, site in OUTSIDE.items()}
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")


def on_files(files, config):
    for file in [each for each in files if each.src_path.endswith(".py")]:
        files.remove(file)
    for repository, site in OUTSIDE.items():
        file = File(site, config["docs_dir"], config["site_dir"], config["use_directory_urls"])
        file.abs_src_path = str(ROOT / repository)
        files.append(file)
    decisions = sorted(each.src_path for each in files if each.src_path.startswith("decisions/"))
    for entry in config["nav"]:
        if "Decisions" in entry:
            entry["Decisions"] = decisions
    return files


def site_path(repository):
    """Where a path of the repository is on the site; None where it is not."""
    if repository.startswith("docs/"):
        return None if repository.endswith(".py") or not (ROOT / repository).is_file() else repository.removeprefix("docs/")
    return OUTSIDE.get(repository)


def relinked(match, page):
    mark, text, target = match.groups()
    if re.match(r"[a-z]+:|#", target):
        return match.group(0)
    path, _, anchor = target.partition("#")
    repository = posixpath.normpath(posixpath.join(posixpath.dirname(INSIDE.get(page, "docs/" + page)), path))
    if not (ROOT / repository).exists():
        LOG.warning("%s links to %s, which is not there", page, target)
    site = site_path(repository)
    if site is None:
        return text
    link = os.path.relpath(site, posixpath.dirname(page) or ".")
    return f"{mark}[{text}]({link}{'#' + anchor if anchor else ''})"


def on_page_markdown(markdown, page, config, files):
    pieces = re.split(r"(^ *```.*?^ *```|`[^`\n]+`)", markdown, flags=re.DOTALL | re.MULTILINE)
    # Code between links stays; a link around code is put together first.
    whole = "".join(piece if index % 2 == 0 else f"\0{index}\0" for index, piece in enumerate(pieces))
    whole = LINK.sub(lambda match: relinked(match, page.file.src_path), whole)
    return re.sub(r"\0(\d+)\0", lambda match: pieces[int(match.group(1))], whole)
