# SPDX-License-Identifier: BSD-3-Clause
"""Flexible bodies of Exudyn as files of kempe-flexible-1, with the modes that they have.

Files of Exudyn are pickled, and to unpickle is to run what is in the file. Here nothing of it is run: numbers, words, lists,
dicts, arrays and sparse matrices are read as data by classes of this module, and anything else is refused.
"""

from __future__ import annotations

import io
import os
import pickle
import zipfile
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NoReturn

from .errors import Error, FileError, InputError
from .lazy import np
from .options import path_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[Any]

__all__ = ["convert_exudyn", "read_exudyn"]

ALIKE = 1e-9  # of entries of a matrix that must be equal, by the largest one


# -- pickled data ------------------------------------------------------------------------------------


class _Type:
    """A type of numbers or words, by its name: f8, i4, b1, U12, O (a list of objects)."""

    def __init__(self, name: object, *_: object) -> None:
        if not isinstance(name, str) or not (name in ("O", "O8") or name[:1] in "fiubU" and name[1:].isdigit()):
            raise InputError(f"it has an array of the type {name!r}: real numbers and words are read")
        self.name, self.order = name, "<"

    def __setstate__(self, state: object) -> None:
        order = state[1] if isinstance(state, tuple) and len(state) > 1 else None
        if order not in ("<", "|", "=", ">"):
            raise InputError("it has an array in an unknown order of bytes")
        self.order = "<" if order in "|=" else str(order)


class _Array:
    """An array: NumPy makes it from checked bytes."""

    def __new__(cls, *_: object) -> _Array:
        return object.__new__(cls)

    def __init__(self, *_: object) -> None:
        self.value: Any = None

    def __setstate__(self, state: object) -> None:
        if not (isinstance(state, tuple) and len(state) == 5 and isinstance(state[2], _Type)):
            raise InputError("it has an array without numbers")
        _, shape, kind, by_columns, content = state
        if not (isinstance(shape, tuple) and all(isinstance(x, int) and x >= 0 for x in shape)):
            raise InputError("it has an array without a shape")
        if kind.name[0] == "O":
            self.value = content
            return
        self.value = _numbers(content, kind, shape, "F" if by_columns else "C")


class _Number:
    """One number of an array."""

    def __new__(cls, kind: object, content: object) -> Any:
        return _numbers(content, kind, (), "C")[()]

    def __setstate__(self, state: object) -> None:
        raise InputError("it changes a number")


class _Buffer:
    """An array of protocol 5: its bytes, type, shape and order."""

    def __new__(cls, content: object, kind: object, shape: object, order: object) -> Any:
        if not (isinstance(shape, tuple) and all(isinstance(x, int) and x >= 0 for x in shape) and order in ("C", "F")):
            raise InputError("it has an array without a shape")
        return _numbers(bytes(content) if isinstance(content, bytearray) else content, kind, shape, str(order))

    def __setstate__(self, state: object) -> None:
        raise InputError("it changes an array")


class _Sparse:
    """A sparse matrix by rows, with the members of scipy.sparse.csr_matrix."""

    def __new__(cls, *_: object) -> _Sparse:
        return object.__new__(cls)

    def __setstate__(self, state: object) -> None:
        if not isinstance(state, dict):
            raise InputError("it has a sparse matrix without members")
        self.members = state


def _numbers(content: object, kind: object, shape: Any, order: Any) -> Array:
    if not isinstance(kind, _Type) or kind.name[0] == "O" or not isinstance(content, bytes):
        raise InputError("it has an array without numbers")
    found = np.dtype(kind.order + kind.name)
    count = 1
    for size in shape:
        count *= size
    if found.itemsize * count != len(content):
        raise InputError(f"it has an array of {len(content)} bytes: its shape {shape} needs {found.itemsize * count}")
    return np.frombuffer(content, found).reshape(shape, order=order) if content else np.zeros(shape, found)


_STANDS_FOR = {
    "numpy.ndarray": _Array,
    "numpy.dtype": _Type,
    "scipy.sparse._csr.csr_matrix": _Sparse,
    "scipy.sparse._csr.csr_array": _Sparse,
    "scipy.sparse.csr.csr_matrix": _Sparse,
} | {
    f"numpy.{core}.{name}": stand
    for core in ("core", "_core")
    for name, stand in (("multiarray._reconstruct", _Array), ("multiarray.scalar", _Number), ("numeric._frombuffer", _Buffer))
}


