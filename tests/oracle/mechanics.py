# SPDX-License-Identifier: BSD-3-Clause
"""Mechanics in maximal coordinates: each body has a place, axes, velocity and angular velocity of its own, in ground axes,
and moves by the laws of Newton and Euler. Joints and closures are constraints between bodies. Accelerations, joint wrenches
and multipliers follow from one linear system. The first axis of all arrays counts instants."""
import numpy as np

import closure_residuals
import force_wrenches
from convention import broken
from jets import Jet, cross, matmul, matvec, tilde, transposed, turning, untilde, value
from mechanism import Item


class Environment:
    """The variables of expressions: time, coordinates, rates, multipliers, the names of one file."""

    def __init__(self, motion, scope, t, q, qd=None, lift=lambda x: x):
        self.motion, self.scope, self.t, self.q_of, self.qd_of, self.lift = motion, scope, t, q, qd, lift
        self.local = {}

    def value(self, text):
        return self.scope.compiled(text)(self)

    def name(self, text):
        if text in self.local:
            return self.local[text]
        if text == "t":
            return self.t
        if text == "pi" or text in self.scope.texts:
            return self.scope.name(text)
        full = self.scope.full(text)
        if full in self.motion.mechanism.blocks:
            return self.motion.mechanism.blocks[full](self)
        return self.state(full) if full in self.motion.states else self.motion.unknown(self.scope, text, self)

    def state(self, full):
        return self.lift(self.motion.states[full])

    def table(self, name):
        return self.scope.table(name)

    def coordinate(self, number):
        return self.q_of(number)

    def number_of(self, name):
        return self.motion.mechanism.places[self.scope.full(name)]

    def q(self, name):
        return self.q_of(self.number_of(name))

    def qd(self, name):
        return self.qd_of(self.number_of(name))

    def multiplier(self, name):
        return self.motion.multiplier(self.scope.full(name))

    def measure(self, word, places, component):
        return self.motion.measure(self.scope, word, places, component)

    def holds(self, a, sign, b):
        return self.motion.holds(a, sign, b)


