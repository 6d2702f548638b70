#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A mechanism with closed loops by a peer that is called from Python; in the plane, but for MuJoCo and SciPy:

    closed.py exudyn|mujoco|drake|scipy|heyoka TREE.json T_END SECONDS [CODE]

Prints a line a setting: `way|setting|seconds of processor time|q ...`, q empty where the run broke off. A way goes to finer
settings until a run has taken SECONDS. CODE: the folder of equations that `kempe generate --lang python` wrote, for scipy.
"""
import json
import math
import pathlib
import statistics
import sys
import time

LIMIT = 2.0                                               # s, set by main


def sweep(way, settings, run):
    """run(setting) -> (seconds, q or None)"""
    for setting in settings:
        try:
            found = [run(setting)]
            while len(found) < 3 and sum(f[0] for f in found) < LIMIT / 4:
                found.append(run(setting))
        except Exception as trouble:                      # a peer's own complaint is its result
            print(f"{way}|{setting:g}|nan|", f"{type(trouble).__name__}: {trouble}".replace("\n", " ")[:150], file=sys.stderr)
            print(f"{way}|{setting:g}|nan|", flush=True)
            continue
        seconds, q = statistics.median(f[0] for f in found), found[0][1]
        print(f"{way}|{setting:g}|{seconds:.6g}|" + " ".join(repr(float(x)) for x in (q if q is not None else [])), flush=True)
        if seconds > LIMIT:
            break


class Given:
    def __init__(self, path):
        self.__dict__ = json.loads(pathlib.Path(path).read_text())

    def poses(self):
        """Place and absolute angle of each body at the start, its velocity and turning rate: plane, one hinge each."""
        out = []
        for k, b in enumerate(self.bodies):
            (x, y), angle, (vx, vy), rate = ((0, 0), 0, (0, 0), 0) if b["parent"] < 0 else out[b["parent"]]
            c, s = math.cos(angle), math.sin(angle)
            dx, dy = c * b["at"][0] - s * b["at"][1], s * b["at"][0] + c * b["at"][1]
            out.append(((x + dx, y + dy), angle + self.q[k], (vx - rate * dy, vy + rate * dx), rate + self.qd[k]))
        return out

    def relative(self, absolute):
        return [absolute[k] - (absolute[b["parent"]] if b["parent"] >= 0 else 0) for k, b in enumerate(self.bodies)]


def exudyn_make(given):
    """Rigid bodies in the plane, a revolute joint each, a further one each loop: the container, the system, its nodes, the poses at the start."""
    import exudyn as exu
    import exudyn.itemInterface as items

    system = exu.SystemContainer()
    mbs = system.AddSystem()
    ground = mbs.AddObject(items.ObjectGround())
    markers = lambda k, p: mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground if k < 0 else objects[k], localPosition=local(k, p)))
    com = lambda k: [0, 0, 0] if k < 0 else given.bodies[k]["com"]
    local = lambda k, p: [p[i] - com(k)[i] for i in range(3)]
    fixed = lambda: mbs.AddNode(items.NodePointGround())
    objects, nodes = [], []
    poses = given.poses()
    for k, b in enumerate(given.bodies):
        (x, y), angle, (vx, vy), rate = poses[k]
        c, s = math.cos(angle), math.sin(angle)
        dx, dy = c * b["com"][0] - s * b["com"][1], s * b["com"][0] + c * b["com"][1]
        nodes.append(mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[x + dx, y + dy, angle], initialCoordinates=[0, 0, 0],
                                                       initialVelocities=[vx - rate * dy, vy + rate * dx, rate])))
        objects.append(mbs.AddObject(items.ObjectRigidBody2D(physicsMass=b["mass"], physicsInertia=b["inertia"]["zz"], nodeNumber=nodes[k])))
        if any(given.gravity):
            marker = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=objects[k]))
            mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=given.gravity))
    for k, b in enumerate(given.bodies):
        mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[markers(b["parent"], b["at"]), markers(k, [0, 0, 0])]))
    for a, p, b, q in given.closures:
        mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[markers(a, p), markers(b, q)]))
    for a, p, b, q, k, c, l in given.springs:
        mbs.AddObject(items.ObjectConnectorSpringDamper(markerNumbers=[markers(a, p), markers(b, q)], stiffness=k, damping=c,
                                                        referenceLength=l))
    for k, x in given.efforts:                        # of hinges on the ground
        marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[k], coordinate=2))
        mbs.AddLoad(items.LoadCoordinate(markerNumber=marker, load=x))
    for k, stiffness, damping, rest in given.held:    # likewise; the node's angle counts from the start
        markers_of = [mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=n, coordinate=c)) for n, c in ((fixed(), 0), (nodes[k], 2))]
        mbs.AddObject(items.ObjectConnectorCoordinateSpringDamper(markerNumbers=markers_of, stiffness=stiffness, damping=damping,
                                                                  offset=rest - given.q[k]))
    mbs.Assemble()
    return system, mbs, nodes, poses # the first owns the second


def exudyn_settings(end, steps, index2, radius, linear_solver=None, redundant=False):
    """The linear solver is Exudyn's default, unless another one is named or joints are redundant."""
    import exudyn as exu

    settings = exu.SimulationSettings()
    if linear_solver:
        settings.linearSolverType = getattr(exu.LinearSolverType, linear_solver)
    integration = settings.timeIntegration
    integration.numberOfSteps, integration.endTime = int(steps), end
    integration.generalizedAlpha.spectralRadius = radius
    integration.generalizedAlpha.useIndex2Constraints = index2
    integration.generalizedAlpha.useNewmark = index2
    integration.newton.useModifiedNewton = True
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = end
    if redundant:
        settings.linearSolverType = exu.LinearSolverType.EigenDense
        settings.linearSolverSettings.ignoreSingularJacobian = True
    integration.verboseMode = 0
    settings.displayStatistics = settings.displayComputationTime = False
    return settings


