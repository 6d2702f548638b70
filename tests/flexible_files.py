#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Flexible bodies from files: a blade of solid elements in a closed loop, the slider-crank of the IVP test set (Simeon 1998), a
Craig-Bampton beam, a beam in both forms, and mistakes. The files are made here, from the data of the bodies.

    python3 tests/flexible_files.py build/dev/kempe
"""
import functools
import io
import pathlib
import struct
import sys
import tempfile
import unittest
import zipfile

sys.dont_write_bytecode = True
import runs

try:
    import numpy as np
except ModuleNotFoundError:
    print("NumPy is missing")
    sys.exit(77)


# -- modes ---------------------------------------------------------------------------------------------

def modes_of(K, M):
    """Squares of the frequencies and modes of unit mass."""
    L = np.linalg.cholesky(M)
    B = np.linalg.solve(L, np.linalg.solve(L, K).T)
    values, y = np.linalg.eigh((B + B.T) / 2)
    return values, np.linalg.solve(L.T, y)


def integrals(weight, place, phi):
    """Of points: weight (p), place (p, 3), modes (p, 3, n)."""
    return {"m": weight.sum(), "b0": weight @ place, "P0": np.einsum("i,ia,ib->ab", weight, place, place),
            "S": np.einsum("i,iak->ak", weight, phi), "Z0": np.einsum("i,iak,ib->kab", weight, phi, place),
            "T": np.einsum("i,iak,ibl->klab", weight, phi, phi)}


# -- the blade -----------------------------------------------------------------------------------------

def blade_mesh():
    """A box of 10 x 2 x 1 elements, quadratic along each edge: nodes, stiffness (nn, 3, nn, 3), mass between nodes."""
    length, width, height, E, nu, rho = 0.5, 0.06, 0.008, 71e9, 0.33, 2750.0
    count = (10, 2, 1)

    def line(n, h):
        """int N N', int N dN', int dN dN' along an edge."""
        at, weight = np.polynomial.legendre.leggauss(3)
        found = np.zeros((3, 2 * n + 1, 2 * n + 1))
        for e in range(n):
            for x, w in zip(at, weight):
                N, d, i = np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2]), np.array([x - .5, -2 * x, x + .5]) * 2 / h, np.arange(2 * e, 2 * e + 3)
                for k, part in enumerate((np.outer(N, N), np.outer(N, d), np.outer(d, d))):
                    found[k][np.ix_(i, i)] += w * h / 2 * part
        return found

    edges = [line(n, size / n) for n, size in zip(count, (length, width, height))]

    def solid(choice):
        return np.kron(np.kron(*(edges[c][k] if k < 3 else edges[c][1].T for c, k in enumerate(choice[:2]))), edges[2][choice[2]] if choice[2] < 3 else edges[2][1].T)

    def slopes(i, j):
        choice = [0, 0, 0]
        if i == j:
            choice[i] = 2
        else:
            choice[i], choice[j] = 3, 1
        return solid(choice)

    lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)
    Ms = rho * solid([0, 0, 0])
    grid = [np.linspace(low, high, 2 * n + 1) for n, low, high in zip(count, (0, -width / 2, -height / 2), (length, width / 2, height / 2))]
    nodes = np.array([[x, y, z] for x in grid[0] for y in grid[1] for z in grid[2]])
    nn = len(nodes)
    shear = sum(slopes(c, c) for c in range(3))
    K = np.zeros((nn, 3, nn, 3))
    for i in range(3):
        for j in range(3):
            K[:, i, :, j] = lam * slopes(i, j) + mu * slopes(j, i) + (mu * shear if i == j else 0)
    return nodes, K, Ms


def blade(whole=True):
    """Arrays of the file of a blade, to be changed at will. Without `whole` integrals are left to the mass of the nodes."""
    return {name: array for name, array in reduced_blade().items() if whole or name not in ("m", "b0", "P0", "S", "Z0", "T")}


@functools.cache
def reduced_blade():
    """The mesh with rigid end faces, that at x = 0 fixed. Six static modes of the other one and four of the blade between both,
    made orthogonal."""
    length = 0.5
    nodes, K, Ms = blade_mesh()
    nn = len(nodes)
    K, M = K.reshape(3 * nn, 3 * nn), np.kron(Ms, np.eye(3))
    held, face = (np.repeat(nodes[:, 0] == x, 3) for x in (0, length))
    inner = ~(held | face)
    static = np.zeros((3 * nn, 6))
    for i in np.where(nodes[:, 0] == length)[0]:
        x = nodes[i] - [length, 0, 0]
        static[3 * i:3 * i + 3] = np.hstack([np.eye(3), [[0, x[2], -x[1]], [-x[2], 0, x[0]], [x[1], -x[0], 0]]])
    static[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[inner] @ static)
    fixed = np.zeros((3 * nn, 4))
    fixed[inner] = modes_of(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)])[1][:, :4]
    basis = np.hstack([static, fixed])
    values, Q = modes_of(basis.T @ K @ basis, basis.T @ M @ basis)
    phi = basis @ Q
    sign = np.sign(phi[np.abs(phi).argmax(0), np.arange(10)])
    phi, Q = (phi * sign).reshape(nn, 3, 10), Q * sign
    row, column = np.nonzero(Ms)
    file = {"format": "kempe-flexible-1", "units": "m kg s", "nodes": nodes, "modes": phi, "K": np.diag(values), "M": np.eye(10),
            "mass_row": row, "mass_col": column, "mass_value": Ms[row, column], "interface_names": np.array(["A", "B"]),
            "interface_place": np.array([[0, 0, 0], [length, 0, 0]]),
            "interface_displacement": np.stack([np.zeros((3, 10)), Q[:3]]), "interface_rotation": np.stack([np.zeros((3, 10)), Q[3:6]])}
    moved = np.einsum("ij,jak->iak", Ms, phi)
    return file | {"m": Ms.sum(), "b0": Ms.sum(0) @ nodes, "P0": nodes.T @ Ms @ nodes, "S": moved.sum(0), "Z0": np.einsum("iak,ib->kab", moved, nodes),
                   "T": np.einsum("iak,ibl->klab", phi, moved)}


