"""Blocks, the state to resume from, failures and interruptions: the same for every compiled method."""

import signal

import h5py
import numpy as np
import pytest
from support.integrate_models import chain, explosion, failing, oscillator, pulse, rigid_body

from femflex.integrate import Dop853, Esdirk4, GeneralizedAlpha, IntegrationError, Interrupted, driver, pace
from femflex.integrate import resume as head

METHODS = [Dop853(rtol=1e-7, atol=1e-8), Esdirk4(rtol=1e-5, atol=1e-6), GeneralizedAlpha(rtol=1e-4, atol=1e-5)]
with_methods = pytest.mark.parametrize("method", METHODS, ids=[method.name for method in METHODS])

BODY, START = rigid_body(spring=2.0), np.array([1.0, 0, 0, 0, 0.3, 1.0, 0.2])
TIMES = np.sort(np.concatenate([np.linspace(0, 6, 50), np.linspace(2, 2.1, 30)]))  # several rows a step, and none


@pytest.fixture
def small_pieces(monkeypatch):
    """Blocks of seven rows, kernel calls of one trial step."""
    monkeypatch.setattr(driver, "ROWS", 7)
    monkeypatch.setattr(driver, "FIRST_BUDGET", 1)
    monkeypatch.setattr(driver, "adapted", lambda budget, seconds: 1)


@with_methods
def test_where_blocks_are_cut_changes_no_bit(method, small_pieces, monkeypatch):
    pieces = method.solve(BODY, TIMES, START)
    blocks = list(method.blocks(BODY, TIMES, START))
    assert [len(block.times) for block in blocks] == [7] * 11 + [3]
    monkeypatch.undo()
    whole = method.solve(BODY, TIMES, START)
    assert np.array_equal(pieces.states, whole.states)
    assert pieces.steps == whole.steps
    assert np.array_equal(np.concatenate([block.times for block in blocks]), TIMES)


@pytest.mark.sampled(4)
@with_methods
@pytest.mark.parametrize("given", ["all times", "times left"])
def test_resuming_from_any_block_gives_the_same_rows_bit_for_bit(method, given, small_pieces, tmp_path):
    whole = method.solve(BODY, TIMES, START)
    blocks = list(method.blocks(BODY, TIMES, START))
    for done in range(1, len(blocks)):
        with h5py.File(tmp_path / f"{done}.h5", "w") as file:
            file["state"] = blocks[done - 1].resume
        with h5py.File(tmp_path / f"{done}.h5") as file:
            state = file["state"][:]
        count = sum(len(block.times) for block in blocks[:done])
        rest = method.solve(BODY, TIMES if given == "all times" else TIMES[count:], np.zeros(7), state=state)
        assert np.array_equal(rest.times, TIMES[count:])
        assert np.array_equal(rest.states, whole.states[count:])
        assert rest.steps == whole.steps


def test_resuming_around_breaks_gives_the_same_rows_bit_for_bit(small_pieces):
    model, times, method = pulse(0.31, 0.77), np.linspace(0, 2, 41), METHODS[0]
    whole, blocks = method.solve(model, times, [0.0, 0.0]), list(method.blocks(model, times, [0.0, 0.0]))
    for done in range(1, len(blocks)):
        rest = method.solve(model, times, [9.0, 9.0], state=blocks[done - 1].resume)
        assert np.array_equal(rest.states, whole.states[7 * done :])


def test_a_finished_run_resumes_to_nothing():
    done = METHODS[0].solve(BODY, TIMES, START)
    assert list(METHODS[0].blocks(BODY, TIMES, START, done.resume)) == []


