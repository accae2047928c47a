"""Dofs that support conditions set to zero, provided that these set single dofs and no combinations to zero."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import IntArray

ROUNDING = 1e-9  # entry of a row, and singular value of rows, below which they are zero


def zero_columns(rows: sparse.csr_array) -> IntArray | None:
    """Return the columns (k,), ascending, that rows @ x = 0 sets to zero; None when it leaves a combination of them
    free."""
    entries = rows.tocoo()
    nonzero = np.abs(entries.data) > ROUNDING
    row, column, value = entries.coords[0][nonzero], entries.coords[1][nonzero], entries.data[nonzero]
    columns, local = np.unique(column, return_inverse=True)
    n = len(columns)
    graph = sparse.coo_array((np.ones(len(row)), (row, local)), shape=(rows.shape[0], n))
    single = np.zeros(n, bool)
    single[local[np.diff(graph.tocsr().indptr)[row] == 1]] = True
    if not single.all():
        coupled = (graph.T @ graph).tocsr()
        _, part = csgraph.connected_components(coupled, directed=False)
        for k in np.unique(part[~single]):
            members = np.flatnonzero(part == k)
            in_part = np.isin(local, members)
            used, block_row = np.unique(row[in_part], return_inverse=True)
            block = np.zeros((len(used), len(members)))
            block[block_row, np.searchsorted(members, local[in_part])] = value[in_part]
            if np.linalg.matrix_rank(block, tol=ROUNDING) < len(members):
                return None
    return columns.astype(np.int64)
