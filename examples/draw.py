#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws examples/NAME/NAME.svg: each mechanism at its start pose, from the same geometry as its model file.

    python3 examples/draw.py            writes all pictures
"""
import math
import pathlib

from panels import COLOURS

HERE = pathlib.Path(__file__).parent
WIDTH, MARGIN = 560, 50


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

    def body(self, name, *points, other_side=False, shift=(0, 0), colour=None):
        """Its name stands beside a bar, right of the way from its first point or on the other side; else in the
        middle. A colour by its number, or the next one."""
        self.see(*points)
        self.shapes.append(("body", (name, other_side, shift, colour), points))

    def curve(self, name, *points, shift=(0, 0)):
        """An open line in the next colour, its name at its middle."""
        self.see(*points)
        self.shapes.append(("curve", (name, shift), points))

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
        for order in (("guide",), ("fixed",), ("spring", "body", "curve", "slider"), ("joint", "fixed")):
            for kind, note, points in self.shapes:
                if kind not in order:
                    continue
                pixels = [place(p) for p in points]
                if kind == "body":
                    colour = bodies if note[3] is None else note[3]
                    lines += draw_body(*note[:3], pixels, COLOURS[colour % len(COLOURS)])
                    bodies += note[3] is None
                elif kind == "curve":
                    lines += draw_curve(*note, pixels, COLOURS[bodies % len(COLOURS)])
                    bodies += 1
                elif kind == "fixed" and order == ("fixed",):
                    lines += draw_ground(*pixels[0])
                else:
                    lines += DRAW[kind](note, pixels)
        path.write_text("\n".join(lines) + "\n</svg>\n")


def draw_body(name, other_side, shift, pixels, colour):
    path = " L ".join(f"{x:.1f} {y:.1f}" for x, y in pixels)
    close, fill = (" Z", colour) if len(pixels) > 2 else ("", "none")
    x, y = (sum(p[k] for p in pixels) / len(pixels) for k in (0, 1))
    if len(pixels) == 2:                                  # beside the bar, not on it
        (ax, ay), (bx, by) = pixels
        length = math.hypot(bx - ax, by - ay)
        nx, ny = (by - ay) / length, (ax - bx) / length
        if other_side:
            nx, ny = -nx, -ny
        away = 12 + 4.5 * len(name) * abs(nx)
        x, y = x + away * nx, y + away * ny
    x, y = x + shift[0], y + shift[1]
    return [f'<path d="M {path}{close}" fill="{fill}" fill-opacity="0.15" stroke="{colour}" stroke-width="6" '
            'stroke-linejoin="round" stroke-linecap="round"/>',
            f'<text x="{x:.1f}" y="{y + 5:.1f}" text-anchor="middle" fill="{colour}">{name}</text>']


def draw_curve(name, shift, pixels, colour):
    path = " L ".join(f"{x:.1f} {y:.1f}" for x, y in pixels)
    x, y = pixels[len(pixels) // 2]
    return [f'<path d="M {path}" fill="none" stroke="{colour}" stroke-width="6" stroke-linejoin="round" stroke-linecap="round"/>',
            f'<text x="{x + shift[0]:.1f}" y="{y + shift[1] + 5:.1f}" text-anchor="middle" fill="{colour}">{name}</text>']


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


def crank_rocker():
    crank, coupler, rocker, base = 0.1, 0.3, 0.25, 0.32
    O, A, D = (0, 0), turn(math.radians(60), (crank, 0)), (base, 0)
    B = circles(A, coupler, D, rocker, 1)
    angle = math.atan2(B[1] - A[1], B[0] - A[0])
    p = Picture("Crank-rocker, crank at 60 degrees")
    p.body("crank", A, O)
    p.body("coupler", A, at(A, angle, (0.15, 0.16)), at(A, angle, (0.4, 0.01)), at(A, angle, (0.23, -0.06)))
    p.body("rocker", B, D)
    p.pivot(O, "O", True, (-26, 4))
    p.pivot(D, "D", True, (12, 4))
    p.pivot(A, "A", shift=(-22, -6))
    p.pivot(B, "B", shift=(-4, -12))
    for name, point, shift in (("P", (0.15, 0.16), (-4, -12)), ("Q", (0.23, -0.06), (-4, 22)), ("R", (0.4, 0.01), (10, 4))):
        p.pivot(at(A, angle, point), name, shift=shift)
    return p


def slider_crank(title="Slider-crank", angle=math.radians(50)):
    r, l = 0.2, 0.5                                        # turned for the picture: at the start all is in line
    A = turn(angle, (r, 0))
    P = (A[0] + math.sqrt(l * l - A[1] ** 2), 0)
    p = Picture(f"{title}, crank turned by {round(math.degrees(angle))} degrees")
    p.guide((0, 0), (0.78, 0))
    p.body("crank", A, (0, 0), other_side=angle > math.pi / 2)
    p.body("rod", P, A)
    p.slider(P)
    p.pivot((0, 0), "O", True, (-26, 4))
    p.pivot(A, "A")
    p.pivot(P, "P", shift=(-4, -20))
    return p


def loose_pin():
    r, l, angle, gap = 0.05, 0.12, math.radians(50), 0.006  # the clearance is enlarged
    A = turn(angle, (r, 0))
    bearing = (A[0] + math.sqrt(l * l - A[1] ** 2), 0)
    journal = at(bearing, math.radians(150), (gap, 0))
    p = Picture("Slider-crank with a loose pin, crank turned by 50 degrees, clearance enlarged")
    p.guide((0, 0), (0.18, 0))
    p.body("crank", A, (0, 0))
    p.body("rod", journal, A)
    p.slider(bearing)
    p.pivot((0, 0), "A", True, (-26, 4))
    p.pivot(A, "B")
    p.pivot(bearing, "slider.P", shift=(10, -16))
    p.pivot(journal, "rod.P", shift=(-40, -14))
    return p


def loose_slider():
    r, l, angle, tilt = 0.05, 0.12, math.radians(50), math.radians(4)  # clearance and tilt are enlarged
    A = turn(angle, (r, 0))
    pin = (A[0] + math.sqrt(l * l - A[1] ** 2), 0)
    p = Picture("Slider-crank with a loose guide, crank turned by 50 degrees, clearance enlarged")
    for side in (1, -1):
        p.guide((0.1, side * 0.0185), (0.2, side * 0.0185))
    p.body("crank", A, (0, 0))
    p.body("rod", pin, A)
    p.body("", *(at(pin, tilt, corner) for corner in ((0.03, 0.015), (-0.03, 0.015), (-0.03, -0.015), (0.03, -0.015))))
    p.pivot((0, 0), "A", True, (-26, 4))
    p.pivot(A, "B")
    p.pivot(pin, "slider", shift=(12, 22))
    return p


def driven_slider_crank():
    return slider_crank("Driven slider-crank", math.radians(125))


def oblique(point):
    """A point in space as seen from the front, a little from the right and above; z upwards."""
    x, y, z = point
    return (x + 0.45 * y, z + 0.28 * y)


def circles(P, r, Q, s, side):
    """The point where the circles about P and Q meet, on the left (1) or right (-1) of P-Q."""
    dx, dy = Q[0] - P[0], Q[1] - P[1]
    apart = math.hypot(dx, dy)
    along = (r * r - s * s + apart * apart) / (2 * apart)
    across = side * math.sqrt(r * r - along * along)
    return (P[0] + (along * dx - across * dy) / apart, P[1] + (along * dy + across * dx) / apart)


def n_four_bar():
    n, angle = 2, math.radians(65)
    p = Picture("Four-bar windows, N = 2, while they fall")
    tip = [at((i, 0), angle, (1, 0)) for i in range(n + 1)]
    for i in range(n + 1):
        p.body(f"v{i}", tip[i], (i, 0))
    for i in range(n):
        p.body(f"h{i}", tip[i], tip[i + 1])
    for i in range(n + 1):
        p.pivot((i, 0), f"G{i}", True, (12, 4))
        p.pivot(tip[i], f"T{i}", shift=(-8, -14))
    return p


def bricard():
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1), (0, 1, 1), (0, 0, 1)]     # -y of the model is drawn backwards
    seen = [oblique(x) for x in points]
    p = Picture("Bricard's six-bar at the start: five rods along the edges of a cube")
    for k in range(5):
        p.body(f"r{k + 1}", seen[k], seen[k + 1])
    for k in range(6):
        p.pivot(seen[k], f"P{k + 1}", k in (0, 5), {1: (4, 24), 5: (-34, 4)}.get(k, (10, -8)))
    return p


def governor():
    angle = math.radians(30)
    p = Picture("Flyball governor at the start")
    p.guide((0, -0.05), (0, 1.05))
    p.body("shaft", (0, 0), (0, 1), shift=(0, 60))
    for side, name in ((-1, "rod b"), (1, "rod a")):
        hinge = (0.05 * side, 1)
        middle, ball = ((hinge[0] + side * x * math.cos(angle), 1 - x * math.sin(angle)) for x in (0.5, 1))
        p.spring(middle, (0.05 * side, 0.5))
        p.body(name, ball, hinge, other_side=side > 0)
        p.pivot(ball, "5 kg", shift=(8, 16))
    p.slider((0, 0.5))
    p.pivot((0, 0), "O", True, (12, 4))
    return p


def spatial_slider_crank():
    A, P, S = ((0, 0.1, 0.12), (0, 0.1, 0.2), (0.2, 0, 0))
    p = Picture("Spatial slider-crank at the start")
    p.guide(oblique((-0.02, 0, 0)), oblique((0.32, 0, 0)))
    p.body("crank", oblique(P), oblique(A), other_side=True)
    p.body("rod", oblique(S), oblique(P))
    p.slider(oblique(S))
    p.pivot(oblique(A), "A", True, (12, 4))
    p.pivot(oblique(P), "P")
    p.pivot(oblique(S), "S", shift=(-4, -20))
    return p


def stewart():
    ring = lambda r, z, angles: [oblique((r * math.cos(math.radians(a)), r * math.sin(math.radians(a)), z)) for a in angles]
    base, top = ring(1, 0, (-10, 10, 110, 130, 230, 250)), ring(0.5, 1, (-50, 50, 70, 170, 190, 290))
    p = Picture("Gough-Stewart platform at the start")
    for k in range(6):
        p.spring(base[k], top[k])
    p.body("platform", *top)
    for k in range(6):
        p.pivot(base[k], f"B{k + 1}", True, (-9, 42) if k == 0 else (12, 4))
        p.pivot(top[k])
    return p


def bennett():
    alpha, beta = math.radians(40), math.radians(75)
    a, b, q1 = 1, math.sin(beta) / math.sin(alpha), 1.0
    q2 = 2 * math.atan(math.sin((beta + alpha) / 2) / math.sin((beta - alpha) / 2) / math.tan(q1 / 2))
    x2 = (math.cos(q1), math.sin(q1), 0)                   # second link: the first's axes turned about its hinge
    c, s, ca, sa = math.cos(q2), math.sin(q2), math.cos(alpha), math.sin(alpha)
    y2 = (-math.sin(q1), math.cos(q1), 0)
    along = tuple(c * x2[k] + s * ca * y2[k] + s * sa * (k == 2) for k in range(3))
    points = [(0, 0, 0), x2, tuple(a * x2[k] + b * along[k] for k in range(3)), (-b, 0, 0)]
    seen = [oblique(x) for x in points]
    p = Picture("Bennett's four-bar at the start")
    for name, k in (("first", 0), ("second", 1), ("third", 2)):
        p.body(name, seen[k], seen[k + 1])
    for k, name in enumerate(("O", "1", "2", "P")):
        p.pivot(seen[k], name, k in (0, 3), (-26, 4) if k in (0, 3) else (12, -8))
    return p


def peaucellier():
    h, r, angle = 0.35, 0.4, math.radians(45)
    reach = 2 * h * math.cos(angle / 2)
    far = (1 - r * r) / reach
    half, middle = angle / 2, (reach + far) / 2
    O, Q, C, D = (0, 0), (h, 0), turn(half, (reach, 0)), turn(half, (far, 0))
    A, B = (turn(half + k * math.acos(middle), (1, 0)) for k in (1, -1))
    p = Picture("Peaucellier's linkage, crank at 45 degrees")
    p.guide((1.2, -0.6), (1.2, 0.8))
    p.body("arm a", A, O, other_side=True)
    p.body("arm b", O, B, other_side=True)
    p.body("crank", Q, C)
    for name, one, two in (("ac", A, C), ("ad", D, A), ("bc", C, B), ("bd", B, D)):
        p.body(name, one, two)
    p.pivot(O, "O", True, (-26, 4))
    p.pivot(Q, "Q", True, (12, 4))
    for name, point in (("A", A), ("B", B), ("C", C), ("D", D)):
        p.pivot(point, name, shift=(-4, -12))
    return p


def chebyshev():
    angle = math.radians(120)
    A, O, D = turn(angle, (1, 0)), (0, 0), (2, 0)
    B = circles(A, 2.5, D, 2.5, 1)
    P = (2 * B[0] - A[0], 2 * B[1] - A[1])
    p = Picture("Chebyshev's lambda linkage, crank at 120 degrees")
    p.guide((0, 4), (4, 4))
    p.body("crank", A, O)
    p.body("coupler", A, P, shift=(95, -77))
    p.body("rocker", B, D)
    p.pivot(O, "O", True, (12, 4))
    p.pivot(D, "D", True, (12, 4))
    for name, point in (("A", A), ("B", B), ("P", P)):
        p.pivot(point, name, shift=(-22, -8))
    return p


def jansen_leg():
    B, O = (0, 0), (38, 7.8)
    A = (O[0] + 15, O[1])
    U, G = circles(B, 41.5, A, 50, 1), circles(B, 39.3, A, 61.9, -1)
    W = circles(B, 40.1, U, 55.8, 1)
    H = circles(W, 39.4, G, 36.7, -1)
    F = circles(H, 65.7, G, 49, -1)
    p = Picture("Jansen's leg at the start")
    p.body("crank", O, A)
    p.body("upper rod", U, A)
    p.body("lower rod", A, G)
    p.body("upper", B, U, W)
    p.body("link", H, W)
    p.body("lower", B, G)
    p.body("leg", G, H, F)
    p.pivot(B, "B", True, (12, -4))
    p.pivot(O, "O", True, (12, 22))
    p.pivot(A, "A", shift=(10, 4))
    p.pivot(G, "G", shift=(12, 14))
    for name, point in (("U", U), ("W", W), ("H", H), ("F", F)):
        p.pivot(point, name, shift=(-20, -8))
    return p


def stephenson():
    O, D, E, A = (0, 0), (1, 0), (1.2, 0.3), (0, 0.3)
    B = circles(A, 0.9, D, 0.7, 1)
    P = at(A, math.atan2(B[1] - A[1], B[0] - A[0]), (0.55, 0.45))
    Q = circles(P, 1, E, 0.6, 1)
    p = Picture("Stephenson's six-bar at the start")
    p.body("crank", O, A)
    p.body("coupler", A, B, P)
    p.body("rocker", B, D)
    p.body("rod", Q, P)
    p.body("lever", E, Q)
    p.see((-0.08, -0.05))
    for name, point, shift in (("O", O, (12, 4)), ("D", D, (12, 4)), ("E", E, (12, 4))):
        p.pivot(point, name, True, shift)
    p.pivot(A, "A", shift=(-26, 4))
    for name, point in (("B", B), ("P", P), ("Q", Q)):
        p.pivot(point, name, shift=(-8, -14))
    return p


def double_four_bar():
    O, D, E, S = (0, 0), (0.8, 0), (1.5, 0.05), (1.7, 0.9)
    B = at(O, math.radians(80), (0.35, 0))
    C = circles(B, 0.75, D, 0.45, 1)
    F = at(D, math.atan2(C[1] - D[1], C[0] - D[0]), (0.4, 0.15))
    G = circles(F, 0.7, E, 0.5, 1)
    p = Picture("Two four-bars in a row at the start")
    p.body("crank", O, B)
    p.body("bar", B, C, other_side=True)
    p.body("rocker", D, C, F, shift=(52, 24))
    p.body("rod", F, G, other_side=True)
    p.body("lever", E, G)
    p.spring(S, G)
    for name, point, shift in (("O", O, (12, 4)), ("D", D, (12, 4)), ("E", E, (12, 4)), ("S", S, (12, 4))):
        p.pivot(point, name, True, shift)
    for name, point in (("B", B), ("C", C), ("F", F), ("G", G)):
        p.pivot(point, name, shift=(-8, -14))
    return p


def double_wishbone():
    seen = lambda x, y, z: oblique((y, -x, z))             # from the front, outwards to the right
    UF, UB, U = seen(-0.048, 0.446, 0.245), seen(-0.268, 0.478, 0.196), seen(-0.053, 0.716, 0.215)
    LF, LB, L = seen(0.223, 0.307, 0), seen(-0.223, 0.307, 0), seen(-0.036, 0.787, -0.118)
    T, R, S = seen(-0.250, 0.448, 0.054), seen(-0.176, 0.821, -0.016), seen(-0.040, 0.910, -0.026)
    p = Picture("Double wishbone, from the front")
    p.body("upper", UF, U, UB, shift=(-30, -28))
    p.body("lower", LF, L, LB)
    p.body("upright", U, L, R, S, shift=(30, -72))
    p.body("tie rod", T, R, shift=(-50, -8))
    for point in (UF, UB, LF, LB, T):
        p.pivot(point, fixed=True)
    for name, point in (("U", U), ("L", L), ("T", R), ("S", S)):
        p.pivot(point, name, shift=(10, 4))
    return p


def askew(flat, title):
    """A plane picture as seen when its plane is upright and turned away."""
    seen = lambda x: oblique((0.75 * x[0], 0.65 * x[0], x[1]))
    p = Picture(title)
    p.points = [seen(x) for x in flat.points]
    p.shapes = [(kind, note, tuple(seen(x) for x in points)) for kind, note, points in flat.shapes]
    return p


def slider_crank_spatial():
    return askew(slider_crank(), "Slider-crank with hinges in space, crank turned by 50 degrees")


def n_four_bar_spatial():
    return askew(n_four_bar(), "Four-bar windows with hinges in space, while they fall")


def parallel_robot():
    p = Picture("Planar parallel robot at the start")
    tip = {}
    for side, way, crank in (("l", -1, -150), ("r", 1, -30)):
        pivot, u, v = (0.2 * way, 0), (0.0866 * way, 0.05), (-0.07 * way, 0.07)
        elbow = at(pivot, math.radians(crank), (0.4, 0))
        rod = math.radians(-34.1725 if way < 0 else -145.8275)
        end = at(elbow, rod, (0.6, 0))
        add = lambda a, b: (a[0] + b[0], a[1] + b[1])
        right = way > 0                                   # names stand mirrored, outside the parallelograms
        p.body(f"crank_{side}", pivot, elbow, other_side=right, shift=(-29 * way, -15), colour=0)
        p.body(f"crank_bar_{side}", add(pivot, u), add(elbow, u), other_side=not right, shift=(0, -4), colour=3)
        p.body(f"rod_{side}", elbow, end, other_side=not right, shift=(0, 4), colour=1)
        p.body(f"rod_bar_{side}", add(elbow, v), add(end, v), other_side=right, shift=(-10 * way, -2), colour=5)
        p.body(f"elbow_{side}", elbow, add(elbow, u), add(elbow, v), shift=(30 * way, 30), colour=4)
        for place, fixed in ((pivot, True), (add(pivot, u), True), (elbow, False), (add(elbow, u), False),
                             (add(elbow, v), False), (end, False), (add(end, v), False)):
            p.pivot(place, fixed=fixed)
        tip[side] = (end, add(end, v))
    p.body("platform", tip["l"][0], tip["r"][0], tip["l"][1], tip["r"][1], shift=(0, 34), colour=2)
    return p


def car_axis():
    yb = 0.1                                              # drawn with the right wheel on top of a bump
    right_wheel, left = (math.sqrt(1 - yb * yb), yb), (-0.05, 0.4975)
    right = (left[0] + math.sqrt(1 - 0.12**2), left[1] - 0.12)
    p = Picture("The car axis, its right wheel on a bump")
    p.guide((0, 0), right_wheel)
    p.guide((0.006, -0.0597), (-0.075, 0.746))
    p.spring((0, 0), left)
    p.spring(right_wheel, right)
    p.body("rod", left, right)
    p.pivot((0, 0), "O", True, (-26, 4))
    p.pivot(right_wheel, "wheel", shift=(-22, 24))
    p.pivot(left, "left", shift=(-42, 4))
    p.pivot(right, "right", shift=(-4, -14))
    return p


def suspension():
    seen = lambda x, y, z: oblique((-y, 0.55 * x, z))      # from behind and above, left to the left
    p = Picture("The car's suspension from behind")
    at_chassis = []
    for s, side in ((1, "left"), (-1, "right")):
        U, L, S = (-0.02, 0.42 * s, 0.16), (0, 0.32 * s, -0.11), (-0.02, 0.46 * s, 0.38)
        UB, LB, LS = (-0.03, 0.66 * s, 0.18), (0.01, 0.70 * s, -0.13), (0, 0.55 * s, -0.11)
        T, R, W = (-0.14, 0.68 * s, -0.04), (-0.14, 0.34 * s, -0.05), (0, 0.75 * s, 0)
        BD, D, B = (-0.08, 0.50 * s, 0.05), (-0.06, 0.52 * s, -0.12), (-0.30, 0.30 * s, 0.02)
        A, RW, AS, top = (-2.1, 0.55 * s, -0.02), (-2.5, 0.75 * s, 0), (-2.45, 0.60 * s, 0), (-2.45, 0.58 * s, 0.4)
        for name, colour, *points in (("", 0, U, UB), ("", 1, L, LB), ("", 2, UB, LB, T, W), ("", 3, R, T), ("", 4, B, BD),
                                      ("", 5, BD, D), ("", 6, A, RW)):
            p.body(name, *(seen(*x) for x in points), colour=colour)
        p.spring(seen(*S), seen(*LS))
        p.spring(seen(*top), seen(*AS))
        for wheel in (W, RW):
            p.spring(seen(*wheel), seen(wheel[0], wheel[1], -0.3))
            p.pivot(seen(wheel[0], wheel[1], -0.3), fixed=True)
            p.pivot(seen(*wheel))
        for point in (U, L, S, UB, LB, T, R, BD, D, B, A, top):
            p.pivot(seen(*point))
        at_chassis.append((U, L, S, R, B, A, top))
    p.body("", seen(*at_chassis[0][3]), seen(*at_chassis[1][3]), colour=3)
    p.body("", seen(*at_chassis[0][4]), seen(*at_chassis[1][4]), colour=4)
    for (_, low, high, _, _, arm, top), far in zip(at_chassis, at_chassis[::-1]):
        for a, b in ((low, high), (high, top), (top, arm), (arm, low)):
            p.guide(seen(*a), seen(*b))
        p.guide(seen(*low), seen(*far[1]))
        p.guide(seen(*arm), seen(*far[5]))
    return p


def ride():
    length, foot, between, high, radius = 0.4, 0.25, 0.2, 0.35, 0.3
    p = Picture("A quarter of a car on wishbones")
    p.guide((0, -0.1), (0, 0.5))
    p.spring((foot, 0), (foot, high))
    p.spring((length, -radius), (length, 0))
    p.guide((length - 0.1, -radius), (length + 0.1, -radius))
    p.body("body", (0, 0), (0, between), (foot, high))
    p.body("lower", (0, 0), (length, 0), other_side=True)
    p.body("upright", (length, 0), (length, between), other_side=True)
    p.body("upper", (0, between), (length, between))
    for point, name, shift in (((0, 0), "L", (-20, 14)), ((0, between), "U", (-22, 4)), ((length, 0), "W", (12, 14)),
                               ((length, between), "T", (12, 0))):
        p.pivot(point, name, shift=shift)
    return p


def limousine():
    seen = lambda x, y, z: oblique((-y, 0.55 * x, z))      # from behind and above, left to the left
    p = Picture("A saloon on bushings, from behind")
    corners = {}
    for axle, x0, sag in (("F", 0, 0.02), ("R", -3.1, 0.017)):
        for s in (1, -1):
            at = lambda x, y, z: seen(x0 + x, y * s, z)
            A, B, C, S = at(0.18, 0.37, -0.10), at(-0.20, 0.37, -0.10), at(0.01, 0.75, -0.13), at(0, 0.59, -0.09)
            U, V, top = at(0.13, 0.48, 0.17), at(-0.16, 0.47, 0.16), at(0, 0.52, 0.50)
            OU, OV, T, W = at(0.01, 0.72, 0.20), at(-0.03, 0.72, 0.20), at(-0.14, 0.73, -0.04), at(0, 0.81, 0)
            R, H, E, D = at(-0.15, 0.36, -0.05), at(-0.30, 0.32, 0.02), at(-0.07, 0.60, 0.06), at(-0.06, 0.61, -0.09)
            post = at(0, 0.81, -0.34)
            for colour, *points in ((1, A, B, C), (0, U, OU), (0, V, OV), (2, C, OU, OV, T, W), (3, R, T), (4, H, E), (5, E, D)):
                p.body("", *points, colour=colour)
            p.body("", H, at(-0.30, 0, 0.02), colour=4)
            p.spring(top, S)
            p.spring(W, post)
            p.pivot(post, fixed=True)
            for point in (A, B, C, U, V, OU, OV, T, W, R, H, E, D, top):
                p.pivot(point)
            corners[axle, s] = (A, B, top)
    p.body("", *(seen(-0.15, y, -0.05) for y in (0.36, -0.36)), colour=3)
    mounts = [seen(x, y, 0.02) for x, y in ((0.30, 0.42), (0.30, -0.42), (-0.35, -0.40), (-0.35, 0.40))]
    p.body("", *mounts, colour=6)
    p.body("", *(seen(x, y, 0.05) for x, y in ((0.05, 0.30), (0.05, -0.30), (-0.85, -0.20), (-0.85, 0.20))), colour=7)
    for s in (1, -1):
        (front_a, front_b, front_top), (rear_a, rear_b, rear_top) = corners["F", s], corners["R", s]
        for a, b in ((front_top, rear_top), (rear_top, rear_a), (rear_top, rear_b), (front_top, mounts[0 if s > 0 else 1])):
            p.guide(a, b)
    p.guide(corners["R", 1][2], corners["R", -1][2])
    p.guide(corners["F", 1][2], corners["F", -1][2])
    for point in mounts:
        p.pivot(point)
    return p


def bogie():
    """From its right, behind it to the left; rods, which are closures, and springs in grey."""
    seen = lambda x, y, z: (x + 0.38 * y, z + 0.45 * y)
    p = Picture("The bogie from its right")
    ball, cradle, top, guide = (-0.9, 0, -0.05), (-0.765, 0, 0), (-1.25, 0.45, 0.2), (-0.215, 0, -0.15)
    rear = lambda x, y, z: (ball[0] + x, ball[1] + y, ball[2] + z)
    riding = lambda x, y, z: (cradle[0] + x, cradle[1] + y, cradle[2] + z)
    wheels = [(1, (0, 0.75, 0), 0.32), (2, (-1.7, 0.75, -0.1325), 0.1875), (1, (0, -0.75, 0), 0.32), (2, (-1.7, -0.75, -0.1325), 0.1875)]

    def bars(name, colour, *ways, **where):
        for way in ways:
            for a, b in zip(way, way[1:]):
                p.body(name, seen(*a), seen(*b), colour=colour, **where)
                name = ""

    def wheel(colour, middle, radius):
        p.body("", *round_about(*seen(*middle), radius, radius), colour=colour)

    for colour, middle, radius in wheels[:2]:
        wheel(colour, middle, radius)
    crank = rear(-0.35, 0.30, 0.05)
    p.guide(seen(crank[0], crank[1] + 0.15, crank[2]), seen(*top))
    for side in (1, -1):
        pin = (-0.45, 0.42 * side, -0.10)
        p.guide(seen(pin[0] - 0.15, pin[1], pin[2]), seen(*riding(0.165, 0.42 * side, 0.08)))
    bars("HF", 0, ((0, 0, 0), ball), ((0, 0.75, 0), (0, -0.75, 0)), ((-0.45, 0.55, -0.17), (-0.45, 0.42, -0.1), (-0.45, -0.42, -0.1), (-0.45, -0.55, -0.17)),
         ((-0.45, 0.42, -0.1), (-0.45, 0.45, 0.2), top), shift=(150, -14))
    bars("HR", 5, (ball, rear(-0.8, 0, -0.06)), (rear(-0.8, 0.75, -0.0825), rear(-0.8, -0.75, -0.0825)), (rear(-0.4, 0.55, -0.12), rear(-0.4, -0.55, -0.12)),
         (rear(-0.35, 0, -0.04), crank), shift=(-24, 2))
    bars("CR", 3, (riding(0, 0.55, 0.1), riding(0, -0.55, 0.1)), (riding(0.165, 0.42, 0.08), riding(0, 0.42, 0.1)),
         (riding(0.165, -0.42, 0.08), riding(0, -0.42, 0.1)), (riding(0, 0, 0.1), riding(0.1, 0, -0.15)), shift=(-30, -18))
    for name, side in (("L1", 1), ("L2", -1)):
        bars(name, 4, ((-0.5, 0.55 * side, -0.17), (-1.3, 0.55 * side, -0.17)), other_side=side > 0, shift=(10 + 10 * side, 0))
    bars("L3", 4, (riding(0.10, 0, -0.15), guide), other_side=True)
    for name, side in (("K1", 1), ("K2", -1)):
        bars(name, 6, ((-0.45, 0.42 * side, -0.1), (-0.6, 0.42 * side, -0.1)), other_side=True)
    bars("K3", 6, (crank, (crank[0], crank[1] + 0.15, crank[2])))
    for colour, middle, radius in wheels[2:]:
        wheel(colour, middle, radius)
    for point in (ball, crank, guide, riding(0.10, 0, -0.15), top, (crank[0], crank[1] + 0.15, crank[2]), *(w[1] for w in wheels)):
        p.pivot(seen(*point))
    for side in (1, -1):
        for point in ((-0.45, 0.42 * side, -0.1), (-0.6, 0.42 * side, -0.1), riding(0.165, 0.42 * side, 0.08), (-0.5, 0.55 * side, -0.17),
                      (-1.3, 0.55 * side, -0.17)):
            p.pivot(seen(*point))
    return p


def quarter_car():
    hub, tower = (0, 0.3), (0, 0.9)
    p = Picture("The quarter car")
    p.see((0.16, 0.9))
    p.spring((0, 0), hub)
    p.spring(hub, tower)
    p.guide((-0.25, 0.22), (-0.25, 1.02))
    p.body("wheel", (-0.25, 0.3), hub, other_side=True)
    p.body("body", (-0.85, 0.9), tower, (-0.65, 1.2))
    p.slider((-0.25, 0.9))
    p.pivot((0, 0), "road", True, (14, 8))
    p.pivot(hub, "hub")
    p.pivot(tower, "tower")
    return p


def round_about(x, y, rx, ry, n=48):
    """A polygon for an ellipse."""
    return [(x + rx * math.cos(2 * math.pi * k / n), y + ry * math.sin(2 * math.pi * k / n)) for k in range(n)]


def restrained_wheelset():
    """From above, x to the right and y upwards: turned and shifted a little; springs to the frame that runs along."""
    p = Picture("A wheelset on springs from above, shifted and turned")
    turned, shift = 0.07, (0, 0.05)
    put = lambda point: at(shift, turned, point)
    for y in (0.75, -0.75):
        p.guide((-1.15, y), (1.15, y))
    for side in (1, -1):
        small, wide = 0.42, 0.46                               # cones: narrower towards the outside
        p.body("", *(put((x, side * y)) for x, y in ((-wide, 0.69), (wide, 0.69), (small, 0.83), (-small, 0.83))), colour=1)
        p.spring(put((0, side * 1.0)), (0.95, side * 1.0))
        p.pivot((0.95, side * 1.0), None, True)
    p.body("wheelset", put((0, -1.0)), put((0, 1.0)), colour=0, other_side=True, shift=(8, 60))
    p.spring(put((0, 1.0)), (0, 1.45))
    p.pivot((0, 1.45), "ky", True, (14, 8))
    p.pivot(put((0, 0)), "y, psi", shift=(10, 4))
    return p


def wheelset():
    half, r = 0.1506, 0.1                   # from behind; cones drawn steeper than they are
    p = Picture("The wheelset on its rails")
    p.see((-0.32, -0.16), (0.32, 0.1))
    p.body("", (-0.23, 0.0), (0.23, 0.0), colour=6)
    for s in (-1, 1):
        p.body("", (s * (half - 0.03), r + 0.006), (s * (half + 0.03), r - 0.006), (s * (half + 0.03), -r + 0.006),
               (s * (half - 0.03), -r - 0.006), colour=1)
        p.body("", *((s * half + 0.06 * math.sin(a), -r - 0.06 + 0.06 * math.cos(a)) for a in
                     [k * math.pi / 12 for k in range(-12, 12)]), colour=0)
        p.spring((s * 0.32, 0), (s * 0.23, 0))
        p.pivot((s * 0.32, 0), "", True)
        p.pivot((s * half, -r), "L" if s > 0 else "R", shift=(-26, -2))
    return p


def rolling_wheel():
    """From above: the way of the middle over one wave, drawn wider, and the axle at five places of it."""
    p = Picture("The wave of a wheelset from above, its amplitude drawn 300 times as large")
    length, high = 11.65, 0.9                                  # half of the true length of the wave, to scale with the axle
    for y in (0.75, -0.75):
        p.guide((-0.8, y), (length + 0.8, y))
    wave = [(length * k / 60, high * math.cos(2 * math.pi * k / 60)) for k in range(61)]
    for a, b in zip(wave, wave[1:]):
        p.guide(a, b)
    for k in range(0, 61, 15):
        x, y = wave[k]
        angle = -0.5 * math.sin(2 * math.pi * k / 60)
        put = lambda point: at((x, 0.12 * y / high), angle, point)
        for side in (1, -1):
            p.body("", *(put((u, side * w)) for u, w in ((-0.46, 0.69), (0.46, 0.69), (0.43, 0.83), (-0.43, 0.83))), colour=1)
        p.body("", put((0, -0.9)), put((0, 0.9)), colour=0)
    return p


def hydraulic_excavator():
    """At its start; cylinders as springs."""
    angles = [math.radians(angle) for angle in (25, 25 - 95, 25 - 95 - 60)]
    O, C = (0, 0), (0.45, -0.35)
    boom = lambda point: at(O, angles[0], point)
    stick = lambda point: at(boom((2.8, 0)), angles[1], point)
    bucket = lambda point: at(stick((1.5, 0)), angles[2], point)
    lug, pin = bucket((-0.05, 0.25)), stick((1.2, 0))
    eye = circles(pin, 0.3, lug, 0.33, 1)
    p = Picture("The arm of an excavator with its cylinders, at the start")
    p.spring(C, boom((1.2, 0.25)))
    p.spring(boom((1.3, 0.5)), stick((-0.4, 0.1)))
    p.spring(stick((0.1, 0.35)), eye)
    p.body("boom", O, boom((1.3, 0.5)), boom((2.8, 0)))
    p.body("stick", stick((-0.4, 0.1)), stick((0.1, 0.35)), stick((1.5, 0)), boom((2.8, 0)))
    p.body("bucket", bucket((0, 0)), lug, bucket((0.8, 0)))
    p.body("", pin, eye, colour=4)
    p.body("", eye, lug, colour=6)
    p.pivot(O, "foot", True, (-34, 4))
    p.pivot(C, None, True)
    for point in (boom((2.8, 0)), stick((1.5, 0)), pin, eye, lug, boom((1.2, 0.25)), boom((1.3, 0.5)), stick((-0.4, 0.1)), stick((0.1, 0.35))):
        p.pivot(point)
    return p


def toggle_press():
    """On its anvil's side of the start, with the knee half straight."""
    l, u = 0.3, math.radians(35)
    K, R = (l * math.sin(u), -l * math.cos(u)), (0, -2 * l * math.cos(u))
    low = -2 * l * math.cos(math.radians(8))
    p = Picture("A toggle press, its ram above the anvil")
    p.guide(R, (0, low))
    p.see((-0.2, low))
    p.body("upper", (0, 0), K)
    p.body("lower", K, R)
    p.body("anvil", (-0.12, low - 0.04), (0.12, low - 0.04), other_side=True, colour=6)
    p.slider(R)
    p.pivot((0, 0), "O", True, (-30, 4))
    p.pivot(K, "K")
    p.pivot(R, "R", shift=(-28, 4))
    return p


