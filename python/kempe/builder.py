# SPDX-License-Identifier: BSD-3-Clause
"""A model built in code instead of read from a file."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

from ._native import ffi, lib
from .context import Context, Release
from .model import Model
from .options import entry_of, number, options, utf8

Number = float | str  # in SI, or an expression of parameters
Method = TypeVar("Method", bound=Callable[..., "Builder"])


def recorded(method: Method) -> Method:
    """The method, with a record of its calls: a model that was built is pickled as them."""

    @functools.wraps(method)
    def call(builder: Builder, /, *arguments: Any, **keywords: Any) -> Builder:
        method(builder, *arguments, **keywords)
        builder._calls.append((method.__name__, arguments, keywords))
        return builder

    return cast(Method, call)


class Builder:
    """Adds bodies, joints and forces in any order, then `finish()` gives the model. Numbers are in SI, or expressions of the
    model's parameters as text. Methods return the builder.

    Raises TypeError if the name is not a text.

    >>> pendulum = Builder("pendulum").gravity(0, -9.81, 0).parameter("L", 2)
    >>> _ = pendulum.body("arm", mass=3, com=("L/2", 0, 0), inertia=(0, 0, 1, 0, 0, 0)).q("arm", 0.5)
    >>> pendulum.finish()
    <Model 'pendulum': coordinates arm>
    """

    def __init__(self, name: str) -> None:
        self._context = Context()
        self._name = name
        self._calls: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = []
        out = ffi.new("kempe_model **")
        self._context.check(lib.kempe_model_new, self._context.pointer, utf8(name), out)
        self._pointer = ffi.gc(out[0], Release(self._context, lib.kempe_model_free, ()))

    def __repr__(self) -> str:
        return f"<Builder {self._name!r}: {len(self._calls)} calls>"

    def _call(self, function: Any, *arguments: Any) -> Builder:
        self._context.check(function, self._pointer, *arguments)
        return self

    def _numbers(
        self, function: Any, *arguments: Any, numbers: tuple[Number, ...], more: tuple[Any, ...] = ()
    ) -> Builder:
        keep: list[Any] = []
        return self._call(function, *arguments, *(number(each, keep) for each in numbers), *more)

    def _add(self, what: str, name: str, members: dict[str, Any], key: str = "name") -> Builder:
        start = getattr(lib, f"kempe_{what}_default")(ffi.new("char[]", utf8(name)))
        struct, keep = options(f"kempe_{what}_def", {key: name, **members}, start=start)
        self._call(getattr(lib, f"kempe_model_add_{what}"), struct)
        del keep
        return self

    @recorded
    def gravity(self, x: Number, y: Number, z: Number) -> Builder:
        """Gravity in m/s^2, in the axes of the ground.

        Raises ArgumentError if the builder has finished. Raises TypeError if a value is neither a number nor a text."""
        return self._numbers(lib.kempe_model_set_gravity, numbers=(x, y, z))

    @recorded
    def parameter(self, name: str, value: Number) -> Builder:
        """A parameter and its value in SI, or an expression.

        Raises ArgumentError if the name is missing or taken, or the builder has finished. Raises TypeError if the value is neither a
        number nor a text."""
        return self._numbers(lib.kempe_model_add_parameter, utf8(name), numbers=(value,))

    @recorded
    def body(self, name: str, **members: Any) -> Builder:
        """A body: at, joint, kind, axis (3), motions, mass, com (3), inertia (xx yy zz xy xz yz).

        Raises ArgumentError if the name is missing or taken or the builder has finished. Raises TypeError if there is no such member or
        a value has another type. Raises ValueError if it has another length. `finish` checks the rest."""
        return self._add("body", name, members)

    @recorded
    def point(self, body: str, name: str, x: Number, y: Number, z: Number) -> Builder:
        """A point of a body or of the "ground".

        Raises ArgumentError if a name is missing, the point exists, or the builder has finished. Raises TypeError if a place is neither
        a number nor a text."""
        return self._numbers(lib.kempe_model_add_point, utf8(body), utf8(name), numbers=(x, y, z))

    @recorded
    def joint(self, name: str, **members: Any) -> Builder:
        """A joint between two bodies: kind, point (2), axis (3), pitch, cut.

        Raises ArgumentError if the name is missing or taken or the builder has finished. Raises TypeError if there is no such member or
        a value has another type. Raises ValueError if it has another length. `finish` checks the rest."""
        return self._add("joint", name, members)

    @recorded
    def closure(self, name: str, **members: Any) -> Builder:
        """A closure between two points: kind, point (2), length.

        Raises ArgumentError if the name is missing or taken or the builder has finished. Raises TypeError if there is no such member or
        a value has another type. Raises ValueError if it has another length. `finish` checks the rest."""
        return self._add("closure", name, members)

    @recorded
    def force(self, name: str, **members: Any) -> Builder:
        """A force: joint with torque or force, or spring (2) with stiffness, damping, free_length.

        Raises ArgumentError if the name is missing or taken or the builder has finished. Raises TypeError if there is no such member or
        a value has another type. Raises ValueError if it has another length. `finish` checks the rest."""
        return self._add("force", name, members)

    @recorded
    def shape(self, body: str, **members: Any) -> Builder:
        """A shape of a body or of the "ground": kind with dimensions (3) or between (2), radius, file, scale, point or at (3), axis (3),
        density or mass, hole, colour, opacity; or text.

        Raises ArgumentError if the name is missing or taken or the builder has finished. Raises TypeError if there is no such member or
        a value has another type. Raises ValueError if it has another length. `finish` checks the rest."""
        return self._add("shape", body, members, "body")

    @recorded
    def text(self, section: str, name: str, entry: Any) -> Builder:
        """Any other entry of the model language, as text, number, list or dict.

        Raises InputError if the entry is not of the model language. Raises ArgumentError if the builder has finished. Raises TypeError
        if the entry has another type. Raises ValueError if a number in it is not finite.

        >>> tank = Builder("tank").text("states", "p", {"start": "2 MPa", "rate": "-p/(3 s)"}).text("run", "t_end", 5)
        >>> tank = tank.body("lid", joint="x", kind="prismatic", axis=(0, 0, 1), mass=4)
        >>> tank.text("forces", "seal", {"joint": "x", "friction": {"force": 30, "static": 50}}).finish().states
        ('p',)
        """
        return self._call(lib.kempe_model_add_text, utf8(section), utf8(name), utf8(entry_of(entry)))

    @recorded
    def q(self, coordinate: str, value: Number, hold: bool = False) -> Builder:
        """Guess of a coordinate for the assembly; `hold`: it keeps this value.

        Raises ArgumentError if the name is missing or the builder has finished. Raises TypeError if the value is neither a number nor a
        text."""
        return self._numbers(lib.kempe_model_set_q, utf8(coordinate), numbers=(value,), more=(int(hold),))

    @recorded
    def qd(self, coordinate: str, value: Number) -> Builder:
        """Rate of a coordinate at the start.

        Raises ArgumentError if the name is missing or the builder has finished. Raises TypeError if the value is neither a number nor a
        text."""
        return self._numbers(lib.kempe_model_set_qd, utf8(coordinate), numbers=(value,))

    def finish(self) -> Model:
        """Checks and freezes the model.

        Raises InputError if the model is wrong; the message has every mistake, and the builder may then be continued. Raises
        ArgumentError if the builder has finished."""
        self._call(lib.kempe_model_finish)
        return Model._of(self._context, self._pointer, (_build_again, (self._name, list(self._calls))))


def _build_again(name: str, calls: list[tuple[str, tuple[Any, ...], dict[str, Any]]]) -> Model:
    builder = Builder(name)
    for method, arguments, keywords in calls:
        getattr(builder, method)(*arguments, **keywords)
    return builder.finish()
