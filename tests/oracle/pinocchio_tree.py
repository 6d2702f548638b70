# SPDX-License-Identifier: BSD-3-Clause
"""Pinocchio's model of a robot in URDF beside Kempe's (docs/urdf.md): the coordinate map, M and C of the open tree, and the
loops and couplings of URDF+ and robot.yaml as closures with Pinocchio's frames."""
import re
import xml.etree.ElementTree as xml

import numpy as np
import pinocchio as pin


def clean(name):
    return re.sub(r"[^A-Za-z0-9_\u0080-\U0010ffff]", "_", name if not name[:1].isdigit() else "_" + name)


def vector(element, key, absent):
    text = element.get(key) if element is not None else None
    return np.array([float(x) for x in text.split()]) if text else np.array(absent, dtype=float)


def placement(element):
    origin = element.find("origin")
    return pin.SE3(pin.rpy.rpyToMatrix(vector(origin, "rpy", [0, 0, 0])), vector(origin, "xyz", [0, 0, 0]))


def turn(axis, angle):
    return pin.exp3(np.eye(3)[axis] * angle)


def substituted(model, kinds):
    """The tree with other joints: FIXED at zero, SPHERICAL as turns about x, y, z, UJOINT_XY as turns about x, y. The
    names of its joints are those of Kempe's coordinates."""
    turns = {"X": pin.JointModelRX, "Y": pin.JointModelRY, "Z": pin.JointModelRZ}
    other, last, names = pin.Model(), [0], [""]
    locked = []
    for k in range(1, model.njoints):
        kind, parent, place = kinds.get(model.names[k], ""), last[model.parents[k]], model.jointPlacements[k]
        axes = "XYZ" if kind == "SPHERICAL" else kind[-2:] if kind.startswith("UJOINT") else ""
        chain = [turns[axis]() for axis in axes] or [model.joints[k]]
        for i, joint in enumerate(chain):
            names.append(clean(model.names[k]) + (f".{i + 1}" if len(chain) > 1 else ""))
            parent = other.addJoint(parent, joint, place, names[-1])
            other.addJointFrame(parent)
            place = pin.SE3.Identity()
        if kind == "FIXED":
            locked.append(parent)
        other.appendBodyToJoint(parent, model.inertias[k], pin.SE3.Identity())
        last.append(parent)
    for frame in list(model.frames)[1:]:
        kind = pin.FrameType.OP_FRAME if frame.type == pin.FrameType.JOINT else frame.type
        other.addFrame(pin.Frame(frame.name, last[frame.parentJoint], frame.placement, kind), False)
    return pin.buildReducedModel(other, locked, pin.neutral(other)) if locked else other


class Tree:
    """Pinocchio's model of the file, with coordinates in Kempe's order: rates v = T(q) qd. A floating joint has there a
    quaternion and rates in its own axes, here x, y, z and rotations about x, y, z."""

    def __init__(self, path, coordinates, kinds):
        self.model = substituted(pin.buildModelFromUrdf(str(path)), kinds)
        self.data = self.model.createData()
        self.joints, known = [], list(coordinates)
        for k in range(1, self.model.njoints):
            joint, name = self.model.joints[k], self.model.names[k]
            own = [name] if joint.nv == 1 else [f"{name}.{i}" for i in range(1, joint.nv + 1)]
            if joint.nv not in (1, 6) or any(x not in known for x in own):
                raise ValueError(f"joint '{name}' has {joint.nv} coordinates")
            self.joints.append((joint, [known.index(x) for x in own]))
        if sum(len(own) for _, own in self.joints) != len(known):
            raise ValueError("other coordinates than Kempe's")
        losses = {clean(j.get("name")): j.find("dynamics") for j in xml.parse(path).getroot().findall("joint")}
        given = [losses.get(name) for name in coordinates]
        self.damping, self.friction = (np.array([0.0 if e is None else float(e.get(key, 0)) for e in given])
                                       for key in ("damping", "friction"))

    def state(self, q, qd):
        """q and v of Pinocchio, T, and dT/dt qd."""
        mine, T, drift = np.zeros(self.model.nq), np.zeros((self.model.nv, len(q))), np.zeros(self.model.nv)
        for joint, own in self.joints:
            value, rate, first = q[own], qd[own], joint.idx_v
            if joint.nv == 1:
                T[first, own[0]] = 1
                value = value if joint.nq == 1 else [np.cos(value[0]), np.sin(value[0])]
            else:
                x, y, z = (turn(k, value[3 + k]) for k in range(3))
                R, E = x @ y @ z, np.column_stack([(y @ z).T[:, 0], z.T[:, 1], [0, 0, 1]])
                spin, third = E @ rate[3:], E[:, 2] * rate[5]
                T[first:first + 3, own[:3]], T[first + 3:first + 6, own[3:]] = R.T, E
                drift[first:first + 3] = -np.cross(spin, R.T @ rate[:3])
                drift[first + 3:first + 6] = -np.cross(E[:, 1] * rate[4] + third, E[:, 0] * rate[3]) - np.cross(third, E[:, 1] * rate[4])
                value = [*value[:3], *pin.Quaternion(R).coeffs()]
            mine[joint.idx_q:joint.idx_q + joint.nq] = value
        return mine, T @ qd, T, drift

    def dynamics(self, q, qd):
        mine, v, T, drift = self.state(q, qd)
        pin.crba(self.model, self.data, mine)
        M = np.triu(self.data.M) + np.triu(self.data.M, 1).T
        C = T.T @ (pin.nonLinearEffects(self.model, self.data, mine, v) + M @ drift)
        return T.T @ M @ T, C + self.damping * qd + self.friction * np.sign(qd)