def jansen_walker():
    """At the start, about to fall on its feet; the pair of legs behind is paler."""
    unit, height = 0.01, 0.85
    length = {name: unit * x for name, x in zip("abcdefghijklm", (38, 41.5, 39.3, 40.1, 55.8, 39.4, 36.7, 65.7, 49, 50, 61.9, 7.8, 15))}
    p = Picture("A machine on four of Jansen's legs at the start")
    joints = []

    def leg(side, phase, colour):
        own = phase if side == 1 else math.pi - phase
        place = lambda point: (side * (point[0] - length["a"]), point[1] + height)
        B, O = (0, 0), (length["a"], length["l"])
        A = at(O, own, (length["m"], 0))
        U, G = circles(B, length["b"], A, length["j"], 1), circles(B, length["c"], A, length["k"], -1)
        W = circles(B, length["d"], U, length["e"], 1)
        H = circles(W, length["f"], G, length["g"], -1)
        F = circles(H, length["h"], G, length["i"], -1)
        for points in ((U, A), (A, G), (B, U, W), (H, W), (B, G), (G, H, F), (O, A)):
            p.body("", *map(place, points), colour=colour)
        joints.extend(map(place, (A, U, W, G, H)))

    for phase, colour in ((math.pi, 6), (0, 0)):
        for side in (1, -1):
            leg(side, phase, colour + (side < 0 and phase == 0))
    p.body("trunk", (-length["a"], height), (length["a"], height), (0, height + length["l"]), shift=(0, -2), colour=2)
    p.guide((-0.95, 0), (0.95, 0))
    for point in joints + [(-length["a"], height), (length["a"], height), (0, height + length["l"])]:
        p.pivot(point)
    return p


