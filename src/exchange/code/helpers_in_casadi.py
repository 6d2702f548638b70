# SPDX-License-Identifier: BSD-3-Clause
# Numbers, arrays and linear algebra of the functions below. An entry that is zero at all arguments is not in the pattern.
def _list(x):
    """The entries of a vector."""
    if not isinstance(x, (casadi.DM, casadi.SX, casadi.MX)):
        x = casadi.vertcat(*x)
    return casadi.vertsplit(casadi.vec(casadi.densify(x)))


def _number(x):
    return x


def _vector(entry, height):
    return casadi.vertcat(*(entry.get(row, casadi.DM(1, 1)) for row in range(height)))


def _matrix(entry, height, columns):
    return casadi.vertcat(casadi.DM(0, columns), *(
        casadi.horzcat(*(entry.get((row, column), casadi.DM(1, 1)) for column in range(columns)))
        for row in range(height)))


def _rows(x, rows):
    return x[rows, :]


def _columns(x, columns):
    return x[:, columns]


def _column(x):
    return x


def _spread(x, places, size):
    """A vector with x at these places, otherwise zero."""
    at = dict(zip(places, casadi.vertsplit(x)))
    return casadi.vertcat(*(at.get(place, casadi.DM(1, 1)) for place in range(size)))


def _join(parts):
    return casadi.vertcat(*parts)


def _solve(matrix, b):
    """A solution of linear equations: in SX by CasADi's factors, which are not accurate for all matrices, with steps that
    correct the residual."""
    if not isinstance(matrix, casadi.SX):
        return casadi.solve(matrix, b)
    factor, triangle = casadi.qr(matrix)
    x = casadi.solve(triangle, factor.T @ b)
    for _ in range(2):
        x = x + casadi.solve(triangle, factor.T @ (b - matrix @ x))
    return x


_block = casadi.blockcat
