# SPDX-License-Identifier: BSD-3-Clause
"""Outputs of a driven mechanism with their exact derivatives by parameters, for optimisers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from ._native import lib
from .arrays import Array, optional, vector, view
from .context import Owned, string
from .errors import ArgumentError
from .lazy import np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Gradient(Owned):
    """Values (k) of the model's outputs at driven coordinates (d), and their derivatives by parameters (p).

    Results are copies; they belong to the last `at`."""

    _noun = "gradient"

    def _made(self) -> None:
        count = lib.kempe_gradient_count(self._pointer)
        self.names: tuple[str, ...] = tuple(string(lib.kempe_gradient_name(self._pointer, k)) for k in range(count))

    def __repr__(self) -> str:
        return f"<Gradient: {len(self.names)} values by {', '.join(self.parameters)}>"

    def _set_options(self, options: Mapping[str, Any]) -> None:
        self.parameters, self.driven = (self._words(options.get(name, ())) for name in ("parameters", "driven"))

    @staticmethod
    def _words(given: str | Iterable[str]) -> tuple[str, ...]:
        return tuple(word.strip() for word in given.split(",")) if isinstance(given, str) else tuple(given)

    def set(self, values: ArrayLike) -> None:
        """Sets the values of all parameters (p), in SI, from the next `at` on.

        Raises InputError if the model cannot have these values. Raises ValueError if there is another number of values. Raises
        TypeError if they are not numbers."""
        self._context.check(lib.kempe_gradient_set, self._pointer, vector(values, len(self.parameters), "values"))

    def at(self, driven: ArrayLike, rates: ArrayLike | None = None, accelerations: ArrayLike | None = None) -> Array:
        """Evaluates at the driven coordinates (d), with their rates and accelerations. Returns the values (k).

        Raises FailedError if the loops cannot be closed there. Raises ValueError if an array has another length. Raises TypeError if
        its entries are not numbers."""
        count = len(self.driven)
        self._context.check(
            lib.kempe_gradient_eval,
            self._pointer,
            vector(np.atleast_1d(driven), count, "driven"),
            optional(None if rates is None else np.atleast_1d(rates), count, "rates"),
            optional(None if accelerations is None else np.atleast_1d(accelerations), count, "accelerations"),
        )
        self._known = True
        return self.values

    _known = False  # at has been called

    def _copy(self, get: Any, *shape: int) -> Array:
        if not self._known:
            raise ArgumentError("the gradient has no values yet: call at(driven) first")
        return view(get(self._pointer), shape, None).copy()

    @property
    def values(self) -> Array:
        """Values (k)."""
        return self._copy(lib.kempe_gradient_values, len(self.names))

    @property
    def jacobian(self) -> Array:
        """Derivatives of the values by the parameters (k x p)."""
        return self._copy(lib.kempe_gradient_jacobian, len(self.names), len(self.parameters))

    @property
    def by_driven(self) -> Array:
        """Derivatives of the values by the driven coordinates (k x d)."""
        return self._copy(lib.kempe_gradient_by_driven, len(self.names), len(self.driven))

    @property
    def q(self) -> Array:
        """All coordinates (n)."""
        return self._copy(lib.kempe_gradient_q, len(self._context.coordinates))

    @property
    def q_jacobian(self) -> Array:
        """Derivatives of all coordinates by the parameters (n x p)."""
        return self._copy(lib.kempe_gradient_q_jacobian, len(self._context.coordinates), len(self.parameters))
