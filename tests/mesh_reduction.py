#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""`kempe reduce`: a blade of solid elements and its motion in a closed loop, the formats of meshes, matrices of CalculiX beside the
frequencies that it computes itself, modes beside those of NumPy, and mistakes.

    python3 tests/mesh_reduction.py build/dev/kempe
"""
import pathlib
import subprocess
import sys
import unittest

sys.dont_write_bytecode = True
import flexible_files
import runs

try:
    import numpy as np
except ModuleNotFoundError:
    print("NumPy is missing")
    sys.exit(77)

MODELS = runs.ROOT / "tests/models"
BRICK = {"mass": MODELS / "brick_mass.mtx", "nodes": MODELS / "brick_nodes.txt", "units": "m kg s"}
# Ten frequencies of the blade with rigid ends, the first one fixed: finite elements by SciPy, eleven digits or more. Rounding of the
# stiffness matrix leaves ten digits of the first one.
BLADE = (167.99496913, 1059.99571612, 1242.47694317, 2639.25881089, 3013.97506965, 6043.59393601, 8812.25208668, 11640.49297313,
         17646.91814588, 20006.07959268)
# The steel bar fixed at one end by CalculiX 2.20, *FREQUENCY with the same elements: six and seven digits.
CALCULIX = (0.1956998e5, 0.2337607e5, 0.7168093e5, 0.1304784e6, 0.1415340e6, 0.1438993e6)


def options(words):
    """Words of the command."""
    return [word for name, value in words.items() for each in (value if isinstance(value, (list, tuple)) else [value]) for word in (f"--{name}", each)]


def entries(prefix, A):
    row, col = np.nonzero(A)
    return {f"{prefix}_row": row, f"{prefix}_col": col, f"{prefix}_value": A[row, col]}


def rows_of(prefix, A):
    """As scipy.sparse.csr_matrix has them."""
    row, col = np.nonzero(A)
    return {f"{prefix}_data": A[row, col], f"{prefix}_indices": col.astype(np.int32), f"{prefix}_indptr": np.searchsorted(row, np.arange(len(A) + 1)).astype(np.int32)}


def market(A, symmetric, digits=17):
    row, col = np.nonzero(np.tril(A) if symmetric else A)
    lines = [f"%%MatrixMarket matrix coordinate real {'symmetric' if symmetric else 'general'}", "% a comment", f"{len(A)} {len(A)} {len(row)}"]
    return "\n".join(lines + [f"{i + 1} {j + 1} {A[i, j]:.{digits}g}" for i, j in zip(row, col)]) + "\n"


def brick():
    """The mesh of tests/models: nodes, stiffness, mass between nodes."""
    def matrix(name):
        lines = (MODELS / name).read_text().splitlines()
        A = np.zeros((int(lines[1].split()[0]),) * 2)
        for line in lines[2:]:
            i, j, x = line.split()
            A[int(i) - 1, int(j) - 1] = A[int(j) - 1, int(i) - 1] = float(x)
        return A
    nodes = np.array([[float(x) for x in line.split(",")] for line in (MODELS / "brick_nodes.txt").read_text().splitlines()[1:]])
    return nodes, matrix("brick.mtx"), matrix("brick_mass.mtx")


def craig_bampton(nodes, K, Ms, faces, kept):
    """Squares of the frequencies with the first face held, and with all of them, by dense matrices."""
    M = np.kron(Ms, np.eye(3))
    held = np.zeros(len(nodes), bool)
    held[np.concatenate(faces)] = True
    inner = ~np.repeat(held, 3)
    static = np.zeros((3 * len(nodes), 6 * (len(faces) - 1)))
    for f, face in enumerate(faces[1:]):
        for i in face:
            x = nodes[i] - nodes[face].mean(0)
            static[3 * i:3 * i + 3, 6 * f:6 * f + 6] = np.hstack([np.eye(3), [[0, x[2], -x[1]], [-x[2], 0, x[0]], [x[1], -x[0], 0]]])
    static[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[inner] @ static)
    values, shapes = flexible_files.modes_of(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)])
    basis = np.zeros((3 * len(nodes), static.shape[1] + kept))
    basis[:, :static.shape[1]] = static
    basis[inner, static.shape[1]:] = shapes[:, :kept]
    return flexible_files.modes_of(basis.T @ K @ basis, basis.T @ M @ basis)[0], values


class Meshes(flexible_files.Folder):
    def setUp(self):
        super().setUp()
        self.folder = pathlib.Path(self.folder.name if hasattr(self.folder, "name") else self.folder)

    def reduce(self, mesh, body="body.npz", **words):
        return runs.kempe("reduce", mesh, "-o", self.folder / body, *options(words))

    def alike(self, found, expected, tolerance):
        self.assertEqual(len(found), len(expected))
        for a, b in zip(found, expected):
            self.assertLess(abs(a - b), tolerance * abs(b), (found, expected))

    def test_blade(self):
        """Frequencies of the blade, and its motion beside Lagrange's equations of its nodes."""
        nodes, K, Ms = flexible_files.blade_mesh()
        K = K.reshape(3 * len(nodes), -1)
        np.savez(self.folder / "mesh.npz", nodes=nodes, units="m kg s", **entries("stiffness", K), **entries("mass", Ms))
        said = self.reduce(self.folder / "mesh.npz", "blade.npz", interface=["A=x=0", "B=x=0.5"], modes=4)
        self.alike(said["frequencies"], BLADE, 5e-10)
        self.assertLess(max(map(abs, said["rigid"])), 1e-6)
        self.near(said["mass"], 0.66, 1e-12)
        model = self.folder / "model.yaml"
        model.write_text(flexible_files.BLADE)
        flexible_files.Blade.check(self, model)
        flexible_files.Blade.check_rest(self, lambda text: (model.write_text(text), model)[1])

    def test_example(self):
        """The file of the example is that of its script and command."""
        example = runs.ROOT / "examples/flexible_blade"
        subprocess.run([sys.executable, example / "mesh_flexible_blade.py", self.folder / "mesh.npz"], check=True)
        self.reduce(self.folder / "mesh.npz", interface=["root=x=0", "tip=x=0.5"], modes=4)
        made, kept = (np.load(path) for path in (self.folder / "body.npz", example / "flexible_blade.npz"))
        self.assertEqual(made.files, kept.files)
        for name in kept.files:
            if kept[name].dtype.kind == "U":
                self.assertEqual(made[name].tolist(), kept[name].tolist())
            else: # of equally large displacements rounding of the machine may take another one for the sign
                self.near(np.abs(np.abs(made[name]) - np.abs(kept[name])).max(), 0, 1e-8 * np.abs(kept[name]).max(), name)

    def test_formats(self):
        """The same mesh in all formats, in other units, with the mass by nodes or by displacements."""
        nodes, K, Ms = brick()
        M = np.kron(Ms, np.eye(3))
        expected, held = craig_bampton(nodes, K, Ms, [range(4), range(8, 12)], 3) # the first three are equal
        faces = ["root=x=0", "tip=x=2"]
        for name, arrays in (("entries.npz", entries("stiffness", K) | entries("mass", Ms)), ("rows.npz", rows_of("stiffness", K) | rows_of("mass", M)),
                             ("twice.npz", {k: np.concatenate([v, v]) / (2 if "value" in k else 1) for k, v in (entries("stiffness", K) | entries("mass", M)).items()})):
            np.savez_compressed(self.folder / name, nodes=nodes, units="m kg s", **arrays)
            said = self.reduce(self.folder / name, interface=faces, modes=3)
            self.alike(np.square(said["frequencies"]), expected, 1e-12)
            self.alike([*np.square(said["held_frequencies"]), said["first_left_out"]**2], held[:4], 1e-12)
        place = "\n".join(f"{10 * k} {x} {y}\t{z}" for k, (x, y, z) in enumerate(1e3 * nodes))
        for symmetric in (True, False): # in mm, t and s: 1 N/m is 1e-3 t/s^2
            (self.folder / "K.mtx").write_text(market(1e-3 * K, symmetric))
            (self.folder / "M.mtx").write_text(market(1e-3 * (M if symmetric else Ms), symmetric).replace("real", "Real"))
            (self.folder / "nodes.txt").write_text(place)
            said = self.reduce(self.folder / "K.mtx", mass=self.folder / "M.mtx", nodes=self.folder / "nodes.txt", units="mm t s",
                               interface=["root=0,10,20,30", "tip=x=2000,y=0:1000"], modes=3)
            self.alike(np.square(said["frequencies"]), expected, 1e-12)
        self.assertIn("node_number", np.load(self.folder / "body.npz").files)

    def test_calculix_format(self):
        """Fortran's exponents, nodes in any order with gaps, sets and ranges, rows in any order."""
        nodes, K, Ms = brick()
        expected, _ = craig_bampton(nodes, K, Ms, [range(4), range(8, 12)], 3)
        number = [7, 3, 11, 100, 5, 22, 21, 20, 50, 60, 70, 80]
        order = np.random.default_rng(1).permutation(36)
        for ending, A in ((".sti", K), (".mas", np.kron(Ms, np.eye(3)))):
            B = A[np.ix_(order, order)]
            row, col = np.nonzero(np.triu(B))
            lines = (f"{i + 1} {j + 1} {B[i, j]:.17e}" for i, j in zip(row, col))
            (self.folder / f"job{ending}").write_text("\n".join(line.replace("e", "D") if k % 2 else line for k, line in enumerate(lines)))
        (self.folder / "job.dof").write_text("".join(f"{number[r // 3]}.{r % 3 + 1}\n" for r in order))
        text = "*Heading\n bricks\n*Node\n" + "".join(f"{n}, {x}, {y}, {z}\n" for n, (x, y, z) in sorted(zip(number, nodes.tolist()), reverse=True))
        (self.folder / "job.inp").write_text(text + "4711, 0, 0, 0\n*Nset, nset=Tip, generate\n50, 80, 10\n** a comment\n*Nset, nset=all\ntip, 7, 3,\n11, 100\n")
        said = self.reduce(self.folder / "job.sti", units="m kg s", interface=["root=3,7,11,100", "tip=TIP"], modes=3)
        self.alike(np.square(said["frequencies"]), expected, 1e-12)
        self.assertEqual(said["unused_nodes"], 1)
        self.alike(self.reduce(self.folder / "job.sti", units="m kg s", interface=["ends=all"], modes=1)["frequencies"], [10], 1e-12)
        # its nodes keep their numbers in models
        model = "kempe: 1\nbodies: {b: {joint: {name: A, revolute: z, at: ground}, flexible: {file: body.npz}, points: {P: {node: NODE}}}}\nrun: {outputs: [position(b.P)], t_end: 0.1}\n"
        (self.folder / "model.yaml").write_text(model.replace("NODE", "100"))
        _, rows = runs.simulated(self.folder / "model.yaml")
        self.near(rows[0]["position.b.P.z"], 0.5, 1e-9) # z of the fourth node from the middle of both ends
        (self.folder / "model.yaml").write_text(model.replace("NODE", "101"))
        said = runs.kempe("check", self.folder / "model.yaml", status=2)
        self.assertIn("is 101: the file has none of this number among its nodes 3 to 100", said["reason"])

    def test_calculix_itself(self):
        said = self.reduce(MODELS / "calculix/steel_bar.sti", units="mm t s", interface="root=ROOT", modes=6)
        self.alike(said["frequencies"], CALCULIX, 5e-7)
        self.near(said["mass"], 7850 * 60e-3 * 10e-3 * 5e-3, 1e-12)
        self.assertEqual(said["unused_nodes"], 1)

    def test_three_interfaces_and_equal_modes(self):
        """Modes of the same frequency are all found; a third interface has six more static modes."""
        nodes, K, Ms = brick()
        for kept, faces, names in ((3, [range(4)], ["a=x=0"]), (12, [range(4)], ["a=0-3"]), (0, [range(4), range(8, 12)], ["a=x=0", "b=x=2"]),
                                   (1, [[0, 1, 2], [3, 5, 7], [8, 9, 10]], ["a=0-2", "b=3,5,7", "c=8-10"])):
            expected, held = craig_bampton(nodes, K, Ms, faces, kept)
            said = self.reduce(MODELS / "brick.mtx", **BRICK, interface=names, **({"modes": kept} if kept else {}))
            self.alike(np.square(said["frequencies"]), expected, 1e-11)
            self.alike([*np.square(said["held_frequencies"]), said["first_left_out"]**2], held[:kept + 1], 1e-11)
            self.assertEqual(said["equal_left_out"], kept > 0 and held[kept] < 1.00001 * held[kept - 1])
        self.assertTrue(self.reduce(MODELS / "brick.mtx", **BRICK, interface=["a=x=0", "b=x=2"], modes=2)["equal_left_out"])

    def test_chord(self):
        """The frame changes rigid motions alone: frequencies are those of the modes less them, and models read both files alike."""
        nodes, K, Ms = brick()
        faces = ["a=x=0", "b=x=2"]
        self.reduce(MODELS / "brick.mtx", "clamped.npz", **BRICK, interface=faces, modes=2)
        said = self.reduce(MODELS / "brick.mtx", "chord.npz", **BRICK, interface=faces, modes=2, frame="chord")
        file = np.load(self.folder / "clamped.npz")
        phi, shift = file["modes"], file["interface_displacement"]
        x, chord = nodes - [0, .5, .5], []
        for k in range(phi.shape[2]):
            turn = np.cross([2, 0, 0], shift[1][:, k]) / 4 # about the line between both interfaces it is that of the first one: none
            chord.append((phi[:, :, k] - np.cross(turn, x)).ravel())
        chord = np.array(chord).T
        M = np.kron(Ms, np.eye(3))
        self.alike(np.square(said["frequencies"]), flexible_files.modes_of(chord.T @ K @ chord, chord.T @ M @ chord)[0], 1e-11)
        text = "kempe: 1\nbodies: {b: {joint: {name: A, revolute: z, at: ground}, flexible: {file: FILE, frame: chord}}}\nloops: {}\n"
        found = []
        for name in ("clamped.npz", "chord.npz"):
            (self.folder / "model.yaml").write_text(text.replace("FILE", name).replace("loops: {}\n", ""))
            found.append(sorted(abs(complex(*x)) for x in runs.kempe("modes", self.folder / "model.yaml")["eigenvalues"]))
        for a, b in zip(*found):
            self.near(a, b, 1e-4 if b < 1e-3 else 1e-9 * b)

    def test_same_bytes_and_inputs_kept(self):
        for name in ("one.npz", "two.npz"):
            self.reduce(MODELS / "brick.mtx", name, **BRICK, interface="a=x=0", modes=3)
        self.assertEqual((self.folder / "one.npz").read_bytes(), (self.folder / "two.npz").read_bytes())
        nodes, K, Ms = brick()
        np.savez(self.folder / "mesh.npz", nodes=nodes, units="m kg s", **entries("stiffness", K), **entries("mass", Ms))
        before = (self.folder / "mesh.npz").read_bytes()
        runs.kempe("reduce", self.folder / "mesh.npz", "-o", self.folder / "mesh.npz", *options({"interface": "a=x=0", "modes": 1}), status=3)
        self.assertEqual((self.folder / "mesh.npz").read_bytes(), before)
        said = runs.kempe("reduce", self.folder / "mesh.npz", "-o", self.folder / "none/body.npz", *options({"interface": "a=x=0", "modes": 1}), status=1)
        self.assertIn("none/body.npz", said["reason"])


