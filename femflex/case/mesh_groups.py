"""References of bodies to their meshes: groups that exist and are not empty, and markers on the mesh."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femflex.case.body import FlexibleTable
from femflex.fem.connections import Equation
from femflex.noun.problems import Problem, suggestion_text

if TYPE_CHECKING:
    from femflex.mesh import Mesh

UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "inch": 0.0254}  # of a mesh file, in metres
NEAR = 0.05  # distance over mesh size beyond which a marker's position counts as a mistake


def group_problems(name: str, table: FlexibleTable, folder: Path) -> list[Problem]:
    """References of the body that its mesh does not have, or the reason why the mesh cannot be read."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # given again when the body is built
            return list(mesh_problems(name, table, file_mesh(folder, table)))
    except (ValueError, OSError) as error:
        return [Problem(f"bodies.{name}.mesh", str(error))]


def file_mesh(folder: Path, table: FlexibleTable) -> Mesh:
    """The mesh of a body from its file, in metres. Raises ValueError and OSError."""
    from femflex.mesh import read_mesh

    mesh = read_mesh(folder / table.source, dict(table.groups) or None)
    return with_regions(mesh if table.mesh_unit == "m" else mesh.scaled(UNITS[table.mesh_unit]), table)


def with_regions(mesh: Mesh, table: FlexibleTable) -> Mesh:
    """The mesh with the regions of a body, the whole groups that it names, and the reference nodes of connections."""
    from femflex.mesh.regions import with_box, with_points, with_whole_groups

    file_points = mesh.points
    mesh = with_whole_groups(mesh, [group for _, group in referenced_groups("", table)])
    for name, region in table.regions.items():
        if region.box is not None:
            mesh = with_box(mesh, name, *region.box, within=region.within)
        elif region.points is not None:
            mesh = with_points(mesh, name, region.points)
        else:
            nearest = np.argmin(np.linalg.norm(file_points - np.array(region.nearest), axis=1))
            mesh = mesh.with_groups(points={name: [nearest]})
    for connection in table.connections:
        mesh = connection.with_reference_node(mesh)
    return mesh


def mesh_problems(name: str, table: FlexibleTable, mesh: Mesh) -> Iterator[Problem]:
    """Groups that the mesh lacks or that are empty, and markers that are not on it."""
    for marker, entry in table.markers.items():
        if entry.position is not None:
            position = np.array(entry.position)
            yield from _distance_problems(
                f"bodies.{name}.markers.{marker}.position", mesh, mesh.nearest_point(position), position
            )
    node_groups = {m.group for m in table.members if m.family == "nodes"}  # groups of points are permitted there
    for key_path, group in referenced_groups(name, table):
        if group not in mesh.groups:
            text = f"found {group!r}, which is no group of {table.source}; {suggestion_text(group, mesh.groups)}"
            groups_text = f" (it has {', '.join(map(repr, mesh.groups))})" if "known are" not in text else ""
            yield Problem(key_path, text + groups_text)
            continue
        try:
            mesh.group_cells(group) if ".members[" in key_path and group not in node_groups else mesh.group_points(
                group
            )
        except ValueError as error:
            yield Problem(key_path, str(error))


def referenced_groups(name: str, table: FlexibleTable) -> Iterator[tuple[str, str]]:
    """Key paths at which a body refers to groups of its mesh, and the names of these groups."""
    yield from ((f"bodies.{name}.members[{m.group}].group", m.group) for m in table.members)
    yield from ((f"bodies.{name}.point_masses[{m.group}].group", m.group) for m in table.point_masses)
    for connection in table.connections:
        key_path = f"bodies.{name}.connections[{connection.kind}]"
        if isinstance(connection, Equation):
            yield from ((f"{key_path}.terms", term.group) for term in connection.terms)
        else:
            yield f"{key_path}.group", connection.group
            yield f"{key_path}.reference", connection.reference_group
    for i, b in enumerate(table.bushings):
        yield from ((f"bodies.{name}.bushings[{i}].{key}", g) for key, g in (("group", b.group), ("to", b.to)) if g)
    for key in ("forces", "masses"):
        yield from ((f"bodies.{name}.preload.{key}", group) for group in getattr(table.preload, key, ()))
    for key in ("clamp", "interfaces", "loads"):
        yield from ((f"bodies.{name}.reduction.{key}", group) for group in getattr(table.reduction, key, ()))
    for marker, entry in table.markers.items():
        if entry.position is None:
            key = f"bodies.{name}.markers.{marker}"
            yield (f"{key}.group", entry.group) if entry.group is not None else (key, marker)


def _distance_problems(key_path: str, mesh: Mesh, index: int, position: np.ndarray) -> list[Problem]:
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    distance = float(np.linalg.norm(mesh.points[index] - position))
    if distance <= NEAR * size:
        return []
    text = (
        f"found {position.tolist()} m, {distance:.4g} m from the nearest point of the mesh "
        f"{mesh.points[index].tolist()}; name a place on the mesh"
    )
    return [Problem(key_path, text)]