def exudyn_redundant(given):
    return 2 * len(given.closures) > given.n - len(given.independent)


def exudyn_relative(given, mbs, nodes, poses):
    import exudyn as exu
    turned = [mbs.GetNodeOutput(n, exu.OutputVariableType.Coordinates)[2] for n in nodes]
    return given.relative([pose[1] + x for pose, x in zip(poses, turned)])


def exudyn_run(given, end, *options):
    """Seconds of the integration, and q."""
    _system, mbs, nodes, poses = exudyn_make(given)
    settings = exudyn_settings(end, *options, redundant=exudyn_redundant(given))
    begin = time.thread_time()
    mbs.SolveDynamic(settings)
    return time.thread_time() - begin, exudyn_relative(given, mbs, nodes, poses)


def exudyn(given, end):
    """Generalised alpha, index 2 or 3."""
    run = lambda *settings: exudyn_run(given, end, *settings)
    counts = [300 * 4**k for k in range(9)]
    sweep("exudyn generalised alpha (0.9), index 3, steps", counts, lambda n: run(n, False, 0.9))
    sweep("exudyn trapezoidal, index 2, steps", counts, lambda n: run(n, True, 1.0))


def mujoco_make(given, step, integrator, stiff):
    """`connect` takes its second point from the pose of the file, which is that of zero angles: it is set afterwards."""
    import mujoco as mj
    sys.path.insert(0, str(pathlib.Path(__file__).parent))
    import tree

    class Model(tree.Tree):
        def __init__(self):
            self.__dict__ = dict(given.__dict__)

    text = Model().mjcf(options=f'timestep="{step!r}" integrator="{integrator}" tolerance="1e-14" iterations="200"')
    soft = f'solref="{2 * step!r} 1" solimp="0.9999 0.9999 0.001"' if stiff else ""
    equal = [f'<connect body1="b{a}" body2="b{b}" anchor="{p[0]!r} {p[1]!r} {p[2]!r}" {soft}/>' for a, p, b, q in given.closures]
    equal += [f'<tendon tendon1="r{k}" {soft}/>' for k in range(len(given.rods))]
    m = mj.MjModel.from_xml_string(text.replace("</mujoco>", f"<equality>{''.join(equal)}</equality></mujoco>"))
    for k, (*_, length) in enumerate(given.rods):     # beside the length at zero coordinates
        m.eq_data[len(given.closures) + k, 0] = length - m.tendon_length0[k]
    for k, (*_, q) in enumerate(given.closures):
        m.eq_data[k, 3:6] = q
    d = mj.MjData(m)
    d.qpos[:], d.qvel[:] = given.q, given.qd
    for k, x in given.efforts:
        d.qfrc_applied[k] = x
    return m, d


