"""Prescribed profiles, Kepler orbits, and systems started at a given state."""

from __future__ import annotations

import numpy as np
import pytest
from support.random_systems import random_tree

from femflex.body import Marker, rigid_body
from femflex.system import Orbit, Profile, Segments, System, assembled, free, revolute, started, weld
from femflex.system.orbit import EARTH_RADIUS
from femflex.system.record import read_record, record

TIMES = np.array([0.0, 0.7, 1.1, 2.0, 3.5, 4.0, 6.0])
PROFILES = {
    "constant": Profile.constant(0.7),
    "polynomial": Profile.polynomial(0.3, -1.0, 0.5, 0.2),
    "sine": Profile.sine(0.4, 3.0, 0.5, mean=1.0),
    "smooth step": Profile.smooth_step(1.0, 3.0, -0.2, 0.9),
    "cubic spline": Profile.spline(TIMES, np.cos(TIMES)),
    "spline at rest": Profile.spline(TIMES, np.cos(TIMES), ends="rest"),
    "quintic spline": Profile.spline(TIMES, np.cos(TIMES), 5),
    "quintic at rest": Profile.spline(TIMES, np.cos(TIMES), 5, "rest"),
}
PROFILES["sum"] = PROFILES["smooth step"] + PROFILES["sine"] + PROFILES["cubic spline"] + PROFILES["polynomial"]


@pytest.mark.parametrize("name", PROFILES)
def test_profile_rates_are_derivatives(name):
    profile, h = PROFILES[name], 1e-3
    for t in np.linspace(0.3, 5.7, 41):
        if np.abs(profile.breaks - t).min(initial=1.0) < 2 * h:
            continue  # a difference across a knot
        s, ds, dds = (np.array(v) for v in profile(t + h * np.arange(-2, 3)))
        assert ds[2] == pytest.approx((s[0] - 8 * s[1] + 8 * s[3] - s[4]) / (12 * h), abs=1e-9)
        assert dds[2] == pytest.approx((ds[0] - 8 * ds[1] + 8 * ds[3] - ds[4]) / (12 * h), abs=1e-9)


@pytest.mark.parametrize("name", PROFILES)
def test_profiles_are_continuous_over_knots(name):
    profile = PROFILES[name]
    for t in profile.knots[(profile.knots > profile.first) & (profile.knots < profile.last)]:
        before, after = profile(np.nextafter(t, -1)), profile(t)
        assert np.array(before) == pytest.approx(np.array(after), abs=1e-9)


def test_spline_interpolates_its_points():
    for name in ("cubic spline", "quintic at rest"):
        profile = PROFILES[name]
        assert profile(TIMES)[0] == pytest.approx(np.cos(TIMES), abs=1e-12)
        assert np.isnan(profile(-0.1)[0]) and np.isnan(profile(6.1)[2])
    _, ds, dds = PROFILES["quintic at rest"](np.array([0.0, 6.0]))
    assert [*ds, *dds] == pytest.approx([0.0] * 4, abs=1e-11)
    assert PROFILES["spline at rest"](np.array([0.0, 6.0]))[1] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_smooth_step_rests_outside():
    s, ds, _ = PROFILES["smooth step"](np.array([0.0, 1.0, 2.0, 3.0, 9.0]))
    assert s == pytest.approx([-0.2, -0.2, 0.35, 0.9, 0.9])
    assert ds == pytest.approx([0.0, 0.0, 1.1 * 2.1875 / 2, 0.0, 0.0], abs=1e-12)


def test_sum_of_profiles():
    parts = [PROFILES[name] for name in ("smooth step", "sine", "cubic spline", "polynomial")]
    for t in (0.0, 0.5, 1.0, 2.7, 5.9):
        assert np.array(PROFILES["sum"](t)) == pytest.approx(sum(np.array(part(t)) for part in parts), abs=1e-12)
    assert (PROFILES["sum"].first, PROFILES["sum"].last) == (0.0, 6.0)
    assert not PROFILES["constant"].moves and PROFILES["sum"].moves and PROFILES["sine"].moves


