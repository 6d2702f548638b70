# SPDX-License-Identifier: BSD-3-Clause
"""Documents of models: entries that read back as the same model with the same bits, as they are and after changes; parts of models."""

import json
import os
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


def motion(model):
    """A short run, or the sentence that ends it."""
    try:
        return model.simulate(t_end=0.02, no_convergence_check=True)
    except kempe.FailedError as error:
        return str(error)


def bits_of(run):
    return run if isinstance(run, str) else (run.t.tobytes(), run.q.tobytes(), run.qd.tobytes(), run.lam.tobytes())


def bits(model):
    return bits_of(motion(model))


def parts(model):
    """The parsed model. Joints are cut for other reasons, though the same ones, where more of them have start values."""
    parsed = model.parsed()
    for cut in parsed.get("cuts", []):
        del cut["reason"]
    return parsed


def same(model):
    """The entries read back as the same parsed model and the same motion."""
    again = kempe.Model.from_dict(model.to_dict())
    return parts(again) == parts(model) and bits(again) == bits(model)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_reads_back(path):
    """The same parsed model and the same motion, also by way of JSON text, and with other starts: each start's parsed model, and the motion
    from one of them, a different one in the next example (KEMPE_FULL: from all)."""
    model = kempe.Model(path)
    entries, run = model.to_dict(), motion(model)
    again = kempe.Model.from_dict(entries)
    assert parts(again) == parts(model) and bits(again) == bits_of(run)
    plain = json.loads(json.dumps(entries))
    assert kempe.Model.from_dict(plain, folder=entries.folder).parsed() == model.parsed()
    if isinstance(run, str):
        return
    one = {name: float(run.q[-1, 0]) for name in model.coordinates[:1] if name not in model.states}
    rate = {model.coordinates[-1]: float(run.qd[-1, -1])}
    starts = ((run.q[-1], run.qd[-1]), (run.q[-1], None), (None, run.qd[-1]), (one, rate))
    found = []
    for q, qd in starts:
        try:
            found.append(model.start_at(q, qd))
        except kempe.FailedError:  # a drive moves it, or rates contradict each other
            continue
    moved = EXAMPLES.index(path)
    for k, started in enumerate(found):
        again = kempe.Model.from_dict(started.to_dict())
        assert parts(again) == parts(started), k
        if "KEMPE_FULL" in os.environ or k == moved % len(found):
            assert bits(again) == bits(started), k


def test_another_start_reads_back(four_bar):
    """Another start is in the entries of at least some examples: none of them refuses it here."""
    started = four_bar.start_at(q={"crank": 1.2}, qd={"crank": 2})
    assert same(started) and started.to_dict()["start"]["q"]["crank"] == 1.2 and bits(started) != bits(four_bar)
    again = kempe.Model.from_dict(started.to_dict()).start_at(qd={"crank": 3})
    assert same(again) and again.to_dict()["start"]["qd"] == {"crank": 3} | again.to_dict()["start"]["qd"]
    goals = {**four_bar.to_dict(), "start": {"q": {"crank": 0.5}, "goals": {"rocker": 0.3}}}
    assert same(kempe.Model.from_dict(goals).start_at(q={"crank": 0.2}))
    tank = {"kempe": 1, "bodies": {"lid": {"joint": {"prismatic": "z", "at": "ground"}, "mass": 2}}}
    tank["states"] = {"p": {"start": 3, "rate": "-p"}, "late": {"delay": "q(lid)", "time": 0.01, "before": "t"}}
    tank["forces"] = {"push": {"joint": "lid", "force": "p + late"}}
    assert same(kempe.Model.from_dict(tank)) and same(kempe.Model.from_dict(tank).start_at(qd={"p": 7, "late": 0.5}))


def test_instances_read_back(four_bar, tmp_path):
    values = {"crank": [0.29, 0.3, 0.31], "q.crank": [0.1, 0.2, 0.3], "qd.crank": 1}
    four_bar.ensemble(values).run_folder(tmp_path, chunk=2, t_end=0.1)
    for k in range(3):
        instance = four_bar.instance(tmp_path, k)
        entries = instance.to_dict()
        assert bits(kempe.Model.from_dict(entries)) == bits(instance) and entries["parameters"]["crank"] == values["crank"][k]


def test_other_models_read_back():
    count = 0
    for path in OTHERS:
        try:
            model = kempe.Model(path)
        except kempe.Error:
            continue
        assert kempe.Model.from_dict(model.to_dict()).parsed() == model.parsed(), path.name
        count += 1
    assert count > 100


def test_given_values_are_in_it(four_bar):
    path = ROOT / "examples/four_bar/four_bar.yaml"
    model = kempe.Model(path, crank="310 mm", base=0.91)
    entries = model.to_dict()
    assert entries["parameters"]["crank"] == "310 mm" and entries["parameters"]["base"] == 0.91
    again = kempe.Model.from_dict(entries)
    assert bits(again) == bits(model) != bits(four_bar)
    assert kempe.Model.from_dict(pickle.loads(pickle.dumps(again)).to_dict()).parsed() == model.parsed()
    cart = ROOT / "examples/cart_pole/cart_pole.yaml"
    for value in (3, "3 N", {"t": [0, 0.01, 1], "value": [1.0, 2.0, 0.0], "method": "linear"}):
        model = kempe.Model(cart, u=value)
        again = kempe.Model.from_dict(model.to_dict())
        assert bits(again) == bits(model) and again.input_value("u", 0.005) == model.input_value("u", 0.005)


