"""Cholesky factors of large sparse matrices: nested dissection, and dense fronts from separator to separator.

The graph is cut by separators of nodes, its halves again, down to small blocks. A front contains the dofs of one
separator, which are eliminated last of its subtree, and the dofs further up that they are connected to (I. S. Duff and
J. K. Reid, ACM Trans. Math. Softw. 9 (1983) 302). All arithmetic is in dense blocks and runs at the speed of matrix
products. A separator is the middle level set of distances from the far side of the part (A. George and J. W. H. Liu,
Computer Solution of Large Sparse Positive Definite Systems (1981), ch. 8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.linalg import blas, lapack

from femflex.arrays import Array, IntArray

LEAF = 60  # number of graph nodes at which a part is not cut further
FEW_DOFS = 10_000  # below which SuperLU is quick enough
WIDE = 2e4  # dofs squared: cube of the size of level sets over the number of dofs, from which fronts are faster
BALANCE = 0.3  # least share of a part on each side of its separator


@dataclass(frozen=True, eq=False)
class Front:
    """A part's dofs begin .. end, in the order of elimination, and the later ones connected to them; L11 (p, p), L21
    (m, p)."""

    begin: int
    end: int
    later: IntArray
    L11: Array
    L21: Array


def worthwhile(A: sparse.csr_array) -> bool:
    """Whether fronts are faster than scipy's SuperLU on A (n, n) [any unit]: for large matrices of solids, which have
    wide separators.

    With level sets of s dofs the fronts cost about s^3, and their overhead grows with n: s^3 / n is over 2e4 on meshes
    of solids, and below 1e4 on shells.
    """
    n = A.shape[0]
    if n < FEW_DOFS:
        return False
    graph = _compress_graph(A)[1]
    level = _levels(graph, np.array([0]))
    reached = level >= 0
    width = n * reached.mean() / (level.max() + 1)
    return bool(width**3 > WIDE * n)


class Cholesky:
    """Factors of a symmetric positive definite matrix (n, n); LinAlgError where it is not positive definite."""

    def __init__(self, A: sparse.csr_array) -> None:
        self.order, tree = dissection(A)
        self._fronts = _factorise_fronts(A[self.order][:, self.order].tocsr(), tree)

    def solve(self, b: Array) -> Array:
        """A^-1 b of b (n,) or (n, k), in the unit of b over that of A: [m] of forces and stiffness."""
        x = np.array(b[self.order], np.float64)
        triangular_solve = blas.dtrsv if x.ndim == 1 else _dtrsm
        for f in self._fronts:
            part_x = x[f.begin : f.end] = triangular_solve(f.L11, x[f.begin : f.end], lower=1)
            if len(f.later):
                x[f.later] -= f.L21 @ part_x
        for f in reversed(self._fronts):
            part_x = x[f.begin : f.end]
            if len(f.later):
                part_x = part_x - f.L21.T @ x[f.later]
            x[f.begin : f.end] = triangular_solve(f.L11, part_x, lower=1, trans=1)
        solution = np.empty_like(x)
        solution[self.order] = x
        return solution


def _dtrsm(L: Array, b: Array, lower: int, trans: int = 0) -> Array:
    """L^-1 b or L^-T b, b (p, k)."""
    return np.asarray(blas.dtrsm(1.0, L, b, lower=lower, trans_a=trans))


@dataclass(frozen=True, eq=False)
class EliminationPart:
    """A part of the elimination order, begin .. end, and the numbers of the parts below that it joins."""

    begin: int
    end: int
    below: tuple[int, ...]


def dissection(A: sparse.csr_array) -> tuple[IntArray, list[EliminationPart]]:
    """Return the elimination order (n,) of the rows of a symmetric pattern (n, n), and its parts, each after those
    below it."""
    node, graph = _compress_graph(A)
    dofs = np.argsort(node, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(node, minlength=graph.shape[0]))])
    order: list[IntArray] = []
    parts: list[EliminationPart] = []

    def add(nodes: IntArray, below: tuple[int, ...]) -> int:
        begin = parts[-1].end if parts else 0
        part_dofs = np.concatenate([dofs[starts[k] : starts[k + 1]] for k in nodes])
        order.append(part_dofs)
        parts.append(EliminationPart(begin, begin + len(part_dofs), below))
        return len(parts) - 1

    def dissect(nodes: IntArray) -> tuple[int, ...]:
        if len(nodes) <= LEAF:
            return (add(nodes, ()),) if len(nodes) else ()
        first_half, second_half, separator = _halves(graph[nodes][:, nodes].tocsr())
        if not len(first_half) or not len(second_half):
            return (add(nodes, ()),)
        below = dissect(nodes[first_half]) + dissect(nodes[second_half])
        return (add(nodes[separator], below),) if len(separator) else below

    dissect(np.arange(graph.shape[0]))
    return np.concatenate(order), parts


def _compress_graph(A: sparse.csr_array) -> tuple[IntArray, sparse.csr_array]:
    """Return the node (n,) of a smaller graph that each dof belongs to, and that graph, in which dofs of equal patterns
    are one node."""
    n = A.shape[0]
    pattern = sparse.csr_array((np.ones(A.nnz), A.indices, A.indptr), shape=A.shape)
    marks = np.random.default_rng(0).random(n)
    _, first, node = np.unique(np.asarray(pattern @ marks), return_index=True, return_inverse=True)
    if len(first) == n:
        return np.arange(n), pattern
    members = sparse.csr_array((np.ones(n), (np.arange(n), node)), shape=(n, len(first)))
    graph = (pattern[first] @ members).tocsr()
    graph.data[:] = 1.0
    return node.astype(np.int64), graph


def _halves(graph: sparse.csr_array) -> tuple[IntArray, IntArray, IntArray]:
    """Return two sides of a connected graph and the separator between them; of a graph in pieces, the first piece and
    the rest."""
    level = _levels(graph, np.array([0]))
    if (level < 0).any():
        return np.flatnonzero(level >= 0), np.flatnonzero(level < 0), np.zeros(0, np.int64)
    for _ in range(2):
        level = _levels(graph, np.flatnonzero(level == level.max()))
    counts = np.bincount(level)
    before = np.cumsum(counts) - counts
    allowed = (before >= BALANCE * len(level)) & (before + counts <= (1 - BALANCE) * len(level))
    if not allowed.any():
        allowed = np.zeros(len(counts), bool)
        allowed[int(np.searchsorted(before + counts, len(level) / 2))] = True
    middle = int(np.flatnonzero(allowed)[np.argmin(counts[allowed])])
    after = level == middle + 1
    between = (level == middle) & ((graph @ after) > 0)
    return np.flatnonzero((level <= middle) & ~between), np.flatnonzero(level > middle), np.flatnonzero(between)


def _levels(graph: sparse.csr_array, start: IntArray) -> IntArray:
    """Distances (n,) of nodes from the start; -1 where not reached."""
    n = graph.shape[0]
    level = np.full(n, -1, np.int64)
    level[start] = 0
    front, distance = start, 0
    while len(front):
        distance += 1
        neighbours = np.unique(graph[front].indices).astype(np.int64)
        front = neighbours[level[neighbours] < 0]
        level[front] = distance
    return level


def _factorise_fronts(A: sparse.csr_array, tree: list[EliminationPart]) -> list[Front]:
    """Fronts of the permuted matrix, one for each part of the tree."""
    A.sort_indices()
    fronts: list[Front] = []
    updates: dict[int, tuple[IntArray, Array]] = {}  # later dofs and update of the parts that are not joined yet
    for number, part in enumerate(tree):
        rows = slice(A.indptr[part.begin], A.indptr[part.end])
        columns, values = A.indices[rows].astype(np.int64), A.data[rows]
        row = np.repeat(np.arange(part.begin, part.end), np.diff(A.indptr[part.begin : part.end + 1]))
        below = [updates.pop(k) for k in part.below]
        connected = np.unique(np.concatenate([columns, *(later for later, _ in below)]))
        later = connected[connected >= part.end]
        p, m = part.end - part.begin, len(later)
        F = np.zeros((p + m, p + m), order="F")
        front_dofs = np.concatenate([np.arange(part.begin, part.end), later])
        lower = columns >= row  # entry (row, column) of the upper triangle is (column, row) of the lower
        F[np.searchsorted(front_dofs, columns[lower]), row[lower] - part.begin] = values[lower]
        for child_dofs, share in below:
            position = np.searchsorted(front_dofs, child_dofs)
            F[np.ix_(position, position)] += share
        L11, failed = lapack.dpotrf(F[:p, :p], lower=1, clean=1)
        if failed:
            raise np.linalg.LinAlgError("the matrix is not positive definite")
        L21 = np.zeros((0, p))
        if m:
            L21 = blas.dtrsm(1.0, L11, F[p:, :p], side=1, lower=1, trans_a=1)
            share = blas.dsyrk(-1.0, L21, beta=1.0, c=np.asfortranarray(F[p:, p:]), lower=1, overwrite_c=1)
            updates[number] = later, share
        fronts.append(Front(part.begin, part.end, later, L11, L21))
    return fronts
