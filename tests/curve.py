# SPDX-License-Identifier: BSD-3-Clause
"""Kinematics beside Kempe's own, for tests: frames that turn and go on from each other, and the track in a left curve behind
straight track and a transition."""
import csv
import math
import pathlib

RAIL = pathlib.Path(__file__).resolve().parent.parent / "examples/profiles/uic60.csv"


def turn(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    i, j = ((1, 2), (2, 0), (0, 1))[axis]
    m = [[float(r == k) for k in range(3)] for r in range(3)]
    m[i][i], m[i][j], m[j][i], m[j][j] = c, -s, s, c
    return m


def times(a, b):
    return [[sum(a[r][k] * b[k][c] for k in range(3)) for c in range(3)] for r in range(3)]


def cross(a, b):
    return tuple(a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3))


class Frame:
    """A place and axes; `then` goes on from a point of it, by rotations about axes 0, 1, 2."""

    def __init__(self, at=(0, 0, 0), axes=turn(0, 0)):
        self.at, self.axes = at, axes

    def vector(self, *v):
        """From these axes to the ground's."""
        return tuple(sum(self.axes[r][k] * x for k, x in enumerate(v)) for r in range(3))

    def seen(self, v):
        """From the ground's axes to these."""
        return tuple(sum(self.axes[r][k] * v[r] for r in range(3)) for k in range(3))

    def point(self, x, y, z):
        return tuple(a + b for a, b in zip(self.at, self.vector(x, y, z)))

    def then(self, point, *turns):
        axes = self.axes
        for axis, angle in turns:
            axes = times(axes, turn(axis, angle))
        return Frame(self.point(*point), axes)


def between_rails(gauge=1.435, depth=0.014, slope=1 / 40):
    """Distance of the origins of both rails' profiles, over which cant is measured: rails UIC 60 lean inwards by the slope, and the
    gauge is that of their inner sides so far below their tops."""
    with open(RAIL, newline="") as file:
        points = [(float(row["y"]), float(row["z"])) for row in csv.DictReader(line for line in file if line[0] != "#")]
    c, s = math.cos(math.atan(slope)), math.sin(math.atan(slope))
    points = [(c * y - s * z, s * y + c * z) for y, z in points]
    level = max(z for _, z in points) - depth
    sides = [a[0] + (level - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) for a, b in zip(points, points[1:]) if a[1] <= level < b[1]]
    assert len(sides) == 1 and sides[0] < 0
    return gauge - 2 * sides[0]


class Track:
    """Its left curve: radius, middle, and the angle of its cant."""

    def __init__(self, before, lead, radius, cant):
        """The transition's heading is s^2/(2 radius lead): its end by Simpson's rule, and from there the radius to the left."""
        n, x, y = 400, 0, 0
        for i in range(n + 1):
            weight = (1 if i in (0, n) else 4 if i % 2 else 2) * lead / n / 3
            heading = (i / n * lead)**2 / (2 * radius * lead)
            x, y = x + weight * math.cos(heading), y + weight * math.sin(heading)
        end = lead / (2 * radius)
        self.radius, self.lean = radius, math.asin(cant / between_rails())
        self.middle = before + x - radius * math.sin(end), y + radius * math.cos(end)

    def inward(self, place):
        """Its level distance from the middle line."""
        return self.radius - math.hypot(place[0] - self.middle[0], place[1] - self.middle[1])

    def under(self, place):
        """The track's axes on its middle line beside a place, forwards, left and up."""
        heading = math.atan2(place[0] - self.middle[0], self.middle[1] - place[1])
        line = self.middle[0] + self.radius * math.sin(heading), self.middle[1] - self.radius * math.cos(heading), 0
        return Frame(line).then((0, 0, 0), (2, heading), (0, -self.lean))
