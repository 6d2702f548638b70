# SPDX-License-Identifier: BSD-3-Clause
"""MuJoCo's model of a file in MJCF beside Kempe's (docs/mjcf.md): the coordinate map, M and C of the open tree, and its
equalities as closures. Textures are left out, and meshes whose files are absent are replaced by a small one."""
import pathlib
import re
import xml.etree.ElementTree as xml

import mujoco
import numpy as np

CONNECT, WELD, JOINT = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD), int(mujoco.mjtEq.mjEQ_JOINT)
SITE, FREE, BALL = int(mujoco.mjtObj.mjOBJ_SITE), int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)
MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def clean(name):
    name = re.sub(r"[^A-Za-z0-9\u0080-\U0010ffff]", "_", name)
    return "_" + name if name[:1].isdigit() or name in ("", "ground") else name


def included(element, folder):
    """The element with those of included files in place of `include`."""
    for child in list(element):
        if child.tag == "include":
            at = list(element).index(child)
            element.remove(child)
            for k, e in enumerate(xml.parse(folder / child.get("file")).getroot()):
                element.insert(at + k, e)
            return included(element, folder)
    for child in element:
        included(child, folder)
    return element


def load(path):
    root = included(xml.parse(path).getroot(), pathlib.Path(path).parent)
    for tag in ("visual", "keyframe", "sensor", "contact"):
        for e in root.findall(tag):
            root.remove(e)
    folder = pathlib.Path(path).parent
    for compiler in root.findall("compiler"):
        given = {key: compiler.attrib.pop(key, None) for key in ("meshdir", "assetdir", "texturedir")}
        folder /= given["meshdir"] or given["assetdir"] or ""
    assets = {}
    for asset in root.findall("asset"):
        for e in list(asset):
            if e.tag in ("texture", "skin", "hfield"):
                asset.remove(e)
            if e.tag == "material":
                e.attrib.pop("texture", None)
                for layer in list(e):
                    e.remove(layer)
            if e.tag == "mesh" and e.get("file"):
                e.set("name", e.get("name", pathlib.Path(e.get("file")).stem))
                file = folder / e.get("file")
                there = file.exists()
                e.set("file", f"{len(assets)}{file.suffix.lower() if there else '.obj'}")
                assets[e.get("file")] = file.read_bytes() if there else MESH
    model = mujoco.MjModel.from_xml_string(xml.tostring(root, encoding="unicode"), assets)
    return root, model


def turn(axis, angle):
    u, s = np.eye(3)[axis], np.sin(angle)
    cross = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + s * cross + (1 - np.cos(angle)) * cross @ cross


def quaternion(R):
    q = np.zeros(4)
    mujoco.mju_mat2Quat(q, R.ravel())
    return q


def matrix(q):
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, np.array(q, dtype=float))
    return R.reshape(3, 3)


