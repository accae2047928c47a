"""The CSR pattern of a sum of element matrices, built from its connected runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.assembly.connections import Connections

Integers = NDArray[np.integer]  # of any width


@dataclass(frozen=True, eq=False)
class Pattern:
    """CSR pattern indptr, indices of elements with dofs (e, l); offset (e, r, r): the start of each pair of runs within
    its rows."""

    dofs: IntArray
    runs: Runs
    indptr: Integers
    indices: Integers
    offset: Integers


def pattern(dofs: IntArray, runs: Runs, joined: Connections, n_dof: int) -> Pattern:
    """The pattern of a matrix (n_dof, n_dof) in which runs of dofs (e, l), dof numbers, are joined."""
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
    placeholder = np.empty(len(columns), np.int8)
    single = sparse.csr_array((placeholder, columns.astype(kind), indptr.astype(kind)), shape=(n + 1, n_dof))
    run_of = np.full(n_dof, n, np.int64)
    run_of[np.repeat(runs.first, runs.size) + _ramps(runs.size)] = np.repeat(np.arange(n), runs.size)
    full = single[run_of]
    offset = (begin - row_begin[row]).astype(np.int32)[joined.pair].reshape(*runs.number.shape, -1)
    return Pattern(dofs, runs, full.indptr, full.indices, offset)


def expand_offsets(offset: Integers, runs: Runs) -> Integers:
    """Offsets (k, l, l) of single dofs from those of runs (k, r, r)."""
    if len(runs.within) == offset.shape[1]:
        return offset
    return offset[:, runs.column][:, :, runs.column] + runs.within.astype(np.int32)


def _ramps(sizes: IntArray) -> IntArray:
    """0 .. size - 1 for every size, one after the other."""
    ends = np.cumsum(sizes)
    return np.arange(ends[-1]) - np.repeat(ends - sizes, sizes)


@dataclass(frozen=True, eq=False)
class Runs:
    """Dofs of elements (e, l) as runs of consecutive ones.

    first   (n_runs,)  first dof of every run, ascending
    size    (n_runs,)  its number of dofs
    number  (e, r)     runs of the elements
    column  (l,)       index of the element's run that a column belongs to
    within  (l,)       its position in the run
    """

    first: IntArray
    size: IntArray
    number: IntArray
    column: IntArray
    within: IntArray


def find_runs(dofs: IntArray, n_dof: int) -> Runs:
    """The longest runs of columns of dofs (e, l), numbers, that are consecutive in all elements and share none with
    another."""
    starts = np.concatenate([[True], ~(np.diff(dofs, axis=1) == 1).all(axis=0)])
    runs = _runs_from(dofs, starts, n_dof)
    owner = np.full(n_dof, -1, np.int64)
    owner[dofs] = runs.number[:, runs.column]
    length = np.bincount(runs.column)
    disjoint = (owner[dofs] == runs.number[:, runs.column]).all() and (runs.size[runs.number] == length).all()
    return runs if disjoint else _runs_from(dofs, np.ones(dofs.shape[1], bool), n_dof)


def _runs_from(dofs: IntArray, starts: BoolArray, n_dof: int) -> Runs:
    column = np.cumsum(starts) - 1
    begin = np.flatnonzero(starts)
    size_at = np.zeros(n_dof, np.int64)
    size_at[dofs[:, begin]] = np.diff(begin, append=len(starts))
    first = np.flatnonzero(size_at)
    number_at = np.cumsum(size_at > 0) - 1
    return Runs(first, size_at[first], number_at[dofs[:, begin]], column, np.arange(len(starts)) - begin[column])


@dataclass(frozen=True, eq=False)
class ElementMatrices:
    """Element matrices values(elements) (k, l, l) on the dofs (e, l), or alike on every component of dofs (e, l, c)."""

    dofs: IntArray
    values: Callable[[slice], Array]
