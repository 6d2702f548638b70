# SPDX-License-Identifier: BSD-3-Clause
"""State spaces."""

from __future__ import annotations

import os
from typing import Any

from ._native import ffi, lib
from .arrays import Array, view
from .context import constant, string
from .options import path_of
from .result import PartOf, Result


class MatrixOf(PartOf):
    """An attribute of a linearization: one of its matrices."""

    def __get__(self, linearization: Linearization | None, owner: type[Linearization]) -> Array:
        return self if linearization is None else linearization.matrix(self.name)  # type: ignore[return-value]


class Linearization(Result):
    """xd = A x + B w and y = C x + D w with x = (du, dud). M dudd + G dud + K du + L w = 0. dq = N du and dqd = N dud + Nd du.

    Matrices are read-only views."""

    _noun = "linearization"
    _options = "kempe_linearize_options"
    _kept = ("states", "inputs", "outputs", "delays", "q", "qd", "y", "sample_time", "is_equilibrium")

    def matrix(self, name: str) -> Array:
        """A matrix by its name: A, B, C, D, M, G, K, L, N, Nd, Z.

        Raises ArgumentError if there is no such matrix."""
        rows, columns = ffi.new("int *"), ffi.new("int *")
        values = lib.kempe_linearization_matrix(self._pointer, constant("MATRIX", name), rows, columns)
        return view(values, (rows[0], columns[0]), self._pointer, "F")

    A: MatrixOf = MatrixOf("Of the states (2p x 2p, and one for each state of the model).")
    B: MatrixOf = MatrixOf("Of the inputs on the rates of the states.")
    C: MatrixOf = MatrixOf("Of the states on the outputs.")
    D: MatrixOf = MatrixOf("Of the inputs on the outputs.")
    M: MatrixOf = MatrixOf("Mass of the independent coordinates (p x p).")
    G: MatrixOf = MatrixOf("Damping and gyroscopic terms (p x p).")
    K: MatrixOf = MatrixOf("Stiffness (p x p).")
    L: MatrixOf = MatrixOf("Of the inputs on the equations of motion.")
    N: MatrixOf = MatrixOf("Coordinates by independent ones (n x p).")
    Nd: MatrixOf = MatrixOf("Rate of N along the motion (n x p).")
    Z: MatrixOf = MatrixOf("With sampled states: eigenvalues of A, real and imaginary parts as columns.")

    def _channel(self, name: str) -> dict[str, str]:
        channel, p = getattr(lib, f"KEMPE_CHANNEL_{name}"), self._pointer
        return {
            string(lib.kempe_linearization_name(p, channel, k)): string(lib.kempe_linearization_unit(p, channel, k))
            for k in range(lib.kempe_linearization_count(p, channel))
        }

    @property
    def states(self) -> dict[str, str]:
        """States and their units."""
        return self._channel("STATE")

    @property
    def inputs(self) -> dict[str, str]:
        """Inputs and their units."""
        return self._channel("INPUT")

    @property
    def outputs(self) -> dict[str, str]:
        """Outputs and their units."""
        return self._channel("OUTPUT")

    @property
    def delays(self) -> dict[str, float]:
        """The last inputs and outputs, and the time after which each of these outputs is the input of its name."""
        names, p = self._channel("DELAY"), self._pointer
        return {name: float(lib.kempe_linearization_delay(p, k)) for k, name in enumerate(names)}

    @property
    def q(self) -> Array:
        """Coordinates of the state (n)."""
        return view(lib.kempe_linearization_q(self._pointer), (len(self._context.coordinates),), self._pointer)

    @property
    def qd(self) -> Array:
        """Rates of the state (n)."""
        return view(lib.kempe_linearization_qd(self._pointer), (len(self._context.coordinates),), self._pointer)

    @property
    def y(self) -> Array:
        """Outputs at the state."""
        return view(lib.kempe_linearization_y(self._pointer), (len(self.outputs),), self._pointer)

    @property
    def sample_time(self) -> float:
        """With sampled states: the time after which all samples repeat; A, B, C, D are the map over it. Otherwise 0."""
        return float(lib.kempe_linearization_sample_time(self._pointer))

    @property
    def is_equilibrium(self) -> bool:
        """The matrices are valid at all times, not at this instant only."""
        return bool(lib.kempe_linearization_is_equilibrium(self._pointer))

    def write(self, path: str | os.PathLike[str]) -> None:
        """All matrices and names: .npz for NumPy, .mat for MATLAB and Octave.

        Raises FileError if the file cannot be written. Raises ArgumentError if its ending is of no known format."""
        self._context.check(lib.kempe_linearization_write, self._pointer, path_of(path))

    def _closed(self) -> None:
        if self.delays:
            raise ValueError(f"a state space without delays is needed, and this one ends at {', '.join(self.delays)}")

    def to_scipy(self) -> Any:
        """A scipy.signal.StateSpace.

        Raises ImportError if SciPy is not installed. Raises ValueError if the state space has delays.

        >>> space = kempe.Model("cart_pole.yaml").system().linearize(inputs="u", outputs="q(x)").to_scipy()  # with SciPy
        >>> space.A.shape  # with SciPy
        (4, 4)
        """
        from scipy.signal import StateSpace

        self._closed()
        return StateSpace(self.A, self.B, self.C, self.D, **({"dt": self.sample_time} if self.sample_time else {}))

    def to_control(self) -> Any:
        """A control.StateSpace of python-control, with the names of its channels. It allows no dots in names: they are "_".

        Raises ImportError if python-control is not installed. Raises ValueError if the state space has delays."""
        import control

        self._closed()
        return control.ss(
            self.A,
            self.B,
            self.C,
            self.D,
            self.sample_time or 0,
            **{
                channel: [name.replace(".", "_") for name in names]
                for channel, names in (("states", self.states), ("inputs", self.inputs), ("outputs", self.outputs))
            },
        )
