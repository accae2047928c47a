"""Dofs that are zero under support conditions, where these set single dofs to zero and no combinations."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import IntArray

ROUNDING = 1e-9  # entry of a row, and singular value of rows, below which they are zero


def held_columns(rows: sparse.csr_array) -> IntArray | None:
    """Columns (k,), ascending, that rows @ x = 0 sets to zero; None when it leaves a combination of them free."""
    entries = rows.tocoo()
    sees = np.abs(entries.data) > ROUNDING
    row, column, value = entries.coords[0][sees], entries.coords[1][sees], entries.data[sees]
    columns, own = np.unique(column, return_inverse=True)
    n = len(columns)
    graph = sparse.coo_array((np.ones(len(row)), (row, own)), shape=(rows.shape[0], n))
    alone = np.zeros(n, bool)
    alone[own[np.diff(graph.tocsr().indptr)[row] == 1]] = True
    if not alone.all():
        both = (graph.T @ graph).tocsr()
        _, part = csgraph.connected_components(both, directed=False)
        for k in np.unique(part[~alone]):
            members = np.flatnonzero(part == k)
            of = np.isin(own, members)
            used, at = np.unique(row[of], return_inverse=True)
            block = np.zeros((len(used), len(members)))
            block[at, np.searchsorted(members, own[of])] = value[of]
            if np.linalg.matrix_rank(block, tol=ROUNDING) < len(members):
                return None
    return columns.astype(np.int64)
