"""The single open line that a member's elements form, and the same line divided at fractions of its arc length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import Array, IntArray

if TYPE_CHECKING:
    from femflex.mesh import Mesh


AT_NODE = 1e-9  # of the whole length; a cut closer than this to a node is at the node


@dataclass(frozen=True, eq=False)
class Path:
    """An open line of straight elements.

    points    (n_p, 3)  the mesh's points and those that cuts have added [m]
    elements  (e, 2)    nodes of each element, in its own direction
    nodes     (m,)      nodes in order along the line
    s         (m,)      arc length of these nodes [m]
    """

    points: Array
    elements: IntArray
    nodes: IntArray
    s: Array

    @property
    def length(self) -> float:
        """Arc length of the whole line [m]."""
        return float(self.s[-1])

    def arc(self, nodes: IntArray) -> Array:
        """Arc length of nodes of the line, in their shape [m]."""
        s_of_point = np.zeros(len(self.points))
        s_of_point[self.nodes] = self.s
        return s_of_point[nodes]

    def with_nodes_at_cuts(self, k: int) -> Path:
        """Return the line with nodes at all multiples of a k-th of its length; elements there are split in two."""
        cuts = self.length * np.arange(1, k) / k
        at_node = np.abs(self.s[None, :] - cuts[:, None]).min(axis=1, initial=np.inf) <= AT_NODE * self.length
        new_s = cuts[~at_node]
        new_points = np.stack([np.interp(new_s, self.s, self.points[self.nodes, axis]) for axis in range(3)], axis=1)
        number = len(self.points) + np.arange(len(new_s))
        nodes, s = np.concatenate([self.nodes, number]), np.concatenate([self.s, new_s])
        order = np.argsort(s, kind="stable")
        ends = self.arc(self.elements)
        elements = []
        for (a, b), (s_a, s_b) in zip(self.elements, ends, strict=True):
            inside = (new_s > min(s_a, s_b)) & (new_s < max(s_a, s_b))
            between = number[inside] if s_a < s_b else number[inside][::-1]
            chain = np.concatenate([[a], between, [b]])
            elements.append(np.stack([chain[:-1], chain[1:]], axis=1))
        points = np.concatenate([self.points, new_points])
        return Path(points, np.concatenate(elements), nodes[order], s[order])


def path_of(mesh: Mesh, elements: IntArray, group: str, start: str | None = None) -> Path:
    """The line that the elements (e, 2), node numbers, of a group form, from the end that lies in the point group
    `start`.

    Without `start` it begins where its cells point away from. Raises ValueError when they branch, close, fall into
    several lines, or when `start` is at neither end.
    """
    nodes, local = np.unique(elements, return_inverse=True)
    local = local.reshape(-1, 2)
    degree = np.bincount(local.ravel(), minlength=nodes.size)
    if degree.max() > 2:
        raise ValueError(
            f"group {group!r} branches at {int((degree > 2).sum())} of its nodes; only a single line can be cut into "
            "segments, so make each branch a group and a member of its own"
        )
    length = np.linalg.norm(mesh.points[elements[:, 1]] - mesh.points[elements[:, 0]], axis=1)
    graph = sparse.coo_array((length, (local[:, 0], local[:, 1])), shape=(nodes.size, nodes.size)).tocsr()
    n_lines = int(csgraph.connected_components(graph, directed=False)[0])
    ends = np.flatnonzero(degree == 1)
    if n_lines > 1:
        raise ValueError(
            f"group {group!r} falls into {n_lines} lines that share no node; only a single line can be cut into "
            "segments, so make each a group and a member of its own"
        )
    if not ends.size:
        raise ValueError(
            f"group {group!r} is a closed line, which has no end to begin at; only an open line can be cut into "
            "segments, so open it, or divide it into two members"
        )
    begin = _begin(mesh, nodes, ends, local, group, start)
    s = csgraph.dijkstra(graph, directed=False, indices=np.array([begin]))[0]
    order = np.argsort(s, kind="stable")
    return Path(mesh.points, elements, nodes[order], s[order])


def _begin(mesh: Mesh, nodes: IntArray, ends: IntArray, local: IntArray, group: str, start: str | None) -> int:
    """Return the end, as an index into `nodes`, where the line begins."""
    if start is None:
        pointing_away = np.isin(ends, local[:, 0])
        return int(ends[np.lexsort((ends, ~pointing_away))[0]])
    matching_ends = ends[np.isin(nodes[ends], mesh.group_points(start))]
    if matching_ends.size != 1:
        where = "both ends" if matching_ends.size else "neither end"
        raise ValueError(
            f"group {start!r} lies at {where} of the line {group!r}; name the group of the one end where its segments "
            "are counted from"
        )
    return int(matching_ends[0])
