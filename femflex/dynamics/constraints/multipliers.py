"""The multipliers' own equations: A M^-1 A^T lambda = r from the white rows, rows that depend on each other found.

The white rows W (A M^-1 A^T = W W^T) are orthogonalised, the longest remaining one first: W = L Q, L lower triangular.
Nothing is squared, so that rows as different as their bodies' masses stay apart from rows that follow from others. Then
the multipliers are the smallest that do (in the rows' scales).

`small` holds L (m, m); the orthonormal columns P (m, rank) and the triangle R (rank, rank) of L = P R where rows are
redundant; scales, order, rank, v, w (m each). `basis` (m, width) holds the rows as they are orthogonalised.
"""

from __future__ import annotations

import math

from femflex.arrays import Array, Table
from femflex.dynamics.constraints.rows import row_of
from femflex.dynamics.layout.constraint_records import R_LAMBDA, R_TARGET, closing_of, constraint_of
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset

# The pool holds the part that stands instead along a run, where that at the start is known (see `singular_passage`).
RESUM_BELOW = 1e-6  # part of a squared length down to which subtracting from it is exact enough


@inner
def scales_of(table: Table) -> int:
    """Place in the work array of scales; order, rank, v and w follow, n_rows each."""
    closing = closing_of(table)
    return closing["small"] + 3 * closing["n_rows"] * closing["n_rows"]


@inner
def rank_of(table: Table, work: Array) -> int:
    """Number of rows that do not depend on others, after factorise_products."""
    return int(work[scales_of(table) + 2 * closing_of(table)["n_rows"]])


@inner
def factorise_products(table: Table, pool: Array, work: Array) -> None:
    """The factor L of the scaled white rows, and their rank."""
    closing = closing_of(table)
    m, width, base = closing["n_rows"], closing["width"], scales_of(table)
    L, basis, order = offset(work, closing["small"]), offset(work, closing["basis"]), offset(work, base + m)
    remaining, summed = (
        offset(work, base + 3 * m),
        offset(work, base + 4 * m),
    )  # squared lengths: what remains, when last summed
    write_scaled(table, pool, work)
    for i in range(m):
        order[i] = i
        remaining[i] = summed[i] = row_product(basis, i, i, width)
    rank, longest = 0, 0.0
    while rank < m:
        best = longest_remaining(basis, remaining, summed, rank, m, width)
        longest = math.sqrt(remaining[best]) if rank == 0 else longest
        if not math.sqrt(remaining[best]) > pool[closing["tolerance"] + 2] * longest:
            L[rank * m + rank] = math.sqrt(remaining[best])  # to be reported; of no part in what follows
            break
        exchange(L, basis, order, m, width, rank, best)
        remaining[best], summed[best] = remaining[rank], summed[rank]
        eliminate(L, basis, remaining, m, width, rank)
        rank += 1
    work[base + 2 * m] = rank
    if rank < m:
        orthogonalise_columns(L, offset(work, closing["small"] + m * m), m, rank)


@inner
def write_scaled(table: Table, pool: Array, work: Array) -> None:
    """The white rows in the rows' scales; a general row is its own measure."""
    closing = closing_of(table)
    width, scales = closing["width"], offset(work, scales_of(table))
    white, basis = offset(work, closing["white"]), offset(work, closing["basis"])
    for i in range(closing["n_constraints"]):
        c = constraint_of(table, i)
        for k in range(c["n_rows"]):
            j, s = c["first"] + k, pool[c["scales"] + k]
            if s == 0.0:
                square = row_product(white, j, j, width)
                s = 1.0 / math.sqrt(square) if square > 0.0 else 1.0
            scales[j] = s
            for a in range(width):
                basis[j * width + a] = s * white[j * width + a]


@inner
def row_product(rows: Array, i: int, j: int, width: int) -> float:
    """Row i times row j."""
    total = 0.0
    for a in range(width):
        total += rows[i * width + a] * rows[j * width + a]
    return total


