# SPDX-License-Identifier: BSD-3-Clause
"""Random linkages in space with a closed loop, friction that sticks in their pins and slides, and stops, as those of
random_friction.py in the plane. The axes of all joints are random; the last body is put where it closes the loop, by the
oracle's own places of the bodies before it."""
import pathlib

import numpy as np

from mechanics import Motion
from mechanism import Mechanism, normal
from random_friction import Linkage
from random_loops import rotation

REGULAR = 0.05  # least singular value of the closures by the dependent coordinates: no start is near a change point


class SpatialLinkage(Linkage):
    """Of a crank on the ground and a rod on a cross or a ball, to a rocker (four-bar), to a slider on the ground, behind a
    second crank (five-bar); of cylindrical joints, with friction in their rotations and their slides."""

    shapes, stream = ("universal-four-bar", "ball-four-bar", "slider-crank", "five-bar", "cylinders"), (3,)

    def make(self):
        """Drawn again where the start is near a change point, at which rates and reactions grow without bound."""
        for _ in range(100):
            self.document.update({"ground": {"points": {}}, "bodies": {}, "loops": {}, "start": {"q": {}, "hold": [], "qd": {}}})
            self.rotates = {}
            super().make()
            if self.least_value() > REGULAR:
                return
        raise RuntimeError("no regular start is found")

    def least_value(self):
        motion, built = self.motion()
        dependent = [k for k, name in enumerate(built.columns) if name not in self.document["start"]["hold"]]
        values = np.linalg.svd(motion.jacobian[0][:, dependent], compute_uv=False)
        return values[len(motion.jacobian[0]) - 1]

    def motion(self):
        """The oracle's mechanism at the start, as far as it is there."""
        built = Mechanism(self.document, pathlib.Path("."))
        values = np.array([[float(self.document["start"]["q"][name]) for name in built.columns]])
        built.q = values
        return Motion(built, np.zeros(1), values, np.zeros_like(values)), built

    def draw_gravity(self):
        g = 0.0 if self.chance(0.1) else 9.81
        return g * self.direction()

    def direction(self):
        return normal(self.random.normal(size=3))

    def exact(self, vector):
        return [self.text(x) for x in vector]

    def kind_of(self, joint):
        """Own reactions press in joints with one coordinate alone."""
        kind = super().kind_of(joint)
        return "static" if kind == "joint" and joint not in self.single else kind

    # -- bodies

    def add_link(self, name, joint, rubs=True):
        """A box along its x axis with an end; `joint`: the keys of its joint, whose coordinates have friction if `rubs`."""
        mass, length = self.number(0.3, 2), self.number(0.15, 0.8)
        across = mass * length**2 / 12
        self.document["bodies"][name] = {
            "joint": joint, "mass": self.text(mass),
            "com": self.exact(length * np.array([self.number(0.2, 0.8), *self.random.uniform(-0.2, 0.2, 2)])),
            "inertia": {"xx": self.text(0.3 * across), "yy": self.text(across), "zz": self.text(1.2 * across)},
            "points": {"E": self.exact([length, *self.random.uniform(-0.1, 0.1, 2)])}}
        names = joint.get("coordinates", [joint["name"]])
        kind = next(iter(set(joint) - {"name", "at", "coordinates"}))
        if len(names) == 1:
            self.single.add(names[0])
        for k, coordinate in enumerate(names):
            turns = kind != "prismatic" and not (kind == "cylindrical" and k == 0)
            value = self.number(-np.pi, np.pi) if turns and len(names) == 1 else self.number(-0.8, 0.8) * (1.0 if turns else 0.4)
            self.document["start"]["q"][coordinate] = self.text(value)
            if rubs:
                self.rotates[coordinate] = turns

    def pin(self, name, at):
        return {"name": name, "revolute": self.exact(self.direction()), "at": at}

    def add_cross(self, name, at):
        self.add_link(name, {"name": f"j{name}", "universal": "y", "at": at, "coordinates": [f"j{name}y", f"j{name}z"]})

    def add_ball(self, name, at):
        self.add_link(name, {"name": f"j{name}", "spherical": "x", "at": at,
                             "coordinates": [f"j{name}x", f"j{name}y", f"j{name}z"]}, rubs=False)

    def pose(self, point):
        """Place and axes of a point of a body in ground axes, before the last body is there."""
        motion, built = self.motion()
        body, name = point.split(".")
        place, axes = built.body(body).points[name]
        number = built.body(body).number
        return motion.point(number, place)[0][0], motion.turn[0, number] @ axes

    def close_by_rocker(self, point):
        """A rocker from the ground to a point, and the loop there."""
        place, _ = self.pose(point)
        self.document["ground"]["points"]["D"] = ["0", "0", "0"]
        joint = self.pin("jd", "ground.D")
        self.add_link("d", joint)
        axis = normal(np.array([float(x) for x in joint["revolute"]]))
        end = np.array([float(x) for x in self.document["bodies"]["d"]["points"]["E"]])
        turned = rotation(axis, float(self.document["start"]["q"]["jd"])) @ end
        self.document["ground"]["points"]["D"] = self.exact(place - turned)
        self.document["loops"]["C"] = {"ball": [point, "d.E"]}

    def begin_with_crank(self):
        self.single = set()
        self.document["ground"]["points"]["A"] = ["0", "0", "0"]
        self.add_link("a", self.pin("ja", "ground.A"))

    def make_universal_four_bar(self):
        self.begin_with_crank()
        self.add_cross("b", "a.E")
        self.close_by_rocker("b.E")
        self.begin(["ja"])

    def make_ball_four_bar(self):
        self.begin_with_crank()
        self.add_ball("b", "a.E")
        self.close_by_rocker("b.E")
        self.begin(["ja"])

    def make_five_bar(self):
        self.begin_with_crank()
        self.add_link("b", self.pin("jb", "a.E"))
        self.add_cross("c", "b.E")
        self.close_by_rocker("c.E")
        self.begin(["ja", "jb"])

    def make_slider_crank(self):
        self.begin_with_crank()
        self.add_cross("b", "a.E")
        place, _ = self.pose("b.E")
        axis, x = self.direction(), self.number(-0.5, 0.5)
        self.document["ground"]["points"]["S"] = self.exact(place - x * axis)
        self.document["bodies"]["slider"] = {
            "joint": {"name": "s", "prismatic": self.exact(axis), "at": "ground.S"},
            "mass": self.text(self.number(0.3, 2)), "points": {"P": ["0", "0", "0"]}}
        self.rotates["s"] = False
        self.single.add("s")
        self.document["start"]["q"]["s"] = self.text(x)
        self.document["loops"]["C"] = {"ball": ["b.E", "slider.P"]}
        self.begin(["ja"])

    def make_cylinders(self):
        """A crank and three cylindrical joints about axes in space, of which the last one closes the loop."""
        self.begin_with_crank()
        for name, at in (("b", "a.E"), ("c", "b.E")):
            self.add_link(name, {"name": f"j{name}", "cylindrical": self.exact(self.direction()), "at": at,
                                 "coordinates": [f"j{name}x", f"j{name}r"]})
        place, axes = self.pose("c.E")
        axis = self.direction()
        self.document["ground"]["points"]["D"] = self.exact(place + self.number(-0.3, 0.3) * axis)
        self.document["loops"]["C"] = {"cylindrical": ["ground.D", "c.E"],
                                       "axes": [self.exact(axis), self.exact(axes.T @ axis)]}
        self.begin(["ja"])
