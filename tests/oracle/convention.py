# SPDX-License-Identifier: BSD-3-Clause
"""What a mutation breaks on purpose: `run --mutate` sets one of these, and comparisons must then fail. All are False in
every other run."""

BROKEN = {}


def broken(name):
    """Whether this convention is broken on purpose. Every name asked for is known afterwards."""
    return BROKEN.setdefault(name, False)
