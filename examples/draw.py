#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws examples/NAME/NAME.svg: each mechanism at its start pose, from the same geometry as its model file.

    python3 examples/draw.py            writes all pictures
"""
import math
import pathlib

HERE = pathlib.Path(__file__).parent
WIDTH, MARGIN = 560, 50
PALETTE = ["#c0392b", "#2471a3", "#1e8449", "#b9770e", "#7d3c98", "#117a65", "#5d6d7e"]


def turn(angle, point):
    c, s = math.cos(angle), math.sin(angle)
    return (c * point[0] - s * point[1], s * point[0] + c * point[1])


def at(origin, angle, point):
    x, y = turn(angle, point)
    return (origin[0] + x, origin[1] + y)


class Picture:
    """Collects shapes in metres, writes them in pixels."""

    def __init__(self, title):
        self.title, self.shapes, self.points = title, [], []

    def see(self, *points):
        self.points += points

    def body(self, name, *points):
        self.see(*points)
        self.shapes.append(("body", name, points))

    def spring(self, a, b):
        self.see(a, b)
        self.shapes.append(("spring", None, (a, b)))

    def pivot(self, point, label=None, fixed=False, shift=(9, -9)):
        self.see(point)
        self.shapes.append(("fixed" if fixed else "joint", (label, shift), (point,)))

    def guide(self, a, b):
        self.see(a, b)
        self.shapes.append(("guide", None, (a, b)))

    def slider(self, point):
        self.see(point)
        self.shapes.append(("slider", None, (point,)))

    def write(self, path):
        xs, ys = [p[0] for p in self.points], [p[1] for p in self.points]
        scale = (WIDTH - 2 * MARGIN) / (max(xs) - min(xs))
        height = round(scale * (max(ys) - min(ys)) + 2 * MARGIN)
        place = lambda p: (MARGIN + scale * (p[0] - min(xs)), height - MARGIN - scale * (p[1] - min(ys)))
        lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" '
                 f'height="{height}" font-family="sans-serif" font-size="15">',
                 f"<title>{self.title}</title>", f'<rect width="{WIDTH}" height="{height}" fill="white"/>']
        bodies = 0
        for order in (("guide",), ("fixed",), ("spring", "body", "slider"), ("joint", "fixed")):
            for kind, note, points in self.shapes:
                if kind not in order:
                    continue
                pixels = [place(p) for p in points]
                if kind == "body":
                    lines += draw_body(note, pixels, PALETTE[bodies % len(PALETTE)])
                    bodies += 1
                elif kind == "fixed" and order == ("fixed",):
                    lines += draw_ground(*pixels[0])
                else:
                    lines += DRAW[kind](note, pixels)
        path.write_text("\n".join(lines) + "\n</svg>\n")


def draw_body(name, pixels, colour):
    path = " L ".join(f"{x:.1f} {y:.1f}" for x, y in pixels)
    close, fill = (" Z", colour) if len(pixels) > 2 else ("", "none")
    x, y = (sum(p[k] for p in pixels) / len(pixels) for k in (0, 1))
    if len(pixels) == 2:                                  # beside the bar, not on it
        (ax, ay), (bx, by) = pixels
        length = math.hypot(bx - ax, by - ay)
        nx, ny = (by - ay) / length, (ax - bx) / length
        away = 12 + 4.5 * len(name) * abs(nx)
        x, y = x + away * nx, y + away * ny
    return [f'<path d="M {path}{close}" fill="{fill}" fill-opacity="0.15" stroke="{colour}" stroke-width="6" '
            'stroke-linejoin="round" stroke-linecap="round"/>',
            f'<text x="{x:.1f}" y="{y + 5:.1f}" text-anchor="middle" fill="{colour}">{name}</text>']


def draw_ground(x, y):
    hatch = " ".join(f"M {x - 10 + 7 * k:.1f} {y + 18:.1f} l -5 6" for k in range(4))
    return [f'<path d="M {x:.1f} {y:.1f} l -10 18 h 20 Z" fill="#eee" stroke="#333" stroke-width="1.5"/>',
            f'<path d="{hatch}" stroke="#333" stroke-width="1.2"/>']


def draw_joint(note, pixels):
    (label, (dx, dy)), (x, y) = note, pixels[0]
    lines = [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="white" stroke="#333" stroke-width="2"/>']
    if label:
        lines.append(f'<text x="{x + dx:.1f}" y="{y + dy:.1f}" fill="#333" font-weight="bold">{label}</text>')
    return lines


def draw_spring(_, pixels):
    (ax, ay), (bx, by) = pixels
    teeth = 14
    nx, ny = -(by - ay), bx - ax
    length = math.hypot(nx, ny)
    points = []
    for k in range(teeth + 1):
        f = 0.15 + 0.7 * k / teeth
        w = 0 if k in (0, teeth) else (7 if k % 2 else -7) / length
        points.append(f"{ax + f * (bx - ax) + w * nx:.1f} {ay + f * (by - ay) + w * ny:.1f}")
    path = " L ".join([f"{ax:.1f} {ay:.1f}", *points, f"{bx:.1f} {by:.1f}"])
    return [f'<path d="M {path}" fill="none" stroke="#777" stroke-width="1.8"/>']


def draw_guide(_, pixels):
    (ax, ay), (bx, by) = pixels
    return [f'<path d="M {ax:.1f} {ay:.1f} L {bx:.1f} {by:.1f}" stroke="#999" stroke-width="1.5" '
            'stroke-dasharray="8 5"/>']


def draw_slider(_, pixels):
    x, y = pixels[0]
    return [f'<rect x="{x - 24:.1f}" y="{y - 14:.1f}" width="48" height="28" rx="3" fill="#eee" stroke="#333" '
            'stroke-width="2"/>']


DRAW = {"joint": draw_joint, "fixed": draw_joint, "spring": draw_spring, "guide": draw_guide, "slider": draw_slider}


def andrews():
    beta, gamma, phi = -0.0617138900142764496, 0.455279819163070380, 0.222668390165885885
    delta, epsilon = 0.487364979543842550, 1.23054744454982120
    O, A, B, C = (0, 0), (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
    F, G, H = at(O, beta, (0.007, 0)), at(A, delta, (0.04, 0)), at(A, epsilon, (0, -0.04))
    D, E = at(B, gamma, (0.02, -0.018)), at(B, gamma, (0, -0.035))
    p = Picture("Andrews' squeezing mechanism at the start")
    p.spring(D, C)
    p.body("K2", F, E)
    p.body("K1", O, F)
    p.body("K3", B, D, E)
    p.body("K5", A, G)
    p.body("K4", E, G)
    p.body("K7", A, H)
    p.body("K6", E, H)
    p.pivot(O, "O", True, (-8, -12))
    p.pivot(A, "A", True, (-26, 4))
    p.pivot(B, "B", True, (-8, -12))
    p.pivot(C, "C", True, (-24, 4))
    p.pivot(F, "F", shift=(10, 4))
    p.pivot(G, "G", shift=(-14, -10))
    p.pivot(H, "H", shift=(-4, 24))
    p.pivot(D, "D", shift=(10, 14))
    p.pivot(E, "E", shift=(-4, 24))
    return p


def four_bar():
    crank, coupler, rocker, base = 0.3, 0.8, 0.7, 0.9
    diagonal = math.hypot(base, crank)
    along = (coupler**2 - rocker**2 + diagonal**2) / (2 * diagonal)
    across = math.sqrt(coupler**2 - along**2)
    C = ((along * base + across * crank) / diagonal, crank + (across * base - along * crank) / diagonal)
    O, B, D = (0, 0), (0, crank), (base, 0)
    p = Picture("Grashof four-bar at the start")
    p.body("crank", B, O)
    p.body("coupler", C, B)
    p.body("rocker", C, D)
    p.pivot(O, "O", True, (-26, 4))
    p.pivot(B, "B", shift=(-24, 4))
    p.pivot(C, "C", shift=(12, -8))
    p.pivot(D, "D", True, (12, 4))
    return p


def slider_crank(title="Slider-crank", angle=math.radians(50)):
    r, l = 0.2, 0.5                                        # turned for the picture: at the start all is in line
    A = turn(angle, (r, 0))
    P = (A[0] + math.sqrt(l * l - A[1] ** 2), 0)
    p = Picture(f"{title}, crank turned by {round(math.degrees(angle))} degrees")
    p.guide((0, 0), (0.78, 0))
    p.body("crank", A, (0, 0))
    p.body("rod", P, A)
    p.slider(P)
    p.pivot((0, 0), "O", True, (-26, 4))
    p.pivot(A, "A")
    p.pivot(P, "P", shift=(-4, -20))
    return p


def driven_slider_crank():
    return slider_crank("Driven slider-crank", math.radians(125))


def governor():
    p = Picture("Stiff flyball governor at the start")
    p.guide((0, -0.1), (0, 1.08))
    p.body("shaft", (0, 1), (0, 0))
    for side in (-1, 1):
        angle = side * math.radians(-30) + (math.pi if side < 0 else 0)
        hinge, along = (side * 0.05, 1), turn(angle, (1, 0))
        end = (hinge[0] + along[0], hinge[1] + along[1])
        p.spring((hinge[0] + along[0] / 2, hinge[1] + along[1] / 2), (side * 0.05, 0.5))
        p.body("right" if side > 0 else "left", *((hinge, end) if side > 0 else (end, hinge)))
        p.pivot(hinge, shift=(4, -12))
        p.pivot(end, "5 kg", shift=(-16, 28))
    p.slider((0, 0.5))
    p.pivot((0, 0), "O", True, (-26, 4))
    return p


if __name__ == "__main__":
    for make in (andrews, four_bar, slider_crank, driven_slider_crank, governor):
        make().write(HERE / make.__name__ / f"{make.__name__}.svg")
