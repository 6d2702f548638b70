# SPDX-License-Identifier: BSD-3-Clause
"""Many instances that are advanced by the caller: as steppers with the same inputs, with the same bits for any lanes and threads."""

import warnings

import kempe
import numpy as np
import pytest
from conftest import ROOT

COUNT, STEP, STEPS = 9, 0.01, 25
OUTPUTS = "q, qd, qdd, position(bar.end)"


@pytest.fixture(scope="module")
def cart():
    return kempe.Model(ROOT / "tests/models/cart_and_linkage.yaml")


def starts():
    phi = np.random.default_rng(4).uniform(-0.2, 0.2, COUNT)
    return np.stack([0 * phi, phi, phi, -phi], axis=1)


def run(cart, lanes=0, threads=1):
    forces = np.random.default_rng(5).uniform(-9, 9, (STEPS, COUNT, 1))
    many = cart.ensemble_stepper(COUNT, OUTPUTS, lanes, t_end=5, rtol=1e-10, threads=threads)
    for k, q in enumerate(starts()):
        many.begin(k, q, [0.1, 0, 0, 0])
    return many, np.array([many.advance(STEP * (k + 1), ["u"], forces[k]) for k in range(STEPS)]), forces


def test_they_are_as_steppers(cart):
    many, rows, forces = run(cart)
    assert many.no_lanes == "" and many.names[:2] == ("q.x", "q.phi") and rows.shape == (STEPS, COUNT, len(many.names))
    outputs = cart.system().outputs(OUTPUTS)
    assert outputs.names == many.names
    for k, q in enumerate(starts()):
        stepper = cart.system().stepper(t_end=5, rtol=1e-10)
        stepper.set_state(q, [0.1, 0, 0, 0])
        for step in range(STEPS):
            stepper.set_input("u", forces[step, k, 0])
            stepper.advance(STEP * (step + 1))
            assert np.abs(rows[step, k] - outputs.at_stepper(stepper)).max() < 1e-7
        assert many.outcome(k) == "complete, not checked" and many.reason(k) == many.single(k) == ""
        assert np.abs(many.q[k] - stepper.q).max() < 1e-8 and np.abs(many.qd[k] - stepper.qd).max() < 1e-8
    assert (many.t == STEP * STEPS).all()
    assert repr(many).startswith("<EnsembleStepper: 9 instances in lanes, outputs q.x, q.phi")


@pytest.mark.parametrize("lanes, threads", [(1, 1), (5, 2), (16, 3)])
def test_lanes_and_threads_have_the_same_bits(cart, lanes, threads):
    assert (run(cart, lanes, threads)[1] == run(cart)[1]).all()


def test_steppers_in_place_of_lanes(cart):
    many, rows, _ = run(cart, -1, 2)
    assert np.abs(rows - run(cart)[1]).max() < 1e-7 and "by steppers (a request for separate runs)" in repr(many)
    assert many.single(0) == many.no_lanes == "a request for separate runs"
    assert cart.ensemble_stepper(1, "q", t_end=1, integrator="radau").no_lanes == "another integrator"


def test_some_stay_and_some_begin_again(cart):
    many = cart.ensemble_stepper(3, ["q"], t_end=1)
    assert np.isnan(many.t).all() and np.isnan(many.q).all()
    for k in range(3):
        many.begin(k)
    first = many.q[0].copy()
    out = np.zeros((3, 4))
    assert many.advance([0.1, np.nan, 0.2], ["u"], [[1], [1], [2]], out) is out
    assert (out[1] == 0).all() and (out[0] != out[2]).any() and many.t.tolist() == [0.1, 0, 0.2]
    many.begin(0)
    assert (many.q[0] == first).all() and many.t[0] == 0


def test_an_end_is_none_of_the_others():
    text = (ROOT / "tests/models/cart_and_linkage.yaml").read_text().replace("force: u", 'force: "u*sqrt(0.2 - q(x))"')
    many = kempe.Model.from_text(text).ensemble_stepper(2, "q", t_end=3)
    many.begin(0), many.begin(1)
    step = 1
    while many.outcome(0) == "complete, not checked" and step < 100:
        many.advance([0.02 * step, 0.02 * step], ["u"], [[20], [0]])
        step += 1
    assert many.outcome(0) == "failed" and many.reason(0) and many.single(0) and many.t[0] < many.t[1] and many.ended == 1
    assert many.outcome(1) == "complete, not checked" and many.single(1) == ""


def test_mistakes(cart):
    many = cart.ensemble_stepper(2, "q", t_end=1)
    with pytest.raises(kempe.ArgumentError, match="instance 0 has not begun"):
        many.advance(0.1)
    many.begin(0), many.begin(1)
    with pytest.raises(kempe.ArgumentError, match="instance 2 does not exist"):
        many.begin(2)
    with pytest.raises(kempe.ArgumentError, match="instance -1 does not exist"):
        many.reason(-1)
    with pytest.raises(kempe.ArgumentError, match="t_end = 1"):
        many.advance(1.5)
    with pytest.raises(kempe.ArgumentError, match="input 'v'"):
        many.advance(0.1, ["v"], [[1], [1]])
    with pytest.raises(kempe.ArgumentError, match="not finite"):
        many.advance(0.1, ["u"], [[1], [np.inf]])
    with pytest.raises(ValueError, match="values have the shape"):
        many.advance(0.1, ["u"], [1, 1])
    with pytest.raises(kempe.ArgumentError, match="q of 'phi' is nan"):
        many.begin(0, [0, np.nan, 2.5, 90])
    with pytest.raises(kempe.ArgumentError, match="a positive number"):
        cart.ensemble_stepper(0, "q", t_end=1)
    with pytest.raises(kempe.ArgumentError, match="nothing"):
        cart.ensemble_stepper(1, "nothing", t_end=1)


@pytest.mark.parametrize("lanes, threads", [(0, 1), (0, 2), (-1, 2)])
def test_doubts_are_said_once(lanes, threads):
    """A warning says once that instances are not trustworthy, and why, by the end of the step in which it happens."""
    slide = {"bodies": {"a": {"joint": {"name": "X", "prismatic": "x", "at": "ground"}, "mass": 1}}, "start": {"qd": {"X": 1}}}
    pushes = {"kempe": 1, **slide, "forces": {"f": {"joint": "X", "friction": {"force": "0.5*cos(4*t)"}}}}
    leaves = {"kempe": 1, **slide, "tables": {"law": {"x": [0, 0.2, 0.5], "y": [0, 1, 0], "method": "linear"}}, "forces": {"f": {"joint": "X", "force": "law(t)"}}}
    for text, said in ((pushes, "friction 'f' has a negative level in instances"), (leaves, "instances use table 'law' above 0.5")):
        many = kempe.Model.from_dict(text).ensemble_stepper(6, "q", lanes, t_end=2, threads=threads)
        for k in range(6):
            many.begin(k)
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            counts = []
            for t in 0.3, 0.9, 1.5:
                many.advance(np.full(6, t))
                counts.append(sum(said in str(one.message) for one in heard))
        assert counts[1:] == [1, 1]