BLADE = """kempe: 1
gravity: [0, 0, -9.81]
bodies:
  blade:
    joint: {name: th, revolute: [0, 0.866025403784438647, 0.5], at: ground}
    flexible: {file: blade.npz, damping: {ratio: 0.01}}
    mass: 0.66
    points: {P: {node: 313}, B: {interface: B}}
  crank:
    joint: {name: A, revolute: -y, at: ground.C}
    inertia: {yy: 1}
    points: {pin: [60 mm, 0, 0]}
ground: {points: {C: [0.5, 0.05, -0.35]}}
loops: {rod: {rod: [blade.P, crank.pin], length: 320 mm}}
drives: {d: {joint: A, angle: "40*t"}}
start: {q: {th: 0.08396196752157}}
run: {t_end: 0.15, rtol: 1e-11, output_step: 0.01, outputs: [q, qd, position(blade.P), lambda(rod)]}
"""
HELD = BLADE.replace('angle: "40*t"', "locked: yes")
# t: angle, rate, tip, tension of the rod, three modes: Lagrange's equations of the nodes by automatic derivatives
MOTION = {
    0.02: (-0.0259297822558, -4.57165639713, (0.500268700249, 0.023474897081, 0.009223860996), 18.874886280, (-7.5061071563e-04, -4.1995583138e-05, -1.6411963634e-05)),
    0.05: (-0.0561688794373, 2.71834577661, (0.500181536384, 0.015910293523, 0.021741312990), 28.734294446, (-9.4747858433e-04, -7.1038459469e-05, -1.6818536242e-05)),
    0.10: (0.1852753711083, 3.33573326851, (0.488970306997, 0.075971070940, -0.077711929999), -21.177323469, (6.7771492782e-04, 5.1871493715e-05, 1.2750684016e-05)),
    0.15: (0.1274081179196, -5.63228187711, (0.494212666922, 0.061739870354, -0.053327653770), -16.502211531, (5.8980338488e-04, 3.9940808020e-05, 1.1757814136e-05)),
}


# -- the slider-crank ----------------------------------------------------------------------------------

L1, L2, PI, YOUNG, EDGE, RHO = 0.15, 0.3, 3.1415927, 0.2e12, 0.008, 7870.0
MASS, INERTIA = 0.151104, 0.0045339259  # of the rod


def slider_rod(damped):
    """The matrices of the problem as integrals of a body."""
    volume = EDGE * EDGE * L2
    fm, fk = RHO * volume, YOUNG * EDGE * EDGE / L2
    M, K, B, D = np.zeros((4, 4, 4))
    M[:2, :2], M[2:, 2:] = np.diag([.5, .5]) * fm, np.array([[8, 1], [1, 2]]) * fm
    K[:2, :2] = np.diag([1 / 24, 2 / 3]) * fk * PI**4 * (EDGE / L2)**2
    K[2:, 2:] = np.array([[16, -8], [-8, 7]]) / 3 * fk
    B[0, 2], B[0, 3], B[1, 3] = -16 / PI**3, 8 / PI**3 - 1 / PI, .5 / PI
    B = volume * (B - B.T)
    D[:2, :2], D[2:, 2:] = np.diag([5, 25]), .5 * np.array([[2.308375455264791e2, -2.62688487992052e2], [-2.62688487992052e2, 4.217421837156818e2]])
    T, S, Z = np.zeros((4, 4, 3, 3)), np.zeros((3, 4)), np.zeros((4, 3, 3))
    T[:, :, 0, 0], T[:, :, 1, 0], T[:, :, 0, 1] = M, RHO * B.T / 2, -RHO * B.T / 2
    S[0], S[1] = RHO * volume * np.array([0, 0, 2 / 3, 1 / 6]), RHO * volume * np.array([2 / PI, 0, 0, 0])
    Z[:, 0, 0], Z[:, 1, 0] = RHO * L2 * volume * np.array([0, 0, 1 / 3, 1 / 6]), RHO * L2 * volume * np.array([1 / PI, -.5 / PI, 0, 0])
    end = np.zeros((2, 3, 4))
    end[1, 0, 3] = 1
    file = {"format": "kempe-flexible-1", "units": "m kg s", "K": K, "M": M, "m": MASS, "b0": np.array([MASS * L2 / 2, 0, 0]),
            "P0": np.diag([INERTIA, 0, 0]), "S": S, "Z0": Z, "T": T, "interface_names": np.array(["A", "B"]),
            "interface_place": np.array([[0, 0, 0], [L2, 0, 0]]), "interface_displacement": end, "interface_rotation": np.zeros((2, 3, 4))}
    return file | ({"D": D} if damped else {})


