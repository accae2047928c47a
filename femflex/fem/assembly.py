"""Sparse sums of element matrices.

The pattern is found on runs of dofs that always come together (the three translations of a node), which are few, and
laid out as a finished CSR matrix; the element matrices are then made chunk by chunk and added in place, so that no
list of triplets is ever held. How runs are connected is found once for all matrices on the same elements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Integers = NDArray[np.integer]  # of whichever width

CHUNK_ENTRIES = 400_000  # entries of element matrices made at once: small enough to stay in cache (3 MB)


@dataclass(frozen=True, eq=False)
class Part:
    """Element matrices values(elements) (k, l, l) on the dofs (e, l), or alike on every component of dofs (e, l, c)."""

    dofs: Index
    values: Callable[[slice], Array]


@dataclass(frozen=True, eq=False)
class Runs:
    """Dofs of elements (e, l) as runs of consecutive ones.

    first   (n_runs,)  first dof of every run, ascending
    size    (n_runs,)  its number of dofs
    number  (e, r)     runs of the elements
    column  (l,)       which of the element's runs a column belongs to
    within  (l,)       its place in the run
    """

    first: Index
    size: Index
    number: Index
    column: Index
    within: Index


@dataclass(frozen=True, eq=False)
class Connections:
    """Pairs of runs that share an element: row and col (n_pairs,), sorted; pair (e r r,) for each in the elements."""

    number: Index
    row: Index
    col: Index
    pair: Integers


@dataclass(frozen=True, eq=False)
class Pattern:
    """CSR pattern indptr, indices of elements with dofs (e, l); offset (e, r, r): where in its rows a pair of runs
    begins."""

    dofs: Index
    runs: Runs
    indptr: Integers
    indices: Integers
    offset: Integers


class Assembler:
    """Sums of element matrices on raw dofs, which T (n_raw, n_dof) gives from the independent ones."""

    def __init__(self, T: sparse.csr_array) -> None:
        self._T = T.copy()
        self._T.eliminate_zeros()
        self._number = renumbering(self._T)
        self._known: list[Connections] = []
        self._patterns: list[Pattern] = []

    def total(self, parts: Sequence[Part]) -> sparse.csr_array:
        """T^T (sum of the parts) T, (n_dof, n_dof), without entries that are zero.

        Parts whose raw dofs are independent ones by another number go straight to their places.
        """
        n_raw, n_dof = self._T.shape
        direct, reduced = sparse.csr_array((n_dof, n_dof)), sparse.csr_array((n_raw, n_raw))
        for part in parts:
            renumbered = self._number[part.dofs]
            if (renumbered >= 0).all():
                direct = _added(direct, self._sum(Part(renumbered, part.values), n_dof))
            else:
                reduced = _added(reduced, self._sum(part, n_raw))
        if reduced.nnz:
            direct = _added(direct, (self._T.T.tocsr() @ (reduced @ self._T)).tocsr())
        direct.sort_indices()
        if direct.nnz > np.count_nonzero(direct.data):
            direct = direct.copy()  # its pattern may belong to another matrix too
            direct.eliminate_zeros()
        return direct

    def _sum(self, part: Part, n: int) -> sparse.csr_array:
        """Sparse sum (n, n) of the part's element matrices, indices sorted."""
        if not part.dofs.size:
            return sparse.csr_array((n, n))
        if part.dofs.ndim == 3:
            return self._repeated(part, n)
        known = self._pattern(part.dofs, n)
        data = np.zeros(len(known.indices))
        start = known.indptr[part.dofs]
        step = max(1, CHUNK_ENTRIES // part.dofs.shape[1] ** 2)
        for begin in range(0, len(part.dofs), step):
            chunk = slice(begin, begin + step)
            place = start[chunk, :, None] + _expanded(known.offset[chunk], known.runs)
            np.add.at(data, place.ravel(), np.ascontiguousarray(part.values(chunk)).ravel())
        return sparse.csr_array((data, known.indices, known.indptr), shape=(n, n))

    def _repeated(self, part: Part, n: int) -> sparse.csr_array:
        """The sum of a part that is alike on all components: made once where they are numbered in a row."""
        dofs = part.dofs
        shift = dofs - dofs[:, :, :1]
        steps = shift[0, 0]
        if (shift == steps).all():
            one = self._sum(Part(dofs[:, :, 0], part.values), n)
            each = [_shifted(one, int(step)) for step in steps]
        else:
            each = [self._sum(Part(dofs[:, :, c], part.values), n) for c in range(dofs.shape[2])]
        total = each[0]
        for matrix in each[1:]:
            total = _added(total, matrix)
        return total

    def _pattern(self, dofs: Index, n: int) -> Pattern:
        for known in self._patterns:
            if len(known.indptr) == n + 1 and known.dofs.shape == dofs.shape and np.array_equal(known.dofs, dofs):
                return known
        runs = find_runs(dofs, n)
        self._patterns.append(pattern(dofs, runs, self._connections(runs.number), n))
        return self._patterns[-1]

    def _connections(self, number: Index) -> Connections:
        for known in self._known:
            if known.number.shape == number.shape and np.array_equal(known.number, number):
                return known
        self._known.append(layered_connections(number))
        return self._known[-1]


def assembled(parts: Sequence[Part], T: sparse.csr_array) -> sparse.csr_array:
    """T^T (sum of the parts) T, (n_dof, n_dof), with parts on raw dofs and T (n_raw, n_dof)."""
    return Assembler(T).total(parts)


def renumbering(T: sparse.csr_array) -> Index:
    """Independent dof (n_raw,) that a raw dof is equal to; -1 where it depends on several, or is scaled."""
    single = np.flatnonzero(np.diff(T.indptr) == 1)
    entry = T.indptr[single]
    same = T.data[entry] == 1.0
    number = np.full(T.shape[0], -1, np.int64)
    number[single[same]] = T.indices[entry[same]]
    return number


def find_runs(dofs: Index, n_dof: int) -> Runs:
    """The longest runs of columns whose dofs are consecutive in all elements, and share no dof with another run."""
    starts = np.concatenate([[True], ~(np.diff(dofs, axis=1) == 1).all(axis=0)])
    runs = _runs_from(dofs, starts, n_dof)
    owner = np.full(n_dof, -1, np.int64)
    owner[dofs] = runs.number[:, runs.column]
    length = np.bincount(runs.column)
    disjoint = (owner[dofs] == runs.number[:, runs.column]).all() and (runs.size[runs.number] == length).all()
    return runs if disjoint else _runs_from(dofs, np.ones(dofs.shape[1], bool), n_dof)


def _runs_from(dofs: Index, starts: NDArray[np.bool_], n_dof: int) -> Runs:
    column = np.cumsum(starts) - 1
    begin = np.flatnonzero(starts)
    size_at = np.zeros(n_dof, np.int64)
    size_at[dofs[:, begin]] = np.diff(begin, append=len(starts))
    first = np.flatnonzero(size_at)
    number_at = np.cumsum(size_at > 0) - 1
    return Runs(first, size_at[first], number_at[dofs[:, begin]], column, np.arange(len(starts)) - begin[column])


def layered_connections(number: Index) -> Connections:
    """Which of the runs number (e, r) are connected, from those of the first layer where runs come in equal layers.

    Every node of a plate has a run of its deflection and one of its rotations: run, and run + n on the same elements.
    """
    n_runs, r = int(number.max()) + 1, number.shape[1]
    for layers in range(r, 1, -1):
        n = n_runs // layers
        if r % layers or n_runs % layers:
            continue
        by_layer = number.reshape(len(number), -1, layers)
        if (by_layer - by_layer[:, :, :1] == n * np.arange(layers)).all():
            return _repeated_in_layers(number, connections(by_layer[:, :, 0]), n, layers)
    return connections(number)


def _repeated_in_layers(number: Index, first: Connections, n: int, layers: int) -> Connections:
    """Connections of all layers, n runs in each, sorted: in a row the pairs of one layer stand after the other's."""
    count = np.bincount(first.row, minlength=n)
    before = (np.cumsum(count) - count)[first.row]  # pairs of the rows above
    k, steps = np.arange(len(first.row)), np.arange(layers)[:, None]
    in_row = layers * before + (k - before) + steps * count[first.row]  # (layer of the column, k)
    place = in_row + (layers * len(k) * np.arange(layers))[:, None, None]  # (layer of the row, layer of the column, k)
    row, col = np.empty(place.size, np.int64), np.empty(place.size, np.int64)
    row[place], col[place] = first.row + n * steps[:, None], first.col + n * steps
    b = number.shape[1] // layers
    pair = np.moveaxis(place.astype(np.int32), 2, 0)[first.pair.reshape(-1, b, b)]
    return Connections(number, row, col, pair.transpose(0, 1, 3, 2, 4).ravel())


def connections(number: Index) -> Connections:
    """Which of the runs number (e, r) of elements are connected."""
    r = number.shape[1]
    n = int(number.max()) + 1
    owner = _sorting(number.ravel().astype(np.int32), n)  # element and run, by run
    counts = np.bincount(number.ravel(), minlength=n)
    indptr = np.concatenate([[0], np.cumsum(counts * r)]).astype(np.int32)
    cols = number.astype(np.int32)[owner // r].ravel()
    pair = (owner[:, None] * np.int32(r) + np.arange(r, dtype=np.int32)).ravel()
    by_row = sparse.csr_array((pair, cols, indptr), shape=(n, n))
    ordered = by_row.tocsc().tocsr()  # sorts the columns of each row and keeps repeated pairs
    new = np.empty(len(cols), bool)
    np.not_equal(ordered.indices[1:], ordered.indices[:-1], out=new[1:])
    new[ordered.indptr[:-1]] = True
    unique = np.cumsum(new, dtype=np.int32)
    number_of = np.empty(len(cols), np.int32)
    number_of[ordered.data] = unique - 1
    row = np.repeat(np.arange(n), np.diff(np.concatenate([[0], unique[ordered.indptr[1:] - 1]])))
    return Connections(number, row, ordered.indices[new].astype(np.int64), number_of)


def pattern(dofs: Index, runs: Runs, joined: Connections, n_dof: int) -> Pattern:
    """The pattern of a matrix (n_dof, n_dof) in which runs are joined."""
    n, row, col = len(runs.first), joined.row, joined.col
    width = runs.size[col]
    end = np.cumsum(width)
    begin = end - width  # of each pair among the entries of one row of every run
    row_end = end[np.append(np.flatnonzero(np.diff(row)), len(row) - 1)]
    row_begin = np.concatenate([[0], row_end[:-1]])
    columns = np.repeat(runs.first[col] - begin, width) + np.arange(end[-1])
    indptr = np.concatenate([[0], row_end, row_end[-1:]])  # one empty row at the end, for dofs without a run
    entries = int(np.sum((row_end - row_begin) * runs.size))
    kind = np.int32 if entries < 2**31 else np.int64
    dust = np.empty(len(columns), np.int8)
    single = sparse.csr_array((dust, columns.astype(kind), indptr.astype(kind)), shape=(n + 1, n_dof))
    run_of = np.full(n_dof, n, np.int64)
    run_of[np.repeat(runs.first, runs.size) + _ramps(runs.size)] = np.repeat(np.arange(n), runs.size)
    full = single[run_of]
    offset = (begin - row_begin[row]).astype(np.int32)[joined.pair].reshape(*runs.number.shape, -1)
    return Pattern(dofs, runs, full.indptr, full.indices, offset)


def _sorting(numbers: NDArray[np.int32], n: int) -> NDArray[np.int32]:
    """Order (k,) that sorts numbers (k,) in 0 .. n - 1 and keeps equal ones in turn; linear, by counting."""
    k = len(numbers)
    ramp = np.arange(k + 1, dtype=np.int32)
    return sparse.csr_array((np.zeros(k, np.int8), numbers, ramp), shape=(k, n)).tocsc().indices


def _expanded(offset: Integers, runs: Runs) -> Integers:
    """Offsets (k, l, l) of single dofs from those of runs (k, r, r)."""
    if len(runs.within) == offset.shape[1]:
        return offset
    return offset[:, runs.column][:, :, runs.column] + runs.within.astype(np.int32)


def _shifted(matrix: sparse.csr_array, step: int) -> sparse.csr_array:
    """The matrix with every row and column number raised by step; its last rows are empty."""
    if step == 0:
        return matrix
    indptr = np.concatenate([np.zeros(step, matrix.indptr.dtype), matrix.indptr[: len(matrix.indptr) - step]])
    indices = matrix.indices + matrix.indices.dtype.type(step)
    return sparse.csr_array((matrix.data, indices, indptr), shape=matrix.shape)


def _added(a: sparse.csr_array, b: sparse.csr_array) -> sparse.csr_array:
    if a.nnz == 0 or b.nnz == 0:
        return b if a.nnz == 0 else a
    return a + b


def _ramps(sizes: Index) -> Index:
    """0 .. size - 1 for every size, one after the other."""
    ends = np.cumsum(sizes)
    return np.arange(ends[-1]) - np.repeat(ends - sizes, sizes)
