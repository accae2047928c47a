"""Every method against closed forms: stated orders, dense output, rotations, jumps, and scipy's solvers."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.special import ellipj
from support.integrate_models import (
    Compiled,
    Second,
    chain,
    correcting,
    duffing,
    free_kinematic,
    free_residual,
    free_solve,
    kepler,
    oscillator,
    pulse,
    rigid_body,
    spun,
)
from support.scipy_integrators import integrator

from femflex.integrate import INTEGRATORS, Dop853, Esdirk4
from femflex.integrate.dop853_table import A as DOP_A
from femflex.integrate.dop853_table import B as DOP_B
from femflex.integrate.dop853_table import C as DOP_C
from femflex.integrate.esdirk_kernel import EMBEDDED, STAGES, A, fractions


def steady(method, h):
    """The method at steps of one size: nothing is an error."""
    if isinstance(method, Dop853):
        return Dop853(rtol=0.0, atol=1e3, max_step=h)
    return like(method, step=h, rtol=1e-13, atol=1e-13)


def like(method, **settings):
    """The same method with other settings."""
    return type(method)(**settings)


def slope(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), deg=1)[0]


IMPLICIT = {"esdirk4": Esdirk4()}
METHODS = {"dop853": Dop853(), **IMPLICIT}
with_methods = pytest.mark.parametrize("name", METHODS)
with_implicit = pytest.mark.parametrize("name", IMPLICIT)


def cubic_spring(cubic):
    """x'' + x + cubic x^3 = 0; Newton's matrix knows the linear spring only."""
    return chain(np.ones(1), np.array([1.0, 0.0]), cubic=cubic)


def jacobi(times, cubic, amplitude):
    """The free motion of that spring from rest."""
    speed = np.sqrt(1 + cubic * amplitude**2)
    return amplitude * ellipj(speed * times, cubic * amplitude**2 / (2 * speed**2))[1]


def test_explicit_table_meets_the_quadrature_conditions_of_order_eight():
    assert DOP_A[:12, :12].sum(axis=1) == pytest.approx(DOP_C[:12], abs=1e-14)
    for k in range(8):
        assert DOP_B @ DOP_C[:12] ** k == pytest.approx(1 / (k + 1), abs=1e-14)
    assert abs(DOP_B @ DOP_C[:12] ** 8 - 1 / 9) > 1e-6  # not of order nine


def test_implicit_table_meets_the_eight_conditions_of_order_four():
    a = [fractions(row) for row in STAGES]
    b, embedded, c = a[5], fractions(EMBEDDED), [sum(row) for row in a]

    def inner(v, w):
        return sum(x * y for x, y in zip(v, w, strict=True))

    ac, ac2 = [inner(row, c) for row in a], [inner(row, [x * x for x in c]) for row in a]
    third = [([Fraction(1)] * 6, 1), (c, 2), ([x * x for x in c], 3), (ac, 6)]
    fourth = [([x**3 for x in c], 4), ([x * y for x, y in zip(c, ac, strict=True)], 8), (ac2, 12)]
    fourth.append(([inner(row, ac) for row in a], 24))
    for weights, denominator in third + fourth:
        assert inner(b, weights) == Fraction(1, denominator)
    assert all(inner(embedded, weights) == Fraction(1, denominator) for weights, denominator in third)
    assert any(inner(embedded, weights) != Fraction(1, denominator) for weights, denominator in fourth)


def test_implicit_runge_kutta_method_is_l_stable():
    def growth(z):
        return abs(1 + z * A[5] @ np.linalg.solve(np.eye(6) - z * A, np.ones(6)))

    assert max(growth(1j * y) for y in np.geomspace(1e-2, 1e6, 500)) <= 1 + 1e-12
    assert growth(1e9j) < 1e-6


def test_explicit_error_falls_at_order_eight():
    steps, ends = 2 * np.pi / np.array([8, 12, 16, 24]), np.array([0.0, 2 * np.pi])
    errors = [
        np.linalg.norm(steady(Dop853(), h).solve(oscillator(), ends, [1.0, 0.0]).states[-1] - [1, 0]) for h in steps
    ]
    assert slope(steps, errors) == pytest.approx(8, abs=0.2)


@with_implicit
def test_implicit_error_falls_at_the_stated_order(name):
    """A Duffing oscillation, at the times of four rows."""
    method, times, h = IMPLICIT[name], np.linspace(0, 6, 4), np.array([0.06, 0.04, 0.03, 0.02])
    runs = [steady(method, step).solve(cubic_spring(0.5), times, [1.0, 0.0]).states[:, 0] for step in h]
    assert slope(h, [np.abs(x - jacobi(times, 0.5, 1.0)).max() for x in runs]) == pytest.approx(method.order, abs=0.15)


