"""Mesh contents from data sets of VTK's readers, and a VTK grid from a mesh."""

from __future__ import annotations

from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, BoolArray, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.contents import Block, Contents

Arrays = dict[str, NDArray[Any]]
Leaf = dict[str, Any]  # see vtk_worker.py

CELLS = {
    1: "vertex", 3: "line", 5: "triangle", 8: "quad", 9: "quad", 10: "tetra", 11: "hexahedron", 12: "hexahedron",
    13: "wedge", 14: "pyramid", 21: "line3", 22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20",
    26: "wedge15", 27: "pyramid13", 28: "quad9", 29: "hexahedron27", 32: "wedge18",
}  # fmt: skip
PIXELS = {8: [0, 1, 3, 2], 11: [0, 1, 3, 2, 4, 5, 7, 6]}  # axis-aligned cells, whose nodes are listed row by row
WEDGE = [0, 2, 1, 3, 5, 4]  # its first face points outward in VTK, inward in meshio
REORDERED = {**PIXELS, 13: WEDGE}
TYPES = {cell: number for number, cell in CELLS.items() if number not in PIXELS}
LINE, POLYLINE = 3, 4
MAX_GROUP_VALUES = 64  # an integer array with more values than this is a field, not groups


class Cells(NamedTuple):
    """Cells of a data set: types (n,) in VTK's numbers, offsets (n + 1,) into the nodes."""

    kinds: IntArray
    offsets: IntArray
    nodes: IntArray


def cells_of(leaf: Leaf) -> Cells:
    """Cells of a leaf; ValueError if its lists are inconsistent."""
    kinds, offsets, nodes = (np.asarray(leaf[key], np.int64) for key in ("kinds", "offsets", "nodes"))
    if len(offsets) != len(kinds) + 1 or (np.diff(offsets) < 0).any() or offsets[-1] > len(nodes) or offsets[0] < 0:
        raise ValueError(f"its {len(kinds)} cells and their lists of nodes do not agree")
    is_line = (kinds == POLYLINE) & (np.diff(offsets) == 2)  # XDMF writes lines as polylines of two nodes
    return Cells(np.where(is_line, LINE, kinds), offsets, nodes)


def leaf_contents(leaf: Leaf) -> Contents:
    """Contents of a leaf: an array per group, 1 inside and 0 outside, or one group per integer value."""
    points, (kinds, offsets, nodes) = np.asarray(leaf["points"], float), cells_of(leaf)
    blocks, rows, left_out = [], list[IntArray](), dict[str, int]()
    for kind in np.unique(kinds).tolist():
        cell_rows = np.flatnonzero(kinds == kind)
        if kind not in CELLS:
            left_out[f"VTK type {kind}"] = len(cell_rows)
            continue
        cell = CELLS[kind]
        counts = np.unique(offsets[cell_rows + 1] - offsets[cell_rows])
        if len(counts) != 1 or counts[0] != len(CELL_TYPES[cell].nodes):
            raise ValueError(f"its cells of type {cell} have {counts.min()} to {counts.max()} nodes")
        node_rows = nodes[offsets[cell_rows][:, None] + np.arange(counts[0])]
        blocks.append(Block(cell, node_rows[:, REORDERED[kind]] if kind in REORDERED else node_rows, {}))
        rows.append(cell_rows)
    for name, values in leaf["cell"].items():
        for group, inside in membership(unquote(name), values).items():
            for block, cell_rows in zip(blocks, rows, strict=True):
                if len(inside) == len(kinds):
                    block.groups[group] = np.flatnonzero(inside[cell_rows])
    point_groups = {
        group: np.flatnonzero(inside)
        for name, values in leaf["point"].items()
        if len(values) == len(points)
        for group, inside in membership(unquote(name), values).items()
    }
    return Contents(points, blocks, point_groups, left_out=left_out)


def membership(name: str, values: NDArray[Any]) -> dict[str, BoolArray]:
    """Mask (n,) of the items in each group, from an array of group numbers (n,); no group for real-valued and vector
    arrays."""
    if values.dtype.kind not in "iub" or values.ndim != 1:
        return {}
    distinct = np.unique(values)
    if len(distinct) > MAX_GROUP_VALUES:
        return {}
    if set(distinct.tolist()) <= {0, 1}:
        return {name: values == 1}
    return {f"{name}_{value}": values == value for value in distinct}


def make_grid(points: Array, cells: dict[str, IntArray], cell_arrays: Arrays, point_arrays: Arrays) -> Any:
    """An unstructured grid of VTK with points (n_p, 3) [m], and integer arrays over its cells and points."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid

    grid, vtk_cells, vtk_points = vtkUnstructuredGrid(), vtkCellArray(), vtkPoints()
    vtk_points.SetData(numpy_to_vtk(np.ascontiguousarray(points, float), deep=True))
    counts = np.concatenate([np.full(len(nodes), nodes.shape[1]) for nodes in cells.values()])
    kinds = np.concatenate([np.full(len(nodes), TYPES[cell]) for cell, nodes in cells.items()])
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    cells = {cell: nodes[:, WEDGE] if cell == "wedge" else nodes for cell, nodes in cells.items()}
    nodes = np.concatenate([nodes.ravel() for nodes in cells.values()]).astype(np.int64)
    vtk_cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(nodes, deep=True))
    grid.SetPoints(vtk_points)
    grid.SetCells(numpy_to_vtk(kinds.astype(np.uint8), deep=True), vtk_cells)
    for data, arrays in ((grid.GetCellData(), cell_arrays), (grid.GetPointData(), point_arrays)):
        for name, values in arrays.items():
            array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
            array.SetName(name)
            data.AddArray(array)
    return grid
