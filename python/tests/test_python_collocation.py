# SPDX-License-Identifier: BSD-3-Clause
"""Collocation by IPOPT: derivatives of the programs, motions that runs repeat, known optima, limits, the assembly mode, mistakes.
IPOPT is CasADi's, also of another Python (KEMPE_OPTIMISER_PYTHON), or the system's."""

import os
import re
import subprocess
import sys
import textwrap
import warnings

import kempe
import numpy as np
import pytest
from conftest import ROOT
from kempe import collocation, ipopt
from kempe.followed_loops import FollowedLoops
from kempe.optimal import collocate, ilqr


@pytest.fixture(scope="module", autouse=True)
def library():
    other, before = os.environ.get("KEMPE_OPTIMISER_PYTHON"), list(sys.path)
    if other:
        words = "import casadi, os; print(os.path.dirname(os.path.dirname(casadi.__file__)))"
        done = subprocess.run([other, "-c", words], capture_output=True, text=True)
        sys.path += done.stdout.split("\n")[:1] if done.returncode == 0 else []
    try:
        ipopt.load()
    except ImportError as error:
        pytest.skip(str(error))
    finally:
        sys.path[:] = before


@pytest.fixture
def quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.fixture
def five_bar():
    return kempe.Model(ROOT / "tests/models/swing_five_bar.yaml")


UP = {"q(a)": np.pi / 2, "q(b)": np.pi / 2, "qd(a)": 0, "qd(b)": 0}


def matrix(places, entries, shape):
    assert len(set(zip(*places))) == len(entries)  # no entry twice
    made = np.zeros(shape)
    made[places] = entries
    return made


