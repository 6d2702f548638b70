# SPDX-License-Identifier: BSD-3-Clause
"""Curves over time, way or speed as SVG, for scripts draw_NAME.py of examples: panels below each other, on one axis."""
import csv
import pathlib
import re

# The colours of bodies and curves, in their order: those of pages and plots.
COLOURS = re.findall(r'KMP_PLOT_COLOUR\("(#\w{6})"', (pathlib.Path(__file__).resolve().parents[1] / "src/output/plot_colours.def").read_text())
BLUE, RED, GREEN, BROWN, VIOLET, TEAL, PLUM, OLIVE = COLOURS[:8]


def rows(path):
    """Numbers of a table; lines that begin with # are no part of it, and fields may be empty."""
    with open(path, newline="") as file:
        return [{key: float(x) for key, x in row.items() if x} for row in csv.DictReader(line for line in file if line[0] != "#")]


class Panel:
    """Curves over `span`, drawn from `left`, `top` on, so `wide` and `high`; what is beyond the ticks is drawn on the border."""

    def __init__(self, left, top, wide, high, span, ticks):
        self.left, self.top, self.wide, self.high, self.span, self.low, self.high_tick = left, top, wide, high, span, ticks[0], ticks[-1]
        self.ticks, self.lines = ticks, []

    def x(self, s):
        return self.left + (s - self.span[0]) / (self.span[1] - self.span[0]) * self.wide

    def y(self, v):
        return self.top + self.high * (self.high_tick - min(max(v, self.low), self.high_tick)) / (self.high_tick - self.low)

    def frame(self, title):
        self.lines.append(f'<text x="{self.left}" y="{self.top - 8}" font-weight="bold">{title}</text>')
        for v in self.ticks:
            self.lines.append(f'<path d="M{self.left},{self.y(v):.1f}h{self.wide}" stroke="#999" stroke-width="0.5"/>'
                              f'<text x="{self.left - 6}" y="{self.y(v) + 4:.1f}" text-anchor="end">{v:g}</text>')

    def level(self, v, colour):
        """Dashed, across."""
        self.lines.append(f'<path d="M{self.left},{self.y(v):.1f}h{self.wide}" stroke="{colour}" stroke-dasharray="4 3"/>')

    def mark(self, s):
        """Dashed, up."""
        self.lines.append(f'<path d="M{self.x(s):.1f},{self.top}v{self.high}" stroke="#999" stroke-dasharray="3 3"/>')

    def curve(self, points, colour, name, down, thick=1.6, beside=8):
        """Its name, in lines between |, stands `beside` the panel and so far down."""
        way = "L".join(f"{self.x(s):.1f},{self.y(v):.1f}" for s, v in points)
        self.lines.append(f'<path d="M{way}" fill="none" stroke="{colour}" stroke-width="{thick}"/>')
        for line, words in enumerate(name.split("|")):
            self.lines.append(f'<text x="{self.left + self.wide + beside}" y="{self.top + down + 14 * line}" fill="{colour}">{words}</text>')

    def axis(self, at, name, beside):
        """Below the panel."""
        for s in at:
            self.lines.append(f'<text x="{self.x(s):.1f}" y="{self.top + self.high + 16}" text-anchor="middle">{s:g}</text>')
        self.lines.append(f'<text x="{self.left + self.wide + beside}" y="{self.top + self.high + 16}">{name}</text>')


def page(wide, high, panels, before=()):
    """Panels, and lines before them."""
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high}" font-family="sans-serif" font-size="12">'
          '<rect width="100%" height="100%" fill="#fff"/>')
    print("\n".join([*before, *(line for panel in panels for line in panel.lines)]) + "\n</svg>")
