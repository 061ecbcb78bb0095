#!/usr/bin/python3
"""Makes the pages of the manual of a program, one for it and one for each of its commands, from what they say with --help.

    docs/reference/manual.py build/release/client/cli/strata --section 1 --out build/release/manual/man1

Nothing is done where the pages are newer than the program. The date in them is that of SOURCE_DATE_EPOCH, if it is set.
"""
import argparse
import datetime
import gzip
import os
import pathlib
import re
import sys
import textwrap

import help_text

LISTS = {"Positionals": "ARGUMENTS", "Options": "OPTIONS", "Subcommands": "COMMANDS",
         "Group Positionals": "ARGUMENTS OF WHICH ONE, OR ONE SUCH OPTION, IS REQUIRED",
         "Group Options": "OPTIONS OF WHICH ONE IS REQUIRED"}
GROUP = re.compile(r"^\[Option Group: .*\]\n\s*\n  \[Exactly 1 .*\]\n((?:  .*\n)*)", re.MULTILINE)


def escaped(text):
    """Text as roff takes it: no letter of it is a request, and a hyphen is one that can be copied."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("~", "\\(ti").replace("^", "\\(ha").replace("`", "\\(ga")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.MULTILINE)


def filled(text):
    return escaped(textwrap.fill(text, 76, break_long_words=False, break_on_hyphens=False))


def ungrouped(group):
    """What CLI11 lists of an option group, as lists of their own."""
    return re.sub(r"^(\w+:)$", r"Group \1", re.sub(r"^  ", "", group[1], flags=re.MULTILINE), flags=re.MULTILINE)


def sections(text):
    """(what it is, its usage, [(heading, lines)], the rest) of a help text."""
    text = GROUP.sub(ungrouped, text)
    about, _, rest = text.partition("Usage: ")
    usage, _, rest = rest.partition("\n")
    listed = []
    lines = rest.splitlines()
    while lines:
        heading = re.fullmatch(r"(\S.*):", lines[0])
        if not lines[0].strip():
            lines.pop(0)
            continue
        is_list = heading and (heading[1] in LISTS or re.match(r"  -", lines[1] if len(lines) > 1 else ""))
        if not is_list:
            break
        end = next((i for i, line in enumerate(lines) if i and not line.startswith("  ")), len(lines))
        listed.append((heading[1], lines[1:end]))
        lines = lines[end:]
    return about.strip(), usage, listed, lines


def items(lines):
    """[(name and type, what is said of it)] of the lines of a list."""
    found = []
    for line in lines:
        begin = re.match(r"  (\S.*?)(?:\s{2,}(\S.*))?$", line)
        if begin and not line.startswith("   "):
            found.append([begin[1], begin[2] or ""])
        elif found:
            found[-1][1] = (found[-1][1] + " " + line.strip()).strip()
    return found


def item(heading, name, said):
    words = name.split(" ", 1) if heading != "Options" or name.startswith("-") else [name]
    rest = " " + escaped(words[1]) if len(words) > 1 else ""
    return f".TP\n\\fB{escaped(words[0])}\\fR{rest}\n{filled(said) or '.br'}\n"


def footer_of(lines):
    """(notes, examples) of a footer: what has columns stays as it is written."""
    notes = examples = ""
    for paragraph in re.split(r"\n\n+", "\n".join(lines).strip()):
        head, _, rest = paragraph.partition("\n")
        if head == "Example:":
            examples = ".SH EXAMPLES\n.nf\n" + escaped("\n".join(line.strip() for line in rest.splitlines())) + "\n.fi\n"
        elif rest:
            notes += f".PP\n{filled(head)}\n.PP\n.nf\n{escaped(rest)}\n.fi\n"
        elif head:
            notes += f".PP\n{filled(head)}\n"
    return notes, examples


def first_sentence(text):
    short = re.split(r"(?<=\w)[.;:] |\n", text, maxsplit=1)[0].rstrip(".")
    return short[:1].lower() + short[1:] if not short[:2].isupper() else short


def see_also(name, words, all_words, section):
    pages = [words[:-1]] if words else []
    pages += [other for other in all_words if len(other) == len(words) + 1 and other[:len(words)] == words]
    names = ["-".join((name, *other)) for other in pages]
    return ".SH SEE ALSO\n" + ",\n".join(f".BR {escaped(each)} ({section})" for each in names).replace(",\n", " ,\n") + "\n" if names else ""


def page_of(name, words, text, all_words, options):
    about, usage, listed, footer = sections(text)
    title = "-".join((name, *words))
    about = about.removeprefix(f"{name}, ").removeprefix("Strata: ")
    page = f'.TH {escaped(title.upper())} {options.section} "{options.date}" "{options.version}" "Strata"\n'
    page += f".SH NAME\n{escaped(title)} \\-\n{filled(first_sentence(about))}\n"
    command = " ".join((name, *words))
    page += f".SH SYNOPSIS\n.B {escaped(command)}\n{escaped(usage.removeprefix(command).strip())}\n"
    page += f".SH DESCRIPTION\n{filled(about)}\n"
    lists = [(heading, items(lines)) for heading, lines in listed if lines]
    for heading, found in lists:
        page += f'.SH "{escaped(LISTS.get(heading, heading.upper()))}"\n' + "".join(item(heading, *each) for each in found)
    notes, examples = footer_of(footer)
    if notes:
        page += ".SH NOTES\n" + notes.removeprefix(".PP\n")
    return page + examples + see_also(name, words, all_words, options.section)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--section", default="1")
    parser.add_argument("--version", default="Strata")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    options = parser.parse_args()
    name = options.program.name
    options.out.mkdir(parents=True, exist_ok=True)
    first = options.out / f"{name}.{options.section}.gz"
    if first.exists() and first.stat().st_mtime > max(options.program.stat().st_mtime, pathlib.Path(__file__).stat().st_mtime):
        return 0
    for old in options.out.glob(f"{name}*.gz"):
        old.unlink()
    epoch = int(os.environ.get("SOURCE_DATE_EPOCH", datetime.datetime.now(datetime.timezone.utc).timestamp()))
    options.date = datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc).date().isoformat()
    pages = help_text.walk(str(options.program))
    all_words = [words for words, _ in pages]
    for words, text in reversed(pages):  # that of the program last: it says that all are there
        page = page_of(name, words, text, all_words, options)
        file = options.out / f"{'-'.join((name, *words))}.{options.section}.gz"
        file.write_bytes(gzip.compress(page.encode(), mtime=0))
    return 0


sys.exit(main())
