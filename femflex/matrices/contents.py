"""What a file with matrices holds, in its own units, and the register of formats by suffix."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.body import MassMoments
from femflex.matrices.model import Recovery
from femflex.reading import reading


@dataclass(frozen=True, eq=False)
class Entries:
    """A matrix by its entries: rows and columns with node and component of their own, or by number.

    matrix  csr
    dofs    (n, 2) node and component of its rows and columns; None: numbered from 0
    """

    matrix: sparse.csr_array
    dofs: IntArray | None = None


@dataclass(eq=False)
class Contents:
    """What one file holds; empty where it does not hold a thing.

    matrices  name in the file -> Entries
    ids (n,), points (n, 3), frames (n, 3, 3)   nodes, see MatrixModel
    dofs      (n_dof, 2) map for matrices without their own
    scalars   numbers of nodes that are scalar points (modal coordinates)
    notes     sentences on what was changed or left out
    """

    matrices: dict[str, Entries] = field(default_factory=dict)
    ids: IntArray | None = None
    points: Array | None = None
    frames: Array | None = None
    dofs: IntArray | None = None
    scalars: set[int] = field(default_factory=set)
    groups: dict[str, IntArray] = field(default_factory=dict)
    cells: dict[str, IntArray] = field(default_factory=dict)
    recovery: Recovery | None = None
    moments: MassMoments | None = None
    notes: list[str] = field(default_factory=list)


Reader = Callable[[Path], Contents]


@dataclass(frozen=True)
class MatrixFormat:
    """A format of files with matrices or node coordinates: its name for messages, and its reader."""

    name: str
    read: Reader


FORMATS: dict[str, MatrixFormat] = {}  # by suffix, lower case
ADVICE = "It may be cut short, damaged or of another format; write it again from its source."


def register(name: str, suffixes: Iterable[str], read: Reader) -> None:
    """Make a format known under its suffixes."""
    for suffix in suffixes:
        FORMATS[suffix] = MatrixFormat(name, read)


def read_contents(path: str | Path) -> Contents:
    """Contents of a file. Raises ValueError where it is missing, of no known format, or damaged."""
    path = Path(path)
    if not path.is_file():
        near = sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.parent.is_dir() else []
        raise ValueError(f"{path} does not exist; {path.parent} holds {near[:8] or 'no such files'}")
    if path.suffix.lower() not in FORMATS:
        known = ", ".join(f"{suffix} ({FORMATS[suffix].name})" for suffix in sorted(FORMATS))
        raise ValueError(f"{path.name}: {path.suffix or 'no suffix'} is no known format of matrices; known are {known}")
    form = FORMATS[path.suffix.lower()]
    with reading(path, form.name, ADVICE):
        return form.read(path)


def whole(
    rows: ArrayLike, columns: ArrayLike, values: ArrayLike, n: int, symmetric: bool | None = None
) -> sparse.csr_array:
    """The matrix (n, n), in the unit of its entries; one triangle alone is mirrored, unless it is known not to be
    `symmetric`. Of one that is known to be, each entry without its mirror image is, whatever the order of the rows."""
    i, j, v = np.asarray(rows, np.int64), np.asarray(columns, np.int64), np.asarray(values, float)
    matrix = sparse.csr_array(sparse.coo_array((v, (i, j)), shape=(n, n)))
    off = i != j
    one_triangle = bool((i[off] < j[off]).all() or (i[off] > j[off]).all())
    if symmetric is False or not off.any() or not (symmetric or one_triangle):
        return matrix
    given = sparse.csr_array(sparse.coo_array((np.ones(len(v)), (i, j)), shape=(n, n))).astype(bool).astype(float)
    return sparse.csr_array(matrix + matrix.T - matrix.T.multiply(given))


def numbered(pairs: IntArray) -> tuple[IntArray, IntArray]:
    """Different rows (n, 2) of pairs (k, 2), in the order of node and component, and the number of each (k,)."""
    found, number = np.unique(pairs, axis=0, return_inverse=True)
    return found, np.asarray(number, np.int64).ravel()


def groups_from(names: Mapping[str, ArrayLike]) -> dict[str, IntArray]:
    """Groups (k,) of node numbers; ValueError names a group with a number of more than 64 bits."""
    found = {}
    for name, nodes in names.items():
        try:
            found[name] = np.unique(np.asarray(nodes, np.int64))
        except OverflowError:
            raise ValueError(f"group {name!r} has a node number above {2**63 - 1}; give numbers of its nodes") from None
    return found