class Loops:
    """The loops and couplings of a file, and further pairs of frames: residual, Jacobian and jdqd at a state."""

    def __init__(self, path, tree, coordinates, pairs):
        self.tree, self.coordinates = tree, list(coordinates)
        root = xml.parse(path).getroot()
        self.joints = {j.find("child").get("link"): j for j in root.findall("joint")}
        self.loops, self.rows = [], []
        for loop in root.findall("loop"):
            sides = [self.frame(loop.find(side), f"{loop.get('name')} {side}") for side in ("predecessor", "successor")]
            axis = vector(loop.find("axis"), "xyz", [1, 0, 0])
            self.loops.append((loop.get("type"), sides, axis / np.linalg.norm(axis)))
        for first, second, kind in pairs:
            kind = {"3d": "ball", "6d": "fixed"}[kind.lower()]
            names = [frame.name for frame in tree.model.frames]
            self.loops.append((kind, [names.index(first), names.index(second)], np.array([1.0, 0, 0])))
        for coupling in root.findall("coupling"):
            row = np.zeros(len(self.coordinates))
            ends = [self.ancestors(coupling.find(side).get("link")) for side in ("predecessor", "successor")]
            for side, factor in ((0, float(coupling.find("ratio").get("value"))), (1, -1.0)):
                for joint in set(ends[side]) - set(ends[1 - side]):
                    if clean(joint) in self.coordinates:
                        row[self.coordinates.index(clean(joint))] = factor
            self.rows.append((row, 0.0))
        for joint in root.findall("joint"):
            mimic = joint.find("mimic")
            if mimic is not None:
                row = np.zeros(len(self.coordinates))
                row[self.coordinates.index(clean(joint.get("name")))] = 1
                row[self.coordinates.index(clean(mimic.get("joint")))] -= float(mimic.get("multiplier", 1))
                self.rows.append((row, float(mimic.get("offset", 0))))
        tree.data = tree.model.createData()

    @property
    def count(self):
        return len(self.loops) + len(self.rows)

    def is_turned(self, q):
        return False

    def ancestors(self, link):
        names = []
        while link in self.joints:
            names.append(self.joints[link].get("name"))
            link = self.joints[link].find("parent").get("link")
        return names

    def frame(self, side, name):
        model = self.tree.model
        body = model.frames[model.getFrameId(side.get("link"), pin.FrameType.BODY)]
        frame = pin.Frame(name, body.parentJoint, model.getFrameId(side.get("link"), pin.FrameType.BODY),
                          body.placement * placement(side), pin.FrameType.OP_FRAME)
        return model.addFrame(frame)

    def values(self, q, qd):
        tree, n = self.tree, len(self.coordinates)
        mine, v, T, own = tree.state(q, qd)
        pin.computeJointJacobians(tree.model, tree.data, mine)
        pin.forwardKinematics(tree.model, tree.data, mine, v, own)
        pin.updateFramePlacements(tree.model, tree.data)
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        h, J, drift = [], [], []
        for kind, sides, axis in self.loops:
            place = [tree.data.oMf[s] for s in sides]
            jacobian = [pin.getFrameJacobian(tree.model, tree.data, s, world) @ T for s in sides]
            rate = [pin.getFrameVelocity(tree.model, tree.data, s, world) for s in sides]
            spin = [pin.getFrameAcceleration(tree.model, tree.data, s, world).angular for s in sides]
            shift = [pin.getFrameClassicalAcceleration(tree.model, tree.data, s, world).linear for s in sides]
            if kind not in ("revolute", "continuous", "fixed", "ball"):
                raise ValueError(f"a loop of type {kind}")
            h.extend(place[1].translation - place[0].translation)
            J.extend(jacobian[1][:3] - jacobian[0][:3])
            drift.extend(shift[1] - shift[0])
            across = {"ball": np.zeros((0, 3)), "fixed": np.eye(3)}.get(kind, np.linalg.svd(axis.reshape(1, 3))[2][1:])
            relative = place[0].rotation.T @ place[1].rotation
            off = pin.log3(relative) if kind == "fixed" else np.cross(axis, relative @ axis)
            for direction in across:
                e = place[0].rotation @ direction
                h.append(direction @ off)
                J.append(e @ (jacobian[1][3:] - jacobian[0][3:]))
                drift.append(e @ (spin[1] - spin[0]) + np.cross(rate[0].angular, e) @ (rate[1].angular - rate[0].angular))
        for row, equals in self.rows:
            h.append(row @ q - equals)
            J.append(row)
            drift.append(0.0)
        return np.array(h), np.array(J).reshape(-1, n), np.array(drift)


def loops_beside(path):
    """The URDF file of robot.yaml, its other kinds of joints, its pairs of frames."""
    if path.suffix != ".yaml":
        return path, {}, []
    import yaml
    given = yaml.safe_load(path.read_text())
    kinds = dict(zip(given.get("joint_name", []), given.get("joint_type", [])))
    robot = path.with_suffix(".urdf")
    robot = robot if robot.exists() else next(path.parent.glob("*.urdf"))
    return robot, kinds, [(*pair, kind) for pair, kind in zip(given["closed_loop"], given["type"])]
