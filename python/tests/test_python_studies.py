# SPDX-License-Identifier: BSD-3-Clause
"""Every study gives what the command gives, to the bit; workspaces, steppers, outputs, gradients agree with each other."""

import concurrent.futures
import importlib.util
import os
import pickle
import re
import threading
import time
import zipfile

import kempe
import numpy as np
import pytest
from conftest import ROOT, USED, untimed
from left_out import LEFT_OUT
from test_python_basics import pendulum

EXAMPLES = ROOT / "examples"
STUDIES = {  # study: model, options of the command, keywords
    "simulate": ("four_bar/four_bar", ["--t-end", 1], {"t_end": 1}),
    "simulate dae": (
        "slider_crank/slider_crank",
        ["--t-end", 0.2, "--formulation", "dae", "--rtol", 1e-6],
        {"t_end": 0.2, "formulation": "dae", "rtol": 1e-6},
    ),
    "simulate ida": (
        "slider_crank/slider_crank",
        ["--t-end", 0.2, "--formulation", "dae", "--integrator", "ida", "--rtol", 1e-6],
        {"t_end": 0.2, "formulation": "dae", "integrator": "ida", "rtol": 1e-6},
    ),
    "check": ("four_bar/four_bar", [], {}),
    "kinematics": ("four_bar/four_bar", ["--sweep", "crank=0:6:31"], {"sweep": {"crank": (0, 6, 31)}}),
    "equilibrium": ("governor/governor", ["--rates", "shaft=5.5"], {"rates": {"shaft": 5.5}}),
    "inverse": ("driven_slider_crank/driven_slider_crank", [], {}),
    "linearize": ("quarter_car/quarter_car", ["--inputs", "effort(wheel)"], {"inputs": ["effort(wheel)"]}),
    "modes": ("quarter_car/quarter_car", [], {}),
    "sensitivity": (
        "four_bar/four_bar",
        ["--parameters", "crank,base", "--outputs", "q(rocker)", "--t-end", 0.3],
        {"parameters": ["crank", "base"], "outputs": "q(rocker)", "t_end": 0.3},
    ),
}
PLAIN = ("equilibrium", "inverse")  # the command derives these equations without recursions


@pytest.mark.parametrize("study", STUDIES)
def test_same_bits_as_the_command(study, command):
    name, words, keywords = STUDIES[study]
    path = EXAMPLES / f"{name}.yaml"
    model = kempe.Model(path)
    source = model if study == "sensitivity" else model.system("plain" if study in PLAIN else None)
    result = getattr(source, study.split()[0])(**keywords)
    expected = command(study.split()[0], path, *words)
    assert untimed(result.to_dict()) == untimed(expected)
    assert str(result) and repr(result) and "<pre>" in result._repr_html_()


def test_check(four_bar):
    check = four_bar.system().check()
    assert check.dof == 1 and check.redundant == {} and len(check.independent) == 1
    assert len(check.text(full=True)) > len(check.text()) and check.closures["kind"][0]
    assert check.mobility["rank"][0] == 2


def test_assembly_and_branches(four_bar, tmp_path):
    system = four_bar.system()
    assembly, branches = system.assemble(), system.branches(seed=1)
    assert np.array_equal(assembly.q, branches[0]) and len(branches) == 2 and assembly.qd.shape == (3,)
    assert len(list(branches)) == 2 and str(branches) and str(assembly)
    with pytest.raises(IndexError):
        branches[2]


def test_trajectory(four_bar):
    run = four_bar.simulate(t_end=1)
    assert run.q.shape == run.qd.shape == run.qdd.shape == (len(run), 3) and run.lam.shape == (len(run), 2)
    assert run.names == four_bar.coordinates and run.closure_rows == four_bar.system().rows and run.units["t"] == "s"
    point = run["position(coupler.C)"]
    assert point.shape == (len(run), 3) and np.array_equal(point[:, 0], run["position(coupler.C).x"])
    assert np.array_equal(run["q.crank"], run.q[:, 0]) and run.outputs(["q(crank)", "energy"]).names[:2] == (
        "t",
        "q.crank",
    )
    assert run.verdict["convergence"]["result"] == "converged" and "t" in run.log
    assert "image/svg+xml" in run._repr_html_() and "complete" in repr(run)
    assert np.array_equal(four_bar.system().simulate(t_end=1, backend="tape").q, run.q)


def test_reactions(four_bar):
    """The largest force of a joint is the largest value of its output over the rows; equilibria and inverse dynamics have the table too."""
    run = four_bar.simulate(t_end=1)
    pins = dict(zip(run.reactions["joint"], run.reactions["force"]))
    for joint in ("crank", "coupler", "rocker", "C"):
        assert pins[joint] == pytest.approx(np.linalg.norm(run[f"reaction({joint})"], axis=1).max(), rel=1e-9)
    assert run.reactions.units["force"] == "N" and run.reactions["unique"].all()
    assert run.to_dict()["reactions"][0]["force"]["peak"] == pins["crank"]
    system = four_bar.system()
    whole = system.simulate(t_end=1, reaction_peaks="motion", keep_dense=True)
    peaks = dict(zip(whole.reactions["joint"], whole.reactions["force"]))
    for joint in ("crank", "coupler", "rocker", "C"):
        fine = np.linalg.norm(system.outputs(f"reaction({joint})").at_time(whole, np.linspace(0, 1, 4001)), axis=1).max()
        assert pins[joint] <= peaks[joint] * (1 + 1e-9) and fine <= peaks[joint] * (1 + 1e-9) < fine * (1 + 1e-5)
    assert whole.to_dict()["reaction_peaks"] == {"of": "motion", "from": 0, "until": 1} and len(whole.bearings["at"]) == 0
    held = four_bar.system().equilibrium().reactions.row(0)
    assert held["joint"] == "crank" and held["force"] == pytest.approx(np.hypot(held["force.x"], held["force.y"]), rel=1e-12)
    driven = kempe.Model(EXAMPLES / "driven_slider_crank/driven_slider_crank.yaml").system()
    forces = driven.inverse()
    load = np.hypot(forces.rows["reaction.P.x"], forces.rows["reaction.P.y"])
    assert dict(zip(forces.reactions["joint"], forces.reactions["force"]))["P"] == pytest.approx(load.max(), rel=1e-12)


def test_system_text(four_bar):
    system = four_bar.system()
    assert system is four_bar.system() and system.coordinates == four_bar.coordinates
    assert all(system.text(view) for view in ("equations", "program", "stats", "passes")) and "rows" in repr(system)
    other = four_bar.system(dynamics="ner")
    assert np.allclose(other.simulate(t_end=0.1).q, system.simulate(t_end=0.1).q)


# -- workspace ---------------------------------------------------------------------------------------


def test_workspace_is_the_equation_of_motion(four_bar):
    system = four_bar.system()
    run, workspace = four_bar.simulate(t_end=1), system.workspace()
    for k in (0, 40, len(run) - 1):
        q, qd = run.q[k], run.qd[k]
        qdd, lam = workspace.forward_dynamics(run.t[k], q, qd)
        views = workspace.evaluate(run.t[k], q, qd)
        assert np.allclose(views.M @ qdd + views.C, views.J.T @ lam, atol=1e-9) and np.allclose(
            views.J @ qdd, -views.jdqd, atol=1e-9
        )
        assert np.allclose(qdd, run.qdd[k]) and np.abs(views.h).max() < 1e-12
        assert np.allclose(workspace.inverse_dynamics(0, q, qd, qdd), views.M @ qdd + views.C)
        assert np.isclose(0.5 * qd @ views.M @ qd, workspace.kinetic)
    Q = np.array([1.0, 0, 0])
    assert not np.allclose(workspace.forward_dynamics(0, q, qd, Q).qdd, workspace.forward_dynamics(0, q, qd).qdd)
    assert np.isfinite(workspace.potential)


def test_workspace_copies_and_views(four_bar):
    workspace = four_bar.system().workspace()
    workspace.evaluate(0, [0, 0, 0])
    copies = [getattr(workspace, name) for name in "M C h J jdqd".split()]
    live = workspace.views
    assert (
        all(np.array_equal(a, b) for a, b in zip(copies, live))
        and copies[0].flags.writeable
        and not live.M.flags.writeable
    )
    workspace.evaluate(0, [0.5, 0.5, 0], [1, 0, 0])
    assert not np.array_equal(copies[0], workspace.M) and np.array_equal(live.M, workspace.M)


