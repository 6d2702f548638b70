#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/contact_laws.svg, force over creep and over spin by each law of bench/results/laws.csv, and puts the tables
of bench/results/laws.txt into docs/contact_laws.md.

    python3 bench/draw_laws.py
"""
import csv
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))
from panels import BLUE, RED, TEAL, VIOLET  # noqa: E402

RESULTS = ROOT / "bench/results"

WIDTH, HEIGHT, LEFT, TOP, BOTTOM, GAP = 440, 380, 70, 50, 60, 60
LAWS = [  # name, colour, dashes
    ("linear", "#7f8c8d", "2 3"), ("shen", BLUE, ""), ("polach", RED, ""), ("tanh", TEAL, "6 4"),
    ("fastsim", "#222222", ""),
]
PANELS = [  # column, greatest value, marks, greatest force, words
    ("creep", 6e-3, [k * 1e-3 for k in range(7)], 1.2, "creepage along"),
    ("spin", 1.5, [k * 0.25 for k in range(7)], 1.2, "spin, 1/m"),
]
# CONTACT r2707 (github eve70a/CONTACT), examples/tractcurv.ref_out, cases 2 to 15, exact theory: force along, N.
EXACT = [9112, 16700, 22820, 27570, 31040, 33330, 34620, 35130, 35180, 35180, 35190, 35190, 35200, 35200]


def text(x, y, words, anchor="middle", colour="#222222", size=14, more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}" font-size="{size}"{more}>{words}</text>'


def panel(left, rows, column, greatest, marks, top, words):
    def place(at, force):
        return left + WIDTH * at / greatest, TOP + HEIGHT * (1 - force / top)

    lines = [text(left + WIDTH / 2, TOP + HEIGHT + 44, words)]
    for mark in marks:
        x, y = place(mark, 0)
        lines += [f'<path d="M{x:.1f} {y:.1f}V{TOP}" stroke="#dddddd"/>', text(x, y + 20, f"{mark:g}")]
    for k in range(7):
        x, y = place(0, 0.2 * k)
        lines += [f'<path d="M{x:.1f} {y:.1f}h{WIDTH}" stroke="#dddddd"/>', text(x - 8, y + 5, f"{0.2 * k:.1f}", "end")]
    for name, colour, dashes in LAWS:
        points = [(float(r["at"]), float(r[name])) for r in rows if r["over"] == column]
        shown = " ".join("%.1f,%.1f" % place(*p) for p in points if p[1] <= top)
        lines.append(f'<polyline points="{shown}" fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>')
    if column == "creep":
        for k, force in enumerate(EXACT):
            x, y = place(4e-4 * (k + 1), force / (0.33 * 106700))
            lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="white" stroke="{VIOLET}" stroke-width="2"/>')
    lines.append(f'<rect x="{left}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#222222"/>')
    return lines


def legend(left):
    lines, y = [], TOP + HEIGHT - 130
    lines.append(f'<rect x="{left}" y="{y - 16}" width="190" height="132" fill="white" fill-opacity="0.9" stroke="#bbbbbb"/>')
    for name, colour, dashes in LAWS:
        lines += [f'<path d="M{left + 10} {y}h34" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>',
                  text(left + 54, y + 5, name, "start", size=13)]
        y += 20
    return lines + [f'<circle cx="{left + 27}" cy="{y}" r="4" fill="white" stroke="{VIOLET}" stroke-width="2"/>',
                    text(left + 54, y + 5, "CONTACT, exact", "start", size=13)]


def draw():
    with open(RESULTS / "laws.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    second = LEFT + WIDTH + GAP
    width, height = second + WIDTH + 20, TOP + HEIGHT + BOTTOM
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
             f'font-family="sans-serif">', f'<rect width="{width}" height="{height}" fill="white"/>',
             text(LEFT + WIDTH / 2, TOP - 18, "force along, no spin"), text(second + WIDTH / 2, TOP - 18, "force across, spin alone"),
             text(20, TOP + HEIGHT / 2, "force / (friction N)", more=f' transform="rotate(-90 20 {TOP + HEIGHT / 2})"')]
    for left, settings in zip((LEFT, second), PANELS):
        lines += panel(left, rows, *settings)
    (ROOT / "docs/contact_laws.svg").write_text("\n".join(lines + legend(LEFT + WIDTH - 205) + ["</svg>", ""]))


def block(first):
    """The recorded lines from one on, up to the end of their paragraph, as a block of a page."""
    lines = (RESULTS / "laws.txt").read_text().split("\n")
    start = next(k for k, line in enumerate(lines) if line.startswith(first))
    return "".join(f"    {line.rstrip()}\n" for line in "\n".join(lines[start:]).split("\n\n")[0].strip("\n").split("\n"))


def write_page():
    page = (ROOT / "docs/contact_laws.md").read_text()
    for first in ("law ", "a/b, spin"):
        page = re.sub(rf"^    {re.escape(first.strip())}\b.*\n(?:    .*\n)*", lambda _: block(first), page, flags=re.M)
    (ROOT / "docs/contact_laws.md").write_text(page)


draw()
write_page()
