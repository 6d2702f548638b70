# SPDX-License-Identifier: BSD-3-Clause
"""Contexts of the library, and objects that belong to one. Each model has its context, with a lock: Python
objects may be used in any thread, and calls on one model happen one after another. An object of the library is freed once,
after all that was made from it."""

from __future__ import annotations

import contextlib
import functools
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from ._native import ffi, lib
from .errors import ArgumentError, Interrupted, KempeWarning, error_of, in_python
from .options import unknown, utf8
from .progress import Progress, ProgressTo, shown

if TYPE_CHECKING:
    import logging
    import pathlib

NULL = ffi.NULL
_INFO = 20  # logging.INFO
_getsignal: Any = sys.modules.get("_signal", signal).getsignal  # the function of the module signal searches for an enum
_main_thread = threading.main_thread().ident
T = TypeVar("T", bound="Owned")


def string(text: Any) -> str:
    """A C string; "" for NULL."""
    return "" if text == NULL else str(ffi.string(text).decode())


def outcome(number: int) -> str:
    """The word of an outcome."""
    return string(lib.kempe_outcome_text(number))


def constant(group: str, name: str) -> int:
    """A constant of the library, KEMPE_GROUP_NAME."""
    prefix = f"KEMPE_{group}_"
    try:
        return int(getattr(lib, prefix + name.upper()))
    except AttributeError:
        known = [each.removeprefix(prefix).lower() for each in dir(lib) if each.startswith(prefix)]
        raise ArgumentError(unknown(group.lower(), name, known)) from None


def interruptible() -> bool:
    """KeyboardInterrupt would be raised in this thread."""
    return threading.get_ident() == _main_thread and _getsignal(signal.SIGINT) is signal.default_int_handler


def text_written(write: Callable[[pathlib.Path], None], name: str) -> str:
    """The text that a function writes into a file of this name."""
    import pathlib
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / name
        write(path)
        return path.read_text()


