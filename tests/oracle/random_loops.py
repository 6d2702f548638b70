# SPDX-License-Identifier: BSD-3-Clause
"""Random closures of a mechanism that is placed: their second points are put where they must be. Those that would lock the
mechanism, or say nothing new, are taken back. Rates are made to fit."""
import numpy as np

from random_choices import Choices
from closure_residuals import floating
from jets import Jet, turning
from mechanics import Motion
from mechanism import Mechanism, Point, Scope, normal

CLOSURES = ("ball", "rod", "revolute", "universal", "cylindrical", "prismatic", "weld", "planar", "point_on_line",
            "point_on_plane")
LOCKING = ("revolute", "universal", "cylindrical", "prismatic", "weld")  # with so many rows that few trees leave room
CURVES = ("table", "y", "y-and-z", "surface", "two-surfaces")
CUTS = {kind: kind for kind in ("revolute", "universal", "cylindrical", "prismatic", "weld", "planar")} | {"ball": "spherical"}


def rotation(axis, angle):
    return turning(axis, Jet(np.array([angle]), np.zeros(1), np.zeros(1))).v[0]


class Loops(Choices):
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
        self.coupler_screws()
        self.look()

    def coupler_screws(self):
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

    def add_closures(self):
        for _ in range(self.one_of(0, 1, 1, 2, 2, 3)):
            maker, kind = self.one_of(*[(self.put_point_closure, kind) for kind in (*CLOSURES, *CURVES)],
                                      *[(maker, None) for maker in (self.put_coupler, self.put_constraint, self.put_drive)] * 4)
            for _ in range(20 if kind in LOCKING else 8):
                if self.try_closure(maker, kind):
                    break

    def try_closure(self, maker, kind):
        """One closure more, unless it locks the mechanism or says nothing new."""
        before = {key: dict(self.document.get(key, {})) for key in ("loops", "joints", "drives", "tables", "parameters")}
        features = dict(self.features)
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
        self.features.clear()
        self.features.update(features)
        self.cuts &= set(before["joints"])
        for key, value in before.items():
            self.document[key] = value
            if not value and key != "parameters":
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
            given = {key: self.exact(mine[:, k]) for k, key in enumerate("xy")}
            self.document["bodies"][body]["points"][name] = {"at": local, "axes": given}
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

    def mechanism_table(self, name):
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

    def put_coupler(self):
        first, second = self.coordinate(), self.coordinate()
        if first is None or first[1] == second[1]:
            return None
        factor = self.between(0.4, 2.0)
        keys = {"coupler": {first[0]: "1", second[0]: repr(-factor)}}
        if self.chance(0.5):
            self.features["coupler-equals"] += 1
            keys["equals"] = repr(self.value(first) - factor * self.value(second))
        self.made = "coupler"
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
        loops = {n: k for n, k in self.document.get("loops", {}).items() if "coupler" not in k and "constraint" not in k}
        if loops and self.chance(0.15):
            name = list(loops)[-1]
            self.document["loops"][name + "again"] = loops[name]
            self.features["redundant"] += 1
            self.look()

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