def mujoco(given, end):
    """Hinges; each loop a `connect`. The default softness, then the stiffest that the step allows."""
    import mujoco as mj

    def run(steps, integrator, stiff):
        m, d = mujoco_make(given, end / steps, integrator, stiff)
        begin = time.thread_time()
        mj.mj_step(m, d, nstep=int(steps))
        seconds = time.thread_time() - begin
        return seconds, d.qpos if all(math.isfinite(x) for x in d.qpos) and d.time > 0.99 * end else None

    counts = [300 * 4**k for k in range(9)]
    sweep("MuJoCo, default softness, RK4, steps", counts, lambda n: run(n, "RK4", False))
    sweep("MuJoCo, stiffest, RK4, steps", counts, lambda n: run(n, "RK4", True))
    sweep("MuJoCo, stiffest, implicitfast, steps", counts, lambda n: run(n, "implicitfast", True))


def drake(given, end):
    """Discrete MultibodyPlant (SAP), a ball constraint each loop."""
    from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame, LinearSpringDamper, RevoluteJoint, RevoluteSpring, RotationalInertia, SpatialInertia
    from pydrake.math import RigidTransform
    from pydrake.systems.analysis import Simulator

    def run(steps):
        plant = MultibodyPlant(end / steps)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
        plant.mutable_gravity_field().set_gravity_vector(given.gravity)
        bodies, joints = [], []
        body = lambda k: plant.world_body() if k < 0 else bodies[k]
        for k, b in enumerate(given.bodies):
            inertia = dict(b["inertia"])
            inertia["xx"] = inertia["yy"] = inertia["zz"]  # turns about z alone: the others are what a body may have
            bodies.append(plant.AddRigidBody(f"b{k}", SpatialInertia.MakeFromCentralInertia(
                b["mass"], b["com"], RotationalInertia(inertia["xx"], inertia["yy"], inertia["zz"], 0, 0, 0))))
            frame = plant.AddFrame(FixedOffsetFrame(f"f{k}", body(b["parent"]).body_frame(), RigidTransform(b["at"])))
            joints.append(plant.AddJoint(RevoluteJoint(f"j{k}", frame, bodies[k].body_frame(), [0, 0, 1], damping=0)))
        for a, p, b, q in given.closures:
            plant.AddBallConstraint(body(a), p, body(b), q)
        for a, p, b, q, k, c, l in given.springs:
            plant.AddForceElement(LinearSpringDamper(body(a), p, body(b), q, l, k, c))
        for k, stiffness, damping, rest in given.held:    # without damping
            plant.AddForceElement(RevoluteSpring(joints[k], rest, stiffness))
        for k, _ in given.efforts:
            plant.AddJointActuator(f"a{k}", joints[k])
        plant.Finalize()
        simulator = Simulator(plant)
        context = simulator.get_mutable_context()
        plant.SetPositions(context, given.q)
        plant.SetVelocities(context, given.qd)
        if given.efforts:
            plant.get_actuation_input_port().FixValue(context, [x for _, x in given.efforts])
        simulator.Initialize()
        begin = time.thread_time()
        simulator.AdvanceTo(end)
        return time.thread_time() - begin, list(plant.GetPositions(context))

    sweep("Drake discrete SAP, steps", [300 * 4**k for k in range(8)], run)


