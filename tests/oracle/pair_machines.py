# SPDX-License-Identifier: BSD-3-Clause
"""The machines of random_pairs.py before forces of features act on them: text of their bodies and loops, equations by hand, what
their joints and loops carry."""
import math

import numpy as np

from event_motion import Border, Held, Machine


def pull(l, angle, rate, change, across):
    """Acceleration of the centre of an arm whose joint accelerates across, less gravity."""
    s, c = math.sin(angle), math.cos(angle)
    return np.array([across + l * (c * change - s * rate * rate), l * (s * change + c * rate * rate) + 9.81, 0.0])


def last_kept(function):
    """The value of a function for the last argument is not computed again."""
    kept = {}

    def once(x):
        if x not in kept:
            kept.clear()
            kept[x] = function(x)
        return kept[x]
    return once


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def mixed(*parts):
    """The sum of vectors times numbers."""
    return tuple(sum(w * a[k] for w, a in parts) for k in range(3))


def turner(axis, arm):
    """A function of an angle: the arm that turns about the axis, and its first and second derivative."""
    along = mixed((dot(axis, arm), axis))
    across, beside = mixed((1, arm), (-1, along)), cross(axis, arm)
    (a, b, c), (d, e, f), (g, h, i) = along, across, beside

    def turned(angle):
        s, u = math.sin(angle), math.cos(angle)
        x, y, z = u * d + s * g, u * e + s * h, u * f + s * i
        return (a + x, b + y, c + z), (u * g - s * d, u * h - s * e, u * i - s * f), (-x, -y, -z)
    return turned


def bar(length, angle):
    """The same of a bar in the plane."""
    s, c = length * math.sin(angle), length * math.cos(angle)
    return (c, s, 0.0), (-s, c, 0.0), (-c, -s, 0.0)


def numbers(vector):
    return [float(x) for x in vector]


