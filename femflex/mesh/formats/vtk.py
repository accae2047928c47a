"""VTU and legacy VTK by meshio: a group is a marker array of that name, 1 where an item belongs to it, else 0.

Other integer arrays with few values (MaterialIDs, CellEntityIds) are read as one group per value, MaterialIDs_3.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, BoolArray, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.contents import Block, Contents
from femflex.mesh.formats.register import WriteOptions, load_meshio, meshio_call, register
from femflex.mesh.mesh import Mesh

VTU, VTK = "VTU", "legacy VTK"
PIXEL = [0, 1, 3, 2]  # a rectangle along the axes, whose nodes are listed row by row
VOXEL = [*PIXEL, 4, 5, 7, 6]  # a box along the axes
ALONG_AXES = {"pixel": ("quad", PIXEL), "voxel": ("hexahedron", VOXEL)}
CELLS = {
    1: "vertex", 3: "line", 5: "triangle", 8: "quad", 9: "quad", 10: "tetra", 11: "hexahedron", 12: "hexahedron",
    13: "wedge", 14: "pyramid", 21: "line3", 22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20",
    26: "wedge15", 27: "pyramid13", 28: "quad9", 29: "hexahedron27", 32: "wedge18",
}  # fmt: skip
LINE, POLYLINE = 3, 4
REORDERED = {8: PIXEL, 11: VOXEL, 13: [0, 2, 1, 3, 5, 4]}  # a wedge's first face points outward in VTK
WIDTHS = {
    "VECTORS": 3,
    "NORMALS": 3,
    "TENSORS": 9,
    "TENSORS6": 6,
    "TEXTURE_COORDINATES": 0,
    "GLOBAL_IDS": 1,
    "PEDIGREE_IDS": 1,
}  # of data that are no groups: numbers of an item, 0: given on the line
KINDS = {
    "char": "i1", "signed_char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2", "int": "i4",
    "unsigned_int": "u4", "long": "i8", "unsigned_long": "u8", "vtktypeint64": "i8", "vtktypeuint64": "u8",
    "vtkidtype": "i4", "float": "f4", "double": "f8",
}  # fmt: skip
MAX_GROUP_VALUES = 64  # an integer array with more values than this is a field, not groups
Markers = Mapping[str, NDArray[Any]]


def read_vtu(path: Path) -> Contents:
    """Contents of a .vtu file."""
    if b'compressor="vtkLZ4DataCompressor"' in path.read_bytes()[:2000]:
        raise ValueError(
            "it is compressed by LZ4, which is not read; save it compressed by ZLib, or without compression"
        )
    with meshio_call(path) as output:
        raw = load_meshio().vtu.read(path)
    if unknown := re.search(r"cannot handle \(type (\d+)\)", output.getvalue()):
        raise ValueError(f"{path.name} has cells of VTK's type {unknown[1]}, which are not read; write it without.")
    forms = [(*ALONG_AXES.get(block.type, (block.type, slice(None))), block.data) for block in raw.cells]
    cells = [(cell, nodes[:, order]) for cell, order, nodes in forms]
    cell_arrays = {unquote(name): np.concatenate(parts) for name, parts in raw.cell_data.items()}
    return marked_contents(raw.points, cells, cell_arrays, {unquote(k): v for k, v in raw.point_data.items()})


def read_vtk(path: Path) -> Contents:
    """Contents of a legacy .vtk file of an unstructured grid, of any version, text or binary."""
    file, arrays = _Legacy(path.read_bytes()), dict[str, NDArray[Any]]()
    data: dict[str, dict[str, NDArray[Any]]] = {"CELL_DATA": {}, "POINT_DATA": {}, "": {}}  # "": of no item
    part, count = "", 0
    while words := file.line():
        section, rest = words[0].upper(), words[1:]
        if section == "DATASET" and rest[0].upper() != "UNSTRUCTURED_GRID":
            raise ValueError(f"its data set is {rest[0].upper()}; unstructured grids are read, so save it as one")
        if section in data:
            part, count = section, int(rest[0])
        elif section == "METADATA":
            file.skip_paragraph()
        elif section == "POINTS":
            arrays[section] = file.array(3 * int(rest[0]), rest[1]).reshape(-1, 3)
        elif section == "CELLS":
            arrays["OFFSETS"], arrays["NODES"] = file.cells(int(rest[0]), int(rest[1]))
        elif section == "CELL_TYPES":
            arrays[section] = file.array(int(rest[0]), "int")
        elif section == "LOOKUP_TABLE":
            file.array(4 * int(rest[1]), "unsigned_char" if file.binary else "float")
        elif section == "COLOR_SCALARS":
            colours = file.array(count * int(rest[1]), "unsigned_char" if file.binary else "float")
            if rest[1] == "1":
                data[part][rest[0]] = colours if file.binary else np.rint(255 * colours).astype(int)
        elif section == "FIELD":
            for _ in range(int(rest[1])):
                name, size, number, kind = file.line()
                data[part][name] = file.array(int(size) * int(number), kind).reshape(int(number), int(size))
        elif section == "SCALARS":
            file.line()  # of its table of colours
            per_item = int([*rest, "1"][2])
            data[part][rest[0]] = file.array(count * per_item, rest[1]).reshape(count, per_item)
        elif section in WIDTHS:
            file.array(count * (WIDTHS[section] or int(rest[1])), rest[-1])
    kinds, offsets, nodes = (arrays[name].astype(np.int64) for name in ("CELL_TYPES", "OFFSETS", "NODES"))
    if len(offsets) != len(kinds) + 1 or (np.diff(offsets) < 0).any() or offsets[-1] > len(nodes) or offsets[0] < 0:
        raise ValueError(f"its {len(kinds)} cells and their lists of nodes do not agree")
    kinds = np.where((kinds == POLYLINE) & (np.diff(offsets) == 2), LINE, kinds)
    cells, rows, left_out = list[tuple[str, IntArray]](), [np.zeros(0, np.int64)], dict[str, int]()
    for kind in np.unique(kinds).tolist():
        cell_rows = np.flatnonzero(kinds == kind)
        if kind not in CELLS:
            left_out[f"VTK type {kind}"] = len(cell_rows)
            continue
        cell = CELLS[kind]
        counts = np.unique(offsets[cell_rows + 1] - offsets[cell_rows])
        if counts.tolist() != [len(CELL_TYPES[cell].nodes)]:
            raise ValueError(f"its cells of type {cell} have {counts.min()} to {counts.max()} nodes")
        cells.append((cell, nodes[offsets[cell_rows][:, None] + np.array(REORDERED.get(kind, range(counts[0])))]))
        rows.append(cell_rows)
    order, items = np.concatenate(rows), len(kinds)
    spelled = {part: {unquote(unquote(name)): v for name, v in arrays.items()} for part, arrays in data.items()}
    marks = {name: values[order] for name, values in spelled["CELL_DATA"].items() if len(values) == items}
    return replace(marked_contents(arrays["POINTS"], cells, marks, spelled["POINT_DATA"]), left_out=left_out)


class _Legacy:
    """A legacy file from its fourth line on: lines of words, and arrays as text or in binary (largest byte first)."""

    def __init__(self, content: bytes) -> None:
        head = content.split(b"\n", 3)
        if len(head) < 4 or not head[0].startswith(b"# vtk DataFile Version"):
            raise ValueError("its first line is not that of a file of VTK")
        self._data, self._place = head[3], 0
        self.binary = head[2].strip().upper() == b"BINARY"

    def line(self) -> list[str]:
        """The words of the next line that has some; none at the end."""
        while self._place < len(self._data):
            stop = self._data.find(b"\n", self._place) + 1 or len(self._data) + 1
            words = self._data[self._place : stop - 1].decode("latin-1").split()
            self._place = stop
            if words:
                return words
        return []

    def skip_paragraph(self) -> None:
        """Go on after the next line without words."""
        stop = self._data.find(b"\n\n", self._place)
        self._place = len(self._data) if stop < 0 else stop + 2

    def array(self, count: int, kind: str) -> NDArray[Any]:
        """The next `count` numbers of this type. Raises ValueError if the file has fewer."""
        if kind.lower() not in KINDS:
            raise ValueError(f"it has data of type {kind}")
        dtype = np.dtype(KINDS[kind.lower()])
        if self.binary and count * dtype.itemsize > len(self._data) - self._place:
            raise ValueError(f"it announces {count} numbers and ends before the last")
        if self.binary:
            values = np.frombuffer(self._data, dtype.newbyteorder(">"), count, self._place)
            self._place += values.nbytes
            return values.astype(dtype)
        words = self._data[self._place :].split(None, count) if count else []
        if len(words) < count:
            raise ValueError(f"it announces {count} numbers and ends after {len(words)}")
        self._place = len(self._data) - (len(words[count]) if len(words) > count else 0) if count else self._place
        return np.array(words[:count]).astype(dtype) if count else np.zeros(0, dtype)

    def cells(self, n_cells: int, size: int) -> tuple[NDArray[Any], NDArray[Any]]:
        """Offsets (n + 1,) of cells in the list of their nodes, and this list. Before version 5 each cell is its number
        of nodes and the nodes."""
        start = self._place
        if (words := self.line()) and words[0].upper() == "OFFSETS":
            offsets = self.array(n_cells, words[1])
            return offsets, self.array(size, self.line()[1])
        self._place = start
        listed = self.array(size, "int")
        counts, k, numbers = list[int](), 0, listed.tolist()
        while k < len(numbers) and numbers[k] >= 0:
            counts.append(numbers[k])
            k += 1 + numbers[k]
        if len(counts) != n_cells or k != size:
            raise ValueError(
                f"its line CELLS {n_cells} {size} and its cells do not agree; the second number is that of all numbers "
                "below it, one for each cell and one for each of its nodes"
            )
        offsets = np.cumsum([0, *counts])
        return offsets, np.delete(listed, offsets[:-1] + np.arange(n_cells))


def marked_contents(
    points: Array, cells: Sequence[tuple[str, IntArray]], cell_arrays: Markers, point_arrays: Markers
) -> Contents:
    """Contents of points (n, 3) [m] and cells, with groups by arrays over all cells in order, and over the points."""
    starts = np.cumsum([0, *(len(nodes) for _, nodes in cells)])
    blocks = [Block(cell, nodes) for cell, nodes in cells]
    for name, values in cell_arrays.items():
        for group, inside in _membership(name, values).items():
            for block, start in zip(blocks, starts, strict=False):
                block.groups[group] = np.flatnonzero(inside[start : start + len(block.nodes)])
    point_groups = {
        group: np.flatnonzero(inside)
        for name, values in point_arrays.items() if len(values) == len(points)
        for group, inside in _membership(name, values).items()
    }  # fmt: skip
    return Contents(points, blocks, point_groups)


def _membership(name: str, values: NDArray[Any]) -> dict[str, BoolArray]:
    """Mask (n,) of the items in each group, from an array of group numbers (n,) or (n, 1); no group for others."""
    values = values.ravel() if values.shape[1:] == (1,) else values
    distinct = np.unique(values) if values.dtype.kind in "iub" and values.ndim == 1 else values[:0]
    if len(distinct) > MAX_GROUP_VALUES:
        return {}
    if len(distinct) and set(distinct.tolist()) <= {0, 1}:
        return {name: values == 1}
    return {f"{name}_{value}": values == value for value in distinct}


def write_vtk(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a .vtu file, or a legacy .vtk file of version 4.2, which other programs can read, too."""
    xml = path.suffix.lower() == ".vtu"

    def spelled(name: str) -> str:
        return quote(name if xml else quote(name, safe=""), safe="")  # VTK's reader of legacy files decodes once more

    cell_data = {
        spelled(group): [np.isin(np.arange(len(n)), by.get(c, [])).astype(np.int32) for c, n in mesh.cells.items()]
        for group, by in mesh.cell_groups.items()
    }
    point_data = {
        spelled(group): np.isin(np.arange(len(mesh.points)), rows).astype(np.int32)
        for group, rows in mesh.point_groups.items()
    }
    raw = load_meshio().Mesh(mesh.points, list(mesh.cells.items()), point_data=point_data, cell_data=cell_data)
    with meshio_call(path):
        if xml:
            load_meshio().vtu.write(path, raw, binary=options.binary)
        else:
            load_meshio().vtk.write(path, raw, fmt_version="4.2", binary=options.binary)


register(VTU, (".vtu",), read_vtu, write_vtk)
register(VTK, (".vtk",), read_vtk, write_vtk)
