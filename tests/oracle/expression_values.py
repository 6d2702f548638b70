# SPDX-License-Identifier: BSD-3-Clause
"""The expressions of the model language, read from docs/model/expressions.md: grammar, units, functions. An
expression becomes a Python function of an environment, which says what names, q(..), qd(..) and lambda(..) are; its
values are numbers, arrays or jets."""
import functools
import math
import re

import numpy as np

from convention import broken
from jets import Jet, value

UNITS = {"m": 1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "km": 1e3, "rad": 1, "deg": math.pi / 180, "rev": 2 * math.pi, "s": 1,
         "ms": 1e-3, "us": 1e-6, "min": 60, "Hz": 1, "rpm": 2 * math.pi / 60, "kg": 1, "g": 1e-3, "N": 1, "mN": 1e-3,
         "kN": 1e3, "J": 1, "kJ": 1e3, "W": 1, "kW": 1e3, "Pa": 1, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "bar": 1e5}
TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([^\W\d]\w*)|(<=|>=|[-+*/^(),<>.]))")


def smooth(f, f1, f2):
    return lambda x: x.chain(f(x.v), f1(x.v), f2(x.v)) if isinstance(x, Jet) else f(x)


FUNCTIONS = {
    "sin": smooth(np.sin, np.cos, lambda x: -np.sin(x)),
    "cos": smooth(np.cos, lambda x: -np.sin(x), lambda x: -np.cos(x)),
    "tan": smooth(np.tan, lambda x: 1 / np.cos(x)**2, lambda x: 2 * np.tan(x) / np.cos(x)**2),
    "asin": smooth(np.arcsin, lambda x: (1 - x * x)**-0.5, lambda x: x * (1 - x * x)**-1.5),
    "acos": smooth(np.arccos, lambda x: -(1 - x * x)**-0.5, lambda x: -x * (1 - x * x)**-1.5),
    "atan": smooth(np.arctan, lambda x: 1 / (1 + x * x), lambda x: -2 * x / (1 + x * x)**2),
    "sinh": smooth(np.sinh, np.cosh, np.sinh),
    "cosh": smooth(np.cosh, np.sinh, np.cosh),
    "tanh": smooth(np.tanh, lambda x: 1 / np.cosh(x)**2, lambda x: -2 * np.tanh(x) / np.cosh(x)**2),
    "exp": smooth(np.exp, np.exp, np.exp),
    "log": smooth(np.log, lambda x: 1 / x, lambda x: -1 / (x * x)),
    "sqrt": smooth(np.sqrt, lambda x: 0.5 * x**-0.5, lambda x: -0.25 * x**-1.5),
    "abs": smooth(np.abs, np.sign, lambda x: 0 * x),
}


def choose(holds, x, y):
    """x where the condition holds, otherwise y; what is not chosen may be no number."""
    if not isinstance(x, Jet) and not isinstance(y, Jet):
        return np.where(holds, x, y)
    x, y = (z if isinstance(z, Jet) else Jet(z) for z in (x, y))
    return Jet(np.where(holds, x.v, y.v), np.where(holds, x.d, y.d), np.where(holds, x.e, y.e))


def power(x, y):
    if isinstance(y, Jet):
        return FUNCTIONS["exp"](y * FUNCTIONS["log"](x))
    if not isinstance(x, Jet):
        return np.power(np.asarray(x, float), y)
    first = y * np.power(x.v, y - 1) if np.any(y != 0) else 0 * x.v
    second = y * (y - 1) * np.power(x.v, y - 2) if np.any((y != 0) & (y != 1)) else 0 * x.v
    return x.chain(np.power(x.v, y), first, second)


def atan2(y, x):
    if not isinstance(x, Jet) and not isinstance(y, Jet):
        return np.arctan2(y, x)
    x, y = (z if isinstance(z, Jet) else Jet(z) for z in (x, y))
    r2 = x * x + y * y
    d = (x.v * y.d - y.v * x.d) / r2.v
    return Jet(np.arctan2(y.v, x.v), d, (x.v * y.e - y.v * x.e) / r2.v - d * r2.d / r2.v)


