"""Vectors of dofs that follow other dofs: the map from all dofs to those that are left independent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import Array, IntArray

SQUARE = 1e-9  # cosine between directions that passes for rounding
NEGLIGIBLE = 1e-9  # singular value of directions below which a dof has no part in them


@dataclass(frozen=True, eq=False)
class Dependence:
    """Components of one vector of raw dofs that follow others: ways @ raw[target] = ways @ M @ raw[source].

    target  (3,) raw dofs of a translation or a rotation; (1,) a single one
    ways    (r, 3) orthonormal directions in which it follows
    source  (m,) raw dofs; M (3, m)
    where   of what it is a part, for messages
    """

    target: IntArray
    ways: Array
    source: IntArray
    M: Array
    where: str


def independent_of(T: sparse.csr_array, dependences: Sequence[Dependence]) -> sparse.csr_array:
    """T (n_raw, n) [1] without the dofs that follow others (n_raw, n - k).

    Raises ValueError where dofs follow in two connections, or each other in a circle.
    """
    if not dependences:
        return T
    n = T.shape[1]
    owner: dict[int, str] = {}
    rows, cols, values = [], [], []
    for one in _gathered(dependences):
        block, own = _columns(T, one.target)
        source, moved = _columns(T, one.source)
        given = one.ways @ one.M @ source
        seen = one.ways @ block
        itself = np.isin(moved, own)  # the vector by its other components
        np.subtract.at(seen.T, np.searchsorted(own, moved[itself]), given[:, itself].T)
        given, moved = given[:, ~itself], moved[~itself]
        U, size, Vt = np.linalg.svd(seen)
        rank = int(np.sum(size > NEGLIGIBLE))
        if not rank:
            continue
        pivots = _pivots(Vt[:rank])
        rest = np.setdiff1d(np.arange(len(own)), pivots)
        left = U[:, :rank].T
        taken = [owner[int(own[p])] for p in pivots if int(own[p]) in owner]
        if taken:
            raise ValueError(
                f"{one.where} and {taken[0]} make the same node dependent; make it dependent in one connection only, "
                "or the reference node of the other"
            )
        owner.update({int(own[p]): one.where for p in pivots})
        inverse = np.linalg.inv(left @ seen[:, pivots])
        columns = np.concatenate([moved, own[rest]])
        relation = np.concatenate([inverse @ left @ given, -inverse @ left @ seen[:, rest]], axis=1)
        row, column = np.nonzero(relation)
        rows.append(own[pivots][row])
        cols.append(columns[column])
        values.append(relation[row, column])
    follow = np.zeros(n, bool)
    follow[list(owner)] = True
    triplets = [(np.concatenate(part) if part else np.zeros(0)) for part in (values, rows, cols)]
    D = sparse.coo_array((triplets[0], (triplets[1].astype(int), triplets[2].astype(int))), shape=(n, n)).tocsr()
    free = np.flatnonzero(~follow)
    number = sparse.coo_array((np.ones(len(free)), (free, np.arange(len(free)))), shape=(n, len(free))).tocsr()
    _refuse_circles(D, owner)
    total, step = number, number
    while step.nnz:
        step = (D @ step).tocsr()
        step.eliminate_zeros()
        total = (total + step).tocsr()
    found = (T @ total).tocsr()
    found.eliminate_zeros()
    found.sort_indices()
    return found


def _gathered(dependences: Sequence[Dependence]) -> list[Dependence]:
    """The dependences, those of one vector in directions at right angles as one: pivots are then chosen together."""
    by_target: dict[tuple[int, ...], list[Dependence]] = {}
    for one in dependences:
        by_target.setdefault(tuple(int(dof) for dof in one.target), []).append(one)
    found: list[Dependence] = []
    for several in by_target.values():
        ways = np.concatenate([one.ways for one in several])
        if len(several) == 1 or np.abs(ways @ ways.T - np.eye(len(ways))).max() > SQUARE:
            found += several
            continue
        source = np.unique(np.concatenate([one.source for one in several]))
        M = np.zeros((several[0].M.shape[0], len(source)))
        for one in several:
            moved = one.ways.T @ one.ways @ one.M
            np.add.at(M.T, np.searchsorted(source, one.source), moved.T)
        where = " and ".join(dict.fromkeys(one.where for one in several))
        found.append(Dependence(several[0].target, ways, source, M, where))
    return found


def _refuse_circles(D: sparse.csr_array, owner: dict[int, str]) -> None:
    """Raise ValueError where dofs follow themselves by way of others."""
    count, part = csgraph.connected_components(D, connection="strong")
    several = np.flatnonzero(np.bincount(part, minlength=count)[part] > 1)
    if len(several):
        names = sorted({owner[int(dof)] for dof in several})
        raise ValueError(
            f"{' and '.join(names)} depend on each other in a cycle; a node may depend only on nodes that do not "
            "depend on it"
        )


def _columns(T: sparse.csr_array, raw: IntArray) -> tuple[Array, IntArray]:
    """The rows of T as a dense block (len(raw), c) and their dofs (c,)."""
    rows = T[raw].tocoo()
    columns, local = np.unique(rows.coords[1], return_inverse=True)
    block = np.zeros((len(raw), len(columns)))
    block[rows.coords[0], local] = rows.data
    return block, columns.astype(np.int64)


def _pivots(rows: Array) -> IntArray:
    """Columns (r,) of rows (r, c) with the largest determinant that elimination with pivots finds."""
    work = rows.copy()
    chosen: list[int] = []
    for _ in range(len(rows)):
        sizes = np.abs(work).max(axis=0)
        sizes[chosen] = -1.0
        # of equal columns the first, so that axes stay as they are
        column = int(np.flatnonzero(sizes >= sizes.max() * (1 - 1e-9))[0])
        at = int(np.abs(work[:, column]).argmax())
        chosen.append(column)
        pivot = work[at] / work[at, column]
        work = work - np.outer(work[:, column], pivot)
    return np.array(chosen, np.int64)
