"""Surfaces of rigid bodies for drawing: boxes, cylinders, mesh files, or the box of equal mass and inertia."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import Skin
from femflex.case.body import RigidTable
from femflex.case.case import Case
from femflex.case.mesh_groups import UNITS
from femflex.case.shape import BoxShape, CylinderShape, MeshShape

Part = tuple[Array, dict[str, IntArray]]

SIDES = 32  # of a drawn cylinder
WATER = 1000.0  # kg/m^3
CORNERS = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]) / 2
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [2, 3, 7, 6], [1, 2, 6, 5], [0, 4, 7, 3]])


def rigid_skin(case: Case, table: RigidTable) -> Skin:
    """The surface of a rigid body for drawing."""
    parts = [_shape_part(case, shape) for shape in table.shapes] or [equivalent_box(table)]
    return joined_skin(parts)


def joined_skin(parts: Iterable[Part]) -> Skin:
    """A single skin of several parts (points (n, 3), cells by type), without shapes."""
    points: list[Array] = []
    cells: dict[str, list[IntArray]] = {}
    n_points = 0
    for part_points, part_cells in parts:
        for kind, rows in part_cells.items():
            cells.setdefault(kind, []).append(rows + n_points)
        points.append(part_points)
        n_points += len(part_points)
    return Skin(
        np.concatenate(points), {kind: np.concatenate(rows) for kind, rows in cells.items()}, np.zeros((0, n_points, 3))
    )


def box(size: Array, position: Array, C: Array) -> Part:
    """A box with edges `size` (3,) [m] along the columns of C, centred at `position`."""
    return CORNERS * size @ C.T + position, {"quad": FACES}


def equivalent_box(table: RigidTable) -> Part:
    """The uniform box of the body's mass and inertia: edges sqrt(12 q / m), q = int x^2 dm along principal axes.

    For a point mass, the cube of WATER that has its mass.
    """
    principal, axes = np.linalg.eigh(central_inertia(table))
    second = np.maximum(principal.sum() / 2 - principal, 0.0)
    axes = axes * np.sign(np.linalg.det(axes))
    size = np.sqrt(12 * second / table.mass) if second.any() else np.full(3, (table.mass / WATER) ** (1 / 3))
    return box(np.maximum(size, 0.01 * size.max()), np.array(table.center_of_mass), axes)


def central_inertia(table: RigidTable) -> Array:
    """Inertia (3, 3) about the centre of mass, without an imbalance [kg m^2]."""
    centre, J = np.array(table.center_of_mass), np.array(table.inertia)
    if table.inertia_about == "center_of_mass":
        return J
    return J - table.mass * ((centre @ centre) * np.eye(3) - np.outer(centre, centre))


def _shape_part(case: Case, shape: BoxShape | CylinderShape | MeshShape) -> Part:
    position = np.array(shape.position)
    if isinstance(shape, CylinderShape):
        points, cells = _cylinder(shape.radius, shape.length, np.array(shape.axis))
        return points + position, cells
    C = np.eye(3) if shape.orientation is None else np.array(shape.orientation)
    if isinstance(shape, BoxShape):
        return box(np.array(shape.size), position, C)
    from femflex.mesh import read_mesh

    mesh = read_mesh(case.file_path(shape.file)).scaled(UNITS[shape.mesh_unit])
    return mesh.points @ C.T + position, _surface(mesh.cells)


def _surface(cells: dict[str, IntArray]) -> dict[str, IntArray]:
    """The cells of the surfaces and lines of a mesh, with their corner nodes only."""
    corners = {"line": 2, "triangle": 3, "quad": 4}
    corner_cells: dict[str, list[IntArray]] = {}
    for kind, rows in cells.items():
        shape = kind.rstrip("0123456789")
        if shape in corners:
            corner_cells.setdefault(shape, []).append(rows[:, : corners[shape]])
    if not corner_cells:
        raise ValueError(f"a mesh to draw needs lines, triangles or quads; it has {sorted(cells)}")
    return {kind: np.concatenate(rows) for kind, rows in corner_cells.items()}


def _cylinder(radius: float, length: float, axis: Array) -> Part:
    z = axis / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    angle = np.arange(SIDES) * 2 * np.pi / SIDES
    ring = radius * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y)
    ends = np.array([-z, z]) * length / 2
    points = np.concatenate([ring + ends[0], ring + ends[1], ends])
    k, k1 = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    quads = np.stack([k, k1, k1 + SIDES, k + SIDES], axis=1)
    bottom = np.stack([k1, k, np.full(SIDES, 2 * SIDES)], axis=1)
    top = np.stack([k + SIDES, k1 + SIDES, np.full(SIDES, 2 * SIDES + 1)], axis=1)
    return points, {"quad": quads, "triangle": np.concatenate([bottom, top])}
