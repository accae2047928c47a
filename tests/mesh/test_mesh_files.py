"""The meshes that are shipped, and files that are not what they should be."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from femflex.mesh import line, read_mesh, write_mesh
from femflex.mesh.quality import qualities, sizes
from femflex.warning import PhysicsWarning

MESHES = Path(__file__).parents[2] / "meshes"
NO_MESHES = ("boom_matrices.pch", "laminate.bdf", "mast.bdf")  # matrices; decks with coordinate systems of their own


def test_the_boom_is_33_m_of_lines_along_no_axis():
    mesh = read_mesh(MESHES / "boom.msh")
    length = sizes(mesh.points, "line", mesh.group_cells("boom")["line"])
    assert length == pytest.approx(np.full(20, 1.65), rel=1e-12)
    way = mesh.points[mesh.group_points("tip")[0]] - mesh.points[mesh.group_points("root")[0]]
    assert np.linalg.norm(way) == pytest.approx(33, rel=1e-14)
    assert (np.abs(way) > 1).all()


@pytest.mark.parametrize(("name", "cell"), [("panel.msh", "triangle"), ("panel6.msh", "triangle6")])
def test_the_panels_have_their_area_root_and_hinges(name, cell):
    mesh = read_mesh(MESHES / name)
    nodes = mesh.group_cells("panel")[cell]
    assert sizes(mesh.points, cell, nodes).sum() == pytest.approx(9, rel=1e-9)
    assert qualities(mesh.points, cell, nodes).min() > 0.6
    assert np.abs(mesh.points[mesh.group_points("root")][:, 0]).max() == 0
    assert mesh.group_points("root").tolist() == np.flatnonzero(mesh.points[:, 0] == 0).tolist()
    for group, at in {"hinge_1": [0, -0.5, 0], "hinge_2": [0, 0.5, 0], "tip_corner": [6, 0.75, 0]}.items():
        assert mesh.points[mesh.group_points(group)].tolist() == [at]
    assert np.isin(mesh.group_points("hinge_1"), mesh.group_points("root")).all()


def test_the_frame_is_an_l_of_two_legs():
    mesh = read_mesh(MESHES / "l_frame.inp")
    for group, length in {"mast": 4, "arm": 3}.items():
        assert sizes(mesh.points, "line", mesh.group_cells(group)["line"]).sum() == pytest.approx(length)
    assert (
        np.intersect1d(mesh.group_points("mast"), mesh.group_points("arm")).tolist()
        == mesh.group_points("corner").tolist()
    )
    assert mesh.points[mesh.group_points("tip")].tolist() == [[3, 0, 4]]


def test_the_strip_is_read_by_name_and_by_number():
    mesh = read_mesh(MESHES / "strip.bdf")
    assert mesh.groups == ["inner", "outer", "root", "strip", "tip"]
    numbered = read_mesh(MESHES / "strip.bdf", groups={"clamp": "SET 1", "skin": "PID 1", "whole": "SET 3"})
    assert numbered.group_points("clamp").tolist() == mesh.group_points("root").tolist()
    assert numbered.group_cells("skin")["quad"].tolist() == mesh.group_cells("inner")["quad"].tolist()
    assert len(numbered.group_cells("whole")["quad"]) == 20


@pytest.mark.filterwarnings("ignore:half_panels.inp. 13 pairs of points lie within")  # its *TIE joins them in a deck
@pytest.mark.sampled(6)
@pytest.mark.parametrize("script", sorted(MESHES.glob("make_*.py")), ids=lambda p: p.name)
def test_every_script_makes_the_files_beside_it(script, tmp_path):
    if "gmsh" in script.read_text():
        pytest.importorskip("gmsh")
    copy = tmp_path / script.name
    copy.write_text(script.read_text())
    subprocess.run([sys.executable, str(copy)], check=True, cwd=tmp_path, env={"PYTHONPATH": str(MESHES.parent)})
    made = [path for path in tmp_path.iterdir() if path != copy]
    assert made
    for path in made:
        assert (MESHES / path.name).stat().st_size < 200_000
        if path.name in NO_MESHES:
            assert numbers_of(path) == pytest.approx(numbers_of(MESHES / path.name), rel=1e-6, abs=1e-6)
            continue
        new, kept = read_mesh(path), read_mesh(MESHES / path.name)
        assert new.groups == kept.groups
        assert np.ptp(new.points, axis=0) == pytest.approx(np.ptp(kept.points, axis=0))


def numbers_of(path):
    """Every number of a file of text."""
    return [float(word.replace("D", "E")) for word in re.findall(r"[-+]?\d+\.?\d*(?:[DE][-+]?\d+)?", path.read_text())]


def test_a_missing_file_is_answered_with_its_neighbours(tmp_path):
    with pytest.raises(
        ValueError,
        match=r"bom.msh does not exist; .*meshes holds \[.*'boom.msh', .*'link.msh', 'panel.msh', .*'slab.msh'.*\]",
    ):
        read_mesh(MESHES / "bom.msh")
    with pytest.raises(ValueError, match=r"boom.stp: .stp is not a known mesh format; known are .*\.msh \(Gmsh .msh\)"):
        read_mesh(MESHES / "boom.stp")
    with pytest.raises(ValueError, match="boom: no suffix is not a known mesh format"):
        read_mesh(MESHES / "boom")


@pytest.mark.parametrize("suffix", [".msh", ".vtu", ".vtk", ".med", ".inp", ".bdf"])
@pytest.mark.parametrize("content", [b"", b"not a mesh\n", bytes(range(256)) * 4])
def test_files_of_something_else_are_refused_in_a_sentence(suffix, content, tmp_path):
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=f"mesh{suffix}"):
        read_mesh(path)


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize(
    ("suffix", "version"), [(".msh", "4.1"), (".msh", "2.2"), (".vtu", None), (".vtk", None), (".med", None)]
)
def test_files_cut_short_are_refused_in_a_sentence(suffix, version, binary, tmp_path):
    path = tmp_path / f"mesh{suffix}"
    write_mesh(path, line([[0, 0, 0], [1, 1, 0]], 50), binary=binary, version=version)
    whole = path.read_bytes()
    for share in (0.3, 0.6):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(ValueError, match=f"mesh{suffix}"):
            read_mesh(path)


def test_coordinates_that_are_no_numbers_and_cells_without_size_are_refused(tmp_path):
    path = tmp_path / "mesh.msh"
    write_mesh(path, line([[0, 0, 0], [1, 0, 0]], 2), binary=False, version="2.2")
    text = path.read_text()
    path.write_text(text.replace("2 5.0000000000000000e-01", "2 nan"))
    with pytest.raises(
        ValueError, match=r"1 of 3 mesh points have coordinates that are not finite, the first is point 1"
    ):
        read_mesh(path)
    path.write_text(text.replace("2 5.0000000000000000e-01", "2 0.0000000000000000e+00"))
    with pytest.raises(
        ValueError, match=r"mesh.msh: 1 of 2 cells of type line have no length, the first is number 0 at"
    ):
        read_mesh(path)


def msh(nodes, elements):
    """Text of format 2.2."""
    parts = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(nodes)), *nodes, "$EndNodes"]
    return "\n".join([*parts, "$Elements", str(len(elements)), *elements, "$EndElements", ""])


def test_elements_that_are_not_understood_are_left_out_and_said(tmp_path):
    path = tmp_path / "mesh.msh"
    nodes = ["10 0 0 0", "20 1 0 0", "30 1 1 0", "40 0 1 0", "50 .5 .5 1", "60 9 9 9", "70 .3 .3 0"]
    cubic = " ".join(["10 20 30 40 50"] + ["70"] * 5)  # a triangle of ten nodes
    elements = [f"1 21 2 1 1 {cubic}", f"2 21 2 1 1 20 {cubic[3:]}", "3 2 2 2 1 10 20 30"]
    path.write_text(msh(nodes, elements))
    with pytest.warns(
        PhysicsWarning, match=r"mesh.msh: elements not understood and left out: triangle10 \(2\); 1 are kept"
    ):
        mesh = read_mesh(path)
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]  # numbers with gaps, unused nodes dropped
    assert mesh.group_cells("surface_2")["triangle"].tolist() == [[0, 1, 2]]
    with pytest.raises(ValueError, match="group 'surface_1' is not in the mesh"):
        mesh.group_cells("surface_1")


def test_elements_on_nodes_that_do_not_exist_are_refused(tmp_path):
    path = tmp_path / "mesh.msh"
    path.write_text(msh(["1 0 0 0", "4 1 0 0"], ["1 1 2 1 1 1 4", "2 1 2 1 1 4 2"]))
    with pytest.raises(ValueError, match=r"mesh.msh: 1 elements of type line use nodes that the file does not define"):
        read_mesh(path)


@pytest.mark.parametrize("lost", [1, 28, 57])
def test_binary_2_2_that_ends_before_its_last_node_is_said_to_be_cut_short(lost, tmp_path):
    path = tmp_path / "short.msh"
    write_mesh(path, line([[0, 0, 0], [1, 0, 0]], 2), version="2.2")
    data = path.read_bytes()
    end = data.index(b"$EndNodes") - (data[data.index(b"$EndNodes") - 1 :][:1] == b"\n")
    path.write_bytes(data[: end - lost] + data[data.index(b"$EndNodes") :])
    with pytest.raises(ValueError, match=r"short.msh announces 3 nodes but ends before the last; the file is cut"):
        read_mesh(path)


def test_binary_2_2_with_gaps_is_refused_with_advice(tmp_path):
    path = tmp_path / "mesh.msh"
    write_mesh(path, line([[0, 0, 0], [1, 0, 0]], 2), version="2.2")
    data = path.read_bytes()
    start = data.index(b"$Nodes\n3\n") + len(b"$Nodes\n3\n")
    path.write_bytes(data[:start] + np.int32(9).tobytes() + data[start + 4 :])
    with pytest.raises(ValueError, match=r"binary of version 2.2 and numbers its 3 nodes up to 9; with gaps only text"):
        read_mesh(path)


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "mesh.inp"
    write_mesh(path, line([[0, 0, 0], [1, 0, 0]], 2))
    before = path.read_text()
    with pytest.raises(ValueError, match="cannot stand in an Abaqus deck"):
        write_mesh(path, line([[0, 0, 0], [1, 0, 0]], 2).with_groups(points={'"': [0]}))
    assert path.read_text() == before
    assert [p.name for p in tmp_path.iterdir()] == ["mesh.inp"]


def test_importing_the_mesh_layer_loads_neither_meshio_nor_gmsh():
    code = "import sys, femflex.mesh; print([m for m in ('meshio', 'gmsh', 'scipy', 'h5py') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=MESHES.parent, check=True)
    assert done.stdout.strip() == "[]"
