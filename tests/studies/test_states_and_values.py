"""States of a run, bodies that are built once for many values, and diagrams and loci over values that do not fit."""

from __future__ import annotations

import numpy as np
import pytest
from support.small_cases import clamped_rod, sprung_wheels

from femflex.case import CaseError, with_values
from femflex.case.read import parse_case
from femflex.dynamics.equilibria.equilibrium import EquilibriumError
from femflex.pipeline import prepare, run
from femflex.studies.campbell import axis_of, case_campbell, case_spins, diagram_of, value_diagram
from femflex.studies.linear.instant import state_of_run
from femflex.studies.linear.root_locus import root_locus
from femflex.studies.varied import VariedCase

WHEELS = sprung_wheels(20, 'output_step = "0.25 s"')
ROD = clamped_rod("{ y = 1 }")


@pytest.fixture(scope="module")
def wheels():
    return parse_case(WHEELS)


@pytest.fixture(scope="module")
def with_rod():
    return parse_case(WHEELS.replace('output_step = "0.25 s"', "samples = 101") + ROD)


def test_the_state_of_a_run_is_its_row_nearest_to_a_time(wheels, tmp_path):
    run(wheels, tmp_path / "r.h5")
    system = prepare(wheels).system
    w = 2.0  # sqrt(8 / 2)
    for at, row in ((0.0, 0.0), (0.3, 0.25), (0.4, 0.5), (1.0, 1.0)):
        t, x = state_of_run(tmp_path / "r.h5", system, at)
        assert t == pytest.approx(row) and x.shape == (4,)
        assert x == pytest.approx([np.sin(w * row) / 4, 0, np.cos(w * row) / 2, 0], abs=1e-6)
    for at in (-0.1, 1.5):
        with pytest.raises(ValueError) as caught:
            state_of_run(tmp_path / "r.h5", system, at)
        assert str(caught.value) == f"there is no state at {at:g} s in {tmp_path / 'r.h5'}; it goes from 0 s to 1 s"
    other = prepare(parse_case(STONE)).system
    with pytest.raises(ValueError) as caught:
        state_of_run(tmp_path / "r.h5", other, 0.5)
    assert str(caught.value) == (
        f"{tmp_path / 'r.h5'} is of another craft: its state has 4 numbers and that of the case 2; take the run of "
        "this case"
    )


def test_branches_of_a_root_locus_go_to_the_nearest_poles(wheels):
    """The poles of the damped wheel pass those of the other in size, and both keep their columns."""
    stiffnesses = [4.0, 9.0, 16.0, 36.0]
    case = with_values(wheels, {"joints.0.damping": 4.0})
    found = root_locus(case, "joints.0.stiffness", stiffnesses)
    assert found.poles.shape == (4, 4)
    wanted = []
    for k in stiffnesses:
        s = -1.0 + 1j * np.sqrt(k / 2 - 1.0)
        wanted.append([s, np.conj(s), 1j * np.sqrt(20 / 3), -1j * np.sqrt(20 / 3)])
    columns = [int(np.argmin(np.abs(found.poles[0] - s))) for s in wanted[0]]
    assert len(set(columns)) == 4 and found.poles[:, columns] == pytest.approx(np.array(wanted), abs=1e-6)
    with pytest.raises(ValueError) as caught:
        root_locus(parse_case(WHEELS.replace("stiffness = 20\n", "")), "joints.1.kind", ["revolute", "universal"])
    assert str(caught.value) == (
        "the model has 6 states at joints.1.kind = universal and 4 before; a root locus needs a value that changes "
        "none of them"
    )


STONE = """
title = "a stone on a spring"
[run]
duration = "1 s"
[environment]
gravity = [0, 0, -9]
[bodies.stone]
kind = "rigid"
mass = 2
inertia = [1, 1, 1]
[[joints]]
kind = "prismatic"
child = "stone"
axis = [0, 0, 1]
name = "shaft"
stiffness = 8
"""


def test_a_value_without_equilibrium_is_named_with_its_unit():
    case = parse_case(STONE)
    for unit, text in (("N/m", r"at joints\.0\.stiffness = 0 N/m \S"), ("", r"at joints\.0\.stiffness = 0 \S")):
        with pytest.raises(EquilibriumError, match=text):
            value_diagram(case, "joints.0.stiffness", [0.0, 8.0], unit)
    found = value_diagram(case, "joints.0.stiffness", [2.0, 18.0], "N/m")
    assert found.unit == "N/m" and found.speeds.tolist() == [2.0, 18.0] and found.title == "a stone on a spring"
    assert found.branches[0].frequencies == pytest.approx(np.array([1.0, 3.0]) / (2 * np.pi)) and found.orders == ()