def robot_leg():
    """In the middle of its motion, half crouched."""
    front, rear = math.radians(-50), math.radians(-130)
    hips = ((0.03, 0), (-0.03, 0))
    knees = [at(hip, angle, (0.1, 0)) for hip, angle in zip(hips, (front, rear))]
    foot = circles(knees[0], 0.2, knees[1], 0.2, 1)
    foot = foot if foot[1] < -0.1 else circles(knees[0], 0.2, knees[1], 0.2, -1)
    p = Picture("A leg of a robot: a five-bar linkage with a motor at each hip")
    p.see((-0.2, 0.03))
    p.see((0.2, -0.3))
    p.body("trunk", (-0.08, 0.02), (0.08, 0.02), other_side=True, colour=6)
    for name, hip, knee in zip(("front", "rear"), hips, knees):
        p.body(f"thigh_{name}", hip, knee, other_side=name == "rear")
        p.body(f"shank_{name}", knee, foot, other_side=name == "rear")
    for point in knees:
        p.pivot(point)
    p.pivot(hips[0], None, True)
    p.pivot(hips[1], None, True)
    p.pivot(foot, "foot", shift=(10, 4))
    return p


def flexible_robot():
    """At 0.4 s; the links are half waves of the deflections in their middles, drawn 40 times as large."""
    tool, larger = (0.25579, 0.40346), 40
    p = Picture("A five-bar robot with flexible links at 0.4 s: deflections times 40")
    elbows = []
    for side, way, origin, crank, middle in (("l", -1, (0, 0), 2.1983, -1.5e-4), ("r", 1, (0.5, 0), 0.90136, 6.9e-4)):
        elbow = at(origin, crank, (0.25, 0))
        length, angle = math.dist(elbow, tool), math.atan2(tool[1] - elbow[1], tool[0] - elbow[0])
        p.body(f"crank_{side}", origin, elbow, other_side=way < 0)
        p.curve(f"link_{side}", *(at(elbow, angle, (length * k / 16, larger * middle * math.sin(math.pi * k / 16))) for k in range(17)),
                shift=(34 * way, -14))
        p.pivot(origin, f"motor_{side}", True, (16, 4))
        elbows.append(elbow)
    for elbow in elbows:
        p.pivot(elbow)
    p.pivot(tool, "tool", shift=(-16, -14))
    return p


