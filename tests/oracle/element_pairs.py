# SPDX-License-Identifier: BSD-3-Clause
"""Machines of random_pairs.py with machine elements: ropes, outlines, cams, gears, a tyre and an element of the library, from equations
by hand (feature_pairs --elements). A closure by an element leaves one coordinate."""
import math
import operator

import numpy as np

from event_motion import Machine
from random_pairs import Pair

FINER = 1e-2  # times the tolerance of the others: slips of a tyre are small differences of rates, which its accelerations multiply
KINDS = "pendulum cart slide cam hoist meshed wheel".split()
ELEMENTS = "rope touch library".split()
FEATURES = [*KINDS, *ELEMENTS, "touch-circle", "touch-flank", "touch-slot", "cam-flat", "cam-roller", "spring", "harmonic", "kink-position", "jump",
            "table", "state", "sampled", "counter", "relay", "delay", "friction", "stop", "measure", "input-hold"]
MUTATIONS = """rope-damping rope-slack touch-radius touch-side gas-exponent cam-bends cam-roller hoist-mass mesh-teeth tyre-slides
tyre-slip""".split()


def at_last_place(f):
    """The function of coordinates; at the last ones it is not worked out again."""
    kept = [None, None]

    def found(x):
        key = tuple(x)
        if kept[0] != key:
            kept[:] = key, f(x)
        return kept[1]
    return found


