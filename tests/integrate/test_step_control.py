"""The rules by which steps are cut, measured, refused and lengthened, each against its formula."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from femflex.integrate import Dop853, choose, hermite
from femflex.integrate import resume as head
from femflex.integrate.driver import adapted, checked
from femflex.integrate.intervals import interval, until
from femflex.integrate.outcome import Block, Steps, failure
from femflex.integrate.pace import MOST, TRIALS, Pace
from femflex.integrate.starting import asked, first_step, norm
from femflex.integrate.step_control import accept, cut, filtered, reject, retreat, scaled_norm, shorter, standing


def plain(kernel):
    """The function itself, not what is compiled of it."""
    return getattr(kernel, "py_func", kernel)


def state(**numbers) -> np.ndarray:
    out = np.zeros(head.HEAD + 3)
    out[head.SMALLEST] = math.inf
    for key, value in numbers.items():
        out[getattr(head, key)] = value
    return out


@pytest.mark.parametrize(
    ("h", "left", "wanted"),
    [(0.5, 0.5, 0.5), (0.5, 0.504, 0.504), (0.5, 0.506, 0.253), (0.5, 0.9, 0.45), (0.5, 1.0, 0.5),
     (0.5, 3.0, 0.5), (9.0, 1.0, 1.0)],
)  # fmt: skip
def test_the_last_two_steps_share_what_is_left(h, left, wanted):
    assert plain(cut)(2.0, h, 2.0 + left) == pytest.approx(wanted)


def test_a_call_ends_with_its_rows_its_end_its_budget_or_its_steps():
    at = state(T=2.0)
    found = [plain(standing)(*numbers, at) for numbers in (
        (3, 3, 0.1, 9.0, 5), (2, 3, 0.1, 2.0, 5), (2, 3, 0.1, 1.9, 5), (2, 3, 0.1, 9.0, 0), (2, 3, 0.1, 9.0, 1),
        (2, 3, 0.0, 9.0, 1), (2, 3, math.nan, 9.0, 1), (2, 3, 0.9 * head.TINY * 2.0, 9.0, 1),
        (2, 3, 1.1 * head.TINY * 2.0, 9.0, 1),
    )]  # fmt: skip
    stuck = [head.STUCK] * 3
    assert found == [head.FULL, head.END, head.END, head.PAUSE, head.GO_ON, *stuck, head.GO_ON]


def test_an_error_is_measured_by_the_larger_of_both_ends():
    e, x, y = np.array([1e-3, -4e-3, 2e-3]), np.array([1.0, -5.0, 0.0]), np.array([-2.0, 3.0, 0.0])
    atol = np.array([1e-3, 2e-3, 4e-3])
    wanted = math.sqrt(((1e-3 / 2.1e-2) ** 2 + (4e-3 / 5.2e-2) ** 2 + 0.25) / 3)
    assert plain(scaled_norm)(e, x, y, 1e-2, atol) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("fixed", [0.0, 0.1])
@pytest.mark.parametrize("bad", [None, 0, 1, 2])
@pytest.mark.parametrize("size", [0.5, 1.0, 1.5, math.inf])
def test_a_step_is_judged_by_its_error_and_by_every_rate_at_its_end(fixed, bad, size, monkeypatch):
    """The error of one entry of three is measured; a fixed step has none, but a rate that is not finite ends it too."""
    for name, part in vars(hermite).items():
        monkeypatch.setattr(hermite, name, plain(part))  # compiled parts serve kernels alone
    x, ydot, at = np.zeros(3), np.ones(3), state(CONTRACTION=0.1)
    if bad is not None:
        ydot[bad] = math.nan
    e = np.array([0.0, size * math.sqrt(3.0), 0.0])
    found = hermite.judged(0.2, 4, 0.1, fixed, e, x, x, ydot, 0.0, np.ones(3), at)
    error = 0.0 if fixed and math.isfinite(size) else size
    if error <= 1.0 and bad is None:
        assert found == pytest.approx(error) and at[head.CONTRACTION] == 0.1 and at[head.REJECTED] == 0
    else:
        assert found == -1.0 and at[head.CONTRACTION] == hermite.DOUBT and at[head.REJECTED] == 1


@pytest.mark.parametrize("signs", [0, 1])
def test_coordinates_that_are_renewed_have_their_own_rates_at_the_time_that_is_reached(monkeypatch, signs):
    """Of q = (q0, q1) the first changes its sign; its rate is then that of the new one, in the row of the end."""

    def switch(t, x):
        x[0] *= 1 - 2 * signs
        return signs

    def kinematic(t, q, u, out):
        out[:] = q * u[0] + t

    monkeypatch.setattr(hermite, "clipped", plain(hermite.clipped))
    vectors, at = np.zeros((4, 3)), state(T=2.5, DENSE=1.0)
    vectors[0], vectors[1], vectors[3] = [4.0, 5.0, 6.0], [24.5, 32.5, 7.0], [1.0, 2.0, 3.0]
    plain(hermite.renew_coordinates)(switch, kinematic, (), (0, 0.0, 2.0), 2, at, vectors)
    assert vectors[0].tolist() == [-4.0 if signs else 4.0, 5.0, 6.0] and vectors[3].tolist() == [1.0, 2.0, 3.0]
    assert vectors[1].tolist() == ([-22.0, 32.0, 7.0] if signs else [24.5, 32.5, 7.0])  # at 2 s, the end
    assert at[head.DENSE] == 1 - signs


def test_a_step_that_fails_is_cut_by_the_root_of_its_error():
    assert plain(shorter)(16.0, 4, 0.8, 0.1, 0.3) == pytest.approx(0.4)
    assert plain(shorter)(1e12, 4, 0.8, 0.1, 0.3) == 0.1
    assert [plain(shorter)(error, 4, 0.8, 0.1, 0.3) for error in (math.inf, math.nan, 1.0)] == [0.3] * 3


def test_a_refused_step_tells_the_coordinate_that_is_worst_in_its_own_tolerance():
    e, x, atol = np.array([3e-3, -5e-3, 4e-3]), np.array([0.0, 100.0, 0.1]), np.array([1e-3, 1e-3, 1e-3])
    at = state(REJECTED=4.0)
    plain(reject)(head.ERROR_TEST, 0.25, -1, e, x, 1e-2, atol, at)
    # 3, 5e-3 / 1.001, and 4e-3 / 2e-3
    assert (at[head.REJECTED], at[head.REJECTED_LAST], at[head.H]) == (5.0, 1.0, 0.25)
    assert (at[head.CAUSE], at[head.COORDINATE]) == (head.ERROR_TEST, 0)
    plain(reject)(head.NEWTON, 0.25, -1, e[::-1].copy() * [1, 200, 1], x, 1e-2, atol, at)
    assert (at[head.CAUSE], at[head.COORDINATE]) == (head.NEWTON, 0)
    plain(reject)(head.NEWTON, 0.1, 2, e, x, 1e-2, atol, at)
    assert (at[head.CAUSE], at[head.COORDINATE], at[head.REJECTED]) == (head.NOT_FINITE, 2, 7.0)
    plain(retreat)(0.05, at)
    assert (at[head.CAUSE], at[head.COORDINATE], at[head.H], at[head.REJECTED]) == (head.UNHELD, -1, 0.05, 8.0)


def test_the_filter_is_that_of_soederlind():
    at = state(T=3.0, T_OLD=2.5, ERROR=2e-2)
    factor = 0.95 * 0.3 ** (-1 / 32) * 2e-2 ** (-1 / 32) * (0.4 / 0.5) ** (-1 / 4)
    assert plain(filtered)(0.4, 0.3, 8, 0.1, 5.0, at) == pytest.approx(factor, rel=1e-12)
    assert plain(filtered)(0.4, 0.0, 8, 0.1, 1.5, at) == 1.5
    assert plain(filtered)(1e9, 1e9, 8, 0.4, 1.5, at) == 0.4
    first = state(T=3.0, T_OLD=3.0, ERROR=2e-2)
    wanted = 0.95 * (0.3 * 2e-2) ** (-1 / 32)
    assert plain(filtered)(0.4, 0.3, 8, 0.1, 5.0, first) == pytest.approx(wanted)


def test_an_accepted_step_is_counted_and_one_cut_short_keeps_the_size_that_was_wanted():
    at = state(T=2.0, T_OLD=1.9, REJECTED_LAST=1.0)
    plain(accept)(2.5, 0.5, 0.5, 3.0, 0.2, True, at)
    assert at[head.H] == 0.5 and at[head.REJECTED_LAST] == 0.0  # after a rejection it does not grow
    assert (at[head.T_OLD], at[head.T], at[head.ERROR], at[head.DENSE]) == (2.0, 2.5, 0.2, 1.0)
    plain(accept)(2.6, 0.1, 0.5, 2.0, 1e-9, False, at)
    assert (at[head.H], at[head.ERROR], at[head.DENSE]) == (0.5, 1e-4, 0.0)
    plain(accept)(3.6, 1.0, 1.0, 2.0, 0.1, False, at)
    plain(accept)(3.9, 0.3, 0.4, 3.0, 0.1, False, at)
    assert at[head.H] == pytest.approx(0.9)
    assert (at[head.ACCEPTED], at[head.SMALLEST], at[head.LARGEST]) == (4.0, 0.1, 1.0)


def test_a_smooth_interval_ends_at_the_next_break_and_its_model_is_asked_inside():
    breaks, up, down = np.array([1.0, 2.5, 4.0]), math.inf, -math.inf
    assert interval(0.5, 9.0, breaks) == (1.0, -math.inf, np.nextafter(1.0, down))
    assert interval(1.0, 9.0, breaks) == (2.5, np.nextafter(1.0, up), np.nextafter(2.5, down))
    assert interval(2.0, 2.2, breaks) == (2.2, np.nextafter(1.0, up), np.nextafter(2.5, down))
    assert interval(4.0, 9.0, breaks) == (9.0, np.nextafter(4.0, up), math.inf)
    clock = SimpleNamespace(next=lambda x: x[0])
    assert until(clock, np.array([2.1]), 2.0, 9.0, breaks)[0] == 2.1
    assert until(clock, np.array([1.5]), 2.0, 9.0, breaks)[0] == 2.0
    assert until(clock, np.array([7.0]), 2.0, 9.0, breaks) == interval(2.0, 9.0, breaks)
    assert until(None, np.array([2.1]), 2.0, 9.0, breaks) == interval(2.0, 9.0, breaks)
    asked_at = []
    model = SimpleNamespace(rate=lambda t, x, out, *rest: asked_at.append(t), table=None, pool=None, work=None)
    for t in (0.5, 1.7, 2.6):
        asked(model, t, np.zeros(1), np.zeros(1), (2.5, 1.1, 2.4))
    assert asked_at == [1.1, 1.7, 2.4]


def test_the_budget_of_a_call_aims_at_a_tenth_of_a_second():
    assert adapted(100, 0.2) == 50 and adapted(100, 0.05) == 200 and adapted(100, 1e-6) == 800 and adapted(1, 5.0) == 1


@pytest.mark.parametrize(
    ("times", "x0", "text"),
    [
        ([0.0, 0.0], [1.0, 2.0], "output times must be a list of at least one finite number, strictly ascending"),
        ([], [1.0, 2.0], "output times must be"),
        ([0.0, np.inf], [1.0, 2.0], "output times must be"),
        ([[0.0, 1.0]], [1.0, 2.0], "output times must be"),
        ([0.0], [1.0], "the first state has shape (1,); the model has 2 states"),
        ([0.0], [1.0, np.nan], "the first state is not finite: coordinate 1 is nan"),
    ],
)
def test_times_and_states_that_mean_nothing_are_refused(times, x0, text):
    with pytest.raises(ValueError) as error:
        checked(np.array(times), np.array(x0), 2)
    assert text in str(error.value)


@pytest.mark.parametrize(
    "settings", [{"rtol": -1e-3}, {"atol": 0.0}, {"atol": np.array([1.0, -1.0])}, {"max_step": 0.0}]
)
def test_settings_without_a_meaning_are_refused(settings):
    with pytest.raises(ValueError, match="must"):
        Dop853(**settings)


def test_the_first_step_is_that_of_hairer_norsett_and_wanner():
    A = np.array([[0.0, 1.0], [-9.0, -0.4]])
    model = SimpleNamespace(
        rate=lambda t, x, out, *rest: np.copyto(out, A @ x + [0.0, t]), table=None, pool=None, work=None
    )
    x, k1, rtol, atol = np.array([1.0, -2.0]), np.zeros(2), 1e-3, np.array([1e-4, 1e-2])
    found = first_step(model, 5, 2.0, (9.0, -math.inf, math.inf), x, k1, rtol, atol)
    scale = atol + rtol * abs(x)

    def size(v):
        return math.sqrt(np.mean((v / scale) ** 2))

    f0 = A @ x + [0.0, 2.0]
    np.testing.assert_allclose(k1, f0)
    h0 = 0.01 * size(x) / size(f0)
    f1 = A @ (x + h0 * f0) + [0.0, 2.0 + h0]
    d2 = size(f1 - f0) / h0
    assert found == pytest.approx(min(100 * h0, (0.01 / max(size(f0), d2)) ** (1 / 5)), rel=1e-12)
    short = first_step(model, 5, 2.0, (2.0 + h0 / 1e4, -math.inf, math.inf), x, k1, rtol, atol)
    assert short == pytest.approx(h0 / 100, rel=1e-9)
    assert first_step(model, 5, 0.0, (9.0, 0.0, 9.0), np.zeros(2), k1, rtol, atol) == pytest.approx(1e-4)
    assert norm(np.zeros(0)) == 0.0 and norm(np.array([3.0, -4.0])) == pytest.approx(math.sqrt(12.5))


def test_a_run_is_given_up_where_its_steps_would_take_for_ever():
    pace = Pace(state(ACCEPTED=3.0, REJECTED=2.0, T=1.0))
    assert not pace.hopeless(5 + TRIALS - 1, 1.0, 9.0)  # too early to tell
    assert pace.hopeless(5 + TRIALS, 1.0 + 0.9 * 8.0 * TRIALS / MOST, 9.0)
    assert not pace.hopeless(5 + 2 * TRIALS, 1.1, 9.0)
    assert not pace.hopeless(5 + 2 * TRIALS + 10, 1.1, 9.0)  # counted from the last look
    assert pace.hopeless(5 + 3 * TRIALS, 1.1, 9.0)


def test_a_block_tells_its_time_state_and_steps():
    at = state(
        N_X=2.0, T=4.0, ACCEPTED=7.0, REJECTED=3.0, EVALUATIONS=90.0, SMALLEST=0.1, LARGEST=0.7, H=0.3, COORDINATE=1.0
    )
    at[head.HEAD :] = [5.0, 6.0, 7.0]
    block = Block(np.zeros(0), np.zeros((0, 2)), at)
    assert block.t == 4.0 and block.x.tolist() == [5.0, 6.0]
    assert block.steps == Steps(7, 3, 90, 0.1, 0.7, "running")


@pytest.mark.parametrize(
    ("cause", "text"),
    [
        ("NOT_FINITE", "the motion is not finite beyond this: coordinate 1 is the first to fail"),
        ("ERROR_TEST", "no step is small enough to keep the error of coordinate 1 within the tolerance"),
        ("NEWTON", "Newton's iteration does not converge, worst in coordinate 1"),
        ("CREEPING", "with steps of 0.3 s it would need more than 1e+12 steps to the end"),
        ("EVENT", "an event gives numbers that are not finite, or repeats without end at the same time"),
        ("UNHELD", "no state beyond this satisfies all constraints"),
    ],
)
def test_a_failure_says_why_and_when(cause, text):
    at = state(CAUSE=getattr(head, cause), T=4.25, H=0.3, COORDINATE=1.0, ACCEPTED=7.0)
    error = failure("dop853", at, np.array([1.0, 2.0]))
    assert str(error).startswith(f"dop853 stopped at t = 4.25 s: {text}") and error.reason.startswith(text)
    assert error.steps.ended.startswith(f"failed: {text}") and error.steps.accepted == 7
    assert error.coordinate == 1 and error.t == 4.25 and error.states.tolist() == [[1.0, 2.0]]
    asked_of = []

    def diagnosis(t, x, unheld):
        asked_of.append((t, x.tolist(), unheld))
        return "the boom is at its end", KeyError("boom")

    told = failure("dop853", at, np.array([1.0, 2.0]), SimpleNamespace(diagnosis=diagnosis))
    assert "4.25 s: the boom is at its end. The state" in str(told) and isinstance(told.__cause__, KeyError)
    assert asked_of == [(4.25, [1.0, 2.0], cause == "UNHELD")]
    silent = failure("dop853", at, np.zeros(2), SimpleNamespace(diagnosis=lambda t, x, unheld: ("", None)))
    assert text in str(silent)


def test_the_choice_tells_the_band_the_method_and_its_kind():
    none = choose(0.0, 10.0, 0.1, None)
    assert none.sentence == "dop853 (explicit, order 8): the model has no linear vibration (0 Hz)."
    edge = choose(math.pi / 0.1, 1e9, 0.1, None)  # just what the output can show
    assert (
        edge.name == "dop853"
        and "the highest natural frequency is 5 Hz, the highest in the output 5 Hz" in edge.sentence
    )
    why = choose(4.0 * math.pi, 10.0, 0.1, None, band=6.0 * math.pi, asked="esdirk4", why="it has latches")
    assert why.name == "esdirk4"
    assert why.sentence == ("esdirk4 (it has latches): the highest natural frequency is 2 Hz, the highest wanted 3 Hz.")
