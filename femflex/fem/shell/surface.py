"""Shells on a surface that is given by its equation F(x, y, z) = 0: nodes are moved onto it, and its normals are the
directors.

A cylinder is "x**2 + y**2 - R**2", a sphere "x**2 + y**2 + z**2 - R**2", a paraboloid "x**2 + y**2 - 4 * F * z" and a
graph "z - f(x, y)", with numbers for R and F. A node moves along the normal by Newton's method,
x - F grad F / |grad F|^2; this also moves middle nodes on chords, and nodes of a refined mesh, onto the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.fem.formula import formula_of_position
from femflex.fem.option import member_options
from femflex.mesh.cells import CELL_TYPES

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


STEP = 1e-5  # of the extent, of central differences: their error is 1e-10, as that of rounding
OFF = 0.1  # of the longest side at a node, that it may lie off the surface
CLOSE = 1e-10  # of the extent, within which nodes are on it
TIMES = 20  # Newton steps


def gradient(text: str, x: Array, extent: float) -> Array:
    """Gradient (n, 3) of the formula at positions x (n, 3), by central differences over STEP of the extent [m]."""
    h = STEP * extent
    sides = [formula_of_position(text, x + h * e) - formula_of_position(text, x - h * e) for e in np.eye(3)]
    return np.stack(sides, axis=-1) / (2 * h)


def normals(text: str, x: Array, where: str) -> Array:
    """Unit normals (n, 3) of the surface at positions x (n, 3). Raises ValueError where it has none."""
    grad = gradient(text, x, _extent(x))
    size = np.linalg.norm(grad, axis=1)
    if not (size > 0).all():
        position = ", ".join(f"{c:.6g}" for c in x[int(np.argmin(size))])
        raise ValueError(
            f"{where}: surface {text!r} has no normal at ({position}) m, where its gradient is zero; rewrite it"
        )
    return np.asarray(grad / size[:, None])


def move_onto_surfaces(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """Return the mesh with the nodes of shell members that have a `surface` moved onto it, and notes about it.

    Raises ValueError for a formula that is not understood, and for nodes that lie far off.
    """
    points, notes = mesh.points.copy(), []
    for member in members:
        text = member_options(member)["surface"] if member.family == "shell" else None
        if text is None:
            continue
        where = f"shell on group {member.group!r}"
        if not isinstance(text, str):
            raise ValueError(f"{where} has surface {text!r}; give a formula of x, y and z that is zero on the surface")
        cells = mesh.group_cells(member.group)
        nodes = np.unique(np.concatenate([rows.ravel() for rows in cells.values()]))
        try:
            projected = _project(text, points[nodes], where)
        except ValueError as error:
            raise ValueError(str(error) if where in str(error) else f"{where}: surface: {error}") from None
        distance = np.linalg.norm(projected - points[nodes], axis=1)
        side = np.zeros(len(points))
        for name, rows in cells.items():
            x = points[rows[:, : CELL_TYPES[name].n_corners]]
            longest = np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2).max(axis=1)
            np.maximum.at(side, rows, longest[:, None])
        too_far = distance > OFF * side[nodes]
        if too_far.any():
            worst = int(np.argmax(distance / side[nodes]))
            position = ", ".join(f"{c:.6g}" for c in points[nodes[worst]])
            raise ValueError(
                f"{where}: {int(too_far.sum())} of {len(nodes)} nodes lie off the surface {text!r}, the node at "
                f"({position}) m by {distance[worst]:.3g} m, over {OFF:.0%} of its element's side; correct the formula "
                "or leave it out"
            )
        points[nodes] = projected
        if distance.max() > CLOSE * _extent(points[nodes]):
            count = int((distance > CLOSE * _extent(points[nodes])).sum())
            notes.append(
                f"{count} of {len(nodes)} nodes of {where} are moved onto its surface, by up to {distance.max():.3g} m"
            )
    return (replace(mesh, points=points), tuple(notes)) if notes else (mesh, ())


def _project(text: str, x: Array, where: str) -> Array:
    extent, start = _extent(x), x
    for _ in range(TIMES):
        grad = gradient(text, x, extent)
        square = np.sum(grad**2, axis=1)
        if not (square > 0).all():
            normals(text, x, where)
        step = (formula_of_position(text, x) / square)[:, None] * grad
        x = x - step
        if np.abs(step).max() < 1e-13 * extent:
            break
        if np.linalg.norm(x - start, axis=1).max() > extent:
            break
    return x


def _extent(x: Array) -> float:
    return float(np.linalg.norm(np.ptp(x, axis=0))) or 1.0
