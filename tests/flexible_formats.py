#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Flexible bodies from files of other programs: the same modes as arrays of kempe-flexible-1 and as standard input data (SID)
give the same motion. The files are written here, from places, masses and displacements of points, by the definitions of
their formats.

    python3 tests/flexible_formats.py build/dev/kempe
"""
import pathlib
import re
import subprocess
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
try:
    import kempe
except ModuleNotFoundError:
    kempe = None

from flexible_files import integrals, modes_of


# -- a body of points ----------------------------------------------------------------------------------

def cloud(n=4, second=False, seed=3):
    """Points with masses that deform by n modes, two interfaces; the first one is held. With `second` displacements have terms of
    second order as well, the first interface none. Stiffness, damping and modes are random; nothing is symmetric."""
    rng = np.random.default_rng(seed)
    count = 30
    weight, place = rng.uniform(0.02, 0.05, count), rng.normal(size=(count, 3)) * (0.5, 0.1, 0.08) + (0.5, 0, 0)
    bend = place[:, :1, None] * rng.normal(size=(count, 3, n)) * 0.5 + place[:, :1, None]**2 * rng.normal(size=(3, n))
    root, form = rng.normal(size=(n, n)), rng.normal(size=(count, 3, n, n)) * 0.3 * place[:, :1, None, None]**2
    body = {"weight": weight, "place": place, "phi": bend, "K": 3e3 * (root @ root.T + n * np.eye(n)), "D": 0.3 * np.eye(n),
            "ends": np.array([[0.0, 0, 0], [1.0, 0.1, 0.05]]), "shift": np.stack([np.zeros((3, n)), rng.normal(size=(3, n))]),
            "turn": np.stack([np.zeros((3, n)), rng.normal(size=(3, n))]), "form": (form + form.swapaxes(2, 3)) * second}
    tip = rng.normal(size=(3, n, n)) * 0.3
    body["tip"] = np.stack([np.zeros((3, n, n)), tip + tip.swapaxes(1, 2)]) * second
    return body


def arrays(body):
    """As kempe-flexible-1."""
    n = len(body["K"])
    file = integrals(body["weight"], body["place"], body["phi"]) | {
        "format": "kempe-flexible-1", "units": "m kg s", "K": body["K"], "D": body["D"], "interface_names": np.array(["7", "12"]),
        "interface_place": body["ends"], "interface_displacement": body["shift"], "interface_rotation": body["turn"]}
    if body["form"].any():
        file |= {"h": np.einsum("p,paij->aij", body["weight"], body["form"]),
                 "Y": np.einsum("p,paij,pb->abij", body["weight"], body["form"], body["place"]), "interface_H": body["tip"]}
    return file | {"M": np.einsum("p,pai,paj->ij", body["weight"], body["phi"], body["phi"]).reshape(n, n)}


# -- standard input data -------------------------------------------------------------------------------

def tilde(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def sid_parts(body):
    """Expansions name: (A0, [A1 of each mode]) of Wallrapp 1994: the mass matrix of rigid motions and coordinates, and the forces of
    Coriolis and centrifugal accelerations, of points r = X + phi q + q' form q/2 in axes that move with them: sums over the points of
    what a rate and an acceleration do there. Oe has columns for wx^2, wy^2, wz^2, wx wy, wy wz, wx wz. Gr, Ge: a block for each
    component of the rate."""
    weight, place, phi, form = (body[key] for key in ("weight", "place", "phi", "form"))
    n = phi.shape[2]
    modes = range(n)
    unit = np.eye(3)
    # centrifugal acceleration w x (w x r) = W r for each product of rates
    W = [tilde(unit[i]) @ tilde(unit[j]) + (tilde(unit[j]) @ tilde(unit[i]) if i != j else 0) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))]

    def total(value):
        return sum(w * np.asarray(x) for w, x in zip(weight, value))

    zero = {
        "mdCM": total(place)[:, None], "J": total([tilde(x) @ tilde(x).T for x in place]), "Ct": total(phi.transpose(0, 2, 1)),
        "Cr": total([(tilde(x) @ f).T for x, f in zip(place, phi)]), "Me": total([f.T @ f for f in phi]),
        "Oe": total([np.stack([f.T @ (a @ x) for a in W], axis=1) for x, f in zip(place, phi)]),
        # 2 r x (w x u'): column a of block k of the moment by unit rate about a; here blocks by a, columns by k
        "Gr": np.hstack([total([2 * tilde(x) @ tilde(unit[a]) @ f for x, f in zip(place, phi)]) for a in range(3)]),
        "Ge": np.hstack([total([2 * f.T @ tilde(unit[a]) @ f for f in phi]) for a in range(3)]),
        "Ke": body["K"], "De": body["D"], "ksigma": np.zeros((n, 1))}
    first = {
        "mdCM": [total(phi[:, :, k])[:, None] for k in modes],
        "J": [total([tilde(f[:, k]) @ tilde(x).T + tilde(x) @ tilde(f[:, k]).T for x, f in zip(place, phi)]) for k in modes],
        "Ct": [total(form[:, :, :, k].transpose(0, 2, 1)) for k in modes],
        "Cr": [total([(tilde(f[:, k]) @ f + tilde(x) @ g[:, :, k]).T for x, f, g in zip(place, phi, form)]) for k in modes],
        "Oe": [total([np.stack([f.T @ (a @ f[:, k]) + g[:, :, k].T @ (a @ x) for a in W], axis=1) for x, f, g in zip(place, phi, form)]) for k in modes]}
    return zero, first


def by_modes(blocks, n):
    """Gr and Ge with a block for each mode in place of one for each component."""
    return blocks.reshape(len(blocks), 3, n).transpose(0, 2, 1).reshape(len(blocks), 3 * n)


def expansion(name, zero, first=None, structure=3, mode_last=False, n=None):
    rows, columns = zero.shape
    lines = [name, f"order = {0 if first is None else 1}", f"nrow = {rows}", f"ncol = {columns}", f"nq = {n}", "nqn = 0", f"structure = {structure}"]
    for i, j in np.argwhere(zero != 0):
        if structure == 3 or (structure == 2 and j <= i) or (structure == 1 and i == j):
            lines.append(f"m0({i + 1:3d},{j + 1:3d}) = {zero[i, j]:.17E}".replace("E", "D"))
    for k, part in enumerate(first if first is not None else []):
        for i, j in np.argwhere(part != 0):
            index = (i + 1, j + 1, k + 1) if mode_last else (i + 1, k + 1, j + 1)
            lines.append(f"m1({index[0]:3d},{index[1]:3d},{index[2]:3d}) = {part[i, j]:.17E}")
    return lines + [f"end {name}"]


def sid(body, six=True, mode_last=False, blocks_by_modes=False, change=None, axes=lambda psi: (np.eye(3), psi), structures=()):
    """The text; `change` may alter the parts before they are written; `axes` of a node and their change by psi~."""
    n = len(body["K"])
    zero, first = sid_parts(body)
    names = ["mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De"]
    if six:
        at = ((0, 0, 1, 0, 0), (1, 1, 2, 1, 2))
        pick = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
        zero["J"] = np.array([[zero["J"][i]] for i in pick])
        first["J"] = [np.array([[x[i]] for i in pick]) for x in first["J"]]
    if blocks_by_modes:
        zero["Gr"], zero["Ge"] = by_modes(zero["Gr"], n), by_modes(zero["Ge"], n)
    if not body["form"].any():
        del first["Ct"]
    if change:
        change(zero, first)
    lines = [f"  2 {n} : No. nodes, No. modes: points", "part $", "new modal =$", "refmod", f"mass = {body['weight'].sum():.17E}", f"nelastq = {n}"]
    lines += [f"ielastq ( {k + 1}) = Eigen Mode {k + 1} : 1.0 Hz" for k in range(n)] + ["end refmod", "frame"]
    for k, name in enumerate(("7", "12")):
        shift, turn = body["shift"][k], body["turn"][k]
        lines += [f"new node = {name}", "rframe = body ref"]
        lines += expansion("origin", body["ends"][k][:, None], [shift[:, j:j + 1] for j in range(n)], mode_last=mode_last, n=n)
        lines += expansion("phi", shift, [body["tip"][k][:, :, j] for j in range(n)] if body["tip"].any() and k else None, mode_last=mode_last, n=n)
        lines += expansion("psi", turn, n=n)
        lines += expansion("AP", axes(np.eye(3))[0], [axes(tilde(turn[:, j]))[1] for j in range(n)], mode_last=mode_last, n=n) + ["end node"]
    lines.append("end frame")
    for name in names:
        if name in zero:
            lines += expansion(name, zero[name], first.get(name), dict(structures).get(name, 2 if name in ("Me", "Ke") else 3), mode_last, n)
    return "\n".join(lines + ["end modal", "end part", ""])


# -- matrices DMIG -------------------------------------------------------------------------------------

def lattice(k=4, seed=5):
    """A free truss of bars between points with masses, its two end faces rigid: six static modes of each end and k modes with both
    fixed. Its points are those of `integrals`; K of the reduced body has the six rigid motions."""
    rng = np.random.default_rng(seed)
    place = np.array([[0.3 * i, 0.1 * j, 0.12 * m] for i in range(4) for j in range(2) for m in range(2)]) + rng.normal(size=(16, 3)) * 0.01
    weight, count = rng.uniform(0.05, 0.2, 16), 48
    K = np.zeros((count, count))
    for a in range(16):
        for b in range(a):
            along = place[a] - place[b]
            size = np.linalg.norm(along)
            if size < 0.42:
                row = np.zeros(count)
                row[3 * a:3 * a + 3], row[3 * b:3 * b + 3] = along / size, -along / size
                K += 2e4 / size * np.outer(row, row)
    M = np.diag(np.repeat(weight, 3))
    ends = np.array([place[:4].mean(0), place[12:].mean(0)])
    basis = np.zeros((count, 12 + k))
    for end, points in enumerate((range(4), range(12, 16))):
        for i in points:
            basis[3 * i:3 * i + 3, 6 * end:6 * end + 6] = np.hstack([np.eye(3), -tilde(place[i] - ends[end])])
    inner = np.arange(12, 36)
    basis[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[inner] @ basis)
    basis[inner, 12:] = modes_of(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)])[1][:, :k]
    shift, turn = np.zeros((2, 3, 12 + k)), np.zeros((2, 3, 12 + k))
    for end in range(2):
        for i in range(3):
            shift[end, i, 6 * end + i] = turn[end, i, 6 * end + 3 + i] = 1
    return {"weight": weight, "place": place, "phi": basis.reshape(16, 3, 12 + k), "K": basis.T @ K @ basis, "M": basis.T @ M @ basis,
            "ends": ends, "shift": shift, "turn": turn}


def lattice_arrays(body):
    return integrals(body["weight"], body["place"], body["phi"]) | {
        "format": "kempe-flexible-1", "units": "m kg s", "K": body["K"], "M": body["M"], "interface_names": np.array(["1001", "20"]),
        "interface_place": body["ends"], "interface_displacement": body["shift"], "interface_rotation": body["turn"]}


# coordinates of the lattice in a file: grid points 1001 and 20, scalar points from 500 on
def labels(body):
    return [(1001, i) for i in range(1, 7)] + [(20, i) for i in range(1, 7)] + [(500 + i, 0) for i in range(len(body["K"]) - 12)]


def wide(*fields):
    return "".join(f"{x:>16.9E}".replace("E", "D") if isinstance(x, float) else f"{x:>16}" for x in fields)


def short(x):
    """A number in eight columns without E."""
    return re.sub(r"E([+-])0?", r"\1", f"{x:.2E}" if x >= 0 else f"{x:.1E}")


def punched(name, matrix, label, form=6):
    """A matrix as it is punched: one triangle for form 6."""
    lines = [f"DMIG    {name:<8}       0       {form}       2       0                {len(label):>8}"]
    for j, column in enumerate(label):
        rows = [i for i in range(len(label)) if matrix[i, j] != 0 and (form == 1 or i >= j)]
        if rows:
            lines.append("DMIG*   " + f"{name:<16}" + wide(*column))
            lines += ["*       " + wide(*label[i], float(matrix[i, j])) for i in rows]
    return lines


def grids(body, ids=(1001, 20)):
    return [f"GRID*   {number:>16}{'':>16}{at[0]:>16.9f}{at[1]:>16.9f}\n*       {at[2]:>16.9f}" for number, at in zip(ids, body["ends"])]


def pch(body, form=6, places=True, keep=None):
    label, keep = labels(body), keep or list(range(len(body["K"])))
    label = [label[k] for k in keep]
    return "\n".join(["$ title", *(grids(body) if places else []), *(line for name, m in (("KAAX", body["K"]), ("MAAX", body["M"])) for line in punched(name, m[np.ix_(keep, keep)], label, form)),
                      "DMIG    PAX            0       9       2       0                       1", ""])


ARM = """kempe: 1
gravity: [1, -9.81, 2]
bodies:
  base: {joint: {name: S, revolute: [0.6, 0, 0.8], at: ground}, mass: 0.4, inertia: {xx: 0.01, yy: 0.02, zz: 0.015}, points: {P: [0.1, 0.2, 0]}}
  arm: {joint: {name: A, revolute: [0, 0.8, 0.6], at: base.P}, flexible: {FLEXIBLE}, points: {B: {interface: "12"}, C: {interface: "12", offset: [0.1, 0, -0.2]}}}
  end: {joint: {name: E, universal: [x, y], at: arm.B}, mass: 0.2, com: [0.1, 0.05, 0], inertia: {xx: 0.002, yy: 0.003, zz: 0.004}, points: {T: [0.2, 0, 0]}}
