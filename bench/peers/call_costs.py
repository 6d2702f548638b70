# SPDX-License-Identifier: BSD-3-Clause
"""Cost of a call from Python, of Kempe and its peers on the same mechanism, in one process: call_costs.py MODEL.yaml TREE.json
SECONDS (bench/peers/run writes both files). Prints JSON: for each quantity and peer the time of a call in us, by rounds in which
all take turns, and the largest deviation of its results from Kempe's, relative to the largest value of the state.

- M, bias: mass matrix and bias at one state. Kempe's evaluate has h, J and jdqd as well.
- qdd: accelerations at one state, of closed loops with their multipliers.
- qdd, rows: accelerations at many states by one call, on one thread, per state. MuJoCo's `rollout` makes a step of explicit
  Euler over 1 s, whose change of the rates is the acceleration.

Inputs and results are NumPy arrays. MuJoCo's closures are soft and Exudyn has accelerations of loops inside its integrators
alone: neither has `qdd` of closed loops."""

import json
import pathlib
import sys
import time

import numpy as np
import kempe

KEYS = ("xx", "yy", "zz", "xy", "xz", "yz")
STATES, ROWS = 64, 4096


def matrix(inertia):
    xx, yy, zz, xy, xz, yz = (inertia[k] for k in KEYS)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


# Each peer has `quantities`: a call for each of those that it can compute.


class Kempe:
    def __init__(self, path, tree):
        system = kempe.Model(path).system()
        self.workspace = system.workspace()
        n, m = self.workspace.n, self.workspace.m
        self.one, self.rows = kempe.Accelerations(np.empty(n), np.empty(m)), kempe.Accelerations(np.empty((ROWS, n)), np.empty((ROWS, m)))
        self.quantities = {"M, bias": self.equations, "qdd": self.accelerations, "qdd, rows": self.many}

    def equations(self, q, qd):
        found = self.workspace.evaluate(0.0, q, qd)
        return found.M, found.C

    def accelerations(self, q, qd):
        return self.workspace.forward_dynamics(0.0, q, qd, out=self.one).qdd

    def many(self, q, qd):
        return self.workspace.forward_states(0.0, q, qd, out=self.rows).qdd


class Pinocchio:
    def __init__(self, path, tree):
        import pinocchio as pin

        self.pin, self.model = pin, pin.Model()
        self.model.gravity.linear = np.array(tree["gravity"], float)
        joints, point = [], lambda p: pin.SE3(np.eye(3), np.array(p, float))
        at = lambda k: joints[k] if k >= 0 else 0
        kinds = {(1, 0, 0): pin.JointModelRX, (0, 1, 0): pin.JointModelRY, (0, 0, 1): pin.JointModelRZ}
        for k, b in enumerate(tree["bodies"]):
            (_, axis), = b["motions"]
            joints.append(self.model.addJoint(at(b["parent"]), kinds[tuple(axis)](), point(b["at"]), f"b{k}"))
            inertia = pin.Inertia(b["mass"], np.array(b["com"], float), matrix(b["inertia"]))
            self.model.appendBodyToJoint(joints[-1], inertia, pin.SE3.Identity())
        self.data, self.tau = self.model.createData(), np.zeros(self.model.nv)
        self.quantities = {"M, bias": self.equations, "qdd": self.accelerations}
        if tree["closures"]:
            self.contacts = pin.StdVec_RigidConstraintModel()
            for a, p, b, q in tree["closures"]:
                self.contacts.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, self.model, at(a), point(p), at(b), point(q), pin.ReferenceFrame.LOCAL))
            self.contact_data = pin.StdVec_RigidConstraintData()
            for contact in self.contacts:
                self.contact_data.append(contact.createData())
            pin.initConstraintDynamics(self.model, self.data, self.contacts, self.contact_data)
            self.settings = pin.ProximalSettings(1e-14, 1e-12, 10)
            self.quantities["qdd"] = self.closed
        else:
            self.pool, self.out = pin.ModelPool(self.model, 1), np.zeros((self.model.nv, ROWS), order="F")
            self.zeros = np.zeros((self.model.nv, ROWS), order="F")
            self.quantities["qdd, rows"] = self.many

    def equations(self, q, qd):
        bias = self.pin.nonLinearEffects(self.model, self.data, q, qd)
        M = self.pin.crba(self.model, self.data, q)
        return M, bias

    def accelerations(self, q, qd):
        return self.pin.aba(self.model, self.data, q, qd, self.tau)

    def closed(self, q, qd):
        return self.pin.constraintDynamics(self.model, self.data, q, qd, self.tau, self.contacts, self.contact_data, self.settings)

    def many(self, q, qd):
        self.pin.abaInParallel(1, self.pool, q.T, qd.T, self.zeros, self.out)
        return self.out.T


