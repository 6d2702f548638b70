# SPDX-License-Identifier: BSD-3-Clause
"""A flexible beam as particles (docs/model/flexible.md). Mass points stand on the axis, or with rotary inertia four in each
section, at Gauss points of the length, so that sums over them are the integrals of polynomials. Their places are X + U1 q + q'
U2 q, by the rod r' = R (e1 + gamma), R' = R theta~' to second order in the coordinates.

Of `first`, and of the turn of sections in `full`, the energy has the terms of second order u2 in products with the undeformed
place alone. A quadratic form has just these as half the difference of its values at X + u2 and X - u2: such particles have half
the mass, and half of it with a negative sign."""
import copy

import numpy as np
from numpy.polynomial import Polynomial

NODES = 16  # Gauss points of an integral: exact to degree 31
FAMILIES = (("y", "y"), ("z", "z"), ("torsion", "phi"), ("axial", "x"))
FAULTS = """shortening of the axis; turn of sections; angles of second order; order of angles; turn of the chord;
shear of sections; line of the chord; inertia of sections; inertia of second order; products of second order; damping; stiffness;
offset of stations; order of modes; size of modes; constant of torsion; coupled displacement; taper; momentum of shapes;
axes of the beam; axes of stations""".replace("\n", " ").split("; ")
PLANTED, ASKED = set(), set()  # errors; those that were asked for


def planted(name):
    """True if this error is planted on purpose."""
    assert name in FAULTS, name
    ASKED.add(name)
    return name in PLANTED


def tilde(a):
    """(3, n, x) -> (n, x, 3, 3): the matrices of cross products."""
    m = np.zeros(a.shape[1:] + (3, 3))
    m[..., 0, 1], m[..., 0, 2], m[..., 1, 2] = -a[2], a[1], -a[0]
    return m - np.swapaxes(m, -1, -2)


PLACES, WEIGHTS = np.polynomial.legendre.leggauss(NODES)


def gauss(length):
    return 0.5 * length * (PLACES + 1), 0.5 * length * WEIGHTS


class Shape:
    """Of one coordinate: the polynomials of x of the rotation theta, of the strain gamma and of the axis' displacement r1."""

    def __init__(self, beam, family, own):
        zero = Polynomial([0.0])
        self.family, self.own, self.turn, self.strain = family, own, [zero] * 3, [zero] * 3
        if family in "yz":
            s = beam.slip["yz".index(family)]
            slope, slip = own.deriv(), -s * own.deriv(3)
            if beam.frame == "chord" and not planted("line of the chord"):
                rise = slip.integ()
                slope = slope - (rise(beam.length) - rise(0)) / beam.length
            self.turn[2 if family == "y" else 1] = slope if family == "y" else -slope
            self.strain["xyz".index(family)] = 0 * slip if planted("shear of sections") else slip
        elif family == "torsion":
            self.turn[0] = own
        else:
            self.strain[0] = own.deriv()
        rates = [self.strain[0], self.strain[1] + self.turn[2], self.strain[2] - self.turn[1]]
        self.way = [rate.integ() - rate.integ()(0) for rate in rates]
        if beam.frame == "mean" and family != "torsion":
            c = ("axial", "y", "z").index(family)
            self.way[c] = self.way[c] + own(0)

    def measured(self):
        return {"y": self.way[1], "z": self.way[2], "torsion": self.turn[0], "axial": self.way[0]}[self.family]


def values(fields, x):
    """[shape][3] of polynomials at x: (3, n, x)."""
    return np.array([[np.broadcast_to(f[c](x), np.shape(x)) for f in fields] for c in range(3)])