def slider_crank(start, rates, nonlinear):
    k, b = .5 * YOUNG * EDGE * EDGE / L2**2 * PI**2, 80 / (PI**2 * 9)
    q = [f"q(rod.mode{i})" for i in range(1, 5)]
    bow = f"{b!r}*(-4*{q[2]} + 2*{q[3]})"
    forces = [f"{q[0]}*{q[3]} - {q[1]}*{bow}", f"4*{q[1]}*{q[3]} - {q[0]}*{bow}", f"4*{b!r}*{q[0]}*{q[1]}", f"0.5*{q[0]}^2 + 2*{q[1]}^2 - 2*{b!r}*{q[0]}*{q[1]}"]
    lines = [f'  f{i + 1}: {{joint: rod.mode{i + 1}, force: "-{k!r}*({force})"}}' for i, force in enumerate(forces)]

    def four(values):
        return ", ".join(f"rod.mode{i + 1}: {x!r}" for i, x in enumerate(values))

    return "\n".join(["kempe: 1", "bodies:", "  crank: {joint: {name: A, revolute: z, at: ground}, inertia: {zz: 0.002727}, points: {P: [0.15, 0, 0]}}",
                      "  rod: {joint: {name: R, revolute: z, at: crank.P}, flexible: {file: rod.npz}, points: {B: {interface: B}}}",
                      "  slider: {joint: {name: X, prismatic: x, at: ground}, mass: 0.075552, points: {P: [0, 0, 0]}}",
                      "loops: {pin: {revolute: [rod.B, slider.P], axis: z}}", 'drives: {d: {joint: A, angle: "150*t"}}', *(["forces:", *lines] if nonlinear else []),
                      f"start: {{q: {{A: 0, R: 0, X: {L1 + L2 + start[3]!r}, {four(start)}}}, qd: {{{four(rates)}}}}}",
                      "run: {t_end: 0.1, rtol: 1e-12, atol: 1e-14, output_step: 0.1, outputs: [q, qd, lambda]}", ""])


BEGIN = ((0.0, 0.0, .103339863e-4, .169327969e-4), (.444896105, .463434311e-2, -.178591076e-5, -.268938672e-5))
REST = ((0.0,) * 4, (0.0,) * 4)
# phi2, x3, q1 .. q4; w2, qd1 .. qd4; three multipliers, at t = 0.1, by DOP853 in the published matrices
CRANKS = {
    "linear": (BEGIN, False, False, (-3.311734988256446e-01, 1.697373326399585e-01, 1.893192843019977e-04, 2.375751320488482e-05, -5.323896778190885e-06, -8.363313291670509e-06),
               (60.25346755129598, -3.005541170950031e-02, -5.500430645932758e-03, 4.974111663948e-04, 1.105559971554e-03), (-62.32935927834, -163.7920993443, 25.29857948788)),
    "nonlinear": (BEGIN, True, False, (-3.311738876283186e-01, 1.697369739244488e-01, -1.180767246911809e-04, 2.365146392724776e-05, -5.475025837701899e-06, -8.702536690241243e-06),
                  (60.25087973974386, -4.920707774723295e-01, -6.742607150324628e-03, -3.677991385708e-04, -1.218730797713e-03), (-87.39734041123, -163.5529006697, 29.31975169750)),
    "damped": (BEGIN, False, True, (-3.311735025564397e-01, 1.697373291978640e-01, 2.108031932636729e-04, 2.382368225206038e-05, -5.332459085938681e-06, -8.366568347658491e-06),
               (60.25280316233999, -3.897054373363786e-02, -5.646051392019996e-03, 2.671062201186e-04, 5.252539164024e-04), (-60.62434309917, -163.7105981163, 25.06042599028)),
    "at rest": (REST, False, False, (-3.311790060439120e-01, 1.697322516687284e-01, -1.417236825414966e-04, 2.162529675539181e-05, -7.934711992362019e-06, -1.316818725207322e-05),
                (60.16395192590953, 1.219492355017e-01, -3.419542301995e-02, -7.968995756468e-02, -7.793421798921e-02), (-103.1291481607, -200.0878853118, 32.20466862)),
}


# -- the Craig-Bampton beam ----------------------------------------------------------------------------