def test_workspace_arguments_are_converted_or_refused(four_bar):
    workspace = four_bar.system().workspace()
    q = np.arange(6.0)[::2] * 0.1
    expected = workspace.evaluate(0, q.copy()).M.copy()
    for same in (q, list(q), q.astype("f4").astype("f8"), tuple(q)):
        assert np.allclose(workspace.evaluate(0, same).M, expected)
    with pytest.raises(ValueError, match="q has 3 values"):
        workspace.evaluate(0, np.zeros(4))
    with pytest.raises(ValueError, match="qdd must be"):
        workspace.forward_dynamics(0, q, q, out=kempe.Accelerations(np.empty(3, "f4"), np.empty(2)))
    for wrong in (np.empty(6)[::2], np.frombuffer(bytes(24)), np.empty((3, 1))):
        with pytest.raises(ValueError, match="out must be"):
            workspace.inverse_dynamics(0, q, q, q, out=wrong)
    with pytest.raises(kempe.FailedError):
        workspace.evaluate(0, [np.nan, 0, 0])
    closed, rates = workspace.close(0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
    workspace.evaluate(0, closed, rates)
    assert closed[0] == 0.3 and np.abs(workspace.h).max() < 1e-12 and np.abs(workspace.J @ rates).max() < 1e-12


def test_many_states_are_single_ones(four_bar):
    run, workspace = four_bar.simulate(t_end=0.5), four_bar.system().workspace()
    many = workspace.evaluate_states(run.t, run.q, run.qd)
    accelerations = workspace.forward_states(run.t, run.q, run.qd)
    forces = workspace.inverse_states(0.0, run.q, run.qd, accelerations.qdd)
    for k in (0, 3, len(run) - 1):
        one = workspace.evaluate(run.t[k], run.q[k], run.qd[k])
        assert all(np.array_equal(a[k], b) for a, b in zip(many, one))
        qdd, lam = workspace.forward_dynamics(run.t[k], run.q[k], run.qd[k])
        assert np.array_equal(accelerations.qdd[k], qdd) and np.array_equal(accelerations.lam[k], lam)
        assert np.array_equal(forces[k], workspace.inverse_dynamics(0, run.q[k], run.qd[k], qdd))
    copies = [each.copy() for each in many]
    again = workspace.evaluate_states(run.t, run.q + 0.1, run.qd, out=many)
    assert again is many and not np.array_equal(many.C, copies[1])
    workspace.evaluate_states(run.t, run.q, run.qd, out=many)
    assert all(np.array_equal(a, b) for a, b in zip(many, copies))
    with pytest.raises(ValueError, match="mass must be"):
        workspace.evaluate_states(run.t[1:], run.q[1:], run.qd[1:], out=many)
    wrong = run.q.copy()
    wrong[7] = np.nan
    with pytest.raises(kempe.FailedError, match="state 7"):
        workspace.evaluate_states(0, wrong)
    with pytest.raises(kempe.FailedError, match="state 7"):
        workspace.forward_states(0, wrong, run.qd)
    with pytest.raises(ValueError, match="qd has rows"):
        workspace.evaluate_states(0, run.q, run.qd[:-1])
    with pytest.raises(ValueError, match="t is a number"):
        workspace.evaluate_states([0, 1], run.q)


def test_outputs_and_products_at_a_state(four_bar):
    workspace, words, names = four_bar.system().workspace(), "position(coupler.C).x, reaction(crank)", ["crank_mass", "base"]
    q, qd = workspace.close(0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
    found = workspace.forward_derivatives(0, q, qd, by=names, outputs=words)
    closed = workspace.closed_derivatives(0, q, qd, by=names, outputs=words)
    handles = four_bar.system().outputs(words)
    assert np.allclose(found.y, handles.at(0, q, qd, found.qdd, found.lam), rtol=1e-10) and np.array_equal(found.y, closed.y)
    assert found.y_q.shape == (4, 3) and found.y_p.shape == (4, 2) and closed.y_u.shape == (4, 1)
    total = found.y_q @ closed.q_p + found.y_qd @ closed.qd_p + found.y_p
    assert np.allclose(closed.y_p, total, rtol=1e-9) and np.allclose(closed.y_ud, found.y_qd @ closed.q_u, rtol=1e-9)
    rng = np.random.default_rng(1)
    dq, dqd, dQ = rng.normal(size=(3, 3))
    dp, w = rng.normal(size=2), rng.normal(size=9)
    also = {"by": names, "outputs": words}
    values, change = workspace.forward_jvp(0, q, qd, dq=dq, dqd=dqd, dQ=dQ, dp=dp, **also)
    assert np.array_equal(values.qdd, found.qdd) and np.array_equal(values.y, found.y)
    assert np.allclose(change.qdd, found.qdd_q @ dq + found.qdd_qd @ dqd + found.qdd_Q @ dQ + found.qdd_p @ dp, rtol=1e-9)
    assert np.allclose(change.y, found.y_q @ dq + found.y_qd @ dqd + found.y_Q @ dQ + found.y_p @ dp, rtol=1e-9)
    _, gradient = workspace.forward_vjp(0, q, qd, qdd=w[:3], lam=w[3:5], y=w[5:], **also)
    forward = w @ np.concatenate(change)
    assert np.isclose(gradient.q @ dq + gradient.qd @ dqd + gradient.Q @ dQ + gradient.p @ dp, forward, rtol=1e-10)
    _, change = workspace.forward_jvp(0, q, qd, du=[0.5], dud=[2], **also)
    assert np.allclose(change.y, closed.y_u[:, 0] * 0.5 + closed.y_ud[:, 0] * 2, rtol=1e-9)
    _, gradient = workspace.forward_vjp(0, q, qd, y=w[5:], closed=True, **also)
    assert np.allclose(gradient.u, w[5:] @ closed.y_u, rtol=1e-9) and np.allclose(gradient.p, w[5:] @ closed.y_p, rtol=1e-9)
    step = 1e-5
    sides = [workspace.forward_jvp(0, q + s * step * dq, qd, dq=dq, dqd=dqd)[1].qdd for s in (1, -1)]
    bent = workspace.forward_second(0, q, qd, first=(dq, dqd), second=(dq,))
    assert np.allclose(bent.qdd, (sides[0] - sides[1]) / (2 * step), rtol=1e-6)
    many = workspace.forward_derivatives(0, [q, q], [qd, 2 * qd], threads=2, **also)
    assert np.array_equal(many.y[0], found.y) and np.array_equal(many.y_q[0], found.y_q) and many.y_p.shape == (2, 4, 2)
    for wrong, text in (
        ({"dq": dq, "du": [1]}, "of all coordinates, or"),
        ({"dp": dp}, "dp has 0 values"),
        ({"dq": dq[:2]}, "dq has 3 values"),
        ({"dq": dq, "outputs": "q(crank)"}, "q_u"),
        ({"dq": dq, "outputs": "positoin(coupler.C)"}, "position"),
        ({"dq": dq, "by": "crankmass"}, "crank_mass"),
    ):
        with pytest.raises((kempe.ArgumentError, ValueError), match=text):
            workspace.forward_jvp(0, q, qd, **wrong)
    with pytest.raises(kempe.ArgumentError, match="tuple"):
        workspace.forward_second(0, q, qd, first=dq, second=(dq,))


def test_hessians_and_determinants(four_bar):
    workspace, coordinates = four_bar.system().workspace(), four_bar.coordinates
    q, qd = workspace.close(0, [0.3, 0, 0], [1, 0, 0], hold="crank")
    u, words, step = coordinates.index(workspace.independent[0]), "acceleration(coupler.C)", 1e-4
    weights, unit = dict(qdd=[1, 2, 3], lam=[4, -1], y=[1, 0.5, 2]), dict(du=[[1], [0]], dud=[[0], [1]])
    H = workspace.forward_hessian(0, q, qd, **weights, **unit, outputs=words)
    for k, changed in enumerate((q, qd)):
        sides = []
        for sign in (1, -1):
            moved = [q.copy(), qd.copy()]
            moved[k][u] += sign * step
            gradient = workspace.forward_vjp(0, *workspace.close(0, *moved, hold=workspace.independent), closed=True, outputs=words, **weights)[1]
            sides.append(np.concatenate((gradient.u, gradient.ud)))
        assert np.allclose(H[k], (sides[0] - sides[1]) / (2 * step), rtol=1e-5, atol=1e-6 * abs(H).max())
    rows = {name: [each] * 3 for name, each in weights.items()}
    many = workspace.forward_hessian([0, 0, 0], [q] * 3, [qd] * 3, [[0, 0, 0]] * 3, **rows, **unit, outputs=words, threads=2)
    assert np.array_equal(many, [H] * 3)
    bent = workspace.forward_hessian(0, q, qd, by_q=np.eye(3)[0], by_qd=np.eye(3)[1], **unit)  # dependent coordinates bend along the motion
    assert np.allclose(bent, bent.T) and abs(bent).max() > 0.1
    assert workspace.forward_hessian(0, q, qd, qdd=[1, 0, 0]).shape == (0, 0)
    at = [workspace.close(0, q + step * k * np.eye(3)[u], hold=workspace.independent)[0] for k in (-1, 0, 1)]
    found = workspace.determinants(0, at, threads=2)
    assert np.isclose(found.by_u[1, 0], (found.logarithm[2] - found.logarithm[0]) / (2 * step), rtol=1e-6)
    assert np.isclose(found.by_uu[1, 0, 0], (found.by_u[2, 0] - found.by_u[0, 0]) / (2 * step), rtol=1e-6)
    J = workspace.evaluate(0, q).J
    assert np.isclose(np.exp(found.logarithm[1]), abs(np.linalg.det(np.delete(J, u, axis=1))))
    assert workspace.determinants(0, at, curvature=False).by_uu.shape == (0, 1, 1)
    for call, text in (
        (lambda: workspace.forward_hessian(0, q, qd, du=[1]), "du has a row of 1 numbers for each direction"),
        (lambda: workspace.forward_hessian(0, q, qd, du=[[1]], dud=[[1], [2]]), "for each direction"),
        (lambda: workspace.forward_hessian(0, q, qd, du=[[1]], dq=[[1, 0, 0]]), "of all coordinates, or"),
        (lambda: workspace.forward_hessian(0, [q], [qd], qdd=[1, 2, 3], du=[[1]]), "qdd has rows of 3 weights"),
        (lambda: workspace.forward_hessian(0, q, qd, lam=[np.nan, 0], du=[[1]]), "the weight of lambda of 'C.1' is nan"),
        (lambda: workspace.forward_hessian(0, q, qd, by_q=[np.nan, 0, 0], du=[[1]]), "the weight of q of"),
        (lambda: workspace.determinants(0, [q, q + 0.1]), "state 1: determinants of the loops need closed loops"),
    ):
        with pytest.raises((kempe.ArgumentError, kempe.FailedError), match=text):
            call()


def test_steps_with_derivatives(four_bar):
    workspace = four_bar.system().workspace()
    q, qd = workspace.close(0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
    u = [four_bar.coordinates.index(name) for name in workspace.independent]
    after, step = workspace.step(0, q, qd, 1e-3, Q=[0.1, 0, 0], steps=20, by="crank_mass"), 1e-5
    for k, start in enumerate((q, qd)):
        sides = []
        for sign in (1, -1):
            moved = [q.copy(), qd.copy()]
            moved[k][u[0]] += sign * step
            moved = workspace.close(0, *moved, hold=workspace.independent)
            end = workspace.step(0, *moved, 1e-3, Q=[0.1, 0, 0], steps=20, by="crank_mass")
            sides.append(np.concatenate((end.q[u], end.qd[u])))
        assert np.allclose(after.x_x[:, k], (sides[0] - sides[1]) / (2 * step), rtol=1e-6, atol=1e-8)
    run = four_bar.system().simulate(t_end=0.02, rtol=1e-11, output_step=0.02)
    assembly = four_bar.system().assemble()
    end = workspace.step(0, assembly.q, assembly.qd, 1e-3, steps=20)
    assert np.allclose(end.q, run.q[-1], atol=1e-9) and np.allclose(end.qd, run.qd[-1], atol=1e-7)
    for wrong, text in (({"h": 0.0}, "not zero"), ({"h": 1e-3, "steps": 0}, "at least one"), ({"h": 1e-3, "by": "crankmass"}, "crank_mass")):
        with pytest.raises(kempe.ArgumentError, match=text):
            workspace.step(0, q, qd, **wrong)


def test_summaries_have_no_words_of_the_command(four_bar, tmp_path):
    """Options of the command are keywords and calls here, in the summary of each kind of result."""

    def example(name):
        return kempe.Model(EXAMPLES / name / f"{name}.yaml")

    ensemble, folder = four_bar.ensemble({"crank": np.linspace(0.1, 0.3, 4)}), tmp_path / "with blank.kempe"
    failing = four_bar.ensemble({"crank": [0.3, 5]}).run_folder(tmp_path / "failing.kempe", t_end=0.1)
    made = {
        "check": four_bar.system().check(),
        "run": example("limousine").simulate(t_end=0.05),
        "shared loads": example("bennett").simulate(t_end=0.5),
        "compare": four_bar.system().compare(t_end=0.1),
        "linearize": example("quarter_car").system().linearize(),
        "modes": example("suspension").system().modes(),
        "equilibrium": example("suspension").system().equilibrium(),
        "inverse": example("delta_robot").system().inverse(actuators="A1,A2,A3"),
        "cycles": kempe.Model(EXAMPLES.parent / "tests/models/bautin.yaml").system().limit_cycles(sweep="mu=-0.3:0.2:6", outputs="state(x)"),
        "ensemble": ensemble.run(t_end=0.1),
        "statistics": ensemble.run(t_end=0.1).statistics(),
        "folder": ensemble.run_folder(folder, t_end=0.1),
        "failing": failing,
    }
    for name, result in made.items():
        for text in (str(result), result.text(full=True)):
            found = re.search(r"--[a-z]|-o FILE|kempe (?:simulate|gather|show)", text)
            assert not found, f"{name}: {text[max(0, found.start() - 60) : found.end() + 60]}"
    assert "condition numbers: text(full=True)" in str(made["check"])
    assert re.search(r'use formulation="\w+", .*rtol=[0-9.e-]+\n', str(made["compare"]))
    assert 'loads="least-norm" gives' in str(made["shared loads"])
    assert f"Model.instance({str(tmp_path / 'failing.kempe')!r}, 1)" in str(failing)
    assert kempe.Model.instance and failing.write
    with pytest.raises(kempe.ArgumentError, match="`coordinates` of the model lists all"):
        example("delta_robot").system().inverse()


def test_words_of_refused_derivatives(four_bar):
    workspace = four_bar.system().workspace()
    q, qd, bad = [0, 0, 0], [20, -22.5, 7.5], [0, np.nan, 0]
    for call, text in (
        (lambda: workspace.forward_jvp(0, q, qd, dq=bad), "the change of q of 'coupler' is nan: give a finite number"),
        (lambda: workspace.forward_vjp(0, q, qd, lam=bad[:2]), "the weight of lambda of 'C.2' is nan"),
        (lambda: workspace.forward_second(0, q, qd, first=(q,), second=(q, bad)), "the change of qd of 'coupler'"),
        (lambda: workspace.step(np.nan, q, qd, 1e-3), "the time t is nan"),
        (lambda: workspace.closed_derivatives(np.nan, q, qd), "the time t is nan"),
        (lambda: workspace.forward_derivatives(0, q, qd, outputs="lambda"), r"in lam_q, lam_qd, .* lambda\(C.1\)"),
    ):
        with pytest.raises(kempe.ArgumentError, match=text):
            call()


def test_forces_of_actuators_at_a_state(four_bar):
    workspace = four_bar.system().workspace()
    q, qd = workspace.close(0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
    found = workspace.closed_equations(0, q, qd)
    qdd = found.X @ [3.0] + found.drift
    crank, rocker = (four_bar.coordinates.index(name) for name in ("crank", "rocker"))
    for actuators, weights in (("crank", None), (["crank", "rocker"], None), ("rocker, crank", [1, 9])):
        tau = workspace.inverse_dynamics(0, q, qd, qdd, actuators=actuators, weights=weights)
        Q = np.zeros(3)
        for name, force in zip(actuators.replace(" ", "").split(",") if isinstance(actuators, str) else actuators, tau):
            Q[four_bar.coordinates.index(name)] = force
        assert np.allclose(workspace.forward_dynamics(0, q, qd, Q).qdd, qdd, rtol=1e-9)
        assert np.allclose(found.M @ [3.0] + found.C, found.X.T @ Q, rtol=1e-9)
    assert np.isclose(tau[0] / tau[1], 9 * found.X[rocker, 0] / found.X[crank, 0], rtol=1e-9)
    # Operational space: a point of the coupler moves with the given acceleration.
    outputs = four_bar.system().outputs("position(coupler.C).x")
    J, drift = outputs.closed_jacobian(0, q, qd)
    udd = np.linalg.solve(J, np.array([2.0]) - drift)
    force = workspace.inverse_dynamics(0, q, qd, found.X @ udd + found.drift, actuators="crank")
    now = workspace.forward_dynamics(0, q, qd, [force[0], 0, 0])
    assert np.isclose(four_bar.system().outputs("acceleration(coupler.C).x").at(0, q, qd, now.qdd, now.lam)[0], 2, rtol=1e-9)
    for wrong, text in (
        ({"actuators": "krank"}, "crank"),
        ({"actuators": "crank,crank"}, "given twice"),
        ({"actuators": "crank", "weights": [1, 2]}, "weights has 1 values"),
        ({"actuators": "crank", "weights": [0]}, "not a positive number"),
        ({"weights": [1]}, "weights need actuators"),
        ({"actuators": []}, "actuators is empty"),
    ):
        with pytest.raises((kempe.ArgumentError, ValueError), match=text):
            workspace.inverse_dynamics(0, q, qd, qdd, **wrong)
    with pytest.raises(kempe.FailedError, match="forces of actuators need closed loops"):
        workspace.inverse_dynamics(0, q + 0.1, qd, qdd, actuators="crank")
    for call in (workspace.closed_derivatives, workspace.closed_equations):
        with pytest.raises(kempe.FailedError, match="velocities that keep the loops closed.* has the rate"):
            call(0, q, qd + [0, 1, 0])
    by_names = workspace.forward_derivatives(0, q, qd, by="crank_mass, base")
    with pytest.raises(kempe.ArgumentError, match="same names and outputs"):
        workspace.forward_derivatives(0, q, qd, outputs="velocity(coupler.C).x", out=by_names)


def test_derivatives_at_a_state(four_bar):
    workspace = four_bar.system().workspace()
    q, qd = workspace.close(0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
    found, closed = workspace.forward_derivatives(0, q, qd), workspace.closed_derivatives(0, q, qd, Q=[0, 0, 0])
    qdd, lam = workspace.forward_dynamics(0, q, qd)
    assert np.allclose(found.qdd, qdd, rtol=1e-12) and np.array_equal(found.lam, closed.lam)
    step = 1e-5
    for j in range(3):
        sides = [workspace.forward_dynamics(0, q, qd, Q=s * step * np.eye(3)[j]) for s in (1, -1)]
        assert np.allclose(found.qdd_Q[:, j], (sides[0].qdd - sides[1].qdd) / (2 * step), rtol=1e-6, atol=1e-6)
        assert np.allclose(found.lam_Q[:, j], (sides[0].lam - sides[1].lam) / (2 * step), rtol=1e-6, atol=1e-6)
    u = [four_bar.coordinates.index(name) for name in workspace.independent]
    # The chain rule: along closed motions the change of all coordinates is q_u, of their rates qd_u.
    assert np.allclose(closed.udd_u, (found.qdd_q @ closed.q_u + found.qdd_qd @ closed.qd_u)[u], rtol=1e-10)
    assert np.allclose(closed.udd_ud, (found.qdd_qd @ closed.q_u)[u], rtol=1e-10)
    assert np.allclose(closed.udd_Q, found.qdd_Q[u], rtol=1e-10)
    for derive, before in ((workspace.forward_derivatives, found), (workspace.closed_derivatives, closed)):
        kept = [each.copy() for each in before]
        again = derive(0, q, 2 * qd)
        assert derive(0, q, 2 * qd, out=before) is before and all(map(np.array_equal, before, again))
        assert not np.array_equal(before.qdd, kept[0])
        assert all(map(np.array_equal, derive(0, list(q), qd, Q=[0, 0, 0], out=before), kept))
        for wrong in (again[:2], found if derive == workspace.closed_derivatives else closed, derive(0, [q], [qd])):
            with pytest.raises(kempe.ArgumentError, match="out must be an earlier result .* at one state"):
                derive(0, q, qd, out=wrong)
        with pytest.raises(kempe.ArgumentError, match="at 2 states"):
            derive(0, [q, q], [qd, qd], out=before)
        many = derive(0, [q, q], [qd, qd])
        assert derive(0, [q, q], [2 * qd, qd], out=many) is many
        assert all(map(np.array_equal, (each[0] for each in many), again)) and np.array_equal(many.qdd[1], kept[0])
    states = np.array([q, q + 0.01, q]), np.array([qd, qd, 2 * qd])
    for threads in (1, 2):
        many = workspace.forward_derivatives([0, 0, 0], *states, threads=threads)
        ones = [workspace.forward_derivatives(0, *state) for state in zip(*states)]
        assert all(np.array_equal(a, np.array(b)) for a, b in zip(many, zip(*ones)))
        rows = workspace.closed_derivatives(0, states[0][::2], states[1][::2], threads=threads)
        assert rows.udd_Q.shape == (2, 1, 3) and np.array_equal(rows.udd_Q[0], closed.udd_Q)
        with pytest.raises(kempe.FailedError, match="state 1: .* close the state first"):
            workspace.closed_derivatives(0, *states, threads=threads)
    with pytest.raises(ValueError, match="q has 3 values"):
        workspace.forward_derivatives(0, q[:2], qd)
    with pytest.raises(kempe.ArgumentError, match=r"contact 'rear1' opens and closes.*\(stick\)"):
        walker = kempe.Model(ROOT / "examples/jansen_walker/jansen_walker.yaml").system().workspace("slip")
        walker.forward_derivatives(0, np.zeros(walker.n), np.zeros(walker.n))
    with pytest.raises(kempe.FailedError):
        workspace.forward_derivatives(0, [np.nan, 0, 0], qd)


def test_derivatives_by_names(four_bar):
    """By inputs and parameters, compared with other models; derivatives at many states have the bits of one."""
    system = four_bar.system()
    workspace, names = system.workspace(), ["crank_mass", "rocker"]
    q, qd = workspace.close(0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
    found = workspace.forward_derivatives(0, q, qd, by=names)
    closed = workspace.closed_derivatives(0, q, qd, by="crank_mass,rocker")
    inverse = workspace.inverse_derivatives(0, q, qd, found.qdd, by=names)
    step = 1e-5
    for k, value in enumerate((1, 0.7)):
        sides = [kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", parameters={names[k]: value + s * step}).system().workspace() for s in (1, -1)]
        each = [side.forward_dynamics(0, q, qd) for side in sides]
        assert np.allclose(found.qdd_p[:, k], (each[0].qdd - each[1].qdd) / (2 * step), rtol=1e-5, atol=1e-5)
        assert np.allclose(found.lam_p[:, k], (each[0].lam - each[1].lam) / (2 * step), rtol=1e-5, atol=1e-5)
        each = [side.inverse_dynamics(0, q, qd, found.qdd) for side in sides]
        assert np.allclose(inverse.Q_p[:, k], (each[0] - each[1]) / (2 * step), rtol=1e-5, atol=1e-5)
        each = [side.close(0, q, qd, hold=workspace.independent) for side in sides]
        assert np.allclose(closed.q_p[:, k], (each[0][0] - each[1][0]) / (2 * step), rtol=1e-5, atol=1e-5)
        assert np.allclose(closed.qd_p[:, k], (each[0][1] - each[1][1]) / (2 * step), rtol=1e-5, atol=1e-5)
    assert closed.udd_p.shape == (1, 2) and np.allclose(inverse.Q_qdd, workspace.evaluate(0, q, qd).M)
    with pytest.raises(kempe.ArgumentError, match="'crnk'"):
        workspace.closed_derivatives(0, q, qd, by=["crnk"])
    assert workspace.forward_derivatives(0, q, qd).qdd_p.shape == (3, 0)
    with pytest.raises(kempe.ArgumentError, match="out must be an earlier result"):
        workspace.forward_derivatives(0, q, qd, by=["rocker"], out=found)
    rows = workspace.closed_derivatives(0, [q, q, q], [qd, 2 * qd, qd], by=names, threads=2)
    assert np.array_equal(rows.udd_p[2], closed.udd_p) and np.array_equal(rows.q_p[0], closed.q_p)
    pole = kempe.Model(ROOT / "examples/cart_pole/cart_pole.yaml").system().workspace()
    for value in (0, 3):
        pole.set_input("u", value)
        by_u = pole.forward_derivatives(0, [0, 0.4], [0, 1], by="u")
        pole.set_input("u", value + 1)
        assert np.allclose(by_u.qdd + by_u.qdd_p[:, 0], pole.forward_dynamics(0, [0, 0.4], [0, 1]).qdd, rtol=1e-12)


def test_two_threads_with_a_workspace_each(four_bar):
    run, system = four_bar.simulate(t_end=0.5), four_bar.system()
    expected = system.workspace().forward_states(run.t, run.q, run.qd)
    workspaces = [system.workspace() for _ in range(2)]
    halves = np.array_split(np.arange(len(run)), 2)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        made = list(pool.map(lambda w, k: w.forward_states(run.t[k], run.q[k], run.qd[k]), workspaces, halves))
    assert np.array_equal(np.concatenate([each.qdd for each in made]), expected.qdd)


def test_right_side_for_scipy(four_bar):
    run, workspace = four_bar.simulate(t_end=0.5, rtol=1e-10), four_bar.system().workspace()
    y = np.concatenate([run.q[3], run.qd[3]])
    assert np.allclose(workspace.rates(run.t[3], y), np.concatenate([run.qd[3], run.qdd[3]]))
    if importlib.util.find_spec("scipy"):
        from scipy.integrate import solve_ivp

        start = np.concatenate([run.q[0], run.qd[0]])
        solved = solve_ivp(workspace.rates, (0, 0.5), start, method="DOP853", rtol=1e-10, atol=1e-10)
        assert np.allclose(solved.y[:3, -1], run.q[-1], atol=1e-6)


# -- steppers and outputs --------------------------------------------------------------------------------


def test_stepper_is_the_run(four_bar):
    system = four_bar.system()
    run = system.simulate(t_end=1, output_step=0.1)
    stepper = system.stepper(t_end=1)
    for k in range(1, 11):
        stepper.keep_inputs()
        stepper.advance(run.t[k])
        assert np.array_equal(stepper.q, run.q[k]) and np.array_equal(stepper.lam, run.lam[k])
    with pytest.raises(kempe.ArgumentError):
        stepper.step()
    assert stepper.work["steps"] > 10 and stepper.reason == "" and "1 s" in repr(stepper)
    states = list(system.stepper(t_end=1))
    assert states[-1].t == 1 and np.allclose(states[-1].q, run.q[-1], atol=1e-6) and states[0].qdd.shape == (3,)


def test_stepper_states(four_bar):
    stepper = four_bar.system().stepper(t_end=2)
    stepper.advance(0.5)
    twin = stepper.copy()
    saved = stepper.save()
    stepper.advance(1.0)
    twin.advance(1.0)
    end = stepper.state
    assert np.allclose(end.q, twin.q, atol=1e-12)
    stepper.restore(saved)
    assert stepper.t == 0.5
    stepper.advance(1.0)
    assert np.array_equal(end.q, stepper.q)
    assert stepper.set_state(end.q, np.zeros(3)) < 1e-9 and np.allclose(stepper.qd, 0)
    stepper.set_stop(1.25)
    assert stepper.set_parameters(crank_mass=1.5) < 1e-9
    stepper.reset()
    assert stepper.t == 0


def test_inputs():
    model = pendulum()
    assert model.inputs == {"push": "N m"} and model.input_value("push", 0.3) == 0
    stepper = model.system().stepper(t_end=1)
    stepper.set_input("push", 5.0)
    stepper.advance(0.5)
    assert stepper.input("push") == 5 and stepper.q[0] != pendulum().simulate(t_end=0.5).q[-1, 0]
    stepper.set_input("push", 1.0, rate=2.0)
    stepper.advance(1.0)
    assert np.isclose(stepper.input("push"), 2.0)
    workspace = model.system().workspace()
    free = workspace.forward_dynamics(0, [0.0], [0.0]).qdd[0]
    workspace.set_input("push", 4.0)
    assert np.isclose(workspace.forward_dynamics(0, [0.0], [0.0]).qdd[0] - free, 4 / 4)
    with pytest.raises(kempe.ArgumentError, match="there is no input 'pull'; there are push"):
        stepper.set_input("pull", 1)
    assert pendulum(push=3).input_value("push", 0) == 3


def test_outputs(four_bar):
    system = four_bar.system()
    run, outputs = four_bar.simulate(t_end=0.5), system.outputs(["position(coupler.C)", "velocity(coupler.C)"])
    assert len(outputs) == 6 and outputs.units["position.coupler.C.x"] == "m"
    values = outputs.at_row(run, 5)
    assert np.array_equal(values[:3], run["position(coupler.C)"][5])
    assert np.allclose(outputs.at(run.t[5], run.q[5], run.qd[5], run.qdd[5], run.lam[5]), values)
    J, jdqd = outputs.jacobian(0.0, run.q[5], run.qd[5])
    assert np.allclose(J[:3] @ run.qd[5], values[3:]) and J.shape == (6, 3) and jdqd.shape == (6,)
    outputs.choose("crank")
    closed, drift = outputs.closed_jacobian(0.0, run.q[5], run.qd[5])
    assert (
        outputs.independent == ("crank",)
        and np.allclose(closed[:3, 0] * run.qd[5, 0], values[3:])
        and drift.shape == (6,)
    )
    outputs.choose()
    stepper = system.stepper(t_end=1)
    assert np.allclose(outputs.at_stepper(stepper)[:3], run["position(coupler.C)"][0])
    with pytest.raises(kempe.ArgumentError):
        system.outputs("nonsense")


def test_between_rows(four_bar):
    system = four_bar.system()
    many = system.simulate(t_end=0.5, output_step=0.01)
    few = system.simulate(t_end=0.5, output_step=0.5, keep_dense=True)
    states, one = few.at(many.t[::-1]), few.at(many.t[7])
    assert len(few) == 2 and states.lam.shape == many.lam.shape and one.q.shape == (3,)
    for name in ("q", "qd", "qdd", "lam"):
        assert np.array_equal(getattr(states, name)[::-1], getattr(many, name))
        assert np.array_equal(getattr(one, name), getattr(many, name)[7])
    outputs = system.outputs("position(coupler.C)")
    table = many.outputs("position(coupler.C)").to_dict()
    assert np.array_equal(outputs.at_time(few, many.t), np.stack(list(table.values())[1:], axis=1))
    assert outputs.at_time(few, 0.123).shape == (3,) and few.at([]).q.shape == (0, 3)
    with pytest.raises(kempe.ArgumentError, match="not within the run"):
        few.at([0.1, 0.6])
    with pytest.raises(kempe.ArgumentError, match="keep_dense"):
        many.at(0.1)


def test_threads_share_many_states():
    model = kempe.Model(EXAMPLES / "cart_pole/cart_pole.yaml")
    workspace, n = model.system().workspace(), len(model.coordinates)
    q, qd = np.random.default_rng(1).normal(size=(2, 1001, n))
    workspace.set_input("u", 2.5)
    for threads in (2, 3, 0):
        for name, given in (("evaluate", (q, qd)), ("forward", (q, qd)), ("inverse", (q, qd, q))):
            one = getattr(workspace, f"{name}_states")(np.arange(1001.0), *given)
            shared = getattr(workspace, f"{name}_states")(np.arange(1001.0), *given, threads=threads)
            assert all(np.array_equal(a, b) for a, b in zip(one, shared)), (name, threads)
    workspace.set_input("u", -1)
    assert np.array_equal(workspace.forward_states(0, q, qd, threads=3).qdd, workspace.forward_states(0, q, qd).qdd)
    assert workspace.forward_states(0, q[:1], qd[:1], threads=3).qdd.shape == (1, n)
    q[700:] = np.nan
    with pytest.raises(kempe.FailedError, match="state 700: "):
        workspace.forward_states(0, q, qd, threads=3)


@pytest.mark.parametrize("name", ["four_bar", "andrews", "cart_pole"])
def test_states_in_lanes_have_the_bits_of_single_ones(name):
    workspace = kempe.Model(EXAMPLES / f"{name}/{name}.yaml").system().workspace()
    t, (q, qd) = np.linspace(0, 1, 1501), np.random.default_rng(2).normal(size=(2, 1501, workspace.n))
    for threads in (1, 2):
        many = workspace.evaluate_states(t, q, qd, threads=threads)
        for k in (0, 7, 8, 701, 1499, 1500):
            one = workspace.evaluate(t[k], q[k], qd[k])
            assert all(np.array_equal(a[k], b) for a, b in zip(many, one)), (threads, k)
        made = workspace.forward_states(t, q, qd, Q=qd, threads=threads)
        for k in (0, 7, 8, 701, 1499, 1500):
            one = workspace.forward_dynamics(t[k], q[k], qd[k], Q=qd[k])
            assert all(np.array_equal(a[k], b) for a, b in zip(made, one)), (threads, k)
    still = workspace.evaluate_states(0.5, q[:800])
    assert np.array_equal(workspace.C, still.C[-1]) and np.array_equal(workspace.M, many.M[799])
    q[1005] = np.nan
    with pytest.raises(kempe.FailedError, match="state 1005"):
        workspace.evaluate_states(t, q, qd, out=many)
    with pytest.raises(kempe.FailedError, match="state 1005"):
        workspace.forward_states(t, q, qd)


def test_force_of_many_threads():
    """Callbacks run in the threads; their exceptions are raised."""
    calls = []

    def force(t, q, qd):
        calls.append(threading.get_ident())
        time.sleep(1e-3)  # so that no thread has ended before the next one begins
        if t > 90:
            raise ZeroDivisionError(f"at {t}")
        return -qd

    workspace = pendulum().system(force=force).workspace()
    states = np.zeros((100, 1)), np.ones((100, 1))
    assert workspace.forward_states(0, *states, threads=4).qdd.shape == (100, 1) and len(set(calls)) > 1
    with pytest.raises(ZeroDivisionError, match="at 9"):
        workspace.forward_states(np.arange(100), *states, threads=4)
    assert workspace.forward_states(0, *states, threads=4).qdd.shape == (100, 1)


# -- states and friction that sticks -------------------------------------------------------------------------

STATES = {"p": {"start": "2 MPa", "rate": "(3e6 - p)/0.1"}, "n": {"sample": "10 ms", "next": "n + 1", "scale": 1}}


def cylinder():
    """A load on a cylinder, with a pressure and a counter, built in code."""
    built = kempe.Builder("cylinder").body("load", joint="x", kind="prismatic", axis=(0, 0, 1), mass=200)
    for name, state in STATES.items():
        built.text("states", name, state)
    return built.force("push", joint="x", force="p*1e-3 - 2e4*qd(x)").finish()


def test_states():
    """A pressure that follows its exact solution, everywhere that Python shows it."""
    model = cylinder()
    assert model.states == ("p", "n") and model.coordinates == ("x", "p", "n")
    assert "states</th>" in model._repr_html_() and pickle.loads(pickle.dumps(model)).states == model.states
    run = model.simulate(t_end=0.5, output_step=0.05, keep_dense=True)
    exact = 3e6 - 1e6 * np.exp(-run.t / 0.1)
    assert np.allclose(run["state(p)"], exact, rtol=1e-6) and np.array_equal(run["p"], run["state.p"])
    assert np.array_equal(run["state"], run.qd[:, 1:]) and np.array_equal(run["n"][1:], 5 * np.arange(1, 11))
    assert np.isclose(run.at(0.123).qd[1], 3e6 - 1e6 * np.exp(-1.23), rtol=1e-6)
    stepper = model.system().stepper(t_end=0.5)
    stepper.advance(0.25)
    assert np.isclose(stepper.qd[1], exact[5], rtol=1e-6) and stepper.qd[2] == 25
    starts = model.ensemble({"state.p": [1e6, 2e6]}).run(t_end=0.1)
    assert np.allclose(starts.qd[:, 1], 3e6 - np.array([2e6, 1e6]) / np.e, rtol=1e-6)


def test_friction_that_sticks():
    """A block that slides to rest under friction, and stays there."""
    built = kempe.Builder("block").body("block", joint="s", kind="prismatic", axis=(1, 0, 0), mass=2).qd("s", 3)
    model = built.text("forces", "rub", {"joint": "s", "friction": {"force": 4, "static": 5}}).finish()
    run = model.simulate(t_end=2, output_step=0.25)
    assert np.allclose(run.qd[:, 0], np.maximum(3 - 2 * run.t, 0), atol=1e-9)
    assert np.isclose(run.q[-1, 0], 9 / 4) and np.allclose(run.lam[:6, 0], -4) and run.lam[-1, 0] == 0
    assert np.array_equal(run["force(rub)"], run.lam[:, 0])
    last = run.log.row(-1)
    assert np.isclose(last["t"], 1.5) and last["kind"] == "friction" and "rub" in last["text"]
    assert "rub" in str(model.parsed()["forces"])


# -- other studies ------------------------------------------------------------------------------------------


def test_kinematics(four_bar):
    sweep = four_bar.system().kinematics(sweep={"crank": (0, 6, 31)})
    assert sweep.status == "complete" and sweep.reason == "" and sweep.rows.row_count == 31
    assert sweep.dead_centres.row_count == 0 and sweep.change_points.row_count == 0
    blocked = four_bar.system().kinematics(sweep={"rocker": ("0 deg", "90 deg", 31)})
    assert blocked.status == "stopped" and blocked.dead_centres.row_count == 1 and "dead" in repr(blocked)
    crank_rocker = kempe.Model(EXAMPLES / "crank_rocker/crank_rocker.yaml")
    coordinate = crank_rocker.coordinates[0]
    assert "<svg" in crank_rocker.system().kinematics(sweep={coordinate: (0, 6)}).svg()


def test_equilibrium():
    system = kempe.Model(EXAMPLES / "governor/governor.yaml").system()
    found = system.equilibrium(rates="shaft=5.5")
    assert len(found) == 1 and found.stability() in ("stable", "neutral") and found.is_stable() is True
    assert len(system.equilibrium(rates="shaft=5.5", global_=True)) >= 1
    assert found.equilibria["stability"][0] == found.stability(0) and found.history.row_count > 0


def test_warnings_have_the_words_of_python():
    model = kempe.Model(EXAMPLES / "n_four_bar_spatial/n_four_bar_spatial.yaml")
    with pytest.warns(kempe.KempeWarning, match=r'loads="least-norm" gives the smallest shares'):
        model.system().inverse(actuators=model.coordinates[0])


@pytest.mark.parametrize("name", ["toggle_press", "scissor_lift", "contact_arc", "friction_stack", "planetary_gearbox", "limousine"])
def test_outputs_at_an_equilibrium(name):
    """They are the outputs of a run that starts there."""
    file = EXAMPLES / f"{name}/{name}.yaml"
    model = kempe.Model(file if file.exists() else EXAMPLES.parent / f"tests/models/{name}.yaml")
    found = model.system().equilibrium().equilibria
    here = [{c: found[f"{kind}.{c}"][0] for c in model.coordinates} for kind in ("q", "qd")]
    run = model.simulate(q=here[0], qd=here[1], t_end=1e-9, output_step=1e-9, no_convergence_check=True).rows
    names = [c for c in found if c in run and not c.startswith(("q.", "qd.", "lambda.", "load."))]
    assert names
    for c in names:
        size = max(abs(run[other][0]) for other in run if other == c or other.rsplit(".", 1)[0] == c.rsplit(".", 1)[0])
        assert abs(found[c][0] - run[c][0]) <= 1e-6 * max(size, 1e-3), c


def test_inverse():
    found = kempe.Model(EXAMPLES / "driven_slider_crank/driven_slider_crank.yaml").system().inverse()
    assert found.status == "complete" and found.dof == found.rank and found.residual < 1e-9 and found.rows.row_count > 2
    assert found.loads_not_unique == ""


def test_a_motion_with_states():
    """A trajectory of a model with states is a motion, data and a reference, also from a pickle."""
    text = """kempe: 1
states: {i: {rate: "qd(A) - i", start: 0.2}}
bodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}}}
forces: {m: {joint: A, torque: "2 - i"}}
gravity: [0, -9.81, 0]
run: {t_end: 1, outputs: [q]}
"""
    model = kempe.Model.from_text(text)
    run = model.simulate()
    whole = kempe.Model.from_text(text.replace("[q]", "[q, qd, qdd, state]")).simulate()
    for motion in (run, whole, pickle.loads(pickle.dumps(whole))):
        assert abs(model.system().inverse(motion=motion, actuators="A").rows["tau.A"]).max() < 1e-9
    assert model.simulate(reference=run).trusted


def test_delays_of_a_state_space(tmp_path):
    linear = (
        kempe.Model.from_text(
            "kempe: 1\nstates: {late: {delay: q(x), time: 2}}\n"
            "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
            "forces: {f: {joint: x, force: 0.3*late - q(x) - 0.1*qd(x)}}\n"
        )
        .system()
        .linearize(inputs="effort(x)", outputs="q(x)")
    )
    assert linear.delays == {"delay(late)": 2.0}
    assert list(linear.inputs) == ["effort(x)", "delay(late)"] and list(linear.outputs) == ["q.x", "delay(late)"]
    s = 0.7j  # the response equals the response of the state space whose last input is e^(-2 s) times its last output
    response = linear.C @ np.linalg.solve(s * np.eye(2) - linear.A, linear.B) + linear.D
    late = np.exp(-2 * s)
    closed = response[0, 0] + response[0, 1] * late * response[1, 0] / (1 - late * response[1, 1])
    assert abs(closed - 1 / (s * s + 0.1 * s + 1 - 0.3 * late)) < 1e-13
    linear.write(tmp_path / "late.npz")
    with np.load(tmp_path / "late.npz") as kept:
        assert list(kept["delays"]) == ["delay(late)"] and kept["delay_times"].tolist() == [2.0]
    if importlib.util.find_spec("scipy"):
        with pytest.raises(ValueError, match=r"ends at delay\(late\)"):
            linear.to_scipy()


def test_linearize(tmp_path):
    linear = (
        kempe.Model(EXAMPLES / "suspension/suspension.yaml")
        .system()
        .linearize(inputs="force(chassis.R.z)", outputs="q")
    )
    p = len(linear.states) // 2
    M, G, K, L, N = linear.M, linear.G, linear.K, linear.L, linear.N
    assert (
        linear.A.shape == (2 * p, 2 * p)
        and linear.B.shape == (2 * p, 1)
        and linear.C.shape[0] == len(linear.outputs) == len(linear.y)
    )
    assert np.allclose(linear.A[p:, :p], -np.linalg.solve(M, K), atol=1e-6 * np.abs(linear.A).max())
    assert (
        N.shape[1] == p
        and linear.Nd.shape == N.shape
        and G.shape == M.shape
        and L.shape == (p, 1)
        and linear.D.shape == (linear.C.shape[0], 1)
    )
    assert list(linear.inputs.values()) == ["N"] and linear.is_equilibrium and linear.q.shape == linear.qd.shape
    linear.write(tmp_path / "car.npz")
    with np.load(tmp_path / "car.npz") as kept:
        assert np.array_equal(kept["A"], linear.A)
    if importlib.util.find_spec("scipy"):
        assert np.array_equal(linear.to_scipy().A, linear.A)


def test_modes():
    modes = kempe.Model(EXAMPLES / "quarter_car/quarter_car.yaml").system().modes()
    assert modes.zero_count == 0 and not modes.is_unstable and len(modes.eigenvalues) == modes.modes.row_count
    assert modes.rows.row_count and modes.critical.row_count == 0 and modes.state.row_count == 1
    assert np.all(modes.eigenvalues.real < 0) and modes.z.size == 0
    sampled = kempe.Model(EXAMPLES / "hydraulic_excavator/hydraulic_excavator.yaml").system().modes()
    slow = abs(sampled.z) > 0.1
    np.testing.assert_allclose(np.exp(0.01 * sampled.eigenvalues[slow]), sampled.z[slow], rtol=1e-12)
    assert slow.sum() == 18 and sampled.is_unstable and "unstable" in sampled._repr_html_()


def test_limit_cycles(tmp_path):
    """r' = r (mu + r^2 - r^4)."""
    cycles = kempe.Model(EXAMPLES.parent / "tests/models/bautin.yaml").system().limit_cycles(sweep="mu=-0.5:0.25:4", outputs="state(x)")
    rows = cycles.rows
    assert cycles.branch_count == 1 and cycles.count() == rows.row_count == cycles.states.row_count
    r = rows["state.x.amplitude"][1:]
    np.testing.assert_allclose(r**2 * (1 - r**2), -rows["mu"][1:], atol=1e-8)
    assert list(rows["point"]).count("fold") == 1 and "fold" in str(cycles)
    assert cycles.equilibria.row_count == 4 and cycles.critical.row_count == 1
    assert cycles.multipliers.row_count == 3 * (rows.row_count - 1)
    cycles.write_picture(tmp_path / "diagram.svg")
    cycles.write_report(tmp_path / "diagram.html")
    assert "Amplitude" in (tmp_path / "diagram.svg").read_text() and (tmp_path / "diagram.html").stat().st_size > 1000


def test_comfort():
    system = kempe.Model(EXAMPLES / "ride/shaken_seat.yaml").system()
    comfort = system.comfort(from_=5, t_end=10)
    known = np.genfromtxt(EXAMPLES / "ride/shaken_seat.csv", delimiter=",", names=True, skip_header=2)
    assert list(comfort.signals["direction"]) == ["longitudinal", "lateral", "vertical"]
    windows = [comfort.windows[name][0] for name in comfort.windows.names[1:]]
    np.testing.assert_allclose(windows, [known[name][0] for name in ("along_Wd", "across_Wd", "up_Wb")], rtol=2e-5)
    assert comfort.mean_comfort == pytest.approx((6 * np.hypot(np.hypot(*windows[:2]), windows[2]),), rel=1e-12)
    assert "N_MV" in str(comfort)


def test_response():
    model = kempe.Model(EXAMPLES / "quarter_car/quarter_car.yaml")
    system = model.system()
    response = system.response(inputs=f"effort({model.coordinates[0]})", outputs="q", frequencies="0.5:20:5")
    assert (
        response.rows.row_count == 5
        and response.peaks.names[0] == "input"
        and "<svg" in response.svg()
        and str(response)
    )


def test_sensitivity_is_the_slope(four_bar):
    found = four_bar.sensitivity(parameters="crank_mass", outputs="q(rocker)", t_end=0.3)
    step, path = 1e-5, EXAMPLES / "four_bar/four_bar.yaml"
    ends = [kempe.Model(path, crank_mass=1 + d).simulate(t_end=0.3, rtol=1e-11).q[-1, 2] for d in (-step, step)]
    assert np.isclose(found.rows["q.rocker/crank_mass"][-1], (ends[1] - ends[0]) / (2 * step), rtol=1e-5)
    assert found.method == "forward" and found.work["steps"] > 0 and found.parameters["parameter"][0] == "crank_mass"


def test_texts_among_the_options_of_a_run(four_bar):
    """Texts and numbers of the run inside the options of a study reach it, in any order."""
    for integrator in ("dop853", "radau9"):
        found = four_bar.sensitivity(integrator=integrator, t_end=0.1, parameters="crank", outputs="q(rocker)", independent="crank", rtol=1e-7)
        assert f"integrator {integrator}" in found.text() and "rtol 1e-07" in found.text()
    flows = [four_bar.flow(0.1, variables="crank", outputs="q(rocker)", rtol=1e-11, integrator=name)() for name in ("dop853", "radau9")]
    np.testing.assert_allclose(flows[0].jacobian, flows[1].jacobian, rtol=1e-8)
    assert not np.array_equal(flows[0].jacobian, flows[1].jacobian)
    with pytest.raises(kempe.ArgumentError, match="'rk45'"):
        four_bar.fit(data={"t": [0, 0.1], "q(crank)": [0, 0.1]}, parameters="crank_mass", integrator="rk45")


def test_flow_through_an_impact():
    """A ball that falls from x, strikes at t0 and rebounds, at t = 0.2 and 0.7 s: by closed forms."""
    model = kempe.Model.from_text(
        "kempe: 1\nparameters: {e: 0.8, g: 9.81}\ngravity: [-g, 0, 0]\n"
        "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
        "contacts: {floor: {joint: x, lower: 0, restitution: e}}\nstart: {q: {x: 1}}\n"
    )
    flow = model.flow([0.2, 0.7], variables="q.x,qd.x,e", outputs="q,qd", rtol=1e-11)
    assert flow.names == ("q.x", "qd.x") and flow.variables == ("q.x", "qd.x", "e")
    np.testing.assert_array_equal(flow.start, [1, 0, 0.8])

    def motion(x, v, e, t, g=9.81):
        t0 = (v + np.sqrt(v * v + 2 * g * x)) / g
        rebound = -e * (v - g * t0)
        after = t - t0
        return np.array([x + v * t - g * t * t / 2, v - g * t] if t < t0 else [rebound * after - g * after**2 / 2, rebound - g * after])

    for x, v, e in ((1, 0, 0.8), (0.9, 0.3, 0.5)):
        found = flow([x, v, e])
        for row, t in enumerate((0.2, 0.7)):
            np.testing.assert_allclose(found.values[row], motion(x, v, e, t), rtol=1e-9, atol=1e-9)
            for k in range(3):
                step = 1e-20j * np.eye(3)[k]
                a, b, c = np.array([x, v, e]) + step
                t0 = (b + np.sqrt(b * b + 2 * 9.81 * a)) / 9.81
                rebound, after = -c * (b - 9.81 * t0), t - t0
                exact = [a + b * t, b] if t < t0.real else [rebound * after - 9.81 * after**2 / 2, rebound - 9.81 * after]
                np.testing.assert_allclose(found.jacobian[row, :, k], np.imag(exact) / 1e-20, rtol=1e-8, atol=1e-8)
    by_name = flow({"qd.x": 0.3, "e": 0.5, "q.x": 0.9})
    np.testing.assert_array_equal(by_name.jacobian, flow([0.9, 0.3, 0.5]).jacobian)
    with pytest.raises(KeyError, match="no variable 'z'"):
        flow({"z": 1})
    with pytest.raises(kempe.ArgumentError, match="'e' is not finite"):
        flow([1, 0, float("nan")])
    for times, words in (([], "needs one"), ([0.0], "no time after 0"), ([1, 1], "ascend"), (-1, "begin at 0")):
        with pytest.raises(kempe.ArgumentError, match=words):
            model.flow(times, variables="e")
    for word in ("t_end", "output_step"):
        with pytest.raises(kempe.ArgumentError, match=f"give no {word}"):
            model.flow(1, variables="e", **{word: 0.5})
    with pytest.raises(kempe.FailedError, match="backwards at t"):
        kempe.Model(EXAMPLES / "four_bar/four_bar.yaml").sensitivity(
            method="adjoint", outputs="q(rocker)", t_end=2, integrator="dop853", max_steps=550
        )


def test_flows_of_two_intervals_are_one(four_bar):
    """The Jacobian of a flow over 0.2 s is the product of those over 0.1 s each, through the closed loop."""
    model = four_bar
    whole, half = (model.flow(t, variables="q.crank,qd.crank", outputs="q,qd", rtol=1e-11) for t in (0.2, 0.1))
    places = [half.names.index(name) for name in half.variables]
    first = half()
    second = half(first.values[places])
    full = whole()
    np.testing.assert_allclose(second.values, full.values, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(second.jacobian @ first.jacobian[places], full.jacobian, rtol=1e-7, atol=1e-7)


def test_flow_by_an_input():
    """A step of a controller: the state of a cart with a pole after a force that is constant."""
    model = kempe.Model(EXAMPLES / "cart_pole/cart_pole.yaml")
    flow = model.flow(0.02, variables="q.x,q.phi,qd.x,qd.phi,u", outputs="q,qd", rtol=1e-11)
    found = flow({"u": 2.0})
    ahead, behind = (flow({"u": 2.0 + step}).values for step in (1e-3, -1e-3))
    np.testing.assert_allclose(found.jacobian[:, 4], (ahead - behind) / 2e-3, rtol=1e-7, atol=1e-9)
    assert abs(found.jacobian[:, 4]).min() > 1e-5
    with pytest.raises(kempe.ArgumentError, match="no parameter 'v'"):
        model.flow(0.02, variables="v")


def test_gradient_is_the_slope():
    path = EXAMPLES / "coupler_fit/coupler_fit.yaml"
    model = kempe.Model(path)
    driven = model.coordinates[0]
    names = [name for name in ("crank", "coupler", "rocker") if name in str(model)][:2]
    gradient = model.gradient(parameters=names, driven=driven)
    values = gradient.at(0.1)
    start = np.array([model.parameters[name] for name in names])
    assert values.shape == (len(gradient.names),) and gradient.jacobian.shape == (len(values), 2)
    assert gradient.by_driven.shape == (len(values), 1) and gradient.q.shape == (len(model.coordinates),)
    assert gradient.q_jacobian.shape == (len(model.coordinates), 2)
    first = gradient.by_driven[:, 0].copy()
    ahead, behind = gradient.at(0.1 + 1e-6), gradient.at(0.1 - 1e-6)
    assert np.allclose(first, (ahead - behind) / 2e-6, atol=1e-5)
    if start is not None:
        gradient.set(start)
        assert np.allclose(gradient.at([0.1]), values)


def test_fit_finds_the_mass(tmp_path):
    path, data = EXAMPLES / "four_bar/four_bar.yaml", tmp_path / "measured.csv"
    kempe.Model(path, crank_mass=2).simulate(t_end=1).rows.write(data)
    fit = kempe.Model(path).fit(data=data, columns="q.rocker", parameters={"crank_mass": (0.1, 5)})
    low, high = fit.intervals["crank_mass"]
    assert abs(fit.values["crank_mass"] - 2) < 1e-6 and low <= fit.values["crank_mass"] <= high
    assert 0 < fit.errors["crank_mass"] < 1e-5 and fit.rank == 1
    assert fit.parameters["parameter"][0] == "crank_mass" and fit.correlation["crank_mass"][0] == 1
    assert fit.columns["column"][0] == "q.rocker" and "q.rocker.residual" in fit.rows.names and "crank_mass" in str(fit)
    kempe.Model(path, crank_mass=3).simulate(t_end=1).rows.write(tmp_path / "other.csv")
    words = ["crank_mass@1:0.1:5", "crank_mass@2:0.1:5"]
    both = kempe.Model(path).fit(data=data, files=[tmp_path / "other.csv"], columns="q.rocker", parameters=words)
    assert abs(both.values["crank_mass@1"] - 2) < 1e-6 and abs(both.values["crank_mass@2"] - 3) < 1e-6
    fit.write_report(tmp_path / "fit.html")
    assert "crank_mass" in (tmp_path / "fit.html").read_text()


def test_optimum_is_less_than_its_neighbours(four_bar, tmp_path):
    found = four_bar.optimize(minimize="max(qd(rocker))", parameters={"base": (0.85, 0.95)}, t_end=0.3)

    def highest(base):
        run = kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", base=base).simulate(t_end=0.3, output_step=1e-4)
        return run.rows["qd.rocker"].max()

    best = found.values["base"]
    assert found.method == "slopes" and found.kept and np.isclose(found.quantity, highest(best), rtol=1e-6)
    assert all(highest(best + away) > found.quantity for away in (-0.002, 0.002))
    assert list(found.values) == ["base"] and found.parameters["parameter"][0] == "base" and "base" in str(found)
    assert found.limits.row_count == 0 and found.starts.row_count == 1 and found.history.row_count >= 1
    found.write_report(tmp_path / "optimum.html")
    assert "base" in (tmp_path / "optimum.html").read_text()


def test_compare(four_bar):
    lines = []
    four_bar.on_progress(lines.append)
    compared = four_bar.system().compare(t_end=0.2, rtols=[1e-4, 1e-6], formulations="reduced", integrators=["dop853"])
    assert compared.runs.row_count >= 2 and compared.levels.names[0] == "formulation" and str(compared)
    assert any("rtol" in line for line in lines)


def test_ensemble(four_bar, tmp_path):
    lengths = np.linspace(0.28, 0.32, 5)
    batch = four_bar.ensemble({"crank_mass": 1.0 + lengths, "q.crank": 0.0}).run(t_end=0.2)
    assert len(batch) == 5 and batch.status == ["complete"] * 5 and batch.reason == [""] * 5 and str(batch)
    assert batch.q.shape == batch.qd.shape == (5, 3) and np.array_equal(batch.instances["q.coupler"], batch.q[:, 1])
    alone = kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", crank_mass=1.0 + lengths[2]).simulate(t_end=0.2)
    assert np.allclose(batch.q[2], alone.q[-1], atol=1e-6)
    sampled = four_bar.sample({"crank_mass": (0.9, 1.1)}, 4, seed=3)
    assert len(sampled) == 4 and sampled.names == ("crank_mass",) and all(0.9 <= row[0] <= 1.1 for row in sampled)
    (tmp_path / "values.csv").write_text("crank_mass\n1\n1.1\n")
    read = four_bar.values(tmp_path / "values.csv")
    assert [row[0] for row in read] == [1, 1.1]
    with pytest.raises(IndexError):
        read[2]
    with pytest.raises(kempe.ArgumentError):
        four_bar.values({"nonsense": [1, 2]})


def test_fmu(four_bar, tmp_path):
    unit = four_bar.fmu(tmp_path / "unit.fmu", fmi=2, kind="cs", no_binary=True)
    assert "CoSimulation" in zipfile.ZipFile(tmp_path / "unit.fmu").read("modelDescription.xml").decode()
    assert zipfile.ZipFile(tmp_path / "unit.fmu").namelist() == list(unit.files)
    assert "co-simulation" in str(unit) and "model exchange" not in str(unit)
    with pytest.raises(kempe.ArgumentError, match="versions are 2 and 3"):
        four_bar.fmu(fmi=4)


def test_reduce(tmp_path):
    mesh = EXAMPLES.parent / "tests/models/brick.mtx"
    more = {"mass": mesh.with_name("brick_mass.mtx"), "nodes": mesh.with_name("brick_nodes.txt"), "units": "m kg s"}
    body = kempe.reduce(mesh, interfaces={"root": "x=0", "tip": "8-11"}, modes=1, **more)
    assert len(body.frequencies) == 7 and body.to_dict()["mass"] == pytest.approx(24) and "clamped" in str(body)
    body.write(tmp_path / "brick.npz")
    with np.load(tmp_path / "brick.npz") as file:
        assert file["T"].shape == (7, 7, 3, 3) and np.allclose(np.sqrt(np.diag(file["K"])), body.frequencies)
        assert np.allclose(np.einsum("klaa->kl", file["T"]), np.eye(7))
    assert kempe.reduce(mesh, interfaces="root=x=0", modes=1, **more).frequencies[0] < body.frequencies[0]
    with pytest.raises(kempe.InputError, match="there is no node 12"):
        kempe.reduce(mesh, interfaces={"root": "9-12"}, modes=1, **more)


def test_generate(four_bar, tmp_path):
    code = four_bar.generate(language="python", sets="M_C")
    assert len(code.files) >= 1 and all(code.files.values()) and str(code)
    code.write(tmp_path / "code")
    assert {path.name for path in (tmp_path / "code").iterdir()} == set(code.files)
    assert "M_C" in str(four_bar.count(sets="M_C"))


def test_contact_laws():
    ellipse = kempe.contact.hertz(80e3, along=1 / 0.46, across=1 / 0.3, shear_modulus=82e9, poisson=0.28)
    creep = dict(
        a=ellipse["a"], b=ellipse["b"], shear_modulus=82e9, poisson=0.28, normal=80e3, friction=0.3, slip=(1e-3, 0)
    )
    forces = {law: kempe.contact.creep(law, **creep)["force"][0] for law in ("linear", "shen", "polach", "fastsim")}
    assert all(force < 0 for force in forces.values()) and abs(forces["linear"]) > abs(forces["shen"])
    three = kempe.contact.flexibilities(**creep)
    assert three.shape == (3,) and kempe.contact.flexibility(**creep) == pytest.approx(three[0])
    assert kempe.contact.fastsim(three, **creep)["force"][0] == forces["fastsim"]
    assert kempe.contact.kalker(1.0, 0.25)["c11"] == pytest.approx(4.12, rel=0.01)
    with pytest.raises(kempe.ArgumentError):
        kempe.contact.hertz(-1, along=1, across=1, shear_modulus=1, poisson=0.3)
    with pytest.raises(kempe.ArgumentError, match="there is no law 'none of these'"):
        kempe.contact.creep("none of these", **creep)


def test_conicity():
    places = np.linspace(-0.008, 0.008, 81)
    found = kempe.contact.conicity(places, 2 * 0.025 * (places - 0.001), 0.003)
    assert found["conicity"] == pytest.approx(0.025, abs=1e-12) and found["low"] == pytest.approx(-0.002, abs=1e-12)
    with pytest.raises(kempe.FailedError, match="no motion of the amplitude"):
        kempe.contact.conicity(places, -places, 0.003)
    with pytest.raises(kempe.ArgumentError):
        kempe.contact.conicity(places[::-1], places, 0.003)
    system = kempe.Model(EXAMPLES / "conicity/conicity.yaml").system()
    table = system.contact(sweep="shift=-9 mm:9 mm:181", conicity="1 mm:7 mm:7", pair="L,R")
    assert table.conicity["conicity"][2] == pytest.approx(0.188, abs=0.001)  # EN 15302, case E1
    assert table.radii.row_count > 181 and np.all(np.diff(table.radii["y"]) > 0)  # rows between the places, too
    assert table.nonlinearity > 0
    assert np.isnan(system.contact(sweep="shift=0:1 mm:2").nonlinearity)


def test_contact_table():
    model = kempe.Model(EXAMPLES / "manchester/manchester.yaml")
    table = model.system().contact(sweep="shift=0:2 mm:2")
    assert (
        table.status == "complete"
        and table.reason == ""
        and table.states.row_count == 2
        and "normal" in table.rows
        and str(table)
    )
    assert table.zone_count(0) > 0 and table.patch(0, 0, 0)["touches"] in (0, 1)
    with pytest.raises(IndexError):
        table.patch(9, 0, 0)


def results_with_pages():
    four_bar, car = (kempe.Model(EXAMPLES / f"{name}/{name}.yaml").system() for name in ("four_bar", "quarter_car"))
    yield kempe.Model(EXAMPLES / "four_bar/four_bar.yaml").ensemble({"crank_mass": [1.0, 1.1]}).run(t_end=0.1)
    yield four_bar.simulate(t_end=0.1)
    yield four_bar.assemble()
    yield four_bar.kinematics(sweep={"crank": (0, 1, 5)})
    yield four_bar.inverse(actuators="crank")
    yield four_bar.compare(t_end=0.05, rtols=[1e-4], formulations="reduced", integrators=["dop853"])
    yield from (car.equilibrium(), car.modes(), car.response(inputs="effort(body)", outputs="q", frequencies="1:9:3"))


def test_reports(tmp_path):
    missing, path = set(), tmp_path / "page.html"
    for result in results_with_pages():
        try:
            result.write_report(path)
            assert "<html" in path.read_text() and result.report()._repr_html_().startswith("<iframe")
        except kempe.FileError as absent:  # libraries of pages
            missing.add(str(absent))
    if missing:
        pytest.skip("; ".join(missing))


def test_pictures(tmp_path):
    model = kempe.Model(EXAMPLES / "manchester/manchester.yaml")
    model.system().contact(sweep="shift=0:2 mm:3").write_picture(tmp_path / "contact.svg")
    assert "<svg" in (tmp_path / "contact.svg").read_text()
    heavy, light = (kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", crank_mass=m).simulate(t_end=0.1).rows for m in (1, 2))
    heavy.write_picture(tmp_path / "both.svg", y="q(rocker)", against=light)
    assert 'class="dashed"' in (tmp_path / "both.svg").read_text()
    other = tmp_path / "other.csv"
    other.write_text("t,other\n0,1\n")
    with pytest.raises(kempe.InputError, match="none of the columns of the picture"):
        heavy.write_picture(tmp_path / "no.svg", y="qd(rocker)", against=kempe.Table.read(other))


# -- the whole interface ------------------------------------------------------------------------------------


def test_animation(four_bar, tmp_path):
    path = tmp_path / "four_bar.glb"
    four_bar.simulate(t_end=0.1).write_animation(path)
    written = path.read_bytes()
    assert written[:4] == b"glTF" and int.from_bytes(written[8:12], "little") == len(written)


@pytest.mark.last_of_all
def test_every_public_function_is_reached_or_left_out(request):
    if len(request.session.items) < 60 or "KEMPE_COMMAND" not in os.environ:
        pytest.skip("a selection of the tests")

    headers = [path.read_text() for path in (ROOT / "include/kempe").glob("*.h") if path.name != "runtime.h"]
    public = {
        name
        for text in headers
        for name in re.findall(
            r"^(?:KEMPE_API|static inline) [^;{=]*?\b(kempe_\w+)\(", re.sub(r"/\*.*?\*/", "", text, flags=re.S), re.M
        )
    }
    assert len(public) > 200
    missing = sorted(public - USED - set(LEFT_OUT))
    assert missing == [], "wrap these functions and test them, or list them in python/tests/left_out.py"
    assert sorted(set(LEFT_OUT) - public) == [] and sorted(set(LEFT_OUT) & USED) == []


ZEROS = [
    *({name: 0} for name in ("t_end", "rtol", "atol", "output_step", "max_steps", "fixed_step", "max_step", "threads")),
    {"rtol": 0.0},
]


@pytest.mark.parametrize("given", ZEROS, ids=str)
def test_a_zero_is_given(four_bar, given):
    name = next(iter(given))
    calls = [
        four_bar.simulate,
        lambda **more: four_bar.sensitivity(parameters="crank", outputs="q(rocker)", **more),
        lambda **more: four_bar.function(["crank"], **more),
        lambda **more: four_bar.system().stepper(**more),
        lambda **more: four_bar.ensemble({"crank": [0.3]}).run(**more),
    ]
    for call in calls:
        with pytest.raises(kempe.ArgumentError, match=f"{name} needs a positive number"):
            call(**given)


def test_other_zeros_are_given(four_bar, tmp_path):
    with pytest.raises(kempe.ArgumentError, match="count needs a positive number"):
        four_bar.sample("crank=0.29:0.31", 0)
    with pytest.raises(kempe.ArgumentError, match="seed needs a positive number"):
        four_bar.sample("crank=0.29:0.31", 3, seed=0)
    with pytest.raises(kempe.ArgumentError, match="chunk needs a positive number"):
        four_bar.ensemble({"crank": [0.3]}).run_folder(tmp_path / "a", chunk=0)
    with pytest.raises(kempe.ArgumentError, match="confidence needs a positive number"):
        four_bar.fit(data="m.csv", columns="q.crank", parameters={"crank": (0.1, 5)}, confidence=0.0)
    assert four_bar.simulate(t_end=0.1, keep_dense=0, rtol=None).t[-1] == 0.1


def test_every_number_of_options_is_known():
    """A number is a count, a word of yes and no, or must be positive."""
    from kempe._native import ffi
    from kempe.options import _COUNTS

    flags = set("""body_inputs convergence_check drives full_convergence_check global integral judge_safety keep_dense
        keep_independent keep_parameters linear modes newton no_binary no_convergence_check optimize resume simulator slide stick
        vectorised""".split())
    for name in sum(map(list, ffi.list_types()), []):
        if name.endswith("_options"):
            for member, field in ffi.typeof(name).fields:
                if field.type.cname in ("int", "long") and not member.endswith("_count"):
                    assert member in _COUNTS | flags, f"{name}.{member}"


def test_rows_by_name(four_bar):
    pandas = pytest.importorskip("pandas")
    f = four_bar.function(["crank", "base"], quantities="range(q(rocker))", t_end=1)
    frame = pandas.DataFrame({"base": [0.90, 0.91], "note": ["a", "b"], "crank": [0.29, 0.30]})
    expected = f([[0.29, 0.90], [0.30, 0.91]])
    assert np.array_equal(f(frame), expected)
    assert np.array_equal(f({"base": [0.90, 0.91], "crank": [0.29, 0.30]}), expected)
    assert np.array_equal(f(frame[["base", "crank"]].iloc[1]), expected[1])
    with pytest.raises(kempe.ArgumentError, match="there is no column 'crank'; there are base"):
        f(frame[["base"]])


def test_results_of_evaluate_are_copies(four_bar):
    workspace = four_bar.system().workspace()
    masses = [workspace.evaluate(0, [x, 2 * x, 0]).M for x in (0, 0.5, 1)]
    views = [workspace.evaluate(0, [x, 2 * x, 0], views=True).M for x in (0, 0.5, 1)]
    assert not np.array_equal(masses[0], masses[1]) and np.array_equal(views[0], views[1])
    assert np.array_equal(masses[2], views[2])


def test_a_workspace_in_two_threads(four_bar):
    import threading

    workspace, entered, refused = four_bar.system().workspace(), threading.Event(), []

    def other():
        try:
            workspace.evaluate(0, [0.1, 0, 0])
        except kempe.ArgumentError as error:
            refused.append(str(error))
        entered.set()

    with workspace._alone():
        threading.Thread(target=other).start()
        assert entered.wait(60)
    assert len(refused) == 1 and "a workspace of its own" in refused[0]
    workspace.evaluate(0, [0, 0, 0])
    thread = threading.Thread(target=other)
    thread.start()
    thread.join()
    assert len(refused) == 1
    with pytest.raises(kempe.ArgumentError, match="a workspace of its own"):
        _ = workspace.M  # the other thread has evaluated since


def test_texts_with_nul(four_bar):
    for call in (lambda: kempe.Model("a\0b"), lambda: kempe.Model.from_text("a\0b"), lambda: four_bar.system("pla\0in")):
        with pytest.raises(ValueError, match="NUL"):
            call()


def test_saved_steppers_at_samples():
    """Times that are sums meet samples up to rounding; a saved stepper takes each sample once."""
    text = """kempe: 1
bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}
states: {z: {next: ".5*z+q(x)", sample: .1}}
inputs: {u: {default: 0, unit: N}, v: {t: [0, .3, .7, 1.1, 2], value: [0, 1, -1, 2, 0], method: hold}}
forces: {f: {joint: x, force: "1-z+u+v"}}
run: {t_end: 3, rtol: 1e-9}
"""
    system = kempe.Model.from_text(text).system()
    x = v = z = 0.0
    for k in range(20):
        z = 0.5 * z + x
        a = 1 - z + (0 if k < 3 else 1 if k < 7 else -1 if k < 11 else 2)
        x, v = x + 0.1 * v + 0.005 * a, v + 0.1 * a
    for every in (0, 1, 3):
        stepper, t = system.stepper(t_end=3, integrator="dop853"), 0.0
        for k in range(1, 41):
            t += 0.05
            if every and k % every == 0:
                state = stepper.save()
                stepper.advance(t + 0.2)
                stepper.restore(state)
            stepper.set_input("u", 0)
            stepper.advance(t)
        assert abs(stepper.q[0] - x) < 1e-11


def test_long_sums_of_steps():
    """Sums of steps that leave a sample by more than rounding make short steps to it, from saved states too."""
    text = """kempe: 1
inputs: {u: {default: 0, unit: N}}
bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}
states: {z: {next: ".2*z+1", sample: .1}}
forces: {f: {joint: x, force: "z-q(x)-2*qd(x)+u"}}
"""
    stepper, t = kempe.Model.from_text(text).system().stepper(t_end=100, rtol=1e-9), 0.0
    for k in range(1, 900):
        t += 0.1
        if k % 5 == 0:
            stepper.restore(stepper.save())
        stepper.set_input("u", 0)
        stepper.advance(t)
    assert abs(stepper.q[0] - 1.25) < 1e-9  # z goes to 1/(1 - 0.2)


def test_bearings():
    """Two rows for each pair, an array in the dictionary, sizes in quantities."""
    model = kempe.Model(EXAMPLES / "unbalanced_shaft/unbalanced_shaft.yaml")
    run = model.simulate()
    most = 5 * 9.81 + 5 * 0.2e-3 * (50 * np.pi) ** 2
    assert list(run.bearings["bearings"]) == ["main", "main"] and list(run.bearings["at"]) == [0, 0.12]
    assert run.bearings["radial"] == pytest.approx([5 / 12 * most, 17 / 12 * most], rel=1e-10)
    assert [one["radial"]["peak"] for one in run.to_dict()["bearings"]] == list(run.bearings["radial"])
    assert run.bearings.units["equivalent"] == "N" and run["bearing(main).2.z"][30] == pytest.approx(17 / 12 * most, rel=1e-12)
    batch = model.ensemble({"e": [0.2e-3, 0]}, quantities=["max(reactions)", "max(bearing(main).2.size)"]).run()
    assert batch.instances["max(reaction(pin).size)"] == pytest.approx([most, 5 * 9.81], rel=1e-9)
    assert batch.instances["max(bearing(main).2.size)"] == pytest.approx([17 / 12 * most, 17 / 12 * 5 * 9.81], rel=1e-9)
