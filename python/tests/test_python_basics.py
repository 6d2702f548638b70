# SPDX-License-Identifier: BSD-3-Clause
"""Models, errors, tables, views of memory, interrupts, threads, processes."""

import concurrent.futures
import gc
import itertools
import json
import os
import pathlib
import pickle
import re
import signal
import subprocess
import sys
import textwrap
import threading
import time
import warnings
import weakref

import growth
import kempe
import numpy as np
import pytest
from conftest import ROOT, page_program

PENDULUM = """
kempe: 1
gravity: [0, -9.81, 0]
parameters: {L: 2 m}
inputs: {push: {unit: N m, default: 0}}
bodies: {arm: {joint: {name: A, revolute: z, at: ground}, mass: 3, com: [0, -L/2, 0], inertia: {zz: 1}}}
forces: {push: {joint: A, torque: push}}
start: {q: {A: 0.5}}
run: {t_end: 1, output_step: 0.1}
"""
FREE = PENDULUM.replace("inputs: {push: {unit: N m, default: 0}}\n", "").replace(
    "forces: {push: {joint: A, torque: push}}\n", ""
)


def pendulum(text=PENDULUM, **more):
    return kempe.Model.from_text(text, **more)


# -- models and errors ---------------------------------------------------------------------------------


def test_model(four_bar):
    assert four_bar.name == "four-bar" and four_bar.coordinates == ("crank", "coupler", "rocker")
    assert (
        four_bar.to_dict()["name"] == "four-bar" and "coupler" in str(four_bar) and "four-bar" in four_bar._repr_html_()
    )
    assert "crank" in repr(four_bar) and four_bar.inputs == {}


def test_parameters():
    by_keyword = kempe.Model(ROOT / "examples/four_bar/four_bar.yaml", crank="310 mm").simulate(t_end=0.1)
    by_number = kempe.Model(ROOT / "examples/four_bar/four_bar.yaml", {"crank": 0.31}).simulate(t_end=0.1)
    assert np.array_equal(by_keyword.q, by_number.q)
    assert not np.array_equal(by_number.q, kempe.Model(ROOT / "examples/four_bar/four_bar.yaml").simulate(t_end=0.1).q)
    with pytest.raises(kempe.Error, match="crnk"):
        kempe.Model(ROOT / "examples/four_bar/four_bar.yaml", crnk=1)


def test_dict_is_text():
    document = {
        "kempe": 1,
        "gravity": (0, -9.81, 0),
        "bodies": {
            "arm": {
                "joint": {"name": "A", "revolute": "z", "at": "ground"},
                "mass": np.float64(3),
                "com": np.array([0.0, -1, 0]),
                "inertia": {"zz": 1},
            }
        },
        "start": {"q": {"A": 0.5}},
    }
    assert np.array_equal(
        kempe.Model.from_dict(document).simulate(t_end=1, output_step=0.1).q, pendulum(FREE).simulate().q
    )


def test_problems():
    with pytest.raises(kempe.InputError) as caught:
        kempe.Model.from_text("kempe: 1\nbodies: {a: {mas: 1}}\n", label="wrong.yaml")
    problems = caught.value.problems
    assert [(p.file, p.line) for p in problems] == [("wrong.yaml", 2)] * 2 and problems[1].column == 14
    assert "did you mean 'mass'" in problems[1].sentence and str(problems[0]).startswith("wrong.yaml:2:13: ")
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize(
    "error, base, call",
    [
        (kempe.FileError, OSError, lambda m: kempe.Model("/nothing/here.yaml")),
        (kempe.ArgumentError, ValueError, lambda m: m.simulate(formulation="nonsense")),
        (kempe.ArgumentError, ValueError, lambda m: m.system().linearize(inputs="nonsense")),
        (kempe.FailedError, RuntimeError, lambda m: m.simulate(max_steps=3)),
        (TypeError, TypeError, lambda m: m.simulate(rtoll=1e-3)),
        (TypeError, TypeError, lambda m: kempe.Trajectory()),
        (TypeError, TypeError, lambda m: pickle.dumps(m.system().workspace())),
        (TypeError, TypeError, lambda m: m.simulate(independent=object())),
        (ValueError, ValueError, lambda m: m.system().workspace().evaluate(0, [1, 2])),
        (ValueError, ValueError, lambda m: m.system().workspace().close(0, [1, 2, 3], hold=["nonsense"])),
        (KeyError, KeyError, lambda m: m.simulate(t_end=0.1).rows["nonsense"]),
        (kempe.ArgumentError, ValueError, lambda m: m.simulate(t_end=0.1)["nonsense"]),
    ],
)
def test_errors(error, base, call, four_bar):
    with pytest.raises(error) as caught:
        call(four_bar)
    assert isinstance(caught.value, base) and str(caught.value)


