"""Frequencies over any value of a case: names, crossings and veering against closed forms, and mistakes."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.case import CaseError
from femflex.case.read import parse_case
from femflex.cli.app import app
from femflex.studies.campbell import value_diagram
from femflex.studies.stability import case_stability

WHEELS = """
title = "two wheels on sprung axles"
[run]
duration = "1 s"
[bodies.a]
kind = "rigid"
mass = 3
inertia = [2, 2, 2]
[bodies.b]
kind = "rigid"
mass = 3
inertia = [2, 2, 3]
[[joints]]
kind = "revolute"
child = "a"
name = "first"
stiffness = 8
[[joints]]
kind = "revolute"
parent = "a"
child = "b"
name = "second"
stiffness = 20
[stability]
vary."joints.0.stiffness" = { between = ["0.5 N m", "60 N m"], points = 7 }
"""


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