def test_changes_are_read(four_bar):
    entries = four_bar.to_dict()
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
    entries = built.to_dict()
    assert entries["bodies"]["arm"]["com"] == [0, "-L/2", 0]
    entries["parameters"]["L"] = 3
    assert kempe.Model.from_dict(entries).bodies["arm"]["com"] == [0, -1.5, 0]
    text = kempe.Model.from_text("kempe: 1\nbodies: {arm: {joint: {revolute: z, at: ground}, mass: 3, inertia: {zz: 1}}}")
    assert kempe.Model.from_dict(text.to_dict()).parsed() == text.parsed()
    robot = kempe.Model(ROOT / "tests/models/geared_leg.urdf")
    assert robot.to_dict()["kempe"] == 1 and bits(kempe.Model.from_dict(robot.to_dict())) == bits(robot)


def test_values_of_included_files(tmp_path):
    link = "bodies: {link: {joint: {revolute: z, at: ground}, mass: m, inertia: {zz: 1}, points: {end: [l, 0, 0]}}}"
    law = "forces: {turn: {joint: link, torque: u}}\nstart: {qd: {link: 0.5}, goals: {link: 0.1}}"
    (tmp_path / "link.yaml").write_text(f"kempe: 1\nparameters: {{l: 1, m: 3}}\ninputs: {{u: {{unit: N*m}}}}\n{link}\n{law}\n")
    pair = "[{file: link.yaml, prefix: a_}, {file: link.yaml, prefix: b_, at: a_link.end, set: {m: 2}}]"
    (tmp_path / "pair.yaml").write_text(f"kempe: 1\ninclude: {pair}\n")
    (tmp_path / "whole.yaml").write_text("kempe: 1\nparameters: {k: 2}\ninclude: [{file: pair.yaml, prefix: one_}, {file: pair.yaml, prefix: two_}]\n")
    samples = {"t": np.linspace(0, 1, 3), "value": np.array([0.0, 2.0, 1.0]), "method": "linear"}
    values = {"one_a_m": 4, "two_b_l": "500 mm", "two_b_m": "k*1 kg", "one_b_u": 3, "two_a_u": samples}
    whole = kempe.Model(tmp_path / "whole.yaml", values)
    assert same(whole) and bits(whole) != bits(kempe.Model(tmp_path / "whole.yaml"))
    assert whole.to_dict()["include"][0]["set"] == {"a_m": 4, "b_u": 3}
    assert whole.parameters["one_a_m"] == 4 and whole.parameters["two_b_m"] == 2 and whole.parameters["one_b_m"] == 2
    rates = dict.fromkeys(whole.coordinates, 1.0)
    started = whole.start_at(q={"one_a_link": 0.7}, qd=rates)
    assert same(started) and started.to_dict()["start"]["goals"] == dict.fromkeys(whole.coordinates)
    with pytest.raises(kempe.InputError, match="no parameter 'one_c_m'"):
        kempe.Model(tmp_path / "whole.yaml", one_c_m=4)


def test_starts_of_a_file_and_of_one_that_it_includes():
    """Both have goals and rates of the same coordinates, and none of them is in another start."""
    model = kempe.Model(ROOT / "tests/models/starts.yaml")
    started = model.start_at(q=[0.1, 0.2, 0.3], qd=[1, 2, 3])
    assert same(model) and same(started) and started.parsed()["start"]["goals"] == {}
    assert same(model.start_at(qd=[1, 2, 3])) and same(started.start_at(qd={model.coordinates[0]: 5}))


def test_settings_of_robots_are_in_it(tmp_path):
    leg = ROOT / "tests/models/geared_leg.urdf"
    (tmp_path / "leg.urdf").write_text(leg.read_text().replace("</joint>", "<spindle/></joint>", 1))
    (tmp_path / "whole.yaml").write_text("kempe: 1\ngravity: [0, 0, -9.81]\ninclude: [{file: leg.urdf, prefix: l_, base: fixed}, {file: leg.urdf, prefix: r_}]\n")
    for more in ({}, {"robot_base": "free"}, {"joint_limits": True}):
        whole = kempe.Model(tmp_path / "whole.yaml", leave_out="spindle", **more)
        assert kempe.Model.from_dict(whole.to_dict()).parsed() == whole.parsed(), more
    assert [entry.get("base") for entry in whole.to_dict()["include"]] == ["fixed", None]
    with pytest.raises(kempe.InputError, match="spindle"):
        kempe.Model(tmp_path / "whole.yaml")


def test_closure_tolerance_is_in_it(four_bar):
    assert kempe.Model(ROOT / "examples/four_bar/four_bar.yaml", closure_tolerance=1e-3).to_dict()["closure_tolerance"] == 1e-3


def test_both_names_are_one():
    assert kempe.Model.document is kempe.Model.to_dict


def test_parts(four_bar):
    cart = kempe.Model(ROOT / "examples/cart_pole/cart_pole.yaml", l="0.5 m")
    assert cart.parameters == {"l": 0.5} and cart.points == {"cart.pin": [0, 0, 0], "pole.tip": [0, 1, 0]}
    assert list(cart.bodies) == ["cart", "pole"] and cart.bodies["pole"]["com"] == [0, 0.5, 0]
    assert cart.joints["phi"] == {"body": "pole", "parent": "cart", "at": "pin", "coordinates": ["phi"], "axes": [[0, 0, 1]]}
    assert cart.actuators == {"push": {"kind": "force", "coordinate": "x", "effort": "u", "inputs": ["u"]}}
    assert four_bar.actuators == {} and np.allclose(four_bar.points["ground.D"], [0.9, 0, 0])
    robot = kempe.Model(ROOT / "tests/models/closed_arm.urdf")
    assert set(robot.joints) == {body["joint"] for body in robot.parsed()["bodies"]}
