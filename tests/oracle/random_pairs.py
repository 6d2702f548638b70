# SPDX-License-Identifier: BSD-3-Clause
"""Random small machines that combine features of different kinds: as text of the model language, and as a machine of
event_motion.py from equations by hand. `FEATURES` must all occur."""
import math

import numpy as np

from event_motion import Held
from pair_machines import Machines

KINDS = "slide pendulum cart yoke gear driven rod rocker four_bar puck journal".split()
FEATURES = [*KINDS, *"""harmonic pulse kink-position kink-rate kink-time jump table table-hold table-straight table-left table-periodic table-spline input-linear
input-hold state sampled counter relay delay friction friction-sides ratchet friction-by-load friction-dependent stop play gap compliant measure
spring""".split()]
ROWS = 4
MOST_EXTRA = 4  # features of a model beside its spring
MUTATIONS = """gravity-across friction-without-load friction-static friction-sign friction-back ratchet-rebounds stop-restitution stop-ignored delay-time
delay-before sample-late sample-start state-start counter-both relay-limits input-method table-outside drive-impulse pulse-missed
ramp-late kink-side dead-zone push-ignored sway-ignored start-rate yoke-mass gear-sign harmonic-phase jump-size load-static
measure-sign rod-mass rocker-bends bar-bends contact-friction contact-impulse contact-damping stop-below table-period table-ends""".split()


def curve(at, value):
    """The periodic cubic spline through points, of which the last one is the first one again."""
    h, n = np.diff(at), len(at) - 1
    matrix, right = np.zeros((n, n)), np.zeros(n)
    for k in range(n):  # the second derivatives at the points
        before, after = h[k - 1], h[k]
        matrix[k, k - 1] += before
        matrix[k, k] += 2 * (before + after)
        matrix[k, (k + 1) % n] += after
        right[k] = 6 * ((value[k + 1] - value[k]) / after - (value[k] - value[k - 1 if k else n - 1]) / before)
    bend = np.linalg.solve(matrix, right)
    bend = np.append(bend, bend[0])

    def law(x):
        k = min(max(int(np.searchsorted(at, x, "right")) - 1, 0), n - 1)
        a, b = at[k + 1] - x, x - at[k]
        return float((bend[k] * a ** 3 + bend[k + 1] * b ** 3) / (6 * h[k]) + (value[k] / h[k] - bend[k] * h[k] / 6) * a
                     + (value[k + 1] / h[k] - bend[k + 1] * h[k] / 6) * b)
    return law