@pytest.mark.parametrize("scheme", ["hermite-simpson", "radau"])
def test_derivatives_of_the_program(five_bar, scheme, monkeypatch):
    """Gradient, Jacobian and Hessian of all parts against differences: collocation, limits that depend on forces, all costs, the end time."""
    kept = []
    monkeypatch.setattr(collocation, "solve", lambda *given: kept.append(given[0]) or ipopt.solve(*given))
    workspace, q = five_bar.system().workspace(), five_bar.system().assemble().q
    path = {"q(c)": (None, 3.1), "velocity(left_rod.P)": (-10, 10), "reaction(tip)": (-100, 100)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        collocate(
            workspace, q, np.zeros(4), (0.3, 5.0), "a, b", UP, path, limits=[1.2, 1.3], effort=0.1, time=1.0, running=[0.1, 0.2, 0.3, 0.4],
            final=[1, 2, 3, 4], target=[1, 1, 0, 0.5], scheme=scheme, intervals=4, refinements=0, iterations=6,
        )
    program = kept[0]
    rng = np.random.default_rng(0)
    z = program.last + 1e-3 * rng.normal(size=len(program.last))
    weights, n, m = rng.normal(size=len(program.least)), len(z), len(program.least)
    gradient, J = program.gradient(z), matrix(program.jacobian_places, program.jacobian(z), (m, n))
    lower = matrix(program.hessian_places, program.hessian(z, 0.7, weights), (n, n))
    H = lower + np.tril(lower, -1).T

    def at(z):
        slope = 0.7 * program.gradient(z) + weights @ matrix(program.jacobian_places, program.jacobian(z), (m, n))
        return np.concatenate(([program.value(z)], program.constraints(z), slope))

    for i in range(n):
        step = 1e-4 * np.eye(n)[i]
        coarse, fine = ((at(z + k * step) - at(z - k * step)) / (2e-4 * k) for k in (2, 1))
        difference = (4 * fine - coarse) / 3
        assert np.allclose(difference[: m + 1], [gradient[i], *J[:, i]], rtol=1e-9, atol=1e-9 * abs(J).max())
        assert np.allclose(difference[m + 1 :], H[:, i], rtol=0, atol=1e-9 * abs(H).max())


def test_known_optimum(quiet):
    """A mass that moves by 1 m in 1 s: the forces of least effort are 6 - 12 t; with a limit, in the least time, bang-bang."""
    body = {"joint": {"name": "x", "prismatic": "x", "at": "ground"}, "mass": 1}
    workspace = kempe.Model.from_dict({"kempe": 1, "bodies": {"m": body}}).system().workspace()
    for scheme in ("hermite-simpson", "radau"):
        motion = collocate(workspace, [0], [0], 1.0, "x", {"q(x)": 1, "qd(x)": 0}, effort=1.0, scheme=scheme, intervals=3)
        assert np.allclose(motion.forces[:, 0], 6 - 12 * motion.t, atol=1e-6) and abs(motion.cost - 6) < 1e-6
        assert motion.converged and motion.error < 1e-7 and motion.replay < 1e-6
        assert np.allclose(motion.at([0.25, 0.8])[2][:, 0], [3, -3.6], atol=1e-6)
        fast = collocate(workspace, [0], [0], (0.1, 5), "x", {"q(x)": 1, "qd(x)": 0}, limits=2.0, effort=0.0, time=1.0, scheme=scheme)
        assert abs(fast.t[-1] - 2**0.5) < 1e-4 and abs(fast.forces).max() < 2 + 1e-6
        quick = collocate(
            workspace, [0], [0], (0.1, 5), "x", {"q(x)": 1, "qd": 0}, {"qd": (-0.5, 0.5)},
            limits=2.0, effort=1e-6, time=1.0, scheme=scheme, intervals=40,
        )
        assert abs(quick.t[-1] - 2.25) < 5e-3 and abs(quick.qd).max() < 0.5 + 1e-6


@pytest.mark.parametrize("scheme", ["hermite-simpson", "radau"])
def test_swing_up_of_a_five_bar(five_bar, scheme, quiet):
    system = five_bar.system()
    workspace, q = system.workspace(), system.assemble().q
    motion = collocate(workspace, q, np.zeros(4), (0.3, 5.0), "a, b", UP, limits=1.2, effort=0.1, time=1.0, scheme=scheme)
    assert motion.converged and motion.error <= 1e-4 and motion.replay <= 1e-4 and len(motion.history) > 1
    assert abs(motion.cost - 1.10343) < 2e-4 and abs(motion.t[-1] - 0.9893) < 2e-3  # both schemes find the same motion
    assert np.allclose(motion.q[-1, [0, 2]], np.pi / 2, atol=1e-6) and abs(motion.forces).max() <= 1.2 + 1e-6
    # A run with the forces repeats it, in the same assembly mode.
    run = five_bar.system(force=motion.force).simulate(t_end=float(motion.t[-1]), rtol=1e-9, no_convergence_check=True)
    assert abs(run.q[-1] - motion.q[-1]).max() <= motion.replay + 3e-5
    elbows = 0.3 * np.stack((np.cos(motion.q[:, 2]) - np.cos(motion.q[:, 0]) + 1, np.sin(motion.q[:, 2]) - np.sin(motion.q[:, 0])))
    rod = np.stack((np.cos(motion.q[:, 0] + motion.q[:, 1]), np.sin(motion.q[:, 0] + motion.q[:, 1])))
    assert len(set(np.sign(elbows[0] * rod[1] - elbows[1] * rod[0]))) == 1
    again = collocate(workspace, q, np.zeros(4), (0.3, 5.0), "a, b", UP, limits=1.2, effort=0.1, time=1.0, scheme=scheme, guess=motion)
    assert again.history[0][1] < motion.history[0][1] and abs(again.cost - motion.cost) < 1e-4  # a warm start


def test_run_decides_about_the_mesh(five_bar, quiet):
    """A mesh with errors below the accuracy is divided where the run, which amplifies them, differs by more."""
    workspace, q = five_bar.system().workspace(), five_bar.system().assemble().q
    motion = collocate(workspace, q, np.zeros(4), (0.3, 5.0), "a, b", UP, limits=1.2, effort=0.1, time=1.0, accuracy=1e-3)
    assert motion.history[-2][2] <= 1e-3 and motion.history[-1][2] < 0.5 * motion.history[-2][2] and motion.replay <= 1e-3


def test_loops_stay_in_their_mode(five_bar):
    q, t = five_bar.system().assemble().q, np.zeros(3)
    loops = FollowedLoops(five_bar.system().workspace(), q, t)
    turned = loops.positions(t, np.tile(q, (3, 1)), q[[0, 2]] + [[0, 0], [0.5, -0.3], [2, 2]])
    assert np.allclose(turned[0], q) and (np.sin(turned @ [-1, -1, 1, 1]) > 0).all()  # the angle between the rods
    assert abs(five_bar.system().workspace().evaluate_states(t, turned).h).max() < 1e-10
    mirrored = q - [0, 2 * (q[0] + q[1]), 0, 2 * (q[2] + q[3])]  # closed, with the tip below the elbows
    assert abs(five_bar.system().workspace().evaluate(0.0, mirrored).h).max() < 1e-12
    with pytest.raises(kempe.FailedError, match="assembly mode of the start"):
        loops.positions(t[:1], mirrored[None], mirrored[None, [0, 2]])


def test_goal_in_another_assembly_mode(five_bar):
    """The rods would have to pass through one line: no motion within the mode ends there."""
    workspace, q = five_bar.system().workspace(), five_bar.system().assemble().q
    other, _ = workspace.close(0.0, q * [1, 0.2, 1, 0.2] + [0, 2.3, 0, 0.9], hold="a, b")
    assert abs(np.sin(other - q)).max() > 0.5
    with pytest.warns(kempe.KempeWarning, match="not optimal"):
        motion = collocate(workspace, q, np.zeros(4), (0.3, 3.0), "a, b", {"q(c)": other[1], "q(d)": other[3], "qd": 0}, iterations=60)
    assert not motion.converged and motion.q[:, 1].min() > 0
    with pytest.raises(kempe.FailedError, match="cannot follow the first guess: the loops cannot be closed in the assembly mode"):
        collocate(workspace, q, np.zeros(4), (0.3, 3.0), "a, b", UP, guess=[np.pi, 0, 0, 0])  # the elbows are farther apart than both rods


def test_beside_steps(four_bar, quiet):
    """The same problem by steps with constant forces, whose plan is a first guess."""
    workspace = four_bar.system().workspace()
    q, qd = workspace.close(0, [0.3, 0, 0], hold=["crank"])
    u = four_bar.coordinates.index(workspace.independent[0])
    goal = np.array([q[u] + 0.1, 0])
    plan = ilqr(workspace, q, qd, 0.005, np.zeros((80, 1)), "crank", goal, final=[1e4, 1e2], effort=1e-2, tolerance=1e-10)
    motion = collocate(workspace, q, qd, 0.4, "crank", target=goal, final=[1e4, 1e2], effort=1e-2, guess=plan)
    assert motion.cost < plan.cost < 1.01 * motion.cost
    assert np.allclose(motion.at(plan.t)[0], plan.q, atol=2e-3)


def test_redundant_loops_and_a_function_in_python(quiet):
    """Loops with a redundant row; a force of the model's user acts in the equations and in the run."""
    model = kempe.Model(ROOT / "examples/parallel_robot/parallel_robot.yaml")
    system = model.system(force=lambda t, q, qd: -0.5 * qd)
    workspace, q = system.workspace(), system.assemble().q
    end = {"q(a1)": q[0] + 0.3, "q(b1)": q[model.coordinates.index("b1")] + 0.2, "qd(a1)": 0, "qd(b1)": 0}
    motion = collocate(workspace, q, 0 * q, 0.5, "a1, b1", end, effort=1e-3, intervals=8)
    assert motion.converged and motion.replay <= 1e-4


def test_drive_beside_an_actuator(quiet):
    """A crank moves as a function of time, and the closures with it."""
    text = (ROOT / "tests/models/swing_five_bar.yaml").read_text()
    text += 'drives: {conveyor: {joint: b, angle: "-90 deg + 20 deg*sin(5*t/(1 s))"}}\n'
    system = kempe.Model.from_text(text).system()
    workspace, q = system.workspace(), system.assemble().q
    q, qd = workspace.close(0.0, q, 0 * q)
    motion = collocate(workspace, q, qd, 0.5, "a", {"q(a)": -1.0, "qd(a)": 0}, effort=0.1)
    assert motion.converged and motion.replay < 1e-4
    assert np.allclose(motion.q[:, 2], -np.pi / 2 + np.radians(20) * np.sin(5 * motion.t), atol=1e-9)
    with pytest.raises(kempe.ArgumentError, match="the equations depend on time"):
        collocate(workspace, q, qd, (0.3, 0.5), "a", {"q(a)": -1.0})


def test_models_that_are_refused():
    for name, actuator, text in (
        ("hydraulic_excavator", "boom", "models with samples"),
        ("driven_slider_crank", "crank", "no independent coordinates"),
    ):
        model = kempe.Model(ROOT / f"examples/{name}/{name}.yaml")
        q = model.system().assemble().q
        with pytest.raises(kempe.ArgumentError, match=text):
            collocate(model.system().workspace(), q, 0 * q, 0.2, actuator, {f"q({actuator})": 1})


def test_exception_in_a_force_is_raised(four_bar):
    def force(t, q, qd):
        if abs(qd).max() > 0.1:  # the first guess is at rest: within IPOPT
            raise ZeroDivisionError("of the user")
        return 0 * q

    workspace = four_bar.system(force=force).workspace()
    q, qd = workspace.close(0, [0.3, 0, 0], hold="crank")
    with pytest.raises(ZeroDivisionError, match="of the user"):
        collocate(workspace, q, qd, 0.4, "crank", {"q(crank)": 0.5})


class Circle:
    """The highest x + y on a circle."""

    low, high, least, most = np.full(2, -np.inf), np.full(2, np.inf), np.zeros(1), np.full(1, 2.0)
    jacobian_places = np.array([0, 0]), np.array([0, 1])
    hessian_places = np.array([0, 1]), np.array([0, 1])
    calls = 0

    def value(self, z):
        return -z.sum()

    def gradient(self, z):
        return np.full(2, -1.0)

    def constraints(self, z):
        return np.array([z @ z])

    def jacobian(self, z):
        return 2 * z

    def hessian(self, z, factor, multipliers):
        self.calls += 1
        if self.calls == 3:
            raise self.error
        return np.full(2, 2 * multipliers[0])


def test_ipopt_by_itself():
    circle = Circle()
    circle.error = kempe.FailedError("here")  # of one point: IPOPT refuses
    assert not ipopt.solve(circle, np.array([0.1, 0.3]), {}).converged
    circle = Circle()
    circle.error = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        ipopt.solve(circle, np.array([0.1, 0.3]), {})
    circle.calls = 3
    found = ipopt.solve(circle, np.array([0.1, 0.3]), {"tol": 1e-10})
    assert found.converged and np.allclose(found.z, 1, atol=1e-8) and abs(found.value + 2) < 1e-8 and found.iterations > 2
    with pytest.raises(kempe.FailedError, match="refuses the option toll"):
        ipopt.solve(circle, np.zeros(2), {"toll": 1e-10})


def test_without_ipopt(monkeypatch):
    monkeypatch.setattr(ipopt.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(ipopt.ctypes.util, "find_library", lambda name: None)
    with pytest.raises(ImportError, match="pip install casadi"):
        ipopt.load.__wrapped__()


def test_mistakes(four_bar):
    workspace = four_bar.system().workspace()
    q, qd = workspace.close(0, [0.3, 0, 0], hold="crank")
    right = dict(t_end=0.3, actuators="crank", end={"q(crank)": 0.4}, intervals=4)
    for wrong, text in (
        ({"actuators": "krank"}, "crank"),
        ({"actuators": ""}, "names the coordinates"),
        ({"t_end": 0}, "t_end is a positive time"),
        ({"t_end": (1, 0.5)}, "low limit above"),
        ({"t_end": (0.1, None)}, "t_end is a positive time"),
        ({"t_end": np.nan}, "t_end"),
        ({"end": {"q(krank)": 1}}, "crank"),
        ({"end": {"speed(crank)": 1}}, "speed"),
        ({"end": {"q(crank)": (1, 0)}}, "low limit above"),
        ({"end": {"q(crank)": (0, 1, 2)}}, "two limits at most"),
        ({"end": {"q(crank)": np.nan}}, "end.*is a number"),
        ({"end": {"q": [1, 2]}}, "end.*is 3 numbers"),
        ({"path": {"q(crank)": (0.35, 1)}}, "the start has q.crank = 0.3, beyond its limits 0.35 .. 1"),
        ({"limits": 0}, "limits are positive"),
        ({"limits": [1, 2]}, "limits is a number or 1 numbers"),
        ({"effort": -1}, "effort must not be negative"),
        ({"running": [np.nan, 0]}, "running has values that are not finite"),
        ({"target": [1]}, "target .* has 2 values"),
        ({"target": [np.inf, 0]}, "must be finite"),
        ({"time": -1}, "not negative"),
        ({"guess": [1, 2]}, "guess .* has 3 values"),
        ({"guess": [1, 2, np.nan]}, "guess has values"),
        ({"scheme": "gauss"}, "scheme"),
        ({"intervals": 0}, "must be positive"),
        ({"accuracy": np.nan}, "must be positive"),
        ({"refinements": -1}, "must be positive"),
    ):
        with pytest.raises((kempe.ArgumentError, kempe.InputError, ValueError), match=text):
            collocate(workspace, q, qd, **{**right, **wrong})
    with pytest.warns(kempe.KempeWarning, match="not optimal: IPOPT found no motion within the limits"):
        stuck = collocate(workspace, q, qd, **{**right, "limits": 1e-6})
    assert not stuck.converged
    with pytest.warns(kempe.KempeWarning, match="not optimal: the iterations have been used up"):
        collocate(workspace, q, qd, **right, iterations=1)
    with pytest.warns(kempe.KempeWarning, match="less accurate than 1e-12 after 0 refinements"):
        collocate(workspace, q, qd, **right, accuracy=1e-12, refinements=0)


def test_equations_that_depend_on_time():
    model = kempe.Model.from_dict({
        "kempe": 1,
        "bodies": {"m": {"joint": {"name": "x", "prismatic": "x", "at": "ground"}, "mass": 1}},
        "forces": {"wind": {"joint": "x", "force": "1 N*sin(3*t/(1 s))"}},
    })
    workspace = model.system().workspace()
    with pytest.raises(kempe.ArgumentError, match="depend on time"):
        collocate(workspace, [0], [0], (0.5, 1.0), "x", {"q(x)": 1})
    motion = collocate(workspace, [0], [0], 1.0, "x", {"q(x)": 1, "qd(x)": 0}, effort=1.0)
    assert motion.converged and motion.replay < 1e-4
    # x'' = f + sin 3 t: the effort of f is least for the same line as without wind, less the parts that the wind moves.
    wind = np.array([(1 - np.cos(3)) / 3, (3 - np.sin(3)) / 9])
    line = np.linalg.solve([[1, 0.5], [0.5, 1 / 6]], [0 - wind[0], 1 - wind[1]])
    assert np.allclose(motion.forces[:, 0], line[0] + line[1] * motion.t, atol=1e-4)


def test_page(tmp_path, monkeypatch, capsys):
    """The program of docs/optimal.md with its model prints what the page says."""
    page = (ROOT / "docs/optimal.md").read_text()
    model, printed = (re.search(rf"```{kind}\n(.*?)```", page, re.S)[1] for kind in ("yaml", "text"))
    assert model == (ROOT / "tests/models/swing_five_bar.yaml").read_text()
    (tmp_path / "swing_five_bar.yaml").write_text(model)
    monkeypatch.chdir(tmp_path)
    blocks = [textwrap.dedent(block) for block in re.findall(r"(?:^    .*\n)+", page, re.M)]
    names: dict = {}
    for k, block in enumerate(blocks):
        exec(block, names)
        assert capsys.readouterr().out == ("", printed, "True\n", "True True 1.003 s\n")[k]
    assert len(blocks) == 4


def test_repeated_ends(quiet):
    """The rates of all coordinates of one loop are one equation; friction by the load of the loop is in all derivatives."""
    system = kempe.Model(ROOT / "tests/models/rubbing_slider.yaml").system()
    start = system.assemble()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        workspace = system.workspace()
    plan = collocate(workspace, start.q, np.zeros(3), 0.5, "crank", end={"q(crank)": 1.4, "qd": 0}, intervals=12)
    assert plan.converged and plan.error < 1e-4 and plan.replay < 1e-4
    assert plan.q[-1, 0] == pytest.approx(1.4, abs=1e-8) and abs(plan.qd[-1]).max() < 1e-5
    with pytest.warns(kempe.KempeWarning, match="no motion within the limits"):
        collocate(workspace, start.q, np.zeros(3), 0.5, "crank", end={"q(crank)": 1.4, "q(rod)": -1.2}, intervals=12, refinements=0)
