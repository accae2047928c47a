"""Sparse sums of element matrices.

The sparsity pattern is derived from runs of dofs that always come together (the three translations of a node), which
are few, and is stored as a complete CSR matrix. The element matrices are then computed chunk by chunk and added in
place, so that no list of triplets has to be stored. The connections of the runs are computed once for all matrices on
the same elements.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from femflex.arrays import IntArray
from femflex.fem.assembly.connections import Connections, find_connections_by_layer
from femflex.fem.assembly.element_matrices import ElementMatrices
from femflex.fem.assembly.narrowing import find_narrowing
from femflex.fem.assembly.pattern import Pattern, expand_offsets, pattern
from femflex.fem.assembly.runs import find_runs

CHUNK_ENTRIES = 400_000  # entries of element matrices made at once: small enough to stay in cache (3 MB)


class Assembler:
    """Assembles element matrices on raw dofs, which T (n_raw, n_dof) gives from the independent ones."""

    def __init__(self, T: sparse.csr_array) -> None:
        self._T = T.copy()
        self._T.eliminate_zeros()
        self._narrowing = find_narrowing(self._T)
        self._empty = np.diff(self._T.indptr) == 0  # raw dofs that depend on no independent dof
        self._known_connections: list[Connections] = []
        self._patterns: list[Pattern] = []

    def total(self, parts: Sequence[ElementMatrices]) -> sparse.csr_array:
        """T^T (sum of the parts) T (n_dof, n_dof) [N/m or kg in rows of translations], without entries that are zero.

        Elements whose raw dofs are independent ones by another number, or rotations in a plane, go straight to their
        places (`femflex.fem.assembly.narrowing`).
        """
        n_raw, n_dof = self._T.shape
        direct, reduced = sparse.csr_array((n_dof, n_dof)), sparse.csr_array((n_raw, n_raw))
        for part in parts:
            independent, raw = self._narrowing.split_part(self._without_unused_columns(part))
            if independent is not None:
                direct = _add(direct, self._sum(independent, n_dof))
            if raw is not None:
                reduced = _add(reduced, self._sum(raw, n_raw))
        if reduced.nnz:
            direct = _add(direct, (self._T.T.tocsr() @ (reduced @ self._T)).tocsr())
        direct.sort_indices()
        if direct.nnz > np.count_nonzero(direct.data):
            direct = direct.copy()  # its pattern may belong to another matrix too
            direct.eliminate_zeros()
        return direct

    def _without_unused_columns(self, part: ElementMatrices) -> ElementMatrices:
        """Return the part without the columns of dofs that are always zero, such as the rotation of a flat plate about
        its normal."""
        unused = self._empty[part.dofs].all(axis=0)
        if part.dofs.ndim == 3 or not unused.any():
            return part
        kept = np.flatnonzero(~unused)
        return ElementMatrices(part.dofs[:, kept], lambda elements: part.values(elements)[:, kept[:, None], kept])

    def _sum(self, part: ElementMatrices, n: int) -> sparse.csr_array:
        """Sparse sum (n, n) of the part's element matrices, indices sorted."""
        if not part.dofs.size:
            return sparse.csr_array((n, n))
        if part.dofs.ndim == 3:
            return self._repeated(part, n)
        pattern_of_part = self._pattern(part.dofs, n)
        data = np.zeros(len(pattern_of_part.indices))
        start = pattern_of_part.indptr[part.dofs]
        step = max(1, CHUNK_ENTRIES // part.dofs.shape[1] ** 2)
        for begin in range(0, len(part.dofs), step):
            chunk = slice(begin, begin + step)
            position = start[chunk, :, None] + expand_offsets(pattern_of_part.offset[chunk], pattern_of_part.runs)
            np.add.at(data, position.ravel(), np.ascontiguousarray(part.values(chunk)).ravel())
        return sparse.csr_array((data, pattern_of_part.indices, pattern_of_part.indptr), shape=(n, n))

    def _repeated(self, part: ElementMatrices, n: int) -> sparse.csr_array:
        """Sum a part that is alike on all components; it is assembled once where these are numbered in a row."""
        dofs = part.dofs
        shift = dofs - dofs[:, :, :1]
        steps = shift[0, 0]
        if (shift == steps).all():
            component = self._sum(ElementMatrices(dofs[:, :, 0], part.values), n)
            components = [_shifted(component, int(step)) for step in steps]
        else:
            components = [self._sum(ElementMatrices(dofs[:, :, c], part.values), n) for c in range(dofs.shape[2])]
        total = components[0]
        for matrix in components[1:]:
            total = _add(total, matrix)
        return total

    def _pattern(self, dofs: IntArray, n: int) -> Pattern:
        for existing in self._patterns:
            if (
                len(existing.indptr) == n + 1
                and existing.dofs.shape == dofs.shape
                and np.array_equal(existing.dofs, dofs)
            ):
                return existing
        runs = find_runs(dofs, n)
        self._patterns.append(pattern(dofs, runs, self._connections(runs.number), n))
        return self._patterns[-1]

    def _connections(self, number: IntArray) -> Connections:
        for existing in self._known_connections:
            if existing.number.shape == number.shape and np.array_equal(existing.number, number):
                return existing
        self._known_connections.append(find_connections_by_layer(number))
        return self._known_connections[-1]


def assemble(parts: Sequence[ElementMatrices], T: sparse.csr_array) -> sparse.csr_array:
    """T^T (sum of the parts) T (n_dof, n_dof) [N/m or kg], with parts on raw dofs and T (n_raw, n_dof)."""
    return Assembler(T).total(parts)


def _shifted(matrix: sparse.csr_array, step: int) -> sparse.csr_array:
    """The matrix with every row and column number raised by step; its last rows are empty."""
    if step == 0:
        return matrix
    indptr = np.concatenate([np.zeros(step, matrix.indptr.dtype), matrix.indptr[: len(matrix.indptr) - step]])
    indices = matrix.indices + matrix.indices.dtype.type(step)
    return sparse.csr_array((matrix.data, indices, indptr), shape=matrix.shape)


def _add(a: sparse.csr_array, b: sparse.csr_array) -> sparse.csr_array:
    if a.nnz == 0 or b.nnz == 0:
        return b if a.nnz == 0 else a
    return a + b