def scipy(given, end, code):
    """The ODE of q and qd, accelerations by M, C, J, jdqd (written by Kempe in Python) and one solve with numpy."""
    import numpy as np
    from scipy.integrate import solve_ivp
    from scipy.linalg import qr
    folder = pathlib.Path(code)
    sys.path.insert(0, code)
    module = __import__(next(folder.glob("*.py")).stem)
    name = next(x for x in dir(module) if "M_C" in x and callable(getattr(module, x)))
    equations, n, m = getattr(module, name), given.n, 2 * len(given.closures)
    rows = None

    own = np.array(given.own)

    def rates(t, y):
        nonlocal rows
        mass, bias, _, jacobian, jdqd = equations(t, y[:n], y[n:])
        mass, jacobian = np.asarray(mass).reshape(n, n), np.asarray(jacobian).reshape(-1, n)
        if rows is None:                                  # the independent ones, by pivots at the start
            _, r, order = qr(jacobian.T, mode="economic", pivoting=True)
            rows = sorted(order[k] for k, x in enumerate(np.abs(np.diag(r))) if x > 1e-9 * abs(r[0, 0]))
        jacobian = jacobian[rows]
        m = len(rows)
        matrix = np.zeros((n + m, n + m))
        matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = mass, -jacobian.T, jacobian
        x = np.linalg.solve(matrix, -np.concatenate([np.ravel(bias), np.ravel(jdqd)[rows]]))
        return np.concatenate([y[n:], x[:n]])

    def run(rtol, method):
        y = np.concatenate([np.array(given.q)[own], np.array(given.qd)[own]]) # in the order of the equations
        begin = time.thread_time()
        done = solve_ivp(rates, (0, end), y, method=method, rtol=rtol, atol=rtol)
        seconds, q = time.thread_time() - begin, np.empty(n)
        q[own] = done.y[:n, -1]
        return seconds, q if done.success else None

    for method in ("DOP853", "LSODA", "Radau"):
        sweep(f"scipy {method}, rtol", [10.0**-k for k in range(3, 14)], lambda rtol: run(rtol, method))


def heyoka(given, end):
    """Taylor's method of a reduced ODE (planar.py), one step's recursion compiled for each tolerance, which takes time of its own."""
    import heyoka as hy
    sys.path.insert(0, str(pathlib.Path(__file__).parent))
    import planar
    mechanism = planar.Planar(given)
    variables, rates = mechanism.reduced(given.independent)
    names = [x.of[0] for x in variables]
    by_name = dict(zip(names, hy.make_vars(*names)))
    made = mechanism.graph.elsewhere(by_name, {"sin": hy.sin, "cos": hy.cos, "sqrt": hy.sqrt}, rates)
    start = [given.q[int(x[1:])] if x[0] == "q" else given.qd[int(x[1:])] for x in names]
    ready = {}

    def run(tolerance):
        if tolerance not in ready:
            begin = time.thread_time()
            ready[tolerance] = hy.taylor_adaptive([(by_name[x], f) for x, f in zip(names, made)], start, tol=tolerance,
                                                  compact_mode=given.n > 20)
            print(f"heyoka, tolerance {tolerance:g}: compiled in {time.thread_time() - begin:.2f} s", file=sys.stderr)
        integrator, count, begin = ready[tolerance], 0, time.thread_time()
        while count == 0 or time.thread_time() - begin < 0.02:
            integrator.state[:] = start
            integrator.time = 0.0
            outcome = integrator.propagate_until(end)[0]
            count += 1
        seconds = (time.thread_time() - begin) / count
        return seconds, integrator.state[:given.n] if outcome == hy.taylor_outcome.time_limit else None

    sweep("heyoka Taylor, reduced ODE, tolerance", [10.0**-k for k in range(3, 17)], run)


if __name__ == "__main__":
    LIMIT = float(sys.argv[4])
    given, end = Given(sys.argv[2]), float(sys.argv[3])
    {"exudyn": exudyn, "mujoco": mujoco, "drake": drake, "scipy": scipy, "heyoka": heyoka}[sys.argv[1]](given, end, *sys.argv[5:6 if sys.argv[1] == "scipy" else 5])
