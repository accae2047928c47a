"""The automatic choice with its sentence, the register, and scipy's solvers on the same rate."""

import numpy as np
import pytest
from support.integrate_models import chain, duffing, explosion, failing, oscillator, pulse, rigid_body
from support.scipy_integrators import SCIPY, Scipy, integrator

from femflex.integrate import INTEGRATORS, Dop853, Forecast, IntegrationError, Integrator, choose, forecast

TAU = 2 * np.pi


def told_only(calls):
    """A trial that knows the cost already: calls and step of each method."""
    return lambda name: Forecast(*calls[name])


def no_trial(name):
    raise AssertionError(f"no trial of {name} was needed")


def test_modes_that_the_output_shows_are_followed_explicitly():
    choice = choose(TAU * 3.0, duration=100.0, output_step=0.1, trial=no_trial)
    assert choice.name == "dop853"
    assert "the highest natural frequency is 3 Hz, the highest in the output 5 Hz" in choice.sentence


def test_a_short_run_stays_explicit_without_a_trial():
    choice = choose(TAU * 1e3, 0.3, 0.01, no_trial, band=TAU * 5.0)
    assert choice.name == "dop853"
    assert f"at most {12 * 0.3 * TAU * 1e3 / 0.3:.1e} evaluations" in choice.sentence


def test_the_cheaper_method_is_chosen_and_both_costs_are_reported():
    trial = told_only({"dop853": (4e5, 1e-4), "esdirk4": (1e5, 5e-3)})
    choice = choose(TAU * 5e3, 10.0, 0.1, trial, band=TAU * 4.0)
    assert choice.name == "esdirk4"
    explicit = "explicit 6.9e+05 (steps of 0.0001 s)"  # what stability takes
    assert f"evaluations for 10 s at equal tolerance: {explicit}" in choice.sentence
    assert "implicit 2.0e+05 (steps of 0.005 s)" in choice.sentence
    assert "the highest wanted 4 Hz" in choice.sentence
    swinging = told_only({"dop853": (4e5, 1e-4), "esdirk4": (5e5, 1e-3)})
    assert choose(TAU * 5e3, 10.0, 0.1, swinging, band=TAU * 4.0).name == "dop853"


def test_explicit_steps_are_no_longer_than_stability_lets_them_and_cost_what_was_forecast_at_least():
    """5.5 / omega is 0.000175 s at 5 kHz."""
    trial = told_only({"dop853": (9e6, 1e-2), "esdirk4": (4.4e6, 2e-2)})
    choice = choose(TAU * 5e3, 10.0, 0.1, trial, band=TAU * 4.0)
    assert choice.name == "esdirk4"
    assert choice.sentence.endswith(
        "for 10 s at equal tolerance: explicit 9.0e+06 (steps of 0.00018 s), implicit 8.8e+06 (steps of 0.02 s)."
    )


def test_a_rigid_system_says_so():
    assert "the model has no linear vibration" in choose(0.0, 100.0, 0.1, no_trial).sentence


def test_what_is_asked_for_is_taken():
    choice = choose(TAU * 30.0, 1e6, 0.1, no_trial, asked="generalized_alpha")
    assert choice.name == "generalized_alpha"
    assert choice.sentence.startswith("generalized_alpha (requested): the highest natural frequency is 30 Hz")


@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
def test_the_calls_forecast_are_those_spent(method):
    """A slow swing beside a stiff mode, undamped: exact for a run of less than 120 steps; for thousands those of the

    first sixty that count are a sample of a swing that is not periodic: 2 and 4 % off.
    """
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


def test_a_forecast_goes_on_beyond_breaks():
    times = (0.001, 0.002, 0.5)
    found = forecast(Dop853(), pulse(*times[:2]), 3.0, np.zeros(2))
    steps = Dop853().solve(pulse(*times[:2]), np.array([0.0, 3.0]), np.zeros(2)).steps
    assert found.calls == steps.evaluations and found.step == 3.0 / steps.accepted


def test_every_registered_integrator_has_its_own_name_and_follows_the_protocol():
    assert {"dop853", "esdirk4", "generalized_alpha"} <= set(INTEGRATORS)
    for name in INTEGRATORS:
        assert isinstance(integrator(name), Integrator)
        assert integrator(name).name == name
        assert integrator(name).order >= 2