class Motion:
    """The states of a mechanism at several instants: t (T), q and qd (T, n), states of its own (T, s). `multipliers`: what
    lambda(..) means in expressions, name -> (T, rows)."""

    def __init__(self, mechanism, t, q, qd, multipliers=None, conditions=None, states=None):
        self.mechanism, self.t, self.q, self.qd = mechanism, t, q, qd
        self.states = {} if states is None else {state.name: states[:, k] for k, (_, state) in enumerate(mechanism.states)}
        self.multipliers, self.conditions, self.near = multipliers or {}, conditions, np.full(len(t), np.inf)
        self.count, self.bodies, self.n = len(t), len(mechanism.bodies), q.shape[1]
        self.place()
        self.close()

    # -- expressions

    def environment(self, scope):
        """Values alone."""
        rate = (lambda k: 0 * self.qd[:, k]) if broken("rates in expressions") else (lambda k: self.qd[:, k])
        return Environment(self, scope, self.t, lambda k: self.q[:, k], rate)

    def directions(self, scope):
        """Jets by the coordinates: direction 0 is the motion itself, k + 1 that of coordinate k."""
        first = np.zeros((self.count, 1 + self.n))
        first[:, 0] = 1.0

        def coordinate(k):
            d = np.zeros((self.count, 1 + self.n))
            d[:, 0], d[:, 1 + k] = self.qd[:, k], 1.0
            return Jet(self.q[:, k, None], d, np.zeros_like(d))
        return Environment(self, scope, Jet(self.t[:, None], first, np.zeros_like(first)), coordinate)

    def timed(self, scope, directions):
        """Time alone: direction 0 is the motion, in the others time stands."""
        d = np.zeros((self.count, directions))
        d[:, 0] = 1.0
        return Environment(self, scope, Jet(self.t[:, None], d, np.zeros_like(d)), None)

    def multiplier(self, name):
        loop, _, k = name.partition(".")
        return self.multipliers[loop][:, int(k or 1) - 1]

    def holds(self, a, sign, b):
        difference = np.asarray(a - b, float)
        sign = {"<": ">", ">": "<", "<=": ">=", ">=": "<="}[sign] if broken("conditions turned") else sign
        outcome = {"<": difference < 0, "<=": difference <= 0, ">": difference > 0, ">=": difference >= 0}[sign]
        if self.conditions is not None:
            return self.conditions(difference, outcome)
        size = np.abs(difference) / (1 + np.abs(a) + np.abs(b))
        size = size[:, 0] if size.ndim == 2 else size
        self.near = np.minimum(self.near, size)
        return outcome

    def unknown(self, scope, name, env):
        """A named expression, or one of a group of equations, solved by Newton's method from its first guesses."""
        for owner, entry, keys in self.mechanism.unknowns:
            if owner is scope and not isinstance(keys, dict) and entry == name:
                return Environment(self, scope, env.t, env.q_of, env.qd_of, env.lift).value(keys)
            if owner is scope and isinstance(keys, dict) and name in keys["of"]:
                return env.lift(self.solved(scope, keys)[name])
        raise KeyError(name)

    def state_rates(self):
        """Rates of the states, (T, s)."""
        rates = np.zeros((self.count, len(self.mechanism.states)))
        for k, (scope, state) in enumerate(self.mechanism.states):
            if state.rate and not broken("rates of states"):
                rates[:, k] = state.rate(self.environment(scope))
        return rates

    def whens(self):
        """True where the conditions hold at which states change, (T, s)."""
        held = np.zeros((self.count, len(self.mechanism.states)), bool)
        for k, (scope, state) in enumerate(self.mechanism.states):
            if state.when:
                held[:, k] = self.environment(scope).value(f"if({state.when}, 1, 0)") > 0.5
        return held

    def next_states(self, due):
        """The states after those that are due have taken their next values, (T, s)."""
        after = np.stack(list(self.states.values()), -1)
        for k, (scope, state) in enumerate(self.mechanism.states):
            if due[k]:
                after[:, k] = state.following(self.environment(scope))
        return after

    def solved(self, scope, keys):
        names = list(keys["of"])
        texts = keys["zero"] if isinstance(keys["zero"], list) else [keys["zero"]]
        x = np.tile([scope.number(keys["of"][name]) for name in names], (self.count, 1))
        for _ in range(60):
            env = Environment(self, scope, self.t[:, None], lambda k: self.q[:, k, None], lambda k: self.qd[:, k, None],
                              lambda y: y[:, None])
            env.local = {name: Jet(x[:, i, None], np.eye(len(names))[i] + 0 * x[:, :1], 0 * x) for i, name in enumerate(names)}
            rows = [env.value(text) for text in texts]
            f, slope = np.stack([r.v[:, 0] for r in rows], -1), np.stack([r.d for r in rows], -2)
            step = np.linalg.solve(slope, f[..., None])[..., 0]
            x = x - step
            if np.max(np.abs(step)) < 1e-14 * (1 + np.max(np.abs(x))):
                break
        return {name: x[:, i] for i, name in enumerate(names)}

    # -- where the bodies are and how they move

    def place(self):
        """Places, axes and velocities of all bodies, and the joints' share of the accelerations."""
        shape = (self.count, self.bodies + 1, 3)  # the last body is the ground
        self.r, self.v, self.w = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        self.turn = np.tile(np.eye(3), (self.count, self.bodies + 1, 1, 1))
        size = 6 * self.bodies
        self.jointed, self.motions = np.tile(np.eye(size), (self.count, 1, 1)), np.zeros((self.count, size, self.n))
        self.bias = np.zeros((self.count, size))
        self.columns = np.zeros_like(self.motions)  # motions of the bodies by coordinates: jointed columns = -motions
        for joint in self.mechanism.joints:
            self.hang(joint)

    def hang(self, joint):
        """One body from its parent, by relative motion."""
        axes, place = self.relative(joint)
        k, p, c = len(joint.chain), joint.parent, joint.child
        up, wp = self.turn[:, p], self.w[:, p]
        vectors = [untilde(axes.d @ np.swapaxes(axes.v, -1, -2)), place.d, place.v, place.e[:, :1],
                   untilde(axes.e[:, :1] @ np.swapaxes(axes.v, -1, -2))]
        whole = np.concatenate(vectors, 1) @ np.swapaxes(up, -1, -2)  # in ground axes
        spin, slide, (gap, sliding_on, turning_on) = whole[:, :1 + k], whole[:, 1 + k:2 + 2 * k], np.moveaxis(whole[:, -3:], 1, 0)
        self.turn[:, c] = up @ axes.v[:, 0]
        self.r[:, c], self.w[:, c] = self.r[:, p] + gap, wp + spin[:, 0]
        self.v[:, c] = self.v[:, p] + cross(wp, gap) + slide[:, 0]
        coriolis = 0 if broken("Coriolis acceleration") else 2 * cross(wp, slide[:, 0])
        bias = np.concatenate([cross(wp, cross(wp, gap)) + coriolis + sliding_on, turning_on + cross(wp, spin[:, 0])], -1)
        rows = slice(6 * c, 6 * c + 6)
        self.bias[:, rows] = -bias
        for i, number in enumerate(joint.coordinates):
            self.motions[:, rows, number] = -np.concatenate([slide[:, 1 + i], spin[:, 1 + i]], -1)
        if p >= 0:
            self.jointed[:, rows, 6 * p:6 * p + 6] = -np.eye(6)
            self.jointed[:, 6 * c:6 * c + 3, 6 * p + 3:6 * p + 6] = tilde(gap)
            self.columns[:, rows] = -self.jointed[:, rows, 6 * p:6 * p + 6] @ self.columns[:, 6 * p:6 * p + 6]
        self.columns[:, rows] -= self.motions[:, rows]

    def relative(self, joint):
        """Axes and place of the child in the axes of its parent, as jets: direction 0 is the motion, i + 1 that of the
        joint's own coordinate i."""
        axes, place = self.chain(joint)
        at, to = joint.at, joint.to
        frame = joint.frame.T if broken("frame") else joint.frame
        if not joint.turned:
            place = matvec(frame, place)
            axes = matmul(frame, axes)
        else:
            axes = transposed(axes)
            place = -matvec(axes, place)
            axes = matmul(axes, frame.T)
        place = at.place + matvec(at.axes, place)
        axes = matmul(at.axes, axes)
        axes = axes if broken("axes of `to`") else matmul(axes, to.axes.T)
        return axes, place - matvec(axes, to.place) if np.any(to.place) and not broken("place of `to`") else place

    def chain(self, joint):
        k, shape = len(joint.chain), (self.count, 1 + len(joint.chain))
        axes, place = None, Jet(np.zeros((self.count, 1, 3)), np.zeros(shape + (3,)), np.zeros(shape + (3,)))
        order = list(enumerate(joint.chain))
        for i, (rotation, axis) in order[::-1] if broken("order of motions") else order:
            number, d = joint.coordinates[i], np.zeros(shape)
            sign = -1.0 if joint.turned and broken("reversed") else 1.0
            d[:, 0], d[:, 1 + i] = sign * self.qd[:, number], sign
            q = Jet(sign * self.q[:, number, None], d, np.zeros(shape))
            if rotation:
                axes = matmul(axes, turning(axis, q)) if axes else turning(axis, q)
            else:
                along = Jet(*(x[..., None] * axis for x in (q.v, q.d, q.e)))
                place = place + (matvec(axes, along) if axes else along)
        if not axes:
            axes = Jet(np.tile(np.eye(3), (self.count, 1, 1, 1)), np.zeros(shape + (3, 3)), np.zeros(shape + (3, 3)))
        assert k == len(joint.coordinates)
        return axes, place

    # -- points

    def point(self, body, place):
        """Place and velocity in ground axes; `body` -1 is the ground."""
        arm = self.turn[:, body] @ place
        spin = 0 if body >= 0 and broken("velocity of points") else cross(self.w[:, body], arm)
        return self.r[:, body] + arm, self.v[:, body] + spin

    def point_acceleration(self, body, place, accelerations):
        if body < 0:
            return np.zeros((self.count, 3))
        arm, w = self.turn[:, body] @ place, self.w[:, body]
        a, wd = accelerations[:, 6 * body:6 * body + 3], accelerations[:, 6 * body + 3:6 * body + 6]
        return a + cross(wd, arm) + (0 if broken("acceleration of points") else cross(w, cross(w, arm)))

    # -- points and axes in expressions

    def seen(self, point):
        """The axes of a point as columns."""
        return self.turn[:, point.body] @ point.axes

    def measure(self, scope, word, places, component):
        if word == "angle":
            return self.angle(scope, places)
        points = [scope.point(text) for text in places]
        (p, v), w = self.point(points[0].body, points[0].place), self.w[:, points[0].body]
        axes = np.eye(3)[None]
        if len(points) > 1:
            (q, u), spin, axes = self.point(points[1].body, points[1].place), self.w[:, points[1].body], self.seen(points[1])
            carried = 0 if broken("rates of relative positions") or word == "approach" else cross(spin, p - q)
            p, v, w = p - q, v - u - carried, w - spin
        if word in ("distance", "approach"):
            length = np.linalg.norm(p, axis=-1)
            return length if word == "distance" else np.sum(p * v, -1) / length
        if word == "axes":
            component, x = component[1], self.seen(points[0])[:, :, "xyz".index(component[0])]
        else:
            x = {"position": p, "velocity": v, "angular_velocity": w}[word]
        return np.sum(axes[:, :, "xyz".index(component)] * x, -1)

    def angle(self, scope, places):
        """Between two axes, or from the first to the second about a third."""
        axes = [self.seen(scope.point(text[:-2]))[:, :, "xyz".index(text[-1])] for text in places]
        across, along = cross(axes[0], axes[1]), np.sum(axes[0] * axes[1], -1)
        if len(axes) == 2:
            return np.arctan2(np.linalg.norm(across, axis=-1), along)
        about = axes[2] * (-1 if broken("sign of angles") else 1)
        along = along - np.sum(about * axes[0], -1) * np.sum(about * axes[1], -1)
        return np.arctan2(np.sum(about * across, -1), along)

    # -- closures

    def pose(self, body, side):
        """A body as jets along 13 directions: 0 is the motion without acceleration, 1-6 and 7-12 are unit velocities of
        the first and of the second body."""
        d, w = np.zeros((self.count, 13, 3)), np.zeros((self.count, 13, 3))
        d[:, 0], w[:, 0] = self.v[:, body], self.w[:, body]
        if body >= 0:
            d[:, 1 + 6 * side:4 + 6 * side] = np.eye(3)
            w[:, 4 + 6 * side:7 + 6 * side] = np.eye(3)
        turn, wt = self.turn[:, body, None], tilde(w)
        return (Jet(turn, wt @ turn, wt @ wt @ turn), Jet(self.r[:, body, None], d, np.zeros_like(d)))

    def close(self):
        """All closures' rows: their values, rates, gradients by bodies and by coordinates, and bias."""
        self.rows, parts = {}, []
        items = list(self.mechanism.closures) + list(self.mechanism.drives)
        items += [Item("screw", j.name, None, {"joint": j}) for j in self.mechanism.joints if j.pitch is not None]
        self.items = items
        at = 0
        for item in items:
            part = self.coordinate_rows(item) if item.kind in closure_residuals.ON_COORDINATES else self.body_rows(item)
            self.rows[item.name] = slice(at, at + part[0].shape[1])
            at += part[0].shape[1]
            parts.append(part)
        empty = [np.zeros((self.count, 0)), np.zeros((self.count, 0)), np.zeros((self.count, 0)),
                 np.zeros((self.count, 0, 6 * self.bodies)), np.zeros((self.count, 0, self.n))]
        parts.append(empty)
        self.h, self.hdot, self.closing, self.by_bodies, self.by_coordinates = (np.concatenate(x, 1) for x in zip(*parts))
        self.jacobian = self.by_bodies @ self.columns + self.by_coordinates

    def body_rows(self, item):
        first, second = (p.body for p in item.points)
        ends = closure_residuals.Ends(item, self.pose(first, 0), self.pose(second, 1))
        rows = closure_residuals.ROWS[item.kind](ends, self.timed(item.scope, 13))
        h, d, e = stacked(rows, self.count, 13)
        gradient = np.zeros((self.count, len(rows), 6 * self.bodies))
        for side, body in ((0, first), (1, second)):
            if body >= 0:
                gradient[:, :, 6 * body:6 * body + 6] = d[:, :, 1 + 6 * side:7 + 6 * side]
        bias = 0 * h if broken("speed of closures in time") else e[:, :, 0]
        return h, d[:, :, 0], bias, gradient, np.zeros((self.count, len(rows), self.n))

    def coordinate_rows(self, item):
        env = self.directions(item.scope)
        rows = closure_residuals.ON_COORDINATES[item.kind](item, env)
        h, d, e = stacked(rows, self.count, 1 + self.n)
        bias = 0 * e[:, :, 0] if item.kind == "drive" and broken("acceleration of drives") else e[:, :, 0]
        return h, d[:, :, 0], bias, np.zeros((self.count, len(rows), 6 * self.bodies)), d[:, :, 1:]

    # -- forces and the linear system

    def load(self):
        self.loads = force_wrenches.Loads(self)
        return self.loads

    def inertia(self):
        """The blocks of Newton's and Euler's laws about each body's origin, and what they say without acceleration."""
        size = 6 * self.bodies
        mass, right = np.zeros((self.count, size, size)), np.zeros((self.count, size))
        for body in self.mechanism.bodies:
            b, turn, w = body.number, self.turn[:, body.number], self.w[:, body.number]
            com, tensor = turn @ body.com, turn @ self.tensor(body) @ np.swapaxes(turn, -1, -2)
            lever = tilde(com)
            s, m = slice(6 * b, 6 * b + 3), body.mass
            a = slice(6 * b + 3, 6 * b + 6)
            mass[:, s, s], mass[:, s, a], mass[:, a, s] = m * np.eye(3), -m * lever, m * lever
            mass[:, a, a] = tensor - m * lever @ lever
            pull = cross(w, cross(w, com))
            gyroscopic = 0 if broken("gyroscopic moment") else cross(w, (tensor @ w[..., None])[..., 0])
            right[:, s], right[:, a] = -m * pull, -m * cross(com, pull) - gyroscopic
        return mass, right

    @staticmethod
    def tensor(body):
        if not broken("sign of products of inertia"):
            return body.inertia
        return 2 * np.diag(np.diag(body.inertia)) - body.inertia

    def ranks(self):
        """Orthonormal combinations of the closures' rows that are independent, and of those that are not: (T, m, r) and
        (T, m, m - r). The rank is that of the first instant."""
        m = self.h.shape[1]
        scale = np.linalg.norm(self.jacobian, axis=2)
        scale[scale < 1e-12] = 1.0
        left, values, _ = np.linalg.svd(self.jacobian / scale[:, :, None])
        self.singular_values = values
        self.rank = int(np.sum(values[0] > 1e-9)) if m else 0
        left = left / scale[:, :, None]
        return left[:, :, :self.rank], left[:, :, self.rank:]

    def solve(self):
        """Accelerations of the bodies x and of the coordinates z, joint wrenches u, multipliers y of independent rows, by
        mass x - jointed' u - by_bodies' y = force, jointed x + motions z = -bias, by_bodies x + by_coordinates z = -closing and
        -motions' u - by_coordinates' y = effort: the joints' rows give x = columns z + x0."""
        mass, right = self.inertia()
        force, effort = right + self.load().wrenches, self.loads.efforts
        kept, self.dropped = self.ranks()
        by_bodies, by_coordinates = (np.swapaxes(kept, -1, -2) @ x for x in (self.by_bodies, self.by_coordinates))
        self.parts = mass, by_bodies, by_coordinates
        across, times = lambda m: np.swapaxes(m, -1, -2), lambda m, v: (m @ v[..., None])[..., 0]
        x0, rows = -np.linalg.solve(self.jointed, self.bias[..., None])[..., 0], by_bodies @ self.columns + by_coordinates
        n, size = self.n, self.n + kept.shape[2]
        k, b = np.zeros((self.count, size, size)), np.zeros((self.count, size))
        k[:, :n, :n], k[:, :n, n:], k[:, n:, :n] = across(self.columns) @ mass @ self.columns, -across(rows), rows
        b[:, :n] = effort + times(across(self.columns), force - times(mass, x0))
        b[:, n:] = -times(across(kept), self.closing) - times(by_bodies, x0)
        found = np.linalg.solve(k, b[..., None])[..., 0]
        self.qdd, y = found[:, :n], found[:, n:]
        self.accelerations = times(self.columns, self.qdd) + x0
        unjointed = times(mass, self.accelerations) - times(across(by_bodies), y) - force
        self.joint_wrenches = np.linalg.solve(across(self.jointed), unjointed[..., None])[..., 0]
        self.lambdas = times(kept, y) * (-1 if broken("sign of multipliers") else 1)
        return self

    def matrix(self, instants):
        """Of all unknowns of `solve`."""
        mass, by_bodies, by_coordinates, jointed, motions = (x[instants] for x in (*self.parts, self.jointed, self.motions))
        nb, n = 6 * self.bodies, self.n
        size = nb + n + nb + by_bodies.shape[1]
        k = np.zeros((len(mass), size, size))
        x, z, u, y = slice(0, nb), slice(nb, nb + n), slice(nb + n, 2 * nb + n), slice(2 * nb + n, size)
        k[:, x, x], k[:, u, x], k[:, u, z] = mass, jointed, motions
        k[:, y, x], k[:, y, z] = by_bodies, by_coordinates
        k[:, x, u], k[:, z, u] = (-np.swapaxes(m, -1, -2) for m in (jointed, motions))
        k[:, x, y], k[:, z, y] = (-np.swapaxes(m, -1, -2) for m in (by_bodies, by_coordinates))
        return k

    def condition(self, instants=slice(None)):
        """Of the linear system with rows and columns brought to size 1: how much of rounding may be seen in its solution."""
        k = self.matrix(instants)
        for _ in range(3):
            for axis in (-1, -2):
                size = np.max(np.abs(k), axis=axis, keepdims=True)
                k = k / np.sqrt(np.where(size == 0, 1, size))
        return np.linalg.cond(k)

    # -- what closures transmit

    def wrench(self, item, lambdas, body_side=1):
        """Force and moment about the point's own place on one of the closure's bodies, ground axes; `lambdas` (T, m, c)."""
        point = item.points[body_side]
        if point.body < 0:
            return -self.opposite(item, lambdas, body_side)
        rows, b = self.rows[item.name], 6 * point.body
        whole = np.einsum("tmk,tmc->tkc", self.by_bodies[:, rows, b:b + 6], lambdas[:, rows])
        return self.about(whole, self.turn[:, point.body] @ point.place)

    def opposite(self, item, lambdas, body_side):
        """The wrench on the other body, about this side's place."""
        other, mine = item.points[1 - body_side], item.points[body_side]
        rows, b = self.rows[item.name], 6 * other.body
        whole = np.einsum("tmk,tmc->tkc", self.by_bodies[:, rows, b:b + 6], lambdas[:, rows])
        return self.about(whole, self.point(mine.body, mine.place)[0] - self.r[:, other.body])

    @staticmethod
    def about(whole, arm):
        force, moment = whole[:, :3], whole[:, 3:]
        arm = 0 * arm if broken("place of moments") else arm
        return np.concatenate([force, moment - tilde(arm) @ force], 1)

    def free_joint_wrenches(self):
        """Those that the free combinations of multipliers make alone, without any motion: (T, 6 bodies, m - r)."""
        loads = np.swapaxes(self.by_bodies, -1, -2) @ self.dropped
        return -np.linalg.solve(np.swapaxes(self.jointed, -1, -2), loads)

    def lengths(self, item):
        """Distances of a closure's points."""
        first, second = (self.point(p.body, p.place)[0] for p in item.points)
        return np.linalg.norm(second - first, axis=-1)

    def kinetic(self):
        total = np.zeros(self.count)
        for body in self.mechanism.bodies:
            _, velocity = self.point(body.number, body.com)
            w = np.einsum("tji,tj->ti", self.turn[:, body.number], self.w[:, body.number])
            total += 0.5 * body.mass * np.sum(velocity**2, -1)
            total += (0 if broken("kinetic energy of rotation") else 0.5) * np.einsum("ti,ij,tj->t", w, self.tensor(body), w)
        return total


def stacked(rows, count, directions):
    """Scalar jets as arrays (T, rows) and (T, rows, directions)."""
    rows = [r if isinstance(r, Jet) else Jet(r) for r in rows]
    wide = lambda x: np.broadcast_to(np.asarray(x, float), (count, directions))
    h = np.stack([np.broadcast_to(value(r), (count, 1))[:, 0] for r in rows], 1)
    return h, np.stack([wide(r.d) for r in rows], 1), np.stack([wide(r.e) for r in rows], 1)
