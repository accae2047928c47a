"""VTU and legacy VTK: a group is a marker array of that name, 1 where a cell or point belongs to it, 0 elsewhere.

Other integer arrays with few values (MaterialIDs, CellEntityIds) are read as one group per value, MaterialIDs_3.
meshio does not know most type names that VTK writes to legacy files, reads their int as 64 bits, and writes arrays that
VTK does not read; so the arrays of legacy files are read and written here and meshio is given the cells alone.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np
from numpy.typing import NDArray

from femflex.mesh.contents import Block, Contents
from femflex.mesh.formats import WriteOptions, load_meshio, meshio_speaking, register
from femflex.mesh.mesh import Mesh
from femflex.mesh.vtk_legacy import (
    Arrays,
    attributes_section,
    cell_types,
    geometry_and_attributes,
    is_binary,
    read_attributes,
)

Array = NDArray[np.float64]
Index = NDArray[np.int64]

VTU, VTK = "VTU", "legacy VTK"
MOST_VALUES = 64  # an integer array with more values than this is a field, not groups


def read_vtu(path: Path) -> Contents:
    """Contents of a .vtu file."""
    with meshio_speaking(path, VTU) as said:
        raw = load_meshio().vtu.read(path)
    kept = sum(len(part.data) for part in raw.cells)
    unknown = sorted(set(re.findall(r"cannot handle \(type (\d+)\)", " ".join(said.getvalue().split()))))
    counted = re.search(rb'NumberOfCells="\s*(\d+)', path.read_bytes())
    left_out = {f"VTK type {', '.join(unknown)}": int(counted[1]) - kept} if unknown and counted else {}
    blocks = [Block(part.type, np.asarray(part.data, np.int64), {}) for part in raw.cells]
    return _contents(raw.points, blocks, raw.cell_data, raw.point_data, left_out)


def read_vtk(path: Path) -> Contents:
    """Contents of a legacy .vtk file."""
    data = path.read_bytes()
    geometry, attributes = geometry_and_attributes(data)
    understood = load_meshio()._vtk_common.vtk_to_meshio_type
    with meshio_speaking(path, VTK):
        kinds = cell_types(geometry)
    unknown = {int(kind): int((kinds == kind).sum()) for kind in np.unique(kinds) if int(kind) not in understood}
    left_out = {f"VTK type {kind}": count for kind, count in unknown.items()}
    if len(kinds) and sum(unknown.values()) == len(kinds):
        return Contents(np.zeros((0, 3)), [], left_out=left_out)
    with tempfile.TemporaryDirectory() as folder, meshio_speaking(path, VTK):
        plain = Path(folder) / "plain.vtk"
        plain.write_bytes(geometry)
        raw = load_meshio().vtk.read(plain)
        cell_arrays, point_arrays = read_attributes(attributes, is_binary(data))
    stays = ~np.isin(kinds, list(unknown)) if len(kinds) else slice(None)  # meshio leaves the others out
    blocks = [Block(part.type, np.asarray(part.data, np.int64), {}) for part in raw.cells]
    ends = np.cumsum([len(block.nodes) for block in blocks])[:-1]
    per_block = {name: np.split(values[stays], ends) for name, values in cell_arrays.items()}
    return _contents(raw.points, blocks, per_block, point_arrays, left_out)


def write_vtu(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a .vtu file."""
    cells, points = _markers(mesh)
    ends = np.cumsum([len(nodes) for nodes in mesh.cells.values()])[:-1]
    raw = load_meshio().Mesh(
        mesh.points,
        list(mesh.cells.items()),
        point_data=points,
        cell_data={name: np.split(values, ends) for name, values in cells.items()},
    )
    with meshio_speaking(path, VTU, "written"):
        load_meshio().vtu.write(path, raw, binary=options.binary)


def write_vtk(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a legacy .vtk file."""
    with meshio_speaking(path, VTK, "written"):
        load_meshio().vtk.write(path, load_meshio().Mesh(mesh.points, list(mesh.cells.items())), binary=options.binary)
    with path.open("ab") as file:
        file.write(attributes_section(*_markers(mesh), options.binary))


def _contents(
    points: Array, blocks: list[Block], cell_data: dict[str, list[Any]], point_data: Arrays, left_out: dict[str, int]
) -> Contents:
    """Contents with groups from marker arrays per block and over points."""
    for name, parts in cell_data.items():
        for group, member in _membership(unquote(name), [np.asarray(part) for part in parts]).items():
            for block, inside in zip(blocks, member, strict=True):
                block.groups[group] = np.flatnonzero(inside)
    point_groups = {
        group: np.flatnonzero(member[0])
        for name, values in point_data.items()
        for group, member in _membership(unquote(name), [np.asarray(values)]).items()
    }
    return Contents(points, blocks, point_groups, left_out=left_out)


def _membership(name: str, parts: list[NDArray[Any]]) -> dict[str, list[NDArray[np.bool_]]]:
    """Membership per block for every group an array tells; none for real-valued and vector arrays."""
    if not parts or any(part.dtype.kind not in "iub" or part.ndim != 1 for part in parts):
        return {}
    values = np.unique(np.concatenate(parts))
    if len(values) > MOST_VALUES:
        return {}
    if set(values.tolist()) <= {0, 1}:
        return {name: [part == 1 for part in parts]}
    return {f"{name}_{value}": [part == value for part in parts] for value in values}


def _markers(mesh: Mesh) -> tuple[Arrays, Arrays]:
    """Marker arrays over all cells in order and over the points; blanks in names are %20, as VTK spells them."""
    cells = {}
    for group, by_type in mesh.cell_groups.items():
        parts = [np.isin(np.arange(len(nodes)), by_type.get(cell, [])) for cell, nodes in mesh.cells.items()]
        cells[quote(group, safe="")] = np.concatenate(parts).astype(np.int32)
    points = {
        quote(group, safe=""): np.isin(np.arange(len(mesh.points)), rows).astype(np.int32)
        for group, rows in mesh.point_groups.items()
    }
    return cells, points


register(VTU, (".vtu",), read_vtu, write_vtu)
register(VTK, (".vtk",), read_vtk, write_vtk)