@inner
def longest_remaining(basis: Array, remaining: Array, summed: Array, first: int, m: int, width: int) -> int:
    """The row of which most remains; lengths that have shrunk far are summed anew."""
    best = first
    for i in range(first, m):
        if remaining[i] < RESUM_BELOW * summed[i]:
            remaining[i] = summed[i] = row_product(basis, i, i, width)
        if remaining[i] > remaining[best]:
            best = i
    return best


@inner
def exchange(L: Array, basis: Array, order: Array, m: int, width: int, a: int, b: int) -> None:
    """Exchange rows a and b of the factor and of the basis."""
    if a == b:
        return
    for j in range(a):
        L[b * m + j], L[a * m + j] = L[a * m + j], L[b * m + j]
    for j in range(width):
        basis[b * width + j], basis[a * width + j] = basis[a * width + j], basis[b * width + j]
    order[b], order[a] = order[a], order[b]


@inner
def eliminate(L: Array, basis: Array, remaining: Array, m: int, width: int, k: int) -> None:
    """Column k of the factor; the rows beyond k lose their part along row k."""
    length = math.sqrt(row_product(basis, k, k, width))
    L[k * m + k] = length
    for a in range(width):
        basis[k * width + a] /= length
    for i in range(k + 1, m):
        part = row_product(basis, i, k, width)
        L[i * m + k] = part
        remaining[i] = max(remaining[i] - part * part, 0.0)
        for a in range(width):
            basis[i * width + a] -= part * basis[k * width + a]


@inner
def orthogonalise_columns(L: Array, P: Array, m: int, rank: int) -> None:
    """P (m, rank) with orthonormal columns and R (rank, rank), m * m behind it, of the columns of L = P R."""
    R = offset(P, m * m)
    for j in range(rank):
        for i in range(m):
            P[i * rank + j] = L[i * m + j] if i >= j else 0.0
        for k in range(j):
            R[k * rank + j] = 0.0
        for _ in range(2):  # twice is enough
            for k in range(j):
                part = 0.0
                for i in range(m):
                    part += P[i * rank + k] * P[i * rank + j]
                R[k * rank + j] += part
                for i in range(m):
                    P[i * rank + j] -= part * P[i * rank + k]
        square = 0.0
        for i in range(m):
            square += P[i * rank + j] ** 2
        R[j * rank + j] = math.sqrt(square)
        for i in range(m):
            P[i * rank + j] /= R[j * rank + j]


@inner
def multipliers(table: Table, work: Array) -> None:
    """Replace the rows' right sides r by lambda of A M^-1 A^T lambda = r: R_TARGET to R_LAMBDA.

    Full rank: two triangular solutions. Else, with L = P R, the smallest lambda, P R^-T R^-1 P^T r.
    """
    closing = closing_of(table)
    m, base, rank = closing["n_rows"], scales_of(table), rank_of(table, work)
    L, scales, order = offset(work, closing["small"]), offset(work, base), offset(work, base + m)
    v, w = offset(work, base + 3 * m), offset(work, base + 4 * m)
    for i in range(m):
        j = int(order[i])
        v[i] = scales[j] * work[row_of(table, j) + R_TARGET]
    if rank == m:
        solve_triangles(L, m, v)
    else:
        solve_deficient(offset(work, closing["small"] + m * m), m, rank, v, w)
    for i in range(m):
        j = int(order[i])
        work[row_of(table, j) + R_LAMBDA] = scales[j] * v[i]


@inner
def solve_deficient(P: Array, m: int, rank: int, v: Array, w: Array) -> None:
    """Replace v (m) by P R^-T R^-1 P^T v; w is scratch."""
    R = offset(P, m * m)
    for i in range(rank):
        w[i] = 0.0
        for k in range(m):
            w[i] += P[k * rank + i] * v[k]
    for j in range(rank):
        i = rank - 1 - j
        for k in range(i + 1, rank):
            w[i] -= R[i * rank + k] * w[k]
        w[i] /= R[i * rank + i]
    for i in range(rank):
        for k in range(i):
            w[i] -= R[k * rank + i] * w[k]
        w[i] /= R[i * rank + i]
    for i in range(m):
        v[i] = 0.0
        for k in range(rank):
            v[i] += P[i * rank + k] * w[k]


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
