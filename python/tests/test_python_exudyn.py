# SPDX-License-Identifier: BSD-3-Clause
"""Bodies of Exudyn as files of kempe-flexible-1: from objects, and from pickled files of which nothing is run."""

import io
import os
import pickle
import subprocess
import sys
import types
import zipfile

import kempe
import numpy as np
import pytest
from kempe.exudyn import read_exudyn


class Csr:
    """A substitute for scipy.sparse.csr_matrix, pickled under its name."""

    def __init__(self, dense):
        row, column = np.nonzero(dense)
        self._shape, self.data, self.indices = dense.shape, dense[row, column], column.astype(np.int32)
        self.indptr = np.searchsorted(row, np.arange(len(dense) + 1)).astype(np.int32)

    def tocoo(self):
        row = np.repeat(np.arange(len(self.indptr) - 1), np.diff(self.indptr))
        return types.SimpleNamespace(row=row, col=self.indices, data=self.data)


Csr.__module__, Csr.__qualname__, Csr.__name__ = "scipy.sparse._csr", "csr_matrix", "csr_matrix"


@pytest.fixture
def scipy(monkeypatch):
    """The module that has the class while it is pickled."""
    for name in ("scipy", "scipy.sparse", "scipy.sparse._csr"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    sys.modules["scipy.sparse._csr"].csr_matrix = Csr


def truss(seed=5):
    """Sixteen points with masses and bars, the ends of four points each; modes of random combinations and rigid ones."""
    rng = np.random.default_rng(seed)
    place = np.array([[0.3 * i, 0.1 * j, 0.12 * m] for i in range(4) for j in range(2) for m in range(2)])
    place += rng.normal(size=(16, 3)) * 0.01
    stiffness = np.zeros((48, 48))
    for a in range(16):
        for b in range(a):
            along = place[a] - place[b]
            size = np.linalg.norm(along)
            if size < 0.42:
                row = np.zeros(48)
                row[3 * a : 3 * a + 3], row[3 * b : 3 * b + 3] = along / size, -along / size
                stiffness += 2e4 / size * np.outer(row, row)
    masses = np.diag(rng.uniform(0.05, 0.2, 16))
    masses[0, 1] = masses[1, 0] = 0.01
    values, vectors = np.linalg.eigh(stiffness)
    return types.SimpleNamespace(
        nodes={"Position": place},
        massMatrix=Csr(np.kron(masses, np.eye(3))),
        stiffnessMatrix=Csr(stiffness),
        nodeSets=[{"Name": "left", "NodeNumbers": np.arange(4)}, {"Name": "right", "NodeNumbers": [12, 13, 14, 15]}],
        modeBasis={"matrix": vectors[:, :12], "type": "NormalModes"},
        elements=[],
        surface=[],
        elementSets=[],
        dense=(masses, stiffness),
    )


def save(fem, path):
    """As FEMinterface.SaveToFile writes .npz, .npy and .pkl."""
    members = {key: getattr(fem, key) for key in ("nodes", "elements", "surface", "nodeSets", "elementSets", "modeBasis")}
    members |= {"massMatrix": fem.massMatrix, "stiffnessMatrix": fem.stiffnessMatrix, "fileVersion": 4}
    if path.suffix == ".npz":
        np.savez(path, **members)
    elif path.suffix == ".pkl":
        path.write_bytes(pickle.dumps(members))
    else:
        with open(path, "wb") as file:
            np.save(file, np.array([4]))
            np.save(file, fem.nodes, allow_pickle=True)
            np.save(file, fem.elements, allow_pickle=True)
            triplets = {}
            for key in ("massMatrix", "stiffnessMatrix"):
                found = getattr(fem, key).tocoo()
                triplets[key] = np.array([found.row, found.col, found.data]).T
            np.save(file, triplets | {"type": "sparseTriplets"}, allow_pickle=True)
            for key in ("surface", "nodeSets", "elementSets", "modeBasis"):
                np.save(file, getattr(fem, key), allow_pickle=True)


MODEL = """kempe: 1
bodies:
  arm: {joint: {name: S, free: x, at: ground}, flexible: {file: arm.npz}, points: {B: {interface: right}}}
"""


def frequencies(folder):
    (folder / "arm.yaml").write_text(MODEL)
    found = np.abs(kempe.Model(folder / "arm.yaml").system().modes().eigenvalues)
    return np.unique(np.round(found[found > 1], 6))


def test_object(tmp_path):
    """Mass, stiffness and free frequencies of the reduced body equal the values of the whole one."""
    fem = truss()
    kempe.convert_exudyn(fem, tmp_path / "arm.npz")
    file = np.load(tmp_path / "arm.npz")
    masses, stiffness = fem.dense
    basis = fem.modeBasis["matrix"]
    assert abs(file["K"] - basis.T @ stiffness @ basis).max() < 1e-10
    dense = np.zeros((16, 16))
    dense[file["mass_row"].astype(int), file["mass_col"].astype(int)] = file["mass_value"]
    assert (dense == masses).all() and (file["nodes"] == fem.nodes["Position"]).all()
    assert list(file["interface_names"]) == ["left", "right"]
    mass = basis.T @ np.kron(masses, np.eye(3)) @ basis
    factor = np.linalg.inv(np.linalg.cholesky(mass))
    expected = np.sqrt(np.abs(np.linalg.eigvalsh(factor @ file["K"] @ factor.T)[6:]))
    assert abs(frequencies(tmp_path) - expected).max() < 1e-5


def test_interfaces(tmp_path):
    """A rigid motion of the nodes of an interface is the motion of the interface; names and numbers of nodes choose it."""
    fem = truss()
    place = fem.nodes["Position"]
    shift, turn = np.array([0.1, -0.2, 0.3]), np.array([0.4, 0.5, -0.6])
    centre = place[12:].mean(0)
    fem.modeBasis["matrix"][36:, 0] = (shift + np.cross(turn, place[12:] - centre)).ravel()
    kempe.convert_exudyn(fem, tmp_path / "arm.npz", {"A": [0, 1, 2, 3], "B": "right"})
    file = np.load(tmp_path / "arm.npz")
    assert list(file["interface_names"]) == ["A", "B"] and abs(file["interface_place"][1] - centre).max() < 1e-15
    assert abs(file["interface_displacement"][1, :, 0] - shift).max() < 1e-13
    assert abs(file["interface_rotation"][1, :, 0] - turn).max() < 1e-13


@pytest.mark.parametrize("ending", [".npz", ".npy", ".pkl"])
def test_files(tmp_path, scipy, ending):
    """Files give the same body as the object, and so does the command."""
    fem = truss()
    kempe.convert_exudyn(fem, tmp_path / "arm.npz")
    path = tmp_path / f"fem{ending}"
    save(fem, path)
    kempe.convert_exudyn(read_exudyn(path), tmp_path / "other.npz")
    words = [sys.executable, "-m", "kempe.convert", path, tmp_path / "third.npz", "--interface", "left=left", "--interface", "right=12,13,14,15"]
    subprocess.run(words, check=True, env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)})
    one = np.load(tmp_path / "arm.npz")
    for name in ("other.npz", "third.npz"):
        other = np.load(tmp_path / name)
        assert one.files == other.files
        for key in one.files:
            assert (one[key] == other[key]).all(), key