def flexible_blade():
    """At 0.1 s, seen along y: the first mode, 1.7 mm at the end, from the line between hinge and corner, 100 times as large."""
    tip, deflection, larger = (0.48897, -0.07771), 1.7e-3, 100
    p = Picture("A flexible blade at 0.1 s: bending times 100")
    pin, down, length = at((0.5, -0.35), 4.0, (0.06, 0)), math.atan2(tip[1], tip[0]), math.hypot(*tip)
    bent = ((k / 16, larger * deflection * ((k / 16)**2 * (3 - k / 16) / 2 - k / 16)) for k in range(17))
    p.curve("blade", *(at((0, 0), down, (length * x, z)) for x, z in bent), shift=(20, -20))
    p.body("rod", tip, pin)
    p.body("crank", (0.5, -0.35), pin)
    p.pivot((0, 0), "hinge", True, (-12, 42))
    p.pivot((0.5, -0.35), "motor", True, (12, -8))
    p.pivot(pin)
    p.pivot(tip)
    return p


def flexible_slider_crank():
    """The crank at 2 rad; the rod is a half wave, drawn 40 times as large."""
    centre, slider, larger = (0, 0.1, 0.12), (0.22, 0, 0), (0, 40 * 1.2e-4, -40 * 1.6e-4)
    pin = (0, 0.1 + 0.08 * math.cos(2), 0.12 + 0.08 * math.sin(2))
    p = Picture("A slider-crank in space with a flexible rod: deflection times 40")
    p.guide(oblique((0.15, 0, 0)), oblique((0.32, 0, 0)))
    p.body("crank", oblique(pin), oblique(centre), other_side=True)
    p.curve("rod", *(oblique(tuple(a + (b - a) * k / 16 + c * math.sin(math.pi * k / 16) for a, b, c in zip(pin, slider, larger))) for k in range(17)),
            shift=(10, -14))
    p.slider(oblique(slider))
    p.pivot(oblique(centre), "motor", True, (12, 4))
    p.pivot(oblique(pin), "pin", shift=(-24, -10))
    p.pivot(oblique(slider), "slider", shift=(-4, -20))
    return p


