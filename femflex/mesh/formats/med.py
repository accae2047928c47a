"""MED (Salome, Code_Aster): groups are families of cells and of points.

Files are read with h5py. Points and cells are written by meshio, which neither converts to MED's node order (its solids
are mirrored compared with other formats) nor writes group names; nodes are reordered and families are added here.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, IntArray
from femflex.hdf5 import open_hdf5
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.contents import Block, Contents, group_classes
from femflex.mesh.formats.register import WriteOptions, load_meshio, meshio_call, register
from femflex.mesh.mesh import Mesh

Families = dict[int, list[str]]

NAME = "MED"
# MED lists the faces of its 27-node brick as bottom, four sides, top; VTK as -x, +x, -y, +y, -z, +z.
H27_FROM_VTK = [*range(20), 24, 22, 21, 23, 20, 25, 26]
TRIANGLE7 = "TR7"  # a triangle of six nodes and a central node, which is dropped
MAX_NAME_BYTES = 80  # bytes of a group name


def read_med(path: Path) -> Contents:
    """Contents of a .med file with one mesh."""
    cell_of_code = _cell_of_code()
    with open_hdf5(path) as file:
        step, family_groups = _only_mesh(file, path)
        cell_families, point_families = _families(family_groups, "ELEME"), _families(family_groups, "NOEUD")
        points, point_numbers = _points(step)
        point_groups = _groups(point_families, point_numbers)
        blocks, left_out = [], dict[str, int]()
        for code, group in step["MAI"].items() if "MAI" in step else ():
            count = int(group["NOD"].attrs["NBR"]) if "NOD" in group else 0
            if code not in cell_of_code and code != TRIANGLE7:
                left_out[f"MED {code}"] = count
                continue
            cell = cell_of_code.get(code, "triangle6")
            n = 7 if code == TRIANGLE7 else len(CELL_TYPES[cell].nodes)
            node_list = np.asarray(group["NOD"][()], np.int64)
            if not count or len(node_list) != n * count:
                raise ValueError(f"it claims {count} cells of type {code} and lists {len(node_list)} nodes of them")
            nodes = node_list.reshape(n, count).T[:, : len(CELL_TYPES[cell].nodes)] - 1
            block_groups = _groups(cell_families, _family_of(group, count))
            if cell == "vertex":
                point_groups = _united_groups(
                    point_groups, {name: nodes[rows, 0] for name, rows in block_groups.items()}
                )
            else:
                blocks.append(Block(cell, nodes[:, med_order(cell)], block_groups))
    group_names = {name for names in cell_families.values() for name in names}
    return Contents(
        points, blocks, point_groups, empty=tuple(sorted(group_names - point_groups.keys())), left_out=left_out
    )


def write_med(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a .med file; cells (points) with the same groups form one family."""
    import h5py

    cell_of_code = _cell_of_code()
    unknown = sorted(set(mesh.cells) - set(cell_of_code.values()))
    if unknown:
        raise ValueError(
            f"MED files written here hold no cells of type {unknown}; write {path.stem}.msh or .vtu instead."
        )
    too_long = [name for name in mesh.groups if len(name.encode()) > MAX_NAME_BYTES]
    if too_long:
        raise ValueError(f"MED group names have at most {MAX_NAME_BYTES} bytes; shorten {too_long}.")
    cell_families: Families = {}
    tags = [
        _family_numbers({g: by[c] for g, by in mesh.cell_groups.items() if c in by}, len(nodes), cell_families, -1)
        for c, nodes in mesh.cells.items()
    ]
    point_families: Families = {}
    point_tags = _family_numbers(mesh.point_groups, len(mesh.points), point_families, 1)
    cells = [(cell, nodes[:, np.argsort(med_order(cell))]) for cell, nodes in mesh.cells.items()]
    raw = load_meshio().Mesh(mesh.points, cells, point_data={"point_tags": point_tags}, cell_data={"cell_tags": tags})
    image = BytesIO()  # written in memory first: HDF5 does not recover from a full disk
    with meshio_call(path):
        load_meshio().med.write(image, raw)
    with h5py.File(image, "r+") as file:
        file["ENS_MAA/mesh"].attrs["DIM"] = mesh.dimension
        for key, families in (("ELEME", cell_families), ("NOEUD", point_families)):
            for number, names in families.items():
                _write_family(file.require_group(f"FAS/mesh/{key}"), number, names)
    path.write_bytes(image.getvalue())


def med_order(cell: str) -> IntArray:
    """Position (n,) in MED's node list of every node in VTK's order.

    MED numbers lines and surfaces like VTK. Its solids are VTK's with the first two axes exchanged.
    """
    kind = CELL_TYPES[cell]
    if kind.dimension < 3:
        return np.arange(len(kind.nodes))
    mirrored = kind.nodes[H27_FROM_VTK if cell == "hexahedron27" else slice(None)][:, [1, 0, 2]]
    return np.array([int(np.argmin(np.abs(mirrored - node).sum(axis=1))) for node in kind.nodes])


