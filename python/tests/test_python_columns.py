# SPDX-License-Identifier: BSD-3-Clause
"""Data in memory: measured motions, prescribed motions, samples of inputs, references, values of ensembles."""

import pickle
import re

import kempe
import kempe._options
import numpy as np
import pytest
from conftest import ROOT
from kempe.columns import TABLES, columns_of

EXAMPLES = ROOT / "examples"
ASK = {"columns": "q.rocker", "parameters": {"crank_mass": (0.1, 5)}}
T = np.linspace(0, 2, 21)


def cart(**inputs):
    return kempe.Model(EXAMPLES / "cart_pole/cart_pole.yaml", **inputs)


@pytest.fixture
def measured():
    return kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", crank_mass=2).simulate(t_end=0.5)


def forms(run):
    """The same rows in each form."""
    structured = np.array(list(zip(run.t, run.q[:, 2])), dtype=[("t", float), ("q.rocker", float)])
    return {
        "table": run.rows,
        "frozen": pickle.loads(pickle.dumps(run.rows)),
        "mapping": {"t": run.t, "q(rocker)": run.q[:, 2]},
        "lists": {"t": run.t.tolist(), "q.rocker": run.q[:, 2].tolist()},
        "structured": structured,
        "trajectory": run,
    }


# -- the same bits as from a file ------------------------------------------------------------------------


def test_fit_of_each_form(four_bar, measured, tmp_path):
    path = tmp_path / "measured.csv"
    measured.rows.write(path)
    by_file = four_bar.fit(data=path, **ASK)
    for name, data in forms(measured).items():
        found = four_bar.fit(data=data, **ASK)
        assert found.values == by_file.values, name
        assert np.array_equal(found.rows["q.rocker"], by_file.rows["q.rocker"]), name
    assert by_file.values["crank_mass"] == pytest.approx(2, abs=1e-6)
    several = four_bar.fit(data=measured.rows, files=[measured, path], **ASK)
    assert several.values["crank_mass"] == pytest.approx(2, abs=1e-6) and set(several.rows["file"]) == {1, 2, 3}
    again = four_bar.fit(data=measured, start=by_file.parameters, **ASK)
    assert again.parameters["start"][0] == by_file.values["crank_mass"]


def test_frames(four_bar, measured):
    pytest.importorskip("pandas")
    frame = measured.to_pandas()
    by_table = four_bar.fit(data=measured.rows, **ASK).values
    assert frame.index.name == "t" and four_bar.fit(data=frame, **ASK).values == by_table
    assert four_bar.fit(data=frame.reset_index(), **ASK).values == by_table
    values = four_bar.values(frame.iloc[:2].rename(columns={"q.crank": "crank"})[["crank"]])
    assert values.names == ("crank",) and len(values) == 2


def test_units_gaps_and_vectors(four_bar, measured):
    degrees = {"t": measured.t, "q(rocker) [deg]": np.degrees(measured.q[:, 2])}
    assert four_bar.fit(data=degrees, **ASK).values["crank_mass"] == pytest.approx(2, abs=1e-6)
    gaps = measured.q[:, 2].copy()
    gaps[3] = np.nan
    found = four_bar.fit(data={"t": measured.t, "q(rocker)": gaps}, **ASK)
    assert found.columns["count"][0] == len(measured) - 1
    points = {"t": measured.t, "position(coupler.C)": measured["position(coupler.C)"]}
    found = four_bar.fit(data=points, columns="position.coupler.C.x", parameters=ASK["parameters"])
    assert found.values["crank_mass"] == pytest.approx(2, abs=1e-6)
    assert list(columns_of("data", points))[1:] == [f"position.coupler.C.{axis}" for axis in "xyz"]


