"""Studies of bodies whose strain is chosen automatically, and what several studies refuse before the first runs."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.case import Case
from femflex.cli.app import app
from femflex.pipeline.case_bodies import with_own_strain
from femflex.studies import convergence, planned, strain_forms

Built = Callable[..., Case]
Written = Callable[..., Path]
DERIVED = 'modes = 3, derivatives = 2 }\nstrain = "condensed"'
UNSAID = ('strain = "linear"\n', "")
SILENT = ("modes = 4 }", "modes = 3, derivatives = 2 }")
SHORT = (
    'duration = "4 s"\noutput_step = "0.05 s"\nrtol = 1e-10',
    'duration = "1 s"\noutput_step = "0.02 s"\nrtol = 1e-7',
)
GENTLE = ("[0, 4, 8]", "[0, 0.04, 0.08]")
SPUN = ('kind = "weld"\nparent', 'kind = "revolute"\naxis = "z"\nrate = "9 rad/s"\nparent')


def told(*arguments: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, [str(word) for word in arguments])
    return done.exit_code, " ".join(done.stdout.split()), " ".join(done.stderr.split())


@pytest.mark.slow
def test_an_automatic_choice_is_written_out_as_the_body_got_it(built: Built):
    assert with_own_strain(built(UNSAID, SILENT, SPUN)).bodies["beam"].strain == "condensed"
    assert with_own_strain(built(UNSAID, SILENT)).bodies["beam"].strain == "condensed"  # its pulse bends it by 11 %
    assert with_own_strain(built(UNSAID, SILENT, GENTLE)).bodies["beam"].strain == "linear"
    said = built(("modes = 4 }", DERIVED))
    assert with_own_strain(said) is said


@pytest.mark.slow
def test_a_study_over_derivatives_of_an_automatic_body_is_that_of_the_condensed_one(built: Built):
    automatic = convergence(built(UNSAID, SILENT, SPUN, SHORT), "derivatives", [1, 2])
    condensed = convergence(built(("modes = 4 }", DERIVED), SPUN, SHORT), "derivatives", [1, 2])
    assert automatic.values.tolist() == condensed.values.tolist()
    assert automatic.followers.tolist() == [1, 2]


@pytest.mark.slow
def test_every_level_over_modes_of_an_automatic_body_derives_from_its_own_modes(built: Built):
    rungs = planned(built(UNSAID, ("modes = 4 }", "modes = 3 }"), SPUN), "modes", [1, 3]).ladder.rungs
    few, many = (rung.build().followers for rung in rungs)
    assert 0 < few < many


def test_strain_forms_tell_what_an_automatic_body_has(built: Built):
    assert strain_forms(built(UNSAID, SILENT, SPUN, SHORT)).own == {"beam": "condensed"}


@pytest.mark.parametrize(
    ("over", "sentence"),
    [
        ("modes,derivatives", "there is no nonlinear strain with derivatives to vary"),
        ("modes,segments", "there is no line cut into segments"),
        ("modes,colour", "or strain; found 'colour'"),
        ("modes,strain,derivatives", "--over modes,derivatives,strain"),
    ],
)
def test_a_list_of_studies_is_refused_before_the_first_one_runs(written: Written, over: str, sentence: str):
    spun = [UNSAID, SILENT, SPUN] if "strain" in over else []
    code, out, err = told("converge", written(*spun), "--over", over)
    assert code == 2 and out == "" and sentence in err


@pytest.mark.slow
def test_the_backbone_of_a_condensed_body_is_its_own_and_near_that_of_its_nonlinear_form(written: Written):
    found = {}
    for strain in ("condensed", "nonlinear"):
        path = written(("modes = 4 }", DERIVED.replace("condensed", strain)))
        found[strain] = json.loads(told("modes", path, "--backbone", "1 mm, 1 cm", "--json")[1])["beam"]["backbone"]
    own, other = (np.array(found[strain]["frequency_hz"]) for strain in ("condensed", "nonlinear"))
    assert own == pytest.approx(other, rel=1e-4) and (own != other).any()


@pytest.mark.sampled(1)
@pytest.mark.parametrize("strain", ["condensed", "nonlinear"])
def test_the_backbone_of_a_body_file_is_that_of_the_body_it_was_made_of(written: Written, tmp_path: Path, strain: str):
    path, file = written(("modes = 4 }", DERIVED.replace("condensed", strain))), tmp_path / "beam_file.h5"
    assert told("body", path, "beam", "-o", file)[0] == 0
    own, kept = (json.loads(told("modes", f, "--backbone", "1 mm, 1 cm", "--json")[1]) for f in (path, file))
    assert kept["beam_file"]["backbone"]["frequency_hz"] == own["beam"]["backbone"]["frequency_hz"]


@pytest.mark.slow
def test_a_backbone_that_ends_early_keeps_what_it_had(written: Written):
    path = written(("modes = 4 }", DERIVED))
    code, out, err = told("modes", path, "--backbone", "1 mm, 1 cm, 1000 m")
    rows = [amplitude for amplitude in (" 0.001 ", " 0.01 ", " 1000 ") if amplitude in out]
    assert code == 3 and rows == [" 0.001 ", " 0.01 "] and "no free vibration with an amplitude of" in err
    code, out, _ = told("modes", path, "--backbone", "1 mm, 1 cm, 1000 m", "--json")
    assert code == 3 and json.loads(out)["beam"]["backbone"]["amplitude_m"] == [0.001, 0.01]


def test_modes_tell_of_condensed_strain_and_of_what_follows(written: Written):
    code, out, _ = told("modes", written(("modes = 4 }", DERIVED)), "--backbone", "1 mm")
    assert code == 0 and "3 elastic coordinates, 2 dependent shapes (derivative); condensed strain" in out
    assert "free vibration in mode 1 by its amplitude" in out
