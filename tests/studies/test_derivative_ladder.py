"""Studies over the number of derivative shapes: what a beam that bends far needs of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from femflex.case import Case
from femflex.cli.converge_report import print_study
from femflex.studies import assessed, convergence, planned
from femflex.studies.study import Point
from femflex.studies.verdict import level_text

QUANTITY = 'of = "value", channel = "markers/beam.tip/deflection", component = "y"'
FAR = [
    ("modes = 4 }", 'modes = 3, joints = {}, derivatives = "auto" }\nstrain = "nonlinear"'),
    ("torque = [[0, 0, 0], [0, 4, 8], [0, 0, 0]]", "torque = [[0, 0, 0], [0, 0, 20], [0, 0, 0]]"),
    ('duration = "4 s"\noutput_step = "0.05 s"\nrtol = 1e-10', 'duration = "2 s"\noutput_step = "0.02 s"\nrtol = 1e-6'),
    ('of = "value", channel', 'of = "peak", channel'),
]


def test_without_derivatives_a_beam_bends_far_less_and_a_few_are_enough(built: Callable[..., Case], capsys):
    found = convergence(built(*FAR), "derivatives", [0, 1, 2, 3])
    assert found.levels.tolist() == found.derivatives.tolist() == [0, 1, 2, 3]
    assert found.counts.tolist() == [3, 4, 5, 6]
    exact = found.values[-1]
    assert found.values[0] < 0.3 * exact
    assert np.abs(found.values[2] / exact - 1) < 1e-3
    assert "1 derivative shape per body (4 elastic coordinates, 1 of them derivative shapes) suffices" in found.verdict
    print_study(found)
    assert "derivatives coordinates vibration derivatives value" in " ".join(capsys.readouterr().out.split())


def test_modes_and_derivatives_are_counted_apart(built: Callable[..., Case], capsys):
    case = built(FAR[0], (f"{{ {QUANTITY} }}", '{ of = "mode_frequency", body = "beam", mode = 1 }'))
    found = convergence(case, "modes", [1, 2, 3])
    assert found.counts.tolist() == (found.levels + found.derivatives).tolist() and found.derivatives.all()
    print_study(found)
    assert "modes coordinates vibration derivatives value" in " ".join(capsys.readouterr().out.split())


def test_levels_left_out_go_as_far_as_there_are_shapes(built: Callable[..., Case]):
    ladder = planned(built(*FAR), "derivatives").ladder
    assert ladder.rungs[0].level == 0 and ladder.varied == ("beam",)
    assert ladder.rungs[-1].level >= (ladder.own or 0) > 0
    assert ladder.rungs[-1].build().derivatives == ladder.rungs[-1].level


def test_all_the_shapes_that_the_modes_have_are_the_answer_and_fewer_are_judged_by_them(built: Callable[..., Case]):
    study = planned(built(*FAR), "derivatives")
    most = study.ladder.whole
    assert most is not None and most == study.ladder.rungs[-1].level

    def judged(last: int):
        values = zip([0, 1, 2, last], [1.0, 1.1, 1.3, 1.9], strict=True)
        return assessed(study, [Point(n, 3 + n, value, 1e-12, "m", derivatives=n) for n, value in values])

    found = judged(most)
    assert found.recommended == most and found.errors == pytest.approx([0.9, 0.8, 0.6, 0.0], abs=1e-9)
    text = "derivative shapes): no further shapes exist. With fewer the value differs by 0.32 or more, relative."
    assert text in found.verdict
    assert judged(most - 1).verdict.startswith("Does not converge over") and judged(most - 1).recommended is None


def test_linear_bodies_have_no_derivatives_to_vary(built: Callable[..., Case]):
    with pytest.raises(ValueError, match="there is no nonlinear strain with derivatives to vary; its bodies are hub"):
        planned(built(), "derivatives")
    with pytest.raises(ValueError, match="at least two different numbers of derivative shapes, each at least 0"):
        planned(built(*FAR), "derivatives", [-1, 2])


def test_shapes_that_follow_are_counted_apart_from_coordinates(built: Callable[..., Case], capsys):
    case = built(*FAR[1:], ("modes = 4 }", 'modes = 3, joints = {}, derivatives = "auto" }\nstrain = "condensed"'))
    found = convergence(case, "derivatives", [0, 1, 2, 3])
    assert found.levels.tolist() == found.followers.tolist() == [1, 2, 3]  # with none there is nothing to condense
    assert found.counts.tolist() == [4, 5, 6] and not found.derivatives.any()
    print_study(found)
    assert "derivatives shapes vibration derivatives dependent" in " ".join(capsys.readouterr().out.split())
    told = level_text(found, 2)
    assert told == "2 derivative shapes per body (5 shapes, 2 of them dependent derivative shapes)"
