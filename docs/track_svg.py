#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/model/figures/track.svg: what the coordinates of profiles and tracks mean, and a course.

    python3 docs/model/figures/track.svg.py > docs/model/figures/track.svg
"""
import math
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[1]
GAUGE, DEPTH, SLOPE = 1.435, 0.014, 1 / 40
COURSE = [("straight", 40, 0), ("transition", 25, 0), ("left", 45, 1 / 50), ("transition", 25, 0), ("straight", 10, 0),
          ("transition", 20, 0), ("right", 25, -1 / 40), ("transition", 20, 0), ("straight", 20, 0)]
COLOURS = {"straight": "#333", "transition": "#c70", "left": "#06c", "right": "#a0a"}


def profile(name):
    lines = (ROOT / "examples/profiles" / name).read_text().split("\n")
    rows = [line for line in lines if line and not line.startswith("#")]
    return [tuple(map(float, row.split(","))) for row in rows[1:]]


def crossing(points, level):
    """The inner place at a height: y ascends."""
    top = max(range(len(points)), key=lambda k: points[k][1])
    for k in range(top, 0, -1):
        (a, za), (b, zb) = points[k - 1], points[k]
        if za <= level:
            return a + (b - a) * (level - za) / (zb - za)
    raise ValueError(level)


def rail():
    """The right rail in its track, and where its profile begins there."""
    c, s = 1 / math.hypot(1, SLOPE), SLOPE / math.hypot(1, SLOPE)
    turned = [(c * y - s * z, s * y + c * z) for y, z in profile("uic60.csv")]
    height = max(z for _, z in turned)
    at = GAUGE / 2 - crossing(turned, height - DEPTH)
    return [(y + at, z - height) for y, z in turned], at, -height


def path(points, **style):
    words = " ".join(f'{key.replace("_", "-")}="{value}"' for key, value in style.items())
    return f'<path d="M{" L".join(f"{x:.2f},{y:.2f}" for x, y in points)}" fill="none" {words}/>'


def text(x, y, words, anchor="start", colour="#333"):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{words}</text>'


def arrow(x, y, dx, dy, words):
    end = f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{x + dx:.1f}" y2="{y + dy:.1f}" stroke="#333" marker-end="url(#tip)"/>'
    return end + text(x + 1.25 * dx, y + 1.25 * dy + 4, words, "middle")


def cross_section():
    """Both rails from behind, left on the left, with a wheel on the right one."""
    points, at, _ = rail()
    out, scale, x0, y0 = [], 330.0, 380.0, 130.0
    for sign in (-1, 1):
        out.append(path([(x0 + sign * scale * y, y0 - scale * z) for y, z in points], stroke="#333", stroke_width=1.5))
        face = x0 + sign * scale * GAUGE / 2
        out.append(path([(face, y0 + scale * DEPTH), (face, y0 + 50)], stroke="#999"))
    wheel = [(y + at - 0.0003, z) for y, z in profile("s1002.csv")]
    out.append(path([(x0 + scale * y, y0 - scale * z) for y, z in wheel], stroke="#06c", stroke_width=1.5))
    left, right = x0 - scale * GAUGE / 2, x0 + scale * GAUGE / 2
    out.append(f'<line x1="{left + 2:.1f}" y1="{y0 + 46}" x2="{right - 2:.1f}" y2="{y0 + 46}" stroke="#333" '
               'marker-start="url(#tip)" marker-end="url(#tip)"/>')
    out.append(text(x0, y0 + 41, "gauge, at gauge_depth below the top", "middle"))
    out.append(path([(60, y0), (700, y0)], stroke="#bbb", stroke_dasharray="4 3"))
    out += [arrow(x0, y0, 0, -42, "z"), arrow(x0, y0, -50, 0, "y"), text(x0 + 6, y0 - 6, "x away from here")]
    out += [text(left - 20, 24, "left rail", "middle"), text(right + 10, 24, "right rail, wheel", "middle")]
    return out


def detail():
    """The right rail and its wheel, and the coordinates of both profiles."""
    points, at, up = rail()
    scale, x0, y0 = 2200.0, 230.0, 330.0
    place = lambda y, z: (x0 + scale * (y - at), y0 - scale * z)
    out = [path([place(*p) for p in points], stroke="#333", stroke_width=1.5),
           path([place(y + at - 0.0003, z) for y, z in profile("s1002.csv")], stroke="#06c", stroke_width=1.5)]
    x, y = place(at, up)
    out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="#333"/>', arrow(x, y + 44, 42, 0, "y"),
            arrow(x, y + 44, 0, -26, ""), text(x - 8, y + 32, "z", "end"),
            text(x + 50, y + 62, "of the rail's profile, upright: y outwards", "middle")]
    x, y = place(at - 0.0003, 0.028)
    out += [arrow(x, y, 46, 0, "y"), arrow(x, y, 0, -24, "z"), text(x, y + 16, "of the wheel's profile: radius less z", "middle", "#06c")]
    out.append(text(place(at - 0.055, -0.026)[0], place(0, -0.026)[1] + 22, "flange: y, z negative", "middle", "#06c"))
    return out


def line():
    """Pieces of the course, each a list of places; curvature by the middle of small steps."""
    x = y = heading = 0.0
    pieces = []
    for k, (kind, length, bend) in enumerate(COURSE):
        first = COURSE[k - 1][2] if kind == "transition" and k else bend
        last = COURSE[k + 1][2] if kind == "transition" and k + 1 < len(COURSE) else bend
        n, places = 200, [(x, y)]
        for i in range(n):
            step, middle = length / n, first + (last - first) * (i + 0.5) / n
            heading += middle * step / 2
            x, y = x + step * math.cos(heading), y + step * math.sin(heading)
            heading += middle * step / 2
            places.append((x, y))
        pieces.append((kind, places))
    return pieces


def course():
    scale, x0, y0, out = 1.75, 430.0, 440.0, []
    for kind, places in line():
        shown = [(x0 + scale * x, y0 - scale * y) for x, y in places]
        out.append(path(shown[::8], stroke=COLOURS[kind], stroke_width=3))
    for k, (kind, colour) in enumerate(COLOURS.items()):
        out.append(text(680, 400 + 16 * k, kind, colour=colour))
    return out


def main():
    print('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 760 500" font-family="sans-serif" font-size="12">')
    print('<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto-start-reverse">'
          '<path d="M0,0 L8,4 L0,8 z" fill="#333"/></marker></defs>')
    print("\n".join(cross_section() + detail() + course()))
    print("</svg>")


if __name__ == "__main__":
    main()