@pytest.mark.parametrize(
    "error, sentence, call",
    [
        (ValueError, "t_end: a number in SI is needed", lambda m: m.simulate(t_end="5 s")),
        (ValueError, "max_steps: a whole number is needed, not 1.5", lambda m: m.simulate(max_steps=1.5)),
        (TypeError, "there is no keyword 'outputs'", lambda m: m.simulate(outputs="q")),
        (TypeError, "progress is True or a function", lambda m: m.simulate(progress=3)),
        (TypeError, "force is a function", lambda m: m.system(force=3)),
        (ValueError, "force gives 3 values, not None", lambda m: m.system(force=lambda t, q, qd: None).simulate()),
        (ValueError, r"not the shape \(2,\)", lambda m: m.system(force=lambda t, q, qd: [1, 2]).simulate()),
        (TypeError, r"sweep: a range is .*, not an array of 3 values", lambda m: swept(m, {"crank": np.arange(3.0)})),
        (kempe.ArgumentError, "there is no matrix 'Q'", lambda m: m.system().linearize().matrix("Q")),
        (kempe.ArgumentError, "there is no view 'all'; there are eq", lambda m: m.system().text("all")),
        (kempe.ArgumentError, "near are crank", lambda m: m.system().workspace().close(0, [0] * 3, hold="crnk")),
        (ValueError, r"q has 3 values, not the shape \(2,\)", lambda m: m.system().workspace().close(0, [0, 0])),
        (ValueError, "state has 6 values", lambda m: m.system().workspace().rates(0, [0.0] * 5)),
        (TypeError, "crank: a number in SI", lambda m: m.system().stepper().set_parameters(crank="310 mm")),
        (ValueError, r"one length are needed; there are \[2, 3\]", lambda m: m.values({"a": [1, 2], "b": [1, 2, 3]})),
        (ValueError, r"'crank' has the shape \(2, 2\)", lambda m: m.values({"crank": np.eye(2)})),
        (ValueError, "there are none", lambda m: m.values({})),
        (KeyError, "near are q.crank", lambda m: m.simulate(t_end=0.1).rows["q.crnk"]),
        (TypeError, "a name is needed, not int", lambda m: m.simulate(t_end=0.1)[0]),
        (TypeError, "a text is needed, not PosixPath", lambda m: kempe.Model.from_text(ROOT)),
    ],
)
def test_sentences_of_typical_mistakes(error, sentence, call, four_bar):
    with pytest.raises(error, match=sentence):
        call(four_bar)


def swept(model, sweep):
    return model.system().kinematics(sweep=sweep)


def test_arguments_of_several_kinds(four_bar):
    path = ROOT / "examples/four_bar/four_bar.yaml"
    assert kempe.Model(path, crank=np.array(0.31)).parameters["crank"] == 0.31
    assert four_bar.simulate(t_end=np.float32(0.5), max_steps=1e6).t[-1] == 0.5
    workspace = four_bar.system().workspace()
    q, qd = workspace.close(0, [0.2, 0, 0], hold="crank")
    assert q[0] == 0.2 and np.array_equal(q, workspace.close(0, [0.2, 0, 0], hold=["crank"])[0])


def test_keywords_have_near_names(four_bar):
    with pytest.raises(TypeError, match="near are rtol"):
        four_bar.simulate(rtoll=1e-3)


def test_failed_run_has_its_rows(four_bar):
    with pytest.raises(kempe.FailedError) as caught:
        four_bar.simulate(max_steps=3, output_step=1e-4)
    partial = caught.value.partial
    assert partial.status == "failed" and len(partial) > 1 and partial.reason in str(caught.value)
    assert len(partial.t) == len(partial.q)


