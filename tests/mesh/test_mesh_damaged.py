"""Damaged mesh files of every format, and files that claim more than they hold: one sentence, at once."""

from __future__ import annotations

import random
import warnings
from pathlib import Path

import numpy as np
import pytest
from support.mesh_files import damaged, dataset, sheet, unv_elements, unv_nodes, written_exodus

from femflex.mesh import read_mesh, write_mesh

FORMATS = [
    (".msh", {"binary": True, "version": "4.1"}),
    (".msh", {"binary": False, "version": "4.1"}),
    (".msh", {"binary": True, "version": "2.2"}),
    (".msh", {"binary": False, "version": "2.2"}),
    (".inp", {}),
    (".bdf", {}),
    (".vtu", {"binary": True}),
    (".vtu", {"binary": False}),
    (".vtk", {"binary": True}),
    (".vtk", {"binary": False}),
    (".med", {}),
]


def check_damaged(suffix: str, options: dict, folder: Path, generator: random.Random, count: int) -> int:
    """Read so many damaged files; ValueError with a sentence that names the file, or a mesh. How many were refused."""
    path, refused = folder / f"mesh{suffix}", 0
    write_mesh(path, sheet(), **options)
    whole = path.read_bytes()
    for _ in range(count):
        path.write_bytes(damaged(whole, generator))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                assert len(read_mesh(path).points)
            except ValueError as error:
                refused += 1
                assert path.name in str(error) or "group" in str(error) or "cells" in str(error)
                assert len(str(error)) < 1500
    return refused


@pytest.mark.parametrize(("suffix", "options"), FORMATS)
def test_damaged_files_are_refused_or_read(suffix: str, options: dict, tmp_path: Path):
    assert check_damaged(suffix, options, tmp_path, random.Random(5), 20) > 2


@pytest.mark.slow
@pytest.mark.parametrize(("suffix", "options"), FORMATS)
def test_many_damaged_files_are_refused_or_read(suffix: str, options: dict, tmp_path: Path):
    assert check_damaged(suffix, options, tmp_path, random.Random(6), 1500) > 100


DECK = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 2, 0, 0\n*ELEMENT, TYPE=B31, ELSET=BOOM\n1, 1, 2\n2, 2, 3\n"


def test_long_ranges_take_no_memory(tmp_path: Path):
    path = tmp_path / "boom.inp"
    path.write_text(DECK + "*NSET, NSET=ALL, GENERATE\n1, 400000000, 2\n*ELSET, ELSET=E, GENERATE\n2, 400000000\n")
    mesh = read_mesh(path)
    assert mesh.point_groups["ALL"].tolist() == [0, 2] and mesh.cell_groups["E"]["line"].tolist() == [1]
    path = tmp_path / "boom.bdf"
    path.write_text(
        "SET 1 = 1 THRU 99999999 EXCEPT 2 THRU 50\nBEGIN BULK\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,77,,2.,0.,0.\n"
        'CBAR,1,1,1,2,0.,0.,1.\nCBAR,2,1,2,77,0.,0.,1.\n$HMSET 1 1 "ends"\nENDDATA\n'
    )
    assert read_mesh(path).point_groups["ends"].tolist() == [0, 2]


UNV = dataset(2411, *unv_nodes(np.eye(3))) + dataset(2412, *unv_elements([(1, 91, 1, [11, 12, 13])]))
CDB = """\
/PREP7
ET,1,185
NBLOCK,6,SOLID,8,8
(3i8,6e20.13)
{nodes}
N,R5.3,LOC,-1,
EBLOCK,19,SOLID,1,1
(19i8)
       3       1       5       1       0       0       0       0       8       0       7       1       2       3       4       5       6       7       8
      -1
CMBLOCK,ROOT,NODE,2
(8i10)
         1        -4
FINISH
"""  # noqa: E501


def whole_file(kind: str, path: Path) -> bytes:
    """A sound file of a format."""
    if kind == "unv":
        path.write_text(UNV)
    elif kind == "exo":
        written_exodus(sheet(), path)
    elif kind == "xdmf":
        meshio = pytest.importorskip("meshio")
        meshio.xdmf.write(path, meshio.Mesh(sheet().points, list(sheet().cells.items())), data_format="XML")
    else:
        nodes = "\n".join(
            f"{k:8d}{0:8d}{0:8d}" + "".join(f"{x:20.13E}" for x in row) for k, row in enumerate(np.eye(8, 3), 1)
        )
        path.write_text(CDB.format(nodes=nodes))
    return path.read_bytes()


@pytest.mark.parametrize("kind", ["unv", "exo", "xdmf", "cdb"])
def test_damaged_files_of_other_programs_are_refused_or_read(kind: str, tmp_path: Path):
    path = tmp_path / f"mesh.{kind}"
    whole, generator, refused = whole_file(kind, path), random.Random(8), 0
    for _ in range(25):
        path.write_bytes(damaged(whole, generator))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                read_mesh(path)
            except ValueError as error:
                refused += 1
                assert path.name in str(error)
                for word in ("list index", "KeyError", "unpack", "invalid literal", "Traceback", "vtk"):
                    assert word not in str(error)
    assert refused > 3


@pytest.mark.parametrize("suffix", [".inp", ".bdf", ".med", ".msh", ".vtu", ".vtk", ".exo", ".xdmf", ".unv"])
@pytest.mark.parametrize(
    "content", [b"", b"\n", b"\0" * 64, b"hello, world\n", b"*NODE\n1, 0.\n", b"$MeshFormat\n4.1 0 8\n"]
)
def test_empty_and_foreign_files_are_refused(suffix: str, content: bytes, tmp_path: Path):
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(content)
    with warnings.catch_warnings(), pytest.raises(ValueError) as error:
        warnings.simplefilter("ignore")
        read_mesh(path)
    assert path.name in str(error.value)
    for word in ("list index", "KeyError", "unpack", "invalid literal", "zero-size"):
        assert word not in str(error.value)
