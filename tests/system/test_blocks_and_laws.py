"""Blocks, control laws and sampled sensors against their transfer functions and formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from support.effector_builders import Sensor, plain

from femflex.effectors import (
    Allocation,
    AttitudeFeedback,
    LinearSystem,
    LowPass,
    MomentumManagement,
    Notch,
    Observer,
    Pd,
    Pid,
    Pulses,
    Sampling,
)
from femflex.effectors import Sensor as SensorNoun
from femflex.effectors.control_laws import discretised
from femflex.system import Context

POINTS = (0.3, 0.2 + 1.7j, -0.1 + 9.0j)


def law_of(noun, n=None, **keys):
    """The matrices of a controller for n inputs."""
    return noun(inputs=[f"a.{k}" for k in range(n or 1)], **keys).system(n or 1)


def transfer(law, s):
    A, B, C, D = law
    return C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D


@pytest.mark.parametrize("s", POINTS)
def test_filters_have_their_transfer_function_in_every_channel(s):
    w, wn = 2 * math.pi * 0.7, 2 * math.pi * 0.4
    wanted = [
        (LowPass, {"frequency": 0.7}, w / (s + w)),
        (LowPass, {"frequency": 0.7, "order": 2, "damping": 0.3}, w**2 / (s**2 + 0.6 * w * s + w**2)),
        (LowPass, {"frequency": 0.7, "order": 2}, w**2 / (s**2 + math.sqrt(2.0) * w * s + w**2)),
        (
            Notch,
            {"frequency": 0.4, "width": 0.25, "depth": 0.2},
            (s**2 + 0.1 * wn * s + wn**2) / (s**2 + 0.5 * wn * s + wn**2),
        ),
        (Notch, {"frequency": 0.4}, (s**2 + wn**2) / (s**2 + 2 * wn * s + wn**2)),
    ]
    for noun, keys, value in wanted:
        np.testing.assert_allclose(transfer(law_of(noun, 3, **keys), s), value * np.eye(3), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("s", POINTS)
def test_pd_and_pid_transfer_functions(s):
    P, I, D = [2.0, 3.0], [0.5, 0.7], [11.0, 13.0]
    pd, pid = law_of(Pd, 4, stiffness=P, damping=D), law_of(Pid, 4, stiffness=P, integral=I, damping=D)
    np.testing.assert_allclose(transfer(pd, s), -np.hstack([np.diag(P), np.diag(D)]))
    np.testing.assert_allclose(transfer(pid, s), -np.hstack([np.diag(P) + np.diag(I) / s, np.diag(D)]), rtol=1e-12)


@pytest.mark.parametrize("s", POINTS)
def test_observer_equals_the_loop_of_model_and_feedback(s):
    rng = np.random.default_rng(3)
    A, B, C = rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), rng.normal(size=(1, 3))
    K, L = rng.normal(size=(2, 3)), rng.normal(size=(3, 1))
    # x from s x = A x + B v + L (y - C x) with v = -K x, written as one linear system in (x, v) for y = 1
    left = np.block([[s * np.eye(3) - A + L @ C, -B], [K, np.eye(2)]])
    v = np.linalg.solve(left, np.vstack([L, np.zeros((2, 1))]))[3:]
    found = law_of(
        Observer, **{k: plain(m) for k, m in {"A": A, "B": B, "C": C, "feedback": K, "correction": L}.items()}
    )
    np.testing.assert_allclose(transfer(found, s), v, rtol=1e-10)


def test_allocation_has_the_least_norm():
    E = np.array([[1.0, 0.5, -0.2, 0.3], [0.1, -0.8, 0.6, 0.4]])
    D = law_of(Allocation, 2, effect=plain(E)).D
    np.testing.assert_allclose(E @ D, np.eye(2), atol=1e-12)
    np.testing.assert_allclose(np.linalg.svd(E)[2][2:] @ D, 0.0, atol=1e-12)  # nothing that demands nothing
    h = np.array([1.0, -2.0, 3.0, 0.5])
    np.testing.assert_allclose(law_of(MomentumManagement, 4, rate=0.25, effect=plain(E)).D @ h, -0.25 * (E @ h))


def test_sampled_block_equals_zero_order_hold_discretisation():
    rng = np.random.default_rng(5)
    matrices = {
        key: plain(rng.normal(size=size)) for key, size in zip("ABCD", ((3, 3), (3, 2), (2, 3), (2, 2)), strict=True)
    }
    keys = {"inputs": ["a.b.x", "c.y"], "outputs": ["p", "q"], **matrices}
    one = LinearSystem(**keys).system(2)
    h, x, u = 0.4, rng.normal(size=3), rng.normal(size=2)
    grown = expm(one.A * h)
    exact = grown @ x + np.linalg.solve(one.A, (grown - np.eye(3)) @ one.B @ u)  # A^-1 (e^(A h) - 1) B u
    found = discretised(one, h)
    np.testing.assert_allclose(found.A @ x + found.B @ u, exact, rtol=1e-9)
    law = LinearSystem(**keys, period=h, limit=[0.3, 50.0]).controller("law").law
    assert law.paths == ("effectors/a.b/x", "effectors/c/y")
    sensors = {"effectors/a.b/x": np.array(u[0]), "effectors/c/y": np.array(u[1])}
    y, memory = law(1.0, sensors, x)
    np.testing.assert_allclose(y, np.clip(one.C @ x + one.D @ u, [-0.3, -50.0], [0.3, 50.0]))
    np.testing.assert_allclose(memory, exact, rtol=1e-9)
    scaled = LinearSystem(**keys, period=h, limit=[0.3, 0.2], scaled=True).controller("law").law
    y, _ = scaled(1.0, sensors, x)
    raw = one.C @ x + one.D @ u
    assert abs(y[0] * raw[1] - y[1] * raw[0]) < 1e-12
    assert max(abs(y) / [0.3, 0.2]) == pytest.approx(1.0) and y @ raw > 0.0


def test_attitude_feedback_is_its_formula():
    rng = np.random.default_rng(7)
    P, D, J = (
        rng.normal(size=(3, 3)),
        rng.normal(size=(3, 3)),
        np.array([[5.0, 0.1, 0.2], [0.1, 6.0, 0.3], [0.2, 0.3, 7.0]]),
    )
    e, w, H = rng.normal(size=(3, 3))
    context = Context({name: SensorNoun(kind=kind, body="hub") for name, kind in (("s", "attitude"), ("g", "rate"))})
    momentum = ["h.x", "h.y", "h.z"]
    given = dict(zip([f"effectors/{n}/{axis}" for n in "sgh" for axis in "xyz"], np.ravel([e, w, H]), strict=True))

    def torque(**keys):
        law = AttitudeFeedback(error="s", rate="g", period=0.1, **keys).controller("law", context).law
        return law(0.0, given, np.zeros(0))[0]

    for wheels, inertia in ((True, J), (False, J), (False, None)):
        more = {} if inertia is None else {"inertia": plain(inertia)}
        found = torque(stiffness=plain(P), damping=plain(D), momentum=momentum if wheels else None, limit=1e9, **more)
        L = (0.0 * J if inertia is None else J) @ w + (H if wheels else 0.0)
        np.testing.assert_allclose(found, -P @ e - D @ w + np.cross(w, L))
    np.testing.assert_allclose(torque(stiffness=[1.0, 2.0, 3.0], damping=0.0, limit=1e-3), -1e-3 * np.sign(e))
    np.testing.assert_allclose(torque(stiffness=[1.0, 2.0, 3.0], damping=4.0), -e * [1.0, 2.0, 3.0] - 4.0 * w)


def test_pulse_widths_follow_the_demands():
    jets = Pulses(
        inputs=[f"d.{k}" for k in "abcde"], outputs=list("abcde"), full=[2.0, 4.0, 1.0, 5.0, 1.0], period=0.5,
        minimum_on=0.06,
    )  # fmt: skip
    (one,) = jets.effectors("jets")
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