def test_a_state_of_another_method_or_model_is_refused():
    state = METHODS[0].solve(BODY, TIMES[:5], START).resume
    with pytest.raises(ValueError, match="was not written by 'esdirk4' for 7 states"):
        METHODS[1].solve(BODY, TIMES, START, state=state)
    with pytest.raises(ValueError, match="was not written by 'dop853' for 2 states"):
        METHODS[0].solve(oscillator(), TIMES, [1.0, 0.0], state=state)
    with pytest.raises(ValueError, match="was not written by 'dop853'"):
        METHODS[0].solve(BODY, TIMES, START, state=np.zeros(3))


def test_times_that_the_stored_state_cannot_give_are_refused(small_pieces):
    state = next(iter(METHODS[0].blocks(oscillator(), np.array([0.0, *range(10, 30)]), [1.0, 0.0]))).resume
    state[head.DENSE] = 0.0
    asked = np.linspace(state[head.LAST_OUT] + 1e-6, 29.0, 5)
    with pytest.raises(ValueError, match="can give no rows before t = "):
        METHODS[0].solve(oscillator(), asked, [1.0, 0.0], state=state)


def test_a_slow_stretch_gives_blocks_without_rows_that_tell_the_time(monkeypatch):
    monkeypatch.setattr(pace, "BLOCK_SECONDS", 0.005)
    monkeypatch.setattr(driver, "CALL_SECONDS", 0.002)
    reached, rows = [], 0
    for block in Dop853().blocks(oscillator(1e5), np.array([0.0, 1e6]), [1.0, 0.0]):
        reached.append(block.t)
        rows += len(block.times)
        assert block.states.shape == (len(block.times), 2)
        if len(reached) == 5:
            break
    assert rows == 1
    assert np.all(np.diff(reached) > 0)
    assert block.steps.accepted > 100


def test_a_true_answer_of_progress_stops_the_run_and_keeps_what_it_had(small_pieces):
    seen = []
    solution = METHODS[0].solve(BODY, TIMES, START, progress=lambda t: seen.append(t) or len(seen) == 3)
    assert solution.steps.ended == "stopped"
    assert np.array_equal(solution.times, TIMES[:21])
    assert seen[2] >= TIMES[20]
    rest = METHODS[0].solve(BODY, TIMES, START, state=solution.resume)
    assert np.array_equal(np.concatenate([solution.states, rest.states]), METHODS[0].solve(BODY, TIMES, START).states)


def test_an_interrupt_raised_by_progress_carries_the_solution(small_pieces):
    def stop(t):
        if t > 1.0:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="rows are kept") as caught:
        METHODS[0].solve(BODY, TIMES, START, progress=stop)
    solution = caught.value.solution
    assert solution.steps.ended == "interrupted"
    assert np.array_equal(solution.times, TIMES[: len(solution.times)])
    assert 7 <= len(solution.times) < len(TIMES)


@pytest.fixture
def alarm():
    """SIGALRM raises KeyboardInterrupt, as SIGINT does."""

    def raised(number, frame):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, raised)
    yield lambda seconds: signal.setitimer(signal.ITIMER_REAL, seconds)
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


def test_an_interrupt_in_a_long_run_is_answered_long_before_its_end(alarm):
    model, times = oscillator(1e5), np.linspace(0, 1e3, 10**6)  # a minute of work
    alarm(0.3)
    with pytest.raises(Interrupted) as caught:
        Dop853().solve(model, times, [1.0, 0.0])
    solution = caught.value.solution
    assert 0 < len(solution.times) < 0.2 * len(times)
    # goes on as if nothing had happened
    later = Dop853().blocks(model, times, [1.0, 0.0], solution.resume)
    assert next(later).times[0] == times[len(solution.times)]


