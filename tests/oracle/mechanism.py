# SPDX-License-Identifier: BSD-3-Clause
"""A model as docs/model describes it: bodies with their places, joints between two bodies, closures, drives,
forces, sensors, and models that are included. Every text of the file stays a text until it is evaluated here."""
import csv
import pathlib
import re

import numpy as np

from convention import broken
from expression_values import Table, compiled
from jets import cross
from state_values import states_of

KINDS = {"revolute": "Ra", "prismatic": "Ta", "cylindrical": "TaRa", "screw": "TaRa", "universal": "RaRb",
         "spherical": "RaRbRc", "planar": "TbTcRa", "free": "TaTbTcRaRbRc", "weld": ""}
CUTS = {"spherical": "ball"}
LOOPS = ["ball", "rod", "revolute", "universal", "cylindrical", "prismatic", "weld", "planar", "point_on_line",
         "point_on_plane", "point_on_curve", "coupler", "constraint"]
UNIT = {"x": np.eye(3)[0], "y": np.eye(3)[1], "z": np.eye(3)[2]}


def normal(v):
    return v / np.linalg.norm(v)


class Point:
    """A place on a body with axes: the body's number (-1 is the ground), the place and the axes there as columns."""

    def __init__(self, body, place, axes=None):
        self.body, self.place, self.axes = body, np.asarray(place, float), np.eye(3) if axes is None else axes


class Body:
    def __init__(self, name, number):
        self.name, self.number = name, number
        self.mass, self.com, self.inertia, self.points = 0.0, np.zeros(3), np.zeros((3, 3)), {}
        self.stations = {}  # bodies in place of this one that have some of its points


class Joint:
    """From `at` on one body to `to` on another, through a frame and a chain of motions [(is a rotation, axis)]. If it
    is turned round, the chain goes from the carried body to the one that carries it."""

    def __init__(self, name, at, to, frame, chain, turned=False, pitch=None):
        self.name, self.at, self.to, self.frame, self.chain = name, at, to, frame, chain
        self.turned, self.pitch, self.coordinates = turned, pitch, []
        self.loads_parent = False  # its second body carries the first


class Item:
    """A closure, a drive, a force: its kind, its name, the texts of its keys, and where names in them are looked up."""

    def __init__(self, kind, name, scope, keys, points=(), vectors=()):
        self.kind, self.name, self.scope, self.keys = kind, name, scope, keys
        self.points, self.vectors = list(points), list(vectors)


class Scope:
    """The meanings of the names of one file."""

    def __init__(self, mechanism, document, folder, prefix, base, settings):
        self.mechanism, self.document, self.folder, self.prefix, self.base = mechanism, document, folder, prefix, base
        self.texts = {**document.get("parameters", {}), **settings}
        self.values, self.tables, self.grounds = {}, {}, {}
        self.names = frozenset(self.texts)

    def full(self, name):
        return self.prefix + name

    def parameter(self, name):
        if name not in self.values:
            text = self.texts[name]
            self.values[name] = text if isinstance(text, float) else self.number(text)
        return self.values[name]

    def name(self, text):
        if text == "pi":
            return np.pi
        return self.parameter(text)

    def table(self, name):
        if name not in self.tables:
            self.tables[name] = self.read_table(self.document["tables"][name])
        return self.tables[name]

    def read_table(self, keys):
        method = keys.get("method", "spline")
        if "csv" not in keys:
            return Table([self.number(x) for x in keys["x"]], [self.number(y) for y in keys["y"]], method)
        with open(self.folder / keys["csv"], newline="") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        return Table([float(row[keys["x"]]) for row in rows], [float(row[keys["y"]]) for row in rows], method)

    def compiled(self, text):
        return compiled(str(text), self.names)

    def number(self, text):
        return float(self.compiled(text)(self))

    def vector(self, texts):
        return np.array([self.number(x) for x in texts])

    def triple(self, texts):
        return self.vector(texts) if isinstance(texts, list) else np.full(3, self.number(texts))

    # -- axes and places

    def axis(self, text):
        if isinstance(text, list):
            return normal(self.vector(text))
        return -UNIT[text[1]] if text[0] == "-" else UNIT[text]

    def axes(self, given):
        """The axes as columns: of two the first one stands, of one alone the shortest turn brings the others."""
        found = [("xyz".index(key), self.axis(text)) for key, text in given.items()]
        (i, first), m = found[0], np.zeros((3, 3))
        if len(found) == 1:
            return shortest_turn(UNIT["xyz"[i]], first)
        k, second = found[1]
        if broken("order of two axes"):
            (k, second), (i, first) = found
        m[:, i], m[:, k] = first, normal(second - first * (first @ second))
        rest = 3 - i - k
        m[:, rest] = cross(m[:, (rest + 1) % 3], m[:, (rest + 2) % 3])
        return m

    def pose(self, keys):
        """Place and axes of an entry of `points`."""
        if not isinstance(keys, dict):
            return self.vector(keys), np.eye(3)
        return self.vector(keys.get("at", ["0", "0", "0"])), self.axes(keys["axes"]) if "axes" in keys else np.eye(3)

    def point(self, text):
        body, _, name = text.partition(".")
        if body == "ground":
            if not name:
                return Point(self.base.body, self.base.place)
            place, axes = self.grounds[name]
            return Point(self.base.body, self.base.place + place, axes)
        body = self.mechanism.body(self.full(body))
        return Point(body.stations.get(name, body.number), *body.points[name]) if name else Point(body.number, np.zeros(3))


