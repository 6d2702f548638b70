# SPDX-License-Identifier: BSD-3-Clause
"""Another start of runs and studies: arrays and mappings, what follows, what is refused."""

import pickle
import re
import warnings

import kempe
import numpy as np
import pytest
from conftest import ROOT

EXAMPLES = ROOT / "examples"
ARM = {"joint": {"revolute": "z", "at": "ground"}, "mass": 3, "com": [0, -1, 0], "inertia": {"zz": 1}}


def model(name):
    return kempe.Model(EXAMPLES / name / f"{name}.yaml")


def bodies(**more):
    return kempe.Model.from_dict({"kempe": 1, "gravity": [0, -9.81, 0], "bodies": {"arm": ARM}, **more})


# -- the same motion -----------------------------------------------------------------------------------


def test_as_in_a_file(four_bar):
    """A start in a call is the start in a file, where that closes the loops."""
    closed = four_bar.start_at(q={"crank": 1.5}).system().assemble().q
    values = ", ".join(f"{name}: {float(value)!r}" for name, value in zip(four_bar.coordinates, closed))
    text = (EXAMPLES / "four_bar/four_bar.yaml").read_text()
    changed = re.sub(r"start: .*\n", f"start: {{q: {{{values}}}, qd: {{crank: 3}}}}\n", text)
    assert changed != text
    by_file = kempe.Model.from_text(changed).simulate(t_end=1)
    by_call = four_bar.simulate(q=closed, qd={"crank": 3}, t_end=1)
    assert np.array_equal(by_file.q, by_call.q) and np.array_equal(by_file.qd, by_call.qd)


@pytest.mark.parametrize("name", ["four_bar", "delta_robot", "bennett", "stewart", "loose_pin", "stick_slip", "wheelset"])
def test_own_start_again(name):
    """The assembled start, given as arrays, is where the run starts."""
    system = model(name).system()
    own = system.assemble()
    again = system.start_at(own.q, own.qd).assemble()
    assert np.allclose(again.q, own.q, rtol=0, atol=1e-12)
    assert np.allclose(again.qd, own.qd, rtol=0, atol=1e-12 * max(1, abs(own.qd).max()))


def test_run_goes_on(four_bar):
    """A run from a row of another one continues it, in all formulations and by steps."""
    system = four_bar.system()
    whole = system.simulate(t_end=2, rtol=1e-10)
    half = len(whole) // 2
    row = {"q": whole.q[half], "qd": whole.qd[half]}
    for formulation in ("reduced", "projected", "dae"):
        rest = system.simulate(**row, t_end=1, rtol=1e-10, formulation=formulation)
        assert rest.q[0, 0] == whole.q[half, 0] and np.allclose(rest.q[0], whole.q[half], rtol=0, atol=1e-14)
        assert abs(rest.q[-1] - whole.q[-1]).max() < 1e-8
    rest = system.simulate(**row, t_end=1)
    assert rest.verdict["convergence"]["result"] == "converged"
    stepper = system.stepper(**row, t_end=1)
    stepper.advance(1.0)
    assert np.array_equal(stepper.q, rest.q[-1]) and stepper.q.shape == (3,)


def test_rounded_rows(four_bar):
    """Values of few digits: the independent ones stay, the others follow."""
    run = four_bar.simulate(t_end=1)
    near = four_bar.simulate(q=run.q[50].round(4), qd=run.qd[50].round(4), t_end=0.1)
    moved = abs(near.q[0] - run.q[50].round(4))
    assert moved.min() == 0 and 0 < moved.max() < 1e-3


# -- what follows --------------------------------------------------------------------------------------


def test_others_start_as_in_the_model():
    robot = model("delta_robot")
    own = robot.system().assemble().q
    moved = robot.simulate(q={"A1": own[3] + 0.05}, t_end=0.01).q[0]
    assert moved[3] == own[3] + 0.05 and np.array_equal(moved[4:], own[4:]) and abs(moved[:3] - own[:3]).max() > 1e-3
    placed = robot.start_at(q={"P.1": 0.02, "P.2": 0.0, "P.3": -0.5}).system().assemble().q
    assert placed[:3].tolist() == [0.02, 0.0, -0.5] and abs(placed[3:] - own[3:]).max() > 1e-3