def test_an_interrupt_yields_the_rows_of_the_block_at_hand_first(monkeypatch):
    calls = []

    def interrupted(budget, seconds):
        calls.append(budget)
        if len(calls) == 12:
            raise KeyboardInterrupt
        return 1

    monkeypatch.setattr(driver, "FIRST_BUDGET", 1)
    monkeypatch.setattr(driver, "adapted", interrupted)
    blocks = METHODS[0].blocks(BODY, TIMES, START)
    kept = next(blocks)
    with pytest.raises(KeyboardInterrupt):
        next(blocks)
    assert 0 < len(kept.times) < len(TIMES)
    rest = METHODS[0].solve(BODY, TIMES, START, state=kept.resume)
    whole = METHODS[0].solve(BODY, TIMES, START)
    assert np.array_equal(np.concatenate([kept.states, rest.states]), whole.states)


def test_a_value_that_is_not_a_number_ends_the_run_with_the_last_finite_state_and_its_place():
    times = np.linspace(0, 2, 21)
    with pytest.raises(IntegrationError, match=r"dop853 stopped at t = 1\.3 s.* coordinate 1 is the first") as caught:
        Dop853().solve(failing(1.3), times, np.zeros(3))
    error = caught.value
    assert error.coordinate == 1
    assert error.t == pytest.approx(1.3, abs=1e-9)
    assert np.array_equal(error.times[:-1], times[times < error.t])
    assert error.states[-1] == pytest.approx([1.3, 1.3, 1.3**2 / 2], abs=1e-8)
    assert np.all(np.isfinite(error.states))
    assert error.steps.ended.startswith("failed")


def test_blocks_come_before_the_error_and_the_error_holds_the_last_state_alone():
    received = []
    with pytest.raises(IntegrationError) as caught:
        received += Dop853().blocks(failing(1.3), np.linspace(0, 2, 21), np.zeros(3))
    assert caught.value.times.shape == (1,)
    received.clear()
    blocks = Dop853().blocks(failing(1.3), np.linspace(0, 2, 21), np.zeros(3))
    received.append(next(blocks))
    assert received[0].times[-1] == pytest.approx(1.2)


def test_a_rate_that_fails_at_once_keeps_the_first_state():
    with pytest.raises(IntegrationError) as caught:
        Dop853().solve(failing(0.0), np.array([0.0, 1.0]), np.array([1.0, 2.0, 3.0]))
    assert caught.value.states.tolist() == [[1.0, 2.0, 3.0]]
    assert caught.value.coordinate == 1


def test_a_motion_that_leaves_all_bounds_is_told_with_its_coordinate():
    with pytest.raises(IntegrationError, match="coordinate 1") as caught:
        Dop853().solve(explosion(), np.linspace(0, 2, 5), np.array([0.0, 1.0]))
    assert caught.value.t == pytest.approx(1.0, abs=1e-9)
    assert caught.value.coordinate == 1


@pytest.mark.parametrize("method", METHODS[1:], ids=["esdirk4", "generalized_alpha"])
def test_implicit_methods_tell_values_that_are_not_numbers(method):
    broken = chain(np.ones(3), np.array([1.0, 1.0, np.nan, 1.0]))
    with pytest.raises(IntegrationError, match="not finite beyond this") as caught:
        method.solve(broken, np.array([0.0, 1.0]), np.array([1.0, 0, 0, 0, 0, 0]))
    assert caught.value.states.tolist() == [[1, 0, 0, 0, 0, 0]]


@pytest.mark.parametrize("times", [[], [0.0, 0.0], [1.0, 0.5], [0.0, np.nan], [[0.0, 1.0]]])
def test_output_times_out_of_order_are_refused(times):
    with pytest.raises(ValueError, match="strictly ascending"):
        Dop853().solve(oscillator(), np.array(times), [1.0, 0.0])


def test_a_first_state_that_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="the model has 2 states"):
        Dop853().solve(oscillator(), np.array([0.0, 1.0]), [1.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="coordinate 1 is nan"):
        Dop853().solve(oscillator(), np.array([0.0, 1.0]), [1.0, np.nan])


@with_methods
def test_a_single_output_time_is_the_first_state(method):
    solution = method.solve(BODY, np.array([3.0]), START)
    assert np.array_equal(solution.states, [START])