class _Reader(pickle.Unpickler):
    """Reads data; names of programs are replaced by the classes above, or are refused."""

    def find_class(self, module: str, name: str) -> Any:
        if f"{module}.{name}" not in _STANDS_FOR:
            raise InputError(f"it calls '{module}.{name}', which is not read: take kempe.convert_exudyn in Exudyn")
        return _STANDS_FOR[f"{module}.{name}"]

    def persistent_load(self, pid: object) -> NoReturn:
        raise InputError("it refers to data outside of the file")


def _plain(x: Any, known: dict[int, Any]) -> Any:
    """Puts arrays in place of their substitutes, in lists and dicts as well; each object once, wherever it occurs."""
    if id(x) in known:
        return known[id(x)]
    if isinstance(x, _Array):
        known[id(x)] = _plain(x.value, known)
    elif isinstance(x, dict):
        own: dict[Any, Any] = {}
        known[id(x)] = own
        own.update((key, _plain(value, known)) for key, value in x.items())
    elif isinstance(x, (list, tuple)):
        items: list[Any] = []
        known[id(x)] = items
        items.extend(_plain(value, known) for value in x)
    else:
        return x
    return known[id(x)]


def _unpickled(stream: Any) -> Any:
    try:
        return _plain(_Reader(stream).load(), {})
    except Error:
        raise
    except Exception as error:  # whatever damaged bytes lead to, also a size beyond all memory
        raise InputError(f"its pickled data are damaged: {type(error).__name__}: {error}") from None


def _stored(stream: Any) -> Any:
    """An array of NumPy's format; one of objects is read as data."""
    try:
        start = stream.tell()
        version = np.lib.format.read_magic(stream)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        if read(stream)[2].hasobject:
            return _unpickled(stream)
        stream.seek(start)
        return np.lib.format.read_array(stream, allow_pickle=False)
    except (Error, MemoryError):
        raise
    except Exception as error:
        raise InputError(f"an array of it is damaged: {error}") from None


def _first(x: Any) -> Any:
    """The object of an array with one."""
    return x[0] if isinstance(x, list) and len(x) == 1 else x


_NAMES = ("nodes", "elements", "matrices", "surface", "nodeSets", "elementSets", "modeBasis")


def _read_members(content: bytes, ending: str) -> dict[str, Any]:
    stream = io.BytesIO(content)
    if ending == ".npz":
        with zipfile.ZipFile(stream) as archive:
            wanted = ("nodes", "massMatrix", "stiffnessMatrix", "nodeSets", "modeBasis")
            return {name: _stored(io.BytesIO(archive.read(name + ".npy"))) for name in wanted if name + ".npy" in archive.namelist()}
    if ending == ".pkl":
        found = _unpickled(stream)
        return found if isinstance(found, dict) else {}
    version = _stored(stream)
    if not isinstance(version, np.ndarray) or version.shape != (1,) or version[0] < 2:
        raise InputError("it is of a version before 2: load it in Exudyn, and save it again")
    members = {name: _stored(stream) for name in _NAMES}
    both = _first(members.pop("matrices"))
    return members | (both if isinstance(both, dict) else {})


def _arrays(x: Any) -> dict[str, Array]:
    """The arrays of a dict."""
    return {key: value for key, value in x.items() if isinstance(value, np.ndarray)} if isinstance(x, dict) else {}


def _is_flat(x: Any) -> bool:
    """An array or a list of whole numbers."""
    return isinstance(x, np.ndarray) and x.dtype.kind in "iu" or isinstance(x, list) and all(isinstance(k, int) for k in x)


