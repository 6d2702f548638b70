# SPDX-License-Identifier: BSD-3-Clause
"""The demands of each closure, as geometry: lists of scalar jets that stay zero along the motion. Gradients by the bodies'
velocities, and the terms of the acceleration without any acceleration of the bodies, are derivatives of these."""
import functools

import numpy as np

from convention import broken
from expression_values import FUNCTIONS
from jets import cross, dot, matmul, matvec, transposed
from mechanism import normal


def across(axis):
    """Two unit vectors across an axis, which is fixed in a body."""
    return both_across(*axis)


@functools.lru_cache(1000)
def both_across(*axis):
    axis = np.array(axis)
    first = normal(cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))]))
    return first, cross(axis, first)


class Ends:
    """The two points of a closure, seen along the motion: `a`, `b` are jets (axes, place) of the bodies."""

    def __init__(self, closure, a, b):
        self.closure, (self.turn_a, place_a), (self.turn_b, place_b) = closure, a, b
        first, second = closure.points
        self.gap = place_b + matvec(self.turn_b, second.place) - place_a - matvec(self.turn_a, first.place)

    def on_first(self, vector):
        return matvec(self.turn_a, vector)

    def on_second(self, vector):
        return matvec(self.turn_b, vector)

    def coincide(self):
        return [self.gap.part(k) for k in range(3)]

    def parallel(self):
        mine = self.on_first(self.closure.vectors[0])
        return [dot(mine, self.on_second(v)) for v in across(self.closure.vectors[1])]

    def on_axis(self):
        return [dot(self.gap, self.on_first(v)) for v in across(self.closure.vectors[0])]

    def aligned(self):
        a, b = (point.axes for point in self.closure.points)
        return [dot(self.on_first(a[:, i]), self.on_second(b[:, k])) for i, k in ((0, 1), (0, 2), (1, 2))]

    def in_plane(self):
        return [dot(self.gap, self.on_first(self.closure.vectors[0]))]

    def crossed(self):
        return [dot(self.on_first(self.closure.vectors[0]), self.on_second(self.closure.vectors[1]))]

    def seen(self):
        """The place of the second point in the axes of the first."""
        axes = np.eye(3) if broken("curve in axes of ground") else transposed(self.on_axes())
        local = matvec(axes, self.gap)
        return [local.part(k) for k in range(3)]

    def on_axes(self):
        return matmul(self.turn_a, self.closure.points[0].axes)


def rod(ends, env):
    length = env.value(ends.closure.keys["length"])
    return [FUNCTIONS["sqrt"](dot(ends.gap, ends.gap)) - length]


def curve(ends, env):
    keys, (x, y, z) = ends.closure.keys, ends.seen()
    env.local = {"x": x, "y": y, "z": z}
    if "table" in keys:
        return [y - env.table(keys["table"])(x)]
    if "curve" in keys:
        texts = keys["curve"] if isinstance(keys["curve"], list) else [keys["curve"]]
        return [env.value(text) for text in texts]
    return [place - env.value(keys[key]) for key, place in (("y", y), ("z", z)) if key in keys]


ROWS = {
    "ball": lambda e, env: e.coincide(),
    "rod": rod,
    "revolute": lambda e, env: e.coincide() + e.parallel(),
    "universal": lambda e, env: e.coincide() + e.crossed(),
    "cylindrical": lambda e, env: e.on_axis() + e.parallel(),
    "prismatic": lambda e, env: e.on_axis() + e.aligned(),
    "weld": lambda e, env: e.coincide() + e.aligned(),
    "planar": lambda e, env: e.in_plane() + e.parallel(),
    "point_on_line": lambda e, env: e.on_axis(),
    "point_on_plane": lambda e, env: e.in_plane(),
    "point_on_curve": curve,
}


def coupler(closure, env):
    total = 0.0
    for name, factor in closure.keys["coupler"].items():
        total = env.q(name) * closure.scope.number(factor) + total
    return [total - closure.scope.number(closure.keys["equals"]) if "equals" in closure.keys else total]


def constraint(closure, env):
    return [env.value(closure.keys["constraint"])]


def drive(closure, env):
    q, keys = env.q(closure.keys["joint"]), closure.keys
    if keys.get("locked") == "yes":
        return [q]
    return [q - env.value(keys["angle"] if "angle" in keys else keys["displacement"])]


def screw(closure, env):
    """`pitch` is the advance in a turn."""
    joint = closure.keys["joint"]
    slide, turn = (env.coordinate(k) for k in joint.coordinates)
    return [slide - turn * (joint.pitch / (1 if broken("pitch of screws") else 2 * np.pi))]


ON_COORDINATES = {"coupler": coupler, "constraint": constraint, "drive": drive, "screw": screw}


def floating(closure):
    """True if the rows keep the value of the start instead of zero."""
    return closure.kind == "coupler" and "equals" not in closure.keys or closure.keys.get("locked") == "yes"
