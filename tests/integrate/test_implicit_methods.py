"""The implicit methods against closed forms: orders, damping, stiff systems, rotations, and Newton's end."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from scipy.special import ellipj
from support.integrate_models import (
    Compiled,
    Second,
    chain,
    chain_matrices,
    chain_residual,
    contrary_solve,
    correcting,
    free_kinematic,
    free_residual,
    free_solve,
    oscillator,
    plain_advance,
    pulse,
    rigid_body,
    spun,
)

from femflex.integrate import Dop853, Esdirk4, GeneralizedAlpha, IntegrationError
from femflex.integrate.esdirk_table import EMBEDDED, STAGES, A, fractions
from femflex.integrate.generalized_alpha_kernel import error_constants

METHODS = [Esdirk4(), *(GeneralizedAlpha(rho=rho) for rho in (1.0, 0.8, 0.3))]
NAMES = ["esdirk4", "alpha1", "alpha0.8", "alpha0.3"]
with_methods = pytest.mark.parametrize("method", METHODS, ids=NAMES)


def like(method, **settings):
    """The same method with other settings."""
    own = {"rho": method.rho} if isinstance(method, GeneralizedAlpha) else {}
    return type(method)(**own, **settings)


def observed_order(h, errors):
    return np.polyfit(np.log(h), np.log(errors), deg=1)[0]


def cubic_spring(cubic):
    """x'' + x + cubic x^3 = 0; Newton's matrix knows the linear spring only."""
    return chain(np.ones(1), np.array([1.0, 0.0]), cubic=cubic)


def test_runge_kutta_table_meets_the_eight_conditions_of_order_four_exactly():
    a = [fractions(row) for row in STAGES]
    b, embedded, c = a[5], fractions(EMBEDDED), [sum(row) for row in a]

    def inner(v, w):
        return sum(x * y for x, y in zip(v, w, strict=True))

    ac, ac2 = [inner(row, c) for row in a], [inner(row, [x * x for x in c]) for row in a]
    third = [([Fraction(1)] * 6, 1), (c, 2), ([x * x for x in c], 3), (ac, 6)]
    fourth = [
        ([x**3 for x in c], 4),
        ([x * y for x, y in zip(c, ac, strict=True)], 8),
        (ac2, 12),
        ([inner(row, ac) for row in a], 24),
    ]
    for weights, denominator in third + fourth:
        assert inner(b, weights) == Fraction(1, denominator)
    assert all(inner(embedded, weights) == Fraction(1, denominator) for weights, denominator in third)
    assert any(inner(embedded, weights) != Fraction(1, denominator) for weights, denominator in fourth)


def test_runge_kutta_method_is_stable_and_forgets_stiff_modes():
    def growth(z):
        return abs(1 + z * A[5] @ np.linalg.solve(np.eye(6) - z * A, np.ones(6)))

    assert max(growth(1j * y) for y in np.geomspace(1e-2, 1e6, 500)) <= 1 + 1e-12
    assert growth(1e9j) < 1e-6


@with_methods
def test_constant_steps_converge_at_the_stated_order(method):
    cubic, times = 0.5, np.linspace(0, 6, 4)
    speed = np.sqrt(1 + cubic)
    exact = ellipj(speed * times, cubic / (2 * speed**2))[1]
    h, errors = np.array([0.06, 0.04, 0.03, 0.02]), []
    for step in h:
        x = like(method, step=step, rtol=1e-13, atol=1e-13).solve(cubic_spring(cubic), times, [1.0, 0.0])
        errors.append(np.abs(x.states[:, 0] - exact).max())
    assert observed_order(h, errors) == pytest.approx(method.order, abs=0.15)


@with_methods
def test_steps_that_change_all_the_time_keep_the_order(method):
    """Error of the whole run against the mean step, at a row of tolerances."""
    model, end = cubic_spring(2.0), np.array([0.0, 4.0])
    exact = Dop853(rtol=1e-13, atol=1e-13).solve(model, end, [1.5, 0.0]).states[-1]
    tolerances = 10.0 ** -np.arange(7, 11)
    runs = [like(method, rtol=tol, atol=tol).solve(model, end, [1.5, 0.0]) for tol in tolerances]
    assert runs[-1].steps.largest > 1.2 * 4 / runs[-1].steps.accepted  # they do change
    mean = [4 / run.steps.accepted for run in runs]
    errors = [np.abs(run.states[-1] - exact).max() for run in runs]
    assert observed_order(mean, errors) == pytest.approx(method.order, abs=0.25)


