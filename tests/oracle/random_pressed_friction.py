# SPDX-License-Identifier: BSD-3-Clause
"""Random mechanisms whose rotations share one axis, with friction by load in slides at every place of the tree and in
every frame: gravity, forces and springs have any direction, also that of the common axis; bodies elsewhere have nothing
to do with the slides."""
import numpy as np

from random_friction import Linkage
from random_loops import rotation


class PressedLinkage(Linkage):
    """The closed ones lie in the plane of x and y, as those that they are made of; open ones lie in any plane."""

    shapes, stream = ("slider-crank", "four-bar", "six-bar", "carriage", "wagon", "table"), (7,)

    def make(self):
        self.loose = []  # bodies whose points are pushed
        self.tilt = np.eye(3)
        super().make()
        self.loose += list(self.document["bodies"])
        self.add_others()
        self.add_pushes()

    def draw_gravity(self):
        """Along an axis, along the common axis of rotations and across it, or in any direction."""
        g = self.random.normal(size=3) if self.chance(0.5) else np.eye(3)[self.random.integers(3)] * self.random.choice([-1, 1])
        return 9.81 * g / np.linalg.norm(g)

    def vector(self, v):
        return [self.text(x) for x in v]

    def kind_of(self, joint):
        """A slide is never pressed by the reaction of a loop, which has no part across the plane."""
        kind = super().kind_of(joint) if self.document["loops"] else "joint"
        return "joint" if not self.rotates[joint] and (kind == "loop" or self.chance(0.8)) else kind

    # -- open mechanisms

    def add_carried(self, name, at, joint, kinds):
        """A body with a point on it at any height; `kinds`: whether each coordinate of its joint is a rotation."""
        mass, (x, y, z) = self.number(0.3, 3), self.random.uniform(-0.4, 0.4, 3)
        names = joint.get("coordinates", [joint["name"]])
        self.document["bodies"][name] = {
            "joint": {**joint, "at": at}, "mass": self.text(mass), "com": self.vector(self.random.uniform(-0.2, 0.2, 3)),
            "inertia": {"xx": self.text(0.02 * mass), "yy": self.text(0.025 * mass), "zz": self.text(0.03 * mass)},
            "points": {"E": {"at": self.vector([x, y, z]), "axes": self.turned_axes()} if self.chance(0.3) else self.vector([x, y, z])}}
        for coordinate, rotates in zip(names, kinds):
            self.rotates[coordinate] = rotates
            self.document["start"]["q"][coordinate] = self.text(self.number(-0.5, 0.5))
            if self.chance(0.8):
                self.document["start"]["qd"][coordinate] = self.text(self.number(-2, 2))
        return f"{name}.E"

    def turned_axes(self):
        """Axes turned about the common axis alone."""
        angle = self.number(-np.pi, np.pi)
        return {"x": self.vector([np.cos(angle), np.sin(angle), 0])}

    def root(self):
        """A point of the ground, in half of the models with axes of its own."""
        place = self.vector(self.random.uniform(-0.5, 0.5, 3))
        if self.chance(0.5):
            self.tilt = rotation(self.direction(), self.number(-np.pi, np.pi))
            self.document["ground"]["points"]["O"] = {"at": place, "axes": {"x": self.vector(self.tilt[:, 0]), "z": self.vector(self.tilt[:, 2])}}
        else:
            self.document["ground"]["points"]["O"] = place
        return "ground.O"

    def direction(self):
        v = self.random.normal(size=3)
        return v / np.linalg.norm(v)

    def slide(self, name):
        """Along x, along y, or between them."""
        angle = self.random.choice([0.0, np.pi / 2, self.number(-np.pi, np.pi)])
        axis = {0.0: "x", np.pi / 2: "y"}.get(float(angle), self.vector([np.cos(angle), np.sin(angle), 0]))
        return {"name": name, "prismatic": axis}

    def make_carriage(self):
        """A slide, on it a bar, on that a slide and a bar."""
        end = self.add_carried("a", self.root(), self.slide("s"), [False])
        end = self.add_carried("b", end, {"name": "jb", "revolute": "z"}, [True])
        end = self.add_carried("c", end, self.slide("sc"), [False])
        self.add_carried("d", end, {"name": "jd", "revolute": "z"}, [True])

    def make_wagon(self):
        """A bar, on it two slides across each other, on which a bar turns."""
        end = self.add_carried("a", self.root(), {"name": "ja", "revolute": "z"}, [True])
        end = self.add_carried("b", end, self.slide("s"), [False])
        end = self.add_carried("c", end, self.slide("sc"), [False])
        self.add_carried("d", end, {"name": "jd", "revolute": "z"}, [True])

    def make_table(self):
        """A block that moves in the plane, with a slide on it."""
        end = self.add_carried("a", self.root(), {"name": "p", "planar": "z", "coordinates": ["p1", "p2", "p3"]}, [False, False, True])
        self.add_carried("b", end, self.slide("s"), [False])

    # -- what else there is

    def add_others(self):
        """Bodies on the ground that turn or slide far from the rest."""
        others = {"revolute": ("z", "y"), "prismatic": ("x", "z")}
        for k in range(self.random.integers(0, 3)):
            kind = list(others)[self.random.integers(2)]
            axis = self.tilt[:, 2] if self.chance(0.4) and kind == "revolute" else np.eye(3)["xyz".index(self.random.choice(others[kind]))]
            self.document["ground"]["points"][f"far{k}"] = ["10", self.text(k), "0"]
            self.document["bodies"][f"far{k}"] = {"joint": {"name": f"jfar{k}", kind: self.vector(axis), "at": f"ground.far{k}"}, "mass": "2",
                                                  "inertia": {"xx": "0.1", "yy": "0.1", "zz": "0.1"}}
            self.document["start"]["qd"][f"jfar{k}"] = self.text(self.number(-1, 1))

    def add_pushes(self):
        """Forces and springs at points of the bodies."""
        for k in range(self.random.integers(0, 3)):
            body = self.loose[self.random.integers(len(self.loose))]
            point = list(self.document["bodies"][body]["points"])[0]
            if self.chance(0.5):
                v = self.random.normal(size=3) if self.chance(0.5) else np.array([0, 0, 1.0])
                self.document["forces"][f"push{k}"] = {"at": f"{body}.{point}", "force": self.vector(5 * v)}
            else:
                self.document["ground"]["points"][f"hook{k}"] = self.vector(self.random.uniform(-1, 1, 3) + np.array([0, 0, 2.0]))
                self.document["forces"][f"rope{k}"] = {"spring": [f"ground.hook{k}", f"{body}.{point}"], "stiffness": self.text(self.number(1, 20)),
                                                       "free_length": self.text(self.number(0.1, 0.5))}