class ElementPair(Pair):
    def choose(self):
        kind = str(self.r.choice(KINDS))
        self.features.append(kind)
        self.loops, self.sections, self.pushes = "", {}, []
        getattr(self, kind)()
        self.spring()
        if kind in ("pendulum", "cart", "slide"):
            wanted = [name for name in ELEMENTS if kind != "slide" or name != "touch"]
            for name in self.r.choice(wanted, size=int(self.r.integers(1, 3)), replace=False):
                self.features.append(str(name))
                getattr(self, str(name))()
            self.carry()
        extra = ["harmonic", "kink_position", "jump", "table", "inputs", "state", "sampled", "counter", "relay", "delay", "friction", "stop", "measure"]
        for name in self.r.choice(extra, size=int(self.r.integers(0, 3)), replace=False):
            getattr(self, str(name))()
        self.loops += "".join(f"{name}: {{{', '.join(lines)}}}\n" for name, lines in self.sections.items())

    def tolerance(self):
        return super().tolerance() * (FINER if "wheel" in self.features else 1)

    def section(self, name, line):
        self.sections.setdefault(name, []).append(line)

    # -- a point that moves

    def mover(self):
        """The point of the moving body by its measures: its name, its place, its velocity."""
        word = self.measures[0][0].split("(")[1].split(")")[0]
        parts = [dict(self.measures).get(f"{what}({word}).{c}") for what in ("position", "velocity") for c in "xyz"]
        nothing = lambda t, x, v: 0.0  # noqa: E731
        places, rates = [p or nothing for p in parts[:3]], [p or nothing for p in parts[3:]]
        return word, lambda x: np.array([p(0.0, x, None) for p in places]), lambda x, v: np.array([p(0.0, x, v) for p in rates])

    def line(self):
        """Distance of the point from ground.N, its rate, its slopes by the coordinates."""
        word, place, rate = self.mover()
        n = self.machine.n

        def known(x):
            away = place(x) - (1.5, 0.5, 0)
            long = math.hypot(*away)
            e = away / long
            return long, e, [float(e @ rate(x, [float(j == k) for j in range(n)])) for k in range(n)]
        known = at_last_place(known)
        return word, lambda x: known(x)[0], lambda x, v: sum(map(operator.mul, known(x)[2], v)), lambda x: known(x)[2], lambda x: known(x)[1]

    def carry(self):
        """Joints carry the forces of elements, too, across their motion."""
        across = np.eye(3)
        if "slide" in self.features:
            word, place, rate = self.mover()
            d = rate(self.x, [1.0])
            across = across - np.outer(d, d)
        for name, base in list(self.machine.reactions.items()):
            if name in ("reaction(A)", "reaction(X)"):
                part = np.diag([0.0, 1, 1]) if name == "reaction(X)" else across
                self.machine.reactions[name] = lambda t, x, v, z, a, base=base, part=part: np.asarray(base(t, x, v, z, a)) - part @ sum(
                    push(t, x, v, z) for push in self.pushes)
                self.presses[name[9]] = lambda t, x, v, z, a, f, needed, name=name: float(np.linalg.norm(self.machine.reactions[name](t, x, v, z, a)))

    def along(self, slopes, push, direction):
        self.pushes.append(lambda t, x, v, z: push(t, x, v, z) * direction(x))
        self.machine.terms.append((None, lambda t, x, v, z: [push(t, x, v, z) * s for s in slopes(x)]))

    def rope(self):
        word, distance, rate, slopes, direction = self.line()
        free, k, c = round(distance(self.x) * float(self.r.uniform(0.93, 1.05)), 4), self.between(50, 800, 1), self.between(0.001, 0.02)
        self.section("ropes", f"rope: {{along: [ground.N, {word}], stiffness: {k}, damping: {c}, length: {free}}}")
        damping = self.mutated("rope-damping", c, 0.0)
        _, push = self.law_kinks(lambda t, x, v: distance(x) - free, lambda t, x, v: rate(x, v), lambda d, r: k * (d + damping * r))
        slack = self.mutated("rope-slack", 1.0, 0.0)
        self.along(slopes, lambda t, x, v, z: -push(t, x, v, z) if slack or distance(x) > free else -k * (distance(x) - free), direction)
        self.machine.reactions["tension(rope)"] = lambda t, x, v, z, a: [push(t, x, v, z)]

    def library(self):
        word, distance, rate, slopes, direction = self.line()
        f, n, c, long = self.between(20, 80, 1), self.between(1, 1.4), self.between(0, 5), round(distance(self.x) + self.between(0.2, 0.6), 3)
        rod, volume = self.between(8, 12), self.between(300, 500, 0)
        self.loops += (f"include: [{{file: kempe:gas_spring.yaml, prefix: gas_, ports: {{P: ground.N, Q: {word}}}, set: {{F1: {f} N, length: {long} m, rod: {rod} mm, "
                       f"volume: {volume} cm^3, n: {n}, damping: {c} N*s/m}}}}]\n")
        area, size, power = math.pi / 4 * (rod * 1e-3) ** 2, volume * 1e-6, self.mutated("gas-exponent", n, 1.0 if n != 1 else 1.2)
        self.along(slopes, lambda t, x, v, z: f * (size / (size - area * (long - distance(x)))) ** power - c * rate(x, v), direction)

    def touch(self):
        """A disc about the point on an outline, by a law."""
        word, place, rate = self.mover()
        kind = str(self.r.choice(["circle", "flank", "slot"]))
        self.features.append(f"touch-{kind}")
        n, r, start = self.machine.n, self.between(0.01, 0.05), place(self.x) - (1.5, 0.5, 0)
        text, force = self.law()
        apart = self.between(-0.01, 0.15)
        if kind == "circle":
            radius = round(float(np.hypot(*start[:2])) - r - apart, 4)
            if radius < 0.05:
                raise ValueError("too near")
            outline = f"circle: {radius}"
            surfaces = [(lambda p: math.hypot(p[0], p[1]) - self.mutated("touch-radius", r, 0.9 * r) - radius, lambda p: p / math.hypot(p[0], p[1]))]
        elif kind == "flank":
            top = round(float(start[1]) - r - apart, 4)
            outline = f"rectangle: [20, 0.8], at: [0, {top - 0.4!r}]"
            surfaces = [(lambda p: p[1] - self.mutated("touch-radius", r, 0.9 * r) - top, lambda p: np.array([0.0, 1.0, 0.0]))]
        else:
            half, middle = r + abs(apart) + 0.02, round(float(start[1]), 3)
            outline = f"slot: 20, width: {2 * half!r}, at: [-10, {middle}]"
            surfaces = [(lambda p, s=s: half - self.mutated("touch-radius", r, 0.9 * r) - s * (p[1] - middle), lambda p, s=s: np.array([0.0, -s, 0.0])) for s in (1.0, -1.0)]
            if self.broken == "touch-side":
                surfaces = surfaces[:1]
        self.section("outlines", f"o: {{{outline}}}")
        self.contacts.append(f"touch: {{cylinder: {word}, radius: {r}, on: {{outline: o, at: ground.N}}, {text}}}")
        for gap, normal in surfaces:
            def slopes(x, normal=normal):
                e = normal(place(x) - (1.5, 0.5, 0))
                return [float(e @ rate(x, [float(j == k) for j in range(n)])) for k in range(n)]
            slopes, depth = at_last_place(slopes), at_last_place(lambda x, gap=gap: -gap(place(x) - (1.5, 0.5, 0)))
            _, push = self.law_kinks(lambda t, x, v, depth=depth: depth(x), lambda t, x, v, slopes=slopes: -sum(map(operator.mul, slopes(x), v)), force)
            self.along(slopes, push, lambda x, normal=normal: normal(place(x) - (1.5, 0.5, 0)))

    # -- closures by an element

    def cam(self):
        """An eccentric disc lifts a follower with a flat face or a roller."""
        e, big, i, m = self.between(0.02, 0.1), self.between(0.15, 0.3), self.between(0.1, 0.5), self.between(0.5, 2)
        flat = self.chance(0.5)
        r = 0.0 if flat else self.between(0.01, 0.05)
        reach = big + self.mutated("cam-roller", r, 0.0)
        self.features.append("cam-flat" if flat else "cam-roller")
        self.gravity = [self.between(-3, 3), self.between(-9, 9), 0.0]
        self.bodies = (f"  a: {{joint: {{name: A, revolute: z, at: ground}}, mass: 1, inertia: {{zz: {i}}}, points: {{C: [0, 0, 0]}}}}\n"
                       f"  s: {{joint: {{name: S, prismatic: y, at: ground}}, mass: {m}, points: {{P: [0, 0, 0]}}}}\n")
        self.section("outlines", f"disc: {{circle: {big}, at: [{e}, 0]}}")
        self.section("loops", f"cam: {{follower: s.P, {'flat: y' if flat else f'roller: {r}'}, on: {{outline: disc, at: a.C}}}}")

        def lift(x):
            s, c = math.sin(x), math.cos(x)
            if flat:
                return reach + e * s, e * c, -e * s, 1.0
            root = math.sqrt(reach * reach - (e * c) ** 2)
            bent = e * e * s * c / root
            return e * s + root, e * c + bent, -e * s + e * e * (c * c - s * s) / root - bent * bent / root, root / reach
        self.machine = Machine(1, lambda x: [[i + m * lift(x[0])[1] ** 2]])
        g, bends = self.gravity[1], self.mutated("cam-bends", 1.0, 0.0)
        self.machine.terms.append((0, lambda t, x, v, z: m * lift(x[0])[1] * (g - bends * lift(x[0])[2] * v[0] ** 2)))
        self.machine.reactions["lambda(cam)"] = lambda t, x, v, z, a: [
            m * (lift(x[0])[1] * a[0] + lift(x[0])[2] * v[0] ** 2 - g) / lift(x[0])[3]]
        self.one("S", lambda x: lift(x)[0])

    def one(self, name, of):
        """The start of the coordinate A, and of one that depends on it."""
        self.force_word, self.joint, self.k = "torque", "A", 0
        x, v = self.between(-1, 1), self.between(-2, 2)
        self.begin_at([x], [v], ["A"])
        self.start_text = f"start: {{q: {{A: {x}, {name}: {of(x)!r}}}, qd: {{A: {v}}}, hold: [A]}}\n"

    def hoist(self):
        """A drum with a load on an inextensible rope."""
        r, i, m = self.between(0.1, 0.3), self.between(0.1, 0.5), self.between(0.5, 2)
        self.gravity = [0, -9.81, 0]
        self.points = f", W: [{r}, -3, 0]"
        self.bodies = (f"  a: {{joint: {{name: A, revolute: z, at: ground}}, mass: 1, inertia: {{zz: {i}}}, points: {{C: [0, 0, 0]}}}}\n"
                       f"  s: {{joint: {{name: S, prismatic: y, at: ground.W}}, mass: {m}, points: {{P: [0, 0, 0]}}}}\n")
        self.section("ropes", f"rope: {{along: [{{drum: a.C, radius: {r}, turn: right}}, s.P], slack: no}}")
        carried = self.mutated("hoist-mass", m, 0.0)
        self.machine = Machine(1, lambda x: [[i + carried * r * r]])
        self.machine.terms.append((0, lambda t, x, v, z: -m * 9.81 * r))
        self.machine.reactions["tension(rope)"] = lambda t, x, v, z, a: [m * (r * a[0] + 9.81)]
        self.one("S", lambda x: 0.0)

    def meshed(self):
        """A pair of spur wheels."""
        first, second, apart = int(self.r.integers(15, 30)), int(self.r.integers(20, 50)), self.between(0.1, 0.3)
        ia, ib = self.between(0.1, 0.5), self.between(0.02, 0.1)
        self.gravity, self.points = [0, 0, -9.81], f", B: [{apart}, 0, 0]"
        self.bodies = (f"  a: {{joint: {{name: A, revolute: z, at: ground}}, mass: 1, inertia: {{zz: {ia}}}}}\n"
                       f"  b: {{joint: {{name: B, revolute: z, at: ground.B}}, mass: 1, inertia: {{zz: {ib}}}}}\n")
        self.section("gears", f"mesh: {{between: [A, B], teeth: [{first}, {second}]}}")
        ratio = first / second
        counted = self.mutated("mesh-teeth", ratio, 1.0)
        self.machine = Machine(1, lambda x: [[ia + counted * counted * ib]])
        self.machine.reactions["lambda(mesh)"] = lambda t, x, v, z, a: [ib * ratio * a[0] * (first + second) / (apart * second)]
        self.one("B", lambda x: 0.0)

    def wheel(self):
        """A wheel with a brush tyre that drives a carriage; its load is constant."""
        m, w, i = self.between(20, 60), self.between(5, 10), self.between(0.5, 2)
        radius, rho, c = 0.3, self.between(0.005, 0.02), self.between(1e4, 5e4, 0)
        cp, half, mu, low = self.between(2e5, 6e5, 0), self.between(0.04, 0.08), self.between(0.3, 1), self.between(1, 3)
        self.gravity = [self.between(-2, 2), 0, -9.81]
        self.points = f", H: [0, 0, {radius - rho!r}], O: [0, 0, 0]"
        self.bodies = (f"  c: {{joint: {{name: X, prismatic: x, at: ground.H}}, mass: {m}, points: {{P: [0, 0, 0]}}}}\n"
                       f"  a: {{joint: {{name: A, revolute: y, at: c.P}}, mass: {w}, inertia: {{yy: {i}}}, points: {{C: [0, 0, 0]}}}}\n")
        self.section("roads", "street: {flat: ground.O}")
        self.section("tyres", f"T: {{on: street, at: a.C, model: brush, radius: {radius}, vertical_stiffness: {c}, tread_stiffness: {cp}, half_length: {half}, "
                              f"friction: {mu}, low_speed: {low}}}")
        most, effective = mu * c * rho, radius - rho / 3
        theta = 2 * cp * half * half / (3 * most)

        def reach(x, v):
            kappa = (v[1] * self.mutated("tyre-slip", effective, radius) - v[0]) / math.hypot(v[0], low)
            return kappa, theta * abs(kappa) / abs(1 + kappa)

        def pull(x, v):
            kappa, u = reach(x, v)
            u = min(u, 1.0) if self.broken != "tyre-slides" else u
            return math.copysign(most * (3 * u - 3 * u * u + u**3), kappa)
        self.machine = Machine(2, lambda x: [[m + w, 0.0], [0.0, i]])
        self.machine.kinks.append(lambda t, x, v, z: reach(x, v)[1] - 1)
        self.machine.terms.append((None, lambda t, x, v, z: (pull(x, v) + (m + w) * self.gravity[0], -(radius - rho) * pull(x, v))))
        self.k = int(self.r.integers(2))
        self.force_word, self.joint = ("force", "X") if self.k == 0 else ("torque", "A")
        speed = self.between(2, 6)
        self.begin_at([self.between(-0.2, 0.2), self.between(-0.8, 0.8)], [speed, round(speed / effective * self.between(0.8, 1.3), 3)], ["X", "A"])