def with_rotations(K):
    return np.kron(np.eye(2), K)


def negative(Ms):
    Ms = Ms.copy()
    Ms[5, 5] = -1
    return Ms


def hinged(K):
    """Elements that do not resist z of the four nodes in the middle, as of a mechanism."""
    loose = np.zeros(36, bool)
    loose[14:24:3] = True
    K = K.copy()
    K[loose] = K[:, loose] = 0
    K[14, 14] = K[17, 17] = K[20, 20] = K[23, 23] = 1.0
    for i, j in ((14, 17), (17, 14), (20, 23), (23, 20)):
        K[i, j] = -1.0
    return K


def supported(K):
    K = K.copy()
    K[20, 20] += 10
    return K


def changed(A, i, j, x):
    A = A.copy()
    A[i, j] = x
    return A


def apart(A, width):
    """Two bricks without the nodes that join them to the first face."""
    A = A.copy()
    n = 4 * width
    A[:n, n:] = A[n:, :n] = 0
    return A


FACES = {"interface": ["root=x=0", "tip=x=2"], "modes": 1}
# Changes of the mesh, of the options, the exit code and the sentence.
MISTAKES = [
    ({}, {"interface": "root=x=0,tip=12", "modes": 1}, 2, "interface 'tip': there is no node 12; its nodes are 0 to 11"),
    ({}, {"interface": "root=x=0.25", "modes": 1}, 2, "interface 'root' has no nodes: no place of a node is there"),
    ({}, {"interface": "root=0,1", "modes": 1}, 2, "interface 'root' has 2 nodes: a rigid body needs three nodes or more that are not in a line"),
    ({}, {"interface": "root=0,4,8", "modes": 1}, 2, "interface 'root' has 3 nodes in a line"),
    ({}, {"interface": "root=0-3,tip=3-8", "modes": 1}, 2, "node 3 is in interface 'tip' and in one before it"),
    ({}, {"interface": "root=0-11", "modes": 1}, 2, "all its nodes are in interfaces, and none is left to deform"),
    ({}, {"interface": "root=x=0,root=x=2", "modes": 1}, 3, "'root' is named twice"),
    ({}, {"interface": "2nd=x=0", "modes": 1}, 3, "'2nd' is not a name"),
    ({}, {"interface": "root=SET", "modes": 1}, 3, "'SET' is none of a name with nodes"),
    ({}, {"interface": "root=x=0:", "modes": 1}, 3, "'x=0:' is none of a name with nodes"),
    ({}, {"interface": "root=5-3", "modes": 1}, 3, "'5-3' is none of a name with nodes"),
    ({}, {"modes": 1}, 3, "interfaces are missing: name the nodes that joints hold"),
    ({}, {"interface": "root=x=0"}, 3, "one interface has no static modes: give --modes N, or a second --interface"),
    ({}, {"interface": "root=x=0", "modes": 25}, 2, "with its interfaces held the mesh has 24 modes, and 25 are wanted"),
    ({}, {"interface": "root=x=0", "modes": 300}, 3, "300 modes, six of them for each interface but the first, are more than the 200"),
    ({}, {"interface": "root=x=0", "modes": 1, "frame": "chord"}, 3, "--frame chord is from the first interface to the second one"),
    ({}, FACES | {"frame": "free"}, 3, "--frame 'free' does not exist: clamped, chord or mean"),
    ({}, FACES | {"units": "mm t s"}, 3, "has its units, 'm kg s': leave out --units"),
    ({"units": None}, FACES, 3, "does not state its units: give the units of length, mass and time"),
    ({"units": None}, FACES | {"units": "m N s"}, 3, "--units 'm N s': units of length, mass and time are expected"),
    ({"units": "metres"}, FACES, 2, "array 'units' is 'metres'"),
    ({"K": lambda K: changed(K, 2, 5, 77.0)}, FACES, 2, "the stiffness is not symmetric: 77 between z of node 0 and z of node 1"),
    ({"K": np.triu}, FACES, 2, "a matrix of one triangle must be completed"),
    ({"K": lambda K: changed(K, 4, 4, np.nan)}, FACES, 2, "the stiffness between y of node 1 and y of node 1 is nan: all entries must be finite, at most 1e+60"),
    ({"K": lambda K: changed(K, 4, 4, -1.0)}, FACES, 2, "the stiffness of y of node 1 is -1: it must be positive"),
    ({"K": lambda K: -K}, FACES, 2, "it must be positive"),
    ({"K": lambda K: K - 50 * np.eye(36)}, {"interface": "root=x=0", "modes": 1}, 2, "its stiffness is negative: a displacement has the energy of -36.1 1/s^2 times its mass"),
    ({"K": supported}, FACES, 2, "its stiffness resists"),
    ({"K": hinged}, {"interface": "root=x=0", "modes": 1}, 2, "with its interfaces held a part of the mesh moves without stiffness"),
    ({"K": lambda K: apart(K, 3), "M": lambda M: apart(M, 1)}, FACES, 2, "it has 2 parts that no element joins; one of them has 4 nodes, among them node 0"),
    ({"K": with_rotations}, FACES, 2, "matrix 'stiffness' has row 71, and there are 12 nodes: three rows a node are expected; rotations of nodes"),
    ({"K": lambda K: K[:6, :6]}, FACES, 2, "matrix 'stiffness' has only the rows of 12 nodes"),
    ({"M": negative}, FACES, 2, "the mass of node 5 is -1: it must be positive"),
    ({"M": lambda M: 0 * M + np.diag([1.0] * 11 + [1e-30])}, {"interface": "root=x=0", "modes": 1}, 0, ""),
    ({"M": lambda M: changed(changed(M, 0, 1, 9.0), 1, 0, 9.0)}, FACES, 2, "the mass between nodes 0 and 1, 9, is larger than their own"),
    ({"M": lambda M: np.kron(M, np.diag([1, 1, 2]))}, FACES, 2, "for y and"),
    ({"M": lambda M: np.kron(M, np.eye(3)) + 0.1 * np.ones((36, 36))}, FACES, 2, "masses of solid elements have none between different directions"),
    ({"nodes": lambda x: x[:, :2]}, FACES, 2, "array 'nodes' is 12 x 2: a row of x, y and z for each node is expected"),
    ({"nodes": lambda x: x[:3]}, FACES, 2, "there are 3 nodes"),
    ({"nodes": lambda x: x + [0, 0, np.inf]}, FACES, 2, "z of node"),
    ({"nodes": lambda x: x[::-1]}, FACES, 0, ""),
    ({"nodes": lambda x: x * [1, 2, 1]}, FACES, 2, "a supported mesh, wrong nodes"),
    ({"drop": "stiffness_value"}, FACES, 2, "it has no matrix 'stiffness': the arrays 'stiffness_row', 'stiffness_col' and 'stiffness_value'"),
    ({"drop": "mass_row"}, FACES, 2, "array 'mass_row': it is missing"),
    ({"add": {"mass_row": np.zeros(3)}}, FACES, 2, "array 'mass_row' has 3 entries"),
    ({"add": {"mass_col": lambda x: x + 0.5}}, FACES, 2, "rows are counted from 0"),
    ({"add": {"stiffness_value": np.array(["a"])}}, FACES, 2, "array 'stiffness_value': numbers are expected"),
]
# Texts of MatrixMarket and CalculiX: file, words in it, others in their place, the sentence.
TEXTS = [
    ("K.mtx", "symmetric", "hermitian", "K.mtx:1:1: the line '%%MatrixMarket matrix coordinate real symmetric'"),
    ("K.mtx", "36 36", "36 35", "the matrix is 36 x 35: it must be square"),
    ("K.mtx", "36 36", "36 36.5", "whole and positive numbers are expected"),
    ("K.mtx", "\n1 1 ", "\n1 37 ", "column 37 is none of 1 to 36"),
    ("K.mtx", "\n2 1 ", "\n1 2 ", "entry (1, 2) is above the diagonal"),
    ("K.mtx", "\n1 1 ", "\n1 1 nan ", "a row, a column and a value are expected"),
    ("K.mtx", "\n1 1 ", "\n1 1 5 ", "a row, a column and a value are expected and no more"),
    ("K.mtx", "\n1 1 ", "\n% 1 1 ", "entries, its head says"),
    ("M.mtx", "12 12", "13 13", "the mass has 13 rows, and there are 12 nodes"),
    ("K.mtx", "36 36", "72 72", "the stiffness has 72 rows, and there are 12 nodes: three rows a node are expected; rotations of nodes"),
    ("nodes.txt", "0,0,1", "0,0", "nodes.txt:3:4: x, y and z of a node are expected"),
    ("nodes.txt", "0,0,1", "0,0,1,2", "x, y and z of a node are expected, or in all lines its number and these"),
    ("job.dof", "8.2", "8.5", "job.dof:5:1: node 8 has a rotation, direction 5: bodies of solid elements are reduced"),
    ("job.dof", "8.2", "9.2", "the input has no node 9"),
    ("job.dof", "8.2\n", "", "is none of 1 to 47, the equations in the file .dof"),
    ("job.dof", "8.2", "8", "a node and a direction, as 12.1, are expected"),
    ("job.sti", "1 2 ", "2 1 ", "entry (2, 1) is below the diagonal"),
    ("job.inp", "*NODE", "*INCLUDE, INPUT=x\n*NODE", "job.inp:2:1: *INCLUDE is not followed"),
    ("job.inp", "*NODE, NSET=NALL", "*ELEMENT", "it has no nodes, lines behind *NODE"),
    ("job.inp", "8, 0, 0, 5", "3, 0, 0, 5", "node 3 is given twice"),
    ("job.inp", "8, 0, 0, 5", "8, 0, 0, a", "a node's number, x, y and z are expected"),
    ("job.inp", "*NSET, NSET=ROOT", "*NSET", "*NSET needs its name"),
    ("job.inp", "ROOT, TIP", "ROOT, TIPS", "there is no set 'TIPS' of nodes before this line"),
]