class Tree:
    """Rates v = T(q) qd. A ball joint has three angles about x, y, z in place of a quaternion; a free joint also
    displacements, in the axes that its body has in the file."""

    def __init__(self, path, coordinates):
        self.root, self.model = load(path)
        m, known = self.model, list(coordinates)
        self.data = mujoco.MjData(m)
        m.opt.density = m.opt.viscosity = 0
        m.body_gravcomp[:] = 0
        m.tendon_stiffness[:] = m.tendon_damping[:] = 0
        taken = {clean(m.joint(k).name) for k in range(m.njnt) if m.joint(k).name}
        self.joints, self.own = [], []
        for k in range(m.njnt):
            body = m.jnt_bodyid[k]
            name = clean(m.joint(k).name) if m.joint(k).name else None
            if name is None:
                base = clean(m.body(body).name) if m.body(body).name else f"body_{body}"
                name = base if m.body_jntnum[body] == 1 else f"{base}_joint{k - m.body_jntadr[body] + 1}"
                while name in taken:
                    name += "_"
                taken.add(name)
            size = {FREE: 6, BALL: 3}.get(int(m.jnt_type[k]), 1)
            own = [name] if size == 1 else [f"{name}.{i}" for i in range(1, size + 1)]
            if any(x not in known for x in own):
                raise ValueError(f"joint '{name}' is not Kempe's")
            self.joints.append((k, size, [known.index(x) for x in own]))
            if size > 1: # values that Kempe lists as not used
                dofs = slice(m.jnt_dofadr[k], m.jnt_dofadr[k] + size)
                m.jnt_stiffness[k] = m.dof_armature[dofs] = m.dof_frictionloss[dofs] = 0
        if sum(len(own) for _, _, own in self.joints) != len(known):
            raise ValueError("other coordinates than Kempe's")

    def state(self, q, qd):
        """qpos and qvel of MuJoCo, T, and dT/dt qd."""
        m, n = self.model, len(q)
        qpos, T, drift = m.qpos0.copy(), np.zeros((m.nv, n)), np.zeros(m.nv)
        for k, size, own in self.joints:
            at, first, value, rate = m.jnt_qposadr[k], m.jnt_dofadr[k], q[own], qd[own]
            if size == 1:
                qpos[at], T[first, own[0]] = value[0], 1
                continue
            x, y, z = (turn(i, value[size - 3 + i]) for i in range(3))
            E = np.column_stack([(y @ z).T[:, 0], z.T[:, 1], [0, 0, 1]])
            third = E[:, 2] * rate[-1]
            R = matrix(m.qpos0[at + size - 3:at + size + 1])
            turns = first + size - 3
            T[turns:turns + 3, own[-3:]] = E
            drift[turns:turns + 3] = -np.cross(E[:, 1] * rate[-2] + third, E[:, 0] * rate[-3]) - np.cross(third, E[:, 1] * rate[-2])
            qpos[at + size - 3:at + size + 1] = quaternion(R @ x @ y @ z)
            if size == 6:
                qpos[at:at + 3] += R @ value[:3]
                T[first:first + 3, own[:3]] = R
        return qpos, T @ qd, T, drift

    def read(self):
        """Kempe's coordinates of the position in the file."""
        q = np.zeros(sum(size for _, size, _ in self.joints))
        for k, size, own in self.joints:
            if size == 1:
                q[own[0]] = self.model.qpos0[self.model.jnt_qposadr[k]]
        return q

    def place(self, q, qd):
        qpos, v, T, drift = self.state(q, qd)
        self.data.qpos[:], self.data.qvel[:] = qpos, v
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        return v, T, drift

    def dynamics(self, q, qd):
        v, T, drift = self.place(q, qd)
        M = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, M)
        loss = self.model.dof_frictionloss * np.sign(v)
        C = self.data.qfrc_bias - self.data.qfrc_passive + loss + M @ drift
        return T.T @ M @ T, T.T @ C