def read_exudyn(path: str | os.PathLike[str]) -> SimpleNamespace:
    """The nodes, matrices, sets of nodes and modes in a file of Exudyn's FEMinterface.SaveToFile, .npz, .npy or .pkl, with the
    names that they have in Exudyn. Nothing in the file is run.

    Raises InputError if the file has another format or other content than data. Raises FileError if it cannot be read."""
    name = path_of(path).decode()
    ending = os.path.splitext(name)[1].lower()
    if ending not in (".npz", ".npy", ".pkl"):
        raise InputError(f"'{name}': .npz, .npy and .pkl of Exudyn are read; other files by kempe.convert_exudyn in Exudyn")
    try:
        with open(name, "rb") as file:
            members = _read_members(file.read(), ending)
    except OSError as error:
        raise FileError(f"'{name}': {error.strerror}") from None
    except zipfile.BadZipFile as error:
        raise InputError(f"'{name}': it is not an archive of arrays: {error}") from None
    except InputError as error:
        raise InputError(f"'{name}': {error.message}") from None
    members = {key: _first(value) if key != "nodeSets" else value for key, value in members.items()}
    fem = SimpleNamespace(
        nodes=_arrays(members.get("nodes")),
        modeBasis=_arrays(members.get("modeBasis")),
        massMatrix=members.get("massMatrix"),
        stiffnessMatrix=members.get("stiffnessMatrix"),
        nodeSets=[],
    )
    for x in members.get("nodeSets", []):
        if isinstance(x, dict) and isinstance(x.get("Name"), str) and _is_flat(x.get("NodeNumbers")):
            fem.nodeSets.append(x)
    return fem


# -- the body ----------------------------------------------------------------------------------------


def _triplets(matrix: Any, what: str) -> tuple[Array, Array, Array]:
    """Rows, columns and entries of a sparse matrix, an array of triplets, or one by rows from a file."""
    if isinstance(matrix, _Sparse):
        members = matrix.members
        start, column, value = (_plain(members.get(key), {}) for key in ("indptr", "indices", "data"))
        if not all(isinstance(x, np.ndarray) and x.ndim == 1 and len(x) > 0 for x in (start, column, value)):
            raise InputError(f"the matrix of {what} is not sparse by rows")
        if start[0] != 0 or len(column) != len(value) or (np.diff(start) < 0).any() or start[-1] != len(value):
            raise InputError(f"the matrix of {what} is damaged")
        return np.repeat(np.arange(len(start) - 1), np.diff(start)), column, value
    if hasattr(matrix, "tocoo"):
        found = matrix.tocoo()
        return np.asarray(found.row), np.asarray(found.col), np.asarray(found.data)
    array = np.asarray(matrix, dtype=float)
    if array.ndim == 2 and array.shape[1] == 3 and array.shape[0] > 0 and (np.abs(array[:, :2]) < 2**31).all():
        return array[:, 0].astype(int), array[:, 1].astype(int), array[:, 2]
    raise InputError(f"there is no matrix of {what}: compute it before the body is converted")


def _product(triplets: tuple[Array, Array, Array], x: Array) -> Array:
    row, column, value = triplets
    result = np.zeros_like(x)
    np.add.at(result, row, value[:, None] * x[column])
    return result


def _check_matrix(triplets: tuple[Array, Array, Array], size: int, what: str) -> None:
    row, column, value = triplets
    if len(row) == 0 or min(row.min(), column.min()) < 0 or max(row.max(), column.max()) >= size or not np.isfinite(value).all():
        raise InputError(f"the matrix of {what} does not fit the nodes: three rows for each of them are expected, {size} in all")


