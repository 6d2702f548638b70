# SPDX-License-Identifier: BSD-3-Clause
"""Mechanisms with flexible bodies by Lagrange's equations of particles. Every mass is points whose places are functions of the
coordinates; their derivatives along the motion and along each coordinate are jets. M is the sum of m (dx/dq)'(dx/dq), C that of m
(dx/dq)'(x'' - g), less applied forces. Closures and forces are those of the other mechanics here: each station of a beam is a
body of its own without mass."""
import numpy as np

import force_wrenches
from beam_particles import Beam, planted
from jets import Jet, matmul, matvec, product, transposed, turning, untilde
from mechanics import Motion
from mechanism import Body, Joint, Mechanism, Point, Scope

RANK = 1e-9  # of singular values of rows of length 1


class FlexibleMechanism(Mechanism):
    def __init__(self, document, folder="."):
        self.beams = []  # (body, beam)
        super().__init__(document, folder)
        self.scope_of_points = Scope(self, document, ".", "", Point(-1, np.zeros(3)), {})
        self.scope_of_points.grounds.update(self.ground_points)
        self.rigid = [(body.number, *points_of(body)) for body in self.bodies if body.mass or np.any(body.inertia)]

    def add_body(self, scope, name, keys):
        points = keys.get("points", {})
        plain = {point: place for point, place in points.items() if not (isinstance(place, dict) and "station" in place)}
        super().add_body(scope, name, {**keys, "points": plain})
        body = self.bodies[-1]
        if "flexible" not in keys:
            return
        beam = Beam.of(scope, keys["flexible"])
        self.beams.append((body, beam))
        body.beam, body.sections = beam, {}
        for point, given in points.items():
            if point in plain:  # of the section at the origin
                body.stations[point] = self.section(body, 0.0)
                continue
            body.stations[point] = self.section(body, scope.number(given["station"]))
            _, axes = scope.pose({**given, "at": ["0"] * 3})
            offset = scope.vector(given.get("offset", ["0", "0", "0"])) * (0 if planted("offset of stations") else 1)
            body.points[point] = offset, axes

    def section(self, body, x):
        """The body without mass that a section is."""
        if x not in body.sections:
            section = Body(f"{body.name}@{x:g}", len(self.bodies))
            self.bodies.append(section)
            body.sections[x] = section.number
            joint = Joint(section.name, Point(body.number, np.zeros(3)), Point(section.number, np.zeros(3)), np.eye(3), [])
            joint.beam, joint.station, joint.words = body.beam, x, []
            self.joints.append(joint)
        return body.sections[x]

    def point_of(self, text):
        return self.scope_of_points.point(text)

    def count(self):
        super().count()
        for body, beam in self.beams:
            beam.first_coordinate = len(self.columns)
            for name in beam.names:
                self.places[f"{body.name}.{name}"] = len(self.columns)
                self.columns.append(f"{body.name}.{name}")
                self.rotates.append(name.startswith("phi"))


def points_of(body):
    """Masses and places of seven points that have a rigid body's mass, centre and inertia."""
    second = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia
    values, axes = np.linalg.eigh(second)
    share = max(body.mass, 1.0)
    arms = [np.sqrt(abs(v) / (2 * share)) * axes[:, k] for k, v in enumerate(values)]
    weights = [body.mass - 2 * share * np.sum(np.sign(values))]
    places = [body.com]
    for v, arm in zip(values, arms):
        for sign in (1, -1):
            weights.append(share * np.sign(v))
            places.append(body.com + sign * arm)
    return np.array(weights), np.array(places)


class Applied(force_wrenches.Loads):
    def weigh(self):
        """Particles have their weight."""


