"""Pairs of runs of dofs that share an element, computed once for all matrices on the same elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from femflex.arrays import IntArray

Integers = NDArray[np.integer]  # of any width


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
