"""Whole runs of every method against the same rules in dense Python: the same steps, refusals, counts and rows.

Stages of the explicit method are those of scipy's table; those of the implicit methods are solved exactly, for the
models are linear.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import DOP853 as table
from support.integrate_models import chain, chain_matrices, kepler

from femflex.integrate import Dop853, Esdirk4, GeneralizedAlpha
from femflex.integrate.esdirk_table import ERROR, GAMMA
from femflex.integrate.esdirk_table import A as STAGES


def cut(h: float, left: float) -> float:
    """A step before the end: the last two share what is left."""
    if 1.01 * h >= left:
        return left
    return left / 2 if 2 * h > left else h


def rms(v: np.ndarray) -> float:
    return math.sqrt(np.mean(v**2))


class Notes:
    """Steps that were taken and refused."""

    def __init__(self) -> None:
        self.sizes, self.rejected, self.calls = [], 0, 0

    def agree(self, steps, rel=1e-6) -> None:
        assert (steps.accepted, steps.rejected) == (len(self.sizes), self.rejected)
        assert steps.smallest == pytest.approx(min(self.sizes), rel=rel)
        assert steps.largest == pytest.approx(max(self.sizes), rel=rel)


def first_step(f, order: int, x: np.ndarray, k1: np.ndarray, rtol: float, atol: np.ndarray, end: float) -> float:
    """Hairer, Norsett & Wanner (1993), II.4."""
    scale = atol + rtol * np.abs(x)
    h0 = min(0.01 * rms(x / scale) / rms(k1 / scale), end)
    d2 = rms((f(h0, x + h0 * k1) - k1) / scale) / h0
    return min(100 * h0, (0.01 / max(rms(k1 / scale), d2)) ** (1 / order))


def dormand_prince(f, x, end, rtol, atol, times, max_step):
    """States (n_t, n_x) at the times, and the notes, by DOP853 with the filter H211b of Soederlind."""
    notes, rows = Notes(), [x]
    t, k1 = 0.0, f(0.0, x)
    h = min(first_step(f, 8, x, k1, rtol, atol, end), max_step)
    notes.calls = 2
    before, error_before, refused = 0.0, 1e-4, False
    while t < end:
        wanted = min(h, max_step)
        step = cut(wanted, end - t)
        k = np.zeros((16, len(x)))
        k[0] = k1
        for s in range(1, 12):
            k[s] = f(t + table.C[s] * step, x + step * table.A[s, :s] @ k[:s])
        y = x + step * table.B @ k[:12]
        notes.calls += 11
        scale = atol + rtol * np.maximum(np.abs(x), np.abs(y))
        e5, e3 = (np.sum((weights[:12] @ k[:12] / scale) ** 2) for weights in (table.E5, table.E3))
        error = step * e5 / math.sqrt((e5 + 0.01 * e3) * len(x))
        if error > 1.0:
            h, refused = step * max(1 / 3, 0.95 * error ** (-1 / 8)), True
            notes.rejected += 1
            continue
        k[12] = f(t + step, y)
        notes.calls += 1
        ahead = [time for time in times[len(rows) :] if time < t + step]
        if ahead:
            for s in range(13, 16):
                k[s] = f(t + table.C_EXTRA[s - 13] * step, x + step * table.A_EXTRA[s - 13, :s] @ k[:s])
            notes.calls += 3
        F = np.zeros((7, len(x)))
        F[0], F[1] = y - x, step * k[0] - (y - x)
        F[2], F[3:] = 2 * (y - x) - step * (k[12] + k[0]), step * table.D @ k
        for time in ahead:
            part, inner = (time - t) / step, np.zeros(len(x))
            for i, row in enumerate(F[::-1]):
                inner = (inner + row) * (part if i % 2 == 0 else 1 - part)
            rows.append(x + inner)
        ratio = step / before if before else 1.0
        factor = min(6.0, max(1 / 3, 0.95 * (max(error, 1e-10) * error_before) ** (-1 / 32) * ratio ** (-1 / 4)))
        factor = min(factor, 1.0) if refused else factor
        h = max(step * factor, wanted) if step < wanted else step * factor
        error_before, refused, before = max(error, 1e-4), False, step
        t, x, k1 = (end if step == end - t else t + step), y, k[12]
        notes.sizes.append(step)
        if len(rows) < len(times) and times[len(rows)] == t:
            rows.append(x)
    return np.array(rows), notes


@pytest.mark.parametrize("max_step", [math.inf, 0.05])
def test_the_explicit_method_takes_the_steps_of_its_formulas(max_step):
    """An ellipse from its perigee on: steps of all sizes, some of them refused, rows within them and at the end."""
    model, x0 = kepler(), np.array([0.2, 0.0, 0.0, 3.0])
    out = np.empty(4)

    def f(t, x):
        model.rate(t, np.ascontiguousarray(x), out, model.table, model.pool, model.work)
        return out.copy()

    times = np.array([0.0, 0.31, 0.32, 1.9, 4.0, 7.0])
    rtol, atol = 1e-6, np.array([1e-7, 3e-6, 1e-7, 2e-8])
    rows, notes = dormand_prince(f, x0, 7.0, rtol, atol, times, max_step)
    found = Dop853(rtol=rtol, atol=atol, max_step=max_step).solve(model, times, x0)
    assert notes.rejected > 0 or max_step < 1.0
    notes.agree(found.steps)
    assert found.steps.evaluations == notes.calls
    np.testing.assert_allclose(found.states, rows, rtol=1e-7, atol=1e-9)


SPRINGS, DAMPERS, MASSES = np.array([3.0, 40.0, 900.0, 2.0]), np.array([0.1, 0.4, 0.2, 0.3]), np.array([1.0, 0.5, 2.0])
PUSH, OMEGA = 2.5, 3.0


def pushed():
    """A chain whose last mass is pushed, its right side udot = g(t, q, u), and its first-order form."""
    model = chain(MASSES, SPRINGS, DAMPERS, force=PUSH, w=OMEGA)
    M, D, K = chain_matrices(model)
    inverse = np.linalg.inv(M)

    def push(t):
        return inverse @ (PUSH * math.sin(OMEGA * t) * np.eye(3)[2])

    return model, inverse @ D, inverse @ K, push


def hermite(part, h, x0, v0, x1, v1):
    s = part
    return (
        (1 + 2 * s) * (1 - s) ** 2 * x0 + s * (1 - s) ** 2 * h * v0 + s**2 * (3 - 2 * s) * x1 + s**2 * (s - 1) * h * v1
    )


def controlled(step_of, order, shrink, grow, x, v, end, h, max_step, times, fixed=0.0):
    """Rows and notes of a method with step_of(t, h, x, v) -> (end, its rate, scaled error) and the PI controller."""
    notes, rows = Notes(), []
    t, error_before, refused, h = 0.0, 1e-4, False, min(h, max_step)
    while t < end:
        wanted = min(h, max_step)
        step = cut(wanted, end - t)
        y, w, error, keep = step_of(t, step, x, v)
        error = 0.0 if fixed else error
        if error > 1.0:
            h, refused = step * max(shrink, 0.9 * error ** (-1 / order)), True
            notes.rejected += 1
            continue
        for time in [time for time in times[len(rows) :] if time < t + step]:
            rows.append(hermite((time - t) / step, step, x, v, y, w))
        factor = 0.9 * error ** (-0.7 / order) * error_before ** (0.4 / order) if error > 0 else grow
        factor = min(grow, max(shrink, factor))
        factor = min(factor, 1.0) if refused else factor
        h = max(step * factor, wanted) if step < wanted else step * factor
        h = min(fixed, 2 * step) if fixed else h
        error_before, refused = max(error, 1e-4), False
        t, x, v = (end if step == end - t else t + step), y, w
        keep(step)
        notes.sizes.append(step)
        if len(rows) < len(times) and times[len(rows)] == t:
            rows.append(x)
    return np.array(rows), notes


def scaled(e, x, y, rtol, atol):
    return rms(e / (atol + rtol * np.maximum(np.abs(x), np.abs(y))))


X0 = np.array([0.3, -0.1, 0.02, 0.0, 1.0, -0.5])
TIMES = np.array([0.0, 0.11, 0.5, 1.3, 2.0])


@pytest.mark.parametrize(
    ("rtol", "max_step", "fixed"), [(1e-5, math.inf, 0.0), (1e-3, 0.03, 0.0), (1e-4, math.inf, 0.02)]
)
def test_the_implicit_runge_kutta_method_takes_the_steps_of_its_formulas(rtol, max_step, fixed):
    model, D, K, push = pushed()
    atol, b = np.full(6, 0.1 * rtol), STAGES[5]

    def f(t, x):
        return np.concatenate([x[3:], push(t) - D @ x[3:] - K @ x[:3]])

    def step_of(t, h, x, v):
        k = np.zeros((6, 6))
        k[0] = v
        L = np.block([[np.zeros((3, 3)), np.eye(3)], [-K, -D]])
        for s in range(1, 6):
            known = x + h * STAGES[s, :s] @ k[:s]
            k[s] = np.linalg.solve(np.eye(6) - GAMMA * h * L, f(t + STAGES[s].sum() * h, known))
        y = x + h * b @ k
        return y, k[5], scaled(h * ERROR @ k, x, y, rtol, atol), lambda h: None

    v0 = f(0.0, X0)
    h = fixed or first_step(f, 4, X0, v0, rtol, atol, 2.0)
    rows, notes = controlled(step_of, 4, 0.25, 4.0, X0, v0, 2.0, h, max_step, TIMES, fixed)
    settings = {"step": fixed} if fixed else {}
    found = Esdirk4(rtol=rtol, atol=atol, max_step=max_step, **settings).solve(model, TIMES, X0)
    notes.agree(found.steps, rel=1e-3)
    np.testing.assert_allclose(found.states, rows, atol=3e-2 * rtol)


@pytest.mark.parametrize(("rho", "rtol", "fixed"), [(0.8, 1e-4, 0.0), (0.3, 1e-3, 0.0), (0.6, 1e-3, 0.015)])
def test_generalized_alpha_takes_the_steps_of_its_formulas(rho, rtol, fixed):
    model, D, K, push = pushed()
    atol = np.full(6, 0.1 * rtol)
    alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    beta, gamma = 0.25 * (1 - alpha_m + alpha_f) ** 2, 0.5 - alpha_m + alpha_f
    d = alpha_m - alpha_f
    lag = 0.5 * ((1 - alpha_f) - (1 - alpha_m) * (1 + d) ** 2 - alpha_m * d**2)
    C_q, C_u = 0.5 * d + beta - 1 / 6, 0.5 * ((1 - gamma) * d**2 + gamma * (1 + d) ** 2) + lag - 1 / 6

    def f(t, x):
        return np.concatenate([x[3:], push(t) - D @ x[3:] - K @ x[:3]])

    v0 = f(0.0, X0)
    h = fixed or first_step(f, 2, X0, v0, rtol, atol, 2.0)
    small = 1e-4 * h
    jerk = (f(small, X0 + small * v0) - v0)[3:] / small
    kept = {"slope": d * jerk, "mean": jerk, "before": 0.0}

    def step_of(t, h, x, v):
        q, u, w = x[:3], x[3:], v[3:]
        a = w + h * kept["slope"]
        ratio = (1 - alpha_f) / (1 - alpha_m)
        rest = (alpha_f * w - alpha_m * a) / (1 - alpha_m)  # a_1 = ratio w_1 + rest
        q_0 = q + h * u + h**2 * ((0.5 - beta) * a + beta * rest)
        u_0 = u + h * ((1 - gamma) * a + gamma * rest)
        S = np.eye(3) + gamma * h * ratio * D + beta * h**2 * ratio * K
        w_1 = np.linalg.solve(S, push(t + h) - D @ u_0 - K @ q_0)
        a_1 = ratio * w_1 + rest
        y = np.concatenate([q_0 + beta * h**2 * ratio * w_1, u_0 + gamma * h * ratio * w_1])
        between = 0.5 * (h + kept["before"])
        e = np.concatenate([
            C_q * h**2 * (a_1 - w - h * kept["slope"]), C_u * h**3 * ((w_1 - w) / h - kept["mean"]) / between
        ])  # fmt: skip

        def keep(h):
            kept.update(slope=(a_1 - w_1) / h, mean=(w_1 - w) / h, before=h)

        return y, np.concatenate([y[3:], w_1]), scaled(e, x, y, rtol, atol), keep

    rows, notes = controlled(step_of, 3, 0.3, 3.0, X0, v0, 2.0, h, math.inf, TIMES, fixed)
    settings = {"step": fixed} if fixed else {}
    found = GeneralizedAlpha(rho=rho, rtol=rtol, atol=atol, **settings).solve(model, TIMES, X0)
    notes.agree(found.steps, rel=1e-3)
    np.testing.assert_allclose(found.states, rows, atol=3e-2 * rtol)