def flexible_pendulum():
    """At 0.5 s; the strip has a half wave of its deflection, drawn 20 times as large."""
    p = Picture("A flexible pendulum at 0.5 s: deflection times 20")
    place = lambda x, y: at((0, 0), -1.3726, (x, y))
    p.curve("strip", *(place(k / 16, 20 * 3e-3 * math.sin(math.pi * k / 16)) for k in range(17)), shift=(24, 0))
    p.pivot((0, 0), "pivot", True, (12, 4))
    p.pivot(place(1, 0), "weight", shift=(12, 4))
    return p


def crane():
    """At the start."""
    def circle(centre, radius):
        return [at(centre, math.pi * k / 24, (radius, 0)) for k in range(49)]

    drum, hook = (-5, -4), (1.0, -6)
    p = Picture("A crane: winch, boom, and a hook block on two falls")
    p.body("boom", (-5.4, -6.5), (0, 0), colour=6, shift=(-40, 40))
    p.curve("winch", *circle(drum, 0.15), shift=(-34, 22))
    p.curve("tip", *circle((0, 0), 0.2), shift=(-24, -18))
    p.curve("hook", *circle(hook, 0.2), shift=(46, 4))
    p.curve("", (-5.09, -3.88), (-0.13, 0.15))
    p.curve("", (0.2, 0.02), (0.8, -6.02))
    p.curve("", (1.2, -5.99), (0.6, 0))
    p.pivot((0.6, 0), "end", True, (12, 4))
    p.pivot(drum, None, True)
    p.pivot((0, 0), None, True)
    return p


