# SPDX-License-Identifier: BSD-3-Clause
"""Models in SDFormat beside Drake, which reads the same files and refuses loops (docs/sdf.md):

    tests/oracle/drake_models.py FILE.sdf ..       with Kempe's package and Drake (pip install drake) on PYTHONPATH

At 100 random states the mass matrix and the bias of the tree are compared, relative to their largest entry, with coordinates
matched by the names of joints. The joints that Kempe cuts become frames of their links in a copy of the file, and their
constraints are written again here with Drake's frames: the rank of their Jacobian, the residual at Kempe's closed states, and
accelerations by a saddle system of Drake's M, C and J at 20 of them. One line a model. Exit code 1: a difference beyond 1e-12
of M and C, 1e-9 of accelerations and of residuals, or another rank; 77: no Drake."""
import logging
import pathlib
import re
import sys
import tempfile
import warnings
import xml.etree.ElementTree as xml

try:
    import numpy as np
    import pydrake.all as drake
except ImportError:
    print("skipped: Drake is needed (pip install drake)")
    sys.exit(77)
import kempe

logging.getLogger("drake").setLevel(logging.ERROR)
xml.register_namespace("drake", "http://drake.mit.edu")
V = drake.JacobianWrtVariable.kV
STATES, CLOSED = 100, 20
BOUNDS = {"M": 1e-12, "C": 1e-12, "residual": 1e-9, "accelerations": 1e-9}


def clean(name):
    return re.sub(r"[^A-Za-z0-9_\u0080-\U0010ffff]", "_", name if not name[:1].isdigit() else "_" + name)


def text(element, path, absent=""):
    found = element.find(path) if element is not None else None
    return (found.text or "").strip() if found is not None else absent


def turn(axis, angle):
    c, s, k = np.cos(angle), np.sin(angle), axis
    a, b = (k + 1) % 3, (k + 2) % 3
    R = np.eye(3)
    R[a, a] = R[b, b] = c
    R[a, b], R[b, a] = -s, s
    return R


class File:
    """The elements of a file by their names in Kempe, and the file without the joints that are cut."""

    def __init__(self, path, cuts):
        try:
            self.root = xml.parse(path).getroot()
        except xml.ParseError as e:
            raise ValueError(str(e)) from None
        world = self.root.find("world")
        top = self.root if world is None else world
        models = top.findall("model")
        if top.findall("include") or any(m.find("include") is not None for m in models):
            raise ValueError("a file that includes others")
        self.joints, self.links, self.cuts = {}, {}, {}
        for model in models:
            self.walk(model, "" if len(models) == 1 else clean(model.get("name")) + "__")
        self.old = int(self.root.get("version").split(".")[1]) < 7
        for name in cuts:
            if name not in self.joints:
                raise ValueError(f"a closure '{name}' that is no joint of the file")
            self.cuts[name] = self.frames_of(*self.joints[name])

    def walk(self, model, prefix):
        for joint in model.findall("joint"):
            self.joints[prefix + clean(joint.get("name"))] = model, joint
        for link in model.findall("link"):
            self.links[prefix + clean(link.get("name"))] = link
        for inner in model.findall("model"):
            self.walk(inner, prefix + clean(inner.get("name")) + "__")

    def frames_of(self, model, joint):
        """Frames at the joint on its child and on its parent, and one that gives its axes."""
        name, child, parent, pose = f"cut of {joint.get('name')}", text(joint, "child"), text(joint, "parent"), joint.find("pose")
        model.remove(joint)
        near = xml.SubElement(model, "frame", {"name": name, "attached_to": child})
        place = xml.SubElement(near, "pose", dict(pose.attrib) if pose is not None else {})
        place.text = pose.text if pose is not None else "0 0 0 0 0 0"
        key = "frame" if self.old else "relative_to"
        place.set("relative_to", place.attrib.pop(key, None) or child)
        far = xml.SubElement(model, "frame", {"name": name + " far", "attached_to": parent})
        xml.SubElement(far, "pose", {"relative_to": name}).text = "0 0 0 0 0 0"
        axes = []
        for word in ("axis", "axis2"):
            xyz = joint.find(f"{word}/xyz")
            own = self.old and text(joint, f"{word}/use_parent_model_frame") in ("1", "true")
            said = "__model__" if own else xyz.get("expressed_in") if xyz is not None else None
            if said:
                axis = xml.SubElement(model, "frame", {"name": f"{name} {word}", "attached_to": child})
                xml.SubElement(axis, "pose", {"relative_to": said}).text = "0 0 0 0 0 0"
            axes.append((np.array([float(x) for x in (xyz.text or "0 0 1").split()]) if xyz is not None else None,
                         f"{name} {word}" if said else name))
        return joint.get("type"), name, axes

    def written(self):
        if self.cuts and self.old:
            self.root.set("version", "1.7")
            for pose in self.root.iter("pose"):
                if "frame" in pose.attrib:
                    pose.set("relative_to", pose.attrib.pop("frame"))
            for axis in (a for word in ("axis", "axis2") for a in self.root.iter(word)):
                if text(axis, "use_parent_model_frame") in ("1", "true") and axis.find("xyz") is not None:
                    axis.find("xyz").set("expressed_in", "__model__")
        return xml.tostring(self.root, encoding="unicode")


