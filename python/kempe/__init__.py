# SPDX-License-Identifier: BSD-3-Clause
"""Kempe: mechanisms with closed kinematic loops.

    >>> import kempe
    >>> model = kempe.Model("four_bar.yaml", crank="310 mm")
    >>> run = model.simulate(t_end=5, rtol=1e-9)
    >>> run
    <Trajectory: complete, 501 rows to t = 5 s>
    >>> run.q.shape, run["position(coupler.C)"].shape
    ((501, 3), (501, 3))

Units are SI: kg, m, rad, s, N. n is the number of coordinates, m the number of constraint equations. Arrays are of float64. The examples of
these texts are run in a folder with the models four_bar.yaml, quarter_car.yaml and cart_pole.yaml of the source.

Each text says what its function raises. Every function raises TypeError if an argument has another type, and OutOfMemoryError if the
system has no more memory. Every computation raises Interrupted if Ctrl-C ends it.
"""

from . import contact
from ._native import ffi as _ffi
from ._native import lib as _lib
from .about import about
from .builder import Builder
from .check import Assembly, Branches, Check
from .comfort import Comfort
from .compare import Comparison
from .contacts import Contacts
from .document import Document
from .machine_elements import element_text, elements
from .ensemble import EnsembleResult, Ensemble, Folder, Function, Statistics, Values
from .ensemble_stepper import EnsembleStepper
from .equilibrium import Equilibrium
from .errors import (
    ArgumentError,
    BugError,
    Error,
    FailedError,
    FileError,
    InputError,
    Interrupted,
    KempeWarning,
    OutOfMemoryError,
    Problem,
    StoppedError,
)
from .exudyn import convert_exudyn
from .fit import Fit, Optimum
from .generate import Code, Count, FmuExport
from .flow import Flow, FlowValues
from .gradient import Gradient
from .inverse import Inverse
from .kinematics import Kinematics
from .linearize import Linearization
from .model import Model
from .modes import LimitCycles, Modes
from .output_handles import Outputs
from .progress import Progress
from .reduction import Reduction, reduce
from .response import Response
from .sensitivity import Sensitivity
from .signatures import list_options
from .stepper import SavedState, State, Stepper
from .system import System
from .table import FrozenTable, Table
from .trajectory import Trajectory
from .workspace import (
    Accelerations,
    ClosedDerivatives,
    ClosedEquations,
    ClosedGradient,
    Derivatives,
    Equations,
    ForwardValues,
    InverseDerivatives,
    StateGradient,
    Step,
    Workspace,
)

list_options(Model, System, Ensemble, reduce)

__version__: str = _ffi.string(_lib.kempe_version()).decode()

__all__ = [
    "Accelerations",
    "ArgumentError",
    "Assembly",
    "EnsembleResult",
    "Branches",
    "BugError",
    "Builder",
    "Check",
    "ClosedDerivatives",
    "ClosedEquations",
    "ClosedGradient",
    "Code",
    "Comfort",
    "Comparison",
    "Contacts",
    "Count",
    "Derivatives",
    "Document",
    "Ensemble",
    "EnsembleStepper",
    "Equations",
    "Equilibrium",
    "Error",
    "FailedError",
    "Fit",
    "FmuExport",
    "FileError",
    "Folder",
    "ForwardValues",
    "FrozenTable",
    "Function",
    "Flow",
    "FlowValues",
    "Gradient",
    "InputError",
    "Interrupted",
    "Inverse",
    "InverseDerivatives",
    "KempeWarning",
    "Kinematics",
    "LimitCycles",
    "Linearization",
    "Model",
    "Modes",
    "Optimum",
    "OutOfMemoryError",
    "Outputs",
    "Problem",
    "Progress",
    "Reduction",
    "Response",
    "SavedState",
    "Sensitivity",
    "State",
    "StateGradient",
    "Step",
    "Statistics",
    "Stepper",
    "StoppedError",
    "System",
    "Table",
    "Trajectory",
    "Values",
    "Workspace",
    "about",
    "contact",
    "convert_exudyn",
    "element_text",
    "elements",
    "reduce",
]