forces: {pull: {spring: [ground.O, arm.C], stiffness: 120, damping: 2, free_length: 0.5}}
ground: {points: {O: [1, 1, 1]}}
start: {q: {A: 0.5, arm.mode1: 0.01}, qd: {S: 4, A: -3, arm.mode2: 0.4}}
run: {t_end: 0.5, rtol: 1e-11, atol: 1e-13, output_step: 0.05, outputs: [q, qd, position(end.T), reaction(E)]}
"""


class Folder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = pathlib.Path(self.folder.name)

    def put(self, text, name, content):
        if isinstance(content, str):
            (self.root / name).write_text(content)
        else:
            np.savez(self.root / name, **content)
        path = self.root / (name.split(".")[0] + ".yaml")
        path.write_text(text)
        return path

    def same(self, one, other, tolerance):
        for a, b in zip(one, other, strict=True):
            self.assertEqual(a.keys(), b.keys())
            for key in a:
                self.assertLessEqual(abs(a[key] - b[key]), tolerance * max(1, abs(b[key])), f"{key} at {a['t']}: {a[key]!r} for {b[key]!r}")


SCALE = ", scale: {length: 1, mass: 1}"


class StandardInputData(Folder):
    def model(self, text, content, words="", name="arm.SID_FEM"):
        return self.put(text.replace("FLEXIBLE", f"file: {name}{SCALE}{words}"), name, content)

    def reference(self, text, body, words=""):
        return self.put(text.replace("FLEXIBLE", f"file: npz.npz{words}"), "npz.npz", arrays(body))

    def test_motion(self):
        """The same motion as from the arrays, without and with terms of second order, open and in a loop, in all formulations."""
        loop = ARM.replace("ground: {points", "loops: {rod: {rod: [end.T, ground.O], length: 0.9}}\nground: {points")
        for second in (False, True):
            for text, words in ((ARM, []), *((loop, ["--formulation", word, "--rtol", "1e-10", "--t-end", "0.2"]) for word in ("reduced", "projected", "dae"))):
                body = cloud(second=second)
                body["K"] = body["K"] * (1 if text == ARM else 20)
                said, expected = runs.simulated(self.reference(text, body), *words)
                found, rows = runs.simulated(self.model(text, sid(body)), *words)
                self.same(rows, expected, 1e-9)
                self.assertEqual(found["flexible"], said["flexible"])
                self.assertEqual(found["formulation"], words[1] if words else "reduced")
                self.assertEqual(found["flexible"]["arm"]["stiffening"], "first" if second else "none")
                self.assertNotIn("doubt", found["flexible"]["arm"])

    @unittest.skipUnless(kempe, "the Python package is not built")
    def test_mass_and_bias(self):
        """M and C at random states, for the orders of indices and tensors that programs write."""
        for second in (False, True):
            body = cloud(n=3, second=second)
            one = kempe.Model(str(self.reference(ARM, body))).system().workspace()
            for words in ({}, {"six": False}, {"mode_last": True}, {"blocks_by_modes": True}):
                other = kempe.Model(str(self.model(ARM, sid(body, **words)))).system().workspace()
                rng = np.random.default_rng(7)
                for _ in range(5):
                    q, qd = rng.normal(size=one.n) * 0.3, rng.normal(size=one.n) * 3
                    a, b = one.evaluate(0.0, q, qd), other.evaluate(0.0, q, qd)
                    self.assertLessEqual(abs(a.M - b.M).max(), 1e-10 * abs(a.M).max(), words)
                    self.assertLessEqual(abs(a.C - b.C).max(), 1e-10 * abs(a.C).max(), words)

    def test_parts_left_out(self):
        """Gr, Ge, ksigma and De may be absent, also Cr of first order with Ge, or Oe with J: T and Z0 are the same."""
        body = cloud()
        body["D"] = 0 * body["D"]
        expected = runs.simulated(self.reference(ARM, body))[1]

        def less(zero, first):
            for name in ("Gr", "ksigma", "De"):
                del zero[name]
            del first["Cr"], first["mdCM"]

        def without_ge(zero, first):
            del zero["Ge"], first["J"]

        for change in (less, without_ge):
            said, found = runs.simulated(self.model(ARM, sid(body, change=change)))
            self.same(found, expected, 1e-9)
            self.assertNotIn("doubt", said["flexible"]["arm"])

    def test_structures(self):
        """Modes of unit mass: Me is the unit matrix by its structure 4, Ke diagonal by 1, De zero by 0."""
        body = cloud(second=True)
        squares, modes = modes_of(body["K"], arrays(body)["M"])
        body |= {"phi": body["phi"] @ modes, "K": np.diag(squares), "D": 0 * body["D"], "shift": body["shift"] @ modes, "turn": body["turn"] @ modes,
                 "form": np.einsum("paij,ik,jl->pakl", body["form"], modes, modes), "tip": np.einsum("paij,ik,jl->pakl", body["tip"], modes, modes)}
        text = sid(body, structures={"Me": 4, "Ke": 1, "De": 0})
        self.assertEqual(text.count("m0(", text.index("\nMe\n"), text.index("end Me")), 0)
        self.same(runs.simulated(self.model(ARM, text))[1], runs.simulated(self.reference(ARM, body))[1], 1e-9)

    def test_axes_of_nodes(self):
        """Axes of nodes are other than the body's, and psi is in those of the body; psi in those of the node is refused."""
        body, turned = cloud(), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
        expected = runs.simulated(self.reference(ARM, body))[1]
        for axes in (lambda psi: (turned, psi @ turned), lambda psi: (turned, psi)):
            self.same(runs.simulated(self.model(ARM, sid(body, axes=axes)))[1], expected, 1e-9)
        done = subprocess.run([runs.command, "check", self.model(ARM, sid(body, axes=lambda psi: (turned, turned @ psi)))], capture_output=True, text=True)
        self.assertEqual(done.returncode, 2)
        self.assertIn("the axes of node '12' turn otherwise than by psi, the rotation in axes of the body: AP and psi differ by", done.stderr)

    def test_units(self):
        """The same body in millimetres and tonnes, from the sizes that the points have then."""
        body = cloud(second=True)
        expected = runs.simulated(self.reference(ARM, body))[1]
        other = body | {"weight": body["weight"] * 1e-3, "place": body["place"] * 1e3, "K": body["K"] * 1e-3, "D": body["D"] * 1e-3, "form": body["form"] * 1e-3,
                        "tip": body["tip"] * 1e-3, "turn": body["turn"] * 1e-3, "ends": body["ends"] * 1e3}
        model = self.put(ARM.replace("FLEXIBLE", "file: arm.sid, scale: {length: 1 mm, mass: 1000 kg}"), "arm.sid", sid(other))
        self.same(runs.simulated(model)[1], expected, 1e-9)

    def test_studies(self):
        """Equilibrium, modes, state spaces, sensitivities and ensembles are those of the arrays."""
        body = cloud(second=True)
        text = ARM.replace("kempe: 1", "kempe: 1\nparameters: {k: 200}").replace("stiffness: 200", "stiffness: k").replace("qd: {S: 4, A: -3, arm.mode2: 0.4}", "qd: {}")
        text = text.replace("t_end: 0.5, rtol: 1e-11, atol: 1e-13", "t_end: 0.1, rtol: 1e-10")
        pair = self.reference(text, body), self.model(text, sid(body))

        def numbers(x):
            if isinstance(x, dict):
                return [n for key in sorted(x) if key not in ("build_s", "cpu_s", "model", "work", "wall_s") for n in numbers(x[key])]
            return [n for y in x for n in numbers(y)] if isinstance(x, list) else [x] if isinstance(x, float) else []

        for words in (["equilibrium"], ["modes", "--at", "start"], ["linearize", "--at", "start"], ["sensitivity", "--parameters", "k"],
                      ["ensemble", "--sample", "k=150:250", "--instances", "4"]):
            one, other = (runs.kempe(words[0], model, *words[1:], status=None) for model in pair)
            a, b = np.array(numbers(one)), np.array(numbers(other))
            self.assertEqual(a.shape, b.shape, words)
            self.assertGreater(len(a), 3, words)
            self.assertLessEqual(abs(a - b).max(), 1e-7 * max(1, abs(a).max()), words)

    def test_unit_and_checkpoint(self):
        """A unit on the library carries the file; a run does not go on with another one."""
        body = cloud()
        model = self.model(ARM, sid(body))
        unit, state = self.root / "arm.fmu", self.root / "run.checkpoint"
        subprocess.run([runs.command, "fmu", model, "--binary", "--no-cache", "-q", "-o", unit], check=True, capture_output=True)
        with zipfile.ZipFile(unit) as archive:
            self.assertEqual(archive.read("resources/model/arm.SID_FEM").decode(), sid(body))
        runs.kempe("simulate", model, "--no-convergence-check", "--t-end", "0.1", "--checkpoint", state)
        again = ("simulate", model, "--no-convergence-check", "--t-end", "0.2", "--resume", state)
        runs.kempe(*again)
        (self.root / "arm.SID_FEM").write_text(sid(body | {"K": body["K"] * 1.01}))
        done = subprocess.run([runs.command, *map(str, again)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        self.assertIn("the checkpoint is of another model, or the model has changed", done.stderr)

    def test_doubts(self):
        """Check and results say what a file lacks or contradicts, and a fast rotation is not trustworthy."""
        def lacking(zero, first):
            del first["Oe"]

        def off(zero, first):
            first["Oe"] = [1.5 * x for x in first["Oe"]]

        def little(zero, first):
            first["Oe"] = [1.002 * x for x in first["Oe"]]

        body = cloud()
        expected = runs.simulated(self.reference(ARM, body))[1]
        slow = ARM.replace("S: 4, A: -3", "S: 0.4, A: -0.3").replace("gravity: [1, -9.81, 2]\n", "").replace("stiffness: 120", "stiffness: 1")
        for change, words in ((lacking, "its file has no centrifugal terms of the deformed body (Oe of first order)"), (off, "its centrifugal terms of the deformed body (Oe of first order) differ from its mass Me by 0.5 of it")):
            model = self.model(ARM, sid(body, change=change))
            said, rows = runs.simulated(model, status=5)
            self.assertIn(words, said["flexible"]["arm"]["doubt"])
            self.assertIn(words, said["warnings"][-1])
            self.assertIn(", so that rates up to 0.1 are right", said["warnings"][-1])
            self.assertIn("file 'arm.SID_FEM' of body 'arm': " + words, said["warnings"][0])
            shown = " ".join(subprocess.run([runs.command, "check", model], capture_output=True, text=True).stdout.split())
            self.assertIn("warning: " + words, shown)
            self.assertIn("the body is right where it turns with less than 0.1 of its first frequency", shown)
            shown = subprocess.run([runs.command, "simulate", model, "--no-convergence-check", "-q"], capture_output=True, text=True).stdout
            self.assertIn("arm: warning: " + words, " ".join(shown.split()))
            one, other = (runs.simulated(path, "--t-end", "0.2")[1] for path in (self.model(slow, sid(body, change=change)), self.reference(slow, body)))
            self.same(*([{key: x for key, x in row.items() if key[:2] in ("t", "q.")} for row in rows] for rows in (one, other)), 1e-3)
            self.assertGreater(max(abs(a[key] - b[key]) for a, b in zip(rows, expected) for key in a), 1e-3)
        said = runs.simulated(self.model(ARM, sid(body, change=little)))[0]
        self.assertRegex(said["flexible"]["arm"]["doubt"], r"its Oe and Me \(mode .\) differ by 0.002 of their scale: they are not integrals over one mass")

    def test_as_written_elsewhere(self):
        """Comments before the body, names and structures of other programs; more nodes than stations; a held node."""
        body = cloud()
        text = sid(body).replace("\n", "$ \r\n").replace("mdCM", "mCM").replace("\nJ$", "\nmmi$").replace("end J$", "end mmi$")
        text = "made by a program\nfor kg and m\n" + text.split("\n", 1)[1]
        self.same(runs.simulated(self.model(ARM, text))[1], runs.simulated(self.reference(ARM, body))[1], 1e-9)


FREE = """kempe: 1
bodies:
  body: {joint: {name: A, JOINT, at: ground}, flexible: {FLEXIBLE}, points: {B: {interface: "20"}}}
"""
SWING = """kempe: 1
gravity: [0, -0.02, 0.01]
bodies:
  body: {joint: {name: A, spherical: z, at: ground}, flexible: {FLEXIBLE}, points: {B: {interface: "20"}}}
  end: {joint: {name: E, revolute: z, at: body.B}, mass: 0.3, com: [0.1, 0, 0], inertia: {xx: 0.01, yy: 0.02, zz: 0.02}, points: {T: [0.2, 0, 0]}}
run: {t_end: 0.5, rtol: 1e-10, output_step: 0.1, outputs: [q, position(end.T)]}
"""


class Matrices(Folder):
    WORDS = "interfaces: {A: 1001, B: 20}"

    def pair(self, text, body, content=None, words="", **files):
        """The model with the matrices and with the arrays."""
        text = text.replace('interface: "20"', "interface: B")
        for name, other in files.items():
            (self.root / name.replace("_", ".")).write_text(other)
        return (self.put(text.replace("FLEXIBLE", f"file: body.pch{SCALE}, {self.WORDS}{words}"), "body.pch", content or pch(body)),
                self.put(text.replace("FLEXIBLE", f"file: npz.npz, {self.WORDS}"), "npz.npz", lattice_arrays(body)))

    def test_modes(self):
        """Frequencies at rest depend on what the matrices have: free, clamped, and with the second end on a pin."""
        body = lattice()
        for joint in ("free: x", "weld: yes", "revolute: z", "spherical: z"):
            text = FREE.replace("JOINT", joint)
            if joint == "weld: yes":
                text = text.replace("bodies:", "bodies:\n  base: {joint: {name: S, prismatic: x, at: ground}, mass: 1}").replace("at: ground}, flexible", "at: base}, flexible")
            found, expected = ([complex(*x) for x in runs.kempe("modes", model)["eigenvalues"]] for model in self.pair(text, body))
            found, expected = (np.sort(np.abs(x)) for x in (found, expected))
            self.assertEqual(len(found), len(expected))
            kept = expected > 1
            self.assertGreater(kept.sum(), 16)
            self.assertLessEqual(abs(found[kept] / expected[kept] - 1).max(), 1e-8, joint)

    def test_slow_motion(self):
        """A slow motion is that of the arrays, to the square of the rate by the first frequency; the result says so."""
        for formulation in ("reduced", "projected", "dae"):
            (said, rows), (_, expected) = (runs.simulated(model, "--formulation", formulation) for model in self.pair(SWING, lattice()))
            self.assertIn("its file has only the motions of interfaces: centrifugal forces on its modes are not known", said["flexible"]["body"]["doubt"])
            self.same(rows, expected, 1e-6)
            self.assertGreater(max(abs(row["q.A.1"]) + abs(row["q.A.3"]) for row in rows), 1e-3)

    def test_fast_motion(self):
        model = self.pair(SWING.replace("run:", "start: {qd: {A.2: 4, A.3: 6}}\nrun:"), lattice())[0]
        said, _ = runs.simulated(model, status=5)
        self.assertIn("so that rates up to 0.1 are right", said["warnings"][-1])

    def test_equilibrium(self):
        one, other = (runs.kempe("equilibrium", model) for model in self.pair(SWING.replace("spherical: z", "revolute: z").replace("0.01]", "0]"), lattice()))
        for key, x in other["q"].items():
            self.assertLessEqual(abs(one["q"][key] - x), 1e-9, key)

    def test_forms(self):
        """Both triangles, eight columns, commas, small letters, places in the model or in another file, damping, units."""
        body = lattice(k=2)
        label = labels(body)
        damped = body["K"] * 1e-5
        expected = np.array(runs.kempe("modes", self.pair(FREE.replace("JOINT", "free: x"), body)[0])["eigenvalues"])

        def check(content, words="", tolerance=1e-6, **files):
            found = np.array(runs.kempe("modes", self.pair(FREE.replace("JOINT", "free: x"), body, content, words, **files)[0])["eigenvalues"])
            self.assertLessEqual(abs(np.sort(np.hypot(*found.T)) - np.sort(np.hypot(*expected.T))).max(), tolerance * abs(expected).max())
            return found

        check(pch(body, form=1))
        check(pch(body).lower())
        a, b = body["ends"]
        check(pch(body, places=False), f", nodes: {{1001: {a.tolist()}, 20: {b.tolist()}}}")
        check(pch(body, places=False), ", nodes: places.bdf", places_bdf="CEND\nBEGIN BULK\nCORD2R,7,0,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRID,9,7,1.,2.,3.\n".replace("GRID,9,7", "GRID,9,")
              + "\n".join(f"grid,{n},,{x[0]!r},{x[1]!r},{x[2]!r}" for n, x in zip((1001, 20), (a, b))) + "\nENDDATA\n")
        with_commas = [",".join(["DMIG", name, str(j[0]), str(j[1]), "", *sum(([str(i[0]), str(i[1]), repr(float(m[r, c])), ""] for r, i in enumerate(label) if r >= c and m[r, c] != 0), [])[:4]])
                       + "".join("\n," + ",".join([str(i[0]), str(i[1]), repr(float(m[r, c])), ""]) + ",,,," for r, i in list((r, i) for r, i in enumerate(label) if r >= c and m[r, c] != 0)[1:])
                       for name, m in (("KAAX", body["K"]), ("MAAX", body["M"])) for c, j in enumerate(label)]
        heads = ["DMIG,KAAX,0,6,2,0,,,14", "DMIG,MAAX,0,6,2,0,,,14"]
        n = len(label)
        check("\n".join([*grids(body), heads[0], *with_commas[:n], heads[1], *with_commas[n:], ""]))
        found = check(pch(body) + "\n".join([*punched("BAAX", damped, label), ""]))
        self.assertLess(found[:, 0].min(), -1)
        size = np.array([1.0] * 3 + [1e3] * 3 + [1.0] * 3 + [1e3] * 3 + [1.0] * (n - 12))
        other = body | {"K": body["K"] * 1e-3 * np.outer(size, size), "M": body["M"] * 1e-3 * np.outer(size, size), "ends": body["ends"] * 1e3}
        model = self.put(FREE.replace("JOINT", "free: x").replace("FLEXIBLE", f"file: body.pch, scale: {{length: 1 mm, mass: 1000 kg}}, {self.WORDS}").replace('interface: "20"', "interface: B"), "body.pch", pch(other))
        found = np.array(runs.kempe("modes", model)["eigenvalues"])
        self.assertLessEqual(abs(np.sort(np.hypot(*found.T)) - np.sort(np.hypot(*expected.T))).max(), 1e-6 * abs(expected).max())


    def test_eight_columns(self):
        """Two bodies on an elastic joint, whose matrices are whole numbers, in columns of 8 and of 16."""
        gap = np.hstack([-np.eye(6), np.eye(6)])
        gap[:3, 3:6] = tilde([1, 0, 0])
        body = {"K": gap.T @ np.diag([900.0, 500, 700, 20, 30, 40]) @ gap, "M": np.diag([2.0, 2, 2, .5, .25, .75, 3, 3, 3, 1, 2, 1.5]), "ends": np.array([[0.0, 0, 0], [1, 0, 0]])}
        label = labels(body)

        def narrow(name, matrix):
            lines = [f"DMIG    {name:<8}       0       6       1       0{'':>16}{len(label):>8}"]
            for j, column in enumerate(label):
                rows = [f"{label[i][0]:>8}{label[i][1]:>8}{matrix[i, j]:>8.6g}{'':8}" for i in range(j, len(label)) if matrix[i, j] != 0]
                lines += [f"DMIG    {name:<8}{column[0]:>8}{column[1]:>8}{'':8}{rows[0]}"] + ["        " + "".join(rows[k:k + 2]) for k in range(1, len(rows), 2)]
            return lines

        text = FREE.replace("JOINT", "free: x")
        found = [runs.kempe("modes", self.pair(text, lattice(), content)[0])["eigenvalues"] for content in (pch(body), "\n".join([*grids(body), *narrow("KAAX", body["K"]), *narrow("MAAX", body["M"]), ""]))]
        self.assertEqual(found[0], found[1])
        self.assertGreater(len(found[0]), 12)


# -- mistakes ------------------------------------------------------------------------------------------

def instead(old, new, count=1):
    def change(text):
        assert old in text, old
        return text.replace(old, new, count)
    return change


def altered(change):
    return lambda text: sid(cloud(n=2), change=change)


def set_zero(name, entry, value):
    def change(zero, first):
        zero[name] = zero[name].copy()
        zero[name][entry] = value
    return altered(change)


def entry_of(pattern, by):
    return lambda text: re.sub(pattern, by, text, count=1, flags=re.S)


# A change of the text, words of the model in place of others, the sentence, and whether a line of the file is named.
SID = "file 'arm.SID_FEM' of body 'arm': "
SID_MISTAKES = [
    (None, (SCALE, ""), SID + "it does not say its units: give them by 'scale: {length: 1, mass: 1}'", False),
    (lambda text: "nothing\n", None, SID + "it has no line 'part', which begins a body of standard input data", False),
    (lambda text: text[:len(text) // 2], None, "it ends before 'end part': it is not complete", True),
    (lambda text: text[:200] + "\0" + text[200:], None, "it is not a text file: its byte 200 is zero", False),
    (instead("nelastq = 2", "nelastq = 900"), None, "nelastq, the number of modes, is ' 900': 1 to 200 are read", True),
    (instead("nelastq = 2\n", ""), None, "'refmod' has no 'nelastq', the number of modes", False),
    (entry_of(r"mass = [^\n]*", "mass = -1"), None, "the mass is ' -1': a positive number is expected", True),
    (entry_of(r"mass = [^\n]*\n", ""), None, "'refmod' has no mass", False),
    (instead("rframe = body ref", "sframe = body ref"), None, "'sframe' is not an object of standard input data: a node has origin, phi, psi, AP and sigma", True),
    (instead("\nKe\n", "\nKx\n"), None, "'Kx' is not an object of standard input data: a body has refmod, frame", True),
    (instead("end frame", "end frames"), None, "'end frames' is not expected here: a frame has nodes", True),
    (entry_of(r"\nKe\n.*end Ke", ""), None, "it has no object 'Ke'", False),
    (instead("\nKe\n", "\nKe\nend Ke\nKe\n"), None, "'Ke' is there twice: the first one is in line", True),
    (entry_of(r"end Me", "end Ke"), None, "'end Ke' ends 'Me', which began in line", True),
    (entry_of(r"(Oe\norder = 1\nnrow = )2", r"\g<1>3"), None, "'Oe' is 3 x 6: 2 x 6 is expected of 2 modes", True),
    (entry_of(r"(Oe\norder = )1", r"\g<1>0"), None, "'Oe' is of order 0, and has an entry m1", True),
    (entry_of(r"(Oe\norder = )1", r"\g<1>2"), None, "'Oe' is of order 2: orders 0 and 1 are read", True),
    (entry_of(r"(Oe\norder = )1", r"\g<1>x"), None, "'order' of 'Oe' is ' x': a whole number from 0 to 9 is expected", True),
    (entry_of(r"(new node = 12\n.*?)m0\(  1,  1\)", r"\1m0(  1,  9)"), None, "entry m0 of 'origin' is in row 1, column 9: it has 3 rows, 1 columns and 2 modes", True),
    (entry_of(r"(Me\n.*?)m0\(  1,  1\)", r"\1m0(  1,  x)"), None, "'m0(1,x)' of 'Me': entries are m0(row, column) and m1(row, mode, column), counted from 1", True),
    (entry_of(r"(Me\n.*?m0\(  1,  1\) = )\S*", r"\1NaN"), None, "'m0(1,1)' of 'Me' is ' NaN': a number up to 1e+100 is expected", True),
    (entry_of(r"(Me\n.*?m0\(  1,  1\) = )\S*", r"\g<1>1D+120"), None, "'m0(1,1)' of 'Me' is ' 1D+120': a number up to 1e+100 is expected", True),
    (entry_of(r"(Me\n.*?)(m0\(  1,  1\) = \S*)", r"\1\2\n\2"), None, "entry m0 of row 1, column 1 of 'Me' is there twice", True),
    (entry_of(r"(Me\n.*?structure = )2", r"\g<1>4"), None, "and its structure 4 says that it is the unit matrix", True),
    (entry_of(r"(Ke\n.*?structure = )2", r"\g<1>1"), None, "entry m0 of row 2, column 1 of 'Ke' is", True),
    (entry_of(r"(Ke\n.*?structure = )2", r"\g<1>3"), None, "'Ke' is not symmetric: entry (2, 1) is", True),
    (set_zero("Me", (0, 0), -1.0), None, "'Me': the mass of mode 1 is -1: it must be positive", True),
    (set_zero("Me", (0, 0), 1e-9), None, "the mass of the modes, the traces of T, is not positive", False),
    (set_zero("ksigma", (1, 0), 5.0), None, "'ksigma' is not zero: bodies with stresses before deformation are not read", True),
    (set_zero("Ct", (0, 0), 50.0), None, "mdCM and Ct (mode 1) differ by", False),
    (set_zero("Gr", (0, 0), 50.0), None, "Gr and Cr with Oe (mode 1) differ by", False),
    (entry_of(r"(new node = 12.*?AP.*?m1\([ \d,]*\) = )\S*", r"\g<1>5"), None, "the axes of node '12' turn otherwise than by psi", True),
    (entry_of(r"(new node = 12.*?origin.*?m1\([ \d,]*\) = )\S*", r"\g<1>5"), None, "the place of node '12' moves otherwise than by phi", True),
    (entry_of(r"(new node = 12.*?)psi\n.*?end psi\n", r"\1"), None, "node '12' has no object 'psi'", True),
    (None, ('interface: "12"}', 'interface: "13"}'), "it is 7 or 12, not '13'", False),
    (None, (SCALE, SCALE + ", stiffening: first"), "'first' needs the arrays 'h', 'Y' and 'interface_H', which the file does not have, or Ct, Oe and phi of first order in standard input data", False),
    (None, (SCALE, SCALE + ", interfaces: {A: [1, 2, 3]}"), "the file has no nodes", False),
    (None, ("arm.SID_FEM", "arm.txt"), "its ending is of no format that is read: .npz (arrays of kempe-flexible-1), .sid_fem (standard input data (SID))", False),
]


FORCE = "file 'body.pch' of body 'body': "
PCH_MISTAKES = [
    (None, (SCALE, ""), FORCE + "it does not say its units: give them by 'scale: {length: 1, mass: 1}'", False),
    (lambda text: "SOL 103\nCEND\n", None, "it has no matrix of stiffness, DMIG KAAX", False),
    (lambda text: text.replace("MAAX", "PAAX"), None, "it has no matrix of mass, DMIG MAAX", False),
    (lambda text: text + text[text.index("DMIG    KAAX"):text.index("DMIG    MAAX")].replace("KAAX", "KBBX"), None, "a second matrix of stiffness: one of them is 'KAAX', of line", True),
    (lambda text: "\n".join(line for line in text.split("\n") if not line.startswith("DMIG    KAAX")), None, "a column of the matrix 'KAAX' without its first card, DMIG KAAX 0 ..", True),
    (instead("KAAX           0       6       2", "KAAX           0       2       2"), None, "the matrix of stiffness has the form 2: 1, square, and 6, symmetric, are read", True),
    (instead("KAAX           0       6       2", "KAAX           0       6       4"), None, "the matrix of stiffness has the type 4: 1 and 2, real numbers, are read", True),
    (instead("KAAX           0       6       2", "KAAX           0       1       2"), None, "the matrix 'KAAX' of the form 1 is not symmetric: the entries of coordinates", True),
    (entry_of(r"D\+04", "X+04"), None, "an entry of card DMIG is", True),
    (entry_of(r"(DMIG\*   KAAX {12} {12}1001)", r"DMIG*   KAAX                        1a01"), None, "the grid point of a column of card DMIG is '1a01': a whole number is expected", True),
    (entry_of(r"(DMIG\*   KAAX.*?\n)(\*[^\n]*\n)", r"\1\2*                   1001               1 5.000000000D+00\n"), None, "the matrix 'KAAX' has the entry of point 1001, component 1, and point 1001, component 1, twice", True),
    (entry_of(r"(DMIG\*   KAAX.*?\n\* *1001 *)1", r"\g<1>7"), None, "the matrix 'KAAX' has an entry of points", True),
    (lambda text: pch(lattice(k=2), keep=[k for k in range(14) if k != 11]), None, "point 20 has 5 components, from 1 on: an interface is a grid point with components 1 to 6", False),
    (lambda text: text.split("GRID*")[0] + text[text.index("DMIG"):], None, "it does not say where grid point 20 is: give its place by 'nodes: {20: [x, y, z]}'", False),
    (lambda text: text.replace("GRID*               1001                ", "GRID*               1001               5"), None, "grid point 1001 is in the coordinate system CP = 5: places and displacements in the basic system are read", True),
    (lambda text: "GRDSET,,3\n" + text, None, "GRDSET gives all grid points a coordinate system", True),
    (lambda text: text.replace("DMIG*   KAAX", "DMIG*\tKAAX", 1), None, "card DMIG has a tab: its columns are not known; write blanks", True),
    (lambda text: text + "\n".join([*punched("K4AAX", np.eye(2), [(20, 1), (20, 2)]), ""]), None, "structural damping, 'K4AAX', is of harmonic motions: remove the matrix, and take 'damping'", True),
    (lambda text: text.replace("GRID*                 20                ", "GRID*                 20                ", 1).replace("GRID", "HRID"), (SCALE, SCALE + ", nodes: {20: [2, 0, 0], 1001: [0, 1, 0]}"), "its stiffness resists the rigid rotation about x by", False),
    (lambda text: pch(lattice(k=2) | {"M": lattice(k=2)["M"] * np.where(np.arange(14) % 6 == 0, 1.2, 1)}), None, "its rigid mass differs between directions", False),
    (lambda text: pch(lattice(k=2) | {"K": lattice(k=2)["K"] + 50 * np.eye(14)}), None, "its stiffness resists the rigid translation along x by", False),
    (lambda text: pch(lattice(k=2) | {"K": lattice(k=2)["K"] * np.where(np.arange(14) > 11, -1, 1)[:, None] * np.ones(14)}), None, "the stiffness of its scalar points is not positive", False),
    (None, (SCALE, SCALE + ", nodes: {x: [0, 0, 0]}"), "the number of a node is expected", False),
    (None, (SCALE, SCALE + ", nodes: {20: [0, 0]}"), "node '20' of file 'body.pch' of body 'body'", False),
    (None, (SCALE, SCALE + ", nodes: absent.bdf"), "cannot read", False),
    (None, (SCALE, SCALE + ", stiffening: first"), "'first' needs the arrays", False),
    (None, (SCALE, SCALE + ", modes: 9"), "modes of body 'body' are 9: a whole number from 1 to 8, which the file has, is expected", False),
    (None, ('interface: "20"', "node: 20"), "the node of point 'body.B' is 20: the file has no nodes", False),
]
OTHERS = [("body.mnf", "it is a modal neutral file of Adams, whose layout is not public, which is not read: export the body from the finite element program as standard input data (SID)"),
          ("body.OP4", "it is a file OUTPUT4 of Nastran, which is not read: write its matrices as DMIG"), ("body.op2", "it is a file OUTPUT2 of Nastran, which is not read"),
          ("body.fem", "it is a modal body of MBDyn or a deck of OptiStruct, which is not read: write modes, modal matrices and masses as an .npz of kempe-flexible-1"),
          ("body.npy", "it is one array of NumPy, in Exudyn a pickled program, which is not read: write it again by 'python -m kempe.convert FILE OTHER.npz'"),
          ("body.mtx", "it is a matrix of Matrix Market, which is not read"), ("body", "its ending is of no format that is read"), ("body.sid.gz", "its ending is of no format that is read")]
STILL = re.sub(r"start: .*\n", "", ARM)


class Mistakes(Folder):
    def test_matrices(self):
        whole = pch(lattice(k=2))
        for change, words, sentence, in_file in PCH_MISTAKES:
            with self.subTest(sentence):
                text = FREE.replace("JOINT", "revolute: z").replace("FLEXIBLE", "file: body.pch" + SCALE)
                self.refused(self.put(text.replace(*words) if words else text, "body.pch", change(whole) if change else whole), sentence, in_file)

    def test_nodes(self):
        """Mistakes in the text with the nodes are at its lines; formats with nodes of their own have none beside."""
        text = FREE.replace("JOINT", "revolute: z").replace("FLEXIBLE", f"file: body.pch{SCALE}, nodes: places.bdf")
        for places, sentence, line in (("GRID,20,,0.,0.,x\n", "a coordinate of card GRID is 'x'", "places.bdf:1:16"), ("$\nGRID,20,,0.,0.,0.,6\n", "grid point 20 is in the coordinate system CD = 6", "places.bdf:2:1")):
            (self.root / "places.bdf").write_text(places)
            model = self.put(text, "body.pch", pch(lattice(k=2), places=False))
            done = subprocess.run([runs.command, "check", model], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2)
            self.assertIn(sentence, done.stderr)
            self.assertIn(line, done.stderr)
        (self.root / "places.bdf").write_bytes(b"GRID,20\0")
        self.refused(model, "'places.bdf' is not a text file: it has bytes of zero", False)
        self.refused(self.put(STILL.replace("FLEXIBLE", f"file: arm.sid{SCALE}, nodes: {{1: [0, 0, 0]}}"), "arm.sid", sid(cloud(n=2))), "its nodes are in it: remove 'nodes'", False)

    def test_formats_that_are_not_read(self):
        for name, sentence in OTHERS:
            (self.root / name).write_text("content")
            (self.root / "arm.yaml").write_text(FREE.replace("JOINT", "revolute: z").replace("FLEXIBLE", "file: " + name))
            self.refused(self.root / "arm.yaml", f"file '{name}' of body 'body': {sentence}", False)

    def test_rigid_modes(self):
        """Modes that are rigid motions alone."""
        body = cloud(n=2)
        body["phi"] = np.stack([np.cross([0, 0, 1], body["place"]), np.cross([0, 1, 0], body["place"])], axis=2)
        self.refused(self.put(STILL.replace("FLEXIBLE", "file: arm.sid" + SCALE), "arm.sid", sid(body)), "all its modes are rigid motions: without others the body is rigid", False)

    def test_exudyn(self):
        """Pickled arrays are not read, and the command that converts them is named."""
        text = STILL.replace("FLEXIBLE", "file: arm.npz")
        pickled = {name: np.array({"a": 1}, dtype=object) for name in ("nodes", "modeBasis", "massMatrix", "stiffnessMatrix")}
        self.refused(self.put(text, "arm.npz", pickled), "it is a file of Exudyn, whose arrays are pickled programs: write it again by 'python -m kempe.convert FILE OTHER.npz'", False)

    def refused(self, model, words, in_file):
        done = subprocess.run([runs.command, "check", model], capture_output=True, text=True)
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        said = [line for line in done.stderr.splitlines() if line and "warning" not in line]
        self.assertIn(words, said[0])
        self.assertRegex(said[0], rf"{'(arm.SID_FEM|body.pch)' if in_file else '.yaml'}:\d+:\d+: ")

    def test_standard_input_data(self):
        whole = sid(cloud(n=2))
        for change, words, sentence, in_file in SID_MISTAKES:
            with self.subTest(sentence):
                text = STILL.replace("FLEXIBLE", "file: arm.SID_FEM" + SCALE)
                if words:
                    text = text.replace(*words)
                (self.root / "arm.txt").write_text(whole)
                self.refused(self.put(text, "arm.SID_FEM", change(whole) if change else whole), sentence, in_file)

    def test_second_order_of_standard_input_data(self):
        """Terms of second order are whole, or refused."""
        body = cloud(n=2, second=True)
        for words, change, sentence in ((", stiffening: none", None, "terms of second order cannot be left out, because the file has the stiffening by rotation within its centrifugal terms (Oe)"),
                                        ("", lambda zero, first: first.pop("Oe"), "Ct or phi has terms of second order, and Oe has none: write all of them"),
                                        (", interfaces: {A: 12, B: 7}", None, "its modes move or turn the first interface, and its terms of second order are in their frame")):
            text = STILL.replace("FLEXIBLE", "file: arm.SID_FEM" + SCALE + words).replace('interface: "12"', "interface: B" if "interfaces" in words else 'interface: "12"')
            self.refused(self.put(text, "arm.SID_FEM", sid(body, change=change)), sentence, False)
        text = re.sub(r"(new node = 12.*?phi\norder = )1(.*?)\nm1.*?\nend phi", r"\g<1>0\2\nend phi", sid(body), flags=re.S)
        self.refused(self.put(STILL.replace("FLEXIBLE", "file: arm.SID_FEM" + SCALE), "arm.SID_FEM", text), "the file has no displacements of second order for interface '12'", False)

    def test_damaged(self):
        """Texts cut anywhere, or with other bytes, end in a sentence or are read: none is a fault of the program."""
        rng = np.random.default_rng(1)
        for name, text, whole in (("arm.SID_FEM", STILL, sid(cloud(n=2)).encode()), ("body.pch", FREE.replace("JOINT", "revolute: z"), pch(lattice(k=1)).encode())):
            model = self.put(text.replace("FLEXIBLE", f"file: {name}{SCALE}"), name, whole.decode())
            for _ in range(300 if runs.FULL else 30):
                bytes_ = bytearray(whole[:rng.integers(len(whole))] if rng.random() < 0.3 else whole)
                for _ in range(int(rng.integers(1, 4))):
                    if bytes_:
                        bytes_[rng.integers(len(bytes_))] ^= 1 << int(rng.integers(8))
                (self.root / name).write_bytes(bytes_)
                done = subprocess.run([runs.command, "check", model], capture_output=True)
                self.assertIn(done.returncode, (0, 2), done.stderr)


def main():
    runs.main()


if __name__ == "__main__":
    main()
