"""Gmsh .msh, 2.2 and 4.1, text and binary: groups are physical groups, points of a group physical points.

meshio keeps one physical group per element, confuses groups of equal name but different dimension, and fails if only
some entities are in groups. Therefore the sections that define groups are read and written here; meshio handles only
the nodes and elements.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.contents import Block, Contents, group_classes, without_repeated_cells
from femflex.mesh.formats.guards import check_gmsh_counts
from femflex.mesh.formats.register import WriteOptions, load_meshio, meshio_call, register
from femflex.mesh.mesh import Mesh

Tag = tuple[int, int]  # dimension, number

NAME = "Gmsh .msh"
HINT = "The file may be cut short; write it again, without parametric coordinates (Mesh.SaveParametric = 0)."
KINDS = ("point", "line", "surface", "volume")
# meshio returns the 18-node wedge in Gmsh's order: edges (0,1) (0,2) (0,3) (1,2) ...; VTK's order follows the faces.
WEDGE18_FROM_GMSH = [0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16]


def read_gmsh(path: Path) -> Contents:
    """Contents of a .msh file, with its physical groups; groups without a name are called surface_7 and so on."""
    data = path.read_bytes()
    version, binary, width = _header(data, path)
    if version == "2.2" and binary:
        _check_numbers_without_gaps(_section_bytes(data, "Nodes", path), path)
    bodies = _section_bytes(data, "Nodes", path), _section_bytes(data, "Elements", path)
    check_gmsh_counts(*bodies, (version, binary, width), path.name)
    core = b"".join(_section_bytes(data, name, path, True) for name in ("MeshFormat", "Nodes", "Elements"))
    with tempfile.TemporaryDirectory() as folder, meshio_call(path, NAME, hint=HINT):
        plain = Path(folder) / "plain.msh"
        plain.write_bytes(core)
        raw = load_meshio().gmsh.read(plain)
    names = _physical_names(_section_bytes(data, "PhysicalNames", path).decode())
    if version == "2.2":
        blocks, owners = _blocks_by_cell_tag(raw, names)  # format 2.2 repeats an element for each of its groups
        keys = [np.column_stack([owner, block.nodes]) for block, owner in zip(blocks, owners, strict=True)]
        blocks = without_repeated_cells(blocks, keys)
    else:
        entities = read_entities(_section_bytes(data, "Entities", path), binary, width)
        blocks = _blocks_by_entity(raw, entities, names)
    return Contents(raw.points, blocks, empty=tuple(names.values()))


def write_gmsh(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a .msh file, version 4.1 or 2.2; a cell in several groups is in several physical groups."""
    version = options.version or "4.1"
    if version not in ("4.1", "2.2"):
        raise ValueError(f"Gmsh version {version!r} is not written; known are '4.1' and '2.2'.")
    tags = physical_tags(mesh)
    entities = entities_of(mesh, tags)
    lines = [f'{dim} {number} "{name}"' for (dim, name), number in sorted(tags.items(), key=lambda i: (i[0][0], i[1]))]
    names = "\n".join(["$PhysicalNames", str(len(lines)), *lines, "$EndPhysicalNames", ""]).encode() if lines else b""
    raw = _tagged_mesh(mesh, entities, repeat=version == "2.2")
    with meshio_call(path, NAME, "written"):
        load_meshio().gmsh.write(path, raw, fmt_version=version, binary=options.binary)
    data = path.read_bytes()
    if version == "4.1":
        start, end = data.index(b"$Entities\n"), data.index(b"$EndEntities\n") + len(b"$EndEntities\n")
        data = data[:start] + entities_section(entities, options.binary) + data[end:]
    head = data.index(b"$EndMeshFormat\n") + len(b"$EndMeshFormat\n")
    path.write_bytes(data[:head] + names + data[head:])


def _header(data: bytes, path: Path) -> tuple[str, bool, int]:
    """Version, binary or not, and bytes of a size, from the $MeshFormat section."""
    match = re.match(rb"\s*(?:\$Comments.*?\$EndComments\s*)?\$MeshFormat\s+(\S+)\s+([01])\s+(\d+)", data, re.S)
    if re.match(rb"\s*\$NOD\s", data):
        raise ValueError(
            f"{path.name} is of Gmsh format 1 ($NOD, $ELM), which is not read; 2.2 and 4.1 are. "
            f"Convert it: gmsh {path.name} -save -format msh41 -o new.msh"
        )
    if not match:
        raise ValueError(f"{path.name} does not begin with $MeshFormat: it is no Gmsh mesh.")
    version = {"2": "2.2", "4": "4.0"}.get(match[1].decode(), match[1].decode())
    if version not in ("2.2", "4.1"):
        raise ValueError(
            f"{path.name} is of Gmsh format {version}; 2.2 and 4.1 are read. "
            f"Convert it: gmsh {path.name} -save -format msh41 -o new.msh"
        )
    return version, match[2] == b"1", int(match[3])


