# SPDX-License-Identifier: BSD-3-Clause
"""The rows of a run with dry friction that sticks, beside mechanics of the oracle. Friction is taken from the row as a
given effort, and the accelerations that follow are compared with those of the row. Then each element must fit its law:
level against the rate while it slips, at most the static level and no rate or acceleration while it sticks. Levels by
reactions use the oracle's own joint forces and multipliers. Stops are not passed, never pull, and push only where they
are closed and stay so.

`fault`: one of FAULTS, an error that is planted in the rows or in the laws, and must be found."""
import numpy as np

from compare_run import Comparison
from mechanics import Motion

SLIPS = 1e-9  # a smaller rate, of the fastest one, is rest up to the tolerance of the run
LEAST = 0.01  # rad/s, m/s: a linkage that does not move faster rests
LAW = 1e-7  # of the level
RESTS = 1e-6  # an acceleration of an element that sticks, of the largest one
ENERGY = 1e-8  # of the largest energy
PATH = 1e-4  # of it: work by rows, with turns between them interpolated
TOUCHES = 1e-8  # rad, m: a gap that is none
PUSHES = 1e-7  # of the largest force of a stop, at least 1: a force that is none
FAULTS = {  # what a complaint about each says
    "friction of the wrong direction": "qdd",
    "friction less by 1e-5": "qdd",
    "rest taken as slip": "does not have its level while it slips",
    "slip taken as rest": "at rest",
    "a larger level": "does not have its level while it slips",
    "a smaller static level": "exceeds its static level at rest",
    "an acceleration at rest": "is accelerated at rest",
    "a stop that pulls": "pulls",
    "a stop that pushes at a distance": "pushes at a distance",
    "a stop that is passed": "is passed",
    "a stop that pushes what leaves": "pushes what leaves",
    "energy that grows": "the energy rises",
}


FACTORS = {"friction of the wrong direction": -1.0, "friction less by 1e-5": 1 - 1e-5}  # of faults that change the motion


