#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The words that people read: the field's terms, and none of those that were retired.

    python3 tests/words.py PATH/TO/kempe    pages and help without retired words, docs/commands.md as the help says
    python3 tests/words.py --self-test      proves that planted words are found
    python3 tests/words.py --count          words a sentence and long sentences of each page

Text in backquotes and indented blocks is the program's own and is left out, but for the help, which is read whole.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "docs"))
import commands  # noqa: E402

RETIRED = {  # pattern: the word instead
    r"\broads?\b(?! vehicle)": "formulation",
    r"\bshaky\b": "infinitesimally mobile",
    r"\b(is|are|was|were) told\b": "is reported",
    r"\bby turns\b": "alternately",
    r"\bhangs? (on|by)\b": "is attached to, depends on",
    r"\bclock on the wall\b": "wall-clock time",
    r"\bno numbers?\b": "not a number, NaN",
    r"\bfrom afar\b": "from a distant guess",
    r"\bfreedoms\b": "degrees of freedom",
    r"\bcomplain(s|ed)? of\b": "reports",
    r"\bholds? (it|them|all of them) against\b": "compares with",
    r"\bled (over|through|along)\b": "swept, crossed",
    r"\bwho (moves|pulls)\b": "participation, acting forces",
    r"\bstumbles?\b": "fails",
}
OPTIONS = r"--(road|roads|once|every|fixed-u|u|dynamics|over|vary|drive|nearest|require|fix|free)\b"
HEADLESS = re.compile(r"^#+ (What|Whether|Of|Where|How)\b(?!-to\b).*", re.M)
REAL_ROADS = re.compile(r"road profile|drive\(road\)|bumpy road|\bthe road\b(?=[^.]*(plate|passengers|wheel|car))|times the road|road's displacement|road of 1 m", re.I)


def prose(text):
    """The text that is a person's: without code, tables' rules and addresses of links."""
    text = re.sub(r"^(    |\t).*$", "", text, flags=re.M)
    text = re.sub(r"```.*?```", "", text, flags=re.S)
    text = re.sub(r"\$\$.*?\$\$", "X", text, flags=re.S)
    text = re.sub(r"`[^`\n]*`|\$[^$]+\$", "X", text)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    return text


def pages():
    yield ROOT / "README.md"
    yield from sorted((ROOT / "docs").rglob("*.md"))
    yield from sorted((ROOT / "examples").rglob("README.md"))


def faults(name, text, whole=False):
    seen = REAL_ROADS.sub("", text if whole else prose(text))
    for pattern, instead in RETIRED.items():
        for match in re.finditer(pattern, seen):
            yield f"{name}: '{match.group()}': {instead}"
    for match in re.finditer(OPTIONS, text):
        yield f"{name}: '{match.group()}' is an option no more"
    for match in HEADLESS.finditer(seen):
        yield f"{name}: '{match.group()}': a heading is a noun"


def sentences(text):
    for block in re.split(r"\n\s*\n|^\|.*$|^#.*$|^- ", prose(text), flags=re.M):
        for sentence in re.split(r"(?<=[.:;?!])\s+", " ".join(block.split())):
            words = sentence.split()
            if len(words) > 2:
                yield words


def count():
    for page in pages():
        lengths = [len(words) for words in sentences(page.read_text())]
        if lengths:
            print(f"{page.relative_to(ROOT).as_posix():44} {sum(lengths) / len(lengths):5.1f} words a sentence, "
                  f"{sum(n > 30 for n in lengths):3} of {len(lengths)} above 30")
    return 0


def self_test():
    planted = ["solved along two roads\n", "## What it costs\n", "the mechanism is shaky\n", "run it with `--once`\n",
               "errors are told by line\n"]
    clean = ["a quarter car on a bumpy road\n", "    kempe simulate x.yaml\n", "## Cost\n", "| `road` | a key |\n"]
    wrong = [text for text in planted if not list(faults("planted", text))]
    wrong += [text for text in clean if list(faults("clean", text))]
    print(*(f"self-test: judged wrongly: {text.strip()}" for text in wrong), sep="\n", end="\n" if wrong else "")
    print(f"self-test: {len(planted) + len(clean) - len(wrong)} of {len(planted) + len(clean)} judged rightly")
    return 1 if wrong else 0


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    if arguments == ["--count"]:
        return count()
    kempe = str(pathlib.Path(arguments[0]).resolve())
    found = [f for page in pages() for f in faults(page.relative_to(ROOT).as_posix(), page.read_text())]
    for command in ["", *commands.commands(kempe)]:
        found += faults(f"kempe {command} --help", commands.help_of(kempe, *command.split()), whole=True)
    print(*found, f"{len(found)} retired words", sep="\n")
    return 1 if commands.main([kempe, "--check"]) or found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
