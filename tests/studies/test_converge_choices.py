"""Choices by study: types of functions, forms of strain, and the verb that compares them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from typer.testing import CliRunner

from femflex.case import Case, parse_case
from femflex.cli.app import app
from femflex.studies import (
    convergence,
    function_kinds,
    recommended_level,
    strain_forms,
    with_recommended_level,
)

BOOM = """
title = "a boom that stays"
source = "numbers of no meaning"
[run]
duration = "1 s"
output_step = "0.1 s"
[bodies.boom]
kind = "deploying"
family = "beam"
length = "1 m"
mass_per_length = 1
EIy = 1
EIz = 1
functions = { y = 2 }
TAPER
[[joints]]
kind = "weld"
child = "boom"
[study]
quantity = { of = "mode_frequency", body = "boom", mode = 1 }
tolerance = 1e-4
"""
TAPER = "taper = { along = [0, 1], mass = [0.3, 1.0], bending = [0.05, 1.0] }"


def boom(taper="", **changes):
    text = BOOM.replace("TAPER", taper)
    for old, new in changes.items():
        text = text.replace(old, new)
    return parse_case(text, Path("boom.toml"))


def test_one_characteristic_function_is_the_mode_of_a_uniform_boom():
    comparison = function_kinds(boom(), [1, 2, 4])
    assert comparison.choice == ("characteristic", 1)
    assert comparison.recommended == recommended_level(comparison) == "characteristic, 1"
    assert {option.name for option in comparison.options} == {
        "characteristic", "characteristic, static", "characteristic, tip", "polynomial", "elements",
    }  # fmt: skip
    assert comparison.own == {"boom": "by default, 2"}
    exact = 3.51601527 / (2 * np.pi)
    for option in comparison.with_values:
        assert option.values[-1] == pytest.approx(exact, rel=4e-4), option.name


@pytest.mark.slow
def test_tapered_boom_needs_elements():
    """Elements have the taper in their shapes; one of their modes is enough, however strong the taper."""
    case = boom(TAPER)
    comparison = function_kinds(case, [1, 2, 3, 4, 6])
    assert comparison.choice == ("elements", 1)
    uniform = next(option for option in comparison.options if option.name == "characteristic")
    enough = comparison.enough(uniform)
    assert enough is None or enough.level > 3
    functions = with_recommended_level(case, comparison, tuple(comparison.own)).bodies["boom"].functions
    assert (functions.family, functions.y) == ("elements", 1)


BuildCase = Callable[..., Case]
SPUN = [  # 0.3 of a turn a second about z, faster than the beam's first flap
    ("torque = [[0, 0, 0], [0, 4, 8], [0, 0, 0]]", "torque = [[0, 0, 0], [0, 0, 20], [0, 0, 0]]"),
    ('duration = "4 s"\noutput_step = "0.05 s"\nrtol = 1e-10', 'duration = "2 s"\noutput_step = "0.02 s"\nrtol = 1e-6'),
    ('of = "value", channel', 'of = "peak", channel'),
    ("modes = 4 }", 'modes = 3, joints = {}, derivatives = "auto" }\nstrain = "linear"'),
]


def test_large_deflection_needs_more_than_linear_strain(build_case: BuildCase):
    """By a fifth of its length: linear strain leaves the foreshortening out, and the beam on a small hub feels it."""
    comparison = strain_forms(build_case(*SPUN))
    assert [option.problem for option in comparison.options] == ["", "", ""]
    linear, condensed, nonlinear = (option.points[0] for option in comparison.options)
    assert (linear.derivatives, linear.followers) == (0, 0)
    assert condensed.count == linear.count == 3 and condensed.followers == nonlinear.derivatives > 0
    off = [comparison.differences(option)[0] for option in comparison.options]
    assert off[1] < 0.05 * off[0] and off[2] == 0 and comparison.choice in (("condensed", 1), ("nonlinear", 1))
    assert comparison.own == {"beam": "linear"}


def test_choice_of_a_study_is_set_in_the_case(build_case: BuildCase):
    case = build_case(*SPUN)
    study = convergence(case, "modes", [1, 2, 3])
    recommended_case = with_recommended_level(case, study, ("beam",))
    assert recommended_case.bodies["beam"].reduction.modes == recommended_level(study)
    refined_case = with_recommended_level(case, replace(study, over="mesh"), ("beam",))
    assert refined_case.bodies["beam"].refine == case.bodies["beam"].refine + recommended_level(study)


def invoke_converge(*arguments: object):
    return CliRunner().invoke(app, ["converge", *map(str, arguments)])


@pytest.mark.slow
def test_several_studies_in_turn(write_case_file: Callable[..., Path], tmp_path: Path):
    case = write_case_file(*SPUN[:-1], ("modes = 4 }", 'modes = 2, derivatives = "auto" }\nstrain = "nonlinear"'))
    picture = tmp_path / "study.png"
    result = invoke_converge(case, "--over", "modes,derivatives,strain", "--tolerance", "0.02", "-o", picture)
    assert result.exit_code == 0, result.stderr
    assert np.ptp(imread(picture)) > 0.5
    summary = json.loads(invoke_converge(case, "--over", "derivatives,strain", "--json").stdout)
    assert set(summary["choice"]) == {"derivatives", "strain"} and len(summary["strain"]["rows"]) == 3
    assert summary["derivatives"]["rows"] and summary["together"]


RunConverge = Callable[..., tuple[int, str, str]]


@pytest.fixture
def converge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RunConverge:
    """Runs `femflex converge` in a folder of its own; returns exit code, standard output and standard error."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> tuple[int, str, str]:
        done = CliRunner().invoke(app, ["converge", *map(str, arguments)])
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        return done.exit_code, done.stdout, done.stderr

    return call


def rows(out: str) -> list[list[str]]:
    """Cells of the lines that begin with a number."""
    return [line.split() for line in out.splitlines() if line.lstrip(" ")[:1].isdigit() and not line.startswith("  ")]


def test_verb_recommends_six_modes(converge: RunConverge, write_case_file: Callable[..., Path]):
    code, out, err = converge(
        write_case_file(("modes = 4 }", "modes = 4, joints = {} }")), "--levels", "2,3,4,6,8,10", "--tolerance", "1e-3"
    )
    assert (code, err) == (0, "")
    assert [row[0] for row in rows(out)] == ["2", "3", "4", "6", "8", "10"]
    assert [row[0] for row in rows(out) if row[-1] == "<-"] == ["6"]