class Tree:
    """Drake's model, with coordinates in Kempe's order: q = S z, and rates v = T(q) qd. A screw has one coordinate there; a free
    link has a quaternion and rates in the axes of the world, here x, y, z and rotations about x, y, z from its pose in the file."""

    def __init__(self, path, model, system):
        shown, self.coordinates = model.to_dict(), list(system.coordinates)
        self.cuts = [cut["joint"] for cut in shown["cuts"]]
        self.file = File(path, self.cuts)
        self.plant = plant = drake.MultibodyPlant(0.0)
        plant.mutable_gravity_field().set_gravity_vector(shown["gravity"])
        parser = drake.Parser(plant)
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(folder, "copy.sdf")
            copy.write_text(self.file.written())
            try:
                parser.AddModels(str(copy))
                plant.Finalize()
            except RuntimeError as e:
                raise ValueError(str(e).splitlines()[0][:150]) from None
        self.context = plant.CreateDefaultContext()
        self.gravity = np.array(shown["gravity"])
        known, self.joints, used = {}, [], []
        for k, name in enumerate(self.coordinates):
            known.setdefault(name.split(".")[0], []).append(k)
        for index in plant.GetJointIndices():
            joint = plant.get_joint(index)
            if joint.num_velocities() == 0:
                continue
            scope = plant.GetModelInstanceName(joint.model_instance())
            names = [clean(n) for n in (f"{scope}::{joint.name()}", f"{scope.partition('::')[2]}::{joint.name()}", joint.name())]
            own = next((n for n in names if n in known), None)
            if own is None:
                raise ValueError(f"joint '{joint.name()}' has no coordinate in Kempe")
            self.joints.append((joint, known[own], own))
            used += known[own]
        if sorted(used) != list(range(len(self.coordinates))):
            raise ValueError("other coordinates than Kempe's")
        self.S = np.eye(len(self.coordinates))
        for joint, own, name in self.joints:
            if joint.type_name() == "screw":
                self.S[own[0], own[1]] = joint.screw_pitch() / (2 * np.pi)
                self.S[own[0], own[0]] = 0
        self.S = self.S[:, np.abs(self.S).sum(axis=0) > 0]

    def state(self, q, qd):
        """Sets the state of Drake's model; v, T and dT/dt qd."""
        plant, n = self.plant, len(q)
        mine, T, drift = np.zeros(plant.num_positions()), np.zeros((plant.num_velocities(), n)), np.zeros(plant.num_velocities())
        for joint, own, _ in self.joints:
            value, rate, kind = q[own], qd[own], joint.type_name()
            first, rows = joint.position_start(), joint.velocity_start() + np.arange(joint.num_velocities())
            if kind in ("revolute", "prismatic", "universal", "planar"):
                mine[first:first + len(own)] = value
                T[rows, own] = 1
            elif kind == "screw":
                mine[first] = value[1]
                T[rows[0], own[1]] = 1
            elif kind in ("ball_rpy", "quaternion_floating"):
                x, y, z = (turn(k, a) for k, a in enumerate(value[-3:]))
                E = np.column_stack([np.eye(3)[0], x[:, 1], (x @ y)[:, 2]])
                r = rate[-3:]
                change = np.cross(E[:, 0] * r[0], E[:, 1] * r[1]) + np.cross(E[:, 0] * r[0] + E[:, 1] * r[1], E[:, 2] * r[2])
                if kind == "ball_rpy":
                    mine[first:first + 3] = drake.RollPitchYaw(drake.RotationMatrix(x @ y @ z)).vector()
                    T[np.ix_(rows, own)], drift[rows] = E, change
                else:
                    start = plant.GetDefaultFloatingBaseBodyPose(joint.child_body())
                    R = start.rotation().matrix()
                    turned = drake.RotationMatrix(R @ x @ y @ z).ToQuaternion()
                    mine[first:first + 7] = [*turned.wxyz(), *(start.translation() + R @ value[:3])]
                    T[np.ix_(rows[:3], own[3:])], drift[rows[:3]] = R @ E, R @ change
                    T[np.ix_(rows[3:], own[:3])] = R
            else:
                raise ValueError(f"a joint of type {kind}")
        plant.SetPositions(self.context, mine)
        plant.SetVelocities(self.context, T @ qd)
        return T @ qd, T, drift

    def point(self, frame, at):
        """Jacobian and bias of the spatial velocity of a point of a frame."""
        world = self.plant.world_frame()
        bias = self.plant.CalcBiasSpatialAcceleration(self.context, V, frame, at, world, world)
        return (self.plant.CalcJacobianSpatialVelocity(self.context, V, frame, at, world, world),
                np.concatenate([bias.rotational(), bias.translational()]))

    def dynamics(self, q, qd):
        plant, (v, T, drift) = self.plant, self.state(q, qd)
        M = plant.CalcMassMatrix(self.context)
        forces = drake.MultibodyForces(plant)
        plant.CalcForceElementsContribution(self.context, forces)
        C = plant.CalcInverseDynamics(self.context, drift, forces)
        C = T.T @ C
        for joint, own, name in self.joints:
            source = self.file.joints.get(name, (None, None))[1]
            friction = text(source, "axis/dynamics/friction") if source is not None else ""
            if friction and len(own) == 1:
                C[own[0]] += float(friction) * np.sign(qd[own[0]])
        for name, link in self.file.links.items():
            if text(link, "gravity") in ("0", "false"):
                found = [plant.get_body(drake.BodyIndex(k)) for k in range(plant.num_bodies())
                         if clean(plant.get_body(drake.BodyIndex(k)).name()) == name.split("__")[-1]]
                jacobian, _ = self.point(found[0].body_frame(), found[0].default_com())
                C += T.T @ jacobian[3:].T @ (found[0].default_mass() * self.gravity)
        return T.T @ M @ T, C

    def reduced(self, M, C):
        return self.S.T @ M @ self.S, self.S.T @ C


