#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws contact_frame.svg, singular.svg and the figures of docs/model: frames, cuts, joints, closures.

    python3 docs/figures.py            writes the figures
    python3 docs/figures.py --check    fails when a figure differs
"""
import math
import pathlib
import sys

import generated

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "examples"))
from panels import BLUE, BROWN, GREEN, RED  # noqa: E402

DOCS = pathlib.Path(__file__).parent
GREY, INK, PALE = "#9aa5b1", "#2c3e50", "#b3bcc6"
LIGHT = (-0.35, -0.55, 0.75)


# -- vectors -------------------------------------------------------------------------------------------

def add(*vectors):
    return tuple(sum(parts) for parts in zip(*vectors))


def scaled(k, v):
    return tuple(k * x for x in v)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(v):
    return scaled(1 / math.sqrt(dot(v, v)), v)


def rotation(axis, degrees):
    """Columns of the rotation about a unit vector (Rodrigues)."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = lambda v: add(scaled(c, v), scaled(s, cross(axis, v)), scaled((1 - c) * dot(axis, v), axis))
    return [turn(e) for e in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]


class Frame:
    """An origin and three axes; b, c, a of the text are x, y, z here, so that a points up."""

    def __init__(self, origin=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0), (0, 0, 1))):
        self.origin, self.axes = origin, axes

    def at(self, x, y, z):
        return add(self.origin, self.to(x, y, z))

    def to(self, x, y, z):
        return add(*(scaled(k, axis) for k, axis in zip((x, y, z), self.axes)))

    def moved(self, x, y, z):
        return Frame(self.at(x, y, z), self.axes)

    def turned(self, k, degrees):
        """Rotated about its own axis k."""
        columns = rotation(tuple(1.0 if j == k else 0.0 for j in range(3)), degrees)
        return Frame(self.origin, [self.to(*column) for column in columns])


# -- drawing -------------------------------------------------------------------------------------------

def shade(colour, normal):
    """A face's colour by the light on it."""
    light = 0.72 + 0.28 * dot(unit(normal), unit(LIGHT))
    parts = [int(colour[k:k + 2], 16) for k in (1, 3, 5)]
    return "#" + "".join(f"{max(0, min(255, round(255 - (255 - p * (0.55 + 0.45 * light)) * (0.55 + 0.3 * (1 - light) + 0.15)))):02x}" for p in parts)


def text(x, y, words, colour=INK, anchor="middle", size=14, style="", more=""):
    """Words with a white rim; `_k` becomes an index."""
    parts, shown = words.split("_"), ""
    for k, part in enumerate(parts):
        index = part[:1] if k else ""
        shown += (f'<tspan dy="4" font-size="{size * 0.75:.0f}">{index}</tspan><tspan dy="-4">{part[1:]}</tspan>' if index else part)
    return (f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}" font-size="{size}" {style} stroke="white" stroke-width="3" '
            f'paint-order="stroke" {more}>{shown}</text>')


ITALIC, BOLD = 'font-style="italic"', 'font-weight="bold"'


def polyline(points, colour, width=1.5, more=""):
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round" {more}/>'


def polygon(points, fill, stroke, width=0.8, more=""):
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polygon points="{path}" fill="{fill}" stroke="{stroke}" stroke-width="{width}" stroke-linejoin="round" {more}/>'


