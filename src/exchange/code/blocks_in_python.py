# SPDX-License-Identifier: BSD-3-Clause
# Implicit blocks and averages over places, as in kempe_newton.h, which comes with generated C. The functions of a block
# take and return lists.
_quotient = _ieee(operator.truediv, np.true_divide)
_logarithm = _ieee(math.log, np.log)


def _largest(x):
    size = 0.0
    for y in x:
        size = size if abs(y) <= size or size != size else abs(y)
    return size


def _direction(n, f):
    """The step -A^-1 f; NaN: singular."""
    if n == 1:
        return [_quotient(-f[0], f[1])]
    if n == 2:
        a, p = f[2:], 0 if abs(f[2]) >= abs(f[4]) else 1
        r = 1 - p
        factor = _quotient(a[2*r], a[2*p])
        second = _quotient(-(f[r] - factor*f[p]), a[2*r + 1] - factor*a[2*p + 1])
        return [_quotient(-(f[p] + a[2*p + 1]*second), a[2*p]), second]
    try:
        return np.linalg.solve(np.reshape(f[n:n + n*n], (n, n)), -np.array(f[:n])).tolist()
    except np.linalg.LinAlgError:
        return [math.nan]*n


def _advance(y, dy, equations, residual):
    """Steps along dy; shorter where the residuals are NaN or grow."""
    n = len(y)
    for k in range(13):
        there = [y[i] + dy[i] for i in range(n)]
        f = equations(there)
        if _largest(f[:n]) <= 2*residual:
            break
        if k < 12:
            dy = [0.5*step for step in dy]
    return there, dy, f


def _is_final(step, before, size):
    """The remaining error is rounding, judged by the step before."""
    rate = _quotient(step, before)
    return (math.isfinite(before) and step <= 1e-8*size and step*rate*rate <= 2.0**-54*size) or \
        step <= 2.0**-51*size or (step <= 1e-9*size and step >= 0.5*before)


def _descend(y, equations):
    """Newton's iteration from y on; None: there is no solution."""
    n, before, f = len(y), math.inf, equations(y)
    size = [abs(x) for x in y]
    for _ in range(60):
        dy = _direction(n, f)
        step = _largest(dy)
        if not math.isfinite(step):
            return None
        part = max([0.0] + [_quotient(abs(dy[i]), size[i]) for i in range(n) if dy[i] != 0])
        stands = math.isfinite(before) and part >= 0.9*before and step <= 1e-9*_largest(size)
        if stands or _is_final(part, before, 1.0):
            return [y[i] + dy[i] for i in range(n)]
        y, dy, f = _advance(y, dy, equations, _largest(f[:n]))
        size = [size[i] if abs(y[i]) <= size[i] else abs(y[i]) for i in range(n)]
        if not math.isfinite(_largest(size)):
            return None
        before = part if _largest(dy) == step else math.inf
    return None


class _Valley:
    """The interval about a candidate in which the least merit is searched, and a place in it."""

    def __init__(self, candidate, best, equations, merit):
        first, last = best == 0, best == len(candidate) - 1
        self.low = -math.inf if first else candidate[best - 1]
        self.high = math.inf if last else candidate[best + 1]
        self.spacing = math.inf if first and last else self.high - candidate[best] if first else \
            candidate[best] - self.low if last else (self.high - self.low)/2
        self.equations, self.merit_of = equations, merit
        self.y = self.merit = math.nan
        self.f = [math.nan]*3

    def look(self, y):
        """The values at y; None: there are none."""
        f = self.equations([y])[:3]
        merit = self.merit_of([y])[0]
        return (f, merit) if all(map(math.isfinite, f)) and math.isfinite(merit) else None

    def take(self, y, values):
        self.y, (self.f, self.merit) = y, values

    def middle(self):
        end = self.low if self.f[2] > 0 else self.high
        return self.y + math.copysign(abs(end - self.y)/2 if math.isfinite(end) else self.spacing, -self.f[2])

    def go(self, y):
        """Moves to y, which becomes an end outside the domain or behind a local maximum."""
        values = self.look(y)
        hill = values and values[1] > self.merit and abs(y - self.y) > 1e-3*self.spacing
        if values and not hill:
            self.take(y, values)
        elif y > self.y:
            self.high = y
        else:
            self.low = y


def _lowest(c, m, k):
    """The lowest point of the parabola through the merits of a candidate and its neighbours."""
    if k == 0 or k == len(c) - 1:
        return c[k]
    left, right = (m[k] - m[k - 1])/(c[k] - c[k - 1]), (m[k + 1] - m[k])/(c[k + 1] - c[k])
    curvature = (right - left)/(c[k + 1] - c[k - 1])
    y = c[k] - _quotient(left + curvature*(c[k] - c[k - 1]), 2*curvature)
    return y if c[k - 1] < y < c[k + 1] else c[k]


