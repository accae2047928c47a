"""Charts and loci of stability against closed forms: Lagrange, DeBra and Delp, a spinner with booms, Meissner."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from support.rigid_stability import rigid_kind
from support.small_cases import HUB_AND_BAR
from typer.testing import CliRunner

from femflex.body import Marker, rigid_body
from femflex.case import CaseError, read_case
from femflex.case.read import parse_case
from femflex.cli.app import app
from femflex.cli.stability import one_axis
from femflex.studies.floquet import floquet
from femflex.studies.stability import Chart, Locus, case_stability, judged_rest, stability_chart, stability_locus
from femflex.studies.stability.affine import AffineChart
from femflex.studies.stability.gravity_gradient import delp_boundary, moments, with_ratios
from femflex.studies.stability.judgement import NONE, STATIC, UNSTABLE, Judgement
from femflex.studies.varied import VariedCase
from femflex.system import Frame, Load, System, free, revolute

CASES = Path(__file__).parents[2] / "cases"
ORBITER = (
    HUB_AND_BAR
    + """vary.k_roll = { between = [-0.33, 0.79], points = 9 }
vary.k_yaw = { between = [-0.9, 0.7], points = 9 }
"""
)


@pytest.mark.slow
def test_the_regions_of_lagrange_and_of_debra_and_delp_are_those_of_the_rigid_craft():
    chart = case_stability(parse_case(ORBITER)).found
    assert isinstance(chart, Chart)
    wanted = np.array([[rigid_kind(a, b) for b in chart.second] for a in chart.first])
    assert np.array_equal(chart.kinds, wanted) and {0, 1, 2} == set(np.unique(wanted))
    for _, _, points in chart.boundaries:
        for k_roll, k_yaw in points:
            both = k_roll * k_yaw
            curves = [k_roll - k_yaw, k_roll, k_yaw]
            if both > 0:
                curves.append((1 + 3 * k_roll + both - 4 * np.sqrt(both)) / 10)  # its slope there is up to 10
            assert np.abs(curves).min() < max(chart.error)


def test_moments_have_their_ratios_and_the_curve_of_delp_is_where_the_discriminant_vanishes():
    roll, pitch, yaw = moments(0.4, -0.3, 7.0)
    assert ((pitch - yaw) / roll, (pitch - roll) / yaw, pitch) == pytest.approx((0.4, -0.3, 7.0))
    k_roll, k_yaw = delp_boundary(20).T
    assert 1 + 3 * k_roll + k_roll * k_yaw == pytest.approx(4 * np.sqrt(k_roll * k_yaw), abs=1e-12)
    assert k_roll[0] == pytest.approx(-1 / 3)
    with pytest.raises(ValueError, match=r"no body has k_roll = 1\.2 and k_yaw = 0; both lie between -1 and 1"):
        moments(1.2, 0.0, 1.0)


def critical_speed(m: float, EI: float, L: float, h: float, difference: float) -> float:
    """Speed [rad/s] at which booms along the axis of a spinner bend it over (see cases/spinner.toml)."""
    x, weight = np.polynomial.legendre.leggauss(40)
    x, weight = (x + 1) * L / 2, weight * L / 2

    def left(speed: float) -> float:
        b = (m * speed**2 / EI) ** 0.25
        ends = [
            [1, 0, 1, 0],
            [0, b, 0, b],
            [np.cosh(b * L), np.sinh(b * L), -np.cos(b * L), -np.sin(b * L)],
            [np.sinh(b * L), np.cosh(b * L), np.sin(b * L), -np.cos(b * L)],
        ]
        c = np.linalg.solve(ends, [h, 1, 0, 0])
        v = c @ np.array([np.cosh(b * x), np.sinh(b * x), np.cos(b * x), np.sin(b * x)])
        return difference - 2 * m * weight @ ((h + x) * v)

    return float(brentq(left, 0.05, 2.3))


@pytest.mark.slow
def test_booms_along_the_axis_bend_a_spinner_over_at_the_exact_speed():
    case = read_case(CASES / "spinner.toml")
    assert case.stability is not None
    axis = case.stability.vary["attitude.spin.2"].model_copy(
        update={"between": ["0.69 rad/s", "0.73 rad/s"], "points": 2}
    )
    table = case.stability.model_copy(update={"vary": {"attitude.spin.2": axis}, "without": []})
    locus = case_stability(case.model_copy(update={"stability": table})).found
    assert isinstance(locus, Locus) and locus.kinds.tolist() == [STATIC, UNSTABLE] and locus.unit == "rad/s"
    assert locus.critical[0] == pytest.approx(critical_speed(0.5, 158.0, 5.0, 0.5, 150.0 - 90.0), rel=2e-4)


def test_multipliers_of_a_spin_are_the_exponentials_of_its_poles():
    spun = System(
        {"hub": rigid_body(20.0, np.diag([85.0, 120.0, 150.0]))},
        (free("hub"),),
        frame=Frame("spinning", np.array([0.0, 0.0, 0.4])),
    )
    period = 2 * np.pi / 0.4
    poles = judged_rest(spun).values
    found = floquet(spun, period)
    for pole in poles:
        assert np.abs(found.multipliers - np.exp(pole * period)).min() < 1e-5
    assert judged_rest(spun).kind == STATIC


def square_wave(stiff: float, slack: float, period: float, turns: int = 1) -> System:
    """A bar on a pin, pulled along x by a force that jumps between two values: Meissner's equation for small angles."""
    bar = rigid_body(1.0, np.eye(3), markers={"tip": Marker.rigid([1.0, 0.0, 0.0])})
    times = np.concatenate([[k, k + 0.5, k + 0.5, k + 1.0] for k in range(turns)]) * period
    pull = np.outer(np.tile([stiff, stiff, slack, slack], turns), [1.0, 0.0, 0.0])
    return System(
        {"bar": bar}, (revolute("bar", name="pin"),), loads=(Load("pull", "bar", "tip", "inertial", pull, times=times),)
    )