def test_masked_numbers_are_unknown(four_bar, measured):
    """The data below a mask is not measured: files of some formats are read as masked arrays."""
    gaps, mask = measured.q[:, 2].copy(), np.zeros(len(measured), dtype=bool)
    gaps[3], mask[3] = 1e3, True
    found = four_bar.fit(data={"t": measured.t, "q(rocker)": np.ma.array(gaps, mask=mask)}, **ASK)
    assert found.columns["count"][0] == len(measured) - 1 and found.values["crank_mass"] == pytest.approx(2, abs=1e-6)
    whole = four_bar.fit(data={"t": np.ma.array(measured.t), "q(rocker)": np.ma.array(measured.q[:, 2])}, **ASK)
    assert whole.columns["count"][0] == len(measured)
    with pytest.raises(ValueError, match="the time of row 3 is nan"):
        four_bar.fit(data={"t": np.ma.array(measured.t, mask=mask), "q(rocker)": measured.q[:, 2]}, **ASK)
    workspace, q = four_bar.system().workspace(), np.ma.array(measured.q[0], mask=[False, True, False])
    for call in (workspace.evaluate, workspace.forward_dynamics):
        assert np.array_equal(call(0.0, np.ma.array(measured.q[0]), measured.qd[0])[0], call(0.0, measured.q[0], measured.qd[0])[0])
        with pytest.raises(kempe.FailedError, match="not finite"):
            call(0.0, q, measured.qd[0])
    with pytest.raises(ValueError, match="q of 'coupler' is nan"):
        four_bar.simulate(q=q)
    with pytest.raises((kempe.ArgumentError, kempe.FailedError), match="nan|not finite"):
        four_bar.flow(0.1, variables="crank", outputs="q(rocker)")(np.ma.array([0.3], mask=[True]))


def test_motions(four_bar, tmp_path):
    system, path = four_bar.system(), tmp_path / "motion.csv"
    run = four_bar.simulate(t_end=0.5, output_step=0.05)
    columns = {f"{kind}.{name}": getattr(run, kind)[:, k] for kind in ("q", "qd", "qdd") for k, name in enumerate(run.names)}
    head = ",".join(["t", *columns])
    np.savetxt(path, np.column_stack([run.t, *columns.values()]), "%.17g", ",", header=head, comments="")
    by_file = system.inverse(actuators="crank", motion=path)
    for motion in (run, {"t": run.t, **columns}):
        assert np.array_equal(system.inverse(actuators="crank", motion=motion).rows["tau.crank"], by_file.rows["tau.crank"])
    turning = system.inverse(actuators="crank", motion={"t": T, "q(crank)": lambda t: 2 * t + 0.1 * np.sin(t)})
    assert turning.status == "complete" and np.array_equal(turning.rows["t"], T)
    assert np.array_equal(turning.rows["q.crank"], [2 * t + 0.1 * np.sin(t) for t in T])


def test_reference(four_bar):
    exact = four_bar.simulate(t_end=0.5, rtol=1e-12)
    error = four_bar.simulate(t_end=0.5, rtol=1e-6, reference=exact).to_dict()["error"]
    assert 0 < error["q"] < 1e-3
    compared = four_bar.system().compare(t_end=0.5, reference=exact, formulations="reduced", integrators="dop853", rtols=[1e-6])
    assert compared.runs.row_count > 0


def test_inputs(tmp_path):
    path = tmp_path / "u.csv"
    path.write_text("t,v\n" + "".join(f"{float(t)!r},{float(np.sin(t))!r}\n" for t in T))
    by_file = cart(u=f"{path}:v:cubic").simulate(t_end=1)
    for samples in ({"t": T, "value": np.sin(T)}, {"t": T.tolist(), "value": np.sin}):
        model = cart(u={**samples, "method": "cubic"})
        run = model.simulate(t_end=1)
        assert np.array_equal(run.q, by_file.q)
        assert np.array_equal(pickle.loads(pickle.dumps(model)).simulate(t_end=1).q, run.q)
        assert model.input_value("u", T[7]) == np.sin(T[7]) and "<html" in str(run.report())
        batch = pickle.loads(pickle.dumps(model.ensemble({"l": [0.4, 0.5]}))).run(t_end=1)
        assert abs(batch.q[0] - run.q[-1]).max() < 1e-6
    held = cart(u={"t": [0, 1], "value": [1, 3], "method": "hold"})
    assert held.input_value("u", 0.9) == 1 and held.input_value("u", 1.1) == 3
    text = (EXAMPLES / "cart_pole/cart_pole.yaml").read_text()
    again = kempe.Model.from_text(text, u={"t": T, "value": np.sin, "method": "cubic"})
    assert np.array_equal(again.simulate(t_end=1).q, by_file.q)