# -- files that are more than data -------------------------------------------------------------------


class Calls:
    def __init__(self, function, *arguments):
        self.parts = function, arguments

    def __reduce__(self):
        return self.parts


def pickled(value, protocol=4):
    return pickle.dumps(value, protocol)


def written(tmp_path, content):
    (tmp_path / "fem.pkl").write_bytes(content)
    return tmp_path / "fem.pkl"


MARK = "kempe_exudyn_was_run"
CALLS = [
    (Calls(os.system, f"touch {MARK}"), "calls '(posix|nt).system'"),
    (Calls(eval, "1"), "calls 'builtins.eval'"),
    (Calls(getattr, 1, "real"), "calls 'builtins.getattr'"),
    (Calls(np.load, "x"), "calls 'numpy.*load'"),
    (Calls(np.fromfile, "x"), "calls 'numpy.*fromfile'"),
    (Calls(subprocess.Popen, "x"), "calls 'subprocess.Popen'"),
    (types.SimpleNamespace(a=1), "calls 'types.SimpleNamespace'"),
]


@pytest.mark.parametrize("value, words", CALLS)
@pytest.mark.parametrize("place", ["whole", "inside an array"])
def test_calls(tmp_path, value, words, place):
    """A name of a program is refused before anything is run, wherever it occurs."""
    array = np.empty(1, dtype=object)
    array[0] = value
    content = {"nodes": {"Position": array if place == "inside an array" else value}}
    with pytest.raises(kempe.InputError, match=words):
        read_exudyn(written(tmp_path, pickled(content)))
    np.savez(tmp_path / "fem.npz", nodes=content)
    with pytest.raises(kempe.InputError, match=words):
        read_exudyn(tmp_path / "fem.npz")
    assert not os.path.exists(MARK)