@pytest.mark.parametrize(("stiff", "slack"), [(4.0, 1.0), (9.0, 0.5), (2.5, 2.0)])
def test_a_square_wave_of_stiffness_has_the_trace_of_meissner(stiff, slack):
    """2 cos a cos b - (a / b + b / a) sin a sin b, a and b the angles of the two halves."""
    period = 2.0
    a, b = np.sqrt([stiff, slack]) * period / 2
    trace = 2 * np.cos(a) * np.cos(b) - (a / b + b / a) * np.sin(a) * np.sin(b)
    found = floquet(square_wave(stiff, slack, period), period)
    assert np.trace(found.monodromy) == pytest.approx(trace, abs=1e-6)
    assert found.stable == (abs(trace) < 2)


def test_branches_go_on_and_changes_of_stability_are_found():
    def judge(value: float) -> Judgement:
        roots = np.roots([1.0, value, 4.0])
        return Judgement(STATIC if value >= 0.3 else UNSTABLE, float(roots.real.max()), roots.astype(complex))

    locus = stability_locus(judge, np.linspace(-1, 3, 9).tolist(), "damping")
    assert locus.critical == pytest.approx([0.3], abs=1e-8)
    assert np.abs(np.diff(locus.branches.imag, axis=0)).max() < 1.0
    with pytest.raises(ValueError, match="nothing can be judged at any value of k; at the first: no luck"):
        stability_locus(lambda _: Judgement(NONE, 0.0, np.zeros(0, complex), "no luck"), [1.0, 2.0], "k")
    with pytest.raises(ValueError, match="the values of first are to rise"):
        stability_chart(lambda a, b: judge(a + b), [1.0, 0.0], [0.0, 1.0])


def test_a_damper_turns_the_drift_of_a_free_wheel_into_a_pole_along_one_branch():
    """J s^2 + d s = 0: at d = 0 a known motion and no pole, beyond it s = -d / J."""

    def judge(damping: float) -> Judgement:
        wheel = rigid_body(1.0, 2.0 * np.eye(3))
        return judged_rest(System({"wheel": wheel}, (revolute("wheel", damping=np.array([damping])),)))

    found = stability_locus(judge, [0.0, 0.5, 1.0], "damping")
    assert np.isnan(found.branches[0, 0]) and found.branches[1:, 0] == pytest.approx([-0.25, -0.5], rel=1e-7)
    with pytest.raises(ValueError, match="the craft has 2 states at value = 1 and 1 before"):
        stability_locus(lambda x: Judgement(STATIC, 0.0, np.zeros(1 + int(x), complex)), [0.0, 1.0])


