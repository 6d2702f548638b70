# SPDX-License-Identifier: BSD-3-Clause
"""Types of the public interface. This file and the blocks of docs/python.md are strict for mypy and pyright, whose verdict is
tested where they are installed."""

import importlib.util
import json
import pathlib
import subprocess
import sys
from typing import Any, assert_type

import kempe
import numpy as np
import pytest
from conftest import ROOT, page_program
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def model() -> kempe.Model:
    return kempe.Model(ROOT / "examples/four_bar/four_bar.yaml", crank="310 mm")


def test_motion_has_types() -> None:
    run = assert_type(model().simulate(t_end=0.1, rtol=1e-9), kempe.Trajectory)
    assert assert_type(run.t, Floats).shape == (len(run),)
    assert assert_type(run.q, Floats).shape == (len(run), 3)
    assert assert_type(run["position(coupler.C)"], NDArray[Any]).shape == (len(run), 3)
    assert assert_type(run.rows, kempe.Table).units["q.crank"] == "rad"
    stepper = assert_type(model().system().stepper(t_end=0.1), kempe.Stepper)
    states = [assert_type(state, kempe.State) for state in stepper]
    assert assert_type(states[-1].t, float) == 0.1 and states[-1].q.shape == (3,)


def test_equations_have_types() -> None:
    workspace = assert_type(model().system().workspace(), kempe.Workspace)
    start = model().system().assemble()
    equations = assert_type(workspace.evaluate(0, start.q, [0.0, 0.0, 0.0]), kempe.Equations)
    assert assert_type(equations.M, Floats).shape == (3, 3) and assert_type(workspace.J, Floats).shape == (2, 3)
    made = assert_type(workspace.forward_dynamics(0.0, start.q, np.zeros(3)), kempe.Accelerations)
    assert assert_type(workspace.inverse_dynamics(0.0, start.q, start.qd, made.qdd), Floats).shape == (3,)
    many = workspace.forward_states(0.0, np.tile(start.q, (4, 1)), np.zeros((4, 3)))
    assert assert_type(many.lam, Floats).shape == (4, 2)
    outputs = assert_type(model().system().outputs(["position(coupler.C)"]), kempe.Outputs)
    J, jdqd = outputs.jacobian(0.0, start.q)
    assert assert_type(J, Floats).shape == (3, 3) and assert_type(jdqd, Floats).shape == (3,)


def test_studies_have_types() -> None:
    system = assert_type(model().system(force=lambda t, q, qd: -0.1 * qd), kempe.System)
    assert assert_type(system.check(), kempe.Check).dof == 1
    sweep = assert_type(model().system().kinematics(sweep={"crank": (0, 6, 31)}), kempe.Kinematics)
    assert assert_type(sweep.rows["q.rocker"], NDArray[Any]).size == 31
    modes = kempe.Model(ROOT / "examples/quarter_car/quarter_car.yaml").system().modes()
    assert assert_type(modes.eigenvalues, NDArray[np.complex128]).size > 0
    batch = model().ensemble({"crank": np.linspace(0.28, 0.3, 3)}).run(t_end=0.1)
    assert assert_type(batch, kempe.EnsembleResult).q.shape == (3, 3)
    with pytest.raises(kempe.InputError) as caught:
        kempe.Model.from_text("kempe: 1")
    assert assert_type(caught.value.problems, list[kempe.Problem])


# -- the tools' verdicts ---------------------------------------------------------------------------------


def tool(name: str, *words: str, cwd: pathlib.Path = ROOT) -> str:
    """Text that a tool prints. The tool must succeed."""
    if importlib.util.find_spec(name) is None:
        pytest.skip(f"{name} is not installed")
    done = subprocess.run([sys.executable, "-m", name, *words], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
    return done.stdout


def programs(folder: pathlib.Path) -> None:
    """This file and the page as programs of users."""
    (folder / "page.py").write_text(page_program())
    (folder / "typed_tests.py").write_text(pathlib.Path(__file__).read_text().replace("from conftest", "from helpers"))
    (folder / "helpers.py").write_text("import pathlib\nROOT = pathlib.Path()\ndef page_program() -> str: return ''\n")


def test_mypy(tmp_path: pathlib.Path) -> None:
    programs(tmp_path)
    tool("mypy", "--config-file", "pyproject.toml", "-p", "kempe")
    tool("mypy", "--config-file", str(ROOT / "pyproject.toml"), ".", cwd=tmp_path)


def test_mypy_sees_mistakes(tmp_path: pathlib.Path) -> None:
    (tmp_path / "wrong.py").write_text("import kempe\nkempe.Model('a').simulate(rtoll=1)\n")
    with pytest.raises(AssertionError, match="rtoll"):
        tool("mypy", "--config-file", str(ROOT / "pyproject.toml"), "wrong.py", cwd=tmp_path)


def test_pyright(tmp_path: pathlib.Path) -> None:
    programs(tmp_path)
    folder = str(pathlib.Path(kempe.__file__).absolute().parents[1])
    settings = {"typeCheckingMode": "strict", "pythonVersion": "3.11", "extraPaths": [folder]}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    assert "0 errors" in tool("pyright", "--pythonpath", sys.executable, cwd=tmp_path)


def test_interface_is_complete() -> None:
    """Every symbol that the package exports has a type that no checker has to infer."""
    said = tool("pyright", "--pythonpath", sys.executable, "--verifytypes", "kempe", "--ignoreexternal")
    assert "Type completeness score: 100%" in said
