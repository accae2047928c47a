"""`femflex new`: a starting case that checks without problems, for a boom and for meshes, and never overwrites."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from femflex.case import read_case
from femflex.mesh import Mesh, line, write_mesh

MESHES = Path(__file__).resolve().parents[2] / "meshes"


def test_a_new_case_is_valid_and_commented(femflex, tmp_path):
    code, out, _ = femflex("new", "first_craft")
    text = (tmp_path / "first_craft.toml").read_text()
    assert code == 0 and "femflex check first_craft.toml" in out
    assert text.startswith("#:schema case.schema.json\n") and text.count("#") > 20 and 'title = "First craft"' in text
    assert json.loads((tmp_path / "case.schema.json").read_text())["properties"]["bodies"]
    case = read_case(tmp_path / "first_craft.toml")
    assert set(case.bodies) == {"hub", "boom"} and case.run.duration == 60.0


def test_its_commented_tables_are_valid_too(femflex, tmp_path):
    femflex("new", "craft.toml")
    path = tmp_path / "craft.toml"
    text = path.read_text().split("[[loads]]")
    path.write_text(text[0] + "[[loads]]" + text[1].replace("\n# ", "\n"))
    assert list(read_case(path).expect.answers) == ["turned"]


def test_a_new_case_runs(femflex):
    femflex("new", "craft.toml")
    code, out, err = femflex("run", "craft.toml", "--no-pictures")
    assert code == 0 and "done" in out and not err


@pytest.mark.parametrize(
    ("mesh", "members", "clamp"),
    [
        ("boom.msh", {"boom": "beam"}, "root"),
        ("panel.msh", {"panel": "plate"}, "root"),
        ("l_frame.inp", {"mast": "beam", "arm": "beam"}, "root"),
        ("slab.msh", {"panel": "solid"}, "root"),
    ],
)
def test_a_mesh_brings_its_groups(femflex, tmp_path, mesh, members, clamp):
    code, out, _ = femflex("new", "craft.toml", "--mesh", MESHES / mesh)
    assert code == 0 and "are guesses" in out
    body = read_case(tmp_path / "craft.toml").bodies["flexible"]
    assert {member.group: member.family for member in body.members} == members
    assert list(body.reduction.clamp) == [clamp]


def test_the_torque_bends_a_flat_mesh_out_of_its_plane(femflex, tmp_path):
    femflex("new", "panel.toml", "--mesh", str(MESHES / "panel.msh"))  # 6 m along x, 1.5 m along y
    (load,) = read_case(tmp_path / "panel.toml").loads
    torque = np.abs(load.torque).max(axis=0)
    assert torque[1] > 0 and torque[0] == torque[2] == 0


def test_a_large_mesh_is_read_in_millimetres_and_a_missing_root_is_said(femflex, tmp_path):
    plain = line([[0.0, 0.0, 0.0], [500.0, 0.0, 0.0]], 2)
    write_mesh(tmp_path / "long.msh", Mesh(plain.points, plain.cells, {"rod": plain.cell_groups["line"]}, {}))
    _, out, _ = femflex("new", "craft.toml", "--mesh", "long.msh")
    assert "mesh_unit: the mesh spans 500" in out and "clamp: no group of the mesh looks like a root" in out
    assert 'mesh_unit = "mm"' in (tmp_path / "craft.toml").read_text()


def test_nothing_is_overwritten_and_mistakes_are_sentences(femflex, tmp_path):
    (tmp_path / "craft.toml").write_text("mine")
    code, _, err = femflex("new", "craft.toml")
    assert code == 2 and "exists" in err and (tmp_path / "craft.toml").read_text() == "mine"
    code, _, err = femflex("new", "craft.json")
    assert code == 2 and "a case ends in .toml" in err
    plain = line([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 2)
    write_mesh(tmp_path / "bare.msh", Mesh(plain.points, plain.cells, {}, {}))
    code, _, err = femflex("new", "other.toml", "--mesh", "bare.msh")
    assert code == 2 and "name its parts in the mesher" in err and not (tmp_path / "other.toml").exists()


@pytest.mark.parametrize(
    ("deck", "units", "first", "clamp"),
    [("mast.bdf", "mm-t-s", 2.036, "supports"), ("half_panels.inp", "mm-t-s", 17.72, "supports")],
)
def test_a_deck_brings_units_supports_and_modes(femflex, tmp_path, deck, units, first, clamp):
    code, out, _ = femflex("new", "craft.toml", "--deck", MESHES / deck)
    assert code == 0 and f"{units} is a guess" in out and f"modes       {first:.4g}" in out
    body = read_case(tmp_path / "craft.toml").bodies["flexible"]
    assert body.units == units and list(body.reduction.clamp) == [clamp]
    assert body.markers["root"].group != body.markers["tip"].group


def test_a_deck_without_supports_or_mass_gets_free_modes_and_a_density_to_look_at(femflex, tmp_path):
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,500.,0.,0.", "GRID,3,,1000.,0.,0.", "CBAR,1,3,1,2,0.,1.,0."]
    cards += ["CBAR,2,3,2,3,0.,1.,0.", "PBAR,3,1,100.,800.,900.,1500.", "MAT1,1,70000.,,.33"]
    (tmp_path / "bare.bdf").write_text("\n".join(["BEGIN BULK", *cards, "ENDDATA", ""]))
    code, out, _ = femflex("new", "craft.toml", "--deck", "bare.bdf", "--units", "mm-t-s")
    assert code == 0 and "no supports restrain" in out and "overrides: the deck has no mass" in out
    body = read_case(tmp_path / "craft.toml").bodies["flexible"]
    assert body.reduction.method == "free_free" and body.overrides == {"mat_1": {"density": 2700.0}}
    code, _, err = femflex("check", "craft.toml")
    assert code == 0, err


def test_new_takes_one_source_and_known_units(femflex, tmp_path):
    code, _, err = femflex("new", "craft.toml", "--deck", MESHES / "mast.bdf", "--mesh", MESHES / "boom.msh")
    assert code == 2 and "give one of them" in err
    code, _, err = femflex("new", "craft.toml", "--units", "mm-t-s")
    assert code == 2 and "--units without --deck" in err
    code, _, err = femflex("new", "craft.toml", "--deck", MESHES / "mast.bdf", "--units", "mm")
    assert code == 2 and "length-mass-time" in err and not (tmp_path / "craft.toml").exists()


def test_folded_quadrilaterals_are_shells_and_flat_rectangles_plates(femflex, tmp_path):
    """plate_bfs is for rectangles of one plane."""
    flat = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]], float)
    folded, askew = flat.copy(), flat.copy()
    folded[[2, 5]] = [[1, 0, 1], [1, 1, 1]]
    askew[:, 0] += 0.3 * askew[:, 1]
    for points, family in ((flat, "plate_bfs"), (folded, "shell"), (askew, "shell")):
        groups = {"skin": {"quad": np.arange(2)}, "root": {"line": np.arange(1)}}
        cells = {"quad": np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), "line": np.array([[0, 3]])}
        write_mesh(tmp_path / "skin.msh", Mesh(points, cells, cell_groups=groups))
        code, out, err = femflex("new", "skin.toml", "--mesh", "skin.msh", "--force")
        assert code == 0 and "not used" not in out, err
        (member,) = read_case(tmp_path / "skin.toml").bodies["flexible"].members
        assert member.family == family


def test_groups_that_are_not_used_are_named(femflex, tmp_path):
    """A boom of lines beyond a panel of triangles: the panel alone becomes a member."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 0, 0], [-2, 0, 0]], float)
    cells = {"triangle": np.array([[0, 1, 2], [0, 2, 3]]), "line": np.array([[5, 4], [4, 0], [0, 3]])}
    groups = {"panel": {"triangle": np.arange(2)}, "boom": {"line": np.arange(2)}, "edge": {"line": np.array([2])}}
    write_mesh(tmp_path / "mixed.msh", Mesh(points, cells, cell_groups=groups))
    out = femflex("new", "mixed.toml", "--mesh", "mixed.msh")[1]
    assert "members: 'boom' are not used; give members to those that carry load" in " ".join(out.split())


def test_a_group_of_a_deck_that_looks_like_a_clamp_is_proposed(femflex, tmp_path):
    (tmp_path / "bar.inp").write_text(
        "*NODE\n1,0,0,0\n2,1,0,0\n*ELEMENT,TYPE=B33,ELSET=BAR\n1,1,2\n*NSET,NSET=ROOT\n1\n"
        "*BEAM SECTION,ELSET=BAR,MATERIAL=M,SECTION=CIRC\n0.01\n0,0,1\n*MATERIAL,NAME=M\n*ELASTIC\n7e10,0.3\n"
        "*DENSITY\n2700\n"
    )
    code, out, err = femflex("new", "bar.toml", "--deck", "bar.inp", "--units", "SI")
    assert code == 0, err
    assert "to clamp group 'ROOT': reduction = { method" in " ".join(out.split())
