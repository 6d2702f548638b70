# SPDX-License-Identifier: BSD-3-Clause
"""Random trees: bodies, their joints, graphs of joints, linkages, included files."""
import numpy as np

from random_choices import Choices, written
from mechanism import normal

COUNT = {"revolute": 1, "prismatic": 1, "cylindrical": 2, "screw": 2, "universal": 2, "spherical": 3, "planar": 3, "free": 6,
         "weld": 0}


class Trees(Choices):
    def body(self, massless=False):
        keys = {}
        if not massless:
            masses = self.random.uniform(0.2, 0.8, 5)
            places = self.random.normal(size=(5, 3)) * 0.3
            tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, places))
            keys["mass"] = self.number_text(self.between(0.5, 2.0), "kg")
            keys["com"] = self.vector(0.4, "m")
            keys["inertia"] = {a + b: repr(float(np.round(tensor["xyz".index(a), "xyz".index(b)], 6)))
                               for a, b in ("xx", "yy", "zz", "xy", "xz", "yz")}
        else:
            self.features["massless"] += 1
        keys["points"] = {f"P{k}": self.place() for k in range(self.random.integers(1, 4))}
        return keys

    def place(self):
        place = self.vector(0.6, "m")
        if self.chance(0.6):
            return place
        self.features["axes-of-points"] += 1
        return {"at": place, "axes": self.axes()}

    def kind(self, light):
        """One of the keys of a joint and its value."""
        kind = self.one_of("revolute", "revolute", "prismatic", "cylindrical", "screw", "universal", "spherical", "planar",
                           "motions", *(() if light else ("free", "free", "weld")))
        self.features[kind] += 1
        if kind == "weld":
            return {kind: "yes"}
        if kind == "motions":
            return {kind: self.motions()}
        if kind in ("universal", "spherical", "planar", "free"):
            return {kind: self.two_axes() if self.chance(0.6) else self.one_of("x", "y", "z")}
        if kind == "screw":
            return {kind: self.direction(), "pitch": self.number_text(self.between(0.1, 0.5), "m")}
        return {kind: self.direction()}

    def motions(self):
        """Up to three, none along or about an axis of another one of its kind."""
        axes = list(self.random.permutation(["1", "2", "3"]))[:self.random.integers(1, 4)]
        return [self.elementary(axis) for axis in axes]

    def elementary(self, axis):
        letter, sign = self.one_of("R", "R", "T"), self.one_of("", "-")
        if self.chance(0.7):
            return sign + letter + axis
        v = np.round(self.random.normal(size=3) * 0.3 + 1.5 * np.eye(3)[int(axis) - 1], 2)
        return {letter: self.exact(v)}

    def add_joint(self, name, keys, parents, light=False):
        """The joint of a body in the file's tree."""
        joint = {"name": f"j_{name}", **self.kind(light), "at": self.parent_point(parents)}
        if self.chance(0.4):
            self.features["frame"] += 1
            joint["frame"] = self.axes()
        if self.chance(0.4):
            self.features["to"] += 1
            joint["to"] = "P0"
        if self.chance(0.25) and "weld" not in joint:
            self.features["reversed"] += 1
            joint["reversed"] = "yes"
        self.name_coordinates(name, joint)
        keys["joint"] = joint

    def parent_point(self, parents):
        name, keys = parents[self.random.integers(len(parents))]
        if not keys["points"] or self.chance(0.15):
            return name
        return f"{name}.{self.one_of(*keys['points'])}"

    def straight_point(self, parents):
        """One with the axes of its body."""
        name, keys = parents[self.random.integers(len(parents))]
        points = [point for point, place in keys["points"].items() if isinstance(place, list)]
        return f"{name}.{self.one_of(*points)}" if points else name

    def motions_of(self, joint):
        kind = next(k for k in joint if k in COUNT or k == "motions")
        return len(joint["motions"]) if kind == "motions" else COUNT[kind]

    def name_coordinates(self, name, joint):
        count = self.motions_of(joint)
        if count > 1 and self.chance(0.3):
            self.features["coordinates"] += 1
            joint["coordinates"] = [f"c_{name}{k}" if self.chance(0.8) else "~" for k in range(count)]

    def make_tree(self):
        document, count = self.document, int(self.random.integers(1, 7))
        document["ground"] = {"points": {f"O{k}": self.place() for k in range(2)}}
        document["bodies"] = {}
        parents = [("ground", document["ground"])]
        self.graph = self.chance(0.25)
        for k in range(count):
            name = f"b{k}"
            keys = self.body()
            if self.graph:
                self.add_edge(name, keys, parents)
            else:
                self.add_joint(name, keys, parents)
            document["bodies"][name] = keys
            parents.append((name, keys))
            if self.chance(0.06) and not self.graph:
                self.put_massless(name, keys, parents)
        if self.chance(0.25):
            self.add_include(parents)

    def make_linkage(self):
        """Bodies that turn about parallel axes, in two chains from the ground: what closes them in space is redundant."""
        document, axes = self.document, self.axes()
        document["ground"] = {"points": {f"O{k}": {"at": self.vector(0.5), "axes": axes} for k in range(2)}}
        document["bodies"], self.graph = {}, False
        length = [int(self.random.integers(1, 3)), int(self.random.integers(1, 3))]
        for chain, count in enumerate(length):
            at = f"ground.O{chain}"
            for k in range(count):
                name, keys = f"b{chain}{k}", self.body()
                keys["points"] = {f"P{i}": self.vector(0.6, "m") for i in range(2)}
                keys["joint"] = {"name": f"j{chain}{k}", "revolute": "z", "at": at}
                document["bodies"][name] = keys
                at = f"{name}.P0"

    def put_massless(self, name, keys, parents):
        """A cross without mass that carries a body with mass about another axis."""
        cross = self.body(massless=True)
        cross["joint"] = {"name": f"j_{name}m", "revolute": "x", "at": self.parent_point(parents)}
        tip = self.body()
        tip["joint"] = {"name": f"j_{name}t", "revolute": "y", "at": f"{name}m.P0", "frame": {"x": "x"}}
        self.document["bodies"][f"{name}m"], self.document["bodies"][f"{name}t"] = cross, tip
        parents.append((f"{name}t", tip))

    def add_edge(self, name, keys, parents):
        """A joint between two bodies, under `joints`."""
        self.features["graph"] += 1
        kind = self.one_of("revolute", "revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "screw",
                           "weld")
        self.features[kind] += 1
        parent = self.one_of(*[(n, k) for n, k in parents if k["points"]])
        ends = [f"{parent[0]}.{self.one_of(*parent[1]['points'])}", f"{name}.P0"]
        if self.chance(0.5):
            ends.reverse()
            self.features["graph-turned"] += 1
        joint = {kind: ends, "cut": "no"}
        if kind in ("universal", "spherical", "planar"):
            joint["axes"] = self.two_axes()
        elif kind != "weld":
            joint["axis"] = self.direction()
        if kind == "screw":
            joint["pitch"] = repr(self.between(0.1, 0.5))
        self.document.setdefault("joints", {})[f"j_{name}"] = joint

    def add_include(self, parents):
        """A second file with a body or two, a force, a sensor and parameters of its own."""
        self.features["include"] += 1
        inner = Trees(self.random, "part", self.features)
        first, second = inner.body(), inner.body()
        inner.add_joint("i0", first, [("ground", {"points": {"G": 0}})])
        inner.add_joint("i1", second, [("i0", first)], light=True)
        second["points"]["far"] = ["2", "2.5", "1.8"]
        document = inner.document
        document.update({"ground": {"points": {"G": inner.place()}}, "bodies": {"i0": first, "i1": second}})
        document["parameters"]["stiff"] = "3"
        document["tables"] = {"own": inner.spline()}
        moved = f"q(j_i1{'' if inner.motions_of(second['joint']) == 1 else '.1'})"
        document["algebraic"] = {"half": f"0.5*{moved}"}
        document["sensors"] = {"seen": f"own({moved}) + stiff*half + t"}
        document["forces"] = {"inner": {"spring": ["ground.G", "i1.far"], "stiffness": "stiff + 1", "free_length": "0.2"}}
        name = f"part{self.number}.yaml"
        keys = {"file": name, "prefix": "s_", "at": self.straight_point(parents)}
        if self.chance(0.5):
            self.features["include-offset"] += 1
            keys["offset"] = self.vector(0.3, "m")
        if self.chance(0.5):
            self.features["include-set"] += 1
            keys["set"] = {"stiff": self.number_text(self.between(1, 5))}
        self.files[name] = written(document)
        self.document["include"] = [keys]
        if self.chance(0.3):
            self.features["include-twice"] += 1
            self.document["include"].append({"file": name, "prefix": "r_", "at": "ground"})
        self.inner = document