@with_methods
def test_rotations_converge_at_the_stated_order(method):
    model, x0, ends = rigid_body((2.0, 2.0, 3.2)), np.array([1.0, 0, 0, 0, 0.7, -0.2, 1.1]), np.array([0.0, 3.0])
    h, exact = np.array([0.1, 0.06, 0.04, 0.03]), spun(model, x0, 3.0)
    runs = [like(method, step=step, rtol=1e-12, atol=1e-12).solve(model, ends, x0).states[-1] for step in h]
    assert observed_order(h, [np.abs(x - exact).max() for x in runs]) == pytest.approx(method.order, abs=0.2)
    assert all(np.linalg.norm(x[:4]) == pytest.approx(1, abs=1e-14) for x in runs)


@with_methods
def test_rows_between_steps_are_as_good_as_those_at_steps(method):
    # cubic Hermite: fourth order, never worse than the methods
    model, x0 = rigid_body(spring=2.0), np.array([1.0, 0, 0, 0, 0.3, 1.0, 0.2])
    exact = Dop853(rtol=1e-13, atol=1e-13).solve(model, np.linspace(0, 5, 321), x0).states
    x = like(method, step=5 / 40, rtol=1e-12, atol=1e-12).solve(model, np.linspace(0, 5, 321), x0)
    error = np.abs(x.states - exact).max(axis=1)
    at_steps, between = error[::8].max(), error.max()
    assert between < 1.5 * at_steps + 5e-5


def stiff_sizes(rho):
    """Size after 0 ... 100 steps of a mode with omega h = 1e5."""
    method = GeneralizedAlpha(rho=rho, step=1.0, rtol=1e-8, atol=1e-40)
    x = method.solve(chain(np.ones(1), np.array([1e10, 0.0])), np.arange(0.0, 101.0), [1.0, 0.0])
    return np.hypot(x.states[:, 0], x.states[:, 1] / 1e5)


@pytest.mark.parametrize("rho", [0.3, 0.8, 1.0])
def test_modes_far_above_the_step_shrink_by_rho_a_step(rho):
    size = stiff_sizes(rho)
    # the root at infinity is double and defective: size goes with n rho^n
    assert (size[100] / size[50]) ** (1 / 50) == pytest.approx(rho * 2 ** (1 / 50), abs=0.02)


def test_modes_far_above_the_step_vanish_at_once_with_rho_zero():
    size = stiff_sizes(0.0)
    assert size[20] < 1e-12 * size[0]


def stiff_pair():
    """Two equal masses, a soft spring to the wall and a very stiff one between; the slow mode is excited alone."""
    model = chain(np.ones(2), np.array([1.0, 1e10, 0.0]))
    M, _, K = chain_matrices(model)
    values, vectors = np.linalg.eigh(np.linalg.solve(M, K))
    slow = vectors[:, 0] / vectors[0, 0]
    return model, np.concatenate([slow, np.zeros(2)]), np.sqrt(values[0])


@pytest.mark.parametrize(("method", "tolerance", "error"), [(Esdirk4, 1e-7, 2e-5), (GeneralizedAlpha, 1e-7, 2e-3)])
def test_a_stiff_mode_at_rest_does_not_govern_the_step(method, tolerance, error):
    model, x0, omega = stiff_pair()
    times = np.linspace(0, 20, 41)
    x = method(rtol=tolerance, atol=np.array([1e-7, 1e-7, 1e-7, 1e-7])).solve(model, times, x0)
    assert x.states[:, 0] == pytest.approx(np.cos(omega * times), abs=error)
    # dop853 is stable up to omega h = 5.9: the stiff mode's 1.4e5 rad/s allow it no less than 20 * 12 * 1.4e5 / 5.9
    assert x.steps.evaluations < 5.7e6 / 500


@with_methods
def test_a_forced_damped_stiff_chain_follows_its_quasi_static_answer(method):
    n, w = 12, 0.7
    model = chain(np.full(n, 1e-2), np.full(n + 1, 1e6), np.full(n + 1, 2e2), force=1e3, w=w)
    M, D, K = chain_matrices(model)
    load = np.zeros(n)
    load[-1] = 1e3
    response = np.linalg.solve(K + 1j * w * D - w**2 * M, load)
    times = np.linspace(0, 12, 25)
    exact = np.imag(response * np.exp(1j * w * times[:, None]))
    x0 = np.concatenate([exact[0], np.imag(1j * w * response)])
    x = like(method, rtol=1e-5, atol=1e-8).solve(model, times, x0)
    assert x.states[:, :n] == pytest.approx(exact, abs=2e-4 * np.abs(exact).max())
    assert x.steps.evaluations < 6000


@with_methods
def test_agreement_with_the_explicit_method_on_a_nonlinear_chain(method):
    model = chain(np.linspace(1, 2, 6), np.linspace(3, 1, 7), np.full(7, 0.02), cubic=0.4, force=0.7, w=1.3)
    times, x0 = np.linspace(0, 10, 21), np.concatenate([np.sin(np.arange(6.0)), np.zeros(6)])
    exact = Dop853(rtol=1e-12, atol=1e-12).solve(model, times, x0).states
    error, tolerance = (3e-6, 1e-8) if method.order == 4 else (2e-3, 1e-7)
    assert like(method, rtol=tolerance, atol=tolerance).solve(model, times, x0).states == pytest.approx(
        exact, abs=error
    )


