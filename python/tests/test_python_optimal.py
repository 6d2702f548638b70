# SPDX-License-Identifier: BSD-3-Clause
"""Optimal motions: a swing-up within limits that a controlled run repeats, a closed loop, the exact solution of a linear problem."""

import warnings

import numpy as np
import pytest

import kempe
from conftest import ROOT
from kempe.optimal import ilqr


def test_swing_up():
    model = kempe.Model(ROOT / "examples/cart_pole/cart_pole.yaml")
    workspace = model.system().workspace()
    guess = 0.5 * np.sin(np.arange(120))[:, None]
    plan = ilqr(
        workspace, [0, np.pi], [0, 0], 0.02, guess, "x", [0, 0, 0, 0], final=[1e3, 1e4, 1e2, 1e2], running=[0.1, 0.1, 0, 0], effort=1e-2,
        limits=15, substeps=2, iterations=200,
    )
    assert plan.converged and abs(plan.q[-1]).max() < 2e-3 and abs(plan.qd[-1]).max() < 2e-2
    assert abs(plan.forces).max() <= 15 and plan.costs == tuple(sorted(plan.costs, reverse=True)) and plan.cost == plan.costs[-1]
    # A run with these forces has the planned motion, within the stated error and the tolerance.
    stepper = model.system().stepper(rtol=1e-10, t_end=3)
    stepper.set_state([0, np.pi], [0, 0])
    for k in range(120):
        stepper.set_input("u", plan.forces[k, 0])
        stepper.advance(0.02 * (k + 1))
        assert np.allclose(stepper.q, plan.q[k + 1], atol=20 * plan.error)
    assert 0 < plan.error < 1e-4


def test_closed_loop_against_the_linear_solution(four_bar):
    workspace = four_bar.system().workspace()
    q, qd = workspace.close(0, [0.3, 0, 0], hold=["crank"])
    u = four_bar.coordinates.index(workspace.independent[0])
    goal = np.array([q[u] + 1e-3, 0])
    plan = ilqr(workspace, q, qd, 0.01, np.zeros((40, 1)), "crank", goal, final=[1e6, 1e4], effort=1e-2, tolerance=1e-12)
    assert plan.converged and plan.gains.shape == (40, 1, 2)
    modes = [np.sign(np.cross([1, 0, 0], [0, 0, row[1]])) for row in plan.q]  # the assembly mode stays
    assert all(np.array_equal(mode, modes[0]) for mode in modes)
    # No neighbouring forces are better: the cost as a function of the forces has its least value here.
    def cost(forces):
        state, total = (q, qd), 0.0
        for k, force in enumerate(forces):
            total += 0.5 * 0.01 * 1e-2 * force[0] ** 2
            after = workspace.step(0.01 * k, *state, 0.01, Q=np.eye(3)[four_bar.coordinates.index("crank")] * force[0], derivatives=False)
            state = after.q, after.qd
        e = np.array([state[0][u], state[1][u]]) - goal
        return total + 0.5 * e @ np.diag([1e6, 1e4]) @ e
    best = cost(plan.forces)
    assert np.isclose(best, plan.cost, rtol=1e-12)
    rng = np.random.default_rng(2)
    for _ in range(5):
        direction = rng.normal(size=(40, 1))
        sides = [cost(plan.forces + s * 1e-3 * direction) for s in (1, -1)]
        assert min(sides) > best and abs(sides[0] - sides[1]) < 0.1 * (sides[0] + sides[1] - 2 * best)


def test_mistakes(four_bar):
    workspace = four_bar.system().workspace()
    q, qd = workspace.close(0, [0.3, 0, 0], hold=["crank"])
    right = dict(h=0.01, forces=np.zeros((5, 1)), actuators="crank", target=[q[1], 0])
    for wrong, text in (
        ({"actuators": "krank"}, "crank"),
        ({"actuators": "crank,crank"}, "each of them once"),
        ({"actuators": ""}, "names the coordinates"),
        ({"forces": np.zeros(5)}, "a row of 1 numbers"),
        ({"forces": np.zeros((0, 1))}, "a row of 1 numbers"),
        ({"target": [1]}, "target .* has 2 values"),
        ({"effort": 0}, "effort must be positive"),
        ({"limits": -1}, "limits are positive"),
        ({"final": [1, 2, 3]}, "final is a number, 2 numbers"),
        ({"final": -1}, "final must not be negative"),
        ({"running": [np.nan, 0]}, "running has values that are not finite"),
        ({"target": [np.nan, 0]}, "not finite"),
        ({"limits": [1, 2]}, "limits is a number or 1 numbers"),
        ({"iterations": 0}, "at least one iteration"),
        ({"tolerance": np.nan}, "positive tolerance"),
        ({"h": 0.0}, "positive length of a step"),
    ):
        with pytest.raises((kempe.ArgumentError, ValueError), match=text):
            ilqr(workspace, q, qd, **{**right, **wrong})
    with pytest.warns(kempe.KempeWarning, match="1 iterations have not converged|not optimal"):
        ilqr(workspace, q, qd, 0.01, np.zeros((20, 1)), "crank", [q[1] + 0.5, 0], final=1e4, iterations=1, tolerance=1e-15)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ilqr(workspace, q, qd, 0.01, np.zeros((20, 1)), "crank", [q[1] + 0.1, 0], final=[1e4, 1e2], effort=1e-4)