def test_warnings_are_python_warnings(four_bar):
    with pytest.warns(kempe.KempeWarning, match="energy error") as caught:
        four_bar.simulate(rtol=1e-2, t_end=50)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        four_bar.simulate(t_end=0.1)
        with pytest.raises(kempe.KempeWarning):
            four_bar.simulate(rtol=1e-2, t_end=50)


def test_closure_tolerance_and_cache(tmp_path):
    path = ROOT / "examples/four_bar/four_bar.yaml"
    first = kempe.Model(path, closure_tolerance=0.0, cache=tmp_path).simulate(t_end=0.1)
    assert list(tmp_path.iterdir())
    assert np.array_equal(first.q, kempe.Model(path, cache=tmp_path).simulate(t_end=0.1).q)
    with pytest.raises(kempe.ArgumentError):
        kempe.Model(path, closure_tolerance=-1.0)


def test_base_and_strict_reading():
    path = ROOT / "tests/models/geared_leg.urdf"
    free = kempe.Model(path, robot_base="free")
    assert len(kempe.Model.from_text(free.export("urdf+")).coordinates) == len(free.coordinates)
    with pytest.raises(kempe.Error, match="unknown format 'obj'; there are urdf\\+, sdf, mjcf"):
        free.export("obj")
    assert len(free.coordinates) == len(kempe.Model(path).coordinates) + 6
    assert pickle.loads(pickle.dumps(free)).coordinates == free.coordinates
    assert "hip_upper" in str(kempe.Model(path, joint_limits=True)) and "hip_upper" not in str(kempe.Model(path))
    with pytest.raises(kempe.InputError, match=r"geared_leg\.urdf:30:5: limits of motion are not used"):
        kempe.Model(path, strict=True)
    with pytest.raises(kempe.ArgumentError, match="unknown base 'loose'"):
        kempe.Model(path, robot_base="loose")


def test_builder_gives_the_model_of_a_file():
    built = kempe.Builder("pendulum").gravity(0, -9.81, 0).parameter("L", 2)
    built.body(
        "arm", joint="A", kind="revolute", axis=(0, 0, 1), mass=3, com=(0, "-L/2", 0), inertia=(0, 0, 1, 0, 0, 0)
    )
    built.q("A", 0.5).qd("A", 0).text("run", "t_end", "1").text("run", "output_step", "0.1")
    model = built.finish()
    assert np.array_equal(model.simulate().q, pendulum(FREE).simulate().q)
    assert np.array_equal(pickle.loads(pickle.dumps(model)).simulate().q, model.simulate().q)
    with pytest.raises(kempe.ArgumentError):
        built.body("late")


def test_builder_has_shapes():
    built = kempe.Builder("bar").parameter("rho", 2700).body("bar").point("bar", "E", 1, 0, 0)
    built.shape("bar", kind="box", dimensions=(2, 0.1, 0.1), density="rho")
    built.shape("bar", kind="sphere", dimensions=(0.05, 0, 0), point="E", colour="red")
    built.shape("ground", text="{box: [1, 1, 0.1], at: [0, 0, 1]}")
    model = built.finish()
    assert "sphere" in str(model.parsed())
    assert np.isclose(model.system().workspace().evaluate(0.0, [0.0], [0.0]).M[0, 0], 54 * (4 + 0.01) / 12)
    with pytest.raises(kempe.ArgumentError, match="'leg' does not exist"):
        kempe.Builder("bar").shape("leg")


def test_builder_closes_loops_and_reports():
    built = kempe.Builder("triangle").point("ground", "B", 1, 0, 0)
    built.body("a", mass=1, inertia=(1, 1, 1, 0, 0, 0)).point("a", "P", 1, 0, 0)
    built.closure("rod", kind="rod", point=("a.P", "ground.B"), length=0.5)
    built.force("spring", spring=("a.P", "ground.B"), stiffness=10, free_length=0.1)
    built.joint("late", kind="revolute", point=("a.P", "nothing.Q"))
    with pytest.raises(kempe.InputError, match="nothing"):
        built.finish()
    with pytest.raises(TypeError, match="near are mass"):
        built.body("b", mas=1)
    with pytest.raises(ValueError, match="3 values"):
        built.body("b", com=(1, 2))


