# SPDX-License-Identifier: BSD-3-Clause
# Numbers, arrays and linear algebra of the functions below, in double precision.
def _number(x):
    return torch.as_tensor(x, dtype=torch.float64)


def _list(x):
    """The entries of a vector."""
    return [_number(entry) for entry in x] if isinstance(x, (list, tuple)) else list(torch.unbind(_number(x)))


def _vector(entry, height):
    if height == 0:
        return torch.zeros(0, dtype=torch.float64)
    given = [x for x in entry.values() if isinstance(x, torch.Tensor)]
    zero = torch.zeros((), dtype=torch.float64, device=given[0].device if given else None)
    return torch.stack([entry[row] + zero if row in entry else zero for row in range(height)])


def _matrix(entry, height, columns):
    flat = {row*columns + column: x for (row, column), x in entry.items()}
    return _vector(flat, height*columns).reshape(height, columns)


def _places(x, places):
    return torch.tensor(places, dtype=torch.long, device=x.device)


def _rows(x, rows):
    return torch.index_select(x, 0, _places(x, rows))


def _columns(x, columns):
    return torch.index_select(x, 1, _places(x, columns))


def _column(x):
    return x[:, None]


def _spread(x, places, size):
    """A vector with x at these places, otherwise zero."""
    return _vector(dict(zip(places, torch.unbind(x))), size)


def _block(rows):
    return torch.cat([torch.cat(row, 1) for row in rows], 0)


def _solve(matrix, b):
    return torch.linalg.solve(matrix, b[:, None])[:, 0] if b.ndim == 1 else torch.linalg.solve(matrix, b)


_join = torch.cat