def tip(a, b, colour, size=8):
    """The head of an arrow that ends at b, coming from a."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = math.hypot(dx, dy) or 1
    dx, dy = dx / length, dy / length
    left, right = [(b[0] - size * dx + k * 0.42 * size * -dy, b[1] - size * dy + k * 0.42 * size * dx) for k in (1, -1)]
    return polygon([b, left, right], colour, colour, 0.5)


def arrow(a, b, colour, width=1.5, both=False, more=""):
    length = math.hypot(b[0] - a[0], b[1] - a[1]) or 1
    short = lambda p, q: (q[0] - (q[0] - p[0]) * 5 / length, q[1] - (q[1] - p[1]) * 5 / length)
    return polyline([short(b, a) if both else a, short(a, b)], colour, width, more) + tip(a, b, colour) + (tip(b, a, colour) if both else "")


def document(title, width, height, shapes):
    head = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
            f'font-family="sans-serif" font-size="14">\n<title>{title}</title>\n<rect width="{width}" height="{height}" fill="white"/>')
    return "\n".join([head, *shapes]) + "\n</svg>\n"


class View:
    """A parallel projection: shapes in space, drawn from far to near."""

    def __init__(self, x, y, scale, azimuth=-58, elevation=24):
        az, el = math.radians(azimuth), math.radians(elevation)
        self.right = (-math.sin(az), math.cos(az), 0)
        self.up = (-math.sin(el) * math.cos(az), -math.sin(el) * math.sin(az), math.cos(el))
        self.near = (math.cos(el) * math.cos(az), math.cos(el) * math.sin(az), math.sin(el))
        self.x, self.y, self.scale, self.shapes, self.front = x, y, scale, [], []

    def place(self, p):
        return (self.x + self.scale * dot(p, self.right), self.y - self.scale * dot(p, self.up))

    def depth(self, points):
        return sum(dot(p, self.near) for p in points) / len(points)

    def put(self, points, drawn, lift=0.0):
        self.shapes.append((self.depth(points) + lift, drawn))

    def face(self, points, colour, stroke=None):
        normal = cross(add(points[1], scaled(-1, points[0])), add(points[2], scaled(-1, points[1])))
        if dot(normal, self.near) > 1e-9:
            fill = shade(colour, normal)
            self.put(points, polygon([self.place(p) for p in points], fill, stroke or fill))

    def prism(self, base, top, colour, edges=True):
        """Two equal polygons, anticlockwise as seen from the top, and the sides between them."""
        dark = shade(colour, (0, 0, -2.2))
        self.face(top, colour, dark)
        self.face(base[::-1], colour, dark)
        for k in range(len(base)):
            j = (k + 1) % len(base)
            self.face([base[k], base[j], top[j], top[k]], colour, dark if edges else None)

    def box(self, frame, low, high, colour):
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        self.prism([frame.at(x, y, low[2]) for x, y in corners], [frame.at(x, y, high[2]) for x, y in corners], colour)

    def cylinder(self, frame, radius, low, high, colour, axis=2):
        order = {2: lambda u, v, w: (u, v, w), 0: lambda u, v, w: (w, u, v), 1: lambda u, v, w: (v, w, u)}[axis]
        ring = [(radius * math.cos(k * math.pi / 14), radius * math.sin(k * math.pi / 14)) for k in range(28)]
        pieces = max(1, round((high - low) / 0.22))
        for n in range(pieces):  # short pieces, so that the order by depth is right
            a, b = (low + (high - low) * k / pieces for k in (n, n + 1))
            base, top = ([frame.at(*order(u, v, w)) for u, v in ring] for w in (a, b))
            dark = shade(colour, (0, 0, -2.2))
            if n == 0:
                self.face(base[::-1], colour, dark)
            if n == pieces - 1:
                self.face(top, colour, dark)
            for k in range(28):
                j = (k + 1) % 28
                self.face([base[k], base[j], top[j], top[k]], colour)

    def ghost(self, frame, low, high):
        """The dashed edges of a box at q = 0."""
        corner = lambda i: frame.at(*(high[k] if i >> k & 1 else low[k] for k in range(3)))
        for i in range(8):
            for k in range(3):
                if not i >> k & 1:
                    ends = [corner(i), corner(i | 1 << k)]
                    self.put(ends, polyline([self.place(p) for p in ends], "#7f8c99", 1, 'stroke-dasharray="4 3"'), -0.3)

    def axis(self, a, b, colour=INK, label="", width=1.6, away=13, shift=(0, 0)):
        """An arrow in space, hidden by what is before it."""
        steps = 14
        points = [add(scaled(1 - k / steps, a), scaled(k / steps, b)) for k in range(steps + 1)]
        for p, q in zip(points, points[1:-1]):
            self.put([p, q], polyline([self.place(p), self.place(q)], colour, width))
        start, end = self.place(points[-3]), self.place(b)
        self.put([b], polyline([start, self.place(points[-2])], colour, width) + tip(start, end, colour), 0.02)
        if label:
            x, y = self.place(a)
            length = math.hypot(end[0] - x, end[1] - y) or 1
            self.front.append(text(end[0] + away * (end[0] - x) / length + shift[0], end[1] + away * (end[1] - y) / length + 5 + shift[1], label,
                                   colour, style=ITALIC, size=15))

    def frame(self, frame, size, names, colour=INK, shifts=((0, 0),) * 3):
        """Axes that nothing hides."""
        start = self.place(frame.origin)
        for k in range(3):
            end = self.place(frame.at(*(size if j == k else 0 for j in range(3))))
            length = math.hypot(end[0] - start[0], end[1] - start[1])
            self.front.append(arrow(start, end, colour, 1.6))
            self.front.append(text(end[0] + 12 * (end[0] - start[0]) / length + shifts[k][0], end[1] + 12 * (end[1] - start[1]) / length + 5 + shifts[k][1],
                                   names[k], colour, style=ITALIC, size=15))

    def arc(self, frame, radius, begin, end, label, k=2, height=0.0, shift=(0, 0), colour=RED):
        """A rotation about axis k of a frame, from one angle to another (degrees, from the next axis)."""
        def at(angle):
            u, v = radius * math.cos(math.radians(angle)), radius * math.sin(math.radians(angle))
            return frame.at(*{2: (u, v, height), 0: (height, u, v), 1: (v, height, u)}[k])
        points = [self.place(at(begin + (end - begin) * j / 24)) for j in range(25)]
        self.front.append(polyline(points[:-1], colour, 2) + tip(points[-3], points[-1], colour))
        x, y = points[13]
        if label:
            self.front.append(text(x + shift[0], y + shift[1], label, colour, style=ITALIC, size=15))

    def length(self, a, b, label, shift=(0, 0), colour=RED):
        p, q = self.place(a), self.place(b)
        self.front.append(arrow(p, q, colour, 2))
        if label:
            self.front.append(text((p[0] + q[0]) / 2 + shift[0], (p[1] + q[1]) / 2 + 5 + shift[1], label, colour, style=ITALIC, size=15))

    def drawn(self):
        return [shape for _, shape in sorted(self.shapes, key=lambda s: s[0])] + self.front


# -- joints --------------------------------------------------------------------------------------------

WORLD = Frame()


def named(v, size=1.3, names=("b", "c", "a"), shifts=((0, 0),) * 3):
    """The axes at `at`: those of a joint about the axis a, which points up."""
    sizes = size if isinstance(size, tuple) else (size,) * 3
    for k in range(3):
        end = tuple(sizes[k] if j == k else 0 for j in range(3))
        v.axis(WORLD.origin, end, INK, names[k], shift=shifts[k])


def hub(v, frame):
    """A sleeve with an arm along b."""
    v.box(frame, (0.2, -0.09, -0.07), (0.95, 0.09, 0.07), BLUE)
    v.cylinder(frame, 0.24, -0.2, 0.2, BLUE)


ARM = (0, -0.09, -0.07), (0.95, 0.09, 0.07)


def revolute(v):
    v.cylinder(WORLD, 0.42, -0.5, -0.24, GREY)
    v.cylinder(WORLD, 0.1, -0.24, 0.42, GREY)
    v.ghost(WORLD, *ARM)
    hub(v, WORLD.turned(2, 42))
    named(v)
    v.arc(WORLD, 1.07, 0, 42, "q", shift=(14, 6))


def prismatic(v):
    v.box(WORLD, (-0.13, -0.13, -0.75), (0.13, 0.13, 1.05), GREY)
    block = (-0.32, -0.32, -0.2), (0.32, 0.32, 0.2)
    v.ghost(WORLD, *block)
    v.box(WORLD.moved(0, 0, 0.62), *block, BLUE)
    named(v)
    v.length((-0.45, -0.32, 0), (-0.45, -0.32, 0.62), "q", (-12, 0))


def rod_and_sleeve(v):
    v.cylinder(WORLD, 0.1, -0.8, 1.05, GREY)
    v.ghost(WORLD, *ARM)
    hub(v, WORLD.moved(0, 0, 0.66).turned(2, 42))
    named(v, (1.3, 1.15, 1.3))
    v.length((0, -0.42, 0), (0, -0.42, 0.66), "q_1", (-16, 0))
    v.arc(WORLD.moved(0, 0, 0.66), 1.07, 0, 42, "q_2", shift=(17, 6))


def cylindrical(v):
    rod_and_sleeve(v)


def screw(v):
    points = []
    for k in range(9 * 24 + 1):
        angle = k * 2 * math.pi / 24
        points.append((0.115 * math.cos(angle), 0.115 * math.sin(angle), -0.78 + 1.8 * k / (9 * 24)))
    for p, q in zip(points, points[1:]):
        if dot((p[0], p[1], 0), v.near) > 0 and not 0.42 < p[2] < 0.9:
            v.put([p, q], polyline([v.place(p), v.place(q)], "#5d6d7e", 1.3), 0.05)
    rod_and_sleeve(v)


def yoke(v, frame, side, colour, sign):
    """A fork along c, which points up here, with lugs on the axis `side` (0: a, 1: b)."""
    def part(across, along):
        low, high = [-0.13, -0.13, 0], [0.13, 0.13, 0]
        low[side], high[side] = sorted(across)
        low[2], high[2] = sorted(sign * w for w in along)
        v.box(frame, low, high, colour)
    v.cylinder(frame, 0.13, *sorted((sign * 0.66, sign * 1.05)), colour)
    part((-0.55, 0.55), (0.5, 0.66))
    part((-0.55, -0.43), (-0.13, 0.5))
    part((0.43, 0.55), (-0.13, 0.5))


def universal(v):
    first = WORLD.turned(0, 12)
    body = first.turned(1, 22)
    yoke(v, WORLD, 0, GREY, -1)
    yoke(v, body, 1, BLUE, 1)
    v.cylinder(first, 0.06, -0.43, 0.43, "#d5dbdf", axis=0)
    v.cylinder(first, 0.06, -0.43, 0.43, "#d5dbdf", axis=1)
    named(v, (1.3, 1.35, 1.2), ("a", "b", "c"), ((0, 0), (0, 0), (-4, 0)))
    v.arc(WORLD, 0.22, -150, 120, "q_1", k=0, height=0.95, shift=(13, -4))
    v.arc(first, 0.22, -60, 210, "q_2", k=1, height=1.0, shift=(10, 24))


def spherical(v):
    v.cylinder(WORLD, 0.5, -0.75, -0.5, GREY)
    v.cylinder(WORLD, 0.2, -0.5, -0.2, GREY)
    body = WORLD.turned(2, 20).turned(0, 8).turned(1, -38)
    x, y = v.place((0, 0, 0))
    v.put([(0, 0, 0)], f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{0.3 * v.scale:.1f}" fill="url(#ball)" '
          f'stroke="{shade(BLUE, (0, 0, -2.2))}" stroke-width="0.8"/>', 0.25)
    v.cylinder(body, 0.1, 0.28, 1.0, BLUE)
    v.ghost(WORLD, (-0.1, -0.1, 0.28), (0.1, 0.1, 1.0))
    named(v, (1.4, 1.4, 1.3))
    v.arc(WORLD, 0.22, -60, 210, "q_1", height=1.12, shift=(28, 14))
    v.arc(WORLD, 0.22, -150, 120, "q_2", k=0, height=1.0, shift=(16, -6))
    v.arc(WORLD, 0.22, -60, 210, "q_3", k=1, height=0.95, shift=(21, 10))


def planar(v):
    v.box(WORLD, (-0.6, -0.6, -0.32), (1.2, 1.1, -0.12), GREY)
    block = (-0.3, -0.2, -0.12), (0.3, 0.2, 0.12)
    v.ghost(WORLD, *block)
    v.box(WORLD.moved(0.68, 0.55, 0).turned(2, 32), *block, BLUE)
    named(v, (1.5, 1.3, 0.85), shifts=((0, 4), (-19, 3), (0, 0)))
    v.axis((0.68, 0.55, 0.12), (0.68, 0.55, 0.85), "#5d6d7e", "", 1)
    v.length((0, -0.42, -0.12), (0.68, -0.42, -0.12), "q_1", (-2, 13))
    v.length((-0.45, 0, -0.12), (-0.45, 0.55, -0.12), "q_2", (-14, -4))
    v.arc(WORLD.moved(0.68, 0.55, 0), 0.24, -60, 210, "q_3", height=0.65, shift=(28, 12))


def free(v):
    block, place = ((-0.26, -0.2, -0.16), (0.26, 0.2, 0.16)), (0.8, 0.5, 0.72)
    v.ghost(WORLD, *block)
    v.box(WORLD.moved(*place).turned(2, 22).turned(0, 14).turned(1, 12), *block, BLUE)
    named(v, (1.2, 0.85, 0.85))
    v.length((0, 0, 0), (0.8, 0, 0), "q_2", (-4, 16))
    v.length((0.8, 0, 0), (0.8, 0.5, 0), "q_3", (-10, -9))
    v.length((0.8, 0.5, 0), place, "q_1", (14, 8))
    v.arc(Frame(place), 0.22, -60, 210, "q_4", height=0.46, shift=(-38, 4))
    v.arc(Frame(place), 0.22, -150, 120, "q_5", k=0, height=0.58, shift=(18, 14))
    v.arc(Frame(place), 0.22, -60, 210, "q_6", k=1, height=0.62, shift=(22, 0))


def weld(v):
    v.box(WORLD, (-0.75, -0.2, -0.2), (0, 0.2, 0.2), GREY)
    v.box(WORLD, (0, -0.2, -0.2), (0.75, 0.2, 0.2), BLUE)
    named(v, (1.3, 1.1, 1.0))


KINDS = (("revolute", "rotation about a", revolute), ("prismatic", "translation along a", prismatic),
         ("cylindrical", "translation, then rotation", cylindrical), ("screw", "translation and rotation, coupled", screw),
         ("universal", "rotations about a, then b", universal), ("spherical", "rotations about a, b, c", spherical),
         ("planar", "translations along b, c, rotation about a", planar), ("free", "translations, then rotations, a, b, c", free),
         ("weld", "no coordinate", weld))


PANEL = 290, 280
BALL = ('<defs><radialGradient id="ball" cx="0.38" cy="0.32" r="0.75"><stop offset="0" stop-color="#d6e9f7"/>'
        f'<stop offset="1" stop-color="{BLUE}"/></radialGradient></defs>')


def kind_panel(x, y, name, note, draw):
    """A joint or a closure in a panel with its name and a note."""
    v = View(x + 132, y + 183, 88, *((-38, 24) if name == "universal" else ()))
    draw(v)
    middle = x + PANEL[0] / 2
    return [text(middle, y + 26, name.replace("_", " "), INK, size=17, style=BOLD), text(middle, y + 45, note, "#5d6d7e", size=13), *v.drawn()]


def alone(name, note, draw):
    """One panel as a figure."""
    return lambda: document(f"{name.replace('_', ' ')}: {note}", *PANEL, [BALL, *kind_panel(0, 0, name, note, draw)])


def joints():
    """Three rows of three panels."""
    width, height = PANEL
    shapes = [BALL]
    for k, kind in enumerate(KINDS):
        shapes += kind_panel(width * (k % 3), height * (k // 3), *kind)
    for k in (1, 2):
        shapes.append(polyline([(20, height * k + 2), (3 * width - 20, height * k + 2)], "#e3e7eb", 1))
    return document("The kinds of joints, their coordinates and their zero positions", 3 * width, 3 * height, shapes)


# -- closures ------------------------------------------------------------------------------------------

def knob(v, point, name, shift, colour=BLUE):
    """A point of a body as a small ball with its name."""
    x, y = v.place(point)
    v.front += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5.5" fill="{colour}" stroke="white" stroke-width="1.2"/>',
                text(x + shift[0], y + shift[1], name, INK, style=BOLD)]


def stick(v, origin, turns, length=0.85):
    """A rod of the second body that ends at Q."""
    body = Frame(origin)
    for k, degrees in turns:
        body = body.turned(k, degrees)
    v.cylinder(body, 0.075, 0.08, length, BLUE)


def free_along(v, a, b):
    v.front.append(arrow(v.place(a), v.place(b), RED, 2, both=True))


def rod(v):
    p, q = (-0.75, -0.1, -0.35), (0.75, 0.1, 0.35)
    v.box(Frame(p), (-0.5, -0.3, -0.3), (-0.05, 0.3, 0.25), GREY)
    v.box(Frame(q), (0.05, -0.3, -0.25), (0.5, 0.3, 0.3), BLUE)
    v.put([p, q], polyline([v.place(p), v.place(q)], "#5d6d7e", 4), 0.5)
    knob(v, p, "P", (-2, 24), GREY)
    knob(v, q, "Q", (4, -14))
    v.front.append(text(v.x + 4, v.y - 16, "length", RED, style=ITALIC, size=15))


def point_on_line(v):
    v.cylinder(WORLD, 0.05, -0.6, 1.05, GREY)
    v.box(WORLD, (-0.45, -0.45, -0.75), (0.45, 0.45, -0.6), GREY)
    q = (0, 0, 0.5)
    stick(v, q, ((1, 70),))
    knob(v, (0, 0, -0.3), "P", (-17, 5), GREY)
    knob(v, q, "Q", (15, 24))
    v.axis((0, 0, 1.05), (0, 0, 1.35), INK, "axis")
    free_along(v, (-0.28, 0, 0.15), (-0.28, 0, 0.95))


def plate(v):
    v.box(WORLD, (-1.0, -0.8, -0.35), (1.1, 0.9, -0.2), GREY)


def point_on_plane(v):
    plate(v)
    q = (0.45, 0.35, -0.2)
    stick(v, q, ((1, 28), (0, -18)), 1.0)
    knob(v, (-0.45, -0.25, -0.2), "P", (-4, 21), GREY)
    knob(v, q, "Q", (2, 30))
    v.axis((-0.45, -0.25, -0.2), (-0.45, -0.25, 0.6), INK, "axis")
    free_along(v, (0.05, 0.35, -0.2), (0.95, 0.35, -0.2))
    free_along(v, (0.45, -0.15, -0.2), (0.45, 0.85, -0.2))


def point_on_curve(v):
    plate(v)
    height = lambda x: -0.1 + 0.55 * math.sin(2.6 * x)
    points = [(-0.9 + 1.85 * k / 60, height(-0.9 + 1.85 * k / 60), -0.2) for k in range(61)]
    v.front.append(polyline([v.place(p) for p in points], RED, 2.4))
    q = (0.72, height(0.72), -0.2)
    v.frame(Frame((-0.75, -0.5, -0.2)), 0.6, ("x", "y", "z"))
    stick(v, q, ((1, 25), (0, -10)), 1.0)
    knob(v, (-0.75, -0.5, -0.2), "P", (-6, 21), GREY)
    knob(v, q, "Q", (17, 12))


def constant_velocity(v):
    bent = WORLD.turned(0, -32)
    v.cylinder(WORLD, 0.12, -1.0, -0.41, GREY)
    v.cylinder(WORLD, 0.36, -0.4, 0.05, GREY)
    v.cylinder(bent, 0.1, 0.1, 1.15, BLUE)
    x, y = v.place((0, 0, 0))
    v.put([(0, 0, 0.06)], f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{0.26 * v.scale:.1f}" fill="url(#ball)" '
          f'stroke="{shade(BLUE, (0, 0, -2.2))}" stroke-width="0.8"/>', 0.25)
    v.axis((0, 0, -1.0), (0, 0, -1.3), INK, "")
    v.axis(bent.at(0, 0, 1.15), bent.at(0, 0, 1.45), INK, "")
    v.arc(WORLD, 0.24, -60, 210, "", height=-0.85)
    v.arc(bent, 0.24, -60, 210, "", height=0.85)
    x, y = v.place((0, 0, -0.85))
    v.front.append(text(x + 34, y + 8, "\u03c9", RED, style=ITALIC, size=16))
    x, y = v.place(bent.at(0, 0, 0.85))
    v.front.append(text(x + 34, y + 2, "\u03c9", RED, style=ITALIC, size=16))


def follower(v):
    turn = [2 * math.pi * k / 80 for k in range(81)]
    edge = lambda a, z: (0.26 + 0.62 * math.cos(a), 0.62 * math.sin(a), z)
    v.cylinder(Frame((0.26, 0, 0)), 0.62, -0.12, 0.12, GREY)
    v.front.append(polyline([v.place(edge(a, 0.12)) for a in turn], RED, 2.0))
    y = math.sqrt(0.8 ** 2 - 0.26 ** 2)
    v.cylinder(Frame((0, y, 0)), 0.18, -0.1, 0.1, BLUE)
    knob(v, (0, 0, 0.12), "P", (-17, 5), GREY)
    knob(v, (0, y, 0.12), "Q", (17, 8))
    free_along(v, (-0.35, y - 0.1, 0), (-0.35, y + 0.6, 0))


CLOSURES = (("constant_velocity", "both shafts turn alike", constant_velocity), ("rod", "constant distance of P and Q", rod), ("point_on_line", "Q moves along the axis through P", point_on_line),
            ("point_on_plane", "Q moves in the plane through P", point_on_plane), ("point_on_curve", "Q moves along a curve", point_on_curve), ("follower", "a roller on a cam", follower))


# -- frames of a joint ---------------------------------------------------------------------------------

def dot_at(v, point, name, shift):
    x, y = v.place(point)
    v.front += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.2" fill="white" stroke="{INK}" stroke-width="1.4"/>',
                text(x + shift[0], y + shift[1], name, INK, style=BOLD)]


def frames():
    """A revolute joint: its two points apart, with q = 0, and turned."""
    width, height = 930, 350
    dark = "#1b4f72"
    captions = (("two points with their axes", "at: point P of the parent; to: point T of the body"), ("q = 0", "the points and their axes coincide"),
                ("q = 50 deg", "the body has rotated about z of P"))
    shapes = []
    for k, (title, note) in enumerate(captions):
        v = View(310 * k + 42, 250, 92)
        v.box(WORLD, (-0.15, -0.25, -0.22), (1.5, 0.75, 0), GREY)
        point = Frame((0.9, 0.25, 0))
        held = point.moved(0, 0, 1.25) if k == 0 else point.turned(2, 50 if k == 2 else 0)
        v.box(held, (-0.14, -0.12, 0), (1.45, 0.12, 0.16), BLUE)
        v.frame(WORLD, 0.5, ("x", "y", "z"), "#5d6d7e", ((0, 0), (-3, 4), (0, 0)))
        top, middle = held.moved(0, 0, 0.16), held.moved(1.0, 0, 0.16)
        if k == 0:
            v.frame(point, 0.4, ("x", "y", "z"), INK, ((0, 2), (0, 2), (0, 2)))
            v.front.append(polyline([v.place(point.at(0, 0, 0.66)), v.place(held.origin)], "#7f8c99", 1, 'stroke-dasharray="4 3"'))
            dot_at(v, point.origin, "P", (-14, 14))
            v.frame(top, 0.4, ("x", "y", "z"), dark, ((0, 15), (0, 2), (0, 2)))
            dot_at(v, top.origin, "T", (-15, 0))
        else:
            v.frame(Frame(top.origin), 0.45 if k == 1 else 0.85, ("x", "y", "z") if k == 1 else ("x", "", "z"), INK,
                    ((0, 15) if k == 1 else (2, 4), (0, 2), (0, 2)))
            dot_at(v, top.origin, "P, T", (-24, -5))
        if k == 2:
            v.arc(Frame(top.origin), 0.72, 0, 50, "q", shift=(12, 10))
        v.frame(middle, 0.34, ("x", "y", "z"), dark, ((2, 13) if k < 2 else (0, 2), (0, 2) if k < 2 else (0, 3), (0, 2)))
        dot_at(v, WORLD.origin, "O", (-14, 8))
        dot_at(v, middle.origin, "G", (-2, 20) if k < 2 else (10, 20))
        shapes += [text(310 * k + 155, 28, title, INK, size=16, style=BOLD), text(310 * k + 155, 48, note, "#5d6d7e", size=13), *v.drawn()]
    return document("The frames of a joint between two points", width, height, shapes)


# -- cuts ----------------------------------------------------------------------------------------------

def bar(a, b, colour):
    return (polyline([a, b], colour, 7, 'stroke-linecap="round"'))


def hinge(p, name, shift, fixed=False):
    x, y = p
    base = (f'<path d="M {x:.1f} {y:.1f} l -10 18 h 20 Z" fill="#eee" stroke="#333" stroke-width="1.5"/>' if fixed else "")
    return base + f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="white" stroke="#333" stroke-width="2"/>' + text(x + shift[0], y + shift[1], name, INK, style=BOLD)


def angle(centre, radius, begin, end, label, shift=(0, 0)):
    """An angle in the plane, anticlockwise from the horizontal, with the line from which it counts."""
    points = [(centre[0] + radius * math.cos(math.radians(begin + (end - begin) * k / 20)),
               centre[1] - radius * math.sin(math.radians(begin + (end - begin) * k / 20))) for k in range(21)]
    x, y = points[10]
    far = (centre[0] + (radius + 12) * math.cos(math.radians(begin)), centre[1] - (radius + 12) * math.sin(math.radians(begin)))
    return [polyline([centre, far], "#7f8c99", 1, 'stroke-dasharray="4 3"'), polyline(points[:-1], RED, 1.8) + tip(points[-3], points[-1], RED, 7),
            text(x + shift[0], y + shift[1], label, RED, style=ITALIC)]


def circle_meet(a, r, b, s, side=1):
    """The point at distance r from a and s from b, left of the way from a to b or right of it."""
    d = math.hypot(b[0] - a[0], b[1] - a[1])
    x = (d * d + r * r - s * s) / (2 * d)
    y = side * math.sqrt(r * r - x * x)
    ux, uy = (b[0] - a[0]) / d, (b[1] - a[1]) / d
    return (a[0] + x * ux - y * uy, a[1] + x * uy + y * ux)


def cuts():
    """A four-bar: its loop of joints, the tree, and the closed loop with its multipliers."""
    width, height, scale = 900, 320, 190
    lengths = {"crank": 0.3, "coupler": 0.8, "rocker": 0.7, "base": 0.9}

    A, D = (0, 0), (0.9, 0)
    B = (0.3 * math.cos(math.radians(62)), 0.3 * math.sin(math.radians(62)))
    C = circle_meet(B, lengths["coupler"], D, lengths["rocker"])
    shapes = []
    for k, (title, note) in enumerate((("joints of a loop", "four hinges A, B, C, D"), ("tree: C is cut", "h = Q - P is not yet zero"),
                                       ("closed: h = 0", "the multipliers are the force in C"))):
        place = lambda p: (50 + 300 * k + scale * p[0], 262 - scale * p[1])
        P, Q = C, C
        if k == 1:
            tilt = math.radians(13)
            P = (B[0] + 0.8 * math.cos(tilt), B[1] + 0.8 * math.sin(tilt))
            turn = math.radians(70)
            Q = (D[0] + 0.7 * math.cos(turn), D[1] + 0.7 * math.sin(turn))
        a, b, d, p, q = map(place, (A, B, D, P, Q))
        shapes += [text(300 * k + 150, 28, title, INK, size=16, style=BOLD), text(300 * k + 150, 48, note, "#5d6d7e", size=13)]
        shapes += [bar(a, b, BLUE), bar(b, p, RED), bar(d, q, GREEN)]
        middle = lambda u, w: ((u[0] + w[0]) / 2, (u[1] + w[1]) / 2)
        x, y = middle(a, b)
        shapes.append(text(x + (12 if k == 0 else -14), y + (10 if k == 0 else -4), "crank", BLUE, "start" if k == 0 else "end"))
        x, y = middle(b, p)
        shapes.append(text(x + 8, y + 22, "coupler", RED, "start" if k != 1 else "middle"))
        x, y = middle(d, q)
        shapes.append(text(x + 14, y + (10 if k != 1 else 0), "rocker", GREEN, "start"))
        shapes += [hinge(a, "A", (-16, 6), True), hinge(d, "D", (20, 20), True), hinge(b, "B", (-14, -6))]
        if k == 0:
            shapes.append(hinge(p, "C", (2, -13)))
        elif k == 1:
            shapes += angle(a, 40, 0, 62, "q(A)", (25, 2)) + angle(d, 34, 0, 70, "q(D)", (25, 2))
            heading = (b[0] + 62 * math.cos(math.radians(62)), b[1] - 62 * math.sin(math.radians(62)))
            shapes.append(polyline([b, heading], "#7f8c99", 1, 'stroke-dasharray="4 3"'))
            arc = [(b[0] + 46 * math.cos(math.radians(t)), b[1] - 46 * math.sin(math.radians(t))) for t in range(62, 7, -3)]
            shapes += [polyline(arc[:-1], RED, 1.8) + tip(arc[-3], arc[-1], RED, 7), text(b[0] + 62, b[1] - 38, "q(B)", RED, "start", style=ITALIC)]
            shapes += [arrow(p, (q[0] - 4, q[1] + 4), RED, 2.2), text((p[0] + q[0]) / 2 - 14, (p[1] + q[1]) / 2 - 4, "h", RED, "start", style=ITALIC, size=17)]
            for point, name, shift in ((p, "P", (4, 20)), (q, "Q", (0, -13))):
                shapes.append(f'<circle cx="{point[0]:.1f}" cy="{point[1]:.1f}" r="5" fill="white" stroke="#333" stroke-width="2"/>'
                              + text(point[0] + shift[0], point[1] + shift[1], name, INK, style=BOLD))
        else:
            shapes += [arrow(p, (p[0] + 56, p[1]), GREEN, 2.4), text(p[0] + 40, p[1] - 10, "+\u03bb", GREEN, size=15),
                       text(p[0] + 14, p[1] + 19, "on the rocker", GREEN, "start", size=12),
                       arrow(p, (p[0] - 56, p[1]), RED, 2.4), text(p[0] - 40, p[1] - 10, "-\u03bb", RED, size=15),
                       text(p[0] - 62, p[1] + 4, "on the coupler", RED, "end", size=12), hinge(p, "C", (0, -13))]
    return document("A loop, its tree with one cut joint, and the closed loop", width, height, shapes)


# -- singular positions --------------------------------------------------------------------------------

def panel(k, title, note):
    return [text(300 * k + 150, 28, title, INK, size=16, style=BOLD), text(300 * k + 150, 48, note, "#5d6d7e", size=13)]


def faint(shapes):
    return [f'<g opacity="0.3">{"".join(shapes)}</g>']


def four_bar_shapes(place, a, b, c, d):
    points = [place(p) for p in (a, b, c, d)]
    return [bar(points[0], points[1], BLUE), bar(points[1], points[2], RED), bar(points[2], points[3], GREEN)]


def dead_centre(k):
    """A slider-crank with crank and rod in line; before and after it faintly."""
    place = lambda p: (45 + 300 * k + 190 * p[0], 175 - 190 * p[1])
    shapes = [polyline([place((-0.1, 0)), place((1.25, 0))], "#7f8c99", 1, 'stroke-dasharray="7 4"')]
    for angle_, solid in ((38, False), (-38, False), (0, True)):
        b = (0.35 * math.cos(math.radians(angle_)), 0.35 * math.sin(math.radians(angle_)))
        c = (b[0] + math.sqrt(0.75 ** 2 - b[1] ** 2), 0)
        x, y = place(c)
        drawn = [bar(place((0, 0)), place(b), BLUE), bar(place(b), (x, y), RED),
                 f'<rect x="{x - 20:.1f}" y="{y - 12:.1f}" width="40" height="24" rx="3" fill="#e9f7ef" stroke="{GREEN}" stroke-width="2"/>']
        shapes += drawn if solid else faint(drawn)
        if solid:
            bx, by = place(b)
            shapes += [hinge(place((0, 0)), "", (0, 0), True), hinge((bx, by), "", (0, 0)), hinge((x, y), "", (0, 0)),
                       text(x, y - 22, "slider", GREEN), text((bx + x) / 2 - 12, by - 11, "rod", RED), text(place((0.2, 0))[0], by - 11, "crank", BLUE)]
    return panel(k, "dead centre", "the slider turns back: it cannot be u here") + shapes


def change_point(k):
    """A parallelogram in line, and the two branches that continue."""
    place = lambda p: (35 + 300 * k + 165 * p[0], 175 - 165 * p[1])
    a, d, r, l = (0, 0), (0.95, 0), 0.42, 0.95
    b = (r * math.cos(math.radians(35)), r * math.sin(math.radians(35)))
    shapes = []
    for side, label, shift in ((1, "parallelogram", (6, -14)), (-1, "crossed", (26, 18))):
        c = circle_meet(b, l, d, r, side)
        shapes += faint(four_bar_shapes(place, a, b, c, d))
        x, y = place(c)
        shapes += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="white" stroke="#8795a1" stroke-width="1.6"/>', text(x + shift[0], y + shift[1], label, "#5d6d7e", size=13)]
    x, y = place(b)
    shapes.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="white" stroke="#8795a1" stroke-width="1.6"/>')
    shapes += four_bar_shapes(place, a, (r, 0), (r + l, 0), d)
    shapes += [hinge(place(a), "A", (-15, 4), True), hinge(place(d), "D", (-18, 22), True), hinge(place((r, 0)), "B", (0, 24)), hinge(place((r + l, 0)), "C", (6, 24))]
    return panel(k, "change point", "J loses a row: two branches meet") + shapes


def redundant(k):
    """A parallelogram with a third parallel bar."""
    place = lambda p: (55 + 300 * k + 150 * p[0], 220 - 170 * p[1])
    up = (0.22, 0.55)
    shapes = []
    for x, colour in ((0, RED), (0.55, BROWN), (1.1, GREEN)):
        shapes.append(bar(place((x, 0)), place((x + up[0], up[1])), colour))
    shapes.insert(0, bar(place(up), place((1.1 + up[0], up[1])), BLUE))
    for x, name, shift in ((0, "A", (-16, 6)), (0.55, "B", (-16, 6)), (1.1, "C", (-16, 6))):
        shapes += [hinge(place((x, 0)), name, shift, True), hinge(place((x + up[0], up[1])), "", (0, 0))]
    x, y = place((0.55 + up[0], up[1]))
    shapes.append(text(x, y - 16, "this bar constrains nothing new", BROWN, size=13))
    return panel(k, "redundant constraint", "4 coordinates, 4 rows, mobility 1") + shapes


def singular():
    return document("A dead centre, a change point and a redundant constraint", 900, 270, dead_centre(0) + change_point(1) + redundant(2))


# -- wheel and rail ------------------------------------------------------------------------------------

def rail_shape(x, y, side):
    """A rail's head and web in a cross-section; its top falls inwards. `side` is -1 for the left rail, seen from behind."""
    slope = lambda u: (x + side * u, y + 0.10 * -u + 0.0018 * u * u)
    top = [slope(u) for u in range(-44, 45, 4)]
    inner, outer = top[0], top[-1]
    body = [*top, (outer[0] + side * 2, outer[1] + 24), (x + side * 12, y + 42), (x + side * 12, y + 66), (x - side * 12, y + 66),
            (x - side * 12, y + 42), (inner[0] - side * 2, inner[1] + 24)]
    return polygon(body, "#dfe4e8", "#5d6d7e", 1.5)


