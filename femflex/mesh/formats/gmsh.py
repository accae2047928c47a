"""Gmsh .msh, 2.2 and 4.1, text and binary: groups are physical groups, points of a group physical points."""

from __future__ import annotations

import re
import struct
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.contents import Block, Contents, group_classes, without_repeated_cells
from femflex.mesh.formats.register import WriteOptions, register
from femflex.mesh.mesh import Mesh

Tag = tuple[int, int]  # dimension, number

NAME = "Gmsh .msh"
VERSIONS = ("4.1", "2.2")
KINDS = ("point", "line", "surface", "volume")
TYPES = {
    "line": 1, "triangle": 2, "quad": 3, "tetra": 4, "hexahedron": 5, "wedge": 6, "pyramid": 7, "line3": 8,
    "triangle6": 9, "quad9": 10, "tetra10": 11, "hexahedron27": 12, "wedge18": 13, "vertex": 15, "quad8": 16,
    "hexahedron20": 17, "wedge15": 18, "pyramid13": 19,
}  # fmt: skip
CELLS = {number: cell for cell, number in TYPES.items()}
# Nodes of elements of other types, all of higher order, which are left out.
OTHER_TYPES = {14: 14, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21, 26: 4, 27: 5, 28: 6, 29: 20, 30: 35, 31: 56,
               36: 16, 37: 25, 38: 36, 92: 64, 93: 125}  # fmt: skip
# Gmsh lists middles by the lower corner of their edge; where that is not meshio's order: their places in its list.
_BRICK = [*range(9), 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15]
_WEDGE = [0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11]
ORDER = {
    "tetra10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8], "hexahedron20": _BRICK,
    "hexahedron27": [*_BRICK, 22, 23, 21, 24, 20, 25, 26], "wedge15": _WEDGE, "wedge18": [*_WEDGE, 15, 17, 16],
    "pyramid13": [0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12],
}  # fmt: skip


def read_gmsh(path: Path) -> Contents:
    """Contents of a .msh file, with its physical groups; groups without a name are called surface_7 and so on."""
    data = path.read_bytes()
    version, binary, width = _header(data, path)
    names = _physical_names(_section(data, "PhysicalNames", path).decode())
    sections = [_section(data, name, path, needed=True) for name in ("Nodes", "Elements")]
    nodes, elements = (_Numbers(body, binary, width, path) for body in sections)
    blocks, keys, left_out = list[Block](), list[IntArray](), dict[str, int]()
    if version == "2.2":
        numbers, points = _nodes_2(nodes, binary)
        parts = _elements_2(elements, binary)
    else:
        numbers, points = _nodes_4(nodes)
        groups = _groups_of_entities(_Numbers(_section(data, "Entities", path), binary, width, path))
        parts = _elements_4(elements, groups)
    order = np.argsort(numbers, kind="stable")
    for kind, owner, tags, listed in parts:
        if kind not in CELLS:
            left_out[f"Gmsh type {kind}"] = left_out.get(f"Gmsh type {kind}", 0) + len(listed)
            continue
        cell = CELLS[kind]
        place = np.minimum(np.searchsorted(numbers, listed, sorter=order), max(len(numbers) - 1, 0))
        rows = np.where(numbers[order[place]] == listed, order[place], -1) if len(numbers) else listed * 0 - 1
        rows = rows[:, ORDER.get(cell, slice(None))]
        if (rows < 0).any():
            raise ValueError(f"{path.name}: elements of type {cell} use nodes that the file does not define.")
        dimension, everything = CELL_TYPES[cell].dimension, np.arange(len(rows))
        of_all = {names.get((dimension, abs(n)), f"{KINDS[dimension]}_{abs(n)}"): everything for n in tags if n}
        blocks.append(Block(cell, rows, of_all))
        keys.append(np.column_stack([np.full(len(rows), owner), rows]))
    if version == "2.2":  # which repeats an element for each of its groups
        blocks = without_repeated_cells(blocks, keys)
    return Contents(points, blocks, empty=tuple(names.values()), left_out=left_out)


