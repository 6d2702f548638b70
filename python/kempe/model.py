# SPDX-License-Identifier: BSD-3-Clause
"""Models: read from a file or text, built in code, with other values of their parameters."""

from __future__ import annotations

import json
import os
import re
import uuid
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from ._native import ffi, lib
from .arrays import Array, finite, optional, whole
from .columns import columns_of, is_path, is_samples, samples_of, text_of_table
from .context import Context, Fixed, level_of_caller, string
from .display import details, model_html
from .document import Document, actuators_of, bodies_of, document_of, joints_of, points_of, set_robots, set_start, set_values
from .ensemble import Ensemble, Folder, Function, Recipe, Values, rows_of
from .ensemble_stepper import EnsembleStepper
from .errors import ArgumentError, FileError, InputError, KempeWarning
from .fit import Fit, Optimum
from .flow import Flow, flow_of
from .generate import Code, Count, FmuExport
from .gradient import Gradient
from .lazy import np
from .options import characters, entry_of, path_of, text_of, utf8, words
from .options import options as struct_of
from .result import study
from .sensitivity import Sensitivity
from .start import Start, start_row
from .system import Force, System

if TYPE_CHECKING:
    from typing import Unpack

    from ._options import (
        Data,
        EnsembleOptions,
        FitOptions,
        FlowOptions,
        FmuOptions,
        GenerateOptions,
        GradientOptions,
        OptimumOptions,
        RunOptions,
        SampleOptions,
        SensitivityOptions,
    )
    from .trajectory import Trajectory

Values_ = Mapping[str, Any]
_OWN = re.compile(r"""^[ {]*["']?kempe["']?[ ]*:""", re.M)  # a text in the model language


class Reading(NamedTuple):
    """The settings of a reading."""

    closure_tolerance: float | None
    cache: str | os.PathLike[str] | None
    robot_base: str | None
    joint_limits: bool
    strict: bool
    leave_out: Sequence[str]


