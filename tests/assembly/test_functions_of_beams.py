"""Functions of a case's beams: those of their tables, and static shapes of spin, joints and loads, with their notes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from femflex.assembly.functions import functions_of
from femflex.case import parse_case
from femflex.reduction.beams.uniform_beam import BeamFunctions

CASE = """
[run]
duration = 4
{more}
[bodies.boom]
kind = "analytic"
length = 2
EA = 1e6
EIy = 10
EIz = 20
GJ = 10
mass_per_length = 1
{strain}
functions = {{ {functions} }}
markers.head = {{ group = "tip" }}
[[joints]]
kind = "revolute"
child = "boom"
axis = "z"
"""
SPIN = "[attitude]\nframe = 'spinning'\nspin = [0, 0, 0.3]\n"
CONDENSED = "strain = 'condensed'"
TURNED = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])  # beam axes x, y, z along y, z, x of the body


def made(functions: str, strain: str = "", more: str = "", modes: int | None = None, frame: Any = None):
    case = parse_case(CASE.format(functions=functions, strain=strain, more=more))
    return functions_of(case, "boom", case.bodies["boom"], modes, np.eye(3) if frame is None else frame)  # type: ignore[arg-type]


def test_functions_without_causes_are_those_of_the_table_or_of_a_given_number():
    assert made("y = 2, axial = 3") == (BeamFunctions(2, 0, 3, 0), "")
    assert made("z = 2, torsion = 3", CONDENSED) == (BeamFunctions(0, 2, 0, 3), "")
    assert made("y = 2, z = 1, axial = 3", modes=5) == (BeamFunctions(5, 5, 5, 0), "")
    ends = "y = 4, z = 3, family = 'polynomial', ends = 'clamped-clamped'"
    assert made(ends) == (BeamFunctions(4, 3, family="polynomial", ends="clamped-clamped"), "")
    assert made("y = 4, z = 3, static = true") == (BeamFunctions(4, 3, static=True), "")


OUT = "(spin = false in its functions would leave them out)"


def test_a_steady_spin_adds_static_shapes_to_bending_functions_of_clamped_free_beams_alone():
    """Two for each direction of bending, one of stretch and one of torsion, in fields that have functions."""
    assert made("y = 3, axial = 1, torsion = 2", CONDENSED, SPIN) == (
        BeamFunctions(5, 0, 2, 3, static=True),
        f"4 static shapes of its loads (spin) in addition to its functions {OUT}",
    )
    assert made("z = 3", CONDENSED, "", None) == (BeamFunctions(0, 3), "")
    assert made("z = 3, spin = true", CONDENSED)[0] == BeamFunctions(0, 5, static=True)
    assert made("z = 3, y = 1, spin = true", "strain = 'nonlinear'")[0] == BeamFunctions(3, 5, static=True)
    for functions, strain in (
        ("y = 3, axial = 1", ""),
        ("y = 3, axial = 1", "strain = 'linear'"),
        ("y = 3, axial = 1, spin = false", CONDENSED),
        ("axial = 1, torsion = 1", CONDENSED),
        ("y = 3, ends = 'clamped-clamped'", CONDENSED),
    ):
        found, note = made(functions, strain, SPIN)
        assert note == "" and not found.static and found.axial == ("axial" in functions), functions
    assert made("y = 3, static = true", CONDENSED, SPIN) == (BeamFunctions(3, static=True), "")
    assert made("y = 3, static = false", CONDENSED, SPIN) == (BeamFunctions(3), "")


@pytest.mark.parametrize(
    ("functions", "few"), [("y = 3, z = 5", 3), ("z = 2, axial = 1", 2), ("y = 3, torsion = 1", 3), ("y = 4, z = 4", 0)]
)
def test_few_polynomials_per_direction_are_noted_under_spin(functions: str, few: int):
    said = (
        f"no static shapes of its loads (spin) are added to its {few} polynomials per direction. Give 4 or more: the "
        "first two frequencies of a fast blade are then within 0.5 %, and with 5 within 0.25 %"
    )
    text = f"{functions}, family = 'polynomial'"
    found, note = made(text, CONDENSED, SPIN)
    assert note == (said if few else "") and not found.static and found.family == "polynomial"
    assert made(text, CONDENSED)[1] == made(text, "", SPIN)[1] == ""


def test_joints_and_loads_add_the_shapes_of_their_ends():
    rest = "in addition to its functions"
    assert made("y = 2, z = 1, joints = ['root']") == (
        BeamFunctions(4, 3, static=True),
        f"4 static shapes of its joints (root) {rest} (joints = [] in its functions would leave them out)",
    )
    assert made("y = 2, torsion = 1, joints = ['tip']") == (
        BeamFunctions(4, 0, 0, 2, tip=True),
        f"3 static shapes of its joints (tip) {rest} (joints = [] in its functions would leave them out)",
    )
    assert made("y = 2, axial = 1, joints = ['root', 'tip']", CONDENSED, SPIN) == (
        BeamFunctions(6, 0, 3, static=True, tip=True),
        f"6 static shapes of its loads (spin) and of its joints (root, tip) {rest} (joints = [] in its functions would "
        "leave them out)",
    )
    assert made("axial = 2, loads = true") == (
        BeamFunctions(0, 0, 3, tip=True),
        f"1 static shape of its loads (tip) {rest} (loads = false in its functions would leave them out)",
    )
    assert made("y = 1, joints = ['tip'], loads = true")[1].count("tip") == 1
    assert made("y = 3, static = true, joints = ['root']") == (BeamFunctions(3, static=True), "")


LOAD = "[[loads]]\nname = 'push'\nbody = 'boom'\nmarker = '{}'\n{} = {}\n"


@pytest.mark.parametrize(
    ("functions", "load", "tip"),
    [
        # a cantilever on n of its modes answers a force at its tip to 97.1, 99.5 %, a moment to 61, 79, 87 %, ...
        ("y = 1", ("tip", "force", [0, 2, 0]), True),
        ("y = 2", ("tip", "force", [0, 2, 0]), False),
        ("y = 2", ("tip", "torque", [0, 0, 2]), True),
        ("y = 2", ("tip", "torque", [0, 2, 0]), False),  # bends in z, where nothing bends
        ("z = 2", ("tip", "torque", [0, 2, 0]), True),
        ("z = 2", ("head", "torque", [0, 2, 0]), True),
        ("z = 2", ("root", "torque", [0, 2, 0]), False),
        ("y = 2, torsion = 2", ("tip", "torque", [1, 0, 0]), True),  # 8 / pi^2 (1 + 1 / 9)
        ("y = 2, torsion = 19", ("tip", "torque", [1, 0, 0]), True),
        ("y = 2, torsion = 22", ("tip", "torque", [1, 0, 0]), False),  # 99.1 %
        ("y = 2, axial = 2", ("tip", "force", [1, 0, 0]), True),
        ("y = 1, axial = 22", ("tip", "force", [1, 0, 0]), False),
        ("y = 1, axial = 2, loads = false", ("tip", "force", [1, 0, 0]), False),
    ],
)
@pytest.mark.parametrize("frame", [np.eye(3), TURNED])
def test_a_load_at_the_tip_adds_shapes_where_functions_answer_it_by_less_than_99_per_cent(functions, load, tip, frame):
    marker, key, along = load
    given = (np.array(along, float) @ frame).tolist()
    found, note = made(functions, "", LOAD.format(marker, key, given), frame=frame)
    assert found.tip is tip and bool(note) is tip
    if tip:
        assert " of its loads (tip) in addition to its functions (loads = false in" in note
