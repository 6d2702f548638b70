# SPDX-License-Identifier: BSD-3-Clause
"""Functions of rows, and result folders by executors: the same numbers as without, also after the loss of a process."""

import concurrent.futures
import importlib.util
import multiprocessing
import os
import pickle
import re
import shutil
import subprocess
import sys
import textwrap

import kempe
import numpy as np
import pytest
from conftest import ROOT

RUN = {"t_end": 0.3, "rtol": 1e-8}
FOUR_BAR = ROOT / "examples/four_bar/four_bar.yaml"
SPAWN = multiprocessing.get_context("spawn")

# The first coordinate at t = 1 is Ishigami's function of the inputs, up to the errors of integration.
ISHIGAMI = """
kempe: 1
parameters: {x1: 0, x2: 0, x3: 0}
bodies:
  block: {mass: 1 kg, joint: {name: y, prismatic: x, at: ground}}
start: {qd: {y: "(sin(x1) + 7*sin(x2)^2 + 0.1*x3^4*sin(x1))"}}
"""


def rows(count=24):
    return np.random.default_rng(1).uniform([0.28, 0.88], [0.32, 0.92], (count, 2))


def bars(count=60, seed=1, t_end=0.3):
    model = kempe.Model(FOUR_BAR)
    return model.ensemble(model.sample("crank=0.29:0.31,base=0.88:0.92", count, seed=seed))


def same_files(one, other):
    names = sorted(path.name for path in one.iterdir())
    assert names == sorted(path.name for path in other.iterdir())
    for name in names:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


# -- functions --------------------------------------------------------------------------------------------


def test_function_is_an_ensemble(four_bar):
    X, words = rows(), {"swing": "range(q(rocker))", "fast": "max(qd(rocker))"}
    f = four_bar.function(["crank", "base"], quantities=words, **RUN)
    assert f.inputs == ("crank", "base") and f.values == ("swing", "fast", "fast.time")
    table = four_bar.ensemble({"crank": X[:, 0], "base": X[:, 1]}, quantities=words).run(**RUN).quantities
    Y = f(X)
    assert (Y == np.stack([table[name] for name in f.values], axis=1)).all() and f.reasons == [""] * len(X)
    assert (f(X[::-1])[::-1] == Y).all() and (f(X[7]) == Y[7]).all() and f(X[7]).shape == (3,)
    assert f(np.asfortranarray(X)).tobytes() == Y.tobytes() and f(X[:0]).shape == (0, 3)
    ends = four_bar.function(["crank", "qd.crank"], **RUN)
    single = kempe.Model(FOUR_BAR, crank=0.31).simulate(**RUN)
    assert ends.values[0] == "q.crank" and ends.values[-1] == "qd.rocker"
    start = single.qd[0, 0]
    assert abs(ends([0.31, start]) - np.r_[single.q[-1], single.qd[-1]]).max() < 1e-6


def test_function_failures(four_bar):
    X = rows(6)
    f = four_bar.function(["crank", "base"], quantities="max(q(rocker))", **RUN)
    Y = f(X)
    wrong = X.copy()
    wrong[2], wrong[4, 1] = [0.3, 30.0], np.nan
    found = f(wrong)
    assert np.isnan(found[[2, 4]]).all() and (np.delete(found, [2, 4], 0) == np.delete(Y, [2, 4], 0)).all()
    assert [k for k, reason in enumerate(f.reasons) if reason] == [2, 4]
    assert "parameter 'base' is not a number" in f.reasons[4]
    assert np.isnan(f(wrong[[2, 4]])).all() and len(f.reasons) == 2 and all(f.reasons)
    with pytest.raises(ValueError, match=r"rows of 2 values are needed \(crank, base\); the array's shape is \(6, 1\)"):
        f(X[:, :1])
    with pytest.raises(kempe.ArgumentError, match="crnk"):
        four_bar.function(["crnk"])
    with pytest.raises(ValueError, match="'crank' is given twice"):
        four_bar.function(["crank", "crank"])
    with pytest.raises(TypeError, match="a sequence of names"):
        four_bar.function("crank")
    with pytest.raises(TypeError, match="t_ende"):
        four_bar.function(["crank"], t_ende=1)


def derivation(f):
    """The object of a process that a pickled function belongs to."""
    return id(f._ensemble)


def test_function_in_processes(four_bar):
    X = rows()
    f = four_bar.function(["crank", "base"], quantities="max(q(rocker))", **RUN)
    built = kempe.Model.from_text(FOUR_BAR.read_text()).function(["crank", "base"], quantities="max(q(rocker))", **RUN)
    parts = np.array_split(X, 5)
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=SPAWN) as pool:
        assert (np.concatenate(list(pool.map(f, parts))) == f(X)).all()
        assert (np.concatenate(list(pool.map(built, parts))) == f(X)).all()
        assert len(set(pool.map(derivation, [f] * 5))) == 1  # one derivation for five tasks
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        assert (np.concatenate(list(pool.map(f, parts))) == f(X)).all()
    assert (pickle.loads(pickle.dumps(f))(X) == f(X)).all()