def _header(data: bytes, path: Path) -> tuple[str, bool, int]:
    """Version, binary or not, and bytes of a size, from the $MeshFormat section."""
    match = re.match(rb"\s*(?:\$Comments.*?\$EndComments\s*)?\$MeshFormat\s+(\S+)\s+([01])\s+(\d+)", data, re.S)
    if not match and not re.match(rb"\s*\$NOD\s", data):
        raise ValueError(f"{path.name} does not begin with $MeshFormat: it is no Gmsh mesh.")
    word = match[1].decode() if match else "1 ($NOD, $ELM)"
    version = {"2": "2.2", "4": "4.0"}.get(word, word)
    if not match or version not in VERSIONS:
        raise ValueError(
            f"{path.name} is of Gmsh format {version}, which is not read; 2.2 and 4.1 are. "
            f"Convert it: gmsh {path.name} -save -format msh41 -o new.msh"
        )
    return version, match[2] == b"1", int(match[3])


def _section(data: bytes, name: str, path: Path, needed: bool = False) -> bytes:
    """Bytes of a section without its first and last line; b"" if it is missing."""
    start, stop = data.find(f"${name}".encode()), data.find(f"$End{name}".encode())
    if start < 0 or stop < 0:
        if needed or start >= 0:
            raise ValueError(f"{path.name} has no complete ${name} section; the file is cut short or no mesh.")
        return b""
    return data[start + len(name) + 1 : stop].removeprefix(b"\r").removeprefix(b"\n")


def _physical_names(text: str) -> dict[Tag, str]:
    entries = re.findall(r'^\s*(\d)\s+(-?\d+)\s+"(.*)"\s*$', text, re.M)
    return {(int(dim), int(number)): name for dim, number, name in entries}


class _Numbers:
    """The numbers of a section, one after the other; a section that ends too soon raises ValueError."""

    def __init__(self, section: bytes, binary: bool, width: int, path: Path) -> None:
        self._section, self._path, self._place, self._text = section, path, 0, None if binary else _text(section)
        self.filled = bool(section)
        self._types = {"size": np.dtype(f"<u{width}"), "int": np.dtype("<i4"), "double": np.dtype("<f8")}

    def line(self) -> int:
        """The whole number of a line of text, which binary sections of 2.2 begin with."""
        if self._text is not None:
            return self.whole_number("int")
        word, mark, _ = self._section.partition(b"\n")
        self._place = len(word) + len(mark)
        return int(word)

    def whole_number(self, kind: str) -> int:
        """One whole number."""
        return int(self.take(kind, 1)[0])

    def take(self, kind: str, count: int, columns: int = 1, dtype: Any = None) -> NDArray[Any]:
        """The next numbers (count,), or (count, columns); kind: size, int or double."""
        kind_dtype, total, here = dtype or self._types[kind], count * columns, self._place
        size, end = (1, len(self._text)) if self._text is not None else (kind_dtype.itemsize, len(self._section))
        if not 0 <= total * size <= end - here:
            raise ValueError(
                f"{self._path.name} claims {count} nodes or elements, and its section of {len(self._section)} bytes "
                "has no place for them; the file is cut short or damaged. Write it again from its source."
            )
        self._place += total * size
        text = self._text
        values = np.frombuffer(self._section, kind_dtype, total, here) if text is None else text[here : here + total]
        values = values if dtype or kind == "double" else values.astype(np.int64)
        return values.reshape(count, columns) if columns > 1 else values


def _text(section: bytes) -> Array:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # text that is no number
        try:
            return np.fromstring(section.decode("ascii"), sep=" ")
        except (DeprecationWarning, UnicodeDecodeError):
            raise ValueError("one of its sections holds text that is no number") from None


def _nodes_2(nodes: _Numbers, binary: bool) -> tuple[IntArray, Array]:
    """Numbers and positions of the nodes."""
    count = nodes.line()
    if binary:
        records = nodes.take("", count, dtype=np.dtype([("number", "<i4"), ("x", "<f8", 3)]))
        return records["number"].astype(np.int64), records["x"].copy()
    rows = nodes.take("double", count, 4)
    return rows[:, 0].astype(np.int64), rows[:, 1:]


def _nodes_4(nodes: _Numbers) -> tuple[IntArray, Array]:
    blocks, announced, _, _ = nodes.take("size", 4).tolist()
    numbers, points = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
    for _ in range(blocks):
        dimension, _, parametric = nodes.take("int", 3).tolist()
        count = nodes.whole_number("size")
        numbers.append(nodes.take("size", count))
        points.append(nodes.take("double", count, 3 + (dimension if parametric else 0))[:, :3])
    if sum(map(len, numbers)) != announced:
        raise ValueError(f"it claims {announced} nodes, and its blocks hold {sum(map(len, numbers))}")
    return np.concatenate(numbers), np.concatenate(points)


