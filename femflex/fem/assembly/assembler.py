"""Sparse sums of element matrices.

The pattern is found on runs of dofs that always come together (the three translations of a node), which are few, and
laid out as a finished CSR matrix; the element matrices are then made chunk by chunk and added in place, so that no
list of triplets is ever held. How runs are connected is found once for all matrices on the same elements.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from femflex.arrays import IntArray
from femflex.fem.assembly.connections import Connections, layered_connections
from femflex.fem.assembly.narrowed import narrowing
from femflex.fem.assembly.part import Part
from femflex.fem.assembly.pattern import Pattern, expanded, pattern
from femflex.fem.assembly.runs import find_runs

CHUNK_ENTRIES = 400_000  # entries of element matrices made at once: small enough to stay in cache (3 MB)


class Assembler:
    """Sums of element matrices on raw dofs, which T (n_raw, n_dof) gives from the independent ones."""

    def __init__(self, T: sparse.csr_array) -> None:
        self._T = T.copy()
        self._T.eliminate_zeros()
        self._narrowing = narrowing(self._T)
        self._empty = np.diff(self._T.indptr) == 0  # raw dofs that nothing moves
        self._known: list[Connections] = []
        self._patterns: list[Pattern] = []

    def total(self, parts: Sequence[Part]) -> sparse.csr_array:
        """T^T (sum of the parts) T (n_dof, n_dof) [N/m or kg in rows of translations], without entries that are zero.

        Elements whose raw dofs are independent ones by another number, or rotations in a plane, go straight to their
        places (`femflex.fem.assembly.narrowed`).
        """
        n_raw, n_dof = self._T.shape
        direct, reduced = sparse.csr_array((n_dof, n_dof)), sparse.csr_array((n_raw, n_raw))
        for given in parts:
            near, far = self._narrowing.split(self._moved(given))
            if near is not None:
                direct = _added(direct, self._sum(near, n_dof))
            if far is not None:
                reduced = _added(reduced, self._sum(far, n_raw))
        if reduced.nnz:
            direct = _added(direct, (self._T.T.tocsr() @ (reduced @ self._T)).tocsr())
        direct.sort_indices()
        if direct.nnz > np.count_nonzero(direct.data):
            direct = direct.copy()  # its pattern may belong to another matrix too
            direct.eliminate_zeros()
        return direct

    def _moved(self, part: Part) -> Part:
        """The part without columns of dofs that nothing moves, such as rotation of a flat plate about its normal."""
        still = self._empty[part.dofs].all(axis=0)
        if part.dofs.ndim == 3 or not still.any():
            return part
        kept = np.flatnonzero(~still)
        return Part(part.dofs[:, kept], lambda elements: part.values(elements)[:, kept[:, None], kept])

    def _sum(self, part: Part, n: int) -> sparse.csr_array:
        """Sparse sum (n, n) of the part's element matrices, indices sorted."""
        if not part.dofs.size:
            return sparse.csr_array((n, n))
        if part.dofs.ndim == 3:
            return self._repeated(part, n)
        known = self._pattern(part.dofs, n)
        data = np.zeros(len(known.indices))
        start = known.indptr[part.dofs]
        step = max(1, CHUNK_ENTRIES // part.dofs.shape[1] ** 2)
        for begin in range(0, len(part.dofs), step):
            chunk = slice(begin, begin + step)
            place = start[chunk, :, None] + expanded(known.offset[chunk], known.runs)
            np.add.at(data, place.ravel(), np.ascontiguousarray(part.values(chunk)).ravel())
        return sparse.csr_array((data, known.indices, known.indptr), shape=(n, n))

    def _repeated(self, part: Part, n: int) -> sparse.csr_array:
        """The sum of a part that is alike on all components: made once where they are numbered in a row."""
        dofs = part.dofs
        shift = dofs - dofs[:, :, :1]
        steps = shift[0, 0]
        if (shift == steps).all():
            one = self._sum(Part(dofs[:, :, 0], part.values), n)
            each = [_shifted(one, int(step)) for step in steps]
        else:
            each = [self._sum(Part(dofs[:, :, c], part.values), n) for c in range(dofs.shape[2])]
        total = each[0]
        for matrix in each[1:]:
            total = _added(total, matrix)
        return total

    def _pattern(self, dofs: IntArray, n: int) -> Pattern:
        for known in self._patterns:
            if len(known.indptr) == n + 1 and known.dofs.shape == dofs.shape and np.array_equal(known.dofs, dofs):
                return known
        runs = find_runs(dofs, n)
        self._patterns.append(pattern(dofs, runs, self._connections(runs.number), n))
        return self._patterns[-1]

    def _connections(self, number: IntArray) -> Connections:
        for known in self._known:
            if known.number.shape == number.shape and np.array_equal(known.number, number):
                return known
        self._known.append(layered_connections(number))
        return self._known[-1]


def assembled(parts: Sequence[Part], T: sparse.csr_array) -> sparse.csr_array:
    """T^T (sum of the parts) T (n_dof, n_dof) [N/m or kg], with parts on raw dofs and T (n_raw, n_dof)."""
    return Assembler(T).total(parts)


def _shifted(matrix: sparse.csr_array, step: int) -> sparse.csr_array:
    """The matrix with every row and column number raised by step; its last rows are empty."""
    if step == 0:
        return matrix
    indptr = np.concatenate([np.zeros(step, matrix.indptr.dtype), matrix.indptr[: len(matrix.indptr) - step]])
    indices = matrix.indices + matrix.indices.dtype.type(step)
    return sparse.csr_array((matrix.data, indices, indptr), shape=matrix.shape)


def _added(a: sparse.csr_array, b: sparse.csr_array) -> sparse.csr_array:
    if a.nnz == 0 or b.nnz == 0:
        return b if a.nnz == 0 else a
    return a + b
