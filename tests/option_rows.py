#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The table of the options of a run, src/model/data/run_options.def, and what comes from it.

    python3 tests/option_rows.py           fails when kempe_run_options differs from the table, or when a row that is added to a copy
                                           of the table does not reach all that it feeds
    python3 tests/option_rows.py --write   writes the members of kempe_run_options in include/kempe/kempe.h
    python3 tests/option_rows.py --files   tells in how many files that are written by hand each option is named
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.dont_write_bytecode = True
sys.path[:0] = [str(ROOT / "schema"), str(ROOT / "docs")]
import api  # noqa: E402
import generate_schema  # noqa: E402

TABLE, HEADER = ROOT / "src/model/data/run_options.def", ROOT / "include/kempe/kempe.h"
STRUCT = re.compile(r"(typedef struct kempe_run_options \{\n.*?;[^\n]*\n)(.*?)(\} kempe_run_options;)", re.S)
C = {"NUMBER": "double ", "TIME": "double ", "ANGLE": "double ", "LONG": "long ", "WHOLE": "int ", "FLAG": "int ", "TEXT": "const char *"}
DRY = ('KMP_RUN_OPTION(dry_run, TIME, KEY, RUN, FOLDER, OF_ALL, CLI_SIMULATE, IN_RUN, "dry-run", "T",\n    "none", "an option that no run obeys", "")\n')
# Files that a row reaches, and the text of the row in each after the preprocessor.
REACHED = {
    "src/cli/options.c": r'"dry-run".*"an option that no run obeys" ", s" " \(default: the model.s, or "',
    "src/cli/command.c": r"run->dry_run = run->dry_run",
    "src/model/read/read_run.c": r'\{"dry_run", "s", "none"\}',
    "src/model/write/model_print.c": r'"dry_run", [\w()]+, \(double\)run->dry_run',
    "integrators/run/methods.c": r"spec->dry_run = spec->dry_run",
    "src/studies/simulate/trajectory.c": r"run->dry_run = spec->dry_run",
    "src/ensemble/manifest.c": r'\{"dry_run", [^"]*\}',
    "src/ensemble/result_folder.c": r'"dry_run", &f->run\.dry_run',
    "src/ensemble/mechanisms.c": r"x->dry_run != y->dry_run",
}


def rows():
    for name, kind, *_, absent, words, more in generate_schema.rows(TABLE.name, "KMP_RUN_OPTION"):
        yield name, kind, absent, words, more


def comment(kind, absent, words, more):
    unit = generate_schema.RUN_UNITS.get(kind)
    text = f"{'1: ' if kind == 'FLAG' else ''}{words}{f', {unit}' if unit else ''}{more}{f' (default: {absent})' if absent else ''}"
    text = text.replace("`", "")
    return "".join(f"    {line}\n" for line in textwrap.wrap(f"/* {text}\u00a0*/", 116, subsequent_indent=" * ")).replace("\u00a0", " ")


def members():
    """The members of the struct, each below its comment."""
    return "".join(f"{comment(kind, *words)}    {C[kind]}{name};\n" for name, kind, *words in rows())


def wanted(text):
    return STRUCT.sub(lambda match: match.group(1) + members() + match.group(3), text)


def dry_run():
    """The files that a row of a copy of the table does not reach."""
    missed = []
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / "model/data/run_options.def"
        copy.parent.mkdir(parents=True)
        copy.write_text(TABLE.read_text() + DRY)
        for file, pattern in REACHED.items():
            command = ["cc", "-E", "-P", "-DKEMPE_ENSEMBLE", f"-I{folder}", f"-I{ROOT / 'src'}", f"-I{ROOT}", f"-I{ROOT / 'include'}", str(ROOT / file)]
            text = subprocess.run(command, capture_output=True, text=True, check=False).stdout
            if not re.search(pattern, text):
                missed.append(file)
    return missed


def named(option):
    """Files written by hand that name an option: sources, headers and Python, without tests, examples and pages."""
    folders = ["src", "constraints", "integrators", "include", "python/kempe", "schema"]
    files = [path for folder in folders for path in sorted((ROOT / folder).rglob("*")) if path.suffix in {".c", ".h", ".def", ".py"}]
    word = re.compile(rf"\b{option}\b")
    return [str(path.relative_to(ROOT)) for path in files if path != HEADER and word.search(path.read_text())]


def main(arguments):
    text = HEADER.read_text()
    if "--write" in arguments:
        HEADER.write_text(wanted(text))
        return 0
    if "--files" in arguments:
        for name, *_ in rows():
            files = named(name)
            print(f"{name}: {len(files)} files: {' '.join(files)}")
        return 0
    wrong = [] if text == wanted(text) else ["kempe_run_options differs from run_options.def: python3 tests/option_rows.py --write"]
    wrong += [f"{file}: a row that is added to run_options.def does not arrive here" for file in dry_run()]
    said = f"{len(list(rows()))} options of a run; a row reaches {len(REACHED)} sources that nobody edits; max_step is named in {len(named('max_step'))} files"
    print(*wrong or [said], sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
