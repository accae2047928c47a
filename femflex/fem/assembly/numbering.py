"""Numbering of raw degrees of freedom while members are added, and the map to the independent ones.

Members ask for dofs node by node: translations, rotations (three global components each) and extra dofs that belong
to no single node (bubbles, edge and twist dofs). A node that only flat plates of one plane share has no stiffness
about its normal; its rotation is then restricted to the plane, so that M and K stay regular. raw = T independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
Index = NDArray[np.int64]

RANK_TOLERANCE = 1e-6  # sine of the fold angle below which two plate facets count as one plane
COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")  # of a node: three translations, three rotations


@dataclass(frozen=True, eq=False)
class _Extra:
    """Extra dofs (count,), the nodes (count, k) each lies on, what clamps them, and the axes (count, 3) they use."""

    dofs: Index
    nodes: Index
    kind: str
    axes: NDArray[np.bool_]


class Numbering:
    """Hands out raw dof numbers; the same node always gets the same numbers."""

    def __init__(self, n_nodes: int) -> None:
        self._translation = np.full((n_nodes, 3), -1, np.int64)
        self._rotation = np.full((n_nodes, 3), -1, np.int64)
        self._spin_space = np.zeros((n_nodes, 3, 3))  # sum of projectors on the directions members stiffen
        self._extras: list[_Extra] = []
        self._ties: dict[int, tuple[int, float]] = {}  # raw dof -> the one it follows and its factor; 0 holds it
        self.n_raw = 0

    def translation(self, nodes: Index) -> Index:
        """Raw dofs (k, 3) of the translation of nodes (k,), global components."""
        return self._numbers(self._translation, nodes)

    def rotation(self, nodes: Index, normals: Array | None = None) -> Index:
        """Raw dofs (k, 3) of the rotation of nodes (k,), global components.

        normals (k, 3), unit: the member gives no stiffness about them (flat plates). None: stiffness about all axes.
        """
        projector = np.eye(3) if normals is None else np.eye(3) - normals[:, :, None] * normals[:, None, :]
        np.add.at(self._spin_space, nodes, projector)
        return self._numbers(self._rotation, nodes)

    def extra(
        self,
        count: int,
        nodes: Index | None = None,
        kind: Literal["translation", "rotation"] = "translation",
        directions: Array | None = None,
    ) -> Index:
        """Raw dofs (count,) that belong to no single node.

        nodes (count, k): the nodes each dof lies on; it is clamped when all of them are. Without nodes it never is.
        kind: a "translation" is fixed where the group's three translations are (bubbles, edge displacements), a
        "rotation" only where its rotations are too (edge slopes, twists).
        directions (count, 3): unit vectors that translations move along; the axes they have a part in must be held,
        and need not be all three.
        """
        dofs = self._take(count)
        if nodes is not None:
            axes = np.ones((count, 3), bool) if directions is None else np.abs(directions) > RANK_TOLERANCE
            self._extras.append(_Extra(dofs, np.asarray(nodes, np.int64).reshape(count, -1), kind, axes))
        return dofs

    def tie(self, first: int, second: int, factor: float) -> None:
        """Ties two raw dofs: the second is factor (not 0) times the first. Where ties contradict, both stay zero."""
        (a, p), (b, q) = self._followed(first), self._followed(second)
        if a != b and p and q:
            self._ties[b] = a, factor * p / q
        elif a != b or p * factor != q:
            self._ties |= {a: (a, 0.0), b: (b, 0.0)}

    def _followed(self, dof: int) -> tuple[int, float]:
        """The dof that one follows in the end, itself if none, and its factor; 0 where it is held."""
        factor = 1.0
        while factor and dof in self._ties:
            dof, part = self._ties[dof]
            factor *= part
        return dof, factor

    def translation_of(self, nodes: Index) -> Index:
        """Raw dofs (k, 3) that members already gave the translation of nodes (k,); -1 where none did."""
        return self._translation[nodes]

    def rotation_of(self, nodes: Index) -> Index:
        """Raw dofs (k, 3) that members already gave the rotation of nodes (k,); -1 where none did."""
        return self._rotation[nodes]

    def independent(self) -> sparse.csr_array:
        """T (n_raw, n_dof): raw dofs from the independent ones."""
        nodes = np.flatnonzero(self._rotation[:, 0] >= 0)
        value, axes = np.linalg.eigh(self._spin_space[nodes])
        flat = value[:, 0] < RANK_TOLERANCE**2 * value[:, 2]
        keep = np.ones(self.n_raw, bool)
        dropped = self._rotation[nodes[flat]]
        keep[dropped.ravel()] = False
        keep[list(self._ties)] = False
        number = np.cumsum(keep) - 1
        rows, cols = [np.flatnonzero(keep)], [number[keep]]
        values = [np.ones(int(keep.sum()))]
        n_dof = int(keep.sum())
        for place, j in enumerate(
            (2, 1)
        ):  # the two stiffened directions of each flat node; in the xy plane x comes last
            rows.append(dropped.ravel())
            cols.append(np.repeat(n_dof + np.arange(len(dropped)) * 2 + place, 3))
            values.append(axes[flat, :, j].ravel())
        n_dof += 2 * len(dropped)
        tied = [(dof, *self._followed(dof)) for dof in self._ties]
        rows.append(np.array([dof for dof, _, _ in tied], np.int64))
        cols.append(number[[first for _, first, _ in tied]] if tied else np.zeros(0, np.int64))
        values.append(np.array([factor for _, _, factor in tied]))
        triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(cols)))
        T = sparse.coo_array(triplets, shape=(self.n_raw, n_dof)).tocsr()
        T.eliminate_zeros()  # a dof counts as a rotation about an axis only when it has a part in it
        return T

    def raw_dofs_on(self, nodes: Index, components: Sequence[str] = COMPONENTS) -> Index:
        """Raw dofs that the named components of nodes (k,) carry, with the extra dofs lying wholly on these nodes."""
        unknown = [c for c in components if c not in COMPONENTS]
        if unknown:
            raise ValueError(f"components {unknown} are not of a node; name some of {list(COMPONENTS)}")
        nodal = np.concatenate([self._translation[nodes], self._rotation[nodes]], axis=1)
        found = [nodal[:, [COMPONENTS.index(c) for c in components]].ravel()]
        on = np.zeros(len(self._translation), bool)
        on[nodes] = True
        free = np.array([c not in components for c in "xyz"])
        every = set(COMPONENTS) <= set(components)
        for e in self._extras:
            held = ~(e.axes & free).any(axis=1) & (every or e.kind == "translation")
            found.append(e.dofs[held & on[e.nodes].all(axis=1)])
        dofs = np.concatenate(found)
        return np.unique(dofs[dofs >= 0])

    def node_rows(self, n_raw: int) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Operators (3 n_nodes, n_raw) that give every node's translation and rotation; zero rows where it has none."""
        return _rows(self._translation, n_raw), _rows(self._rotation, n_raw)

    def _numbers(self, table: Index, nodes: Index) -> Index:
        fresh = np.unique(nodes[table[nodes, 0] < 0])
        table[fresh] = self._take(3 * len(fresh)).reshape(-1, 3)
        return table[nodes]

    def _take(self, count: int) -> Index:
        start, self.n_raw = self.n_raw, self.n_raw + count
        return np.arange(start, self.n_raw, dtype=np.int64)


def _rows(table: Index, n_raw: int) -> sparse.csr_array:
    flat = table.ravel()
    rows = np.flatnonzero(flat >= 0)
    return sparse.coo_array((np.ones(len(rows)), (rows, flat[rows])), shape=(flat.size, n_raw)).tocsr()
