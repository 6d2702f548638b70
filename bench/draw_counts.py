#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/counts.svg, the operations of bench/results/opcounts.csv over N as Fig. 5 of Fisette and Samin 1996, on
logarithmic axes, and puts the counts of bench/results/opcounts.txt and robotran.txt into docs/counts.md.

    python3 bench/draw_counts.py
"""
import csv
import math
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[1]
RESULTS = ROOT / "bench/results"

WIDTH, HEIGHT, LEFT, TOP, BOTTOM, GAP = 480, 520, 70, 60, 60, 40
X, Y = (1, 100), (10, 4e6)
PAPER = {"linear": 12, "binary": 31}
CURVES = [  # title, colour, dashes, columns that are added up, of which tree alone
    ("classical + dense solve", "#7f8c8d", "", ("classical", "dense solve"), None),
    ("ner + dense solve", "#c0392b", "6 4", ("ner", "dense solve"), "binary"),
    ("ner + sparse solve", "#c0392b", "", ("ner", "sparse solve"), None),
    ("composite + sparse solve", "#b9770e", "", ("composite", "sparse solve"), None),
    ("O(N), 6 x 6", "#2471a3", "", ("O(N) 6x6",), None),
    ("O(N)", "#117a65", "", ("O(N)",), None),
    ("generated: composite + sparse solve", "#b9770e", "2 3", ("generated composite", "sparse solve"), None),
    ("generated: O(N)", "#117a65", "2 3", ("generated O(N)",), None),
]


def place(left, n, count):
    x = left + WIDTH * (math.log(n) - math.log(X[0])) / (math.log(X[1]) - math.log(X[0]))
    y = TOP + HEIGHT * (1 - (math.log(count) - math.log(Y[0])) / (math.log(Y[1]) - math.log(Y[0])))
    return x, y


def text(x, y, words, anchor="middle", colour="#222222", size=14, more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}" font-size="{size}"{more}>{words}</text>'


def grid(left):
    lines = []
    for n in [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100]:
        x, y = place(left, n, Y[0])
        lines.append(f'<path d="M{x:.1f} {y:.1f}V{TOP}" stroke="#dddddd"/>')
        if n in (1, 2, 5, 10, 20, 50, 100):
            lines.append(text(x, y + 20, str(n)))
    for power in range(1, 7):
        for digit in range(1, 10):
            if 10**power * digit <= Y[1]:
                x, y = place(left, X[0], 10**power * digit)
                colour = "#bbbbbb" if digit == 1 else "#eeeeee"
                lines.append(f'<path d="M{left} {y:.1f}h{WIDTH}" stroke="{colour}"/>')
        lines.append(text(left - 8, place(left, 1, 10**power)[1] + 5, f"10<tspan dy='-6' font-size='10'>{power}</tspan>", "end"))
    lines.append(f'<rect x="{left}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#222222"/>')
    return lines


def values(rows, columns):
    """(N, operations) where all columns are known."""
    return {int(r["N"]): sum(int(r[c]) for c in columns) for r in rows if all(r[c] for c in columns)}


def break_even(matrix, order_n):
    """The N from which the second takes fewer for good; None when it does not."""
    worse = [n for n in matrix if order_n[n] >= matrix[n]]
    star = max(worse, default=0) + 1
    return star if star in matrix else None


def star(left, rows, matrix, order_n, colour, above):
    a, b = values(rows, matrix), values(rows, order_n)
    n = break_even(a, b)
    if n is None:
        return []
    x, y = place(left, n, b[n])
    return [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="white" stroke="{colour}" stroke-width="2"/>',
            text(x + (-6 if above else 6), y + (-12 if above else 22), f"N* = {n}", "end" if above else "start", colour, 13,
                 ' font-weight="bold" paint-order="stroke" stroke="white" stroke-width="4"')]


def panel(left, tree, rows):
    lines = [text(left + WIDTH / 2, TOP - 36, f"{tree} tree", size=18)] + grid(left)
    x, y = place(left, PAPER[tree], Y[0])
    lines += [f'<path d="M{x:.1f} {y:.1f}V{TOP}" stroke="#7d3c98" stroke-dasharray="8 5"/>',
              text(x, TOP - 8, f"N* of the paper: {PAPER[tree]}", colour="#7d3c98", size=13)]
    for title, colour, dashes, columns, only in CURVES:
        if only in (None, tree):
            points = " ".join("%.1f,%.1f" % place(left, n, v) for n, v in sorted(values(rows, columns).items()) if v >= Y[0])
            lines.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2" stroke-linejoin="round" '
                         f'stroke-dasharray="{dashes}"/>')
    lines += star(left, rows, ("ner", "sparse solve"), ("O(N) 6x6",), "#2471a3", True)
    lines += star(left, rows, ("generated composite", "sparse solve"), ("generated O(N)",), "#117a65", False)
    lines.append(text(left + WIDTH / 2, TOP + HEIGHT + 42, "N"))
    return lines


def legend(left):
    lines = []
    for k, (title, colour, dashes, _, only) in enumerate(CURVES):
        y = TOP + 22 + 20 * k
        lines.append(f'<path d="M{left + 14} {y}h34" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>')
        lines.append(text(left + 56, y + 5, title + (f" ({only} tree)" if only else ""), "start", size=13))
    return [f'<rect x="{left + 6}" y="{TOP + 6}" width="304" height="{20 * len(CURVES) + 10}" fill="white" '
            f'fill-opacity="0.9" stroke="#bbbbbb"/>'] + lines


def draw():
    with open(RESULTS / "opcounts.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    second = LEFT + WIDTH + GAP + 40
    width, height = second + WIDTH + 20, TOP + HEIGHT + BOTTOM
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
             f'font-family="sans-serif">', f'<rect width="{width}" height="{height}" fill="white"/>',
             text(20, TOP + HEIGHT / 2, "operations + - * /", more=f' transform="rotate(-90 20 {TOP + HEIGHT / 2})"')]
    for left, tree in ((LEFT, "linear"), (second, "binary")):
        lines += panel(left, tree, [r for r in rows if r["tree"] == tree])
    (ROOT / "docs/counts.svg").write_text("\n".join(lines + legend(second) + ["</svg>", ""]))


def block(name, first):
    """The recorded lines from one on, up to the end of their paragraph, as a block of a page."""
    lines = (RESULTS / name).read_text().split("\n")
    start = next(k for k, line in enumerate(lines) if line.startswith(first))
    return "".join(f"    {line}\n" for line in "\n".join(lines[start:]).split("\n\n")[0].strip("\n").split("\n"))


def models():
    rows = re.findall(r"^(\w+)\n  M_C +(\d+) .*?\| +(\d+) .*?\| +([\d.]+)\n  M_C, scheme ner +(\d+) ",
                      (RESULTS / "robotran.txt").read_text(), re.M)
    return "".join(f"| {name} | {robotran} | {ner} | {own} | {ratio} |\n" for name, own, robotran, ratio, ner in rows)


def write_page():
    page = (ROOT / "docs/counts.md").read_text()
    for name, first in (("opcounts.txt", "N*, from which"), ("robotran.txt", "geometric means")):
        page = re.sub(rf"^    {re.escape(first)}.*\n(?:    .*\n)*", lambda _: block(name, first), page, flags=re.M)
    page = re.sub(r"(?<=\|--:\|\n)(?:\|.*\n)+", lambda _: models(), page)
    (ROOT / "docs/counts.md").write_text(page)


draw()
write_page()