# -- tables and views ------------------------------------------------------------------------------------


def test_table(four_bar, tmp_path):
    run = four_bar.simulate(t_end=0.2)
    rows = run.rows
    assert (
        rows.row_count == len(run)
        and rows.units["q.crank"] == "rad"
        and list(rows)[0] == "t"
        and len(rows) == len(rows.units)
    )
    assert np.array_equal(rows["q.crank"], run.q[:, 0]) and np.array_equal(rows["q(crank)"], run.q[:, 0])
    assert rows.row(1)["t"] == run.t[1] and rows["t"] is rows["t"]
    rows.write(tmp_path / "rows.csv")
    earlier = kempe.Table.read(tmp_path / "rows.csv")
    assert list(earlier) == list(rows) and np.array_equal(earlier["qd.crank"], rows["qd.crank"])
    run.write_report(tmp_path / "both.html", against=earlier)
    assert "rows.csv" in (tmp_path / "both.html").read_text()
    with pytest.raises(kempe.InputError, match="has no column of an output"):
        run.write_report(tmp_path / "both.html", against=four_bar.system().check().coordinates)
    with pytest.raises(TypeError):
        run.write_report(tmp_path / "both.html", against=run)
    (tmp_path / "half.csv").write_text("t,q.crank\n0.1,0\n9,1\n")
    with pytest.warns(kempe.KempeWarning, match=r"half.csv' has times from 0.1 to 9 s, this run from 0 to 0.2 s: its dotted curves are drawn from 0.1 to 0.2 s"):
        run.write_report(tmp_path / "both.html", against=kempe.Table.read(tmp_path / "half.csv"))
    for text, said in (("t,q.crank\n", "no rows"), ("t,q.crank\n0.3,0\n9,1\n", "they do not meet"), ("t,q.crank [kg]\n0,1\n1,2\n", "'q.crank' in kg, this run in rad"), ("t [mm],q.crank\n0,1\n", "'t' in m, this run in s")):
        (tmp_path / "other.csv").write_text(text)
        with pytest.raises(kempe.InputError, match=said):
            run.write_report(tmp_path / "both.html", against=kempe.Table.read(tmp_path / "other.csv"))
    (tmp_path / "bad.csv").write_text("t,q.crank\n0,one\n")
    with pytest.raises(kempe.InputError, match="bad.csv:2:3: this is not a number"):
        kempe.Table.read(tmp_path / "bad.csv")
    rows.write(tmp_path / "rows.npz")
    with np.load(tmp_path / "rows.npz") as kept:
        assert np.array_equal(kept["values"][:, list(kept["names"]).index("qd.crank")], run.qd[:, 0])
    assert (
        "<svg" in rows.svg(y=["q.crank", "q.rocker"])
        and "q.crank" in rows._repr_html_()
        and "more rows" in rows._repr_html_()
    )
    assert "q.crank" in str(rows) and "rows" in repr(rows)
    again = pickle.loads(pickle.dumps(rows))
    assert np.array_equal(again["q(crank)"], run.q[:, 0]) and again.units == rows.units and list(again) == list(rows)
    words = four_bar.system().check().coordinates
    assert list(words["coordinate"]) == list(four_bar.coordinates) and words["role"].dtype.kind == "U"


def test_views_are_read_only_and_keep_their_owner_alive():
    model = pendulum()
    run = model.simulate()
    q, t, copy = run.q, run.t, run.q.copy()
    assert not q.flags.writeable and not t.flags.writeable and np.shares_memory(q, run.q)
    with pytest.raises(ValueError):
        q[0, 0] = 1
    gone = weakref.ref(run)
    del run, model
    gc.collect()
    others = [pendulum().simulate() for _ in range(5)]  # would reuse freed memory
    assert gone() is None and np.array_equal(q, copy) and np.array_equal(t, others[0].t)