def free_beam(k):
    """A free beam in a plane, 20 elements with axial displacements: all six static modes of its ends, and k with both ends fixed."""
    length, area, second, E, rho, count = 1.0, 1e-3, 1e-8, 2e11, 7850.0, 20
    h, n = length / count, 3 * (count + 1)
    M, K, weight, place, rows = np.zeros((n, n)), np.zeros((n, n)), [], [], []
    bend = E * second / h**3 * np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h], [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])
    for e in range(count):
        at, b = [3 * e, 3 * e + 3], [3 * e + 1, 3 * e + 2, 3 * e + 4, 3 * e + 5]
        K[np.ix_(b, b)] += bend
        K[np.ix_(at, at)] += E * area / h * np.array([[1, -1], [-1, 1]])
        for x, w in zip(*np.polynomial.legendre.leggauss(4)):
            s, row = (x + 1) / 2, np.zeros((3, n))
            row[0, at] = 1 - s, s
            row[1, b] = 1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)
            weight.append(w * h / 2 * rho * area)
            place.append([(e + s) * h, 0, 0])
            rows.append(row)
    weight, place, rows = np.array(weight), np.array(place), np.array(rows)
    M = np.einsum("i,iak,ial->kl", weight, rows, rows)
    ends, inner = [0, 1, 2, n - 3, n - 2, n - 1], np.arange(3, n - 3)
    basis = np.zeros((n, 6 + k))
    basis[ends, :6] = np.eye(6)
    basis[inner, :6] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, ends)])
    basis[inner, 6:] = modes_of(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)])[1][:, :k]
    way, turn = np.zeros((2, 3, 6 + k)), np.zeros((2, 3, 6 + k))
    for end in range(2):
        way[end, 0, 3 * end] = way[end, 1, 3 * end + 1] = turn[end, 2, 3 * end + 2] = 1
    return integrals(weight, place, np.einsum("iak,kl->ial", rows, basis)) | {
        "format": "kempe-flexible-1", "units": "m kg s", "K": basis.T @ K @ basis, "M": basis.T @ M @ basis, "interface_names": np.array(["A", "B"]),
        "interface_place": np.array([[0, 0, 0], [length, 0, 0]]), "interface_displacement": way, "interface_rotation": turn}


PINNED = """kempe: 1
bodies: {beam: {joint: {name: A, revolute: z, at: ground}, flexible: {file: beam.npz, frame: FRAME}, points: {B: {interface: B}}}}
ground: {points: {O: [0, 0, 0]}}
loops: {B: {point_on_line: [ground.O, beam.B], axis: x}}
"""
FREE = """kempe: 1
bodies:
  beam: {joint: {name: A, planar: z, at: ground}, flexible: {file: beam.npz, frame: FRAME}, points: {B: {interface: B}}}
"""
# modes with both ends fixed: the first frequencies of the free beam; of the beam on pins
BEAM = {0: ((428.298366148889, 1462.917423689831), (174.852075788748, 801.272872722244)),
        2: ((358.402486043575, 988.734728868041, 3252.069448472986), (157.547856815272, 630.577193368282)),
        4: ((357.263529446884, 985.320548388491, 1938.15907820649, 3202.922286267026, 9292.66432967194), (157.536438648792, 630.172065779000, 1420.277467238652)),
        8: ((357.126314943937, 984.51205939332, 1930.817864384032), (157.536108094798, 630.148993732556, 1417.905603765546))}


class Folder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def put(self, text, name, arrays, write=np.savez_compressed):
        root = pathlib.Path(self.folder.name)
        write(root / name, **arrays)
        (root / "model.yaml").write_text(text)
        return root / "model.yaml"

    def near(self, found, expected, tolerance, what=""):
        self.assertLessEqual(abs(found - expected), tolerance, f"{what}: {found!r} for {expected!r}")