def test_trapezoid_has_a_constant_rate():
    profile = Profile.trapezoid(1.0, 5.0, 2.0, 8.0, 1.0)
    s, rate, acceleration = profile(np.array([0.5, 1.5, 3.0, 4.5, 6.0]))
    assert s == pytest.approx([2.0, 2.25, 5.0, 7.75, 8.0])
    assert rate == pytest.approx([0.0, 1.0, 2.0, 1.0, 0.0])
    assert acceleration == pytest.approx([0.0, 2.0, 0.0, -2.0, 0.0])
    assert list(profile.breaks) == [1.0, 2.0, 4.0, 5.0]
    assert Profile.trapezoid(0.0, 2.0, 0.0, 1.0, 1.0)(1.0)[0] == pytest.approx(0.5)  # no constant part


@pytest.mark.parametrize("eccentricity", [0.0, 0.1, 0.7])
def test_perigee_altitude(eccentricity):
    """a (1 - e) = R + h, and n^2 a^3 = mu."""
    orbit = Orbit(perigee_altitude=400e3, eccentricity=eccentricity)
    assert orbit.semi_major_axis * (1 - eccentricity) == pytest.approx(EARTH_RADIUS + 400e3)
    assert orbit.mean_motion**2 * orbit.semi_major_axis**3 == pytest.approx(orbit.mu)
    assert orbit.period * orbit.mean_motion == pytest.approx(2 * np.pi)


def test_directions_of_orbital_elements():
    """The normal leans by i from Z, away from the node by a right angle; the perigee lies omega past the node."""
    node, inclination, perigee = np.deg2rad([40.0, 63.4, 110.0])
    C = Orbit(8e6, 0.1, inclination, node, perigee).C_NP()
    line = np.array([np.cos(node), np.sin(node), 0.0])
    normal = np.array([np.sin(inclination) * np.sin(node), -np.sin(inclination) * np.cos(node), np.cos(inclination)])
    np.testing.assert_allclose(C[:, 2], normal, atol=1e-15)
    np.testing.assert_allclose(C[:, 0], np.cos(perigee) * line + np.sin(perigee) * np.cross(normal, line), atol=1e-15)
    assert np.linalg.det(C) == pytest.approx(1.0)


def segment(k: int, *markers: str):
    named = {name: Marker.at_position(np.array([k + 0.1 * j, 0.0, 1.0])) for j, name in enumerate(markers)}
    ends = {
        ".near": Marker.at_position(np.array([1.0 * k, 0, 0])),
        ".far": Marker.at_position(np.array([k + 1.0, 0, 0])),
    }
    return rigid_body(1.0 + k, [1.0, 1.0, 1.0], markers=named | ends)


BOOM = Segments((segment(0, "root"), segment(1, "lug"), segment(2, "mid"), segment(3, "tip")))
HUB = rigid_body(9.0, [1.0, 1.0, 1.0], markers={"m": Marker.at_position(np.zeros(3))})


def craft(**more) -> System:
    joints = (
        free("hub"),
        weld("boom", "hub", child_marker="mid", parent_marker="m"),
        revolute("flap", "boom", parent_marker="tip", name="hinge"),
    )
    return assembled({"hub": HUB, "boom": BOOM, "flap": HUB}, joints, **more)


def test_segments_are_welded_outwards_from_the_clamped_one():
    system = craft()
    assert system.segments == {"boom": ("boom.1", "boom.2", "boom.3", "boom.4")}
    found = {j.child: (j.parent, j.parent_marker, j.child_marker, j.label) for j in system.joints}
    assert found["boom.3"] == ("hub", "m", "mid", "hub-boom")
    assert found["boom.4"][:3] == ("boom.3", ".far", ".near")
    assert found["boom.2"][:3] == ("boom.3", ".near", ".far") and found["boom.1"][:3] == ("boom.2", ".near", ".far")
    assert found["flap"] == ("boom.4", "tip", "origin", "hinge")
    assert [system.bodies[f"boom.{k + 1}"].moments.mass for k in range(4)] == [1.0, 2.0, 3.0, 4.0]
    whole = assembled({"hub": HUB, "boom": BOOM}, (free("hub"), weld("boom", "hub", name="w")))
    assert whole.joint_of("boom.1").label == "w" and whole.joint_of("boom.4").parent == "boom.3"