class Pair(Machines):
    """A machine with its features: `text` and `machine`, made from the same numbers."""

    plain = False  # without forces that other formats lack

    def __init__(self, seed, number, broken=None, shift=None):
        self.broken = broken  # a mutation of the machine alone: the text stays right
        self.shift = shift or {}  # changes of parameters of the machine alone
        self.r = np.random.default_rng([seed, number])
        self.number, self.features, self.forces, self.states, self.other = number, [], [], [], {}
        self.end = round(float(self.r.uniform(0.5, 1.4)), 2)
        self.held, self.presses, self.measures, self.state_names, self.resting = None, {}, [], [], []
        self.points, self.rubbing, self.free_of_holds, self.contacts = "", None, True, []
        self.choose()
        self.write()

    def choose(self):
        kind = self.r.choice(KINDS)
        self.features.append(str(kind))
        getattr(self, kind)()
        self.spring()
        extra = ["harmonic", "pulse", "kink_position", "kink_rate", "kink_time", "jump", "table", "inputs", "state", "sampled",
                 "counter", "relay", "delay", "friction", "stop", "compliant", "measure"]
        for name in self.r.choice(extra, size=int(self.r.integers(1, MOST_EXTRA + 1)), replace=False):
            getattr(self, str(name))()

    def between(self, low, high, digits=3):
        return round(float(self.r.uniform(low, high)), digits)

    def mutated(self, name, right, wrong):
        return wrong if self.broken == name else right

    def chance(self, p):
        return self.r.random() < p

    def begin_at(self, x, v, names):
        self.x, self.v, self.names = x, self.mutated("start-rate", v, [0.0] * len(v)), names
        self.v = [a + (self.shift.get("rate", 0.0) if n == self.joint else 0.0) for n, a in zip(names, self.v)]
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
        self.stiff, stiff, load = k, k + self.shift.get("stiff", 0.0), self.shift.get("load", 0.0)
        self.add(f"load - stiff*q({self.joint}) - {c}*qd({self.joint})", lambda t, x, v, z: load - stiff * x[n] - c * v[n])

    def harmonic(self):
        a, w, p = self.between(1, 6), self.between(3, 12), self.between(0, 6)
        self.features.append("harmonic")
        self.add(f"{a}*sin({w}*t + {p})", lambda t, x, v, z: a * math.sin(w * t + self.mutated("harmonic-phase", p, 0.0)))

    def pulse(self):
        a, s = self.between(20, 200, 1), self.between(0.004, 0.03, 4)
        at = self.between(0.2, 0.9) * self.end
        at = round(at, 4)
        self.features.append("pulse")
        self.machine.spells.append((at - 7 * s, at + 7 * s, s / 8))
        self.machine.breaks += [at - 7 * s, at + 7 * s]
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
        """A law given by points, inside them and beyond."""
        n, j = self.k, self.joint
        kind = str(self.r.choice(["", "-hold", "-straight", "-left", "-periodic", "-spline"]))
        at = np.array([-0.5, -0.1, 0.2, 0.6]) if kind in ("-hold", "-straight", "-left") else np.array([-40.0, -0.5, -0.1, 0.2, 0.6, 40.0])
        if kind in ("-periodic", "-spline"):
            at = np.array([-0.4, -0.15, 0.1, 0.2, 0.45])
        value = self.r.uniform(-4, 4, len(at)).round(2)
        self.features.append("table" + kind)
        keys = {"": "", "-hold": ", outside: hold", "-straight": ", outside: linear", "-left": "", "-periodic": ", periodic: yes", "-spline": ", periodic: yes"}[kind]
        if kind in ("-periodic", "-spline"):
            value[-1] = value[0]
        elif not kind:
            value[0], value[-1] = value[1], value[-2]
        whole, least = at[-1] - at[0], at[0]
        slopes = [(value[k + 1] - value[k]) / (at[k + 1] - at[k]) for k in (0, -2)]

        def straight(x):
            beyond = slopes[0] * min(x - at[0], 0.0) + slopes[1] * max(x - at[-1], 0.0) if kind == "-straight" else 0.0
            return float(np.interp(x, at, value)) + self.mutated("table-ends", beyond, 0.0)
        law = curve(at, value) if kind == "-spline" else straight
        if kind in ("-periodic", "-spline"):
            around = self.mutated("table-period", whole, 1.1 * whole)
            if kind == "-periodic":
                for a in at[:-1]:
                    self.machine.kinks.append(lambda t, x, v, z, a=a: math.sin(math.pi * (x[n] - a) / whole))
            self.add(f"law(q({j}))", lambda t, x, v, z: law(least + (x[n] - least) % around))
        else:
            self.machine.kinks += [lambda t, x, v, z, a=a: x[n] - a for a in (at if kind else at[1:-1])]
            if kind == "-left":
                self.left = n, at[0], at[-1]  # straight on, which is not to be trusted
            self.add(f"law(q({j}))", lambda t, x, v, z: law(self.mutated("table-outside", x[n], min(x[n], 0.2))))
        method = "spline" if kind == "-spline" else "linear"
        self.other["tables"] = f"tables: {{law: {{x: {at.tolist()}, y: {value.tolist()}, method: {method}{keys}}}}}\n"

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
        self.state_names.append(name)
        self.states.append(f"  {name}: {text}")
        self.machine.start.append(self.mutated("sample-start" if "sample:" in text else "state-start", start, 0.0 if "when" not in text else start))
        return name, len(self.machine.start) - 1

    def state(self):
        time, k, s, n, j = self.between(0.05, 0.4), self.between(2, 10), self.between(-0.5, 0.5), self.k, self.joint
        self.features.append("state")
        name, i = self.add_state(f"{{rate: \"(q({j}) - z{len(self.machine.start)})/{time}\", start: {s}}}", s)
        self.resting.append(lambda x: x[n])
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
        self.resting.append(lambda x: b * x[n] / (1 - a))
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

    def measure(self):
        if not self.measures:
            return
        self.features.append("measure")
        text, value = self.measures[int(self.r.integers(len(self.measures)))]
        k = self.between(-5, 5)
        self.add(f"{k}*{text}", lambda t, x, v, z: self.mutated("measure-sign", k, -k) * value(t, x, v))

    def hold(self):
        if self.held is None:
            self.held = Held(self.k)
            self.machine.held.append(self.held)
        return self.held

    def friction(self):
        """Friction of a level, or by the load of the joint; in loops on a coordinate that depends on the other one."""
        if not self.free_of_holds or (self.rubbing and self.held):
            return
        joint, word, ratio = self.rubbing or (self.joint, self.force_word, None)
        held = self.hold()
        held.ratio = ratio
        if ratio:
            self.features.append("friction-dependent")
        level = self.between(0.3, 3)
        static = round(level * self.between(1, 1.5), 4) if self.chance(0.5) else None
        if joint in self.presses and self.chance(0.6):
            mu, radius = self.between(0.05, 0.4), self.between(0.05, 0.3) if word == "torque" else 1.0
            holds = round(mu * self.between(1, 1.5), 4) if self.chance(0.5) else None
            self.features.append("friction-by-load")
            keys = f"mu: {mu}" + (f", mu_static: {holds}" if holds else "") + (f", radius: {radius}" if word == "torque" else "")
            self.forces.append(f"  rub: {{joint: {joint}, friction: {{{keys}}}}}")
            held.press = mu * radius, self.mutated("load-static", (holds or mu) * radius, 3 * mu * radius), self.presses[joint]
            return
        self.features.append("friction")
        digits, back = int(1e4 * level), 1.0
        if digits % 3 == 0:  # by digits that are drawn, so that all other models stay as they are
            self.features.append("friction-sides")
            back = round(0.3 + digits % 100 / 60, 4)

        elif digits % 3 == 1 and not ratio:  # it holds against the start's other direction
            self.features.append("ratchet")
            held.pawl = -1 if self.v[self.k] >= 0 else 1

        def said(x):
            if held.pawl:
                return f"[{x}, unlimited]" if held.pawl < 0 else f"[unlimited, {x}]"
            return f"[{x}, {back}*{x}]" if back != 1 else f"{x}"

        def side(way):
            return self.mutated("friction-back", back, 1 / back) if way < 0 else 1.0

        rest = f", static: {static if held.pawl else said(static)}" if static else ""
        self.forces.append(f"  rub: {{joint: {joint}, friction: {{{word}: {said(level)}{rest}}}}}")
        held.level = lambda t, way: self.mutated("friction-sign", level, 0.5 * level) * side(way)
        held.static = lambda t, way: math.inf if way == held.pawl else self.mutated("friction-static", static or level, 4 * (static or level)) * side(way)
        held.catches = self.mutated("ratchet-rebounds", True, False)
        if held.pawl < 0 and held.upper is None:
            self.stop()  # from which it would rebound

    def stop(self):
        """A rigid limit of a coordinate, or one on each side."""
        if not self.free_of_holds or (self.held and self.held.ratio):
            return
        held, joint = self.hold(), self.joint
        self.features.append("stop")
        held.upper = round(self.x[self.k] + self.between(0.02, 0.3), 3)
        restitution = float(self.r.choice([0.0, 0.4, 0.6, 0.8]))
        held.restitution = self.mutated("stop-restitution", restitution, 0.9)
        if self.chance(0.3):
            self.features.append("gap")
            self.contacts.append(f"end: {{gap: \"{held.upper} - q({joint})\", restitution: {restitution}}}")
        else:
            text, held.upper = self.with_unit(held.upper)
            self.contacts.append(f"end: {{joint: {joint}, upper: {text}, restitution: {restitution}}}")
        if self.chance(0.4):
            self.features.append("play")
            held.lower = round(self.x[self.k] - self.between(0.02, 0.3), 3)
            self.contacts.append(f"begin: {{joint: {joint}, lower: {held.lower}, restitution: {restitution}}}")
            held.lower = self.mutated("stop-below", held.lower, None)
        held.upper = self.mutated("stop-ignored", held.upper, None)

    def with_unit(self, value):
        """A length or an angle in another unit than that of SI: its text, its value."""
        unit, size = ("deg", math.pi / 180) if self.force_word == "torque" else ("mm", 1e-3)
        number = round(value / size, 2)
        return f"{number} {unit}", number * size

    def compliant(self):
        """A limit with a law of its depth."""
        if not self.free_of_holds or self.held and self.held.upper is not None:
            return
        self.features.append("compliant")
        side, n = (1, -1)[int(self.r.integers(2))], self.k
        limit = round(self.x[n] + side * self.between(0.02, 0.3), 3)
        text, force = self.law()
        _, push = self.law_kinks(lambda t, x, v: side * (x[n] - limit), lambda t, x, v: side * v[n], force)
        self.machine.terms.append((n, lambda t, x, v, z: -side * push(t, x, v, z)))
        self.contacts.append(f"soft: {{joint: {self.joint}, {'upper' if side > 0 else 'lower'}: {limit}, {text}}}")

    # -- text

    def tolerance(self):
        """The relative and the absolute tolerance of the run."""
        return float(self.r.choice(["1e-8", "1e-9", "1e-10"]))

    def write(self):
        if self.contacts:
            self.other["contacts"] = "contacts:\n" + "".join(f"  {text}\n" for text in self.contacts)
        states = "states:\n" + "\n".join(self.states) + "\n" if self.states else ""
        self.rtol = f"{self.tolerance():.0e}"
        self.text = (f"kempe: 1\nname: pair {self.number}\ngravity: {list(map(float, self.gravity))}\nparameters: {{stiff: {self.stiff}, load: 0}}\n"
                     f"ground: {{points: {{N: [1.5, 0.5, 0]{self.points}}}}}\n" + self.other.get("inputs", "")
                     + self.other.get("tables", "") + "bodies:\n" + self.bodies + getattr(self, "loops", "") + states
                     + "forces:\n" + "\n".join(self.forces) + "\n" + self.other.get("contacts", "") + self.start_text
                     + f"run: {{t_end: {self.end}, output_step: {self.end / ROWS!r}, rtol: {self.rtol}, atol: {self.rtol}, outputs: [q, qd]}}\n")


class Foreign(Pair):
    """A machine that other formats can say: springs, dampers and friction of its joints."""

    plain = True

    def choose(self):
        kind = str(self.r.choice(["slide", "pendulum", "cart"]))
        self.features.append(kind)
        getattr(self, kind)()
        self.stiff, rest, c, n = self.between(5, 30), self.between(-0.3, 0.3), self.between(0.1, 0.6), self.k
        self.forces.append(f"  f0: {{joint: {self.joint}, spring: {{stiffness: {self.stiff}, rest: {rest}, damping: {c}}}}}")
        self.machine.terms.append((n, lambda t, x, v, z: -self.stiff * (x[n] - rest) - c * v[n]))
        if self.chance(0.5):
            level = self.between(0.2, 2)
            self.features.append("friction")
            self.forces.append(f"  rub: {{joint: {self.joint}, friction: {{{self.force_word}: {level}}}}}")
            self.hold().level = self.held.static = lambda t, way: level
