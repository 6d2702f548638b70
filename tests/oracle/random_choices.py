# SPDX-License-Identifier: BSD-3-Clause
"""Random numbers, directions and axes as texts of the model language, and a document of texts as YAML."""
import collections
import re

import numpy as np

from mechanism import normal

UNITS = {"m": (("mm", 1e3), ("cm", 1e2), ("m", 1.0)), "kg": (("g", 1e3), ("kg", 1.0))}
BLOCKS = ("bodies", "joints", "loops", "forces", "sensors", "drives", "tables", "algebraic", "states")


class Choices:
    """One model's random stream. `features` counts what the model has in it."""

    def __init__(self, random, name, features=None):
        self.random, self.features = random, collections.Counter() if features is None else features
        self.document = {"kempe": "1", "name": name, "gravity": self.vector(6.0), "parameters": {}}

    def chance(self, p):
        return self.random.random() < p

    def one_of(self, *what):
        return what[self.random.integers(len(what))]

    def between(self, low, high):
        return float(np.round(self.random.uniform(low, high), 4))

    def number_text(self, x, unit=None):
        """Now and then with another unit, or as a parameter."""
        if unit in UNITS and self.chance(0.2):
            self.features["units"] += 1
            word, factor = self.one_of(*UNITS[unit])
            return f"{x * factor!r} {word}"
        if self.chance(0.08):
            self.features["parameters"] += 1
            name = f"p{len(self.document['parameters']) + 1}"
            self.document["parameters"][name] = repr(x / 2)
            return f"2*{name}"
        return repr(x)

    def vector(self, size, unit=None):
        values = [self.between(-size, size) for _ in range(3)]
        return [self.number_text(x, unit) if unit else repr(x) for x in values]

    @staticmethod
    def exact(v):
        return [repr(float(x)) for x in v]

    def direction(self):
        if self.chance(0.6):
            return self.one_of("x", "y", "z", "-x", "-y", "-z")
        self.features["oblique-axis"] += 1
        v = self.random.normal(size=3)
        return [repr(float(x)) for x in np.round(v / np.linalg.norm(v) + 0.05, 3)]

    def two_axes(self):
        """Two directions across each other, as texts."""
        if self.chance(0.5):
            return list(self.one_of(("x", "y"), ("y", "-x"), ("z", "y"), ("-z", "x"), ("x", "z")))
        a = normal(self.random.normal(size=3))
        b = normal(np.cross(a, self.random.normal(size=3)))
        return [self.exact(a), self.exact(b)]

    def axes(self):
        if self.chance(0.5):
            self.features["one-axis-alone"] += 1
            while True:
                key, v = self.one_of("x", "y", "z"), np.round(self.random.normal(size=3), 3)
                if normal(v)["xyz".index(key)] > -0.95:
                    return {key: self.exact(v) if self.chance(0.7) else self.one_of(*(a for a in "xyz"))}
        keys = self.one_of("xy", "xz", "zx", "yz", "zy", "yx")
        v = np.round(self.random.normal(size=(2, 3)), 3)
        return {keys[0]: self.exact(v[0]), keys[1]: self.exact(v[1])}

    def spline(self):
        x = np.cumsum(self.random.uniform(0.2, 0.4, 6)) - 1.0
        return {"x": [repr(float(np.round(v, 3))) for v in x], "y": [repr(self.between(-0.5, 0.5)) for _ in x]}



def flow(value):
    """A value in YAML's flow style."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(flow(v) for v in value) + "]"
    return value if re.fullmatch(r"[\w.+-][\w.+*/ ()-]*", value) else f'"{value}"'


def written(document):
    lines = []
    for key, value in document.items():
        if isinstance(value, dict) and value and key in BLOCKS:
            lines.append(f"{key}:")
            lines += [f"  {name}: {flow(keys)}" for name, keys in value.items()]
        elif value:
            lines.append(f"{key}: {flow(value)}")
    return "\n".join(lines) + "\n"