class Blade(Folder):
    def check(self, model, *words):
        _, rows = runs.simulated(model, *words)
        for t, (angle, rate, tip, tension, modes) in MOTION.items():
            row = min(rows, key=lambda r: abs(r["t"] - t))
            self.near(row["q.th"], angle, 1e-10, f"angle at {t}")
            self.near(row["qd.th"], rate, 1e-8, f"rate at {t}")
            for c, x in zip("xyz", tip):
                self.near(row[f"position.blade.P.{c}"], x, 1e-10, f"tip at {t}")
            self.near(0.32 * row["lambda.rod.1"], -tension, 2e-7, f"tension at {t}")
            for k, x in enumerate(modes):
                self.near(row[f"q.blade.mode{k + 1}"], x, 1e-11, f"mode {k + 1} at {t}")

    def test_motion(self):
        self.check(self.put(BLADE, "blade.npz", blade()))

    def test_nodal_mass_and_stored(self):
        self.check(self.put(BLADE, "blade.npz", blade(whole=False), np.savez))

    def test_projected_and_dae(self):
        for formulation in ("projected", "dae"):
            self.check(self.put(BLADE, "blade.npz", blade()), "--formulation", formulation)

    def check_rest(self, put):
        """`put` writes a model beside the blade."""
        model = put(HELD)
        rest = runs.kempe("equilibrium", model)
        for name, x in (("th", 0.0844352335343), ("blade.mode1", 6.78845646247e-05), ("blade.mode2", 1.03126790139e-05), ("blade.mode3", 1.85850705e-07)):
            self.near(rest["q"][name], x, 1e-12, name)
        self.near(0.32 * rest["lambda"]["rod.1"], 3.407584432, 1e-8, "tension")
        found = [complex(*x) for x in runs.kempe("modes", model)["eigenvalues"]][::2]
        for k, x in enumerate((-2.50234523 + 216.24205539j, -6.87218045 + 756.29486339j, -15.58260663 + 1848.75964906j, -30.34223905 + 2825.88349585j)):
            self.near(found[k], x, 2e-7, f"eigenvalue {k + 1}")
        model = put(HELD.replace(", damping: {ratio: 0.01}", ""))
        found = [abs(complex(*x)) for x in runs.kempe("modes", model)["eigenvalues"]][::2]
        for k, x in enumerate((216.250666135, 756.327360625, 1848.812085314, 2825.923538157, 5043.615116066, 6425.925860130)):
            self.near(found[k], x, 1e-7 * x, f"frequency {k + 1}")

    def test_equilibrium_and_modes(self):
        self.check_rest(lambda text: self.put(text, "blade.npz", blade()))

    def test_other_units(self):
        """The same body in mm and t, with units in the file or in the model: coordinates are lengths."""
        file = blade()
        for name, power in (("nodes", (1, 0)), ("m", (0, 1)), ("b0", (1, 1)), ("P0", (2, 1)), ("S", (0, 1)), ("Z0", (1, 1)), ("T", (0, 1)), ("M", (0, 1)), ("K", (0, 1)),
                            ("mass_value", (0, 1)), ("interface_place", (1, 0)), ("interface_rotation", (-1, 0))):
            file[name] = file[name] * 1e3 ** power[0] * 1e-3 ** power[1]
        self.check(self.put(BLADE, "blade.npz", file | {"units": "mm t s"}))
        del file["units"]
        self.check(self.put(BLADE.replace("blade.npz,", "blade.npz, scale: {length: 1 mm, mass: 1000 kg},"), "blade.npz", file))

    def test_interface_of_nodes(self):
        """The rigid end faces as interfaces by their nodes; modes that move their first interface, and lose that motion."""
        file = blade()
        a, b = (np.where(file["nodes"][:, 0] == x)[0].tolist() for x in (0, 0.5))
        place = f"interfaces: {{A: {a}, B: {b}}},"
        self.check(self.put(BLADE.replace("blade.npz,", f"blade.npz, {place}"), "blade.npz", file))
        x, rigid = file["nodes"], np.random.default_rng(0).normal(size=(6, 10))
        moved = rigid[:3] + np.cross(rigid[3:].T[None], x[:, None]).transpose(0, 2, 1)
        free = {key: file[key] for key in ("format", "units", "K", "nodes", "mass_row", "mass_col", "mass_value")} | {"modes": file["modes"] + moved}
        self.check(self.put(BLADE.replace("blade.npz,", f"blade.npz, {place}"), "blade.npz", free))

    def test_report(self):
        """The page draws the body by pieces from its joint to its points."""
        model = self.put(BLADE, "blade.npz", blade())
        page = model.parent / "run.html"
        runs.kempe("simulate", model, "--t-end", "0.02", "--report", page)
        self.assertIn("blade", page.read_text())

    def test_modes(self):
        """The first modes alone are those of a file that has no others."""
        file = blade()
        few = {key: x[..., :6] if key in ("modes", "S", "interface_displacement", "interface_rotation") else x[:6, :6] if key in ("K", "M", "T") else x[:6] if key == "Z0" else x
               for key, x in file.items()}
        ends = [runs.simulated(self.put(BLADE.replace("blade.npz,", f"blade.npz, {words}"), "blade.npz", arrays))[1][-1] for words, arrays in (("modes: 6,", file), ("", few))]
        self.assertEqual(ends[0], ends[1])
        self.assertNotIn("q.blade.mode7", ends[0])


    def test_mean_frame(self):
        """In mean axes the modes of the blade by itself are those of the free blade, and a free blade moves as in its frame."""
        text = "kempe: 1\ngravity: [0, 0, -9.81]\nbodies:\n  blade:\n    joint: {free: x, at: ground}\n    flexible: {file: blade.npz, frame: FRAME}\n" \
               "    points: {P: {node: 313}, A: {interface: A}}\nforces: {f: {at: blade.P, force: [0, 0, '2*sin(30*t)']}}\n" \
               "run: {t_end: 0.02, rtol: 1e-10, outputs: [position(blade.P), position(blade.A)]}\n"
        said, ends = {}, {}
        for frame in ("clamped", "mean"):
            model = self.put(text.replace("FRAME", frame), "blade.npz", blade())
            said[frame] = runs.kempe("check", model)["flexible_bodies"][0]
            ends[frame] = runs.simulated(model)[1][-1]
        for k in range(3):
            self.near(said["mean"]["fixed"][k], said["clamped"]["free"][k], 1e-9 * said["clamped"]["free"][k], f"frequency {k + 1}")
        for name, x in ends["clamped"].items():
            if name.startswith("position"):
                self.near(ends["mean"][name], x, 2e-8, name)


