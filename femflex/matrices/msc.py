"""Matrices that MSC Nastran writes to HDF5 (HDF5OUT with MTX YES), in the group NASTRAN/RESULT/MATRIX/GENERAL.

IDENTITY   one row per matrix: NAME, FORM, TYPE, ROW, COLUMN (its size), COLUMN_POS, DATA_POS, NON_ZERO
COLUMN     POSITION, in DATA, of the first entry of each column, and of the end of the last, from COLUMN_POS on
DATA       ROW, counted from 0, and VALUE of each entry, from DATA_POS on
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.matrices.contents import Contents, Entries, assembled_matrix

if TYPE_CHECKING:
    import h5py

PLACE = "NASTRAN/RESULT/MATRIX/GENERAL"
FIELDS = {
    "IDENTITY": ("NAME", "ROW", "COLUMN", "COLUMN_POS", "DATA_POS", "NON_ZERO"),
    "COLUMN": ("POSITION",),
    "DATA": ("ROW", "VALUE"),
}


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