class MuJoCo:
    def __init__(self, path, tree):
        import mujoco
        from mujoco import rollout

        self.mj, self.rollout = mujoco, rollout
        self.model = mujoco.MjModel.from_xml_path(str(pathlib.Path(path).with_suffix(".xml")))
        self.model.opt.timestep = 1
        self.data, n = mujoco.MjData(self.model), self.model.nv
        self.M, self.first, self.after = np.zeros((n, n)), np.zeros((ROWS, 1, 1 + 2 * n)), np.zeros((ROWS, 1, 1 + 2 * n))
        self.quantities = {"M, bias": self.equations}
        if not tree["closures"]:
            self.quantities |= {"qdd": self.accelerations, "qdd, rows": self.many}

    def equations(self, q, qd):
        self.data.qpos[:], self.data.qvel[:] = q, qd
        self.mj.mj_fwdPosition(self.model, self.data)
        self.mj.mj_fwdVelocity(self.model, self.data)
        self.mj.mj_fullM(self.model, self.data, self.M)
        return self.M, self.data.qfrc_bias

    def accelerations(self, q, qd):
        self.data.qpos[:], self.data.qvel[:] = q, qd
        self.mj.mj_forward(self.model, self.data)
        return self.data.qacc

    def many(self, q, qd):
        n = self.model.nv
        first = self.first[:, 0]
        first[:, 1:1 + n], first[:, 1 + n:] = q, qd
        self.rollout.rollout(self.model, self.data, first, nstep=1, state=self.after, skip_checks=False)
        return self.after[:, 0, 1 + n:] - qd


class Exudyn:
    def __init__(self, path, tree):
        import exudyn as exu
        import exudyn.utilities as eu

        container = exu.SystemContainer()
        mbs = container.AddSystem()
        n = tree["n"]
        node = mbs.AddNode(eu.NodeGenericODE2(referenceCoordinates=[0] * n, initialCoordinates=[0] * n, initialCoordinates_t=[0] * n, numberOfODE2Coordinates=n))
        kinds = {(1, 0, 0): exu.JointType.RevoluteX, (0, 1, 0): exu.JointType.RevoluteY, (0, 0, 1): exu.JointType.RevoluteZ}
        bodies = tree["bodies"]
        mbs.AddObject(eu.ObjectKinematicTree(
            nodeNumber=node, jointTypes=[kinds[tuple(b["motions"][0][1])] for b in bodies], linkParents=[b["parent"] for b in bodies],
            jointTransformations=exu.Matrix3DList([np.eye(3) for _ in bodies]),
            jointOffsets=exu.Vector3DList([b["at"] for b in bodies]),
            linkInertiasCOM=exu.Matrix3DList([matrix(b["inertia"]) for b in bodies]),
            linkCOMs=exu.Vector3DList([b["com"] for b in bodies]), linkMasses=[b["mass"] for b in bodies], gravity=tree["gravity"]))
        mbs.Assemble()
        self.container, self.mbs, self.solver = container, mbs, exu.MainSolverImplicitSecondOrder()
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.timeIntegration.verboseMode = 0
        self.solver.InitializeSolver(mbs, settings)
        self.quantities = {"M, bias": self.equations}
        if not tree["closures"]:
            self.quantities["qdd"] = self.accelerations

    def equations(self, q, qd):
        self.mbs.systemData.SetODE2Coordinates(q)
        self.mbs.systemData.SetODE2Coordinates_t(qd)
        self.solver.ComputeMassMatrix(self.mbs)
        self.solver.ComputeODE2RHS(self.mbs)
        return self.solver.GetSystemMassMatrix(), -self.solver.GetSystemResidual()

    def accelerations(self, q, qd):
        M, bias = self.equations(q, qd)
        return np.linalg.solve(M, -bias)


def typical(seconds, works):
    """The time of each work in s, by turns: the fastest tenth of the rounds is below it."""
    times, begun = {name: [] for name in works}, time.thread_time()
    while time.thread_time() - begun < seconds * len(works):
        for name, work in works.items():
            begin = time.thread_time()
            work()
            times[name].append(time.thread_time() - begin)
    return {name: float(np.quantile(each, 0.1)) for name, each in times.items()}


def flat(found):
    return np.concatenate([np.ravel(each) for each in (found if isinstance(found, tuple) else (found,))])


def off(reference, found):
    return max(float(np.abs(a - b).max() / np.abs(a).max()) for a, b in zip(reference, found))


def states(tree, workspace):
    """Random states; of closed loops those that are closed, near the start."""
    chance = np.random.default_rng(7)
    q, qd = (chance.uniform(-1, 1, (STATES, tree["n"])) for _ in range(2))
    if tree["closures"]:
        for k in range(STATES):
            q[k], qd[k] = workspace.close(0.0, np.array(tree["q"]) + 0.3 * q[k], qd[k])
    return q, qd


def main(path, tree, seconds):
    tree = json.loads(pathlib.Path(tree).read_text())
    own = Kempe(path, tree)
    q, qd = states(tree, own.workspace)
    pairs = [(a.copy(), b.copy()) for a, b in zip(q, qd)]
    rows = np.tile(q, (ROWS // STATES, 1)), np.tile(qd, (ROWS // STATES, 1))
    peers, out = {"Kempe": own}, {"left out": []}
    for kind in (Pinocchio, MuJoCo, Exudyn):
        try:
            peers[kind.__name__] = kind(path, tree)
        except Exception as trouble:  # a peer that is not there, or is another version
            out["left out"].append(f"{kind.__name__}: {str(trouble).splitlines()[0]}")

    def one(call):
        return lambda: [call(a, b) for a, b in pairs]

    for quantity in ("M, bias", "qdd", "qdd, rows"):
        works, found = {}, {}
        for name, peer in peers.items():
            if quantity in peer.quantities:
                call = peer.quantities[quantity]
                works[name] = (lambda call=call: call(*rows)) if "rows" in quantity else one(call)
                found[name] = call(*rows).copy() if "rows" in quantity else [flat(call(a, b)).copy() for a, b in pairs]
        count = ROWS if "rows" in quantity else STATES
        times = typical(seconds, works)
        out[quantity] = {name: (1e6 * times[name] / count, off(found["Kempe"], found[name])) for name in works}
    print(json.dumps(out))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