def test_nothing_stays(four_bar, measured, tmp_path, monkeypatch):
    """A table in memory is forgotten after its call: its name is a file again."""
    monkeypatch.chdir(tmp_path)
    four_bar.fit(data=measured, **ASK)
    with pytest.raises(kempe.FileError, match="cannot read 'data'"):
        four_bar.fit(data="data", **ASK)
    with pytest.raises(kempe.InputError):
        four_bar.fit(data={"q(rocker)": [1.0]}, **ASK)
    with pytest.raises(kempe.FileError, match="cannot read 'data'"):
        four_bar.fit(data="data", **ASK)
    assert not list(tmp_path.iterdir())


def test_options_that_are_tables():
    """All options of which the headers say that they are tables may be in memory."""
    found = {}
    for name in dir(kempe._options):
        keys = getattr(getattr(kempe._options, name), "__annotations__", {}) if name.endswith("Options") else {}
        tables = {key for key, kind in keys.items() if "Data" in str(kind)}
        if tables:
            found["kempe_" + re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()] = tables
    assert found == {struct: set(keys) for struct, keys in TABLES.items()}


# -- mistakes ------------------------------------------------------------------------------------------


def fitted(data):
    return lambda model: model.fit(data=data, **ASK)


def moved(motion):
    return lambda model: model.system().inverse(actuators="crank", motion=motion)


def pushed(**inputs):
    return lambda model: cart(**inputs)


@pytest.mark.parametrize(
    "error, sentence, call",
    [
        (TypeError, r"data: a path, a mapping .* not an array of the shape \(2, 3\) without names", fitted(np.zeros((2, 3)))),
        (TypeError, "data: a path, a mapping .* not list", fitted([1, 2])),
        (TypeError, "data: .* not a function; a column of a mapping may be a function of its column t", fitted(np.sin)),
        (ValueError, "data: there are no columns", fitted({})),
        (ValueError, "data: there are no rows", fitted({"t": [], "q(rocker)": []})),
        (ValueError, "data: columns of one length are needed; there are 't' 2, 'q.rocker' 1", fitted({"t": [0, 1], "q(rocker)": [1]})),
        (ValueError, "data: the times must increase; row 2 has 1 s after 1 s", fitted({"t": [0, 1, 1], "q(rocker)": [1, 2, 3]})),
        (ValueError, "data: the time of row 1 is nan", fitted({"t": [0, np.nan], "q(rocker)": [1, 2]})),
        (ValueError, r"data: the column 'q\(rocker\)' has an infinite value in row 1", fitted({"t": [0, 1], "q(rocker)": [1, np.inf]})),
        (TypeError, r"data: the column 'q\(rocker\)' has texts", fitted({"t": [0, 1], "q(rocker)": ["1", "2"]})),
        (TypeError, "data: the column 't' has values of datetime64", fitted({"t": np.array(["2026-01-01"], "M8[s]"), "q(rocker)": [1]})),
        (TypeError, "data: the column 't' has values that are not numbers", fitted({"t": [object()], "q(rocker)": [1]})),
        (ValueError, r"data: the column 'q\(rocker\)' has the shape \(2, 4\)", fitted({"t": [0, 1], "q(rocker)": np.zeros((2, 4))})),
        (ValueError, "data: the column 'q.rocker' is given twice", fitted({"t": [0], "q(rocker)": [1], "q.rocker": [1]})),
        (TypeError, "data: names of columns are texts, not 3", fitted({"t": [0], 3: [1]})),
        (ValueError, "data: 'a,b' cannot be the name of a column", fitted({"t": [0], "a,b": [1]})),
        (kempe.InputError, "^data: column t is missing$", fitted({"q(rocker)": [1]})),
        (kempe.InputError, "^data: the unit of this column does not fit: rad is expected$", fitted({"t": [0, 1], "q(rocker) [m]": [1, 2]})),
        (kempe.InputError, "^data: 'q.roker' is not an output", lambda m: m.fit(data={"t": [0], "q(roker)": [1]}, parameters="crank_mass")),
        (kempe.ArgumentError, "^data is missing$", lambda m: m.fit(**ASK)),
        (TypeError, "files: a list of tables is needed, not dict", lambda m: m.fit(data={"t": [0], "q(rocker)": [1]}, files={}, **ASK)),
        (kempe.ArgumentError, r"motion: 'q\(crank\)' is a function of t; the times .* as the column t", moved({"q(crank)": np.sin})),
        (kempe.InputError, "motion: column q.NAME is missing", moved({"t": [0, 1]})),
        (kempe.InputError, "motion: column q.crank has no value at t = 1 s", moved({"t": [0, 1], "q(crank)": [0, np.nan]})),
        (kempe.InputError, "unknown column 'q.crnk'", moved({"t": [0, 1], "q(crnk)": [0, 1]})),
        (TypeError, "motion: a path, .* not int", moved(3)),
        (kempe.ArgumentError, "u: the method between samples is missing; it is one of hold, linear, cubic", pushed(u={"t": T, "value": T})),
        (kempe.ArgumentError, "u: the method .* is 'spline'", pushed(u={"t": T, "value": T, "method": "spline"})),
        (kempe.ArgumentError, "u: samples are .* there are the columns t, force", pushed(u={"t": T, "force": T, "method": "hold"})),
        (kempe.ArgumentError, "u: samples are .* there are the columns value", pushed(u={"value": np.sin, "method": "hold"})),
        (ValueError, "u: the times must increase", pushed(u={"t": T[::-1], "value": T, "method": "hold"})),
        (ValueError, "u: the sample of row 0 is nan", pushed(u={"t": [0], "value": [np.nan], "method": "hold"})),
        (TypeError, 'u: {"t": times, .* is needed for an input that varies, .* not a function', pushed(u=np.sin)),
        (TypeError, "u: .* not 21 values", pushed(u=T)),
        (TypeError, "u: .* not 2 values", pushed(u=[1, 2])),
        (kempe.ArgumentError, "'l' is a parameter, which is a number; samples are for inputs", pushed(l={"t": T, "value": T, "method": "hold"})),
        (kempe.InputError, "^w:1:1: the model has no parameter 'w'", pushed(w={"t": T, "value": T, "method": "hold"})),
        (kempe.InputError, "^u:1:1: unknown parameter 'abc'", pushed(u="abc")),
        (TypeError, "values: a path, .* not list", lambda m: m.values([[1, 2]])),
        (ZeroDivisionError, "", moved({"t": [0, 1], "q(crank)": lambda t: 1 / 0})),
    ],
)
def test_mistakes(error, sentence, call, four_bar):
    with pytest.raises(error, match=sentence) as caught:
        call(four_bar)
    assert not re.search(r"--[a-z]|NULL", str(caught.value))