class SliderCrank(Folder):
    def test_variants(self):
        for name, ((start, rates), nonlinear, damped, q, qd, multipliers) in CRANKS.items():
            model = self.put(slider_crank(start, rates, nonlinear), "rod.npz", slider_rod(damped))
            row = runs.simulated(model)[1][-1]
            self.near(row["q.R"] + 15, q[0], 1e-11, f"{name}: angle")
            self.near(row["q.X"], q[1], 1e-11, f"{name}: slider")
            self.near(row["qd.R"] + 150, qd[0], 1e-7, f"{name}: rate")
            for k in range(4):
                self.near(row[f"q.rod.mode{k + 1}"], q[2 + k], 1e-11, f"{name}: mode {k + 1}")
                self.near(row[f"qd.rod.mode{k + 1}"], qd[1 + k], 1e-7, f"{name}: rate {k + 1}")
            for key, x in (("lambda.pin.2", multipliers[0]), ("lambda.pin.1", multipliers[1]), ("lambda.d.1", multipliers[2])):
                self.near(abs(row[key]), abs(x), 1e-5 * abs(x), f"{name}: {key}")


class Beams(Folder):
    def test_craig_bampton(self):
        """Rigid motions among the modes are split off, in either frame."""
        for k, (free, pinned) in BEAM.items():
            for frame in ("clamped", "chord"):
                for text, expected in ((FREE, free), (PINNED, pinned)):
                    model = self.put(text.replace("FRAME", frame), "beam.npz", free_beam(k))
                    found = sorted({round(abs(complex(*x)), 9) for x in runs.kempe("modes", model)["eigenvalues"]})
                    found = [w for w in found if w > 1]
                    for i, w in enumerate(expected):
                        self.near(found[i], w, 3e-9 * w, f"{k} modes, {frame}, {'free' if text is FREE else 'pinned'} {i + 1}")

    def test_first(self):
        """Bending of second order by a file is that of the beam with the same shapes."""
        length, line, stiff = 1.0, 1.0, 10.0
        at, weight = np.polynomial.legendre.leggauss(8)
        x, w = (at + 1) / 2 * length, weight / 2 * line * length
        phi = np.zeros((8, 3, 2))
        phi[:, 1, 0], phi[:, 1, 1] = x**2, x**3
        exponent = [[3.0, 4.0], [4.0, 5.0]]
        factor = np.array([[4, 6], [6, 9]])
        shorter = [[lambda s, a=factor[i, j], b=exponent[i][j]: -a * s**b / b for j in range(2)] for i in range(2)]  # - int v_i' v_j'
        field = np.array([[shorter[i][j](x) for j in range(2)] for i in range(2)])
        h, Y, H = np.zeros((3, 2, 2)), np.zeros((3, 3, 2, 2)), np.zeros((2, 3, 2, 2))
        h[0], Y[0, 0] = field @ w, field @ (w * x)
        H[1, 0] = [[shorter[i][j](length) for j in range(2)] for i in range(2)]
        way, turn = np.zeros((2, 3, 2)), np.zeros((2, 3, 2))
        way[1, 1], turn[1, 2] = [1, 1], [2, 3]
        file = integrals(w, np.c_[x, 0 * x, 0 * x], phi) | {
            "format": "kempe-flexible-1", "units": "m kg s", "K": stiff * np.array([[4, 6], [6, 12]]), "interface_names": np.array(["A", "B"]), "interface_place": np.array([[0, 0, 0], [length, 0, 0]]),
            "interface_displacement": way, "interface_rotation": turn, "h": h, "Y": Y, "interface_H": H}
        text = """kempe: 1
gravity: [0, -9.81, 0]
bodies:
  arm: {joint: {name: A, revolute: z, at: ground}, flexible: {FLEXIBLE}, points: {B: {PLACE}}}
  end: {joint: {name: E, revolute: z, at: arm.B}, mass: 0.2, com: [0.1, 0, 0], inertia: {zz: 0.003}, points: {C: [0.2, 0, 0]}}
run: {t_end: 0.5, rtol: 1e-10, output_step: 0.1, outputs: [q, position(end.C)]}
"""
        one = runs.simulated(self.put(text.replace("FLEXIBLE", "file: arm.npz").replace("PLACE", "interface: B"), "arm.npz", file))[1]
        beam = f"beam: {{length: {length}, EIz: {stiff}, rhoA: {line}}}, shapes: {{y: 2}}, raw: yes, stiffening: first"
        other = runs.simulated(self.put(text.replace("FLEXIBLE", beam).replace("PLACE", "station: 1"), "arm.npz", file))[1]
        for a, b in zip(one, other, strict=True):
            for key, partner in (("q.A", "q.A"), ("q.arm.mode1", "q.arm.y1"), ("q.arm.mode2", "q.arm.y2"), ("position.end.C.x", "position.end.C.x"), ("position.end.C.y", "position.end.C.y")):
                self.near(a[key], b[partner], 1e-9, f"{key} at {a['t']}")
        soft = runs.simulated(self.put(text.replace("FLEXIBLE", "file: arm.npz, stiffening: none").replace("PLACE", "interface: B"), "arm.npz", file))[1]
        self.assertGreater(abs(soft[-1]["q.A"] - one[-1]["q.A"]), 1e-5)


# -- mistakes ------------------------------------------------------------------------------------------

