# SPDX-License-Identifier: BSD-3-Clause
"""Random bodies at revolute and prismatic joints, and their balance: six accelerations of each body and all loads of joints are
unknowns of Newton's and Euler's equations (gear_trains, rope_machines, element_machines)."""
import csv
import subprocess

import numpy as np

WAYS = ("reduced", "projected", "dae")
NOTHING = np.zeros(3)


def number(x):
    return repr(float(x))


def numbers(v):
    return "[" + ", ".join(number(x) for x in v) + "]"


def cross(a, b):
    """Of two vectors; numpy's own takes ten times as long."""
    ax, ay, az = a
    bx, by, bz = b
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def unit(v):
    return v / np.linalg.norm(v)


def turned(axis, angle):
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def frame(z, x):
    """Columns x, y, z with z along one direction and x near another."""
    z = unit(z)
    x = unit(x - (x @ z) * z)
    return np.column_stack([x, cross(z, x), z])


class Body:
    """A body at the end of a joint along or about z of a frame on its parent (None: the ground)."""

    def __init__(self, rng, name, parent, at, axes, slides=False):
        self.name, self.parent, self.at, self.axes, self.slides = name, parent, np.asarray(at, float), axes, slides
        self.mass, self.com = rng.uniform(0.5, 3), rng.uniform(-0.03, 0.03, 3)
        m = rng.uniform(-1, 1, (3, 3))
        second = 0.01 * (m @ m.T + 0.2 * np.eye(3))
        self.inertia = np.trace(second) * np.eye(3) - second
        self.q, self.qd, self.torque = rng.uniform(-1, 1) * (0.0 if slides else 1), 0.0, rng.uniform(-5, 5)
        self.points = []

    def point(self, at, axes=None):
        self.points.append((np.asarray(at, float), axes))
        return f"{self.name}.P{len(self.points)}"


class Bodies:
    """Bodies of a machine, with gravity and points of the ground."""

    def __init__(self, rng):
        self.rng, self.bodies, self.ground = rng, [], []
        self.gravity = rng.uniform(-10, 10, 3)

    def add(self, parent, at, axes, slides=False):
        self.bodies.append(Body(self.rng, f"b{len(self.bodies)}", parent, at, axes, slides))
        return self.bodies[-1]

    def place(self, body, at, axes=None):
        """The name of a new point of a body, or of the ground."""
        if body:
            return body.point(at, axes)
        self.ground.append((np.asarray(at, float), axes))
        return f"ground.Q{len(self.ground)}"

    def move(self):
        """Places, axes and velocities of all bodies in the axes of the ground."""
        for body in self.bodies:
            p = body.parent
            place, turn, v, w = (p.x, p.R, p.v, p.w) if p else (np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))
            axes = turn @ body.axes
            arm = turn @ body.at + (body.q * axes[:, 2] if body.slides else 0)
            body.x, body.base = place + arm, axes
            body.R = axes if body.slides else axes @ turned(np.array([0.0, 0, 1]), body.q)
            body.w = w + (0 if body.slides else body.qd * axes[:, 2])
            body.v = v + cross(w, arm) + (body.qd * axes[:, 2] if body.slides else 0)

    def pose(self, body):
        return (body.x, body.R, body.v, body.w) if body else (np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))

    def rows_of_rates(self, count, values):
        """The matrix of functions that are linear in the rates of all coordinates."""
        rows = np.zeros((count, len(self.bodies)))
        for k, body in enumerate(self.bodies):
            for other in self.bodies:
                other.qd = float(other is body)
            self.move()
            rows[:, k] = values()
        return rows

    def set_rates(self, rates):
        for body, rate in zip(self.bodies, rates):
            body.qd = float(rate)
        self.move()

    # -- text -------------------------------------------------------------------------------------------------

    def text(self, elements, outputs, end=1e-6, step=1e-6, rtol=1e-10):
        """The model with the lines of further sections, and the outputs of its run."""
        lines = ["kempe: 1", f"gravity: {numbers(self.gravity)}"]
        own = {id(body): [] for body in self.bodies}
        grounds = [point_text(f"Q{k + 1}", *point) for k, point in enumerate(self.ground)]
        for body in self.bodies:
            (own[id(body.parent)] if body.parent else grounds).append(point_text(f"J{body.name}", body.at, body.axes))
        lines += [f"ground: {{points: {{{', '.join(grounds)}}}}}", "bodies:"]
        for body in self.bodies:
            points = own[id(body)] + [point_text(f"P{k + 1}", *point) for k, point in enumerate(body.points)]
            i = body.inertia
            tensor = "{" + ", ".join(f"{'xyz'[a]}{'xyz'[b]}: {number(i[a, b])}" for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))) + "}"
            lines.append(f"  {body.name}: {{joint: {{{'prismatic' if body.slides else 'revolute'}: z, at: "
                         f"{body.parent.name if body.parent else 'ground'}.J{body.name}}}, mass: {number(body.mass)}, com: {numbers(body.com)}, "
                         f"inertia: {tensor}{', points: {' + ', '.join(points) + '}' if points else ''}}}")
        lines += [*elements, "forces:"]
        lines += [f"  t{body.name}: {{joint: {body.name}, {'force' if body.slides else 'torque'}: {number(body.torque)}}}" for body in self.bodies]
        lines.append("start: {q: {" + ", ".join(f"{b.name}: {number(b.q)}" for b in self.bodies) + "}, qd: {"
                     + ", ".join(f"{b.name}: {number(b.qd)}" for b in self.bodies) + "}}")
        loads = [f"{what}({b.name})" for b in self.bodies for what in ("reaction", "moment")]
        lines.append(f"run: {{t_end: {end!r}, rtol: {rtol!r}, output_step: {step!r}, outputs: [{', '.join(['qdd', *outputs, *loads])}]}}")
        return "\n".join(lines) + "\n"


