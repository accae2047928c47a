"""The multipliers' own equations: A M^-1 A^T lambda = r from the white rows, rows that depend on each other found.

A pivoted Cholesky factorisation finds which rows follow from others; then the multipliers are the smallest that do (in
the rows' scales). `small` holds S (m, m), with the factor L below its diagonal; L^T L (rank, rank);
scales, order, rank, v, w (m each).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.compiled import inner
from femflex.dynamics.constraint_layout import R_LAMBDA, R_TARGET, closing_of, constraint_of
from femflex.dynamics.dense import factorise, solve_factorised
from femflex.dynamics.lanes import beyond
from femflex.dynamics.rows import row_of

Array = NDArray[np.float64]
Table = NDArray[np.int64]

DEPENDENT = 1e-11  # a pivot below this part of the largest belongs to a row that depends on those before


@inner
def scales_of(table: Table) -> int:
    """Place in the work array of scales; order, rank, v and w follow, n_rows each."""
    closing = closing_of(table)
    return closing["small"] + 2 * closing["n_rows"] * closing["n_rows"]


@inner
def rank_of(table: Table, work: Array) -> int:
    """Number of rows that do not depend on others, after factorise_products."""
    return int(work[scales_of(table) + 2 * closing_of(table)["n_rows"]])


@inner
def factorise_products(table: Table, pool: Array, work: Array) -> None:
    """Pivoted Cholesky factor of the scaled A M^-1 A^T, and its rank."""
    closing = closing_of(table)
    m, at = closing["n_rows"], scales_of(table)
    S, order = beyond(work, closing["small"]), beyond(work, at + m)
    write_products(table, pool, work)
    largest = 0.0
    for i in range(m):
        order[i] = i
        largest = max(largest, S[i * m + i])
    rank = 0
    while rank < m:
        best = rank
        for i in range(rank, m):
            if S[i * m + i] > S[best * m + best]:
                best = i
        if not S[best * m + best] > DEPENDENT * largest:
            break
        exchange(S, order, m, rank, best)
        eliminate(S, m, rank)
        rank += 1
    work[at + 2 * m] = rank
    if rank < m:
        write_normal_factor(S, beyond(work, closing["small"] + m * m), m, rank)


@inner
def write_products(table: Table, pool: Array, work: Array) -> None:
    """S = A M^-1 A^T in the rows' scales; a general row is its own measure."""
    closing = closing_of(table)
    m, width, scales = closing["n_rows"], closing["width"], beyond(work, scales_of(table))
    S, white = beyond(work, closing["small"]), beyond(work, closing["white"])
    for i in range(m):
        for j in range(i + 1):
            total = 0.0
            for k in range(width):
                total += white[i * width + k] * white[j * width + k]
            S[i * m + j] = total
    for i in range(closing["n_constraints"]):
        c = constraint_of(table, i)
        for k in range(c["n_rows"]):
            j, s = c["first"] + k, pool[c["scales"] + k]
            if s == 0.0:
                s = 1.0 / math.sqrt(S[j * m + j]) if S[j * m + j] > 0.0 else 1.0
            scales[j] = s
    for i in range(m):
        for j in range(i + 1):
            S[i * m + j] *= scales[i] * scales[j]
            S[j * m + i] = S[i * m + j]


@inner
def exchange(S: Array, order: Array, m: int, a: int, b: int) -> None:
    """Exchange rows a and b, and columns a and b, of S and the factor."""
    if a == b:
        return
    for j in range(m):
        S[b * m + j], S[a * m + j] = S[a * m + j], S[b * m + j]
    for j in range(m):
        S[j * m + b], S[j * m + a] = S[j * m + a], S[j * m + b]
    order[b], order[a] = order[a], order[b]


@inner
def eliminate(S: Array, m: int, k: int) -> None:
    """Column k of the factor, and what remains of S beyond it."""
    root = math.sqrt(S[k * m + k])
    S[k * m + k] = root
    for i in range(k + 1, m):
        S[i * m + k] /= root
    for i in range(k + 1, m):
        for j in range(k + 1, i + 1):
            S[i * m + j] -= S[i * m + k] * S[j * m + k]
            S[j * m + i] = S[i * m + j]


@inner
def write_normal_factor(L: Array, G: Array, m: int, rank: int) -> None:
    """The factors of G = L^T L (rank, rank) of the first columns of L."""
    for i in range(rank):
        for j in range(i + 1):
            total = 0.0
            for k in range(i, m):
                total += L[k * m + i] * L[k * m + j]
            G[i * rank + j] = total
    factorise(G, rank)


@inner
def multipliers(table: Table, work: Array) -> None:
    """Replace the rows' right sides r by lambda of A M^-1 A^T lambda = r: R_TARGET to R_LAMBDA.

    Full rank: two triangular solutions. Else L (m, rank) gives the smallest lambda, L (L^T L)^-2 L^T r.
    """
    closing = closing_of(table)
    m, at, rank = closing["n_rows"], scales_of(table), rank_of(table, work)
    L, scales, order = beyond(work, closing["small"]), beyond(work, at), beyond(work, at + m)
    v, w = beyond(work, at + 3 * m), beyond(work, at + 4 * m)
    for i in range(m):
        j = int(order[i])
        v[i] = scales[j] * work[row_of(table, j) + R_TARGET]
    if rank == m:
        solve_triangles(L, m, v)
    else:
        G = beyond(work, closing["small"] + m * m)
        for i in range(rank):
            w[i] = 0.0
            for k in range(i, m):
                w[i] += L[k * m + i] * v[k]
        solve_factorised(G, rank, w)
        solve_factorised(G, rank, w)
        for i in range(m):
            v[i] = 0.0
            for k in range(min(i + 1, rank)):
                v[i] += L[i * m + k] * w[k]
    for i in range(m):
        j = int(order[i])
        work[row_of(table, j) + R_LAMBDA] = scales[j] * v[i]


@inner
def solve_triangles(L: Array, m: int, v: Array) -> None:
    """Replace v (m) by the solution of L L^T v = v."""
    for i in range(m):
        for k in range(i):
            v[i] -= L[i * m + k] * v[k]
        v[i] /= L[i * m + i]
    for j in range(m):
        i = m - 1 - j
        for k in range(i + 1, m):
            v[i] -= L[k * m + i] * v[k]
        v[i] /= L[i * m + i]
