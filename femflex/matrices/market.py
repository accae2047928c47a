"""Matrices as text, one a file: MatrixMarket, Abaqus *MATRIX GENERATE in both forms, CalculiX."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy import sparse

from femflex.arrays import Array
from femflex.matrices.contents import Contents, Entries, assembled_matrix, distinct_pairs, register

INTERNAL_DOFS = 1_000_000_000  # first number of degrees of freedom inside elements, ten per node -1, -2, ...
ROW_LAYOUTS = {5: "node, component, node, component, value", 3: "row, column, value"}  # of *MATRIX GENERATE's two forms


def _mtx(path: Path) -> Contents:
    with open(path, "rb") as opened:
        head = opened.read(64)
    if head.lower().startswith(b"%%matrixmarket"):
        from scipy.io import mmread

        try:
            return _single_matrix(path, Entries(sparse.csr_array(mmread(path, spmatrix=False))))
        except ValueError as error:  # "Line 3: Invalid integer value. ..."
            location = re.match(r"Line (\d+): ([^.]*)", str(error))
            problem = f", line {location[1]}: {location[2].lower()}" if location else f": {error}"
            raise ValueError(f"{path.name}{problem}; it is damaged, so write it again from its source") from None
    return _abaqus(path)


def _abaqus(path: Path) -> Contents:
    """Rows of node, component, node, component, value (MATRIX INPUT), or of row, column, value (COORDINATE)."""
    values = _rows(path, ROW_LAYOUTS)
    if values.shape[1] == 3:
        return _single_matrix(path, Entries(_coordinate_form(values), open_ended=True))
    pairs = np.concatenate([values[:, :2], values[:, 2:4]]).astype(np.int64)
    inner = pairs[:, 0] < 1  # degrees of freedom within elements (B33): no node has them
    pairs[inner] = np.column_stack(
        [INTERNAL_DOFS - 10 * pairs[inner, 0] + pairs[inner, 1], np.zeros(inner.sum(), np.int64)]
    )
    dofs, number = distinct_pairs(pairs)
    n = len(values)
    scalars = {int(node) for node in np.unique(pairs[inner, 0])}
    entries = Entries(assembled_matrix(number[:n], number[n:], values[:, 4], len(dofs)), dofs)
    return Contents(matrices={path.stem: entries}, scalars=scalars)


def _coordinate_form(values: Array) -> sparse.csr_array:
    values = _without_counts(values)
    i, j = values[:, 0].astype(np.int64), values[:, 1].astype(np.int64)
    if min(i.min(), j.min()) < 1:
        raise ValueError("it has a row or column number below 1; rows and columns count from 1")
    return assembled_matrix(i - 1, j - 1, values[:, 2], int(max(i.max(), j.max())))


def _without_counts(values: Array) -> Array:
    """The rows without a leading row of MatrixMarket's counts (rows, columns, entries), in a file without its
    banner."""
    n, m, entries = values[0]
    remaining = values[1:]
    counts = n == m and entries == len(remaining) and len(remaining) and remaining[:, :2].max() <= n
    return remaining if counts and (n >= 2 or len(remaining) == 1) else values


def _rows(path: Path, row_layouts: dict[int, str]) -> Array:
    """The numbers in a text, with the same count in each row. Raises ValueError with the file and line of a row that
    differs.

    row_layouts: permitted count of numbers in a row -> their meaning
    """
    rows: list[list[float]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith(("*", "%", "#")):
            continue
        words = line.replace(",", " ").split()
        expected = {len(rows[0]): row_layouts[len(rows[0])]} if rows else row_layouts
        if len(words) not in expected:
            layouts = " or ".join(f"{count} ({what})" for count, what in expected.items())
            raise ValueError(f"{path.name}, line {number}, has a row of {len(words)} values; a row has {layouts}")
        try:
            rows.append([float(word.upper().replace("D", "E")) for word in words])
        except ValueError:
            raise ValueError(f"{path.name}, line {number}: {line.strip()[:60]!r} is no row of numbers") from None
    if not rows:
        raise ValueError(f"{path.name} has no rows of numbers")
    return np.array(rows)


def _single_matrix(path: Path, entries: Entries) -> Contents:
    return Contents(matrices={path.stem: entries})


def _calculix(path: Path) -> Contents:
    return _single_matrix(path, Entries(_coordinate_form(_rows(path, {3: ROW_LAYOUTS[3]})), open_ended=True))


register("MatrixMarket or Abaqus matrix", (".mtx",), _mtx)
register("CalculiX matrix", (".sti", ".mas"), _calculix)
