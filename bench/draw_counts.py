#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/counts.svg, the operations of bench/results/opcounts.csv over N as Fig. 5 of Fisette and Samin 1996, on
logarithmic axes, and docs/loop_counts.svg, likewise those of mechanisms with loops of loop_counts.csv. Puts the counts of
bench/results/opcounts.txt, loop_counts.txt and robotran.txt into docs/counts.md.

    python3 bench/draw_counts.py
"""
import csv
import math
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "examples"))
from panels import BLUE, BROWN, RED, TEAL, VIOLET  # noqa: E402

RESULTS = ROOT / "bench/results"

LEFT, TOP, BOTTOM, GAP = 70, 60, 60, 40
PAPER = {"linear": 12, "binary": 31}
CURVES = [  # title, colour, dashes, columns that are added up, of which tree alone
    ("classical + dense solve", "#7f8c8d", "", ("classical", "dense solve"), None),
    ("ner + dense solve", RED, "6 4", ("ner", "dense solve"), "binary"),
    ("ner + sparse solve", RED, "", ("ner", "sparse solve"), None),
    ("composite + sparse solve", BROWN, "", ("composite", "sparse solve"), None),
    ("O(N), 6 x 6", BLUE, "", ("O(N) 6x6",), None),
    ("O(N)", TEAL, "", ("O(N)",), None),
    ("generated: composite + sparse solve", BROWN, "2 3", ("generated composite", "sparse solve"), None),
    ("generated: O(N)", TEAL, "2 3", ("generated O(N)",), None),
]


LOOPS = [  # algorithm, title, colour
    ("ner", "M by ner", RED),
    ("composite", "M by composite bodies", BROWN),
    ("products", "products with M", BLUE),
    ("articulated", "articulated bodies: O(N)", TEAL),
]
STARS = [("composite", "products", BLUE), ("composite", "articulated", TEAL)]
FAMILIES = {"chain": "chain, no loop", "scissors": "lift of N scissor cells", "windows": "N windows", "legs": "N four-bars in a row",
            "trams": "tram of N cars"}


class Panel:
    """Logarithmic axes: x from 1 to `most`, y over a range."""

    def __init__(self, left, top, width, height, most, y):
        self.left, self.top, self.width, self.height, self.most, self.y = left, top, width, height, most, y

    def place(self, n, count):
        x = self.left + self.width * math.log(n) / math.log(self.most)
        y = self.top + self.height * (1 - (math.log(count) - math.log(self.y[0])) / (math.log(self.y[1]) - math.log(self.y[0])))
        return x, y

    def grid(self):
        lines = []
        for n in [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100]:
            if n <= self.most:
                x, y = self.place(n, self.y[0])
                lines.append(f'<path d="M{x:.1f} {y:.1f}V{self.top}" stroke="#dddddd"/>')
                if n in (1, 2, 5, 10, 20, 50, 100):
                    lines.append(text(x, y + 20, str(n)))
        for power in range(1, 8):
            for digit in range(1, 10):
                if 10**power * digit <= self.y[1]:
                    x, y = self.place(1, 10**power * digit)
                    colour = "#bbbbbb" if digit == 1 else "#eeeeee"
                    lines.append(f'<path d="M{self.left} {y:.1f}h{self.width}" stroke="{colour}"/>')
            if 10**power <= self.y[1]:
                lines.append(text(self.left - 8, self.place(1, 10**power)[1] + 5, f"10<tspan dy='-6' font-size='10'>{power}</tspan>", "end"))
        lines.append(f'<rect x="{self.left}" y="{self.top}" width="{self.width}" height="{self.height}" fill="none" stroke="#222222"/>')
        return lines

    def curve(self, points, colour, dashes=""):
        line = " ".join("%.1f,%.1f" % self.place(n, v) for n, v in sorted(points.items()) if v >= self.y[0])
        return (f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2" stroke-linejoin="round" '
                f'stroke-dasharray="{dashes}"/>')

    def star(self, matrix, order_n, colour, above):
        """The break-even N*; nothing where there is none."""
        n = break_even(matrix, order_n)
        if n is None:
            return []
        x, y = self.place(n, order_n[n])
        return [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="white" stroke="{colour}" stroke-width="2"/>',
                text(x + (-6 if above else 6), y + (-12 if above else 22), f"N* = {n}", "end" if above else "start", colour, 13,
                     ' font-weight="bold" paint-order="stroke" stroke="white" stroke-width="4"')]


def text(x, y, words, anchor="middle", colour="#222222", size=14, more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}" font-size="{size}"{more}>{words}</text>'


def values(rows, columns):
    """(N, operations) where all columns are known."""
    return {int(r["N"]): sum(int(r[c]) for c in columns) for r in rows if all(r[c] for c in columns)}


def break_even(matrix, order_n):
    """The N from which the second takes fewer for good; None when it does not."""
    both = matrix.keys() & order_n.keys()
    worse = [n for n in both if order_n[n] >= matrix[n]]
    return min((n for n in both if n > max(worse, default=0)), default=None)


def draw_tree(left, tree, rows):
    panel = Panel(left, TOP, 480, 520, 100, (10, 4e6))
    lines = [text(left + panel.width / 2, TOP - 36, f"{tree} tree", size=18)] + panel.grid()
    x, y = panel.place(PAPER[tree], panel.y[0])
    lines += [f'<path d="M{x:.1f} {y:.1f}V{TOP}" stroke="{VIOLET}" stroke-dasharray="8 5"/>',
              text(x, TOP - 8, f"N* of the paper: {PAPER[tree]}", colour=VIOLET, size=13)]
    for title, colour, dashes, columns, only in CURVES:
        if only in (None, tree):
            lines.append(panel.curve(values(rows, columns), colour, dashes))
    lines += panel.star(values(rows, ("ner", "sparse solve")), values(rows, ("O(N) 6x6",)), BLUE, True)
    lines += panel.star(values(rows, ("generated composite", "sparse solve")), values(rows, ("generated O(N)",)), TEAL, False)
    return lines + [text(left + panel.width / 2, TOP + panel.height + 42, "N")]


def legend(left, top, titles):
    """titles: (words, colour, dashes)"""
    lines = []
    for k, (title, colour, dashes) in enumerate(titles):
        y = top + 16 + 20 * k
        lines.append(f'<path d="M{left + 8} {y}h34" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>')
        lines.append(text(left + 50, y + 5, title, "start", size=13))
    return [f'<rect x="{left}" y="{top}" width="304" height="{20 * len(titles) + 10}" fill="white" '
            f'fill-opacity="0.9" stroke="#bbbbbb"/>'] + lines


def recorded(name):
    with open(RESULTS / name, newline="") as file:
        return list(csv.DictReader(file))


def write_picture(name, width, height, lines):
    head = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
            f'font-family="sans-serif">', f'<rect width="{width}" height="{height}" fill="white"/>']
    (ROOT / "docs" / name).write_text("\n".join(head + lines + ["</svg>", ""]))


def draw_trees():
    rows = recorded("opcounts.csv")
    second, middle = LEFT + 480 + GAP + 40, TOP + 520 / 2
    lines = [text(20, middle, "operations + - * /", more=f' transform="rotate(-90 20 {middle})"')]
    for left, tree in ((LEFT, "linear"), (second, "binary")):
        lines += draw_tree(left, tree, [r for r in rows if r["tree"] == tree])
    titles = [(title + (f" ({only} tree)" if only else ""), colour, dashes) for title, colour, dashes, _, only in CURVES]
    write_picture("counts.svg", second + 480 + 20, TOP + 520 + BOTTOM, lines + legend(second + 6, TOP + 6, titles))


def draw_loops():
    rows, across, width, height = recorded("loop_counts.csv"), 3, 300, 330
    lines = []
    for k, (family, title) in enumerate(FAMILIES.items()):
        own = [r for r in rows if r["family"] == family]
        panel = Panel(LEFT + k % across * (width + 60), TOP + k // across * (height + 110), width, height, int(own[-1]["N"]), (10, 3e7))
        counts = {a: values(own, (a,)) for a, _, _ in LOOPS}
        lines += [text(panel.left + width / 2, panel.top - 14, title, size=16)] + panel.grid()
        lines += [panel.curve(counts[a], colour) for a, _, colour in LOOPS if counts[a]]
        for a, b, colour in STARS:
            if counts[b]:
                lines += panel.star(counts[a], counts[b], colour, b == "products")
        lines.append(text(panel.left + width / 2, panel.top + height + 42, "N"))
    middle = TOP + height / 2
    lines.append(text(20, middle, "operations + - * /", more=f' transform="rotate(-90 20 {middle})"'))
    place = LEFT + 2 * (width + 60), TOP + height + 110
    lines += legend(*place, [(title, colour, "") for _, title, colour in LOOPS])
    lines.append(text(place[0], place[1] + 120, "N*: from here on fewer operations than with M", "start", size=13))
    write_picture("loop_counts.svg", LEFT + across * (width + 60), TOP + 2 * height + 110 + BOTTOM, lines)


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
    for name, first in (("opcounts.txt", "N*, from which"), ("loop_counts.txt", "N*: from this size"), ("robotran.txt", "geometric means")):
        page = re.sub(rf"^    {re.escape(first)}.*\n(?:    .*\n)*", lambda _: block(name, first), page, flags=re.M)
    page = re.sub(r"(?<=\|--:\|\n)(?:\|.*\n)+", lambda _: models(), page)
    (ROOT / "docs/counts.md").write_text(page)


draw_trees()
draw_loops()
write_page()