class Loops:
    """The equalities of a file: residual, Jacobian and jdqd at a state."""

    def __init__(self, path, tree, coordinates):
        self.tree, m = tree, tree.model
        self.rows = [k for k in range(m.neq) if m.eq_active0[k]]

    @property
    def count(self):
        return len(self.rows)

    def side(self, body, point, v, T, drift):
        m, d = self.tree.model, self.tree.data
        j, r, jd, rd = (np.zeros((3, m.nv)) for _ in range(4))
        mujoco.mj_jac(m, d, j, r, point, body)
        mujoco.mj_jacDot(m, d, jd, rd, point, body)
        return j @ T, r @ T, jd @ v + j @ drift, rd @ v + r @ drift, r @ v

    def frames(self, k):
        """Bodies, points and axes that an equality makes one."""
        m, d = self.tree.model, self.tree.data
        data = m.eq_data[k]
        weld = m.eq_type[k] == WELD
        first, second = m.eq_obj1id[k], m.eq_obj2id[k]
        if m.eq_objtype[k] == SITE:
            bodies = [m.site_bodyid[first], m.site_bodyid[second]]
            points = [d.site_xpos[first], d.site_xpos[second]]
            axes = [d.site_xmat[first].reshape(3, 3), d.site_xmat[second].reshape(3, 3)]
        else:
            bodies, R = [first, second], [d.xmat[first].reshape(3, 3), d.xmat[second].reshape(3, 3)]
            local = [data[3:6], data[:3]] if weld else [data[:3], data[3:6]]
            points = [d.xpos[b] + r @ p for b, r, p in zip(bodies, R, local)]
            axes = [R[0] @ matrix(data[6:10]) if weld else R[0], R[1]]
        return bodies, points, axes

    def is_turned(self, q):
        """True if a weld is closed half a turn off, where it has fewer rows."""
        self.tree.place(q, np.zeros(len(q)))
        welds = [self.frames(k)[2] for k in self.rows if self.tree.model.eq_type[k] == WELD]
        return any(np.trace(a.T @ b) < 0 for a, b in welds)

    def pair(self, k, v, T, drift):
        weld = self.tree.model.eq_type[k] == WELD
        bodies, points, axes = self.frames(k)
        sides = [self.side(b, np.array(p), v, T, drift) for b, p in zip(bodies, points)]
        h, J, bias = [points[1] - points[0]], [sides[1][0] - sides[0][0]], [sides[1][2] - sides[0][2]]
        if weld: # rows along the axes of the first frame
            relative = axes[0].T @ axes[1]
            off = np.array([relative[2, 1] - relative[1, 2], relative[0, 2] - relative[2, 0], relative[1, 0] - relative[0, 1]]) / 2
            h.append(off)
            J.append(axes[0].T @ (sides[1][1] - sides[0][1]))
            spin = sides[1][4] - sides[0][4]
            bias.append(axes[0].T @ (sides[1][3] - sides[0][3] - np.cross(sides[0][4], spin)))
        return np.concatenate(h), np.vstack(J), np.concatenate(bias)

    def form(self, kind, k, n):
        """Value beyond the reference and row of a joint or fixed tendon."""
        m, d = self.tree.model, self.tree.data
        row = np.zeros(m.nv)
        if kind == JOINT:
            row[m.jnt_dofadr[k]] = 1
            at = m.jnt_qposadr[k]
            return d.qpos[at] - m.qpos0[at], row
        value = 0.0
        for w in range(m.tendon_adr[k], m.tendon_adr[k] + m.tendon_num[k]):
            joint, coefficient = m.wrap_objid[w], m.wrap_prm[w]
            at = m.jnt_qposadr[joint]
            row[m.jnt_dofadr[joint]] += coefficient
            value += coefficient * (d.qpos[at] - m.qpos0[at])
        return value, row

    def relation(self, k, v, T, drift):
        m = self.tree.model
        a = m.eq_data[k][:5]
        y, row = self.form(m.eq_type[k], m.eq_obj1id[k], len(v))
        if m.eq_obj2id[k] < 0:
            return np.array([y - a[0]]), (row @ T)[None], np.array([row @ drift])
        x, other = self.form(m.eq_type[k], m.eq_obj2id[k], len(v))
        slope = sum(i * a[i] * x ** (i - 1) for i in range(1, 5))
        bend = sum(i * (i - 1) * a[i] * x ** (i - 2) for i in range(2, 5))
        total = row - slope * other
        return (np.array([y - sum(a[i] * x ** i for i in range(5))]), (total @ T)[None],
                np.array([total @ drift - bend * (other @ v) ** 2]))

    def largest(self):
        """The largest residual at MuJoCo's present positions: distances of anchors, values of relations."""
        v, T = np.zeros(self.tree.model.nv), np.eye(self.tree.model.nv)
        worst = 0.0
        for k in self.rows:
            pair = self.tree.model.eq_type[k] in (CONNECT, WELD)
            h = (self.pair if pair else self.relation)(k, v, T, v)[0]
            worst = max(worst, np.linalg.norm(h[:3]))
        return worst

    def values(self, q, qd):
        v, T, drift = self.tree.place(q, qd)
        rows = [(self.pair if self.tree.model.eq_type[k] in (CONNECT, WELD) else self.relation)(k, v, T, drift) for k in self.rows]
        return tuple(np.concatenate([np.atleast_1d(r[i]) for r in rows]) for i in range(3))
