"""Frequencies of the whole craft in studies, sweeps and stability, and studies that have no value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.small_cases import clamped_rod, sprung_wheels

from femflex.case import Case
from femflex.case.read import parse_case
from femflex.pipeline.decisions import build_system
from femflex.studies import planned, with_choice
from femflex.studies.convergence import assessed
from femflex.studies.stability import case_stability
from femflex.studies.stability.judgement import judged_rest
from femflex.studies.strain_forms import StrainForm, StrainStudy, has_strain
from femflex.studies.study import Study
from femflex.studies.sweep.member import Plan, run_member
from femflex.studies.verdict import level_text
from femflex.system import Sensor

WHEELS = sprung_wheels(48, 'samples = 5\n[attitude]\nframe = "inertial"')
STUDY = '[study]\nquantity = { of = "system_frequency", mode = 3 }\n'
ROD = clamped_rod('{ y = 2, family = "polynomial" }') + STUDY
CLAMPED = 1.8751040687119611**2 / 4 * np.sqrt(3000.0 / 0.5) / (2 * np.pi)


def test_a_frequency_of_the_craft_is_that_of_its_mode_or_branch_at_every_level():
    """Above the two wheels, at 1 / pi and 6.93 / 2 pi Hz, lies the bending of the clamped rod."""
    ladder = planned(parse_case(WHEELS + ROD), "modes", [1, 2]).ladder

    def study(quantity: str) -> Study:
        return Study(parse_case(WHEELS + ROD.replace("mode = 3", quantity)), "modes", ladder)

    built = ladder.rungs[1].build()
    wheels = np.sqrt([8 / 2, 48 / 3]) / (2 * np.pi)
    for quantity, hertz, tolerance in (
        ("mode = 2", wheels[1], 1e-6),
        ('branch = "joint 1"', wheels[0], 1e-6),
        ('branch = "joint 2"', wheels[1], 1e-6),
        ('branch = "joint 1", mode = 2', wheels[0], 1e-6),
        ("mode = 3", CLAMPED, 5e-3),
    ):
        assert study(quantity).value(built, print) == (pytest.approx(hertz, rel=tolerance), "Hz", 0.0)
    with pytest.raises(ValueError, match=r"^[^'\"]*9"):
        study("mode = 9").value(built, print)
    points = list(study("mode = 4").points())  # with one function the craft has three modes, with two it has four
    assert [bool(point.problem) for point in points] == [True, False] and np.isnan(points[0].value)
    assert points[1].unit == "Hz" and points[1].value > CLAMPED and (points[1].level, points[1].count) == (2, 2)
    with pytest.raises(ValueError, match="there is no value yet to judge convergence by"):
        assessed(study("mode = 4"), points[:1])


SWEEP = """
case = "wheels.toml"
design = "list"
{histories}
[vary."joints.0.stiffness"]
values = ["2 N m/rad", "32 N m/rad"]
[outputs.second]
of = "system_frequency"
mode = 2
[outputs.first]
of = "system_frequency"
branch = "joint 1"
{more}
"""
WATCHED = """
[outputs.speed]
of = "value"
channel = "bodies/a/rate"
component = "z"
"""


def test_a_member_of_a_sweep_gives_frequencies_of_the_craft_beside_its_motion(tmp_path):
    text = SWEEP.format(histories='histories = ["q:second.angle"]', more=WATCHED)
    plan = Plan(text, WHEELS, str(tmp_path / "wheels.toml"))
    for k, stiffness in enumerate((2.0, 32.0)):
        w = np.sqrt(stiffness / 2.0)
        found = run_member(plan, k, {"joints.0.stiffness": stiffness})
        assert not found.problem and found.number == k and found.units == ["Hz", "Hz", "rad/s", "rad"]
        assert found.outputs[:2] == pytest.approx(np.array([4.0, w]) / (2 * np.pi))
        assert found.outputs[2] == pytest.approx(0.5 * np.cos(w), abs=1e-6)
        assert found.time == pytest.approx([0, 0.25, 0.5, 0.75, 1]) and len(found.histories) == 1
        assert found.histories[0] == pytest.approx(np.zeros(5))
    alone = Plan(
        SWEEP.format(histories="", more='[outputs.weight]\nof = "body_mass"\nbody = "b"'), WHEELS, plan.case_path
    )
    found = run_member(alone, 5, {"joints.0.stiffness": 2.0})
    assert found.outputs == pytest.approx([4.0 / (2 * np.pi), 1.0 / (2 * np.pi), 3.0]) and found.units == [
        "Hz",
        "Hz",
        "kg",
    ]
    assert found.time == [] and found.histories == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'channel = "bodies/a/rate"',
            'channel = "bodies/a/rat"',
            "the run has no channel 'bodies/a/rat'; did you mean 'bodies/a/rate'?",
        ),
        ("mode = 2", "mode = 7", "7"),
    ],
)
def test_a_member_without_an_output_keeps_the_sentence(tmp_path, old, new, words):
    text = SWEEP.format(histories="", more=WATCHED).replace(old, new)
    found = run_member(Plan(text, WHEELS, str(tmp_path / "wheels.toml")), 3, {"joints.0.stiffness": 2.0})
    assert words in found.problem and (found.number, found.outputs, found.units) == (3, [], [])


def test_what_a_study_chose_goes_into_the_reduction_and_the_strain(built: Callable[..., Case]):
    case = built(("modes = 4 }", 'modes = 3, derivatives = 2 }\nstrain = "nonlinear"'))
    level = SimpleNamespace(recommended=5, over="derivatives", levels=np.array([5]), n_resolved=1)
    assert with_choice(case, level, ["beam"]).bodies["beam"].reduction.derivatives == 5
    assert with_choice(case, level, ["beam"]).bodies["beam"].reduction.modes == 3
    forms = tuple(
        StrainForm(name, 3, 0, 0, value) for name, value in (("linear", 2.0), ("condensed", 1.001), ("nonlinear", 1.0))
    )
    found = with_choice(case, StrainStudy("x", 0.01, forms, {}), ["beam"])
    assert found.bodies["beam"].strain == "condensed" and found.bodies["hub"] is case.bodies["hub"]


def test_analytic_bodies_have_a_strain_to_choose_where_they_bend():
    table = parse_case(WHEELS + ROD).bodies["rod"]
    for functions, bends in (({"y": 2}, True), ({"y": 0, "z": 1}, True), ({"y": 0, "axial": 2}, False)):
        made = table.model_copy(update={"functions": table.functions.model_copy(update=functions)})
        assert has_strain(made) is bends
    assert not has_strain(parse_case(WHEELS).bodies["a"])


def test_meshed_bodies_have_a_strain_to_choose_where_they_bend(built: Callable[..., Case]):
    assert has_strain(built().bodies["beam"])
    rigid = '"cantilever", clamp = "ROOT", modes = 4', '"rigid"'
    case = built(rigid, ('strain = "linear"', ""), ('child_marker = "ROOT"', 'child_marker = "origin"'))
    assert not has_strain(case.bodies["beam"])


def test_the_states_of_a_craft_are_two_per_coordinate_and_those_of_its_effectors():
    system = build_system(parse_case(WHEELS))
    found = judged_rest(system)
    assert found.size == 4 and found.stable and sorted(found.names()) == ["joint 1", "joint 1", "joint 2", "joint 2"]
    gauge = Sensor("gauge", "acceleration", "a", bandwidth=4.0)
    assert judged_rest(replace(system, effectors=gauge.effectors)).size == 7


def test_motions_are_judged_over_their_own_period_or_that_of_the_spin():
    """Multipliers exp(i w T) of a wheel at rest on its spring."""
    still = WHEELS.replace('rate = "0.5 rad/s"\n', "")
    stability = (
        '[stability]\nof = "motion"\n{}[stability.vary]\n"joints.0.stiffness" = {{ between = [2, 32], points = 2 }}\n'
    )
    done: list[float] = []
    found = case_stability(parse_case(still + stability.format('period = "0.3 s"\n')), done.append).found
    for k, w in enumerate((1.0, 4.0)):
        wanted = np.exp(1j * 0.3 * np.array([w, -w, 4.0, -4.0]))
        assert sorted(found.branches[k], key=lambda s: s.imag) == pytest.approx(
            sorted(wanted, key=lambda s: s.imag), abs=1e-6
        )
    assert (
        found.of == "multipliers"
        and done == pytest.approx([0.5, 1.0])
        and found.growth == pytest.approx([0, 0], abs=1e-6)
    )


def test_points_without_a_craft_count_as_none_with_their_reason():
    case = parse_case(WHEELS + '[stability.vary]\n"bodies.a.mass" = { between = [-1, 4], points = 3 }\n')
    found = case_stability(case).found
    assert found.kinds.tolist() == [-1, 2, 2]
    assert np.isnan(found.branches[0]).all() and found.critical == ()


def test_a_key_that_is_not_in_the_case_is_refused_before_anything_is_judged():
    from femflex.case import CaseError

    case = parse_case(WHEELS + '[stability.vary]\n"joints.5.stiffness" = { between = [2, 32], points = 2 }\n')
    with pytest.raises(CaseError, match=r"stability\.vary: .*joints is a list of 2"):
        case_stability(case)


def test_levels_that_were_not_tried_are_said_without_a_count():
    found = SimpleNamespace(
        levels=np.array([1, 2]), counts=np.array([5, 6]), over="modes", derivatives=np.zeros(0), followers=np.zeros(0)
    )
    assert [level_text(found, n) for n in (1, 9, 2)] == [
        "1 mode per body (5 elastic coordinates)",
        "9 modes",
        "2 modes per body (6 elastic coordinates)",
    ]