def shortest_turn(a, b):
    """The rotation about a x b that brings the unit vector a onto b."""
    if broken("shortest turn"):
        first = normal(cross(np.roll(a, 1) + 0.1 * a, b) + 1e-9)
        here, there = np.stack([a, np.roll(a, 1), np.roll(a, 2)], 1), np.stack([b, first, cross(b, first)], 1)
        return there @ here.T
    v, c = cross(a, b), a @ b
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + k + k @ k / (1 + c)


class Mechanism:
    """`told`: names of the joints that Kempe cut where the file leaves the choice to it."""

    def __init__(self, document, folder=".", told=()):
        self.told, self.bodies, self.joints, self.closures, self.drives = set(told), [], [], [], []
        self.forces, self.sensors, self.unknowns, self.edges = [], {}, [], []
        self.start, self.rates, self.held, self.ground_points = {}, {}, set(), {}
        self.names, self.document, self.states, self.blocks = {}, document, [], {}
        scope = self.read(document, pathlib.Path(folder), "", Point(-1, np.zeros(3)), {})
        self.gravity = scope.vector(document.get("gravity", ["0", "0", "0"]))
        self.make_tree()
        self.count()

    def body(self, name):
        return self.bodies[self.names[name]]

    # -- reading

    def read(self, document, folder, prefix, base, settings):
        scope = Scope(self, document, folder, prefix, base, settings)
        for name, keys in document.get("ground", {}).get("points", {}).items():
            scope.grounds[name] = scope.pose(keys)
            place, axes = scope.grounds[name]
            points = self.ground_points if base.body < 0 else self.bodies[base.body].points
            points[scope.full(name)] = (base.place + place, axes)
        for name, keys in document.get("bodies", {}).items():
            self.add_body(scope, name, keys)
        for keys in document.get("include", []):
            self.read_inner(scope, keys)
        for name, keys in document.get("bodies", {}).items():
            if "joint" in keys:
                self.add_joint(scope, name, keys["joint"])
        self.read_items(scope)
        self.read_start(scope)
        return scope

    def read_inner(self, scope, keys):
        import yaml_texts
        base = scope.point(keys.get("at", "ground"))
        offset = scope.vector(keys.get("offset", ["0", "0", "0"])) * (0 if broken("offset of includes") else 1)
        path = scope.folder / keys["file"]
        settings = {name: scope.number(text) for name, text in keys.get("set", {}).items()
                    if not broken("settings of includes")}
        return self.read(yaml_texts.load(path), path.parent, scope.prefix + keys.get("prefix", ""),
                         Point(base.body, base.place + offset), settings)

    def add_body(self, scope, name, keys):
        body = Body(scope.full(name), len(self.bodies))
        self.names[body.name] = body.number
        self.bodies.append(body)
        body.mass = scope.number(keys.get("mass", "0"))
        body.com = scope.vector(keys.get("com", ["0", "0", "0"]))
        for key, text in keys.get("inertia", {}).items():
            if key != "as_given":
                i, k = "xyz".index(key[0]), "xyz".index(key[1])
                body.inertia[i, k] = body.inertia[k, i] = scope.number(text)
        for point, place in keys.get("points", {}).items():
            body.points[point] = scope.pose(place)

    def chain(self, scope, kind, given):
        """The motions of a named joint about its axes a, b, c."""
        if kind == "motions":
            return [motion(scope, m) for m in given]
        if kind == "weld":
            return []
        a, b = (given[0], given[1]) if isinstance(given, list) and len(given) == 2 else (given, None)
        a_axis = scope.axis(a)
        if b is None:
            i = int(np.argmax(np.abs(a_axis)))
            b_axis = np.eye(3)[(i + 1) % 3]
        else:
            b_axis = scope.axis(b)
            b_axis = normal(b_axis - a_axis * (a_axis @ b_axis))
        b_axis = -b_axis if kind == "universal" and broken("axis of universal joints") else b_axis
        axes = {"a": a_axis, "b": b_axis, "c": cross(a_axis, b_axis)}
        word = KINDS[kind]
        return [(word[i] == "R", axes[word[i + 1]]) for i in range(0, len(word), 2)]

    def add_joint(self, scope, name, keys):
        kind = next(k for k in [*KINDS, "motions"] if k in keys)
        at, child = scope.point(keys["at"]), self.body(scope.full(name))
        to = Point(child.number, *child.points[keys["to"]]) if "to" in keys else Point(child.number, np.zeros(3))
        frame = scope.axes(keys["frame"]) if "frame" in keys else np.eye(3)
        pitch = scope.number(keys["pitch"]) if kind == "screw" else None
        joint = Joint(scope.full(keys.get("name", name)), at, to, frame, self.chain(scope, kind, keys[kind]),
                      keys.get("reversed") == "yes", pitch)
        joint.words = [None if w == "~" else scope.full(w) for w in keys.get("coordinates", [])]
        self.joints.append(joint)

    def read_items(self, scope):
        document = scope.document
        for name, keys in document.get("joints", {}).items():
            self.add_edge(scope, name, keys)
        for name, keys in document.get("loops", {}).items():
            self.closures.append(self.loop(scope, name, keys))
        for name, keys in document.get("drives", {}).items():
            self.drives.append(Item("drive", scope.full(name), scope, keys))
        for name, keys in document.get("states", {}).items():
            states, output = states_of(scope, name, keys)
            self.states += [(scope, state) for state in states]
            if output:
                self.blocks[scope.full(name)] = output
        for name, keys in document.get("forces", {}).items():
            self.forces.append(force(scope, name, keys))
        for name, keys in document.get("contacts", {}).items():
            if "joint" in keys:
                self.forces.append(Item("joint_contact", scope.full(name), scope, keys, []))
        for name, text in document.get("sensors", {}).items():
            self.sensors[scope.full(name)] = (scope, text)
        for name, keys in document.get("algebraic", {}).items():
            self.unknowns.append((scope, name, keys))

    def loop(self, scope, name, keys):
        kind = next(k for k in LOOPS if k in keys)
        if kind in ("coupler", "constraint"):
            return Item(kind, scope.full(name), scope, keys)
        points = [scope.point(text) for text in keys[kind]]
        texts = keys.get("axes", [keys.get("axis", "z")] * 2)
        return Item(kind, scope.full(name), scope, keys, points, [p.axes @ scope.axis(a) for p, a in zip(points, texts)])

    def add_edge(self, scope, name, keys):
        kind = next(k for k in KINDS if k in keys)
        first, second = (scope.point(text) for text in keys[kind])
        cut = keys["cut"] == "yes" if "cut" in keys else scope.full(name) in self.told and kind != "screw"
        if cut:
            loop = {**{k: v for k, v in keys.items() if k in ("axis", "axes")}, CUTS.get(kind, kind): keys[kind]}
            if kind == "planar" and "axes" in keys:
                loop["axes"] = [keys["axes"][0]] * 2  # the second one is an axis across, of the joint alone
            self.closures.append(self.loop(scope, name, loop))
            return
        given = keys.get("axes", keys.get("axis", "z"))
        pitch = scope.number(keys["pitch"]) if kind == "screw" else None
        self.edges.append(Joint(scope.full(name), first, second, np.eye(3), self.chain(scope, kind, given), pitch=pitch))

    def read_start(self, scope):
        start = scope.document.get("start", {})
        self.start.update({scope.full(k): scope.number(v) for k, v in start.get("q", {}).items()})
        self.rates.update({scope.full(k): scope.number(v) for k, v in start.get("qd", {}).items()})
        self.held.update(scope.full(k) for k in start.get("hold", []))

    # -- the tree and its coordinates

    def make_tree(self):
        """Every body is carried by one other; joints between two bodies are turned round where the second one carries."""
        carried = {joint.to.body for joint in self.joints}
        for joint in self.joints:
            joint.parent, joint.child = joint.at.body, joint.to.body
        while self.edges:
            before = len(self.edges)
            for joint in list(self.edges):
                ends = [self.reached(joint.at.body), self.reached(joint.to.body)]
                if ends[0] == ends[1]:
                    continue
                joint.turned = joint.loads_parent = not ends[0]
                if joint.turned:
                    joint.at, joint.to = joint.to, joint.at
                joint.parent, joint.child, joint.words = joint.at.body, joint.to.body, []
                self.joints.append(joint)
                carried.add(joint.child)
                self.edges.remove(joint)
            if len(self.edges) == before:
                raise ValueError("bodies that nothing joins to the ground")
        self.order()

    def reached(self, body):
        carriers = {joint.child: joint.parent for joint in self.joints}
        while body in carriers:
            body = carriers[body]
        return body < 0

    def order(self):
        """Parents before children."""
        left, done = list(self.joints), {-1}
        self.joints = []
        while left:
            joint = next(j for j in left if j.parent in done)
            left.remove(joint)
            self.joints.append(joint)
            done.add(joint.child)
        self.carrier = {joint.child: joint.parent for joint in self.joints}

    def count(self):
        self.places, self.columns, self.rotates = {}, [], []
        for joint in self.joints:
            for k, (rotation, _) in enumerate(joint.chain):
                number, single = len(self.columns), len(joint.chain) == 1
                joint.coordinates.append(number)
                word = joint.words[k] if k < len(getattr(joint, "words", [])) else None
                self.places[f"{joint.name}.{k + 1}"] = number
                self.columns.append(word or (joint.name if single else f"{joint.name}.{k + 1}"))
                self.rotates.append(rotation)
                for name in [word, joint.name if single else None]:
                    if name:
                        self.places[name] = number
        # Coordinates of a joint that is cut are functions of the others, which are not worked out here.
        self.sensors = {name: (scope, text) for name, (scope, text) in self.sensors.items()
                        if all(scope.full(word) in self.places for word in re.findall(r"\bqd?d?\(([\w.]+)\)", text))}

    def above(self, body):
        """The body itself, its carrier, and so on to the ground."""
        way = [body]
        while way[-1] >= 0:
            way.append(self.carrier[way[-1]])
        return way

    def common(self, closure):
        """The nearest common ancestor of a closure's bodies."""
        first = self.above(closure.points[0].body)
        return next(body for body in self.above(closure.points[1].body) if body in first)


def motion(scope, m):
    if isinstance(m, dict):
        (key, axis), = m.items()
        return key == "R", scope.axis(axis)
    sign = -1.0 if m[0] == "-" else 1.0
    return m[-2] == "R", sign * np.eye(3)[int(m[-1]) - 1]


def force(scope, name, keys):
    points = []
    if "at" in keys:
        kind, points = "at", [scope.point(keys["at"])]
    elif "on" in keys:
        kind, points = "on", [scope.point(keys["on"])]
    elif "joint" in keys:
        kind = next((k for k in ("stops", "friction", "spring") if k in keys), "effort")
        kind = "joint_" + kind
    else:
        kind = next(key for key in ("spring", "bushing", "line", "cylinder", "torsion") if key in keys)
        points = [scope.point(text) for text in keys[kind]]
    return Item(kind, scope.full(name), scope, keys, points)
