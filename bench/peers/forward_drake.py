#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Accelerations of a tree by Drake's MultibodyPlant (continuous, its articulated body algorithm): forward_drake.py TREE.json
STATES SECONDS. Its C++ headers are not in the wheel, so it is called from Python; the time of the same calls on a plant of
one pendulum, which is nearly nothing but calling, is taken off."""
import json
import pathlib
import statistics
import sys
import time

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, RevoluteJoint, RotationalInertia, SpatialInertia, UnitInertia

KEYS = ("xx", "yy", "zz", "xy", "xz", "yz")


def build(gravity, tree):
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector(gravity)
    bodies = []
    for k, b in enumerate(tree):
        parent, place = plant.world_body() if b["parent"] < 0 else bodies[b["parent"]], RigidTransform(b["at"])
        for j, (kind, axis) in enumerate(b["motions"]):
            if j + 1 == len(b["motions"]):
                inertia = SpatialInertia.MakeFromCentralInertia(b["mass"], b["com"], RotationalInertia(*(b["inertia"][x] for x in KEYS)))
            else:
                inertia = SpatialInertia(0, [0, 0, 0], UnitInertia(0, 0, 0))
            body = plant.AddRigidBody(f"b{k}.{j}", inertia)
            frame = plant.AddFrame(FixedOffsetFrame(f"f{k}.{j}", parent.body_frame(), place))
            joint = RevoluteJoint if kind == "R" else PrismaticJoint
            plant.AddJoint(joint(f"j{k}.{j}", frame, body.body_frame(), axis, damping=0))
            parent, place = body, RigidTransform()
        bodies.append(parent)
    plant.Finalize()
    return plant, plant.CreateDefaultContext()


def ns_a_call(plant, context, states, seconds):
    count, rounds = 16, []
    while True:
        begin = time.thread_time()
        for k in range(count):
            plant.SetPositionsAndVelocities(context, states[k % len(states)])
            plant.EvalTimeDerivatives(context)
        spent = time.thread_time() - begin
        if spent > seconds / 12:
            rounds.append(1e9 * spent / count)
            if len(rounds) == 9:
                return statistics.median(rounds)
        else:
            count *= 2


if __name__ == "__main__":
    given = json.loads(pathlib.Path(sys.argv[1]).read_text())
    states = np.loadtxt(sys.argv[2], ndmin=2)
    seconds, n = float(sys.argv[3]), given["n"]
    plant, context = build(given["gravity"], given["bodies"])
    print("Drake EvalTimeDerivatives, revolute and prismatic joints")
    for state in states:
        plant.SetPositionsAndVelocities(context, state)
        print(" ".join(f"{x:.17g}" for x in plant.EvalTimeDerivatives(context).CopyToVector()[n:]))
    pendulum = {"parent": -1, "at": [0, 0, 0], "mass": 1, "com": [1, 0, 0], "inertia": dict.fromkeys(KEYS, 0) | {"xx": 1, "yy": 1, "zz": 1},
                "motions": [("R", [0, 0, 1])]}
    small = build(given["gravity"], [pendulum])
    whole, calling = ns_a_call(plant, context, states, seconds), ns_a_call(*small, states[:, :2].copy(), seconds)
    print(f"calling: {calling:.0f} ns", file=sys.stderr)
    print(f"{whole - calling:.6g}")