def _nodal_mass(triplets: tuple[Array, Array, Array], count: int) -> tuple[Array, Array, Array]:
    """The mass between nodes, which must be the same along x, y and z."""
    row, column, value = triplets
    largest = np.abs(value).max()
    if np.abs(value[row % 3 != column % 3]).max(initial=0) > ALIKE * largest:
        raise InputError("the mass couples directions: displacements between the nodes are needed, which the file does not have")
    parts = []
    for axis in range(3):
        own = (row % 3 == axis) & (column % 3 == axis)
        key, place = np.unique(row[own] // 3 * count + column[own] // 3, return_inverse=True)
        parts.append((key, np.bincount(place, value[own], len(key))))
    for key, entries in parts[1:]:
        if not np.array_equal(key, parts[0][0]) or np.abs(entries - parts[0][1]).max() > ALIKE * largest:
            raise InputError("the mass is not the same along x, y and z: bodies of solid elements are converted")
    key, entries = parts[0]
    return key // count, key % count, entries


def _places(fem: Any, interfaces: Mapping[str, str | Sequence[int]] | None, count: int) -> dict[str, Array]:
    """Nodes of each interface, by the names of node sets or by their numbers."""
    sets = {str(x["Name"]): x["NodeNumbers"] for x in fem.nodeSets if isinstance(x, dict) and "Name" in x and "NodeNumbers" in x}
    wanted = dict(interfaces) if interfaces else {name: name for name in sets}
    found = {}
    for name, nodes in wanted.items():
        if isinstance(nodes, str) and nodes not in sets:
            raise InputError(f"interface '{name}': there is no set of nodes '{nodes}'; the sets are: {', '.join(sets) or 'none'}")
        own = np.unique(np.asarray(sets[nodes] if isinstance(nodes, str) else nodes).astype(int))
        if len(own) < 3 or own[0] < 0 or own[-1] >= count:
            raise InputError(f"interface '{name}' has {len(own)} nodes: three or more from 0 to {count - 1} are expected")
        found[name] = own
    return found


def _motion(name: str, place: Array, phi: Array) -> tuple[Array, Array, Array]:
    """The mean place of nodes, and their displacement and rotation by least squares."""
    centre = place.mean(0)
    rigid = np.zeros((len(place), 3, 6))
    rigid[:, :, :3] = np.eye(3)
    x, y, z = (place - centre).T
    rigid[:, 0, 4], rigid[:, 0, 5], rigid[:, 1, 3], rigid[:, 1, 5], rigid[:, 2, 3], rigid[:, 2, 4] = z, -y, -z, x, y, -x
    moves, _, rank, _ = np.linalg.lstsq(rigid.reshape(-1, 6), phi.reshape(-1, phi.shape[2]), rcond=1e-9)
    if rank < 6:
        raise InputError(f"interface '{name}': its nodes are in a line, and do not say how it turns about that line")
    return centre, moves[:3], moves[3:]


def convert_exudyn(
    fem: Any,
    path: str | os.PathLike[str],
    interfaces: Mapping[str, str | Sequence[int]] | None = None,
    units: str = "m kg s",
) -> None:
    """Writes a body of Exudyn, an object like its FEMinterface with nodes, massMatrix, stiffnessMatrix and modeBasis, as a file of
    kempe-flexible-1. `interfaces`: sets of nodes by name, or numbers of nodes from 0; None: all sets of the body. `units`: the units of its
    numbers.

    Raises InputError if it is not a body of solid elements with modes, an interface does not name its nodes, or there are no such
    units. Raises FileError if the file cannot be written."""
    if "Position" not in fem.nodes or len(fem.nodes) != 1:
        raise InputError("its nodes must all be 'Position': only bodies of solid elements are converted, without beams and shells")
    place = np.asarray(fem.nodes["Position"], dtype=float)
    basis = np.asarray(fem.modeBasis["matrix"] if "matrix" in fem.modeBasis else np.zeros((0, 0)), dtype=float)
    count = len(place)
    if basis.ndim != 2 or basis.shape[1] == 0 or basis.shape[0] != 3 * count or place.shape != (count, 3):
        raise InputError(f"its mode basis has {basis.shape[0]} rows: compute modes first, with three rows for each of {count} nodes")
    if not (np.isfinite(place).all() and np.isfinite(basis).all()):
        raise InputError("its nodes or modes have entries that are not finite")
    mass, stiffness = _triplets(fem.massMatrix, "mass"), _triplets(fem.stiffnessMatrix, "stiffness")
    _check_matrix(mass, 3 * count, "mass")
    _check_matrix(stiffness, 3 * count, "stiffness")
    phi = basis.reshape(count, 3, -1)
    n = phi.shape[2]
    row, column, value = _nodal_mass(mass, count)
    ends = {name: _motion(name, place[nodes], phi[nodes]) for name, nodes in _places(fem, interfaces, count).items()}
    reduced = basis.T @ _product(stiffness, basis)
    if np.abs(reduced - reduced.T).max() > 1e-6 * np.abs(reduced).max():
        raise InputError("the matrix of stiffness is not symmetric: one triangle of it must be completed")
    arrays = {
        "format": "kempe-flexible-1", "units": units, "nodes": place, "modes": phi, "K": (reduced + reduced.T) / 2,
        "mass_row": row.astype(float), "mass_col": column.astype(float), "mass_value": value,
    }  # fmt: skip
    if ends:
        arrays |= {
            "interface_names": np.array(list(ends)), "interface_place": np.array([x[0] for x in ends.values()]),
            "interface_displacement": np.array([x[1] for x in ends.values()]).reshape(-1, 3, n),
            "interface_rotation": np.array([x[2] for x in ends.values()]).reshape(-1, 3, n),
        }  # fmt: skip
    try:
        with open(path_of(path).decode(), "wb") as file:
            np.savez_compressed(file, **arrays)
    except OSError as error:
        raise FileError(f"'{path_of(path).decode()}': {error.strerror}") from None
