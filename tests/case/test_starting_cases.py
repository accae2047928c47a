"""Starting cases of meshes of any shape, and readings of tables that refuse what they cannot take."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from femflex.case import CaseError, parse_case, read_case
from femflex.case.body import FlexibleTable
from femflex.case.mesh_groups import with_places
from femflex.case.model_inputs import model_values
from femflex.case.motion import Motion, MotionOf
from femflex.case.motions import ThreeAngles
from femflex.case.run import PicturesTable
from femflex.case.starting_case import named_like, starting_case
from femflex.case.sweep import SweepTable
from femflex.mesh import Mesh, box, rectangle
from femflex.mesh.generators import line

# starting cases


def started(mesh: Mesh) -> tuple[dict[str, Any], list[str]]:
    """The tables of a starting case with this mesh, and the notes on it."""
    text, notes = starting_case("my_craft.toml", mesh, "a.msh")
    return tomllib.loads(text), notes


def torque(mesh: Mesh) -> list[list[float]]:
    return started(mesh)[0]["loads"][0]["torque"]


def turned(mesh: Mesh, order: list[int]) -> Mesh:
    return replace(mesh, points=mesh.points[:, order])


def test_the_torque_of_a_starting_case_bends_a_flat_mesh_across_its_length():
    """Flat is thinner than a tenth of the width; about z with the full torque otherwise."""
    assert torque(rectangle(4.0, 1.0, 2, 1)) == [[0, 0.4, 0], [0, 0.4, 0], [0, -0.4, 0], [0, -0.4, 0]]
    assert torque(rectangle(1.0, 4.0, 1, 2))[0] == [0.4, 0, 0]
    assert torque(turned(rectangle(4.0, 1.0, 2, 1), [2, 0, 1]))[3] == [0, 0, -0.4]
    assert torque(box(4.0, 1.0, 0.09, 2, 1, 1))[0] == [0, 0.4, 0]
    assert torque(box(4.0, 1.0, 0.11, 2, 1, 1)) == [[0, 0, 4], [0, 0, 4], [0, 0, -4], [0, 0, -4]]
    assert torque(box(0.09, 4.0, 1.0, 1, 2, 1))[0] == [0, 0, 0.4]
    straight = line([[0, 0, 0], [3.0, 0, 0]], 3).with_groups(points={"root": [0]})
    assert torque(straight)[0] == [0, 0, 4]  # it has no plane
    thin = replace(straight, points=straight.points + np.array([[0, 0, 0], [0, 2e-6, 0], [0, 0, 0], [0, 0, 0]]))
    assert torque(thin)[0] == [0, 0, 4]  # 2e-6 m across 3 m is rounding


@pytest.mark.parametrize(("length", "unit"), [(201.0, "mm"), (199.0, None)])
def test_a_mesh_of_hundreds_is_read_in_millimetres(length: float, unit: str | None):
    mesh = line([[0, 0, 0], [0, length, 0]], 3)
    groups: dict[str, Any] = {"cells": {"mast": {"line": [0, 1, 2]}}, "points": {"Base": [0], "the end": [3]}}
    found, notes = started(Mesh(mesh.points, mesh.cells).with_groups(**groups))
    body = found["bodies"]["flexible"]
    assert body.get("mesh_unit") == unit and body["mesh"] == "a.msh"
    assert (f"mesh_unit: the mesh spans {length:g}, read as millimetres" in notes) is (unit is not None)
    assert body["reduction"] == {"method": "cantilever", "clamp": "Base", "modes": 6}
    assert body["markers"] == {"tip": {"group": "the end"}} and found["joints"][0]["child_marker"] == "Base"
    assert found["sections"]["own"] == {"kind": "tube", "outer_radius": "30 mm", "thickness": "1 mm"}


def test_groups_that_share_cells_are_one_member_and_those_beside_are_noted():
    """Of three groups of lines the largest that share no cell carry; points have no part in it."""
    mesh = line([[0, 0, 0], [3.0, 0, 0]], 6)
    cells = mesh.cells["line"]
    own = Mesh(mesh.points, mesh.cells).with_groups(
        cells={"part": {"line": [1, 2]}, "all": {"line": [0, 1, 2, 3]}, "rest": {"line": [4, 5]}},
        points={"left": [0]},
    )
    found, notes = started(own)
    members = found["bodies"]["flexible"]["members"]
    assert [(one["group"], one["family"], one["section"], one["material"]) for one in members] == [
        ("all", "beam", "own", "metal"),
        ("rest", "beam", "own", "metal"),
    ]
    assert notes == ["members: families, section and material of 'all', 'rest' are guesses"] and len(cells) == 6
    assert "markers" not in found["bodies"]["flexible"]


def test_surfaces_beside_a_solid_are_named_and_a_mesh_without_a_root_is_noted():
    solid = box(4.0, 1.0, 0.5, 2, 1, 1)
    n = len(solid.points)
    points = np.vstack([solid.points, [[5, 0, 0], [6, 0, 0], [6, 1, 0], [5, 1, 0.0]]])
    kind = next(cell for cell in solid.cells if cell.startswith("hexa"))
    mesh = Mesh(points, {kind: solid.cells[kind], "quad": np.arange(n, n + 4)[None]}).with_groups(
        cells={"block": {kind: np.arange(len(solid.cells[kind]))}, "flag": {"quad": [0]}}, points={"dot": [2]}
    )
    found, notes = started(mesh)
    assert found["bodies"]["flexible"]["members"] == [{"group": "block", "family": "solid", "material": "metal"}]
    assert notes[1:] == [
        "members: 'flag' are not used; give members to those that carry load",
        "clamp: no group of the mesh looks like a root; name the group that is attached to the hub",
    ]
    assert "own" not in found.get("sections", {})
    assert found["bodies"]["flexible"]["reduction"]["clamp"] == "dot"
    with pytest.raises(ValueError, match=r"a\.msh has no group of lines, surfaces or volumes"):
        started(Mesh(points, {}).with_groups(points={"dot": [2]}))


@pytest.mark.parametrize(
    ("moved", "family"),
    [((0, 0, 0), "plate_bfs"), ((0, 0.2, 0), "shell"), ((0, 0, 0.2), "shell"), ((1e-5,) * 3, "plate_bfs")],
)
def test_quadrilaterals_that_are_no_rectangles_of_one_plane_are_shells(moved: tuple[float, ...], family: str):
    mesh = rectangle(4.0, 1.0, 2, 1, "quad")
    points = mesh.points.copy()
    points[-1] += moved
    own = Mesh(points, {"quad": mesh.cells["quad"]}).with_groups(cells={"sheet": {"quad": [0, 1]}})
    assert started(own)[0]["bodies"]["flexible"]["members"][0]["family"] == family
    folded = points.copy()
    folded[:2, [0, 2]] = [[2.0, 2.0], [2.0, 2.0]]  # the first of two squares stands upright
    own = Mesh(folded, {"quad": mesh.cells["quad"]}).with_groups(cells={"sheet": {"quad": [0, 1]}})
    assert started(own)[0]["bodies"]["flexible"]["members"][0]["family"] == "shell"


def test_names_are_matched_in_the_order_of_the_words():
    assert named_like(["Left side", "ROOT_2", "base"], ("root", "base", "left")) == "ROOT_2"
    assert named_like(["a", "bottom_left", "Left", "left"], ("root", "left")) == "Left"
    assert named_like(["a"], ("root",)) is None


# readings


OVERRIDES = {
    "E": ("2 GPa", 2e9), "E1": ("3 kPa", 3e3), "E2": (4.0, 4.0), "E3": ("5 MPa", 5e6), "G": ("6 kPa", 6e3),
    "G12": ("7 kPa", 7e3), "G13": ("8 kPa", 8e3), "G23": ("9 kPa", 9e3), "density": ("2 g/cm^3", 2e3),
    "A": ("3 cm^2", 3e-4), "I1": ("4 cm^4", 4e-8), "I2": ("5 cm^4", 5e-8), "J": ("6 cm^4", 6e-8),
    "thickness": ("7 mm", 7e-3), "thickness_3": ("8 mm", 8e-3), "nonstructural_mass": ("9 g/m", 9e-3),
    "K1": ("1 kN/m", 1e3), "K2": ("2 kN/m", 2e3), "K3": ("3 kN/m", 3e3), "K4": ("4 kN m", 4e3),
    "K5": ("5 kN m", 5e3), "K6": ("6 kN m", 6e3), "nu": (0.3, 0.3),
}  # fmt: skip


def deck(overrides: Any) -> Any:
    reduction = {"method": "cantilever", "clamp": "r", "modes": 3}
    return FlexibleTable.model_validate(
        {"kind": "flexible", "deck": "a.bdf", "reduction": reduction, "overrides": overrides}
    ).overrides


def test_values_of_a_deck_are_read_in_the_unit_of_their_key():
    found = deck({"pid_1": {key: text for key, (text, _) in OVERRIDES.items()}, "mid_2": {"E": 5}})
    assert found["pid_1"] == pytest.approx({key: value for key, (_, value) in OVERRIDES.items()})
    assert found["mid_2"] == {"E": 5.0}
    assert deck({"p": {"nonstructural_mass": "2 kg/m^2"}})["p"]["nonstructural_mass"] == 2.0


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        (3, "found 3 (a number); expected tables such as { pid_3 = { thickness = '2 mm' } }"),
        ({"pid_1": 0.2}, "found 0.2 (a number) for 'pid_1'; expected a table of values"),
        ({"pid_1": {"E": "2 mm"}}, "pid_1.E: found '2 mm', which is a length; expected a pressure or elastic modulus"),
        (
            {"p": {"nonstructural_mass": "2 m"}},
            "p.nonstructural_mass: found '2 m', which is a length; expected a mass per",
        ),
        ({"p": {"nu": "2 m"}}, "p.nu: found '2 m', which is a length; expected a plain number"),
    ],
)
def test_values_of_a_deck_that_cannot_be_read_are_refused(overrides: Any, told: str):
    with pytest.raises(ValidationError) as caught:
        deck(overrides)
    assert told in str(caught.value)


def test_a_scale_of_pictures_is_a_factor_or_automatic():
    def scale(value: Any) -> Any:
        return PicturesTable.model_validate({"scale": value}).scale

    assert scale("auto") == "auto" and scale(2.5) == 2.5
    for value, told in (("large", "found 'large'; expected a factor such as 10, or 'auto'"), (0, "it must be above 0")):
        with pytest.raises(ValidationError, match=told):
            scale(value)


def test_a_list_of_motions_has_one_for_every_coordinate():
    read = ThreeAngles.model_validate
    free, fixed, locked = read({"angles": ["free", "30 deg", "locked"]}).angles
    assert free is None and locked == Motion(locked=True)
    assert fixed is not None and fixed.profile is not None
    assert fixed.profile(Path())(0.0)[0] == pytest.approx(np.pi / 6)
    assert read({"angles": "locked"}).angles == (Motion(locked=True),) * 3
    for given, told in (
        ({"a": 1}, "expected a list with a motion for every coordinate"),
        (["free"], "found 1 motion; expected 3, 'free' among them"),
        (["free", "free", "fre"], r"entry 3: found 'fre' \(text\); a motion is 'locked', 'free', a number"),
        (["free", "2 m", "free"], "entry 2: found '2 m', which is a length; expected an angle"),
    ):
        with pytest.raises(ValidationError, match=told):
            read({"angles": given})


def test_a_polynomial_may_have_one_coefficient_or_many():
    for given, at_2 in (([7], 7.0), ([1, "2 mm/s"], 1.004), ([0, 0, "3 m/s^2", 4, 5, 6], 12 + 32 + 80 + 192)):
        motion = MotionOf("m").read({"kind": "polynomial", "coefficients": given})
        assert motion is not None and motion.profile is not None
        assert motion.profile(Path())(2.0)[0] == pytest.approx(at_2)


@pytest.mark.parametrize("key", ["a", "b", "c"])
def test_every_value_of_a_sweep_must_vary_as_its_design_says(key: str):
    """Lists for a grid, limits or a scatter for a random one; any of three may be the wrong one."""
    for design, right, wrong in (
        ("grid", {"values": [1]}, {"normal": [1, 2]}),
        ("random", {"normal": [1, 2]}, {"values": [1]}),
    ):
        need = "values" if design == "grid" else "between or normal"
        table = {"case": "a", "histories": ["q"], "design": design, "members": None if design == "grid" else 3}
        vary = dict.fromkeys("abc", right)
        SweepTable.model_validate(table | {"vary": vary})
        with pytest.raises(ValidationError, match=f"found design = '{design}', which needs {need} for '{key}'"):
            SweepTable.model_validate(table | {"vary": vary | {key: wrong}})


MESHED = {
    "kind": "flexible",
    "mesh": "a.msh",
    "members": [{"group": "line", "family": "beam"}],
    "reduction": {"method": "cantilever", "clamp": "root", "modes": 3},
}


def test_regions_of_a_body_are_groups_of_its_mesh():
    mesh = line([[0, 0, 0], [4.0, 0, 0]], 8)
    mesh = mesh.with_groups(points={"root": [0], "mid": [3, 4, 5]})
    regions = {
        "near": {"nearest": [1.2, 5.0, 0]},
        "some": {"points": [2, 9]},
        "inside": {"box": [[1.9, -1, -1], [9, 1, 1]]},
        "within": {"box": [[1.9, -1, -1], [9, 1, 1]], "within": "mid"},
    }
    joined = {"kind": "rigid", "group": "mid", "position": [2.0, 0.3, 0.4]}
    table = FlexibleTable.model_validate(MESHED | {"regions": regions, "connections": [joined]})
    found = with_places(mesh, table)
    at = {name: sorted(found.points[found.group_points(name)][:, 0].tolist()) for name in regions}
    assert at == {"near": [1.0], "some": [0.5, 4.0], "inside": [2, 2.5, 3, 3.5, 4], "within": [2.0, 2.5]}
    (own,) = found.group_points(table.connections[0].reference_group)  # type: ignore[union-attr]
    assert found.points[own].tolist() == [2.0, 0.3, 0.4] and len(found.points) == len(mesh.points) + 1


def test_what_a_result_file_cannot_keep_is_refused():
    text = "[run]\nduration = 4\n[bodies.hub]\nkind = 'rigid'\nmass = 2\ninertia = [3, 4, 5]\n"
    case = parse_case(text)
    hub = case.bodies["hub"].model_copy(update={"mass": 1j})
    with pytest.raises(TypeError, match="a case holds a complex, which a result file cannot keep"):
        model_values(case.model_copy(update={"bodies": {"hub": hub}}))


# files


def test_a_file_that_is_no_case_is_refused_with_what_it_is(tmp_path: Path):
    (tmp_path / "b.toml").write_text("a = " + "1" * 5000)
    (tmp_path / "c.toml").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "e.toml").write_text("a = " + "[" * 3000 + "]" * 3000)
    for name, told in (
        ("", "found a folder; name a case file (TOML) in it"),
        ("b.toml", "this file holds a whole number of thousands of digits"),
        ("c.toml", "this file is not text; a case is a TOML file in UTF-8"),
        ("e.toml", "this file nests tables or lists too deeply; "),
        ("x.nas", "there is no such file; give the name of one that is there"),
        ("d.toml", "there is no such case file; "),
    ):
        with pytest.raises(CaseError) as caught:
            read_case(tmp_path / name)
        (problem,) = caught.value.problems
        assert problem.text.startswith(told), name
