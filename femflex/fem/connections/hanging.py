"""Nodes that lie on an edge or face of a neighbouring element without being one of its nodes, and follow that edge or
face.

A middle node of a second-order element beside one of first order, or a corner of a finer mesh on a longer edge, would
let the parts separate between the nodes that they share. It follows the field of the element without that node:

    u = sum N_k u_k + theta x d,  theta = sum N_k theta_k

N_k are the shape functions of the edge or face at the node, d its distance from there. Edges of plates and of four-node
shells deflect as their ends turn, too: u has (theta_a - theta_b) x (x_b - x_a) / 8 in the middle.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import skew
from femflex.fem.connections.middle_nodes import led_by_middles
from femflex.fem.family import EDGES as FAMILY_EDGES
from femflex.fem.plate.sides import side_table
from femflex.mesh import Mesh
from femflex.mesh.cells import CELL_TYPES, EDGES, FACES

OFF = 1e-6  # of an edge's length: distance beyond which a node off the edge cannot follow a solid, without rotations
BESIDE = 1e-4  # of an edge's length: distance at which a chain of shorter edges still lies on it


@dataclass(frozen=True)
class Leader:
    """An edge or a face of an element: its nodes, their weights at the node that follows, and the family of the
    element."""

    nodes: tuple[int, ...]
    weights: tuple[float, ...]
    family: str


def hanging_dependences(mesh: Mesh, numbering: Numbering, others: Sequence[Dependence]) -> list[Dependence]:
    """Dependences of the hanging nodes of the numbering's members; nodes that follow in `others` are left to these.

    Raises ValueError, with the place, where a node cannot follow: off a straight edge of a solid, or on the boundary of
    solids of another size.
    """
    cells = [
        (member.family, kind, nodes)
        for member in numbering.members
        if member.family in FAMILY_EDGES
        for kind, nodes in mesh.group_cells(member.group).items()
    ]
    leaders = {**_on_chains(mesh, cells), **_on_faces(mesh, cells), **_on_edges(mesh, cells)}
    dependent = np.unique(np.concatenate([np.zeros(0, np.int64), *(dependence.target for dependence in others)]))
    dependences: list[Dependence] = []
    for node, leader in leaders.items():
        node_array = np.array([node])
        moves, turns = numbering.translation_of(node_array)[0], numbering.rotation_of(node_array)[0]
        if moves[0] < 0 or np.isin(moves, dependent).any() or np.isin(turns, dependent).any():
            continue
        dependences += _node_dependences(mesh, numbering, node, leader)
        if FAMILY_EDGES[leader.family] == "bent":  # the edge is straight in its plane
            sides = side_table(mesh, numbering).existing_dofs(_keys(mesh, np.array([leader.nodes])))
            dependences += [
                Dependence(side, np.eye(1), node_array[:0], np.zeros((1, 0)), "a straight edge") for side in sides
            ]
    return dependences


def hanging_note(mesh: Mesh, numbering: Numbering, dependences: Sequence[Dependence]) -> tuple[str, ...]:
    """Return a sentence on the nodes that follow, with the position of the first; none where there are none."""
    dofs = numbering.translation_of(np.arange(len(mesh.points)))[:, 0]
    nodes = np.flatnonzero(np.isin(dofs, [dependence.target[0] for dependence in dependences]))
    if not len(nodes):
        return ()
    return (
        f"{len(nodes)} nodes lie on edges or faces of neighbouring elements that have no node there (the first at "
        f"{_position_text(mesh, nodes[0])}); they follow these, as a linear constraint",
    )


def _node_dependences(mesh: Mesh, numbering: Numbering, node: int, leader: Leader) -> list[Dependence]:
    """Return the dependences of one node."""
    node_array, nodes, w = np.array([node]), np.array(leader.nodes), np.array(leader.weights)
    where = f"the node at {_position_text(mesh, node)} on the edge of a neighbouring element"
    moves, turns = numbering.translation_of(nodes), numbering.rotation_of(nodes)
    if leader.family == "solid":
        turns = np.full_like(turns, -1)
    x = mesh.points[nodes]
    d, size = mesh.points[node] - w @ x, np.linalg.norm(np.ptp(x, axis=0))
    turning = bool((turns >= 0).all())
    if np.linalg.norm(d) > OFF * size and not turning:
        raise ValueError(
            f"the node at {_position_text(mesh, node)} lies {np.linalg.norm(d):.3g} m off the straight edge of a "
            "neighbouring element that has no node there, and cannot follow it; make both of one order (order = 2 for "
            "solids), or move the node onto the edge"
        )
    move = np.concatenate([weight * np.eye(3) for weight in w], axis=1)
    target = numbering.translation_of(node_array)[0]
    if not turning:
        source = moves.ravel()
        if leader.family == "membrane" and len(nodes) == 2:
            source = np.concatenate([source, numbering.sides(nodes[None])[0]])
            move = np.concatenate([move, 4 * w[0] * w[1] * np.eye(3)], axis=1)
        return [Dependence(target, np.eye(3), source, move, where)]
    source = np.concatenate([moves.ravel(), turns.ravel()])
    tilt = -skew(d) @ move  # theta x d = -d x theta
    displacement, turn = np.concatenate([move, tilt], axis=1), np.concatenate([0 * move, move], axis=1)
    if FAMILY_EDGES[leader.family] == "bent":
        displacement, turn = _cubic_edge(x, float(w[1]))
        displacement[:, 6:] += tilt
    elif len(nodes) == 2:  # a shell deflects along its edge as its nodes rotate, if it bends uniformly
        displacement[:, 6:] += w[0] * w[1] / 2 * np.concatenate([-skew(x[1] - x[0]), skew(x[1] - x[0])], axis=1)
    dependences = [Dependence(target, np.eye(3), source, displacement, where)]
    if numbering.rotation_of(node_array)[0, 0] >= 0:
        dependences.append(Dependence(numbering.rotation_of(node_array)[0], np.eye(3), source, turn, where))
    return dependences


def _cubic_edge(x: Array, t: float) -> tuple[Array, Array]:
    """Displacement and rotation (3, 12) at t of an edge x (2, 3) [m] that bends as a cubic, over u_a, u_b, theta_a,
    theta_b."""
    span = x[1] - x[0]
    L, I = np.linalg.norm(span), np.eye(3)
    e = span / L
    h = np.array([1 - 3 * t**2 + 2 * t**3, 3 * t**2 - 2 * t**3, t - 2 * t**2 + t**3, t**3 - t**2])
    dh = np.array([-6 * t + 6 * t**2, 6 * t - 6 * t**2, 1 - 4 * t + 3 * t**2, 3 * t**2 - 2 * t]) / L
    across, cross = I - np.outer(e, e), skew(e)  # u' = theta x e = -e x theta
    stretch = np.outer(e, e)
    displacement = [h[k] * across + linear * stretch for k, linear in enumerate((1 - t, t))]
    displacement += [-L * h[2 + k] * cross for k in (0, 1)]
    rotation = [dh[k] * cross for k in (0, 1)]  # theta across e = e x u'
    rotation += [L * dh[2 + k] * across + linear * stretch for k, linear in enumerate((1 - t, t))]
    return np.concatenate(displacement, axis=1), np.concatenate(rotation, axis=1)


Cells = Sequence[tuple[str, str, IntArray]]


def _on_edges(mesh: Mesh, cells: Cells) -> dict[int, Leader]:
    """Middle nodes of second-order elements on edges of others without one."""
    n, leaders = len(mesh.points), {}
    edges, middles = _middles(mesh, cells)
    # shells last, as they have rotations too
    for family, kind, nodes in sorted(cells, key=lambda cell: cell[0] != "solid"):
        if not led_by_middles(family, kind):
            on = np.flatnonzero(np.isin(edges, _keys(mesh, nodes[:, EDGES[CELL_TYPES[kind].shape]])))
            for key, node in zip(edges[on].tolist(), middles[on].tolist(), strict=True):
                leaders[node] = _edge(mesh, node, key // n, key % n, family)
    return leaders


def _edge(mesh: Mesh, node: int, a: int, b: int, family: str, middle: int = -1) -> Leader:
    """Return the edge from a to b, with a node in its middle or none, as the leader of a node on it."""
    span = mesh.points[b] - mesh.points[a]
    t = float(span @ (mesh.points[node] - mesh.points[a]) / (span @ span))
    if middle < 0:
        return Leader((a, b), (1 - t, t), family)
    return Leader((a, b, middle), ((1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)), family)


def _on_faces(mesh: Mesh, cells: Cells) -> dict[int, Leader]:
    """Leaders of nodes in the middle of quadrilateral faces of solids that have no node there: middle nodes of faces of
    27-node bricks, and of the diagonals where triangles of two elements meet such a face."""
    solids = [(kind, nodes) for family, kind, nodes in cells if family == "solid"]
    if len({kind for kind, _ in solids}) < 2:
        return {}
    faces = [_Faces.from_cells(kind, nodes, face) for kind, nodes in solids for face in FACES[CELL_TYPES[kind].shape]]
    quads = [quad_faces for quad_faces in faces if quad_faces.corners.shape[1] == 4]
    if not quads:
        return {}
    every = np.sort(np.concatenate([quad_faces.corners for quad_faces in quads]), axis=1)
    _, which, count = np.unique(every, axis=0, return_inverse=True, return_counts=True)
    numbers = np.split(which.ravel(), np.cumsum([len(quad_faces.corners) for quad_faces in quads])[:-1])
    centres: dict[int, int] = {}
    for quad_faces, number in zip(quads, numbers, strict=True):
        centres |= {k: node for k, node in zip(number.tolist(), quad_faces.centre.tolist(), strict=True) if node >= 0}
    edges, middles = _middles(mesh, [("solid", kind, nodes) for kind, nodes in solids])
    leaders: dict[int, Leader] = {}
    crossed: list[tuple[int, list[int], Leader]] = []
    for quad_faces, number in zip(quads, numbers, strict=True):
        for row in np.flatnonzero((quad_faces.centre < 0) & np.isin(number, list(centres))):
            leaders[centres[int(number[row])]] = quad_faces.leader(row)
        for around in ([0, 1, 2, 3], [1, 2, 3, 0]):
            key = _keys(mesh, quad_faces.corners[:, around[::2]])
            for row in np.flatnonzero((count[number] == 1) & np.isin(key, edges)):
                node = int(middles[np.searchsorted(edges, key[row])])
                crossed.append((node, quad_faces.corners[row, around].tolist(), quad_faces.leader(row)))
                if quad_faces.centre[row] >= 0:
                    crossed.append((int(quad_faces.centre[row]), *crossed[-1][1:]))
    if crossed:
        corner_nodes = [node for _, quad, _ in crossed for node in quad]
        triangle_corners = [quad_faces.corners for quad_faces in faces if quad_faces.corners.shape[1] == 3]
        triangles = {
            frozenset(corners)
            for quad_faces in triangle_corners
            for corners in quad_faces[np.isin(quad_faces, corner_nodes).all(axis=1)].tolist()
        }
        for node, (i, j, k, l), leader in crossed:
            if {frozenset((i, j, k)), frozenset((i, k, l))} <= triangles:
                leaders[node] = leader
    return leaders


@dataclass(frozen=True, eq=False)
class _Faces:
    """One face of all solids of a kind: corners (e, 3|4); nodes (e, m) and weights (m,) of the point in its middle,
    without a node that may be there; that node (e,), -1 where there is none."""

    corners: IntArray
    nodes: IntArray
    weights: tuple[float, ...]
    centre: IntArray

    @classmethod
    def from_cells(cls, kind: str, nodes: IntArray, face: list[int]) -> _Faces:
        cell, n = CELL_TYPES[kind], len(face)
        corners, none = nodes[:, face], np.full(len(nodes), -1)
        if cell.order == 1 or n == 3:
            return cls(corners, corners, (1 / n,) * n, none)
        between = {frozenset(parents.tolist()): k for k, parents in enumerate(cell.parents, cell.n_corners)}
        more = [between[frozenset((face[k], face[k - 1]))] for k in range(n)]
        centre = nodes[:, between[frozenset(face)]] if frozenset(face) in between else none
        return cls(corners, nodes[:, [*face, *more]], (-0.25,) * 4 + (0.5,) * 4, centre)

    def leader(self, row: int | np.intp) -> Leader:
        return Leader(tuple(self.nodes[row].tolist()), self.weights, "solid")


def _keys(mesh: Mesh, pairs: IntArray) -> IntArray:
    """One number (...) for each pair (..., 2) of nodes, whatever their order."""
    ordered = np.sort(pairs, axis=-1)
    return np.asarray(ordered[..., 0] * len(mesh.points) + ordered[..., 1])


def _middles(mesh: Mesh, cells: Cells) -> tuple[IntArray, IntArray]:
    """Keys (k,), ascending, of the edges of elements that are moved by a node in their middle, and that node (k,)."""
    keys, middles = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for family, kind, nodes in cells:
        if led_by_middles(family, kind):
            cell = CELL_TYPES[kind]
            keys.append(_keys(mesh, nodes[:, EDGES[cell.shape]]).ravel())
            middles.append(nodes[:, cell.n_corners : cell.n_corners + len(EDGES[cell.shape])].ravel())
    key, first = np.unique(np.concatenate(keys), return_index=True)
    return key, np.concatenate(middles)[first]


def _on_chains(mesh: Mesh, cells: Cells) -> dict[int, Leader]:
    """Nodes of chains of shorter edges that lie on a longer one, from end to end, where surfaces of two meshes meet.

    Raises ValueError for solids, whose faces would need the same.
    """
    leaders: dict[int, Leader] = {}
    edges, middles = _middles(mesh, cells)

    def middle(a: int, b: int) -> int:
        key = min(a, b) * len(mesh.points) + max(a, b)
        k = int(np.searchsorted(edges, key))
        return int(middles[k]) if k < len(edges) and edges[k] == key else -1

    for solid in (False, True):
        pairs, families = _free_edges(mesh, [cell for cell in cells if (cell[0] == "solid") == solid])
        for (a, b), family, chain in _chains(mesh, pairs, families):
            middle_node = middle(a, b)
            if solid and chain != [middle_node]:
                raise ValueError(
                    f"solids of different size meet at {_position_text(mesh, chain[0])}: the node there lies on the "
                    f"edge from {_position_text(mesh, a)} to {_position_text(mesh, b)} of an element that has no node "
                    "there, and the parts would move apart; mesh both alike where they meet"
                )
            middles_between = [middle(*pair) for pair in zip([a, *chain], [*chain, b], strict=True)]
            # a longer edge stays straight beside edges that stay straight
            leading_middle = middle_node if max(middles_between) >= 0 else -1
            on = {*chain, *middles_between, middle_node} - {leading_middle, -1}
            leaders |= {node: _edge(mesh, node, a, b, family, leading_middle) for node in on if not solid}
    return leaders


def _free_edges(mesh: Mesh, cells: Cells) -> tuple[IntArray, list[str]]:
    """Edges (k, 2) that one surface element has alone, or of faces that one solid has alone, and their families."""
    edges: list[tuple[IntArray, str]] = []
    faces = [
        (np.pad(face.corners, ((0, 0), (0, 4 - face.corners.shape[1])), constant_values=-1), face.corners.shape[1])
        for family, kind, nodes in cells
        if family == "solid"
        for face in (_Faces.from_cells(kind, nodes, face) for face in FACES[CELL_TYPES[kind].shape])
    ]
    if faces:
        every = np.concatenate([corners for corners, _ in faces])
        _, which, count = np.unique(np.sort(every, axis=1), axis=0, return_inverse=True, return_counts=True)
        outer = count[which.ravel()] == 1
        start = 0
        for corners, n in faces:
            face = corners[outer[start : start + len(corners)], :n]
            start += len(corners)
            edges.append((np.stack([face, np.roll(face, -1, axis=1)], axis=2).reshape(-1, 2), "solid"))
    else:
        edges += [(nodes[:, EDGES[CELL_TYPES[kind].shape]].reshape(-1, 2), family) for family, kind, nodes in cells]
    if not edges:
        return np.zeros((0, 2), np.int64), []
    pairs = np.sort(np.concatenate([face for face, _ in edges]), axis=1)
    _, first, count = np.unique(_keys(mesh, pairs), return_index=True, return_counts=True)
    kept = first if faces else first[count == 1]
    names = np.repeat([family for _, family in edges], [len(face) for face, _ in edges])
    return pairs[kept], [str(name) for name in names[kept]]


def _chains(mesh: Mesh, pairs: IntArray, families: list[str]) -> Iterable[tuple[tuple[int, int], str, list[int]]]:
    """Edges among pairs (k, 2) that others cover from end to end, their family, and the nodes between their ends."""
    ways = np.concatenate([pairs, pairs[:, ::-1]])
    order = np.argsort(ways[:, 0], kind="stable")
    ways, number = ways[order], np.tile(np.arange(len(pairs)), 2)[order]
    span = mesh.points[ways[:, 1]] - mesh.points[ways[:, 0]]
    length = np.linalg.norm(span, axis=1)
    unit = span / np.where(length > 0, length, 1.0)[:, None]
    covered: set[int] = set()
    for step in range(1, int(np.bincount(ways[:, 0]).max(initial=0))):
        same = ways[step:, 0] == ways[:-step, 0]
        along = same & (np.einsum("ki,ki->k", unit[step:], unit[:-step]) > 1 - 1e-6)
        for k in np.flatnonzero(along).tolist():
            covered.add(int(number[k if length[k] > length[k + step] else k + step]))
    if not covered:
        return
    beyond: dict[int, list[int]] = {}
    for a, b in ways.tolist():
        beyond.setdefault(a, []).append(b)
    for row in sorted(covered):
        a, b = pairs[row].tolist()
        if chain := _chain(mesh, beyond, a, b):
            yield (a, b), families[row], chain


def _chain(mesh: Mesh, beyond: dict[int, list[int]], a: int, b: int) -> list[int]:
    """Nodes between a and b of edges that lead from one to the other along their straight line; none where there are
    no such edges."""
    span = mesh.points[b] - mesh.points[a]

    def fraction(node: int) -> float:
        return float(span @ (mesh.points[node] - mesh.points[a]) / (span @ span))

    chain = [a]
    while chain[-1] != b:
        ahead = {
            fraction(node): node
            for node in beyond[chain[-1]]
            if {chain[-1], node} != {a, b}
            and fraction(chain[-1]) < fraction(node) <= 1
            and np.linalg.norm(mesh.points[node] - mesh.points[a] - fraction(node) * span)
            <= BESIDE * np.linalg.norm(span)
        }
        if not ahead:
            return []
        chain.append(ahead[min(ahead)])
    return chain[1:-1]


def _position_text(mesh: Mesh, node: int | np.intp) -> str:
    return "(" + ", ".join(f"{c:.6g}" for c in mesh.points[node]) + ") m"
