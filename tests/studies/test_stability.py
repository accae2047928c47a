"""Charts and loci of stability: Lagrange, DeBra and Delp, a spinner with booms, Meissner's equation."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from support.rigid_stability import rigid_kind
from support.small_cases import HUB_AND_BAR
from typer.testing import CliRunner

from femflex.body import Marker, rigid_body
from femflex.case import read_case
from femflex.case.read import parse_case
from femflex.cli.app import app
from femflex.dynamics import compile_system
from femflex.rotations import dcm_from_quaternion
from femflex.studies.floquet import floquet
from femflex.studies.stability import Chart, Locus, case_stability, equilibrium_stability, stability_chart
from femflex.studies.stability.inertia_ratios import affine_judge, craft_inertia, moments_from_ratios, with_ratios
from femflex.studies.stability.judgement import NONE, STATIC, UNSTABLE, Judgement
from femflex.system import Frame, Load, Orbit, System, revolute, spherical, weld

CASES = Path(__file__).parents[2] / "cases"
ORBITER = (
    HUB_AND_BAR
    + """vary.k_roll = { between = [-0.33, 0.79], points = 9 }
vary.k_yaw = { between = [-0.9, 0.7], points = 9 }
"""
)


@pytest.mark.slow
def test_regions_of_lagrange_and_of_debra_and_delp():
    chart = case_stability(parse_case(ORBITER)).result
    assert isinstance(chart, Chart)
    expected = np.array([[rigid_kind(a, b) for b in chart.second_values] for a in chart.first_values])
    assert np.array_equal(chart.kinds, expected) and {0, 1, 2} == set(np.unique(expected))
    for _, _, points in chart.boundaries:
        for k_roll, k_yaw in points:
            product = k_roll * k_yaw
            curves = [k_roll - k_yaw, k_roll, k_yaw]
            if product > 0:
                curves.append((1 + 3 * k_roll + product - 4 * np.sqrt(product)) / 10)  # its slope there is up to 10
            assert np.abs(curves).min() < max(chart.error)


def critical_speed(m: float, EI: float, L: float, h: float, difference: float) -> float:
    """Speed [rad/s] at which booms along the axis of a spinner bend it over (see cases/spinner.toml)."""
    x, weight = np.polynomial.legendre.leggauss(40)
    x, weight = (x + 1) * L / 2, weight * L / 2

    def remaining_stiffness(speed: float) -> float:
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

    return float(brentq(remaining_stiffness, 0.05, 2.3))


@pytest.mark.slow
def test_spinner_with_axial_booms_has_its_critical_speed():
    case = read_case(CASES / "spinner.toml")
    assert case.stability is not None
    axis = case.stability.vary["attitude.spin.2"].model_copy(
        update={"between": ["0.69 rad/s", "0.73 rad/s"], "points": 2}
    )
    table = case.stability.model_copy(update={"vary": {"attitude.spin.2": axis}, "without": []})
    locus = case_stability(case.model_copy(update={"stability": table})).result
    assert isinstance(locus, Locus) and locus.kinds.tolist() == [STATIC, UNSTABLE] and locus.unit == "rad/s"
    assert locus.critical[0] == pytest.approx(critical_speed(0.5, 158.0, 5.0, 0.5, 150.0 - 90.0), rel=2e-4)


def square_wave(stiff: float, slack: float, period: float, turns: int = 1) -> System:
    """A bar on a pin, pulled along x by a force that jumps between two values: Meissner's equation for small angles."""
    bar = rigid_body(1.0, np.eye(3), markers={"tip": Marker.at_position([1.0, 0.0, 0.0])})
    times = np.concatenate([[k, k + 0.5, k + 0.5, k + 1.0] for k in range(turns)]) * period
    pull = np.outer(np.tile([stiff, stiff, slack, slack], turns), [1.0, 0.0, 0.0])
    return System(
        {"bar": bar}, (revolute("bar", name="pin"),), loads=(Load("pull", "bar", "tip", "inertial", pull, times=times),)
    )