class Particles(Motion):
    """The states of a mechanism at several instants, as `Motion`."""

    def __init__(self, mechanism, t, q, qd):
        super().__init__(mechanism, t, q, qd)
        self.equations()

    # -- places

    def coordinates(self, numbers):
        """Jets (t, 1 + n) + numbers: direction 0 is the motion, 1 + k coordinate k."""
        numbers = np.asarray(numbers, int)
        d = np.zeros((self.count, 1 + self.n) + numbers.shape)
        d[:, 0] = self.qd[:, numbers]
        for at in np.ndindex(numbers.shape):
            d[(slice(None), 1 + numbers[at]) + at] = 1.0
        return Jet(self.q[:, None][..., numbers], d, np.zeros_like(d))

    def chain(self, joint):
        shape = (self.count, 1 + self.n)
        axes = Jet(np.tile(np.eye(3), (self.count, 1, 1, 1)), np.zeros(shape + (3, 3)), np.zeros(shape + (3, 3)))
        place = Jet(np.zeros((self.count, 1, 3)), np.zeros(shape + (3,)), np.zeros(shape + (3,)))
        for (rotation, axis), number in zip(joint.chain, joint.coordinates):
            q = self.coordinates(number)
            if rotation:
                axes = matmul(axes, turning(axis, q))
            else:
                place = place + matvec(axes, Jet(*(x[..., None] * axis for x in (q.v, q.d, q.e))))
        return axes, place

    def fields(self, beam, first, more):
        """first q + q' more q of many points."""
        q = self.coordinates(np.arange(beam.n) + beam.first_coordinate)
        flat, bent = first.reshape(-1, beam.n), more.reshape(-1, beam.n, beam.n)
        linear = product(lambda a, b: b @ a.T, flat, q)
        size = len(flat)
        half = product(lambda a, b: (b @ a.reshape(-1, beam.n).T).reshape(b.shape[:2] + (size, beam.n)), bent, q)
        squares = product(lambda a, b: (a @ b[..., None])[..., 0], half, q)
        sum_ = linear + squares
        return Jet(*(x.reshape(x.shape[:2] + first.shape[:-1]) for x in (sum_.v, sum_.d, sum_.e)))

    def station(self, beam, x):
        """Axes and place at a section in the axes of the body: without deformation the axes are these."""
        place, ways, more, turns, twice = beam.station(x)
        angle, way = self.fields(beam, turns, twice), self.fields(beam, ways, more)
        order = (2, 0, 1) if planted("order of angles") else (2, 1, 0)
        axes = None
        for c in order:
            turn = turning(np.eye(3)[c], angle.part(c))
            axes = turn if axes is None else matmul(axes, turn)
        turn, back = beam.axes, np.eye(3) if planted("axes of stations") else beam.axes.T
        way = way + place
        return Jet(*(turn @ x @ back for x in (axes.v, axes.d, axes.e))), Jet(*(x @ turn.T for x in (way.v, way.d, way.e)))

    def place(self):
        shape = (self.count, self.bodies + 1)
        self.r, self.v, self.w = (np.zeros(shape + (3,)) for _ in range(3))
        self.turn = np.tile(np.eye(3), shape + (1, 1))
        self.columns, self.drift = np.zeros((self.count, 6 * self.bodies, self.n)), np.zeros((self.count, 6 * self.bodies))
        still = (Jet(np.eye(3) + np.zeros((self.count, 1, 3, 3)), np.zeros((self.count, 1 + self.n, 3, 3)),
                     np.zeros((self.count, 1 + self.n, 3, 3))),
                 Jet(np.zeros((self.count, 1, 3)), np.zeros((self.count, 1 + self.n, 3)), np.zeros((self.count, 1 + self.n, 3))))
        self.poses = {-1: still}
        for joint in self.mechanism.joints:
            self.hang(joint)

    def hang(self, joint):
        up, origin = self.poses[joint.parent]
        section = getattr(joint, "station", None)
        axes, place = self.relative(joint) if section is None else self.station(joint.beam, section)
        beam = getattr(self.mechanism.bodies[joint.child], "beam", None)
        if beam is not None and beam.frame == "chord":  # its section at the origin is where the joint has it
            turned, _ = self.station(beam, 0.0)  # it turns and does not move
            if not planted("turn of the chord"):
                axes = matmul(axes, transposed(turned))
        turn, at = matmul(up, axes), origin + matvec(up, place)
        c = joint.child
        self.poses[c] = turn, at
        rates = turn.d @ np.swapaxes(turn.v, -1, -2)
        spin = np.stack([rates[..., 2, 1], rates[..., 0, 2], rates[..., 1, 0]], -1)
        self.turn[:, c], self.r[:, c] = turn.v[:, 0], at.v[:, 0]
        self.v[:, c], self.w[:, c] = at.d[:, 0], spin[:, 0]
        self.columns[:, 6 * c:6 * c + 3] = np.swapaxes(at.d[:, 1:], 1, 2)
        self.columns[:, 6 * c + 3:6 * c + 6] = np.swapaxes(spin[:, 1:], 1, 2)
        self.drift[:, 6 * c:6 * c + 3] = at.e[:, 0]
        self.drift[:, 6 * c + 3:6 * c + 6] = untilde((turn.e @ np.swapaxes(turn.v, -1, -2))[:, 0])

    def clouds(self):
        """Masses and places (t, directions, points, 3) of all particles."""
        for number, weight, place in self.mechanism.rigid:
            turn, at = self.poses[number]
            arms = product(lambda a, b: b @ np.swapaxes(a, -1, -2), turn, place)
            yield weight, arms, at
        for body, beam in self.mechanism.beams:
            turn, at = self.poses[body.number]
            turn = Jet(*(x @ beam.axes for x in (turn.v, turn.d, turn.e)))
            local = self.fields(beam, beam.first, beam.more) + beam.place
            yield beam.weight, product(lambda a, b: b @ np.swapaxes(a, -1, -2), turn, local), at

    # -- equations

    def equations(self):
        n, gravity = self.n, self.mechanism.gravity
        self.M, self.C = np.zeros((self.count, n, n)), np.zeros((self.count, n))
        self.kinetic_energy, self.potential = np.zeros(self.count), np.zeros(self.count)
        for weight, arms, at in self.clouds():
            rate, pull = arms.d + at.d[:, :, None], arms.e[:, 0] + at.e[:, 0, None]
            columns = rate[:, 1:].reshape(self.count, n, -1)
            heavy = (rate[:, 1:] * weight[:, None]).reshape(self.count, n, -1)
            self.M += heavy @ np.swapaxes(columns, -1, -2)
            self.C += np.einsum("tkx,tx->tk", heavy, (pull - gravity).reshape(self.count, -1))
            self.kinetic_energy += 0.5 * np.einsum("p,tpi,tpi->t", weight, rate[:, 0], rate[:, 0])
            self.potential -= np.einsum("p,tpi,i->t", weight, arms.v[:, 0] + at.v[:, 0, None], gravity)
        for _, beam in self.mechanism.beams:
            own = slice(beam.first_coordinate, beam.first_coordinate + beam.n)
            q, qd = self.q[:, own], self.qd[:, own]
            self.C[:, own] += q @ beam.stiffness + qd @ beam.damping
            self.potential += 0.5 * np.sum(q * (q @ beam.stiffness), -1)
        self.loads = Applied(self)
        self.C -= np.einsum("tbk,tb->tk", self.columns, self.loads.wrenches) + self.loads.efforts
        self.potential += self.loads.potential
        self.jdqd = self.closing + np.einsum("trb,tb->tr", self.by_bodies, self.drift)

    def accelerate(self, force=0.0):
        """qdd and the closures' share J' lambda of the efforts."""
        m = self.h.shape[1]
        right = force - self.C
        self.qdd, self.closure_efforts = np.zeros_like(self.q), np.zeros_like(self.q)
        for k in range(self.count):
            rows, bias = row_space(self.jacobian[k], self.jdqd[k]) if m else (np.zeros((0, self.n)), np.zeros(0))
            r = len(rows)
            whole = np.block([[self.M[k], -rows.T], [rows, np.zeros((r, r))]])
            found = np.linalg.solve(whole, np.concatenate([right[k], -bias]))
            self.qdd[k], self.closure_efforts[k] = found[:self.n], rows.T @ found[self.n:]
        return self


def row_space(jacobian, bias):
    """Orthonormal rows that span those of J, and what J qdd + jdqd = 0 says in them."""
    size = np.linalg.norm(jacobian, axis=1)
    size[size < 1e-12] = 1.0
    left, values, right = np.linalg.svd(jacobian / size[:, None], full_matrices=False)
    kept = values > RANK
    return right[kept], (left.T @ (bias / size))[kept] / values[kept]

