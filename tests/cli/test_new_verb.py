"""`femflex new`: a starting case that checks without problems, for a boom, meshes and decks."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from femflex.case import read_case
from femflex.mesh import Mesh, write_mesh

MESHES = Path(__file__).resolve().parents[2] / "meshes"


def test_new_case_is_valid_with_its_commented_tables_and_runs(femflex, tmp_path):
    assert femflex("new", "first_craft")[0] == 0
    path = tmp_path / "first_craft.toml"
    assert json.loads((tmp_path / "case.schema.json").read_text())["properties"]["bodies"]
    case = read_case(path)
    assert set(case.bodies) == {"hub", "boom"} and case.run.duration == 60.0
    code, _, err = femflex("run", path, "--no-pictures")
    assert code == 0 and not err
    head, _, commented = path.read_text().partition("[[loads]]")
    path.write_text(head + "[[loads]]" + commented.replace("\n# ", "\n"))
    assert list(read_case(path).expect.answers) == ["turned"]
    assert femflex("new", path)[0] == 2 and "\n# " not in path.read_text().partition("[[loads]]")[2]


@pytest.mark.parametrize(
    ("mesh", "members", "clamp"),
    [
        ("boom.msh", {"boom": "beam"}, "root"),
        ("panel.msh", {"panel": "plate"}, "root"),
        ("l_frame.inp", {"mast": "beam", "arm": "beam"}, "root"),
        ("slab.msh", {"panel": "solid"}, "root"),
    ],
)
def test_groups_of_a_mesh_become_members(femflex, tmp_path, mesh, members, clamp):
    assert femflex("new", "craft.toml", "--mesh", MESHES / mesh)[0] == 0
    case = read_case(tmp_path / "craft.toml")
    body = case.bodies["flexible"]
    assert {member.group: member.family for member in body.members} == members
    assert list(body.reduction.clamp) == [clamp]
    if mesh == "panel.msh":  # 6 m along x, 1.5 m along y: the torque bends it out of its plane
        torque = np.abs(case.loads[0].torque).max(axis=0)
        assert torque[1] > 0 and torque[0] == torque[2] == 0


@pytest.mark.parametrize("deck", ["mast.bdf", "half_panels.inp"])
def test_deck_has_units_and_supports(femflex, tmp_path, deck):
    code, out, _ = femflex("new", "craft.toml", "--deck", MESHES / deck)
    assert code == 0 and "mm-t-s" in out
    body = read_case(tmp_path / "craft.toml").bodies["flexible"]
    assert body.units == "mm-t-s" and list(body.reduction.clamp) == ["supports"]
    assert body.markers["root"].group != body.markers["tip"].group
    text = (tmp_path / "craft.toml").read_text()
    before, commented, after = text.partition("# [distributed_loads")
    assert bool(commented) == (deck == "mast.bdf")  # which has GRAV 7
    if commented:
        table, _, rest = after.partition("\n\n")
        (tmp_path / "craft.toml").write_text(before + (commented + table)[2:].replace("\n# ", "\n") + "\n\n" + rest)
        assert read_case(tmp_path / "craft.toml").effectors["distributed_loads"]["static"].load_set == "load 7"


def test_deck_without_supports_or_mass_gets_free_modes_and_a_density(femflex, tmp_path):
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,500.,0.,0.", "GRID,3,,1000.,0.,0.", "CBAR,1,3,1,2,0.,1.,0."]
    cards += ["CBAR,2,3,2,3,0.,1.,0.", "PBAR,3,1,100.,800.,900.,1500.", "MAT1,1,70000.,,.33"]
    (tmp_path / "bare.bdf").write_text("\n".join(["BEGIN BULK", *cards, "ENDDATA", ""]))
    assert femflex("new", "craft.toml", "--deck", "bare.bdf", "--units", "mm-t-s")[0] == 0
    body = read_case(tmp_path / "craft.toml").bodies["flexible"]
    assert body.reduction.method == "free_free" and body.overrides == {"mat_1": {"density": 2700.0}}
    code, _, err = femflex("check", "craft.toml")
    assert code == 0, err


def test_folded_and_skew_quadrilaterals_are_shells(femflex, tmp_path):
    """plate_bfs is for rectangles of one plane."""
    flat = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]], float)
    folded, skew = flat.copy(), flat.copy()
    folded[[2, 5]] = [[1, 0, 1], [1, 1, 1]]
    skew[:, 0] += 0.3 * skew[:, 1]
    for points, family in ((flat, "plate_bfs"), (folded, "shell"), (skew, "shell")):
        groups = {"skin": {"quad": np.arange(2)}, "root": {"line": np.arange(1)}}
        cells = {"quad": np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), "line": np.array([[0, 3]])}
        write_mesh(tmp_path / "skin.msh", Mesh(points, cells, cell_groups=groups))
        code, _, err = femflex("new", "skin.toml", "--mesh", "skin.msh", "--force")
        assert code == 0, err
        (member,) = read_case(tmp_path / "skin.toml").bodies["flexible"].members
        assert member.family == family


GRID = np.array([[x, y, 0.0] for y in range(3) for x in range(3)])
QUADS = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
RIB, RIM = np.array([[3, 4], [4, 5]]), np.array([[0, 1], [1, 2]])
OFF = np.array([[2.5, 1, 0], [3, 1, 0]])  # beyond the middle of the right side
ALL = {"quad": np.arange(4)}
LINES = {"line": np.arange(2)}


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("lines", "groups", "points", "members", "clamp"),
    [
        (None, {}, {}, [("all", "plate_bfs")], None),
        (RIB, {"panel": ALL | LINES}, {"root": [0, 3, 6]}, [("panel", "shell"), ("panel", "beam")], "root"),
        (RIM, {"panel": ALL | LINES}, {}, [("panel", "plate_bfs")], None),
        (RIB, {"panel": ALL, "stringer": LINES}, {"root": [0, 3, 6]}, [("panel", "plate_bfs")], "root"),
        (RIM, {"panel": ALL, "root": LINES}, {}, [("panel", "plate_bfs")], "root"),
        (np.array([[5, 9], [9, 10]]), {"panel": ALL, "arm": LINES}, {"root": [10]}, None, "root"),
        (
            np.array([[5, 9], [9, 10]]),
            {"panel": ALL},
            {"root": [10]},
            [("panel", "plate_bfs")],
            None,
        ),  # off the members
        (RIM, {"panel": {"quad": np.arange(3)}}, {"tip": [8]}, [("panel", "plate_bfs")], None),
    ],
)
def test_new_case_of_any_groups_passes_check(femflex, tmp_path, lines, groups, points, members, clamp):
    cells = {"quad": QUADS} | ({} if lines is None else {"line": lines})
    mesh_points = GRID if lines is None or lines.max() < 9 else np.concatenate([GRID, OFF])
    write_mesh(
        tmp_path / "part.vtu", Mesh(mesh_points, cells, groups, {key: np.array(rows) for key, rows in points.items()})
    )
    code, out, err = femflex("new", "part.toml", "--mesh", "part.vtu")
    assert code == 0, err
    body = read_case(tmp_path / "part.toml").bodies["flexible"]
    members = [("panel", "shell"), ("arm", "beam")] if members is None else members
    assert [(member.group, member.family) for member in body.members] == members
    assert list(getattr(body.reduction, "clamp", {})) == ([clamp] if clamp else [])
    assert clamp or "free-free" in out
    code, _, err = femflex("check", "part.toml")
    assert code == 0, err
    if "stringer" in groups:
        assert "'stringer'" in out
        text = (tmp_path / "part.toml").read_text().replace("# { group", "{ group").replace("plate_bfs", "shell")
        (tmp_path / "part.toml").write_text(text)
        assert femflex("check", "part.toml")[0] == 0
        assert len(read_case(tmp_path / "part.toml").bodies["flexible"].members) == 2


RIGID = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nRBE2,1,1,123456,2\nCONM2,5,2,,3.\n,1.,,1.,,,1.\n"
SHEET = (
    "*NODE\n1, 0., 0.\n2, 1., 0.\n3, 1., 1.\n4, 0., 1.\n*ELEMENT, TYPE=S4R, ELSET=SHEET\n1, 1, 2, 3, 4\n"
    "*SHELL GENERAL SECTION, ELSET=SHEET\n1.6E8, 5.E7, 1.6E8, 0., 0., 5.4E7, 0., 0.\n"
    "0., 53., 0., 0., 0., 17., 53., 0.\n0., 0., 0., 0., 18.\n"
)


@pytest.mark.parametrize(
    ("name", "text", "key", "value"),
    [
        ("rigid.bdf", f"BEGIN BULK\n{RIGID}ENDDATA\n", "method", "rigid"),
        ("sheet.inp", SHEET, "overrides", {"SHEET": {"nonstructural_mass": 5.4}}),
    ],
)
def test_new_case_of_a_rigid_or_massless_deck_passes_check(femflex, tmp_path, name, text, key, value):
    (tmp_path / name).write_text(text)
    code, _, err = femflex("new", "part.toml", "--deck", name, "--units", "m-kg-s")
    assert code == 0, err
    body = read_case(tmp_path / "part.toml").bodies["flexible"]
    assert getattr(body, key, getattr(body.reduction, key, None)) == value
    code, _, err = femflex("check", "part.toml")
    assert code == 0, err