@pytest.mark.parametrize(("stiff", "slack"), [(4.0, 1.0), (9.0, 0.5), (2.5, 2.0)])
def test_square_wave_of_stiffness_matches_meissner(stiff, slack):
    """2 cos a cos b - (a / b + b / a) sin a sin b, a and b the angles of the two halves."""
    period = 2.0
    a, b = np.sqrt([stiff, slack]) * period / 2
    trace = 2 * np.cos(a) * np.cos(b) - (a / b + b / a) * np.sin(a) * np.sin(b)
    result = floquet(square_wave(stiff, slack, period), period)
    assert np.trace(result.monodromy) == pytest.approx(trace, abs=1e-6)
    assert result.stable == (abs(trace) < 2)


def test_boundary_of_a_disc_is_traced():
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


def test_verb_writes_loci_and_charts(tmp_path):
    path = tmp_path / "hinge.toml"
    path.write_text(HINGE)
    done = call(
        path, "--vary", "joints.0.stiffness=-1:8:4", "-o", str(tmp_path / "l.png"), "-o", str(tmp_path / "l.csv")
    )
    assert done.exit_code == 0, done.stderr
    assert (tmp_path / "l.png").stat().st_size > 20_000
    rows = (tmp_path / "l.csv").read_text().splitlines()
    assert rows[0].startswith("joints.0.stiffness,kind,growth,real_1") and len(rows) == 5
    words = ["--vary", "joints.0.stiffness=1:8:3", "--vary", "joints.0.damping=0:2:3"]
    done = call(path, *words, "-o", str(tmp_path / "c.png"))
    assert done.exit_code == 0 and (tmp_path / "c.png").stat().st_size > 10_000
    data = json.loads(call(path, *words, "--json").stdout)
    assert len(data["points"]) == 9 and len(data["region"]) > 2 and "second" not in data


@pytest.mark.slow
def test_soft_damped_booms_remove_the_region_of_debra_and_delp():
    case = read_case(CASES / "gravity_gradient.toml")
    assert case.stability is not None
    vary = {key: axis.model_copy(update={"points": 10}) for key, axis in case.stability.vary.items()}
    case_result = case_stability(
        case.model_copy(update={"stability": case.stability.model_copy(update={"vary": vary})})
    )
    assert isinstance(case_result.result, Chart) and isinstance(case_result.second, Chart)
    steps = [(a, b) for a in (-0.01, 0.0, 0.01) for b in (-0.01, 0.0, 0.01)]
    nearby_kinds = np.array(
        [
            [[rigid_kind(x + a, y + b) for a, b in steps] for y in case_result.second.second_values]
            for x in case_result.second.first_values
        ]
    )
    rigid, clear = (
        nearby_kinds[:, :, 4],
        np.ptp(nearby_kinds, axis=2) == 0,
    )  # of points off the boundaries: some lie exactly on them
    is_known = (case_result.second.kinds != NONE) & clear
    assert is_known.sum() > 60 and np.array_equal(case_result.second.kinds[is_known], rigid[is_known])
    assert not (case_result.result.kinds == 1).any() and (case_result.result.kinds == 2).any()
    assert ((case_result.result.kinds == 2) <= (rigid == 2))[clear].all()  # flexibility makes nothing stable


def craft(spring: float = 0.0) -> System:
    """A hub off its own origin with a bar welded on askew, and where wanted a rotor on a spring."""
    turned = Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix()
    seat = Marker.at_position([0.7, -0.2, 0.4])
    seat = Marker(seat.position, np.zeros((3, 0)), np.zeros((3, 0)), turned)
    hub = rigid_body(200.0, np.array([[50.0, 1, 2], [1, 40, 0.5], [2, 0.5, 45]]), [0.1, 0.05, -0.08], {"seat": seat})
    bar = rigid_body(7.0, np.array([[3.0, 0.2, 0.1], [0.2, 1.0, 0.3], [0.1, 0.3, 3.2]]), [0.3, 0.6, -0.2])
    bodies, joints = {"hub": hub, "bar": bar}, [spherical("hub"), weld("bar", "hub", parent_marker="seat")]
    if spring:
        bodies["rotor"] = rigid_body(2.0, np.diag([0.6, 0.5, 0.7]))
        joints.append(revolute("rotor", "hub", axis=[1, 2, 3], stiffness=[spring], damping=[spring / 50], name="axle"))
    return System(bodies, tuple(joints), orbit=Orbit(6.98e6), frame=Frame("orbital"))


