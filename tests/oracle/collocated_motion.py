# SPDX-License-Identifier: BSD-3-Clause
"""A motion integrated by the oracle itself, by collocation: over a short window the accelerations at Chebyshev's points are
integrated as a polynomial, again and again, until positions and rates no longer change (Picard's iteration). All points of a
window are evaluated at once. Conditions are held over a window, which ends where one of them changes."""
import numpy as np
from numpy.polynomial import chebyshev

from mechanics import Motion

ORDER = 9  # points of a window
LONGEST = 0.02  # of a window, s
MOST = 100  # windows of a motion: near a singular position of a spherical joint's angles they become too short
PLACE = 1e-12  # of a change of a condition, in parts of a window
SETTLED = 1e-13  # change of the last iteration, of 1 + the size of each value
SMOOTH = 1e-9  # last coefficients of the accelerations times the window's length, likewise

PLACES = 0.5 - 0.5 * np.cos(np.pi * np.arange(ORDER) / (ORDER - 1))
TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(2 * PLACES - 1, ORDER - 1))


def integral(places):
    """The matrix that brings values at PLACES to integrals from 0 to other places of [0, 1]."""
    lows = np.stack([chebyshev.chebint(row, lbnd=-1) for row in np.eye(ORDER)])
    return 0.5 * chebyshev.chebvander(2 * places - 1, ORDER) @ lows.T @ TO_COEFFICIENTS


class TooManyWindows(Exception):
    """The motion is left out: its windows are too short."""


class Conditions:
    """Outcomes of the comparisons of an evaluation, in the order in which they are asked for: recorded, or held."""

    def __init__(self, held=None):
        self.held, self.found = held, []

    def __call__(self, difference, outcome):
        self.found.append(np.asarray(outcome).reshape(len(outcome), -1)[:, 0])
        return np.full(np.shape(outcome), self.held[len(self.found) - 1]) if self.held is not None else outcome


class Integration:
    def __init__(self, mechanism, t, q, qd):
        self.mechanism, self.t, self.q, self.qd = mechanism, t, q, qd
        self.held = self.outcomes(np.zeros(1), q[None], qd[None])[0]
        self.whole, self.windows = integral(PLACES), 0

    def motion(self, t, q, qd, conditions):
        return Motion(self.mechanism, self.t + t, q, qd, conditions=conditions).solve()

    def outcomes(self, t, q, qd):
        """All conditions at several instants: (instants, conditions)."""
        conditions = Conditions()
        self.motion(t, q, qd, conditions)
        return np.array(conditions.found).T.reshape(len(t), -1)

    def window(self, h):
        """Accelerations at the points of a window, or None where it must be shorter."""
        q, qd = (self.places(h, np.zeros((ORDER, len(self.q))), PLACES))
        for _ in range(25):
            try:
                with np.errstate(all="ignore"):
                    a = self.motion(h * PLACES, q, qd, Conditions(self.held)).qdd
            except np.linalg.LinAlgError:  # no state: iterates of a window that is too long lead anywhere
                return None
            before, (q, qd) = (q, qd), self.places(h, a, PLACES)
            change = max(np.max(np.abs(q - before[0]) / (1 + np.abs(q))), np.max(np.abs(qd - before[1]) / (1 + np.abs(qd))))
            if not np.isfinite(change):
                return None
            if change < SETTLED:
                last = np.max(np.abs((TO_COEFFICIENTS @ a)[-2:]) / (1 + np.abs(qd[-1])))
                return a if last * h < SMOOTH else None
        return None

    def places(self, h, a, at):
        """Positions and rates at parts of a window."""
        rates = self.qd + h * integral(PLACES) @ a
        return self.q + h * integral(at) @ rates, self.qd + h * integral(at) @ a

    def advance(self, end):
        h = LONGEST
        while end - self.t > 1e-12:
            h = min(h, end - self.t, LONGEST)
            a = self.window(h)
            if a is None:
                h *= 0.4
                if h < 1e-9:
                    raise FloatingPointError("windows become too short")
                continue
            self.take(h, a)
            self.windows += 1
            if self.windows > MOST:
                raise TooManyWindows
            h *= 1.6

    def take(self, h, a):
        """The window up to the first change of a condition."""
        at, low, found = PLACES, 0.0, None
        while True:
            q, qd = self.places(h, a, at)
            found = self.outcomes(h * at, q, qd)
            other = np.nonzero(np.any(found != self.held, axis=1))[0]
            if len(other) == 0 or at[other[0]] - low < PLACE or other[0] == 0:
                break
            low, high = at[other[0] - 1], at[other[0]]
            at = np.linspace(low, high, 17)
        k = other[0] if len(other) else len(at) - 1
        if k == 0 and len(other):  # at the border itself: the other side is behind it
            k = 1
        self.t, self.q, self.qd, self.held = self.t + h * at[k], q[k], qd[k], found[k]