def test_rates(four_bar):
    start = four_bar.start_at(qd={"rocker": 2}).system().assemble()
    own = four_bar.system().assemble()
    assert np.array_equal(start.q, own.q) and start.qd[2] == 2 and start.qd[0] != own.qd[0]
    still = four_bar.start_at(q={"crank": 1}, qd=np.zeros(3)).system().assemble()
    assert still.q[0] == 1 and not still.qd.any()
    twice = four_bar.start_at(q={"crank": 1}).start_at(qd={"crank": 3}).system().assemble()
    assert twice.q[0] == 1 and twice.qd[0] == 3


def test_clearance_stays_given():
    for name in ("loose_pin", "loose_slider"):
        loose = model(name)
        k = loose.coordinates.index("B")
        own = loose.system().assemble().q
        assert loose.start_at(q={"B": own[k] + 0.05}).system().assemble().q[k] == own[k] + 0.05


def test_locked_at_the_given_value():
    locked = bodies(drives={"d": {"joint": "arm", "locked": "yes"}})
    assert locked.simulate(q={"arm": 0.7}, t_end=1).q[:, 0].tolist() == [0.7] * 201
    with pytest.raises(kempe.FailedError, match="the rate of 'arm' would be 0 rad/s, not 0.5"):
        locked.simulate(qd={"arm": 0.5}, t_end=1)


def test_goals_do_not_count():
    text = (EXAMPLES / "four_bar/four_bar.yaml").read_text()
    with_goal = kempe.Model.from_text(text.replace("hold: [crank]", "goals: {crank: 0.5}"))
    assert with_goal.system().assemble().q[0] == pytest.approx(0.5)
    assert with_goal.start_at(q={"crank": 1.5}).system().assemble().q[0] == 1.5
    assert with_goal.start_at(qd={"crank": 1}).system().assemble().q[0] == pytest.approx(0.5)


def test_states():
    heated = bodies(states={"heat": {"start": 20, "rate": "qd(arm)^2 - heat"}})
    for given in ({"heat": 3, "arm": 2}, [2, 3]):
        run = heated.simulate(qd=given, t_end=1)
        assert run["state(heat)"][0] == 3 and run.qd[0, 0] == 2
    assert heated.simulate(q=[1, 7], t_end=1)["state(heat)"][0] == 20
    with pytest.raises(kempe.ArgumentError, match="'heat' is a state, whose value at the start is in qd"):
        heated.simulate(q={"heat": 3})


def test_delays():
    signal = {"delay": "q(arm)", "time": 0.1}
    for more in ({}, {"start": 0.1}):
        delayed = bodies(states={"seen": {**signal, **more}})
        run = delayed.simulate(q={"arm": 1}, qd={"seen": 0.5}, t_end=0.2, output_step=0.05)
        assert run["state(seen)"][:2].tolist() == [0.5, 0.5] and run["state(seen)"][3] == pytest.approx(run.q[1, 0])
        assert delayed.simulate(q={"arm": 1}, t_end=0.2, output_step=0.05)["state(seen)"][1] == more.get("start", 1)
    delayed = bodies(states={"seen": {**signal, "before": "3*t"}})
    assert delayed.simulate(q={"arm": 1}, t_end=0.2)["state(seen)"][0] == pytest.approx(-0.3)
    with pytest.warns(kempe.KempeWarning, match="'seen' before the start is constant at its given value, in place of 'before'"):
        assert delayed.simulate(qd={"seen": 0.5}, t_end=0.2)["state(seen)"][0] == 0.5


def test_sampled_states():
    counter = bodies(states={"i": {"start": 4, "sample": 0.1, "next": "i + 1"}})
    assert counter.simulate(qd={"i": 10}, t_end=0.25)["state(i)"][-1] == counter.simulate(t_end=0.25)["state(i)"][-1] + 6


def test_islands():
    two = bodies(bodies={"a": ARM, "b": ARM})
    run = two.simulate(q={"a": 1}, t_end=1)
    assert run.q[0].tolist() == [1, 0] and not run.q[:, 1].any() and abs(run.q[-1, 0] - 1) > 0.1


def test_series_by_names():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"arm": [0.5, 0.7]})
    assert bodies().simulate(q=frame.iloc[1], t_end=0.1).q[0, 0] == 0.7


