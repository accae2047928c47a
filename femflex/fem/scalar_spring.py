"""Springs on linear combinations of nodal components, energy k (sum a u)^2 / 2: Nastran's CELAS and the like."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution
from femflex.fem.tables import DenseStrain

if TYPE_CHECKING:
    from femflex.mesh import Mesh

Direction = tuple[float, float, float]


@dataclass(frozen=True)
class ScalarSpring:
    """A spring that resists one linear combination of displacements and rotations of nodes.

    terms      (group of one node, "translation" or "rotation", (3,) factors along the mesh's axes), ...
    stiffness  [N/m], [N] or [N m/rad], as the terms go; not zero

    Unlike a Bushing between nodes that are apart it may resist rigid rotation: it is the spring of a matrix.
    """

    terms: tuple[tuple[str, str, Direction], ...]
    stiffness: float

    def __post_init__(self) -> None:
        if not self.terms or not np.isfinite(self.stiffness) or self.stiffness == 0:
            raise ValueError(
                f"a scalar spring has {len(self.terms)} terms and stiffness {self.stiffness}; give terms and a finite "
                "stiffness other than 0"
            )

    def contribution(self, mesh: Mesh, numbering: Numbering) -> Contribution:
        """Return the strain of the spring. Raises ValueError for groups of several nodes and for a node without such
        dofs."""
        dofs, row = [], []
        for group, kind, factors in self.terms:
            nodes = mesh.group_points(group)
            if len(nodes) != 1:
                raise ValueError(
                    f"scalar spring at group {group!r}: it has {len(nodes)} nodes; name groups of one node"
                )
            node_dofs = (numbering.rotation_of if kind == "rotation" else numbering.translation_of)(nodes)[0]
            if node_dofs[0] < 0:
                raise ValueError(f"scalar spring at group {group!r}: no member gives the node a {kind}; name another")
            dofs.append(node_dofs)
            row.append(np.asarray(factors, float))
        G = np.concatenate(row)[None, None, None]
        elastic = np.full((1, 1, 1, 1), self.stiffness)
        strain = DenseStrain(np.concatenate(dofs)[None], np.ones((1, 1)), elastic, np.eye(1), np.zeros((1, 1, 1)), G)
        return Contribution((), (strain,))
