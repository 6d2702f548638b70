# SPDX-License-Identifier: BSD-3-Clause
"""Random mechanisms with flexible beams: trees in a plane or in space, closed by joints and rods whose second points are put
where they must be at the start."""
import ast
import collections

import numpy as np

from flexible_mechanics import FlexibleMechanism, Particles
from mechanism import normal
from random_choices import Choices, written

MOST = 20  # coordinates
PLANE, SPACE = ("revolute", "revolute", "revolute", "prismatic", "weld"), (
    "revolute", "revolute", "prismatic", "universal", "spherical", "cylindrical", "weld", "motions")
CLOSURES = {"ball": 3, "rod": 1, "revolute": 5, "universal": 4, "cylindrical": 4, "point_on_line": 2, "point_on_plane": 1, "weld": 6}
IN_PLANE = {"ball": 2, "rod": 1, "revolute": 2, "point_on_line": 1, "weld": 3}
LEAST = 0.03  # singular value of the closures that counts
FEATURES = """planar spatial clamped chord mean none first full y z torsion axial rotary shear raw ratio rayleigh rectangle circle tube numbers taper stations along axes
flexible-on-flexible rigid-behind offset axes-of-points revolute prismatic universal spherical cylindrical weld motions frame
reversed ball rod closed drive drive-of-shape spring force torque bushing joint-spring spring-of-shape force-of-shape""".split()