def wheel_shape(x, y, side):
    """The lower part of a wheel: the tread, and the flange towards the middle of the track."""
    points = [(70, -14.0), (0, 0), (-36, 4), (-47, 9), (-54, 28), (-62, 37), (-72, 34), (-78, 14), (-78, -62), (70, -62)]
    return polygon([(x + side * u, y + v) for u, v in points], "#d6e6f2", BLUE, 1.8)


def turned_arrow(p, angle, length, label, colour, shift, width=2.2, size=16):
    """An arrow at an angle in degrees, anticlockwise from the right."""
    dx, dy = math.cos(math.radians(angle)), -math.sin(math.radians(angle))
    q = (p[0] + length * dx, p[1] + length * dy)
    return [arrow(p, q, colour, width), text(q[0] + shift[0], q[1] + shift[1], label, colour, style=ITALIC, size=size)]


def cross_section():
    """Both wheels from behind: left is left."""
    shapes, y, slant = [], 190, 7
    shapes.append(polyline([(450, 90), (450, 262)], "#7f8c99", 1, 'stroke-dasharray="7 4"'))
    shapes.append(text(450, 280, "middle of the track", "#5d6d7e", size=13))
    shapes += [arrow((450, 150), (450, 100), INK, 1.6), text(462, 106, "z", INK, style=ITALIC, size=15), arrow((450, 150), (400, 150), INK, 1.6),
               text(392, 146, "y", INK, style=ITALIC, size=15), f'<circle cx="450" cy="150" r="6" fill="white" stroke="{INK}" stroke-width="1.6"/>',
               polyline([(446, 146), (454, 154)], INK, 1.4), polyline([(446, 154), (454, 146)], INK, 1.4), text(468, 160, "x, forwards", INK, "start", style=ITALIC)]
    for side, name in ((-1, "left wheel"), (1, "right wheel")):
        x = 450 + side * 270
        contact = (x, y)
        shapes += [rail_shape(x, y + 1, side), wheel_shape(x, y - 1, side)]
        shapes.append(text(x, 60, name, INK, size=16, style=BOLD))
        shapes += turned_arrow(contact, 90 + side * slant, 88, "n", GREEN, (side * -12, 8))
        shapes += turned_arrow(contact, 180 + side * slant, 84, "t", GREEN, (-10, 0 if side < 0 else 12))
        shapes.append(f'<circle cx="{x}" cy="{y}" r="4" fill="{RED}"/>')
        level = [(x - side * 14, y + 0), (x - side * 132, y + 0)]
        shapes.append(polyline(level, "#7f8c99", 1, 'stroke-dasharray="4 3"'))
        fall = [(x - side * 14, y + 2), (x - side * 132, y + 132 * math.tan(math.radians(slant)))]
        shapes.append(polyline(fall, "#7f8c99", 1, 'stroke-dasharray="4 3"'))
        shapes.append(text(x - side * 146, y + 13, "\u03b4", RED, style=ITALIC, size=16))
        below = y + 88
        shapes += [arrow((450 + side * 75, below + 18), (x, below + 18), RED, 1.6), polyline([(x, y + 8), (x, below + 26)], "#b9c2ca", 1, 'stroke-dasharray="3 3"'),
                   text(450 + side * 172, below + 12, "y, positive outwards", RED, size=13)]
        shapes += [arrow((x + side * 2, y - 74), (x + side * 58, y - 74), BLUE, 1.6), text(x + side * 64, y - 79, "s", BLUE, style=ITALIC, size=16)]
    return shapes