def _cell_of_code() -> dict[str, str]:
    """meshio name of every supported MED cell type."""
    table = load_meshio().med._med.med_to_meshio_type
    return {code: cell for code, cell in table.items() if cell in CELL_TYPES}


def _only_mesh(file: Any, path: Path) -> tuple[Any, Any]:
    """The h5py groups of the one mesh (its one time step) and of its families; None where there are no families."""
    if "ENS_MAA" not in file:
        raise ValueError(
            f"{path.name} is an HDF5 file without a mesh of MED (no ENS_MAA in it); it has {sorted(file)}. Write it "
            "again from Salome or Code_Aster."
        )
    names = list(file["ENS_MAA"])
    if len(names) != 1:
        raise ValueError(
            f"{path.name} is a MED file of {len(names)} meshes, {', '.join(names) or 'none'}; a file with one mesh is "
            "read. Export the mesh that is wanted alone (in Salome: select it, then Export to MED)"
        )
    mesh = file["ENS_MAA"][names[0]]
    families = mesh["FAS"] if "FAS" in mesh else file.get(f"FAS/{names[0]}")
    if "NOE" in mesh:
        return mesh, families
    steps = [name for name in mesh if name != "FAS"]
    if len(steps) != 1:
        raise ValueError(f"its mesh has {len(steps)} time steps; one is needed")
    step = mesh[steps[0]]
    if "NOE" not in step or "COO" not in step["NOE"]:
        raise ValueError("its mesh has no nodes of its own (a structured grid, or one without coordinates)")
    return step, families


def _points(step: Any) -> tuple[Array, IntArray]:
    """Coordinates (n, 3) and family numbers (n,) of the points; a mesh of 1 or 2 dimensions lies on x, or in x, y."""
    coordinates = step["NOE/COO"]
    count = int(coordinates.attrs["NBR"])
    values = np.asarray(coordinates[()], float)
    if not count or len(values) % count or not 1 <= len(values) // count <= 3:
        raise ValueError(f"it claims {count} points and lists {len(values)} coordinates; 1 to 3 of each are needed")
    points = np.zeros((count, 3))
    points[:, : len(values) // count] = values.reshape(-1, count).T
    return points, _family_of(step["NOE"], count)


def _family_of(group: Any, count: int) -> IntArray:
    """Family numbers (count,) of points or cells; 0 (no family) if the file gives none."""
    numbers = np.asarray(group["FAM"][()], np.int64) if "FAM" in group else np.zeros(count, np.int64)
    if len(numbers) != count:
        raise ValueError(f"it lists {len(numbers)} families of {count} points or cells")
    return numbers


def _united_groups(first: dict[str, IntArray], second: dict[str, IntArray]) -> dict[str, IntArray]:
    """Groups of both; groups of the same name are united."""
    return first | {name: np.union1d(first.get(name, rows), rows) for name, rows in second.items()}


def _families(group: Any, key: str) -> Families:
    """Group names of every family number."""
    families: Families = {}
    for family in group[key].values() if group is not None and key in group else ():
        names = family["GRO/NOM"][()] if "GRO" in family else []
        families[int(family.attrs["NUM"])] = [
            np.asarray(name).tobytes().split(b"\0")[0].decode("utf-8", "replace").strip() for name in names
        ]
    return families


def _groups(families: Families, numbers: NDArray[Any]) -> dict[str, IntArray]:
    groups: dict[str, list[IntArray]] = {}
    for number, names in families.items():
        rows = np.flatnonzero(numbers == number)
        for name in names if len(rows) else []:
            groups.setdefault(name, []).append(rows)
    return {name: np.concatenate(rows) for name, rows in groups.items()}


def _family_numbers(groups: dict[str, IntArray], count: int, families: Families, sign: int) -> IntArray:
    """Family number (count,) of every item, 0 in no group; new families are added to `families`."""
    numbers = np.zeros(count, np.int64)
    for kind, rows in group_classes(groups, count):
        if kind:
            number = next((n for n, names in families.items() if names == [*kind]), sign * (len(families) + 1))
            families[number] = [*kind]
            numbers[rows] = number
    return numbers


def _write_family(group: Any, number: int, names: list[str]) -> None:
    """One family as the MED library lays it out: 80 bytes per group name."""
    family = group.create_group(f"FAM_{number}")
    family.attrs["NUM"] = number
    listed = family.create_group("GRO")
    listed.attrs["NBR"] = len(names)
    data = listed.create_dataset("NOM", (len(names),), dtype="80int8")
    for k, name in enumerate(names):
        data[k] = np.frombuffer(name.encode().ljust(MAX_NAME_BYTES, b"\0"), np.int8)


register(NAME, (".med", ".mmed", ".rmed"), read_med, write_med)
