# SPDX-License-Identifier: BSD-3-Clause
"""Overconstrained linkages in space as text of models, drawn where they are closed: planar four-bars, six-bars and scissors in a
random plane, Sarrus and Bennett linkages. Every body has the axes of the ground there, so that all coordinates are zero."""
import math
import random


def rotation(dice):
    """A random rotation, from a unit quaternion."""
    w, x, y, z = (dice.gauss(0, 1) for _ in range(4))
    n = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def turned(r, v):
    return [sum(r[i][k] * v[k] for k in range(3)) for i in range(3)]


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


class Linkage:
    """Bodies and closures given by points and axes of one drawing."""

    def __init__(self, name, dice, digits):
        self.name, self.dice, self.digits, self.r = name, dice, digits, rotation(dice)
        self.noise = random.Random(name)
        self.origin, self.points, self.bodies, self.loops, self.start = {"ground": [0, 0, 0]}, {"ground": {}}, [], [], {}

    def vector(self, v):
        return "[" + ", ".join(f"{x:.{self.digits}g}" if abs(x) > 1e-15 else "0" for x in v) + "]"

    def axis(self, v):
        """Each body has been exported on its own: the same direction is not rounded in the same way twice."""
        off = 0.5 * 10.0 ** -self.digits if self.digits < 17 else 0
        return self.vector([x + off * self.noise.uniform(-1, 1) for x in turned(self.r, v)])

    def point(self, body, at):
        name = f"P{len(self.points[body])}"
        self.points[body][name] = sub(turned(self.r, at), self.origin[body])
        return f"{body}.{name}"

    def body(self, name, kind, axis, parent, at, to):
        """A slender body of 1 kg from its joint `at` to `to`."""
        place = self.point(parent, at)
        self.origin[name], self.points[name] = turned(self.r, at), {}
        com = [x / 2 for x in sub(turned(self.r, to), self.origin[name])]
        inertia = sum(x * x for x in com) / 3 + 0.01
        self.bodies.append((name, f"{{{kind}: {self.axis(axis)}, at: {place}}}", com, inertia))

    def hinge(self, name, axis, first, second, at):
        self.loops.append(f"  {name}: {{revolute: [{self.point(first, at)}, {self.point(second, at)}], "
                          f"axes: [{self.axis(axis)}, {self.axis(axis)}]}}\n")

    def text(self):
        def points(body):
            return "{" + ", ".join(f"{k}: {self.vector(v)}" for k, v in self.points[body].items()) + "}"
        rows = "".join(f"  {n}: {{joint: {j}, mass: 1, com: {self.vector(c)}, inertia: {{xx: {i:.3g}, yy: {i:.3g}, zz: {i:.3g}}}, "
                       f"points: {points(n)}}}\n" for n, j, c, i in self.bodies)
        return (f"kempe: 1\nname: {self.name}\ngravity: [0, 0, -0.5]\nground: {{points: {points('ground')}}}\nbodies:\n{rows}"
                f"loops:\n{''.join(self.loops)}run: {{t_end: 1, output_step: 0.05, rtol: 1e-9}}\n")


def flat(angle, length, start=(0, 0, 0)):
    return [start[0] + length * math.cos(angle), start[1] + length * math.sin(angle), start[2]]


Z = [0, 0, 1]


def four_bar(x):
    d = x.dice
    a, b = [0, 0, 0], flat(d.uniform(.9, 1.6), d.uniform(.25, .4))
    c = flat(d.uniform(.1, .4), d.uniform(.6, .9), b)
    g = flat(d.uniform(-1.9, -1.3), d.uniform(.5, .7), c)
    x.body("crank", "revolute", Z, "ground", a, b)
    x.body("coupler", "revolute", Z, "crank", b, c)
    x.body("rocker", "revolute", Z, "ground", g, c)
    x.hinge("C", Z, "coupler", "rocker", c)
    return b, c


def six_bar(x):
    d = x.dice
    b, c = four_bar(x)
    p = flat(d.uniform(.5, 1.2), d.uniform(.3, .6), b)
    q = flat(d.uniform(-.3, .5), d.uniform(.5, .8), p)
    g = flat(d.uniform(-1.8, -1.2), d.uniform(.6, .9), q)
    x.body("rod", "revolute", Z, "coupler", p, q)
    x.body("arm", "revolute", Z, "ground", g, q)
    x.hinge("Q", Z, "rod", "arm", q)


def scissors(x):
    d, cells = x.dice, x.dice.choice((1, 2, 3))
    half, angle = d.uniform(.25, .4), d.uniform(.5, 1.)
    w, h = half * math.cos(angle), half * math.sin(angle)
    x.body("a1", "revolute", Z, "ground", [0, 0, 0], [2 * w, 2 * h, 0])
    x.body("b1", "revolute", Z, "a1", [w, h, 0], [0, 2 * h, 0])
    x.body("slide", "prismatic", [1, 0, 0], "ground", [2 * w, 0, 0], [2 * w, .1, 0])
    x.hinge("foot", Z, "b1", "slide", [2 * w, 0, 0])
    for k in range(2, cells + 1):
        y = 2 * h * (k - 1)
        x.body(f"a{k}", "revolute", Z, f"b{k - 1}", [0, y, 0], [2 * w, y + 2 * h, 0])
        x.body(f"b{k}", "revolute", Z, f"a{k - 1}", [2 * w, y, 0], [0, y + 2 * h, 0])
        x.hinge(f"M{k}", Z, f"a{k}", f"b{k}", [w, y + h, 0])