@with_implicit
def test_changing_steps_keep_the_order(name):
    """Error of the whole run against the mean step, at a row of tolerances."""
    method, model, end = IMPLICIT[name], cubic_spring(2.0), np.array([0.0, 4.0])
    exact = Dop853(rtol=1e-13, atol=1e-13).solve(model, end, [1.5, 0.0]).states[-1]
    runs = [like(method, rtol=tol, atol=tol).solve(model, end, [1.5, 0.0]) for tol in 10.0 ** -np.arange(7, 11)]
    assert runs[-1].steps.largest > 1.2 * 4 / runs[-1].steps.accepted  # they do change
    mean, errors = [4 / run.steps.accepted for run in runs], [np.abs(run.states[-1] - exact).max() for run in runs]
    assert slope(mean, errors) == pytest.approx(method.order, abs=0.25)


@with_methods
def test_rotations_converge_at_the_stated_order(name):
    method, model, x0 = METHODS[name], rigid_body((2.0, 2.0, 3.2)), np.array([1.0, 0, 0, 0, 0.7, -0.2, 1.1])
    end, h = (4.0, 4.0 / np.array([6, 8, 12, 16])) if name == "dop853" else (3.0, np.array([0.1, 0.06, 0.04, 0.03]))
    runs = [steady(method, step).solve(model, np.array([0.0, end]), x0).states[-1] for step in h]
    errors = [np.abs(x - spun(model, x0, end)).max() for x in runs]
    assert slope(h, errors) == pytest.approx(method.order, abs=0.4 if name == "dop853" else 0.2)
    assert all(np.linalg.norm(x[:4]) == pytest.approx(1.0, abs=1e-14) for x in runs)


def test_dense_output_of_one_explicit_step_is_of_order_eight():
    steps, errors = np.array([0.56, 0.48, 0.4, 0.34]), []
    for h in steps:
        times = np.array([0.0, 0.3, 0.7, 1.0]) * h
        x = steady(Dop853(), h).solve(duffing(0.5), times, [1.0, 0.2])
        tight = Dop853(rtol=1e-14, atol=1e-15, max_step=h / 40).solve(duffing(0.5), times, [1.0, 0.2])
        assert x.steps.accepted == 1
        errors.append(np.abs(x.states[1:3] - tight.states[1:3]).max())
    assert slope(steps, errors) == pytest.approx(8, abs=0.3)


@with_implicit
def test_rows_between_implicit_steps_are_as_accurate_as_the_steps(name):
    # cubic Hermite: fourth order, never worse than the methods
    model, x0 = rigid_body(spring=2.0), np.array([1.0, 0, 0, 0, 0.3, 1.0, 0.2])
    exact = Dop853(rtol=1e-13, atol=1e-13).solve(model, np.linspace(0, 5, 321), x0).states
    x = like(IMPLICIT[name], step=5 / 40, rtol=1e-12, atol=1e-12).solve(model, np.linspace(0, 5, 321), x0)
    error = np.abs(x.states - exact).max(axis=1)
    assert error.max() < 1.5 * error[::8].max() + 5e-5


def test_duffing_oscillation_is_a_jacobi_function_at_all_output_times():
    times = np.linspace(0, 20, 333)
    x = Dop853(rtol=1e-11, atol=1e-12).solve(duffing(0.7), times, [1.3, 0.0])
    assert x.states[:, 0] == pytest.approx(jacobi(times, 0.7, 1.3), abs=1e-9)


def test_kepler_ellipse_closes_at_any_tolerance():
    e, ends = 0.6, np.array([0.0, 6 * np.pi])
    x0 = np.array([1 - e, 0, 0, np.sqrt((1 + e) / (1 - e))])
    for rtol in (1e-6, 1e-9, 1e-12):
        x = Dop853(rtol=rtol, atol=rtol).solve(kepler(), ends, x0)
        assert x.states[-1] == pytest.approx(x0, abs=3e4 * rtol)  # speed at perigee grows errors by the period's slope


@pytest.mark.parametrize(("name", "factor"), [("esdirk4", 100)])
def test_errors_follow_the_tolerance(name, factor):
    model, ends = cubic_spring(0.5), np.array([0.0, 6.0])
    exact = jacobi(ends, 0.5, 1.0)[-1]
    runs = [like(IMPLICIT[name], rtol=tol, atol=tol).solve(model, ends, [1.0, 0.0]) for tol in (1e-4, 1e-6)]
    coarse, fine = (abs(run.states[-1, 0] - exact) for run in runs)
    assert fine < 0.1 * coarse and fine < factor * 1e-6


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
@with_methods
def test_quaternions_of_rows_have_unit_length(name, tolerance):
    x0, method = np.array([1.0, 0, 0, 0, 0.7, -0.2, 1.1]), like(METHODS[name], rtol=tolerance, atol=tolerance)
    x = method.solve(rigid_body(), np.linspace(0, 10, 101), x0)
    assert np.linalg.norm(x.states[:, :4], axis=1) == pytest.approx(np.ones(101), abs=1e-14)