class Listener:
    """Receives lines of the library's log, and failures of callbacks. The context refers to it by a handle."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self.failure: BaseException | None = None
        self.progress: Callable[[str], object] | None = None  # lines of the log
        self.count: Callable[[Progress], object] | None = None

    def receive(self, level: int, line: Any) -> None:
        if level == lib.KEMPE_LOG_WARNING:
            self.warnings.append(string(line))
        elif level == lib.KEMPE_LOG_PROGRESS:
            if self.progress is not None:
                self.progress(string(line))
        else:
            _logger().info(string(line))


@functools.cache
def _logger() -> logging.Logger:
    import logging

    return logging.getLogger("kempe")


class Context:
    """Messages, interrupts and lock of one model and of everything that is made from it."""

    def __init__(self) -> None:
        self.pointer: Any = ffi.gc(lib.kempe_context_new(), lib.kempe_context_free)
        if self.pointer == NULL:
            raise MemoryError("no memory for a context")
        self.lock: threading.RLock = threading.RLock()
        self.listener: Listener = Listener()
        self.waiting: list[tuple[Release, Any]] = []
        self.coordinates: tuple[str, ...] = ()  # names, once the model is read
        self.rows: tuple[str, ...] = ()  # of the closures, once a system is derived
        self.inputs: dict[str, str] = {}  # and their units
        self.texts: set[str] = set()  # names of texts that are read in place of files
        self._handle = ffi.new_handle((self.pointer, self.listener))
        lib.python_listen(self.pointer, self._handle)

    def on_count(self, receive: Callable[[Progress], object] | None, interval: float = 0.1) -> None:
        """Calls a function about every `interval` seconds of long computations. None: no more."""
        self.listener.count = receive
        callback = NULL if receive is None else lib.python_progress
        lib.kempe_context_set_progress(self.pointer, interval, callback, self._handle)

    @contextlib.contextmanager
    def reporting(self, progress: ProgressTo | None) -> Iterator[None]:
        """Progress of the computations inside goes to a function, or is shown if True. None: as the model has it."""
        if progress is None:
            yield
            return
        if not isinstance(progress, bool) and not callable(progress):
            raise TypeError(f"progress is True or a function, not {type(progress).__name__}")
        bars = shown() if progress is True else None
        with self.lock:
            before = self.listener.count
            self.on_count(bars or progress or None)  # type: ignore[arg-type]
            try:
                yield
            finally:
                self.on_count(before)
                if bars:
                    bars.close()

    def message(self) -> str:
        return in_python(string(lib.kempe_context_message(self.pointer)), self.texts)

    def set_text(self, name: str, text: str | None) -> None:
        """A text that is read in place of a file of this name; None: no longer."""
        self.check(lib.kempe_context_set_text, self.pointer, utf8(name), NULL if text is None else utf8(text))
        self.texts = {*self.texts, name} if text is not None else self.texts - {name}

    def input(self, name: str) -> int:
        """The number of an input."""
        if name not in self.inputs:
            raise ArgumentError(unknown("input", name, self.inputs))
        return list(self.inputs).index(name)

    def run(self, function: Any, *arguments: Any) -> tuple[int, str]:
        """Status and message of a computation. Failures of callbacks are raised, warnings are issued."""
        listener = self.listener
        with self.lock:
            status = function(*arguments)
            message = self.message() if status else ""
            failure, listener.failure = listener.failure, None
            lines, listener.warnings = listener.warnings, []
            self.free_waiting()
        if failure is not None:
            lib.kempe_context_clear_interrupt(self.pointer)
            raise failure
        for line in lines:
            warnings.warn(in_python(line, self.texts), KempeWarning, level_of_caller())
        return status, message

    def guarded(self, function: Any, *arguments: Any) -> tuple[int, str]:
        """As run, for a guarded form of a function: SIGINT ends the computation."""
        lib.python_want_notes(_logger().isEnabledFor(_INFO))
        return self.run(function, self.pointer if interruptible() else NULL, *arguments)

    def check(self, function: Any, *arguments: Any) -> None:
        """Runs a function that gives its result, or whose status is an error."""
        self.refuse(*self.run(function, *arguments))

    def refuse(self, status: int, message: str) -> None:
        if status not in (lib.KEMPE_OK, lib.KEMPE_UNTRUSTED):
            raise error_of(status, message)

    def make(self, kind: type[T], function: Any, *arguments: Any, owners: tuple[Any, ...] = (), long: bool = True) -> T:
        """The object that a function gives by its last argument. If it fails, the error nevertheless has the object that it gives."""
        out = ffi.new(f"kempe_{kind._noun} **")
        try:
            status, message = (self.guarded if long else self.run)(function, *arguments, out)
        except KeyboardInterrupt as interrupt:
            raise Interrupted(self._own(kind, out[0], owners)) from interrupt
        except BaseException:  # of a callback, or a warning that is an error
            self._own(kind, out[0], owners)  # which frees it
            raise
        made = self._own(kind, out[0], owners)
        if status < 0 or made is None:
            raise error_of(status, message, made)
        return made

    def _own(self, kind: type[T], pointer: Any, owners: tuple[Any, ...]) -> T | None:
        if pointer == NULL:
            return None
        made = kind.__new__(kind)
        made._context = self
        made._pointer = ffi.gc(pointer, Release(self, getattr(lib, f"kempe_{kind._noun}_free"), owners))
        made._made()
        made._begun = True
        return made

    def text(self, function: Any, *arguments: Any) -> str:
        """The text that a function gives by its last argument."""
        out = ffi.new("char **")
        self.check(function, *arguments, out)
        try:
            return string(out[0])
        finally:
            lib.kempe_text_free(out[0])

    def free(self, release: Release, pointer: Any) -> None:
        """Frees an object at once, or after the computation that is running in another thread."""
        self.waiting.append((release, pointer))
        if self.lock.acquire(blocking=False):
            try:
                self.free_waiting()
            finally:
                self.lock.release()

    def free_waiting(self) -> None:
        while self.waiting:
            release, pointer = self.waiting.pop()
            release.function(pointer)


class Release:
    """Frees an object of the library; what it was made from lives until then."""

    __slots__ = ("context", "function", "owners")

    def __init__(self, context: Context, function: Any, owners: tuple[Any, ...]) -> None:
        self.context: Context = context
        self.function: Any = function
        self.owners: tuple[Any, ...] = owners

    def __call__(self, pointer: Any) -> None:
        self.context.free(self, pointer)


class Owned:
    """An object of the library. `_noun` is its name in C: kempe_NOUN, kempe_NOUN_free."""

    _noun: ClassVar[str]
    _begun: bool
    _options: ClassVar[str] = ""  # name of its struct of options, where that is not kempe_NOUN_options
    _maker: ClassVar[str] = ""  # function that makes it from options, where that is not guarded_kempe_NOUN_new
    _context: Context
    _pointer: Any

    def __init__(self) -> None:
        raise TypeError(f"{type(self).__name__} is made by a method of a model or system")

    def _made(self) -> None:
        """Called once the object exists."""

    def _owners(self) -> tuple[Any, ...]:
        """Objects that must live as long as one that is made of this one."""
        return (self._pointer,)

    def __reduce__(self) -> Any:
        raise TypeError(f"a {type(self).__name__} cannot be pickled or copied; models, systems, tables and results can")


class Fixed(Owned):
    """An object of the library that never changes: a copy is the object itself."""

    _begun = False  # a name without _ is set only while it is made

    def __setattr__(self, name: str, value: Any) -> None:
        if name[0] != "_" and self._begun:
            raise AttributeError(f"a {type(self).__name__} never changes: '{name}' cannot be set{self._instead(name)}")
        object.__setattr__(self, name, value)

    def _instead(self, name: str) -> str:
        """The end of the sentence: the call that is meant in place of setting an attribute."""
        return ""

    def __copy__(self: T) -> T:
        return self

    def __deepcopy__(self: T, memo: object) -> T:
        return self


def level_of_caller() -> int:
    """Stack level of the first frame outside the package, as seen from the function that calls this."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("kempe."):
        level, frame = level + 1, frame.f_back
    return level


def failed(kind: type[BaseException], failure: BaseException, traceback: TracebackType) -> None:
    """Keeps the exception of a callback and ends the computation; Context.run raises it. KeyboardInterrupt may be raised before
    the first line of a callback, so that a try statement within it is not enough."""
    pointer, listener = ffi.from_handle(traceback.tb_frame.f_locals["user"])[:2]
    if listener.failure is None:
        listener.failure = failure
    lib.kempe_context_interrupt(pointer)


@ffi.def_extern(onerror=failed)
def python_progress(user: Any, progress: Any) -> None:
    count = ffi.from_handle(user)[1].count
    left = progress.left_s if progress.left_s >= 0 else None
    if count is not None:
        count(Progress(progress.done, progress.total, string(progress.unit), progress.elapsed_s, left))


@ffi.def_extern(onerror=failed)
def python_log(user: Any, level: int, line: Any) -> None:
    ffi.from_handle(user)[1].receive(level, line)