Part = tuple[int, int, list[int], IntArray]  # type, number of the entity, numbers of physical groups, nodes of elements


def _elements_2(elements: _Numbers, binary: bool) -> Iterator[Part]:
    """Elements of one type, entity and physical group, in the order in which the first of each appears."""
    found: dict[tuple[int, int, int], list[IntArray]] = {}
    left = elements.line()
    while left > 0:
        if binary:
            kind, count, n_tags = elements.take("int", 3).tolist()
        else:
            (_, kind, n_tags), count = elements.take("int", 3).tolist(), 1
        columns = int(binary) + n_tags + _n_nodes(kind)
        rows = elements.take("int", count, columns).reshape(count, columns)[:, int(binary) :]
        for row in rows if len(rows) < 2 or (rows[:, :n_tags] != rows[0, :n_tags]).any() else [rows]:
            tags = [*np.atleast_2d(row)[0, :n_tags].tolist(), 0, 0]
            found.setdefault((kind, tags[1], tags[0]), []).append(np.atleast_2d(row)[:, n_tags:])
        left -= max(count, 1)
    for (kind, entity, group), parts in found.items():
        yield kind, entity, [group], np.concatenate(parts)


def _elements_4(elements: _Numbers, groups: dict[Tag, list[int]]) -> Iterator[Part]:
    """Elements of every entity, with its physical groups (negative: of reversed orientation)."""
    for _ in range(elements.take("size", 4).tolist()[0]):
        dimension, entity, kind = elements.take("int", 3).tolist()
        count, n = elements.whole_number("size"), _n_nodes(kind)
        yield kind, entity, groups.get((dimension, entity), []), elements.take("size", count, 1 + n)[:, 1:]


def _n_nodes(kind: int) -> int:
    if kind not in CELLS and kind not in OTHER_TYPES:
        raise ValueError(f"it has elements of Gmsh's type {kind}, whose number of nodes is not known; write it without")
    return len(CELL_TYPES[CELLS[kind]].nodes) if kind in CELLS else OTHER_TYPES[kind]


def _groups_of_entities(section: _Numbers) -> dict[Tag, list[int]]:
    """Numbers of the physical groups by dimension and number of the entity."""
    groups: dict[Tag, list[int]] = {}
    if not section.filled:
        return groups
    for dimension, count in enumerate(section.take("size", 4).tolist()):
        for _ in range(count):
            number = section.whole_number("int")
            section.take("double", 6 if dimension else 3)  # bounding box or position
            groups[dimension, number] = section.take("int", section.whole_number("size")).tolist()
            if dimension:
                section.take("int", section.whole_number("size"))  # bounding entities
    return groups


class Entity(NamedTuple):
    """Cells of one type with the same physical groups."""

    dimension: int
    number: int
    cell: str
    nodes: IntArray
    groups: list[int]


