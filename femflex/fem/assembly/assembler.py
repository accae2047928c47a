"""Sparse sums of element matrices.

The sparsity pattern is derived from runs of dofs that always come together (the three translations of a node), which
are few, and is stored as a complete CSR matrix. The element matrices are then computed chunk by chunk and added in
place, so that no list of triplets has to be stored. The connections of the runs are computed once for all matrices on
the same elements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.pattern import (
    Connections,
    ElementMatrices,
    Pattern,
    expand_offsets,
    find_connections_by_layer,
    find_runs,
    pattern,
)

CHUNK_ENTRIES = 400_000  # entries of element matrices made at once: small enough to stay in cache (3 MB)
MOST = 0.5  # share of elements that rotate a node in a plane, above which its columns are transformed per element
GAP = 4  # number of omitted elements in between, up to which those on both sides are computed together


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
        places (`femflex.fem.assembly.assembler`).
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


# Element matrices on the independent dofs, where rotations of nodes lie in a plane.
#
# Three raw rotations of a node of a smooth shell follow two independent ones, theta = B beta. Computed element by
# element, B^T K B costs little; as a product of sparse matrices it took as long as the element matrices themselves.


Split = tuple[ElementMatrices | None, ElementMatrices | None]  # on independent dofs, and the rest on raw ones


@dataclass(frozen=True, eq=False)
class Narrowing:
    """The relation of raw dofs to independent ones where it is an equality or a rotation in a plane.

    number  (n_raw,)       the independent dof that a raw one is equal to, or -1
    pair    (n_raw,)       the first of the two dofs in a row that a raw dof and the two after it follow, or -1
    axes    (n_raw, 3, 2)  how they follow them; zero where there is no pair
    """

    number: IntArray
    pair: IntArray
    axes: Array

    def split_part(self, part: ElementMatrices) -> Split:
        """Split off the elements of a part on raw dofs whose dofs are equal to independent ones or follow pairs."""
        dofs = part.dofs
        if not dofs.size:
            return part, None
        single = self.number[dofs] >= 0
        if single.all():
            return ElementMatrices(self.number[dofs], part.values), None
        triples = self._triples(dofs) if dofs.ndim == 2 else np.zeros(0, np.int64)
        inside = np.zeros(dofs.shape[1], bool)
        inside[(triples[:, None] + np.arange(3)).ravel()] = True
        paired = self.pair[dofs[:, triples]] >= 0
        follows = np.array([fits.all(axis=tuple(range(1, fits.ndim))) for fits in (single[:, ~inside], paired)]).all(
            axis=0
        )
        narrow, other = np.flatnonzero(follows), np.flatnonzero(~follows)
        rest = _of_elements(part, other) if len(other) else None
        if not len(narrow):
            return None, rest
        narrow_part = part if rest is None else _of_elements(part, narrow)
        if not len(triples):
            return ElementMatrices(self.number[narrow_part.dofs], narrow_part.values), rest
        return self._on_pairs(narrow_part, np.flatnonzero(~inside), triples), rest

    def _triples(self, dofs: IntArray) -> IntArray:
        """First columns (t,) of three that follow pairs in most elements (e, l)."""
        row = (np.diff(dofs, axis=1) == 1).all(axis=0)
        columns, column = [], 0
        share = (self.pair[dofs] >= 0).mean(axis=0)
        while column < dofs.shape[1] - 2:
            step = bool(row[column] and row[column + 1] and share[column] > MOST)
            if step:
                columns.append(column)
            column += 3 if step else 1
        return np.array(columns, np.int64)

    def _on_pairs(self, part: ElementMatrices, plain: IntArray, triples: IntArray) -> ElementMatrices:
        """The part on its plain columns and, for each triple, on the two dofs it follows."""
        first = self.pair[part.dofs[:, triples]]
        pairs = np.stack([first, first + 1], axis=2).reshape(len(first), -1)
        kept = slice(int(plain[0]), int(plain[-1]) + 1) if len(plain) and np.ptp(plain) < len(plain) else plain
        n, t = len(plain), len(triples)
        m = n + 2 * t
        # translations and rotations of the same nodes: next to each other they assemble in layers
        with_translations = n == 3 * t
        column = np.arange(m)
        if with_translations:
            column = np.concatenate([column[:n].reshape(t, 3), column[n:].reshape(t, 2)], axis=1).ravel()
        position = np.argsort(column)

        def values(elements: slice) -> Array:
            K, B = part.values(elements), self.axes[part.dofs[elements][:, triples]]  # (k, t, 3, 2)
            e, l = K.shape[:2]
            wide = np.empty((e, l, m))
            wide[:, :, position[:n]] = K[:, :, kept]
            rotated = K[:, :, triples, None] * B[:, None, :, 0]
            for c in (1, 2):
                rotated += K[:, :, triples + c, None] * B[:, None, :, c]
            wide[:, :, position[n:]] = rotated.reshape(e, l, -1)
            narrow = np.empty((e, m, m))
            narrow[:, position[:n]] = wide[:, kept]
            rotated = wide[:, triples, None] * B[:, :, 0, :, None]
            for c in (1, 2):
                rotated += wide[:, triples + c, None] * B[:, :, c, :, None]
            narrow[:, position[n:]] = rotated.reshape(e, -1, m)
            return narrow

        dofs = np.concatenate([self.number[part.dofs[:, plain]], pairs], axis=1)
        return ElementMatrices(dofs[:, column], values)


def find_narrowing(T: sparse.csr_array) -> Narrowing:
    """Return the relation of raw dofs to independent ones by T (n_raw, n_dof) [1 or m], which has no stored zeros."""
    n = T.shape[0]
    count = np.diff(T.indptr)
    single = np.flatnonzero(count == 1)
    entry = T.indptr[single]
    equal = T.data[entry] == 1.0
    number = np.full(n, -1, np.int64)
    number[single[equal]] = T.indices[entry[equal]]
    low, high = np.full(n + 2, T.shape[1] + 2, np.int64), np.full(n + 2, -1, np.int64)
    rows = np.repeat(np.arange(n), count)
    np.minimum.at(low, rows, T.indices)
    np.maximum.at(high, rows, T.indices)
    low3 = np.minimum(np.minimum(low[:-2], low[1:-1]), low[2:])
    high3 = np.maximum(np.maximum(high[:-2], high[1:-1]), high[2:])
    pair = np.where(high3 == low3 + 1, low3, -1)
    pair[max(n - 2, 0) :] = -1
    axes = np.zeros((n, 3, 2))
    for c in range(3):
        valid = rows >= c
        start, column, value = rows[valid] - c, T.indices[valid], T.data[valid]
        paired = pair[start] >= 0
        axes[start[paired], c, column[paired] - pair[start[paired]]] = value[paired]
    return Narrowing(number, pair, axes)


def _of_elements(part: ElementMatrices, elements: IntArray) -> ElementMatrices:
    """The part of these elements alone, ascending."""

    def values(chunk: slice) -> Array:
        numbers = elements[chunk]
        runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > GAP) + 1)
        return np.concatenate([part.values(slice(int(run[0]), int(run[-1]) + 1))[run - run[0]] for run in runs])

    return ElementMatrices(part.dofs[elements], values)