@pytest.mark.parametrize("seed", range(4))
def test_system_started_at_a_state_begins_there(seed):
    system, _, (q, u) = random_tree(seed, n_bodies=6)
    names = [name for name, _ in system.coordinate_names()]
    x = np.concatenate([q, u])
    found = started(system, x)
    np.testing.assert_allclose(found.initial_state(), x)
    for name in system.order:
        own = [k for k, other in enumerate(names) if other.startswith(f"{name}.delta")]
        np.testing.assert_allclose(found.delta0[name], q[own])


def plain_hub(**markers):
    return rigid_body(1.0, np.eye(3), markers={name: Marker.at_position(np.zeros(3)) for name in markers})


def test_parents_come_before_children():
    bodies = {name: plain_hub() for name in ("c", "b", "a")}
    system = System(bodies, (weld("c", "b"), revolute("b", "a"), free("a")))
    assert system.order == ["a", "b", "c"]
    assert system.root == "a"
    names = [name for name, _ in system.coordinate_names()]
    assert names[:3] == ["base-a.slide1", "base-a.slide2", "base-a.slide3"] and names[-1] == "a-b.angle"


def test_record_is_the_motion_of_its_acceleration():
    """Straight between samples, the acceleration of t^3/6 + t^2/2; the error of a sine is of second order."""
    t = np.array([1.0, 1.3, 1.9, 2.0, 4.0])
    profile = record(t, t - 1.0 + 1.0, "none", 2.0)
    tau = np.linspace(0.0, 2.9, 30)
    s, rate, acceleration = profile(1.0 + tau)
    assert s == pytest.approx(2.0 * (tau**3 / 6 + tau**2 / 2), rel=1e-12)
    assert [rate[-1], acceleration[-1]] == pytest.approx([2.0 * (2.9**2 / 2 + 2.9), 2.0 * 3.9], rel=1e-12)
    errors = []
    for n in (200, 400):
        t = np.linspace(0.0, 5.0, n)
        errors.append(np.abs(record(t, np.sin(7 * t), "none")(t[:-1])[0] - (t / 7 - np.sin(7 * t) / 49)[:-1]).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_baselines_of_a_record():
    """A drift that is a constant and a slope vanishes; a parabola of the acceleration makes the rate orthogonal."""
    t = np.linspace(0.0, 8.0, 401)
    pulse = (t * (8.0 - t)) ** 3  # a motion from rest to rest
    acceleration = np.polynomial.Polynomial.fromroots([0, 0, 0, 8, 8, 8]).deriv(2)(t) * -1.0
    drifting = acceleration + 3.0 - 0.7 * t
    s, rate, _ = record(t, drifting, "rest")(np.array([3.0, 8.0, 50.0]))
    assert s == pytest.approx([pulse[150], 0.0, 0.0], abs=2e-4 * pulse.max())
    assert rate[1:] == pytest.approx([0.0, 0.0], abs=1e-9 * np.abs(drifting).max())
    least = record(t, drifting, "least")
    rate = least(t)[1]
    for power in (1, 2, 3):
        assert rate @ t**power == pytest.approx(0.0, abs=1e-9 * np.linalg.norm(rate) * np.linalg.norm(t**power))
    assert np.isnan(least(8.1)[0]) and np.isnan(least(-0.1)[0])


def test_record_of_peer_is_read(tmp_path):
    path = tmp_path / "quake.AT2"
    path.write_text("PEER\nQuake, station\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS=   4, DT=   .0050 SEC\n"
                    "  .1E-01 -.2E-01\n .3E-01 0.0\n")  # fmt: skip
    times, values = read_record(path, None, "m/s^2")
    assert times == pytest.approx([0.0, 0.005, 0.01, 0.015])
    assert values == pytest.approx([0.0980665, -0.196133, 0.2941995, 0.0])