def energy_and_momentum(model, x):
    """Of a free rigid body: its kinetic energy, and its angular momentum squared."""
    J = model.pool[:3]
    return np.column_stack([(J * x[:, 4:] ** 2).sum(axis=1) / 2, ((J * x[:, 4:]) ** 2).sum(axis=1)])


@pytest.mark.parametrize(("name", "error"), [("dop853", 1e-7), ("esdirk4", 1e-6)])
def test_energy_and_momentum_of_a_free_body(name, error):
    model, x0 = rigid_body(), np.array([1.0, 0, 0, 0, 0.3, 1.0, 0.2])
    x = like(METHODS[name], rtol=1e-9, atol=1e-9).solve(model, np.linspace(0, 30, 61), x0)
    values = energy_and_momentum(model, x.states)
    assert values == pytest.approx(np.tile(values[0], (61, 1)), rel=error)


def pulse_motion(t, on, off):
    """Speed under the pulse and the brake after it."""
    return np.where(t < off, np.clip(t - on, 0, None), (off - on) * np.exp(-3 * (t - off).clip(0)))


@pytest.mark.parametrize(("on", "off"), [(0.31, 0.77), (0.0, 2.0), (0.5, 0.5 + 1e-13), (0.3, 0.7), (-1.0, 5.0)])
def test_steps_end_at_breaks_so_that_jumps_cost_no_accuracy(on, off):
    """Breaks between rows, at rows, at both ends, together, and outside."""
    times = np.linspace(0, 2, 21)
    x = Dop853(rtol=1e-10, atol=1e-12).solve(pulse(on, off), times, [0.0, 0.0])
    assert x.states[:-1, 1] == pytest.approx(pulse_motion(times, max(on, 0.0), off)[:-1], abs=1e-11)
    if (on, off) == (0.31, 0.77):
        unaware = Dop853(rtol=1e-10, atol=1e-12).solve(pulse(on, off, known=False), times, [0.0, 0.0])
        assert x.steps.rejected == 0 and unaware.steps.rejected > 5


@pytest.mark.sampled(2)
@with_implicit
def test_implicit_methods_take_breaks_exactly(name):
    """A mass under a constant force that changes at a break: both methods integrate parabolas exactly."""
    given = pulse(0.31, 5.0)
    second = Second(1, 1, correcting(free_residual, free_solve), free_kinematic)
    model = Compiled(2, given.rate, given.pool, breaks=given.breaks, second_order=second)
    times = np.linspace(0, 2, 21)
    x = like(IMPLICIT[name], rtol=1e-6, atol=1e-6).solve(model, times, [0.0, 0.0])
    late = np.clip(times - 0.31, 0, None)
    assert x.states == pytest.approx(np.column_stack([late**2 / 2, late]), abs=1e-9)


def test_absolute_tolerances_weigh_coordinates():
    # two chains in one: the second, held loosely, must not govern the steps
    model, ends = chain(np.ones(2), np.array([1.0, 0.0, 400.0])), np.array([0.0, 10.0])
    x0 = np.array([1.0, 1.0, 0.0, 0.0])
    tight = Dop853(rtol=0.0, atol=1e-9).solve(model, ends, x0)
    loose = Dop853(rtol=0.0, atol=np.array([1e-9, 1.0, 1e-9, 20.0])).solve(model, ends, x0)
    assert loose.steps.evaluations < tight.steps.evaluations / 3
    assert loose.states[-1, 0] == pytest.approx(np.cos(10.0), abs=1e-7)


def test_same_motion_as_scipys_implementation_of_the_same_method():
    times, x0 = np.linspace(0, 30, 61), np.concatenate([np.sin(np.arange(8.0)), np.zeros(8)])
    model = chain(np.linspace(1, 2, 8), np.linspace(3, 1, 9), cubic=0.3, force=0.5, w=1.1)
    ours = integrator("dop853", rtol=1e-12, atol=1e-13).solve(model, times, x0)
    theirs = integrator("scipy_dop853", rtol=1e-12, atol=1e-13).solve(model, times, x0)
    assert ours.states == pytest.approx(theirs.states, abs=1e-10)


@pytest.mark.parametrize("name", [name for name in INTEGRATORS if name.startswith("scipy")])
def test_scipy_solvers_drive_the_same_rate(name):
    times = np.linspace(0, 10, 101)
    x = integrator(name, rtol=1e-6, atol=1e-8).solve(oscillator(1.5), times, [1.0, 0.0])
    assert x.states[:, 0] == pytest.approx(np.cos(1.5 * times), abs=1e-4)
