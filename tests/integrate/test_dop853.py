"""The explicit method against closed forms, its stated orders, and scipy's implementation of the same formulas."""

import numpy as np
import pytest
from scipy.special import ellipj
from support.integrate_models import chain, duffing, kepler, oscillator, pulse, rigid_body, spun
from support.scipy_integrators import integrator

from femflex.integrate import Dop853
from femflex.integrate.dop853_table import A, B, C


def slope(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), deg=1)[0]


def constant(step):
    """Steps of one size: nothing is an error."""
    return Dop853(rtol=0.0, atol=1e3, max_step=step)


def test_tableau_meets_the_quadrature_conditions_of_order_eight():
    assert A[:12, :12].sum(axis=1) == pytest.approx(C[:12], abs=1e-14)
    for k in range(8):
        assert B @ C[:12] ** k == pytest.approx(1 / (k + 1), abs=1e-14)
    assert abs(B @ C[:12] ** 8 - 1 / 9) > 1e-6  # not of order nine


def test_error_falls_at_order_eight():
    steps = 2 * np.pi / np.array([8, 12, 16, 24])
    ends = np.array([0.0, 2 * np.pi])
    errors = [np.linalg.norm(constant(h).solve(oscillator(), ends, [1.0, 0.0]).states[-1] - [1, 0]) for h in steps]
    assert slope(steps, errors) == pytest.approx(8, abs=0.2)


def test_dense_output_of_one_step_is_off_by_the_eighth_power_of_its_size():
    steps, errors = np.array([0.56, 0.48, 0.4, 0.34]), []
    for h in steps:
        times = np.array([0.0, 0.3, 0.7, 1.0]) * h
        x = constant(h).solve(duffing(0.5), times, [1.0, 0.2])
        tight = Dop853(rtol=1e-14, atol=1e-15, max_step=h / 40).solve(duffing(0.5), times, [1.0, 0.2])
        assert x.steps.accepted == 1
        errors.append(np.abs(x.states[1:3] - tight.states[1:3]).max())
    assert slope(steps, errors) == pytest.approx(8, abs=0.3)


def test_kepler_ellipse_closes_at_any_tolerance():
    e, ends = 0.6, np.array([0.0, 6 * np.pi])
    x0 = np.array([1 - e, 0, 0, np.sqrt((1 + e) / (1 - e))])
    for rtol in (1e-6, 1e-9, 1e-12):
        x = Dop853(rtol=rtol, atol=rtol).solve(kepler(), ends, x0)
        assert x.states[-1] == pytest.approx(x0, abs=3e4 * rtol)  # speed at perigee grows errors by the period's slope


def test_duffing_oscillation_is_a_jacobi_function_at_all_output_times():
    times, cubic, amplitude = np.linspace(0, 20, 333), 0.7, 1.3
    speed = np.sqrt(1 + cubic * amplitude**2)
    _, cn, _, _ = ellipj(speed * times, cubic * amplitude**2 / (2 * speed**2))
    x = Dop853(rtol=1e-11, atol=1e-12).solve(duffing(cubic), times, [amplitude, 0.0])
    assert x.states[:, 0] == pytest.approx(amplitude * cn, abs=1e-9)


def test_agrees_with_scipys_implementation_of_the_same_method():
    times, x0 = np.linspace(0, 30, 61), np.concatenate([np.sin(np.arange(8.0)), np.zeros(8)])
    model = chain(np.linspace(1, 2, 8), np.linspace(3, 1, 9), cubic=0.3, force=0.5, w=1.1)
    ours = integrator("dop853", rtol=1e-12, atol=1e-13).solve(model, times, x0)
    theirs = integrator("scipy_dop853", rtol=1e-12, atol=1e-13).solve(model, times, x0)
    assert ours.states == pytest.approx(theirs.states, abs=1e-10)


