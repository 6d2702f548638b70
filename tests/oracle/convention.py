# SPDX-License-Identifier: BSD-3-Clause
"""Conventions that `run --mutate` breaks on purpose in the oracle, one at a time: comparisons must then fail. Nothing is broken in any
other run."""

MUTATIONS = """sign of gravity; Coriolis acceleration; gyroscopic moment; sign of products of inertia; order of motions; frame;
axes of `to`; place of `to`; reversed; shortest turn; order of two axes; axis of universal joints; pitch of screws;
axes of reactions; body of reactions; place of moments; sign of multipliers; acceleration of drives; speed of closures in time;
rates in expressions; conditions turned; ends of splines; tables go on straight; potential of springs; axes of bushings;
place of bushings; rate of bushings; force of stops; sign of friction; axes of forces at points; axes of points;
velocity of points; acceleration of points; offset of includes; settings of includes; kinetic energy of rotation;
curve in axes of ground; rates of relative positions; sign of angles; areas of cylinders; rates of states; tracking of controllers;
values before samples; efforts in loads of joints; bodies of loads of joints""".replace("\n", " ").split("; ")
INTEGRATED = {"rates of states", "tracking of controllers"}  # seen in motions that the oracle integrates
BROKEN = set()


def broken(name):
    """True if this convention is broken on purpose."""
    assert name in MUTATIONS, name
    return name in BROKEN
