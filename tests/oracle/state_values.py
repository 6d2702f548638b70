# SPDX-License-Identifier: BSD-3-Clause
"""States by docs/model/states.md: their start values, rates, next values, and the outputs of blocks. A law is a function of
an environment of expressions."""
import numpy as np

from convention import broken


class State:
    """One value with its rate, or with its next value at samples (`period`) or where `when` becomes true."""

    def __init__(self, name, start, rate=None, following=None, period=None, when=None):
        self.name, self.start, self.rate, self.following, self.period, self.when = name, start, rate, following, period, when


def states_of(scope, name, keys):
    """The states of an entry, and its output where that is none of them."""
    start, full = scope.number(keys.get("start", "0")), scope.full(name)
    text = lambda key: lambda env: env.value(keys[key])
    if "rate" in keys:
        return [State(full, start, rate=text("rate"))], None
    if "next" in keys:
        period = scope.number(keys["sample"]) if "sample" in keys else None
        return [State(full, start, following=text("next"), period=period, when=keys.get("when"))], None
    return (transfer if "transfer" in keys else controller)(scope, full, keys, start)


def transfer(scope, full, keys, start):
    """x' = A x + B u with the output x1: (s^n + a1 s^(n-1) + ..) x1 = (b1 s^(n-1) + ..) u, one power of s after the other."""
    a, b = (scope.vector(keys[key]) for key in ("denominator", "numerator"))
    n = len(a) - 1
    b = np.concatenate([np.zeros(n - len(b)), b]) / a[0]
    a = a[1:] / a[0]
    names = [full if k == 0 else f"{full}.{k + 1}" for k in range(n)]

    def rate(k):
        return lambda env: (b[k] * env.value(keys["transfer"]) - a[k] * env.state(names[0])
                            + (env.state(names[k + 1]) if k + 1 < n else 0))
    return [State(names[k], start if k == 0 else 0.0, rate=rate(k)) for k in range(n)], None


def controller(scope, full, keys, start):
    part = {word: scope.number(keys.get(word, "0")) for word in ("proportional", "integral", "derivative")}
    lag = scope.number(keys["filter"]) if "filter" in keys else None
    low, high = scope.vector(keys["limits"]) if "limits" in keys else (-np.inf, np.inf)
    usual = np.sqrt(part["derivative"] / part["integral"]) or part["proportional"] / part["integral"]
    within = scope.number(keys["tracking"]) if "tracking" in keys else usual

    def slope(env):
        if lag is None:
            return env.value(keys.get("slope", "0"))
        return (env.value(keys["pid"]) - env.state(f"{full}.filtered")) / lag

    def free(env):
        return (part["proportional"] * env.value(keys["pid"]) + env.state(f"{full}.integral")
                + (part["derivative"] * slope(env) if part["derivative"] else 0))

    def output(env):
        v = free(env)
        v = np.where(env.holds(v, "<", low), low, v) if np.isfinite(low) else v
        return np.where(env.holds(v, ">", high), high, v) if np.isfinite(high) else v

    def integral(env):
        back = 0 if broken("tracking of controllers") else (output(env) - free(env)) / within
        return part["integral"] * env.value(keys["pid"]) + (back if np.isfinite(high) else 0)
    states = [State(f"{full}.integral", start, rate=integral)]
    return states + ([State(f"{full}.filtered", 0.0, rate=slope)] if lag is not None else []), output
