# SPDX-License-Identifier: BSD-3-Clause
"""Extrapolated midpoint rule (Gragg, Bulirsch, Stoer) in the numbers of whoever calls: mpmath's or long doubles."""


def step(rates, t, state, h, columns):
    """State at t + h; rates(t, state) is its derivative. States are vectors that add and multiply."""
    table = []
    for k in range(columns):
        n = 2 * (k + 1)
        d = h / n
        before, now = state, state + rates(t, state) * d
        for i in range(1, n):
            before, now = now, before + rates(t + i * d, now) * (2 * d)
        row = [(before + now + rates(t + h, now) * d) / 2]
        for j in range(k):
            # ratio of the squares of the two step sizes, less one
            square, less = n * n, (2 * (k - j)) ** 2
            row.append(row[j] + (row[j] - table[k - 1][j]) * less / (square - less))
        table.append(row)
    return table[-1][-1]


def run(rates, state, ends, h, columns=9, settle=None):
    """Yields (t, state) at the ends, multiples of h from 0 on; `settle` brings a state back after each step."""
    count = 0
    for end in ends:
        while count * h < end - h / 2:
            state = step(rates, count * h, state, h, columns)
            count += 1
            if settle:
                state = settle(count * h, state)
        yield end, state