def quarter_car_on_tyre():
    """At the start."""
    p = Picture("A quarter of a car on a tyre before a bump")
    bump = [(0.45 + 1.2 * k / 24, 0.06 * (1 - math.cos(2 * math.pi * k / 24))) for k in range(25)]
    p.body("body", (-0.35, 0.75), (0.35, 0.75), (0.35, 0.95), (-0.35, 0.95), colour=0, shift=(-8, -14))
    p.curve("tyre", *[at((0, 0.293), math.pi * k / 24, (0.313, 0)) for k in range(49)], shift=(44, 4))
    p.curve("", (0, 0.293), (0, 0.75))
    p.curve("road", (-0.6, 0), *bump, (1.9, 0), shift=(40, -12))
    p.pivot((0, 0.293), "wheel", False, (-52, -8))
    return p


def valve_train():
    """At half of the opening."""
    def lift(angle):
        """Over the angle of the cam."""
        x, y = angle / math.radians(80), (angle - math.radians(100)) / math.radians(80)
        if x < 1:
            return 0.009 * (35 * x ** 4 - 84 * x ** 5 + 70 * x ** 6 - 20 * x ** 7)
        return 0.009 * (1 if y < 0 else max(0, 1 - y + math.sin(2 * math.pi * y) / (2 * math.pi)) if y < 1 else 0)

    turned = math.radians(40)
    path = lambda angle: at((0, 0), math.pi / 2 + turned - angle, (0.035 + lift(angle), 0))
    profile = []
    for k in range(181):
        angle = 2 * math.pi * k / 180
        (x, y), (a, b), (c, d) = path(angle), path((angle - 1e-4) % (2 * math.pi)), path((angle + 1e-4) % (2 * math.pi))
        size = math.hypot(c - a, d - b)
        profile.append((x + 0.009 * (d - b) / size, y - 0.009 * (c - a) / size))
    roller = path(turned)
    p = Picture("A cam, the roller of a valve, and its spring")
    p.curve("cam", *profile, shift=(60, 0))
    p.curve("roller", *(at(roller, math.pi * k / 24, (0.009, 0)) for k in range(49)), shift=(-60, 0))
    top = (0, roller[1] + 0.03)
    p.body("valve", roller, top, colour=2, shift=(12, 0))
    p.spring(top, (0, top[1] + 0.03))
    p.pivot((0, 0), "shaft", True, (12, 4))
    p.pivot((0, top[1] + 0.03), None, True)
    p.see((-0.05, 0), (0.05, 0))
    return p


