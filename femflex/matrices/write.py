"""MatrixModel -> file: npz, HDF5, Matlab, OP4 (through pyYeti) and Nastran bulk data with DMIG; in SI."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import sparse

from femflex.hdf5 import placed_hdf5
from femflex.matrices.arrays import arrays_of
from femflex.matrices.model import MatrixModel
from femflex.matrices.nastran import op4_arrays, pyyeti_module
from femflex.writing import placed

SYMMETRIC, REAL = 6, 2


def write_matrices(model: MatrixModel, path: str | Path, force: bool = False) -> Path:
    """The path of the file that the model was written to; read_matrices reads it back.

    .npz, .h5, .mat hold everything; .op4 too, as matrices of short names; .bdf, .pch, .dmig hold GRID and SPOINT cards
    and DMIG matrices KAAX, MAAX, BAAX, without recovery and mass moments.
    Raises FileExistsError unless force is given, FileNotFoundError for a missing folder, ValueError on other suffixes.
    """
    path = Path(path)
    if path.suffix.lower() not in WRITERS:
        raise ValueError(f"{path.name}: models are written as {', '.join(sorted(WRITERS))}; found {path.suffix!r}")
    with placed(path, force) as part:
        WRITERS[path.suffix.lower()](model, part)
    return path


def _npz(model: MatrixModel, path: Path) -> None:
    np.savez_compressed(path, **arrays_of(model))  # type: ignore[arg-type]


def _hdf5(model: MatrixModel, path: Path) -> None:
    with placed_hdf5(path) as file:
        for name, value in arrays_of(model).items():
            file.create_dataset(name, data=value)


def _mat(model: MatrixModel, path: Path) -> None:
    from scipy.io import savemat

    savemat(path, arrays_of(model, dense=True), do_compression=True)


def _op4(model: MatrixModel, path: Path) -> None:
    pyyeti_module("op4").write(str(path), op4_arrays(model))


def _bulk(model: MatrixModel, path: Path) -> None:
    """Nodes and matrices as bulk data in large fields."""
    if model.frames is not None:
        raise ValueError(
            f"{model.name} has nodes with axes of their own, which are not written to bulk data; write .npz"
        )
    lines = [f"$ {model.name}: mass, stiffness in SI (kg, m, s)"]
    for number, position in zip(model.ids, model.points, strict=True):
        x, y, z = (_field(value) for value in position)
        lines += [f"GRID*   {number:>16d}{'':16}{x}{y}", f"*       {z}"]
    scalars = model.dofs[model.dofs[:, 1] == 0, 0]
    lines += [f"SPOINT  {number:>8d}" for number in scalars]
    for name, A in (("KAAX", model.K), ("MAAX", model.M), ("BAAX", model.D)):
        if A is not None:
            lines += _dmig(name, A, model)
    path.write_text("\n".join([*lines, "ENDDATA", ""]))


def _dmig(name: str, A: sparse.csr_array, model: MatrixModel) -> list[str]:
    """Cards of the lower triangle, column by column."""
    lines = [f"DMIG    {name:<8}{0:>8d}{SYMMETRIC:>8d}{REAL:>8d}{0:>8d}"]
    lower = sparse.tril(A).tocsc()
    for column, (start, end) in enumerate(zip(lower.indptr, lower.indptr[1:], strict=False)):
        if start == end:
            continue
        node, component = model.dofs[column]
        lines.append(f"DMIG*   {name:<16}{node:>16d}{component:>16d}")
        for row, value in zip(lower.indices[start:end], lower.data[start:end], strict=True):
            node, component = model.dofs[row]
            lines.append(f"*       {node:>16d}{component:>16d}{_field(value)}")
    return lines


def _field(value: float) -> str:
    """A number in a field of sixteen columns, with as many digits as fit."""
    for digits in range(12, 6, -1):
        text = f"{value:.{digits}E}"
        text = text.replace("E+0", "+").replace("E-0", "-").replace("E", "")
        if len(text) <= 16:
            break
    return f"{text:>16}"


WRITERS: dict[str, Callable[[MatrixModel, Path], None]] = {
    ".npz": _npz, ".h5": _hdf5, ".hdf5": _hdf5, ".mat": _mat, ".op4": _op4,
    ".bdf": _bulk, ".pch": _bulk, ".dmig": _bulk,
}  # fmt: skip
