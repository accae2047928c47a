"""The CSR pattern of a sum of element matrices, built from its connected runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from femflex.arrays import IntArray
from femflex.fem.assembly.connections import Connections
from femflex.fem.assembly.runs import Runs

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
