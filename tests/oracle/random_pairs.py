# SPDX-License-Identifier: BSD-3-Clause
"""Random small machines that combine features of different kinds: as text of the model language, and as a machine of
event_motion.py from equations by hand. `FEATURES` must all occur."""
import math

import numpy as np

from event_motion import Held, Machine

FEATURES = """slide pendulum cart yoke gear driven harmonic pulse kink-position kink-rate kink-time jump table input-linear
input-hold state sampled counter relay delay friction friction-by-load stop spring""".split()
MOST_EXTRA = 4  # features of a model beside its spring
MUTATIONS = """gravity-across friction-without-load friction-static friction-sign stop-restitution stop-ignored delay-time
delay-before sample-late sample-start state-start counter-both relay-limits input-method table-outside drive-impulse pulse-missed
ramp-late kink-side dead-zone push-ignored start-rate yoke-mass gear-sign harmonic-phase jump-size""".split()


class Pair:
    """A machine with its features: `text` and `machine`, made from the same numbers."""

    def __init__(self, seed, number, broken=None):
        self.broken = broken  # a mutation of the machine alone: the text stays right
        self.r = np.random.default_rng([seed, number])
        self.number, self.features, self.forces, self.states, self.other = number, [], [], [], {}
        self.end = round(float(self.r.uniform(0.6, 1.8)), 2)
        self.held = None
        kind = self.r.choice(["slide", "pendulum", "cart", "yoke", "gear", "driven"])
        self.features.append(str(kind))
        getattr(self, kind)()
        self.spring()
        extra = ["harmonic", "pulse", "kink_position", "kink_rate", "kink_time", "jump", "table", "inputs", "state", "sampled",
                 "counter", "relay", "delay", "friction", "stop"]
        for name in self.r.choice(extra, size=int(self.r.integers(1, MOST_EXTRA + 1)), replace=False):
            getattr(self, str(name))()
        self.write()

    def between(self, low, high, digits=3):
        return round(float(self.r.uniform(low, high)), digits)

    def mutated(self, name, right, wrong):
        return wrong if self.broken == name else right

    def chance(self, p):
        return self.r.random() < p

    # -- machines: coordinates are those that are independent, forces act on `joint`, coordinate k

    def slide(self):
        m = self.between(0.5, 2)
        axis = self.r.standard_normal(3).round(2)
        axis = axis if np.abs(axis).max() > 0.3 else np.array([1.0, 0.2, 0.1])
        g, p = self.r.uniform(-6, 6, 3).round(2), self.r.uniform(-8, 8, 3).round(2)
        d = axis / np.linalg.norm(axis)
        self.gravity = g
        self.bodies = f"  a: {{joint: {{name: A, prismatic: {list(map(float, axis))}, at: ground}}, mass: {m}, inertia: {{xx: 0.1, yy: 0.1, zz: 0.1}}, points: {{O: [0, 0, 0]}}}}\n"
        self.machine = Machine(1, lambda x: np.array([[m]]))
        along = self.mutated("gravity-across", float(m * g @ d), 0.0)
        self.machine.terms.append((0, lambda t, x, v, z: along))
        self.force_word, self.joint, self.k = "force", "A", 0
        self.across = float(np.linalg.norm(m * g - (m * g @ d) * d))
        if self.chance(0.5):
            self.forces.append(f"  push: {{at: a.O, force: {list(map(float, p))}}}")
            pushed = self.mutated("push-ignored", float(p @ d), 0.0)
            self.machine.terms.append((0, lambda t, x, v, z: pushed))
            whole = m * g + p
            self.across = float(np.linalg.norm(whole - (whole @ d) * d))
        self.begin_at([self.between(-0.3, 0.3)], [self.between(-1, 1)], ["A"])

    def pendulum(self):
        m, l, i = self.between(0.5, 2), self.between(0.3, 0.8), self.between(0.02, 0.1)
        self.gravity = [0, -9.81, 0]
        self.bodies = f"  a: {{joint: {{name: A, revolute: z, at: ground}}, mass: {m}, com: [0, {-l}, 0], inertia: {{zz: {i}}}}}\n"
        self.machine = Machine(1, lambda x: np.array([[i + m * l * l]]))
        self.machine.terms.append((0, lambda t, x, v, z: -m * 9.81 * l * math.sin(x[0])))
        self.force_word, self.joint, self.k = "torque", "A", 0
        self.begin_at([self.between(-1, 1)], [self.between(-2, 2)], ["A"])

    def cart(self):
        big, m, l, i = self.between(1, 3), self.between(0.3, 1), self.between(0.3, 0.7), self.between(0.01, 0.05)
        self.gravity = [0, -9.81, 0]
        self.bodies = (f"  c: {{joint: {{name: X, prismatic: x, at: ground}}, mass: {big}, points: {{P: [0, 0, 0]}}}}\n"
                       f"  a: {{joint: {{name: A, revolute: z, at: c.P}}, mass: {m}, com: [0, {-l}, 0], inertia: {{zz: {i}}}}}\n")
        self.machine = Machine(2, lambda x: np.array([[big + m, m * l * math.cos(x[1])], [m * l * math.cos(x[1]), i + m * l * l]]))
        self.machine.terms.append((None, lambda t, x, v, z: np.array([m * l * math.sin(x[1]) * v[1] ** 2, -m * 9.81 * l * math.sin(x[1])])))
        self.k = int(self.r.integers(2))
        self.force_word, self.joint = ("force", "X") if self.k == 0 else ("torque", "A")
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
        self.machine = Machine(1, lambda x: np.array([[i + carried * (r * math.cos(x[0])) ** 2]]))
        self.machine.terms.append((0, lambda t, x, v, z: m * r * r * math.sin(x[0]) * math.cos(x[0]) * v[0] ** 2 + m * g * r * math.cos(x[0])))
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
        self.machine = Machine(1, lambda x: np.array([[ia + ratio * ratio * ib]]))
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
                       f"  a: {{joint: {{name: A, revolute: z, at: c.P}}, mass: {m}, com: [0, {-l}, 0], inertia: {{zz: {i}}}}}\n")
        self.loops = f"drives: {{d: {{joint: X, displacement: \"{low}\"}}}}\n"
        self.machine = Machine(1, lambda x: np.array([[i + m * l * l]]))
        self.machine.terms.append((0, lambda t, x, v, z: -m * 9.81 * l * math.sin(x[0])))
        jump = self.mutated("drive-impulse", after - before, 0.0)
        self.machine.impulses.append((at, lambda x, v: v - m * l * math.cos(x[0]) * jump / (i + m * l * l)))
        self.machine.breaks.append(at)
        self.force_word, self.joint, self.k = "torque", "A", 0
        self.begin_at([self.between(-1, 1)], [self.between(-2, 2)], ["A"])

    def begin_at(self, x, v, names):
        self.x, self.v, self.names = x, self.mutated("start-rate", v, [0.0] * len(v)), names
        q = ", ".join(f"{n}: {a}" for n, a in zip(names, x))
        qd = ", ".join(f"{n}: {a}" for n, a in zip(names, v))
        self.start_text = f"start: {{q: {{{q}}}, qd: {{{qd}}}}}\n"

    # -- features

    def add(self, expression, term):
        name = f"f{len(self.forces)}"
        self.forces.append(f"  {name}: {{joint: {self.joint}, {self.force_word}: \"{expression}\"}}")
        self.machine.terms.append((self.k, term))

    def spring(self):
        k, c, n = self.between(5, 30), self.between(0, 0.5), self.k
        self.features.append("spring")
        self.add(f"-{k}*q({self.joint}) - {c}*qd({self.joint})", lambda t, x, v, z: -k * x[n] - c * v[n])

    def harmonic(self):
        a, w, p = self.between(1, 6), self.between(3, 12), self.between(0, 6)
        self.features.append("harmonic")
        self.add(f"{a}*sin({w}*t + {p})", lambda t, x, v, z: a * math.sin(w * t + self.mutated("harmonic-phase", p, 0.0)))

    def pulse(self):
        a, s = self.between(20, 200, 1), self.between(0.004, 0.03, 4)
        at = self.between(0.2, 0.9) * self.end
        at = round(at, 4)
        self.features.append("pulse")
        self.other["step"] = s / 8
        self.add(f"{a}*exp(-((t - {at})/{s})^2)", lambda t, x, v, z: self.mutated("pulse-missed", a, 0.0) * math.exp(-((t - at) / s) ** 2))

    def kink_position(self):
        b, x0, n, j = self.between(10, 60), self.between(-0.3, 0.3), self.k, self.joint
        self.features.append("kink-position")
        self.machine.kinks.append(lambda t, x, v, z: x[n] - x0)
        if self.chance(0.5):
            self.add(f"-{b}*max(q({j}) - ({x0}), 0)", lambda t, x, v, z: -b * self.mutated("kink-side", max, min)(x[n] - x0, 0.0))
        else:
            self.add(f"-{b}*abs(q({j}) - ({x0}))/4", lambda t, x, v, z: -b * abs(x[n] - x0) / 4)

    def kink_rate(self):
        b, v0, n, j = self.between(1, 4), self.between(0.1, 0.8), self.k, self.joint
        self.features.append("kink-rate")
        self.machine.kinks += [lambda t, x, v, z: v[n] - v0, lambda t, x, v, z: v[n] + v0]
        self.add(f"-{b}*dead_zone(qd({j}), -{v0}, {v0})", lambda t, x, v, z: -b * (v[n] - self.mutated("dead-zone", 1, 0) * min(v0, max(v[n], -v0))))

    def kink_time(self):
        a, t1, t2 = self.between(-6, 6), self.between(0.1, 0.4), self.between(0.5, 1.2)
        self.features.append("kink-time")
        self.machine.breaks += [t1, t2]
        t2 = self.mutated("ramp-late", t2, t1 + 1e-3)
        self.add(f"{a}*ramp(t, {t1}, {self.machine.breaks[-1]})", lambda t, x, v, z: a * min(1.0, max(0.0, (t - t1) / (t2 - t1))))

    def jump(self):
        a, x0, n, j = self.between(1, 6), self.between(-0.3, 0.3), self.k, self.joint
        self.features.append("jump")
        def kink(t, x, v, z):
            return x[n] - x0
        self.machine.kinks.append(kink)
        self.add(f"if(q({j}) > {x0}, {-a}, {a / 2})", lambda t, x, v, z: -a if self.machine.is_above(kink, t, x, v, z) else self.mutated("jump-size", a / 2, 0.0))

    def table(self):
        n, j = self.k, self.joint
        at = np.array([-40.0, -0.5, -0.1, 0.2, 0.6, 40.0])
        value = self.r.uniform(-4, 4, 6).round(2)
        value[0], value[-1] = value[1], value[-2]
        self.features.append("table")
        self.machine.kinks += [lambda t, x, v, z, a=a: x[n] - a for a in at[1:-1]]
        self.other["tables"] = f"tables: {{law: {{x: {at.tolist()}, y: {value.tolist()}, method: linear}}}}\n"
        self.add(f"law(q({j}))", lambda t, x, v, z: float(np.interp(self.mutated("table-outside", x[n], min(x[n], 0.2)), at, value)))

    def inputs(self):
        at = [0.0, self.between(0.1, 0.4), self.between(0.5, 0.9), 4.0]
        value = self.r.uniform(-5, 5, 4).round(2).tolist()
        hold = self.chance(0.5)
        self.features.append("input-hold" if hold else "input-linear")
        self.machine.breaks += at[1:3]
        self.other["inputs"] = f"inputs: {{u: {{t: {at}, value: {value}, method: {'hold' if hold else 'linear'}}}}}\n"

        def law(t):
            if self.mutated("input-method", not hold, hold):
                return float(np.interp(t, at, value))
            return value[0] if t < at[1] - 1e-12 else value[1] if t < at[2] - 1e-12 else value[2]
        self.add("u", lambda t, x, v, z: law(t))

    def add_state(self, text, start):
        name = f"z{len(self.machine.start)}"
        self.states.append(f"  {name}: {text}")
        self.machine.start.append(self.mutated("sample-start" if "sample:" in text else "state-start", start, 0.0 if "when" not in text else start))
        return name, len(self.machine.start) - 1

    def state(self):
        time, k, s, n, j = self.between(0.05, 0.4), self.between(2, 10), self.between(-0.5, 0.5), self.k, self.joint
        self.features.append("state")
        name, i = self.add_state(f"{{rate: \"(q({j}) - z{len(self.machine.start)})/{time}\", start: {s}}}", s)
        self.machine.state_rates.append((i, lambda t, x, v, z: (x[n] - z[i]) / time))
        self.add(f"-{k}*{name}", lambda t, x, v, z: -k * z[i])

    def sampled(self):
        period, a, b, k, s, n, j = self.between(0.03, 0.15), self.between(-0.8, 0.8), self.between(0.5, 2), self.between(1, 8), self.between(-0.5, 0.5), self.k, self.joint
        self.features.append("sampled")
        name, i = self.add_state(f"{{next: \"({a})*z{len(self.machine.start)} + {b}*q({j})\", sample: {period}, start: {s}}}", s)

        def change(t, x, v, z):
            z = z.copy()
            z[i] = a * z[i] + b * x[n]
            return z
        self.machine.samples.append((self.mutated("sample-late", period, 1.1 * period), change))
        self.add(f"-{k}*{name}", lambda t, x, v, z: -k * z[i])

    def counter(self):
        x0, k, n, j = self.between(-0.2, 0.2), self.between(-1, 1), self.k, self.joint
        self.features.append("counter")
        name, i = self.add_state(f"{{next: \"z{len(self.machine.start)} + 1\", when: \"q({j}) > {x0}\", start: 0}}", 0.0)

        def kink(t, x, v, z):
            return x[n] - x0

        def change(t, x, v, z, side):
            z = z.copy()
            z[i] += side > 0 or self.broken == "counter-both"
            return z
        self.machine.kinks.append(kink)
        self.machine.changes[kink] = change
        self.add(f"{k}*{name}", lambda t, x, v, z: k * z[i])

    def relay(self):
        low, high, a, n, j = self.between(-0.4, -0.05), self.between(0.05, 0.4), self.between(1, 5), self.k, self.joint
        self.features.append("relay")
        begins = 1.0 if self.x[n] > high else 0.0
        name, i = self.add_state(f"{{hysteresis: q({j}), limits: [{low}, {high}], values: [0, 1]}}", begins)

        def above(t, x, v, z):
            return x[n] - high

        def below(t, x, v, z):
            return x[n] - low

        def change_above(t, x, v, z, side):
            z = z.copy()
            z[i] = 1.0 if side > 0 else z[i]
            return z

        def change_below(t, x, v, z, side):
            z = z.copy()
            z[i] = 0.0 if side < 0 and self.broken != "relay-limits" else z[i]
            return z
        self.machine.kinks += [above, below]
        self.machine.changes[above], self.machine.changes[below] = change_above, change_below
        self.add(f"-{a}*{name}", lambda t, x, v, z: -a * z[i])

    def delay(self):
        time, k, n, j = self.between(0.05, 0.3), self.between(1, 8), self.k, self.joint
        self.features.append("delay")
        index = len(self.machine.delays)
        self.machine.delays.append((n, self.mutated("delay-time", time, 1.05 * time), self.mutated("delay-before", self.x[n], 0.0)))
        self.states.append(f"  y{index}: {{delay: q({j}), time: {time}}}")
        self.add(f"-{k}*y{index}", lambda t, x, v, z: -k * self.machine.past(index, t))

    def hold(self):
        if self.held is None:
            self.held = Held(self.k)
            self.machine.held.append(self.held)
        return self.held

    def friction(self):
        held = self.hold()
        level = self.between(0.3, 3)
        static = round(level * self.between(1, 1.5), 4) if self.chance(0.5) else None
        if "slide" in self.features and self.chance(0.6):
            mu = self.between(0.05, 0.5)
            self.features.append("friction-by-load")
            self.forces.append(f"  rub: {{joint: {self.joint}, friction: {{mu: {mu}}}}}")
            held.level = held.static = lambda t: mu * self.mutated("friction-without-load", self.across, 0.5 * self.across)
            return
        self.features.append("friction")
        self.forces.append(f"  rub: {{joint: {self.joint}, friction: {{{self.force_word}: {level}{f', static: {static}' if static else ''}}}}}")
        held.level = lambda t: self.mutated("friction-sign", level, 0.5 * level)
        held.static = lambda t: self.mutated("friction-static", static or level, 4 * (static or level))

    def stop(self):
        held = self.hold()
        self.features.append("stop")
        held.upper = round(self.x[self.k] + self.between(0.02, 0.3), 3)
        restitution = float(self.r.choice([0.0, 0.4, 0.6, 0.8]))
        held.restitution = self.mutated("stop-restitution", restitution, 0.9)
        self.other["contacts"] = f"contacts: {{end: {{joint: {self.joint}, upper: {held.upper}, restitution: {restitution}}}}}\n"
        held.upper = self.mutated("stop-ignored", held.upper, None)

    # -- text

    def write(self):
        states = "states:\n" + "\n".join(self.states) + "\n" if self.states else ""
        self.rtol = str(self.r.choice(["1e-8", "1e-9", "1e-10"]))
        self.text = (f"kempe: 1\nname: pair {self.number}\ngravity: {list(map(float, self.gravity))}\n" + self.other.get("inputs", "")
                     + self.other.get("tables", "") + "bodies:\n" + self.bodies + getattr(self, "loops", "") + states
                     + "forces:\n" + "\n".join(self.forces) + "\n" + self.other.get("contacts", "") + self.start_text
                     + f"run: {{t_end: {self.end}, output_step: {self.end / 4!r}, rtol: {self.rtol}, atol: {self.rtol}, outputs: [q, qd]}}\n")