def point_text(name, at, axes):
    return f"{name}: " + (numbers(at) if axes is None else f"{{at: {numbers(at)}, axes: {{z: {numbers(axes[:, 2])}, x: {numbers(axes[:, 0])}}}}}")


class Balance:
    """The equations of a machine: masses, loads that are known, and rows of constraints. Joints have the first rows."""

    def __init__(self, machine):
        self.machine, self.index = machine, {id(b): k for k, b in enumerate(machine.bodies)}
        self.size = 6 * len(machine.bodies)
        self.rows, self.right, self.columns = [], [], []
        self.force, self.mass = np.zeros(self.size), np.zeros((self.size, self.size))
        for k, b in enumerate(machine.bodies):
            c = b.R @ b.com
            inertia = b.R @ b.inertia @ b.R.T
            tilde = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
            self.mass[6 * k:6 * k + 3, 6 * k:6 * k + 3] = b.mass * np.eye(3)
            self.mass[6 * k:6 * k + 3, 6 * k + 3:6 * k + 6] = -b.mass * tilde
            self.mass[6 * k + 3:6 * k + 6, 6 * k:6 * k + 3] = b.mass * tilde
            self.mass[6 * k + 3:6 * k + 6, 6 * k + 3:6 * k + 6] = inertia - b.mass * tilde @ tilde
            spin = cross(b.w, cross(b.w, c))
            self.force[6 * k:6 * k + 3] = b.mass * machine.gravity - b.mass * spin
            self.force[6 * k + 3:6 * k + 6] = cross(c, b.mass * machine.gravity) - cross(b.w, inertia @ b.w) - b.mass * cross(c, spin)
            effort = b.torque * b.base[:, 2]
            self.load(b, b.x, effort if b.slides else 0 * effort, 0 * effort if b.slides else effort)
        for b in machine.bodies:
            self.add_joint(b)
        self.joints = len(self.rows)

    def load(self, body, at, push, torque, alone=False):
        """A load on a body; without `alone` the opposite one on its parent."""
        for b, sign in ((body, 1), (body.parent if body and not alone else None, -1)):
            if b is not None:
                k = self.index[id(b)]
                self.force[6 * k:6 * k + 3] += sign * push
                self.force[6 * k + 3:6 * k + 6] += sign * (cross(at - b.x, push) + torque)

    def jacobian(self, body, at, direction, turning=NOTHING):
        """The row by which the six accelerations of a body give that of a place along a direction, and about `turning`."""
        row = np.zeros(self.size)
        if body is not None:
            k = self.index[id(body)]
            row[6 * k:6 * k + 3] = direction
            row[6 * k + 3:6 * k + 6] = cross(at - body.x, direction) + turning
        return row

    @staticmethod
    def bias(body, speed):
        """The part of the acceleration of the body at a place that moves with `speed`, without accelerations."""
        return np.zeros(3) if body is None else cross(body.w, speed - body.v)

    def add(self, row, right, column=None):
        """A constraint: its row, and where its force has another direction its column."""
        self.rows.append(row)
        self.right.append(right)
        self.columns.append(row if column is None else column)

    def add_joint(self, b):
        px, _, pv, w = self.machine.pose(b.parent)
        for axis in range(3):
            e, rate = b.base[:, axis], cross(w, b.base[:, axis])
            if not (b.slides and axis == 2):
                relative = b.v - pv - cross(w, b.x - px)
                self.add(self.jacobian(b, b.x, e) - self.jacobian(b.parent, b.x, e),
                         -e @ (self.bias(b, b.v) - self.bias(b.parent, b.v)) - rate @ relative)
            if b.slides or axis < 2:
                self.add(self.jacobian(b, b.x, NOTHING, e) - self.jacobian(b.parent, b.x, NOTHING, e), -rate @ (b.w - w))

    def solve(self):
        """The forces of all constraints that are not joints."""
        a, m = np.array(self.rows), len(self.rows)
        whole = np.zeros((self.size + m, self.size + m))
        whole[:self.size, :self.size] = self.mass
        whole[:self.size, self.size:] = -np.array(self.columns).T
        whole[self.size:, :self.size] = a
        self.solved = np.linalg.solve(whole, np.concatenate([self.force, self.right]))
        return self.solved[self.size + self.joints:]

    def loads(self):
        """{body: (force, moment)} of all joints."""
        loads, r = {}, self.size
        for b in self.machine.bodies:
            f, t = np.zeros(3), np.zeros(3)
            for axis in range(3):
                if not (b.slides and axis == 2):
                    f += self.solved[r] * b.base[:, axis]
                    r += 1
                if b.slides or axis < 2:
                    t += self.solved[r] * b.base[:, axis]
                    r += 1
            loads[b.name] = (f, t)
        return loads

    def accelerations(self):
        """Of all coordinates."""
        rates = []
        for k, b in enumerate(self.machine.bodies):
            z = b.base[:, 2]
            pa = self.solved[6 * self.index[id(b.parent)]:][:6] if b.parent else np.zeros(6)
            if b.slides:
                px, _, _, pw = self.machine.pose(b.parent)
                base = pa[:3] + cross(pa[3:], b.x - px) + cross(pw, cross(pw, b.x - px)) + 2 * cross(pw, b.qd * z)
                rates.append(z @ (self.solved[6 * k:6 * k + 3] - base))
            else:
                rates.append(z @ (self.solved[6 * k + 3:6 * k + 6] - pa[3:]))
        return np.array(rates)