class Mechanisms(Choices):
    def __init__(self, seed, number):
        super().__init__(np.random.default_rng([seed, number, 7]), f"flexible{number}")
        self.planar = self.chance(0.35)
        self.features["planar" if self.planar else "spatial"] += 1
        self.start, self.flexible, self.shapes = {}, [], {}
        if self.planar:
            self.document["gravity"] = [*self.document["gravity"][:2], "0"]
        self.make_tree()
        self.choose_start()
        for _ in range(self.one_of(0, 0, 1, 1, 2)):
            for _ in range(6):
                if self.try_closure():
                    break
        self.add_drive()
        for _ in range(self.one_of(0, 1, 2)):
            self.add_force()
        self.document["start"] = {"q": {name: repr(value) for name, value in self.start.items() if value}}
        self.document["run"] = {"t_end": "0.05", "output_step": "0.01", "rtol": "1e-10"}

    def write(self, folder):
        path = folder / f"{self.document['name']}.yaml"
        path.write_text(written({key: value for key, value in self.document.items() if value}))
        return path

    def feature(self, name):
        self.features[name] += 1
        return name

    # -- bodies

    def beam(self):
        """A flexible body's keys but its points, and its length."""
        planar = self.planar
        shapes = {"y": self.one_of(1, 2, 2, 3)} if planar else {key: self.one_of(*counts) for key, counts in (
            ("y", (0, 1, 2, 3)), ("z", (0, 1, 1, 2)), ("torsion", (0, 0, 1, 2)), ("axial", (0, 0, 0, 1)))}
        if planar and self.chance(0.15):
            shapes["axial"] = 1
        if not any(shapes.values()):
            shapes["y"] = 1
        shapes = {self.feature(key): str(count) for key, count in shapes.items() if count}
        keys = {"shapes": shapes}
        sheared, rotary = self.chance(0.3), "torsion" in shapes or self.chance(0.3)
        for key, on in (("shear", sheared), ("raw", self.chance(0.4))):
            if on:
                keys[self.feature(key)] = "yes"
        if rotary:
            self.feature("rotary")
        if rotary and "torsion" not in shapes or rotary and self.chance(0.3):
            keys["rotary"] = "yes"
        keys["frame"] = self.feature(self.one_of("clamped", "chord") if planar else self.one_of("clamped", "clamped", "chord", "chord", "mean"))
        keys["stiffening"] = self.feature(self.one_of("none", "first", "full"))
        if self.chance(0.2):
            del keys["stiffening"]
        if self.chance(0.4):
            kind = self.feature(self.one_of("ratio", "rayleigh"))
            two = [repr(self.between(0.1, 2)), f"{self.between(0.1, 2)!r}e-3"]
            keys["damping"] = {kind: repr(self.between(0.005, 0.1)) if kind == "ratio" else two}
        length = self.between(0.4, 1.0)
        turned = self.turned() if self.chance(0.4) else {}
        text = self.number_text(length, "m")
        keys["beam"] = {"length": text, **turned, **(self.by_section(keys, text) if self.chance(0.5) else self.by_numbers(keys, rotary))}
        return keys, length

    def turned(self):
        """The direction of a beam, which in a plane stays in it."""
        if self.chance(0.5):
            return {self.feature("along"): self.one_of(*(("y", "-y", "-x") if self.planar else ("y", "z", "-x", "-y", "-z")))}
        angle = self.between(-3, 3)
        self.feature("axes")
        return {"axes": {"x": self.exact([np.cos(angle), np.sin(angle), 0]), "z": self.one_of("z", "-z")} if self.planar else self.axes()}

    def by_section(self, keys, length):
        kind = self.feature(self.one_of("rectangle", "circle", "tube", "numbers"))
        b = self.between(0.02, 0.06)
        if kind == "rectangle":
            given = [self.number_text(b, "m"), self.number_text(self.between(0.02, 0.06), "m")]
        elif kind == "circle":
            given = self.number_text(b, "m")
        elif kind == "tube":
            given = [self.number_text(b, "m"), self.number_text(b * self.one_of(0.5, 0.75), "m")]
        else:
            given = {"A": repr(b * b), "Iy": repr(b**4 / 9), "Iz": repr(b**4 / 13), "J": repr(b**4 / 7), "ky": "0.8", "kz": "0.7"}
        moduli = {"poisson": repr(self.between(0, 0.4))} if self.chance(0.5) else {"shear": f"{self.between(1.2, 2.5)!r}e7"}
        tapered = self.taper(kind, given, length) if kind != "numbers" and "shear" not in keys and self.chance(0.5) else {}
        return {"young": f"{self.between(3.0, 6.0)!r}e7", "density": repr(self.between(500, 1500)), **moduli, **({} if "at" in tapered.get("taper", {}) else {"section": {kind: given}}), **tapered}

    def taper(self, kind, given, length):
        self.feature("taper")
        if self.chance(0.5):
            return {"taper": self.other(kind, given)}
        self.feature("stations")
        at = np.round(sorted(self.random.uniform(0.1, 0.9, self.one_of(1, 1, 2))), 3)
        return {"taper": {"at": ["0", *(f"{float(x)!r}*{length}" for x in at), length], "section": [{kind: given}, *(self.other(kind, given) for _ in range(len(at) + 1))]}}

    def other(self, kind, given):
        """A section of this kind."""
        part = f"{self.between(0.3, 1.6)!r}*"
        if kind == "rectangle":
            return {kind: [part + given[0], given[1] if self.chance(0.3) else self.number_text(self.between(0.02, 0.06), "m")]}
        return {kind: [part + text for text in given] if kind == "tube" else part + given}

    def by_numbers(self, keys, rotary):
        made = {"rhoA": self.number_text(self.between(0.5, 2)), "EIz": self.number_text(self.between(5, 30)),
                "EIy": self.number_text(self.between(5, 30)), "GJ": self.number_text(self.between(2, 8)), "EA": f"{self.between(2, 9)!r}e4"}
        if rotary:
            made["rhoI"] = [repr(self.between(5e-4, 3e-3)), repr(self.between(5e-4, 3e-3))] if self.chance(0.7) else "0.001"
        if "shear" in keys:
            made["kGA"] = [f"{self.between(3, 9)!r}e3", f"{self.between(3, 9)!r}e3"] if self.chance(0.7) else "5000"
        return made

    def section_point(self, length, least=0.0):
        x = self.one_of(length, length, float(np.round(self.random.uniform(least, 1) * length, 3)))
        point = {"station": repr(min(x, length))}
        if self.chance(0.4):
            self.feature("offset")
            point["offset"] = [repr(self.between(-0.15, 0.15)) for _ in range(2)] + ["0" if self.planar else repr(self.between(-0.1, 0.1))]
        return self.with_axes(point)

    def with_axes(self, point):
        if self.chance(0.3):
            self.feature("axes-of-points")
            angle = self.between(-3, 3)
            across = {"x": self.exact([np.cos(angle), np.sin(angle), 0]), "z": "z"}
            point["axes"] = across if self.planar else self.axes()
        return point

    def rigid(self):
        masses, places = self.random.uniform(0.2, 0.8, 5), self.random.normal(size=(5, 3)) * 0.2
        tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, places))
        inertia = {a + b: repr(float(np.round(tensor["xyz".index(a), "xyz".index(b)], 6))) for a, b in ("xx", "yy", "zz", "xy", "xz", "yz")}
        place = lambda: [repr(self.between(-0.4, 0.4)) for _ in range(2)] + ["0" if self.planar else repr(self.between(-0.4, 0.4))]
        return {"mass": self.number_text(self.between(0.5, 2), "kg"), "com": place(),
                "inertia": {"zz": inertia["zz"]} if self.planar else inertia,
                "points": {"P0": place(), "P1": self.with_axes({"at": place()})}}

    def make_tree(self):
        document, count = self.document, self.one_of(1, 2, 2, 3, 3, 4)
        document["ground"] = {"points": {f"O{k}": [*self.exact(np.round(self.random.uniform(-0.5, 0.5, 2), 3)), "0"] for k in range(2)}}
        document["bodies"] = {}
        parents, used = [("ground", document["ground"]["points"])], 0
        for k in range(count):
            name, soft = f"b{k}", k == 0 or self.chance(0.6)
            keys = self.rigid()
            if soft:
                beam, length = self.beam()
                keys = {"flexible": beam, "points": {"P0": self.section_point(length), "P1": self.section_point(length, 0.2)}}
                self.shapes[name] = beam["shapes"], length
            parent, points = parents[self.random.integers(len(parents))] if self.chance(0.4) else parents[-1]
            floats = soft and beam["frame"] == "mean"
            joint, motions = self.joint(name, f"{parent}.{self.one_of(*points)}", soft, floats)
            shapes = sum(map(int, keys["flexible"]["shapes"].values())) if soft else 0
            if used + motions + shapes > MOST:
                continue
            if parent in self.shapes:
                self.feature("flexible-on-flexible" if soft else "rigid-behind")
            keys["joint"], document["bodies"][name], used = joint, keys, used + motions + shapes
            parents.append((name, keys["points"]))
        self.parents = parents

    def joint(self, name, at, soft, floats):
        kind = self.feature("motions" if floats else self.one_of(*(PLANE if self.planar else SPACE)))
        if kind == "weld" and not soft:
            kind = "revolute"
        joint, count = {"name": f"j_{name}"}, {"weld": 0, "universal": 2, "spherical": 3, "cylindrical": 2}.get(kind, 1)
        if kind == "weld":
            joint[kind] = "yes"
        elif floats:
            both = [[letter + str(k) for k in self.random.permutation(3) + 1] for letter in "TR"]
            joint[kind], count = both[0] + both[1], 6
        elif kind == "motions":
            axes = list(self.random.permutation(["1", "2", "3"]))[:self.random.integers(1, 4)]
            joint[kind] = [self.one_of("", "-") + self.one_of("R", "R", "T") + axis for axis in axes]
            count = len(axes)
        elif self.planar:
            joint[kind] = self.one_of("z", "-z") if kind == "revolute" else self.one_of("x", "y", "-x")
        else:
            joint[kind] = self.two_axes() if kind in ("universal", "spherical") else self.direction()
        joint["at"] = at
        if self.chance(0.25):
            self.feature("frame")
            angle = self.between(-3, 3)
            joint["frame"] = {"x": self.exact([np.cos(angle), np.sin(angle), 0]), "z": "z"} if self.planar else self.axes()
        if self.chance(0.15) and kind != "weld":
            self.feature("reversed")
            joint["reversed"] = "yes"
        return joint, count

    # -- the start, and closures there

    def choose_start(self):
        built = FlexibleMechanism(self.document)
        sizes = {f"{body.name}.{name}": 0.03 * (1 if name.startswith("phi") else beam.length) / int(name[-1])**2
                 for body, beam in built.beams for name in beam.names}
        for name, turns in zip(built.columns, built.rotates):
            size = sizes.get(name, 1.1 if turns else 0.3)
            self.start[name] = float(np.round(self.random.uniform(-size, size), 5))
        self.look(built)

    def look(self, built=None):
        self.built = built or FlexibleMechanism(self.document)
        q = np.array([[self.start[name] for name in self.built.columns]])
        self.motion = Particles(self.built, np.zeros(1), q, 0 * q)
        return self.motion

    def pose(self, text):
        point = self.built.point_of(text)
        return self.motion.point(point.body, point.place)[0][0], self.motion.turn[0, point.body] @ point.axes

    def put(self, body, place, axes):
        """A point of a body with a pose that is known on the ground."""
        name = f"L{len(self.document['ground']['points'])}{len(self.document.get('loops', {}))}"
        if body == "ground":
            self.document["ground"]["points"][name] = {"at": self.exact(place), "axes": {k: self.exact(axes[:, i]) for i, k in enumerate("xy")}}
            return name
        own, given = self.built.body(body), {}
        number = own.number
        if body in self.shapes:
            given["station"] = repr(self.one_of(self.shapes[body][1], float(np.round(self.shapes[body][1] * self.random.uniform(0.3, 1), 3))))
            self.document["bodies"][body]["points"][name] = given
            self.look()
            own = self.built.body(body)
            number = own.sections[float(given["station"])]
        turn = self.motion.turn[0, number]
        given["offset" if body in self.shapes else "at"] = self.exact(turn.T @ (place - self.motion.r[0, number]))
        given["axes"] = {k: self.exact((turn.T @ axes)[:, i]) for i, k in enumerate("xy")}
        self.document["bodies"][body]["points"][name] = given
        return name

    def try_closure(self):
        kept = {key: repr(self.document.get(key)) for key in ("loops", "ground", "bodies")}
        first, points = self.parents[self.random.integers(1, len(self.parents))]
        others = [name for name, _ in self.parents if name != first]
        second = "ground" if self.chance(0.6) else self.one_of(*others)
        if second == first:
            return False
        kinds = IN_PLANE if self.planar else CLOSURES
        room = len(self.built.columns) - self.rank()[0]
        fitting = [kind for kind, rows in kinds.items() if rows < room]
        if not fitting:
            return False
        kind = self.one_of(*fitting)
        point = f"{first}.{self.one_of(*[p for p in points if not p.startswith('L')])}"
        place, axes = self.pose(point)
        keys = {}
        if kind == "rod":
            gap = self.random.uniform(-0.5, 0.5, 3) * [1, 1, not self.planar]
            place, keys["length"] = place + gap, repr(float(np.linalg.norm(gap)))
        elif kind == "universal":
            axes = np.stack([axes[:, 1], axes[:, 2], axes[:, 0]], 1)
            keys["axes"] = ["x", "x"]
        elif self.planar and kind in ("revolute", "weld", "point_on_line"):
            keys["axis"] = "z" if kind == "revolute" else "x"
        else:
            keys["axis"] = self.one_of("x", "y", "z")
        if kind in ("ball", "rod", "weld"):
            keys.pop("axis", None)
        if kind == "point_on_line":
            place = place + self.between(-0.2, 0.2) * axes[:, "xyz".index(keys["axis"])]
        if kind == "point_on_plane":
            k = "xyz".index(keys["axis"])
            place = place + self.between(-0.2, 0.2) * axes[:, (k + 1) % 3]
        name = self.put(second, place, axes)
        ends = [point, f"{second}.{name}"]
        loops = self.document.setdefault("loops", {})
        loops[f"c{len(loops)}"] = {kind: ends, **keys}
        before = self.rank()[0]
        self.look()
        rank, least = self.rank()
        gap = np.max(np.abs(self.motion.h), initial=0)
        assert gap < 1e-9, (kind, gap, self.document)
        if rank > before and least > LEAST and rank < len(self.built.columns) and rank == self.rank_beside():
            self.feature(kind), self.feature("closed")
            return True
        for key, text in kept.items():
            value = ast.literal_eval(text)
            self.document.pop(key)
            if value is not None:
                self.document[key] = value
        self.parents = [("ground", self.document["ground"]["points"])] + [(n, k["points"]) for n, k in self.document["bodies"].items()]
        self.look()
        return False

    def rank(self):
        """Of the closures, and the least singular value that counts."""
        jacobian = self.motion.jacobian[0]
        if not len(jacobian):
            return 0, 1.0
        size = np.linalg.norm(jacobian, axis=1)
        values = np.linalg.svd(jacobian / np.where(size < 1e-12, 1, size)[:, None])[1]
        return int(np.sum(values > 1e-9)), float(np.min(values[values > 1e-9], initial=1.0))

    def rank_beside(self):
        """Of the closures near the start: a larger one would make that a singular position."""
        kept, columns = self.motion, self.built.columns
        q = np.array([[self.start[name] for name in columns]]) + 0.003 * self.random.normal(size=len(columns))
        self.motion = Particles(self.built, np.zeros(1), q, 0 * q)
        rank = self.rank()[0]
        self.motion = kept
        return rank

    # -- drives and forces

    def add_drive(self):
        if not self.chance(0.2):
            return
        name = self.one_of(*self.built.columns)
        shape = any(name.startswith(f"{body}.") for body in self.shapes)
        size = 0.01 if shape else 0.5
        law = f"{self.start[name]!r} + {size}*t + {size}*sin(3*t)^2"
        turns = self.built.rotates[self.built.columns.index(name)]
        self.document["drives"] = {"d": {"joint": name, "angle" if turns else "displacement": law}}
        self.look()
        if self.rank()[0] < self.motion.h.shape[1] or self.rank()[1] < LEAST or self.motion.h.shape[1] >= len(self.built.columns):
            del self.document["drives"]
            self.look()
            return
        self.feature("drive-of-shape" if shape else "drive")

    def some_point(self, ground=True):
        name, points = self.parents[self.random.integers(0 if ground else 1, len(self.parents))]
        return f"{name}.{self.one_of(*points)}"

    def components(self, size):
        made = [self.one_of(repr(self.between(-size, size)), f"{self.between(-size, size)!r}*cos(5*t)") for _ in range(3)]
        return [*made[:2], "0"] if self.planar else made

    def add_force(self):
        forces = self.document.setdefault("forces", {})
        name, kind = f"f{len(forces)}", self.one_of("spring", "force", "torque", "bushing", "joint-spring", "shape")
        if kind in ("spring", "bushing"):
            ends = [self.some_point(), self.some_point(False)]
            if ends[0].partition(".")[0] == ends[1].partition(".")[0] or np.linalg.norm(self.pose(ends[0])[0] - self.pose(ends[1])[0]) < 0.05:
                return
            if kind == "spring":
                forces[name] = {kind: ends, "stiffness": "40", "damping": "0.5", "free_length": "0.3"}
            else:
                turn = self.pose(ends[0])[1].T @ self.pose(ends[1])[1]
                if np.trace(turn) < 0:  # near half a turn
                    return
                forces[name] = {kind: ends, "stiffness": ["20", "30", "10"], "damping": "0.2", "rotational_stiffness": ["1", "2", "3"]}
        elif kind == "force":
            forces[name] = {"at": self.some_point(False), "force": self.components(8)}
        elif kind == "torque":
            rigid = [body for body, _ in self.parents[1:] if body not in self.shapes]
            if not rigid:
                return
            forces[name] = {"on": self.one_of(*rigid), "torque": ["0", "0", "0.7*cos(t)"] if self.planar else self.components(1)}
        else:
            names = [n for n in self.built.columns if any(n.startswith(f"{b}.") for b in self.shapes) == (kind == "shape")]
            if not names:
                return
            joint = self.one_of(*names)
            turns = self.built.rotates[self.built.columns.index(joint)]
            if kind == "shape" and self.chance(0.5):
                kind = "force-of-shape"
                forces[name] = {"joint": joint, "torque" if turns else "force": f"0.5 - 2*qd({joint})"}
            else:
                kind = "spring-of-shape" if kind == "shape" else kind
                forces[name] = {"joint": joint, "spring": {"stiffness": "6", "damping": "0.1", "rest": "0.01"}}
        self.feature(kind)


def missing(features):
    return [name for name in FEATURES if not collections.Counter(features)[name]]
