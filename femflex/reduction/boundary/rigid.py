"""Vectors of a Structure's dofs for motions given at the nodes, the dofs that clamps fix, and mechanisms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NoReturn

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph
from scipy.sparse.linalg import splu

from femflex.arrays import Array, IntArray
from femflex.fem.eigen.modes import without_stiffness
from femflex.fem.eigen.shift_invert import factorise
from femflex.fem.structure import Structure
from femflex.fem.support import COMPONENTS, Supports

ROUNDING = 1e-13  # force on a dof below which it is zero, over the largest sum of terms at any dof
RANK = 1e-9  # smallest singular value of unit columns below which they count as dependent
RIGID = ("rigid",)  # key of the rigid motions that a Structure has cached
DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")


def dofs_of_node_motion(structure: Structure, translation: Array, rotation: Array) -> Array:
    """Dof vectors (n_dof, k) of motions given as node translations and rotations (n_points, 3, k).

    Dofs at nodes follow the nodes (a flat plate's node takes the part of the rotation it can follow); the dofs that
    belong to no node take the values of least strain energy, K_ee x_e = -K_en x_n, except those of tethers and
    membranes, which are zero where the motion of the nodes is linear in position.
    """
    x, nodal, extra = _dofs_at_nodes(structure, translation, rotation)
    if extra.size:
        K = structure.K[extra]
        load, size = K[:, nodal] @ x[nodal], abs(K[:, nodal]) @ np.abs(x[nodal])
        pulled = np.flatnonzero((np.abs(load) > ROUNDING * size.max(axis=0)).any(axis=0))
        if pulled.size:  # none in a rigid motion of fields that are linear without these dofs
            x[np.ix_(extra, pulled)] = -factorise(K[:, extra]).solve(np.ascontiguousarray(load[:, pulled]))
    return x


def _dofs_at_nodes(structure: Structure, translation: Array, rotation: Array) -> tuple[Array, IntArray, IntArray]:
    """Dof vectors (n_dof, k) of motions of the nodes, all other dofs zero; numbers of dofs at nodes, and of those that
    belong to none and are not zero where the motion of the nodes is linear in position."""
    k = translation.shape[2]
    A = sparse.vstack([structure.translation, structure.rotation]).tocsc()
    nodal = np.flatnonzero(np.diff(A.indptr) > 0)
    A = A[:, nodal]
    motion = np.concatenate([translation.reshape(-1, k), rotation.reshape(-1, k)])
    x = np.zeros((structure.n_dof, k))
    x[nodal] = _least_squares((A.T @ A).tocsc(), np.ascontiguousarray(A.T @ motion))
    free_of_nodes = np.ones(structure.n_dof, bool)
    free_of_nodes[nodal] = free_of_nodes[structure.T[structure.numbering.fading_dofs].indices] = False
    return x, nodal, np.flatnonzero(free_of_nodes)


def _least_squares(AA: sparse.csc_array, Ab: Array) -> Array:
    """x (n, k) of A^T A x = A^T b; where every dof is a component of one node's motion, A^T A is diagonal."""
    if AA.nnz == len(Ab) and np.array_equal(AA.indices, np.arange(len(Ab))):
        return np.asarray(Ab / AA.data[:, None])
    return np.asarray(splu(AA).solve(Ab))


def rigid_shapes(structure: Structure, about: Array | None = None) -> Array:
    """Dof vectors (n_dof, 6) of three unit translations and three unit rotations about a point (default: origin)."""
    R: Array = structure.recalled(RIGID, lambda: dofs_of_node_motion(structure, *rigid_motion(structure.mesh.points)))
    if about is None:
        return R.copy()
    e = np.eye(3)
    return np.column_stack([R[:, :3], R[:, 3:] - R[:, :3] @ np.cross(e, np.asarray(about, float)).T])


def rigid_motion(r: Array) -> tuple[Array, Array]:
    """Translations and rotations (n, 3, 6) of places r (n, 3) in three unit translations and three unit rotations."""
    translation, rotation = np.zeros((len(r), 3, 6)), np.zeros((len(r), 3, 6))
    translation[:, :, :3] = np.eye(3)
    translation[:, :, 3:] = np.cross(np.eye(3)[None], r[:, None, :]).swapaxes(1, 2)  # e_k x r in column k
    rotation[:, :, 3:] = np.eye(3)
    return translation, rotation


def linear_shapes(structure: Structure) -> Array:
    """Dof vectors (n_dof, 12) of unit motions z_a e_b, z = (1, r), that are uniform or linear in position.

    Dofs that belong to no node stay zero where no rigid motion moves them: the fields are linear without them. Least
    energy would have these relax the strain at free edges.
    """
    motion = linear_motion(structure.mesh.points)
    x, _, extra = _dofs_at_nodes(structure, *motion)
    return dofs_of_node_motion(structure, *motion) if rigid_shapes(structure)[extra].any() else x


def linear_motion(r: Array) -> tuple[Array, Array]:
    """Translations z_a e_b, z = (1, r), at places r (n, 3), and their rotations, half the curl: (n, 3, 12) each."""
    e = np.eye(3)
    z = np.column_stack([np.ones(len(r)), r])
    turn = np.concatenate([np.zeros((1, 3, 3)), np.cross(e[:, None], e[None]) / 2])  # e_a x e_b / 2
    translation = np.einsum("na,bc->ncab", z, e).reshape(len(r), 3, 12)
    return translation, np.broadcast_to(turn.transpose(2, 0, 1).reshape(1, 3, 12), (len(r), 3, 12))


def independent_columns(columns: Array) -> Array:
    """Indices (k,) of a largest set of independent columns, found in their order."""
    kept: list[int] = []
    basis = np.zeros((columns.shape[0], 0))
    for j, column in enumerate((columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)).T):
        rest = column - basis @ (basis.T @ column)
        rest -= basis @ (basis.T @ rest)
        size = np.linalg.norm(rest)
        if size > 1e-6:
            kept.append(j)
            basis = np.column_stack([basis, rest / size])
    return np.array(kept, np.int64)