PAIRS = {"atan2": atan2, "pow": power, "min": lambda x, y: choose(value(x) <= value(y), x, y),
         "max": lambda x, y: choose(value(x) >= value(y), x, y)}


class Parser:
    """Recursive descent; every method returns a function of an environment."""

    def __init__(self, text, names):
        self.tokens, self.names, self.place = [], names, 0
        text = text.strip()
        at = 0
        while at < len(text):
            found = TOKEN.match(text, at)
            if not found:
                raise ValueError(f"expression {text!r}")
            self.tokens.append(("number", found[1]) if found[1] else ("name", found[2]) if found[2] else ("sign", found[3]))
            at = found.end()

    def peek(self, ahead=0):
        return self.tokens[self.place + ahead] if self.place + ahead < len(self.tokens) else ("end", "")

    def take(self, sign=None):
        kind, text = self.peek()
        if sign is not None and (kind, text) != ("sign", sign):
            raise ValueError(f"{sign!r} wanted, {text!r} found")
        self.place += 1
        return text

    def sum(self):
        left = self.product()
        while self.peek() in (("sign", "+"), ("sign", "-")):
            left = self.joined(left, self.take(), self.product())
        return left

    def product(self):
        left = self.factor()
        while self.peek() in (("sign", "*"), ("sign", "/")):
            left = self.joined(left, self.take(), self.factor())
        return left

    @staticmethod
    def joined(a, sign, b):
        return {"+": lambda env: a(env) + b(env), "-": lambda env: a(env) - b(env), "*": lambda env: a(env) * b(env),
                "/": lambda env: a(env) / b(env)}[sign]

    def factor(self):
        if self.peek() == ("sign", "-"):
            self.take()
            inner = self.factor()
            return lambda env: -inner(env)
        base = self.primary()
        if self.peek() != ("sign", "^"):
            return base
        self.take()
        exponent = self.factor()
        return lambda env: power(base(env), exponent(env))

    def primary(self):
        kind, text = self.peek()
        self.place += 1
        if kind == "number":
            number = float(text) * self.units()
            return lambda env: number
        if (kind, text) == ("sign", "("):
            inner = self.sum()
            self.take(")")
            return inner
        if kind != "name":
            raise ValueError(f"{text!r} in an expression")
        if self.peek() == ("sign", "("):
            return self.call(text)
        return lambda env: env.name(text)

    def units(self):
        """The units behind a number; a name that is also a parameter's ends them behind * and /."""
        kind, text = self.peek()
        if kind != "name" or text not in UNITS:
            return 1.0
        self.take()
        factor = UNITS[text]**self.exponent()
        while (self.peek() in (("sign", "*"), ("sign", "/")) and self.peek(1)[0] == "name" and self.peek(1)[1] in UNITS
               and self.peek(1)[1] not in self.names):
            sign, unit = self.take(), self.take()
            factor = factor * UNITS[unit]**self.exponent() if sign == "*" else factor / UNITS[unit]**self.exponent()
        return factor

    def exponent(self):
        if self.peek() != ("sign", "^"):
            return 1
        self.take()
        minus = self.peek() == ("sign", "-") and self.take()
        return (-1 if minus else 1) * int(self.take())

    def reference(self):
        """JOINT, JOINT.k or LOOP.k up to the closing parenthesis."""
        text = ""
        while self.peek() != ("sign", ")"):
            text += self.take()
        self.take(")")
        return text

    def named_place(self):
        """BODY.POINT or BODY.POINT.x."""
        text = self.take()
        while self.peek() == ("sign", "."):
            text += self.take() + self.take()
        return text

    def measure(self, word):
        """A quantity of points or axes, behind its opening parenthesis."""
        places = [self.named_place()]
        while self.peek() == ("sign", ","):
            self.take()
            places.append(self.named_place())
        self.take(")")
        component = ""
        while self.peek() == ("sign", "."):
            self.take()
            component += self.take()
        return word, tuple(places), component

    def rate(self):
        """Rate of a distance or a position."""
        word = self.take()
        self.take("(")
        found = self.measure(word)
        self.take(")")
        return {"distance": ("approach", *found[1:]), "position": ("velocity", *found[1:])}[word]

    def call(self, word):
        self.take("(")
        if word in MEASURES or word == "rate":
            found = self.rate() if word == "rate" else self.measure(word)
            return lambda env: env.measure(*found)
        if word in ("q", "qd", "lambda"):
            what = self.reference()
            return {"q": lambda env: env.q(what), "qd": lambda env: env.qd(what),
                    "lambda": lambda env: env.multiplier(what)}[word]
        if word == "if":
            return self.condition()
        arguments = [self.sum()]
        while self.peek() == ("sign", ","):
            self.take()
            arguments.append(self.sum())
        self.take(")")
        if word == "sign":
            x = arguments[0]
            return lambda env: choose(env.holds(value(x(env)), "<", 0.0), -1.0, 1.0)
        if word in PAIRS:
            x, y = arguments
            return lambda env: PAIRS[word](x(env), y(env))
        x = arguments[0]
        if word in FUNCTIONS:
            return lambda env: FUNCTIONS[word](x(env))
        return lambda env: env.table(word)(x(env))

    def condition(self):
        a = self.sum()
        sign = self.take()
        b = self.sum()
        self.take(",")
        x = self.sum()
        self.take(",")
        y = self.sum()
        self.take(")")
        return lambda env: choose(env.holds(value(a(env)), sign, value(b(env))), x(env), y(env))


