# SPDX-License-Identifier: BSD-3-Clause
# Numbers, arrays and linear algebra of the functions below.
def _need_double():
    if not jax.config.jax_enable_x64:
        raise RuntimeError("these equations need double precision: call jax.config.update(\"jax_enable_x64\", True) first")


def _number(x):
    _need_double()
    return jnp.asarray(x, dtype=jnp.float64)


def _list(x):
    """The entries of a vector."""
    return list(_number(x))


def _vector(entry, height):
    zeros = jnp.zeros(height)
    return zeros.at[np.array(list(entry))].set(jnp.stack([_number(x) for x in entry.values()])) if entry else zeros


def _matrix(entry, height, columns):
    flat = {row*columns + column: x for (row, column), x in entry.items()}
    return _vector(flat, height*columns).reshape(height, columns)


def _rows(x, rows):
    return x[np.array(rows, dtype=int)]


def _columns(x, columns):
    return x[:, np.array(columns, dtype=int)]


def _column(x):
    return x[:, None]


def _spread(x, places, size):
    """A vector with x at these places, otherwise zero."""
    return jnp.zeros(size).at[np.array(places, dtype=int)].set(x)


_block, _join, _solve = jnp.block, jnp.concatenate, jnp.linalg.solve