class FrictionRows(Comparison):
    def __init__(self, mechanism, table, fault="", plain=None):
        """`plain`: the same rows without a fault, whose motion serves where the fault is one of the laws."""
        self.mechanism, self.table, self.complaints, self.worst, self.fault = mechanism, table, [], 0.0, fault
        names = mechanism.columns
        self.q, self.qd, self.qdd = (table.columns(word, names) for word in ("q", "qd", "qdd"))
        self.cond, self.plain = None, plain
        self.clear = np.ones(len(self.q), bool)
        if plain and fault not in FACTORS:
            self.motion, self.joint_forces = plain.motion, plain.joint_forces
            return
        self.motion = Motion(mechanism, table.column("t"), self.q, self.qd, table.multipliers())
        factor = FACTORS.get(fault, 1.0)
        self.motion.friction = {f.name: factor * table.column("force." + f.name) for f in self.elements()}
        self.motion.friction.update({f.name: table.column("force." + f.name) for f in self.stops()})
        self.joint_forces = self.motion.solve().joint_wrenches

    def allowed(self):
        """The condition is that of the rows without a fault: friction is not in the matrix."""
        if self.cond is None and self.plain:
            self.plain.allowed()
            self.cond = self.plain.cond
        return super().allowed()

    def elements(self):
        return [f for f in self.mechanism.forces if f.kind == "joint_friction"]

    def stops(self):
        return [f for f in self.mechanism.forces if f.kind == "joint_contact"]

    def run(self):
        self.compare_closures()
        self.agree("qdd", self.qdd, self.motion.qdd, usual=1e-8)
        for item in self.elements():
            self.look_at(item)
        for item in self.stops():
            self.look_at_stop(item)
        self.look_at_energy()
        return self.complaints

    # -- laws

    def number_of(self, item):
        return self.mechanism.places[item.scope.full(item.keys["joint"])]

    def across(self, number):
        """The size of a joint's force across its translations, or across the axis of a pin."""
        joint = next(j for j in self.mechanism.joints if number in j.coordinates)
        rows = slice(6 * joint.child, 6 * joint.child + 3)
        slides = [k for k, (rotation, _) in zip(joint.coordinates, joint.chain) if not rotation]
        force = self.joint_forces[:, rows]
        for k in slides or [number]:
            motion = self.motion.motions[:, 6 * joint.child:6 * joint.child + 6, k]
            axis = motion[:, :3] if slides else motion[:, 3:]
            axis = axis / np.linalg.norm(axis, axis=1)[:, None]
            force = force - np.sum(force * axis, 1)[:, None] * axis
        return np.linalg.norm(force, axis=1)

    def reaction(self, item, keys):
        if "reaction" in keys:
            name = item.scope.full(keys["reaction"])
            loop = next(closure for closure in self.motion.items if closure.name == name)
            return np.linalg.norm(self.motion.wrench(loop, self.motion.lambdas[..., None])[:, :3, 0], axis=1)
        return self.across(self.number_of(item))

    def levels(self, item, way=1):
        """The level and the bound at rest against rates of the sign `way`."""
        scope = item.scope
        keys = {key: value[way < 0] if isinstance(value, list) else value for key, value in item.keys["friction"].items()}
        if "mu" in keys:
            size = self.reaction(item, keys) * (scope.number(keys["radius"]) if "radius" in keys else 1.0)
            return scope.number(keys["mu"]) * size, scope.number(keys.get("mu_static", keys["mu"])) * size
        text = keys["torque"] if "torque" in keys else keys["force"]
        if text == "unlimited":
            return np.full(len(self.motion.t), np.inf), np.full(len(self.motion.t), np.inf)
        level = self.motion.environment(scope).value(text) + 0 * self.motion.t
        return level, np.maximum(scope.number(keys["static"]) if "static" in keys else level, level)

    def look_at(self, item):
        k = self.number_of(item)
        v, a, f = self.qd[:, k], self.motion.qdd[:, k], self.motion.friction[item.name]
        (level, most), (back, most_back) = self.levels(item, 1), self.levels(item, -1)
        more, less = (1 + 1e-5 if self.fault == "a larger level" else 1), (0.5 if self.fault == "a smaller static level" else 1)
        level, back, most, most_back = more * level, more * back, less * most, less * most_back
        a = a + 1e-3 * np.abs(self.qdd).max() if self.fault == "an acceleration at rest" else a
        v = {"rest taken as slip": np.where(v == 0, 1.0, v), "slip taken as rest": 0 * v}.get(self.fault, v)
        slips = np.abs(v) > SLIPS * max(np.abs(self.qd).max(), LEAST)
        small = LAW * (1 + max(x.max() for x in (level, back) if np.isfinite(x).all()))

        def off(direction):
            return np.abs(np.where(direction > 0, f + level, f - back))

        self.expect(item, "does not have its level while it slips", slips, off(v), small)
        self.expect(item, "exceeds its static level at rest", ~slips, np.maximum(f - most_back, -f - most), small)
        begins = ~slips & (np.abs(a) > RESTS * (1 + np.abs(self.qdd).max()))
        self.expect(item, "is accelerated at rest without its level against it", begins, off(a), small)

    def expect(self, item, words, where, off, allowed, kind="friction"):
        off = np.where(where, off, 0.0)
        self.worst = max(self.worst, float(np.max(off / max(allowed, 1e-300)) * LAW))
        if np.max(off) > allowed:
            row = int(np.argmax(off))
            self.complaints.append(f"{kind} '{item.name}' {words}: off by {off[row]:.3g} at t = {self.motion.t[row]:.9g}")

    # -- stops

    def look_at_stop(self, item):
        k, f, gap = self.number_of(item), self.motion.friction[item.name], self.table.column("gap." + item.name)
        sign = 1.0 if "lower" in item.keys else -1.0
        at = item.scope.number(item.keys["lower" if sign > 0 else "upper"])
        own = sign * (self.q[:, k] - at)
        off = np.abs(gap - own).max()
        if off > TOUCHES:
            self.complaints.append(f"the gap of '{item.name}' is off by {off:.3g}")
        own = own - 1e-3 if self.fault == "a stop that is passed" else own
        f = {"a stop that pulls": -f, "a stop that pushes at a distance": f + 1e-3}.get(self.fault, f)
        none = PUSHES * max(1.0, np.abs(f).max())
        a = sign * self.qdd[:, k] + (1e-3 * np.abs(self.qdd).max() if self.fault == "a stop that pushes what leaves" else 0)
        everywhere = np.ones(len(f), bool)
        self.expect(item, "is passed", everywhere, -own, TOUCHES, "stop")
        self.expect(item, "pulls", everywhere, -f, none, "stop")
        self.expect(item, "pushes at a distance", own > TOUCHES, np.abs(f), none, "stop")
        self.expect(item, "pushes what leaves", f > none, np.abs(a), RESTS * (1 + np.abs(self.qdd).max()), "stop")

    # -- energy

    def look_at_energy(self):
        """Without drives the energy never grows; with constant levels it falls by them times the ways that were slipped,
        where no stop takes some."""
        energy = self.motion.kinetic() + self.motion.loads.potential
        energy = energy + 1e-3 * self.motion.t if self.fault == "energy that grows" else energy
        size = max(np.ptp(energy), np.abs(self.motion.kinetic()).max(), 1e-3)
        rise = np.max(np.diff(energy), initial=0.0)
        if any(f.kind == "point_force" for f in self.mechanism.forces):
            return  # not in the energy
        if rise > ENERGY * size:
            self.complaints.append(f"the energy rises by {rise:.3g} of {size:.3g}")
        keys = [f.keys["friction"] for f in self.elements()]
        damped = any("damping" in f.keys.get("spring", {}) for f in self.mechanism.forces if isinstance(f.keys.get("spring"), dict))
        sided = any(isinstance(value, list) for k in keys for value in k.values())
        if damped or sided or self.stops() or any("mu" in k or "abs" in "".join(map(str, k.values())) for k in keys):
            return
        work = sum(self.levels(f)[0] * self.way(self.number_of(f)) for f in self.elements())
        off = np.abs(energy[0] - energy - work).max()
        if off > PATH * size:
            self.complaints.append(f"friction takes {work[-1]:.9g} by its ways, the energy falls by {energy[0] - energy[-1]:.9g}")

    def way(self, number):
        """The way that a coordinate has moved up to each row. If its rate changes sign between rows, it turns back: from
        either row the way to the turn follows from rate, acceleration and the change of that on its own side."""
        q, v, a = self.q[:, number], self.qd[:, number], self.qdd[:, number]
        h, steps = np.diff(self.motion.t), np.abs(np.diff(q))
        for i in np.nonzero(v[1:] * v[:-1] < 0)[0]:
            before = (a[i] - a[i - 1]) / h[i - 1] if i > 0 else 0.0
            after = (a[i + 2] - a[i + 1]) / h[i + 1] if i + 2 < len(a) else 0.0
            steps[i] = self.to_turn(v[i], a[i], before, h[i]) + self.to_turn(-v[i + 1], a[i + 1], -after, h[i])
        return np.concatenate([[0], np.cumsum(steps)])

    @staticmethod
    def to_turn(v, a, j, h):
        """The way until v + a s + j s^2/2 is zero, within h."""
        roots = np.roots([j / 2, a, v]) if j else np.array([-v / a if a else h])
        real = [s.real for s in roots if abs(s.imag) < 1e-9 and 0 <= s.real <= 1.5 * h]
        s = min(real, default=min(max(-v / a, 0.0), h) if a else h)
        return abs(v * s + a * s**2 / 2 + j * s**3 / 6)
