# SPDX-License-Identifier: BSD-3-Clause
"""Equations of a plane mechanism of hinges with closed loops, for peers that integrate equations and derive none.

Lagrange's equations in the angles between bodies. Vectors are sums of arrows, each fixed in a body, so that a product of two
of them needs the sine and the cosine of the angle between these bodies alone, and arrows of one body give numbers: what one
writes by hand. Nothing of Kempe is used. `reduced` is the ODE of all angles and the independent rates: the other rates and
accelerations follow from the closures by elimination, in an order fixed at the start. `descriptor` is the index-3 DAE of
angles, rates, accelerations and multipliers (Hairer and Wanner, Solving Ordinary Differential Equations II, VII.7).
"""
import functools
import math


class Node:
    """A number of the equations: what is said twice is one node."""

    def __init__(self, graph, kind, of):
        self.graph, self.kind, self.of = graph, kind, of

    def __add__(self, other):
        return self.graph.add(self, other)

    def __radd__(self, other):
        return self.graph.add(self, other)

    def __neg__(self):
        return self.graph.mul(-1.0, self)

    def __sub__(self, other):
        return self.graph.add(self, self.graph.mul(-1.0, other))

    def __rsub__(self, other):
        return self.graph.add(other, -self)

    def __mul__(self, other):
        return self.graph.mul(self, other)

    def __rmul__(self, other):
        return self.graph.mul(self, other)

    def __truediv__(self, other):
        return self.graph.mul(self, self.graph.call("inverse", other))


class Graph:
    """Numbers are floats; what is none is a node. Nodes are in the order of their birth."""

    CALLS = {"sin": math.sin, "cos": math.cos, "sqrt": math.sqrt, "inverse": lambda x: 1 / x}

    def __init__(self):
        self.nodes = {}

    def node(self, kind, *of):
        key = (kind, *(x if not isinstance(x, Node) else id(x) for x in of))
        return self.nodes.setdefault(key, Node(self, kind, of))

    def var(self, name):
        return self.node("var", name)

    @staticmethod
    def order(a, b):
        return (a, b) if not isinstance(a, Node) or (isinstance(b, Node) and id(a) <= id(b)) else (b, a)

    def add(self, a, b):
        a, b = self.order(a, b)
        if not isinstance(a, Node):
            return b if a == 0 else self.node("add", a, b) if isinstance(b, Node) else a + b
        return self.node("add", a, b)

    def mul(self, a, b):
        a, b = self.order(a, b)
        if not isinstance(a, Node):
            if not isinstance(b, Node):
                return a * b
            if a in (0, 1):
                return b if a else 0.0
            if b.kind == "mul" and not isinstance(b.of[0], Node):
                return self.mul(a * b.of[0], b.of[1])
        return self.node("mul", a, b)

    def call(self, name, x):
        return self.node(name, x) if isinstance(x, Node) else self.CALLS[name](x)

    def values(self, given):
        """Of all nodes, with the variables given: node -> float."""
        out = {}
        get = lambda x: out[x] if isinstance(x, Node) else x
        for node in self.nodes.values():
            a = node.of
            out[node] = (given[a[0]] if node.kind == "var" else get(a[0]) + get(a[1]) if node.kind == "add"
                         else get(a[0]) * get(a[1]) if node.kind == "mul" else self.CALLS[node.kind](get(a[0])))
        return out

    def derivative(self, x, variable):
        """Of x by a variable."""
        known = {}

        def by(x):
            if not isinstance(x, Node):
                return 0.0
            if x not in known:
                known[x] = self.rule(x, variable, by)
            return known[x]

        return by(x)

    def rule(self, x, variable, by):
        if x.kind == "var":
            return 1.0 if x is variable else 0.0
        a = x.of
        if x.kind == "add":
            return self.add(by(a[0]), by(a[1]))
        if x.kind == "mul":
            return self.add(self.mul(by(a[0]), a[1]), self.mul(a[0], by(a[1])))
        d = by(a[0])
        outer = {"sin": lambda: self.call("cos", a[0]), "cos": lambda: -self.call("sin", a[0]), "sqrt": lambda: 0.5 * self.call("inverse", x),
                 "inverse": lambda: -(x * x)}[x.kind]
        return self.mul(outer(), d) if isinstance(d, Node) or d else 0.0

    def used(self, outputs):
        """Nodes that outputs need, in order."""
        found, left = set(), [x for x in outputs if isinstance(x, Node)]
        while left:
            x = left.pop()
            if x not in found:
                found.add(x)
                left += [y for y in x.of if isinstance(y, Node)]
        return [x for x in self.nodes.values() if x in found]

    def c(self, name, inputs, outputs):
        """A function in C: void name(const double *y, double *f)."""
        lines, names = [f"void {name}(const double *restrict y, double *restrict f)", "{"], {v: f"y[{k}]" for k, v in enumerate(inputs)}
        put = lambda x: names[x] if isinstance(x, Node) else repr(float(x))
        for k, x in enumerate(n for n in self.used(outputs) if n.kind != "var"):
            a = [put(y) for y in x.of]
            value = {"add": " + ".join(a), "mul": " * ".join(a), "inverse": f"1.0 / {a[0]}"}.get(x.kind, f"{x.kind}({a[0]})")
            names[x] = f"n{k}"
            lines.append(f"    const double n{k} = {value};")
        return "\n".join(lines + [f"    f[{k}] = {put(x)};" for k, x in enumerate(outputs)] + ["}", ""])

    def elsewhere(self, variables, functions, outputs):
        """Outputs as expressions of another package: variables and functions by name."""
        made = {}
        get = lambda x: made[x] if isinstance(x, Node) else x
        for x in self.used(outputs):
            a = x.of
            made[x] = (variables[a[0]] if x.kind == "var" else get(a[0]) + get(a[1]) if x.kind == "add" else get(a[0]) * get(a[1])
                       if x.kind == "mul" else 1.0 / get(a[0]) if x.kind == "inverse" else functions[x.kind](get(a[0])))
        return [get(x) for x in outputs]


