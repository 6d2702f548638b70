# SPDX-License-Identifier: BSD-3-Clause
"""Rolling contact of two bodies, without a model: Hertz's ellipse, the laws of creep, equivalent conicity, in SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ._native import ffi, lib
from .arrays import Array, numbers, real, vector
from .errors import ArgumentError, FailedError
from .lazy import np
from .options import members_of, options, unknown

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def _law(name: str) -> int:
    names = [ffi.string(lib.kempe_contact_law_name(k)).decode() for k in range(_LAWS)]
    if name not in names:
        raise ArgumentError(unknown("law", name, names))
    return names.index(name)


_LAWS = len(ffi.typeof("kempe_creep_law").elements)


def _check(status: int, struct: str = "", given: Mapping[str, Any] | None = None) -> None:
    """An error for a status; `given`: values of a struct, of which some may be missing."""
    if status:
        missing = [name for name, _ in ffi.typeof(struct).fields if name not in (given or ())] if struct else []
        said = f"; not given, and so zero: {', '.join(missing)}" if missing else ""
        raise ArgumentError(f"a number is not finite, or outside its documented range{said}")


def hertz(normal: float, **touch: float) -> dict[str, float]:
    """The contact ellipse of a normal force (N): a, b (m), approach (m), pressure (Pa), stiffness. Keywords: along, across (1/m),
    shear_modulus (Pa), poisson.

    Raises ArgumentError if a number is missing, not finite or outside its range. Raises TypeError if there is no such keyword.

    >>> ellipse = hertz(80e3, along=1 / 0.46, across=1 / 0.3, shear_modulus=82e9, poisson=0.28)
    >>> f"{1e3 * ellipse['a']:.2f} mm, {1e3 * ellipse['b']:.2f} mm, {1e-6 * ellipse['pressure']:.0f} MPa"
    '6.68 mm, 5.02 mm, 1139 MPa'
    """
    given, _ = options("kempe_touch", touch)
    made = ffi.new("kempe_ellipse *")
    _check(lib.kempe_contact_hertz(given, real(normal, "normal"), made), "kempe_touch", touch)
    return members_of(made[0])


def kalker(ratio: float, poisson: float) -> dict[str, float]:
    """Kalker's coefficients c11, c22, c23, c33 of an ellipse with the ratio a/b.

    Raises ArgumentError if a number is not finite or outside its range. Raises TypeError if it is not a number.

    >>> f"{kalker(1.0, 0.25)['c11']:.2f}"
    '4.12'
    """
    made = ffi.new("kempe_kalker *")
    _check(lib.kempe_contact_kalker(ratio, poisson, made))
    return members_of(made[0])


def creep(law: str, **given: Any) -> dict[str, Any]:
    """Force (N) along and across, moment (N m) and sticking share by a law: none, linear, shen, polach, tanh, fastsim, fastsim1.
    Keywords: a, b (m), shear_modulus (Pa), poisson, normal (N), friction, slip (2), spin (1/m), strips.

    Raises ArgumentError if there is no such law, or a number is missing, not finite or outside its range. Raises TypeError if there is
    no such keyword."""
    struct, _ = options("kempe_creep", given)
    made = ffi.new("kempe_creep_force *")
    _check(lib.kempe_contact_creep(_law(law), struct, made), "kempe_creep", given)
    return members_of(made[0])


def flexibilities(**given: Any) -> Array:
    """The three flexibilities of FASTSIM, m^3/N. Keywords as in `creep`.

    Raises ArgumentError if a number is missing, not finite or outside its range. Raises TypeError if there is no such keyword."""
    struct, _ = options("kempe_creep", given)
    made = ffi.new("double[3]")
    _check(lib.kempe_contact_flexibilities(struct, made), "kempe_creep", given)
    return np.array(list(made))


def flexibility(**given: Any) -> float:
    """The single flexibility in place of the three, m^3/N. Keywords as in `creep`.

    Raises ArgumentError if a number is missing, not finite or outside its range. Raises TypeError if there is no such keyword."""
    struct, _ = options("kempe_creep", given)
    made = ffi.new("double *")
    _check(lib.kempe_contact_flexibility(struct, made), "kempe_creep", given)
    return float(made[0])


def fastsim(flexibility: ArrayLike, **given: Any) -> dict[str, Any]:
    """FASTSIM with given flexibilities (3). Keywords as in `creep`.

    Raises ArgumentError if a number is missing, not finite or outside its range. Raises TypeError if there is no such keyword. Raises
    ValueError if there are not three flexibilities."""
    struct, _ = options("kempe_creep", given)
    made = ffi.new("kempe_creep_force *")
    _check(lib.kempe_contact_fastsim(struct, vector(flexibility, 3, "flexibility"), made))
    return members_of(made[0])


def conicity(y: ArrayLike, difference: ArrayLike, amplitude: float) -> dict[str, float]:
    """Equivalent conicity (EN 15302) at an amplitude (m): conicity, and the ends low and high of the motion (m). Given is the
    rolling radius of the left wheel less the rolling radius of the right one at ascending lateral places y of the wheelset, positive to the left.

    Raises ArgumentError if the places do not ascend or a number is not finite. Raises FailedError if no motion of the amplitude is
    inside the places. Raises ValueError if there is another number of differences than of places.

    >>> f"{conicity([-0.01, 0.01], [-0.001, 0.001], 0.005)['conicity']:.3f}"
    '0.050'
    """
    places = numbers(y, "y")
    if (np.diff(places) <= 0).any():
        k = int(np.flatnonzero(np.diff(places) <= 0)[0])
        raise ArgumentError(f"y must ascend, but y[{k + 1}] = {places[k + 1]:g} follows {places[k]:g}")
    made = ffi.new("kempe_conicity *")
    status = lib.kempe_contact_conicity(
        len(places), vector(places, len(places), "y"), vector(difference, len(places), "difference"), amplitude, made
    )
    if status == lib.KEMPE_E_FAILED:
        raise FailedError("no motion of the amplitude is inside the places")
    _check(status)
    return members_of(made[0])
