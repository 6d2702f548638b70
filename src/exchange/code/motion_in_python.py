

# Accelerations of the model with its closures, by the linear algebra above.
def _accelerations(mass, bias, jacobian, curvature, rest):
    """qdd and lambda_ of M qdd + C = J' lambda, J qdd + jdqd = 0; rest: on the diagonal of rows without a multiplier."""
    n, r = len(coordinate_names), len(independent_rows)
    if r == 0:
        return _solve(mass, -bias), _vector({}, len(row_names))
    rows = _rows(jacobian, independent_rows)
    system = _block([[mass, rows.T], [rows, _matrix(rest, r, r)]])
    found = _solve(system, -_join([bias, _rows(curvature, independent_rows)]))
    return found[:n], _spread(-found[n:], independent_rows, len(row_names))


def _reduced(mass, bias, jacobian, curvature):
    """The accelerations of the independent coordinates alone."""
    u, v = independent, dependent
    if len(v) == 0:
        return _rows(_solve(mass, -bias), u)
    rows = _rows(jacobian, independent_rows)
    given = _block([[_columns(rows, u), _column(_rows(curvature, independent_rows))]])
    solved = -_solve(_columns(rows, v), given)
    slopes, offset = solved[:, :len(u)], solved[:, len(u)]
    upper, lower = _rows(mass, u), _rows(mass, v)
    mixed = _columns(upper, v) @ slopes
    own = _columns(upper, u) + mixed + mixed.T + slopes.T @ _columns(lower, v) @ slopes
    efforts = _rows(bias, u) + _columns(upper, v) @ offset + slopes.T @ (_rows(bias, v) + _columns(lower, v) @ offset)
    return _solve(own, -efforts)


def _step(q, residuals, jacobian):
    """q after a step of Newton's method for the dependent coordinates."""
    if len(dependent) == 0:
        return q
    rows = _columns(_rows(jacobian, independent_rows), dependent)
    return q - _spread(_solve(rows, _rows(residuals, independent_rows)), dependent, len(coordinate_names))
