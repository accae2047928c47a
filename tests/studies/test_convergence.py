"""Convergence studies of a hub and a beam: against closed forms, and against the run without any reduction."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from femflex.case import Case, CaseError
from femflex.case.measure import MeasureTable
from femflex.pipeline import prepare
from femflex.studies import Point, assessed, convergence, planned
from femflex.studies.study import described
from femflex.warning import PhysicsWarning

LENGTH, EI, MASS = 4.0, 50.0, 0.5  # as in conftest.py
ROOTS = (1.8751040687119611, 4.6940911329741746, 7.8547574382376126)  # of cosh x cos x = -1

QUANTITY = 'quantity = { of = "value", channel = "markers/beam.tip/deflection", component = "y" }'
FIRST_MODE = 'quantity = { of = "mode_frequency", body = "beam", mode = 1 }'
PLAIN = ("modes = 4 }", "modes = 4, joints = {} }")  # without the static shapes of joints that few modes get
NODAL = ('method = "cantilever", clamp = "ROOT", modes = 4', 'method = "nodal", clamp = "ROOT"')

Built = Callable[..., Case]


def clamped_free(root: float, EI: float) -> float:
    """Frequency of a clamped-free Euler-Bernoulli beam [Hz]."""
    return (root / LENGTH) ** 2 * math.sqrt(EI / MASS) / (2 * math.pi)


@pytest.mark.parametrize(
    ("mode", "exact"),
    [(1, clamped_free(ROOTS[0], EI)), (2, clamped_free(ROOTS[0], 2 * EI)), (3, clamped_free(ROOTS[1], EI))],
)
def test_cubic_elements_show_order_four_and_richardson_hits_the_closed_form(built: Built, mode: int, exact: float):
    case = built((QUANTITY, FIRST_MODE.replace("mode = 1", f"mode = {mode}")), cells=4)
    found = convergence(case, "mesh", levels=[0, 1, 2, 3])
    assert found.order == pytest.approx(4.0, abs=0.05)
    assert found.trend.scatter < 0.2
    assert found.estimate == pytest.approx(exact, rel=1e-7)
    true = np.abs(found.values - exact)
    np.testing.assert_allclose(found.errors[:-1], true[:-1], rtol=0.02)
    assert abs(found.estimate - exact) < 0.05 * true[-1]
    assert found.counts.tolist() == [50, 94, 182, 358]  # 6 a node, 5 inside an element for axial and torsion


@pytest.mark.parametrize(("tolerance", "level"), [(1e-2, 0), (1e-4, 1), (1e-5, 2), (1e-7, None)])
def test_the_verdict_names_the_refinement_that_the_closed_form_asks_for(
    built: Built, tolerance: float, level: int | None
):
    found = convergence(built((QUANTITY, FIRST_MODE), cells=2), "mesh", [0, 1, 2], tolerance)
    within = np.abs(found.values / clamped_free(ROOTS[0], EI) - 1) <= tolerance
    assert found.recommended == level == (int(np.argmax(within)) if within.any() else None)
    if level is None:
        assert found.verdict.startswith("Not converged to 1e-07: with 2 refinements (94 dofs)")
        assert "At this rate, 4 refinements would reach the tolerance." in found.verdict
    elif level:
        assert f"{level} refinement{'s' * (level > 1)}" in found.verdict
    else:
        assert "the mesh as it is (28 dofs) suffices" in found.verdict


def test_too_many_cubic_elements_meet_rounding_and_the_verdict_says_so(built: Built):
    found = convergence(built((QUANTITY, FIRST_MODE), cells=16), "mesh", [0, 1, 2, 3, 4, 5], 1e-6)
    exact = clamped_free(ROOTS[0], EI)
    assert found.trend.rounded is not None and found.trend.rounded <= 4
    assert abs(found.estimate - exact) < 2e-8 * exact
    assert np.all(found.errors >= 0.2 * np.abs(found.values - exact))
    assert found.recommended == 0
    assert "rounding dominates" in found.verdict and "elements of higher order" in found.verdict


def value_of_run(case: Case) -> float:
    """The quantity by a run of the case as it is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # few modes are meant to be few here
        prepared = prepare(case, case.path.parent / "none.h5")
    solution = prepared.integrator.solve(prepared.model, prepared.times, prepared.model.x0)
    seen = prepared.model.observe(prepared.times[-1:], solution.states[-1:])
    return float(seen["markers/beam.tip/deflection"][0, 1])


