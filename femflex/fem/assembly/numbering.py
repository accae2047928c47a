"""Numbering of raw degrees of freedom while members are added, and the map to the independent ones.

Members ask for dofs node by node: translations, rotations (three global components each) and extra dofs that belong
to no single node (bubbles, edge and twist dofs). A node that only flat plates of one plane share has no stiffness
about its normal; its rotation is then restricted to the plane, so that M and K stay regular. raw = T independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.assembly.conditions import Condition
from femflex.fem.assembly.dependence import Dependence, independent_of
from femflex.fem.assembly.layout import Extras, Layout, layout

if TYPE_CHECKING:
    from femflex.fem.structure import Member


RANK_TOLERANCE = 1e-6  # sine of the fold angle below which two plate facets count as one plane


class Numbering:
    """Assigns numbers to raw dofs; the same node always gets the same numbers."""

    def __init__(self, n_nodes: int, members: Sequence[Member] = ()) -> None:
        self.members = tuple(members)  # all members of the structure: elements may depend on their neighbours
        self._translation = np.full((n_nodes, 3), -1, np.int64)
        self._rotation = np.full((n_nodes, 3), -1, np.int64)
        self._spin_space = np.zeros((n_nodes, 3, 3))  # sum of projectors on the directions members stiffen
        self._extras: list[Extras] = []
        self._dependences: list[Dependence] = []
        self._ties: dict[int, tuple[int, float]] = {}  # raw dof -> the one it follows, and its factor (0: it is zero)
        self._sides: dict[tuple[int, int], IntArray] = {}  # side between two nodes -> raw dofs (3,) of its displacement
        self._fading: list[IntArray] = []
        self.n_raw = 0

    def translation(self, nodes: IntArray) -> IntArray:
        """Numbers (k, 3) of raw dofs of the translation of nodes (k,), global components."""
        return self._numbers(self._translation, nodes)

    def rotation(self, nodes: IntArray, normals: Array | None = None) -> IntArray:
        """Raw dofs (k, 3) of the rotation of nodes (k,), global components.

        normals (k, 3), unit: the member gives no stiffness about them (flat plates). None: stiffness about all axes.
        """
        projector = np.eye(3) if normals is None else np.eye(3) - normals[:, :, None] * normals[:, None, :]
        np.add.at(self._spin_space, nodes, projector)
        return self._numbers(self._rotation, nodes)

    def extra(self, count: int) -> IntArray:
        """Numbers (n,) of raw dofs that belong to no single node; no support holds them before they are `attach`ed."""
        return self._next_numbers(count)

    def sides(self, ends: IntArray) -> IntArray:
        """Raw dofs (k, 3), global components, of the displacement 4 s (1 - s) b of straight sides with ends (k, 2).

        Tethers and membranes share them: the same pair of nodes always gets the same numbers.
        """
        pairs = [(int(a), int(b)) for a, b in np.sort(ends, axis=1)]
        fresh = list(dict.fromkeys(pair for pair in pairs if pair not in self._sides))
        if fresh:
            self._sides |= zip(fresh, self.fading(np.array(fresh, np.int64), 1)[:, 0], strict=True)
        return np.array([self._sides[pair] for pair in pairs], np.int64).reshape(-1, 3)

    def fading(self, nodes: IntArray, count: int) -> IntArray:
        """Raw dofs (n, count, 3), global components, of functions that vanish at nodes (n, m); all are zero where the
        element moves linearly with these nodes."""
        dofs = self.extra(3 * count * len(nodes)).reshape(len(nodes), count, 3)
        for k in range(count):
            self.attach(dofs[:, k], nodes, np.broadcast_to(np.eye(3), (len(nodes), 3, 3)))
        self._fading.append(dofs.ravel())
        return dofs

    @property
    def fading_dofs(self) -> IntArray:
        """Numbers (k,) of the raw dofs that `fading` assigned."""
        return np.concatenate([np.zeros(0, np.int64), *self._fading])

    def attach(
        self,
        dofs: IntArray,
        nodes: IntArray,
        directions: Array | None = None,
        kind: Literal["translation", "rotation"] = "translation",
        spans: Array | None = None,
    ) -> None:
        """Record the nodes (n, m) between which extra dofs (n, k) fade, so that supports of all these nodes act on
        them.

        kind        they are components of a displacement (bubbles, sides) or of a turn (twists)
        directions  (n, k, 3) unit vectors that they act along; None: along all, so that only a full support holds them
        spans       (n, 3) from the first node to the second, of sides of plates, which deflect as their nodes turn
        """
        self._extras.append(Extras(np.asarray(dofs), np.asarray(nodes), kind, directions, spans))

    def tie(self, first: int, second: int, factor: float) -> None:
        """Tie two raw dofs: the second is factor (not 0) times the first. Where ties contradict each other, both stay
        zero."""
        (a, p), (b, q) = self._leader(first), self._leader(second)
        if a != b and p and q:
            self._ties[b] = a, factor * p / q
        elif a != b or p * factor != q:
            self._ties |= {a: (a, 0.0), b: (b, 0.0)}

    def connect(self, dependences: Sequence[Dependence]) -> None:
        """Add vectors of raw dofs that follow others."""
        self._dependences += dependences

    def _leader(self, dof: int) -> tuple[int, float]:
        """Return the dof that this one follows in the end (itself if none) and the factor, which is 0 for a dof that is
        zero."""
        factor = 1.0
        while factor and dof in self._ties:
            dof, ratio = self._ties[dof]
            factor *= ratio
        return dof, factor

    def translation_of(self, nodes: IntArray) -> IntArray:
        """Numbers (k, 3) of raw dofs that members already gave the translation of nodes (k,); -1 where none did."""
        return self._translation[nodes]

    def rotation_of(self, nodes: IntArray) -> IntArray:
        """Raw dofs (k, 3) that members already gave the rotation of nodes (k,); -1 where none did."""
        return self._rotation[nodes]

    def turns_about_all_axes(self, dofs: IntArray) -> BoolArray:
        """Whether the nodes with these first rotational dofs (...) rotate about all axes, not only in a plane."""
        flat = np.zeros(self.n_raw, bool)
        flat[self._rotation[self._flat_nodes()[0], 0]] = True
        return np.asarray(~flat[dofs])

    def layout(self, supports: Sequence[Condition] = ()) -> Layout:
        """Return the layout of the raw dofs along the axes of supports."""
        nodes, axes = self._flat_nodes()
        return layout(self.n_raw, self._translation, self._rotation, (nodes, axes), self._extras, supports)

    def independent(self, supports: Sequence[Condition] = ()) -> sparse.csr_array:
        """T (n_raw, n_dof) [1]: raw dofs from the independent ones, which lie along the axes of these supports."""
        dropped = self._rotation[self._flat_nodes()[0]]
        keep = np.ones(self.n_raw, bool)
        keep[dropped.ravel()] = False
        keep[list(self._ties)] = False
        number = np.cumsum(keep) - 1
        n_dof = int(keep.sum())
        tied = [(dof, *self._leader(dof)) for dof in self._ties]
        rows = [np.flatnonzero(keep), dropped[:, :2].ravel(), np.array([dof for dof, _, _ in tied], np.int64)]
        cols = [number[keep], n_dof + np.arange(2 * len(dropped))]  # two directions in the plane of each flat node
        cols.append(number[[first for _, first, _ in tied]] if tied else np.zeros(0, np.int64))
        values = [np.ones(n_dof + 2 * len(dropped)), np.array([factor for _, _, factor in tied])]
        triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(cols)))
        selection = sparse.coo_array(triplets, shape=(self.n_raw, n_dof + 2 * len(dropped))).tocsr()
        T = (self.layout(supports).E @ selection).tocsr()
        T.eliminate_zeros()
        T.sort_indices()
        return independent_of(T, self._dependences)

    def _flat_nodes(self) -> tuple[IntArray, Array]:
        """Nodes (k,) that only flat plates of one plane share; two axes in it and its normal (k, 3, 3), as rows."""
        nodes = np.flatnonzero(self._rotation[:, 0] >= 0)
        value, axes = np.linalg.eigh(self._spin_space[nodes])
        flat = value[:, 0] < RANK_TOLERANCE**2 * value[:, 2]
        return nodes[flat], axes[flat][:, :, ::-1].swapaxes(1, 2)  # eigh gives x last in the xy plane

    def node_rows(self, n_raw: int) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Operators (3 n_nodes, n_raw) that give every node's translation and rotation; zero rows where it has none."""
        return _rows(self._translation, n_raw), _rows(self._rotation, n_raw)

    def _numbers(self, table: IntArray, nodes: IntArray) -> IntArray:
        fresh = np.unique(nodes[table[nodes, 0] < 0])
        table[fresh] = self._next_numbers(3 * len(fresh)).reshape(-1, 3)
        return table[nodes]

    def _next_numbers(self, count: int) -> IntArray:
        start, self.n_raw = self.n_raw, self.n_raw + count
        return np.arange(start, self.n_raw, dtype=np.int64)


def _rows(table: IntArray, n_raw: int) -> sparse.csr_array:
    flat = table.ravel()
    rows = np.flatnonzero(flat >= 0)
    return sparse.coo_array((np.ones(len(rows)), (rows, flat[rows])), shape=(flat.size, n_raw)).tocsr()
