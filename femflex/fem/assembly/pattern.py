"""Element matrices, the runs of dofs that they connect, and the CSR pattern of their sum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray

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
    before = np.cumsum(runs.size) - runs.size
    run_of[np.repeat(runs.first - before, runs.size) + np.arange(runs.size.sum())] = np.repeat(np.arange(n), runs.size)
    full = single[run_of]
    offset = (begin - row_begin[row]).astype(np.int32)[joined.pair].reshape(*runs.number.shape, -1)
    return Pattern(dofs, runs, full.indptr, full.indices, offset)


def expand_offsets(offset: Integers, runs: Runs) -> Integers:
    """Offsets (k, l, l) of single dofs from those of runs (k, r, r)."""
    if len(runs.within) == offset.shape[1]:
        return offset
    return offset[:, runs.column][:, :, runs.column] + runs.within.astype(np.int32)


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


@dataclass(frozen=True, eq=False)
class Connections:
    """Pairs of runs that share an element: row and col (n_pairs,), sorted; pair (e r r,) for each in the elements."""

    number: IntArray
    row: IntArray
    col: IntArray
    pair: Integers


def find_connections_by_layer(number: IntArray) -> Connections:
    """Return the connections of the runs number (e, r), from those of the first layer where runs come in equal layers.

    Every node of a plate has one run of its deflection and one of its rotations, numbered run and run + n.
    """
    n_runs, r = int(number.max()) + 1, number.shape[1]
    for layers in range(r, 1, -1):
        n = n_runs // layers
        if r % layers or n_runs % layers:
            continue
        by_layer = number.reshape(len(number), -1, layers)
        if (by_layer - by_layer[:, :, :1] == n * np.arange(layers)).all():
            return _repeated_in_layers(number, find_connections(by_layer[:, :, 0]), n, layers)
    return find_connections(number)


def _repeated_in_layers(number: IntArray, first: Connections, n: int, layers: int) -> Connections:
    """Return the connections of all layers of n runs, sorted; in a row the pairs of one layer follow those of the layer
    before."""
    count = np.bincount(first.row, minlength=n)
    before = (np.cumsum(count) - count)[first.row]  # pairs of the rows above
    k, steps = np.arange(len(first.row)), np.arange(layers)[:, None]
    in_row = layers * before + (k - before) + steps * count[first.row]  # (layer of the column, k)
    # (layer of the row, layer of the column, k)
    position = in_row + (layers * len(k) * np.arange(layers))[:, None, None]
    row, col = np.empty(position.size, np.int64), np.empty(position.size, np.int64)
    row[position], col[position] = first.row + n * steps[:, None], first.col + n * steps
    b = number.shape[1] // layers
    pair = np.moveaxis(position.astype(np.int32), 2, 0)[first.pair.reshape(-1, b, b)]
    return Connections(number, row, col, pair.transpose(0, 1, 3, 2, 4).ravel())


def find_connections(number: IntArray) -> Connections:
    """Return the connections of the runs with numbers (e, r) of elements."""
    r = number.shape[1]
    n = int(number.max()) + 1
    owner = _counting_sort_order(number.ravel().astype(np.int32), n)  # element and run, by run
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


def _counting_sort_order(numbers: NDArray[np.int32], n: int) -> NDArray[np.int32]:
    """Order (k,) that sorts numbers (k,) in 0 .. n - 1 and keeps the order of equal ones; linear time, by counting."""
    k = len(numbers)
    ramp = np.arange(k + 1, dtype=np.int32)
    return sparse.csr_array((np.zeros(k, np.int8), numbers, ramp), shape=(k, n)).tocsc().indices