def test_function_of_another_file(tmp_path):
    """A process that reads a file after its change does not mix two models."""
    path = tmp_path / "bars.yaml"
    path.write_text(FOUR_BAR.read_text())
    pickled = pickle.dumps(kempe.Model(path).function(["base"], **RUN))
    pickle.loads(pickled)
    pickled = pickle.dumps(kempe.Model(path).function(["base"], **RUN))
    path.write_text(FOUR_BAR.read_text().replace("com: [0, crank/2, 0]", "com: [0, crank/3, 0]"))
    assert path.read_text() != FOUR_BAR.read_text()
    with pytest.raises(kempe.InputError, match="bars.yaml: the model has changed since it was pickled"):
        pickle.loads(pickled)


# -- executors --------------------------------------------------------------------------------------------


def test_executors_make_the_same_folder(tmp_path):
    ensemble = bars()
    whole = ensemble.run_folder(tmp_path / "alone.kempe", chunk=7, **RUN)
    seen = []
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=SPAWN) as pool:
        place = tmp_path / "processes.kempe"
        folder = ensemble.run_folder(place, chunk=7, executor=pool, shards=5, progress=seen.append, **RUN)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        threads = ensemble.run_folder(tmp_path / "threads.kempe", chunk=7, executor=pool, threads=2, **RUN)
    for each in (folder, threads):
        assert (each.parts, each.whole, len(each)) == (whole.parts, whole.parts, 60)
        same_files(tmp_path / "alone.kempe", place if each is folder else tmp_path / "threads.kempe")
    assert [(each.done, each.total, each.unit) for each in seen] == [(k, 5, "shards") for k in range(1, 6)]


def test_page_of_a_folder(tmp_path):
    ensemble, pages = bars(), [tmp_path / f"{k}.html" for k in range(3)]
    ensemble.run(**RUN).write_report(pages[0])
    folder = ensemble.run_folder(tmp_path / "bars.kempe", chunk=7, **RUN)
    folder.write_report(pages[1])
    kempe.Folder.open(tmp_path / "bars.kempe").write_report(pages[2], kempe.Model(FOUR_BAR))
    assert pages[0].read_bytes() == pages[1].read_bytes() == pages[2].read_bytes()
    with pytest.raises(kempe.InputError, match="belong to another model"):
        folder.write_report(pages[1], kempe.Model(FOUR_BAR, parameters={"crank": 0.31}))


def test_executors_refuse(tmp_path):
    ensemble, place = bars(), tmp_path / "bars.kempe"
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        with pytest.raises(TypeError, match="int has none"):
            ensemble.run_folder(place, executor=3, **RUN)
        with pytest.raises(TypeError, match="exclude each other"):
            ensemble.run_folder(place, executor=pool, shard="1/2", **RUN)
        with pytest.raises(kempe.ArgumentError, match="the number of shards is -1"):
            ensemble.run_folder(place, executor=pool, shards=-1, **RUN)
        ensemble.run_folder(place, executor=pool, **RUN)
        with pytest.raises(kempe.InputError, match="resume=True runs what is missing"):
            ensemble.run_folder(place, executor=pool, **RUN)
        with pytest.raises(kempe.InputError, match="the seed is 1 in the folder and 2 in this run"):
            bars(seed=2).run_folder(place, executor=pool, resume=True, **RUN)
        lost = kempe.Model(FOUR_BAR).ensemble({"base": [30.0] * 4})
        with pytest.raises(kempe.FailedError, match="no instance of this run reached its end") as caught:
            lost.run_folder(tmp_path / "lost.kempe", chunk=1, executor=pool, shards=2, **RUN)
        assert caught.value.partial.whole == 4


def test_doubtful_instances_elsewhere(tmp_path):
    """The warning of processes elsewhere is given here."""
    ensemble, rough = bars(8), {"t_end": 200, "rtol": 1e-4}
    with pytest.warns(kempe.KempeWarning, match="do not trust . of 8 instances"):
        ensemble.run_folder(tmp_path / "here.kempe", **rough)
    told = pytest.warns(kempe.KempeWarning, match="do not trust . of 8 instances")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=SPAWN) as pool, told:
        ensemble.run_folder(tmp_path / "there.kempe", executor=pool, shards=2, **rough)


