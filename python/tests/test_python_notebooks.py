# SPDX-License-Identifier: BSD-3-Clause
"""Needs of notebooks and clusters: progress, pickled models and results, displays."""

import concurrent.futures
import copy
import doctest
import importlib
import importlib.machinery
import importlib.util
import inspect
import io
import multiprocessing
import os
import pickle
import pkgutil
import re
import shutil
import signal
import sys

import kempe
import numpy as np
import pytest
from conftest import ROOT

EXAMPLES = ROOT / "examples"


def all_results():
    """A result of each study, by name."""
    four_bar = kempe.Model(EXAMPLES / "four_bar/four_bar.yaml")
    quarter_car = kempe.Model(EXAMPLES / "quarter_car/quarter_car.yaml").system()
    system = four_bar.system()
    return {
        "check": system.check(),
        "assembly": system.assemble(),
        "branches": system.branches(),
        "trajectory": four_bar.simulate(t_end=0.2),
        "comparison": system.compare(t_end=0.05, rtols=[1e-4], formulations="reduced", integrators=["dop853"]),
        "kinematics": system.kinematics(sweep={"crank": (0, 6, 31)}),
        "equilibrium": quarter_car.equilibrium(),
        "linearization": quarter_car.linearize(),
        "modes": quarter_car.modes(),
        "sensitivity": four_bar.sensitivity(parameters="crank", t_end=0.1),
        "batch": four_bar.ensemble({"crank": [0.29, 0.3]}).run(t_end=0.1),
        "code": four_bar.generate(language="python", sets="M_C"),
        "count": four_bar.count(sets="M_C"),
    }


@pytest.fixture(scope="module")
def results():
    return all_results()


# -- progress ----------------------------------------------------------------------------------------------


@pytest.fixture
def at_every_step(monkeypatch):
    """Reports after each step instead of ten times a second."""
    on_count = kempe.context.Context.on_count
    monkeypatch.setattr(
        kempe.context.Context, "on_count", lambda self, receive, interval=0.0: on_count(self, receive, 0.0)
    )


def test_progress_of_a_run_and_of_studies(four_bar, at_every_step):
    seen = []
    expected = four_bar.simulate(t_end=0.5, no_convergence_check=1)
    run = four_bar.simulate(t_end=0.5, no_convergence_check=1, progress=seen.append)
    assert np.array_equal(run.q, expected.q)
    assert all(p.unit == "s" and p.total == 0.5 for p in seen) and seen[-1].done == 0.5 and seen[-1].part == 1
    assert [p.done for p in seen] == sorted(p.done for p in seen)
    assert seen[0].left is None and seen[-1].left == 0 and "0.5 of 0.5 s (100 %)" in str(seen[-1])
    count = len(seen)
    four_bar.simulate(t_end=0.5)
    assert len(seen) == count  # only of that run
    system = four_bar.system()
    studies = {
        "rows": lambda: system.kinematics(sweep={"crank": (0, 6, 31)}, progress=seen.append),
        "runs": lambda: system.compare(t_end=0.05, rtols=[1e-4, 1e-6], formulations="reduced", progress=seen.append),
        "starts": lambda: system.branches(progress=seen.append),
        "instances": lambda: four_bar.ensemble({"crank": np.linspace(0.28, 0.3, 4)}).run(
            t_end=0.1, lanes=-1, threads=1, no_convergence_check=1, progress=seen.append
        ),
    }
    for unit, study in studies.items():
        seen.clear()
        study()
        counts = [p.done for p in seen if p.unit == unit]
        assert len(counts) > 1 and counts == sorted(counts), unit


def test_exception_of_progress_ends_the_run(four_bar, at_every_step):
    def receive(progress):
        if progress.done > 0.1:
            raise ZeroDivisionError("enough")

    with pytest.raises(ZeroDivisionError, match="enough"):
        four_bar.simulate(t_end=1e4, progress=receive)
    assert four_bar.simulate(t_end=0.1).status == "complete"


def test_bars_of_tqdm(four_bar, at_every_step, capsys):
    pytest.importorskip("tqdm")
    four_bar.simulate(t_end=0.5, progress=True)
    text = capsys.readouterr().err
    assert text.count("100% |") >= 2 and "0.5 of 0.5 s" in text  # the run, and the one at another tolerance


def test_interrupt_of_a_run_that_reports(four_bar, at_every_step):
    def receive(progress):
        if not sent and progress.done > 0.1:
            sent.append(os.kill(os.getpid(), signal.SIGINT))

    sent = []
    with pytest.raises(kempe.Interrupted) as caught:
        four_bar.simulate(t_end=1e4, progress=receive)
    assert 0 < caught.value.partial.t[-1] < 1e4 and caught.value.partial.status == "stopped"
    assert four_bar.simulate(t_end=0.1).status == "complete"


