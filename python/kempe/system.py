# SPDX-License-Identifier: BSD-3-Clause
"""The derived equations of a model, and every study of one mechanism."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from ._native import ffi, lib
from .arrays import Array, numbers
from .check import Assembly, Branches, Check
from .comfort import Comfort
from .compare import Comparison
from .contacts import Contacts
from .context import Fixed, T, constant, failed, string
from .equilibrium import Equilibrium
from .errors import ArgumentError
from .inverse import Inverse
from .kinematics import Kinematics
from .lazy import np
from .linearize import Linearization
from .modes import LimitCycles, Modes
from .options import text_of, utf8
from .output_handles import Outputs
from .response import Response
from .result import study
from .stepper import Stepper
from .trajectory import Trajectory
from .workspace import Workspace

if TYPE_CHECKING:
    from typing import Unpack

    from numpy.typing import ArrayLike

    from ._options import (
        ComfortOptions,
        CompareOptions,
        ContactOptions,
        EquilibriumOptions,
        InverseOptions,
        KinematicsOptions,
        LimitCyclesOptions,
        LinearizeOptions,
        ModesOptions,
        ResponseOptions,
        RunOptions,
    )
    from .model import Model
    from .progress import ProgressTo
    from .start import Start

Force: TypeAlias = "Callable[[float, Array, Array], ArrayLike]"
View = Literal["equations", "program", "stats", "passes"]


class System(Fixed):
    """The equations of motion of a model. Keywords of studies are the options of the command, with _ for -. Each study that may
    take long has the keyword `progress`: True for a bar, or a function of a `Progress`.

    A system is frozen. Pickled, it is its model, and is derived again. A copy is the system itself."""

    _noun = "system"

    _recipe: tuple[Callable[..., Any], tuple[Any, ...]]
    _of_model: Callable[[], Model]  # the model, without a reference to it
    _model: Model | None = None
    _started: tuple[Model, System] | None = None  # the last other start

    def __reduce__(self) -> Any:
        return self._recipe

    def _made(self) -> None:
        count = lib.kempe_system_row_count(self._pointer)
        self._context.rows = tuple(string(lib.kempe_system_row_name(self._pointer, k)) for k in range(count))

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the n joint coordinates."""
        return self._context.coordinates

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the m closure rows."""
        return self._context.rows

    def text(self, view: View = "equations") -> str:
        """The equations, the program, operation counts or simplifications as text.

        Raises ArgumentError if there is no such view."""
        return self._context.text(lib.kempe_system_print, self._pointer, constant("VIEW", view), lib.KEMPE_TEXT)

    def __repr__(self) -> str:
        return f"<System: {len(self.coordinates)} coordinates, {len(self.rows)} closure rows>"

    def _set_force(self, force: Force) -> None:
        if not callable(force):
            raise TypeError(f"force is a function (t, q, qd), not {type(force).__name__}")
        self._force = ffi.new_handle(
            (self._context.pointer, self._context.listener, _Callback(force, len(self.coordinates)))
        )
        lib.kempe_system_set_force(self._pointer, lib.python_force, self._force)

    def _new(self, kind: type[T], *arguments: Any) -> T:
        return self._context.make(
            kind, getattr(lib, f"guarded_kempe_{kind._noun}_new"), self._pointer, *arguments, owners=self._owners()
        )

    def _owners(self) -> tuple[Any, ...]:
        return (*super()._owners(), getattr(self, "_force", None))

    # -- the mechanism -----------------------------------------------------------------------------------

    def check(self) -> Check:
        """Mobility, redundant rows, independent coordinates, limits of motion.

        Raises FailedError if the model does not assemble; `partial` is then the diagnosis.

        >>> kempe.Model("four_bar.yaml").system().check()
        <Check: 1 degrees of freedom, 0 redundant rows>
        """
        return self._new(Check)

    def assemble(self) -> Assembly:
        """The state in which the loops are closed.

        Raises FailedError if the loops cannot be closed; the message has the gap and the coordinates.

        >>> kempe.Model("four_bar.yaml").system().assemble().q.shape
        (3,)
        """
        return self._new(Assembly)

    def branches(self, seed: int = 1, progress: ProgressTo | None = None) -> Branches:
        """Other assembly modes, from random starts.

        Raises FailedError if the model does not assemble. Raises TypeError if an argument has another type.

        >>> len(kempe.Model("four_bar.yaml").system().branches())
        2
        """
        with self._context.reporting(progress):
            return self._new(Branches, seed)

    # -- motion --------------------------------------------------------------------------------------------

    def start_at(self, q: Start | None = None, qd: Start | None = None, at: str | None = None) -> System:
        """The equations with another start (`Model.start_at`), for every study. They are derived again; the last ones are kept.
        An ensemble has many starts, as columns q.NAME and qd.NAME, and derives once.

        Raises the exceptions of `Model.start_at`.

        >>> system = kempe.Model("four_bar.yaml").system()
        >>> run = system.simulate(t_end=0.5)
        >>> system.start_at(run.q[-1], run.qd[-1]).assemble().q.round(6) == run.q[-1].round(6)
        array([ True,  True,  True])
        """
        if q is None and qd is None and at is None:
            return self
        if self._model is None:
            self._model = self._of_model()
        _, (_, dynamics, force) = self._recipe
        started = self._model.start_at(q, qd, at)
        if self._started is None or self._started[0] is not started:
            self._started = started, started.system(dynamics, force)
        return self._started[1]

    def simulate(
        self, q: Start | None = None, qd: Start | None = None, at: str | None = None, **options: Unpack[RunOptions]
    ) -> Trajectory:
        """Runs one formulation. q, qd, at: another start, as in `start_at`, whose exceptions are raised, too.

        >>> system = kempe.Model("four_bar.yaml").system()
        >>> system.simulate(t_end=1, formulation="projected", output_step=0.1)
        <Trajectory: complete, 11 rows to t = 1 s>
        >>> bool(system.simulate(q={"crank": 1.5}, t_end=1).q[0, 0] == 1.5)
        True
        """
        return study(Trajectory, self.start_at(q, qd, at), options)

    def stepper(
        self, q: Start | None = None, qd: Start | None = None, at: str | None = None, **options: Unpack[RunOptions]
    ) -> Stepper:
        """A run that is advanced by the caller, who sets inputs between the calls. q, qd, at: another start, as in `start_at`.

        >>> stepper = kempe.Model("cart_pole.yaml").system().stepper(t_end=2)
        >>> stepper.set_input("u", 1.5)
        >>> stepper.advance(0.5)
        >>> stepper
        <Stepper at t = 0.5 s>
        """
        return study(Stepper, self.start_at(q, qd, at), options)

    def compare(self, **options: Unpack[CompareOptions]) -> Comparison:
        """Many formulations, integrators and tolerances against a reference.

        >>> system = kempe.Model("four_bar.yaml").system()
        >>> compared = system.compare(t_end=0.1, formulations="reduced", integrators="dop853", rtols=[1e-6, 1e-8])
        >>> compared.runs.row_count
        4
        """
        return study(Comparison, self, options)

    def kinematics(self, **options: Unpack[KinematicsOptions]) -> Kinematics:
        """Positions, rates and accelerations over a range.

        >>> sweep = kempe.Model("four_bar.yaml").system().kinematics(sweep={"crank": ("0 deg", "360 deg", 361)})
        >>> f"{sweep.rows['q.rocker'].max():.4f} rad"
        '0.7068 rad'
        """
        return study(Kinematics, self, options)

    def inverse(self, **options: Unpack[InverseOptions]) -> Inverse:
        """Actuator forces and torques of a prescribed motion. `motion` is a CSV file, a trajectory, or columns by name, which may be
        functions of the column t. Without it: the motion of the model's drives, or the start.

        >>> held = kempe.Model("four_bar.yaml").system().inverse(actuators="crank")
        >>> held.dof, held.rank, "tau.crank" in held.rows
        (1, 1, True)
        """
        return study(Inverse, self, options)

    # -- about a state -------------------------------------------------------------------------------------

    def workspace(self, friction: str | None = None) -> Workspace:
        """M, C, h, J, forward and inverse dynamics at given states. friction: "stick", "slip" or "none", what dry friction
        that sticks in runs does here. With "stick" the accelerations are as in a run that starts at the state. None is
        "slip", without a force at rest, and a warning if the model has such friction.

        Raises ArgumentError if there is no such word, or friction cannot stick in a workspace of this model.

        >>> workspace = kempe.Model("four_bar.yaml").system().workspace()
        >>> workspace.n, workspace.m
        (3, 2)
        """
        words = () if friction is None else (utf8(friction),)
        new = lib.kempe_workspace_new_with_friction if words else lib.kempe_workspace_new
        made = self._context.make(Workspace, new, self._pointer, *words, owners=self._owners(), long=False)
        made._again, made._system = partial(self.workspace, friction), self
        return made

    def outputs(self, words: Any) -> Outputs:
        """Outputs at any state, and their Jacobians: "position(coupler.C), force(spring)" or a list.

        Raises ArgumentError if a word is missing or wrong. Raises TypeError if the words have another type.

        >>> outputs = kempe.Model("four_bar.yaml").system().outputs("position(coupler.C)")
        >>> outputs.names, outputs.units["position.coupler.C.x"]
        (('position.coupler.C.x', 'position.coupler.C.y', 'position.coupler.C.z'), 'm')
        """
        if not text_of(words).strip():
            raise ArgumentError("no output is named: give words as 'position(coupler.C), force(spring)'")
        return self._context.make(
            Outputs, lib.kempe_outputs_new, self._pointer, utf8(text_of(words)), owners=self._owners(), long=False
        )

    def equilibrium(self, **options: Unpack[EquilibriumOptions]) -> Equilibrium:
        """Static and steady-state equilibria.

        >>> found = kempe.Model("quarter_car.yaml").system().equilibrium()
        >>> len(found), found.is_stable()
        (1, True)
        """
        return study(Equilibrium, self, options)

    def linearize(self, **options: Unpack[LinearizeOptions]) -> Linearization:
        """A state space about an equilibrium or the start.

        >>> space = kempe.Model("cart_pole.yaml").system().linearize(inputs="u", outputs="q(x)")
        >>> space.A.shape, space.B.shape, space.C.shape
        ((4, 4), (4, 1), (1, 4))
        """
        return study(Linearization, self, options)

    def modes(self, **options: Unpack[ModesOptions]) -> Modes:
        """Eigenvalues and mode shapes, also over the values of a parameter.

        >>> modes = kempe.Model("quarter_car.yaml").system().modes()
        >>> [f"{frequency:.3f} Hz" for frequency in modes.modes["frequency"][::2]]
        ['1.121 Hz', '10.822 Hz']
        """
        return study(Modes, self, options)

    def limit_cycles(self, **options: Unpack[LimitCyclesOptions]) -> LimitCycles:
        """Limit cycles over the values of a parameter, and their stability.

        >>> x = {"joint": {"name": "x", "prismatic": "x", "at": "ground"}, "mass": 1}
        >>> law = {"joint": "x", "force": "(a - q(x)^2)*qd(x) - q(x)"}
        >>> model = {"kempe": 1, "parameters": {"a": 0.1}, "bodies": {"m": x}, "forces": {"f": law}}
        >>> cycles = kempe.Model.from_dict(model).system().limit_cycles(sweep="a=-1:2:4")
        >>> f"{cycles.rows['period'][-1]:.6f} s", str(cycles.rows["stability"][-1])
        ('7.629874 s', 'stable')
        """
        return study(LimitCycles, self, options)

    def response(self, **options: Unpack[ResponseOptions]) -> Response:
        """Frequency response near an equilibrium.

        >>> response = kempe.Model("cart_pole.yaml").system().response(inputs="u", outputs="q(x)", frequencies="0.1:10:50")
        >>> response.rows.names[0], response.rows.row_count
        ('frequency', 50)
        """
        return study(Response, self, options)

    def comfort(self, **options: Unpack[ComfortOptions]) -> Comfort:
        """Ride comfort of a run: weighted accelerations, mean comfort, Sperling's ride index.

        >>> comfort = kempe.Model("quarter_car.yaml").system().comfort(vertical="qdd(body)", t_end=10)
        >>> str(comfort.signals["weighting"][0]), comfort.windows.row_count
        ('Wb', 2)
        """
        return study(Comfort, self, options)

    def contact(self, **options: Unpack[ContactOptions]) -> Contacts:
        """Wheels on their rails over a range."""
        return study(Contacts, self, options)


class _Callback:
    """A force function of the caller."""

    def __init__(self, force: Force, count: int) -> None:
        self.force, self.count = force, count

    def array(self, pointer: Any, writeable: bool = False) -> Array:
        array = np.frombuffer(ffi.buffer(pointer, 8 * self.count))
        array.flags.writeable = writeable
        return array

    def call(self, t: float, q: Any, qd: Any, effort: Any) -> int:
        given = self.force(t, self.array(q), self.array(qd))
        if np.shape(given) not in ((), (self.count,)) or given is None:
            shape = "None" if given is None else f"the shape {np.shape(given)}"
            raise ValueError(f"force gives {self.count} values, not {shape}")
        if getattr(given, "dtype", None) != np.float64:
            given = numbers(given, "what force gives")
        self.array(effort, True)[:] = given
        return 0


@ffi.def_extern(error=1, onerror=failed)
def python_force(user: Any, t: float, q: Any, qd: Any, effort: Any) -> int:
    callback: _Callback = ffi.from_handle(user)[2]
    return callback.call(t, q, qd, effort)
