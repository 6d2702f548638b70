# SPDX-License-Identifier: BSD-3-Clause
"""Random models of everything that docs/model_format.md describes but wheels. A model is made as nested dicts of texts, placed
by the oracle's own mechanics, closed there by points that are put where they must be, given rates that fit, and written as YAML.

`features` counts what a model has in it; `FEATURES` are those that must all occur."""
import collections
import re

import numpy as np

from closures import floating
from jets import Jet, turning
from mechanics import Motion
from mechanism import Mechanism, normal

FEATURES = """revolute prismatic cylindrical screw universal spherical planar free weld motions chart frame to reversed coordinates
axes-of-points one-axis-alone oblique-axis graph graph-cut graph-chosen graph-turned include include-twice include-offset include-set parameters units
table-spline table-linear table-csv unknown-expression unknown-equations massless loop-ball loop-rod loop-rod-of-time
loop-revolute loop-universal loop-cylindrical loop-prismatic loop-weld loop-planar loop-point_on_line loop-point_on_plane
curve-table curve-y curve-y-and-z curve-surface curve-two-surfaces couple couple-equals constraint constraint-of-time
linkage drive-angle drive-displacement drive-locked redundant torque force joint-spring stops friction spring bushing point-force
body-torque condition-q condition-qd condition-t condition-lambda force-of-lambda sensor ancestor-moves ancestor-body
road-reduced road-dae road-projected integrators dynamics tape held rough-guess""".split()


def rotation(axis, angle):
    return turning(axis, Jet(np.array([angle]), np.zeros(1), np.zeros(1))).v[0]