def gearbox():
    """From above: shafts side by side, wheels as rectangles."""
    a1, a2 = 0.003 * 73 / (2 * math.cos(math.radians(15))), 0.004 * 76 / (2 * math.cos(math.radians(12)))
    r = [0.0015 * z / math.cos(math.radians(15)) for z in (20, 53)] + [0.002 * z / math.cos(math.radians(12)) for z in (18, 58)]
    p = Picture("A gearbox of two helical stages, from above")

    def wheel(name, x, y, radius, width=0.014, colour=0, shift=(0, 0)):
        p.body(name, (y - radius, x - width), (y - radius, x + width), (y + radius, x + width), (y + radius, x - width), colour=colour, shift=shift)

    for name, y, colour in (("input", 0, 0), ("middle", a1, 1), ("output", a1 + a2, 2)):
        p.body(name, (y, -0.02), (y, 0.18), colour=colour, shift=(6, -108))
        for x in (0, 0.14):
            p.pivot((y, x), None, True)
    wheel("20", 0.04, 0, r[0], colour=0, shift=(-14, 0))
    wheel("53", 0.04, a1, r[1], colour=1, shift=(30, 0))
    wheel("18", 0.1, a1, r[2], colour=1, shift=(-16, 0))
    wheel("58", 0.1, a1 + a2, r[3], colour=2, shift=(30, 0))
    return p


def planetary_gearbox():
    """At the start, with the teeth of all wheels."""
    a = 0.066
    p = Picture("A planetary gearbox: sun, three planets on an arm, ring")

    def wheel(name, centre, teeth, shift=(0, 0), ring=False):
        module, radius = 2 * a / 44, a * teeth / 44
        outs = [(-1 if ring else 1) * (module if k % 4 < 2 else -1.25 * module) for k in range(4 * teeth)]
        rim = [at(centre, math.pi * k / (2 * teeth), (radius + out, 0)) for k, out in enumerate(outs)]
        p.curve(name, *rim, rim[0], shift=shift)

    places = [at((0, 0), math.radians(angle), (a, 0)) for angle in (90, 210, 330)]
    wheel("ring", (0, 0), 68, shift=(36, -60), ring=True)
    wheel("sun", (0, 0), 20, shift=(72, -30))
    for name, place in zip("ABC", places):
        wheel(f"planet {name}", place, 24, shift=(85, -26))
    p.body("arm", *places, shift=(0, 44))
    for place in places:
        p.pivot(place)
    p.pivot((0, 0), None, True)
    return p