def test_an_unknown_name_is_reported_with_the_near_one():
    with pytest.raises(ValueError, match=r"'dop583' is not known\. Did you mean 'dop853'\? Known are \["):
        integrator("dop583")


@pytest.mark.parametrize("name", SCIPY)
def test_scipy_solvers_drive_the_same_rate(name):
    times = np.linspace(0, 10, 101)
    x = integrator(name, rtol=1e-6, atol=1e-8).solve(oscillator(1.5), times, [1.0, 0.0])
    assert x.states[:, 0] == pytest.approx(np.cos(1.5 * times), abs=1e-4)
    assert x.steps.evaluations > x.steps.accepted > 10


def test_scipy_solvers_stop_at_breaks_and_keep_quaternions():
    x = integrator("scipy_dop853", rtol=1e-10).solve(pulse(0.31, 0.77), np.linspace(0, 2, 9), [0.0, 0.0])
    assert x.states[-1, 1] == pytest.approx(0.46 * np.exp(-3 * (2 - 0.77)), abs=1e-9)
    x0 = np.array([1.0, 0, 0, 0, 0.7, -0.2, 1.1])
    x = integrator("scipy_rk45", rtol=1e-4).solve(rigid_body(), np.linspace(0, 20, 41), x0)
    assert np.linalg.norm(x.states[:, :4], axis=1) == pytest.approx(np.ones(41), abs=1e-15)


def test_scipy_runs_resume_to_the_tolerance():
    times, method = np.linspace(0, 10, 101), integrator("scipy_dop853", rtol=1e-9)
    first = method.solve(oscillator(), times, [1.0, 0.0], progress=lambda t: True)
    rest = method.solve(oscillator(), times, [1.0, 0.0], state=method.solve(oscillator(), times[:40], [1, 0]).resume)
    assert first.times.size > 0
    assert np.array_equal(rest.times, times[40:])
    assert rest.states[:, 0] == pytest.approx(np.cos(times[40:]), abs=1e-7)
    with pytest.raises(ValueError, match="was not written by a scipy method for 2 states"):
        method.solve(oscillator(), times, [1.0, 0.0], state=np.zeros(5))


@pytest.mark.parametrize("name", SCIPY)
def test_scipy_failures_carry_the_trajectory(name):
    with pytest.raises(IntegrationError, match=f"{name} stopped at t = ") as caught:
        integrator(name, rtol=1e-5).solve(failing(1.3), np.linspace(0, 2, 21), np.zeros(3))
    assert caught.value.t <= 1.3 + 1e-9
    assert np.all(np.isfinite(caught.value.states))
    assert len(caught.value.times) > 3


def test_scipy_tells_the_coordinate_that_explodes():
    with pytest.raises(IntegrationError) as caught:
        integrator("scipy_dop853").solve(explosion(), np.linspace(0, 2, 5), np.array([0.0, 1.0]))
    assert caught.value.coordinate == 1


def test_an_unknown_scipy_method_is_reported():
    with pytest.raises(ValueError, match="scipy method 'RK78' is not known"):
        Scipy("RK78")


@pytest.mark.parametrize(("name", "stages", "step"), [("scipy_rk23", 3, 0.01), ("scipy_rk45", 6, 0.07)])
def test_scipy_statistics_count_the_evaluations_of_each_step_once(name, stages, step):
    """Steps at their bound have no rejections: as many evaluations as the method has stages, the last one used again.

    The rate of the pulse jumps at 0.5 s and 1.25 s, where a new solver starts."""
    times = np.array([0.0, 2.0])
    for model in (oscillator(), pulse(0.5, 1.25)):
        method = integrator(name, rtol=1e-3, atol=1e-2, max_step=step)
        steps = method.solve(model, times, [1.0, 0.0]).steps
        assert steps.accepted >= 2.0 / step - 1e-9 and steps.evaluations == stages * steps.accepted
        assert steps.largest == pytest.approx(step) and steps.smallest <= steps.largest


def test_scipy_tells_the_coordinate_that_explodes_downwards():
    """x'' = -x + x^3 from x = -3: both rates go to minus infinity, that of the velocity first."""
    with pytest.raises(IntegrationError, match="near coordinate 1") as caught:
        integrator("scipy_dop853").solve(duffing(-1.0), np.linspace(0, 3, 5), np.array([-3.0, -1.0]))
    error = caught.value
    assert np.isfinite(error.states).all() and error.coordinate == 1 and error.states[-1].max() < -1e3
