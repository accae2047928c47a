"""Inertia ratios, charts and loci of stability: skew bodies, grids that are not square, judgements by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.rigid_stability import rigid_kind

from femflex.body import Marker, rigid_body
from femflex.case.read import parse_case
from femflex.dynamics import compile_system
from femflex.rotations import dcm_from_quaternion
from femflex.studies.stability import (
    Judgement,
    case_stability,
    judged_motion,
    judged_rest,
    stability_chart,
    stability_locus,
)
from femflex.studies.stability.affine import AffineChart
from femflex.studies.stability.gravity_gradient import (
    craft_inertia,
    delp_boundary,
    known_curves,
    moments,
    with_inertia,
    with_ratios,
)
from femflex.studies.stability.judgement import GYROSCOPIC, NONE, STATIC, UNSTABLE, definite, none
from femflex.system import Frame, Load, Orbit, System, free, revolute, spherical, weld


def craft(spring: float = 0.0) -> System:
    """A hub off its own origin with a bar welded on askew, and where wanted a rotor on a spring."""
    turned = Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix()
    at = Marker.rigid([0.7, -0.2, 0.4])
    at = Marker(at.position, np.zeros((3, 0)), np.zeros((3, 0)), turned)
    hub = rigid_body(200.0, np.array([[50.0, 1, 2], [1, 40, 0.5], [2, 0.5, 45]]), [0.1, 0.05, -0.08], {"seat": at})
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
    places = [c + s * np.sqrt(3 * max(v, 0) / m) * a for v, a in zip(values, axes.T, strict=True) for s in (1, -1)]
    return np.full(6, m / 6), np.array(places)


def test_the_inertia_of_a_craft_is_that_of_all_its_points_about_their_centre():
    system = craft(4.0)
    inertia, turned = craft_inertia(system)
    model = compile_system(system)
    seen = model.observe(np.zeros(1), model.x0[None])
    C_NO = dcm_from_quaternion(seen["orbit/attitude"][0])
    masses, places = [], []
    for name, body in system.bodies.items():
        C = C_NO.T @ dcm_from_quaternion(seen[f"bodies/{name}/attitude"][0])
        m, r = points_of(body.moments)
        masses.append(m)
        places.append(C_NO.T @ seen[f"bodies/{name}/position"][0] + r @ C.T)
        assert turned[name] == pytest.approx(C, abs=1e-12)
    m, r = np.concatenate(masses), np.concatenate(places)
    r = r - m @ r / m.sum()
    wanted = np.einsum("p,p,ab->ab", m, (r**2).sum(axis=1), np.eye(3)) - np.einsum("p,pa,pb->ab", m, r, r)
    assert inertia == pytest.approx(wanted, rel=1e-9, abs=1e-9)
    with pytest.raises(
        ValueError, match="inertia ratios are those of a craft in the orbital frame of a circular orbit"
    ):
        craft_inertia(replace(system, frame=Frame("inertial")))


@pytest.mark.parametrize(("k_roll", "k_yaw"), [(0.4, 0.2), (-0.3, -0.5), (0.1, 0.45)])
def test_a_craft_gets_the_ratios_wanted_and_keeps_its_pitch(k_roll: float, k_yaw: float):
    system = craft()
    pitch = craft_inertia(system)[0][0, 0]
    found = craft_inertia(with_ratios(system, "hub", k_roll, k_yaw))[0]
    assert found == pytest.approx(np.diag(np.diag(found)), abs=1e-8 * pitch)
    assert found[0, 0] == pytest.approx(pitch)
    I2, I3, I1 = np.diag(found)  # pitch, yaw, roll
    assert ((I2 - I3) / I1, (I2 - I1) / I3) == pytest.approx((k_roll, k_yaw))
    assert moments(k_roll, k_yaw, pitch) == pytest.approx((I1, I2, I3))
    body = with_ratios(system, "hub", k_roll, k_yaw).bodies["hub"].moments
    assert body.mass == 200.0 and body.first == pytest.approx(system.bodies["hub"].moments.first)


def test_a_body_that_cannot_have_them_is_named():
    with pytest.raises(ValueError, match=r"k_roll = 0\.4 and k_yaw = 0\.2 cannot be had by 'bar': "):
        with_ratios(craft(), "bar", 0.4, 0.2)
    with pytest.raises(ValueError, match="the craft has no rigid body 'tub'; its rigid bodies are hub, bar"):
        with_ratios(craft(), "tub", 0.4, 0.2)
    J = np.array([[9.0, 1, 2], [1, 8, 0.5], [2, 0.5, 7]])
    assert with_inertia(craft(), "hub", J).bodies["hub"].moments.inertia() == pytest.approx(J)


def test_a_torque_tilts_each_craft_otherwise_so_that_no_three_linearisations_serve_for_all():
    pushed = replace(craft(), loads=(Load("push", "hub", "origin", torque=np.array([0.0, 1e-6, 0.0])),))
    assert AffineChart.of(pushed, "hub") is None


@pytest.mark.parametrize("spring", [0.0, 1e-4])
def test_three_linearisations_judge_as_each_craft_by_itself(spring: float):
    system = craft(spring)
    chart = AffineChart.of(system, "hub")
    assert chart is not None
    seen = set()
    for k_roll, k_yaw in ((0.4, 0.2), (0.2, 0.4), (-0.3, 0.3), (-0.1, -0.5), (-0.5, -0.1), (-0.55, -0.7)):
        fast, slow = chart(k_roll, k_yaw), judged_rest(with_ratios(system, "hub", k_roll, k_yaw))
        assert fast.kind == slow.kind, (k_roll, k_yaw)
        assert fast.growth == pytest.approx(slow.growth, abs=1e-8) and len(fast.values) == len(slow.values)
        for value in slow.values:
            assert np.abs(fast.values - value).min() < 1e-5 * chart.rate + 1e-6 * abs(value)
        if not spring:
            assert fast.kind == rigid_kind(k_roll, k_yaw), (k_roll, k_yaw)
        seen.add(fast.kind)
    assert seen >= {STATIC, UNSTABLE}
    outside = chart(1.2, 0.0)
    assert outside.kind == NONE and outside.problem.startswith("no body has k_roll = 1.2 and k_yaw = 0;")


def test_the_regions_of_a_rigid_craft_are_those_of_its_conditions():
    assert [
        rigid_kind(*k) for k in ((0.5, 0.3), (0.3, 0.5), (-0.05, -0.1), (-0.9, -0.95), (0.5, -0.3), (-0.1, -0.2))
    ] == [
        STATIC,
        UNSTABLE,
        GYROSCOPIC,
        UNSTABLE,
        UNSTABLE,
        GYROSCOPIC,
    ]
    k_roll, k_yaw = delp_boundary(50).T
    assert 1 + 3 * k_roll + k_roll * k_yaw == pytest.approx(4 * np.sqrt(k_roll * k_yaw), abs=1e-12)
    assert (k_roll <= 0).all() and k_yaw[0] == 0 and k_yaw[-1] == -1 and len(k_roll) == 50
    curves, turned = known_curves(("k_roll", "k_yaw")), known_curves(("k_yaw", "k_roll"))
    assert len(curves) == 4 and all(np.array_equal(a[1], b[1][:, ::-1]) for a, b in zip(curves, turned, strict=True))
    for name, curve in curves:
        assert name == "regions of Lagrange, and of DeBra and Delp, for a rigid craft"
        for at in np.linspace(curve[0], curve[-1], 5)[1:-1] if len(curve) == 2 else curve[5:-5:20]:
            around = {rigid_kind(*(at + 1e-4 * np.array([np.cos(w), np.sin(w)]))) for w in np.arange(0.3, 6.5, 0.7)}
            assert len(around) > 1, at  # kinds differ about a boundary


def test_a_stiffness_is_definite_but_for_rounding_in_sizes():
    sizes, M = np.array([1.0, 1e-3]), np.diag([2.0, 4e6])
    for least, wanted in ((1e-6, True), (-1e-12, True), (-1e-6, False)):
        K = np.array([[3.0, 0.1 + least], [0.1 - least, least * 1e6]]) - np.diag([0.0, 0.0])
        K[0, 1] = K[1, 0] = 0.0
        assert definite(M, K, sizes, 1.0) == wanted
    scale = 4.0 * 4.0  # rate^2 M
    for part, wanted in ((0.5, True), (2.0, False)):
        assert definite(np.diag([4.0, 1.0]), np.diag([1.0, -part * 1e-9 * scale]), np.ones(2), 2.0) == wanted
    skew = np.array([[1.0, 5.0], [-5.0, 1.0]])  # its symmetric part counts
    assert definite(np.eye(2), skew, np.ones(2), 1.0) and definite(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(0), 1.0)


def by_kind(kind: int, growth: float = 0.0) -> Judgement:
    return Judgement(kind, growth, np.zeros(0, complex))


def test_a_chart_of_three_kinds_on_an_uneven_grid_has_its_boundaries_between_them():
    """Kinds by a - 2 b: beyond 0.31 static, beyond -0.53 gyroscopic, else unstable; none where b is above 2."""
    asked = []

    def judge(a: float, b: float) -> Judgement:
        asked.append((a, b))
        if b > 2.0:
            return none("x")
        value = a - 2 * b
        return by_kind(STATIC if value > 0.31 else GYROSCOPIC if value > -0.53 else UNSTABLE, 10 * a + b)

    done = []
    a, b = [0.0, 0.7, 1.0, 1.8, 2.5, 3.1], [0.0, 0.4, 1.1, 1.9, 2.2]
    chart = stability_chart(judge, a, b, ("p", "q"), ("m", "s"), done.append)
    assert done == [float(k) for k in range(1, 31)] and chart.names == ("p", "q") and chart.units == ("m", "s")
    assert asked[:6] == [(0.0, one) for one in b] + [(0.7, 0.0)]
    for i, x in enumerate(a):
        for j, y in enumerate(b[:4]):
            assert chart.growth[i, j] == 10 * x + y and chart.kinds[i, j] == judge(x, y).kind
    assert (chart.kinds[:, 4] == NONE).all() and np.isnan(chart.growth[:, 4]).all()
    assert chart.error == pytest.approx((0.8 / 128, 0.8 / 128))
    sides = {(low, high) for low, high, _ in chart.boundaries}
    assert sides == {(UNSTABLE, GYROSCOPIC), (GYROSCOPIC, STATIC)} and len(chart.boundaries) == 2
    for low, _, points in chart.boundaries:
        level = -0.53 if low == UNSTABLE else 0.31
        assert points[:, 0] - 2 * points[:, 1] == pytest.approx(level, abs=3 * 0.8 / 128)
        order = np.diff(points[:, 0] + points[:, 1])
        assert (order > 0).all() or (order < 0).all()
        other = 0.31 - 0.53 - level  # edges that cross both belong to neither
        crossed = sum(
            (x0 - 2 * y0 > level) != (x1 - 2 * y1 > level) and (x0 - 2 * y0 > other) == (x1 - 2 * y1 > other)
            for i, x0 in enumerate(a)
            for j, y0 in enumerate(b[:4])
            for x1, y1 in ([(a[i + 1], y0)] if i < 5 else []) + ([(x0, b[j + 1])] if j < 3 else [])
        )
        assert len(points) == crossed
    with pytest.raises(ValueError, match=r"the values of q are to rise; found \[0\.0\]"):
        stability_chart(judge, a, [0.0], ("p", "q"))


def test_a_locus_leaves_out_what_cannot_be_judged_and_tells_the_largest_split():
    def judge(value: float) -> Judgement:
        if value in (2.0, 5.0):
            return none("y")
        poles = np.array([value * 1j, -1.0, -value * 1j])
        stable = (value < 3.3) or (value > 4.5)
        return Judgement(
            STATIC if stable else UNSTABLE,
            value,
            np.roll(poles, int(value)),
            "",
            None,
            (f"t{value:g}",),
            0.1 * (6 - value),
        )

    done = []
    found = stability_locus(judge, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "v", "N", "multipliers", done.append)
    assert done == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0] and (found.of, found.name, found.unit) == ("multipliers", "v", "N")
    assert found.critical == (pytest.approx(3.3, abs=1e-8),)  # not across what cannot be judged
    assert np.isnan(found.branches[[1, 4]]).all() and found.kinds.tolist() == [2, -1, 2, 0, -1, 2]
    assert found.trivial == ("t1",) and found.split == pytest.approx(0.5) and found.names == ("", "", "")
    for column in found.branches.T:
        real = column[[0, 2, 3, 5]]
        assert (real == -1.0).all() or (np.sign(real.imag) == np.sign(real.imag[0])).all()


def test_the_stability_of_a_motion_is_that_of_its_largest_multiplier_and_of_a_period():
    spun = System(
        {"hub": rigid_body(20.0, np.diag([85.0, 120.0, 100.0]))},
        (free("hub"),),
        frame=Frame("spinning", np.array([0.0, 0.0, 0.4])),
    )
    period = 2 * np.pi / 0.4
    found = judged_motion(spun, period)
    exact = 0.4 * np.sqrt((120 - 100) * (100 - 85) / (85 * 120))  # about the middle axis
    assert found.kind == UNSTABLE and found.growth == pytest.approx(exact, rel=1e-5) and "phase" not in found.problem
    assert found.trivial and found.size == len(found.values) and not found.stable
    bad = judged_motion(spun, -1.0)
    assert bad.kind == NONE and bad.problem == "the period is -1.0 s; it must be above 0" and np.isnan(bad.growth)


SPINNER = """
title = "spinner"
[run]
duration = "1 s"
[attitude]
frame = "spinning"
spin = [0, 0, "0.5 rad/s"]
[bodies.hub]
kind = "rigid"
mass = 20
inertia = [85, 120, 100]
[stability]
of = "motion"
vary."attitude.spin.2" = { between = ["0.4 rad/s", "0.8 rad/s"], points = 2 }
"""
CHART = """of = "equilibrium"
vary."bodies.hub.inertia.0" = { between = [60, 110], points = 3 }
vary."attitude.spin.2" = { between = ["0.4 rad/s", "0.8 rad/s"], points = 2 }
"""


def test_the_period_of_a_spinner_is_that_of_its_spin():
    """Growth about the middle axis z: w sqrt((B - C)(C - A) / (A B)), A = 85, B = 120, C = 100."""
    found = case_stability(parse_case(SPINNER)).found
    assert (found.of, found.name, found.unit) == ("multipliers", "attitude.spin.2", "rad/s")
    assert found.growth == pytest.approx(np.array([0.4, 0.8]) * np.sqrt(20 * 15 / (85 * 120)), rel=1e-4)


def test_values_go_with_their_keys_and_progress_runs_from_0_to_1():
    """Growth about z: w sqrt((B - C)(C - A) / (A B)), B = 120, C = 100; none where A is above C, too."""
    told = []
    found = case_stability(parse_case(SPINNER[: SPINNER.index("of = ")] + CHART), told.append).found
    assert found.names == ("bodies.hub.inertia.0", "attitude.spin.2") and found.units == ("", "rad/s")
    assert found.first.tolist() == [60.0, 85.0, 110.0] and found.second == pytest.approx([0.4, 0.8])
    for i, A in enumerate(found.first):
        for j, w in enumerate(found.second):
            square = (120 - 100) * (100 - A) / (A * 120)
            assert found.growth[i, j] == pytest.approx(w * np.sqrt(max(square, 0.0)), abs=1e-6)
            assert found.kinds[i, j] == (UNSTABLE if square > 0 else STATIC)
    ((low, high, points),) = found.boundaries
    assert (low, high) == (UNSTABLE, STATIC) and points[:, 0] == pytest.approx(100.0, abs=25 / 128)
    assert told == pytest.approx([k / 6 for k in range(1, 7)])
