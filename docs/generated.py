# SPDX-License-Identifier: BSD-3-Clause
"""The end of every script that writes pages or figures: writes them, or compares them with what is there."""
import operator
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[1]


def settle(files, command, arguments, same=operator.eq):
    """Writes files, {path: text}; with the argument --check it tells those that differ. The exit status."""
    if "--check" not in arguments:
        for path, text in files.items():
            path.write_text(text)
        return 0
    wrong = [str(path.relative_to(ROOT)) for path, text in files.items() if not path.exists() or not same(path.read_text(), text)]
    if wrong:
        print(f"not as its source says: {', '.join(wrong)}: run {command}")
    return 1 if wrong else 0
