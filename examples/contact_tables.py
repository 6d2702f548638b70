# SPDX-License-Identifier: BSD-3-Clause
"""Hertz's ellipses and Kalker's coefficients, for references beside the library: numbers may be complex, for complex steps."""
import bisect
import cmath
import math

# Kalker 1990, table E.3, at nu = 0, 1/4, 1/2. Ellipses that are long in the direction of rolling, b/a = 0.1, 0.2, .. 1:
# C11, C22, C23, C33.
LONG = (
    ((10.7, 11.7, 12.9), (10.7, 12.8, 16.0), (12.2, 14.6, 18.0), (0.795, 0.526, 0.228)),
    ((6.96, 7.78, 8.82), (6.96, 8.14, 9.79), (5.72, 6.63, 7.89), (0.828, 0.601, 0.341)),
    ((5.57, 6.34, 7.34), (5.57, 6.40, 7.51), (3.79, 4.32, 5.01), (0.868, 0.674, 0.446)),
    ((4.84, 5.57, 6.57), (4.84, 5.48, 6.31), (2.88, 3.24, 3.70), (0.912, 0.747, 0.549)),
    ((4.37, 5.10, 6.11), (4.37, 4.90, 5.56), (2.35, 2.62, 2.96), (0.958, 0.819, 0.650)),
    ((4.06, 4.78, 5.80), (4.06, 4.50, 5.04), (2.01, 2.23, 2.50), (1.01, 0.892, 0.751)),
    ((3.82, 4.54, 5.58), (3.82, 4.21, 4.67), (1.76, 1.95, 2.18), (1.05, 0.965, 0.852)),
    ((3.65, 4.36, 5.42), (3.65, 3.99, 4.39), (1.58, 1.75, 1.94), (1.10, 1.04, 0.954)),
    ((3.51, 4.22, 5.30), (3.51, 3.81, 4.16), (1.44, 1.59, 1.77), (1.16, 1.11, 1.06)),
    ((3.40, 4.12, 5.20), (3.40, 3.67, 3.98), (1.33, 1.47, 1.63), (1.21, 1.19, 1.16)))
# Ellipses that are wide, a/b = 0.5, 0.6, .. 1: C11, C22.
WIDE = (
    ((2.88, 3.62, 4.83), (2.88, 3.01, 3.14)),
    ((2.98, 3.72, 4.91), (2.98, 3.14, 3.31)),
    ((3.09, 3.81, 4.97), (3.09, 3.28, 3.48)),
    ((3.19, 3.91, 5.05), (3.19, 3.41, 3.65)),
    ((3.29, 4.01, 5.12), (3.29, 3.54, 3.82)),
    ((3.40, 4.12, 5.20), (3.40, 3.67, 3.98)))


def log(x):
    return cmath.log(x) if isinstance(x, complex) else math.log(x)


def exp(x):
    return cmath.exp(x) if isinstance(x, complex) else math.exp(x)


def bends(x, y):
    """Second derivatives of the natural cubic through the points: three to a row, the middle one by elimination."""
    h, found, rows = [b - a for a, b in zip(x, x[1:])], [0.0] * len(x), [(0.0, 0.0)]
    for k in range(1, len(x) - 1):
        upper, right = rows[-1]
        pivot = 2 * (h[k - 1] + h[k]) - h[k - 1] * upper
        jump = (y[k + 1] - y[k]) / h[k] - (y[k] - y[k - 1]) / h[k - 1]
        rows.append((h[k] / pivot, (6 * jump - h[k - 1] * right) / pivot))
    for k in range(len(x) - 2, 0, -1):
        found[k] = rows[k][1] - rows[k][0] * found[k + 1]
    return found


def spline(x, y, at):
    """Natural cubic."""
    bend = bends(x, y)
    k = min(max(bisect.bisect_left(x, at.real) - 1, 0), len(x) - 2)
    h = x[k + 1] - x[k]
    p, q = (x[k + 1] - at) / h, (at - x[k]) / h
    return p * y[k] + q * y[k + 1] + ((p**3 - p) * bend[k] + (q**3 - q) * bend[k + 1]) * h**2 / 6


def coefficients(a, b, nu):
    """Of an ellipse a along and b across: C11, C22, and of long ones C23, C33. 1/C is a parabola through its values at nu 0, 1/4,
    1/2, and log C a natural cubic over the logarithm of the axes' ratio."""
    table = LONG if a.real > b.real else WIDE
    g = b / a if a.real > b.real else a / b
    ratios = [math.log((11 - len(table) + k) / 10) for k in range(len(table))]
    weights = (1 - 4 * nu) * (1 - 2 * nu), 8 * nu * (1 - 2 * nu), -2 * nu * (1 - 4 * nu)
    return [exp(spline(ratios, [-math.log(sum(w / c for w, c in zip(weights, row[k]))) for row in table], log(g))) for k in range(len(table[0]))]


def elliptic(g):
    """K and E of m = 1 - g^2, by the arithmetic and geometric means of 1 and g."""
    a, b, total, power = 1.0, g, 0.5 * (1 - g * g), 0.5
    for _ in range(8):
        power *= 2
        total = total + power * (0.5 * (a - b)) ** 2
        a, b = 0.5 * (a + b), (a * b) ** 0.5
    K = math.pi / (2 * a)
    return K, K * (1 - total)


def ellipse(along, across, normal, g_star):
    """Semi-axes a along and b across, and the approach, from curvatures: g^2 D/B is their ratio, g that of the semi-axes, the shorter
    one over the longer; the cube of the longer one by the load (Johnson 1985, 4.2). g_star: G/(1 - nu) of either body, both alike."""
    small, large = (along, across) if along.real < across.real else (across, along)

    def ratio(g):
        K, E = elliptic(g)
        B, D = (E - g * g * K) / (1 - g * g), (K - E) / (1 - g * g)
        return g * g * D / B, E
    g = (small.real / large.real) ** (2 / 3)  # near enough to begin
    for _ in range(40):  # secants by a fixed step: it holds for complex values, too
        here, up, down = ratio(g)[0], ratio(g + 1e-5)[0], ratio(g - 1e-5)[0]
        g = g - (here - small / large) / ((up - down) / 2e-5)
    longer = (3 * normal * ratio(g)[1] / (math.pi * g_star * (along + across) * g * g)) ** (1 / 3)
    axes = (longer, longer * g) if along.real < across.real else (longer * g, longer)
    return *axes, 3 * normal * elliptic(g)[0] / (2 * math.pi * longer * g_star)
