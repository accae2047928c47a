"""Ends of beams that are released from their nodes in some components: hinges and slides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.support import COMPONENTS

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


def release_ends(
    mesh: Mesh,
    member: Member,
    options: dict[str, Any],
    numbering: Numbering,
    nodes: IntArray,
    frame: Array,
    nodal: IntArray,
) -> IntArray:
    """Return the numbers (2 e, 6) of the dofs of the ends of elements with nodes (e, 2) and frames (e, 3, 3): those of
    their nodes, or separate ones at releases, which follow the nodes in all but the released components.

    Raises ValueError for unknown components, and when no end of the member is at a node of release_at.
    """
    where, components = f"beam on group {member.group!r}", options["release"]
    components = [components] if isinstance(components, str) else list(components)
    unknown = [c for c in components if c not in COMPONENTS]
    if unknown or not components:
        raise ValueError(f"{where} has release {components!r}; name some of {list(COMPONENTS)}")
    if options["release_at"] is None:
        raise ValueError(f"{where} has release without release_at; name the point group of the released ends")
    released_ends = np.flatnonzero(np.isin(nodes.ravel(), mesh.group_points(options["release_at"])))
    if not len(released_ends):
        raise ValueError(f"{where}: no element ends at a node of release_at = {options['release_at']!r}")
    nodal = nodal.copy()
    for end in released_ends:
        axes = frame[end // 2]
        for first in (0, 3):
            follows = np.array([c not in components for c in COMPONENTS[first : first + 3]])
            if follows.all():
                continue
            new_dofs, node_dofs = numbering.extra(3), nodal[end, first : first + 3].copy()
            if follows.any():
                numbering.connect(
                    [Dependence(new_dofs, axes[follows], node_dofs, np.eye(3), f"the release of {where}")]
                )
            nodal[end, first : first + 3] = new_dofs
    return nodal
