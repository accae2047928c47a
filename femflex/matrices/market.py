"""Matrices as text, one a file: MatrixMarket, Abaqus *MATRIX GENERATE in both forms, CalculiX."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from femflex.matrices.contents import Contents, Entries, numbered, register, whole

Array = NDArray[np.float64]


def _mtx(path: Path) -> Contents:
    with open(path, "rb") as opened:
        head = opened.read(64)
    if head.lower().startswith(b"%%matrixmarket"):
        from scipy.io import mmread

        return _one(path, Entries(sparse.csr_array(mmread(path))))
    return _abaqus(path)


def _abaqus(path: Path) -> Contents:
    """Rows of node, component, node, component, value (MATRIX INPUT), or of row, column, value (COORDINATE)."""
    values = np.array([_row(line) for line in _lines(path)], float)
    if values.ndim != 2 or values.shape[1] not in (3, 5):
        raise ValueError(
            f"{path.name} has rows of {values.shape[1] if values.ndim == 2 else 0} values; *MATRIX GENERATE writes "
            "five (node, component, node, component, value) or three (row, column, value)"
        )
    if values.shape[1] == 3:
        return _one(path, Entries(_coordinate(values)))
    pairs = np.concatenate([values[:, :2], values[:, 2:4]]).astype(np.int64)
    dofs, number = numbered(pairs)
    n = len(values)
    return _one(path, Entries(whole(number[:n], number[n:], values[:, 4], len(dofs)), dofs))


def _coordinate(values: Array) -> sparse.csr_array:
    i, j = values[:, 0].astype(np.int64), values[:, 1].astype(np.int64)
    if min(i.min(), j.min()) < 1:
        raise ValueError("it has a row or column number below 1; rows and columns count from 1")
    return whole(i - 1, j - 1, values[:, 2], int(max(i.max(), j.max())))


def _lines(path: Path) -> list[str]:
    return [
        line
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines()
        if line.strip() and not line.lstrip().startswith(("*", "%", "#"))
    ]


def _row(line: str) -> list[float]:
    return [float(word.upper().replace("D", "E")) for word in line.replace(",", " ").split()]


def _one(path: Path, entries: Entries) -> Contents:
    return Contents(matrices={path.stem: entries})


def _calculix(path: Path) -> Contents:
    return _one(path, Entries(_coordinate(np.array([_row(line) for line in _lines(path)], float).reshape(-1, 3))))


register("MatrixMarket or Abaqus matrix", (".mtx",), _mtx)
register("CalculiX matrix", (".sti", ".mas"), _calculix)
