# SPDX-License-Identifier: BSD-3-Clause
"""Result folders by the processes of an executor: concurrent.futures, dask.distributed, mpi4py.futures and the like."""

from __future__ import annotations

import os
import threading
import time
import uuid
import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from .errors import ArgumentError, Error, FailedError, InputError, KempeWarning, StoppedError
from .progress import Progress, ProgressTo, shown

if TYPE_CHECKING:
    from .ensemble import Ensemble, Folder

SHARDS = (
    64  # of a folder, where their number is not given: enough to balance unequal processes, few enough for their overhead
)


class Executor(Protocol):
    """An object that submits calls: `submit(function, *arguments)` gives an object with `result()`."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Any: ...


# -- once in a process ------------------------------------------------------------------------------------

_MOST = 8  # objects that a process keeps, the oldest leave first
_kept: dict[str, Any] = {}
_lock = threading.Lock()


def once(key: str, make: Callable[[], Any]) -> Any:
    """An object that is read from a pickle: made at the first time in this process, and kept for the next ones."""
    with _lock:
        if key not in _kept:
            made = make()
            while len(_kept) >= _MOST:
                del _kept[next(iter(_kept))]
            _kept[key] = made
        return _kept[key]


# -- shards -----------------------------------------------------------------------------------------------


def run_shard(
    ensemble: Ensemble, path: str, lanes: int, chunk: int | None, shard: str, options: Mapping[str, Any], token: str
) -> dict[str, Any]:
    """One share of the parts: counts of its run, and "failure", a sentence where no instance reached its end. `token` makes
    calls differ: some engines give the answer of an equal call again."""
    failure = ""
    try:
        folder = ensemble.run_folder(path, lanes, chunk, shard=shard, **options)
    except FailedError as error:
        if error.partial is None:
            raise
        folder, failure = error.partial, error.message
    return {**folder.to_dict()["run"], "failure": failure, "process": os.getpid()}


class Meter:
    """Progress by shares that have ended."""

    def __init__(self, progress: ProgressTo | None, total: int) -> None:
        if progress is not None and not isinstance(progress, bool) and not callable(progress):
            raise TypeError(f"progress is True or a function, not {type(progress).__name__}")
        self.bars = shown() if progress is True else None
        self.receive: Callable[[Progress], object] | None = self.bars or (progress if callable(progress) else None)
        self.total, self.done, self.began = total, 0, time.monotonic()

    def count(self) -> None:
        self.done += 1
        if self.receive is not None:
            elapsed = time.monotonic() - self.began
            left = elapsed * (self.total - self.done) / self.done
            self.receive(Progress(self.done, self.total, "shards", elapsed, left))

    def close(self) -> None:
        if self.bars:
            self.bars.close()


def run_shards(
    ensemble: Ensemble,
    path: str | os.PathLike[str],
    lanes: int,
    chunk: int | None,
    resume: bool,
    executor: Executor,
    shards: int,
    options: Mapping[str, Any],
) -> Folder:
    """Submits the shares of a folder and waits for all of them."""
    if not callable(getattr(executor, "submit", None)):
        raise TypeError(f"an executor has a method submit(function, *arguments); {type(executor).__name__} has none")
    if shards < 0:
        raise ArgumentError(f"the number of shards is {shards}; it cannot be negative")
    place, count, token = os.path.abspath(os.fsdecode(path)), shards or SHARDS, uuid.uuid4().hex
    if not resume and os.path.exists(os.path.join(place, "manifest.json")):
        raise InputError(
            f"{place}: the folder has results: resume=True runs what is missing; give another folder to begin again"
        )
    given = {"threads": 1, **options}
    meter = Meter(given.pop("progress", None), count)
    futures: list[Any] = []
    counts: list[dict[str, Any]] = []
    failures: list[Exception] = []
    try:
        for k in range(count):
            try:
                shard = f"{k + 1}/{count}"
                futures.append(executor.submit(run_shard, ensemble, place, lanes, chunk, shard, given, token))
            except RuntimeError as error:  # the executor has broken down
                failures += [error] * (count - k)
                break
        for future in futures:
            try:
                counts.append(future.result())
            except Exception as error:  # of the share, or of its process
                failures.append(error)
            meter.count()
    except BaseException:
        for future in futures:
            getattr(future, "cancel", bool)()
        raise
    finally:
        meter.close()
    return _outcome(place, counts, failures, count)


def _outcome(place: str, counts: list[dict[str, Any]], failures: list[Exception], shards: int) -> Folder:
    """The folder with all that its processes have made; warnings and failures belong to the whole."""
    from .ensemble import Folder

    _warn([each for each in counts if each["process"] != os.getpid()])
    if failures:
        raise _loss(place, failures, shards) from failures[0]
    folder = Folder.open(place)
    ran = sum(each["instances"] for each in counts)
    if ran and ran == sum(each["failed"] for each in counts):
        raise FailedError(next(each["failure"] for each in counts if each["failure"]), folder)
    return folder


def _warn(counts: list[dict[str, Any]]) -> None:
    """The warning that processes elsewhere gave there."""
    doubtful = sum(each["not_converged"] for each in counts)
    if doubtful:
        warnings.warn(
            f"do not trust {doubtful} of {sum(each['instances'] for each in counts)} instances: they differ at another rtol "
            "(column verdict); use a smaller rtol",
            KempeWarning,
            stacklevel=5,
        )


def _loss(place: str, failures: list[Exception], shards: int) -> Error:
    """The error of shares that were lost: which parts are missing, and how to run them."""
    from .ensemble import Folder

    first = failures[0]
    if isinstance(first, Error) and not isinstance(first, StoppedError):  # a sentence of the library
        return first
    told = f"{len(failures)} of {shards} shards did not end; the first one: {type(first).__name__}: {first}"
    try:
        folder = Folder.open(place)
    except Error:
        return FailedError(f"{told}\nno part was made; run_folder again, with resume=True, runs all of them")
    try:
        folder.check()
    except FailedError as error:
        missing = error.message
    else:
        missing = "all parts are there all the same"
    return FailedError(
        f"{told}\n{missing}\nin Python: run_folder({place!r}, resume=True, ..) with the same options", folder
    )