@pytest.mark.sampled(2)
@with_methods
def test_jumps_of_the_load_at_breaks_cost_no_accuracy(method):
    """A mass under a constant force that changes at a break: both methods integrate parabolas exactly."""
    given = pulse(0.31, 5.0)
    second = Second(1, 1, correcting(free_residual, free_solve), free_kinematic, plain_advance)
    model = Compiled(2, given.rate, given.pool, breaks=given.breaks, second_order=second)
    times = np.linspace(0, 2, 21)
    x = like(method, rtol=1e-6, atol=1e-6).solve(model, times, [0.0, 0.0])
    late = np.clip(times - 0.31, 0, None)
    assert x.states == pytest.approx(np.column_stack([late**2 / 2, late]), abs=1e-9)


def test_error_constants_of_the_trapezoidal_rule():
    assert error_constants(1.0) == pytest.approx((1 / 12, 1 / 12))


@with_methods
def test_newton_that_cannot_converge_ends_the_run_with_a_sentence(method):
    """A solve of the wrong sign sends every iteration away from the answer."""
    good = chain(np.ones(2), np.full(3, 4.0))
    second = Second(2, 2, correcting(chain_residual, contrary_solve), good.second_order.kinematic, plain_advance)
    model = Compiled(4, good.rate, good.pool, good.table, good.work, second_order=second)
    with pytest.raises(IntegrationError, match="Newton's iteration does not converge") as caught:
        method.solve(model, np.array([0.0, 1.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    assert caught.value.t < 0.02
    assert caught.value.states[-1] == pytest.approx([1, 0, 0, 0], abs=0.1)


@with_methods
def test_a_model_with_only_its_rate_is_refused(method):
    with pytest.raises(ValueError, match=r"second-order calls .* Choose 'dop853'"):
        method.solve(oscillator(), np.array([0.0, 1.0]), [1.0, 0.0])


def test_sizes_that_do_not_add_up_are_refused():
    good = chain(np.ones(2), np.full(3, 4.0))
    model = Compiled(5, good.rate, good.pool, good.table, good.work, second_order=good.second_order)
    with pytest.raises(ValueError, match="n_q = 2, n_u = 2, n_z = 0 and n_x = 5"):
        Esdirk4().solve(model, np.array([0.0, 1.0]), np.zeros(5))


def test_settings_that_mean_nothing_are_refused():
    with pytest.raises(ValueError, match=r"rho = 1\.2 must lie between 0"):
        GeneralizedAlpha(rho=1.2)
    with pytest.raises(ValueError, match=r"step = -1\.0 must be positive"):
        Esdirk4(step=-1.0)


@pytest.mark.parametrize("method", [Dop853, Esdirk4, GeneralizedAlpha])
def test_settings_at_their_limits(method):
    """What is allowed, and what is not any more."""
    limits = {
        "rtol": ([0.0, 1e-3], [-1e-300, np.nan]),
        "atol": ([1e-300, np.full(2, 1.0)], [0.0, np.array([1.0, 0.0])]),
    }
    limits["max_step"] = ([1e-300, np.inf], [0.0, -1.0, np.nan])
    if method is not Dop853:
        limits["step"] = ([None, 1e-300], [0.0, -1.0, np.nan])
    if method is GeneralizedAlpha:
        limits["rho"] = ([0.0, 0.5, 1.0], [-1e-12, 1.0 + 1e-12, np.nan])
    for key, (allowed, refused) in limits.items():
        for value in allowed:
            assert getattr(method(**{key: value}), key) is value
        for value in refused:
            with pytest.raises(ValueError, match=f"{key} = .*(must lie|be positive|must not be)"):
                method(**{key: value})


def test_embedded_error_estimates_are_of_the_size_of_the_error():
    """The tolerance means something: errors of a run fall with it and stay near it, for each method alike."""
    model, ends = cubic_spring(0.5), np.array([0.0, 6.0])
    exact = Dop853(rtol=1e-13, atol=1e-13).solve(model, ends, [1.0, 0.0]).states[-1]
    for method, factor in ((Esdirk4, 100), (GeneralizedAlpha, 2000)):
        errors = [
            np.abs(method(rtol=t, atol=t).solve(model, ends, [1, 0]).states[-1] - exact).max() for t in (1e-4, 1e-6)
        ]
        assert all(later < 0.1 * earlier for earlier, later in pairwise(errors))
        assert errors[1] < factor * 1e-6
