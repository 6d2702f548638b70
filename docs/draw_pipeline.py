#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/pipeline.svg: the steps of src/pipeline.c with the functions that enter them, and the layers and wings of the library.

    python3 docs/draw_pipeline.py            draws it
    python3 docs/draw_pipeline.py --check    fails where the picture is not what it would draw, where a step's function is not in its
                                             file, or where a stop of a walk on docs/overview.md is not
"""
import html
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PICTURE, PAGE = ROOT / "docs/pipeline.svg", ROOT / "docs/overview.md"
OBJECTS = ["model file", "model", "equations", "program", "trajectory", "verdict"]
LAYERS = [("src/base, linalg", "memory, files, matrices"), ("src/symbolic", "expressions, programs"), ("src/model", "language, data, reader"),
          ("constraints/kinds", "h of a closure"), ("src/dynamics", "M, C, J, forces, outputs"), ("src/backend", "tape, machine code"),
          ("constraints", "closing, choice of u, v"), ("integrators", "decisions, formulations"), ("src/output", "tables, verdicts")]
WINGS = [("src/analyses", "KEMPE_ANALYSES"), ("src/rail", "KEMPE_RAIL"), ("src/exchange", "KEMPE_EXCHANGE"), ("src/ensemble", "KEMPE_ENSEMBLE"),
         ("src/picture", "KEMPE_PICTURE"), ("src/report", "KEMPE_REPORT")]
STEP = re.compile(r"^/\* -- (\w+): (\w+), (\S+) -+ \*/$", re.M)
STOP = re.compile(r"^\d+\. `(\w+)`, `([\w./]+)`", re.M)


def steps():
    return STEP.findall((ROOT / "src/pipeline.c").read_text())


def text(x, y, words, size=12, anchor="middle", colour="#222", family="sans-serif"):
    return (f'<text x="{x}" y="{y}" font-size="{size}" text-anchor="{anchor}" fill="{colour}" '
            f'font-family="{family}">{html.escape(words)}</text>')


def box(x, y, width, height, fill, stroke="#889"):
    return f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="4" fill="{fill}" stroke="{stroke}"/>'


def picture():
    out = ['<svg xmlns="http://www.w3.org/2000/svg" width="1000" height="330" viewBox="0 0 1000 330">',
           '<rect width="1000" height="330" fill="#fff"/>',
           '<marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto"><path d="M0,0 8,4 0,8z" '
           'fill="#356"/></marker>']
    pitch, width = 178, 90
    for k, name in enumerate(OBJECTS):
        out += [box(10 + k * pitch, 40, width, 34, "#eef3f8"), text(10 + k * pitch + width / 2, 61, name, 13)]
    for k, (step, function, path) in enumerate(steps()):
        left, middle = 10 + k * pitch + width, 10 + k * pitch + width + (pitch - width) / 2
        out += [f'<line x1="{left + 3}" y1="57" x2="{left + pitch - width - 3}" y2="57" stroke="#356" stroke-width="1.5" marker-end="url(#tip)"/>',
                text(middle, 48, step, 13, colour="#356"), text(middle, 96, function, 11, family="monospace"),
                text(middle, 112, path, 9, colour="#667", family="monospace")]
    out.append(text(10, 150, "The core, each layer on those before it", 12, "start", "#556"))
    pitch = 109
    for k, (name, what) in enumerate(LAYERS):
        out += [box(10 + k * pitch, 160, pitch - 8, 44, "#f4f6ee"), text(10 + k * pitch + (pitch - 8) / 2, 178, name, 9.5, family="monospace"),
                text(10 + k * pitch + (pitch - 8) / 2, 195, what, 8.5, colour="#667")]
    out.append(text(10, 240, "Wings: options of CMake; they see the core, which sees none of them", 12, "start", "#556"))
    pitch = 163
    for k, (name, option) in enumerate(WINGS):
        out += [box(10 + k * pitch, 250, pitch - 12, 44, "#f8f0ea"), text(10 + k * pitch + (pitch - 12) / 2, 268, name, 11, family="monospace"),
                text(10 + k * pitch + (pitch - 12) / 2, 285, option, 9, colour="#667", family="monospace")]
    return "\n".join(out) + "\n</svg>\n"


def missing(stops, where):
    """Stops whose function is not defined, or whose row does not stand, in the file."""
    for function, path in stops:
        file = ROOT / path
        if not file.is_file() or not re.search(rf"\b{function}\b", file.read_text()):
            yield f"{where}: '{function}' is not in {path}"


def main(arguments):
    if arguments != ["--check"]:
        PICTURE.write_text(picture())
        return 0
    problems = [*missing([(function, path) for _, function, path in steps()], "src/pipeline.c"),
                *missing(STOP.findall(PAGE.read_text()), "docs/overview.md")]
    if len(steps()) != len(OBJECTS) - 1:
        problems.append(f"src/pipeline.c: {len(steps())} steps, and {len(OBJECTS)} objects")
    if PICTURE.read_text() != picture():
        problems.append("docs/pipeline.svg: run python3 docs/draw_pipeline.py")
    print("\n".join(problems) or f"{len(steps())} steps, {len(STOP.findall(PAGE.read_text()))} stops of walks stand where the page says")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
