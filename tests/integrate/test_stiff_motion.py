"""Implicit methods on stiff systems against closed forms; the choice between methods and its forecast of cost."""

from __future__ import annotations

import numpy as np
import pytest
from support.integrate_models import (
    Compiled,
    Second,
    chain,
    chain_matrices,
    chain_residual,
    contrary_solve,
    correcting,
    pulse,
)

from femflex.integrate import (
    Dop853,
    Esdirk4,
    Forecast,
    IntegrationError,
    choose,
    forecast,
    integrator,
)

METHODS = [Esdirk4()]
with_methods = pytest.mark.parametrize("method", METHODS, ids=["esdirk4"])


def like(method, **settings):
    """The same method with other settings."""
    return type(method)(**settings)


def stiff_pair():
    """Two equal masses, a soft spring to the wall and a very stiff one between; the slow mode is excited alone."""
    model = chain(np.ones(2), np.array([1.0, 1e10, 0.0]))
    M, _, K = chain_matrices(model)
    values, vectors = np.linalg.eigh(np.linalg.solve(M, K))
    slow = vectors[:, 0] / vectors[0, 0]
    return model, np.concatenate([slow, np.zeros(2)]), np.sqrt(values[0])


@pytest.mark.parametrize(("method", "tolerance", "error"), [(Esdirk4, 1e-7, 2e-5)])
def test_stiff_mode_at_rest_does_not_govern_the_step(method, tolerance, error):
    model, x0, omega = stiff_pair()
    times = np.linspace(0, 20, 41)
    x = method(rtol=tolerance, atol=np.array([1e-7, 1e-7, 1e-7, 1e-7])).solve(model, times, x0)
    assert x.states[:, 0] == pytest.approx(np.cos(omega * times), abs=error)
    # dop853 is stable up to omega h = 5.9: the stiff mode's 1.4e5 rad/s allow it no less than 20 * 12 * 1.4e5 / 5.9
    assert x.steps.evaluations < 5.7e6 / 500


@with_methods
def test_forced_stiff_chain_has_its_harmonic_response(method):
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


@pytest.mark.sampled(1)
@with_methods
def test_same_motion_as_the_explicit_method(method):
    model = chain(np.linspace(1, 2, 6), np.linspace(3, 1, 7), np.full(7, 0.02), cubic=0.4, force=0.7, w=1.3)
    times, x0 = np.linspace(0, 10, 21), np.concatenate([np.sin(np.arange(6.0)), np.zeros(6)])
    exact = Dop853(rtol=1e-12, atol=1e-12).solve(model, times, x0).states
    error, tolerance = (3e-6, 1e-8) if method.order == 4 else (2e-3, 1e-7)
    assert like(method, rtol=tolerance, atol=tolerance).solve(model, times, x0).states == pytest.approx(
        exact, abs=error
    )


@with_methods
def test_newton_that_cannot_converge_ends_the_run(method):
    """A solve of the wrong sign sends every iteration away from the answer."""
    good = chain(np.ones(2), np.full(3, 4.0))
    second = Second(2, 2, correcting(chain_residual, contrary_solve), good.second_order.kinematic)
    model = Compiled(4, good.rate, good.pool, good.table, good.work, second_order=second)
    with pytest.raises(IntegrationError, match="Newton's iteration does not converge") as caught:
        method.solve(model, np.array([0.0, 1.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    assert caught.value.t < 0.02
    assert caught.value.states[-1] == pytest.approx([1, 0, 0, 0], abs=0.1)


TAU = 2 * np.pi


def known_costs(calls):
    """A trial that knows the cost already: calls and step of each method."""
    return lambda name: Forecast(*calls[name])


def no_trial(name):
    raise AssertionError(f"no trial of {name} was needed")


def test_modes_within_the_output_are_followed_explicitly():
    choice = choose(TAU * 3.0, duration=100.0, output_step=0.1, trial=no_trial)
    assert choice.name == "dop853"


def test_cheaper_method_is_chosen():
    trial = known_costs({"dop853": (4e5, 1e-4), "esdirk4": (1e5, 5e-3)})
    choice = choose(TAU * 5e3, 10.0, 0.1, trial, band=TAU * 4.0)
    assert choice.name == "esdirk4"
    swinging = known_costs({"dop853": (4e5, 1e-4), "esdirk4": (5e5, 1e-3)})
    assert choose(TAU * 5e3, 10.0, 0.1, swinging, band=TAU * 4.0).name == "dop853"


@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
def test_forecast_of_calls(method):
    """A slow swing beside a stiff mode: exact for less than 120 steps, and within 12 % from a sample of them."""
    model = chain(np.ones(2), np.array([1.0, 2e5, 0.0]), np.array([0.0, 500.0, 0.0]))
    x0 = np.array([1.0, 1.0, 0.0, 0.0])
    for end, error in ((0.02, 1e-12), (60.0, 0.12)):
        found = forecast(integrator(method, rtol=1e-9), model, end, x0)
        steps = integrator(method, rtol=1e-9).solve(model, np.array([0.0, end]), x0).steps
        assert found.calls == pytest.approx(steps.evaluations, rel=error)
        assert found.step == pytest.approx(end / steps.accepted, rel=error)
    assert steps.accepted > 300
    end = {"dop853": 1.5, "esdirk4": 6.0}[method]  # two thirds of it are left when the trial ends
    found = forecast(integrator(method, rtol=1e-9), model, end, x0)
    steps = integrator(method, rtol=1e-9).solve(model, np.array([0.0, end]), x0).steps
    assert found.calls == pytest.approx(steps.evaluations, rel=0.1)


def test_forecast_beyond_breaks():
    times = (0.001, 0.002, 0.5)
    found = forecast(Dop853(), pulse(*times[:2]), 3.0, np.zeros(2))
    steps = Dop853().solve(pulse(*times[:2]), np.array([0.0, 3.0]), np.zeros(2)).steps
    assert found.calls == steps.evaluations and found.step == 3.0 / steps.accepted