OPS = [
    (b"\x80\x04cnumpy\ndtype\n}(X\x0c\x00\x00\x00__setstate__K\x01ub.", "damaged"),
    (b"\x80\x04cnumpy\nndarray\nN}(X\x01\x00\x00\x00aK\x01u\x86b.", "damaged"),
    (b"\x80\x02\x82\x01.", "damaged"),
    (b"Pid\n.", "refers to data outside of the file"),
    (b"\x80\x04K\x01Q.", "refers to data outside of the file"),
    (b"\x80\x04cnumpy\ndtype\nX\x02\x00\x00\x00V8\x89\x88\x87R.", "an array of the type 'V8'"),
    (b"\x80\x04cnumpy\ndtype\nX\x03\x00\x00\x00c16\x89\x88\x87R.", "an array of the type 'c16'"),
    (b"\x80\x04cnumpy.core.multiarray\n_reconstruct\n)R(K\x01K\x02\x85N\x89C\x00tb.", "an array without numbers"),
    (b"\x80\x04]q\x00h\x00a.", None),
    (b"", "damaged"),
    (b"\x80\x04", "damaged"),
    (b"\x80\x09.", "damaged"),
]


@pytest.mark.parametrize("content, words", OPS)
def test_operations(tmp_path, content, words):
    """Programs of pickle that are not data end in a message; lists within themselves do not make an endless loop."""
    if words is None:
        assert read_exudyn(written(tmp_path, content)).nodes == {}
        return
    with pytest.raises(kempe.InputError, match=words):
        read_exudyn(written(tmp_path, content))


def test_sizes(tmp_path):
    """The number of bytes of an array follows from its shape, and lists that grow without end are not copied."""
    whole = pickled({"nodes": {"Position": np.arange(12.0).reshape(4, 3)}})
    assert (read_exudyn(written(tmp_path, whole)).nodes["Position"] == np.arange(12.0).reshape(4, 3)).all()
    with pytest.raises(kempe.InputError, match=r"an array of 96 bytes: its shape \(4, 5\) needs 160"):
        read_exudyn(written(tmp_path, whole.replace(b"K\x04K\x03\x86", b"K\x04K\x05\x86")))
    deep = []
    for _ in range(200):
        deep = [deep, deep]
    assert read_exudyn(written(tmp_path, pickled({"nodes": deep}))).nodes == {}
    for protocol in range(3, 6):
        found = read_exudyn(written(tmp_path, pickled({"nodes": {"Position": np.ones((2, 3), order="F")}}, protocol)))
        assert (found.nodes["Position"] == 1).all()


def test_damaged(tmp_path, scipy):
    """Files cut anywhere, or with other bytes, end in an error of this reader, or give data."""
    rng = np.random.default_rng(2)
    for ending in (".npz", ".npy", ".pkl"):
        path = tmp_path / f"fem{ending}"
        save(truss(), path)
        whole = path.read_bytes()
        for _ in range(60):
            content = bytearray(whole[: rng.integers(len(whole))] if rng.random() < 0.3 else whole)
            for _ in range(int(rng.integers(1, 6))):
                if content:
                    content[rng.integers(min(len(content), 3000))] ^= 1 << int(rng.integers(8))
            path.write_bytes(content)
            try:
                kempe.convert_exudyn(read_exudyn(path), tmp_path / "arm.npz")
            except kempe.InputError:
                pass


