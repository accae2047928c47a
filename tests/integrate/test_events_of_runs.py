"""Events at exact instants, in their order, at the start and at rows; runs that cannot go on end there."""

from __future__ import annotations

import numpy as np
import pytest
from support.integrate_models import Compiled, explosion, failing, oscillator

from femflex.integrate import Dop853, IntegrationError

START = np.array([1.0, 0.0])


class Timed:
    """Events of an oscillator, each with its value and rate over time, that add 1 to the velocity."""

    def __init__(self, *curves):
        self.curves, self.done, self.calls = curves, set(), []

    def values(self, t, x):
        return np.array([1.0 if k in self.done else value(t) for k, (value, _) in enumerate(self.curves)])

    def rates(self, t, x):
        return np.array([0.0 if k in self.done else rate(t) for k, (_, rate) in enumerate(self.curves)])

    def apply(self, together, t, x):
        self.calls.append((list(together), t))
        self.done |= set(together)
        x[1] += 1.0


class Wall:
    """A wall at x = 0.5 that throws back with a share of the speed, and notes when."""

    def __init__(self, share=0.5):
        self.share, self.times = share, []

    def values(self, t, x):
        return np.array([x[0] - 0.5 if x[1] < 0.0 else 1.0])

    def rates(self, t, x):
        return np.array([x[1]])

    def apply(self, together, t, x):
        self.times.append(t)
        x[1] *= -self.share


def falling_value(time, slope=1.0):
    """A value that falls with a slope and is zero at a time."""
    return (lambda t: slope * (time - t)), (lambda t: -slope)


def dip(time, least):
    """A parabola with its least value at a time."""
    return (lambda t: (t - time) ** 2 + least), (lambda t: 2.0 * (t - time))


def with_events(events):
    model = Compiled(2, oscillator().rate, np.array([1.0]))
    object.__setattr__(model, "events", events)
    return model


def test_simultaneous_events_are_one_and_others_keep_their_order():
    """A step is 0.05 s long: 1e-11 s are below a 1e-9th of it, 1e-9 s are not."""
    events = Timed(
        falling_value(1.0 + 1e-11, 300.0),
        falling_value(1.0 + 1e-9, 1e-4),
        falling_value(1.0),
        falling_value(0.3),
        (lambda t: 1e-14, lambda t: 0.0),
    )
    found = Dop853(max_step=0.05).solve(with_events(events), np.array([0.0, 0.9, 1.5]), START)
    assert [together for together, _ in events.calls] == [[3], [0, 2], [1]]
    assert [t for _, t in events.calls] == pytest.approx([0.3, 1.0, 1.0 + 1e-9], abs=1e-14)
    y, v = np.cos(1.5), -np.sin(1.5)
    for t in (0.3, 1.0, 1.0):  # each adds 1 to the velocity
        y, v = y + np.sin(1.5 - t), v + np.cos(1.5 - t)
    assert found.states[2] == pytest.approx([y, v], abs=1e-8)
    assert found.states[1] == pytest.approx([np.cos(0.9) + np.sin(0.6), -np.sin(0.9) + np.cos(0.6)], abs=1e-8)


def test_event_due_at_the_start_happens_before_the_first_row():
    events = Timed(falling_value(0.5), falling_value(0.0), falling_value(-1.0))
    found = Dop853().solve(with_events(events), np.array([0.0, 0.2]), START)
    assert events.calls == [([1, 2], 0.0)]
    assert found.states[0].tolist() == [1.0, 1.0]
    assert found.states[1] == pytest.approx([np.cos(0.2) + np.sin(0.2), np.cos(0.2) - np.sin(0.2)], abs=1e-9)


def test_value_that_turns_back_within_a_step_counts_where_it_was_reached():
    """Quarters of steps of 0.4 s; two dips within one quarter, of which the deeper later one is reached later."""
    events = Timed(dip(1.05, 1e-6), dip(1.06, -1e-6), dip(1.04, -1e-8), dip(1.05, -1e-10))
    Dop853(rtol=1e-3, atol=1e-3, max_step=0.4).solve(with_events(events), np.array([0.0, 2.0]), START)
    assert [together for together, _ in events.calls] == [[2], [3], [1]]
    assert [t for _, t in events.calls] == pytest.approx([1.04 - 1e-4, 1.05 - 1e-5, 1.06 - 1e-3], abs=1e-9)


def test_row_at_the_instant_of_an_event_is_the_state_after_it():
    """From 1 at rest the wall is met at pi / 3 with the speed sqrt(3) / 2."""
    first, again = Wall(), Wall()
    Dop853().solve(with_events(first), np.array([0.0, 2.0]), START)
    (instant,) = first.times
    assert instant == pytest.approx(np.pi / 3, abs=1e-11)
    times = np.array([0.0, np.nextafter(instant, 0.0), instant, np.nextafter(instant, 3.0), 2.0])
    found = Dop853().solve(with_events(again), times, START)
    assert again.times == first.times and np.array_equal(found.times, times)
    speed = np.sqrt(0.75)
    assert found.states[1:4, 0] == pytest.approx(0.5, abs=1e-11)
    assert found.states[1:4, 1] == pytest.approx([-speed, speed / 2, speed / 2], abs=1e-9)


@pytest.mark.parametrize("share", [-1.0, np.nan], ids=["due again", "not finite"])
def test_event_that_leaves_no_motion_ends_the_run(share):
    with pytest.raises(IntegrationError) as caught:
        Dop853().solve(with_events(Wall(share)), np.array([0.0, 2.0]), START)
    assert caught.value.t == pytest.approx(np.pi / 3, abs=1e-9)
    assert caught.value.states[-1] == pytest.approx([0.5, -np.sqrt(0.75)], abs=1e-9)


def test_value_that_is_not_finite_ends_the_run_with_its_trajectory():
    times = np.linspace(0, 2, 21)
    with pytest.raises(IntegrationError) as caught:
        Dop853().solve(failing(1.3), times, np.zeros(3))
    error = caught.value
    assert error.coordinate == 1 and error.t == pytest.approx(1.3, abs=1e-9)
    assert np.array_equal(error.times[:-1], times[times < error.t]) and np.all(np.isfinite(error.states))
    assert error.states[-1] == pytest.approx([1.3, 1.3, 1.3**2 / 2], abs=1e-8)


def test_motion_that_grows_without_bound_ends_at_its_pole():
    """x' = x^2 from 1 is 1 / (1 - t)."""
    with pytest.raises(IntegrationError) as caught:
        Dop853().solve(explosion(), np.linspace(0, 2, 5), np.array([0.0, 1.0]))
    assert caught.value.coordinate == 1 and caught.value.t == pytest.approx(1.0, abs=1e-9)
