"""Exodus, XDMF, universal files and Ansys archives: each written by another program, or by hand from its manual."""

from __future__ import annotations

import random
import warnings
from pathlib import Path

import numpy as np
import pytest
from test_mesh_damaged import damaged, sheet

from femflex.mesh import box, read_mesh, rectangle, write_mesh
from femflex.mesh.quality import sizes
from femflex.mesh.vtk_data import make_grid
from femflex.warning import PhysicsWarning


def test_an_exodus_file_of_vtk_is_read_with_its_blocks(tmp_path: Path):
    exodus = pytest.importorskip("vtkmodules.vtkIOExodus")
    mesh, path = box(2, 1, 1, 2, 1, 1), tmp_path / "box.exo"
    writer = exodus.vtkExodusIIWriter()
    writer.SetInputData(make_grid(mesh.points, dict(mesh.cells), {}, {}))
    writer.SetFileName(str(path))
    writer.Write()
    found = read_mesh(path)
    assert {cell: len(nodes) for cell, nodes in found.cells.items()} == {"hexahedron": 2, "quad": 10}
    assert sorted(found.cell_groups) == ["block_12", "block_9"]  # numbered by VTK's types
    assert sizes(found.points, "hexahedron", found.cells["hexahedron"]) == pytest.approx([1, 1])
    assert len(found.points) == 12
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ValueError, match=r"box.exo could not be read as Exodus: its contents are not those of this fo"):
        read_mesh(path)
    with pytest.raises(ValueError, match=r"other.e: Exodus is read only; write other.msh or .vtu instead"):
        write_mesh(tmp_path / "other.e", mesh)


@pytest.mark.parametrize("stored", ["XML", "HDF"])
def test_an_xdmf_file_of_meshio_is_read_with_its_marked_cells(stored: str, tmp_path: Path):
    meshio = pytest.importorskip("meshio")
    mesh, path = rectangle(2, 1, 2, 1, "quad"), tmp_path / "plate.xdmf"
    marks = [np.array([7, 9]), np.array([9] * 6)]
    meshio.xdmf.write(
        path, meshio.Mesh(mesh.points, list(mesh.cells.items()), cell_data={"mat": marks}), data_format=stored
    )
    found = read_mesh(path)
    assert {cell: len(nodes) for cell, nodes in found.cells.items()} == {"quad": 2, "line": 6}
    assert found.group_cells("mat_7")["quad"].tolist() == [mesh.cells["quad"][0].tolist()]
    assert len(found.group_cells("mat_9")["line"]) == 6
    assert found.points == pytest.approx(mesh.points)
    path.write_text(path.read_text().replace("Geometry", "Gemetry"))
    with pytest.raises(ValueError, match=r"plate.xdmf could not be read as XDMF"):
        read_mesh(path)


def dataset(number: int, *lines: str) -> str:
    return "\n".join(["    -1", f"{number:6d}", *lines, "    -1", ""])


def unv_elements(cells: list[tuple[int, int, int, list[int]]]) -> list[str]:
    """Dataset 2412 of (number, descriptor, property, nodes)."""
    lines = []
    for number, kind, prop, nodes in cells:
        lines.append("".join(f"{value:10d}" for value in (number, kind, prop, 1, 7, len(nodes))))
        lines += ["         0         1         1"] if kind in (11, 21, 22, 24) else []
        lines += ["".join(f"{n:10d}" for n in nodes[k : k + 8]) for k in range(0, len(nodes), 8)]
    return lines


def unv_nodes(points: np.ndarray) -> list[str]:
    """Dataset 2411, numbered from 11."""
    lines = []
    for k, row in enumerate(points):
        lines += [f"{k + 11:10d}{1:10d}{1:10d}{11:10d}", "".join(f"{x:25.16E}" for x in row).replace("E", "D")]
    return lines