def changed(name, entry, value):
    """A file whose array has another entry; all of it for entry None."""
    def change(file):
        array = np.array(value) if entry is None else np.array(file[name], copy=True)
        if entry is not None:
            array[entry] = value
        file[name] = array
    return change


def removed(*names):
    return lambda file: [file.pop(name) for name in names]


def many(*changes):
    return lambda file: [change(file) for change in changes]


def rigid_resists(file):
    file["K"] = file["K"] + 1e5 * np.eye(len(file["K"]))


# A change of the file of the beam, words of the model in place of others, and the sentence.
FILE = "file 'beam.npz' of body 'beam': "
MISTAKES = [
    (removed("format"), None, FILE + "it has no array 'format' with the word 'kempe-flexible-1'"),
    (changed("format", None, "kempe-flexible-2"), None, "array 'format' is 'kempe-flexible-2': 'kempe-flexible-1' is read"),
    (changed("format", None, 1.0), None, "array 'format' has numbers where words are expected"),
    (removed("units"), None, "it has no array 'units', such as 'm kg s': give the units of its numbers by 'scale: {length: 1, mass: 1}'"),
    (changed("units", None, "m N s"), None, "array 'units' is 'm N s': units of length, mass and time are expected"),
    (None, ("frame: clamped", "scale: {length: 1 mm}"), "it has its units in the array 'units': remove 'scale'"),
    (removed("T"), None, "it has no array 'T'"),
    (removed("K"), None, "it has no array 'K'"),
    (removed("interface_names", "interface_place"), None, "it has no interfaces: name nodes that joints hold"),
    (changed("K", None, np.zeros((3, 4))), None, "array 'K' is 3 x 4: a row and a column for each mode are expected"),
    (changed("K", None, np.zeros(3)), None, "array 'K' is 3: n x n is expected"),
    (changed("S", None, np.zeros((3, 9))), None, "array 'S' is 3 x 9: 3 x 8 is expected"),
    (changed("interface_rotation", None, np.zeros((2, 8))), None, "array 'interface_rotation' is 2 x 8: 2 x 3 x 8 is expected"),
    (changed("K", (0, 1), 5.0), None, "array 'K' is not symmetric: entry (1, 0)"),
    (changed("K", (0, 1), np.nan), None, "array 'K' has the entry nan, number 1: all must be finite"),
    (changed("P0", (0, 0), 1e200), None, "array 'P0' has the entry 1e+200, number 0: all must be finite, at most 1e+100"),
    (changed("M", (2, 2), 9.0), None, "arrays 'M' and 'T' differ: M[2, 2] is 9, the trace of T[2, 2] is"),
    (changed("T", (0, 1, 0, 1), 5.0), None, "array 'T': T[1, 0] is not the transpose of T[0, 1] (entry (1, 0)"),
    (changed("m", None, -1.0), None, "array 'm', the mass, is -1: it must be positive"),
    (changed("m", None, 0.1), None, "the mass of body and modes is not positive"),
    (changed("P0", (1, 0), 1.0), None, "array 'P0' is not symmetric: entry (1, 0) is 1, (0, 1) is 0"),
    (many(lambda f: f.update(K=-f["K"])), None, "the stiffness K is negative"),
    (rigid_resists, None, "the modes have 3 rigid motions, and K resists them"),
    (many(lambda f: f.update(K=0 * f["K"])), None, "K has 8 values of zero, and the modes have 3 rigid motions"),
    (changed("D", None, np.triu(np.ones((8, 8)))), None, "array 'D' is not symmetric"),
    (changed("h", None, np.zeros((3, 8, 8))), None, "it has some of the arrays 'h', 'Y' and 'interface_H', and not 'Y'"),
    (changed("mass_value", None, [1.0]), None, "the mass matrix of the nodes, 'mass_row', 'mass_col' and 'mass_value', needs 'nodes' and 'modes'"),
    (None, ("interface: B", "interface: C"), "it is A or B, not 'C'"),
    (None, ("interface: B", "node: 3"), "the node of point 'beam.B' is 3: the file has no nodes"),
    (None, ("{interface: B}", "[1, 0, 0]"), "a point of body 'beam' is at an interface or a node of its file"),
    (None, ("interface: B", "interface: B, node: 1"), "a point of body 'beam' is at an interface or a node of its file"),
    (None, ("interface: B", "station: 1"), "a point of body 'beam' is at an interface or a node of its file"),
    (None, ("frame: clamped", "interfaces: {A: A, B: X}"), "interface 'B' of body 'beam': the file has no interface 'X'; it has: 'A', 'B'"),
    (None, ("frame: clamped", "interfaces: {B: B}, frame: chord"), "the frame 'chord' is from its first interface to the second one"),
    (None, ("frame: clamped", "modes: 6"), "modes of body 'beam' are 6: a whole number from 1 to 5, which the file has, is expected"),
    (None, ("frame: clamped", "modes: 2.5"), "modes of body 'beam' are 2.5: a whole number from 1 to 5"),
    (None, ("frame: clamped", "stiffening: first"), "stiffening of body 'beam': 'first' needs the arrays 'h', 'Y' and 'interface_H', which the file does not have"),
    (None, ("frame: clamped", "stiffening: full"), "stiffening of body 'beam': a file has terms of second order up to 'first'"),
    (many(*(changed(name, None, np.zeros(shape)) for name, shape in (("h", (3, 8, 8)), ("Y", (3, 3, 8, 8)), ("interface_H", (2, 3, 8, 8))))), None,
     "its modes move or turn the first interface, and its terms of second order are in their frame"),
    (None, ("frame: clamped", "shapes: {y: 2}"), "flexible of body 'beam': 'shapes' is a key of beams, and its modes are in a file"),
    (None, ("points:", "mass: 9, points:"), "mass of body 'beam' is 9 kg, and in its file 'beam.npz' it is 7.85 kg: one of them is in other units, or of another body"),
    (None, ("points:", "inertia: {zz: 1}, points:"), "body 'beam' is flexible, and its file gives its inertia: remove one of the two"),
    (None, ("file: beam.npz", "file: other.npz"), "cannot read"),
    *((None, ("bodies:", f"run: {{outputs: ['{word}(beam.B)']}}\nbodies:"), f"output {word}: body 'beam' is read from a file, which has no cross-sections: take 'reaction' and 'moment' of its joints")
      for word in ("section", "section_by_shapes", "stress")),
]


