"""Nastran: DMIG and GRID cards of bulk data and punch files; OP4 and OP2 through pyYeti."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from femflex.arrays import IntArray
from femflex.decks.findings import Overrides
from femflex.decks.nastran.bulk import Bulk, bulk_of
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.grids import Grids
from femflex.decks.nastran.scalar_points import listed_scalar_points
from femflex.decks.nastran.systems import Systems
from femflex.decks.units import Units
from femflex.extras import require
from femflex.matrices.arrays import arrays_of, contents_of
from femflex.matrices.contents import Contents, Entries, assembled_matrix, distinct_pairs, register
from femflex.matrices.model import MatrixModel
from femflex.mesh.formats.nastran_cards import read_deck, real

SQUARE, SYMMETRIC, RECTANGULAR = 1, 6, 9  # forms of a DMIG
COMPLEX = (3, 4)  # types of its entries


def _bulk(path: Path) -> Contents:
    """DMIG matrices, GRID, SPOINT and EXTRN cards of a file. Raises DeckError with all problems of these cards."""
    bulk = bulk_of(read_deck(path), Units(), Overrides({}))
    grids = Grids(bulk, Systems(bulk))
    contents = Contents(dofs=_superelement_map(bulk), scalars=listed_scalar_points(bulk))
    if numbers := grids.numbers():
        axes = np.array([grids.axes(number) for number in numbers])
        contents.ids = np.array(numbers, np.int64)
        contents.points = np.array([grids.position(number) for number in numbers])
        contents.frames = None if (axes == np.eye(3)).all() else axes
    headers = {card.word(0): card for card in bulk.cards.get("DMIG", ()) if card.word(1) == "0"}
    columns: dict[str, list[Card]] = {}
    for card in bulk.cards.get("DMIG", ()):
        if card.word(1) != "0":
            columns.setdefault(card.word(0), []).append(card)
    for name in sorted(columns.keys() - headers.keys()):
        bulk.findings.problem(
            f"DMIG {name} has columns and no header (DMIG, NAME, 0, form, type); the file may be cut",
            columns[name][0].location,
        )
    for name, head in headers.items():
        bulk.attempt(head, partial(_add_dmig, contents, name, head, columns.get(name, [])))
    bulk.findings.check(path)
    return contents


def _add_dmig(contents: Contents, name: str, head: Card, columns: list[Card]) -> None:
    """Add a DMIG matrix to the contents of its file."""
    form = head.integer(2, SYMMETRIC)
    if head.integer(3, 1) in COMPLEX:
        raise ValueError("it is complex; femflex takes real matrices")
    if form == RECTANGULAR:
        contents.notes.append(f"DMIG {name} is rectangular (form 9), and is not used")
        return
    contents.matrices[name] = _dmig_entries(columns, form)


def _superelement_map(bulk: Bulk) -> IntArray | None:
    """Map of degrees of freedom of an external superelement by EXTRN cards: node and components, 0 for scalars."""
    rows = [
        (card.integer(k), component)
        for card in bulk.cards.get("EXTRN", ())
        for k in range(0, len(card.fields) - 1, 2)
        if card.has(k)
        for component in card.components(k + 1) or (0,)
    ]
    return np.array(rows, np.int64) if rows else None


def _dmig_entries(columns: list[Card], form: int) -> Entries:
    rows, cols, values = list[tuple[int, int]](), list[tuple[int, int]](), list[float]()
    for card in columns:
        column = card.integer(1), card.integer(2, 0)
        f = card.fields
        for k in range(4, len(f) - 2, 4):
            if not f[k]:
                continue
            try:  # fast path for the usual form of an entry
                row, value = (int(f[k]), int(f[k + 1])), real(f[k + 2])
            except ValueError:
                row, value = (card.integer(k), card.integer(k + 1, 0)), card.real(k + 2)
            rows.append(row)
            cols.append(column)
            values.append(value)
    dofs, number = distinct_pairs(np.array([*rows, *cols], np.int64).reshape(-1, 2))
    n = len(rows)
    return Entries(assembled_matrix(number[:n], number[n:], values, len(dofs), form == SYMMETRIC), dofs)


def pyyeti_module(name: str) -> Any:
    """The module pyyeti.nastran.NAME. Raises MissingExtra."""
    import importlib

    require("matrices", "OP4 and OP2 files")
    with np.printoptions():  # which pyYeti changes for the whole process
        return importlib.import_module(f"pyyeti.nastran.{name}")


# name in an OP4 file (eight letters at most, lower case as pyYeti gives it) -> name among the arrays of a model
OP4_NAMES = {
    "kaa": "K", "maa": "M", "baa": "D", "kdaa": "geometric", "dofs": "dofs", "recpts": "recovery_points",
    "recrows": "recovery", "recmass": "recovery_masses", "momfirst": "moments_first", "momsec": "moments_second",
    "mommass": "moments_mass",
}  # fmt: skip


def _op4(path: Path) -> Contents:
    matrices = pyyeti_module("op4").read(str(path), into="dct", sparse=(None, sparse.csr_matrix))
    if "dofs" not in matrices or "nodes" not in matrices:
        return Contents(matrices=_square_matrices(matrices))
    model_arrays = {OP4_NAMES[name]: value for name, value in matrices.items() if name in OP4_NAMES}
    nodes = np.asarray(matrices["nodes"])
    second: Any = model_arrays.get("moments_second")
    if second is not None:  # rows and columns of 3 (1 + n_dof)
        second = second.toarray() if hasattr(second, "toarray") else np.asarray(second)
        if second.shape[0] == second.shape[1] and second.shape[0] % 3 == 0:
            second = second.reshape(second.shape[0] // 3, 3, -1, 3)
        model_arrays["moments_second"] = second
    return contents_of({**model_arrays, "nodes": nodes[:, 0], "points": nodes[:, 1:]})


def op4_arrays(model: MatrixModel) -> dict[str, Any]:
    """The matrices of a model for an OP4 file, with names of at most eight letters; each row of NODES is number, x, y,
    z."""
    arrays = arrays_of(model, dense=True)
    out = {
        name: np.atleast_2d(np.asarray(arrays[array_name], float))
        for name, array_name in OP4_NAMES.items()
        if array_name in arrays
    }
    if "momsec" in out:
        n = 3 * len(arrays["moments_first"])
        out["momsec"] = arrays["moments_second"].reshape(n, n)
    return {**out, "nodes": np.column_stack([model.ids, model.points])}


def _square_matrices(matrices: dict[str, Any]) -> dict[str, Entries]:
    """Square matrices by name, upper case, as pyYeti gives them."""
    return {
        name.upper(): Entries(sparse.csr_array(A))
        for name, A in matrices.items()
        if not isinstance(A, dict) and len(getattr(A, "shape", ())) == 2 and A.shape[0] == A.shape[1]
    }


def _op2(path: Path) -> Contents:
    """DMIG entries (EXTSEOUT with DMIGOP2) and plain matrices of an OP2 file."""
    contents = Contents()
    bulk = pyyeti_module("bulk")
    try:
        frames = bulk.rddmig(str(path), square=True)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError):
        frames = {}
    for name, frame in frames.items():
        if frame.shape[0] != frame.shape[1]:
            contents.notes.append(
                f"DMIG {name.upper()} is rectangular, {frame.shape[0]} x {frame.shape[1]}, and is not used"
            )
            continue
        dofs = np.array([tuple(pair) for pair in frame.index], np.int64)
        contents.matrices[name.upper()] = Entries(sparse.csr_array(frame.to_numpy()), dofs)
    if not contents.matrices:
        contents.matrices = _square_matrices(pyyeti_module("op2").rdmats(str(path)))
    if not contents.matrices:
        raise ValueError(f"{path.name} holds no square matrix; write the matrices with DMIGOP2 or OUTPUT2")
    return contents


register("Nastran bulk data with DMIG or GRID cards", (".bdf", ".nas", ".dat", ".pch", ".asm", ".dmig", ".blk"), _bulk)
register("Nastran OP4", (".op4",), _op4)
register("Nastran OP2", (".op2",), _op2)