# -- what it combines with -----------------------------------------------------------------------------


def test_all_studies(four_bar, tmp_path):
    lifted = four_bar.start_at(q={"crank": 1.5})
    run = lifted.simulate(t_end=1)
    assert lifted is four_bar.start_at(q={"crank": 1.5}) and run.q[0, 0] == 1.5
    batch = lifted.ensemble({"crank_mass": [1, 2]}).run(t_end=1)
    assert abs(batch.q[0] - run.q[-1]).max() < 1e-6 and abs(batch.q[1] - run.q[-1]).max() > 1e-3
    assert lifted.sensitivity(parameters="crank_mass", outputs="q(crank)", t_end=0.2).rows["q.crank"][0] == 1.5
    assert lifted.system("plain").assemble().q[0] == 1.5
    pushed = four_bar.system(force=lambda t, q, qd: -0.5 * qd)
    assert abs(pushed.simulate(q={"crank": 1.5}, t_end=1).q[-1] - run.q[-1]).max() > 1e-3
    assert "<html" in str(run.report())
    for kept in (lifted, lifted.system(), four_bar.system().start_at(q={"crank": 1.5})):
        again = pickle.loads(pickle.dumps(kept))
        assert np.array_equal(again.simulate(t_end=1).q, run.q)


def test_resume(four_bar, tmp_path):
    path = tmp_path / "half"
    start = {"q": {"crank": 1.5}, "qd": {"crank": 3}}
    four_bar.simulate(**start, t_end=0.5, checkpoint=path)
    whole, rest = (four_bar.simulate(**start, t_end=1, resume=more) for more in (None, path))
    assert abs(whole.q[-1] - rest.q[-1]).max() < 1e-6 and len(rest) == len(whole)
    for other in ({}, {"q": {"crank": 1.4}}, {**start, "qd": {"crank": 2}}):
        with pytest.raises(kempe.InputError, match="the checkpoint is of this model from another start: give the start"):
            four_bar.simulate(**other, t_end=1, resume=path)
    for heavier in ({}, start):
        with pytest.raises(kempe.InputError, match="the checkpoint is of another model"):
            kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", crank_mass=2).simulate(**heavier, t_end=1, resume=path)


# -- mistakes ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "error, sentence, start",
    [
        (ValueError, r"q has 3 values, in the order crank, coupler, rocker, not the shape \(2,\); a mapping", {"q": [1, 2]}),
        (ValueError, r"qd has 3 values, .* not the shape \(\)", {"qd": 3}),
        (ValueError, r"not the shape \(1, 3\)", {"q": np.zeros((1, 3))}),
        (kempe.ArgumentError, "q: there is no coordinate 'cranc'; near are crank", {"q": {"cranc": 1}}),
        (kempe.ArgumentError, "qd: there is no coordinate 'q.crank'; near are crank", {"qd": {"q.crank": 1}}),
        (TypeError, "q is an array or a mapping of names to numbers, not a text", {"q": "crank=1"}),
        (TypeError, "q of 'crank' is a number in rad, m, rad/s or m/s, not '70 deg'", {"q": {"crank": "70 deg"}}),
        (TypeError, r"q of 'crank' is a number .*, not \[1\]", {"q": {"crank": [1]}}),
        (ValueError, "q of 'rocker' is nan: a finite number", {"q": [1, 2, np.nan]}),
        (ValueError, "qd of 'crank' is inf: a finite number", {"qd": {"crank": np.inf}}),
        (
            kempe.FailedError,
            r"q does not close the loops, but leaves open 'C' by [\d.]+ m; with '\w+' as given '\w+' is "
            r"[-\d.]+ rad, not .*; leave out coordinates that follow from others, or close q before",
            {"q": [1, 2, 3]},
        ),
        (kempe.FailedError, "with 'crank' as given 'rocker' is .* rad, not 0.2", {"q": {"crank": 1, "rocker": 0.2}}),
        (
            kempe.FailedError,
            r"the loops cannot be closed at this q: what stays open is 'C' by [\d.]+ m, with 'rocker' as given; give a "
            "position that the mechanism can reach",
            {"q": {"rocker": 3.0}},
        ),
        (kempe.FailedError, "qd contradicts itself, the closures or the drives: the rate", {"qd": {"crank": 1, "rocker": 5}}),
        (kempe.FailedError, "leave out rates that follow from others", {"qd": [1, 5, 3]}),
    ],
)
def test_mistakes(error, sentence, start, four_bar):
    for call in (four_bar.simulate, four_bar.system().simulate, four_bar.system().stepper, four_bar.start_at):
        with pytest.raises(error, match=sentence) as caught:
            call(**start)
        assert "--" not in str(caught.value)


