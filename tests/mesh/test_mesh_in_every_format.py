"""One mesh of solids, faces, edges and points, two groups of each that begin alike: the same Mesh in every format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_mesh_other_formats import dataset, unv_elements, unv_nodes

from femflex.mesh import Mesh, read_mesh, write_mesh

POINTS = np.array([
    [0, 0, 0], [1.5, 0, 0], [1.5, 1.25, 0], [0, 1.25, 0], [0, 0, 1], [1.5, 0, 1.125], [1.5, 1.25, 1], [0, 1.25, 1],
    [3, 0, 0], [3.25, 1.25, 0.5], [3, 0, 1], [3.25, 1.25, 1.75], [4, 0.5, 0.25],
])  # fmt: skip
CELLS = {
    "hexahedron": [[0, 1, 2, 3, 4, 5, 6, 7]],
    "tetra": [[1, 8, 2, 5], [8, 9, 2, 5], [8, 12, 9, 5]],
    "quad": [[0, 1, 5, 4], [3, 0, 4, 7]],
    "triangle": [[1, 8, 5], [8, 12, 5], [10, 11, 9]],
    "line": [[0, 3], [8, 12], [12, 10], [3, 7]],
}
GROUPS: dict[str, dict[str, list[int]]] = {
    "core": {"hexahedron": [0], "tetra": [1]},
    "core1": {"tetra": [0, 2]},
    "skin": {"quad": [1], "triangle": [0, 1]},
    "skin1": {"quad": [0, 1], "triangle": [2]},
    "seam": {"line": [1, 2]},
    "seam1": {"line": [0, 3]},
}
SPOTS = {"spot": [11], "spot1": [2, 3, 12], "spot11": [3]}
NUMBER = {
    cell: list(range(first, first + len(CELLS[cell]))) for cell, first in zip(CELLS, (40, 20, 60, 50, 10), strict=True)
}  # of elements, where a format has them
MADE = ("block_", "property_", "type_", "mat_", "real_")  # groups that a format gives besides those of the file


def whole() -> Mesh:
    """The mesh as it should be read."""
    return Mesh(POINTS, {cell: np.array(rows) for cell, rows in CELLS.items()}, GROUPS, SPOTS)


def held(mesh: Mesh) -> dict[str, Any]:
    """Points, cells, and members of all groups of a mesh, in their order."""
    groups = {name: by for name, by in mesh.cell_groups.items() if not name.startswith(MADE)}
    return {
        "points": mesh.points.round(9).tolist(),
        "cells": {cell: mesh.cells[cell].tolist() for cell in sorted(mesh.cells)},
        "groups": {
            name: {cell: groups[name][cell].tolist() for cell in sorted(groups[name])} for name in sorted(groups)
        },
        "spots": {name: mesh.point_groups[name].tolist() for name in sorted(mesh.point_groups)},
    }


def universal(path: Path) -> None:
    """A universal file: nodes from 11 on, elements by number, groups of nodes and elements."""
    kinds = {"hexahedron": 115, "tetra": 111, "quad": 94, "triangle": 91, "line": 11}
    cells = [
        (number, kinds[cell], 3, [n + 11 for n in nodes])
        for cell in CELLS for number, nodes in zip(NUMBER[cell], CELLS[cell], strict=True)
    ]  # fmt: skip
    members = [(name, [(8, NUMBER[cell][r]) for cell, rows in by.items() for r in rows]) for name, by in GROUPS.items()]
    members += [(name, [(7, row + 11) for row in rows]) for name, rows in SPOTS.items()]
    lines = []
    for k, (name, listed) in enumerate(members, 1):
        lines += [f"{k:10d}" + f"{0:10d}" * 6 + f"{len(listed):10d}", name]
        pairs = [f"{kind:10d}{number:10d}{0:10d}{0:10d}" for kind, number in listed]
        lines += ["".join(pairs[k : k + 2]) for k in range(0, len(pairs), 2)]
    path.write_text(
        dataset(2411, *unv_nodes(POINTS)) + dataset(2412, *unv_elements(cells)) + dataset(2467, *lines)
    )  # fmt: skip


def archive(path: Path) -> None:
    """An Ansys archive: solids, shells and links of three element types, components of elements and nodes."""
    pytest.importorskip("mapdl_archive")
    kinds = {"hexahedron": 1, "tetra": 1, "quad": 2, "triangle": 2, "line": 3}
    doubled = {"tetra": [0, 1, 2, 2, 3, 3, 3, 3], "triangle": [0, 1, 2, 2]}
    nodes = [f"{k:8d}{0:8d}{0:8d}" + "".join(f"{x:20.13E}" for x in row) for k, row in enumerate(POINTS, 1)]
    cells = []
    for cell in CELLS:
        for number, listed in zip(NUMBER[cell], CELLS[cell], strict=True):
            corners = [listed[k] + 1 for k in doubled.get(cell, range(len(listed)))]
            head = (1, kinds[cell], 1, 1, 0, 0, 0, 0, len(corners), 0, number)
            cells.append("".join(f"{value:8d}" for value in (*head, *corners)))
    components = []
    members = [
        (name, "ELEM", [NUMBER[cell][r] for cell, rows in by.items() for r in rows]) for name, by in GROUPS.items()
    ]
    members += [(name, "NODE", [row + 1 for row in rows]) for name, rows in SPOTS.items()]
    for name, what, listed in members:
        components += [f"CMBLOCK,{name.upper()},{what},{len(listed)}", "(8i10)"]
        components += ["".join(f"{number:10d}" for number in sorted(listed))]
    path.write_text("\n".join([
        "/PREP7", "ET,1,185", "ET,2,181", "ET,3,180", f"NBLOCK,6,SOLID,{len(nodes)},{len(nodes)}", "(3i8,6e20.13)",
        *nodes, "N,R5.3,LOC,-1,", f"EBLOCK,19,SOLID,{len(cells)},{len(cells)}", "(19i8)", *cells, f"{-1:8d}",
        *components, "FINISH", "",
    ]))  # fmt: skip


def marked(path: Path) -> None:
    """An XDMF file in text: cells of all kinds in one list, an array of 0 and 1 for each group."""
    codes = {"hexahedron": [9], "tetra": [6], "quad": [5], "triangle": [4], "line": [2, 2]}
    order = [(cell, k) for cell in CELLS for k in range(len(CELLS[cell]))]
    topology = " ".join(" ".join(map(str, [*codes[cell], *CELLS[cell][k]])) for cell, k in order)
    size = sum(len(codes[cell]) + len(CELLS[cell][k]) for cell, k in order)

    def array(name: str, center: str, values: list[int]) -> str:
        size, text = len(values), " ".join(map(str, values))
        item = f'<DataItem Dimensions="{size}" NumberType="Int" Format="XML">{text}</DataItem>'
        return f'<Attribute Name="{name}" AttributeType="Scalar" Center="{center}">{item}</Attribute>'

    arrays = [array(name, "Cell", [int(k in by.get(cell, [])) for cell, k in order]) for name, by in GROUPS.items()]
    arrays += [array(name, "Node", [int(k in rows) for k in range(len(POINTS))]) for name, rows in SPOTS.items()]
    places = " ".join(f"{x}" for x in POINTS.ravel())
    path.write_text(
        '<Xdmf Version="2.0"><Domain><Grid Name="Grid">'
        f'<Topology TopologyType="Mixed" NumberOfElements="{len(order)}">'
        f'<DataItem Dimensions="{size}" NumberType="Int" Format="XML">{topology}</DataItem></Topology>'
        f'<Geometry GeometryType="XYZ"><DataItem Dimensions="{len(POINTS)} 3" NumberType="Float" Precision="8" '
        f'Format="XML">{places}</DataItem></Geometry>{"".join(arrays)}</Grid></Domain></Xdmf>'
    )


BY_HAND = {".unv": universal, ".cdb": archive, ".xdmf": marked}
GMSH: dict[str, dict[str, Any]] = {
    "4.1": {"version": "4.1"},
    "4.1 in text": {"version": "4.1", "binary": False},
    "2.2": {"version": "2.2"},
    "2.2 in text": {"version": "2.2", "binary": False},
}
WRITTEN: dict[str, tuple[str, dict[str, Any]]] = {
    "MED": (".med", {}),
    "VTU": (".vtu", {}),
    "VTU in text": (".vtu", {"binary": False}),
    "VTK": (".vtk", {}),
    "VTK in text": (".vtk", {"binary": False}),
    "Abaqus": (".inp", {}),
    "Nastran": (".bdf", {}),
}


@pytest.mark.parametrize("form", WRITTEN)
def test_a_mesh_that_was_written_is_read_in_the_same_order(form: str, tmp_path: Path):
    suffix, options = WRITTEN[form]
    path = tmp_path / f"parts{suffix}"
    write_mesh(path, whole(), **options)
    assert held(read_mesh(path)) == held(whole())


@pytest.mark.parametrize("suffix", BY_HAND)
def test_a_mesh_of_another_program_is_read_in_the_same_order(suffix: str, tmp_path: Path):
    path = tmp_path / f"parts{suffix}"
    BY_HAND[suffix](path)
    wanted = held(whole())
    if suffix == ".cdb":  # Ansys has its names in capitals
        wanted |= {key: {name.upper(): by for name, by in wanted[key].items()} for key in ("groups", "spots")}
    assert held(read_mesh(path)) == wanted


def placed(mesh: Mesh) -> dict[str, Any]:
    """What a mesh holds, by the places of its points, in whatever order."""
    at = [tuple(x) for x in mesh.points.round(9).tolist()]
    cells = {cell: [tuple(at[n] for n in nodes) for nodes in rows] for cell, rows in mesh.cells.items()}
    groups = {
        name: {cell: sorted(cells[cell][k] for k in rows) for cell, rows in by.items()}
        for name, by in mesh.cell_groups.items()
    }
    spots = {name: sorted(at[k] for k in rows) for name, rows in mesh.point_groups.items()}
    return {"cells": {cell: sorted(rows) for cell, rows in cells.items()}, "groups": groups, "spots": spots}


@pytest.mark.parametrize("form", GMSH)
def test_a_mesh_of_gmsh_is_read_with_its_cells_by_entities(form: str, tmp_path: Path):
    path = tmp_path / "parts.msh"
    write_mesh(path, whole(), **GMSH[form])
    assert placed(read_mesh(path)) == placed(whole())