class Machines:
    # coordinates are those that are independent, forces act on `joint`, coordinate k

    def slide(self):
        m = self.between(0.5, 2)
        axis = self.r.standard_normal(3).round(2)
        axis = axis if np.abs(axis).max() > 0.3 else np.array([1.0, 0.2, 0.1])
        g, p = self.r.uniform(-6, 6, 3).round(2), self.r.uniform(-8, 8, 3).round(2)
        d = axis / np.linalg.norm(axis)
        self.gravity = g
        self.bodies = f"  a: {{joint: {{name: A, prismatic: {list(map(float, axis))}, at: ground}}, mass: {m}, inertia: {{xx: 0.1, yy: 0.1, zz: 0.1}}, points: {{O: [0, 0, 0]}}}}\n"
        self.machine = Machine(1, lambda x: [[m]])
        along = self.mutated("gravity-across", float(m * g @ d), 0.0)
        self.machine.terms.append((0, lambda t, x, v, z: along))
        self.force_word, self.joint, self.k = "force", "A", 0
        whole = m * g
        if not self.plain and self.chance(0.5):
            self.forces.append(f"  push: {{at: a.O, force: {list(map(float, p))}}}")
            pushed = self.mutated("push-ignored", float(p @ d), 0.0)
            self.machine.terms.append((0, lambda t, x, v, z: pushed))
            whole = m * g + p
        across = whole - (whole @ d) * d
        swings = not self.plain and self.chance(0.5)  # a force across the axis that changes with time
        w, s = self.between(2, 9), (self.r.uniform(-4, 4, 3) * swings).round(2)
        if swings:
            self.forces.append(f"  sway: {{at: a.O, force: [{', '.join(f'{c}*sin({w}*t)' for c in s)}]}}")
            swung = self.mutated("sway-ignored", float(s @ d), 0.0)
            self.machine.terms.append((0, lambda t, x, v, z: swung * math.sin(w * t)))
        sway = s - (s @ d) * d

        def carried(t):
            return across + sway * math.sin(w * t)
        self.presses["A"] = lambda t, x, v, z, a, f, needed: float(np.linalg.norm(self.mutated("friction-without-load", 1.0, 0.5) * carried(t)))
        self.machine.reactions["reaction(A)"] = lambda t, x, v, z, a: -carried(t)
        self.measures = [(f"position(a.O).{c}", lambda t, x, v, n=n: d[n] * x[0]) for n, c in enumerate("xyz")] + [
            (f"velocity(a.O).{c}", lambda t, x, v, n=n: d[n] * v[0]) for n, c in enumerate("xyz")]
        self.begin_at([self.between(-0.3, 0.3)], [self.between(-1, 1)], ["A"])

    def pendulum(self):
        m, l, i = self.between(0.5, 2), self.between(0.3, 0.8), self.between(0.02, 0.1)
        self.gravity = [0, -9.81, 0]
        self.bodies = f"  a: {{joint: {{name: A, revolute: z, at: ground}}, mass: {m}, com: [0, {-l}, 0], inertia: {{zz: {i}}}, points: {{M: [0.2, {-l}, 0]}}}}\n"
        self.machine = Machine(1, lambda x: [[i + m * l * l]])
        self.machine.terms.append((0, lambda t, x, v, z: -m * 9.81 * l * math.sin(x[0])))
        self.force_word, self.joint, self.k = "torque", "A", 0
        self.machine.reactions["reaction(A)"] = lambda t, x, v, z, a: m * pull(l, x[0], v[0], a[0], 0.0)
        self.presses["A"] = lambda t, x, v, z, a, f, needed: m * float(np.linalg.norm(pull(l, x[0], v[0], a[0], 0.0)))
        self.measure_of_arm(l, 0)
        self.begin_at([self.between(-1, 1)], [self.between(-2, 2)], ["A"])

    def cart(self):
        big, m, l, i = self.between(1, 3), self.between(0.3, 1), self.between(0.3, 0.7), self.between(0.01, 0.05)
        self.gravity = [0, -9.81, 0]
        self.bodies = (f"  c: {{joint: {{name: X, prismatic: x, at: ground}}, mass: {big}, points: {{P: [0, 0, 0]}}}}\n"
                       f"  a: {{joint: {{name: A, revolute: z, at: c.P}}, mass: {m}, com: [0, {-l}, 0], inertia: {{zz: {i}}}, points: {{M: [0.2, {-l}, 0]}}}}\n")
        self.machine = Machine(2, lambda x: [[big + m, m * l * math.cos(x[1])], [m * l * math.cos(x[1]), i + m * l * l]])
        self.machine.terms.append((None, lambda t, x, v, z: (m * l * math.sin(x[1]) * v[1] ** 2, -m * 9.81 * l * math.sin(x[1]))))
        self.k = int(self.r.integers(2))
        self.force_word, self.joint = ("force", "X") if self.k == 0 else ("torque", "A")
        self.machine.reactions["reaction(A)"] = lambda t, x, v, z, a: m * pull(l, x[1], v[1], a[1], a[0])
        self.machine.reactions["reaction(X)"] = lambda t, x, v, z, a: np.array([0, big * 9.81 + m * pull(l, x[1], v[1], a[1], a[0])[1], 0])
        self.presses["A"] = lambda t, x, v, z, a, f, needed: m * float(np.linalg.norm(pull(l, x[1], v[1], a[1], a[0])))
        self.presses["X"] = lambda t, x, v, z, a, f, needed: abs(big * 9.81 + m * pull(l, x[1], v[1], a[1], a[0])[1])
        self.measure_of_arm(l, 1)
        self.begin_at([self.between(-0.2, 0.2), self.between(-0.8, 0.8)], [self.between(-0.5, 0.5), self.between(-1.5, 1.5)], ["X", "A"])

    def yoke(self):
        """A Scotch yoke: the slider stands at r sin(A)."""
        r, i, m = self.between(0.2, 0.5), self.between(0.1, 0.5), self.between(0.5, 2)
        self.gravity = [self.between(-3, 3), 0, 0]
        g = self.gravity[0]
        self.bodies = (f"  a: {{joint: {{name: A, revolute: z, at: ground}}, mass: 1, inertia: {{zz: {i}}}}}\n"
                       f"  s: {{joint: {{name: S, prismatic: x, at: ground}}, mass: {m}}}\n")
        self.loops = f"loops: {{yoke: {{constraint: \"q(S) - {r}*sin(q(A))\"}}}}\n"
        carried = self.mutated("yoke-mass", m, 0.0)
        self.machine = Machine(1, lambda x: [[i + carried * (r * math.cos(x[0])) ** 2]])
        self.machine.terms.append((0, lambda t, x, v, z: m * r * r * math.sin(x[0]) * math.cos(x[0]) * v[0] ** 2 + m * g * r * math.cos(x[0])))
        self.machine.reactions["lambda(yoke)"] = lambda t, x, v, z, a: [m * (r * math.cos(x[0]) * a[0] - r * math.sin(x[0]) * v[0] ** 2 - g)]
        self.force_word, self.joint, self.k = "torque", "A", 0
        x, v = self.between(-1, 1), self.between(-2, 2)
        self.begin_at([x], [v], ["A"])
        self.start_text = f"start: {{q: {{A: {x}, S: {r * math.sin(x)!r}}}, qd: {{A: {v}}}, hold: [A]}}\n"

    def gear(self):
        n, ia, ib = self.between(-3, 3, 1) or 1.5, self.between(0.1, 0.5), self.between(0.02, 0.1)
        self.gravity = [0, 0, -9.81]
        self.bodies = (f"  a: {{joint: {{name: A, revolute: z, at: ground}}, mass: 1, inertia: {{zz: {ia}}}}}\n"
                       f"  b: {{joint: {{name: B, revolute: z, at: ground}}, mass: 1, inertia: {{zz: {ib}}}}}\n")
        self.loops = f"loops: {{wheels: {{constraint: \"q(B) - ({n})*q(A)\"}}}}\n"
        ratio = self.mutated("gear-sign", n, 0.0)
        self.machine = Machine(1, lambda x: [[ia + ratio * ratio * ib]])
        self.machine.reactions["lambda(wheels)"] = lambda t, x, v, z, a: [ib * n * a[0]]
        self.force_word, self.joint, self.k = "torque", "A", 0
        x, v = self.between(-1, 1), self.between(-2, 2)
        self.begin_at([x], [v], ["A"])
        self.start_text = f"start: {{q: {{A: {x}, B: {n * x!r}}}, qd: {{A: {v}}}, hold: [A]}}\n"

    def driven(self):
        """A pendulum on a cart that is driven by a function of time with a kink: the rate of the pendulum jumps there."""
        m, l, i = self.between(0.5, 2), self.between(0.3, 0.8), self.between(0.02, 0.1)
        at, before, after = self.between(0.1, 0.5), self.between(-1, 1), self.between(-1, 1)
        word = str(self.r.choice(["if", "max", "abs"]))
        low = {"if": f"if(t < {at}, {before}*t, {before}*{at} + {after}*(t - {at}))",
               "max": f"{before}*t + ({round(after - before, 6)})*max(t - {at}, 0)",
               "abs": f"{round((before + after) / 2, 6)}*t + ({round((after - before) / 2, 6)})*abs(t - {at})"}[word]
        self.gravity = [0, -9.81, 0]
        self.bodies = (f"  c: {{joint: {{name: X, prismatic: x, at: ground}}, mass: 1, points: {{P: [0, 0, 0]}}}}\n"
                       f"  a: {{joint: {{name: A, revolute: z, at: c.P}}, mass: {m}, com: [0, {-l}, 0], inertia: {{zz: {i}}}, points: {{M: [0.2, {-l}, 0]}}}}\n")
        self.loops = f"drives: {{d: {{joint: X, displacement: \"{low}\"}}}}\n"
        self.machine = Machine(1, lambda x: [[i + m * l * l]])
        self.machine.terms.append((0, lambda t, x, v, z: -m * 9.81 * l * math.sin(x[0])))
        jump = self.mutated("drive-impulse", after - before, 0.0)
        self.machine.impulses.append((at, lambda x, v: [v[0] - m * l * math.cos(x[0]) * jump / (i + m * l * l)]))
        self.machine.breaks.append(at)
        self.machine.reactions["reaction(A)"] = lambda t, x, v, z, a: m * pull(l, x[0], v[0], a[0], 0.0)
        self.machine.reactions["lambda(d)"] = lambda t, x, v, z, a: [m * pull(l, x[0], v[0], a[0], 0.0)[0]]
        self.presses["A"] = lambda t, x, v, z, a, f, needed: m * float(np.linalg.norm(pull(l, x[0], v[0], a[0], 0.0)))
        self.force_word, self.joint, self.k = "torque", "A", 0
        self.begin_at([self.between(-1, 1)], [self.between(-2, 2)], ["A"])


    def measure_of_arm(self, l, n):
        """Measures of the point M of an arm, which is 0.2 beside its end."""
        def place(t, x):
            s, c = math.sin(x[n]), math.cos(x[n])
            return np.array([0.2 * c + l * s + (x[0] if n else 0), 0.2 * s - l * c])

        def rate(t, x, v):
            s, c = math.sin(x[n]), math.cos(x[n])
            return np.array([v[n] * (l * c - 0.2 * s) + (v[0] if n else 0), v[n] * (0.2 * c + l * s)])
        self.measures = [("position(a.M).x", lambda t, x, v: place(t, x)[0]), ("position(a.M).y", lambda t, x, v: place(t, x)[1]),
                         ("velocity(a.M).x", lambda t, x, v: rate(t, x, v)[0]), ("velocity(a.M).y", lambda t, x, v: rate(t, x, v)[1]),
                         ("distance(a.M, ground.N)", lambda t, x, v: float(np.hypot(*(place(t, x) - (1.5, 0.5))))),
                         ("axes(a.M).x.y", lambda t, x, v: math.sin(x[n]))]

    # closed loops whose dependent coordinate has a formula

    def direction(self):
        axis = self.r.standard_normal(3)
        return tuple(numbers(axis / np.linalg.norm(axis)))

    def crank(self):
        """A crank about an axis in space: its text, its inertia, its moment of gravity, its end."""
        e, p, c = self.direction(), numbers(self.r.uniform(-0.4, 0.4, 3)), numbers(self.r.uniform(-0.3, 0.3, 3))
        m, i = self.between(0.5, 2), self.between(0.02, 0.2)
        g, weigh, end = self.gravity, turner(e, c), turner(e, p)
        text = (f"  a: {{joint: {{name: A, revolute: {numbers(e)}, at: ground}}, mass: {m}, com: {numbers(c)}, "
                f"inertia: {{xx: {i}, yy: {i}, zz: {i}}}, points: {{P: {numbers(p)}}}}}\n")
        return text, i + m * dot(cross(e, c), cross(e, c)), last_kept(lambda x: m * dot(weigh(x)[1], g)), end

    def rod(self):
        """A crank, a rod without mass on two balls, and a slider, all about axes in space."""
        self.gravity = g = numbers(self.r.uniform(-8, 8, 3).round(2))
        for _ in range(200):
            text, inertia, moment, end = self.crank()
            d, start = self.direction(), numbers(self.r.uniform(-0.8, 0.8, 3))
            x0, s0, ms = self.between(-3, 3), self.between(-0.3, 0.3), self.between(0.3, 2)
            u = mixed((1, end(x0)[0]), (-1, start), (-s0, d))
            length = math.sqrt(dot(u, u))
            if length > 0.5 and abs(dot(u, d)) > 0.6 * length:
                break
        side, gd = math.copysign(1, dot(u, d)), dot(g, d)

        @last_kept
        def slide(x):
            """Its place, two derivatives by the angle, the direction of the rod."""
            p, p1, p2 = end(x)
            w = (p[0] - start[0], p[1] - start[1], p[2] - start[2])
            wd = dot(w, d)
            square = length ** 2 - dot(w, w) + wd * wd
            if square < (0.15 * length) ** 2:
                raise Border("a dead centre is near")
            s = wd - side * math.sqrt(square)
            u = (w[0] - s * d[0], w[1] - s * d[1], w[2] - s * d[2])
            ud = dot(u, d)
            s1 = dot(u, p1) / ud
            rate = (p1[0] - s1 * d[0], p1[1] - s1 * d[1], p1[2] - s1 * d[2])
            return s, s1, (dot(rate, rate) + dot(u, p2)) / ud, mixed((1 / length, u))

        def tension(x, v, a, f):
            """Force of the rod on the slider, with a force f of others along its way."""
            _, s1, s2, u = slide(x[0])
            return mixed(((ms * (s1 * a[0] + s2 * v[0] ** 2 - gd) - f) / dot(u, d), u))

        def across(x, v, a, f):
            whole = mixed((ms, g), (1, tension(x, v, a, f)))
            return mixed((1, whole), (-dot(whole, d), d))

        def ratio(x):
            s1 = slide(x[0])[1]
            if abs(s1) < 0.02:
                raise Border("a slider turns round")
            return s1
        self.bodies = text + f"  s: {{joint: {{name: S, prismatic: {numbers(d)}, at: ground.S}}, mass: {ms}, points: {{Q: [0, 0, 0]}}}}\n"
        self.points = f", S: {numbers(start)}"
        self.loops = f"loops: {{C: {{rod: [a.P, s.Q], length: {length!r}}}}}\n"
        carried = self.mutated("rod-mass", ms, 0.5 * ms)
        self.machine = Machine(1, lambda x: [[inertia + carried * slide(x[0])[1] ** 2]])
        self.machine.terms.append((0, lambda t, x, v, z: moment(x[0]) + ms * slide(x[0])[1] * (gd - slide(x[0])[2] * v[0] ** 2)))
        self.rubbing = "S", "force", ratio
        self.presses["S"] = lambda t, x, v, z, a, f, needed: math.hypot(*across(x, v, a, f))
        self.load_of_friction = lambda x, v, a, f: {"reaction(C)": tension(x, v, a, f), "reaction(S)": mixed((-1, across(x, v, a, f)))}
        for name in ("reaction(C)", "reaction(S)"):
            self.machine.reactions[name] = lambda t, x, v, z, a, n=name: self.load_of_friction(x, v, a, self.rubs(t, x, v, z, a))[n]
        self.begin_loop(x0, {"S": s0})

    def rubs(self, t, x, v, z, a):
        """The friction on a dependent coordinate, by what the accelerations leave."""
        h = self.held
        if h is None or not h.rubs() or h.ratio is None:
            return 0.0
        return (self.machine.mass(x)[0][0] * a[0] - self.machine.force(t, x, v, z)[0]) / h.ratio(x)

    def begin_loop(self, x, dependent):
        self.force_word, self.joint, self.k = "torque", "A", 0
        v = self.between(-2, 2)
        self.begin_at([x], [v], ["A"])
        places = "".join(f", {name}: {value!r}" for name, value in dependent.items())
        self.start_text = f"start: {{q: {{A: {x}{places}}}, qd: {{A: {v}}}, hold: [A]}}\n"

    def rocker(self):
        """A crank, a rod without mass on two balls, and a rocker, all about axes in space."""
        self.gravity = g = numbers(self.r.uniform(-8, 8, 3).round(2))
        for _ in range(200):
            text, inertia, moment, end = self.crank()
            f, q, c, pivot = self.direction(), *(numbers(self.r.uniform(-size, size, 3)) for size in (0.5, 0.3, 0.8))
            x0, y0, m, i = self.between(-3, 3), self.between(-1.5, 1.5), self.between(0.3, 2), self.between(0.02, 0.1)
            turned, weigh = turner(f, q), turner(f, c)
            arm, arm1, _ = turned(y0)
            u = mixed((1, end(x0)[0]), (-1, pivot), (-1, arm))
            length, reach = math.hypot(*u), math.hypot(*arm1)
            if length > 0.4 and reach > 0.2 and abs(dot(u, arm1)) > 0.6 * length * reach:
                break
        along, beside = mixed((dot(f, q), f)), cross(f, q)
        across, base = mixed((1, q), (-1, along)), mixed((1, pivot), (1, along))
        square, side, whole = dot(across, across), None, i + m * dot(cross(f, c), cross(f, c))

        @last_kept
        def swing(x):
            nonlocal side
            p, p1, p2 = end(x)
            w = (p[0] - base[0], p[1] - base[1], p[2] - base[2])
            a, b = dot(w, across), dot(w, beside)
            level = (dot(w, w) + square - length ** 2) / 2
            size = math.hypot(a, b)
            if abs(level) > 0.97 * size:
                raise Border("a dead centre is near")
            middle, half = math.atan2(b, a), math.acos(level / size)
            if side is None:
                side = min((1, -1), key=lambda s: abs(math.remainder(middle + s * half - y0, 2 * math.pi)))
            y = y0 + math.remainder(middle + side * half - y0, 2 * math.pi)
            arm, arm1, arm2 = turned(y)
            u = (p[0] - pivot[0] - arm[0], p[1] - pivot[1] - arm[1], p[2] - pivot[2] - arm[2])
            lever = dot(u, arm1)
            y1 = dot(u, p1) / lever
            rate = (p1[0] - y1 * arm1[0], p1[1] - y1 * arm1[1], p1[2] - y1 * arm1[2])
            return y, y1, (dot(rate, rate) + dot(u, p2) - y1 * y1 * dot(u, arm2)) / lever, u, lever, m * dot(weigh(y)[1], g)

        def pull_on(x, v, a):
            _, y1, y2, u, lever, weight = swing(x[0])
            return mixed(((whole * (y1 * a[0] + y2 * v[0] ** 2) - weight) / lever, u))
        self.bodies = text + (f"  b: {{joint: {{name: B, revolute: {numbers(f)}, at: ground.B}}, mass: {m}, com: {numbers(c)}, "
                              f"inertia: {{xx: {i}, yy: {i}, zz: {i}}}, points: {{Q: {numbers(q)}}}}}\n")
        self.points = f", B: {numbers(pivot)}"
        self.loops = f"loops: {{C: {{rod: [a.P, b.Q], length: {length!r}}}}}\n"
        self.machine = Machine(1, lambda x: [[inertia + whole * swing(x[0])[1] ** 2]])

        def force(t, x, v, z):
            _, y1, y2, _, _, weight = swing(x[0])
            return moment(x[0]) + y1 * (weight - self.mutated("rocker-bends", whole, 0.0) * y2 * v[0] ** 2)
        self.machine.terms.append((0, force))
        self.machine.reactions["reaction(C)"] = lambda t, x, v, z, a: pull_on(x, v, a)
        self.begin_loop(x0, {"B": y0})

    def four_bar(self):
        """In a plane, with a mass on each bar; the pin between coupler and rocker closes the loop."""
        self.gravity = [self.between(-5, 5), -9.81, 0.0]
        g = self.gravity
        for _ in range(200):
            a, b, c = (self.between(0.2, 0.8) for _ in range(3))
            x0, y0, t0 = (self.between(-3, 3) for _ in range(3))
            if abs(math.sin(t0 - y0)) > 0.6:
                break
        pivot = mixed((1, bar(a, x0)[0]), (1, bar(b, y0)[0]), (-1, bar(c, t0)[0]))
        m = [self.between(0.3, 2) for _ in range(3)]
        i = [self.between(0.01, 0.05) for _ in range(3)]
        r = [self.between(0.2, 0.8) * length for length in (a, b, c)]
        turn = math.copysign(1, math.sin(t0 - y0))

        def angles(x):
            """Angles of coupler and rocker with two derivatives by that of the crank."""
            e, e1, e2 = bar(a, x)
            w = pivot[0] - e[0], pivot[1] - e[1]
            size = math.hypot(w[0], w[1])
            inner = (b * b + size * size - c * c) / (2 * b * size)
            if abs(inner) > 0.995:
                raise Border("a dead centre is near")
            y = math.atan2(w[1], w[0]) - math.copysign(1, turn) * side * math.acos(inner)
            end, n, nn = bar(b, y)
            top = end[0] - w[0], end[1] - w[1]
            z = math.atan2(top[1], top[0])
            if abs(math.sin(z - y)) < 0.15:
                raise Border("a dead centre is near")
            _, k, kk = bar(c, z)
            whole = n[1] * k[0] - n[0] * k[1]

            def solved(p, q):
                """y and z of n y - k z = -(p, q)."""
                return (k[1] * p - k[0] * q) / whole, (n[1] * p - n[0] * q) / whole
            y1, z1 = solved(*e1[:2])
            y2, z2 = solved(*(e2[j] + nn[j] * y1 * y1 - kk[j] * z1 * z1 for j in (0, 1)))
            return (y, y1, y2), (z, z1, z2)
        side = 1
        if abs(math.remainder(angles(x0)[0][0] - y0, 2 * math.pi)) > 1e-6:
            side = -1
        angles = last_kept(angles)

        @last_kept
        def places(x):
            """Of each bar: derivatives of its centre and of its angle by the crank's."""
            (y, y1, y2), (z, z1, z2) = angles(x)
            (_, e1, e2), (_, p1, p2), (_, n, nn), (_, k, kk) = bar(a, x), bar(r[0], x), bar(r[1], y), bar(r[2], z)
            return ((p1, p2, 1.0, 0.0), (mixed((1, e1), (y1, n)), mixed((1, e2), (y1 * y1, nn), (y2, n)), y1, y2),
                    (mixed((z1, k)), mixed((z1 * z1, kk), (z2, k)), z1, z2))

        def mass(x):
            return [[sum(m[k] * dot(p[0], p[0]) + i[k] * p[2] ** 2 for k, p in enumerate(places(x[0])))]]

        def force(t, x, v, z):
            bends = self.mutated("bar-bends", 1.0, 0.0) * v[0] ** 2
            return sum(m[k] * (dot(p[0], g) - bends * dot(p[0], p[1])) - i[k] * p[2] * p[3] * v[0] ** 2
                       for k, p in enumerate(places(x[0])))

        @last_kept
        def shares(x):
            """Of the pins' forces: those without motion, by the acceleration, by the square of the rate."""
            (y, _, _), (z, _, _) = angles(x)
            (rb, _, _), (lb, _, _), (rc, _, _), (lc, _, _) = bar(r[1], y), bar(b, y), bar(r[2], z), bar(c, z)
            out = []
            for still, slow, fast in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
                left = [(mixed((m[k] * slow, p1), (m[k] * fast, p2), (-m[k] * still, g)), i[k] * (w1 * slow + w2 * fast))
                        for k, (p1, p2, w1, w2) in enumerate(places(x))]
                right = left[2][1] + cross(rc, left[2][0])[2], left[1][1] + cross(rb, left[1][0])[2]
                whole = lb[1] * lc[0] - lb[0] * lc[1]
                last = tuple((lb[j] * right[0] + lc[j] * right[1]) / whole for j in (0, 1)) + (0.0,)
                second = mixed((1, left[1][0]), (1, last))
                out.append({"reaction(C)": last, "reaction(T)": second, "reaction(A)": mixed((1, left[0][0]), (1, second))})
            return out

        def pin(name, x, v, acceleration):
            still, slow, fast = (part[name] for part in shares(x[0]))
            return mixed((1, still), (acceleration[0], slow), (v[0] ** 2, fast))
        self.bodies = (f"  a: {{joint: {{name: A, revolute: z, at: ground}}, mass: {m[0]}, com: [{r[0]}, 0, 0], inertia: {{zz: {i[0]}}}, points: {{E: [{a}, 0, 0]}}}}\n"
                       f"  b: {{joint: {{name: T, revolute: z, at: a.E}}, mass: {m[1]}, com: [{r[1]}, 0, 0], inertia: {{zz: {i[1]}}}, points: {{E: [{b}, 0, 0]}}}}\n"
                       f"  c: {{joint: {{name: B, revolute: z, at: ground.B}}, mass: {m[2]}, com: [{r[2]}, 0, 0], inertia: {{zz: {i[2]}}}, points: {{E: [{c}, 0, 0]}}}}\n")
        self.points = f", B: {numbers(pivot)}"
        self.loops = "loops: {C: {ball: [b.E, c.E]}}\n"
        self.machine = Machine(1, mass)
        self.machine.terms.append((0, force))
        for name in ("reaction(A)", "reaction(T)", "reaction(C)"):
            self.machine.reactions[name] = lambda t, x, v, z, acceleration, n=name: pin(n, x, v, acceleration)
        self.presses["A"] = lambda t, x, v, z, acceleration, f, needed: math.hypot(*pin("reaction(A)", x, v, acceleration))
        self.begin_loop(x0, {"T": y0 - x0, "B": t0})

    # contacts

    def plane(self, first, second, points=""):
        """Two bodies that slide across each other; the second one has the point O."""
        self.bodies = (f"  c: {{joint: {{name: X, prismatic: x, at: ground}}, mass: {first}, points: {{P: [0, 0, 0]}}}}\n"
                       f"  a: {{joint: {{name: Y, prismatic: [0, -1, 0], at: c.P}}, mass: {second}, points: {{O: [0, 0, 0]}}}}\n")
        self.machine = Machine(2, lambda x: [[first + second, 0.0], [0.0, second]])
        g = self.gravity
        self.machine.terms.append((None, lambda t, x, v, z: ((first + second) * g[0], -second * g[1])))
        self.k = int(self.r.integers(2))
        self.force_word, self.joint = "force", "XY"[self.k]
        self.free_of_holds = False
        self.measures = [("position(a.O).x", lambda t, x, v: x[0]), ("position(a.O).y", lambda t, x, v: -x[1]),
                         ("velocity(a.O).y", lambda t, x, v: -v[1])]

    def puck(self):
        """On a floor with friction; Y counts downwards."""
        self.gravity = [self.between(-4, 4), -9.81, 0.0]
        self.plane(self.between(0.3, 1), self.between(0.5, 2))
        mu, restitution = self.between(0.1, 0.6), float(self.r.choice([0.0, 0.0, 0.2, 0.6]))
        touches = self.chance(0.4)
        height = 0.0 if touches else self.between(0.02, 0.4)
        floor, rub = Held(1, upper=height, restitution=restitution), Held(0)
        pushes = self.mutated("contact-friction", mu, 0.5 * mu)
        rub.press = pushes, pushes, lambda t, x, v, z, a, f, needed: max(0.0, -needed[1]) if floor.rests else 0.0
        self.machine.held += [floor, rub]

        def struck(motion, impulse):
            most = self.mutated("contact-impulse", mu, 0.0) * impulse / motion.m.mass(motion.x)[0][0]
            if abs(most - abs(motion.v[0])) < 1e-6:
                raise Border("an impact nearly ends the slip")
            motion.v[0] = 0.0 if most > abs(motion.v[0]) else motion.v[0] - math.copysign(most, motion.v[0])
        self.machine.struck = struck
        self.points = f", F: [0, {-height}, 0]"
        self.other["contacts"] = (f"contacts: {{floor: {{point: a.O, on: {{plane: ground.F, normal: y}}, restitution: {restitution}, "
                                  f"friction: {mu}}}}}\n")
        self.other["impacts"] = True
        mass = self.machine.mass(None)[1][1]
        self.machine.reactions["force(floor)"] = lambda t, x, v, z, a: [self.machine.force(t, x, v, z)[1] - mass * a[1] if floor.rests else 0.0]
        self.machine.reactions["gap(floor)"] = lambda t, x, v, z, a: [height - x[1]]
        self.begin_at([self.between(-0.2, 0.2), 0.0], [self.between(-2, 2), 0.0 if touches else self.between(-0.5, 0.5)], ["X", "Y"])

    def journal(self):
        """A pin with clearance in a bearing, by a law of its depth."""
        self.gravity = [self.between(-4, 4), self.between(-9, 9), 0.0]
        self.plane(self.between(0.3, 1), self.between(0.5, 2))
        gap = self.between(0.02, 0.1)
        text, force = self.law()

        def depth(x):
            return math.hypot(x[0], x[1]) - gap

        def rate(x, v):
            return (x[0] * v[0] + x[1] * v[1]) / math.hypot(x[0], x[1])
        touch, push = self.law_kinks(lambda t, x, v: depth(x), lambda t, x, v: rate(x, v), force)

        def pushed(t, x, v, z):
            n = push(t, x, v, z)
            size = math.hypot(x[0], x[1])
            return (-n * x[0] / size, -n * x[1] / size) if n else (0.0, 0.0)
        self.machine.terms.append((None, pushed))
        self.other["contacts"] = f"contacts: {{pin: {{journal: [ground.O, a.O], radius: 0.5, clearance: {gap}, {text}}}}}\n"
        self.points = ", O: [0, 0, 0]"
        angle, size = self.between(-3, 3), self.between(0.2, 0.9) * gap
        self.begin_at([round(size * math.cos(angle), 5), round(size * math.sin(angle), 5)], [self.between(-1, 1), self.between(-1, 1)], ["X", "Y"])

    def law(self):
        """A law of a contact: its text, and its force as a function of depth and rate."""
        k, c = self.between(500, 4000, 0), self.between(1, 10)
        power, loss = float(self.r.choice([1.0, 1.5, 2.0])), self.between(0.02, 0.4)
        weight = self.mutated("contact-damping", 1.0, 0.0)
        return [(f"law: kelvin_voigt, stiffness: {k}, damping: {c}", lambda d, r: k * d + weight * c * r),
                (f"law: hertz, stiffness: {10 * k}, exponent: {power}", lambda d, r: 10 * k * max(d, 0.0) ** power),
                (f"law: hunt_crossley, stiffness: {10 * k}, exponent: {power}, damping: {loss}", lambda d, r: 10 * k * max(d, 0.0) ** power * (1 + weight * loss * r)),
                (f"force: \"{k}*depth + {c}*rate\"", lambda d, r: k * d + weight * c * r)][int(self.r.integers(4))]

    def law_kinks(self, depth, rate, force):
        """Kinks where a contact begins and where its force would pull; its force."""
        def touch(t, x, v, z):
            return depth(t, x, v)

        def pulls(t, x, v, z):
            return force(depth(t, x, v), rate(t, x, v)) if depth(t, x, v) > -1e-9 else 1.0
        self.machine.kinks += [touch, pulls]
        self.machine.stiff.append(touch)

        def push(t, x, v, z):
            if not self.machine.is_above(touch, t, x, v, z):
                return 0.0
            return max(0.0, force(depth(t, x, v), rate(t, x, v)))
        return touch, push
