# SPDX-License-Identifier: BSD-3-Clause
"""Values with their first and second derivative along a motion. A jet holds three numpy arrays of one shape: the value,
the first and the second derivative by one parameter. The leading axes are instants and directions, vectors and matrices
come behind them. Plain arrays and numbers are constants."""
import functools

import numpy as np


ONE = np.eye(3).tolist()


class Jet:
    __slots__ = ("v", "d", "e")
    __array_ufunc__ = None

    def __init__(self, v, d=0.0, e=0.0):
        self.v, self.d, self.e = v, d, e

    def __neg__(self):
        return Jet(-self.v, -self.d, -self.e)

    def __add__(self, o):
        return Jet(self.v + o.v, self.d + o.d, self.e + o.e) if isinstance(o, Jet) else Jet(self.v + o, self.d, self.e)

    __radd__ = __add__

    def __sub__(self, o):
        return self + -o

    def __rsub__(self, o):
        return -self + o

    def __mul__(self, o):
        if not isinstance(o, Jet):
            return Jet(self.v * o, self.d * o, self.e * o)
        return Jet(self.v * o.v, self.d * o.v + self.v * o.d, self.e * o.v + 2 * self.d * o.d + self.v * o.e)

    __rmul__ = __mul__

    def __truediv__(self, o):
        return self * reciprocal(o) if isinstance(o, Jet) else self * (1.0 / o)

    def __rtruediv__(self, o):
        return o * reciprocal(self)

    def chain(self, f, f1, f2):
        """A function of this jet from its value and two derivatives there."""
        return Jet(f, f1 * self.d, f2 * self.d * self.d + f1 * self.e)

    def part(self, *index):
        """Components of vectors and matrices."""
        pick = (Ellipsis, *index)
        return Jet(*(np.broadcast_to(x, np.shape(self.v))[pick] if np.ndim(x) == 0 else x[pick]
                     for x in (self.v, self.d, self.e)))


def reciprocal(a):
    r = 1.0 / a.v
    return a.chain(r, -r * r, 2 * r * r * r)


def value(x):
    return x.v if isinstance(x, Jet) else x


def product(f, a, b):
    """The product rule of any bilinear f."""
    if not isinstance(a, Jet):
        return Jet(f(a, b.v), f(a, b.d), f(a, b.e)) if isinstance(b, Jet) else f(a, b)
    if not isinstance(b, Jet):
        return Jet(f(a.v, b), f(a.d, b), f(a.e, b))
    return Jet(f(a.v, b.v), f(a.d, b.v) + f(a.v, b.d), f(a.e, b.v) + 2 * f(a.d, b.d) + f(a.v, b.e))


def dot(a, b):
    return product(lambda x, y: np.sum(x * y, axis=-1), a, b)


def is_one(a):
    """The matrix of numbers that changes nothing, as most frames are."""
    return not isinstance(a, Jet) and a.shape == (3, 3) and a.tolist() == ONE


def matvec(a, b):
    return b if is_one(a) else product(lambda x, y: (x @ y[..., None])[..., 0], a, b)


def matmul(a, b):
    return b if is_one(a) else a if is_one(b) else product(np.matmul, a, b)


def transposed(a):
    swap = lambda x: np.swapaxes(x, -1, -2)
    return Jet(swap(a.v), swap(a.d), swap(a.e)) if isinstance(a, Jet) else swap(a)


def tilde(a):
    """The matrix of a cross product."""
    a = np.asarray(a)
    m = np.zeros(a.shape + (3,))
    m[..., 0, 1], m[..., 0, 2], m[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    m[..., 1, 0], m[..., 2, 0], m[..., 2, 1] = a[..., 2], -a[..., 1], a[..., 0]
    return m


def untilde(m):
    """The vector of a matrix's skew part."""
    out = np.empty(m.shape[:-1])
    out[..., 0], out[..., 1], out[..., 2] = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    return 0.5 * out


def cross(a, b):
    """Of plain arrays; numpy's own takes longer on few numbers."""
    a0, a1, a2 = (a[..., k] for k in range(3))
    b0, b1, b2 = (b[..., k] for k in range(3))
    first = a1 * b2 - a2 * b1
    out = np.empty(first.shape + (3,))
    out[..., 0], out[..., 1], out[..., 2] = first, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    return out


@functools.lru_cache(1000)
def products(*axis):
    """Of the cross product with an axis, once and twice."""
    k = tilde(axis)
    return k, k @ k


def turning(axis, angle):
    """The matrix that turns vectors by an angle, a jet of any leading shape, about a fixed unit axis."""
    k, k2 = products(*axis)
    s, c = np.sin(angle.v)[..., None, None], np.cos(angle.v)[..., None, None]
    r = ONE + s * k + (1 - c) * k2
    first, second = c * k + s * k2, -s * k + c * k2
    d, e = angle.d[..., None, None], angle.e[..., None, None]
    return Jet(r, first * d, second * d * d + first * e)