def _section_bytes(data: bytes, name: str, path: Path, with_marks: bool = False) -> bytes:
    """Bytes of a section without its first and last line (with_marks: with them); b"" if it is missing."""
    start = data.find(f"${name}".encode())
    stop = data.find(f"$End{name}".encode())
    if start < 0 or stop < 0:
        if with_marks or start >= 0:
            raise ValueError(f"{path.name} has no complete ${name} section; the file is cut short or no mesh.")
        return b""
    body = data[start + len(name) + 1 : stop].removeprefix(b"\r").removeprefix(b"\n")
    return f"${name}\n".encode() + body + f"$End{name}\n".encode() if with_marks else body


def _check_numbers_without_gaps(nodes: bytes, path: Path) -> None:
    """Raise ValueError unless nodes are numbered 1 to n: meshio reads binary 2.2 only with such numbers."""
    count, _, records = nodes.partition(b"\n")
    record = np.dtype([("number", "<i4"), ("position", "<f8", 3)])
    if len(records) < int(count) * record.itemsize:
        raise ValueError(f"{path.name} announces {int(count)} nodes but ends before the last; the file is cut short.")
    numbers = np.frombuffer(records, record, int(count))["number"]
    if not np.array_equal(numbers, np.arange(1, len(numbers) + 1)):
        raise ValueError(
            f"{path.name} is binary of version 2.2 and numbers its {len(numbers)} nodes up to {numbers.max()}; with"
            " gaps only text or version 4.1 is read. Open it in Gmsh and save it again."
        )


def _physical_names(text: str) -> dict[Tag, str]:
    entries = re.findall(r'^\s*(\d)\s+(-?\d+)\s+"(.*)"\s*$', text, re.M)
    return {(int(dim), int(number)): name for dim, number, name in entries}


def _group_name(tag: Tag, names: dict[Tag, str]) -> str:
    dim, number = tag[0], abs(tag[1])
    return names.get((dim, number), f"{KINDS[dim]}_{number}")


def _vtk_order(cell: str, nodes: IntArray) -> IntArray:
    return nodes[:, WEDGE18_FROM_GMSH] if cell == "wedge18" else nodes


def _blocks_by_cell_tag(raw: Any, names: dict[Tag, str]) -> tuple[list[Block], list[IntArray]]:
    """Blocks of format 2.2, where every element carries the numbers of one physical group and one entity."""
    physical, entity = (raw.cell_data.get(f"gmsh:{key}") for key in ("physical", "geometrical"))
    blocks, owners = list[Block](), list[IntArray]()
    for k, part in enumerate(raw.cells):
        numbers = np.abs(physical[k]) if physical else np.zeros(len(part.data), int)
        groups = {_group_name((part.dim, int(n)), names): np.flatnonzero(numbers == n) for n in np.unique(numbers) if n}
        owner = entity[k] if entity else np.zeros(len(part.data), int)
        blocks.append(Block(part.type, _vtk_order(part.type, part.data), groups))
        owners.append(np.asarray(owner, np.int64))
    return blocks, owners


def _blocks_by_entity(raw: Any, entities: dict[Tag, list[int]], names: dict[Tag, str]) -> list[Block]:
    """Blocks of format 4.1, where an entity carries any number of physical groups (negative: reversed orientation)."""
    blocks = []
    for part, owner in zip(raw.cells, raw.cell_data["gmsh:geometrical"], strict=True):
        numbers = entities.get((part.dim, int(owner[0])), []) if len(owner) else []
        everything = np.arange(len(part.data))
        groups = {_group_name((part.dim, n), names): everything for n in numbers}
        blocks.append(Block(part.type, _vtk_order(part.type, part.data), groups))
    return blocks


def _tagged_mesh(mesh: Mesh, entities: list[Entity], repeat: bool) -> Any:
    """meshio mesh with one block per entity (repeat: per entity and group) and the tags that its writers need."""
    cells, physical, owner = [], [], []
    for entity in entities:
        nodes = entity.nodes
        if entity.cell == "wedge18":
            nodes = nodes[:, np.argsort(WEDGE18_FROM_GMSH)]
        for number in (entity.groups or [0]) if repeat else [0]:
            cells.append((entity.cell, nodes))
            physical.append(np.full(len(nodes), number))
            owner.append(np.full(len(nodes), entity.number))
    entity_of_point = np.empty((len(mesh.points), 2), np.int64)  # entity of lowest dimension that contains the point
    entity_of_point[:] = entities[-1].dimension, entities[-1].number
    for entity in sorted(entities, key=lambda e: -e.dimension):
        entity_of_point[np.unique(entity.nodes)] = entity.dimension, entity.number
    return load_meshio().Mesh(
        mesh.points,
        cells,
        point_data={"gmsh:dim_tags": entity_of_point},
        cell_data={"gmsh:physical": physical, "gmsh:geometrical": owner},
    )


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


register(NAME, (".msh",), read_gmsh, write_gmsh)
