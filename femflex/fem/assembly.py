"""Sparse sums of element matrices.

The pattern is found on runs of dofs that always come together (the three translations of a node), which are few, and
laid out as a finished CSR matrix; the element matrices are then made chunk by chunk and added in place, so that no
list of triplets is ever held.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
Index = NDArray[np.int64]

CHUNK_ENTRIES = 400_000  # entries of element matrices made at once: small enough to stay in cache (3 MB)


@dataclass(frozen=True, eq=False)
class Part:
    """Element matrices values(elements) (k, l, l) on the dofs (e, l), or alike on every component of dofs (e, l, c)."""

    dofs: Index
    values: Callable[[slice], Array]

    @property
    def components(self) -> list[Part]:
        """One part with dofs (e, l) for every component."""
        if self.dofs.ndim == 2:
            return [self]
        return [Part(self.dofs[:, :, c], self.values) for c in range(self.dofs.shape[2])]


@dataclass(frozen=True, eq=False)
class _Runs:
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


def assembled(parts: Sequence[Part], T: sparse.csr_array) -> sparse.csr_array:
    """T^T (sum of the parts) T, with parts on raw dofs and T (n_raw, n_dof) giving these from the independent ones.

    Parts whose raw dofs are independent ones by another number go straight to their places.
    """
    n_raw, n_dof = T.shape
    number = _renumbering(T)
    direct, reduced = sparse.csr_array((n_dof, n_dof)), sparse.csr_array((n_raw, n_raw))
    for part in parts:
        renumbered = number[part.dofs]
        if (renumbered >= 0).all():
            direct = _added(direct, summed(Part(renumbered, part.values), n_dof))
        else:
            reduced = _added(reduced, summed(part, n_raw))
    if reduced.nnz:
        direct = _added(direct, (T.T.tocsr() @ (reduced @ T)).tocsr())
    direct.eliminate_zeros()
    direct.sort_indices()
    return direct


def summed(part: Part, n_dof: int) -> sparse.csr_array:
    """Sparse sum (n_dof, n_dof) of the part's element matrices, indices sorted."""
    if not part.dofs.size:
        return sparse.csr_array((n_dof, n_dof))
    if part.dofs.ndim == 3:
        return _repeated(part, n_dof)
    runs = _runs(part.dofs, n_dof)
    pattern, offset = _pattern(runs, n_dof)
    start = pattern.indptr[part.dofs]
    step = max(1, CHUNK_ENTRIES // part.dofs.shape[1] ** 2)
    for begin in range(0, len(part.dofs), step):
        chunk = slice(begin, begin + step)
        place = start[chunk, :, None] + _expanded(offset[chunk], runs)
        np.add.at(pattern.data, place.ravel(), np.ascontiguousarray(part.values(chunk)).ravel())
    return pattern


def _repeated(part: Part, n_dof: int) -> sparse.csr_array:
    """The sum of a part that is alike on all components: made once, and shifted where they are numbered in a row."""
    dofs = part.dofs
    shift = dofs - dofs[:, :, :1]
    constant = shift.reshape(-1, shift.shape[2])[0]
    if not (shift == constant).all():
        return _total([summed(each, n_dof) for each in part.components])
    one = summed(Part(dofs[:, :, 0], part.values), n_dof)
    return _total([_shifted(one, int(step)) for step in constant])


def _shifted(matrix: sparse.csr_array, step: int) -> sparse.csr_array:
    """The matrix with every row and column number raised by step."""
    if step == 0:
        return matrix
    rows = np.roll(np.diff(matrix.indptr), step)
    indptr = np.concatenate([[0], np.cumsum(rows)]).astype(matrix.indptr.dtype)
    data = matrix.data
    if step < 0 or rows[:step].any():  # rows never wrap round: the last components are dofs too
        raise ValueError(f"components numbered {step} apart do not fit in {matrix.shape[0]} dofs")
    return sparse.csr_array((data, matrix.indices + matrix.indices.dtype.type(step), indptr), shape=matrix.shape)


def _total(matrices: Sequence[sparse.csr_array]) -> sparse.csr_array:
    total = matrices[0]
    for matrix in matrices[1:]:
        total = _added(total, matrix)
    return total


def _added(a: sparse.csr_array, b: sparse.csr_array) -> sparse.csr_array:
    if a.nnz == 0 or b.nnz == 0:
        return b if a.nnz == 0 else a
    return a + b


def _renumbering(T: sparse.csr_array) -> Index:
    """Independent dof (n_raw,) that a raw dof is equal to; -1 where it depends on several, or is scaled."""
    counts = np.diff(T.indptr)
    single = np.flatnonzero(counts == 1)
    entry = T.indptr[single]
    same = T.data[entry] == 1.0
    number = np.full(T.shape[0], -1, np.int64)
    number[single[same]] = T.indices[entry[same]]
    return number


def _runs(dofs: Index, n_dof: int) -> _Runs:
    """The longest runs of columns whose dofs are consecutive in all elements."""
    starts = np.concatenate([[True], ~(np.diff(dofs, axis=1) == 1).all(axis=0)])
    runs = _runs_from(dofs, starts, n_dof)
    owner = np.full(n_dof, -1, np.int64)
    owner[dofs] = runs.number[:, runs.column]
    length = np.bincount(runs.column)
    disjoint = (owner[dofs] == runs.number[:, runs.column]).all() and (runs.size[runs.number] == length).all()
    return runs if disjoint else _runs_from(dofs, np.ones(dofs.shape[1], bool), n_dof)


def _runs_from(dofs: Index, starts: NDArray[np.bool_], n_dof: int) -> _Runs:
    column = np.cumsum(starts) - 1
    begin = np.flatnonzero(starts)
    within = np.arange(len(starts)) - begin[column]
    size_at = np.zeros(n_dof, np.int64)
    size_at[dofs[:, begin]] = np.diff(begin, append=len(starts))
    first = np.flatnonzero(size_at)
    number_at = np.cumsum(size_at > 0) - 1
    return _Runs(first, size_at[first], number_at[dofs[:, begin]], column, within)


def _pattern(runs: _Runs, n_dof: int) -> tuple[sparse.csr_array, Index]:
    """CSR matrix of zeros with an entry for every coupled pair of dofs, and offset (e, r, r): where in its rows a
    pair of runs begins."""
    n = len(runs.first)
    keys = (runs.number[:, :, None] * n + runs.number[:, None, :]).ravel()
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    new = np.concatenate([[True], ordered[1:] != ordered[:-1]])
    pairs = ordered[new]
    row, col = pairs // n, pairs % n
    width = np.cumsum(runs.size[col])
    begin = width - runs.size[col]  # of each pair among all entries of the runs' single rows
    row_begin = np.concatenate([[0], width[np.flatnonzero(np.diff(row))]])
    offset = np.empty(len(keys), np.int64)
    offset[order] = (begin - row_begin[row])[np.cumsum(new) - 1]
    repeats = runs.size[col]
    columns = np.repeat(runs.first[col] - begin, repeats) + np.arange(width[-1])
    row_ends = np.append(row_begin[1:], width[-1])
    indptr = np.concatenate([[0], row_ends, row_ends[-1:]])  # one empty row at the end, for dofs without a run
    int_type = np.int32 if int(np.sum((row_ends - row_begin) * runs.size)) < 2**31 else np.int64
    zeros = np.zeros(len(columns))
    single = sparse.csr_array((zeros, columns.astype(int_type), indptr.astype(int_type)), shape=(n + 1, n_dof))
    run_of = np.full(n_dof, n, np.int64)
    run_of[np.repeat(runs.first, runs.size) + _ramps(runs.size)] = np.repeat(np.arange(n), runs.size)
    return single[run_of], offset.reshape(len(runs.number), runs.number.shape[1], -1)


def _expanded(offset: Index, runs: _Runs) -> Index:
    """Offsets (k, l, l) of single dofs from those of runs (k, r, r)."""
    if len(runs.within) == offset.shape[1]:
        return offset
    return offset[:, runs.column][:, :, runs.column] + runs.within


def _ramps(sizes: Index) -> Index:
    """0 .. size - 1 for every size, one after the other."""
    ends = np.cumsum(sizes)
    return np.arange(ends[-1]) - np.repeat(ends - sizes, sizes)