@pytest.mark.slow
def test_the_verdict_names_the_number_of_modes_the_unreduced_run_asks_for(built: Built):
    exact = value_of_run(built(NODAL))
    study = planned(built(PLAIN), "modes", [1, 2, 3, 4, 5, 6, 8, 10])
    points = list(study.points())
    recommended = []
    for tolerance in (3e-2, 1e-3):
        found = assessed(study, points, tolerance)
        bad = np.flatnonzero(np.abs(found.values / exact - 1) > tolerance)
        assert found.recommended == found.levels[bad[-1] + 1]
        assert f"Converged to {tolerance:g}: {found.recommended} modes suffice" in found.verdict
        recommended.append(found.recommended)
    assert recommended[0] < recommended[1] < 10
    assert found.estimate == pytest.approx(exact, rel=1e-3)


@pytest.mark.slow
def test_a_level_gives_what_the_case_itself_gives_with_so_many_modes(built: Built):
    found = convergence(built(), "modes", [1, 2, 3, 5])
    for modes, value in zip(found.levels, found.values, strict=True):
        assert value == pytest.approx(value_of_run(built(("modes = 4", f"modes = {modes}"))), rel=1e-8)


def test_joints_that_a_case_gives_are_those_of_every_level(built: Built):
    given = ("modes = 4 }", 'modes = 4, joints = { ROOT = ["y", "rz"] } }')
    found = convergence(built(given), "modes", [2, 4])
    assert found.counts.tolist() == [4, 6]
    assert found.values[0] == pytest.approx(value_of_run(built(given, ("modes = 4,", "modes = 2,"))), rel=1e-8)


@pytest.mark.slow
def test_static_shapes_are_made_anew_for_each_level_and_converge_faster(built: Built):
    exact = value_of_run(built(NODAL))
    plain = convergence(built(PLAIN), "modes", [2, 4, 6])
    given = ("modes = 4 }", 'modes = 4, joints = {}, attachment = ["y"] }')
    attached = convergence(built(given), "modes", [2, 4, 6])
    assert plain.counts.tolist() == [2, 4, 6] and attached.counts.tolist() == [3, 5, 7]
    off = np.abs(attached.values / exact - 1) / np.abs(plain.values / exact - 1)
    print(off, plain.values, attached.values, exact)
    assert off[0] < 0.3 and np.all(off < 0.9)


def test_the_usual_ladder_goes_to_twice_the_modes_of_the_case(built: Built):
    ladder = planned(built()).ladder
    assert [rung.level for rung in ladder.rungs] == [1, 2, 3, 4, 6, 8] and ladder.own == 4
    few = planned(built(("modes = 4", "modes = 6"), cells=1)).ladder  # the mesh has no more than 8
    assert [rung.level for rung in few.rungs] == [1, 2, 3, 4, 6]
    named = planned(built((QUANTITY, QUANTITY + "\nmodes = [2, 3, 5]\nrefinements = [0, 2]"))).ladder
    assert [rung.level for rung in named.rungs] == [2, 3, 5]
    assert [rung.level for rung in planned(built(), "mesh").ladder.rungs] == [0, 1, 2, 3, 4]


def test_close_pairs_are_not_parted(built: Built):
    case = built((f"EIz = {2 * EI}", f"EIz = {EI}"), PLAIN)
    assert [rung.level for rung in planned(case).ladder.rungs] == [2, 4, 6, 8]
    found = convergence(case, "modes", [1, 2, 3])
    assert found.levels.tolist() == found.counts.tolist() == [2, 4]


def test_modes_of_a_fixed_body_do_not_change_with_their_number(built: Built):
    found = convergence(built((QUANTITY, FIRST_MODE.replace("1", "3"))), "modes", [1, 2, 3, 4, 6])
    assert found.trend.state == "constant" and found.recommended == 3
    assert "No dependence on the number of modes is seen" in found.verdict
    assert found.left_out == (
        "1: mode 3 of body 'beam' has no natural frequency; 1 of its modes have one",
        "2: mode 3 of body 'beam' has no natural frequency; 2 of its modes have one",
    )


