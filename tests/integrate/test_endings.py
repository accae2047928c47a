"""Every run ends: whatever a model answers, it is done or fails with a sentence and what it had."""

import numpy as np
import pytest
from numba import njit
from support.integrate_models import ADVANCE, CORRECT, KINEMATIC, RATE, Compiled, Second, oscillator

from femflex.integrate import IntegrationError, integrator, pace
from femflex.integrate import resume as head
from femflex.integrate.protocol import PROJECT

IMPLICIT = ("esdirk4", "generalized_alpha")
TIMES, START = np.linspace(0.0, 1.0, 5), np.array([1.0, 0.0])
MANY = 100  # blocks of 0.2 s: a run of these models takes one, one that stands gives blocks without an end


def ended(method, model, times=TIMES, x0=START):
    """The error that ends the run, within MANY blocks."""
    with pytest.raises(IntegrationError) as caught:
        for count, _ in enumerate(method.blocks(model, times, x0)):
            assert count < MANY, "the run stands"
    return caught.value


@njit(RATE, cache=True)
def lost_rate(t, x, dx, table, pool, work):
    dx[0], dx[1] = x[1], -x[0]
    if t > 0.3:
        dx[1] = pool[0]


@njit(CORRECT, cache=True)
def spring_correct(t, q, u, udot, out, c_damp, c_stiff, table, pool, work):
    out[0] = (-q[0] - udot[0]) / (1.0 + c_stiff)


@njit(KINEMATIC, cache=True)
def spring_kinematic(t, q, u, qdot, table, pool, work):
    qdot[0] = u[0]


@njit(ADVANCE, cache=True)
def spring_advance(q, increment, out, table, pool, work):
    out[0] = q[0] + increment[0]


@njit(PROJECT, cache=True)
def stay_there(t, x, table, pool, work):
    return 0.0


def lost(value):
    """An oscillator held by a constraint whose rate there is that value after 0.3 s, unseen by Newton's method."""
    second = Second(1, 1, spring_correct, spring_kinematic, spring_advance)
    return Compiled(2, lost_rate, np.array([value]), project=stay_there, second_order=second)


@pytest.mark.parametrize("settings", [{}, {"step": 0.01}], ids=["adaptive", "fixed"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", IMPLICIT)
def test_a_step_that_passes_its_test_and_ends_where_the_rate_is_lost_is_not_tried_for_ever(name, value, settings):
    error = ended(integrator(name, **settings), lost(value))
    assert "not finite beyond this: coordinate 1" in str(error)
    assert error.t == pytest.approx(0.3, abs=1e-9)
    assert np.isfinite(error.states).all()


@njit(RATE, cache=True)
def broken_rate(t, x, dx, table, pool, work):
    dx[0] = dx[1] = pool[0]


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["rk23", "rk45", "dop853", "radau", "bdf", "lsoda"])
def test_scipys_solvers_give_up_a_rate_that_is_never_finite(name, value):
    error = ended(integrator(f"scipy_{name}"), Compiled(2, broken_rate, np.array([value])))
    assert error.t == 0.0 and error.states[-1] == pytest.approx(START)


@njit(RATE, cache=True)
def sticking_rate(t, x, dx, table, pool, work):
    dx[0], dx[1] = x[1], -50.0 * np.sign(x[1]) + 10.0


def test_a_block_on_dry_friction_that_jumps_is_told_instead_of_creeping_for_years(monkeypatch):
    """It sticks after 1/40 s; about u = 0 the steps are then those at which a jump of 100 m/s^2 is within tolerance."""
    monkeypatch.setattr(pace, "TRIALS", 20_000)
    error = ended(integrator("dop853"), Compiled(2, sticking_rate), np.array([0.0, 1.0, 1e4]), np.array([0.0, 1.0]))
    assert "dry friction" in str(error) and "the steps of coordinate 1 short" in str(error)
    assert error.t == pytest.approx(1 / 40, abs=1e-3)
    assert error.states[-1] == pytest.approx([1 / 80, 0.0], abs=1e-6)


def test_a_run_that_is_only_long_is_not_taken_for_one_that_creeps(monkeypatch):
    monkeypatch.setattr(pace, "TRIALS", 100)
    solution = integrator("dop853", max_step=1e-2).solve(oscillator(), np.array([0.0, 30.0]), START)
    assert solution.steps.accepted >= 3000
    assert solution.states[-1] == pytest.approx([np.cos(30.0), -np.sin(30.0)], abs=1e-9)


class Bounce:
    """An event at x = 0.5 that leaves what it is told to."""

    def __init__(self, left):
        self.left = left

    def values(self, t, x):
        return np.array([x[0] - 0.5])

    def rates(self, t, x):
        return np.array([x[1]])

    def happen(self, together, t, x):
        x[:] = self.left


@pytest.mark.parametrize("left", [(0.5, 0.0), (np.nan, 1.0)], ids=["due again", "not finite"])
def test_an_event_that_leaves_nothing_to_go_on_with_ends_the_run(left):
    class Eventful(Compiled):
        events = Bounce(left)

    error = ended(integrator("dop853"), Eventful(2, oscillator().rate, np.array([1.0])), TIMES * 2)
    assert "an event gives numbers that are not finite, or repeats without end" in str(error)
    assert error.t == pytest.approx(np.pi / 3, abs=1e-9)
    assert error.states[-1] == pytest.approx([0.5, -np.sqrt(0.75)], abs=1e-9)


class Wall:
    """A wall at x = 0.5 that throws back with half the speed, and notes when."""

    def __init__(self):
        self.times = []

    def values(self, t, x):
        return np.array([x[0] - 0.5 if x[1] < 0.0 else 1.0])

    def rates(self, t, x):
        return np.array([x[1]])

    def happen(self, together, t, x):
        self.times.append(t)
        x[1] *= -0.5


def walled():
    class Eventful(Compiled):
        events = Wall()

    return Eventful(2, oscillator().rate, np.array([1.0]))


def test_a_row_at_the_very_time_of_an_event_is_the_state_after_it_once():
    """From 1 at rest the wall is met at pi / 3 with the speed sqrt(3) / 2; the rows just before and after say so."""
    method = integrator("dop853")
    first = walled()
    method.solve(first, np.array([0.0, 2.0]), START)
    at = first.events.times[0]
    assert at == pytest.approx(np.pi / 3, abs=1e-11)
    times = np.array([0.0, np.nextafter(at, 0.0), at, np.nextafter(at, 3.0), 2.0])
    again = walled()
    found = method.solve(again, times, START)
    assert again.events.times == first.events.times and np.array_equal(found.times, times)
    speed = np.sqrt(0.75)
    assert found.states[1:4, 0] == pytest.approx(0.5, abs=1e-11)
    assert found.states[1:4, 1] == pytest.approx([-speed, speed / 2, speed / 2], abs=1e-9)


@pytest.mark.parametrize("place", [head.T, head.H, head.HEAD])
def test_a_damaged_state_is_not_gone_on_with(place):
    method = integrator("dop853")
    block = next(method.blocks(oscillator(), TIMES, START))
    block.resume[place] = np.nan
    with pytest.raises(ValueError, match="the stored state is damaged: 1 of its numbers are not finite"):
        method.solve(oscillator(), TIMES, START, state=block.resume)