def test_unit_quaternions_keep_order_eight():
    model, x0 = rigid_body((2.0, 2.0, 3.2)), np.array([1.0, 0, 0, 0, 0.7, -0.2, 1.1])
    exact = spun(model, x0, 4.0)
    steps = 4.0 / np.array([6, 8, 12, 16])
    runs = [constant(h).solve(model, np.array([0.0, 4.0]), x0).states[-1] for h in steps]
    assert slope(steps, [np.linalg.norm(x - exact) for x in runs]) == pytest.approx(8, abs=0.4)
    assert all(np.linalg.norm(x[:4]) == pytest.approx(1.0, abs=1e-15) for x in runs)


def test_unit_quaternions_in_dense_rows():
    x0 = np.array([1.0, 0, 0, 0, 0.7, -0.2, 1.1])
    x = Dop853(rtol=1e-4, atol=1e-4).solve(rigid_body(), np.linspace(0, 30, 401), x0)
    assert np.linalg.norm(x.states[:, :4], axis=1) == pytest.approx(np.ones(401), abs=1e-15)


def pulse_motion(t, on, off):
    """Speed under the pulse and the brake after it."""
    return np.where(t < off, np.clip(t - on, 0, None), (off - on) * np.exp(-3 * (t - off).clip(0)))


def test_steps_stop_at_breaks_so_that_jumps_cost_no_accuracy():
    times, on, off = np.linspace(0, 2, 21), 0.31, 0.77
    x = Dop853(rtol=1e-10, atol=1e-12).solve(pulse(on, off), times, [0.0, 0.0])
    assert x.states[:, 1] == pytest.approx(pulse_motion(times, on, off), abs=1e-11)
    assert x.steps.rejected == 0
    unaware = Dop853(rtol=1e-10, atol=1e-12).solve(pulse(on, off, known=False), times, [0.0, 0.0])
    assert unaware.steps.rejected > 5


def test_breaks_at_output_times_at_the_ends_and_outside_are_harmless():
    times = np.linspace(0, 2, 21)
    for on, off in ((0.0, 2.0), (0.5, 0.5 + 1e-13), (times[3], times[7]), (-1.0, 5.0)):
        x = Dop853(rtol=1e-10, atol=1e-12).solve(pulse(on, off), times, [0.0, 0.0])
        assert x.states[:-1, 1] == pytest.approx(pulse_motion(times, max(on, 0.0), off)[:-1], abs=1e-11)


def test_a_vector_of_absolute_tolerances_weighs_coordinates():
    # two chains in one: the second, held loosely, must not govern the steps
    model, ends = chain(np.ones(2), np.array([1.0, 0.0, 400.0])), np.array([0.0, 10.0])
    x0 = np.array([1.0, 1.0, 0.0, 0.0])
    tight = Dop853(rtol=0.0, atol=1e-9).solve(model, ends, x0)
    loose = Dop853(rtol=0.0, atol=np.array([1e-9, 1.0, 1e-9, 20.0])).solve(model, ends, x0)
    assert loose.steps.evaluations < tight.steps.evaluations / 3
    assert loose.states[-1, 0] == pytest.approx(np.cos(10.0), abs=1e-7)


def test_statistics_count_the_rates():
    x = Dop853(rtol=1e-8, atol=1e-8).solve(oscillator(), np.array([0.0, 50.0]), [1.0, 0.0])
    # 12 a step, 11 a rejected one, 2 to begin
    assert x.steps.evaluations == 12 * x.steps.accepted + 11 * x.steps.rejected + 2
    assert x.steps.smallest <= 50 / x.steps.accepted <= x.steps.largest


@pytest.mark.parametrize("settings", [{"rtol": -1e-3}, {"atol": 0.0}, {"atol": np.array([1e-6, -1.0])}])
def test_tolerances_that_mean_nothing_are_refused(settings):
    with pytest.raises(ValueError, match="must not be negative"):
        Dop853(**settings)


def test_a_step_limit_that_is_not_positive_is_refused():
    with pytest.raises(ValueError, match="max_step = 0"):
        Dop853(max_step=0)