def test_the_boundary_of_a_disc_is_traced_to_its_error():
    def judge(a: float, b: float) -> Judgement:
        if a > 1.9:
            return Judgement(NONE, float("nan"), np.zeros(0, complex))
        return Judgement(STATIC if a * a + b * b < 1 else UNSTABLE, 0.0, np.zeros(0, complex))

    done: list[float] = []
    grid = np.linspace(-2, 2, 14).tolist()
    chart = stability_chart(judge, grid, grid, progress=done.append)
    assert len(chart.boundaries) == 1 and done[-1] == 14 * 14 and (chart.kinds[-1] == NONE).all()
    points = chart.boundaries[0][2]
    assert np.hypot(*points.T) == pytest.approx(1.0, abs=1.5 * max(chart.error))
    assert np.linalg.norm(points[0] - points[-1]) < 1e-12 or len(points) > 20
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)  # from side to side of a cell
    assert steps.max() <= np.sqrt(2) * (grid[1] - grid[0]) + 1e-12


@pytest.mark.parametrize("slope", [-2.0, -0.7, 0.4, 1.6])
def test_an_open_boundary_is_one_line_from_end_to_end(slope):
    grid = np.linspace(-2, 2, 12).tolist()
    chart = stability_chart(
        lambda a, b: Judgement(STATIC if b > slope * a + 0.13 else UNSTABLE, 0.0, np.zeros(0, complex)), grid, grid
    )
    ((*_, points),) = chart.boundaries
    steps = np.diff(points @ [1.0, slope])
    assert (steps > 0).all() or (steps < 0).all()


HINGE = """
title = "a wheel on a sprung axle"
[run]
duration = "1 s"
[bodies.wheel]
kind = "rigid"
mass = 3
inertia = [2, 2, 2]
[[joints]]
kind = "revolute"
child = "wheel"
name = "axle"
stiffness = 8
damping = 1
"""


def call(path: Path, *words: str):
    return CliRunner().invoke(app, ["stability", str(path), *words])


def test_the_verb_draws_loci_and_charts(tmp_path):
    path = tmp_path / "hinge.toml"
    path.write_text(HINGE)
    done = call(
        path, "--vary", "joints.0.stiffness=-1:8:4", "-o", str(tmp_path / "l.png"), "-o", str(tmp_path / "l.csv")
    )
    assert done.exit_code == 0, done.stderr
    assert "joints.0.stiffness" in done.stdout and (tmp_path / "l.png").stat().st_size > 20_000
    rows = (tmp_path / "l.csv").read_text().splitlines()
    assert rows[0].startswith("joints.0.stiffness,kind,growth,real_1") and len(rows) == 5
    words = ["--vary", "joints.0.stiffness=1:8:3", "--vary", "joints.0.damping=0:2:3"]
    done = call(path, *words, "-o", str(tmp_path / "c.png"))
    assert done.exit_code == 0 and "stable" in done.stdout and (tmp_path / "c.png").stat().st_size > 10_000
    data = json.loads(call(path, *words, "--json").stdout)
    assert np.array(data["found"]["kinds"]).shape == (3, 3) and data["second"] is None
    done = call(path, "--vary", "joints.0.stiffness=2:8:2", "--floquet", "--period", "1 s")
    assert done.exit_code == 0, done.stderr
    assert "stable" in done.stdout


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "stability: the case has none; give one with vary, or --vary KEY=FIRST:LAST:NUMBER"),
        (["--vary", "joints.0.stifness=1:2:3"], "did you mean 'stiffness'?"),
        (["--vary", "joints.0.stiffness=1:2"], "--vary: found 'joints.0.stiffness=1:2'; give KEY=FIRST:LAST:NUMBER"),
        (["--vary", "joints.0.stiffness=2:1:3"], "the second must be above the first"),
        (["--vary", "k_roll=0:1:3"], "found 'k_roll' without inertia; name the body"),
        (["--vary", "joints.0.stiffness=1:2:3", "--floquet"], "found no period, and neither an orbit nor a spinning"),
        (["--vary", "bodies.wheel.mass=-2:-1:3"], "nothing can be judged at any value of bodies.wheel.mass"),
    ],
)
def test_mistakes_are_answered(tmp_path, words, sentence):
    path = tmp_path / "hinge.toml"
    path.write_text(HINGE)
    done = call(path, *words)
    assert done.exit_code == 2 and sentence in " ".join(done.stderr.split()), done.stderr