class Model(Fixed):
    """A model file, read and checked, with values of parameters and inputs as keywords.

    Raises FileError if the file, or one that it names, cannot be read. Raises InputError if the text is not a model. Raises TypeError
    if an argument has another type. Raises ArgumentError if a value is given twice or is not finite, or an option has an unknown name.

    >>> model = Model("four_bar.yaml", crank="310 mm")
    >>> model.name, model.coordinates
    ('four-bar', ('crank', 'coupler', 'rocker'))

    A value is a text as in the file: without a unit it is in SI, the value of an input in the unit of the input. A number is the
    text of its digits. In calls and results all numbers are in SI, also inputs of a stepper. `parameters` has values whose names are not keywords.
    Samples of an input are {"t": times, "value": values, "method": "linear"}, or hold or cubic; the values may be a function of t.
    `closure_tolerance` (m) is the gap that redundant closures may keep; `cache` a folder that keeps derived equations.
    Of a robot in another format, `robot_base` is "fixed" or "free"; with `joint_limits` its limits are stops. Mechanics in it that Kempe does not read is an
    error, unless `leave_out` has its name. With `strict` surfaces, limits and controllers that are not used are errors, too.

    A model is frozen. Pickled, it is its path or text and these values, and is read again. A copy is the model itself.
    """

    _noun = "model"

    def __init__(
        self,
        path: str | os.PathLike[str],
        parameters: Values_ | None = None,
        *,
        closure_tolerance: float | None = None,
        cache: str | os.PathLike[str] | None = None,
        robot_base: str | None = None,
        joint_limits: bool = False,
        strict: bool = False,
        leave_out: Sequence[str] = (),
        **more: Any,
    ) -> None:
        values = _values_of(parameters, more)
        reading = Reading(closure_tolerance, cache, robot_base, joint_limits, strict, leave_out)
        if isinstance(path, Mapping):
            raise TypeError("a path is needed, not a mapping: Model.from_dict takes one")
        named = path_of(path)
        self._recipe: Recipe = _read_again, (os.path.abspath(path), None, values, reading)
        try:
            self._read(lib.guarded_kempe_model_read_set, (named,), values, reading)
        except FileError as error:
            if b"\n" not in named:
                raise
            raise FileError(f"{error}; Model.from_text reads a text") from None

    @classmethod
    def from_text(
        cls,
        text: str,
        parameters: Values_ | None = None,
        *,
        label: str = "model",
        closure_tolerance: float | None = None,
        cache: str | os.PathLike[str] | None = None,
        robot_base: str | None = None,
        joint_limits: bool = False,
        strict: bool = False,
        leave_out: Sequence[str] = (),
        **more: Any,
    ) -> Model:
        """Reads a model from text; `label` replaces the file name in messages.

        Raises FileError if a file that the text names cannot be read. Raises InputError if the text is not a model. Raises TypeError if
        an argument has another type. Raises ArgumentError if a value is given twice or is not finite, or an option has an unknown name.

        >>> Model.from_text("kempe: 1", label="empty.yaml")
        Traceback (most recent call last):
        ...
        kempe.errors.InputError: empty.yaml:1:1: the model has no key 'bodies'
        """
        model = cls.__new__(cls)
        values = _values_of(parameters, more)
        reading = Reading(closure_tolerance, cache, robot_base, joint_limits, strict, leave_out)
        model._recipe = _read_again, (label, text, values, reading)
        source = (utf8(text), utf8(label))
        model._read(lib.guarded_kempe_model_read_text_set, source, values, reading)
        return model

    @classmethod
    def from_dict(
        cls,
        document: Mapping[str, Any],
        parameters: Values_ | None = None,
        *,
        folder: str | os.PathLike[str] | None = None,
        **more: Any,
    ) -> Model:
        """Reads a model from a dict with the keys of a model file, or from `to_dict` of a model. Tuples are lists. `folder`: of files
        that the dict names (the present one, or the document's).

        Raises InputError if the dict is not a model. Raises FileError if a file that it names cannot be read. Raises TypeError if an
        entry has another type. Raises ValueError if a number in it is not finite, and ArgumentError as `from_text`.

        >>> arm = {"joint": {"revolute": "z", "at": "ground"}, "mass": "3 kg", "com": (0, -1, 0), "inertia": {"zz": 1}}
        >>> Model.from_dict({"kempe": 1, "gravity": (0, -9.81, 0), "bodies": {"arm": arm}}).coordinates
        ('arm',)
        """
        place = os.fsdecode(folder) if folder is not None else getattr(document, "folder", "")
        return cls.from_text(entry_of(document), parameters, label=os.path.join(place, "dict"), **more)

    def _read(self, function: Any, source: tuple[bytes, ...], values: Values_, reading: Reading) -> None:
        self._context = Context()
        if reading.cache is not None:
            self._context.check(lib.kempe_context_set_cache, self._context.pointer, path_of(reading.cache))
        if reading.robot_base is not None:
            self._context.check(lib.kempe_context_set_base, self._context.pointer, utf8(reading.robot_base))
        self._context.check(lib.kempe_context_set_joint_limits, self._context.pointer, int(reading.joint_limits))
        self._context.check(lib.kempe_context_set_strict, self._context.pointer, int(reading.strict))
        self._context.check(lib.kempe_context_set_left_out, self._context.pointer, utf8(",".join(_names_of(reading.leave_out))))
        keep: list[Any] = []
        settings = ffi.new(
            "kempe_setting[]",
            [(characters(name, keep), characters(self._setting(name, value), keep)) for name, value in values.items()],
        )
        try:
            made = self._context.make(Model, function, self._context.pointer, *source, settings, len(values))
        except InputError as error:
            self._explain_samples(values, error)
            raise
        self._take(made._pointer)
        if reading.closure_tolerance is not None:
            self._context.check(lib.kempe_model_set_closure_tolerance, self._pointer, reading.closure_tolerance)

    def _explain_samples(self, values: Values_, error: InputError) -> None:
        """A parameter is a number, and its samples are read as an expression."""
        wrong = [name for name, value in values.items() if isinstance(value, dict) and f"{name}:1:1: unknown" in error.message]
        if wrong:
            raise ArgumentError(f"'{wrong[0]}' is a parameter, which is a number; samples are for inputs") from None

    def _setting(self, name: str, value: Any) -> str:
        """A value as text. Samples are the text of a table that stays with the model."""
        if not isinstance(value, dict):
            try:
                text = text_of(value)
            except TypeError:
                raise TypeError(f"the value of '{name}' is a number or a text with a unit, not {value!r}") from None
            if text in ("nan", "inf", "-inf"):
                raise ArgumentError(f"the value of '{name}' is {text}: give a finite number")
            return text
        label, method = f"samples of {name}", value["method"]
        self._context.set_text(label, text_of_table(name, {key: value[key] for key in ("t", "value")}))
        return f"{label}:value:{method}"

    def _take(self, pointer: Any) -> None:
        """Takes the library's model over."""
        self._pointer = pointer
        count = lib.kempe_model_coordinate_count(pointer)
        self._context.coordinates = tuple(string(lib.kempe_model_coordinate_name(pointer, k)) for k in range(count))
        self._context.inputs = {
            string(lib.kempe_model_input_name(pointer, k)): string(lib.kempe_model_input_unit(pointer, k))
            for k in range(lib.kempe_model_input_count(pointer))
        }
        self._system: System | None = None
        self._started: tuple[list[bytes | str | None], Model] | None = None  # the last other start
        self._begun = True

    def _instead(self, name: str) -> str:
        return f"; Model(.., {name}=..) has another value"

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            hint = f": model.system().{name} is it" if name[0] != "_" and hasattr(System, name) else ""
            raise AttributeError(f"'Model' object has no attribute '{name}'{hint}")

    @classmethod
    def _of(cls, context: Context, pointer: Any, recipe: Recipe) -> Model:
        """A model that a builder has made."""
        model = cls.__new__(cls)
        model._context, model._recipe = context, recipe
        model._take(pointer)
        return model

    # -- what it has -----------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """The model's name."""
        return string(lib.kempe_model_name(self._pointer))

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the joint coordinates and then of the states, the order of q and qd."""
        return self._context.coordinates

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states, variables with an equation of first order. Their values are the last columns of qd.

        >>> arm = {"joint": {"revolute": "z", "at": "ground"}, "mass": 3, "inertia": {"zz": 1}}
        >>> states = {"heat": {"start": 20, "rate": "qd(arm)^2 - heat"}}
        >>> model = Model.from_dict({"kempe": 1, "bodies": {"arm": arm}, "states": states})
        >>> model.coordinates, model.states, model.simulate(t_end=1)["state(heat)"].shape
        (('arm', 'heat'), ('heat',), (201,))
        """
        return tuple(self.parsed().get("states", ()))

    @property
    def inputs(self) -> dict[str, str]:
        """Inputs and their units as written in the model."""
        return dict(self._context.inputs)

    def input_value(self, name: str, t: float) -> float:
        """Value of an input at t (s) by the model's samples or default, in SI.

        Raises ArgumentError if the model has no such input or t is not finite. Raises TypeError if t is not a number.

        >>> Model("cart_pole.yaml", u=2).input_value("u", 0.0)
        2.0
        """
        return float(lib.kempe_model_input_value(self._pointer, self._context.input(name), finite(t, "t")))

    def parsed(self) -> dict[str, Any]:
        """The model as it was understood: bodies with their motions, closures, forces; expressions of parameters are numbers, in SI. It is
        the JSON of `kempe show`, and does not read back: `to_dict` does.

        >>> Model("four_bar.yaml").parsed()["parameters"]["diagonal"]
        0.9486832980505138
        """
        made: dict[str, Any] = json.loads(self._context.text(lib.kempe_model_print, self._pointer, lib.KEMPE_JSON))
        return made

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters by name, in SI."""
        return dict(self.parsed()["parameters"])

    @property
    def bodies(self) -> dict[str, dict[str, Any]]:
        """Bodies by name: parent, at, joint, mass, com, inertia, points, in SI.

        >>> Model("four_bar.yaml").bodies["crank"]["mass"]
        1
        """
        return bodies_of(self.parsed())

    @property
    def joints(self) -> dict[str, dict[str, Any]]:
        """Joints of the tree by name: body, parent, at (the point there), coordinates, axes.

        >>> Model("cart_pole.yaml").joints["phi"]["coordinates"]
        ['phi']
        """
        return joints_of(self.parsed())

    @property
    def points(self) -> dict[str, list[float]]:
        """Points by BODY.POINT: x, y, z in the axes of the body, m.

        >>> Model("cart_pole.yaml").points["pole.tip"]
        [0, 0.8, 0]
        """
        return points_of(self.parsed())

    @property
    def actuators(self) -> dict[str, dict[str, Any]]:
        """Forces that depend on inputs, by name, with these `inputs`.

        >>> Model("cart_pole.yaml").actuators["push"]["inputs"]
        ['u']
        """
        return actuators_of(self.parsed())

    def to_dict(self) -> Document:
        """The entries of the model file, as a dict that may be changed and read again: `from_dict` of it is the same model, with the
        same bits. It has the values and the start that the model was given, also of files that it includes. `document` is another name.

        Raises OSError if a file of the model can no longer be read. Raises InputError if it has changed to other content.

        >>> entries = Model("four_bar.yaml").to_dict()
        >>> entries["bodies"]["crank"]["mass"] = 2
        >>> Model.from_dict(entries).bodies["crank"]["mass"]
        2
        """
        make, arguments = self._recipe
        if make in (_start_again, _instance_again):
            recipe, *more = arguments
            before: Model = recipe[0](*recipe[1])
            made = before.to_dict()
            if make is _start_again:
                self._put_start(made, before, *more)
            else:
                _put_instance(made, *more)
            return made
        if make is not _read_again:
            return document_of(self.name, self.export("yaml"), self.name, {})
        label, text, values, reading = arguments
        if text is None:
            with open(label, encoding="utf-8") as file:
                text = file.read()
        foreign = not _OWN.search(text)
        made = document_of(self.name, self.export("yaml") if foreign else text, label, values)
        if reading.closure_tolerance is not None:
            made["closure_tolerance"] = reading.closure_tolerance
        if not foreign:
            set_robots(made, reading.robot_base, reading.joint_limits, _names_of(reading.leave_out))
        return made

    document = to_dict

    def _given_start(self) -> dict[str, Any]:
        """Start values that are given, and which of them hold."""
        made: dict[str, Any] = json.loads(self._context.text(lib.python_start, self._pointer))
        return made

    def _put_start(self, document: Document, before: Model, q: Array | None, qd: Array | None, _at: str | None = None) -> None:
        """Puts the start that this model has into the entries of the model before."""
        states = [name for name, value in zip(self.coordinates, () if qd is None else qd) if name in self.states and value == value]
        set_start(document, before._given_start(), self._given_start(), q is not None, qd is not None, states)

    def export(self, format: str) -> str:
        """The model in another format, "urdf+", "sdf", "mjcf" or "yaml". A warning names each part that the format cannot say.

        Raises ArgumentError if the format is unknown, or the model was read from a file in Kempe's language.

        >>> print(Model("four_bar.yaml").export("sdf").splitlines()[0])
        <?xml version="1.0"?>
        """
        return self._context.text(lib.kempe_model_export, self._pointer, utf8(format))

    def __str__(self) -> str:
        return self._context.text(lib.kempe_model_print, self._pointer, lib.KEMPE_TEXT)

    def __repr__(self) -> str:
        return f"<Model {self.name!r}: coordinates {', '.join(self.coordinates)}>"

    def _repr_html_(self) -> str:
        return model_html(self.parsed()) + details("model", str(self))

    def __reduce__(self) -> Any:
        return self._recipe

    def on_progress(self, receive: Callable[[str], object] | None) -> None:
        """Calls a function with lines of progress, about one a second, in all computations with this model. None: no more.

        A single computation has the keyword `progress`: True for a bar, or a function of a `Progress`.

        Raises TypeError if `receive` is not a function."""
        if receive is not None and not callable(receive):
            raise TypeError(f"on_progress takes a function of a line, or None, not {receive!r}")
        self._context.listener.progress = receive
        self._context.on_count(None if receive is None else lambda progress: receive(str(progress)), 1.0)

    # -- equations -------------------------------------------------------------------------------------

    def system(self, dynamics: str | None = None, force: Force | None = None) -> System:
        """The equations of motion. `dynamics`: auto, composite, plain, ner, articulated. `force`: a function (t, q, qd) that gives
        generalized forces (n; N m or N) in addition to the model's; it must be smooth and depend only on its arguments.

        Raises InputError if the model moves no mass or its closures contradict each other. Raises ArgumentError if there is no such
        algorithm. Raises FailedError if the algorithm cannot give the accelerations. Raises TypeError if an argument has another type.
        """
        if dynamics is not None and not isinstance(dynamics, str):
            raise TypeError(f"dynamics is the name of an algorithm, not {dynamics!r}; a function is given as force=..")
        if dynamics is None and force is None and self._system is not None:
            return self._system
        if dynamics is None:
            made = self._context.make(System, lib.guarded_kempe_system_new, self._pointer, owners=(self._pointer,))
        else:
            made = self._context.make(
                System,
                lib.kempe_system_new_with_algorithm,
                self._pointer,
                utf8(dynamics),
                owners=(self._pointer,),
                long=False,
            )
        made._recipe = _derive_again, (self._recipe, dynamics, force)
        made._of_model = partial(Model._of, self._context, self._pointer, self._recipe)
        if force is not None:
            made._set_force(force)
        elif dynamics is None:
            self._system = made
        return made

    def start_at(self, q: Start | None = None, qd: Start | None = None, at: str | None = None) -> Model:
        """The model with another start, in every computation: as `start` of a model file, but independent coordinates keep the
        given values. q, qd: arrays in the order of `coordinates`, or mappings with some of their names; other coordinates start
        as in the model, and follow where the loops need it. Goals of the model do not count when q is given. Values of states are in qd.
        at: "equilibrium", to which this start leads, or "equilibrium NAME=RATE,..", a steady motion; "start": the start itself.

        Raises FailedError if the loops cannot be closed there or values contradict each other; the message has the gap and the
        coordinates. Raises ArgumentError if there is no such coordinate. Raises ValueError if a value is not finite or an array has
        another length. Raises TypeError if a value is not a number.

        >>> lifted = Model("four_bar.yaml").start_at(q={"crank": 1.5}, qd={"crank": 2})
        >>> run = lifted.simulate(t_end=0.5)
        >>> float(run.q[0, 0]), float(run.qd[0, 0])
        (1.5, 2.0)
        >>> rests = Model("four_bar.yaml").start_at(at="equilibrium").simulate(t_end=0.5)
        >>> bool(abs(rests.q[-1] - rests.q[0]).max() < 1e-9)
        True
        """
        names, states = self.coordinates, self.coordinates[len(self.coordinates) - len(self.states) :]
        row = start_row("q", q, names, states)
        self._warn_of_degrees(row)
        return self._start_at(row, start_row("qd", qd, names, ()), at)

    def _warn_of_degrees(self, row: Array | None) -> None:
        """A warning of an angle that is a whole number of radians beyond one turn, as degrees are."""
        if row is None:
            return
        whole = [k for k, value in enumerate(row) if abs(value) > 6.5 and value % 1 == 0]
        if not whole:
            return
        motions = {motion["coordinate"]: motion["kind"] for body in self.parsed()["bodies"] for motion in body.get("motions", ())}
        for k in whole:
            name, turns = self.coordinates[k], abs(row[k]) / (2 * np.pi)
            if motions.get(name) == "R":
                warnings.warn(
                    f"q: '{name}' is {row[k]:g} rad, {turns:.3g} turns: numpy.radians makes them of degrees", KempeWarning, level_of_caller()
                )

    def _start_at(self, q: Array | None, qd: Array | None, at: str | None) -> Model:
        """As start_at, of a value for each coordinate, NaN where none is given."""
        key = [*(None if row is None else row.tobytes() for row in (q, qd)), at]
        if self._started is None or self._started[0] != key:
            pointer = self._pointer
            if q is not None or qd is not None or at is None:
                arguments = [optional(row, len(self.coordinates), "") for row in (q, qd)]
                made = self._context.make(Model, lib.kempe_model_start_at, pointer, *arguments, owners=(pointer,), long=False)
                pointer = made._pointer
            if at is not None:
                made = self._context.make(Model, lib.kempe_model_start_in, pointer, utf8(at), owners=(pointer,), long=False)
            self._started = key, Model._of(self._context, made._pointer, (_start_again, (self._recipe, q, qd, at)))
        return self._started[1]

    def simulate(
        self, q: Start | None = None, qd: Start | None = None, at: str | None = None, **options: Unpack[RunOptions]
    ) -> Trajectory:
        """`system().simulate(..)`. q, qd, at: another start, as in `start_at`.

        >>> Model("four_bar.yaml").simulate(t_end=1).verdict["convergence"]["result"]
        'converged'
        """
        return self.system().simulate(q, qd, at, **options)

    def sensitivity(self, **options: Unpack[SensitivityOptions]) -> Sensitivity:
        """Derivatives of a trajectory, or of a state, by parameters.

        >>> slopes = Model("four_bar.yaml").sensitivity(parameters="crank", outputs="q(rocker)", t_end=0.5)
        >>> slopes.rows.names
        ('t', 'q.rocker', 'q.rocker/crank')
        """
        return study(Sensitivity, self, options)

    def fit(self, **options: Unpack[FitOptions]) -> Fit:
        """Parameters from measured motions: `data` is a CSV file or columns by name, as {"t": .., "q(arm)": ..}, a data frame or a
        table; `parameters` names or a mapping of names to bounds.

        >>> Model("four_bar.yaml", crank_mass=2).simulate(t_end=1).rows.write("measured.csv")
        >>> fit = Model("four_bar.yaml").fit(data="measured.csv", columns="q.rocker", parameters={"crank_mass": (0.1, 5)})
        >>> round(fit.values["crank_mass"], 5)
        2.0
        """
        return study(Fit, self, options)

    def optimize(self, **options: Unpack[OptimumOptions]) -> Optimum:
        """Parameters for which a quantity of a run is least or largest; `parameters` maps names to bounds.

        >>> model = Model("four_bar.yaml")
        >>> optimum = model.optimize(minimize="max(qd(rocker))", parameters={"base": (0.85, 0.95)}, t_end=0.3)
        >>> optimum.method, optimum.kept, list(optimum.values)
        ('slopes', True, ['base'])
        """
        return study(Optimum, self, options)

    def gradient(self, **options: Unpack[GradientOptions]) -> Gradient:
        """Outputs of the driven mechanism with their derivatives by parameters, for repeated evaluation. The outputs are as in
        the model.

        >>> text = open("four_bar.yaml").read().replace("run: {", "run: {outputs: [position(coupler.C)], ")
        >>> gradient = Model.from_text(text).gradient(driven="crank", parameters=["crank", "base"])
        >>> gradient.names, gradient.at(0.1).shape, gradient.jacobian.shape
        (('position.coupler.C.x', 'position.coupler.C.y', 'position.coupler.C.z'), (3,), (3, 2))
        """
        made = study(Gradient, self, options)
        made._set_options(options)
        return made

    def flow(self, t: float | Iterable[float], **options: Unpack[FlowOptions]) -> Flow:
        """The motion from 0 to the time or times `t`, in s, as a function of `variables`, with its exact derivatives, also through
        contacts and other events. Variables are start values (q.NAME, qd.NAME) and parameters. The equations are derived once.

        >>> flow = Model("four_bar.yaml").flow(0.05, variables="crank,base", outputs="q(rocker)")
        >>> flow.names, flow({"base": 0.9}).jacobian.shape
        (('q.rocker',), (1, 2))
        """
        return flow_of(self, t, options)

    def count(self, **options: Unpack[GenerateOptions]) -> Count:
        """Operation counts of sets of equations: "M_C", "J", "forward", ..

        >>> Model("four_bar.yaml").count(sets="M_C")
        <Count>
        """
        return study(Count, self, options)

    def generate(self, **options: Unpack[GenerateOptions]) -> Code:
        """The equations in another language: c, casadi, jax, octave, python, torch.

        >>> list(Model("four_bar.yaml").generate(language="python", sets="M_C").files)
        ['four_bar.py']
        """
        return study(Code, self, options)

    def fmu(self, path: str | os.PathLike[str] | None = None, **options: Unpack[FmuOptions]) -> FmuExport:
        """The model as a functional mock-up unit (FMI 2.0 or 3.0), written to the path if it is given.

        >>> unit = Model("four_bar.yaml").fmu(fmi=2, kind="cs", no_binary=True)
        >>> unit.files[0]
        'modelDescription.xml'
        """
        made = study(FmuExport, self, options)
        if path is not None:
            made.write(path)
        return made

    # -- many instances ----------------------------------------------------------------------------------

    def values(self, columns: Data | None = None) -> Values:
        """Values of parameters and starts (q.NAME, qd.NAME) for many instances: arrays of one length by name, a data frame, or a CSV
        file. None: one instance, the model itself.

        Raises ArgumentError if a column is neither a parameter nor a start of the model. Raises InputError if a cell of a file is not a
        number. Raises FileError if the file cannot be read. Raises ValueError if columns have several lengths. Raises TypeError if a
        column has other entries than numbers.

        >>> values = Model("four_bar.yaml").values({"crank": [0.29, 0.30, 0.31], "qd.crank": 20})
        >>> values.names, len(values), values[0].tolist()
        (('crank', 'qd.crank'), 3, [0.29, 20.0])
        """
        if is_path(columns):
            made = self._context.make(
                Values, lib.guarded_kempe_values_read, self._pointer, path_of(columns), owners=(self._pointer,)
            )
            return self._called(made, "values", os.path.abspath(os.fsdecode(columns)))
        if columns is None:
            made = self._context.make(
                Values, lib.kempe_values_new, self._pointer, 0, ffi.NULL, 1, ffi.NULL, owners=(self._pointer,), long=False
            )
            return self._called(made, "values")
        if not isinstance(columns, Mapping):
            columns = columns_of("values", columns, index=False)
        rows = rows_of(columns)
        keep: list[Any] = []
        names = words(columns, keep)
        data = ffi.from_buffer("double[]", rows)
        made = self._context.make(
            Values,
            lib.kempe_values_new,
            self._pointer,
            len(names),
            names,
            len(rows),
            data,
            owners=(self._pointer,),
            long=False,
        )
        return self._called(made, "values", {name: rows[:, k] for k, name in enumerate(columns)})

    def _called(self, values: Values, name: str, *arguments: Any, **options: Any) -> Values:
        """Values with the call that made them, for pickles."""
        values._recipe, values._call = self._recipe, (name, arguments, options)
        return values

    def sample(self, ranges: Any, count: int | None = None, **options: Unpack[SampleOptions]) -> Values:  # type: ignore[misc]
        """Samples of distributions: {"crank": (0.2, 0.3)} in SI or "crank=200 mm:300 mm" (uniform), "crank=normal(0.3, 0.001)",
        "crank=triangular(0.2, 0.3, 0.4)", "crank=IT7" (a tolerance grade about the model's value). `count` None: 1000.

        >>> values = Model("four_bar.yaml").sample("crank=290 mm:310 mm, coupler=IT9", 100, design="latin")
        >>> len(values), all(0.29 <= row[0] <= 0.31 for row in values)
        (100, True)
        """
        given, keep = struct_of("kempe_sample_options", {"ranges": ranges, "count": count, **options})
        made = self._context.make(
            Values, lib.kempe_values_sample, self._pointer, given, owners=(self._pointer,), long=False
        )
        del keep
        return self._called(made, "sample", ranges, count, **options)

    def ensemble(
        self, values: Values | Data | None = None, **options: Unpack[EnsembleOptions]
    ) -> Ensemble:
        """Many instances of the mechanism, with quantities of each: words, a list of them or a mapping of names to words. Without values:
        one instance, the model itself.

        >>> batch = Model("four_bar.yaml").ensemble({"crank": [0.29, 0.30, 0.31]}).run(t_end=1)
        >>> batch.status, batch.q.shape
        (['complete', 'complete', 'complete'], (3, 3))
        >>> measured = Model("four_bar.yaml").ensemble({"crank": [0.29, 0.30]}, quantities={"swing": "range(q(rocker))"})
        >>> measured.run(t_end=1).quantities["swing"].shape
        (2,)
        """
        if isinstance(options.get("quantities"), Mapping) and not options["quantities"]:
            raise ArgumentError('quantities is empty: give words such as {"swing": "range(q(rocker))"}, or leave it out')
        given, keep = struct_of("kempe_ensemble_options", options)
        values = values if isinstance(values, Values) else self.values(values)
        owners = (self._pointer, values._pointer)
        made = self._context.make(
            Ensemble, lib.guarded_kempe_ensemble_new_with, self._pointer, values._pointer, given, owners=owners
        )
        del keep
        made._values, made._chosen, made._key = values, dict(options), uuid.uuid4().hex
        model_hash = ffi.new("char[65]")
        self._context.check(lib.python_model_hash, self._pointer, model_hash)
        made._hash = ffi.string(model_hash)
        return made

    def ensemble_stepper(
        self, count: int, outputs: str | Sequence[str] = ("q", "qd"), lanes: int = 0, **options: Unpack[RunOptions]
    ) -> EnsembleStepper:
        """Many instances of the mechanism that are advanced by the caller, who sets inputs in each step. `outputs`: words of them;
        `lanes`: instances at a time, 0 the best number, -1 a stepper for each.

        >>> carts = Model("cart_pole.yaml").ensemble_stepper(256, "q, qd", t_end=4)
        >>> carts
        <EnsembleStepper: 256 instances in lanes, outputs q.x, q.phi, qd.x, qd.phi>
        """
        return study(EnsembleStepper, self, options, whole(count, "count"), whole(lanes, "lanes"), utf8(text_of(outputs)))

    def function(
        self,
        inputs: Sequence[str],
        quantities: str | Sequence[str] | Mapping[str, str] | None = None,
        lanes: int = 0,
        **options: Unpack[RunOptions],
    ) -> Function:
        """A function of rows of inputs, parameters and starts (q.NAME, qd.NAME), that gives rows of quantities. The equations are
        derived once. Rows run as in an ensemble, several at a time and in threads; each result depends only on its row.

        Raises TypeError if inputs are one text. Raises ValueError if an input is given twice.

        >>> f = Model("four_bar.yaml").function(["crank"], quantities={"swing": "range(q(rocker))"}, t_end=1)
        >>> Y = f([[0.29], [0.30], [0.31]])
        >>> Y.shape, bool(Y[0] < Y[2])
        ((3, 1), True)
        """
        if isinstance(inputs, str):
            raise TypeError("inputs are a sequence of names, not one text")
        twice = [name for k, name in enumerate(inputs) if name in inputs[:k]]
        if twice:
            raise ValueError(f"the input '{twice[0]}' is given twice")
        values = self.values(dict.fromkeys(inputs, ()))
        wanted: EnsembleOptions = {} if quantities is None else {"quantities": quantities}
        return Function(self.ensemble(values, **wanted), lanes, options)

    def instance(self, folder: str | os.PathLike[str], k: int) -> Model:
        """This model with the values of instance k (from 0 on) of a result folder.

        Raises InputError if the folder has no results or belongs to another model. Raises FailedError if its part is missing or the
        model cannot have these values. Raises ArgumentError if there is no instance k.

        >>> import tempfile
        >>> model = Model("four_bar.yaml")
        >>> with tempfile.TemporaryDirectory() as place:
        ...     folder = model.ensemble({"crank": [0.29, 0.31]}).run_folder(place, t_end=0.5)
        ...     again = model.instance(place, 1)
        >>> again.parameters["crank"], again.simulate(**folder.run_options).status
        (0.31, 'complete')
        """
        context, path = self._context, path_of(folder)
        opened = context.make(Folder, lib.kempe_folder_open, context.pointer, path, long=False)
        owners = (self._pointer,)
        made = context.make(Model, lib.kempe_folder_model, opened._pointer, self._pointer, k, owners=owners, long=False)
        return Model._of(context, made._pointer, (_instance_again, (self._recipe, os.fsdecode(path), k)))


def _put_instance(document: Document, path: str, k: int) -> None:
    """Puts the values of instance k of a result folder into the entries of its model."""
    folder = Folder.open(path)
    chunk = int(folder.to_dict()["chunk"])
    set_values(document, folder.part(k // chunk).row(k % chunk))


def _names_of(given: str | Sequence[str]) -> list[str]:
    return [name for each in ([given] if isinstance(given, str) else given) for name in each.split(",") if name.strip()]


def _instance_again(recipe: Recipe, folder: str, k: int) -> Model:
    made: Model = recipe[0](*recipe[1])
    return made.instance(folder, k)


def _values_of(parameters: Values_ | None, more: Values_) -> Values_:
    """Values of parameters and inputs, with samples as arrays."""
    if parameters is not None and not isinstance(parameters, Mapping):
        raise TypeError(f"parameters is a mapping of names to values, not {parameters!r}")
    twice = [name for name in parameters or {} if name in more]
    if twice:
        raise ArgumentError(f"'{twice[0]}' is given twice, in parameters and as a keyword")
    values = {**(parameters or {}), **more}
    return {name: samples_of(name, value) if is_samples(name, value) else value for name, value in values.items()}


def _start_again(recipe: Recipe, q: Array | None, qd: Array | None, at: str | None = None) -> Model:
    made: Model = recipe[0](*recipe[1])
    return made._start_at(q, qd, at)


def _read_again(label: str, text: str | None, values: Values_, reading: Reading) -> Model:
    if text is None:
        return Model(label, values, **reading._asdict())
    return Model.from_text(text, values, label=label, **reading._asdict())


def _derive_again(recipe: Recipe, dynamics: str | None, force: Force | None) -> System:
    made: Model = recipe[0](*recipe[1])
    return made.system(dynamics, force)
