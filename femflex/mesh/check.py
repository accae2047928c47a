"""Checks of a mesh before any mechanics: cells without size, inside-out solids, points without cells."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.merge import coincident, unused
from femflex.mesh.mesh import Mesh
from femflex.mesh.quality import qualities, sizes
from femflex.warning import PhysicsWarning

COINCIDENT = 1e-9  # of the mesh's extent: points closer than this are reported as coincident
LARGEST = 1e30  # m, of a coordinate: above it areas and distances overflow
FLAT = 1e-12  # length, area or volume below this times the longest edge to that power counts as zero


def check(mesh: Mesh, source: str = "the mesh", strict: bool = True) -> None:
    """Raise ValueError for coordinates above LARGEST, and for surfaces and solids without size or turned inside out.
    Warn of lines without length, unused points and coincident points.

    strict: if False, bad surfaces and solids are warned of, too.
    """
    if (far_points := np.flatnonzero(np.abs(mesh.points).max(axis=1, initial=0.0) > LARGEST)).size:
        raise ValueError(
            f"{source}: {len(far_points)} of {len(mesh.points)} points have coordinates above {LARGEST:g} m, the first "
            f"is number {far_points[0]} at {_position_text(mesh.points[far_points[0]])}; correct the file or its unit"
        )
    without_size = _cells_without_size(mesh)
    # members refuse them
    short = [without_size.pop(kind) for kind in list(without_size) if CELL_TYPES[kind].dimension == 1]
    problems = [*without_size.values(), *_inverted(mesh)]
    if problems and strict:
        raise ValueError(f"{source}: " + " ".join([*problems, *short]))
    for text in (*problems, *short, _unused_points(mesh), _coincident(mesh)):
        if text:
            warnings.warn(f"{source}: {text}", PhysicsWarning, stacklevel=3)


def _cells_without_size(mesh: Mesh) -> dict[str, str]:
    problems = {}
    for cell, nodes in mesh.cells.items():
        kind = CELL_TYPES[cell]
        corners = mesh.points[nodes[:, : kind.n_corners]]
        longest = np.linalg.norm(corners - corners[:, :1], axis=2).max(axis=1)
        flat = np.abs(sizes(mesh.points, cell, nodes)) <= FLAT * longest**kind.dimension
        if kind.dimension and flat.any():
            first = int(np.argmax(flat))
            measure = ("", "length", "area", "volume")[kind.dimension]
            problems[cell] = (
                f"{int(flat.sum())} of {len(nodes)} cells of type {cell} have no {measure}, the first is number "
                f"{first} at {_position_text(corners[first].mean(axis=0))}; remove them or move their nodes apart."
            )
    return problems


def _inverted(mesh: Mesh) -> list[str]:
    problems = []
    for cell, nodes in mesh.cells.items():
        if CELL_TYPES[cell].dimension < 2:
            continue
        bad = np.flatnonzero(qualities(mesh.points, cell, nodes) < 0)
        if len(bad):
            problems.append(
                f"{len(bad)} of {len(nodes)} cells of type {cell} are folded or turned inside out, the first is number "
                f"{bad[0]} at {_position_text(mesh.points[nodes[bad[0]]].mean(axis=0))}; mesh again or correct their "
                "node order."
            )
    return problems


def _unused_points(mesh: Mesh) -> str:
    free = unused(mesh)
    if not len(free):
        return ""
    groups = sorted(group for group, rows in mesh.point_groups.items() if np.isin(rows, free).any())
    where = f"; some are in the point groups {groups}" if groups else ""
    return (
        f"{len(free)} of {len(mesh.points)} points belong to no cell{where}. They have neither stiffness nor mass, "
        "and nothing can be attached to them; connect them, or remove them from the mesh."
    )


def _coincident(mesh: Mesh) -> str:
    extent = float(np.linalg.norm(np.ptp(mesh.points, axis=0))) if len(mesh.points) else 0.0
    pairs = coincident(mesh.points, COINCIDENT * extent)
    if not len(pairs):
        return ""
    position = mesh.points[pairs[0, 0]]
    return (
        f"{len(pairs)} pairs of points lie within {COINCIDENT * extent:.3g} m (the mesh is {extent:.6g} m across); "
        f"the first is {pairs[0].tolist()} at {_position_text(position)}. The parts are not joined there; fuse them "
        "with mesh.merged(..., tolerance) or in the mesher if they should be."
    )


def _position_text(position: Array) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in position) + ") m"


def reorient_solids(mesh: Mesh, source: str = "the mesh") -> Mesh:
    """The mesh with inside-out solid cells mirrored if that makes them regular; warns if there are any.

    Cells that are folded in both orders do not change.
    """
    cells = dict(mesh.cells)
    for name, nodes in mesh.cells.items():
        cell = CELL_TYPES[name]
        if cell.dimension != 3:
            continue
        mirrored = nodes[:, cell.mirrored]
        inverted = qualities(mesh.points, name, nodes) < 0
        inverted[inverted] = qualities(mesh.points, name, mirrored[inverted]) > 0
        if inverted.any():
            cells[name] = np.where(inverted[:, None], mirrored, nodes)
            count, first_text = f"all {len(nodes)}", ""
            if not inverted.all():
                first = int(np.argmax(inverted))
                x, y, z = mesh.points[nodes[first]].mean(axis=0)
                count = f"{int(inverted.sum())} of {len(nodes)}"
                first_text = f", the first is number {first} at ({x:.6g}, {y:.6g}, {z:.6g}) m"
            warnings.warn(
                f"{source}: {count} cells of type {name} are inside out (their volumes are negative){first_text}; "
                "their nodes are taken in the mirrored order. Correct the order of nodes in the file",
                PhysicsWarning,
                stacklevel=3,
            )
    return replace(mesh, cells=cells)