def test_other_studies_say_how(four_bar):
    for call in (four_bar.system().linearize, four_bar.ensemble({"crank": [0.3]}).run, four_bar.sensitivity):
        with pytest.raises(TypeError, match=r"start_at\(q=\.\.\) of a model or system .* columns q\.NAME"):
            call(q={"crank": 1})


def test_move_of_another_is_told():
    """Two independent coordinates, of which the second cannot stay where the first goes."""
    robot = model("parallel_robot")
    system = robot.system()
    name = system.workspace().independent[0]
    k = robot.coordinates.index(name)
    own = system.assemble().q
    told = []
    for step in np.linspace(0, 3, 13):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                moved = system.start_at(q={name: own[k] + step}).assemble().q
            except kempe.FailedError:
                continue
        others = [robot.coordinates.index(each) for each in system.workspace().independent[1:]]
        stays = abs(moved[others] - own[others]).max() < 1e-3
        told.append(stays)
        assert stays != any("give it a value, too" in str(each.message) for each in caught)
    assert told[0] and len(told) > 1


# -- at an equilibrium -----------------------------------------------------------------------------------


def test_at_equilibrium(four_bar):
    """Runs, steppers, other systems and ensembles begin at the equilibrium that the command finds, and stay there."""
    rest = four_bar.system().equilibrium().equilibria
    place = [float(rest[f"q.{name}"][0]) for name in four_bar.coordinates]
    for call in (four_bar.simulate, four_bar.system().simulate):
        run = call(at="equilibrium", t_end=1)
        assert np.allclose(run.q[0], place, rtol=0, atol=1e-12) and abs(run.q - run.q[0]).max() < 1e-9
        assert not run.qd[0].any()
    stepper = four_bar.system().stepper(at="equilibrium", t_end=1)
    stepper.advance(0.5)
    assert np.allclose(stepper.q, place, rtol=0, atol=1e-9)
    held = four_bar.start_at(at="equilibrium")
    assert held is four_bar.start_at(at="equilibrium") and np.allclose(held.system().assemble().q, place, rtol=0, atol=1e-12)
    many = held.ensemble({"crank_mass": [0.5, 1, 2]}).run(t_end=0.3)
    assert abs(np.array([many.instances[f"qd.{name}"] for name in four_bar.coordinates])).max() < 1e-8


def test_at_equilibrium_from_a_given_start(four_bar):
    """A given position is where the search begins; a position that is given later counts."""
    pendulum = bodies(forces={"spring": {"joint": "arm", "torque": "20*sin(2*q(arm))"}})
    low, high = (pendulum.start_at(q={"arm": q}, at="equilibrium").system().assemble().q[0] for q in (0.3, -0.3))
    for q in (low, high):
        assert 20 * np.sin(2 * q) == pytest.approx(3 * 9.81 * np.sin(q), abs=1e-9)
    assert abs(low - high) > 1
    at = four_bar.start_at(at="equilibrium")
    assert at.start_at(q={"crank": 1.5}).system().assemble().q[0] == 1.5
    assert np.array_equal(at.start_at(at="start").simulate(t_end=0.1).q, four_bar.simulate(t_end=0.1).q)


def test_at_equilibrium_is_kept(four_bar):
    """Pickles and documents have the state."""
    at = four_bar.start_at(at="equilibrium")
    assert at.to_dict()["start"]["at"] == "equilibrium"
    for other in (pickle.loads(pickle.dumps(at)), kempe.Model.from_dict(at.to_dict())):
        assert np.array_equal(other.simulate(t_end=0.1).q, at.simulate(t_end=0.1).q)
    with pytest.raises(kempe.ArgumentError, match="unknown state 'rest'"):
        four_bar.simulate(at="rest")
