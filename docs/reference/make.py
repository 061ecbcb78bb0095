#!/usr/bin/python3
"""Makes the references in docs/reference/: of the commands by asking the built programs for their --help, of the API from the
comments of proto/strata/v1.

    docs/reference/make.py --build build/release            writes them
    docs/reference/make.py --build build/release --check    exits 1 and names those that are older than what they are made from

Needs protoc and python3-protobuf. A program that is not built (strata-ros2, where there is no cyclonedds-dev) is left out.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap

from google.protobuf import descriptor_pb2

import help_text

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WIDTH = 118
FIELD = descriptor_pb2.FieldDescriptorProto
PROGRAMS = {  # page: (program, where it lies in the build, what stands above)
    "cli.md": ("strata", "client/cli/strata", "Every command takes `--server`, `--embedded` and `--output`, too, before or after its words."),
    "stratad.md": ("stratad", "server/stratad", "Options may stand in a file, one a line: `listen = 127.0.0.1:50051` (`--config`)."),
    "strata-ros2.md": ("strata-ros2", "client/ros2/strata-ros2", "What it does is told in [a robot of ROS 2](../ros2.md)."),
}
MADE = "<!-- Made by docs/reference/make.py; do not edit. -->\n"


# Commands

def wrapped(line):
    """A line of --help no wider than the page, its rest below its own last column."""
    if len(line) <= WIDTH:
        return line
    column = re.match(r"\s*\S+(?: \S+)*\s{2,}(?=\S)|\s*", line).end()
    return textwrap.fill(line.strip(), WIDTH, initial_indent=line[:len(line) - len(line.lstrip())],
                         subsequent_indent=" " * min(column, 60), break_long_words=False, break_on_hyphens=False)


def command_section(name, words, text):
    about, _, usage = text.partition("Usage: ")
    usage = re.sub(r"^Also --server .*\n|^  -h,--help .*\n", "", usage, flags=re.MULTILINE)
    usage = re.sub(r"Options:\n(?=\n|$)", "", usage)
    usage = re.sub(r"\n{3,}", "\n\n", usage).strip()
    shown = "\n".join(map(wrapped, usage.splitlines()))
    heading = "#" * min(len(words) + 1, 3) + " " + " ".join((name, *words))
    return f"{heading}\n\n{prose(about)}\n\n```text\n{shown}\n```\n"


def command_page(name, program, above):
    sections = [command_section(name, words, text) for words, text in help_text.walk(str(program))]
    title, rest = sections[0].split("\n", 1)
    return f"{title}\n\n{MADE}\n{above}\n{rest}\n" + "\n".join(sections[1:])


# The API

def escaped(text):
    """A comment as Markdown: what is code stays as it is."""
    pieces = text.split("`")
    for index in range(0, len(pieces), 2):
        pieces[index] = pieces[index].replace("&", "&amp;").replace("<", "&lt;").replace("*", "\\*").replace("|", "\\|")
    return "`".join(pieces)


def prose(comment):
    """A comment's paragraphs as Markdown; one with columns stays as it is written."""
    paragraphs = []
    for part in filter(str.strip, comment.split("\n\n")):
        if re.search(r"^ {3,}\S", part, re.MULTILINE):
            paragraphs.append(f"```text\n{textwrap.dedent(part).strip()}\n```")
        else:
            paragraphs.append(textwrap.fill(escaped(" ".join(part.split())), 140, break_long_words=False, break_on_hyphens=False))
    return "\n\n".join(paragraphs)


def cell(comment):
    return "<br>".join(escaped(" ".join(part.split())) for part in comment.strip().split("\n\n"))


def descriptors():
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "set"
        files = sorted((ROOT / "proto/strata/v1").glob("*.proto"))
        subprocess.run(["protoc", f"-I{ROOT / 'proto'}", "--include_source_info", f"--descriptor_set_out={out}",
                        *map(str, files)], check=True)
        return descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes()).file


def comments_of(file):
    return {tuple(place.path): place.leading_comments for place in file.source_code_info.location if place.leading_comments}


def head_of(file):
    """The comment that the file begins with."""
    for place in file.source_code_info.location:
        if tuple(place.path) == (12,):
            return prose(place.leading_comments or "".join(place.leading_detached_comments))
    return ""


