#!/usr/bin/env python3
"""The cross-sections in this folder, made from their definitions: make_profiles.py [FOLDER] writes them all.

A section is a row of pieces, each a function of an inner coordinate, from left to right. Lengths are millimetres here and
metres in the files. In the files y counts outwards, away from the middle of the track, and z upwards; both begin on a wheel
where its radius is the nominal one, on a rail in the middle of its top.
"""

import math
import os
import sys

STEEPEST = math.radians(86)  # of what is written, upright: inclined by 1:20 it is below 89 degrees


# ---- pieces ----------------------------------------------------------------------------------------------------------

def arc(centre, radius, begin, end, up):
    """An arc about `centre` from y = begin to y = end, seen from above (up = 1: a head) or below (-1: a groove)."""
    a, b = (math.asin((y - centre[0]) / radius) for y in (begin, end))
    n = max(2, math.ceil(abs(b - a) / math.radians(1.0)), math.ceil(radius * abs(b - a) / 1.0))
    return [(centre[0] + radius * math.sin(a + (b - a) * i / n), centre[1] + up * radius * math.cos(a + (b - a) * i / n))
            for i in range(n + 1)]


def line(begin, end, spacing=0.5):
    n = max(1, math.ceil(math.dist(begin, end) / spacing))
    return [(begin[0] + (end[0] - begin[0]) * i / n, begin[1] + (end[1] - begin[1]) * i / n) for i in range(n + 1)]


def curve(f, begin, end, spacing):
    n = math.ceil(abs(end - begin) / spacing)
    return [(y, f(y)) for y in (begin + (end - begin) * i / n for i in range(n + 1))]


def joined(pieces):
    """One row of points. Two pieces agree where they meet to the digits of their definitions: a micrometre."""
    out = []
    for piece in pieces:
        if out:
            gap = math.dist(out[-1], piece[0])
            assert gap < 2e-3, f"pieces {gap} mm apart at y = {piece[0][0]}"
            piece = piece[1:]
        out += piece
    return out


# ---- S1002 -----------------------------------------------------------------------------------------------------------

# UIC 510-2 (4th edition, appendix B) and EN 13715 (annex B): the flange height over y from the running circle, mm,
# outwards; powers of y, lowest first.
S1002_TREAD = [0, -3.358537058e-2, 1.565681624e-3, -2.810427944e-5, 5.844240864e-8, -1.562379023e-8, 5.309217349e-15,
               -5.957839843e-12, 2.646656573e-13]
S1002_FILLET = [-4.320221063e+3, -1.038384026e+3, -1.065501873e+2, -6.051367875, -2.054332446e-1, -4.169739389e-3,
                -4.687195829e-5, -2.252755540e-7]


def power(c, y):
    value = 0.0
    for a in reversed(c):
        value = value * y + a
    return value


def s1002():
    """From the back of the flange outwards; heights are of the flange, so downwards."""
    back = -49.5 - 20.5 * math.sin(math.radians(80))
    down = [arc((-49.5, 9.519259302), 20.5, back, -62.764705882, 1),
            arc((-55, 16), 12, -62.764705882, -49.662510381, 1),
            arc((-58.558326413, 8.834924130), 20, -49.662510381, -39.764473993, 1),
            curve(lambda y: -93.576667419 - 2.747477419 * y, -39.764473993, -38.426669071, 0.25),
            arc((-26.210665, 16.446), 13, -38.426669071, -35, -1),
            curve(lambda y: power(S1002_FILLET, y), -35, -26, 0.25),
            curve(lambda y: power(S1002_TREAD, y), -26, 32.15796, 0.5),
            curve(lambda y: 1.364323640 - 0.066666667 * y, 32.15796, 60, 1)]
    return [(y, -z) for y, z in joined(down)]


# ---- rails -----------------------------------------------------------------------------------------------------------

def half_head(first, second):
    """The half of UIC 60 (60E1 of EN 13674-1) that has positive y: arcs of 300, 80 and 13 mm that pass into each other at
    y = first and second; the last one to the steepest angle (the side, 1:20, begins at 87.1 degrees, 36 mm outside)."""
    ends, pieces = [first, second], []
    centre, radius, begin = (0.0, -300.0), 300.0, 0.0
    for end, following in zip(ends, (80.0, 13.0)):
        pieces.append(arc(centre, radius, begin, end, 1))
        angle = math.asin((end - centre[0]) / radius)
        centre = (centre[0] + (radius - following) * math.sin(angle), centre[1] + (radius - following) * math.cos(angle))
        radius, begin = following, end
    pieces.append(arc(centre, radius, begin, centre[0] + radius * math.sin(STEEPEST), 1))
    return joined(pieces)


def mirrored(half):
    return [(-y, z) for y, z in reversed(half[1:])] + half