def _descend_among(candidate, merits, best, equations, merit):
    """The unknown near a candidate, and its merit; None: there is no solution."""
    v = _Valley(candidate, best, equations, merit)
    there, begin = candidate[best], _lowest(candidate, merits, best)
    values = v.look(begin)
    if values:
        v.take(begin, values)
    if not (values and v.merit <= merits[best]):
        values = v.look(there) if begin != there else None
        if not values:
            return None
        v.take(there, values)
    if not math.isfinite(v.spacing):
        v.spacing = abs(_quotient(v.f[0], v.f[1]))
    before = math.inf
    for k in range(60):
        step = 0.0 if v.f[0] == 0 else _quotient(-v.f[0], v.f[1])
        y, size, downhill = v.y + step, max(abs(v.y), v.spacing), step*v.f[2] <= 0
        if not math.isfinite(size):
            return None
        if step == 0 or ((downhill or k > 0) and _is_final(abs(step), before, size)):
            return y, v.merit
        if v.f[2] > 0:
            v.high = v.y
        else:
            v.low = v.y
        if not v.low < y < v.high or not downhill or abs(step) > before/2:
            y = v.middle()
        before = abs(y - v.y)
        if before == 0:
            return v.y, v.merit
        v.go(y)
    return None


def _bound(c, m, k):
    """A lower bound of the merit about a candidate; None: it is not lower than its neighbours."""
    first, last = k == 0, k == len(c) - 1
    if not math.isfinite(m[k]) or (not first and m[k - 1] < m[k]) or (not last and m[k + 1] <= m[k]):
        return None
    if first or last:
        return -math.inf
    before, after = (m[k - 1] - m[k])/(c[k] - c[k - 1]), (m[k + 1] - m[k])/(c[k + 1] - c[k])
    return m[k] - max(before*(c[k + 1] - c[k]), after*(c[k] - c[k - 1]))


def _solve_one_among(candidate, merits, best, equations, merit):
    """From the best candidate, then from those that may have lower merit."""
    found = _descend_among(candidate, merits, best, equations, merit)
    for k in range(len(candidate)):
        bound = _bound(candidate, merits, k) if k != best else None
        if bound is not None and bound < (found[1] if found else math.inf):
            other = _descend_among(candidate, merits, k, equations, merit)
            if other and other[1] < (found[1] if found else math.inf):
                found = other
    return [found[0]] if found else None


def _solve(n, rows, guess, merit, scan, equations):
    """The n unknowns of a block; NaN without a solution. `rows`: candidates of the first one, with values by candidate."""
    def begin(first):
        return [first] + guess([first] + [0.0]*(n - 1))[1:n]

    if not rows:
        y = _descend(guess([0.0]*n)[:n], equations)
        return [math.nan]*n if y is None else y
    merits = [scan((begin(row[0]) if n > 1 else [row[0]]) + list(row[1:]))[0] for row in rows]
    best, least = -1, math.inf
    for k, m in enumerate(merits):
        if -math.inf < m < least:
            best, least = k, m
    if best < 0:
        y = None
    elif n == 1:
        y = _solve_one_among([row[0] for row in rows], merits, best, equations, merit)
    else:
        y = _descend(begin(rows[best][0]), equations)
    return [math.nan]*n if y is None else y


def _average(n, rows, averaged_rows, exponent, averaged):
    """The logarithm of a sum over places, and n - 1 averages. Groups of eight places count by their middle."""
    def larger(x, y):
        return x if y <= x or x != x else y

    def spacing(k):
        return (rows[min(k + 1, last)][0] - rows[max(k - 1, 0)][0])/2

    last = len(rows) - 1
    first = list(range(0, last + 1, 8))
    middle = [(k + min(k + 7, last))//2 for k in first]
    values = [exponent(rows[k]) for k in middle]
    x, needed = [e[0] for e in values], values[-1][1]
    best, most = 0, x[0]
    for k in range(len(x)):
        best = k if x[k] > most else best
        most = larger(most, x[k])
    if most + 24 < needed:
        k = middle[best]
        return [x[best] + _logarithm(spacing(k))] + averaged(averaged_rows[k])[:n - 1]
    places = []
    for k in range(len(x)):
        before, after = x[k - 1] - x[k] if k > 0 else 0.0, x[k + 1] - x[k] if k + 1 < len(x) else 0.0
        if not x[k] + larger(larger(before, after), 0.0)/2 + 12 < most - 24:
            places += range(first[k], min(first[k] + 8, last + 1))
    exponents = [exponent(rows[k])[0] for k in places]
    most = -math.inf
    for e in exponents:
        most = larger(most, e)
    weights = [math.exp(e - most)*spacing(k) if not e - most < -700 else 0.0 for e, k in zip(exponents, places)]
    total = sum(weights)
    sums = [0.0]*(n - 1)
    for weight, k in zip(weights, places):
        found = averaged(averaged_rows[k])
        for i in range(n - 1):
            sums[i] += weight*found[i]
    return [most + _logarithm(total)] + [_quotient(s, total) for s in sums]
