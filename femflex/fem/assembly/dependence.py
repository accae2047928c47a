"""Vectors of dofs that follow other dofs, and the map from all dofs to those that remain independent."""

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
    """Components of one vector of raw dofs that follow others: directions @ raw[target] = directions @ M @ raw[source].

    target  (3,) raw dofs of a translation or a rotation; (1,) a single one
    directions  (r, 3) orthonormal directions in which it follows
    source  (m,) raw dofs; M (3, m)
    where   the connection that it belongs to, for messages
    """

    target: IntArray
    directions: Array
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
    for dependence in _merged_by_target(dependences):
        block, target_columns = _columns(T, dependence.target)
        source, source_columns = _columns(T, dependence.source)
        source_factors = dependence.directions @ dependence.M @ source
        target_factors = dependence.directions @ block
        in_target = np.isin(source_columns, target_columns)  # the vector follows its own other components
        np.subtract.at(
            target_factors.T, np.searchsorted(target_columns, source_columns[in_target]), source_factors[:, in_target].T
        )
        source_factors, source_columns = source_factors[:, ~in_target], source_columns[~in_target]
        U, size, Vt = np.linalg.svd(target_factors)
        rank = int(np.sum(size > NEGLIGIBLE))
        if not rank:
            continue
        pivots = _pivots(Vt[:rank])
        rest = np.setdiff1d(np.arange(len(target_columns)), pivots)
        basis = U[:, :rank].T
        owners = [owner[int(target_columns[p])] for p in pivots if int(target_columns[p]) in owner]
        if owners:
            raise ValueError(
                f"{dependence.where} and {owners[0]} make the same node dependent; make it dependent in one connection "
                "only, or the reference node of the other"
            )
        owner.update({int(target_columns[p]): dependence.where for p in pivots})
        inverse = np.linalg.inv(basis @ target_factors[:, pivots])
        columns = np.concatenate([source_columns, target_columns[rest]])
        relation = np.concatenate(
            [inverse @ basis @ source_factors, -inverse @ basis @ target_factors[:, rest]], axis=1
        )
        row, column = np.nonzero(relation)
        rows.append(target_columns[pivots][row])
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
    independent = (T @ total).tocsr()
    independent.eliminate_zeros()
    independent.sort_indices()
    return independent


def _merged_by_target(dependences: Sequence[Dependence]) -> list[Dependence]:
    """Merge the dependences of one vector in perpendicular directions, so that their pivots are chosen together."""
    by_target: dict[tuple[int, ...], list[Dependence]] = {}
    for dependence in dependences:
        by_target.setdefault(tuple(int(dof) for dof in dependence.target), []).append(dependence)
    merged: list[Dependence] = []
    for group in by_target.values():
        directions = np.concatenate([dependence.directions for dependence in group])
        if len(group) == 1 or np.abs(directions @ directions.T - np.eye(len(directions))).max() > SQUARE:
            merged += group
            continue
        source = np.unique(np.concatenate([dependence.source for dependence in group]))
        M = np.zeros((group[0].M.shape[0], len(source)))
        for dependence in group:
            factors = dependence.directions.T @ dependence.directions @ dependence.M
            np.add.at(M.T, np.searchsorted(source, dependence.source), factors.T)
        where = " and ".join(dict.fromkeys(dependence.where for dependence in group))
        merged.append(Dependence(group[0].target, directions, source, M, where))
    return merged


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
        row = int(np.abs(work[:, column]).argmax())
        chosen.append(column)
        pivot = work[row] / work[row, column]
        work = work - np.outer(work[:, column], pivot)
    return np.array(chosen, np.int64)
