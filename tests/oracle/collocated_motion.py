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
SETTLED = 1e-11  # change of the last iteration, of 1 + the size of each value; ends are then those of 1e-13 to 1e-12
SMOOTH = 1e-9  # last coefficients of the accelerations times the window's length, likewise

PLACES = 0.5 - 0.5 * np.cos(np.pi * np.arange(ORDER) / (ORDER - 1))
TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(2 * PLACES - 1, ORDER - 1))
INTEGRALS = np.stack([chebyshev.chebint(row, lbnd=-1) for row in np.eye(ORDER)])  # from 0, of Chebyshev's polynomials


def integral(places):
    """The matrix that brings values at PLACES to integrals from 0 to other places of [0, 1]."""
    return 0.5 * chebyshev.chebvander(2 * places - 1, ORDER) @ INTEGRALS.T @ TO_COEFFICIENTS


WHOLE = integral(PLACES)


class TooManyWindows(Exception):
    """The motion is left out: its windows are too short."""


class Conditions:
    """Outcomes of the comparisons of an evaluation, in the order in which they are asked for: recorded, or held."""

    def __init__(self, held=None):
        self.held, self.found = held, []

    def __call__(self, difference, outcome):
        self.found.append(np.asarray(outcome).reshape(len(outcome), -1)[:, 0])
        return np.full(np.shape(outcome), self.held[len(self.found) - 1]) if self.held is not None else outcome

    def table(self, instants):
        """All outcomes: (instants, conditions)."""
        return np.array(self.found).T.reshape(instants, -1)


class Integration:
    def __init__(self, mechanism, t, q, qd, y):
        self.mechanism, self.t, self.q, self.qd, self.y, self.taken = mechanism, t, q, qd, y, t
        self.waits = any(state.when for _, state in mechanism.states)
        self.look()
        self.windows, self.before = 0, None

    def motion(self, t, q, qd, y, conditions=None):
        return Motion(self.mechanism, self.t + t, q, qd, conditions=conditions, states=y)

    def slopes(self, t, q, qd, y, conditions):
        """Accelerations, and rates of the states."""
        motion = self.motion(t, q, qd, y, conditions)
        motion.whens()
        return np.concatenate([motion.solve().qdd, motion.state_rates()], 1)

    def look(self, changed=True):
        """Notes the outcomes of all conditions here, unless none of them changed, and the ones at which states change."""
        here = (np.zeros(1), self.q[None], self.qd[None], self.y[None])
        self.held = self.outcomes(*here)[0] if changed else self.held
        self.when = self.motion(*here).whens()[0] if self.waits else np.zeros(len(self.y), bool)

    def change(self, due):
        """The states that are due take their next values."""
        self.before = None
        self.y = self.motion(np.zeros(1), self.q[None], self.qd[None], self.y[None]).next_states(due)[0]
        self.look()

    def outcomes(self, t, q, qd, y):
        """All conditions at several instants."""
        conditions = Conditions()
        self.slopes(t, q, qd, y, conditions)
        return conditions.table(len(t))

    def window(self, h):
        """Accelerations at the points of a window, or None where it must be shorter."""
        q, qd, y = self.places(h, self.guess(h), PLACES)
        for _ in range(25):
            conditions = Conditions(self.held)
            try:
                with np.errstate(all="ignore"):
                    a = self.slopes(h * PLACES, q, qd, y, conditions)
            except np.linalg.LinAlgError:  # no state: iterates of a window that is too long lead anywhere
                return None
            before, (q, qd, y) = (q, qd, y), self.places(h, a, PLACES)
            change = max(np.max(np.abs(x - last) / (1 + np.abs(x)), initial=0.0) for x, last in zip((q, qd, y), before))
            if not np.isfinite(change):
                return None
            if change < SETTLED:
                last = np.max(np.abs((TO_COEFFICIENTS @ a)[-2:]) / (1 + np.abs(np.concatenate([qd[-1], y[-1]]))))
                self.found = conditions.table(ORDER)
                return a if last * h < SMOOTH else None
        return None

    def guess(self, h):
        """The accelerations of the window before go on, where no condition changed; otherwise none."""
        if self.before is None:
            return np.zeros((ORDER, len(self.q) + len(self.y)))
        size, coefficients = self.before
        return chebyshev.chebvander(1 + 2 * h / size * PLACES, ORDER - 1) @ coefficients

    def places(self, h, a, at):
        """Positions, rates and states at parts of a window."""
        n = len(self.q)
        over = WHOLE if at is PLACES else integral(at)
        rates = self.qd + h * WHOLE @ a[:, :n]
        whole = h * over @ a
        return self.q + h * over @ rates, self.qd + whole[:, :n], self.y + whole[:, n:]

    def advance(self, end):
        h = LONGEST
        while end - self.t > 1e-12:
            self.sample()
            h = min(h, end - self.t, LONGEST, self.free())
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

    def periods(self):
        return [state.period for _, state in self.mechanism.states if state.period]

    def free(self):
        """The time up to the next sample."""
        return min((period * np.floor(self.t / period + 1 + 1e-9) - self.t for period in self.periods()), default=np.inf)

    def sample(self):
        """Takes the samples of this instant, once; those of the start were taken before."""
        if self.t - self.taken < 1e-12:
            return
        due = [bool(state.period) and abs(self.t / state.period - round(self.t / state.period)) < 1e-9
               for _, state in self.mechanism.states]
        if any(due):
            self.taken = self.t
            self.change(due)

    def take(self, h, a):
        """The window up to the first change of a condition."""
        at, low, found = PLACES, 0.0, self.found
        q, qd, y = self.places(h, a, at)
        while True:
            other = np.nonzero(np.any(found != self.held, axis=1))[0]
            if len(other) == 0 or at[other[0]] - low < PLACE or other[0] == 0:
                break
            low, high = at[other[0] - 1], at[other[0]]
            at = np.linspace(low, high, 17)
            q, qd, y = self.places(h, a, at)
            found = self.outcomes(h * at, q, qd, y)
        k = other[0] if len(other) else len(at) - 1
        if k == 0 and len(other):  # at the border itself: the other side is behind it
            k = 1
        self.before = None if len(other) else (h, TO_COEFFICIENTS @ a)
        self.t, self.q, self.qd, self.y, before = self.t + h * at[k], q[k], qd[k], y[k], self.when
        self.look(len(other) > 0)
        if np.any(self.when & ~before):
            self.change(self.when & ~before)