def side_view():
    """A driven wheel from its right: forwards is right."""
    x, y, r = 170, 470, 92
    shapes = [text(x + 10, 345, "from the right side", INK, size=16, style=BOLD), polyline([(30, y + r), (330, y + r)], "#5d6d7e", 1.4)]
    shapes.append(f'<circle cx="{x}" cy="{y}" r="{r}" fill="#eaf3f9" stroke="{BLUE}" stroke-width="2"/>')
    arc = [(x + 40 * math.cos(math.radians(t)), y - 40 * math.sin(math.radians(t))) for t in range(150, 20, -5)]
    shapes += [polyline(arc[:-1], INK, 1.8) + tip(arc[-3], arc[-1], INK), text(x, y - 50, "too fast", INK, size=13)]
    shapes += [arrow((x, y), (x + 64, y), INK, 2), text(x + 74, y + 5, "V", INK, style=ITALIC, size=16), f'<circle cx="{x}" cy="{y}" r="3.5" fill="{INK}"/>']
    c = (x, y + r)
    shapes += [arrow(c, (x - 66, y + r), RED, 2.4), text(x - 62, y + r + 21, "slip v", RED, style=ITALIC), arrow(c, (x + 76, y + r), GREEN, 2.4),
               text(x + 96, y + r + 21, "force along > 0", GREEN, size=13), arrow(c, (x, y + r - 58), GREEN, 2.4), text(x + 16, y + r - 46, "N", GREEN, style=ITALIC, size=16)]
    shapes.append(f'<circle cx="{x}" cy="{y + r}" r="4" fill="{RED}"/>')
    shapes.append(text(x, y + r + 44, "creepage along = v.x / V, negative here", RED, size=13))
    return shapes


