# SPDX-License-Identifier: BSD-3-Clause
"""Applied forces by docs/model/forces.md and springs.md: wrenches on bodies about their origins, efforts on coordinates,
potentials, and the values of the output force(NAME). All vectors are in ground axes unless a name says otherwise."""
import numpy as np

from convention import broken
from expression_values import uses
from jets import cross

MOVES = {"t", "q", "qd", "lambda", "distance", "rate", "position", "velocity", "angular_velocity", "axes", "angle"}


class Loads:
    def __init__(self, motion):
        self.motion = motion
        self.wrenches, self.efforts = np.zeros((motion.count, 6 * motion.bodies)), np.zeros((motion.count, motion.n))
        self.potential, self.outputs = np.zeros(motion.count), {}
        self.weigh()
        for item in motion.mechanism.forces:
            getattr(self, item.kind)(item, item.scope)

    def push(self, body, place, force):
        """A force at a place in ground coordinates."""
        if body >= 0:
            b = 6 * body
            self.wrenches[:, b:b + 3] += force
            self.wrenches[:, b + 3:b + 6] += cross(place - self.motion.r[:, body], force)

    def twist(self, body, moment):
        if body >= 0:
            self.wrenches[:, 6 * body + 3:6 * body + 6] += moment

    def weigh(self):
        gravity = self.motion.mechanism.gravity * (-1 if broken("sign of gravity") else 1)
        for body in self.motion.mechanism.bodies:
            place, _ = self.motion.point(body.number, body.com)
            self.push(body.number, place, body.mass * gravity)
            self.potential -= body.mass * place @ gravity

    def constant(self, item, texts):
        return not any(uses(text, MOVES | self.unknown_names(item.scope)) for text in texts)

    def unknown_names(self, scope):
        names = set()
        for owner, entry, keys in self.motion.mechanism.unknowns:
            if owner is scope:
                names |= set(keys["of"]) if isinstance(keys, dict) else {entry}
        return names | set(scope.document.get("states", {}))

    # -- forces between points

    def ends(self, item):
        return [(p, *self.motion.point(p.body, p.place)) for p in item.points]

    def spring(self, item, scope):
        (first, p, vp), (second, q, vq) = self.ends(item)
        keys = {key: scope.number(item.keys.get(key, "0")) for key in ("stiffness", "damping", "free_length")}
        gap = q - p
        length = np.linalg.norm(gap, axis=-1)
        along = gap / length[:, None]
        rate = np.sum(along * (vq - vp), -1)
        tension = keys["stiffness"] * (length - keys["free_length"]) + keys["damping"] * rate
        self.push(first.body, p, tension[:, None] * along)
        self.push(second.body, q, -tension[:, None] * along)
        if not broken("potential of springs"):
            self.potential += 0.5 * keys["stiffness"] * (length - keys["free_length"])**2
        self.outputs[item.name] = tension[:, None]

    def law(self, item, text, **local):
        """Values of an expression that knows some quantities by name."""
        env = self.motion.environment(item.scope)
        env.local = local
        return env.value(text) + 0 * self.motion.t

    def pull(self, item, tension_of):
        """A tension by the length of a way through points, and its rate."""
        ends, length, rate, parts = self.ends(item), 0, 0, []
        for (first, p, vp), (second, q, vq) in zip(ends, ends[1:]):
            part = np.linalg.norm(q - p, axis=-1)
            along = (q - p) / part[:, None]
            length, rate = length + part, rate + np.sum(along * (vq - vp), -1)
            parts.append((first.body, p, second.body, q, along))
        tension = tension_of(distance=length, rate=rate)
        for first, p, second, q, along in parts:
            self.push(first, p, tension[:, None] * along)
            self.push(second, q, -tension[:, None] * along)
        return tension, length

    def line(self, item, scope):
        tension, length = self.pull(item, lambda **local: self.law(item, item.keys["force"], **local))
        if self.constant(item, [item.keys["force"]]):
            self.potential += tension * length
        self.outputs[item.name] = tension[:, None]

    def cylinder(self, item, scope):
        bore, rod = scope.number(item.keys["bore"]), scope.number(item.keys.get("rod", "0"))
        whole, ring = 0.25 * np.pi * bore**2, 0.25 * np.pi * (bore**2 - (0 if broken("areas of cylinders") else rod**2))
        texts = [item.keys["pressure"], item.keys.get("rod_pressure", "0")]
        tension, length = self.pull(item, lambda **local: ring * self.law(item, texts[1], **local)
                                    - whole * self.law(item, texts[0], **local))
        if self.constant(item, texts):
            self.potential += tension * length
        self.outputs[item.name] = -tension[:, None]

    def torsion(self, item, scope):
        motion, (first, second) = self.motion, item.points
        k = "xyz".index(item.keys.get("axis", "z"))
        about, across = motion.seen(first)[:, :, k], "xyz"[(k + 1) % 3]
        names = item.keys["torsion"]
        angle = motion.angle(scope, [f"{names[0]}.{across}", f"{names[1]}.{across}", f"{names[0]}.{'xyz'[k]}"])
        torque = self.law(item, item.keys["torque"], angle=angle)
        self.twist(first.body, torque[:, None] * about)
        self.twist(second.body, -torque[:, None] * about)
        self.outputs[item.name] = torque[:, None]

    def bushing(self, item, scope):
        motion, (first, p, vp), (second, q, vq) = self.motion, *self.ends(item)
        k, c, kr, cr, preload = (scope.triple(item.keys.get(key, "0")) for key in (
            "stiffness", "damping", "rotational_stiffness", "rotational_damping", "preload"))
        axes = motion.turn[:, first.body] @ first.axes
        other = motion.turn[:, second.body] @ second.axes
        if broken("axes of bushings"):
            axes, other = other, axes
        seen = lambda x: np.einsum("tji,tj->ti", axes, x)
        out = lambda x: np.einsum("tij,tj->ti", axes, x)
        d = seen(q - p)
        rate = seen(vq - vp - (0 if broken("rate of bushings") else cross(motion.w[:, first.body], q - p)))
        force = -(preload + k * d + c * rate)
        scalar, vector = half_turn(np.swapaxes(axes, -1, -2) @ other)
        moment = -2 * (scalar * kr * vector + cross(vector, kr * vector))
        moment -= cr * seen(motion.w[:, second.body] - motion.w[:, first.body])
        for body, sign in ((second.body, 1), (first.body, -1)):
            self.push(body, p if body == first.body and broken("place of bushings") else q, sign * out(force))
            self.twist(body, sign * out(moment))
        self.potential += 0.5 * (d * d) @ k + d @ preload + 2 * (vector * vector) @ kr
        self.outputs[item.name] = np.concatenate([force, moment], -1)

    # -- forces at points and on bodies

    def vector(self, item, texts):
        env = self.motion.environment(item.scope)
        return np.stack([env.value(text) + 0 * self.motion.t for text in texts], -1)

    def at(self, item, scope):
        (point, place, _), = self.ends(item)
        force = self.vector(item, item.keys["force"])
        if broken("axes of forces at points"):
            force = np.einsum("tij,tj->ti", self.motion.turn[:, point.body], force)
        self.push(point.body, place, force)
        if self.constant(item, item.keys["force"]):
            self.potential -= np.sum(place * force, -1)

    def on(self, item, scope):
        self.twist(item.points[0].body, self.vector(item, item.keys["torque"]))

    # -- efforts on coordinates

    def effort(self, item, values, potential=0.0):
        self.efforts[:, self.coordinate(item)] += values
        self.potential = self.potential + potential
        self.outputs[item.name] = values[:, None]

    def coordinate(self, item):
        return self.motion.mechanism.places[item.scope.full(item.keys["joint"])]

    def state(self, item):
        number = self.coordinate(item)
        return self.motion.q[:, number], self.motion.qd[:, number]

    def joint_effort(self, item, scope):
        text = item.keys["torque"] if "torque" in item.keys else item.keys["force"]
        values = self.motion.environment(scope).value(text) + 0 * self.motion.t
        self.effort(item, values, -values * self.state(item)[0] if self.constant(item, [text]) else 0.0)

    def joint_spring(self, item, scope):
        keys, (q, qd) = item.keys["spring"], self.state(item)
        k, c, rest = (scope.number(keys.get(key, "0")) for key in ("stiffness", "damping", "rest"))
        self.effort(item, -k * (q - rest) - c * qd, 0.5 * k * (q - rest)**2)

    def joint_stops(self, item, scope):
        keys, (q, qd) = item.keys["stops"], self.state(item)
        k, w, c = (scope.number(keys.get(key, "0")) for key in ("stiffness", "width", "damping"))
        total, potential = 0.0, 0.0
        for key, sign in (("upper", 1.0), ("lower", -1.0)):
            if key in keys:
                x = sign * (q - scope.number(keys[key]))
                root = np.sqrt(x * x + w * w)
                p = 0.5 * (x + root)
                total = total - sign * (k * p * (1 if broken("force of stops") else p / root) + c * (p / root)**2 * sign * qd)
                potential = potential + 0.5 * k * p * p
        self.effort(item, total, potential)

    def joint_contact(self, item, scope):
        """A rigid stop, with the force that a run has."""
        self.effort(item, (1.0 if "lower" in item.keys else -1.0) * self.motion.friction[item.name])

    def joint_friction(self, item, scope):
        keys, (_, qd) = item.keys["friction"], self.state(item)
        if "speed" not in keys:  # it sticks: as a run has it
            self.effort(item, self.motion.friction[item.name])
            return
        level, speed = scope.number(keys.get("torque", keys.get("force"))), scope.number(keys["speed"])
        self.effort(item, (level if broken("sign of friction") else -level) * qd / np.sqrt(qd * qd + speed * speed))


def half_turn(turn):
    """cos(a/2) and sin(a/2) n of rotations by an angle a below half a turn about n."""
    trace = np.trace(turn, axis1=-2, axis2=-1)
    scalar = 0.5 * np.sqrt(np.maximum(1 + trace, 0.0))[..., None]
    skew = np.stack([turn[..., 2, 1] - turn[..., 1, 2], turn[..., 0, 2] - turn[..., 2, 0], turn[..., 1, 0] - turn[..., 0, 1]], -1)
    return scalar, skew / (4 * scalar)
