"""Patches of groups of a mesh: their sizes, normals, and mean motion by the shapes of a body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import LoadSet, Marker, Patches
from femflex.body.patches import clusters, patch_marker
from femflex.fem.static_loads import StaticLoads
from femflex.fem.structure import Structure
from femflex.mesh import Mesh
from femflex.mesh.cells import CELL_TYPES, EDGES, FACES
from femflex.mesh.quality import quadrature
from femflex.mesh.regions import with_whole_groups

POINTS = 4  # Gauss points of a cell per direction: exact for cubics along its sides, times areas of bent cells


def add_patches(
    structure: Structure, phi: Array, groups: Sequence[str], sines: bool
) -> tuple[dict[str, Patches], dict[str, Marker]]:
    """Patches of each group, and their markers on shapes phi (n_dof, n) [m, rad].

    sines: slopes of beams are sines, as with nonlinear strain. Raises ValueError for a group that does not exist, or
    that has neither lines nor surfaces, and for nodes that belong to no member.
    """
    patches: dict[str, Patches] = {}
    markers: dict[str, Marker] = {}
    for group in groups:
        patches[group], own = _patches_of_group(structure, phi, group, sines)
        markers |= own
    return patches, markers


def mean_markers(
    group: str, cells: CellMotion, dimension: int, aligned: bool = True, solid: bool = False, sines: bool = False
) -> tuple[Patches, dict[str, Marker]]:
    """The Patches of cells, and the markers of these and of the whole group."""
    unit = cells.area / np.maximum(np.linalg.norm(cells.area, axis=1), np.finfo(float).tiny)[:, None]
    parts = clusters(cells.position, unit)
    markers = {}
    for k, part in enumerate(parts):
        weight = cells.size[part] / cells.size[part].sum()
        position, phi, psi = (np.tensordot(weight, rows[part], 1) for rows in (cells.position, cells.phi, cells.psi))
        tangent = weight @ unit[part]
        axis = tangent / np.linalg.norm(tangent) if sines and tangent.any() else np.zeros(3)
        markers[patch_marker(group, k)] = Marker(position, phi, psi, axis=axis)
    share = cells.size / cells.size.sum()
    whole_phi = np.tensordot(share, cells.phi, 1)
    markers[patch_marker(group)] = Marker(share @ cells.position, whole_phi, np.zeros_like(whole_phi))
    sizes = np.array([cells.size[part].sum() for part in parts])
    areas = np.array([cells.area[part].sum(axis=0) for part in parts])
    outlines = tuple(cells.corners[part] for part in parts)
    return Patches(dimension, sizes, areas, aligned, solid, outlines), markers


@dataclass(frozen=True, eq=False)
class CellMotion:
    """Cells with their means: size (c,), position (c, 3), area as a vector or length along the tangent (c, 3),
    displacement and rotation phi, psi (c, 3, n) per shape, and corners (c, 4, 3), the last repeated where fewer."""

    size: Array
    position: Array
    area: Array
    phi: Array
    psi: Array
    corners: Array


def _patches_of_group(structure: Structure, phi: Array, group: str, sines: bool) -> tuple[Patches, dict[str, Marker]]:
    mesh = with_whole_groups(structure.mesh, [group])
    cells = mesh.group_cells(group)
    dimension = max((d for kind in cells if (d := CELL_TYPES[kind].dimension) in (1, 2)), default=0)
    if not dimension:
        raise ValueError(
            f"group {group!r} has neither lines nor surfaces, over which a load could be spread; name a group of the "
            "lines, surfaces or faces that carry it"
        )
    used = {kind: rows for kind, rows in cells.items() if CELL_TYPES[kind].dimension == dimension}
    solid = False
    if dimension == 2:
        oriented = {kind: _outward(mesh, kind, rows) for kind, rows in used.items()}
        used = {kind: rows for kind, (rows, _) in oriented.items()}
        solid = all(are_faces for _, are_faces in oriented.values())
    motion = _NodeMotion.from_structure(structure, phi)
    parts = [_cell_motion(mesh, kind, rows, motion, group) for kind, rows in used.items()]
    all_cells = CellMotion(
        *(np.concatenate([getattr(part, key) for part in parts]) for key in CellMotion.__annotations__)
    )
    turning = dimension == 1 and sines and bool(motion.turns.any())
    return mean_markers(group, all_cells, dimension, _aligned(used), solid, turning)


@dataclass(frozen=True, eq=False)
class _NodeMotion:
    """Displacements and rotations (n_points, 3, n) of nodes per shape, and whether each node has them (n_points,)."""

    u: Array
    theta: Array
    moves: BoolArray
    turns: BoolArray

    @classmethod
    def from_structure(cls, structure: Structure, phi: Array) -> _NodeMotion:
        n_points = len(structure.mesh.points)
        operators = (structure.translation, structure.rotation)
        u, theta = (np.asarray(rows @ phi).reshape(n_points, 3, -1) for rows in operators)
        moves, turns = (np.diff(rows.indptr).reshape(n_points, 3).max(axis=1) > 0 for rows in operators)
        return cls(u, theta, moves, turns)


def _cell_motion(mesh: Mesh, kind: str, nodes: IntArray, motion: _NodeMotion, group: str) -> CellMotion:
    """The means over cells of one kind.

    Displacements between nodes are those of the cell's shape functions, and along sides whose ends have rotations the
    cubics of a beam; rotations are those of nodes, or of the tangents where nodes have none. Middle nodes of plates,
    which have no dofs, are left out.
    """
    cell = CELL_TYPES[kind]
    if not motion.moves[nodes].all():
        cell, nodes = CELL_TYPES[cell.corner], nodes[:, : cell.n_corners]
    if not motion.moves[nodes].all():
        raise ValueError(
            f"{np.count_nonzero(~motion.moves[nodes].all(axis=1))} cells of group {group!r} have nodes that belong to "
            "no member, so no load can be spread there; name a group of cells of members or of their faces"
        )
    at, weight = quadrature(cell.shape, POINTS)
    N, dN = cell.interpolation(at), cell.gradients(at)
    x, u = mesh.points[nodes], motion.u[nodes]
    tangents = np.einsum("qid,cia->cqda", dN, x)
    area = tangents[:, :, 0] if cell.dimension == 1 else np.cross(tangents[:, :, 0], tangents[:, :, 1])
    dA = np.linalg.norm(area, axis=2) * weight
    size = dA.sum(axis=1)
    share = dA / size[:, None]
    phi = np.einsum("cq,qi,cian->can", share, N, u)
    turns = motion.turns[nodes].all(axis=1)
    psi = np.einsum("cq,qi,cian->can", share, N, motion.theta[nodes])
    if not turns.all():
        psi[~turns] = _turns_of_tangents(tangents[~turns], dN, u[~turns], area[~turns], share[~turns])
    if cell.order == 1:
        for i, j in EDGES[cell.shape]:
            bend = _side_bend(x[:, i], x[:, j], u[:, i], u[:, j], *(motion.theta[nodes[:, k]] for k in (i, j)))
            bend *= (motion.turns[nodes[:, i]] & motion.turns[nodes[:, j]])[:, None, None, None]
            if cell.dimension == 2:
                normal = area.mean(axis=1) / np.linalg.norm(area.mean(axis=1), axis=1)[:, None]
                bend = np.einsum("cakn,ca,cb->cbkn", bend, normal, normal)
            phi += np.einsum("cq,kq,cakn->can", share, _side_functions(N, cell.shape, i, j), bend)
    position = np.einsum("cq,qi,cia->ca", share, N, x)
    corners = mesh.points[nodes[:, np.minimum(np.arange(4), cell.n_corners - 1)]]
    return CellMotion(size, position, np.einsum("cqa,q->ca", area, weight), phi, psi, corners)


def _side_bend(xi: Array, xj: Array, ui: Array, uj: Array, ti: Array, tj: Array) -> Array:
    """Slopes times length (c, 3, 2, n) at both ends of sides, from the straight line between their ends."""
    side = xj - xi
    along = side / np.linalg.norm(side, axis=1)[:, None]
    chord = uj - ui
    chord = chord - along[:, :, None] * np.einsum("ca,can->cn", along, chord)[:, None]
    ends = [np.cross(t, side[:, :, None], axis=1) - chord for t in (ti, tj)]
    return np.stack(ends, axis=2)


def _side_functions(N: Array, shape: str, i: int, j: int) -> Array:
    """Functions (2, q) whose slopes are one at either end of side i, j and zero at the other, of shape functions N.

    Along the side, at s from 0 to 1, they are s (1 - s)^2 and -s^2 (1 - s); they vanish at the other sides.
    """
    a, b = N[:, i], N[:, j]
    if shape == "quad":
        across = a + b
        a, b = (np.divide(f, across, out=np.zeros_like(f), where=across > 0.0) for f in (a, b))
        return np.stack([a * a * b * across, -a * b * b * across])
    return np.stack([a * a * b, -a * b * b])


def _turns_of_tangents(tangents: Array, dN: Array, u: Array, area: Array, share: Array) -> Array:
    """Mean rotation (c, 3, n) of the normal of surfaces, or of the tangent of lines, by displacements of the nodes."""
    moved = np.einsum("qid,cian->cqdan", dN, u)
    if tangents.shape[2] == 1:
        change = moved[:, :, 0]
    else:
        t1, t2 = tangents[:, :, 0, :, None], tangents[:, :, 1, :, None]
        change = np.cross(moved[:, :, 0], t2, axis=2) + np.cross(t1, moved[:, :, 1], axis=2)
    square = np.sum(area * area, axis=2)[:, :, None, None]
    turn = np.cross(area[:, :, :, None], change, axis=2) / square
    return np.asarray(np.einsum("cq,cqan->can", share, turn))


def _outward(mesh: Mesh, kind: str, nodes: IntArray) -> tuple[IntArray, bool]:
    """The cells, those on faces of one solid ordered such that their normals point out of it, and whether all are."""
    corners = CELL_TYPES[kind].n_corners
    keys = {tuple(row): k for k, row in enumerate(np.sort(nodes[:, :corners], axis=1).tolist())}
    sides = np.zeros(len(nodes))
    for solid, cells in mesh.cells.items():
        if CELL_TYPES[solid].dimension != 3:
            continue
        for face in FACES[CELL_TYPES[solid].shape]:
            if len(face) == corners:
                for cell, key in zip(cells, np.sort(cells[:, face], axis=1).tolist(), strict=True):
                    if (row := keys.get(tuple(key))) is not None:
                        a, b, c = mesh.points[nodes[row, :3]]
                        sides[row] += np.sign(np.cross(b - a, c - a) @ (a - mesh.points[cell].mean(axis=0)))
    turned = nodes.copy()
    turned[sides < 0] = nodes[sides < 0][:, CELL_TYPES[kind].mirrored]
    return turned, bool((sides != 0).all())


def _aligned(cells: dict[str, IntArray]) -> bool:
    """Whether no two surfaces pass through a common side in the same direction."""
    directed = [
        nodes[:, list(edge)]
        for kind, nodes in cells.items()
        for edge in EDGES[CELL_TYPES[kind].shape]
        if CELL_TYPES[kind].dimension == 2
    ]
    if not directed:
        return True
    sides = np.concatenate(directed)
    return len(np.unique(sides, axis=0)) == len(sides)


ROUNDING = 1e-12  # share of all forces, or torques, below which one is rounding


def add_load_sets(
    structure: Structure, phi: Array, sets: Mapping[str, StaticLoads]
) -> tuple[dict[str, LoadSet], dict[str, Marker]]:
    """The LoadSet of each set of static loads, and their markers on shapes phi (n_dof, n).

    The forces f_a along an axis a that have one sign act together at a marker, whose position and motion are their
    means with the weights |f_a|, and so do torques. Their resultant, moment and generalised force are exact:

        F = sum f,   M = sum (r + phi delta) x f + sum t,   Q = sum phi^T f + sum psi^T t

    Raises ValueError for forces at points that belong to no member.
    """
    load_sets: dict[str, LoadSet] = {}
    markers: dict[str, Marker] = {}
    for name, loads in sets.items():
        x = structure.mesh.points[loads.points]
        rows = (3 * loads.points[:, None] + np.arange(3)).ravel()
        u, theta = structure.translation[rows], structure.rotation[rows]
        still = np.diff(u.indptr).reshape(-1, 3).sum(axis=1) == 0
        if n_lost := np.count_nonzero(loads.forces[still].any(axis=1)):
            raise ValueError(
                f"{n_lost} forces of the set of loads {name!r} act on points that belong to no member; give their "
                "elements a family whose nodes move there"
            )
        phi_x, psi_x = (np.asarray(part @ phi).reshape(len(x), 3, phi.shape[1]) for part in (u, theta))
        zero = np.zeros((3, phi.shape[1]))
        at, vectors = [Marker(np.zeros(3), zero, zero)], [np.zeros((2, 3))]
        for axis, weight, total in _parts(loads.forces):
            at.append(Marker(weight @ x, np.tensordot(weight, phi_x, 1), zero))
            vectors.append(np.stack([total * np.eye(3)[axis], np.zeros(3)]))
        for axis, weight, total in _parts(loads.torques):
            at.append(Marker(weight @ x, zero, np.tensordot(weight, psi_x, 1)))
            vectors.append(np.stack([np.zeros(3), total * np.eye(3)[axis]]))
        names = tuple(patch_marker(name, k) for k in range(len(at)))
        forces, torques = np.stack(vectors, axis=1)
        load_sets[name] = LoadSet(names, forces, torques, loads.acceleration)
        markers |= dict(zip(names, at, strict=True))
    return load_sets, markers


def _parts(vectors: Array) -> list[tuple[int, Array, float]]:
    """Axis, weights (k,) whose sum is 1, and total of the components of vectors (k, 3) of either sign."""
    sizes = {(axis, sign): np.maximum(sign * vectors[:, axis], 0.0) for axis in range(3) for sign in (1.0, -1.0)}
    least = ROUNDING * np.abs(vectors).sum()
    return [
        (axis, size / size.sum(), sign * float(size.sum()))
        for (axis, sign), size in sizes.items()
        if size.sum() > least
    ]
