"""Blocks, control laws and sampled sensors against their transfer functions and formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from support.effector_builders import Sensor

from femflex.effectors import (
    Sampling,
    allocation,
    attitude_feedback,
    block,
    low_pass,
    momentum_management,
    notch,
    observer,
    pd,
    pid,
    pulses,
    state_space,
)
from femflex.effectors.blocks import discretised

POINTS = (0.3, 0.2 + 1.7j, -0.1 + 9.0j)


def transfer(system, s):
    A, B, C, D = system
    return C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D


@pytest.mark.parametrize("s", POINTS)
def test_filters_have_their_transfer_function_in_every_channel(s):
    w, wn = 2 * math.pi * 0.7, 2 * math.pi * 0.4
    wanted = [
        (low_pass(0.7, channels=3), w / (s + w)),
        (low_pass(0.7, 2, 0.3, 3), w**2 / (s**2 + 0.6 * w * s + w**2)),
        (low_pass(0.7, 2, channels=3), w**2 / (s**2 + math.sqrt(2.0) * w * s + w**2)),
        (notch(0.4, 0.25, 0.2, 3), (s**2 + 0.1 * wn * s + wn**2) / (s**2 + 0.5 * wn * s + wn**2)),
        (notch(0.4, channels=3), (s**2 + wn**2) / (s**2 + 2 * wn * s + wn**2)),
    ]
    for system, value in wanted:
        np.testing.assert_allclose(transfer(system, s), value * np.eye(3), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("s", POINTS)
def test_pd_and_pid_transfer_functions(s):
    P, I, D = np.array([2.0, 3.0]), np.array([0.5, 0.7]), np.array([11.0, 13.0])
    np.testing.assert_allclose(transfer(pd(P, D), s), -np.hstack([np.diag(P), np.diag(D)]))
    np.testing.assert_allclose(transfer(pid(P, I, D), s), -np.hstack([np.diag(P + I / s), np.diag(D)]), rtol=1e-12)


@pytest.mark.parametrize("s", POINTS)
def test_observer_equals_the_loop_of_model_and_feedback(s):
    rng = np.random.default_rng(3)
    A, B, C = rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), rng.normal(size=(1, 3))
    K, L = rng.normal(size=(2, 3)), rng.normal(size=(3, 1))
    # x from s x = A x + B v + L (y - C x) with v = -K x, written as one linear system in (x, v) for y = 1
    left = np.block([[s * np.eye(3) - A + L @ C, -B], [K, np.eye(2)]])
    v = np.linalg.solve(left, np.vstack([L, np.zeros((2, 1))]))[3:]
    np.testing.assert_allclose(transfer(observer(A, B, C, K, L), s), v, rtol=1e-10)


def test_allocation_has_the_least_norm():
    E = np.array([[1.0, 0.5, -0.2, 0.3], [0.1, -0.8, 0.6, 0.4]])
    D = allocation(E).D
    np.testing.assert_allclose(E @ D, np.eye(2), atol=1e-12)
    np.testing.assert_allclose(np.linalg.svd(E)[2][2:] @ D, 0.0, atol=1e-12)  # nothing that demands nothing
    h = np.array([1.0, -2.0, 3.0, 0.5])
    np.testing.assert_allclose(momentum_management(0.25, E).D @ h, -0.25 * (E @ h))


def test_sampled_block_equals_zero_order_hold_discretisation():
    rng = np.random.default_rng(5)
    one = state_space(
        rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), rng.normal(size=(2, 3)), rng.normal(size=(2, 2))
    )
    h, x, u = 0.4, rng.normal(size=3), rng.normal(size=2)
    grown = expm(one.A * h)
    exact = grown @ x + np.linalg.solve(one.A, (grown - np.eye(3)) @ one.B @ u)  # A^-1 (e^(A h) - 1) B u
    found = discretised(one, h)
    np.testing.assert_allclose(found.A @ x + found.B @ u, exact, rtol=1e-9)
    law = block("law", one, ("a.b.x", "c.y"), ("p", "q"), period=h, limit=[0.3, 50.0]).law
    assert law.paths == ("effectors/a.b/x", "effectors/c/y")
    sensors = {"effectors/a.b/x": np.array(u[0]), "effectors/c/y": np.array(u[1])}
    y, memory = law(1.0, sensors, x)
    np.testing.assert_allclose(y, np.clip(one.C @ x + one.D @ u, [-0.3, -50.0], [0.3, 50.0]))
    np.testing.assert_allclose(memory, exact, rtol=1e-9)
    scaled = block("law", one, ("a.b.x", "c.y"), ("p", "q"), period=h, limit=[0.3, 0.2], scaled=True).law
    y, _ = scaled(1.0, sensors, x)
    raw = one.C @ x + one.D @ u
    assert abs(y[0] * raw[1] - y[1] * raw[0]) < 1e-12
    assert max(abs(y) / [0.3, 0.2]) == pytest.approx(1.0) and y @ raw > 0.0


def test_attitude_feedback_is_its_formula():
    rng = np.random.default_rng(7)
    P, D, J = (rng.normal(size=(3, 3)) for _ in range(3))
    e, w, H = rng.normal(size=(3, 3))
    names = [("s.x", "s.y", "s.z"), ("g.x", "g.y", "g.z"), ("h.x", "h.y", "h.z")]
    given = dict(zip([f"effectors/{n[0]}/{n[2]}" for group in names for n in group], np.ravel([e, w, H]), strict=True))
    for wheels, inertia in ((True, J), (False, J), (False, None)):
        one = attitude_feedback(
            "law", names[0], names[1], P, D, inertia=inertia, momentum=names[2] if wheels else (), period=0.1, limit=1e9
        )
        L = (0.0 * J if inertia is None else J) @ w + (H if wheels else 0.0)
        gyroscopic = np.array([w[1] * L[2] - w[2] * L[1], w[2] * L[0] - w[0] * L[2], w[0] * L[1] - w[1] * L[0]])
        np.testing.assert_allclose(one.law(0.0, given, np.zeros(0))[0], -P @ e - D @ w + gyroscopic)
    short = attitude_feedback("law", names[0], names[1], [1.0, 2.0, 3.0], 0.0, period=0.1, limit=1e-3)
    np.testing.assert_allclose(short.law(0.0, given, np.zeros(0))[0], -1e-3 * np.sign(e))
    gains = attitude_feedback("law", names[0], names[1], [1.0, 2.0, 3.0], 4.0, period=0.1).law
    np.testing.assert_allclose(gains(0.0, given, np.zeros(0))[0], -e * [1.0, 2.0, 3.0] - 4.0 * w)


def test_pulse_widths_follow_the_demands():
    one = pulses("jets", ["d.a", "d.b", "d.c", "d.d", "d.e"], list("abcde"), [2.0, 4.0, 1.0, 5.0, 1.0], 0.5, 0.06)
    demands = dict(zip([f"effectors/d/{k}" for k in "abcde"], [0.8, 0.8, 7.0, 0.5, -0.3], strict=True))
    t, memory, instants, on = 3.0, one.memory, [], []
    while t is not None and t < 3.5 - 1e-9:
        command, memory, t_next = one.law(t, {k: np.array(v) for k, v in demands.items()}, memory)
        instants.append(t)
        on.append(command)
        t = t_next
    # a: 0.4 of 0.5 s; b: 0.2; c: throughout; d: 0.05 s is shorter than the shortest; e pushes the other way
    np.testing.assert_allclose(instants, [3.0, 3.1, 3.2])
    np.testing.assert_array_equal(on, [[1, 1, 1, 0, 0], [1, 0, 1, 0, 0], [0, 0, 1, 0, 0]])


@pytest.mark.parametrize(("delay", "late", "rest"), [(0.0, 0, 0.0), (0.3, 3, 0.0), (0.25, 2, 0.05), (0.05, 0, 0.05)])
def test_sampled_sensor_delays_and_quantises(delay, late, rest):
    sensor = Sensor("gyro", "rate", "hub", bias=[0.5, -1.0, 2.0], sampling=Sampling(0.1, delay, quantum=0.25))
    exact, one = sensor.effectors
    assert exact.name == "gyro_exact" and not exact.parameters[2:5].any()
    memory, seen = one.memory, []
    for k in range(8):
        value = np.array([0.3 * k, 1.0 - 0.7 * k, 0.11 * k])
        given = {f"effectors/gyro_exact/{axis}": v for axis, v in zip("xyz", value, strict=True)}
        known, memory, later = one.law(0.1 * k, given, memory)
        if rest:
            assert later == pytest.approx(0.1 * k + rest)
            known, memory, later = one.law(later, {p: np.array(np.nan) for p in given}, memory)
        assert later is None
        seen.append(known)

    def measured(k):
        return 0.25 * np.rint(np.array([0.3 * k + 0.5, -0.7 * k, 0.11 * k + 2.0]) / 0.25)

    for k in range(8):
        np.testing.assert_allclose(seen[k], measured(max(k - late, 0)), atol=1e-12)
