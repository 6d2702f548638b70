# SPDX-License-Identifier: BSD-3-Clause
"""Environments of Gymnasium for reinforcement learning: one mechanism, or many at once. Gymnasium is an optional package."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from ._native import ffi, lib
from .arrays import DOUBLES, Array, matched, writable
from .context import interruptible
from .errors import ArgumentError, FailedError, Interrupted, error_of
from .lazy import np
from .options import text_of, unknown
from .stepper import Stepper
from .table import column_name
from .workspace import processors

if TYPE_CHECKING:
    from typing import Required, Unpack

    from ._options import RunOptions
    from .ensemble_stepper import EnsembleStepper
    from .model import Model
    from .workspace import Workspace

    class TaskOptions(RunOptions, total=False):
        """Keywords of both environments (`_task`), and options of the stepper."""

        step_time: Required[float]
        horizon: Required[float]
        observation: str | Sequence[str]
        more: str | Sequence[str]
        limits: Mapping[str, tuple[float, float]] | None
        terminated: Callable[[Values], Any] | None
        start: Start | None
        failure_reward: float

_absent = ""
try:
    from gymnasium import Env
    from gymnasium.error import ResetNeeded
    from gymnasium.spaces import Box
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError as missing:
    _absent = f"environments need the package gymnasium (pip install gymnasium): {missing}"
    Env = VectorEnv = object

__all__ = ["Environment", "Values", "VectorEnvironment"]

Limits = tuple[float, float]
Draw = float | Limits
Start = Mapping[str, Draw] | Callable[[Any], Mapping[str, float]]

_DRAWS = 100  # of a start, until one of them closes the loops
_LEAST = 64  # instances of a thread, where the number of threads is not given: fewer take less time than the threads' meeting


class Values(Mapping[str, Any]):
    """Outputs and inputs by their names, and `t`, the time of the episode: an array with a value for each instance.
    `values["q(phi)"]` and `values["q.phi"]` are the same."""

    def __init__(self, places: Mapping[str, int], columns: Array) -> None:
        self._places, self._columns = places, columns

    def __getitem__(self, name: str) -> Any:
        """The values of an output or input.

        Raises KeyError if there is no such value. Raises TypeError if the name is not a text."""
        place = self._places.get(name, self._places.get(column_name(name), -1))
        if place < 0:
            raise KeyError(unknown("value", name, self._places))
        return self._columns[place]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def __repr__(self) -> str:
        return f"<Values: {', '.join(self._places)}>"


class _Task(NamedTuple):
    """Arguments of an environment, read and checked."""

    inputs: tuple[str, ...]
    low: Array
    high: Array
    observed: tuple[str, ...]  # words
    more: tuple[str, ...]
    reward: Callable[[Values], Any]
    terminated: Callable[[Values], Any] | None
    bounds: Mapping[str, Limits]
    step_time: float
    steps: int
    start: Start
    failure_reward: float
    options: Mapping[str, Any]

    @property
    def end(self) -> float:
        """t_end of the runs, s."""
        return (self.steps + 1) * self.step_time


def _task(
    inputs: Mapping[str, Limits],
    reward: Callable[[Values], Any],
    *,
    step_time: float,
    horizon: float,
    observation: str | Sequence[str] = ("q", "qd"),
    more: str | Sequence[str] = (),
    limits: Mapping[str, Limits] | None = None,
    terminated: Callable[[Values], Any] | None = None,
    start: Start | None = None,
    failure_reward: float = 0.0,
    **options: Any,
) -> _Task:
    """The arguments of both environments."""
    if _absent:
        raise ImportError(_absent)
    if not inputs:
        raise ArgumentError("inputs is empty: name the inputs of the model that an action sets, with their limits")
    for name, (low, high) in inputs.items():
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ArgumentError(f"the limits of the input '{name}' are two finite numbers, the lower one first, not {low:g} and {high:g}")
    if not (step_time > 0 and math.isfinite(step_time)):
        raise ArgumentError(f"step_time is {step_time:g} s; a positive number is needed")
    steps = round(horizon / step_time) if math.isfinite(horizon) else 0
    if steps < 1 or abs(steps * step_time - horizon) > 1e-9 * horizon:
        raise ArgumentError(f"the horizon of {horizon:g} s is not a whole number of steps of {step_time:g} s")
    if "t_end" in options:
        raise ArgumentError("the end of an episode is its horizon: leave t_end out")
    low, high = np.array(list(inputs.values()), dtype=float).T.copy()
    bounds = {column_name(name): (float(ends[0]), float(ends[1])) for name, ends in (limits or {}).items()}
    observed, others = (tuple(word.strip() for word in text_of(each).split(",") if word.strip()) for each in (observation, more))
    if not observed:
        raise ArgumentError("the observation is empty: name outputs, as q, qd or position(BODY.POINT)")
    given = {} if start is None else start if callable(start) else {column_name(name): ends for name, ends in start.items()}
    return _Task(tuple(inputs), low, high, observed, others, reward, terminated, bounds, step_time, steps, given, failure_reward, options)


class _Starts:
    """Starts of a task near q and qd of the model."""

    def __init__(self, model: Model, task: _Task, workspace: Workspace, q: Array, qd: Array) -> None:
        self.task, self.coordinates, self.workspace = task, model.coordinates, workspace
        self.q, self.qd = q, qd

    def begin(self, put: Callable[[Array, Array], Any], random: Any, start: Mapping[str, float] | None) -> int:
        """Puts an instance to a start that is given, or drawn until it closes the loops. Returns how many were drawn in vain."""
        names, failure = self.coordinates, None
        for draw in range(1 if start is not None else _DRAWS):
            q, qd = self.q.copy(), self.qd.copy()
            drawn = self._drawn(random) if start is None else {column_name(name): value for name, value in start.items()}
            for name, value in drawn.items():
                kind, _, coordinate = name.partition(".")
                if kind not in ("q", "qd") or coordinate not in names:
                    raise ArgumentError(unknown("start", name, [f"{each}({of})" for each in ("q", "qd") for of in names]))
                (q if kind == "q" else qd)[names.index(coordinate)] = value
            held = dict.fromkeys(name.partition(".")[2] for name in drawn)
            try:
                put(*self.workspace.close(0.0, q, qd, hold=list(held)))
                return draw
            except FailedError as error:
                failure = error
        said = "the start that is given" if start is not None else f"none of {_DRAWS} starts that were drawn"
        raise FailedError(f"{said} closes the loops: {failure}") from failure

    def _drawn(self, random: Any) -> dict[str, float]:
        start = self.task.start
        if callable(start):
            return {column_name(name): float(value) for name, value in start(random).items()}
        return {
            name: float(random.uniform(*value)) if isinstance(value, (tuple, list)) else float(value)
            for name, value in start.items()
        }


class _Group:
    """Steppers of one model, which one thread moves."""

    def __init__(self, model: Model, task: _Task, count: int) -> None:
        self.task, self.count = task, count
        system = model.system()
        self.context = system._context
        self.numbers = ffi.new("int[]", [self.context.input(name) for name in task.inputs])
        self.outputs = system.outputs(",".join((*task.observed, *task.more)))
        self.observed = len(system.outputs(",".join(task.observed)))
        first = system.stepper(t_end=task.end, **task.options)
        self.steppers: list[Stepper] = [first, *(first.copy() for _ in range(count - 1))]
        first.reset()
        self.starts = _Starts(model, task, system.workspace(), first.q, first.qd)
        self.pointers = ffi.new("kempe_stepper *[]", [each._pointer for each in self.steppers])
        self._statuses = ffi.new("int[]", count)
        self.statuses: Any = np.frombuffer(ffi.buffer(self._statuses), dtype=np.intc)

    def bind(self, t: Array, actions: Array, values: Array) -> None:
        """Takes the memory of times, actions and values, each with a row for each stepper."""
        self._struct = ffi.new(
            "python_steppers *",
            {
                "count": self.count,
                "value_count": len(self.outputs),
                "steppers": self.pointers,
                "outputs": self.outputs._pointer,
                "inputs": self.numbers,
                "actions": ffi.from_buffer(DOUBLES, actions),
                "t": ffi.from_buffer(DOUBLES, t),
                "values": writable(values, values.shape, "values"),
                "statuses": self._statuses,
                "context": self.context.pointer,
            },
        )
        self._kept = t, actions, values  # as long as the struct

    def advance(self, acting: bool, guard: bool) -> None:
        """Moves each stepper to its time, and reads its values there. FailedError and StoppedError of one are in `reason`."""
        self._struct.input_count = len(self.task.inputs) if acting else 0
        self._struct.guarded = self.context.pointer if guard else ffi.NULL
        status, message = self.context.run(lib.python_advance_steppers, self._struct)
        if status < 0:
            raise error_of(status, message)

    def reason(self, k: int) -> str:
        """Why stepper k did not reach its time, or has no outputs there; "": it did."""
        status = self.statuses[k]
        return "" if status in (lib.KEMPE_OK, lib.KEMPE_UNTRUSTED) else self.steppers[k].reason or str(error_of(status, ""))

    def begin(self, k: int, random: Any, start: Mapping[str, float] | None) -> int:
        """Puts stepper k to a start. Returns how many were drawn in vain."""
        stepper = self.steppers[k]
        stepper.reset()
        return 0 if start is None and not self.task.start else self.starts.begin(stepper.set_state, random, start)


class _Instances:
    """Instances of a task, with their numbers of steps."""

    no_lanes = ""  # why lanes do not move them

    def __init__(self, task: _Task, count: int, outputs: tuple[str, ...], observed: int) -> None:
        names = (*outputs, *task.inputs, "t")
        self.task, self.places = task, {name: k for k, name in enumerate(names)}
        self.observed = observed
        self.done = np.zeros(count, dtype=np.int64)  # steps of each episode
        self.all = np.ones(count, dtype=bool)
        self.outputs = np.zeros((count, len(outputs)))
        self.t, self.actions = np.zeros(count), np.zeros((count, len(task.inputs)))
        for name in task.bounds:
            if name not in outputs:
                raise ArgumentError(unknown("limit", name, outputs))

    def observation(self) -> Array:
        return self.outputs[:, : self.observed].copy()

    def begin(self, k: int, random: Any, options: Mapping[str, Any] | None) -> dict[str, Any]:
        vain = self._begin(k, random, None if options is None else options.get("start"))
        self.done[k] = 0
        return {"start_draws": vain + 1} if vain else {}

    def _begin(self, k: int, random: Any, start: Mapping[str, float] | None) -> int:
        """Puts instance k to a start. Returns how many were drawn in vain."""
        raise NotImplementedError

    def move(self, acting: bool) -> None:
        """Moves every instance whose time is a number; `acting`: its inputs are set."""
        try:
            self._move(acting)
        except KeyboardInterrupt as interrupt:
            raise Interrupted from interrupt

    def _move(self, acting: bool) -> None:
        raise NotImplementedError

    def _failures(self) -> dict[int, str]:
        """Of each instance whose motion ended in the last step, why."""
        raise NotImplementedError

    def close(self) -> None:
        """Ends the threads."""

    def step(self, actions: Array, moving: Any) -> tuple[Array, Any, Any, dict[int, str]]:
        """A step of the instances that move: rewards, terminated, truncated, and why instances were terminated."""
        task = self.task
        np.minimum(np.maximum(actions, task.low), task.high, out=self.actions)
        if not np.isfinite(self.actions).all():
            raise ValueError("an action is not a finite number")
        self.done += moving
        times = self.done * task.step_time
        self.t[:] = times
        self.t[~moving] = np.nan
        self.move(True)
        # Each value's numbers are next to each other: of others NumPy rounds functions in one of two ways, by their addresses.
        columns = np.ascontiguousarray(np.concatenate((self.outputs, self.actions, times[:, np.newaxis]), axis=1).T)
        values = Values(self.places, columns)
        reasons = self._failures()
        rewards = np.empty(len(times))
        rewards[:] = task.reward(values)
        if reasons:
            rewards[list(reasons)] = task.failure_reward
        reasons = self._beyond(values, moving) | reasons
        ended = np.zeros(len(times), dtype=bool)
        if task.terminated is not None:
            ended |= np.asarray(task.terminated(values), dtype=bool)
        if reasons:
            ended[list(reasons)] = True
        rewards[~moving] = 0.0
        ended &= moving
        return rewards, ended, moving & ~ended & (self.done >= task.steps), reasons

    def _beyond(self, values: Values, moving: Any) -> dict[int, str]:
        """Of each instance that has left a limit, which one."""
        return {
            int(k): f"{name} = {values[name][k]:g} is outside its limits {low:g} .. {high:g}"
            for name, (low, high) in reversed(tuple(self.task.bounds.items()))
            if not ((inside := (values[name] >= low) & (values[name] <= high)) | ~moving).all()
            for k in np.flatnonzero(moving & ~inside)
        }


class _Lanes(_Instances):
    """Instances that move in lanes."""

    def __init__(self, model: Model, task: _Task, count: int, many: EnsembleStepper) -> None:
        system = model.system()
        super().__init__(task, count, many.names, len(system.outputs(",".join(task.observed))))
        self.many = many
        many.begin(0)
        self.starts = _Starts(model, task, system.workspace(), many.q[0], many.qd[0])

    def _begin(self, k: int, random: Any, start: Mapping[str, float] | None) -> int:
        if start is not None or self.task.start:
            return self.starts.begin(partial(self.many.begin, k), random, start)
        self.many.begin(k)
        return 0

    def _move(self, acting: bool) -> None:
        if acting:
            self.many.advance(self.t, self.task.inputs, self.actions, self.outputs)
        else:
            self.many.advance(self.t, out=self.outputs)

    def _failures(self) -> dict[int, str]:
        if self.many.ended == 0:
            return {}
        return {int(k): reason for k in np.flatnonzero(~np.isnan(self.t)) if (reason := self.many.reason(int(k)))}


class _Steppers(_Instances):
    """Instances in groups of steppers, each of which a thread moves."""

    def __init__(self, model: Model, task: _Task, count: int, threads: int, no_lanes: str) -> None:
        ends = [count * k // threads for k in range(threads + 1)]
        recipe = model.__reduce__()
        models = [model, *(recipe[0](*recipe[1]) for _ in range(threads - 1))]  # a context for each thread
        self.parts = [slice(*pair) for pair in zip(ends, ends[1:])]
        self.groups = [_Group(each, task, part.stop - part.start) for each, part in zip(models, self.parts)]
        super().__init__(task, count, self.groups[0].outputs.names, self.groups[0].observed)
        for group, part in zip(self.groups, self.parts):
            group.bind(self.t[part], self.actions[part], self.outputs[part])
        self.pool: Any = None
        self.no_lanes = no_lanes

    def place(self, k: int) -> tuple[_Group, int]:
        """The group of instance k, and its number there."""
        for group, part in zip(self.groups, self.parts):
            if k < part.stop:
                return group, k - part.start
        raise IndexError(k)

    def _begin(self, k: int, random: Any, start: Mapping[str, float] | None) -> int:
        group, number = self.place(k)
        return group.begin(number, random, start)

    def _move(self, acting: bool) -> None:
        if len(self.groups) == 1:
            self.groups[0].advance(acting, interruptible())
        else:
            self._in_threads(acting)

    def _in_threads(self, acting: bool) -> None:
        from concurrent.futures import ThreadPoolExecutor

        if self.pool is None:
            self.pool = ThreadPoolExecutor(len(self.groups))
        waiting = [self.pool.submit(group.advance, acting, False) for group in self.groups]
        try:
            for each in waiting:
                each.result()
        except BaseException:
            for group in self.groups:
                lib.kempe_context_interrupt(group.context.pointer)
            for each in waiting:
                each.exception()
            for group in self.groups:
                lib.kempe_context_clear_interrupt(group.context.pointer)  # which no thread may have seen
            raise

    def _failures(self) -> dict[int, str]:
        """Of each instance whose motion ended in the last step, why."""
        return {
            part.start + int(k): reason
            for group, part in zip(self.groups, self.parts)
            for k in np.flatnonzero(group.statuses)
            if (reason := group.reason(int(k)))
        }

    def close(self) -> None:
        if self.pool is not None:
            self.pool.shutdown()
            self.pool = None


class Environment(Env):  # type: ignore[misc]
    """A mechanism as an environment of Gymnasium (`gymnasium.Env`). An action sets inputs of the model, which are constant during a step.

    `inputs`: the inputs of the model with their limits in SI, the action space; actions beyond them are the limits.
    `reward`: a function of the `Values` after a step, arrays with a value for each instance (here one).
    `step_time`, `horizon` (s): of a step, and of an episode, which is then truncated.
    `observation`: words of outputs; `more`: further outputs, which only the functions see.
    `limits`: of outputs, by name; `terminated`: a function of the values. Both end an episode.
    `start`: (low, high) of "q(NAME)" and "qd(NAME)", drawn uniformly, or a function of a NumPy generator that returns numbers by these
    names. Coordinates that have a value keep it to rounding, the others close the loops; a start that cannot close them is drawn again.
    Further keywords are options of `System.stepper`, as rtol.

    A motion that cannot continue, such as one at a singular position, is terminated: `info["reason"]` says why, the observation
    is of the last state, and the reward is `failure_reward`. Equal seeds give equal bits. `reset(options={"start": {"q(phi)": 0.1}})`
    starts at given values.

    Raises ArgumentError if an argument is empty, outside its range or names what the model does not have. Raises TypeError if there is
    no such option. Raises FailedError if the run cannot start. Raises ImportError if Gymnasium is not installed.

    >>> from kempe.gymnasium import Environment  # with gymnasium
    >>> cart = kempe.Model("cart_pole.yaml")
    >>> upright = lambda values: 1 - values["q(phi)"] ** 2
    >>> task = {"step_time": 0.02, "horizon": 4, "start": {"q(phi)": (-0.1, 0.1)}, "limits": {"q(phi)": (-0.5, 0.5)}}
    >>> env = Environment(cart, {"u": (-20, 20)}, upright, **task)  # with gymnasium
    >>> observation, info = env.reset(seed=1)  # with gymnasium
    >>> observation, reward, terminated, truncated, info = env.step([1.5])  # with gymnasium
    >>> observation.shape, terminated, truncated  # with gymnasium
    ((4,), False, False)
    """

    metadata: dict[str, Any] = {"render_modes": []}
    render_mode: str | None = None

    def __init__(
        self,
        model: Model,
        inputs: Mapping[str, Limits],
        reward: Callable[[Values], Any],
        **options: Unpack[TaskOptions],
    ) -> None:
        task = _task(inputs, reward, **options)
        self._instances: _Instances = _Steppers(model, task, 1, 1, "")
        self.observation_space: Any = _space(self._instances.observed)
        self.action_space: Any = Box(task.low, task.high, dtype=np.float64)
        self._running, self._name = False, model.name

    def reset(self, *, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """The first observation of another episode, and information.

        Raises FailedError if no start closes the loops. Raises ArgumentError if a start has an unknown name."""
        super().reset(seed=seed)
        self._running = False
        info = self._instances.begin(0, self.np_random, options)
        self._instances.t[0] = 0.0
        self._instances.move(False)
        self._running = True
        return self._instances.observation()[0], info

    def step(self, action: Any) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Observation, reward, terminated, truncated and information after a step with an action (in SI).

        Raises ResetNeeded if the episode has ended. Raises ValueError if the action has another length or is not finite. Raises
        TypeError if its entries are not numbers. Raises Interrupted if Ctrl-C ends the step."""
        if not self._running:
            raise ResetNeeded("the episode has ended: call reset first")
        self._running = False  # unless the step is complete
        given = matched(action, len(self._instances.task.inputs), "action")[np.newaxis]
        rewards, ended, cut, reasons = self._instances.step(given, self._instances.all)
        self._running = not (ended[0] or cut[0])
        info = {"reason": reasons[0]} if reasons else {}
        return self._instances.observation()[0], float(rewards[0]), bool(ended[0]), bool(cut[0]), info

    def __repr__(self) -> str:
        return f"<Environment {self._name!r}: {_described(self._instances)}>"

    __str__ = __repr__