def test_line_without_tqdm(four_bar, at_every_step, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    four_bar.simulate(t_end=0.5, progress=True)
    text = capsys.readouterr().err
    assert text.startswith("\r") and "0.5 of 0.5 s (100 %)" in text and text.endswith("\n")


def test_lines_of_all_computations(four_bar, at_every_step):
    lines = []
    four_bar.on_progress(lines.append)
    four_bar.simulate(t_end=0.2)
    assert any("of 0.2 s" in line for line in lines)
    four_bar.on_progress(None)
    lines.clear()
    four_bar.simulate(t_end=0.2)
    assert not lines


# -- pickles and copies --------------------------------------------------------------------------------------


def equal(a, b):
    """Equal values of attributes: numbers, arrays, tables, texts and containers of them."""
    if isinstance(a, (dict, kempe.Table)):
        return list(a) == list(b) and all(equal(a[name], b[name]) for name in a)
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=a.dtype.kind in "fc")
    return a == b


def public(kind):
    """Names of the attributes of a class that take no argument."""
    for name in dir(kind):
        found = inspect.getattr_static(kind, name)
        if not name.startswith("_") and (
            isinstance(found, property) or hasattr(found, "__get__") and not callable(found)
        ):
            yield name


def attribute(result, name):
    try:
        return getattr(result, name)
    except kempe.Error as missing:
        return str(missing)


def test_pickled_results_have_all_that_is_known(results):
    for name, result in results.items():
        again = pickle.loads(pickle.dumps(result))
        assert isinstance(again, type(result)) and repr(again) == repr(result), name
        assert str(again) == str(result) and again.text(full=True) == result.text(full=True)
        assert again.to_dict() == result.to_dict() and again._repr_html_()
        names = [each for each in public(type(result)) if each not in ("tables_and_matrices",)]
        for each in names:
            assert equal(attribute(result, each), attribute(again, each)), f"{name}.{each}"
        assert repr(pickle.loads(pickle.dumps(again))) == repr(result)
    run, again = results["trajectory"], pickle.loads(pickle.dumps(results["trajectory"]))
    assert len(again) == len(run) and np.array_equal(again["q(crank)"], run.q[:, 0]) and again.verdict == run.verdict
    with pytest.raises(TypeError, match="needs the Trajectory itself"):
        again["position(coupler.C)"]
    branches = pickle.loads(pickle.dumps(results["branches"]))
    assert [list(q) for q in branches] == [list(q) for q in results["branches"]]
    assert pickle.loads(pickle.dumps(results["equilibrium"])).is_stable() is results["equilibrium"].is_stable()


def push(t, q, qd):
    return -0.1 * qd


def test_pickled_systems_and_built_models(four_bar):
    system = pickle.loads(pickle.dumps(four_bar.system("plain", push)))
    expected = four_bar.system("plain", push).simulate(t_end=0.2)
    assert np.array_equal(system.simulate(t_end=0.2).q, expected.q)
    built = kempe.Builder("pendulum").gravity(0, -9.81, 0).parameter("L", 2)
    built.body("arm", joint="A", mass=3, com=(0, "-L/2", 0), inertia=(0, 0, 1, 0, 0, 0)).q("A", 0.5)
    model = built.finish()
    again = pickle.loads(pickle.dumps(model))
    assert np.array_equal(again.simulate(t_end=0.2).q, model.simulate(t_end=0.2).q)


def test_copies(four_bar, results):
    for fixed in (four_bar, four_bar.system(), results["trajectory"], results["trajectory"].rows):
        assert copy.copy(fixed) is fixed and copy.deepcopy([fixed])[0] is fixed
    stepper = four_bar.system().stepper(t_end=1)
    stepper.advance(0.2)
    other = copy.copy(stepper)
    stepper.advance(0.4)
    assert other.t == 0.2 and other.q[0] != stepper.q[0]
    with pytest.raises(TypeError, match="a Workspace cannot be pickled or copied"):
        copy.copy(four_bar.system().workspace())


def one_of_many(job):
    model, length = job
    return kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", crank=length).simulate(t_end=0.2), model.simulate(t_end=0.2)


def test_four_spawned_processes(four_bar):
    lengths = [0.28, 0.29, 0.3, 0.31]
    with concurrent.futures.ProcessPoolExecutor(4, multiprocessing.get_context("spawn")) as pool:
        runs = list(pool.map(one_of_many, [(four_bar, length) for length in lengths]))
    expected = four_bar.simulate(t_end=0.2)
    for (run, same), length in zip(runs, lengths):
        assert np.array_equal(same.q, expected.q) and same.units == expected.units
        assert np.array_equal(run.q, one_of_many((four_bar, length))[0].q)