def test_levels_too_coarse_for_the_initial_state_are_left_out(built: Built):
    initial = '[bodies.beam.initial]\nmarker = "tip"\ndisplacement = [0, 0.01, 0]\n\n[[joints]]'
    found = convergence(built(("[[joints]]", initial), PLAIN), "modes", [1, 2, 4, 6])
    assert found.levels.tolist() == [2, 4, 6]  # the first mode bends the other way
    (text,) = found.left_out
    assert text.startswith("1: bodies.beam.initial: marker 'tip': the requested initial displacement is [0, 0.01, 0] m")


def test_a_frequency_of_the_whole_craft_converges_to_that_of_the_coupled_beam(built: Built):
    """Hub and beam free in the plane: the transcendental equation of a free-free beam with a rigid body at one end."""
    ring = QUANTITY.replace('"value"', '"frequency"').replace("}", ", start = 2, tones = 2 }")
    long = ('duration = "4 s"', 'duration = "40 s"')
    gentle = ("torque = [[0, 0, 0], [0, 4, 8]", "torque = [[0, 0, 0], [0, 0.04, 0.08]")  # spin would shift it by 2e-3
    short = ("times = [0, 1, 2]", "times = [0, 0.2, 0.4]")  # two seconds would hardly excite a mode at one hertz
    found = convergence(built((QUANTITY, ring), long, gentle, short, PLAIN), "modes", [2, 4, 6, 8])
    assert found.unit == "Hz"
    assert found.estimate == pytest.approx(coupled_frequency(2 * EI), rel=1e-4)


def coupled_frequency(EI: float) -> float:
    """First bending frequency [Hz] of a beam with a rigid body (5 kg, 3 kg m^2) at its root, free in space."""
    from scipy.optimize import brentq

    def determinant(b: float) -> float:
        # w = a cos + b sin + c cosh + d sinh of b x / L; shear and moment at the root move the body, none at the tip
        k, w2 = b / LENGTH, (b / LENGTH) ** 4 * EI / MASS
        c, s, ch, sh = math.cos(b), math.sin(b), math.cosh(b), math.sinh(b)
        root_force = [5.0 * w2, EI * k**3, 5.0 * w2, -EI * k**3]
        root_moment = [-EI * k**2, 3.0 * w2 * k, EI * k**2, 3.0 * w2 * k]
        rows = [root_force, root_moment, [-c, -s, ch, sh], [s, -c, sh, ch]]
        return float(np.linalg.det(np.array(rows) / np.abs(rows).max(axis=1, keepdims=True)))

    grid = np.linspace(0.5, 8.0, 400)
    signs = np.sign([determinant(b) for b in grid])
    first = int(np.flatnonzero(signs[:-1] * signs[1:] < 0)[0])
    root = brentq(determinant, grid[first], grid[first + 1], xtol=1e-13)
    return (root / LENGTH) ** 2 * math.sqrt(EI / MASS) / (2 * math.pi)


def test_progress_runs_from_nothing_to_everything(built: Built):
    told: list[float] = []
    convergence(built(), "modes", [1, 2, 3], progress=told.append)
    assert told[0] == 0.0 and told[-1] == pytest.approx(1.0)
    assert all(a <= b for a, b in pairwise(told))


def judged(case: Case, values: list[float], over: str = "modes", tolerance: float = 1e-3):
    """The verdict on made-up values at 1, 2, 4, 8, ... modes or 0, 1, 2, ... refinements."""
    study = planned(case, over)  # type: ignore[arg-type]
    levels = [2**k if over == "modes" else k for k in range(len(values))]
    return assessed(
        study, [Point(level, 10 * 2**level, v, 1e-12, "m") for level, v in zip(levels, values, strict=True)], tolerance
    )


@pytest.mark.parametrize("over", ["modes", "mesh"])
def test_values_that_do_not_converge_get_an_honest_verdict(built: Built, over: str):
    found = judged(built(), [1.0, 1.1, 1.25, 1.5, 1.9], over)
    assert found.recommended is None and math.isnan(found.estimate)
    assert found.verdict.startswith("Does not converge over") and "the changes do not fall" in found.verdict
    assert np.isnan(found.errors).all()


@pytest.mark.parametrize("over", ["modes", "mesh"])
def test_values_that_swing_are_not_extrapolated(built: Built, over: str):
    found = judged(built(), [1.0, 1.2, 1.05, 1.0501, 1.05, 1.05004], over)
    assert found.law is None and found.estimate == 1.05004
    assert found.recommended == (4 if over == "modes" else 2)
    assert "Values oscillate" in found.verdict and "no order" in found.verdict
    assert judged(built(), [1.0, 1.2, 1.05, 1.0501, 1.05, 1.05004], over, 1e-6).recommended is None


