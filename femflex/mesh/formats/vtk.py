"""VTU and legacy VTK, by VTK itself: a group is a marker array of that name, 1 where an item belongs to it, else 0.

Other integer arrays with few values (MaterialIDs, CellEntityIds) are read as one group per value, MaterialIDs_3.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from femflex.extras import require
from femflex.mesh.formats.contents import Contents
from femflex.mesh.formats.guards import check_legacy_cells
from femflex.mesh.formats.register import WriteOptions, register
from femflex.mesh.formats.vtk_data import TYPES, WEDGE, Arrays, cells_of, leaf_contents, make_grid
from femflex.mesh.formats.vtk_process import read_leaves
from femflex.mesh.mesh import Mesh

VTU, VTK = "VTU", "legacy VTK"
LEGACY = 42  # version that other programs can read, too


def read_vtu(path: Path) -> Contents:
    """Contents of a .vtu file."""
    (leaf,) = read_leaves("vtu", path)
    return leaf_contents(leaf)


def read_vtk(path: Path) -> Contents:
    """Contents of a legacy .vtk file of any single data set."""
    (leaf,) = read_leaves("vtk", path)
    check_legacy_cells(path, int(cells_of(leaf).offsets[-1]))
    return leaf_contents(leaf)


def write_vtu(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a .vtu file."""
    require("view", f"{path.name} and other files of VTK")
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetDataModeToBinary() if options.binary else writer.SetDataModeToAscii()
    _write(path, mesh, writer)


def write_vtk(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a legacy .vtk file."""
    if not options.binary:
        path.write_text(_legacy_text(mesh), encoding="utf-8")
        return
    require("view", f"{path.name} and other binary files of VTK")
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter

    writer = vtkUnstructuredGridWriter()
    writer.SetFileVersion(LEGACY)
    writer.SetFileTypeToBinary()
    _write(path, mesh, writer)


def _legacy_text(mesh: Mesh) -> str:
    """The text of a legacy file; VTK's own writer keeps only 11 digits."""
    counts = {cell: len(nodes) for cell, nodes in mesh.cells.items()}
    size = sum(nodes.size for nodes in mesh.cells.values()) + sum(counts.values())
    lines = ["# vtk DataFile Version 4.2", "mesh", "ASCII", "DATASET UNSTRUCTURED_GRID"]
    lines += [f"POINTS {len(mesh.points)} double", *(f"{x!r} {y!r} {z!r}" for x, y, z in mesh.points.tolist())]
    lines.append(f"CELLS {sum(counts.values())} {size}")
    for cell, nodes in mesh.cells.items():
        rows = nodes[:, WEDGE] if cell == "wedge" else nodes
        lines += [" ".join(map(str, [len(row), *row])) for row in rows.tolist()]
    lines.append(f"CELL_TYPES {sum(counts.values())}")
    lines += [str(TYPES[cell]) for cell, count in counts.items() for _ in range(count)]
    for section, arrays in zip(("CELL_DATA", "POINT_DATA"), _markers(mesh), strict=True):
        for k, (name, values) in enumerate(arrays.items()):
            lines += [f"{section} {len(values)}", f"FIELD FieldData {len(arrays)}"] if k == 0 else []
            # VTK's reader decodes %20 once more
            lines += [f"{quote(name, safe='')} 1 {len(values)} int", " ".join(map(str, values.tolist()))]
    return "\n".join([*lines, ""])


def _write(path: Path, mesh: Mesh, writer: Any) -> None:
    """Write through memory, since VTK does not recover from a full disk."""
    writer.SetInputData(make_grid(mesh.points, dict(mesh.cells), *_markers(mesh)))
    writer.WriteToOutputStringOn()
    if not writer.Write():
        raise ValueError(f"{path.name} could not be written as {VTU} or {VTK}; another format may hold it: .msh")
    content = (getattr(writer, "GetOutputStdString", None) or writer.GetOutputString)()
    path.write_bytes(content.encode() if isinstance(content, str) else content)


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