class Planar:
    """given: a tree of hinges about z (tree.Tree with a start). M, C and the closures in a graph."""

    def __init__(self, given):
        self.given, self.graph, self.n = given, Graph(), given.n
        self.q = [self.graph.var(f"q{k}") for k in range(self.n)]
        self.v = [self.graph.var(f"v{k}") for k in range(self.n)]
        self.above = [self.chain(k) for k in range(len(given.bodies))]
        self.mass, self.bias = self.dynamics()
        self.gap, self.rows, self.second = self.closures()

    def chain(self, k):
        """A body and those that it hangs on, the last one first."""
        return () if k < 0 else (k, *self.chain(self.given.bodies[k]["parent"]))

    @functools.lru_cache(None)
    def turned(self, names, function):
        sum_of = 0.0
        for sign, k in names:
            sum_of = self.graph.add(sum_of, self.graph.mul(float(sign), self.q[k]))
        return self.graph.call(function, sum_of)

    def between(self, a, b, function):
        """Cosine or sine of the angle from body a to body b."""
        of = lambda k: set(self.above[k]) if k >= 0 else set()
        names = tuple(sorted([(1, k) for k in of(b) - of(a)] + [(-1, k) for k in of(a) - of(b)], key=lambda x: x[1]))
        if names and names[0][0] < 0:                     # cos is even, sin is odd
            value = self.turned(tuple((-s, k) for s, k in names), function)
            return value if function == "cos" else self.graph.mul(-1.0, value)
        return self.turned(names, function) if names else float(function == "cos")

    def dot(self, us, vs):
        return self.product(us, vs, lambda u, v: (u[0] * v[0] + u[1] * v[1], u[1] * v[0] - u[0] * v[1]))

    def cross(self, us, vs):
        return self.product(us, vs, lambda u, v: (u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1]))

    def product(self, us, vs, parts):
        out = 0.0
        for a, u, f in us:
            for b, w, g in vs:
                cosine, sine = parts(u, w)
                value = self.graph.add(self.graph.mul(cosine, self.between(a, b, "cos")), self.graph.mul(sine, self.between(a, b, "sin")))
                out = self.graph.add(out, self.graph.mul(self.graph.mul(f, g), value))
        return out

    def way(self, j, k, point):
        """Arrows (body, components, factor) from the hinge of body j to a point of body k, which hangs on it."""
        out = [(k, tuple(point[:2]), 1.0)]
        while k != j:
            at, k = self.given.bodies[k]["at"], self.given.bodies[k]["parent"]
            out.append((k, tuple(at[:2]), 1.0))
        return [x for x in out if any(x[1])]

    def whole(self, k, point):
        """From the ground's origin."""
        return self.way(-1, k, point) if k >= 0 else [(-1, tuple(point[:2]), 1.0)]

    def rate(self, k):
        out = 0.0
        for j in self.above[k] if k >= 0 else ():
            out = self.graph.add(out, self.v[j])
        return out

    def centripetal(self, arrows):
        """Acceleration by the rates alone."""
        return [(b, u, self.graph.mul(-1.0, self.graph.mul(self.rate(b), self.rate(b)))) for b, u, f in arrows if b >= 0]

    def dynamics(self):
        g, n = self.graph, self.n
        mass, bias = [[0.0] * n for _ in range(n)], [0.0] * n
        weight = [(-1, tuple(self.given.gravity[:2]), -1.0)]
        for k, b in enumerate(self.given.bodies):
            felt = self.centripetal(self.whole(k, b["com"])) + weight
            for i in self.above[k]:
                lever = self.way(i, k, b["com"])
                bias[i] = g.add(bias[i], g.mul(b["mass"], self.cross(lever, felt)))
                for j in self.above[k]:
                    mass[i][j] = g.add(mass[i][j], g.add(g.mul(b["mass"], self.dot(lever, self.way(j, k, b["com"]))), b["inertia"]["zz"]))
        for a, p, b, q, stiffness, damping, free in self.given.springs:
            self.spring(bias, (a, p), (b, q), stiffness, damping, free)
        for k, effort in self.given.efforts:
            bias[k] = g.add(bias[k], -effort)
        for k, stiffness, damping, rest in self.given.held:
            bias[k] = g.add(bias[k], g.add(g.mul(stiffness, g.add(self.q[k], -rest)), g.mul(damping, self.v[k])))
        return mass, bias

    def spring(self, bias, start, end, stiffness, damping, free):
        g = self.graph
        ends = self.whole(*end) + [(b, u, -f) for b, u, f in self.whole(*start)]
        length = g.call("sqrt", self.dot(ends, ends))
        pull = g.mul(stiffness, g.add(length, -free))
        slopes = {}                                       # of the length, by angle
        for sign, (k, p) in ((1.0, end), (-1.0, start)):
            for i in self.above[k] if k >= 0 else ():
                slopes[i] = g.add(slopes.get(i, 0.0), g.mul(sign, self.cross(self.way(i, k, p), ends)))
        slopes = {i: g.mul(x, g.call("inverse", length)) for i, x in slopes.items()}
        for i, slope in slopes.items():
            pull = g.add(pull, g.mul(damping, g.mul(slope, self.v[i])))
        for i, slope in slopes.items():
            bias[i] = g.add(bias[i], g.mul(pull, slope))

    def closures(self):
        """Gaps, their rows, what the rates leave at their second derivatives; two of each loop."""
        axes = ([(-1, (1.0, 0.0), 1.0)], [(-1, (0.0, 1.0), 1.0)])
        gaps, rows, seconds = [], [], []
        for a, p, b, q in self.given.closures:
            ends = self.whole(a, p) + [(k, u, -f) for k, u, f in self.whole(b, q)]
            signed = [(k, u, self.graph.mul(f, g[2])) for (k, u, f), g in ((x, y) for x in ends if x[0] >= 0 for y in self.centripetal([x]))]
            for axis in axes:
                row = [0.0] * self.n
                for sign, k, point in ((1.0, a, p), (-1.0, b, q)):
                    for i in self.above[k] if k >= 0 else ():
                        row[i] = self.graph.add(row[i], self.graph.mul(sign, self.cross(self.way(i, k, point), axis)))
                gaps.append(self.dot(axis, ends))
                rows.append([self.graph.mul(1.0, x) for x in row])
                seconds.append(self.dot(axis, signed))
        return gaps, rows, seconds

    def eliminate(self, rows, columns, pivots_of):
        """Solves rows for the unknowns in `columns`: the other columns are right-hand sides. Pivots are the sparsest of those
        that are at least a tenth of the largest of their row, by numbers at the start. Returns unknown -> row of right-hand sides."""
        g, rows, order, left = self.graph, [list(r) for r in rows], [], list(range(len(rows)))
        unknowns = list(columns)
        while left and unknowns:                          # redundant rows are left over
            number = pivots_of()
            size = lambda x: abs(number[x]) if isinstance(x, Node) else abs(x)
            full = lambda x: isinstance(x, Node) or x != 0
            found = []
            for r in left:
                top = max((size(rows[r][c]) for c in unknowns), default=0)
                for c in unknowns:
                    if full(rows[r][c]) and size(rows[r][c]) >= 0.1 * top > 1e-9:
                        fill = (sum(full(rows[r][d]) for d in unknowns) - 1) * (sum(full(rows[s][c]) for s in left) - 1)
                        found.append((fill, -size(rows[r][c]), r, c))
            _, _, r, c = min(found)
            inverse = g.call("inverse", rows[r][c])
            rows[r] = [x if not full(x) else g.mul(inverse, x) for x in rows[r]]
            rows[r][c] = 1.0
            for s in left:
                if s != r and full(rows[s][c]):
                    factor = rows[s][c]
                    rows[s] = [g.add(x, g.mul(g.mul(-1.0, factor), y)) if full(y) else x for x, y in zip(rows[s], rows[r])]
                    rows[s][c] = 0.0
            left.remove(r)
            unknowns.remove(c)
            order.append((r, c))
        for r, c in reversed(order):                      # back
            for s, d in order:
                if s != r and full(rows[s][c]):
                    factor = rows[s][c]
                    rows[s] = [g.add(x, g.mul(g.mul(-1.0, factor), y)) if full(y) else x for x, y in zip(rows[s], rows[r])]
                    rows[s][c] = 0.0
        return {c: rows[r] for r, c in order}

    def numbers(self):
        state = {f"q{k}": x for k, x in enumerate(self.given.q)} | {f"v{k}": x for k, x in enumerate(self.given.qd)}
        return self.graph.values(state)

    def reduced(self, independent):
        """States: all angles, rates of the independent ones. Returns variables and their rates."""
        g, n = self.graph, self.n
        width = n + 1                                     # the last column: what the rates leave
        rows = [r + [s] for r, s in zip(self.rows, self.second)]
        by = self.eliminate(rows, [k for k in range(n) if k not in independent], self.numbers) if rows else {}
        # q' = B u', q'' = B u'' + b
        b = [[float(i == u) for u in independent] if i in independent else [g.mul(-1.0, by[i][u]) for u in independent] for i in range(n)]
        rest = [0.0 if i in independent else g.mul(-1.0, by[i][n]) for i in range(n)]
        rates = [g.node("var", f"v{u}") for u in independent]
        speed = [sum_of(g, (g.mul(b[i][k], rates[k]) for k in range(len(independent)))) for i in range(n)]
        force = [g.add(self.bias[i], sum_of(g, (g.mul(self.mass[i][j], rest[j]) for j in range(n)))) for i in range(n)]
        system = []
        for k in range(len(independent)):
            carried = [sum_of(g, (g.mul(b[i][k], self.mass[i][j]) for i in range(n))) for j in range(n)]
            system.append([sum_of(g, (g.mul(carried[j], b[j][m]) for j in range(n))) for m in range(len(independent))]
                          + [sum_of(g, (g.mul(b[i][k], force[i]) for i in range(n)))])
        found = self.eliminate(system, range(len(independent)), self.numbers)
        second = [g.mul(-1.0, found[k][len(independent)]) for k in range(len(independent))]
        assert width == n + 1
        return [*self.q, *rates], self.without_dependent([*speed, *second], independent, speed)

    def without_dependent(self, outputs, independent, speed):
        """Dependent rates are put in by their expressions."""
        g, made = self.graph, {}
        for i in range(self.n):
            if i not in independent:
                made[self.v[i]] = speed[i]
        for x in list(g.used(outputs)):
            if x in made:
                continue
            of = [made.get(y, y) for y in x.of]
            if x.kind == "var" or all(p is q for p, q in zip(of, x.of)):
                made[x] = x
            else:
                made[x] = g.add(*of) if x.kind == "add" else g.mul(*of) if x.kind == "mul" else g.call(x.kind, *of)
        return [made.get(x, x) for x in outputs]

    def descriptor(self):
        """Variables q, v, a, lambda and the right-hand sides of q' = v, v' = a, 0 = M a + C - J' lambda, 0 = gap."""
        g, n = self.graph, self.n
        a, l = [g.var(f"a{k}") for k in range(n)], [g.var(f"l{k}") for k in range(len(self.rows))]
        balance = [g.add(g.add(self.bias[i], sum_of(g, (g.mul(self.mass[i][j], a[j]) for j in range(n)))),
                         g.mul(-1.0, sum_of(g, (g.mul(self.rows[r][i], l[r]) for r in range(len(l)))))) for i in range(n)]
        return [*self.q, *self.v, *a, *l], [*self.v, *a, *balance, *self.gap]

    def accelerations(self):
        """a and lambda at the start, by numbers: Gauss's elimination."""
        number = self.numbers()
        get = lambda x: number[x] if isinstance(x, Node) else x
        n, m = self.n, len(self.rows)
        rows = [[get(x) for x in self.mass[i]] + [-get(self.rows[r][i]) for r in range(m)] + [-get(self.bias[i])] for i in range(n)]
        rows += [[get(x) for x in self.rows[r]] + [0.0] * m + [-get(self.second[r])] for r in range(m)]
        for k in range(n + m):
            top = max(range(k, n + m), key=lambda i: abs(rows[i][k]))
            rows[k], rows[top] = rows[top], rows[k]
            for i in range(n + m):
                if i != k and rows[i][k]:
                    f = rows[i][k] / rows[k][k]
                    rows[i] = [x - f * y for x, y in zip(rows[i], rows[k])]
        return [rows[k][-1] / rows[k][k] for k in range(n + m)]


def sum_of(graph, terms):
    out = 0.0
    for x in terms:
        out = graph.add(out, x)
    return out


def radau(given):
    """C that closed_radau.c is linked with."""
    mechanism = Planar(given)
    g, out = mechanism.graph, ["#include <math.h>", ""]
    start = given.q + [given.qd[k] for k in given.independent]
    whole = given.q + given.qd + mechanism.accelerations()
    out.append(f"const int angles = {mechanism.n}, independent = {len(given.independent)}, reduced_size = {len(start)}, "
               f"descriptor_size = {len(whole)};")
    for name, numbers, (variables, rates) in (("reduced", start, mechanism.reduced(given.independent)), ("descriptor", whole, mechanism.descriptor())):
        out.append(f"const double {name}_start[] = {{{', '.join(map(repr, map(float, numbers)))}}};")
        out.append(g.c(f"{name}_rates", variables, rates))
        out.append(g.c(f"{name}_jacobian", variables, [g.derivative(f, v) for v in variables for f in rates]))
    return "\n".join(out)