VIEWS = {
    "trajectory": lambda model: model.simulate(t_end=0.1).lam,
    "column": lambda model: model.simulate(t_end=0.1).rows["q.crank"],
    "output": lambda model: model.simulate(t_end=0.1)["position(coupler.C)"],
    "assembly": lambda model: model.system().assemble().q,
    "matrix": lambda model: model.system().linearize().A,
    "mass matrix": lambda model: evaluated(model).M,
    "part of a Jacobian": lambda model: evaluated(model).J[1:].T,
    "sweep": lambda model: model.system().kinematics(sweep="crank=0:1:5").rows["q.rocker"],
    "many instances": lambda model: model.ensemble({"crank": [0.29, 0.3]}).run(t_end=0.1).q,
}


def evaluated(model):
    workspace = model.system().workspace()
    return workspace.evaluate(0.0, model.system().assemble().q)


@pytest.mark.parametrize("name", VIEWS)
def test_views_outlive_all_else(name):
    def make():
        return VIEWS[name](kempe.Model(ROOT / "examples/four_bar/four_bar.yaml"))

    views = [make() for _ in range(4)]  # objects that were made later would reuse memory of the first
    gc.collect()
    assert views[0].size and np.isfinite(views[0]).all()
    assert all(np.array_equal(each, views[0]) for each in views) and np.array_equal(make(), views[0])


def test_children_outlive_parents():
    workspace = pendulum().system().workspace()
    stepper = pendulum().system().stepper()
    assert stepper.status == "complete, not checked"
    gc.collect()
    workspace.evaluate(0.0, [0.5], [0.0])
    stepper.advance(0.5)
    assert workspace.M[0, 0] > 0 and stepper.t == 0.5


def test_pandas_and_xarray():
    run = pendulum().simulate()
    for name, make in (("pandas", run.to_pandas), ("xarray", run.to_xarray)):
        if importlib_has(name):
            made = make()
            assert np.array_equal(np.asarray(made["q.A"]), run.q[:, 0])


def importlib_has(name):
    import importlib.util

    return importlib.util.find_spec(name) is not None


# -- interrupts, callbacks, threads, processes -----------------------------------------------------------


def interrupt_after(seconds):
    threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT)).start()
    return time.monotonic() + seconds


def interrupted(model):
    """The delay of the end of a long run, and its rows."""
    sent = interrupt_after(0.2)
    with pytest.raises(kempe.Interrupted) as caught:
        model.simulate(t_end=9e4, output_step=0.1)
    assert isinstance(caught.value, KeyboardInterrupt)
    return time.monotonic() - sent, caught.value.partial


def test_interrupt_ends_a_long_run_at_once_with_its_rows(four_bar):
    four_bar.system()
    for _ in range(5):  # of a loaded machine
        late, partial = interrupted(four_bar)
        if late < 0.1:
            break
    assert late < 0.1 and partial.status == "stopped" and "interrupted" in partial.reason
    assert len(partial) > 0 and np.isfinite(partial.q).all()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert four_bar.simulate(t_end=0.1).status == "complete"  # what comes next is not ended


@pytest.mark.parametrize("threads", [0, 1, 2])
def test_interrupt_of_a_workspace(threads, four_bar):
    """Many steps, and many states in this thread or in two, end at once; further calls are not ended."""
    workspace = four_bar.system().workspace()
    q, qd = workspace.close(0, [0.3, 0, 0], [1, 0, 0], hold=["crank"])
    rows = [np.tile(each, (1600000, 1)) for each in (q, qd)]
    workspace.forward_derivatives(0, rows[0][:2], rows[1][:2], threads=threads or 1)
    late = []
    for _ in range(3):  # of a loaded machine
        sent = interrupt_after(0.2)
        with pytest.raises(kempe.Interrupted):
            if threads:
                workspace.forward_derivatives(0, *rows, threads=threads)
            else:
                workspace.step(0, q, qd, 1e-5, steps=400000)
        late.append(time.monotonic() - sent)
        if late[-1] < 0.3:
            break
    assert min(late) < 0.3
    assert np.isfinite(workspace.step(0, q, qd, 1e-3, steps=5).q).all()
    assert np.isfinite(workspace.forward_derivatives(0, rows[0][:9], rows[1][:9], threads=2).qdd_q).all()


