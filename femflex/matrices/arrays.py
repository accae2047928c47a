"""Models as named arrays: npz, HDF5 and Matlab files, read and written in one layout.

    M, K, D, geometric   (n_dof, n_dof)  dense, or sparse: M_row, M_col, M_data (counted from 0) and M_shape
    nodes (n,)           numbers of the nodes; left out: 1, 2, ...
    points (n, 3)        their positions
    dofs (n_dof, 2)      node and component 1..6 of every row, component 0 for a modal coordinate
    frames (n, 3, 3)     axes of displacement of the nodes, as rows; left out: global
    group_NAME (k,)      numbers of the nodes of a group
    cells_KIND (c, m)    cells to draw (line, triangle, quad), by numbers of nodes
    recovery_points (p, 3), recovery (3 p, n_dof), recovery_masses (p,)   points between the interfaces
    moments_mass (), moments_first (1 + n_dof, 3), moments_second (1 + n_dof, 3, 1 + n_dof, 3)   see MatrixModel

Matlab's sparse matrices are read too, also those of version 7.3 files.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZipFile

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.body import MassMoments
from femflex.hdf5 import open_hdf5
from femflex.matrices.contents import Contents, Entries, assembled_matrix, register
from femflex.matrices.model import MatrixModel, Recovery
from femflex.memory import require_proportion

if TYPE_CHECKING:
    import h5py

POINTS = ("points", "xyz", "coordinates", "coords")
NODES = ("nodes", "ids", "node_ids")
DENSE = 1_000_000  # entries (8 MB) up to which a matrix is written with its zeros
RESERVED_NAMES = (*POINTS, *NODES, "dofs", "frames", "recovery", "recovery_points", "recovery_masses")
PLACE = "NASTRAN/RESULT/MATRIX/GENERAL"
FIELDS = {
    "IDENTITY": ("NAME", "ROW", "COLUMN", "COLUMN_POS", "DATA_POS", "NON_ZERO"),
    "COLUMN": ("POSITION",),
    "DATA": ("ROW", "VALUE"),
}


def _npz(path: Path) -> Contents:
    with ZipFile(path) as archive:
        require_proportion(path, sum(member.file_size for member in archive.infolist()))
    arrays = {}
    with np.load(path, allow_pickle=False) as file:
        for name in file.files:
            try:
                arrays[name] = file[name]
            except ValueError as error:  # objects of Python, or a header that is not NumPy's
                raise ValueError(f"array {name!r} holds no plain numbers; write it as numbers") from error
    return contents_of(arrays)


def _mat(path: Path) -> Contents:
    from scipy.io import loadmat, whosmat

    with open(path, "rb") as opened:
        newer = b"MATLAB 7.3" in opened.read(128)
    if newer:
        return _hdf5(path, transposed=True)
    require_proportion(path, sum(8 * math.prod(shape) for _, shape, kind in whosmat(path) if kind != "sparse"))
    return contents_of({name: value for name, value in loadmat(path).items() if not name.startswith("__")})


def _hdf5(path: Path, transposed: bool = False) -> Contents:
    """Contents of the datasets at the root of an HDF5 file. transposed: the file is written column by column, as by
    Matlab."""
    import h5py

    arrays: dict[str, Any] = {}
    with open_hdf5(path) as file:
        if "format" in file.attrs:
            raise ValueError(f"it is a {file.attrs['format']} file; give it to a body of kind 'file', not 'matrices'")
        if "NASTRAN" in file:
            return msc_contents(file)
        for name, item in file.items():
            if isinstance(item, h5py.Group):
                if {"data", "ir", "jc"} <= set(item):  # Matlab's sparse matrix
                    rows = int(item.attrs["MATLAB_sparse"])
                    shape = (rows, len(item["jc"]) - 1)
                    arrays[name] = sparse.csc_array((item["data"][()], item["ir"][()], item["jc"][()]), shape=shape)
                continue
            value = np.asarray(item[()])
            arrays[name] = value.T if transposed else value
    return contents_of(arrays)


def contents_of(arrays: Mapping[str, Any]) -> Contents:
    """Contents of a file with these named arrays."""
    arrays = {name: _as_array(value) for name, value in arrays.items()}
    contents = Contents()
    for name in POINTS:
        if name in arrays:
            contents.points = _real_array(arrays, name, -1, 3)
    if contents.points is not None:
        contents.ids = np.arange(1, len(contents.points) + 1)
    for name in NODES:
        if name in arrays:
            contents.ids = _integer_array(arrays, name, -1)
    if "dofs" in arrays:
        contents.dofs = _integer_array(arrays, "dofs", -1, 2)
    if "frames" in arrays:
        contents.frames = _real_array(arrays, "frames", -1, 3, 3)
    for name, value in arrays.items():
        kind, _, rest = name.partition("_")
        if kind == "group" and rest:
            contents.groups[rest] = _integer_array(arrays, name, -1)
        elif kind == "cells" and rest:
            contents.cells[rest] = _integer_array(arrays, name, len(np.atleast_1d(value)), -1)
        elif name.endswith("_data") and f"{name[:-5]}_row" in arrays:
            if (stem := name[:-5]) != "recovery":
                contents.matrices[stem] = Entries(_from_triplets(arrays, stem))
        elif name in RESERVED_NAMES or name.startswith("moments_"):
            continue
        elif _is_matrix(value):
            dtype = complex if np.issubdtype(value.dtype, np.complexfloating) else float
            contents.matrices[name] = Entries(sparse.csr_array(value, dtype=dtype))
        elif np.size(value) > 1:
            contents.others[name] = _shape_text(value)
    contents.recovery = _recovery(arrays)
    if any(name.startswith("moments_") for name in arrays):
        first = _real_array(arrays, "moments_first", -1, 3)
        second = _real_array(arrays, "moments_second", len(first), 3, len(first), 3)
        contents.moments = MassMoments(float(_real_array(arrays, "moments_mass", 1)[0]), first, second)
    return contents


def _recovery(arrays: Mapping[str, Any]) -> Recovery | None:
    if not any(name.startswith("recovery") for name in arrays):
        return None
    points = _real_array(arrays, "recovery_points", -1, 3)
    if "recovery_data" in arrays:
        rows = _from_triplets(arrays, "recovery")
    elif sparse.issparse(arrays.get("recovery")):
        rows = sparse.csr_array(arrays["recovery"])
    else:
        rows = sparse.csr_array(_real_array(arrays, "recovery", -1, -1))
    return Recovery(points, rows, _real_array(arrays, "recovery_masses", -1) if "recovery_masses" in arrays else None)


def _from_triplets(arrays: Mapping[str, Any], stem: str) -> sparse.csr_array:
    """The matrix of the arrays STEM_row, STEM_col, STEM_data and STEM_shape. Raises ValueError where they do not
    fit."""
    i, j = (_integer_array(arrays, f"{stem}_{part}", -1) for part in ("row", "col"))
    shape = tuple(int(x) for x in _integer_array(arrays, f"{stem}_shape", 2))
    data = np.ravel(arrays[f"{stem}_data"])
    if not len(i) == len(j) == len(data):
        raise ValueError(
            f"arrays {stem}_row, {stem}_col and {stem}_data have {len(i)}, {len(j)} and {len(data)} entries; give as "
            "many of each"
        )
    if min(i.min(), j.min()) < 0 or i.max() >= shape[0] or j.max() >= shape[1]:
        raise ValueError(
            f"arrays {stem}_row and {stem}_col have entries from {min(i.min(), j.min())} to {i.max()} and {j.max()}; "
            f"{stem}_shape is {shape[0]} x {shape[1]}, counted from 0"
        )
    if not np.issubdtype(data.dtype, np.number):
        raise ValueError(f"array {stem + '_data'!r} {_shape_text(data)}; expected n numbers")
    kind = complex if np.iscomplexobj(data) else float
    return sparse.csr_array(sparse.coo_array((data.astype(kind), (i, j)), shape=shape))


def _real_array(arrays: Mapping[str, Any], name: str, *shape: int) -> Array:
    """An array of real numbers in this shape; -1 stands for any number, and one axis may be a row or column. Raises
    ValueError where the array does not fit."""
    expected = " x ".join("n" if n == -1 else str(n) for n in shape)
    if name not in arrays:
        raise ValueError(f"array {name!r} is missing; expected {expected} real numbers")
    value = arrays[name].toarray() if sparse.issparse(arrays[name]) else np.asarray(arrays[name])
    seen = (value.size,) if len(shape) == 1 else value.shape
    fits = len(seen) == len(shape) and all(n in (-1, m) for n, m in zip(shape, seen, strict=True))
    if not fits or not value.size or not np.issubdtype(value.dtype, np.number) or np.iscomplexobj(value):
        raise ValueError(f"array {name!r} {_shape_text(value)}; expected {expected} real numbers")
    return value.astype(float).reshape(seen)


def _shape_text(value: Any) -> str:
    return f"has the shape {value.shape} and holds {value.dtype.name}"


def _integer_array(arrays: Mapping[str, Any], name: str, *shape: int) -> IntArray:
    """An array of whole numbers in this shape; otherwise as `_real_array`."""
    value = _real_array(arrays, name, *shape)
    if not (np.abs(value) < 2**53).all() or (value != np.round(value)).any():
        raise ValueError(f"array {name!r} holds numbers that are not whole; give numbers of nodes and components")
    return value.astype(np.int64)


def _as_array(value: Any) -> Any:
    return value if sparse.issparse(value) else np.asarray(value)


def _is_matrix(value: Any) -> bool:
    shape = value.shape
    numbers = sparse.issparse(value) or np.issubdtype(value.dtype, np.number)
    return numbers and len(shape) == 2 and shape[0] == shape[1] > 1


def arrays_of(model: MatrixModel, dense: bool = False) -> dict[str, Array]:
    """The arrays of a model, with the names, shapes and units of this module's layout. dense: write every matrix
    (n_dof, n_dof) with all its entries, for readers without sparse matrices."""
    out: dict[str, Any] = {"nodes": model.ids, "points": model.points, "dofs": model.dofs}
    for name, A in (("M", model.M), ("K", model.K), ("D", model.D), ("geometric", model.geometric)):
        if A is not None:
            out |= {name: A.toarray()} if dense or _written_dense(A) else _triplets(name, A)
    if model.frames is not None:
        out["frames"] = model.frames
    out |= {f"group_{name}": np.asarray(nodes) for name, nodes in model.groups.items()}
    out |= {f"cells_{name}": np.asarray(cells) for name, cells in model.cells.items()}
    if model.recovery is not None:
        rows = model.recovery.rows
        out["recovery_points"] = model.recovery.points
        out |= {"recovery": rows.toarray()} if dense or _written_dense(rows) else _triplets("recovery", rows)
        if model.recovery.masses is not None:
            out["recovery_masses"] = model.recovery.masses
    if model.moments is not None:
        out |= {f"moments_{name}": np.asarray(getattr(model.moments, name)) for name in ("mass", "first", "second")}
    return out


def _written_dense(A: sparse.csr_array) -> bool:
    """Whether a matrix is written with all its entries: it is small enough for any reader, or has few zeros."""
    return bool(A.shape[0] * A.shape[1] <= DENSE or 3 * A.nnz > A.shape[0] * A.shape[1])


def _triplets(name: str, A: sparse.csr_array) -> dict[str, Any]:
    entries = A.tocoo()
    row, col = entries.coords
    return {
        f"{name}_row": row.astype(np.int64),
        f"{name}_col": col.astype(np.int64),
        f"{name}_data": entries.data,
        f"{name}_shape": np.array(A.shape),
    }


# Matrices that MSC Nastran writes to HDF5 (HDF5OUT with MTX YES), in the group NASTRAN/RESULT/MATRIX/GENERAL.
#
# IDENTITY   one row per matrix: NAME, FORM, TYPE, ROW, COLUMN (its size), COLUMN_POS, DATA_POS, NON_ZERO
# COLUMN     POSITION, in DATA, of the first entry of each column, and of the end of the last, from COLUMN_POS on
# DATA       ROW, counted from 0, and VALUE of each entry, from DATA_POS on


def msc_contents(file: h5py.File) -> Contents:
    """The square matrices of an HDF5 file of MSC Nastran. Raises ValueError where it has none, or they are damaged."""
    if PLACE not in file:
        raise ValueError(
            f"it is a result of MSC Nastran without the group {PLACE}; write the matrices to it, with CRDB_MTX in DMAP "
            "and HDF5OUT with MTX YES"
        )
    group = file[PLACE]
    for table, names in FIELDS.items():
        present = getattr(group.get(table), "dtype", np.dtype("f8")).names or ()
        missing = sorted(set(names) - set(present))
        if missing:
            raise ValueError(f"{PLACE}/{table} has no {', '.join(missing)}; write the file again")
    contents = Contents()
    for row in group["IDENTITY"][()]:
        name = row["NAME"].decode(errors="replace").strip()
        n, n_columns = int(row["ROW"]), int(row["COLUMN"])
        if name in contents.matrices:
            raise ValueError(f"it has the matrix {name} twice; write one domain to the file")
        if n == n_columns:
            contents.matrices[name] = _entries(group, name, row, n)
        else:
            contents.notes.append(f"matrix {name} is rectangular ({n} x {n_columns}), and is not used")
    return contents


def _entries(group: h5py.Group, name: str, row: np.void, n: int) -> Entries:
    """The matrix `name` (n, n) of a row of IDENTITY. Raises ValueError where its parts do not fit together."""
    column, start, count = (int(row[key]) for key in ("COLUMN_POS", "DATA_POS", "NON_ZERO"))
    if min(n, column, start, count) < 0 or column + n + 1 > len(group["COLUMN"]) or start + count > len(group["DATA"]):
        raise ValueError(
            f"matrix {name} has {n} columns from {column} on and {count} entries from {start} on, and the file has "
            f"{len(group['COLUMN'])} positions of columns and {len(group['DATA'])} entries"
        )
    ends = group["COLUMN"][column : column + n + 1]["POSITION"].astype(np.int64) - start
    data = group["DATA"][start : start + count]
    rows = data["ROW"].astype(np.int64)
    if ends[0] != 0 or ends[-1] != count or (np.diff(ends) < 0).any() or (rows < 0).any() or (rows >= n).any():
        raise ValueError(f"matrix {name} ({n} x {n}) has columns or rows that do not fit its {count} entries")
    if data["VALUE"].dtype.kind != "f":
        raise ValueError(f"matrix {name} is complex; femflex takes real matrices")
    columns = np.repeat(np.arange(n), np.diff(ends))
    return Entries(assembled_matrix(rows, columns, data["VALUE"], n))


register("NumPy archive", (".npz",), _npz)
register("HDF5 file of matrices", (".h5", ".hdf5", ".hdf"), _hdf5)
register("Matlab file", (".mat",), _mat)
