"""The dofs that a clamp fixes, and the error message for a structure that is a mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NoReturn

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from femflex.arrays import Array, IntArray
from femflex.fem.structure import Structure
from femflex.fem.support import COMPONENTS, Supports
from femflex.reduction.boundary.rigid import independent_columns, rigid_shapes

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
