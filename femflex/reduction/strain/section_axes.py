"""Which markers are sections of a beam that turn with its tangent."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.fem.tables import SectionInertia
from femflex.reduction.boundary.markers import attachable_nodes

PARALLEL = 1e-9  # sine of the angle between the elements at a node that have one axis


def section_axis(structure: Structure, group: str) -> Array:
    """Unit vector (3,) [1] along the beams of a group of one node; zero where they meet at an angle or others join
    them."""
    nodes = attachable_nodes(structure, group)
    turns = structure.numbering.rotation_of(nodes).ravel()
    held = turns[turns >= 0]
    beams = [block for block in structure.inertia if isinstance(block, SectionInertia)]
    if len(nodes) != 1 or not held.size or not beams:
        return np.zeros(3)
    axes = np.concatenate([block.axis[np.isin(block.dofs, held).any(axis=1)] for block in beams])
    joined = sum(np.isin(block.dofs, held).any(axis=1).sum() for block in structure.strain)
    alone = len(axes) == joined and np.linalg.norm(np.cross(axes, axes[0]), axis=1).max() < PARALLEL
    return np.asarray(axes[0] if alone else np.zeros(3))
