"""Element matrices on the independent dofs, where rotations of nodes lie in a plane.

Three raw rotations of a node of a smooth shell follow two independent ones, theta = B beta. Computed element by
element, B^T K B costs little; as a product of sparse matrices it took as long as the element matrices themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.element_matrices import ElementMatrices

MOST = 0.5  # share of elements that rotate a node in a plane, above which its columns are transformed per element
GAP = 4  # number of omitted elements in between, up to which those on both sides are computed together


class SplitPart(NamedTuple):
    """The share of a part on independent dofs, and the rest on raw ones; None where there is none."""

    independent: ElementMatrices | None
    raw: ElementMatrices | None


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

    def split_part(self, part: ElementMatrices) -> SplitPart:
        """Split off the elements of a part on raw dofs whose dofs are equal to independent ones or follow pairs."""
        dofs = part.dofs
        if not dofs.size:
            return SplitPart(part, None)
        single = self.number[dofs] >= 0
        if single.all():
            return SplitPart(ElementMatrices(self.number[dofs], part.values), None)
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
            return SplitPart(None, rest)
        narrow_part = part if rest is None else _of_elements(part, narrow)
        if not len(triples):
            return SplitPart(ElementMatrices(self.number[narrow_part.dofs], narrow_part.values), rest)
        return SplitPart(self._on_pairs(narrow_part, np.flatnonzero(~inside), triples), rest)

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