MEASURES = ("position", "velocity", "angular_velocity", "axes", "distance", "angle")


@functools.lru_cache(maxsize=20000)
def compiled(text, names):
    parser = Parser(text, names)
    made = parser.sum()
    if parser.peek()[0] != "end":
        raise ValueError(f"{parser.peek()[1]!r} behind an expression: {text!r}")
    return made


def uses(text, words):
    """True if an expression has one of these words in it."""
    return bool(words & set(re.findall(r"[^\W\d]\w*", text)))


class Table:
    """A function through points: a cubic spline whose third derivative is continuous at the second and the last but one
    point, or straight lines; straight on beyond the ends."""

    def __init__(self, x, y, method):
        self.x, self.y = np.asarray(x, float), np.asarray(y, float)
        self.bend = np.zeros(len(x)) if method == "linear" or len(x) < 3 else self.bends()

    def bends(self):
        x, y, n = self.x, self.y, len(self.x)
        h, slope = np.diff(x), np.diff(y) / np.diff(x)
        if n == 3:
            return np.full(3, 2 * (slope[1] - slope[0]) / (h[0] + h[1]))
        a, b = np.zeros((n, n)), np.zeros(n)
        for i in range(1, n - 1):
            a[i, i - 1:i + 2] = h[i - 1], 2 * (h[i - 1] + h[i]), h[i]
            b[i] = 6 * (slope[i] - slope[i - 1])
        a[0, :3] = (1, 0, 0) if broken("ends of splines") else (h[1], -(h[0] + h[1]), h[0])
        a[-1, -3:] = h[-1], -(h[-2] + h[-1]), h[-2]
        return np.linalg.solve(a, b)

    def pieces(self, x):
        i = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        h = self.x[i + 1] - self.x[i]
        inside = x if broken("tables go on straight") else np.clip(x, self.x[0], self.x[-1])
        a, b, m, n = (self.x[i + 1] - inside) / h, (inside - self.x[i]) / h, self.bend[i], self.bend[i + 1]
        f = a * self.y[i] + b * self.y[i + 1] + ((a**3 - a) * m + (b**3 - b) * n) * h * h / 6
        f1 = (self.y[i + 1] - self.y[i]) / h + ((1 - 3 * a * a) * m + (3 * b * b - 1) * n) * h / 6
        return f + f1 * (x - inside), f1, np.where(x == inside, a * m + b * n, 0.0)

    def __call__(self, x):
        return x.chain(*self.pieces(x.v)) if isinstance(x, Jet) else self.pieces(np.asarray(x, float))[0]