def test_a_table_with_contradictions_is_refused():
    for old, new, sentence in (
        ('inertia = "hub"', 'inertia = "hub"\nperiod = 3', "found period or shooting with of = 'equilibrium'"),
        ('inertia = "hub"', 'inertia = "tub"', "the craft has no rigid body 'tub'; its rigid bodies are hub, bar"),
        ("vary.k_yaw = { between = [-0.9, 0.7], points = 9 }", "", "it goes with k_roll and k_yaw, both"),
        ("0.79], points = 9", "0.79], points = 9000", "found 9000 points; give at most 2001"),
    ):
        with pytest.raises((CaseError, ValueError), match=sentence):
            case_stability(parse_case(ORBITER.replace(old, new)))


def test_one_linearisation_for_all_ratios_gives_the_judgements_of_each():
    """Three linearisations of the booms' craft against the equilibrium and linearisation of every craft by itself."""
    case = read_case(CASES / "gravity_gradient.toml")
    craft = VariedCase.of(case, []).system({})
    chart = AffineChart.of(craft, "hub")
    assert chart is not None
    for k_roll, k_yaw in ((-0.6, -0.45), (0.5, 0.3), (0.2, 0.6), (-0.2, -0.6)):
        fast, slow = chart(k_roll, k_yaw), judged_rest(with_ratios(craft, "hub", k_roll, k_yaw))
        assert fast.kind == slow.kind and fast.growth == pytest.approx(slow.growth, rel=1e-7, abs=1e-12)
        assert np.abs(fast.values) == pytest.approx(np.abs(slow.values), rel=1e-6)
    assert "cannot be had by 'hub'" in chart(-0.6, 0.45).problem


@pytest.mark.slow
def test_soft_damped_booms_leave_nothing_of_the_region_of_debra_and_delp():
    case = read_case(CASES / "gravity_gradient.toml")
    assert case.stability is not None
    vary = {key: axis.model_copy(update={"points": 10}) for key, axis in case.stability.vary.items()}
    found = case_stability(case.model_copy(update={"stability": case.stability.model_copy(update={"vary": vary})}))
    assert isinstance(found.found, Chart) and isinstance(found.second, Chart)
    steps = [(a, b) for a in (-0.01, 0.0, 0.01) for b in (-0.01, 0.0, 0.01)]
    near = np.array(
        [[[rigid_kind(x + a, y + b) for a, b in steps] for y in found.second.second] for x in found.second.first]
    )
    rigid, clear = near[:, :, 4], np.ptp(near, axis=2) == 0  # of points off the boundaries: some lie exactly on them
    known = (found.second.kinds != NONE) & clear
    assert known.sum() > 60 and np.array_equal(found.second.kinds[known], rigid[known])
    assert not (found.found.kinds == 1).any() and (found.found.kinds == 2).any()
    assert ((found.found.kinds == 2) <= (rigid == 2))[clear].all()  # flexibility makes nothing stable


def test_a_range_takes_the_unit_of_either_end():
    assert one_axis("bodies.beam.EI=1 N m^2:4:3")[1]["between"] == ["1 N m^2", "4 N m^2"]
    assert one_axis("bodies.beam.EI=1:4 N m^2:3")[1]["between"] == ["1 N m^2", "4 N m^2"]
    assert one_axis("joints.0.damping=1:4:3") == ("joints.0.damping", {"between": [1.0, 4.0], "points": 3})
