#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A long chain, a scissor lift, or spheres that bounce on a plane, by a peer that is called from Python:

    peer_growth.py exudyn|mujoco|pinocchio chain|scissors TREE.json STEPS
    peer_growth.py mujoco spheres N STEPS

Prints JSON, a line a way: its name, seconds of preparation (the model as the peer has it, from numbers in memory, and all that a first
evaluation prepares), what is timed, seconds of it, seconds of the whole run and q at its end, or accelerations at the start. STEPS of
implicit or explicit steps divide the run, of 0.1 s, with spheres of 0.5 s."""
import json
import math
import sys
import time

import closed
import spheres

END = {"chain": 0.1, "scissors": 0.1, "spheres": spheres.END}
sys.setrecursionlimit(100000)


def put(way, preparation, timed, seconds, run=None, **found):
    values = {key: [float(x) for x in value] for key, value in found.items()}
    print(json.dumps({"way": way, "preparation": preparation, "timed": timed, "seconds": seconds, "run": run, **values}), flush=True)


def least(call):
    """Seconds of a call, the least of some rounds; the first one is not timed."""
    call()
    found, spent = math.inf, 0.0
    while spent < 0.5:
        count, begin = 0, time.thread_time()
        while count == 0 or time.thread_time() - begin < 0.05:
            call()
            count += 1
        now = time.thread_time() - begin
        found, spent = min(found, now / count), spent + now
    return found


def exudyn(given, steps, end):
    """Trapezoidal rule, index 2, with the sparse factorisation of Eigen."""
    import exudyn.itemInterface # noqa: F401, before the clock runs

    begin = time.thread_time()
    _system, mbs, nodes, poses = closed.exudyn_make(given)
    settings = closed.exudyn_settings(end, steps, True, 1.0, "EigenSparse", closed.exudyn_redundant(given))
    made = time.thread_time()
    mbs.SolveDynamic(settings)
    run = time.thread_time() - made
    put(f"Exudyn, trapezoidal, {steps} steps", made - begin, "step", run / steps, run, q=closed.exudyn_relative(given, mbs, nodes, poses))


def mujoco_tree(given, step, integrator):
    """The specification by calls, since files nest 500 elements at most; loops are the stiffest `connect` that the step allows."""
    import mujoco as mj

    spec = mj.MjSpec()
    spec.option.timestep, spec.option.gravity, spec.option.integrator = step, given.gravity, integrator
    spec.option.tolerance, spec.option.iterations = 1e-14, 200
    bodies = []
    for k, b in enumerate(given.bodies):
        body = (spec.worldbody if b["parent"] < 0 else bodies[b["parent"]]).add_body(name=f"b{k}", pos=b["at"])
        body.add_joint(type=mj.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        body.mass, body.ipos, body.explicitinertial = b["mass"], b["com"], True
        body.inertia = [b["inertia"][x] for x in ("xx", "yy", "zz")]
        bodies.append(body)
    for a, p, b, _ in given.closures:
        equal = spec.add_equality(type=mj.mjtEq.mjEQ_CONNECT, name1=f"b{a}", name2=f"b{b}", objtype=mj.mjtObj.mjOBJ_BODY)
        equal.data[:3] = p
        equal.solref, equal.solimp = [2 * step, 1], [0.9999, 0.9999, 0.001, 0.5, 2]
    model = spec.compile()
    for k, (*_, q) in enumerate(given.closures):
        model.eq_data[k, 3:6] = q
    data = mj.MjData(model)
    data.qpos[:], data.qvel[:] = given.q, given.qd
    return model, data


def mujoco(given, steps, end):
    import mujoco as mj

    begin = time.thread_time()
    model, data = mujoco_tree(given, end / steps, mj.mjtIntegrator.mjINT_RK4)
    mj.mj_forward(model, data)
    made = time.thread_time() - begin
    if not given.closures:
        put("MuJoCo mj_forward", made, "right-hand side", least(lambda: mj.mj_forward(model, data)), qdd=data.qacc)
    begin = time.thread_time()
    mj.mj_step(model, data, nstep=steps)
    run = time.thread_time() - begin
    put(f"MuJoCo, RK4, {steps} steps", made, "step", run / steps, run, q=data.qpos)


def pinocchio(given, _steps, _end):
    """The articulated body algorithm, or constraintDynamics with a contact of points a loop."""
    import numpy as np
    import pinocchio as pin

    vector = lambda x: np.array(x, float)
    begin = time.thread_time()
    model, joints = pin.Model(), []
    model.gravity.linear = vector(given.gravity)
    at = lambda k: joints[k] if k >= 0 else 0
    place = lambda p: pin.SE3(np.eye(3), vector(p))
    for b in given.bodies:
        joints.append(model.addJoint(at(b["parent"]), pin.JointModelRZ(), place(b["at"]), b["name"]))
        inertia = np.diag([b["inertia"][x] for x in ("xx", "yy", "zz")])
        model.appendBodyToJoint(joints[-1], pin.Inertia(b["mass"], vector(b["com"]), inertia), pin.SE3.Identity())
    data = model.createData()
    q, v, tau = vector(given.q), vector(given.qd), np.zeros(model.nv)
    if given.closures:
        contacts = [pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, at(a), place(p), at(b), place(r), pin.ReferenceFrame.LOCAL)
                    for a, p, b, r in given.closures]
        of_contacts = [c.createData() for c in contacts]
        settings = pin.ProximalSettings(1e-14, 1e-12, 10)
        pin.initConstraintDynamics(model, data, contacts, of_contacts)
        call = lambda: pin.constraintDynamics(model, data, q, v, tau, contacts, of_contacts, settings)
        way = "Pinocchio constraintDynamics"
    else:
        call, way = lambda: pin.aba(model, data, q, v, tau), "Pinocchio ABA"
    found = call()
    made = time.thread_time() - begin
    put(way, made, "right-hand side", least(call), qdd=found)


def mujoco_spheres(n, steps):
    """A sphere has two slides and a hinge. Its contact with the plane is a spring and a damper of the given restitution, as stiff as the
    step allows: a contact lasts ten steps."""
    import mujoco as mj

    step = spheres.END / steps
    frequency = math.pi / (10 * step)
    ratio = -math.log(spheres.RESTITUTION) / math.hypot(math.pi, math.log(spheres.RESTITUTION))
    bounce = f'solref="{-frequency**2!r} {-2 * ratio * frequency!r}" solimp="0.99 0.99 0.001"'
    begin = time.thread_time()
    bodies = []
    for x, y in spheres.places(n):
        bodies.append(f'<body pos="{x!r} 0 {y!r}"><inertial pos="0 0 0" mass="{spheres.MASS!r}" diaginertia="{spheres.INERTIA!r} {spheres.INERTIA!r} '
                      f'{spheres.INERTIA!r}"/><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint axis="0 1 0"/>'
                      f'<geom type="sphere" size="{spheres.RADIUS!r}" contype="1" conaffinity="2" friction="{spheres.FRICTION!r} 0 0" {bounce}/></body>')
    model = mj.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step!r}" gravity="0 0 {-spheres.GRAVITY!r}" cone="elliptic"/><worldbody><geom type="plane" size="1000 1000 1" '
        f'contype="2" conaffinity="1" friction="{spheres.FRICTION!r} 0 0" {bounce}/>{"".join(bodies)}</worldbody></mujoco>')
    data = mj.MjData(model)
    data.qvel[0::3] = spheres.SPEED
    mj.mj_forward(model, data)
    made = time.thread_time()
    mj.mj_step(model, data, nstep=steps)
    run = time.thread_time() - made
    put(f"MuJoCo, {1e3 * step:g} ms steps", made - begin, "step", run / steps, run,
        q=[z for k, (x, y) in enumerate(spheres.places(n)) for z in (x + data.qpos[3 * k], y + data.qpos[3 * k + 1])])


def main():
    peer, scene, given, steps = sys.argv[1:]
    if scene == "spheres":
        mujoco_spheres(int(given), int(steps))
    else:
        {"exudyn": exudyn, "mujoco": mujoco, "pinocchio": pinocchio}[peer](closed.Given(given), int(steps), END[scene])


if __name__ == "__main__":
    main()