def lateness(call):
    """Seconds from Ctrl-C to the end of a call that it ends."""
    sent = interrupt_after(0.2)
    with pytest.raises(KeyboardInterrupt):
        call()
    return time.monotonic() - sent


@pytest.mark.parametrize("lanes", [0, 1, -1])
def test_interrupt_of_a_batch(lanes, four_bar, tmp_path):
    """Ensembles, functions of rows and result folders end within 0.3 s."""
    ensemble = four_bar.ensemble({"crank": np.linspace(0.28, 0.32, 50000)})
    calls = {
        "run": lambda: ensemble.run(t_end=200, lanes=lanes),
        "rows": lambda: four_bar.function(["crank"], lanes=lanes, t_end=200)(np.full((50000, 1), 0.3)),
        "folder": lambda: ensemble.run_folder(tmp_path / "folder", lanes=lanes, t_end=200),
    }
    for name, call in calls.items():
        assert any(lateness(call) < 0.3 for _ in range(3)), name  # of a loaded machine
    assert set(four_bar.ensemble({"crank": [0.29, 0.3]}).run(t_end=0.1, lanes=lanes).status) == {"complete"}


def test_interrupt_of_a_stepper_and_outside_of_runs(four_bar):
    stepper = four_bar.system().stepper(t_end=1e6)
    interrupt_after(0.1)
    with pytest.raises(KeyboardInterrupt):
        stepper.advance(1e6)
    interrupt_after(0.05)
    with pytest.raises(KeyboardInterrupt):
        time.sleep(2)
    assert four_bar.simulate(t_end=0.1).status == "complete"


def test_interrupt_with_a_handler_of_the_user(four_bar):
    seen = []
    before = signal.signal(signal.SIGINT, lambda *_: seen.append(1))
    try:
        interrupt_after(0.02)
        assert four_bar.simulate(t_end=300).t[-1] == 300 and seen == [1]
    finally:
        signal.signal(signal.SIGINT, before)


def test_force_in_python():
    damped = pendulum().system(force=lambda t, q, qd: -2.0 * qd)
    model = pendulum(PENDULUM.replace("torque: push", "torque: push - 2*qd(A)"))
    assert np.allclose(damped.simulate(rtol=1e-9).q, model.simulate(rtol=1e-9).q, atol=1e-7)
    assert not np.allclose(damped.simulate().q, pendulum().simulate().q)
    workspace = damped.workspace()
    assert np.allclose(
        workspace.forward_dynamics(0, [0.1], [1.0]).qdd,
        model.system().workspace().forward_dynamics(0, [0.1], [1.0]).qdd,
    )


def test_force_outlives_its_system(four_bar):
    stepper = four_bar.system(force=lambda t, q, qd: -0.1 * qd).stepper(t_end=0.2)
    gc.collect()
    stepper.advance(0.2)
    kept = four_bar.system(force=lambda t, q, qd: -0.1 * qd)
    assert np.array_equal(stepper.q, kept.simulate(t_end=0.2).q[-1])


def test_exception_of_a_force_is_raised():
    def force(t, q, qd):
        if t > 0.5:
            raise ZeroDivisionError("at half a second")
        return 0 * q

    model = pendulum()
    system = model.system(force=force)
    with pytest.raises(ZeroDivisionError, match="half"):
        system.simulate()
    with pytest.raises(ZeroDivisionError):
        system.workspace().forward_dynamics(1.0, [0.0], [0.0])
    assert model.simulate().status == "complete"
    with pytest.raises(ValueError):
        model.system(force=lambda t, q, qd: [1, 2, 3]).simulate()


def test_threads_use_one_model_and_several(four_bar):
    expected = four_bar.simulate(t_end=1).q
    models = [four_bar, four_bar, kempe.Model(ROOT / "examples/four_bar/four_bar.yaml")]
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        runs = list(pool.map(lambda model: model.simulate(t_end=1), models * 4))
    assert all(np.array_equal(run.q, expected) for run in runs)


def test_threads_compute_at_the_same_time():
    """Each force waits at its first call until the other run has come to its own."""
    both = threading.Barrier(2, timeout=60)

    def run(_):
        calls = itertools.count()
        model = pendulum()
        force = lambda t, q, qd: (both.wait() if next(calls) == 0 else 0, 0 * q)[1]  # noqa: E731
        return model.system(force=force).simulate().q

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        assert np.array_equal(*pool.map(run, range(2)))
    assert both.n_waiting == 0 and not both.broken


