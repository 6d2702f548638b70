# SPDX-License-Identifier: BSD-3-Clause
"""Documents of models: entries that read back as the same model with the same bits, as they are and after changes; parts of models."""

import json
import pickle
import warnings

import kempe
import numpy as np
import pytest
from conftest import ROOT

EXAMPLES = sorted(path for path in (ROOT / "examples").glob("*/*.yaml") if "kempe:" in path.read_text())
OTHERS = sorted((ROOT / "tests/models").glob("*.yaml")) + sorted((ROOT / "tests/models").glob("*.urdf"))


@pytest.fixture(autouse=True)
def quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", kempe.KempeWarning)
        yield


def bits(model):
    try:
        run = model.simulate(t_end=0.02, no_convergence_check=True)
    except kempe.FailedError as error:
        return str(error)
    return run.t.tobytes(), run.q.tobytes(), run.qd.tobytes(), run.lam.tobytes()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_reads_back(path):
    """The same parsed model and the same motion, also by way of JSON text."""
    model = kempe.Model(path)
    entries = model.document()
    again = kempe.Model.from_dict(entries)
    assert again.to_dict() == model.to_dict() and bits(again) == bits(model)
    plain = json.loads(json.dumps(entries))
    assert kempe.Model.from_dict(plain, folder=entries.folder).to_dict() == model.to_dict()


def test_other_models_read_back():
    count = 0
    for path in OTHERS:
        try:
            model = kempe.Model(path)
        except kempe.Error:
            continue
        assert kempe.Model.from_dict(model.document()).to_dict() == model.to_dict(), path.name
        count += 1
    assert count > 100


def test_given_values_are_in_it(four_bar):
    path = ROOT / "examples/four_bar/four_bar.yaml"
    model = kempe.Model(path, crank="310 mm", base=0.91)
    entries = model.document()
    assert entries["parameters"]["crank"] == "310 mm" and entries["parameters"]["base"] == 0.91
    again = kempe.Model.from_dict(entries)
    assert bits(again) == bits(model) != bits(four_bar)
    assert kempe.Model.from_dict(pickle.loads(pickle.dumps(again)).document()).to_dict() == model.to_dict()
    cart = ROOT / "examples/cart_pole/cart_pole.yaml"
    for value in (3, "3 N", {"t": [0, 0.01, 1], "value": [1.0, 2.0, 0.0], "method": "linear"}):
        model = kempe.Model(cart, u=value)
        again = kempe.Model.from_dict(model.document())
        assert bits(again) == bits(model) and again.input_value("u", 0.005) == model.input_value("u", 0.005)


def test_changes_are_read(four_bar):
    entries = four_bar.document()
    entries["bodies"]["crank"]["mass"] = 2.5
    entries["run"]["outputs"] = ["position(coupler.C)"]
    changed = kempe.Model.from_dict(entries)
    assert changed.bodies["crank"]["mass"] == 2.5 and four_bar.bodies["crank"]["mass"] == 1
    assert changed.simulate(t_end=0.1)["position(coupler.C)"].shape[1] == 3
    entries["bodies"]["crank"]["mas"] = 1
    with pytest.raises(kempe.InputError, match="unknown key 'mas'"):
        kempe.Model.from_dict(entries)


def test_built_models_and_texts(tmp_path):
    arm = kempe.Builder("pendulum").gravity(0, -9.81, 0).parameter("L", 2)
    built = arm.body("arm", joint="A", mass=3, com=(0, "-L/2", 0), inertia=(0, 0, 1, 0, 0, 0)).q("A", 0.5).finish()
    entries = built.document()
    assert entries["bodies"]["arm"]["com"] == [0, "-L/2", 0]
    entries["parameters"]["L"] = 3
    assert kempe.Model.from_dict(entries).bodies["arm"]["com"] == [0, -1.5, 0]
    text = kempe.Model.from_text("kempe: 1\nbodies: {arm: {joint: {revolute: z, at: ground}, mass: 3, inertia: {zz: 1}}}")
    assert kempe.Model.from_dict(text.document()).to_dict() == text.to_dict()
    robot = kempe.Model(ROOT / "tests/models/geared_leg.urdf")
    assert robot.document()["kempe"] == 1 and bits(kempe.Model.from_dict(robot.document())) == bits(robot)


def test_what_cannot_be_in_it(four_bar, tmp_path):
    with pytest.raises(kempe.ArgumentError, match="another start"):
        four_bar.start_at(q={"crank": 1}).document()
    (tmp_path / "arm.yaml").write_text(
        "kempe: 1\nparameters: {m: 3}\nbodies: {arm: {joint: {name: a, revolute: z, at: ground}, mass: m, inertia: {zz: 1}}}\n"
    )
    (tmp_path / "whole.yaml").write_text("kempe: 1\ninclude: [{file: arm.yaml, prefix: one_}]\n")
    whole = kempe.Model(tmp_path / "whole.yaml")
    assert kempe.Model.from_dict(whole.document()).to_dict() == whole.to_dict()
    with pytest.raises(kempe.ArgumentError, match="'one_m'.*includes"):
        kempe.Model(tmp_path / "whole.yaml", one_m=4).document()


def test_parts(four_bar):
    cart = kempe.Model(ROOT / "examples/cart_pole/cart_pole.yaml", l="0.5 m")
    assert cart.parameters == {"l": 0.5} and cart.points == {"cart.pin": [0, 0, 0], "pole.tip": [0, 1, 0]}
    assert list(cart.bodies) == ["cart", "pole"] and cart.bodies["pole"]["com"] == [0, 0.5, 0]
    assert cart.joints["phi"] == {"body": "pole", "parent": "cart", "at": "pin", "coordinates": ["phi"], "axes": [[0, 0, 1]]}
    assert cart.actuators == {"push": {"kind": "force", "coordinate": "x", "effort": "u", "inputs": ["u"]}}
    assert four_bar.actuators == {} and np.allclose(four_bar.points["ground.D"], [0.9, 0, 0])
    robot = kempe.Model(ROOT / "tests/models/closed_arm.urdf")
    assert set(robot.joints) == {body["joint"] for body in robot.to_dict()["bodies"]}