def test_a_universal_file_is_read_with_its_groups(tmp_path: Path):
    """A brick of 20 nodes, a tetrahedron of 10 and a beam of three, in the order of the format: round every face."""
    brick, path = box(1, 1, 1, 1, 1, 1, "hexahedron20"), tmp_path / "parts.unv"
    corner = box(1, 1, 1, 1, 1, 1, "tetra10").moved([3, 0, 0])
    points = np.concatenate([brick.points, corner.points])
    (hexa,), tetra = brick.cells["hexahedron20"], corner.cells["tetra10"][0] + len(brick.points)
    ring = [0, 8, 1, 9, 2, 10, 3, 11, 16, 17, 18, 19, 4, 12, 5, 13, 6, 14, 7, 15]
    cells = [
        (5, 116, 2, (hexa[ring] + 11).tolist()),
        (6, 118, 3, (tetra[[0, 4, 1, 5, 2, 6, 7, 8, 9, 3]] + 11).tolist()),
        (7, 24, 4, [hexa[0] + 11, hexa[8] + 11, hexa[1] + 11]),
        (8, 161, 4, [hexa[0] + 11]),
    ]
    group = [f"{1:10d}" + f"{0:10d}" * 6 + f"{3:10d}", "both solids", "8 5 0 0 8 6 0 0", "8 99 0 0"]
    nodes = [f"{2:10d}" + f"{0:10d}" * 6 + f"{1:10d}", "", f"7 {hexa[0] + 11} 0 0"]
    path.write_text(
        dataset(151, "a model") + dataset(2411, *unv_nodes(points)) + dataset(2412, *unv_elements(cells))
        + dataset(2467, *group, *nodes)
    )  # fmt: skip
    with pytest.warns(PhysicsWarning) as caught:
        mesh = read_mesh(path)
    assert any("left out: element 161 of 1 nodes (1); 3 are kept" in str(one.message) for one in caught)
    assert mesh.points[mesh.cells["hexahedron20"][0]] == pytest.approx(brick.points[hexa])
    assert mesh.points[mesh.cells["tetra10"][0]] == pytest.approx(points[tetra])
    assert mesh.points[mesh.cells["line3"][0]] == pytest.approx(brick.points[hexa[[0, 1, 8]]])
    assert sorted(mesh.group_cells("both solids")) == ["hexahedron20", "tetra10"]
    assert list(mesh.group_cells("property_3")) == ["tetra10"]
    assert mesh.points[mesh.group_points("group_2")] == pytest.approx(brick.points[hexa[:1]])


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


def test_an_ansys_archive_is_read_with_its_components(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("mapdl_archive")
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 2], [1, 0, 2], [1, 1, 2], [0, 1, 2]], float)
    nodes = "\n".join(f"{k:8d}{0:8d}{0:8d}" + "".join(f"{x:20.13E}" for x in row) for k, row in enumerate(corners, 1))
    path = tmp_path / "brick.cdb"
    path.write_text(CDB.format(nodes=nodes))
    mesh = read_mesh(path)
    assert sizes(mesh.points, "hexahedron", mesh.cells["hexahedron"]) == pytest.approx([2])
    assert {"type_1", "mat_3", "real_5"} <= set(mesh.cell_groups)
    assert mesh.points[mesh.group_points("ROOT")][:, 2].tolist() == [0, 0, 0, 0]
    path.write_text("/PREP7\nFINISH\n")
    with pytest.raises(ValueError, match=r"brick.cdb"):
        read_mesh(path)
    monkeypatch.setattr("femflex.mesh.io_ansys.find_spec", lambda name: None)
    with pytest.raises(ValueError, match=r"brick.cdb: reading Ansys archives needs mapdl-archive.*pip install"):
        read_mesh(path)


def whole_file(kind: str, path: Path) -> bytes:
    """A sound file of a format."""
    if kind == "unv":
        path.write_text(UNV)
    elif kind == "exo":
        writer = pytest.importorskip("vtkmodules.vtkIOExodus").vtkExodusIIWriter()
        writer.SetInputData(make_grid(sheet().points, dict(sheet().cells), {}, {}))
        writer.SetFileName(str(path))
        writer.Write()
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
    if kind == "cdb":
        pytest.importorskip("mapdl_archive")
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
def test_empty_and_foreign_files_are_refused_in_a_sentence(suffix: str, content: bytes, tmp_path: Path):
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(content)
    with warnings.catch_warnings(), pytest.raises(ValueError) as error:
        warnings.simplefilter("ignore")
        read_mesh(path)
    assert path.name in str(error.value)
    for word in ("list index", "KeyError", "unpack", "invalid literal", "zero-size"):
        assert word not in str(error.value)