def test_python_runs_during_a_computation(four_bar):
    four_bar.system()
    thread = threading.Thread(target=lambda: four_bar.simulate(t_end=60, no_convergence_check=True))
    thread.start()
    turns = 0
    while thread.is_alive():
        time.sleep(1e-4)
        turns += 1
    assert turns > 10


def test_pickled_model():
    model = pickle.loads(pickle.dumps(pendulum(L="1 m")))
    assert np.array_equal(model.simulate().q, pendulum(L=1).simulate().q)


@pytest.mark.skipif("libasan" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer keeps what is freed")
def test_no_growth():
    """A sample of the calls; all of them with KEMPE_FULL."""
    calls = 1_000_000 if "KEMPE_FULL" in os.environ else 10_000
    rows = list(growth.growth(calls))
    grown = {row[0] for row in rows if growth.grows(row)}
    again = {row[0] for row in growth.growth(calls) if growth.grows(row)} if grown else set()  # a leak grows each time
    assert len(rows) > 10 and not grown & again


def test_growth_is_seen(monkeypatch):
    kept = []
    monkeypatch.setattr(growth, "kinds", lambda: {"kept": (1, lambda: kept.append(pendulum().simulate().q))})
    assert growth.grows(next(growth.growth(50)))


def test_about():
    about = kempe.about()
    assert about["kempe"] == kempe.__version__ and any("_native" in name for name in about["libraries"])
    assert all(about["licenses"].values())
    assert re.fullmatch(r"\d+\.\d+\.\d+", about["sundials"]) and re.fullmatch(r"\d+\.\d+\.\d+", about["klu"])
    assert {"dop853", "ida"} <= set(about["integrators"]) and {"klu", "dense"} <= set(about["linear_solvers"])
    parts = about["license"].split(" AND ")
    assert ("GPL-2.0-or-later" in parts) == ("umfpack" in about["linear_solvers"])
    loaded = pathlib.Path("/proc/self/maps").read_text()
    inside = "/libsundials" not in loaded  # a wheel has all libraries in the extension
    for license, library in (("Minpack", "cminpack"), ("MIT", "nlopt")):
        assert (license in parts) == (library in about["searches"]) == (inside or f"/lib{library}" in loaded)
    assert about["backend"] == "tape" or about["backend"].startswith("machine code")


def test_import_alone_is_quiet():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "import kempe; print(kempe.__version__)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == kempe.__version__ and not done.stderr
    assert json.dumps(kempe.__all__)


def test_second_interpreter_has_no_arrays():
    """NumPy is for the first interpreter of a process, and so is the package."""
    name = next((each for each in ("_xxsubinterpreters", "_interpreters") if importlib_has(each)), None)
    if name is None:
        pytest.skip("no module of sub-interpreters")
    second = "try:\n    import kempe\n    kempe.lazy.np.zeros(1)\nexcept ImportError: print('refused', flush=True)"
    program = f"""
import os, kempe, {name} as interpreters
kempe.lazy.np.zeros(1)
interpreters.run_string(interpreters.create(), {second!r})
os._exit(0)"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.stdout == "refused\n", done.stdout + done.stderr


def test_import_waits_with_numpy():
    """Two thirds of the time of an import would be NumPy's."""
    program = "import sys, kempe; assert 'numpy' not in sys.modules; kempe.contact.hertz; assert kempe.about()['numpy']"
    subprocess.run([sys.executable, "-c", program], check=True)


def test_page():
    assert "assert" in page_program()
    subprocess.run([sys.executable, "-c", page_program()], cwd=ROOT, check=True)


def test_readme(tmp_path):
    """The lines of README.md, with the model that the command writes."""
    if "KEMPE_COMMAND" not in os.environ:
        pytest.skip("KEMPE_COMMAND is not set")
    subprocess.run([os.environ["KEMPE_COMMAND"], "new", "four_bar"], cwd=tmp_path, check=True, capture_output=True)
    program = re.search(
        r"(?:^    .*\n)+", (ROOT / "README.md").read_text().partition("after `pip install .`")[2], re.M
    )[0]
    environment = {**os.environ, "PYTHONPATH": str(pathlib.Path(kempe.__file__).absolute().parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        text=True,
        env=environment,
    )
    assert program.count("\n") == 3 and "converged" in done.stdout


BLOCK = """kempe: 1
gravity: [0, 0, -10]
bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}
forces: {rub: {joint: x, friction: {force: 5}}, push: {joint: x, force: 3}}
"""


def test_friction_of_workspaces():
    def qdd(workspace, *state):
        return workspace.forward_dynamics(0, [0], *state).qdd[0]

    system = kempe.Model.from_text(BLOCK).system()
    with pytest.warns(kempe.KempeWarning, match="'rub' sticks in runs"):
        assert qdd(system.workspace(), [0]) == pytest.approx(1.5)
    workspace = system.workspace(friction="stick")
    assert qdd(workspace, [0]) == 0 and workspace.forward_dynamics(0, [0], [0]).lam[0] == pytest.approx(-3)
    assert qdd(workspace, [1]) == pytest.approx(-1) and qdd(workspace, [0], [4]) == pytest.approx(1)
    assert len(workspace.closure_rows) == 0
    assert qdd(system.workspace(friction="none"), [1]) == pytest.approx(1.5)
    with pytest.raises(kempe.ArgumentError, match="slip, stick or none"):
        system.workspace(friction="glide")


def test_states_of_workspaces(recwarn):
    """A state has no past and no samples: what a workspace cannot know of states is named."""

    def system(states):
        body = {"joint": {"name": "x", "prismatic": "x", "at": "ground"}, "mass": 1}
        law = f"-q(x) - {' - '.join(states)}"
        return kempe.Model.from_dict({"kempe": 1, "states": states, "bodies": {"b": body}, "forces": {"f": {"joint": "x", "force": law}}}).system()

    lag = system({"lag": {"rate": "q(x) - lag"}}).workspace()
    assert (lag.rates(0.0, [1, 0, 0, 2]) == [0, 2, -3, -1]).all() and not len(recwarn)
    held = system({"u": {"sample": 0.1, "next": "q(x)"}, "r": {"hysteresis": "q(x)", "limits": [0, 1]}}).workspace()
    for _ in range(2):
        assert (held.rates(0.0, [1, 0, 0, 0, 2, 1]) == [0, 2, 1, -4, 0, 0]).all()
    late = system({"late": {"delay": "q(x)", "time": 0.3}}).workspace(friction="slip")
    assert late.forward_dynamics(0.0, [1, 0], [0, 2]).qdd[0] == -3
    assert [str(warning.message).split(" change")[0].split(", whose")[0] for warning in recwarn] == [
        "rates: 'u', 'r'",
        "the state 'late' is a delayed signal",
    ]


def test_modes_of_workspaces():
    """States of one phase, also by threads, have the modes that are kept; without them one thread decides at each state."""
    workspace = kempe.Model.from_text(BLOCK).system().workspace(friction="stick")
    assert workspace.modes == {}
    with pytest.raises(kempe.ArgumentError, match="evaluate a state first"):
        workspace.keep_modes()
    still = np.zeros((400, 1))
    rates = np.where(np.arange(400) % 2, 1.0, 0.0)[:, None]
    for threads in (1, 2):
        assert workspace.forward_states(0.0, still, rates, threads=threads).qdd[:2, 0] == pytest.approx([0, -1])
    workspace.forward_dynamics(0, [0], [1])
    assert workspace.modes == {"rub": "slips"}
    workspace.keep_modes()
    for threads in (1, 2):
        found = workspace.forward_states(0.0, still, rates, threads=threads)
        assert (found.qdd[:, 0] == -1).all()
    assert (workspace.forward_derivatives(0.0, still, rates, threads=2).qdd_Q[:, 0, 0] == 0.5).all()
    workspace.keep_modes(False)
    assert workspace.forward_dynamics(0, [0], [0]).qdd[0] == 0
    other = kempe.Model.from_text(BLOCK).system().workspace(friction="none")
    assert other.modes == {} and other.keep_modes() is None