def points_of(moments) -> tuple[np.ndarray, np.ndarray]:
    """Points of mass (masses, places) of a body's mass, centre and inertia: six on its principal axes."""
    m, c = moments.mass, moments.center_of_mass()
    J = moments.inertia() - m * (c @ c * np.eye(3) - np.outer(c, c))
    values, axes = np.linalg.eigh(np.trace(J) / 2 * np.eye(3) - J)
    positions = [c + s * np.sqrt(3 * max(v, 0) / m) * a for v, a in zip(values, axes.T, strict=True) for s in (1, -1)]
    return np.full(6, m / 6), np.array(positions)


def test_inertia_of_a_craft_is_a_sum_over_points():
    system = craft(4.0)
    inertia, turned = craft_inertia(system)
    model = compile_system(system)
    channels = model.observe(np.zeros(1), model.x0[None])
    C_NO = dcm_from_quaternion(channels["orbit/attitude"][0])
    masses, positions = [], []
    for name, body in system.bodies.items():
        C = C_NO.T @ dcm_from_quaternion(channels[f"bodies/{name}/attitude"][0])
        m, r = points_of(body.moments)
        masses.append(m)
        positions.append(C_NO.T @ channels[f"bodies/{name}/position"][0] + r @ C.T)
        assert turned[name] == pytest.approx(C, abs=1e-12)
    m, r = np.concatenate(masses), np.concatenate(positions)
    r = r - m @ r / m.sum()
    expected = np.einsum("p,p,ab->ab", m, (r**2).sum(axis=1), np.eye(3)) - np.einsum("p,pa,pb->ab", m, r, r)
    assert inertia == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("k_roll", "k_yaw"), [(0.4, 0.2), (-0.3, -0.5), (0.1, 0.45)])
def test_craft_with_given_inertia_ratios(k_roll: float, k_yaw: float):
    system = craft()
    pitch = craft_inertia(system)[0][0, 0]
    inertia = craft_inertia(with_ratios(system, "hub", k_roll, k_yaw))[0]
    assert inertia == pytest.approx(np.diag(np.diag(inertia)), abs=1e-8 * pitch)
    assert inertia[0, 0] == pytest.approx(pitch)
    I2, I3, I1 = np.diag(inertia)  # pitch, yaw, roll
    assert ((I2 - I3) / I1, (I2 - I1) / I3) == pytest.approx((k_roll, k_yaw))
    assert moments_from_ratios(k_roll, k_yaw, pitch) == pytest.approx((I1, I2, I3))
    body = with_ratios(system, "hub", k_roll, k_yaw).bodies["hub"].moments
    assert body.mass == 200.0 and body.first == pytest.approx(system.bodies["hub"].moments.first)


@pytest.mark.parametrize("spring", [0.0, 1e-4])
def test_affine_chart_agrees_with_single_linearisations(spring: float):
    system = craft(spring)
    chart = affine_judge(system, "hub")
    assert chart is not None and system.orbit is not None
    rate = 2 * np.pi / system.orbit.period
    kinds = set()
    for k_roll, k_yaw in ((0.4, 0.2), (0.2, 0.4), (-0.3, 0.3), (-0.1, -0.5), (-0.5, -0.1), (-0.55, -0.7)):
        fast, slow = chart(k_roll, k_yaw), equilibrium_stability(with_ratios(system, "hub", k_roll, k_yaw))
        assert fast.kind == slow.kind, (k_roll, k_yaw)
        assert fast.growth == pytest.approx(slow.growth, abs=1e-8) and len(fast.values) == len(slow.values)
        for value in slow.values:
            assert np.abs(fast.values - value).min() < 1e-5 * rate + 1e-6 * abs(value)
        if not spring:
            assert fast.kind == rigid_kind(k_roll, k_yaw), (k_roll, k_yaw)
        kinds.add(fast.kind)
    assert kinds >= {STATIC, UNSTABLE}