def uic60():
    return mirrored(half_head(20.456 / 2, 52.053 / 2))


def uic60_manchester():
    """As it is in the Manchester contact benchmark ("UIC60 v3"), measured there: the arc of 300 mm ends 10.5 mm from the
    middle; that of 13 mm passes into the side 36 mm outside."""
    third = 36 - 13 * math.cos(math.atan(1 / 20))  # where the centre of the third arc is
    slant = math.asin((third - 10.5 * 220 / 300) / 67)
    return mirrored(half_head(10.5, 10.5 * 220 / 300 + 80 * math.sin(slant)))


def circular(radius=80.0, width=72.0):
    """A rail whose head is one arc."""
    return mirrored(arc((0.0, -radius), radius, 0.0, width / 2, 1))


# ---- cones -----------------------------------------------------------------------------------------------------------

def blend(begin, end, angles, radius):
    """Between a straight line that ends with one inclination and another: the inclination over the length of the curve is a
    smooth step (of 5th degree, so that curvature begins and ends with nothing); its least radius is `radius`. Points from
    (0, 0)."""
    first, last = angles
    length = 1.875 * abs(last - first) * radius  # the step's greatest slope is 15/8
    n, points, y, z = 2000, [(begin, end)], begin, end
    for i in range(n):
        u = (i + 0.5) / n
        angle = first + (last - first) * u ** 3 * (10 - 15 * u + 6 * u * u)
        y, z = y + length / n * math.cos(angle), z + length / n * math.sin(angle)
        points.append((y, z))
    keep = max(1, n // math.ceil(abs(last - first) / math.radians(1.0)))
    return points[:-1:keep] + [points[-1]]


def cone(conicity, flank=70.0, fillet=10.0, top=8.0, height=28.0):
    """A cone that falls outwards by `conicity`, with a flange whose flank has `flank` degrees."""
    tread, side = -math.atan(conicity), -math.radians(flank)
    # Made from the origin inwards (growing -y), downwards along the flank, then over the flange's top to the level.
    inwards = lambda points: [(-y, z) for y, z in points]
    fillet_points = blend(0, 0, (tread, side), fillet)
    top_points = blend(0, 0, (side, 0.0), top)
    # The flank has the length that the height of the flange leaves it.
    fall = -fillet_points[-1][1] - top_points[-1][1]
    from_tread = 22.8  # the flank is where that of S1002 is, 12 mm below
    flank_length = (height - conicity * from_tread - fall) / math.sin(-side)
    assert flank_length > 0
    moved = lambda points, to: [(y + to[0], z + to[1]) for y, z in points]
    a = moved(fillet_points, (from_tread, -conicity * from_tread))
    b = line(a[-1], (a[-1][0] + flank_length * math.cos(side), a[-1][1] + flank_length * math.sin(side)), 0.25)
    c = moved(top_points, b[-1])
    return joined([list(reversed(inwards(part))) for part in (c, b, a)] +
                  [curve(lambda y: y * conicity, -from_tread, 60, 1)])


# ---- writing ---------------------------------------------------------------------------------------------------------

FILES = {
    "s1002.csv": (s1002, "Wheel S1002 (UIC 510-2, EN 13715)"),
    "uic60.csv": (uic60, "Head of rail UIC 60 (60E1 of EN 13674-1), upright"),
    "uic60_manchester.csv": (uic60_manchester, "Head of rail UIC 60 as in the Manchester contact benchmark, upright"),
    "circular.csv": (circular, "Head of a rail: one arc of 80 mm"),
    "cone20.csv": (lambda: cone(1 / 20), "Wheel: cone 1:20 with a flange of 70 degrees, fillets with continuous curvature"),
    "cone40.csv": (lambda: cone(1 / 40), "Wheel: cone 1:40 with a flange of 70 degrees, fillets with continuous curvature"),
}


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(os.path.abspath(__file__))
    for name, (make, words) in FILES.items():
        with open(os.path.join(folder, name), "w", encoding="ascii", newline="\n") as f:
            f.write(f"# {words}; made by make_profiles.py\n# y outwards, z upwards, m\ny,z\n")
            for y, z in make():
                f.write(f"{y / 1000:.12g},{z / 1000:.12g}\n")
    # The same wheel as an instrument of the MiniProf format measures it: from 70 mm inside, flange upwards.
    with open(os.path.join(folder, "s1002.whl"), "w", encoding="ascii", newline="\n") as f:
        points = s1002()
        f.write(f"Comment=S1002; made by make_profiles.py\nXYPoints={len(points)}\nColumnDef=X,Y\n\n")
        for y, z in points:
            f.write(f"{y + 70:.4f} {-z:.4f}\n")


if __name__ == "__main__":
    main()
