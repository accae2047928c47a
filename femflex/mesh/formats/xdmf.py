"""XDMF (.xdmf, .xmf, of FEniCS and others): an array of few integers over cells or points is one group per value.

Several grids are joined; their points at identical positions are merged. Of grids in time the first is read.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import IntArray
from femflex.hdf5 import open_hdf5
from femflex.mesh.formats.contents import Block, Contents
from femflex.mesh.formats.register import load_meshio, register
from femflex.mesh.formats.vtk import marked_contents

NAME = "XDMF"
Element = ElementTree.Element


def read_xdmf(path: Path) -> Contents:
    """Contents of a file; paths of its heavy data are relative to its folder."""
    root = ElementTree.parse(path).getroot()
    parts = [_grid_contents(grid, root, path.parent) for grid in _grids(root)]
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(len(part.points) for part in parts)])
    points, point_index = np.unique(np.concatenate([part.points for part in parts]), axis=0, return_inverse=True)
    point_index = point_index.ravel()
    blocks, point_groups = list[Block](), dict[str, IntArray]()
    for part, start in zip(parts, starts, strict=False):
        blocks += [Block(block.cell, point_index[block.nodes + start], block.groups) for block in part.blocks]
        for name, rows in part.point_groups.items():
            point_groups[name] = np.union1d(point_groups.get(name, rows[:0]), point_index[rows + start])
    return Contents(points, blocks, point_groups)


def _grids(parent: Element) -> Iterator[Element]:
    """The grids with cells of their own; of a collection in time the first."""
    in_time = parent.get("CollectionType", "").lower() == "temporal"
    grids = [child for child in parent if child.tag in ("Domain", "Grid")]
    for grid in grids[:1] if in_time else grids:
        if grid.find("Topology") is not None:
            yield grid
        else:
            yield from _grids(grid)


def _grid_contents(grid: Element, root: Element, folder: Path) -> Contents:
    """Contents of one grid; without points of its own it is on those of the first grid, as FEniCS writes marks."""
    topology, geometry = grid.find("Topology"), grid.find("Geometry")
    geometry = root.find(".//Geometry") if geometry is None else geometry
    if topology is None or geometry is None:
        raise ValueError("it has a grid without points")
    tables, kind = load_meshio().xdmf.common, topology.get("TopologyType") or topology.get("Type") or ""
    kinds = {name.lower(): cell for name, cell in tables.xdmf_to_meshio_type.items()} | {"polyline": "line"}
    if kind.lower() not in kinds and kind.lower() != "mixed":
        raise ValueError(f"it has a grid of type {kind or '(none)'}; grids of cells are read, not structured ones")
    items = np.asarray(_values(topology.find("DataItem"), root, folder), np.int64)
    if kind.lower() == "mixed":
        cells = [(block.type, block.data) for block in tables.translate_mixed_cells(items.ravel())]
    else:
        cells = [(kinds[kind.lower()], items)]
    points = np.asarray(_values(geometry.find("DataItem"), root, folder), float)
    points = points.reshape(-1, 2 if (geometry.get("GeometryType") or geometry.get("Type")) == "XY" else 3)
    arrays: dict[str, dict[str, NDArray[Any]]] = {"Cell": {}, "Node": {}}
    n_items = {"Cell": sum(len(nodes) for _, nodes in cells), "Node": len(points)}
    for attribute in grid.findall("Attribute"):
        center, name = attribute.get("Center", "Node"), attribute.get("Name", "")
        values = _values(attribute.find("DataItem"), root, folder) if center in arrays else np.zeros(0)
        if center in arrays and len(values) == n_items[center]:
            arrays[center][name] = values
    return marked_contents(points, cells, arrays["Cell"], arrays["Node"])


def _values(item: Element | None, root: Element, folder: Path) -> NDArray[Any]:
    """The array of a DataItem: in the file itself, in HDF5 or binary, or at another place of the file."""
    if item is not None and "Reference" in item.attrib:
        text = (item.text or "") if item.get("Reference") == "XML" else item.attrib["Reference"]
        return _values(root.find("./" + text.strip().removeprefix("/").partition("/")[2]), root, folder)
    if item is None or item.get("ItemType", "Uniform") != "Uniform":
        raise ValueError("it has data that is no plain array, such as a function of arrays")
    shape, text = [int(word) for word in item.get("Dimensions", "").split()], (item.text or "").strip()
    kind = item.get("NumberType") or item.get("DataType") or "Float"
    dtype = load_meshio().xdmf.common.xdmf_to_numpy_type[kind, item.get("Precision", "4")]
    form = item.get("Format", "XML").upper()
    if form == "HDF":
        file_name, _, key = text.partition(":")
        with open_hdf5(folder / file_name) as file:
            return np.asarray(file[key][()])
    order = {"little": "<", "big": ">"}.get(item.get("Endian", "").lower(), "=")
    binary = np.dtype(dtype).newbyteorder(order)
    values = np.fromfile(folder / text, binary) if form == "BINARY" else np.array(text.split(), dtype)
    if values.size != np.prod(shape):
        raise ValueError(f"it announces {shape} numbers and has {values.size}")
    return values.reshape(shape)


register(NAME, (".xdmf", ".xmf"), read_xdmf)