# -- bodies that are none ----------------------------------------------------------------------------


def without(name):
    return lambda fem: setattr(fem, name, None)


def other_nodes(fem):
    fem.nodes["RigidBodyRxyz"] = np.zeros((2, 6))


def other_mass(change):
    def act(fem):
        mass = np.kron(fem.dense[0], np.eye(3))
        change(mass)
        fem.massMatrix = Csr(mass)

    return act


def entry(i, j, value):
    return lambda mass: mass.__setitem__((i, j), value)


def one_triangle(fem):
    fem.stiffnessMatrix = Csr(np.triu(fem.dense[1]))


def few_rows(fem):
    fem.modeBasis = {"matrix": np.zeros((30, 4))}


def no_number(fem):
    fem.nodes["Position"][0, 0] = np.nan


def large(fem):
    fem.massMatrix = Csr(np.eye(60))


MISTAKES = [
    (lambda fem: fem.nodes.clear(), None, "its nodes must all be 'Position'"),
    (other_nodes, None, "its nodes must all be 'Position': only bodies of solid elements are converted"),
    (lambda fem: fem.modeBasis.clear(), None, "its mode basis has 0 rows: compute modes first"),
    (few_rows, None, "its mode basis has 30 rows: compute modes first, with three rows for each of 16 nodes"),
    (no_number, None, "its nodes or modes have entries that are not finite"),
    (without("massMatrix"), None, "there is no matrix of mass: compute it before the body is converted"),
    (without("stiffnessMatrix"), None, "there is no matrix of stiffness"),
    (large, None, "the matrix of mass does not fit the nodes: three rows for each of them are expected, 48 in all"),
    (other_mass(entry(0, 1, 0.5)), None, "the mass couples directions"),
    (other_mass(entry(0, 0, 0.5)), None, "the mass is not the same along x, y and z"),
    (one_triangle, None, "the matrix of stiffness is not symmetric: one triangle of it must be completed"),
    (None, {"A": "middle"}, "interface 'A': there is no set of nodes 'middle'; the sets are: left, right"),
    (None, {"A": [1, 2]}, "interface 'A' has 2 nodes: three or more from 0 to 15 are expected"),
    (None, {"A": [1, 2, 16]}, "interface 'A' has 3 nodes: three or more from 0 to 15 are expected"),
]


@pytest.mark.parametrize("change, interfaces, words", MISTAKES)
def test_mistakes(tmp_path, change, interfaces, words):
    fem = truss()
    if change:
        change(fem)
    with pytest.raises(kempe.InputError, match=words):
        kempe.convert_exudyn(fem, tmp_path / "arm.npz", interfaces)
    assert not (tmp_path / "arm.npz").exists()


def test_line(tmp_path):
    fem = truss()
    fem.nodes["Position"][:4] = [[x, 0, 0] for x in range(4)]
    with pytest.raises(kempe.InputError, match="interface 'left': its nodes are in a line"):
        kempe.convert_exudyn(fem, tmp_path / "arm.npz")


def test_other_files(tmp_path):
    for name, content, words in (
        ("fem.hdf5", b"", ".npz, .npy and .pkl of Exudyn are read"),
        ("fem.npz", b"no archive", "it is not an archive of arrays"),
        ("fem.npy", b"", "an array of it is damaged"),
        ("fem.npy", b"\x93NUMPY\x01\x00", "an array of it is damaged"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(kempe.InputError, match=words):
            read_exudyn(tmp_path / name)
    with pytest.raises(kempe.FileError, match="No such file"):
        read_exudyn(tmp_path / "absent.npz")
    old = io.BytesIO()
    np.save(old, np.array([1]))
    (tmp_path / "fem.npy").write_bytes(old.getvalue())
    with pytest.raises(kempe.InputError, match="of a version before 2"):
        read_exudyn(tmp_path / "fem.npy")
    done = subprocess.run([sys.executable, "-m", "kempe.convert", tmp_path / "absent.npz", tmp_path / "arm.npz"], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)})
    assert done.returncode == 2 and "No such file" in done.stderr