def is_held_by_springs(K: sparse.csr_array, M: sparse.csr_array, R: Array) -> bool:
    """Whether the stiffness K (n_dof, n_dof) [SI] resists all rigid motions R (n_dof, r), by springs to ground."""
    R = R[:, independent_columns(R)]
    R = R / np.linalg.norm(R, axis=0)
    return not without_stiffness(K, M, R @ np.linalg.eigh(R.T @ (K @ R))[1]).any()


def check_no_rigid_motion(R: Array, phi: Array, weight: Array) -> None:
    """Raise ValueError unless the shapes phi are independent of each other and of the rigid motions R.

    weight (n_dof,) makes dofs of different units comparable, e.g. the root of the stiffness diagonal. Measured as the
    smallest singular value of the unit columns of [R, phi].
    """
    if not phi.shape[1]:
        return
    alone = _smallest_singular_value(weight[:, None] * phi)
    if alone < RANK:
        raise ValueError(
            f"the {phi.shape[1]} shapes are not independent (smallest singular value {alone:.1e} of unit columns); "
            "leave out shapes that repeat others."
        )
    R = weight[:, None] * R
    together = _smallest_singular_value(np.column_stack([R[:, independent_columns(R)], weight[:, None] * phi]))
    if together < RANK:
        raise ValueError(
            "the shapes contain a rigid motion of the body frame "
            f"(smallest singular value {together:.1e} of rigid motions and shapes together, unit columns); "
            "clamp a group, name a reference interface, or use free-free modes."
        )


def _smallest_singular_value(columns: Array) -> float:
    norms = np.linalg.norm(columns, axis=0)
    if not norms.all():
        return 0.0
    if columns.shape[0] < columns.shape[1]:
        return 0.0
    return float(np.linalg.svd(np.linalg.qr(columns / norms, mode="r"), compute_uv=False)[-1])


Groups = str | Sequence[str] | Supports  # names; or name -> fixed components, e.g. ("x", "y", "z"), or a Support

SHOWN = 5  # unconnected parts, in addition to the largest, that a message lists


def names(groups: Groups) -> tuple[str, ...]:
    """Names of the groups."""
    return (groups,) if isinstance(groups, str) else tuple(groups)


def held_dofs(structure: Structure, clamp: Groups) -> IntArray:
    """Numbers (k,) of the independent dofs, ascending, that the clamps fix. A mapping names the components fixed at
    each group."""
    return structure.constrained_dofs(clamp if isinstance(clamp, Mapping) else dict.fromkeys(names(clamp), COMPONENTS))