def test_a_killed_worker(tmp_path):
    """A process is killed in the middle: the error has the missing parts, and the rest is run by others."""
    ensemble, place, run = bars(400), tmp_path / "bars.kempe", {"t_end": 5, "no_convergence_check": True}
    killed = []

    def kill(progress):
        if not killed:
            killed.append(multiprocessing.active_children()[0])
            killed[0].kill()

    lost = pytest.raises(kempe.FailedError, match=r"of 20 shards did not end; .*BrokenProcessPool")
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=SPAWN) as pool, lost as caught:
        ensemble.run_folder(place, chunk=10, executor=pool, shards=20, progress=kill, **run)
    folder, message = caught.value.partial, caught.value.message
    told = re.search(r"(\d+) of 40 parts (?:is|are) missing: (\d+)", message)
    assert told and int(told[1]) == 40 - folder.whole > 0 and "resume=True" in message
    assert not (place / f"part-{int(told[2]):06d}.parquet").exists()
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=SPAWN) as pool:
        assert ensemble.run_folder(place, chunk=10, resume=True, executor=pool, shards=3, **run).whole == 40
    ensemble.run_folder(tmp_path / "alone.kempe", chunk=10, **run)
    same_files(tmp_path / "alone.kempe", place)


def test_dask(tmp_path):
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    ensemble = bars()
    ensemble.run_folder(tmp_path / "alone.kempe", chunk=7, **RUN)
    f, X = kempe.Model(FOUR_BAR).function(["crank", "base"], quantities="max(q(rocker))", **RUN), rows()
    local = distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None)
    with local as cluster, distributed.Client(cluster) as client:
        folder = ensemble.run_folder(tmp_path / "dask.kempe", chunk=7, executor=client, shards=4, **RUN)
        assert folder.whole == folder.parts
        found = client.gather(client.map(f, np.array_split(X, 4)))
    same_files(tmp_path / "alone.kempe", tmp_path / "dask.kempe")
    assert (np.concatenate(found) == f(X)).all()


def ishigami():
    return kempe.Model.from_text(ISHIGAMI).function(["x1", "x2", "x3"], quantities="y = q(y)", t_end=1, rtol=1e-9)


def test_ishigami_is_itself():
    X = np.random.default_rng(3).uniform(-np.pi, np.pi, (50, 3))
    expected = np.sin(X[:, 0]) + 7 * np.sin(X[:, 1]) ** 2 + 0.1 * X[:, 2] ** 4 * np.sin(X[:, 0])
    assert abs(ishigami()(X)[:, 0] - expected).max() < 1e-8


def test_indices_by_salib():
    """Sobol's indices of Ishigami's function, whose closed forms are known, within three of SALib's standard errors."""
    sample = pytest.importorskip("SALib.sample.sobol", reason="SALib is not installed")
    analyze = pytest.importorskip("SALib.analyze.sobol", reason="SALib is not installed")
    problem = {"num_vars": 3, "names": ["x1", "x2", "x3"], "bounds": [[-np.pi, np.pi]] * 3}
    X = sample.sample(problem, 1024, calc_second_order=False, seed=5)
    found = analyze.analyze(problem, ishigami()(X)[:, 0], calc_second_order=False, seed=5)
    a, b = 7, 0.1
    alone = np.array([0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8, 0])
    both = 8 * b**2 * np.pi**8 / 225
    variance = alone.sum() + both
    z = 1.96  # the intervals of SALib have 95 %
    assert (abs(found["S1"] - alone / variance) < 3 * found["S1_conf"] / z).all()
    assert (abs(found["ST"] - (alone + [both, 0, both]) / variance) < 3 * found["ST_conf"] / z).all()


# -- the page ---------------------------------------------------------------------------------------------


def programs():
    """The blocks of docs/executors.md by the titles above them."""
    page = (ROOT / "docs/executors.md").read_text()
    for part in re.split(r"^##+ ", page, flags=re.M)[1:]:
        block = re.search(r"(?:^    .*\n|^\n+(?=    ))+", part, re.M)
        if block:
            yield pytest.param(textwrap.dedent(block[0]), id=part.splitlines()[0])


@pytest.mark.parametrize("program", list(programs()))
def test_page(program, tmp_path):
    """Every recipe is a program."""
    for package in re.findall(r"^(?:import|from) (\w+)", program, re.M):
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed")
    shutil.copy(FOUR_BAR, tmp_path)
    (tmp_path / "study.py").write_text(program)
    command, environment = [sys.executable, "study.py"], dict(os.environ)
    if "mpi4py" in program:
        if shutil.which("mpiexec") is None:
            pytest.skip("mpiexec is not installed")
        command[1:1] = ["-m", "mpi4py.futures"]
        command = ["mpiexec", "-n", "2", *command]
        environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        environment |= {"OMPI_MCA_rmaps_base_oversubscribe": "1"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-3000:]
