# SPDX-License-Identifier: BSD-3-Clause
"""A robot's URDF as a model of Kempe, as JSON: the robot's own axes are those of the ground while all its joints are at zero,
and links that are fixed to each other are one body. The first body moves freely."""
import json
import math
import xml.etree.ElementTree as xml


def numbers(text, default="0 0 0"):
    return [float(x) for x in (text or default).split()]


def rotation(rpy):
    """Roll, pitch, yaw about fixed x, y, z."""
    (cx, sx), (cy, sy), (cz, sz) = ((math.cos(a), math.sin(a)) for a in rpy)
    return [[cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx], [-sy, cy * sx, cy * cx]]


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def turned(a, x):
    return [sum(a[i][k] * x[k] for k in range(3)) for i in range(3)]


def plus(a, b):
    return [x + y for x, y in zip(a, b)]


class Body:
    """Parts (mass, centre from the ground, inertia about it), all in the ground's axes."""

    def __init__(self, name, parent, place, motions):
        self.name, self.parent, self.place, self.motions, self.parts = name, parent, place, motions, []

    def whole(self):
        """Mass, centre from the body's origin, inertia about it."""
        mass = sum(m for m, _, _ in self.parts)
        centre = [sum(m * c[i] for m, c, _ in self.parts) / mass if mass else 0 for i in range(3)]
        inertia = [[0.0] * 3 for _ in range(3)]
        for m, c, own in self.parts:
            d = [x - y for x, y in zip(c, centre)]
            for i in range(3):
                for j in range(3):
                    inertia[i][j] += own[i][j] + m * ((i == j) * sum(x * x for x in d) - d[i] * d[j])
        return mass, [x - y for x, y in zip(centre, self.place)], inertia


class Robot:
    def __init__(self, path):
        root = xml.parse(path).getroot()
        self.links = {link.get("name"): link for link in root.findall("link")}
        self.children = {}
        for joint in root.findall("joint"):
            self.children.setdefault(joint.find("parent").get("link"), []).append(joint)
        held = {j.find("child").get("link") for joints in self.children.values() for j in joints}
        first = next(name for name in self.links if name not in held)
        self.bodies = [Body("base", None, [0, 0, 0], ["T1", "T2", "T3", "R1", "R2", "R3"])]
        self.walk(first, self.bodies[0], [0, 0, 0], rotation([0, 0, 0]))

    def walk(self, link, body, place, axes):
        """Adds a link at a place to a body, then what hangs on it."""
        inertial = self.links[link].find("inertial")
        if inertial is not None:
            origin, given = inertial.find("origin"), inertial.find("inertia")
            own = times(axes, rotation(numbers(origin.get("rpy") if origin is not None else None)))
            centre = plus(place, turned(axes, numbers(origin.get("xyz") if origin is not None else None)))
            i = {k: float(given.get(k)) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")}
            matrix = [[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]]
            transposed = [list(row) for row in zip(*own)]
            body.parts.append((float(inertial.find("mass").get("value")), centre, times(times(own, matrix), transposed)))
        for joint in self.children.get(link, []):
            origin = joint.find("origin")
            there = plus(place, turned(axes, numbers(origin.get("xyz") if origin is not None else None)))
            turn = times(axes, rotation(numbers(origin.get("rpy") if origin is not None else None)))
            child, kind, on = joint.find("child").get("link"), joint.get("type"), body
            if kind != "fixed":
                axis = turned(turn, numbers(joint.find("axis").get("xyz")))
                on = Body(child, body, there, [{"T" if kind == "prismatic" else "R": axis}])
                self.bodies.append(on)
            self.walk(child, on, there, turn)

    def model(self, name):
        bodies = {}
        for b in self.bodies:
            mass, com, inertia = b.whole()
            keys = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
            at = f"{b.parent.name}.{b.name}" if b.parent else "ground.base"
            bodies[b.name] = {"joint": {"at": at, "name": f"j_{b.name}", "motions": b.motions}, "mass": mass, "com": com,
                              "inertia": {k: inertia[i][j] for k, (i, j) in keys.items()}, "points": {"O": [0, 0, 0]}}
        for b in self.bodies[1:]:
            bodies[b.parent.name]["points"][b.name] = [x - y for x, y in zip(b.place, b.parent.place)]
        return json.dumps({"kempe": 1, "name": name, "gravity": [0, 0, -9.81], "ground": {"points": {"base": [0, 0, 0]}}, "bodies": bodies})


def model(path, name):
    return Robot(path).model(name)
