# SPDX-License-Identifier: BSD-3-Clause
"""Extremes, times and integrals of a motion of event_motion.py, from cubic pieces between the ends of its steps."""
import math

import numpy as np

NEAR = 1e-3  # of a level: an extreme this near to it may pass it or not


def piece(t0, a, da, t1, b, db):
    """Coefficients of a cubic of s = (t - t0)/h, lowest power first."""
    h = t1 - t0
    return h, (a, h * da, 3 * (b - a) - h * (2 * da + db), 2 * (a - b) + h * (da + db))


def value(c, s):
    return c[0] + s * (c[1] + s * (c[2] + s * c[3]))


def turns(c):
    """The places inside a piece at which its slope is zero."""
    a, b, d = 3 * c[3], 2 * c[2], c[1]
    if abs(a) < 1e-14 * (abs(b) + abs(d)) or a == 0:
        roots = [-d / b] if b else []
    else:
        square = b * b - 4 * a * d
        if square < 0:
            return []
        q = -(b + math.copysign(math.sqrt(square), b)) / 2
        roots = [q / a] + ([d / q] if q else [])
    return sorted(s for s in roots if 0 < s < 1)


class Quantities:
    """`texts` for Kempe with the `right` values and what they may differ by (`allowed`)."""

    def __init__(self, pair, reference, number):
        self.texts, self.right, self.allowed = [], [], []
        k, r = pair.k, np.random.default_rng([number, 11])
        end, unit = pair.end, reference.growth * 1e-6
        self.span = (0.0, end)
        tail = ""
        if r.random() < 0.5:
            self.span = tuple(sorted(round(float(t), 3) for t in r.uniform(0, end, 2)))
            tail = f" from {self.span[0]} to {self.span[1]}"
            if self.span[1] - self.span[0] < 0.05:
                self.span, tail = (0.0, end), ""
        for word, part in (("q", 1), ("qd", 2)):
            name = f"{word}({pair.joint})"
            pieces = [piece(s[0], s[part][k], s[part + 1][k], s[4], s[part + 4][k], s[part + 5][k]) + (s[0],) for s in reference.base.trace if s[4] > s[0]]
            pieces = [p for p in map(self.cut, pieces) if p]
            low, high = self.extremes(pieces)
            size = max(1.0, abs(low), abs(high))
            least = 5e-8 if part == 1 else 5e-6  # of cubic pieces
            fine = unit * size + least * size
            self.put(f"max({name}){tail}", high, fine)
            self.put(f"min({name}){tail}", low, fine)
            self.put(f"range({name}){tail}", high - low, 2 * fine)
            whole = sum(h * (c[0] + c[1] / 2 + c[2] / 3 + c[3] / 4) for h, c, _ in pieces)
            self.put(f"integral({name}){tail}", whole, fine * (1 + end))
            self.put(f"mean({name}){tail}", whole / (self.span[1] - self.span[0]), 10 * fine)
            if part == 1:
                self.levels(name, tail, pieces, low, high, fine, r)

    def put(self, text, right, allowed):
        self.texts.append(text)
        self.right.append(right)
        self.allowed.append(allowed)

    def cut(self, p):
        """A piece within the span."""
        h, c, t0 = p
        a, b = max(0.0, (self.span[0] - t0) / h), min(1.0, (self.span[1] - t0) / h)
        if b - a <= 1e-12:
            return None
        w = b - a
        return h * w, (value(c, a), w * (c[1] + a * (2 * c[2] + 3 * a * c[3])), w * w * (c[2] + 3 * a * c[3]), w ** 3 * c[3]), t0 + a * h

    @staticmethod
    def extremes(pieces):
        values = [value(c, s) for _, c, _ in pieces for s in (0.0, *turns(c), 1.0)]
        return min(values), max(values)

    def levels(self, name, tail, pieces, low, high, fine, r):
        """Times at which a level is passed: where it is passed fast, and no extreme is near."""
        level = round(float(low + r.uniform(0.15, 0.85) * (high - low)), 3)
        first, count, during, slowest, before = None, 0, 0.0, math.inf, None
        for h, c, t0 in pieces:
            marks = [0.0, *turns(c), 1.0]
            for a, b in zip(marks, marks[1:]):
                fa, fb = value(c, a) - level, value(c, b) - level
                if min(abs(fa), abs(fb)) < NEAR * max(1e-3, high - low) and (a > 0 or b < 1 or abs(c[1]) < 0.02 * h):
                    return
                above = fa > 0 if before is None or fa != 0 else before
                if before is None and above:
                    first = t0 + a * h
                if fa * fb < 0:
                    lo, hi = a, b
                    for _ in range(60):
                        m = (lo + hi) / 2
                        lo, hi = (m, hi) if (value(c, m) - level) * fa > 0 else (lo, m)
                    rate = abs((c[1] + lo * (2 * c[2] + 3 * lo * c[3])) / h)
                    slowest = min(slowest, rate)
                    if fb > 0:
                        count, first = count + 1, t0 + lo * h if first is None else first
                    during += h * ((b - lo) if fb > 0 else (lo - a))
                elif above:
                    during += h * (b - a)
                before = fb > 0
        if slowest < 0.05 or abs(value(pieces[0][1], 0.0) - level) < NEAR or abs(value(pieces[-1][1], 1.0) - level) < NEAR:
            return
        late = (fine + 1e-9) / min(slowest, 1.0)
        self.put(f"count({name} > {level}){tail}", float(count), 1e-9)
        self.put(f"duration({name} > {level}){tail}", during, late * (2 + 2 * count))
        if first is not None:
            self.put(f"first({name} > {level}){tail}", first, late)