def linked(type_name):
    short = type_name.removeprefix(".strata.v1.")
    return f"[{short}](#{anchor(short)})" if type_name.startswith(".strata.v1.") else f"`{type_name.lstrip('.')}`"


def anchor(name):
    return name.lower().replace(".", "")


def type_of(field, maps):
    if field.type_name in maps:
        return "map of " + " to ".join(type_of(each, maps) for each in maps[field.type_name].field)
    named = linked(field.type_name) if field.type_name else FIELD.Type.Name(field.type)[5:].lower()
    if field.label == FIELD.LABEL_REPEATED:
        return "repeated " + named
    return "optional " + named if field.proto3_optional else named


def row(*cells):
    return "| " + " | ".join(cells) + " |\n"


def message_section(name, message, path, comments):
    maps = {f".strata.v1.{name}.{nested.name}": nested for nested in message.nested_type if nested.options.map_entry}
    text = f"#### {name}\n\n{prose(comments.get(path, ''))}\n\n"
    if message.field:
        text += row("field", "type", "what") + "|---|---|---|\n"
    for index, field in enumerate(message.field):
        one_of = field.HasField("oneof_index") and not field.proto3_optional
        kind = type_of(field, maps) + (f", one of *{message.oneof_decl[field.oneof_index].name}*" if one_of else "")
        text += row(f"`{field.name}`", kind, cell(comments.get((*path, 2, index), "")))
    for index, nested in enumerate(message.nested_type):
        if not nested.options.map_entry:
            text += "\n" + message_section(f"{name}.{nested.name}", nested, (*path, 3, index), comments)
    for index, nested in enumerate(message.enum_type):
        text += "\n" + enum_section(f"{name}.{nested.name}", nested, (*path, 4, index), comments)
    return text


def enum_section(name, enum, path, comments):
    text = f"#### {name}\n\n{prose(comments.get(path, ''))}\n\n" + row("value", "", "what") + "|---|---|---|\n"
    for index, value in enumerate(enum.value):
        text += row(f"`{value.name}`", str(value.number), cell(comments.get((*path, 2, index), "")))
    return text


def service_section(service, path, comments):
    text = f"### {service.name}\n\n{prose(comments.get(path, ''))}\n\n" + row("call", "takes, answers", "what") + "|---|---|---|\n"
    for index, call in enumerate(service.method):
        takes = ("stream of " if call.client_streaming else "") + linked(call.input_type)
        answers = ("stream of " if call.server_streaming else "") + linked(call.output_type)
        text += row(f"`{call.name}`", f"{takes}, {answers}", cell(comments.get((*path, 2, index), "")))
    return text


def file_section(file):
    comments = comments_of(file)
    parts = [f"## {pathlib.Path(file.name).stem}\n\n{head_of(file)}\n"]
    parts += [service_section(service, (6, index), comments) for index, service in enumerate(file.service)]
    parts += [message_section(message.name, message, (4, index), comments)
              for index, message in enumerate(file.message_type)]
    parts += [enum_section(enum.name, enum, (5, index), comments) for index, enum in enumerate(file.enum_type)]
    return "\n".join(parts)


def api_page():
    files = [file for file in descriptors() if file.name.startswith("strata/")]
    above = ("The public contract, package `strata.v1`, from the comments of `proto/strata/v1`. What holds for all calls (rights, errors, limits, what a\n"
             "repeated call does) is in [the contract](../../proto/README.md); the same by JSON in [web](../web.md#json).\n")
    return f"# API\n\n{MADE}\n{above}\n" + "\n".join(map(file_section, files))


def pages(build):
    made = {page: command_page(name, build / where, above) for page, (name, where, above) in PROGRAMS.items()
            if (build / where).exists()}
    made["api.md"] = api_page()
    # No line ends with a space, and a blank line stands alone.
    return {page: re.sub(r"\n{3,}", "\n\n", re.sub(r" +$", "", text, flags=re.MULTILINE)) for page, text in made.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    stale = []
    for page, text in pages(options.build.resolve()).items():
        file = HERE / page
        if options.check:
            stale += [page] if not file.exists() or file.read_text(encoding="utf-8") != text else []
        else:
            file.write_text(text, encoding="utf-8")
    for page in stale:
        print(f"docs/reference/{page} is older than what it is made from: run docs/reference/make.py", file=sys.stderr)
    return 1 if stale else 0


sys.exit(main())