def test_two_values_and_one_are_not_judged(built: Built):
    two, one = judged(built(), [1.0, 1.1]), judged(built(), [1.0])
    assert math.isnan(two.estimate) and math.isnan(one.estimate)
    assert two.recommended is None and two.verdict.startswith("Two levels differ by 0.091, relative")
    assert one.recommended is None and "1 mode" in one.verdict and "at least three levels" in one.verdict


def test_a_quantity_that_is_nothing_is_constant(built: Built):
    found = judged(built(), [0.0, 0.0, 0.0, 0.0])
    assert found.trend.state == "constant" and found.recommended == 1


HUBS_MODE, MODE_200, LOST = (
    FIRST_MODE.replace(old, new) for old, new in (("beam", "hub"), ("1", "200"), ("beam", "bem"))
)
REFUSED = [
    (("[study]\n" + QUANTITY, ""), "modes", None, r"no \[study\] .* add one, such as"),
    (None, "time", None, "varies modes, mesh, derivatives, segments, functions or strain; found 'time'"),
    (None, "modes", [4], "found levels 4; give at least two different numbers of modes"),
    (None, "modes", [4, 4], "found levels 4, 4; give at least two different numbers of modes"),
    (None, "modes", [0, 2, 4], "found levels 0, 2, 4; give .* each at least 1"),
    (None, "mesh", [-1, 0], "numbers of refinements, each at least 0"),
    (None, "modes", [10, 100], "bodies.beam: 100 modes were requested, but only .* request at most"),
    (("deflection", "deflexion"), "modes", None, "study.quantity.channel: found .* did you mean 'markers/beam.tip/def"),
    (("deflection", "deflexion"), "mesh", None, "study.quantity.channel: found .* did you mean 'markers/beam.tip/def"),
    ((QUANTITY, HUBS_MODE), "modes", None, "body 'hub', which the study is about, has no modes to vary"),
    ((QUANTITY, HUBS_MODE), "mesh", None, "has no mesh to refine; its bodies are hub"),
    ((QUANTITY, MODE_200), "modes", None, "mode 200 of body 'beam' has no natural frequency"),
    ((QUANTITY, MODE_200), "mesh", None, "mode 200 of body 'beam' has no natural frequency"),
    ((QUANTITY, LOST), "modes", None, "study.quantity.body: found 'bem'"),
    ((QUANTITY, QUANTITY + "\nbody = 'hub'"), "modes", None, "body 'hub', which the study is about, has no modes"),
    (NODAL, "modes", None, r"there is no modes to vary; its bodies are hub \(rigid\), beam \(flexible, nodal\)"),
]


@pytest.mark.parametrize(("replaced", "over", "levels", "told"), REFUSED, ids=range(len(REFUSED)))
def test_a_study_that_cannot_be_is_refused_in_a_sentence(built: Built, replaced, over: str, levels, told: str):
    with pytest.raises((ValueError, CaseError), match=f"(?s){told}"):
        convergence(built(*([replaced] if replaced else [])), over, levels)  # type: ignore[arg-type]


def test_a_tolerance_that_is_none_is_refused(built: Built):
    with pytest.raises(ValueError, match="tolerance is -1; it must be above 0"):
        judged(built(), [1.0, 2.0], tolerance=-1)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"of": "frequency", "channel": "q"}, "frequency of q"),
        ({"of": "frequency", "channel": "q", "tones": 3, "tone": 2}, "frequency 2 of 3 of q"),
        ({"of": "peak", "channel": "attitude/angles", "component": "pitch"}, "peak of attitude/angles pitch"),
        ({"channel": "q"}, "value of q at the end"),
        ({"channel": "q", "at": 2.5}, "value of q at 2.5 s"),
        ({"of": "body_mass", "body": "hub"}, "mass of hub"),
        ({"of": "mode_frequency", "body": "boom", "mode": 2}, "frequency of mode 2 of boom"),
        ({"of": "system_frequency", "mode": 4}, "frequency of mode 4 of the craft"),
    ],
)
def test_quantities_in_words(given, words):
    assert described(MeasureTable(**given)) == words
