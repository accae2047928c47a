"""Types of admissible functions compared: which type and how many a quantity needs."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from typer.testing import CliRunner

from femflex.case import parse_case
from femflex.cli.app import app
from femflex.studies import choice, function_kinds, with_choice
from femflex.studies.function_kinds import FunctionKind, FunctionStudy
from femflex.view.side_by_side import plot_studies

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
    found = function_kinds(boom(), [1, 2, 4])
    assert found.chosen == ("characteristic", 1)
    assert found.recommended == choice(found) == "characteristic, 1"
    assert {one.kind for one in found.kinds} == {
        "characteristic", "characteristic, static", "characteristic, tip", "polynomial", "elements",
    }  # fmt: skip
    assert found.own == {"boom": "by default, 2"}
    exact = 3.51601527 / (2 * np.pi)
    for kind, study in found.with_values:
        assert study.values[-1] == pytest.approx(exact, rel=4e-4), kind


@pytest.mark.slow
def test_a_tapered_boom_wants_elements_and_the_choice_goes_into_the_case():
    """Elements have the taper in their shapes; one of their modes is enough, however strong the taper."""
    case = boom(TAPER)
    found = function_kinds(case, [1, 2, 3, 4, 6])
    assert found.chosen == ("elements", 1)
    uniform = dict(found.with_values)["characteristic"]
    assert found.enough(uniform) is None or found.enough(uniform) > 3
    assert "Choose elements, 1 per field." in found.verdict
    functions = with_choice(case, found, tuple(found.own)).bodies["boom"].functions
    assert (functions.family, functions.y) == ("elements", 1)


def test_types_that_do_not_settle_choose_nothing():
    case = boom(TAPER)
    found = function_kinds(case, [1, 2], tolerance=1e-9)
    only = [one for one in found.kinds if one.kind == "characteristic"]
    alone = FunctionStudy(found.title, 1e-9, tuple(only), found.own)
    assert alone.chosen is None and "No type settles within the tolerance 1e-09" in alone.verdict
    failed = FunctionStudy(found.title, 1e-9, (FunctionKind("polynomial", None, problem="why"),), found.own)
    assert failed.verdict == "Polynomial functions have no value: why. Nothing can be compared."


def test_the_verb_prints_and_draws(tmp_path):
    (tmp_path / "boom.toml").write_text(BOOM.replace("TAPER", ""))
    out = tmp_path / "kinds.png"
    said = CliRunner().invoke(
        app, ["converge", str(tmp_path / "boom.toml"), "--over", "functions", "--levels", "1,2", "-o", str(out)]
    )
    assert said.exit_code == 0, said.output
    assert "characteristic  1" in " ".join(said.output.split("\n")) or "characteristic" in said.output
    assert said.output.count("<-") == 1
    assert imread(out).std() > 0.01


def test_a_case_without_functions_is_refused():
    text = BOOM.replace("functions = { y = 2 }\nTAPER", "").replace('body = "boom", mode = 1', 'body = "boom"')
    with pytest.raises(ValueError, match="functions to vary"):
        function_kinds(parse_case(text, Path("boom.toml")))


def test_the_picture_has_a_line_for_each_type(tmp_path):
    found = function_kinds(boom(), [1, 2])
    assert plot_studies([found], tmp_path / "p.png", found.verdict)
