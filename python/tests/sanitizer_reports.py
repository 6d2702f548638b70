# SPDX-License-Identifier: BSD-3-Clause
"""Judges what the sanitizers wrote into a folder (python/sanitize): every error, and each leak that was allocated in Kempe."""

import pathlib
import re
import sys

OURS = re.compile(r"_native\.abi3\.so|/(?:src|constraints|integrators|python)/\S+\.c:\d+|lib(?:sundials|klu|btf|amd|colamd|yaml|expat)\w*\.so")


def findings(text):
    """Errors, and leaks of ours: blocks of a report."""
    blocks = re.split(r"\n\s*\n", text)
    for block in blocks:
        is_leak = re.search(r"(?:Direct|Indirect) leak of", block)
        if is_leak and OURS.search(block):
            yield block
    if not re.search(r"LeakSanitizer: detected memory leaks", text) or re.search(r"ERROR: AddressSanitizer|runtime error:", text):
        yield text[:4000]


def main(folder):
    reports = sorted(pathlib.Path(folder).iterdir())
    found = [each for report in reports for each in findings(report.read_text())]
    for each in found:
        print(each, end="\n\n")
    print(f"{len(reports)} reports of processes, {len(found)} findings in Kempe")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