# -- displays ------------------------------------------------------------------------------------------------


def test_displays_are_small_and_well_formed(results, four_bar):
    from html.parser import HTMLParser

    class Balanced(HTMLParser):
        def __init__(self):
            super().__init__()
            self.open = []

        def handle_starttag(self, tag, attributes):
            if tag not in ("br", "img"):
                self.open.append(tag)

        def handle_endtag(self, tag):
            assert self.open.pop() == tag

    for name, shown in {"model": four_bar, **results, "table": results["trajectory"].rows}.items():
        page = shown._repr_html_()
        parser = Balanced()
        parser.feed(page)
        assert not parser.open and 100 < len(page) < 30_000, name
        assert "color" not in re.sub(r'src="[^"]*"', "", page) and "<style" not in page, name  # the notebook's own


def test_displays_say_what_matters(results, four_bar):
    assert "crank" in four_bar._repr_html_() and "parameters" in four_bar._repr_html_()
    assert 'degrees of freedom</th><td style="text-align: left">1<' in results["check"]._repr_html_()
    run = results["trajectory"]._repr_html_()
    assert "converged" in run and "data:image/svg+xml" in run
    assert "processor time, ms" in results["comparison"]._repr_html_()
    assert "stable: every mode decays" in results["modes"]._repr_html_()
    model = kempe.Model(EXAMPLES / "limousine/limousine.yaml")
    assert "more bodies" in model._repr_html_()


def test_animation_in_a_cell(results):
    try:
        page = results["trajectory"].report()
    except kempe.FileError as missing:
        pytest.skip(str(missing))
    frame = page._repr_html_()
    assert frame.startswith('<iframe srcdoc="') and "&lt;html" in frame and "<html" not in frame


# -- the comparison of notebooks -----------------------------------------------------------------------------


def test_comparison_of_notebooks_can_fail():
    for name in ("nbformat", "nbclient"):
        pytest.importorskip(name)
    loader = importlib.machinery.SourceFileLoader("run_notebooks", str(EXAMPLES / "notebooks/run"))
    run = importlib.util.module_from_spec(importlib.util.spec_from_loader("run_notebooks", loader))
    loader.exec_module(run)
    assert run.difference("a 1.2346 of 5, 2e-8 m", "a 1.2345 of 5, 1e-8 m") is None  # the last digit
    for other in ("a 1.2365 of 5, 1e-8 m", "a 1.2345 of 7, 1e-8 m", "a 1.2345 of 5, 4e-8 m", "b 1.2345 of 5, 1e-8 m"):
        assert run.difference(other, "a 1.2345 of 5, 1e-8 m") is not None, other


# -- examples in docstrings ----------------------------------------------------------------------------------