def write_gmsh(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a .msh file, version 4.1 or 2.2; a cell in several groups is in several physical groups."""
    version, binary = options.version or "4.1", options.binary
    if version not in VERSIONS:
        raise ValueError(f"Gmsh version {version!r} is not written; known are '4.1' and '2.2'.")
    tags = _physical_tags(mesh)
    entities = _entities_of(mesh, tags)
    names = [f'{dim} {number} "{name}"' for (dim, name), number in sorted(tags.items(), key=lambda i: (i[0][0], i[1]))]
    one = struct.pack("<i", 1) + b"\n" if binary else b""
    sections = {"MeshFormat": f"{version} {int(binary)} 8\n".encode() + one}
    sections |= {"PhysicalNames": "\n".join([str(len(names)), *names, ""]).encode()} if names else {}
    write = _sections_4 if version == "4.1" else _sections_2
    sections |= write(mesh, entities, binary)
    path.write_bytes(b"".join(f"${k}\n".encode() + body + f"$End{k}\n".encode() for k, body in sections.items()))


def _rows(values: Any, kind: str, binary: bool) -> bytes:
    """Numbers (n,) in one line, or (n, k) in n lines; kind: of a number in a binary file."""
    if binary:
        return np.asarray(values).astype(kind).tobytes()
    rows = np.atleast_2d(np.asarray(values, float if kind == "<f8" else np.int64)).tolist()
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows).encode()


def _sections_4(mesh: Mesh, entities: list[Entity], binary: bool) -> dict[str, bytes]:
    def integers(*values: int) -> bytes:
        return _rows(values, "<i4", binary)

    def sizes(*values: int) -> bytes:
        return _rows(values, "<u8", binary)

    counts = [sum(e.dimension == dim for e in entities) for dim in range(4)]
    described, elements, number, n_nodes = [sizes(*counts)], list[bytes](), 1, len(mesh.points)
    for e in sorted(entities, key=lambda e: (e.dimension, e.number)):
        points = mesh.points[np.unique(e.nodes)]
        box = [points.min(axis=0), points.max(axis=0)][: 2 if e.dimension else 1]
        described += [integers(e.number), *(_rows(corner, "<f8", binary) for corner in box), sizes(len(e.groups))]
        described += [integers(*e.groups)] if e.groups else []
        described += [sizes(0)] if e.dimension else []  # no bounding entities given
    for e in entities:
        listed = np.column_stack([number + np.arange(len(e.nodes)), _in_order(e) + 1])
        elements += [integers(e.dimension, e.number, TYPES[e.cell]), sizes(len(listed)), _rows(listed, "<u8", binary)]
        number += len(listed)
    # one block of nodes, of the last entity
    nodes = [sizes(1, n_nodes, 1, n_nodes), integers(entities[-1].dimension, entities[-1].number, 0), sizes(n_nodes)]
    nodes += [_rows(1 + np.arange(n_nodes)[:, None], "<u8", binary), _rows(mesh.points, "<f8", binary)]
    elements.insert(0, sizes(len(entities), number - 1, 1, number - 1))
    end = b"\n" if binary else b""
    return {
        name: b"".join([*parts, end])
        for name, parts in (("Entities", described), ("Nodes", nodes), ("Elements", elements))
    }


def _sections_2(mesh: Mesh, entities: list[Entity], binary: bool) -> dict[str, bytes]:
    """Sections in which an element is listed once for each of its groups."""
    end, count, elements = b"\n" if binary else b"", 0, list[bytes]()
    for e in entities:
        for group in e.groups or [0]:
            tags = [np.full(len(e.nodes), value) for value in (TYPES[e.cell], 2, group, e.number)]
            numbers = count + 1 + np.arange(len(e.nodes))
            columns = [numbers, *(tags[2:] if binary else tags), _in_order(e) + 1]
            elements += [_rows([TYPES[e.cell], len(e.nodes), 2], "<i4", True)] if binary else []
            elements.append(_rows(np.column_stack(columns), "<i4", binary))
            count += len(e.nodes)
    if binary:
        records = np.zeros(len(mesh.points), [("number", "<i4"), ("x", "<f8", 3)])
        records["number"], records["x"] = 1 + np.arange(len(mesh.points)), mesh.points
        nodes = records.tobytes()
    else:
        nodes = "".join(f"{k} {x!r} {y!r} {z!r}\n" for k, (x, y, z) in enumerate(mesh.points.tolist(), 1)).encode()
    return {
        "Nodes": f"{len(mesh.points)}\n".encode() + nodes + end,
        "Elements": f"{count}\n".encode() + b"".join(elements) + end,
    }


def _in_order(entity: Entity) -> IntArray:
    """Nodes of the cells of an entity in Gmsh's order."""
    return entity.nodes[:, np.argsort(ORDER[entity.cell])] if entity.cell in ORDER else entity.nodes


def _physical_tags(mesh: Mesh) -> dict[tuple[int, str], int]:
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


def _entities_of(mesh: Mesh, tags: dict[tuple[int, str], int]) -> list[Entity]:
    """One entity for all cells with the same type and groups; one for each point of the point groups."""
    entities: list[Entity] = []
    tags_of_point: dict[int, list[int]] = {}
    for group, points in mesh.point_groups.items():
        for point in points:
            tags_of_point.setdefault(int(point), []).append(tags[0, group])
    for k, point in enumerate(sorted(tags_of_point)):
        entities.append(Entity(0, k + 1, "vertex", np.array([[point]]), tags_of_point[point]))
    counts = [len(entities), 0, 0, 0]
    for cell, nodes in mesh.cells.items():
        dim = CELL_TYPES[cell].dimension
        groups = {group: by_type[cell] for group, by_type in mesh.cell_groups.items() if cell in by_type}
        for kind, members in group_classes(groups, len(nodes)):
            counts[dim] += 1
            entities.append(Entity(dim, counts[dim], cell, nodes[members], [tags[dim, group] for group in kind]))
    return entities


register(NAME, (".msh",), read_gmsh, write_gmsh)
