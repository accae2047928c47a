"""Nodes that lie on an edge or face of a neighbouring element without being a node of it, and follow that edge or face.

A middle node of a second-order element beside one of first order, or a corner of a finer mesh on a longer edge, would
let the parts move apart between the nodes that they share. It follows the field of the element that lacks it:

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
from femflex.fem.plate.sides import side_table
from femflex.mesh import Mesh
from femflex.mesh.cells import CELL_TYPES, EDGES, FACES

MOVED_BY_NODES = {"shell", "solid", "membrane"}
BENT_BY_TURNS = {"plate", "plate_bfs"}
OFF = 1e-6  # of an edge's length: distance of a node from it that no solid can follow, which have no rotations
BESIDE = 1e-4  # of an edge's length: distance at which a chain of shorter edges still lies on it


@dataclass(frozen=True)
class Leader:
    """An edge or a face of an element: its nodes, their weights at the node that follows, and how it moves."""

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
        if member.family in MOVED_BY_NODES | BENT_BY_TURNS
        for kind, nodes in mesh.group_cells(member.group).items()
    ]
    leaders = {**_on_chains(mesh, cells), **_on_faces(mesh, cells), **_on_edges(mesh, cells)}
    taken = np.unique(np.concatenate([np.zeros(0, np.int64), *(one.target for one in others)]))
    found: list[Dependence] = []
    for node, leader in leaders.items():
        own = np.array([node])
        moves, turns = numbering.translation_of(own)[0], numbering.rotation_of(own)[0]
        if moves[0] < 0 or np.isin(moves, taken).any() or np.isin(turns, taken).any():
            continue
        found += _followed(mesh, numbering, node, leader)
        if leader.family in BENT_BY_TURNS:  # the edge is straight in its plane
            sides = side_table(mesh, numbering).known(_keys(mesh, np.array([leader.nodes])))
            found += [Dependence(side, np.eye(1), own[:0], np.zeros((1, 0)), "a straight edge") for side in sides]
    return found


def hanging_note(mesh: Mesh, numbering: Numbering, dependences: Sequence[Dependence]) -> tuple[str, ...]:
    """A sentence on the nodes that follow, with the first place; none where there are none."""
    nodes = np.flatnonzero(np.isin(numbering.translation_of(np.arange(len(mesh.points)))[:, 0], _first(dependences)))
    if not len(nodes):
        return ()
    return (
        f"{len(nodes)} nodes lie on edges or faces of neighbouring elements that have no node there (the first at "
        f"{_at(mesh, nodes[0])}); they follow these, as a linear constraint",
    )


def _first(dependences: Sequence[Dependence]) -> IntArray:
    return np.array([one.target[0] for one in dependences], np.int64)


def _followed(mesh: Mesh, numbering: Numbering, node: int, leader: Leader) -> list[Dependence]:
    """The dependences of one node."""
    own, nodes, w = np.array([node]), np.array(leader.nodes), np.array(leader.weights)
    where = f"the node at {_at(mesh, node)} on the edge of a neighbouring element"
    moves, turns = numbering.translation_of(nodes), numbering.rotation_of(nodes)
    if leader.family == "solid":
        turns = np.full_like(turns, -1)
    x = mesh.points[nodes]
    d, size = mesh.points[node] - w @ x, np.linalg.norm(np.ptp(x, axis=0))
    turning = bool((turns >= 0).all())
    if np.linalg.norm(d) > OFF * size and not turning:
        raise ValueError(
            f"the node at {_at(mesh, node)} lies {np.linalg.norm(d):.3g} m off the straight edge of a neighbouring "
            "element that has no node there, and cannot follow it; make both of one order (order = 2 for solids), or "
            "move the node onto the edge"
        )
    move = np.concatenate([weight * np.eye(3) for weight in w], axis=1)
    target = numbering.translation_of(own)[0]
    if not turning:
        source = moves.ravel()
        if leader.family == "membrane" and len(nodes) == 2:
            source = np.concatenate([source, numbering.sides(nodes[None])[0]])
            move = np.concatenate([move, 4 * w[0] * w[1] * np.eye(3)], axis=1)
        return [Dependence(target, np.eye(3), source, move, where)]
    source = np.concatenate([moves.ravel(), turns.ravel()])
    tilt = -skew(d) @ move  # theta x d = -d x theta
    lift, turn = np.concatenate([move, tilt], axis=1), np.concatenate([0 * move, move], axis=1)
    if leader.family in BENT_BY_TURNS:
        lift, turn = _bent(x, float(w[1]))
        lift[:, 6:] += tilt
    elif len(nodes) == 2:  # a shell deflects along its edge as its nodes turn, where it bends alike
        lift[:, 6:] += w[0] * w[1] / 2 * np.concatenate([-skew(x[1] - x[0]), skew(x[1] - x[0])], axis=1)
    found = [Dependence(target, np.eye(3), source, lift, where)]
    if numbering.rotation_of(own)[0, 0] >= 0:
        found.append(Dependence(numbering.rotation_of(own)[0], np.eye(3), source, turn, where))
    return found


def _bent(x: Array, t: float) -> tuple[Array, Array]:
    """Displacement and rotation (3, 12) at t of an edge x (2, 3) [m] that bends as a cubic, over u_a, u_b, theta_a,
    theta_b."""
    span = x[1] - x[0]
    L, I = np.linalg.norm(span), np.eye(3)
    e = span / L
    h = np.array([1 - 3 * t**2 + 2 * t**3, 3 * t**2 - 2 * t**3, t - 2 * t**2 + t**3, t**3 - t**2])
    dh = np.array([-6 * t + 6 * t**2, 6 * t - 6 * t**2, 1 - 4 * t + 3 * t**2, 3 * t**2 - 2 * t]) / L
    across, cross = I - np.outer(e, e), skew(e)  # u' = theta x e = -e x theta
    stretch = np.outer(e, e)
    lift = [h[k] * across + linear * stretch for k, linear in enumerate((1 - t, t))]
    lift += [-L * h[2 + k] * cross for k in (0, 1)]
    turn = [dh[k] * cross for k in (0, 1)]  # theta across e = e x u'
    turn += [L * dh[2 + k] * across + linear * stretch for k, linear in enumerate((1 - t, t))]
    return np.concatenate(lift, axis=1), np.concatenate(turn, axis=1)


Cells = Sequence[tuple[str, str, IntArray]]


def _led_by_middles(family: str, kind: str) -> bool:
    return family in MOVED_BY_NODES and CELL_TYPES[kind].order == 2


def _on_edges(mesh: Mesh, cells: Cells) -> dict[int, Leader]:
    """Middle nodes of second-order elements on edges of others without one."""
    n, found = len(mesh.points), {}
    edges, middles = _middles(mesh, cells)
    for family, kind, nodes in sorted(cells, key=lambda one: one[0] != "solid"):  # shells last: they turn, too
        if not _led_by_middles(family, kind):
            on = np.flatnonzero(np.isin(edges, _keys(mesh, nodes[:, EDGES[CELL_TYPES[kind].shape]])))
            for key, node in zip(edges[on].tolist(), middles[on].tolist(), strict=True):
                found[node] = _edge(mesh, node, key // n, key % n, family)
    return found


def _edge(mesh: Mesh, node: int, a: int, b: int, family: str, middle: int = -1) -> Leader:
    """The edge from a to b, with a node in its middle or none, as it leads a node near it."""
    span = mesh.points[b] - mesh.points[a]
    t = float(span @ (mesh.points[node] - mesh.points[a]) / (span @ span))
    if middle < 0:
        return Leader((a, b), (1 - t, t), family)
    return Leader((a, b, middle), ((1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)), family)


def _on_faces(mesh: Mesh, cells: Cells) -> dict[int, Leader]:
    """Nodes in the middle of quadrilateral faces of solids that have none there: of faces of 27 nodes' bricks, and of
    the diagonals where triangles of two elements meet such a face."""
    solids = [(kind, nodes) for family, kind, nodes in cells if family == "solid"]
    if len({kind for kind, _ in solids}) < 2:
        return {}
    faces = [_Faces.of(kind, nodes, face) for kind, nodes in solids for face in FACES[CELL_TYPES[kind].shape]]
    quads = [own for own in faces if own.corners.shape[1] == 4]
    if not quads:
        return {}
    every = np.sort(np.concatenate([own.corners for own in quads]), axis=1)
    _, which, count = np.unique(every, axis=0, return_inverse=True, return_counts=True)
    numbers = np.split(which.ravel(), np.cumsum([len(own.corners) for own in quads])[:-1])
    centres: dict[int, int] = {}
    for own, number in zip(quads, numbers, strict=True):
        centres |= {k: node for k, node in zip(number.tolist(), own.centre.tolist(), strict=True) if node >= 0}
    edges, middles = _middles(mesh, [("solid", kind, nodes) for kind, nodes in solids])
    found: dict[int, Leader] = {}
    crossed: list[tuple[int, list[int], Leader]] = []
    for own, number in zip(quads, numbers, strict=True):
        for row in np.flatnonzero((own.centre < 0) & np.isin(number, list(centres))):
            found[centres[int(number[row])]] = own.leader(row)
        for around in ([0, 1, 2, 3], [1, 2, 3, 0]):
            key = _keys(mesh, own.corners[:, around[::2]])
            for row in np.flatnonzero((count[number] == 1) & np.isin(key, edges)):
                node = int(middles[np.searchsorted(edges, key[row])])
                crossed.append((node, own.corners[row, around].tolist(), own.leader(row)))
                if own.centre[row] >= 0:
                    crossed.append((int(own.centre[row]), *crossed[-1][1:]))
    if crossed:
        near = [node for _, quad, _ in crossed for node in quad]
        three = [own.corners for own in faces if own.corners.shape[1] == 3]
        triangles = {frozenset(one) for own in three for one in own[np.isin(own, near).all(axis=1)].tolist()}
        for node, (i, j, k, l), leader in crossed:
            if {frozenset((i, j, k)), frozenset((i, k, l))} <= triangles:
                found[node] = leader
    return found


@dataclass(frozen=True, eq=False)
class _Faces:
    """One face of all solids of a kind: corners (e, 3|4); nodes (e, m) and weights (m,) of the place in its middle,
    without a node that it may have there; that node (e,), -1 where there is none."""

    corners: IntArray
    nodes: IntArray
    weights: tuple[float, ...]
    centre: IntArray

    @classmethod
    def of(cls, kind: str, nodes: IntArray, face: list[int]) -> _Faces:
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
        if _led_by_middles(family, kind):
            cell = CELL_TYPES[kind]
            keys.append(_keys(mesh, nodes[:, EDGES[cell.shape]]).ravel())
            middles.append(nodes[:, cell.n_corners : cell.n_corners + len(EDGES[cell.shape])].ravel())
    key, first = np.unique(np.concatenate(keys), return_index=True)
    return key, np.concatenate(middles)[first]


def _on_chains(mesh: Mesh, cells: Cells) -> dict[int, Leader]:
    """Nodes of chains of shorter edges that lie on a longer one, from end to end, where surfaces of two meshes meet.

    Raises ValueError for solids, whose faces would need the same.
    """
    found: dict[int, Leader] = {}
    edges, middles = _middles(mesh, cells)

    def middle(a: int, b: int) -> int:
        key = min(a, b) * len(mesh.points) + max(a, b)
        k = int(np.searchsorted(edges, key))
        return int(middles[k]) if k < len(edges) and edges[k] == key else -1

    for solid in (False, True):
        pairs, families = _free_edges(mesh, [one for one in cells if (one[0] == "solid") == solid])
        for (a, b), family, chain in _chains(mesh, pairs, families):
            own = middle(a, b)
            if solid and chain != [own]:
                raise ValueError(
                    f"solids of different size meet at {_at(mesh, chain[0])}: the node there lies on the edge from "
                    f"{_at(mesh, a)} to {_at(mesh, b)} of an element that has no node there, and the parts would move "
                    "apart; mesh both alike where they meet"
                )
            more = [middle(*pair) for pair in zip([a, *chain], [*chain, b], strict=True)]
            leading = own if max(more) >= 0 else -1  # beside edges that stay straight a longer one stays straight
            on = {*chain, *more, own} - {leading, -1}
            found |= {node: _edge(mesh, node, a, b, family, leading) for node in on if not solid}
    return found


def _free_edges(mesh: Mesh, cells: Cells) -> tuple[IntArray, list[str]]:
    """Edges (k, 2) that one surface element has alone, or of faces that one solid has alone, and their families."""
    found: list[tuple[IntArray, str]] = []
    faces = [
        (np.pad(own.corners, ((0, 0), (0, 4 - own.corners.shape[1])), constant_values=-1), own.corners.shape[1])
        for family, kind, nodes in cells
        if family == "solid"
        for own in (_Faces.of(kind, nodes, face) for face in FACES[CELL_TYPES[kind].shape])
    ]
    if faces:
        every = np.concatenate([corners for corners, _ in faces])
        _, which, count = np.unique(np.sort(every, axis=1), axis=0, return_inverse=True, return_counts=True)
        outer = count[which.ravel()] == 1
        start = 0
        for corners, n in faces:
            own = corners[outer[start : start + len(corners)], :n]
            start += len(corners)
            found.append((np.stack([own, np.roll(own, -1, axis=1)], axis=2).reshape(-1, 2), "solid"))
    else:
        found += [(nodes[:, EDGES[CELL_TYPES[kind].shape]].reshape(-1, 2), family) for family, kind, nodes in cells]
    if not found:
        return np.zeros((0, 2), np.int64), []
    pairs = np.sort(np.concatenate([own for own, _ in found]), axis=1)
    _, first, count = np.unique(_keys(mesh, pairs), return_index=True, return_counts=True)
    kept = first if faces else first[count == 1]
    names = np.repeat([family for _, family in found], [len(own) for own, _ in found])
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

    def at(node: int) -> float:
        return float(span @ (mesh.points[node] - mesh.points[a]) / (span @ span))

    chain = [a]
    while chain[-1] != b:
        ahead = {
            at(node): node
            for node in beyond[chain[-1]]
            if {chain[-1], node} != {a, b}
            and at(chain[-1]) < at(node) <= 1
            and np.linalg.norm(mesh.points[node] - mesh.points[a] - at(node) * span) <= BESIDE * np.linalg.norm(span)
        }
        if not ahead:
            return []
        chain.append(ahead[min(ahead)])
    return chain[1:-1]


def _at(mesh: Mesh, node: int | np.intp) -> str:
    return "(" + ", ".join(f"{c:.6g}" for c in mesh.points[node]) + ") m"
