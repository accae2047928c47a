"""Contents of a file with matrices, in its own units, and the register of formats by suffix."""

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
    """A matrix whose rows and columns are numbered, or named by node and component.

    matrix  csr
    dofs    (n, 2) node and component of its rows and columns; None: numbered from 0
    open_ended  whether rows and columns without entries may be missing at the end
    """

    matrix: sparse.csr_array
    dofs: IntArray | None = None
    open_ended: bool = False


@dataclass(eq=False)
class Contents:
    """Contents of one file; a field is empty where the file has no such data.

    matrices  name in the file -> Entries
    others    name of every other array of numbers -> its shape and type, for messages
    ids (n,), points (n, 3), frames (n, 3, 3)   nodes, see MatrixModel
    dofs      (n_dof, 2) map for matrices without their own
    scalars   numbers of nodes that are scalar points (modal coordinates)
    notes     sentences on data that was changed or ignored
    """

    matrices: dict[str, Entries] = field(default_factory=dict)
    others: dict[str, str] = field(default_factory=dict)
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
    """Register a format under its suffixes."""
    for suffix in suffixes:
        FORMATS[suffix] = MatrixFormat(name, read)


def read_contents(path: str | Path) -> Contents:
    """Contents of a file. Raises ValueError where it is missing, of no known format, or damaged."""
    path = Path(path)
    if not path.is_file():
        alternatives = sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.parent.is_dir() else []
        raise ValueError(f"{path} does not exist; {path.parent} holds {alternatives[:8] or 'no such files'}")
    if path.suffix.lower() not in FORMATS:
        formats = ", ".join(f"{suffix} ({FORMATS[suffix].name})" for suffix in sorted(FORMATS))
        raise ValueError(
            f"{path.name}: {path.suffix or 'no suffix'} is no known format of matrices; known are {formats}"
        )
    matrix_format = FORMATS[path.suffix.lower()]
    with reading(path, matrix_format.name, ADVICE):
        return matrix_format.read(path)


def assembled_matrix(
    rows: ArrayLike, columns: ArrayLike, values: ArrayLike, n: int, symmetric: bool | None = None
) -> sparse.csr_array:
    """The matrix (n, n), in the unit of its entries. If only one triangle has entries it is mirrored, unless
    `symmetric` is False. If `symmetric` is True every entry without a mirror image is mirrored, whatever the order
    of the rows."""
    i, j, v = np.asarray(rows, np.int64), np.asarray(columns, np.int64), np.asarray(values, float)
    matrix = sparse.csr_array(sparse.coo_array((v, (i, j)), shape=(n, n)))
    off_diagonal = i != j
    one_triangle = bool((i[off_diagonal] < j[off_diagonal]).all() or (i[off_diagonal] > j[off_diagonal]).all())
    if symmetric is False or not off_diagonal.any() or not (symmetric or one_triangle):
        return matrix
    present = sparse.csr_array(sparse.coo_array((np.ones(len(v)), (i, j)), shape=(n, n))).astype(bool).astype(float)
    return sparse.csr_array(matrix + matrix.T - matrix.T.multiply(present))


def distinct_pairs(pairs: IntArray) -> tuple[IntArray, IntArray]:
    """Distinct rows (n, 2) of pairs (k, 2), sorted by node and component, and the index of each pair among them
    (k,)."""
    distinct, number = np.unique(pairs, axis=0, return_inverse=True)
    return distinct, np.asarray(number, np.int64).ravel()


def groups_from(names: Mapping[str, ArrayLike]) -> dict[str, IntArray]:
    """Groups (k,) of node numbers; ValueError names a group with a number of more than 64 bits."""
    groups = {}
    for name, nodes in names.items():
        try:
            groups[name] = np.unique(np.asarray(nodes, np.int64))
        except OverflowError:
            raise ValueError(f"group {name!r} has a node number above {2**63 - 1}; give numbers of its nodes") from None
    return groups