class Mistakes(flexible_files.Folder):
    def setUp(self):
        super().setUp()
        self.folder = pathlib.Path(self.folder.name if hasattr(self.folder, "name") else self.folder)

    def refused(self, mesh, words, status, sentence):
        said = runs.kempe("reduce", mesh, "-o", self.folder / "body.npz", *options(words), status=status)
        self.assertIn(sentence, said["reason"])
        self.assertEqual((self.folder / "body.npz").exists(), status == 0)
        (self.folder / "body.npz").unlink(missing_ok=True)

    def test_arrays(self):
        for change, words, status, sentence in MISTAKES:
            with self.subTest(sentence):
                nodes, K, Ms = brick()
                K, Ms, nodes = (change.get(name, lambda x: x)(A) for name, A in (("K", K), ("M", Ms), ("nodes", nodes)))
                arrays = {"nodes": nodes, "units": change.get("units", "m kg s")} | entries("stiffness", K) | entries("mass", Ms)
                for name, array in change.get("add", {}).items():
                    arrays[name] = array(arrays[name]) if callable(array) else array
                np.savez(self.folder / "mesh.npz", **{name: array for name, array in arrays.items() if array is not None and name != change.get("drop")})
                self.refused(self.folder / "mesh.npz", words, status, sentence)

    def test_texts(self):
        sources = {"K.mtx": "brick.mtx", "M.mtx": "brick_mass.mtx", "nodes.txt": "brick_nodes.txt"} | {f"job.{e}": f"calculix/steel_bar.{e}" for e in ("inp", "dof", "sti", "mas")}
        more = {"mass": self.folder / "M.mtx", "nodes": self.folder / "nodes.txt"}
        for name, old, new, sentence in TEXTS:
            with self.subTest(sentence):
                for own, source in sources.items():
                    (self.folder / own).write_text((MODELS / source).read_text())
                text = (self.folder / name).read_text()
                self.assertIn(old, text)
                (self.folder / name).write_text(text.replace(old, new, 1))
                job = name.startswith("job")
                self.refused(self.folder / ("job.sti" if job else "K.mtx"), {"units": "mm t s", "interface": "a=x=0", "modes": 1} | ({} if job else more), 2, sentence)
        for own, source in sources.items():
            (self.folder / own).write_text((MODELS / source).read_text())
        self.refused(self.folder / "K.mtx", {"units": "mm t s", "interface": "a=x=0", "modes": 1}, 3, "has only the stiffness: give the mass by --mass M.mtx")
        self.refused(self.folder / "job.sti", {"units": "mm t s", "interface": "a=x=0", "modes": 1, "mass": self.folder / "M.mtx"}, 3, "--mass belongs to a matrix .mtx")
        (self.folder / "job.mas").unlink()
        self.refused(self.folder / "job.sti", {"units": "mm t s", "interface": "a=x=0", "modes": 1}, 2, "job.mas")
        self.refused(self.folder / "mesh.bdf", {}, 2, "its ending is none of a mesh with matrices")

    def test_damaged(self):
        """Cut and changed archives are refused with a sentence, or give a body."""
        nodes, K, Ms = brick()
        path = self.folder / "mesh.npz"
        np.savez_compressed(path, nodes=nodes, units="m kg s", **entries("stiffness", K), **entries("mass", Ms))
        whole, chance = path.read_bytes(), np.random.default_rng(5)
        for k in range(200 if runs.FULL else 25):
            data = bytearray(whole[:chance.integers(len(whole))] if k % 2 else whole)
            for at in chance.integers(len(data), size=3) if k % 2 == 0 and data else []:
                data[at] = chance.integers(256)
            path.write_bytes(data)
            said = runs.kempe("reduce", path, "-o", self.folder / "body.npz", *options(FACES), status=None if k % 2 == 0 and bytes(data) == whole else 2)
            self.assertTrue(said["reason"])


if __name__ == "__main__":
    runs.main()