class VectorEnvironment(VectorEnv):  # type: ignore[misc]
    """Many instances of an `Environment` that take their steps together (`gymnasium.vector.VectorEnv`). They are as single ones
    whose seeds are seed, seed + 1, ..: the results of an instance depend neither on the others nor on `threads` (0: one for each
    processor, with at least 64 instances each).

    Motions run in lanes of a vector register, several at a time, and agree with the motions of an Environment to the tolerance. With
    `lanes` False, or where lanes cannot run the model, each instance has a stepper and the bits of an Environment. `no_lanes` says why
    they do not run in lanes, "" if they do.

    An instance that has ended begins another episode in the next step, whose action has no effect and whose reward is zero
    (`AutoresetMode.NEXT_STEP`). `infos["reason"]` says why instances were terminated, where `infos["_reason"]` is true.

    Raises ArgumentError if an argument is empty, outside its range or names what the model does not have. Raises TypeError if there is
    no such option. Raises FailedError if the run cannot start. Raises ImportError if Gymnasium is not installed.

    >>> from kempe.gymnasium import VectorEnvironment  # with gymnasium
    >>> cart = kempe.Model("cart_pole.yaml")
    >>> task = {"step_time": 0.02, "horizon": 4, "start": {"q(phi)": (-0.1, 0.1)}}
    >>> envs = VectorEnvironment(cart, 8, {"u": (-20, 20)}, lambda values: -abs(values["q(phi)"]), **task)  # with gymnasium
    >>> observations, infos = envs.reset(seed=1)  # with gymnasium
    >>> observations, rewards, terminated, truncated, infos = envs.step([[1.5]] * 8)  # with gymnasium
    >>> observations.shape, rewards.shape  # with gymnasium
    ((8, 4), (8,))
    """

    render_mode: str | None = None

    def __init__(  # type: ignore[misc]
        self,
        model: Model,
        count: int,
        inputs: Mapping[str, Limits],
        reward: Callable[[Values], Any],
        *,
        threads: int = 0,
        lanes: bool = True,
        **options: Unpack[TaskOptions],
    ) -> None:
        task = _task(inputs, reward, **options)
        if count < 1 or threads < 0:
            raise ArgumentError(f"at least one instance is needed, and no negative number of threads, not {count} and {threads}")
        self.metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}
        self.num_envs: int = count
        self._instances = _made(model, task, count, min(threads or max(1, min(processors(), count // _LEAST)), count), lanes)
        self.no_lanes: str = self._instances.no_lanes
        self.single_observation_space: Any = _space(self._instances.observed)
        self.single_action_space: Any = Box(task.low, task.high, dtype=np.float64)
        self.observation_space: Any = batch_space(self.single_observation_space, count)
        self.action_space: Any = batch_space(self.single_action_space, count)
        self._randoms: list[Any] = [None] * count
        self._over = np.zeros(count, dtype=bool)
        self._running, self._name = False, model.name

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """The first observations of all instances, and information. A `seed` is of the first instance, the others have the
        numbers after it. `options`: as of Environment, and "reset_mask", which instances begin again.

        Raises FailedError if no start closes the loops. Raises ArgumentError if a start has an unknown name. Raises ValueError if
        `seed` or reset_mask do not have a value for each instance. Raises ResetNeeded if only some of the instances would begin at the
        first call."""
        given = dict(options or {})
        mask = np.asarray(given.pop("reset_mask", np.ones(self.num_envs, dtype=bool)))
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ValueError(f"reset_mask has a truth value for each of {self.num_envs} instances, and one is true")
        if not mask.all() and not self._running:
            raise ResetNeeded("only some of the instances would begin: call reset without reset_mask first")
        seeds = self._seeds(seed)
        self._running = False
        infos = self._begin(np.flatnonzero(mask), seeds, given)
        self._over[mask] = False
        self._running = True
        return self._instances.observation(), infos

    def _seeds(self, seed: Any) -> Sequence[int | None]:
        if seed is None or isinstance(seed, (int, np.integer)):
            return [None if seed is None else int(seed) + k for k in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"there are {self.num_envs} instances and {len(seed)} seeds")
        return list(seed)

    def _begin(self, which: Any, seeds: Sequence[int | None], options: Mapping[str, Any]) -> dict[str, Any]:
        from gymnasium.utils.seeding import np_random

        infos: dict[str, Any] = {}
        for k in which:
            if seeds[k] is not None or self._randoms[k] is None:
                self._randoms[k] = np_random(seeds[k])[0]
            infos = self._add_info(infos, self._instances.begin(int(k), self._randoms[k], options), int(k))
        self._instances.t[:] = np.nan
        self._instances.t[which] = 0.0
        self._instances.move(False)
        return infos

    def step(self, actions: Any) -> tuple[Array, Array, Any, Any, dict[str, Any]]:
        """Observations (N x k), rewards (N), terminated (N), truncated (N) and information after a step with actions (N x inputs).

        Raises ResetNeeded if no episode has begun. Raises ValueError if actions have another shape or are not finite. Raises
        Interrupted if Ctrl-C ends the step."""
        if not self._running:
            raise ResetNeeded("no episode has begun: call reset first")
        instances, shape = self._instances, (self.num_envs, len(self._instances.task.inputs))
        given = np.ascontiguousarray(actions, dtype=float)
        if given.shape != shape:
            raise ValueError(f"actions have the shape {shape}, not {given.shape}")
        self._running = False  # unless the step is complete
        again = np.flatnonzero(self._over)
        rewards, ended, cut, reasons = instances.step(given, ~self._over)
        infos: dict[str, Any] = {}
        for k, reason in reasons.items():
            infos = self._add_info(infos, {"reason": reason}, k)
        if len(again):
            infos |= self._begin(again, [None] * self.num_envs, {})
        self._over = ended | cut
        self._running = True
        return instances.observation(), rewards, ended, cut, infos

    def close_extras(self, **kwargs: Any) -> None:
        """Ends the threads."""
        self._instances.close()

    def __repr__(self) -> str:
        way = f"by steppers ({self.no_lanes})" if self.no_lanes else "in lanes"
        return f"<VectorEnvironment {self._name!r}: {self.num_envs} instances {way}, {_described(self._instances)}>"


def _made(model: Model, task: _Task, count: int, threads: int, lanes: bool) -> _Instances:
    """Instances in lanes, if these are wanted and can run the model."""
    if not lanes:
        return _Steppers(model, task, count, threads, "lanes=False")
    given: Any = {**task.options, "t_end": task.end, "threads": threads}
    many = model.ensemble_stepper(count, (*task.observed, *task.more), **given)
    return _Steppers(model, task, count, threads, many.no_lanes) if many.no_lanes else _Lanes(model, task, count, many)


def _space(count: int) -> Any:
    return Box(-np.inf, np.inf, (count,), dtype=np.float64)


def _described(instances: _Instances) -> str:
    task = instances.task
    return f"inputs {', '.join(task.inputs)}, {instances.observed} observations, steps of {task.step_time:g} s to {task.steps * task.step_time:g} s"


def _list_arguments(owner: type[Any]) -> None:
    """Puts the keywords of `_task` in place of **options in the signature of an environment."""
    own, task = inspect.signature(owner.__init__), inspect.signature(_task).parameters
    kept = [each for each in own.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
    added = [each for name, each in task.items() if name not in own.parameters or name == "options"]
    first = next((k for k, each in enumerate(kept) if each.kind is inspect.Parameter.KEYWORD_ONLY), len(kept))
    owner.__init__.__signature__ = own.replace(parameters=[*kept[:first], *added[:-1], *kept[first:], added[-1]])


_task.__qualname__ = "Environment"  # of its errors about missing arguments
_list_arguments(Environment)
_list_arguments(VectorEnvironment)
