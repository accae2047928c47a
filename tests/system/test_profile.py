"""Profiles: derivatives against differences, the compiled evaluation against the plain one, and refusals."""

import numpy as np
import pytest

from femflex.dynamics.arithmetic.compiled import kernel
from femflex.dynamics.arithmetic.lanes import start
from femflex.dynamics.arithmetic.profiles import profile_at
from femflex.dynamics.arithmetic.symbols import types
from femflex.dynamics.lowering.pool import Pool
from femflex.system import Profile

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


@kernel(types.void(types.float64[::1], types.float64[::1], types.float64[:, ::1]))
def evaluated(pool, times, out):
    for j in range(len(times)):
        s, ds, dds = profile_at(times[j], 0, start(pool))
        out[j, 0], out[j, 1], out[j, 2] = s, ds, dds


@pytest.mark.parametrize("name", PROFILES)
def test_rate_and_acceleration_are_derivatives(name):
    profile, h = PROFILES[name], 1e-3
    for t in np.linspace(0.3, 5.7, 41):
        if np.abs(profile.breaks - t).min(initial=1.0) < 2 * h:
            continue  # a difference across a knot
        s, ds, dds = (np.array(v) for v in profile(t + h * np.arange(-2, 3)))
        assert ds[2] == pytest.approx((s[0] - 8 * s[1] + 8 * s[3] - s[4]) / (12 * h), abs=1e-9)
        assert dds[2] == pytest.approx((ds[0] - 8 * ds[1] + 8 * ds[3] - ds[4]) / (12 * h), abs=1e-9)


@pytest.mark.parametrize("name", PROFILES)
def test_compiled_evaluation_is_the_plain_one(name):
    pool, times = Pool(), np.linspace(-0.5, 6.5, 71)
    pool.put(PROFILES[name].numbers)
    out = np.empty((71, 3))
    evaluated(pool.array(), times, out)
    assert out == pytest.approx(np.stack(PROFILES[name](times), axis=1), abs=1e-13, nan_ok=True)


@pytest.mark.parametrize("name", PROFILES)
def test_position_rate_and_acceleration_go_on_over_knots(name):
    profile = PROFILES[name]
    for t in profile.knots[(profile.knots > profile.first) & (profile.knots < profile.last)]:
        before, after = profile(np.nextafter(t, -1)), profile(t)
        assert np.array(before) == pytest.approx(np.array(after), abs=1e-9)


def test_a_spline_goes_through_its_points_and_is_known_between_them_alone():
    for name in ("cubic spline", "quintic at rest"):
        profile = PROFILES[name]
        assert profile(TIMES)[0] == pytest.approx(np.cos(TIMES), abs=1e-12)
        assert np.isnan(profile(-0.1)[0]) and np.isnan(profile(6.1)[2])
    _, ds, dds = PROFILES["quintic at rest"](np.array([0.0, 6.0]))
    assert [*ds, *dds] == pytest.approx([0.0] * 4, abs=1e-11)
    assert PROFILES["spline at rest"](np.array([0.0, 6.0]))[1] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_step_rests_outside_and_passes_its_middle_at_half_way():
    s, ds, _ = PROFILES["smooth step"](np.array([0.0, 1.0, 2.0, 3.0, 9.0]))
    assert s == pytest.approx([-0.2, -0.2, 0.35, 0.9, 0.9])
    assert ds == pytest.approx([0.0, 0.0, 1.1 * 2.1875 / 2, 0.0, 0.0], abs=1e-12)


def test_a_sum_is_the_sum():
    parts = [PROFILES[name] for name in ("smooth step", "sine", "cubic spline", "polynomial")]
    for t in (0.0, 0.5, 1.0, 2.7, 5.9):
        assert np.array(PROFILES["sum"](t)) == pytest.approx(sum(np.array(part(t)) for part in parts), abs=1e-12)
    assert (PROFILES["sum"].first, PROFILES["sum"].last) == (0.0, 6.0)
    assert not PROFILES["constant"].moves and PROFILES["sum"].moves and PROFILES["sine"].moves


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Profile.spline([0, 1, 2], [0, 1, 0]), "a spline of degree 3 needs at least 4 points; found 3"),
        (lambda: Profile.spline(range(5), range(5), 5), "a spline of degree 5 needs at least 6 points; found 5"),
        (lambda: Profile.spline([0, 2, 1, 3], range(4)), "time 1 s of a spline follows 2 s; times must ascend"),
        (lambda: Profile.spline([0, 1, 2, 3], [0, np.nan, 0, 0]), "value 2 of a spline is nan; all must be finite"),
        (lambda: Profile.spline(range(4), range(5)), "as many values as times"),
        (lambda: Profile.spline(range(4), range(4), 4), "degree 3 or 5"),
        (lambda: Profile.smooth_step(2, 1, 0, 1), "from 2 s to 1 s must end after it starts"),
        (lambda: Profile.trapezoid(0, 2, 0, 1, 1.5), "a ramp is longer than zero, and at most half of the time"),
        (lambda: Profile([0, 1], [[0, 1], [0, 1]]), r"s of a profile jumps from 1 to 0 at t = 1 s"),
        (lambda: Profile([0, 1], [[0, 1], [1, 2]]), r"its rate of a profile jumps from 1 to 2 at t = 1 s"),
        (lambda: Profile([1, 0], [[0], [0]]), "knots of a profile must ascend"),
        (lambda: Profile([0, 1, 1], [[0], [0], [0]]), "knots of a profile must ascend"),
        (lambda: Profile([0, 1], [[0]]), "2 knots and 1 pieces"),
        (lambda: Profile.constant(np.inf), "coefficients of a profile hold a number that is not finite"),
    ],
)
def test_what_is_no_motion_is_refused(make, text):
    with pytest.raises(ValueError, match=text):
        make()


def test_a_trapezoid_has_a_constant_rate_between_its_ramps():
    profile = Profile.trapezoid(1.0, 5.0, 2.0, 8.0, 1.0)
    s, rate, acceleration = profile(np.array([0.5, 1.5, 3.0, 4.5, 6.0]))
    assert s == pytest.approx([2.0, 2.25, 5.0, 7.75, 8.0])
    assert rate == pytest.approx([0.0, 1.0, 2.0, 1.0, 0.0])
    assert acceleration == pytest.approx([0.0, 2.0, 0.0, -2.0, 0.0])
    assert list(profile.breaks) == [1.0, 2.0, 4.0, 5.0]
    assert Profile.trapezoid(0.0, 2.0, 0.0, 1.0, 1.0)(1.0)[0] == pytest.approx(0.5)  # no constant part
