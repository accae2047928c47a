"""The meshes that are shipped, and files that are not what they should be."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from femflex.mesh import line, read_mesh, write_mesh
from femflex.mesh.quality import qualities, sizes

MESHES = Path(__file__).parents[2] / "meshes"
NO_MESHES = ("boom_matrices.pch", "laminate.bdf", "mast.bdf")  # matrices; decks with coordinate systems of their own


def test_boom_mesh():
    mesh = read_mesh(MESHES / "boom.msh")
    length = sizes(mesh.points, "line", mesh.group_cells("boom")["line"])
    assert length == pytest.approx(np.full(20, 1.65), rel=1e-12)
    way = mesh.points[mesh.group_points("tip")[0]] - mesh.points[mesh.group_points("root")[0]]
    assert np.linalg.norm(way) == pytest.approx(33, rel=1e-14)
    assert (np.abs(way) > 1).all()


@pytest.mark.parametrize(("name", "cell"), [("panel.msh", "triangle"), ("panel6.msh", "triangle6")])
def test_panel_meshes(name, cell):
    mesh = read_mesh(MESHES / name)
    nodes = mesh.group_cells("panel")[cell]
    assert sizes(mesh.points, cell, nodes).sum() == pytest.approx(9, rel=1e-9)
    assert qualities(mesh.points, cell, nodes).min() > 0.6
    assert np.abs(mesh.points[mesh.group_points("root")][:, 0]).max() == 0
    assert mesh.group_points("root").tolist() == np.flatnonzero(mesh.points[:, 0] == 0).tolist()
    for group, at in {"hinge_1": [0, -0.5, 0], "hinge_2": [0, 0.5, 0], "tip_corner": [6, 0.75, 0]}.items():
        assert mesh.points[mesh.group_points(group)].tolist() == [at]
    assert np.isin(mesh.group_points("hinge_1"), mesh.group_points("root")).all()


def test_strip_groups_by_name_and_number():
    mesh = read_mesh(MESHES / "strip.bdf")
    assert mesh.groups == ["inner", "outer", "root", "strip", "tip"]
    numbered = read_mesh(MESHES / "strip.bdf", groups={"clamp": "SET 1", "skin": "PID 1", "whole": "SET 3"})
    assert numbered.group_points("clamp").tolist() == mesh.group_points("root").tolist()
    assert numbered.group_cells("skin")["quad"].tolist() == mesh.group_cells("inner")["quad"].tolist()
    assert len(numbered.group_cells("whole")["quad"]) == 20


@pytest.mark.filterwarnings("ignore:half_panels.inp. 13 pairs of points lie within")  # its *TIE joins them in a deck
@pytest.mark.sampled(3)
@pytest.mark.parametrize("script", sorted(MESHES.glob("make_*.py")), ids=lambda p: p.name)
def test_every_script_makes_its_files(script, tmp_path):
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


def test_failed_write_keeps_old_file(tmp_path):
    path = tmp_path / "mesh.inp"
    write_mesh(path, line([[0, 0, 0], [1, 0, 0]], 2))
    before = path.read_text()
    with pytest.raises(ValueError, match="cannot stand in an Abaqus deck"):
        write_mesh(path, line([[0, 0, 0], [1, 0, 0]], 2).with_groups(points={'"': [0]}))
    assert path.read_text() == before
    assert [p.name for p in tmp_path.iterdir()] == ["mesh.inp"]