def patch_view():
    """The patch from above, against n."""
    x, y = 570, 480
    shapes = [text(x + 30, 345, "contact patch, from above", INK, size=16, style=BOLD)]
    shapes.append(f'<ellipse cx="{x}" cy="{y}" rx="46" ry="72" fill="#fdebd0" stroke="{BROWN}" stroke-width="1.8"/>')
    shapes += [arrow((x, y), (x, y - 72), BROWN, 1.6), text(x + 12, y - 40, "a", BROWN, style=ITALIC, size=16),
               arrow((x, y), (x + 46, y), BROWN, 1.6), text(x + 24, y + 17, "b", BROWN, style=ITALIC, size=16)]
    shapes += [polyline([(x, y - 72), (x, y - 98)], INK, 1.4) + tip((x, y - 90), (x, y - 104), INK), text(x + 14, y - 96, "x, forwards", INK, "start", style=ITALIC),
               polyline([(x, y), (x - 90, y)], INK, 1.4) + tip((x - 80, y), (x - 96, y), INK), text(x - 104, y + 5, "t, to the left", INK, "end", style=ITALIC)]
    arc = [(x + 66 * math.cos(math.radians(t)) * 0.98, y - 92 * math.sin(math.radians(t)) * 0.98) for t in range(-52, 38, 5)]
    shapes += [polyline(arc[:-1], RED, 2) + tip(arc[-3], arc[-1], RED), text(x + 82, y + 12, "spin, moment", RED, "start"),
               text(x + 82, y + 30, "positive about n", RED, "start", size=13)]
    shapes.append(f'<circle cx="{x}" cy="{y}" r="5" fill="white" stroke="{GREEN}" stroke-width="1.6"/><circle cx="{x}" cy="{y}" r="1.6" fill="{GREEN}"/>')
    shapes.append(text(x - 12, y + 22, "n", GREEN, style=ITALIC, size=16))
    shapes.append(text(x + 30, y + 104, "creepages: wheel relative to rail; forces: on the wheel", "#5d6d7e", size=13))
    return shapes


def contact_frame():
    shapes = [text(450, 28, "from behind", INK, size=16, style=BOLD), *cross_section(), *side_view(), *patch_view()]
    return document("The frame of a contact between wheel and rail, and its signs", 900, 630, shapes)


OF_MODELS = {"frames": frames, "joints": joints, "cuts": cuts, **{f"joint_{kind[0]}": alone(*kind) for kind in KINDS},
             **{f"closure_{kind[0]}": alone(*kind) for kind in CLOSURES}}
FIGURES = {"contact_frame.svg": contact_frame, "singular.svg": singular, **{f"model/figures/{name}.svg": draw for name, draw in OF_MODELS.items()}}


def main(arguments):
    return generated.settle({DOCS / name: draw() for name, draw in FIGURES.items()}, "python3 docs/figures.py", arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