def run(kempe, text, folder, ways=WAYS):
    """{formulation: first row of its run}; a text where there is none."""
    path, out, rows = folder / "machine.yaml", folder / "out.csv", {}
    path.write_text(text)
    for way in ways:
        out.unlink(missing_ok=True)
        try:
            done = subprocess.run([kempe, "simulate", path, "--formulation", way, "--no-convergence-check", "-o", out],
                                  capture_output=True, text=True, timeout=60)
        except subprocess.TimeoutExpired:
            return f"no result in 60 s by {way}"
        row = next(csv.DictReader(out.read_text().splitlines()), None) if out.exists() else None
        if row is None:
            return done.stderr.strip() or done.stdout.strip()
        rows[way] = row
    return rows


def of_row(machine, row):
    """Accelerations and loads of a row of a run."""
    qdd = np.array([float(row[f"qdd.{b.name}"]) for b in machine.bodies])
    return qdd, {b.name: tuple(np.array([float(row[f"{what}.{b.name}.{c}"]) for c in "xyz"]) for what in ("reaction", "moment")) for b in machine.bodies}


def off(a, b):
    """The largest difference over the largest number."""
    a, b = np.ravel(a), np.ravel(b)
    return np.abs(a - b).max(initial=0) / max(1.0, np.abs(b).max(initial=0))


def off_loads(loads, others):
    return np.max([off(np.array([v[k] for v in others.values()]), np.array([v[k] for v in loads.values()])) for k in range(2)])


def examine_all(count, name, examine, chosen, same):
    """Prints and judges the differences of machines: `examine(k)` is (difference, None), or (None, why it says nothing)."""
    worst, wrong, silent = 0.0, 0, {}
    for k in chosen:
        apart, reason = examine(k)
        if reason:
            silent.setdefault(reason, []).append(k)
            continue
        worst = max(worst, apart)
        if not apart <= same:
            wrong += 1
            print(f"machine {k}: {apart:.3g}")
    said = sum(len(v) for v in silent.values())
    for reason, which in silent.items():
        print(f"{len(which)} without a result, the first {which[0]}: {reason[:300]}")
    print(f"{count - said} machines with {name} by {len(WAYS)} formulations: largest difference {worst:.2g}, {wrong} above {same:g}")
    return bool(wrong or said > count // 5)