class Mistakes(Folder):
    def refused(self, model, words):
        with self.assertRaises(AssertionError) as caught:
            runs.kempe("check", model)
        said = [line for line in str(caught.exception).splitlines() if "model.yaml:" in line]
        self.assertEqual(len(said), 1, said)
        self.assertIn(words, said[0])
        self.assertRegex(said[0], r"model.yaml:\d+:\d+: ")

    def test_sentences(self):
        for change, words, sentence in MISTAKES:
            with self.subTest(sentence):
                file = free_beam(2)
                if change:
                    change(file)
                text = FREE.replace("FRAME", "clamped")
                self.refused(self.put(text.replace(*words) if words else text, "beam.npz", file), sentence)

    def test_objects(self):
        file = free_beam(2)
        file["T"] = np.array([{"a": 1}], dtype=object)
        self.refused(self.put(FREE.replace("FRAME", "clamped"), "beam.npz", file), "array 'T': it has objects, which are not read because they are programs of Python's pickle")

    def test_types(self):
        """float32, columns first, bytes, integers and version 2 are read; big-endian and complex numbers are refused."""
        def write(path, **arrays):
            with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
                for name, array in arrays.items():
                    file = io.BytesIO()
                    np.lib.format.write_array(file, np.asanyarray(array), version=(2, 0))
                    archive.writestr(name + ".npy", file.getvalue())

        file = free_beam(2)
        model = self.put(FREE.replace("FRAME", "clamped"), "beam.npz", file)
        before = runs.kempe("modes", model)["eigenvalues"]
        other = {**file, "T": np.asfortranarray(file["T"]), "format": np.bytes_("kempe-flexible-1"), "interface_place": file["interface_place"].astype(np.int16),
                 "interface_displacement": np.asfortranarray(file["interface_displacement"].astype(np.float32))}
        self.assertEqual(runs.kempe("modes", self.put(FREE.replace("FRAME", "clamped"), "beam.npz", other, write))["eigenvalues"], before)
        for name, array, words in (("K", file["K"].astype(">f8"), "array 'K': its bytes are in big-endian order"), ("K", file["K"].astype(complex), "array 'K': its type is none of real numbers or words"),
                                   ("m", np.zeros(1, dtype=[("a", float), ("b", int)]), "array 'm': its elements have several parts")):
            self.refused(self.put(FREE.replace("FRAME", "clamped"), "beam.npz", {**file, name: array}), words)

    def test_damaged(self):
        """Archives cut anywhere, or with other bytes, are refused or the same: none is read as another body."""
        model = self.put(FREE.replace("FRAME", "clamped"), "beam.npz", free_beam(2))
        path = model.parent / "beam.npz"
        whole, rng = path.read_bytes(), np.random.default_rng(1)
        said = runs.kempe("check", model)
        for cut in sorted({0, 1, 21, 22, 100, len(whole) // 2, len(whole) - 23, len(whole) - 1}):
            path.write_bytes(whole[:cut])
            self.refused(model, "file 'beam.npz' of body 'beam': ")
        for _ in range(200 if runs.FULL else 40):
            bytes_ = bytearray(whole)
            bytes_[rng.integers(len(whole))] ^= 1 << int(rng.integers(8))
            path.write_bytes(bytes_)
            try:
                found = runs.kempe("check", model)
            except AssertionError as error:
                self.assertIn("file 'beam.npz' of body 'beam': ", str(error))
                continue
            for key in ("build_s",):
                found.pop(key, None), said.pop(key, None)
            self.assertEqual(found, said)

    def test_encrypted(self):
        model = self.put(FREE.replace("FRAME", "clamped"), "beam.npz", free_beam(2))
        path = model.parent / "beam.npz"
        whole = bytearray(path.read_bytes())
        at = whole.find(b"PK\x01\x02")
        struct.pack_into("<H", whole, at + 8, 1)
        path.write_bytes(whole)
        self.refused(model, "it is encrypted")


def main():
    runs.main()


if __name__ == "__main__":
    main()