class Generator:
    def __init__(self, seed, number):
        self.random = np.random.default_rng([seed, number])
        self.number, self.features, self.files = number, collections.Counter(), {}
        self.document = {"kempe": "1", "name": f"random {number}", "gravity": self.vector(6.0), "parameters": {}}
        self.points, self.moves = [], []
        self.q = {}

    # -- small choices

    def chance(self, p):
        return self.random.random() < p

    def one_of(self, *what):
        return what[self.random.integers(len(what))]

    def between(self, low, high):
        return float(np.round(self.random.uniform(low, high), 4))

    def number_text(self, x, unit=None):
        """Now and then with another unit, or as a parameter."""
        units = {"m": (("mm", 1e3), ("cm", 1e2), ("m", 1.0)), "rad": (("rad", 1.0), ("deg", 180 / np.pi)), "kg": (("g", 1e3), ("kg", 1.0)),
                 "N": (("N", 1.0), ("kN", 1e-3))}
        if unit in units and self.chance(0.2):
            self.features["units"] += 1
            word, factor = self.one_of(*units[unit])
            return f"{x * factor!r} {word}"
        if self.chance(0.08):
            self.features["parameters"] += 1
            name = f"p{len(self.document['parameters']) + 1}"
            self.document["parameters"][name] = repr(x / 2)
            return f"2*{name}"
        return repr(x)

    def vector(self, size, unit=None):
        values = [self.between(-size, size) for _ in range(3)]
        return [self.number_text(x, unit) if unit else repr(x) for x in values]

    def exact(self, v):
        return [repr(float(x)) for x in v]

    def direction(self):
        if self.chance(0.6):
            return self.one_of("x", "y", "z", "-x", "-y", "-z")
        self.features["oblique-axis"] += 1
        v = self.random.normal(size=3)
        return [repr(float(x)) for x in np.round(v / np.linalg.norm(v) + 0.05, 3)]

    def two_axes(self):
        """Two directions across each other, as texts."""
        if self.chance(0.5):
            return list(self.one_of(("x", "y"), ("y", "-x"), ("z", "y"), ("-z", "x"), ("x", "z")))
        a = normal(self.random.normal(size=3))
        b = normal(np.cross(a, self.random.normal(size=3)))
        return [self.exact(a), self.exact(b)]

    def axes(self):
        if self.chance(0.5):
            self.features["one-axis-alone"] += 1
            while True:
                key, v = self.one_of("x", "y", "z"), np.round(self.random.normal(size=3), 3)
                if normal(v)["xyz".index(key)] > -0.95:
                    return {key: self.exact(v) if self.chance(0.7) else self.one_of(*(a for a in "xyz"))}
        keys = self.one_of("xy", "xz", "zx", "yz", "zy", "yx")
        v = np.round(self.random.normal(size=(2, 3)), 3)
        return {keys[0]: self.exact(v[0]), keys[1]: self.exact(v[1])}

    # -- bodies

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

    def close_linkage(self):
        """A closure between the ends of both chains, of which some rows say nothing new."""
        first, second = list(self.document["bodies"])[0], list(self.document["bodies"])[-1]
        kind = self.one_of("revolute", "ball", "cylindrical", "prismatic", "universal", "planar")
        place, axes = self.frame_of(f"{first}.P1")
        keys = {"axis": self.one_of("x", "y")} if kind == "prismatic" else {"axis": "z"}
        keys = {"axes": ["z", "y"]} if kind == "universal" else {} if kind == "ball" else keys
        turned = axes if kind == "prismatic" else rotation(axes[:, 2], self.angle()) @ axes
        point, undo = self.put_point(second, place, turned)
        self.document["loops"] = {"K0": {kind: [f"{first}.P1", point], **keys}}
        self.look()
        count, rank, least = self.rank()
        if least > 0.02 and len(self.built.columns) > rank:
            self.features["redundant"] += count > rank
            self.features["linkage"] += 1
            return
        undo()
        del self.document["loops"]
        self.look()

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
        kind = self.one_of("revolute", "revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "screw", "weld")
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
        inner = Generator(0, 0)
        inner.random, inner.features = self.random, self.features
        first, second = inner.body(), inner.body()
        inner.add_joint("i0", first, [("ground", {"points": {"G": 0}})])
        inner.add_joint("i1", second, [("i0", first)], light=True)
        second["points"]["far"] = ["2", "2.5", "1.8"]
        document = inner.document
        document.update({"ground": {"points": {"G": inner.place()}}, "bodies": {"i0": first, "i1": second}})
        document["parameters"]["stiff"] = "3"
        document["tables"] = {"own": inner.spline()}
        moved = f"q(j_i1{'' if inner.motions_of(second['joint']) == 1 else '.1'})"
        document["unknowns"] = {"half": f"0.5*{moved}"}
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

    # -- places

    def mechanism(self):
        return Mechanism(self.document, self.folder, self.cuts)

    def settle(self):
        """Random coordinates of the start, and the oracle's mechanism there."""
        self.built = self.mechanism()
        for k, name in enumerate(self.built.columns):
            size = 1.1 if self.built.rotates[k] else 0.5
            self.q.setdefault(name, float(np.round(self.random.uniform(-size, size), 4)))
        for joint in self.built.joints:
            if sum(rotation for rotation, _ in joint.chain) == 3 and self.chance(0.15):
                self.features["chart"] += 1
                self.q[self.built.columns[joint.coordinates[-2]]] = self.one_of(1.5, -1.55)
        self.couple_screws()
        self.look()

    def couple_screws(self):
        for joint in self.built.joints:
            if joint.pitch is not None:
                slide, turn = (self.built.columns[k] for k in joint.coordinates)
                self.q[slide] = self.q[turn] * joint.pitch / (2 * np.pi)

    def look(self):
        self.built = self.mechanism()
        values = np.array([[self.q[name] for name in self.built.columns]])
        self.built.q = values
        self.motion = Motion(self.built, np.zeros(1), values, np.zeros_like(values))
        return self.motion

    def rank(self):
        """Rows, their rank, and the least singular value that counts."""
        self.motion.ranks()
        values = self.motion.singular_values[0]
        rank = self.motion.rank
        return self.motion.h.shape[1], rank, float(values[rank - 1]) if rank else 1.0

    # -- closures

    def add_closures(self):
        for _ in range(self.one_of(0, 1, 1, 2, 2, 3)):
            maker, kind = self.one_of(*[(self.put_point_closure, kind) for kind in (*CLOSURES, *CURVES)],
                                      *[(maker, None) for maker in (self.put_couple, self.put_constraint, self.put_drive)] * 4)
            for _ in range(20 if kind in LOCKING else 8):
                if self.try_closure(maker, kind):
                    break

    def try_closure(self, maker, kind):
        """One closure more, unless it locks the mechanism or says nothing new."""
        before = {key: dict(self.document.get(key, {})) for key in ("loops", "joints", "drives")}
        rows = self.motion.h.shape[1]
        kept = self.motion
        undo = maker(kind) if kind else maker()
        if undo is None:
            return False
        self.look()
        count, rank, least = self.rank()
        assert not count or np.abs(self.motion.h[0, [k for k in range(count) if k not in self.floating()]]).max(initial=0) < 1e-9
        if rank == count and count > rows and least > 0.02 and len(self.built.columns) > rank:
            self.features[self.made] += 1
            return True
        undo()
        self.cuts &= set(before["joints"])
        for key, value in before.items():
            self.document[key] = value
            if not value:
                del self.document[key]
        self.motion = kept
        self.built = self.mechanism()
        return False

    def floating(self):
        """Rows that keep the value of the start."""
        return {k for item in self.motion.items if floating(item)
                for k in range(self.motion.rows[item.name].start, self.motion.rows[item.name].stop)}

    def ends(self):
        """A point that is there, and a body of this file for the other one."""
        bodies = list(self.document["bodies"])
        loose = [b for b in bodies if "free" in self.document["bodies"][b].get("joint", {})]
        second = self.one_of(*(loose if loose and self.chance(0.6) else bodies))
        firsts = [("ground", k) for k in self.document["ground"]["points"]]
        firsts += [(b, k) for b in bodies for k in self.document["bodies"][b]["points"] if b != second and not k.startswith("L")]
        if "include" in self.document:
            firsts += [("s_" + b, k) for b, keys in self.inner["bodies"].items() for k in keys["points"]]
        body, point = firsts[self.random.integers(len(firsts))]
        return f"{body}.{point}", second

    def frame_of(self, text):
        """Place and axes of a point in ground axes."""
        body, _, name = text.partition(".")
        if body == "ground":
            place, axes = self.built.ground_points[name]
            return place, axes
        b = self.built.body(body)
        place, axes = b.points[name]
        return self.motion.point(b.number, place)[0][0], self.motion.turn[0, b.number] @ axes

    def put_point(self, body, place, axes=None):
        """A point of a body at a place and with axes that are known on the ground."""
        b, name = self.built.body(body).number, f"L{sum(len(k['points']) for k in self.document['bodies'].values())}"
        turn = self.motion.turn[0, b]
        local = self.exact(turn.T @ (place - self.motion.r[0, b]))
        if axes is None:
            self.document["bodies"][body]["points"][name] = local
        else:
            mine = turn.T @ axes
            self.document["bodies"][body]["points"][name] = {"at": local, "axes": {"x": self.exact(mine[:, 0]), "y": self.exact(mine[:, 1])}}
        return f"{body}.{name}", lambda: self.document["bodies"][body]["points"].pop(name)

    def put_point_closure(self, kind):
        self.curve = kind
        kind = "point_on_curve" if kind in CURVES else kind
        first, second = self.ends()
        place, axes = self.frame_of(first)
        text = self.one_of("x", "y", "z", "-y") if self.chance(0.7) else self.exact(normal(self.random.normal(size=3)))
        local = self.axis(text)
        axis = axes @ local
        across = np.cross(axis, normal(self.random.normal(size=3)))
        name = f"K{len(self.document.get('loops', {})) + len(self.document.get('joints', {}))}"
        self.made, self.cut = f"loop-{kind}", self.graph and kind in CUTS and self.chance(0.8)
        keys, there, turned = getattr(self, "close_" + kind)(text, place, axes, axis, across)
        point, undo = self.put_point(second, there, turned)
        if self.cut:
            self.document.setdefault("joints", {})[name] = {CUTS[kind]: [first, point], **keys, "cut": "yes"}
            self.made = "graph-cut"
            self.cuts.add(name)
        else:
            self.document.setdefault("loops", {})[name] = {kind: [first, point], **keys}
        return undo

    def axis(self, text):
        if isinstance(text, list):
            return normal(np.array([float(x) for x in text]))
        return (-1 if text[0] == "-" else 1) * np.eye(3)["xyz".index(text[-1])]

    def angle(self):
        return self.between(-1.0, 1.0)

    def close_ball(self, text, place, axes, axis, across):
        return {}, place, None if self.chance(0.5) else axes

    def close_rod(self, text, place, axes, axis, across):
        arm = self.random.normal(size=3)
        length = float(np.linalg.norm(arm))
        if self.chance(0.3):
            self.features["loop-rod-of-time"] += 1
            return {"length": f"{length!r} + {self.between(0.05, 0.2)}*sin(3*t)"}, place + arm, None
        return {"length": repr(length)}, place + arm, None

    def close_revolute(self, text, place, axes, axis, across):
        if self.cut or self.chance(0.5):
            return {"axis": text}, place, rotation(axis, self.angle()) @ axes
        back = rotation(normal(self.random.normal(size=3)), 1.0)
        return {"axes": [text, self.exact(back.T @ axes.T @ axis)]}, place, axes @ back

    def close_universal(self, text, place, axes, axis, across):
        turned = rotation(normal(self.random.normal(size=3)), 1.0) @ axes
        return {"axes": [text, self.exact(turned.T @ normal(across))]}, place, turned

    def close_cylindrical(self, text, place, axes, axis, across):
        keys, there, turned = self.close_revolute(text, place, axes, axis, across)
        return keys, there + self.between(-0.4, 0.4) * axis, turned

    def close_prismatic(self, text, place, axes, axis, across):
        return {"axis": text}, place + self.between(-0.4, 0.4) * axis, axes

    def close_weld(self, text, place, axes, axis, across):
        return {}, place, axes

    def close_planar(self, text, place, axes, axis, across):
        keys, there, turned = self.close_revolute(text, place, axes, axis, across)
        return keys, there + 0.5 * across, turned

    def close_point_on_line(self, text, place, axes, axis, across):
        return {"axis": text}, place + self.between(-0.5, 0.5) * axis, None

    def close_point_on_plane(self, text, place, axes, axis, across):
        return {"axis": text}, place + 0.6 * across, None

    def close_point_on_curve(self, text, place, axes, axis, across):
        kind, self.made = self.curve, "curve-" + self.curve
        x, z = self.between(-0.4, 0.4), self.between(-0.4, 0.4)
        a, b = self.between(0.1, 0.5), self.between(0.5, 1.5)
        if kind == "table":
            self.features["table-spline"] += 1
            name = f"f{len(self.document.get('loops', {}))}"
            self.document.setdefault("tables", {})[name] = self.spline()
            y = float(self.mechanism_table(name)(np.array(x)))
            return {"table": name}, place + axes @ [x, y, z], None
        if kind == "y":
            return {"y": f"{a}*sin({b}*x) + {a}*t"}, place + axes @ [x, a * np.sin(b * x), z], None
        if kind == "y-and-z":
            return ({"y": f"{a}*sin({b}*x)", "z": f"{a}*x^2 - {b}*t"}, place + axes @ [x, a * np.sin(b * x), a * x * x], None)
        y = np.sqrt(1.0 - x * x - 0.5 * z * z)
        surface = f"x^2 + y^2 + 0.5*z^2 - 1"
        if kind == "surface":
            return {"curve": surface, "power": "2"}, place + axes @ [x, y, z], None
        return ({"curve": [surface, f"z - {b}*x - ({float(z - b * x)!r})"], "power": "0"}, place + axes @ [x, y, z], None)

    def spline(self):
        x = np.cumsum(self.random.uniform(0.2, 0.4, 6)) - 1.0
        return {"x": [repr(float(np.round(v, 3))) for v in x], "y": [repr(self.between(-0.5, 0.5)) for _ in x]}

    def mechanism_table(self, name):
        from mechanism import Scope
        return Scope(None, self.document, self.folder, "", None, {}).table(name)

    def coordinate(self):
        """The name of a coordinate of this file, however it may be written, and its number."""
        free = [k for k, name in enumerate(self.built.columns) if not name.startswith(("s_", "r_")) and not self.is_screw(k)]
        if not free:
            return None
        k = int(self.one_of(*free))
        names = [name for name, number in self.built.places.items() if number == k]
        return self.one_of(*names), k

    def is_screw(self, k):
        return any(j.pitch is not None and k in j.coordinates for j in self.built.joints)

    def put_couple(self):
        first, second = self.coordinate(), self.coordinate()
        if first is None or first[1] == second[1]:
            return None
        factor = self.between(0.4, 2.0)
        keys = {"couple": {first[0]: "1", second[0]: repr(-factor)}}
        if self.chance(0.5):
            self.features["couple-equals"] += 1
            keys["equals"] = repr(self.value(first) - factor * self.value(second))
        self.made = "couple"
        self.document.setdefault("loops", {})[f"K{len(self.document.get('loops', {})) + 50}"] = keys
        return lambda: None

    def value(self, coordinate):
        return self.q[self.built.columns[coordinate[1]]]

    def put_constraint(self):
        first, second = self.coordinate(), self.coordinate()
        if first is None or first[1] == second[1]:
            return None
        a, b = self.value(first), self.value(second)
        time = self.chance(0.4)
        value = a * a / 2 + a + 0.7 * np.sin(b)
        text = f"q({first[0]})^2/2 + q({first[0]}) + 0.7*sin(q({second[0]})) - ({float(value)!r})"
        self.made = "constraint-of-time" if time else "constraint"
        keys = {"constraint": text + (" - 0.3*sin(2*t)" if time else ""), "power": "0"}
        self.document.setdefault("loops", {})[f"K{len(self.document.get('loops', {})) + 70}"] = keys
        return lambda: None

    def put_drive(self):
        found = self.coordinate()
        if found is None or any(keys["joint"] == found[0] for keys in self.document.get("drives", {}).values()):
            return None
        turns = self.built.rotates[found[1]]
        at = self.value(found)
        if self.chance(0.25):
            self.made, keys = "drive-locked", {"joint": found[0], "locked": "yes"}
        else:
            text = f"{at!r} + {self.between(0.2, 1.0)}*t + {self.between(0.1, 0.4)}*sin({self.between(1, 4)}*t)"
            self.made = "drive-angle" if turns else "drive-displacement"
            keys = {"joint": found[0], self.made[6:]: text}
        self.document.setdefault("drives", {})[f"D{found[1]}"] = keys
        return lambda: None

    def add_redundant(self):
        """The last closure between points once more, under another name: the rows say the same twice."""
        loops = {n: k for n, k in self.document.get("loops", {}).items() if "couple" not in k and "constraint" not in k}
        if loops and self.chance(0.15):
            name = list(loops)[-1]
            self.document["loops"][name + "again"] = loops[name]
            self.features["redundant"] += 1
            self.look()

    # -- rates

    def set_rates(self):
        """Random rates made to fit the closures: q' = J+ (-h_t) + N z."""
        motion = self.motion
        motion.ranks()
        j, z = motion.jacobian[0], self.random.uniform(-1.0, 1.0, motion.n)
        h_t = motion.hdot[0]
        rates = np.round(z, 4)
        if motion.rank:
            left, values, right = np.linalg.svd(j)
            kept = values > 1e-9
            rates = z - right[:len(values)][kept].T @ ((left.T[:len(values)] @ (j @ z + h_t))[kept] / values[kept])
        self.rates = {name: float(x) for name, x in zip(self.built.columns, rates)}

    # -- laws

    def law(self, coordinate, rate=True):
        """An expression of time, coordinates and rates; conditions among them."""
        terms = [self.term(coordinate, rate) for _ in range(self.random.integers(1, 4))]
        self.document["parameters"]["one"] = "1"  # fits any dimension
        return "one*(" + " + ".join(terms) + ")"

    def term(self, coordinate, rate):
        other = (self.coordinate() or coordinate)[0]
        name = coordinate[0]
        a, b, w = self.between(-2, 2), self.between(-0.8, 0.8), self.between(1, 8)
        kinds = ["constant", "swing", "spring", "table", "condition-q", "condition-t", "functions", "more", "signs", "kink"]
        kinds += ["damping", "condition-qd", "sign", "nested"] if rate else []
        kind = self.one_of(*kinds)
        if kind.startswith("condition"):
            self.features[kind] += 1
        if kind == "table":
            return f"{a}*{self.table()}(q({other}))"
        if kind in ("sign", "nested"):
            self.features["condition-qd"] += 1
        return {"constant": f"({a})", "swing": f"({a})*cos({w}*t)", "spring": f"({-abs(a)})*(q({name}) - ({b}))",
                "damping": f"({-abs(a)})*qd({name})*abs(q({other}))", "condition-q": f"if(q({other}) < {self.near(other)}, {a}, {b}*q({name}))",
                "condition-t": f"if(t {self.one_of('<', '>=')} {self.between(0.01, 0.07)}, {a}, sin(t))",
                "condition-qd": f"if(qd({other}) {self.one_of('>', '<=')} {b}, {a}*q({name}), {b})", "sign": f"({a})*sign(qd({other}) + {self.between(0.3, 1.5)})",
                "nested": f"if(q({name}) > {b}, if(qd({other}) < {b}, {a}, 0.5), -0.3*qd({name}))",
                "functions": f"({a})*tanh(q({other}))*exp(-t)/sqrt(1 + q({name})^2) + atan2({b}, 2 + sin(q({other})))",
                "more": f"({a})*(0.1*pow(2 + sin(q({name})), 1.5) + log(2 + q({name})^2) - asin(0.3*sin(q({other}))) + acos(0.2*cos(t))"
                        f" + 0.1*sinh(sin(q({name})))*cosh(t) + tan(0.3*sin(q({other}))) + atan(t) + abs(q({name}) - 5))",
                "signs": f"(-2^2 + 2^3^2/256 - 2^-1 + {a}e-1/2/5*-3 - -1)*(q({name}) - 20 deg)",
                "kink": f"max({a}*q({name}), min(0.4, {b}*q({other})))"}[kind]

    def near(self, name):
        """A border that is likely to be passed within the run."""
        k = self.built.places[name]
        column = self.built.columns[k]
        rate = self.rates[column] if abs(self.rates[column]) > 1e-3 else 1.0
        return repr(round(self.q[column] + rate * self.between(0.01, 0.06), 5))

    def table(self):
        kind = self.one_of("spline", "linear", "csv")
        self.features["table-" + kind] += 1
        name, tables = "tab" + kind, self.document.setdefault("tables", {})
        if name not in tables:
            keys = self.spline()
            if kind == "csv":
                text = "time,other,value\n" + "".join(f"{x},0,{y}\n" for x, y in zip(keys["x"], keys["y"]))
                self.files[f"table{self.number}.csv"] = "# a table\n" + text
                (self.folder / f"table{self.number}.csv").write_text(self.files[f"table{self.number}.csv"])
                keys = {"csv": f"table{self.number}.csv", "x": "time", "y": "value"}
            tables[name] = {**keys, **({"method": "linear"} if kind == "linear" else {})}
        return name

    def add_forces(self):
        makers = [self.put_effort, self.put_effort, self.put_joint_spring, self.put_stops, self.put_friction, self.put_spring,
                  self.put_bushing, self.put_point_force, self.put_body_torque]
        for k in range(self.random.integers(1, 5)):
            self.one_of(*makers)(f"f{k}")

    def put_force(self, name, feature, keys):
        self.features[feature] += 1
        self.document.setdefault("forces", {})[name] = keys

    def on_coordinate(self):
        found = self.coordinate()
        return (found, "torque" if self.built.rotates[found[1]] else "force") if found else (None, None)

    def put_effort(self, name):
        found, word = self.on_coordinate()
        if found:
            text = self.law(found)
            owner = self.carrying()
            if owner and self.chance(0.3):
                self.features["force-of-lambda"] += 1
                text += f" - one*{self.between(0.02, 0.15)}*abs(lambda({owner}))*tanh(qd({found[0]}))"
            self.put_force(name, word, {"joint": found[0], word: text})

    def carrying(self):
        """A closure whose first multiplier is determined."""
        if self.features["redundant"] or self.linkage:
            return None
        names = [n for n, k in self.document.get("loops", {}).items() if "rod" in k or "ball" in k or "point_on_plane" in k]
        return self.one_of(*names) if names else None

    def put_joint_spring(self, name):
        found, _ = self.on_coordinate()
        if found:
            keys = {"stiffness": repr(self.between(1, 20)), "damping": repr(self.between(0, 1)), "rest": repr(self.between(-0.5, 0.5))}
            self.put_force(name, "joint-spring", {"joint": found[0], "spring": keys})

    def put_stops(self, name):
        found, _ = self.on_coordinate()
        if found:
            at = self.value(found)
            keys = {"stiffness": repr(self.between(10, 100)), "damping": repr(self.between(0, 3)), "width": repr(self.between(0.01, 0.1))}
            if self.chance(0.7):
                keys["lower"] = repr(round(at - self.between(0, 0.2), 4))
            if self.chance(0.7) or "lower" not in keys:
                keys["upper"] = repr(round(at + self.between(0, 0.2), 4))
            self.put_force(name, "stops", {"joint": found[0], "stops": keys})

    def put_friction(self, name):
        found, word = self.on_coordinate()
        if found:
            self.put_force(name, "friction", {"joint": found[0], "friction": {word: repr(self.between(0.1, 2)), "speed": repr(self.between(0.1, 0.5))}})

    def two_points(self):
        names = [f"ground.{k}" for k in self.document["ground"]["points"]]
        names += [f"{b}.{k}" for b, keys in self.document["bodies"].items() for k in keys["points"]]
        first = self.one_of(*names)
        others = [n for n in names if n.split(".")[0] != first.split(".")[0]]
        return first, self.one_of(*others)

    def put_spring(self, name):
        ends = self.two_points()
        if np.linalg.norm(self.frame_of(ends[0])[0] - self.frame_of(ends[1])[0]) > 0.15:
            keys = {"stiffness": repr(self.between(1, 30)), "damping": repr(self.between(0, 2)), "free_length": self.number_text(self.between(0, 1), "m")}
            self.put_force(name, "spring", {"spring": list(ends), **keys})

    def put_bushing(self, name):
        ends = self.two_points()
        turn = self.frame_of(ends[0])[1].T @ self.frame_of(ends[1])[1]
        if np.trace(turn) > -0.7:
            triple = lambda low, high: repr(self.between(low, high)) if self.chance(0.3) else [repr(self.between(low, high)) for _ in range(3)]
            keys = {"stiffness": triple(1, 20), "damping": triple(0, 1), "rotational_stiffness": triple(1, 10),
                    "rotational_damping": triple(0, 0.5), "preload": triple(-2, 2)}
            kept = {k: v for k, v in keys.items() if self.chance(0.8)}
            self.put_force(name, "bushing", {"bushing": list(ends), **kept})

    def three_laws(self):
        found = self.coordinate()
        if self.chance(0.3) or not found:
            return self.vector(3.0)
        return [self.law(found) for _ in range(3)]

    def put_point_force(self, name):
        body = self.one_of(*self.document["bodies"])
        point = self.one_of(*self.document["bodies"][body]["points"])
        self.put_force(name, "point-force", {"at": f"{body}.{point}", "force": self.three_laws()})

    def put_body_torque(self, name):
        self.put_force(name, "body-torque", {"on": self.one_of(*self.document["bodies"]), "torque": self.three_laws()})

    def add_unknowns(self):
        found = self.coordinate()
        if found and self.chance(0.15):
            name = found[0]
            self.features["unknown-equations"] += 1
            self.features["unknown-expression"] += 1
            self.document["unknowns"] = {
                "group": {"of": {"aa": "0.1", "bb": "0"}, "zero": [f"aa - 0.3*sin(bb) - 0.2*q({name})", f"bb + 0.1*aa^2 - 0.3*cos(qd({name})) - 0.1*t"]},
                "named": f"one*(aa*bb + if(qd({name}) > {self.between(-0.5, 0.5)}, 1, -1)*0.2)"}
            self.document["parameters"]["one"] = "1"
            self.document["sensors"] = {"shown": "aa + 2*bb", "called": "named"}
            word = "torque" if self.built.rotates[found[1]] else "force"
            self.put_force("fu", word, {"joint": name, word: "named - 0.5*aa"})

    def add_sensors(self):
        sensors = self.document.setdefault("sensors", {})
        for k in range(self.random.integers(0, 3)):
            found = self.coordinate()
            if found:
                self.features["sensor"] += 1
                sensors[f"s{k}"] = self.law(found) + f" + 0.1*qd({found[0]})"
        owners = list(self.document.get("loops", {})) + list(self.document.get("drives", {}))
        if owners and not self.linkage and self.chance(0.4):
            self.features["condition-lambda"] += 1
            sensors["load"] = f"if(lambda({self.one_of(*owners)}) > 0.1, 1, lambda({owners[0]}))"
        if not sensors:
            del self.document["sensors"]

    # -- the whole

    def add_run(self):
        document = self.document
        outputs = ["q", "qd", "qdd", "lambda", "energy"]
        if not self.built.items_count:
            outputs.remove("lambda")
        for name in list(document.get("loops", {})) + [n for n, k in document.get("joints", {}).items() if k.get("cut") == "yes"]:
            outputs.append(f"reaction({name})")
            if not {"couple", "constraint"} & set(document.get("loops", {}).get(name, {})):
                outputs.append(f"moment({name})")
        outputs += [f"reaction({name})" for name in document.get("drives", {})]
        for body, keys in [("ground", document["ground"]), *document["bodies"].items()]:
            for point in list(keys["points"])[:2]:
                outputs += [f"{word}({body}.{point})" for word in ("position", "velocity", "acceleration")]
        outputs += [f"force({name})" for name, keys in document.get("forces", {}).items() if "at" not in keys and "on" not in keys]
        outputs += [f"sensor({name})" if self.chance(0.5) else name for name in document.get("sensors", {})]
        if "include" in document:
            at = document["include"][0]["at"].split(".")[0]
            outputs += [f"position({at}.s_G)", "force(s_inner)", "s_seen", "position(s_i1.P0)", "velocity(s_i0.P0)"]
        rtol = self.one_of("1e-8", "1e-9", "1e-10")
        document["run"] = {"t_end": "80 ms", "every": "0.01", "rtol": rtol, "atol": rtol, "outputs": outputs}
        self.choose_way(document["run"])
        self.leave_choice()

    def choose_way(self, run):
        road = self.one_of("reduced", "reduced", "dae", "projected")
        self.features["road-" + road] += 1
        if self.chance(0.6):
            run["road"] = road
        if road == "reduced" and self.chance(0.3):
            self.features["integrators"] += 1
            run["road"] = road
            run["integrator"] = self.one_of("radau9", "radau5", "dopri5", "bdf", "adams", "dop853")
        if self.chance(0.3):
            self.features["dynamics"] += 1
            run["dynamics"] = self.one_of("composite", "plain", "ner", "auto", *(() if self.features["force-of-lambda"] else ("articulated",)))

    def add_start(self):
        start = {"q": {n: repr(self.q[n]) for n in self.built.columns if self.q[n] != 0.0},
                 "qd": {n: repr(self.rates[n]) for n in self.built.columns}}
        driven = {self.built.places[keys["joint"]] for keys in self.document.get("drives", {}).values()}
        found = self.coordinate()
        if found and self.document.get("loops") and found[1] not in driven and self.chance(0.3):
            self.features["held"] += 1
            start["hold"] = [found[0]]
        self.guess_roughly(start)
        self.document["start"] = {k: v for k, v in start.items() if v}

    def leave_choice(self):
        """Kempe itself chooses what it cuts of a graph: no joint says so, and no output asks for one."""
        if not self.cuts or self.features["force-of-lambda"] or self.chance(0.5):
            return
        self.features["graph-chosen"] += 1
        for keys in self.document["joints"].values():
            keys.pop("cut")
        outputs = self.document["run"]["outputs"]
        gone = {f"{word}({name})" for word in ("reaction", "moment") for name in self.cuts}
        self.document["run"]["outputs"] = [word for word in outputs if word not in gone]

    def guess_roughly(self, start):
        """A start that is not closed, without rates."""
        loops = self.document.get("loops", {})
        locked = any("locked" in keys for keys in self.document.get("drives", {}).values())
        if not self.motion.items or locked or any("couple" in k for k in loops.values()) or self.chance(0.85):
            return
        self.features["rough-guess"] += 1
        for name in start["q"]:
            if self.built.places[name] not in {self.built.places[n] for n in start.get("hold", [])}:
                start["q"][name] = repr(round(float(start["q"][name]) + self.between(-0.02, 0.02), 5))
        start["qd"] = {}

    def count_ancestors(self):
        for closure in self.built.closures:
            if closure.points:
                common = self.built.common(closure)
                if common >= 0:
                    self.features["ancestor-body"] += 1
                    turn = self.motion.turn[0, common]
                    self.features["ancestor-moves"] += bool(np.abs(turn - np.eye(3)).max() > 0.1)

    def make(self, folder):
        """Writes the model and what it includes; returns its path."""
        self.folder = folder
        while True:
            self.features.clear()
            self.files.clear()
            self.q.clear()
            self.cuts = set()
            for key in [k for k in self.document if k not in ("kempe", "name", "gravity")]:
                del self.document[key]
            self.document["parameters"] = {}
            self.linkage = self.chance(0.12)
            if self.linkage:
                self.make_linkage()
            else:
                self.make_tree()
            for name, text in self.files.items():
                (folder / name).write_text(text)
            import files
            files.load.cache_clear()
            self.settle()
            if 1 <= len(self.built.columns) <= 14 and self.motion.solve().condition()[0] < 1e6:
                break
        if self.linkage:
            self.close_linkage()
        else:
            self.add_closures()
            self.add_redundant()
        self.set_rates()
        self.add_forces()
        self.add_unknowns()
        self.add_sensors()
        self.built.items_count = len(self.motion.items)
        self.count_ancestors()
        self.add_start()
        self.add_run()
        path = folder / f"model{self.number}.yaml"
        path.write_text(written(self.document))
        self.arguments = []
        if self.chance(0.1):
            self.features["tape"] += 1
            self.arguments = ["--backend", "tape"]
        return path


CLOSURES = ("ball", "rod", "revolute", "universal", "cylindrical", "prismatic", "weld", "planar", "point_on_line", "point_on_plane")
LOCKING = ("revolute", "universal", "cylindrical", "prismatic", "weld")  # with so many rows that few trees leave room
CURVES = ("table", "y", "y-and-z", "surface", "two-surfaces")
CUTS = {kind: kind for kind in ("revolute", "universal", "cylindrical", "prismatic", "weld", "planar")} | {"ball": "spherical"}
COUNT = {"revolute": 1, "prismatic": 1, "cylindrical": 2, "screw": 2, "universal": 2, "spherical": 3, "planar": 3, "free": 6, "weld": 0}


def flow(value):
    """A value in YAML's flow style."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(flow(v) for v in value) + "]"
    return value if re.fullmatch(r"[\w.+-][\w.+*/ ()-]*", value) else f'"{value}"'


def written(document):
    lines = []
    for key, value in document.items():
        if isinstance(value, dict) and value and key in ("bodies", "joints", "loops", "forces", "sensors", "drives", "tables", "unknowns"):
            lines.append(f"{key}:")
            lines += [f"  {name}: {flow(keys)}" for name, keys in value.items()]
        elif value:
            lines.append(f"{key}: {flow(value)}")
    return "\n".join(lines) + "\n"