class Beam:
    made = {}  # by what they are made of: a model is read again for each look at its loops, and for each planted error

    @classmethod
    def of(cls, scope, keys):
        """A beam of its own, whose shapes, particles and stations it shares with those of the same keys and parameters."""
        if len(cls.made) > 50:
            cls.made.clear()
        known = cls.made.setdefault(repr((keys, scope.texts)), [])
        for asked, had, beam in known:
            if PLANTED & asked == had:  # planted errors that it did not ask for do not concern it
                return copy.copy(beam)
        ASKED.clear()
        beam = cls(scope, keys)
        known.append((set(ASKED), PLANTED & ASKED, beam))
        return copy.copy(beam)

    def __init__(self, scope, keys):
        self.scope, self.keys, self.known = scope, keys, {}
        self.frame = keys.get("frame", "clamped")
        shapes = keys["shapes"]
        self.counts = {family: int(shapes.get(family, "0")) for family, _ in FAMILIES}
        twists = self.counts["torsion"] > 0
        self.stiffening = keys.get("stiffening", "full" if twists else "first")
        self.rotary = keys.get("rotary", "yes" if twists else "no") == "yes"
        self.sheared = keys.get("shear", "no") == "yes"
        self.read(keys["beam"])
        self.axes = self.own_axes(keys["beam"])
        self.names = [f"{word}{k + 1}" for family, word in FAMILIES for k in range(self.counts[family])]
        self.n = len(self.names)
        self.shapes = [shape for family, _ in FAMILIES if self.counts[family] for shape in self.family(family)]
        self.stiffness = self.strain_energy(self.shapes)
        self.particles()
        self.mass = self.modal_mass()
        self.damping = self.damped(keys.get("damping", {}))
        if planted("stiffness"):
            self.stiffness = self.stiffness + 1e-3 * np.diag(np.diag(self.stiffness))

    # -- what it is made of

    def read(self, keys):
        number = lambda key: self.scope.number(keys[key]) if key in keys else 0.0
        self.length = number("length")
        stations = "at" in keys.get("taper", {})
        self.stations = [self.scope.number(x) for x in keys["taper"]["at"]] if stations else [0.0, self.length]
        given = keys["taper"]["section"] if stations else [keys[key] for key in ("section", "taper") if key in keys]
        if not given:
            two = lambda key: np.full(2, number(key)) if not isinstance(keys.get(key), list) else self.scope.vector(keys[key])
            self.line = number("rhoA")
            self.second = two("rhoI")[::-1]  # of y^2, of z^2
            self.bend, self.twist, self.stretch = [number("EIz"), number("EIy")], number("GJ"), number("EA")
            shear = two("kGA")
        else:
            young, density = number("young"), number("density")
            if "shear" in keys:
                modulus = number("shear")
                poisson = young / (2 * modulus) - 1
            else:
                poisson = number("poisson")
                modulus = young / (2 * (1 + poisson))
            area, second, twist, part = self.section(given[0], poisson)
            self.line, self.second = density * area, density * second
            self.bend, self.twist, self.stretch = young * second, modulus * twist, young * area
            shear = modulus * area * part
        if not self.rotary or planted("inertia of sections"):
            self.second = np.zeros(2)
        self.slip = [b / g if self.sheared and g else 0.0 for b, g in zip(self.bend, shear)]
        self.shear = shear
        self.moduli = (density, young, modulus, poisson) if "taper" in keys else None
        self.sections = [next(iter(keys.items())) for keys in given]

    def places(self):
        """Gauss points of all pieces between stations of the taper, and their weights."""
        made = [(begin + x, w) for begin, end in zip(self.stations, self.stations[1:]) for x, w in [gauss(end - begin)]]
        return tuple(np.concatenate(part) for part in zip(*made))

    def own_axes(self, keys):
        """Of the beam, as columns, in those of the body."""
        given = keys.get("axes", {"x": keys.get("along", "x")})
        if planted("axes of the beam"):
            return np.eye(3)
        return np.diag([-1.0, 1.0, -1.0]) if given == {"x": "-x"} else self.scope.axes(given)

    def along(self, x):
        """At places x: mass by length (x), its second moments (2, x), bending (2, x), torsional and axial stiffness (x)."""
        if not self.moduli or planted("taper"):
            spread = lambda v: np.multiply.outer(v, np.ones(len(x)))
            return [spread(v) for v in (self.line, self.second, np.array(self.bend), self.twist, self.stretch)]
        density, young, modulus, poisson = self.moduli
        kind, sizes = self.sections[0][0], np.array([self.dimensions(kind, given) for kind, given in self.sections])
        made = [self.section({kind: np.array([np.interp(at, self.stations, column) for column in sizes.T])}, poisson) for at in x]
        area, second, twist = (np.array([m[k] for m in made]).T for k in range(3))
        turned = density * second if np.any(self.second) else 0 * second
        return density * area, turned, young * second, modulus * twist, young * area

    def dimensions(self, kind, given):
        return np.atleast_1d(given if isinstance(given, np.ndarray) else self.scope.number(given) if kind == "circle" else self.scope.vector(given))

    def section(self, keys, poisson):
        """Area, int y^2 and int z^2, the constant of torsion, the parts of the area that carry shear."""
        (kind, given), = keys.items()
        if kind == "numbers":
            get = lambda key: self.scope.number(given.get(key, "0"))
            return get("A"), np.array([get("Iz"), get("Iy")]), get("J"), np.array([get("ky"), get("kz")])
        if kind == "rectangle":
            b, h = self.dimensions(kind, given)
            longer, shorter = max(b, h), min(b, h)
            odd = np.arange(1, 4001, 2)
            sum_ = np.sum((np.tanh(0.5 * np.pi * odd * longer / shorter) / odd**5)[::-1])
            twist = longer * shorter**3 * (1 / 3 - 64 / np.pi**5 * (0 if planted("constant of torsion") else shorter / longer) * sum_)
            part = 10 * (1 + poisson) / (12 + 11 * poisson)
            return b * h, np.array([b**3 * h, b * h**3]) / 12, twist, np.full(2, part)
        outer, inner = (*self.dimensions(kind, given), 0.0)[:2]
        second, m = np.pi / 64 * (outer**4 - inner**4), (inner / outer)**2
        part = 6 * (1 + poisson) * (1 + m)**2 / ((7 + 6 * poisson) * (1 + m)**2 + (20 + 12 * poisson) * m)
        return np.pi / 4 * (outer**2 - inner**2), np.full(2, second), 2 * second, np.full(2, part)

    # -- shapes

    def family(self, family):
        """The shapes of a family: powers, or the modes of their span with largest deflection 1, slowest first."""
        count, xi = self.counts[family], Polynomial([0.0, 1 / self.length])
        chord = self.frame == "chord"
        if family in "yz" and self.frame == "mean":
            made = [(2 * xi - 1)**(k + 2) for k in range(count)]
        elif family in "yz":
            made = [xi * (1 - xi) * (2 * xi - 1)**k if chord else xi**(k + 2) for k in range(count)]
        elif self.frame == "mean":
            made = [(2 * xi - 1)**(k + 1) for k in range(count)]
        elif family == "torsion" and chord:
            made = [(xi - 0.5)**(k + 1) - (-0.5)**(k + 1) for k in range(count)]
        else:
            made = [xi**(k + 1) for k in range(count)]
        shapes = [Shape(self, family, own) for own in made]
        if self.frame == "mean" and not planted("momentum of shapes"):
            shapes = [self.without_rigid(shape) for shape in shapes]
        if self.keys.get("raw", "no") == "yes":
            return shapes
        for _ in range(2):  # the second pass has nearly diagonal matrices, and little rounding
            modes = self.modes(shapes)
            shapes = [Shape(self, family, sum((c * shape.own for c, shape in zip(mode, shapes)), Polynomial([0.0]))) for mode in modes]
        if planted("order of modes"):
            shapes.reverse()
        return [Shape(self, family, shape.own / self.peak(shape.measured())) for shape in shapes]

    def without_rigid(self, shape):
        """Less the rigid motion with which it has mass: then it has no momentum."""
        rigid = [Shape(self, shape.family, Polynomial([0.0] * k + [1.0])) for k in range(2 if shape.family in "yz" else 1)]
        mass = self.mass_between([*rigid, shape])
        parts = np.linalg.solve(mass[:-1, :-1], mass[:-1, -1])
        return Shape(self, shape.family, shape.own - sum(c * r.own for c, r in zip(parts, rigid)))

    def modes(self, shapes):
        stiffness, mass = self.strain_energy(shapes), self.mass_between(shapes)
        size = 1 / np.sqrt(np.diag(mass))
        root = np.linalg.cholesky(mass * size[:, None] * size)
        inner = np.linalg.solve(root, np.linalg.solve(root, stiffness * size[:, None] * size).T)
        _, turned = np.linalg.eigh(0.5 * (inner + inner.T))
        return (size[:, None] * np.linalg.solve(root.T, turned)).T

    def peak(self, field):
        """The value where a field is largest; of equal ones that of the least x."""
        if planted("size of modes"):
            return field(self.length) if abs(field(self.length)) > 1e-6 else 1.0
        turning = [r.real for r in field.deriv().roots() if abs(r.imag) < 1e-9 and 0 < r.real < self.length]
        best = 0.0
        for x in sorted([0.0, *turning, self.length]):
            if abs(field(x)) > abs(best) * (1 + 1e-6):
                best = field(x)
        return best

    def mass_between(self, shapes):
        x, w = self.places()
        way, turn = values([s.way for s in shapes], x), values([s.turn for s in shapes], x)
        line, second = self.along(x)[:2]
        about = np.array([second.sum(0), second[1], second[0]])
        return np.einsum("ckx,clx,x->kl", way, way, line * w) + np.einsum("cx,ckx,clx,x->kl", about, turn, turn, w)

    def strain_energy(self, shapes):
        x, w = self.places()
        bent = values([[f.deriv() for f in s.turn] for s in shapes], x)
        strain = values([s.strain for s in shapes], x)
        _, _, bend, twist, stretch = self.along(x)
        rigid = np.array([twist, bend[1], bend[0]]), np.array([stretch, *np.multiply.outer(self.shear, np.ones(len(x)))])
        return sum(np.einsum("cx,ckx,clx,x->kl", k, f, f, w) for k, f in zip(rigid, (bent, strain)))

    # -- terms of second order

    def turns_of_second_order(self, x):
        """R2 (x, 3, 3, n, n): theta~(0)^2/2 + the integral of theta~ theta~'."""
        g, w = gauss(1.0)
        inner = np.multiply.outer(x, g)
        shape = inner.shape
        turn = tilde(values([s.turn for s in self.shapes], inner.ravel())).reshape((self.n,) + shape + (3, 3))
        bent = tilde(values([[f.deriv() for f in s.turn] for s in self.shapes], inner.ravel())).reshape((self.n,) + shape + (3, 3))
        start = tilde(values([s.turn for s in self.shapes], np.zeros(1)))[:, 0]
        turn = turn * (np.asarray(x)[:, None] * w)[..., None, None]
        left = turn.transpose(1, 3, 0, 2, 4).reshape(len(x), 3 * self.n, -1)  # k x g i a -> x i k, g a
        right = bent.transpose(1, 2, 3, 4, 0).reshape(len(x), -1, 3 * self.n)  # l x g a j -> x, g a, j l
        over = (left @ right).reshape(len(x), 3, self.n, 3, self.n).swapaxes(2, 3)
        return over + 0.5 * np.einsum("kia,laj->ijkl", start, start)

    def ways_of_second_order(self, x):
        """r2 (x, 3, n, n): the integral of R2 e1 + theta x gamma."""
        g, w = gauss(1.0)
        inner = np.multiply.outer(x, g).ravel()
        rate = self.turns_of_second_order(inner)[:, :, 0]
        if not planted("coupled displacement"):
            turn, strain = values([s.turn for s in self.shapes], inner), values([s.strain for s in self.shapes], inner)
            rate = rate + np.einsum("xkia,alx->xikl", np.moveaxis(tilde(turn), 0, 1), strain)
        weight = (np.asarray(x)[:, None] * w)
        made = np.einsum("xg,xgikl->xikl", weight, rate.reshape((len(x), NODES) + rate.shape[1:]))
        return 0 * made if planted("shortening of the axis") else made

    # -- particles

    def particles(self):
        """weight (p), place (p, 3), first (p, 3, n), second (p, 3, n, n)."""
        x, w = self.places()
        way = np.moveaxis(values([s.way for s in self.shapes], x), -1, 0)
        turn = tilde(values([s.turn for s in self.shapes], x))
        none = self.stiffening == "none"
        nothing = np.zeros((len(x), 3, self.n, self.n))
        axis = nothing if none else self.ways_of_second_order(x)
        rotated = np.zeros((len(x), 3, 3, self.n, self.n)) if none or planted("turn of sections") else self.turns_of_second_order(x)
        line, second = self.along(x)[:2]
        (y, z), none_of = np.sqrt(2 * second / line), 0 * x
        corners = [(y, none_of), (-y, none_of), (none_of, z), (none_of, -z)] if np.any(self.second) else [(none_of, none_of)]
        full = self.stiffening == "full"
        clouds = []
        for corner in corners:
            at = np.stack([none_of, *corner])
            place = np.stack([x, *corner], -1)
            first = way + np.einsum("kxia,ax->xik", turn, at)
            of_section = np.einsum("xiakl,ax->xikl", rotated, at)
            weight = line * w / len(corners)
            whole, part = (axis, of_section) if full else (nothing, axis + of_section)
            if planted("inertia of second order"):
                whole, part = (nothing, axis + of_section) if full else (axis, of_section)
            if planted("products of second order"):
                whole, part = whole + part, 0 * part
            clouds.append((weight, place, first, whole))
            if np.any(part):
                clouds += [(sign * 0.5 * weight, place, 0 * first, sign * part) for sign in (1.0, -1.0)]
        self.weight, self.place, self.first, self.more = (np.concatenate(c) for c in zip(*clouds))

    def modal_mass(self):
        return np.einsum("p,pik,pil->kl", self.weight, self.first, self.first)

    def damped(self, keys):
        if "rayleigh" in keys:
            a, b = self.scope.vector(keys["rayleigh"])
            return a * self.mass + b * self.stiffness
        made = np.zeros((self.n, self.n))
        if "ratio" in keys:
            modes = self.modes(self.shapes).T
            modes = modes / np.sqrt(np.sum(modes * (self.mass @ modes), 0))
            speed = np.sqrt(np.sum(modes * (self.stiffness @ modes), 0))
            load = self.mass @ modes
            made = load @ np.diag(2 * self.scope.number(keys["ratio"]) * speed) @ load.T
        return made * (1.001 if planted("damping") else 1)

    # -- stations

    def station(self, x):
        """Place, U1 (3, n), U2 (3, n, n); angles about x, y, z: first (3, n) and second (3, n, n) order."""
        key = (x, *PLANTED)
        if key not in self.known:
            self.known[key] = self.new_station(x)
        return self.known[key]

    def new_station(self, x):
        at = np.array([x])
        ways, angles = np.zeros((3, self.n, self.n)), np.zeros((3, self.n, self.n))
        if self.stiffening != "none":
            ways, turned = self.ways_of_second_order(at)[0], self.turns_of_second_order(at)[0]
            if not planted("angles of second order"):
                angles = np.stack([turned[2, 1], -turned[2, 0], turned[1, 0]])
        way, turn = (values([getattr(s, key) for s in self.shapes], at)[:, :, 0] for key in ("way", "turn"))
        return np.array([x, 0.0, 0.0]), way, ways, turn, angles
