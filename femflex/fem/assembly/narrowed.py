"""Element matrices on the independent dofs, where rotations of nodes lie in a plane.

Three raw rotations of a node of a smooth shell follow two independent ones, theta = B beta. Turned element by element,
B^T K B costs little; as a product of sparse matrices it took as long as the element matrices themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.part import Part

MOST = 0.5  # share of elements that turn a node in a plane, from which its columns are turned element by element
GAP = 4  # elements that are left out in between, up to which those on both sides are made together


class Split(NamedTuple):
    """What of a part is on independent dofs, and the rest, on raw ones; None where there is nothing."""

    near: Part | None
    far: Part | None


@dataclass(frozen=True, eq=False)
class Narrowing:
    """How raw dofs follow independent ones.

    number  (n_raw,)       the independent dof that a raw one is equal to, or -1
    pair    (n_raw,)       the first of the two dofs in a row that a raw dof and the two after it follow, or -1
    axes    (n_raw, 3, 2)  how they follow them; zero where there is no pair
    """

    number: IntArray
    pair: IntArray
    axes: Array

    def split(self, part: Part) -> Split:
        """The elements of a part on raw dofs whose dofs are equal to independent ones or follow pairs, and the rest."""
        dofs = part.dofs
        if not dofs.size:
            return Split(part, None)
        single = self.number[dofs] >= 0
        if single.all():
            return Split(Part(self.number[dofs], part.values), None)
        triples = self._triples(dofs) if dofs.ndim == 2 else np.zeros(0, np.int64)
        inside = np.zeros(dofs.shape[1], bool)
        inside[(triples[:, None] + np.arange(3)).ravel()] = True
        paired = self.pair[dofs[:, triples]] >= 0
        good = np.array([part.all(axis=tuple(range(1, part.ndim))) for part in (single[:, ~inside], paired)]).all(
            axis=0
        )
        near, far = np.flatnonzero(good), np.flatnonzero(~good)
        rest = _chosen(part, far) if len(far) else None
        if not len(near):
            return Split(None, rest)
        own = part if rest is None else _chosen(part, near)
        if not len(triples):
            return Split(Part(self.number[own.dofs], own.values), rest)
        return Split(self._turned(own, np.flatnonzero(~inside), triples), rest)

    def _triples(self, dofs: IntArray) -> IntArray:
        """First columns (t,) of three that follow pairs in most elements (e, l)."""
        row = (np.diff(dofs, axis=1) == 1).all(axis=0)
        found, column = [], 0
        share = (self.pair[dofs] >= 0).mean(axis=0)
        while column < dofs.shape[1] - 2:
            step = bool(row[column] and row[column + 1] and share[column] > MOST)
            if step:
                found.append(column)
            column += 3 if step else 1
        return np.array(found, np.int64)

    def _turned(self, part: Part, plain: IntArray, triples: IntArray) -> Part:
        """The part on its plain columns and, for each triple, on the two dofs it follows."""
        first = self.pair[part.dofs[:, triples]]
        pairs = np.stack([first, first + 1], axis=2).reshape(len(first), -1)
        kept = slice(int(plain[0]), int(plain[-1]) + 1) if len(plain) and np.ptp(plain) < len(plain) else plain
        n, t = len(plain), len(triples)
        m = n + 2 * t
        both = n == 3 * t  # translations and rotations of the same nodes: next to each other they assemble in layers
        column = np.arange(m)
        if both:
            column = np.concatenate([column[:n].reshape(t, 3), column[n:].reshape(t, 2)], axis=1).ravel()
        place = np.argsort(column)

        def values(elements: slice) -> Array:
            K, B = part.values(elements), self.axes[part.dofs[elements][:, triples]]  # (k, t, 3, 2)
            e, l = K.shape[:2]
            wide = np.empty((e, l, m))
            wide[:, :, place[:n]] = K[:, :, kept]
            turned = K[:, :, triples, None] * B[:, None, :, 0]
            for c in (1, 2):
                turned += K[:, :, triples + c, None] * B[:, None, :, c]
            wide[:, :, place[n:]] = turned.reshape(e, l, -1)
            found = np.empty((e, m, m))
            found[:, place[:n]] = wide[:, kept]
            turned = wide[:, triples, None] * B[:, :, 0, :, None]
            for c in (1, 2):
                turned += wide[:, triples + c, None] * B[:, :, c, :, None]
            found[:, place[n:]] = turned.reshape(e, -1, m)
            return found

        dofs = np.concatenate([self.number[part.dofs[:, plain]], pairs], axis=1)
        return Part(dofs[:, column], values)


def narrowing(T: sparse.csr_array) -> Narrowing:
    """How raw dofs follow the independent ones by T (n_raw, n_dof) [1 or m], which has no stored zeros."""
    n = T.shape[0]
    count = np.diff(T.indptr)
    single = np.flatnonzero(count == 1)
    entry = T.indptr[single]
    same = T.data[entry] == 1.0
    number = np.full(n, -1, np.int64)
    number[single[same]] = T.indices[entry[same]]
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
        own = rows >= c
        start, column, value = rows[own] - c, T.indices[own], T.data[own]
        at = pair[start] >= 0
        axes[start[at], c, column[at] - pair[start[at]]] = value[at]
    return Narrowing(number, pair, axes)


def _chosen(part: Part, elements: IntArray) -> Part:
    """The part of these elements alone, ascending."""

    def values(few: slice) -> Array:
        own = elements[few]
        runs = np.split(own, np.flatnonzero(np.diff(own) > GAP) + 1)
        return np.concatenate([part.values(slice(int(run[0]), int(run[-1]) + 1))[run - run[0]] for run in runs])

    return Part(part.dofs[elements], values)