@pytest.mark.parametrize(
    "call",
    [
        lambda m: m.generate(language="basic"),
        lambda m: m.generate(language="octave", vectorised=True, keep_parameters=True, sets="nonsense"),
        lambda m: m.system().inverse(t_end=1),
        lambda m: m.system().compare(t_end=0.1, budget=1e-9),
        lambda m: m.sample("crank=IT7", design="nonsense"),
        lambda m: m.ensemble({"crank": [0.3]}).run_folder("/nothing/there"),
        lambda m: m.optimize(minimize="max(q(rocker))", parameters="crank"),
        lambda m: m.fit(data={"t": [0, 0.1, 0.2], "q(rocker)": [0, 0, 0], "who": [0, 0, 0]}, parameters="crank_mass"),
    ],
)
def test_no_options_of_the_command(call, four_bar):
    with pytest.raises((kempe.Error, TypeError)) as caught:
        call(four_bar)
    assert not re.search(r"(^|\W)--[a-z]", str(caught.value))


def test_the_model_itself(four_bar):
    """Without values an ensemble has one instance, the model, with the quantities of a run."""
    batch = four_bar.ensemble(quantities={"swing": "range(q(rocker))"}).run(t_end=1)
    rocker = four_bar.simulate(t_end=1, output_step=1e-3)["q.rocker"]
    assert batch.status == ["complete"] and batch.q.shape == (1, 3)
    assert batch.quantities["swing"][0] == pytest.approx(rocker.max() - rocker.min(), rel=1e-5)
    again = pickle.loads(pickle.dumps(four_bar.values()))
    assert len(again) == 1 and again.names == ()