def test_progress_over_a_value_is_that_of_the_values_and_modes_are_the_lowest(wheels):
    seen: list[float] = []
    found = value_diagram(wheels, "joints.1.stiffness", [27.0, 48.0], modes=1, progress=seen.append)
    assert seen == [27.0, 48.0] and [one.name for one in found.branches] == ["joint 1"]
    assert found.branches[0].frequencies == pytest.approx(2.0 / (2 * np.pi))


def test_bodies_are_built_once_where_only_joints_or_rigid_bodies_change(with_rod):
    fixed = VariedCase.of(with_rod, ["joints.0.stiffness", "run.duration"])
    assert fixed.bodies is not None and set(fixed.bodies) == {"a", "b", "rod"} and fixed.rigid == ()
    assert fixed.bodies_of(with_rod) == fixed.bodies
    rigid = VariedCase.of(with_rod, ["bodies.b.mass", "joints.0.stiffness", "bodies.a.mass", "bodies.b.inertia"])
    assert rigid.bodies is not None and rigid.rigid == ("b", "a") and rigid.case is with_rod
    changed = rigid.bodies_of(with_values(with_rod, {"bodies.b.mass": 7.0, "bodies.a.mass": 4.0}))
    assert changed["rod"] is rigid.bodies["rod"] and rigid.bodies["b"].moments.mass == 3.0
    assert (changed["a"].moments.mass, changed["b"].moments.mass) == (4.0, 7.0)
    for path in ("bodies.rod.EIy", "materials.steel.E", "sections.tube", "bodies.a", "bodies.none.mass"):
        flexible = VariedCase.of(with_rod, ["bodies.b.mass", path])
        assert flexible.bodies is None and flexible.bodies_of(with_rod) is None and flexible.rigid == ()
    system = VariedCase.of(with_rod, ["bodies.rod.EIz"]).system({"bodies.rod.EIz": 750.0})
    assert system.bodies["rod"].omega[0] / fixed.bodies["rod"].omega[0] == pytest.approx(0.5)
    assert rigid.system({"bodies.b.mass": 7.0}).bodies["b"].moments.mass == 7.0


SPINNING = (
    STONE.replace("[environment]\ngravity = [0, 0, -9]\n", "")
    + """
[attitude]
frame = "inertial"
[campbell]
speeds = ["0 rad/s", "1 rad/s", "3 rad/s"]
axis = [3, 0, 4]
orders = [1, 2]
modes = 2
"""
)


def test_the_diagram_of_a_case_is_that_of_its_table_about_its_unit_axis(tmp_path):
    """A stone on a shaft at an angle to the spin, cos = 0.8: omega^2 = k / m - (0.6 Omega)^2."""
    case = parse_case(SPINNING)
    assert axis_of(case) == pytest.approx([0.6, 0.0, 0.8])
    (tmp_path / "c.toml").write_text(SPINNING)
    seen: list[float] = []
    for given in (case, tmp_path / "c.toml", str(tmp_path / "c.toml")):
        found = case_campbell(given, progress=seen.append)
        assert found.title == "a stone on a spring" and found.orders == (1, 2) and found.complete
        assert found.speeds[found.asked] == pytest.approx([0, 1, 3])
        exact = np.sqrt(4.0 - (0.6 * found.speeds) ** 2) / (2 * np.pi)
        assert found.branches[0].frequencies == pytest.approx(exact, rel=1e-6)
        met = [(one.order, one.speed) for one in found.crossings]
        assert met == [(n, pytest.approx(np.sqrt(4 / (n**2 + 0.36)), rel=1e-6)) for n in (2, 1)]
    assert seen == [0, 1, 3] * 3
    part = diagram_of(case, list(case_spins(case))[:2], complete=False)
    assert not part.complete and part.speeds.tolist() == [0, 1]


def test_a_case_without_a_table_or_an_axis_has_no_diagram():
    with pytest.raises(
        CaseError, match=r"campbell: the case has none; give one with speeds = '0:400 rpm:17', or --speeds"
    ):
        case_campbell(parse_case(STONE))
    with pytest.raises(CaseError, match="axis"):
        axis_of(
            parse_case(SPINNING).model_copy(
                update={"campbell": parse_case(SPINNING).campbell.model_copy(update={"axis": None})}
            )
        )