class Loops:
    """The constraints of the joints that are cut: residual, Jacobian and jdqd at a state."""

    def __init__(self, tree):
        self.tree, self.loops, self.rows = tree, [], []
        plant, zero = tree.plant, tree.plant.CreateDefaultContext()
        for kind, name, axes in tree.file.cuts.values():
            far, near = plant.GetFrameByName(name + " far"), plant.GetFrameByName(name)
            turned = [plant.CalcRelativeRotationMatrix(zero, near, plant.GetFrameByName(at)).matrix() @ a
                      if a is not None else None for a, at in axes]
            self.loops.append((kind, far, near, [a / np.linalg.norm(a) if a is not None else None for a in turned]))
        for joint in tree.file.joints.values():
            if joint[1].find("axis/mimic") is not None or joint[1].get("type") in ("gearbox", "screw"):
                raise ValueError("couplers beside loops")

    def values(self, q, qd):
        tree, plant = self.tree, self.tree.plant
        v, T, own = tree.state(q, qd)
        h, J, drift = [], [], []

        def add(residual, row, rate):
            h.append(residual)
            J.append(row @ T)
            drift.append(row @ own + rate)

        for kind, far, near, axes in self.loops:
            (ja, ba), (jb, bb) = tree.point(far, np.zeros(3)), tree.point(near, np.zeros(3))
            A, B = (plant.CalcRelativeTransform(tree.context, plant.world_frame(), f) for f in (far, near))
            d, wa, wb = B.translation() - A.translation(), ja[:3] @ v, jb[:3] @ v
            dv = (jb[3:] - ja[3:]) @ v
            Ra, Rb = A.rotation().matrix(), B.rotation().matrix()
            across = np.linalg.svd(axes[0].reshape(1, 3))[2][1:] if axes[0] is not None else np.eye(3)
            if kind in ("revolute", "continuous", "ball", "universal", "fixed"):
                for e in np.eye(3):
                    add(e @ d, e @ (jb[3:] - ja[3:]), e @ (bb[3:] - ba[3:]))
            elif kind == "prismatic":
                for e in (Ra @ x for x in across):
                    add(e @ d, e @ (jb[3:] - ja[3:]) + np.cross(e, d) @ ja[:3],
                        e @ (bb[3:] - ba[3:]) + 2 * np.cross(wa, e) @ dv + np.cross(ba[:3], e) @ d + np.cross(wa, np.cross(wa, e)) @ d)
            else:
                raise ValueError(f"a loop of type {kind}")
            if kind == "universal":
                a, b = Ra @ axes[0], Rb @ axes[1]
                c, dc = np.cross(a, b), np.cross(np.cross(wa, a), b) + np.cross(a, np.cross(wb, b))
                add(a @ b, c @ (ja[:3] - jb[:3]), c @ (ba[:3] - bb[:3]) + dc @ (wa - wb))
            elif kind != "ball":
                hinge = kind in ("revolute", "continuous")
                between = Ra.T @ Rb
                off = np.array([between[2, 1] - between[1, 2], between[0, 2] - between[2, 0], between[1, 0] - between[0, 1]]) / 2
                off = np.cross(axes[0], between @ axes[0]) if hinge else off
                for x in across if hinge else np.eye(3):
                    e = Ra @ x
                    add(x @ off, e @ (jb[:3] - ja[:3]), e @ (bb[:3] - ba[:3]) + np.cross(wa, e) @ (wb - wa))
        return np.array(h), np.array(J).reshape(-1, len(q)), np.array(drift)


