"""Frequencies over any value of a case: names, crossings and veering against closed forms, and mistakes."""

from __future__ import annotations

import json

import numpy as np
import pytest
from support.small_cases import sprung_wheels
from typer.testing import CliRunner

from femflex.case import CaseError
from femflex.case.read import parse_case
from femflex.case.stability import stability_table
from femflex.cli.app import app
from femflex.dynamics.equilibria.equilibrium import EquilibriumError
from femflex.studies.campbell import value_diagram
from femflex.studies.stability import case_stability
from femflex.studies.stability.judgement import NONE, STATIC

SPRUNG = sprung_wheels(20, "").replace('rate = "0.5 rad/s"\n', "").replace('child = "b"', 'parent = "a"\nchild = "b"')
WHEELS = SPRUNG + '[stability]\nvary."joints.0.stiffness" = { between = ["0.5 N m", "60 N m"], points = 7 }\n'


def exact(k: float) -> np.ndarray:
    """Frequencies [Hz] of 2 a'' + 3 (a + b)'' + k a = 0, 3 (a + b)'' + 20 b = 0."""
    M, K = np.array([[5.0, 3.0], [3.0, 3.0]]), np.diag([k, 20.0])
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)) / (2 * np.pi)


def test_branches_are_the_closed_form_over_a_stiffness_and_bear_their_names():
    found = value_diagram(parse_case(WHEELS), "joints.0.stiffness", [0.5, 4.0, 20.0, 60.0], "N m")
    assert [one.name for one in found.branches] == ["joint 1", "joint 2"] and not found.crossings
    for k, value in enumerate(found.speeds):
        assert [one.frequencies[k] for one in found.branches] == pytest.approx(exact(value), rel=1e-7)
    assert found.value == "joints.0.stiffness" and found.to_dict()["over"] == found.value


def test_branches_that_cross_keep_their_shapes():
    """Two wheels on the ground that do not feel each other: one frequency stays, the other crosses it."""
    case = parse_case(WHEELS.replace('parent = "a"\n', ""))
    found = value_diagram(case, "joints.0.stiffness", np.linspace(4.0, 60.0, 15).tolist(), "N m")
    first, second = found.branches
    assert first.frequencies == pytest.approx(np.sqrt(found.speeds / 2.0) / (2 * np.pi), rel=1e-7)
    assert second.frequencies == pytest.approx(np.full(len(found.speeds), np.sqrt(20.0 / 3.0) / (2 * np.pi)), rel=1e-7)


def test_the_verb_follows_the_value_of_the_case_or_of_its_option(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text(WHEELS)
    run = CliRunner().invoke
    done = run(app, ["campbell", "c.toml", "-o", "c.png", "-o", "c.csv"])
    assert done.exit_code == 0 and "joints.0.stiffness N m" in done.stdout, done.output
    assert (tmp_path / "c.csv").read_text().startswith("joints.0.stiffness [N m],asked,branch")
    assert (tmp_path / "c.png").stat().st_size > 10_000
    done = run(app, ["campbell", "c.toml", "--vary", "joints.1.stiffness=10:30:3", "--json"])
    assert json.loads(done.stdout)["over"] == "joints.1.stiffness"
    for words, sentence in (
        (["--vary", "joints.1.stiffness=10:30:3", "--orders", "1"], "found --orders, which goes with speeds"),
        (["--vary", "joints.1.stifness=10:30:3"], "stifness"),
        (["--vary", "joints.7.stiffness=10:30:3"], "joints is a list of 2"),
        (["--vary", "bodies.b.mass=-2:3:3"], "bodies.b.mass"),
    ):
        done = run(app, ["campbell", "c.toml", *words])
        assert done.exit_code == 2 and sentence in " ".join(done.output.split()), done.output


def test_values_that_fall_are_refused():
    with pytest.raises(ValueError, match=r"the values of joints.0.stiffness are to rise; found \[2, 1\]"):
        value_diagram(parse_case(WHEELS), "joints.0.stiffness", [2, 1])
    with pytest.raises(CaseError, match="joints is a list of 2"):
        value_diagram(parse_case(WHEELS), "joints.4.stiffness", [1, 2])


def test_the_branches_of_a_locus_bear_the_names_of_modes():
    found = case_stability(parse_case(WHEELS)).found
    assert sorted(found.names) == ["joint 1", "joint 1", "joint 2", "joint 2"]
    for name, branch in zip(found.names, found.branches.T, strict=True):
        assert abs(branch[0].imag) / (2 * np.pi) == pytest.approx(exact(0.5)[int(name[-1]) - 1], rel=1e-6)


PENDULUM = """
title = "a pendulum under a torque"
[run]
duration = "1 s"
[environment]
gravity = [0, -9, 0]
[bodies.rod]
kind = "rigid"
mass = 2
inertia = [1, 1, 1]
center_of_mass = [0.5, 0, 0]
[[joints]]
kind = "revolute"
child = "rod"
axis = "z"
angle = "-90 deg"
[[loads]]
name = "motor"
body = "rod"
torque = [0, 0, 1]
[stability]
vary."loads.0.torque.2" = { between = ["2.5 N m", "12.5 N m"], points = 5 }
"""


def test_beyond_the_fold_of_a_pendulum_there_is_no_equilibrium_and_none_without_its_load_is_taken():
    """m g l = 9 N m: w^2 = sqrt(81 - T^2) / 1.5 (about the hinge), and nothing from T = 9 on."""
    case = parse_case(PENDULUM)
    found = value_diagram(case, "loads.0.torque.2", [3.0, 6.0], "N m")
    wanted = np.sqrt(np.sqrt(81 - np.array([9, 36])) / 1.5)
    assert 2 * np.pi * found.branches[0].frequencies == pytest.approx(wanted, rel=1e-7)
    text = (
        r"at loads\.0\.torque\.2 = 9\.5 N m no equilibrium was found under the loads that act below it; let the values"
    )
    with pytest.raises(EquilibriumError, match=text):
        value_diagram(case, "loads.0.torque.2", [3.0, 9.5, 12.0], "N m")
    with pytest.raises(
        EquilibriumError, match=r"^below .* = -6 N m no equilibrium was found under the loads that act at"
    ):
        value_diagram(case, "loads.0.torque.2", [-12.0, -6.0], "N m")
    seen: list[float] = []
    locus = case_stability(case, seen.append).found
    assert locus.kinds.tolist() == [STATIC, STATIC, STATIC, NONE, NONE] and np.isnan(locus.growth[3:]).all()
    assert locus.lost == 10.0 and seen == pytest.approx([0.2, 0.4, 0.6]) and locus.critical == ()
    across = {"between": ["-15 N m", "-5 N m"], "points": 3}
    table = stability_table({"vary": {"loads.0.torque.2": across}}, "a test")
    other = case_stability(case.model_copy(update={"stability": table}))
    assert other.found.kinds.tolist() == [NONE, NONE, STATIC] and other.found.lost is None