MODULES = [
    kempe,
    *(
        importlib.import_module(f"kempe.{name}")
        for _, name, _ in pkgutil.iter_modules(kempe.__path__)
        if name[0] != "_"
    ),
]
PACKAGES = {"# with SciPy": "scipy", "# with pandas": "pandas", "# with IPOPT": "casadi", "# with gymnasium": "gymnasium", "# with xarray": "xarray"}


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_examples_of_docstrings(module, tmp_path, monkeypatch):
    """Each runs by itself, in a folder with three models and a mesh."""
    for name in ("four_bar", "quarter_car", "cart_pole"):
        shutil.copy(EXAMPLES / name / f"{name}.yaml", tmp_path)
    for name in ("brick.mtx", "brick_mass.mtx", "brick_nodes.txt"):
        shutil.copy(EXAMPLES.parent / "tests/models" / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(verbose=False)
    for test in doctest.DocTestFinder().find(module, globs={**vars(module), "kempe": kempe}):
        for example in test.examples:
            missing = [
                name for word, name in PACKAGES.items() if word in example.source and not importlib.util.find_spec(name)
            ]
            example.options.update({doctest.SKIP: True} if missing else {})
        report = io.StringIO()
        runner.run(test, out=report.write)
        assert not report.getvalue(), report.getvalue()
    EXAMPLES_RUN[module.__name__] = runner.tries


EXAMPLES_RUN: dict[str, int] = {}


def test_every_public_name_is_described():
    """Classes, functions and methods have docstrings; most have an example."""
    without = []
    for name in kempe.__all__:
        found = getattr(kempe, name)
        members = vars(found).items() if inspect.isclass(found) else ()
        described = [
            (name, found),
            *((f"{name}.{each}", member) for each, member in members if not each.startswith("_")),
        ]
        for each, member in described:
            member = getattr(member, "__func__", member)
            documented = inspect.isclass(member) or inspect.isfunction(member) or isinstance(member, property)
            if documented and not inspect.getdoc(member):
                without.append(each)
    assert without == []
    if EXAMPLES_RUN:
        assert sum(EXAMPLES_RUN.values()) > 100 and EXAMPLES_RUN["kempe.system"] > 20


# -- objects of other packages -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def car():
    """The state space of a quarter of a car, with a force on its body."""
    return kempe.Model(EXAMPLES / "quarter_car/quarter_car.yaml").system().linearize(inputs="effort(body)", outputs="q")


def decay(space, start, times):
    """Free motion of a state space from a state, by exponentials of A (times x outputs)."""
    values, vectors = np.linalg.eig(space.A)
    parts = np.linalg.solve(vectors, start)
    return np.array([(space.C @ (vectors @ (np.exp(values * t) * parts))).real for t in times])


def test_state_space_of_scipy(car):
    signal = pytest.importorskip("scipy.signal")
    space = car.to_scipy()
    times, start = np.linspace(0, 1, 101), np.eye(len(car.states))[0]
    _, y, _ = signal.lsim(space, np.zeros((101, len(car.inputs))), times, X0=start)
    assert isinstance(space, signal.StateSpace) and np.allclose(y, decay(car, start, times), atol=1e-9)


def test_state_space_of_control(car):
    control = pytest.importorskip("control")
    space = car.to_control()
    assert space.state_labels == ["q_wheel", "q_body", "qd_wheel", "qd_body"] and len(space.input_labels) == 1
    assert np.allclose(np.sort_complex(control.poles(space)), np.sort_complex(np.linalg.eigvals(car.A)))


def test_frames_of_pandas_and_xarray_have_units(results):
    run, again = results["trajectory"], pickle.loads(pickle.dumps(results["trajectory"]))
    pandas = pytest.importorskip("pandas")
    xarray = pytest.importorskip("xarray")
    for each in (run, again):
        frame, data = each.to_pandas(), each.to_xarray()
        assert isinstance(frame, pandas.DataFrame) and frame.index.name == "t" and frame.attrs["units"] == run.units
        assert isinstance(data, xarray.Dataset) and data["qd.crank"].attrs["units"] == "rad/s"
        assert np.array_equal(frame["q.rocker"], run.q[:, 2]) and np.array_equal(data["t"], run.t)
    assert list(results["modes"].modes.to_pandas().columns) == list(results["modes"].modes)


def test_ensembles_in_xarray(four_bar):
    """Labels, units, and the numbers of single runs; what did not run is NaN."""
    xarray = pytest.importorskip("xarray")
    cranks = [0.29, 0.30, 3.0]
    ensemble = four_bar.ensemble({"crank": cranks}, quantities={"swing": "range(q(rocker))"})
    with pytest.warns(kempe.KempeWarning, match="1 of 3 instances"):
        batch = ensemble.run(t_end=0.5)
    for each in (batch, pickle.loads(pickle.dumps(batch))):
        data = each.to_xarray()
        assert isinstance(data, xarray.Dataset) and data["q"].dims == ("instance", "coordinate")
        assert data["instance"].values.tolist() == [1, 2, 3] and data["crank"].values.tolist() == cranks
        assert data["coordinate"].values.tolist() == ["crank", "coupler", "rocker"] and data["swing"].attrs["units"] == "rad"
        assert data["status"].values.tolist() == ["complete", "complete", "failed"] and "across" in str(data["reason"].values[2])
        assert np.isnan(data["q"].sel(instance=3)).all() and np.isnan(data["swing"].sel(instance=3))
        assert np.array_equal(data["qd"].sel(coordinate="rocker"), batch.qd[:, 2], equal_nan=True)
        assert not {"q.rocker", "qd.rocker"} & set(data.variables)
    starts = four_bar.ensemble({"q.crank": [0.1, 0.2]}).run(t_end=0.1).to_xarray()
    assert starts["value.q.crank"].values.tolist() == [0.1, 0.2] and starts["q"].shape == (2, 3)

    table = four_bar.ensemble({"crank": cranks[:2]}).history("1,2", t_end=0.5, output_step=0.1)
    for each in (table, pickle.loads(pickle.dumps(table))):
        history = each.to_xarray()
        assert history["q.rocker"].dims == ("instance", "t") and history["t"].attrs["units"] == "s"
        for k, crank in enumerate(cranks[:2]):
            run = kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", crank=crank).simulate(t_end=0.5, output_step=0.1)
            assert abs(history["q.rocker"].sel(instance=k + 1) - run.q[:, 2]).max() < 1e-9 and (history["t"] == run.t).all()
    assert each.to_xarray("t")["q.rocker"].dims == ("t",)


def test_histories_of_unequal_length_in_xarray():
    columns = {"instance": [1.0, 1.0, 2.0], "t": [0.0, 0.1, 0.05], "q.a": [1.0, 2.0, 3.0], "word": np.array(["a", "b", "c"])}
    table = kempe.FrozenTable("history", dict.fromkeys(columns, ""), {name: np.array(each) for name, each in columns.items()})
    pytest.importorskip("xarray")
    data = table.to_xarray()
    assert data["t"].values.tolist() == [0, 0.05, 0.1] and data["instance"].values.tolist() == [1, 2]
    assert np.array_equal(data["q.a"], [[1, np.nan, 2], [np.nan, 3, np.nan]], equal_nan=True)
    assert data["word"].values.tolist() == [["a", "", "b"], ["", "c", ""]]


def test_covariance_of_a_fit(four_bar):
    """SciPy's covariance of the same residuals, whose derivatives are differences."""
    curve_fit = pytest.importorskip("scipy.optimize").curve_fit
    truth, noise = kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", crank_mass=2), np.random.default_rng(0)
    run = truth.simulate(t_end=1, output_step=0.02)
    measured = run.q[:, 2] + 1e-3 * noise.standard_normal(len(run))
    fit = four_bar.fit(data={"t": run.t, "q(rocker)": measured}, parameters={"crank_mass": (0.1, 5), "coupler_mass": (0.1, 5)})

    def motion(t, *values):
        model = kempe.Model(EXAMPLES / "four_bar/four_bar.yaml", dict(zip(fit.values, values)))
        return model.simulate(t_end=1, output_step=0.02, rtol=1e-11, no_convergence_check=True).q[:, 2]

    found, covariance = curve_fit(motion, run.t, measured, p0=list(fit.values.values()), epsfcn=1e-10)
    assert np.allclose(found, list(fit.values.values()), rtol=1e-3)
    assert np.allclose(fit.covariance, covariance, rtol=2e-2) and (fit.covariance == fit.covariance.T).all()
    assert np.array_equal(np.diag(fit.covariance), np.square(list(fit.errors.values())))
    assert np.array_equal(pickle.loads(pickle.dumps(fit)).covariance, fit.covariance)


def test_every_object_says_what_it_is(four_bar, results):
    """No repr has an address."""
    text = (EXAMPLES / "four_bar/four_bar.yaml").read_text()
    outputs = text.replace("run: {", "run: {outputs: [position(coupler.C)], ")
    ensemble, stepper = four_bar.ensemble({"crank": [0.29, 0.3]}), four_bar.system().stepper(t_end=1)
    said = {
        repr(each)
        for each in (
            four_bar.values({"crank": [0.29], "qd.crank": 2}),
            ensemble,
            ensemble.run(t_end=0.1),
            stepper.save(),
            four_bar.system().workspace(),
            four_bar.system().outputs("q"),
            kempe.Model.from_text(outputs).gradient(driven="crank", parameters=["crank"]),
            four_bar.flow(0.1, variables="crank", outputs="q(rocker)"),
            kempe.Builder("arm").gravity(0, -9.81, 0),
        )
    }
    assert said == {
        "<Values: 1 rows of crank, qd.crank>",
        "<Ensemble: 2 instances, crank>",
        "<EnsembleResult: 2 instances: 2 complete>",
        "<SavedState at t = 0 s>",
        "<Workspace: 3 coordinates, 2 closure rows>",
        "<Outputs: q.crank, q.coupler, q.rocker>",
        "<Gradient: 3 values by crank>",
        "<Flow: 1 values by crank>",
        "<Builder 'arm': 1 calls>",
    }
    for each in results.values():
        assert " object at 0x" not in repr(each)
    for name in kempe.__all__:
        kind = getattr(kempe, name)
        assert not inspect.isclass(kind) or kind.__repr__ is not object.__repr__, name


def test_right_side_of_an_integrator(four_bar):
    """SciPy's integrator gives Kempe's run."""
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    run, workspace = four_bar.simulate(t_end=0.5), four_bar.system().workspace()
    found = solve_ivp(
        workspace.rates, (0, 0.5), [*run.q[0], *run.qd[0]], t_eval=run.t, rtol=1e-10, atol=1e-10, method="DOP853"
    )
    assert np.abs(found.y[:3].T - run.q).max() < 1e-7
