"""MED (Salome, Code_Aster): groups are families of cells and of points.

meshio leaves MED's node order, which turns solids inside out against everyone else's, fails on families without groups
and on accents, and writes no group by name. So families are read and written here with h5py, and meshio is given a copy
with points and cells alone.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.contents import Block, Contents
from femflex.mesh.formats import WriteOptions, load_meshio, meshio_speaking, register
from femflex.mesh.membership import classes
from femflex.mesh.mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Families = dict[int, list[str]]

NAME = "MED"
# MED lists the faces of its 27-node brick as bottom, four sides, top; VTK as -x, +x, -y, +y, -z, +z.
H27_FROM_VTK = [*range(20), 24, 22, 21, 23, 20, 25, 26]
LONGEST = 80  # bytes of a group name


def read(path: Path) -> Contents:
    """Contents of a .med file with one mesh."""
    import h5py

    known = _codes()
    left_out: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "plain.med"
        shutil.copyfile(path, plain)
        with meshio_speaking(path, NAME):
            with h5py.File(plain, "r+") as file:
                step, families = _only_mesh(file)
                cell_families, point_families = _families(families, "ELEME"), _families(families, "NOEUD")
                left_out = _keep_known(file, step, families, known)
            raw = load_meshio().med.read(plain)
    blocks = []
    for part, numbers in zip(raw.cells, raw.cell_data["cell_tags"], strict=True):
        nodes = part.data[:, med_order(part.type)] if part.type in CELL_TYPES else part.data
        blocks.append(Block(part.type, nodes, _groups(cell_families, numbers)))
    points = _groups(point_families, raw.point_data["point_tags"])
    named = {name for names in cell_families.values() for name in names}
    return Contents(raw.points, blocks, points, empty=tuple(sorted(named)), left_out=left_out)


def write(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a .med file; cells (points) that share their groups are one family."""
    import h5py

    known = _codes()
    unknown = sorted(set(mesh.cells) - set(known.values()))
    if unknown:
        raise ValueError(
            f"MED files written here hold no cells of type {unknown}; write {path.stem}.msh or .vtu instead."
        )
    long = [name for name in mesh.groups if len(name.encode()) > LONGEST]
    if long:
        raise ValueError(f"MED group names have at most {LONGEST} bytes; shorten {long}.")
    cell_families: Families = {}
    tags = [
        _family_numbers({g: by[c] for g, by in mesh.cell_groups.items() if c in by}, len(nodes), cell_families, -1)
        for c, nodes in mesh.cells.items()
    ]
    point_families: Families = {}
    point_tags = _family_numbers(mesh.point_groups, len(mesh.points), point_families, 1)
    cells = [(cell, nodes[:, np.argsort(med_order(cell))]) for cell, nodes in mesh.cells.items()]
    raw = load_meshio().Mesh(mesh.points, cells, point_data={"point_tags": point_tags}, cell_data={"cell_tags": tags})
    with meshio_speaking(path, NAME, "written"):
        load_meshio().med.write(path, raw)
    with h5py.File(path, "r+") as file:
        file["ENS_MAA/mesh"].attrs["DIM"] = mesh.dimension
        for key, families in (("ELEME", cell_families), ("NOEUD", point_families)):
            for number, names in families.items():
                _write_family(file.require_group(f"FAS/mesh/{key}"), number, names)


def med_order(cell: str) -> Index:
    """Position in MED's node list of every node of our order.

    MED numbers surfaces and lines like VTK, and solids like VTK's seen in a mirror that swaps the first two axes.
    """
    kind = CELL_TYPES[cell]
    if kind.dimension < 3:
        return np.arange(len(kind.nodes))
    mirrored = kind.nodes[H27_FROM_VTK if cell == "hexahedron27" else slice(None)][:, [1, 0, 2]]
    return np.array([int(np.argmin(np.abs(mirrored - node).sum(axis=1))) for node in kind.nodes])


def _codes() -> dict[str, str]:
    """Our name of every MED cell type that is understood."""
    table = load_meshio().med._med.med_to_meshio_type
    return {code: cell for code, cell in table.items() if cell in CELL_TYPES}


def _only_mesh(file: Any) -> tuple[Any, Any]:
    """The h5py groups of the one mesh (its one time step) and of its families."""
    names = list(file["ENS_MAA"])
    if len(names) != 1:
        raise ValueError(f"it holds {len(names)} meshes, {names}; one is needed")
    mesh = file["ENS_MAA"][names[0]]
    families = mesh["FAS"] if "FAS" in mesh else file.require_group(f"FAS/{names[0]}")
    if "NOE" in mesh:
        return mesh, families
    steps = [name for name in mesh if name != "FAS"]
    if len(steps) != 1:
        raise ValueError(f"its mesh has {len(steps)} time steps; one is needed")
    return mesh[steps[0]], families


def _families(group: Any, key: str) -> Families:
    """Group names of every family number."""
    families: Families = {}
    for family in group[key].values() if key in group else ():
        names = family["GRO/NOM"][()] if "GRO" in family else []
        families[int(family.attrs["NUM"])] = [
            np.asarray(name, np.int8).tobytes().split(b"\0")[0].decode("utf-8", "replace").strip() for name in names
        ]
    return families


def _keep_known(file: Any, step: Any, families: Any, known: dict[str, str]) -> dict[str, int]:
    """Take out of a copy what meshio fails on, and put family numbers where there are none; the left-out cells."""
    left_out = {}
    for key in [key for key in file if key in ("CHA", "PROFILS")]:
        del file[key]
    for key in [key for key in families if key in ("ELEME", "NOEUD")]:
        del families[key]
    for code in list(step["MAI"]):
        count = int(step["MAI"][code]["NOD"].attrs["NBR"]) if "NOD" in step["MAI"][code] else 0
        if code not in known:
            left_out[f"MED {code}"] = count
            del step["MAI"][code]
        elif "FAM" not in step["MAI"][code]:
            step["MAI"][code]["FAM"] = np.zeros(count, np.int64)
    if "FAM" not in step["NOE"]:
        step["NOE"]["FAM"] = np.zeros(int(step["NOE"]["COO"].attrs["NBR"]), np.int64)
    return left_out


def _groups(families: Families, numbers: NDArray[Any]) -> dict[str, Index]:
    groups: dict[str, list[Index]] = {}
    for number, names in families.items():
        rows = np.flatnonzero(numbers == number)
        for name in names if len(rows) else []:
            groups.setdefault(name, []).append(rows)
    return {name: np.concatenate(rows) for name, rows in groups.items()}


def _family_numbers(groups: dict[str, Index], count: int, families: Families, sign: int) -> Index:
    """Family number (count,) of every item, 0 in no group; new families are added to `families`."""
    numbers = np.zeros(count, np.int64)
    for kind, rows in classes(groups, count):
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
        data[k] = np.frombuffer(name.encode().ljust(LONGEST, b"\0"), np.int8)


register(NAME, (".med",), read, write)
