"""Blocks, the state to resume from and interruptions: the same rows bit for bit, for every compiled method."""

from __future__ import annotations

import signal

import h5py
import numpy as np
import pytest
from support.integrate_models import chain, oscillator, pulse, rigid_body

from femflex.integrate import Dop853, Esdirk4, IntegrationError, Interrupted
from femflex.integrate import resume as head

METHODS = [Dop853(rtol=1e-7, atol=1e-8), Esdirk4(rtol=1e-5, atol=1e-6)]
with_methods = pytest.mark.parametrize("method", METHODS, ids=[method.name for method in METHODS])

BODY, START = rigid_body(spring=2.0), np.array([1.0, 0, 0, 0, 0.3, 1.0, 0.2])
TIMES = np.sort(np.concatenate([np.linspace(0, 6, 3000), np.linspace(2, 2.1, 1000)]))  # four blocks of rows


@with_methods
def test_rows_do_not_depend_on_the_other_rows(method):
    """Blocks end after a number of rows: a run with few of them takes the same steps."""
    rows = np.append(np.arange(0, len(TIMES) - 1, 100), len(TIMES) - 1)
    many, few = (method.solve(BODY, times, START) for times in (TIMES, TIMES[rows]))
    assert np.array_equal(many.states[rows], few.states)
    assert (many.steps.accepted, many.steps.smallest) == (few.steps.accepted, few.steps.smallest)


@with_methods
@pytest.mark.parametrize("given", ["all times", "times left"])
def test_resume_from_any_block_bit_for_bit(method, given, tmp_path):
    whole = method.solve(BODY, TIMES, START)
    blocks = list(method.blocks(BODY, TIMES, START))
    assert np.array_equal(np.concatenate([block.states for block in blocks]), whole.states) and len(blocks) > 3
    for done in range(1, len(blocks)):
        with h5py.File(tmp_path / f"{done}.h5", "w") as file:
            file["state"] = blocks[done - 1].resume
        with h5py.File(tmp_path / f"{done}.h5") as file:
            state = file["state"][:]
        count = sum(len(block.times) for block in blocks[:done])
        rest = method.solve(BODY, TIMES if given == "all times" else TIMES[count:], np.zeros(7), state=state)
        assert np.array_equal(rest.times, TIMES[count:]) and np.array_equal(rest.states, whole.states[count:])
        assert rest.steps == whole.steps


def test_resume_around_breaks_bit_for_bit():
    model, times, method = pulse(0.31, 0.77), np.linspace(0, 2, 5000), METHODS[0]
    whole, blocks = method.solve(model, times, [0.0, 0.0]), list(method.blocks(model, times, [0.0, 0.0]))
    count = 0
    for block in blocks[:-1]:
        count += len(block.times)
        rest = method.solve(model, times, [9.0, 9.0], state=block.resume)
        assert np.array_equal(rest.states, whole.states[count:])


def test_finished_run_resumes_to_nothing():
    done = METHODS[0].solve(BODY, TIMES, START)
    assert list(METHODS[0].blocks(BODY, TIMES, START, done.resume)) == []


def test_run_stopped_by_progress_resumes():
    seen = []
    solution = METHODS[0].solve(BODY, TIMES, START, progress=lambda t: seen.append(t) or len(seen) == 2)
    assert solution.steps.ended == "stopped"
    assert np.array_equal(solution.times, TIMES[: len(solution.times)]) and len(solution.times) < len(TIMES)
    rest = METHODS[0].solve(BODY, TIMES, START, state=solution.resume)
    assert np.array_equal(np.concatenate([solution.states, rest.states]), METHODS[0].solve(BODY, TIMES, START).states)


def test_interrupt_raised_by_progress_carries_the_solution():
    def stop(t):
        if t > 1.0:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as caught:
        METHODS[0].solve(BODY, TIMES, START, progress=stop)
    solution = caught.value.solution
    assert solution.steps.ended == "interrupted" and 0 < len(solution.times) < len(TIMES)
    assert np.array_equal(solution.times, TIMES[: len(solution.times)])


@pytest.fixture
def alarm():
    """SIGALRM raises KeyboardInterrupt, as SIGINT does."""

    def raise_interrupt(number, frame):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, raise_interrupt)
    yield lambda seconds: signal.setitimer(signal.ITIMER_REAL, seconds)
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


def test_interrupt_of_a_long_run_is_answered_long_before_its_end(alarm):
    model, times = oscillator(1e5), np.linspace(0, 1e3, 10**6)  # a minute of work
    alarm(0.3)
    with pytest.raises(Interrupted) as caught:
        Dop853().solve(model, times, [1.0, 0.0])
    solution = caught.value.solution
    assert 0 < len(solution.times) < 0.2 * len(times)
    later = Dop853().blocks(model, times, [1.0, 0.0], solution.resume)
    assert next(later).times[0] == times[len(solution.times)]


def test_damaged_state_is_refused():
    block = next(METHODS[0].blocks(oscillator(), TIMES, [1.0, 0.0]))
    block.resume[head.T] = np.nan
    with pytest.raises(ValueError, match="damaged"):
        METHODS[0].solve(oscillator(), TIMES, [1.0, 0.0], state=block.resume)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("method", METHODS[1:], ids=["esdirk4"])
def test_infinite_stiffness_ends_an_implicit_run_at_its_start(method):
    broken = chain(np.ones(3), np.array([1.0, 1.0, np.nan, 1.0]))
    with pytest.raises(IntegrationError) as caught:
        method.solve(broken, np.array([0.0, 1.0]), np.array([1.0, 0, 0, 0, 0, 0]))
    assert caught.value.states.tolist() == [[1, 0, 0, 0, 0, 0]]


@with_methods
def test_single_output_time_is_the_first_state(method):
    assert np.array_equal(method.solve(BODY, np.array([3.0]), START).states, [START])