def free_dofs(structure: Structure, held: IntArray) -> IntArray:
    """Numbers (k,) of independent dofs, ascending, that are not fixed."""
    return np.delete(np.arange(structure.n_dof), held)


def refuse_mechanism(structure: Structure, held: IntArray, clamp: tuple[str, ...], loose: Array) -> NoReturn:
    """Raise ValueError with the number of motions that a clamp leaves without stiffness, and with groups to clamp.

    loose: these motions (n_dof, k) [m, rad].
    """
    n_null = loose.shape[1]
    R = rigid_shapes(structure, about=structure.mesh.points.mean(axis=0))
    n_rigid = len(independent_columns(R)) - len(independent_columns(R[held]))
    parts = _parts(structure)
    others = [group for group in structure.mesh.groups if group not in clamp]
    where = f"clamped at {list(clamp)}" if clamp else "clamped nowhere"
    if n_null <= n_rigid:
        what = f"{n_null} rigid motion{'s' * (n_null > 1)} without stiffness"
        hint = f"Clamp one of its other groups, {others}." if held.size else f"Clamp one of its groups, {others}."
    else:
        what = f"{n_null} motion{'s' * (n_null > 1)} without stiffness, of which {n_rigid} are rigid"
        why = (
            f"falls into {len(parts)} parts that share no node{_smaller_parts_text(structure, parts)}"
            if len(parts) > 1
            else f"is a mechanism{_mechanism_text(structure, loose)}"
        )
        hint = f"It {why}: join the parts or brace it, or clamp more of its groups, {others}."
    raise ValueError(f"the structure, {where}, has {what}. {hint}")


def _mechanism_text(structure: Structure, loose: Array) -> str:
    """A text on the node that the first motion without stiffness moves most.

    A plate joined at a single node rotates about its normal there, against which it has no stiffness.
    """
    translation = (structure.translation @ loose[:, 0]).reshape(-1, 3)
    rotation = (structure.rotation @ loose[:, 0]).reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    shift, arc = np.linalg.norm(translation, axis=1), np.linalg.norm(rotation, axis=1) * size
    verb, amounts, vectors = ("moves", shift, translation) if shift.max() >= arc.max() else ("turns", arc, rotation)
    node = int(amounts.argmax())
    direction = vectors[node] / np.linalg.norm(vectors[node])
    along = ", ".join(f"{round(float(x), 3) + 0.0:g}" for x in direction)
    plates = any(not cell.startswith(("line", "vertex")) for cell in structure.mesh.cells)
    hint = "; a plate joined at one node alone is free to turn about its normal there: join it along an edge"
    text = f"{_node_text(structure, node)} {verb} {'along' if verb == 'moves' else 'about'} ({along})"
    return f" ({text}{hint if plates else ''})"


def _node_text(structure: Structure, node: int) -> str:
    """A text with the name of a node, if it has one, and its position."""
    position = ", ".join(f"{x:.4g}" for x in structure.mesh.points[node])
    name = structure.point_names.get(node)
    return f"{name} at ({position})" if name else f"the node at ({position})"


def _smaller_parts_text(structure: Structure, parts: list[IntArray]) -> str:
    """A text on the parts other than the largest: their numbers of nodes, and one node of each; SHOWN parts at most."""
    smaller = sorted(parts, key=lambda part: -len(part))[1:]
    listed = [f"{len(part)} nodes, among them {_node_text(structure, int(part[0]))}" for part in smaller[:SHOWN]]
    more = f" and {len(smaller) - SHOWN} more" if len(smaller) > SHOWN else ""
    return f" (in addition to the largest: {'; '.join(listed)}{more})"


def _parts(structure: Structure) -> list[IntArray]:
    """The nodes (k,) of each unconnected part. Common dofs, or stiffness between dofs, connect nodes."""
    rows = sparse.vstack([structure.translation, structure.rotation]).tocoo()
    node = rows.coords[0] // 3 % len(structure.mesh.points)
    incidence = sparse.coo_array(
        (np.ones(rows.nnz), (node, rows.coords[1])), shape=(len(structure.mesh.points), structure.n_dof)
    )
    joined = (incidence @ abs(structure.K) @ incidence.T).tocsr()
    used = np.unique(node)
    count, part = csgraph.connected_components(joined[used][:, used], directed=False)
    return [used[part == k] for k in range(count)]
