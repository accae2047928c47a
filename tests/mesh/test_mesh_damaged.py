"""Damaged mesh files of every format, and files that claim more than they hold: one sentence, at once."""

from __future__ import annotations

import random
import re
import warnings
from pathlib import Path

import numpy as np
import pytest

from femflex.mesh import Mesh, read_mesh, write_mesh

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
WRONG = [b"1000000000", b"400000000", b"99999999999999999999", b"-1", b"0", b"1e300", b"nan", b"4294967295", b"x"]


def sheet() -> Mesh:
    """Twelve quads in a group, with an edge."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij"))
    first = np.array([4 * i + j for i in range(4) for j in range(3)])
    quads = np.column_stack([first, first + 4, first + 5, first + 1])
    return Mesh(np.column_stack([x, y, 0 * x]), {"quad": quads}, {"sheet": {"quad": np.arange(12)}}, {"edge": range(4)})


def damaged(data: bytes, generator: random.Random) -> bytes:
    """The bytes cut short, with bits turned over, with a piece taken out, or with a number replaced."""
    kind, changed, at = generator.randrange(5), bytearray(data), generator.randrange(len(data))
    if kind == 0:
        return data[:at]
    if kind == 1:
        changed[at] ^= 1 << generator.randrange(8)
    elif kind == 2:
        del changed[at : at + generator.randrange(1, 64)]
    elif kind == 3:
        changed[at : at + 8] = generator.choice([b"\xff" * 8, (10**9).to_bytes(8, "little"), bytes(8)])
    else:
        numbers = list(re.finditer(rb"(?<![\w.])\d+(?![\w.])", data))
        found = generator.choice(numbers) if numbers else None
        return data if found is None else data[: found.start()] + generator.choice(WRONG) + data[found.end() :]
    return bytes(changed)


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
    assert check_damaged(suffix, options, tmp_path, random.Random(5), 40) > 5


@pytest.mark.slow
@pytest.mark.parametrize(("suffix", "options"), FORMATS)
def test_many_damaged_files_are_refused_or_read(suffix: str, options: dict, tmp_path: Path):
    count = 150 if suffix in (".vtu", ".vtk") else 1500  # each of VTK's takes a process of its own
    assert check_damaged(suffix, options, tmp_path, random.Random(6), count) > count / 15


@pytest.mark.sampled(1)
@pytest.mark.parametrize("encoded", [0, 1])
@pytest.mark.parametrize("compressed", [0, 1])
def test_appended_data_of_vtk_that_are_damaged_are_refused(encoded: int, compressed: int, tmp_path: Path):
    vtk = pytest.importorskip("vtkmodules.vtkIOXML")
    path, plain = tmp_path / "mesh.vtu", tmp_path / "plain.vtu"
    write_mesh(plain, sheet(), binary=False)
    reader, writer = vtk.vtkXMLUnstructuredGridReader(), vtk.vtkXMLUnstructuredGridWriter()
    reader.SetFileName(str(plain))
    writer.SetInputConnection(reader.GetOutputPort())
    writer.SetFileName(str(path))
    writer.SetDataModeToAppended()
    writer.SetEncodeAppendedData(encoded)
    writer.SetCompressorTypeToZLib() if compressed else writer.SetCompressorTypeToNone()
    writer.Write()
    whole, generator, refused = path.read_bytes(), random.Random(7), 0
    assert len(read_mesh(path).cells["quad"]) == 12
    start = whole.index(b"<AppendedData")
    for _ in range(60):
        path.write_bytes(whole[:start] + damaged(whole[start:], generator))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                read_mesh(path)
        except ValueError as error:
            refused += 1
            assert "mesh.vtu" in str(error)
    assert refused > 10


DECK = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 2, 0, 0\n*ELEMENT, TYPE=B31, ELSET=BOOM\n1, 1, 2\n2, 2, 3\n"


def test_ranges_of_a_deck_take_no_memory_however_long(tmp_path: Path):
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