def relative(a, b, size=1e-300):
    """Largest difference over the largest of b; `size`: that of numbers like b where rates and positions are about 1."""
    return np.abs(a - b).max() / max(np.abs(b).max(), size) if len(b) else 0.0


def rank_of(J):
    s = np.linalg.svd(J, compute_uv=False) if J.size else np.zeros(0)
    return int((s > 1e-9 * s[0]).sum()) if len(s) else 0


def judge(path, random):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = kempe.Model(str(path))
        system = model.system()
        work = system.workspace()
    tree, n = Tree(path, model, system), len(system.coordinates)
    found = {"n": n, "M": 0.0, "C": 0.0, "loops": len(tree.cuts), "rows": len(system.rows)}
    for _ in range(STATES):
        q, qd = random.uniform(-3, 3, n), random.uniform(-3, 3, n)
        made = work.evaluate(0.0, q, qd)
        M, C = tree.reduced(*tree.dynamics(q, qd))
        mine = tree.reduced(made.M, made.C)
        found["M"] = max(found["M"], relative(mine[0], M))
        found["C"] = max(found["C"], relative(mine[1], C, np.abs(M).max()))
    if not tree.cuts:
        return found
    loops = Loops(tree)
    found.update({"residual": 0.0, "accelerations": 0.0, "rank": [], "closed": 0})
    for _ in range(20 * CLOSED):
        try:
            q, qd = work.close(0.0, random.uniform(-1, 1, n), random.uniform(-1, 1, n))
        except kempe.Error:
            continue
        h, J, drift = loops.values(q, qd)
        mine = work.evaluate(0.0, q, qd)
        found["residual"] = max(found["residual"], np.abs(h).max(), np.abs(J @ qd).max())
        found["rank"].append((rank_of(mine.J), rank_of(J)))
        M, C = tree.dynamics(q, qd)
        saddle = np.block([[M, J.T], [J, np.zeros((len(J), len(J)))]])
        expected = np.linalg.lstsq(saddle, -np.concatenate([C, drift]), rcond=1e-11)[0][:n]
        found["accelerations"] = max(found["accelerations"], relative(work.forward_dynamics(0.0, q, qd).qdd, expected, 1.0))
        found["closed"] += 1
        if found["closed"] == CLOSED:
            break
    return found


def verdict(found):
    wrong = [name for name, bound in BOUNDS.items() if not found.get(name, 0.0) <= bound]
    if any(a != b for a, b in found.get("rank", [])):
        wrong.append("rank")
    if found["loops"] and not found["closed"]:
        wrong.append("no closed state")
    return ", ".join(wrong) or "agrees"


def main():
    failed = 0
    print("| model | coordinates | M | C | loops, rows, rank | closed states | residual | accelerations | verdict |\n|" + "---|" * 9)
    for path in map(pathlib.Path, sys.argv[1:]):
        try:
            found = judge(path, np.random.default_rng(1))
        except ValueError as e:
            print(f"| {path.stem} | - | - | - | - | - | - | - | not compared: {str(e).splitlines()[0]} |", flush=True)
            continue
        word = verdict(found)
        failed += word != "agrees"
        ranks = sorted({a for a, _ in found.get("rank", [])})
        closed = [f"{found['loops']}, {found['rows']}, {' '.join(map(str, ranks))}", str(found["closed"]),
                  f"{found['residual']:.0e}", f"{found['accelerations']:.0e}"] if found["loops"] else ["-"] * 4
        print(f"| {path.stem} | {found['n']} | {found['M']:.0e} | {found['C']:.0e} |", " | ".join(closed), f"| {word} |", flush=True)
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