def half_shaft():
    """From behind, at 0.15 s."""
    reach, length, rise, radius = 0.7, 0.55, 0.12 * math.sin(1.35), 0.31
    inner, outer = (reach - math.sqrt(length**2 - rise**2), 0), (reach, rise)
    p = Picture("A half shaft from behind at 0.15 s")
    p.body("differential", (-0.1, 0), inner, other_side=True)
    p.body("wheel", (reach, rise - radius), (reach, rise + radius))
    p.body("axle", outer, (reach + 0.15, rise), other_side=True)
    p.body("shaft", inner, outer)
    p.pivot((-0.1, 0), "D", True, (12, -8))
    p.pivot(inner, "inner", shift=(-10, -18))
    p.pivot(outer, "outer", shift=(12, -14))
    return p


def unbalanced_shaft():
    p = Picture("A shaft with its disc beyond the second bearing")
    p.body("shaft", (-0.02, 0), (0.185, 0), other_side=True)
    p.body("disc", (0.17, -0.05), (0.17, 0.05), shift=(0, -60))
    p.pivot((0, 0), "1", True, (-4, -14))
    p.pivot((0.12, 0), "2", True, (-4, -14))
    return p


def scissor_lift():
    """At 6 s, half way."""
    length, angle = 1.6, math.acos(math.cos(math.radians(12)) - 0.225 / 1.6)
    right, rise, sheave, drum = length * math.cos(angle), length * math.sin(angle), 0.06, 0.08

    def circle(centre, radius):
        return [at(centre, math.pi * k / 24, (radius, 0)) for k in range(49)]

    p = Picture("A scissor lift of three cells, raised by a winch")
    p.guide((0.9, -sheave), (1.75, -sheave))
    for k in range(3):
        p.body("", (0, k * rise), (right, (k + 1) * rise), colour=0)
        p.body("", (right, k * rise), (0, (k + 1) * rise), colour=1)
    p.body("platform", (-0.1, 3 * rise + 0.03), (1.7, 3 * rise + 0.03), colour=2)
    p.curve("", (-0.5, sheave), (right, sheave))
    p.curve("", (right, -sheave), (-0.5, -sheave))
    p.curve("winch", *circle((-0.5, sheave - drum), drum), shift=(-10, -34))
    p.curve("roller", *circle((right, 0), sheave), shift=(70, -24))
    for k in range(4):
        p.pivot((0, k * rise), None, k == 0)
        if k:
            p.pivot((right, k * rise))
    for k in range(3):
        p.pivot((right / 2, (k + 0.5) * rise))
    return p


def clutch_start():
    """From the side: engine, clutch, chain, drum with its brake."""
    p = Picture("A drive line from the side: engine, plate clutch, chain and drum")
    low, high, r_a, r_b = 0, 0.3, 0.0346, 0.0769
    p.body("engine", (-0.26, low), (-0.1, low), colour=0, shift=(0, 30))
    p.body("clutch", (-0.1, low - 0.13), (-0.1, low + 0.13), colour=0, shift=(-34, -34))
    p.body("disc", (-0.06, low - 0.1), (-0.06, low + 0.1), colour=1, shift=(90, -70))
    p.body("shaft", (-0.06, low), (0.16, low), colour=1, shift=(-60, 34))
    p.body("chain", (0.16, low - r_a), (0.16, high + r_b), colour=3, shift=(-34, 10))
    p.body("drum", (-0.15, high - 0.12), (0.15, high - 0.12), (0.15, high + 0.12), (-0.15, high + 0.12), colour=2)
    p.body("", (-0.2, high), (-0.15, high), colour=2)
    p.body("brake", (-0.1, high + 0.135), (0.1, high + 0.135), colour=4, shift=(0, -14))
    for place in ((-0.26, low), (0.06, low), (-0.2, high)):
        p.pivot(place, None, True)
    return p


def geneva_drive():
    """Half-way through the first slot."""
    half, c = math.radians(45), 0.1
    crank = c * math.sin(half)
    p = Picture("A Geneva drive: a crank with a pin, and a wheel with four slots")
    rim = []
    for k in range(4):
        for along, across in ((crank, -0.005), (0.024, -0.005), *((0.024 - 0.0055 * math.sin(x), -0.0055 * math.cos(x)) for x in (0.4, 0.8, 1.2, 1.6, 2, 2.4, 2.8)),
                              (0.024, 0.0055), (crank, 0.0055)):
            rim.append(at((c, 0), math.pi + k * math.pi / 2, (along, across)))
    p.curve("wheel", *rim, rim[0], shift=(50, 40))
    p.body("crank", (0, 0), (crank, 0), shift=(0, 30))
    p.curve("pin", *(at((crank, 0), math.pi * k / 12, (0.005, 0)) for k in range(25)), shift=(-14, -18))
    p.pivot((0, 0), "O", True, (-12, -14))
    p.pivot((c, 0), "W", True, (12, -10))
    return p


def ratchet_jack():
    """At the start."""
    teeth, outer, root, length, out = 24, 0.06, 0.052, 0.04, 0.004
    p = Picture("A ratchet jack: wheel, lever and pawls, rack with the load")
    rim = [at((0, 0), 2 * math.pi * k / teeth, corner) for k in range(teeth) for corner in ((outer, 0), (root, 0))]
    p.curve("wheel", *rim, rim[0], shift=(118, 90))
    p.body("lever", (-0.13, -length), (-root - out, -length), (0, 0), shift=(-70, 26))
    p.body("pawl", (root + out, length), (root, 0), shift=(-78, 0))
    p.body("pawl", (-root - out, -length), (-root, 0), shift=(-34, 0))
    p.body("rack", (-0.025, -0.09), (-0.025, 0.09), shift=(0, -90))
    p.pivot((root + out, length), None, True)
    p.pivot((-root - out, -length))
    p.pivot((0, 0), None, True)
    return p


PICTURES = (andrews, four_bar, slider_crank, driven_slider_crank, n_four_bar, bricard, governor, spatial_slider_crank, stewart, bennett,
            peaucellier, chebyshev, jansen_leg, stephenson, double_four_bar, double_wishbone, slider_crank_spatial, n_four_bar_spatial,
            parallel_robot, car_axis, suspension, ride, crank_rocker, limousine, bogie, quarter_car, restrained_wheelset,
            rolling_wheel, wheelset, hydraulic_excavator, toggle_press, loose_pin, loose_slider, jansen_walker, robot_leg, flexible_robot,
            flexible_blade, flexible_slider_crank, flexible_pendulum, planetary_gearbox, half_shaft, unbalanced_shaft, gearbox, crane,
            scissor_lift, clutch_start, quarter_car_on_tyre, geneva_drive, valve_train,
            ratchet_jack)

if __name__ == "__main__":
    for make in PICTURES:
        make().write(HERE / make.__name__ / f"{make.__name__}.svg")