def sarrus(x):
    d = x.dice
    height, out, side = d.uniform(.5, .8), d.uniform(.25, .5), d.uniform(.2, .4)
    other = d.uniform(.9, 2.2)
    legs = []
    for angle in (0, other):
        c, s = math.cos(angle), math.sin(angle)
        legs.append(([-s, c, 0], [side * c, side * s, 0], [(side + out) * c, (side + out) * s, height / 2],
                     [side * c, side * s, height]))
    (u, foot, knee, top), (v, foot2, knee2, top2) = legs
    x.body("shin", "revolute", u, "ground", foot, knee)
    x.body("thigh", "revolute", u, "shin", knee, top)
    x.body("plate", "revolute", u, "thigh", top, top2)
    x.body("shin2", "revolute", v, "ground", foot2, knee2)
    x.body("thigh2", "revolute", v, "shin2", knee2, top2)
    x.hinge("top", v, "thigh2", "plate", top2)


def bennett(x):
    d = x.dice
    alpha, beta = d.uniform(.5, .9), d.uniform(1.2, 1.7)
    a = d.uniform(.4, .6)
    b = a * math.sin(beta) / math.sin(alpha)
    one = d.uniform(.7, 1.5)
    two = 2 * math.atan(math.sin((beta + alpha) / 2) / math.sin((beta - alpha) / 2) / math.tan(one / 2))
    r, p = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 0, 0]
    joints = [(p, Z)]
    for angle, length, twist in ((one, a, alpha), (two, b, beta), (-one, a, alpha), (-two, b, beta)):
        c, s, k, t = math.cos(angle), math.sin(angle), math.cos(twist), math.sin(twist)
        p = [i + j for i, j in zip(p, turned(r, [length * c, length * s, 0]))]
        r = times(r, times([[c, -s, 0], [s, c, 0], [0, 0, 1]], [[1, 0, 0], [0, k, -t], [0, t, k]]))
        joints.append((p, [row[2] for row in r]))
    assert max(map(abs, joints[4][0])) < 1e-12 and abs(joints[4][1][2] - 1) < 1e-12, "a Bennett linkage that is open"
    parent = "ground"
    for k in range(3):
        x.body(f"b{k + 1}", "revolute", joints[k][1], parent, joints[k][0], joints[k + 1][0])
        parent = f"b{k + 1}"
    x.hinge("last", joints[3][1], parent, "ground", joints[3][0])


KINDS = (four_bar, six_bar, scissors, sarrus, bennett)


def linkage(seed, digits=17):
    """The linkage of a seed as text: its kind is the seed's remainder."""
    kind = KINDS[seed % len(KINDS)]
    x = Linkage(kind.__name__.replace("_", "-"), random.Random(seed), digits)
    kind(x)
    return x.text()


def plane_bars(name, lengths, angles, more=""):
    """A planar chain of bars along x when all angles are zero, whose last end meets its own ground point by a ball."""
    at, to, rows, parent = [0., 0.], 0., "", "ground.O"
    for k, length in enumerate(lengths[:-1]):
        to += angles[k]
        at = [at[0] + length * math.cos(to), at[1] + length * math.sin(to)]
        rows += (f"  b{k}: {{joint: {{revolute: z, at: {parent}}}, mass: 1, com: [{length / 2!r}, 0.05, 0], inertia: {{zz: 0.02}}, "
                 f"points: {{E: [{length!r}, 0, 0]}}}}\n")
        parent = f"b{k}.E"
    start = ", ".join(f"b{k}: {angle!r}" for k, angle in enumerate(angles))
    return (f"kempe: 1\nname: {name}\ngravity: [0, -9.81, 0]\nground: {{points: {{O: [0, 0, 0], G: [{at[0]!r}, {at[1]!r}, 0]}}}}\n"
            f"bodies:\n{rows}loops:\n  L: {{ball: [{parent}, ground.G]}}\nstart: {{q: {{{start}}}}}\n"
            f"run: {{t_end: 1, output_step: 0.05, rtol: 1e-8{more}}}\n")


def independent(seed):
    """A mechanism without redundancy as text; every other kind is next to one where rows become dependent."""
    d, kind = random.Random(seed), seed % 4
    if kind == 0:
        return plane_bars("chain", [d.uniform(.3, 1.) for _ in range(4)], [d.uniform(-1.5, 1.5) for _ in range(3)])
    if kind == 1:
        return plane_bars("long chain", [d.uniform(.3, 1.) for _ in range(6)], [d.uniform(-1.5, 1.5) for _ in range(5)])
    off = 10 ** d.uniform(-6, -1)
    if kind == 2:  # nearly folded: all bars nearly in line
        return plane_bars("nearly folded", [.3, .8, .5, 1], [off, d.uniform(-1, 1) * off, math.pi + d.uniform(-1, 1) * off])
    a, b, turn = .4, 1., d.uniform(.05, 1.5)  # nearly a parallelogram
    return plane_bars("near parallelogram", [a, b, a, b], [turn, -turn + off, math.pi + turn + d.uniform(-1, 1) * off])
