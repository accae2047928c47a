"""Nodes whose components follow linear combinations of components of others: the general multi-point constraint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import only_node
from femflex.fem.support import COMPONENTS, GLOBAL, Rows, Support
from femflex.mesh import Mesh


@dataclass(frozen=True, eq=False)
class MultiPointConstraint:
    """Components of one node follow those of others: u_c = sum over leaders of matrix_c @ (u, theta of the leader).

    group       of the one node that follows
    components  (k,) of "x", "y", "z", "rx", "ry", "rz" that follow, along the rows of `axes`
    leaders     (n,) groups of one node each; the node that follows may be one of them, by its other components
    matrix      (k, 6 n) factors of the leaders' translations and rotations, mesh axes
    axes        (3, 3) rows: directions of x, y, z in mesh axes
    name        for messages
    """

    group: str
    components: tuple[str, ...]
    leaders: tuple[str, ...]
    matrix: ArrayLike
    axes: Rows = GLOBAL
    name: str = ""

    def __post_init__(self) -> None:
        Support(self.components, self.axes)  # checks both
        matrix = np.asarray(self.matrix, float)
        if matrix.shape != (len(self.components), 6 * len(self.leaders)) or not np.isfinite(matrix).all():
            raise ValueError(
                f"{self._label()} has a matrix of shape {matrix.shape}; {len(self.components)} components and "
                f"{len(self.leaders)} leaders need {(len(self.components), 6 * len(self.leaders))} finite numbers"
            )

    def with_reference_node(self, mesh: Mesh) -> Mesh:
        """See Connection."""
        return mesh

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """See Connection. Rotations of leaders that no member gives them count as zero."""
        matrix = np.asarray(self.matrix, float).reshape(len(self.components), -1, 2, 3)
        sources, factors = [np.zeros(0, np.int64)], [np.zeros((len(self.components), 0))]
        for k, leader in enumerate(self.leaders):
            leader_node = np.array([only_node(mesh, leader, self._label())])
            for kind in (0, 1):
                if not matrix[:, k, kind].any():
                    continue
                dofs = (numbering.translation_of, numbering.rotation_of)[kind](leader_node)[0]
                if dofs[0] < 0 and kind == 0:
                    dofs = numbering.translation(leader_node)[0]
                if dofs[0] >= 0:
                    sources.append(dofs)
                    factors.append(matrix[:, k, kind])
        source, F = np.concatenate(sources), np.concatenate(factors, axis=1)
        follower, dependences = np.array([only_node(mesh, self.group, self._label())]), []
        rows = np.asarray(Support(self.components, self.axes).axes)
        without_rotation = numbering.translation_of(follower)[0, 0] >= 0 and numbering.rotation_of(follower)[0, 0] < 0
        for kind in (0, 1):
            rows_of_kind = [k for k, c in enumerate(self.components) if COMPONENTS.index(c) // 3 == kind]
            if not rows_of_kind:
                continue
            directions = rows[[COMPONENTS.index(self.components[k]) % 3 for k in rows_of_kind]]
            target = (numbering.translation_of, numbering.rotation_of)[kind](follower)[0]
            if kind == 1 and without_rotation:
                continue  # there is no rotation to follow
            if target[0] < 0:
                target = (numbering.translation, numbering.rotation)[kind](follower)[0]
            dependences.append(Dependence(target, directions, source, directions.T @ F[rows_of_kind], self._label()))
        return dependences

    def _label(self) -> str:
        return self.name or f"the linear connection of group {self.group!r}"
