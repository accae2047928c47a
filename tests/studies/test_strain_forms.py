"""The forms of strain compared, and several studies in turn: what is enough, what it costs, what is printed."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from test_derivative_ladder import FAR
from typer.testing import CliRunner

from femflex.case import Case
from femflex.cli.app import app
from femflex.cli.converge_report import print_forms
from femflex.studies import StrainForm, StrainStudy, choice, convergence, strain_forms, with_choice
from femflex.view.side_by_side import plot_studies

Built = Callable[..., Case]
SPUN = [  # 0.3 of a turn a second about z, faster than the beam's first flap
    *FAR[1:],
    ("modes = 4 }", 'modes = 3, joints = {}, derivatives = "auto" }\nstrain = "linear"'),
]


@pytest.fixture(scope="module")
def forms() -> StrainStudy:
    """A made-up comparison."""
    made = [
        StrainForm("linear", 4, 0, 0, 1.3, 0.1, "", "m"),
        StrainForm("condensed", 4, 0, 3, 1.0005, 0.2, "", "m"),
        StrainForm("nonlinear", 7, 3, 0, 1.0, 4.0, "", "m"),
    ]
    return StrainStudy("peak of tip", 1e-3, tuple(made), {"beam": "linear"})


def test_the_simplest_form_within_the_tolerance_is_chosen(forms: StrainStudy):
    assert forms.recommended == choice(forms) == "condensed"
    assert [round(forms.difference(form), 6) for form in forms.forms] == [0.3, 0.0005, 0.0]
    assert "Linear strain is not enough: 0.3 off nonlinear strain (tolerance 0.001), in 0.025 of its time" in (
        forms.verdict
    )
    assert forms.verdict.endswith("Choose strain = 'condensed'.")
    assert replace(forms, tolerance=1e-5).recommended == "nonlinear"
    assert replace(forms, tolerance=0.5).recommended == "linear"


def test_the_table_points_at_the_form_that_is_chosen(forms: StrainStudy, capsys):
    print_forms(forms)
    pointed = [line.split()[0] for line in capsys.readouterr().out.splitlines() if line.rstrip().endswith("<-")]
    assert pointed == ["condensed"]


def test_a_form_without_a_value_says_why_and_is_not_chosen(forms: StrainStudy):
    away = replace(forms.forms[0], value=math.nan, problem="it diverges at t = 3 s")
    found = replace(forms, forms=(away, *forms.forms[1:]))
    assert "Linear strain has no value: it diverges at t = 3 s." in found.verdict
    assert found.recommended == "condensed"
    alone = replace(forms, forms=(away, forms.forms[1]))
    assert alone.recommended is None and "only strain = 'condensed' has a value" in alone.verdict


def test_a_beam_that_bends_far_wants_more_than_linear_strain(built: Built):
    """By a fifth of its length: linear strain leaves the foreshortening out, and the beam on a small hub feels it."""
    found = strain_forms(built(*SPUN))
    linear, condensed, nonlinear = found.forms
    assert [form.problem for form in found.forms] == ["", "", ""]
    assert (linear.derivatives, linear.followers) == (0, 0)
    assert condensed.coordinates == linear.coordinates == 3 and condensed.followers == nonlinear.derivatives > 0
    assert found.difference(condensed) < 0.05 * found.difference(linear)
    assert found.own == {"beam": "linear"}


def test_what_a_study_chooses_goes_into_the_case(built: Built):
    case = built(*SPUN)
    found = convergence(case, "modes", [1, 2, 3])
    chosen = with_choice(case, found, ("beam",))
    assert chosen.bodies["beam"].reduction.modes == choice(found)
    finer = with_choice(case, replace(found, over="mesh"), ("beam",))
    assert finer.bodies["beam"].refine == case.bodies["beam"].refine + choice(found)


def test_rigid_bodies_have_no_strain_to_choose(built: Built):
    case = built()
    rigid = case.model_copy(update={"bodies": {"hub": case.bodies["hub"]}})
    with pytest.raises(ValueError, match="there is no form of strain to choose; its bodies are hub"):
        strain_forms(rigid)


def called(*arguments: object):
    return CliRunner().invoke(app, ["converge", *map(str, arguments)])


@pytest.mark.slow
def test_several_studies_in_turn_are_one_table_each_one_choice_and_one_picture(
    written: Callable[..., Path], tmp_path: Path
):
    case = written(*SPUN[:-1], ("modes = 4 }", 'modes = 2, derivatives = "auto" }\nstrain = "nonlinear"'))
    picture = tmp_path / "study.png"
    done = called(case, "--over", "modes,derivatives,strain", "--tolerance", "0.02", "-o", picture)
    told = " ".join(done.stdout.split())
    assert done.exit_code == 0, done.stderr
    assert told.count("verdict") == 3 and "together Choose modes = " in told and ", strain = '" in told
    heads = ("strain", "coordinates", "vibration", "derivatives", "dependent", "value", "difference", "seconds")
    assert all(f" {head} " in told for head in heads)
    assert np.ptp(imread(picture)) > 0.5
    both = json.loads(called(case, "--over", "derivatives,strain", "--json").stdout)
    assert [study["over"] for study in both["studies"]] == ["derivatives", "strain"]
    assert set(both["choice"]) == {"derivatives", "strain"} and len(both["studies"][1]["forms"]) == 3


def test_levels_belong_to_one_study(written: Callable[..., Path]):
    done = called(written(), "--over", "modes,strain", "--levels", "1,2,3")
    assert done.exit_code == 2
    given = (
        "--levels goes with one study over modes, mesh, derivatives, segments or functions; found --over modes,strain"
    )
    assert given in " ".join(done.stderr.split())


def test_a_comparison_alone_is_drawn_with_its_verdict(forms: StrainStudy, tmp_path: Path):
    text = plot_studies([forms], tmp_path / "forms.svg", "").read_text()
    assert len(text) > 10_000
    assert np.ptp(imread(plot_studies([forms], tmp_path / "forms.png", ""))) > 0.5
