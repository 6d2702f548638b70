#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/model_index.md: every key, kind, function, unit and output of the model language with its section, from the
tables of docs/model_format.md and docs/track.md.

    python3 docs/model_index.py            writes the page
    python3 docs/model_index.py --check    fails when the tables say something else
"""
import pathlib
import re
import sys

DOCS = pathlib.Path(__file__).parent
PAGE = DOCS / "model_index.md"
HEAD = """# Index of the model language

This page is generated from the tables of [Model files](model_format.md) and [Track](track.md) (`python3 docs/model_index.py`).
"""
PAGES = {"model_format.md": None, "track.md": None}
SINGULAR = {"Top level": "model", "Bodies": "body", "Joints": "joint", "Graphs of joints": "joint between two bodies", "Wheels": "wheel", "Loops": "closure",
            "Curves": "curve", "Drives": "drive", "Forces": "force", "Start": "start", "Run": "run", "Expressions": "expression", "Include": "include",
            "Profiles": "profile", "Tracks": "track", "Course": "course", "Irregularities": "irregularities", "Tables": "table", "Implicit variables": "implicit variable"}
LEFT_OUT = ("Example", "Limits")


def anchor(title):
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")


def sections(text):
    """(title, body) of every section and subsection."""
    parts = re.split(r"^##+ (.*)\n", text, flags=re.M)
    return zip(parts[1::2], parts[2::2])


def tables(body):
    """(last bold word before, heading, rows) of every table; a row is a list of cells."""
    for block in re.finditer(r"(?:^\|.*\n)+", body, re.M):
        rows = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in block.group().rstrip("\n").split("\n")]
        bold = re.findall(r"^\*\*([\w ]+)\*\*", body[:block.start()], re.M)
        yield bold[-1] if bold else "", rows[0], rows[2:]


def words(head, row):
    """Names in a row: the key of `A: {kind: ..}` entries with the kind first, else what stands in backquotes."""
    column = 1 if head[0] == "dimension" else 0
    for text in re.findall(r"`([^`]+)`", row[column]):
        entry = re.match(r"\w+: \{(.*)\}$", text)
        if entry:
            yield from re.findall(r"(?<![\"\w(.*-])([a-z_]{2,}):", text[text.index("{"):])
        elif head[0] != "joint" and re.match(r"[a-zA-Z]", text) and not (head[0] == "key" and re.match(r"[A-Z]", text)):
            yield re.match(r"\w+", text).group()


def kind(head):
    return {"dimension": "unit", "function": "function", "output": "output", "name": "value of `contact(WHEEL)`"}.get(head[0], "")


def entries():
    """{(word, sort): link}"""
    found = {}
    for page in PAGES:
        for title, body in sections((DOCS / page).read_text()):
            if title in LEFT_OUT:
                continue
            for part, head, rows in tables(body):
                if head[0] in ("section", "expression"):
                    continue
                for row in rows:
                    for word in words(head, row):
                        of = SINGULAR.get(part if title == "Top level" else title) or SINGULAR.get(title, title.lower())
                        sort = kind(head) or f"key of {of}"
                        if re.fullmatch("[A-Z]", word) and sort.startswith("key"):
                            continue  # the name of an object in an example
                        found.setdefault((word, sort), f"[{title}]({page}#{anchor(title)})")
    return found


def page():
    found = entries()
    lines = [HEAD]
    for letter in sorted({word[0].upper() for word, _ in found}):
        lines.append(f"## {letter}\n\n| word | role | section |\n|---|---|---|")
        rows = sorted((item for item in found if item[0][0].upper() == letter), key=lambda item: (item[0].lower(), item[0], item[1]))
        lines += [f"| `{word}` | {sort} | {found[word, sort]} |" for word, sort in rows]
        lines.append("")
    return "\n".join(lines)


def main(arguments):
    if arguments == ["--check"]:
        if PAGE.exists() and PAGE.read_text() == page():
            return 0
        print("docs/model_index.md differs: run python3 docs/model_index.py")
        return 1
    PAGE.write_text(page())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
