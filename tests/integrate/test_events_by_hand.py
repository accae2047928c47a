"""Events whose instants are known in advance: which happen at once, at the start, between two looks, or never."""

from __future__ import annotations

import numpy as np
import pytest
from support.integrate_models import Compiled, failing, oscillator

from femflex.integrate import Dop853, Forecast, IntegrationError, forecast, pace

START = np.array([1.0, 0.0])


class Timed:
    """Events of an oscillator, each with its value and rate over time; those that happened have the value 1."""

    def __init__(self, *curves):
        self.curves, self.done, self.calls = curves, set(), []

    def values(self, t, x):
        return np.array([1.0 if k in self.done else value(t) for k, (value, _) in enumerate(self.curves)])

    def rates(self, t, x):
        return np.array([0.0 if k in self.done else rate(t) for k, (_, rate) in enumerate(self.curves)])

    def happen(self, together, t, x):
        self.calls.append((list(together), t))
        self.done |= set(together)
        x[1] += 1.0


def at(time, slope=1.0):
    """A value that falls with a slope and is zero at a time."""
    return (lambda t: slope * (time - t)), (lambda t: -slope)


def dip(time, least):
    """A parabola with its least value at a time."""
    return (lambda t: (t - time) ** 2 + least), (lambda t: 2.0 * (t - time))


def with_events(events):
    model = Compiled(2, oscillator().rate, np.array([1.0]))
    object.__setattr__(model, "events", events)
    return model


def test_events_that_a_step_cannot_distinguish_are_one_and_others_follow_in_their_order():
    """A step is 0.05 s long: 1e-11 s are below a 1e-9th of it, 1e-9 s are not. Slopes say how near a value is."""
    events = Timed(at(1.0 + 1e-11, 300.0), at(1.0 + 1e-9, 1e-4), at(1.0), at(0.3), (lambda t: 1e-14, lambda t: 0.0))
    found = Dop853(max_step=0.05).solve(with_events(events), np.array([0.0, 0.9, 1.5]), START)
    assert [together for together, _ in events.calls] == [[3], [0, 2], [1]]
    assert [t for _, t in events.calls] == pytest.approx([0.3, 1.0, 1.0 + 1e-9], abs=1e-14)
    y, v = np.cos(1.5), -np.sin(1.5)
    for t in (0.3, 1.0, 1.0):  # each adds 1 to the velocity
        y, v = y + np.sin(1.5 - t), v + np.cos(1.5 - t)
    assert found.states[2] == pytest.approx([y, v], abs=1e-8)
    assert found.states[1] == pytest.approx([np.cos(0.9) + np.sin(0.6), -np.sin(0.9) + np.cos(0.6)], abs=1e-8)


def test_an_event_that_is_due_at_the_start_happens_before_the_first_row():
    events = Timed(at(0.5), at(0.0), at(-1.0))
    found = Dop853().solve(with_events(events), np.array([0.0, 0.2]), START)
    assert events.calls == [([1, 2], 0.0)]
    assert found.states[0].tolist() == [1.0, 1.0]
    assert found.states[1] == pytest.approx([np.cos(0.2) + np.sin(0.2), np.cos(0.2) - np.sin(0.2)], abs=1e-9)


def test_an_event_at_the_start_that_stays_due_ends_the_run_there():
    events = Timed(at(0.0))
    events.happen = lambda together, t, x: None
    with pytest.raises(IntegrationError, match="repeats without end at the same time") as error:
        Dop853().solve(with_events(events), np.array([0.0, 0.2]), START)
    assert error.value.t == 0.0 and error.value.states.tolist() == [[1.0, 0.0]]


def test_a_value_that_turns_back_within_a_quarter_of_a_step_counts_where_it_was_reached():
    """Quarters of steps of 0.4 s; two dips within one quarter, of which the deeper later one is reached later."""
    events = Timed(dip(1.05, 1e-6), dip(1.06, -1e-6), dip(1.04, -1e-8), dip(1.05, -1e-10))
    Dop853(rtol=1e-3, atol=1e-3, max_step=0.4).solve(with_events(events), np.array([0.0, 2.0]), START)
    assert [together for together, _ in events.calls] == [[2], [3], [1]]
    wanted = [1.04 - 1e-4, 1.05 - 1e-5, 1.06 - 1e-3]
    assert [t for _, t in events.calls] == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("eventful", [True, False])
def test_a_run_that_would_take_too_many_steps_is_given_up_with_and_without_events(eventful, monkeypatch):
    monkeypatch.setattr(pace, "TRIALS", 50)
    monkeypatch.setattr(pace, "MOST", 2000.0)
    model = with_events(Timed(at(1e9))) if eventful else oscillator()
    method = Dop853(rtol=1e-3, atol=1e-3, max_step=1e-3)
    with pytest.raises(IntegrationError, match="it would need more than 1e\\+12 steps to the end") as error:
        method.solve(model, np.array([0.0, 0.01, 50.0]), START)
    assert 0.04 < error.value.t < 0.5 and error.value.times[:2].tolist() == [0.0, 0.01]
    assert method.solve(model, np.array([0.0, 1.5]), START).steps.accepted >= 1500  # within the limit


def test_a_run_of_equal_steps_is_forecast_to_the_step():
    method, model = Dop853(max_step=2e-3), oscillator()
    found = forecast(method, model, 6.0, START)
    steps = method.solve(model, np.array([0.0, 6.0]), START).steps
    assert steps.accepted >= 3000
    assert found.step == pytest.approx(2e-3, rel=1e-9)
    assert found.calls == pytest.approx(steps.evaluations, abs=40)  # of 36,000


def test_a_run_that_fails_at_once_has_no_end_to_foresee():
    method = Dop853(max_step=1e-3)
    for t in (0.002, 0.02):  # while the step settles, and while steps are counted
        assert forecast(method, failing(t), 1.0, np.zeros(failing(t).n_x)) == Forecast(np.inf, 0.0)
