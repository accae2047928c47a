"""Gmsh's entities: cells that share type and physical groups, and the section of format 4.1 that lists them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.contents import group_classes
from femflex.mesh.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Entity:
    """Cells of one type with the same physical groups, and the points (k, 3) they lie on."""

    dimension: int
    number: int
    cell: str
    nodes: IntArray
    groups: list[int]
    points: Array


def physical_tags(mesh: Mesh) -> dict[tuple[int, str], int]:
    """Number of the physical group of every (dimension, name): cell groups under each dimension they have."""
    keys = [
        (dim, group)
        for group, by_type in mesh.cell_groups.items()
        for dim in sorted({CELL_TYPES[cell].dimension for cell in by_type}) or [mesh.dimension]
    ]
    keys += [(0, group) for group in mesh.point_groups]
    bad = [name for _, name in keys if '"' in name or "\n" in name]
    if bad:
        raise ValueError(f"group names {bad} have a quotation mark or line break; Gmsh files cannot hold them.")
    return {key: number + 1 for number, key in enumerate(dict.fromkeys(keys))}


def entities_of(mesh: Mesh, tags: dict[tuple[int, str], int]) -> list[Entity]:
    """One entity for all cells with the same type and groups; one for each point of the point groups."""
    entities: list[Entity] = []
    tags_of_point: dict[int, list[int]] = {}
    for group, points in mesh.point_groups.items():
        for point in points:
            tags_of_point.setdefault(int(point), []).append(tags[0, group])
    for k, point in enumerate(sorted(tags_of_point)):
        entities.append(Entity(0, k + 1, "vertex", np.array([[point]]), tags_of_point[point], mesh.points[[point]]))
    counts = [len(entities), 0, 0, 0]
    for cell, nodes in mesh.cells.items():
        dim = CELL_TYPES[cell].dimension
        groups = {group: by_type[cell] for group, by_type in mesh.cell_groups.items() if cell in by_type}
        for kind, members in group_classes(groups, len(nodes)):
            counts[dim] += 1
            rows = nodes[members]
            numbers = [tags[dim, group] for group in kind]
            entities.append(Entity(dim, counts[dim], cell, rows, numbers, mesh.points[np.unique(rows)]))
    return entities


def read_entities(section: bytes, binary: bool, width: int) -> dict[tuple[int, int], list[int]]:
    """Numbers of the physical groups by (dimension, entity number); width: bytes of a size in the binary file."""
    take = _binary_taker(section, width) if binary else _text_taker(section)
    groups: dict[tuple[int, int], list[int]] = {}
    if not section:
        return groups
    counts = take("size", 4)
    for dimension, count in enumerate(counts):
        for _ in range(int(count)):
            number = int(take("int", 1)[0])
            take("double", 3 if dimension == 0 else 6)  # position or bounding box
            groups[dimension, number] = [int(n) for n in take("int", int(take("size", 1)[0]))]
            if dimension:
                take("int", int(take("size", 1)[0]))  # bounding entities
    return groups


def entities_section(entities: list[Entity], binary: bool) -> bytes:
    """The complete section, with its first and last line."""

    def encode(kind: str, values: list[int] | Array) -> bytes:
        if binary:
            return np.asarray(values).astype(_types(8)[kind]).tobytes()
        return "".join(f"{v:.16g} " if kind == "double" else f"{v} " for v in values).encode()

    def line_end() -> bytes:
        return b"" if binary else b"\n"

    parts = [
        b"$Entities\n",
        encode("size", [sum(e.dimension == dim for e in entities) for dim in range(4)]),
        line_end(),
    ]
    for entity in sorted(entities, key=lambda e: (e.dimension, e.number)):
        low, high = entity.points.min(axis=0), entity.points.max(axis=0)
        parts += [encode("int", [entity.number]), encode("double", low)]
        parts += [encode("double", high)] if entity.dimension else []
        parts += [encode("size", [len(entity.groups)]), encode("int", entity.groups)]
        parts += [encode("size", [0])] if entity.dimension else []  # no bounding entities given
        parts.append(line_end())
    return b"".join([*parts, b"\n" if binary else b"", b"$EndEntities\n"])


def _types(width: int) -> dict[str, np.dtype[Any]]:
    return {"size": np.dtype(f"<u{width}"), "int": np.dtype("<i4"), "double": np.dtype("<f8")}


def _text_taker(section: bytes) -> Callable[[str, int], list[float]]:
    words = iter(section.split())
    return lambda kind, count: [float(next(words)) for _ in range(count)]


def _binary_taker(section: bytes, width: int) -> Callable[[str, int], list[float]]:
    types = _types(width)
    position = 0

    def take(kind: str, count: int) -> list[float]:
        nonlocal position
        values = np.frombuffer(section, types[kind], count, position)
        position += values.nbytes
        return [float(value) for value in values]

    return take
