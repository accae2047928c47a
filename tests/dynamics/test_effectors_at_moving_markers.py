"""Effectors of femflex at markers of a tumbling flexible tree: formulas over jets of the markers, and virtual work."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.effector_builders import Sensor, Supply, cable, control_moment_gyro, reaction_wheel, signal, tank, thruster
from support.pointwise import Jet, Tree
from support.random_systems import random_state, random_tree

from femflex.dynamics import compile_system
from femflex.system import Profile

T = 0.7  # s
TREE, _, (Q, U) = random_tree(28, n_bodies=4)  # all four bend
ONE, TWO = (TREE.order[1], "a"), (TREE.order[2], "a")


def unit(v):
    return np.asarray(v, float) / np.linalg.norm(v)


def vee(W):
    return np.array([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]) / 2


@cache
def motion(where):
    """Place, axes C_NM, velocity and angular rate of a marker at the state (Q, U), inertial components."""
    return motion_at(where, Q, U)


@cache
def partial_motion(where):
    """Velocity and angular rate of a marker per unit of every quasi-velocity, (n, 3) each."""
    moves = [motion_at(where, Q, along)[2:] for along in np.eye(len(U))]
    return np.array([v for v, _ in moves]), np.array([w for _, w in moves])


def motion_at(where, q, u):
    tree = Tree(TREE, {name: ((), (), ()) for name in TREE.bodies})
    tree.points(q, u, 0 * u, Jet(np.eye(3)))
    body, marker = where
    C, r = tree.frames[body]
    C_BM, r_BM = tree.marker(TREE.bodies[body].marker(marker), tree.delta[body])
    axes, place = C @ C_BM, r + C @ r_BM
    return place.v, axes.v, place.d, vee(axes.d @ axes.v.T)


def observed_channels(*effectors, z0=None, t=T, q=Q, u=U):
    """Channels of a model of the tree with these effectors at (t, q, u), its states at their start, and the model."""
    model = compile_system(replace(TREE, effectors=effectors, z0=z0 or {}))
    x = np.concatenate([q, u, model.parts(model.x0)[2]])
    return {path: v[0] for path, v in model.observe(np.array([t]), x[None]).items()}, model, x


def rates_of_states(model, x, t=T):
    return model.state_rate(t, x)[model.n_q + model.n_u :]


def check_work(model, x, out, effector):
    """The equations hold what force and torque at the markers do along every coordinate, and their power is told."""
    none, path = np.zeros((len(effector.markers), 3)), f"effectors/{effector.name}"  # not exerted: no channel
    force, torque = (np.reshape(out.get(f"{path}/{key}", none), (-1, 3)) for key in ("force", "torque"))
    n, power = model.n_u, 0.0
    expected = np.zeros(n)
    for where, F, M in zip(effector.markers, force, torque, strict=True):
        V, W = partial_motion(where)
        expected += V @ F + W @ M
        _, _, v, w = motion(where)
        power += F @ v + M @ w
    push = model_without_effectors().residual(T, x[: model.n_q + n], np.zeros(n)) - model.residual(T, x, np.zeros(n))
    assert push == pytest.approx(expected, abs=1e-11 * max(1.0, np.abs(expected).max()))
    assert out[f"effectors/{effector.name}/power"] == pytest.approx(power, rel=1e-10)
    assert np.count_nonzero(np.abs(expected) > 1e-6) > 3


@cache
def model_without_effectors():
    return compile_system(TREE)


@pytest.mark.parametrize("z", [1.0, -60.0, 79.7, 80.3], ids=["slow", "backwards", "at its limit", "beyond it"])
@pytest.mark.parametrize("mode", ["torque", "speed", "too fast", "signal"])
def test_wheel_on_flexible_body_satisfies_rotor_balance(mode, z):
    J, axis, most = 0.4, unit([1.0, -2.0, 0.5]), {"max_torque": 1.5, "max_speed": 80.0}
    command = {
        "torque": {"torque": 1.1},
        "speed": {"speed": 78.0, "bandwidth": 3.0},
        "too fast": {"speed": 200.0, "bandwidth": 0.01},
        "signal": {"torque": "in.value"},
    }
    source = signal("in", [0.0, 2.0], [-4.0, 1.0])
    wheel = reaction_wheel("w", *ONE[:1], J, marker=ONE[1], axis=axis, viscous=0.01, coulomb=0.2, coulomb_speed=3.0,
                           **most, **command[mode])  # fmt: skip
    _, C, _, omega = motion(ONE)
    a = C @ axis
    h = J * (z + a @ omega)
    out, model, x = observed_channels(source, wheel, z0={"w.momentum": h})
    wanted = {
        "torque": 1.1,
        "speed": 3.0 * J * (78.0 - z),
        "too fast": 0.01 * J * (80.0 - z),
        "signal": -4.0 + 5.0 * T / 2.0,
    }[mode]
    motor = np.clip(wanted, -1.5, 1.5)
    if motor * z > 0:
        motor *= np.clip((80.0 - abs(z)) / (0.01 * 80.0), 0.0, 1.0)
    friction = 0.01 * z + 0.2 * np.tanh(z / 3.0)
    tau = motor - friction
    own = {key.removeprefix("effectors/w/"): v for key, v in out.items() if key.startswith("effectors/w/")}
    assert own["speed"] == pytest.approx(z, rel=1e-12)
    assert own["motor"] == pytest.approx(motor, rel=1e-10, abs=1e-12)
    assert own["friction"] == pytest.approx(friction, rel=1e-11)
    assert own["saturated"] == float(abs(motor - wanted) > 1e-9)
    assert [own[f"momentum_{k}"] for k in "xyz"] == pytest.approx(h * a, rel=1e-12)
    assert own["torque"] == pytest.approx(-tau * a - np.cross(omega, h * a), rel=1e-10)
    assert "force" not in own  # it exerts none
    assert own["energy"] == pytest.approx(h * h / (2 * J), rel=1e-12)
    assert own["dissipation"] == pytest.approx(friction * z, rel=1e-11)
    assert own["supplied"] == pytest.approx(motor * z, rel=1e-10, abs=1e-12)
    assert rates_of_states(model, x) == pytest.approx([tau], rel=1e-10)
    check_work(model, x, out, wheel)


G, S = unit([1.0, 2.0, -1.0]), unit(np.cross([1.0, 2.0, -1.0], [0.3, 0.1, 1.0]))


@pytest.mark.parametrize("max_torque", [1e3, 0.05])
def test_gimbal_with_inertia_satisfies_rotor_and_motor_balance(max_torque):
    J, h, p = 0.3, 7.0, 0.5
    keys = {"gimbal_axis": G, "spin_axis": S, "rates": [0.6], "initial_angles": [0.8]}
    keys |= {"gimbal_inertia": J, "bandwidth": 4.0, "max_torque": max_torque}
    gyro = control_moment_gyro("c", ONE[0], h, marker=ONE[1], **keys)
    out, model, x = observed_channels(gyro, z0={"c.momentum": p})
    _, C, _, omega = motion(ONE)
    g, s = C @ G, C @ Rotation.from_rotvec(0.8 * G).apply(S)
    rate = p / J - g @ omega
    back = g @ np.cross(omega, h * s)
    motor = np.clip(J * 4.0 * (0.6 - rate) + back, -max_torque, max_torque)
    turning = np.cross(omega + rate * g, h * s)
    torque = -motor * g - (turning - g * (g @ turning)) - np.cross(omega, p * g)
    assert out["effectors/c/torque"] == pytest.approx(torque, rel=1e-10)
    assert out["effectors/c/rate1"] == pytest.approx(rate, rel=1e-11)
    assert out["effectors/c/motor1"] == pytest.approx(motor, rel=1e-11)
    assert [out[f"effectors/c/momentum_{k}"] for k in "xyz"] == pytest.approx(h * s + p * g, abs=1e-11)
    assert out["effectors/c/energy"] == pytest.approx(p * p / (2 * J))
    assert out["effectors/c/supplied"] == pytest.approx(rate * motor, rel=1e-10)
    assert rates_of_states(model, x) == pytest.approx([rate, motor - back], rel=1e-10)
    check_work(model, x, out, gyro)


KINDS = {
    "table": ({"profile": ([0.2, 0.5, 0.9], [0.3, 0.65, 1.0])}, 0.65),
    "before its table": ({"profile": ([0.8, 0.9], [0.3, 1.0])}, 0.0),
    "continuous": ({"command": "in.value"}, 0.55),
    "off": ({"command": "low.value", "switched": True}, 0.0),
    "on": ({"command": "in.value", "switched": True}, 1.0),
    "beyond": ({"command": "high.value"}, 1.0),
}


@pytest.mark.parametrize("lag", [0.0, 0.4])
@pytest.mark.parametrize("kind", KINDS)
def test_thruster_fed_from_another_body(kind, lag):
    more, level = KINDS[kind]
    axis, turn, full, impulse, k = np.array([0.3, 1.0, -2.0]), np.array([0.1, -0.2, 0.05]), 3.0, 40.0, 0.7
    constants = [signal(name, [0.0], [v]) for name, v in (("in", 0.55), ("low", 0.45), ("high", 1.7))]
    jet = thruster("jet", ONE[0], full, marker=ONE[1], axis=axis, misalignment=turn, lag=lag, specific_impulse=impulse,
                   supply=Supply("fuel", *TWO, k), **more)  # fmt: skip
    fuel = tank("fuel", 5.0, ["jet"])
    thrust = 1.9 if lag else full * level
    z0 = {"jet.lagged": 1.9} if lag else {}
    out, model, x = observed_channels(*constants, jet, fuel, z0=z0)
    _, C, v_e, _ = motion(ONE)
    _, _, v_t, omega_t = motion(TWO)
    flow = thrust / (9.80665 * impulse)
    push = thrust * C @ Rotation.from_rotvec(turn).apply(unit(axis))
    between = flow * (v_e - v_t)
    force, torque = (out[f"effectors/jet/{key}"].reshape(2, 3) for key in ("force", "torque"))
    size = {"abs": 1e-12}
    assert force == pytest.approx(np.array([push - between, -between]), **size)
    assert torque == pytest.approx(np.array([np.zeros(3), flow * k * k * omega_t]), **size)
    assert out["effectors/jet/thrust"] == pytest.approx(thrust, **size)
    assert out["effectors/jet/flow"] == pytest.approx(flow, **size)
    assert out["effectors/jet/mass_flow"] == pytest.approx(flow, **size)
    kinetic = flow * (v_t @ v_t + k * k * omega_t @ omega_t) / 2
    given = force[0] @ v_e + force[1] @ v_t + torque[1] @ omega_t
    assert out["effectors/jet/supplied"] == pytest.approx(given - kinetic, **size)
    lags = [(full * level - 1.9) / lag] if lag else []
    assert rates_of_states(model, x) == pytest.approx([*lags, -flow, 0.0, 0.0], **size)
    if thrust:
        check_work(model, x, out, jet)
    empty, model, x = observed_channels(*constants, jet, fuel, z0={**z0, "fuel.feed": 0.0})
    assert empty["effectors/jet/thrust"] == 0.0 and not empty["effectors/jet/force"].any()
    assert rates_of_states(model, x) == pytest.approx([*([-1.9 / lag] if lag else []), 0.0, 0.0, 0.0])


def length_of(distance, part):
    """A growing length that is that part of the distance at T."""
    return Profile.polynomial(part * distance - 0.3 * T, 0.3)


@pytest.mark.parametrize(("part", "damping"), [(0.8, 2.0), (0.8, 0.0), (1.2, 2.0), (0.999, 400.0)],
                         ids=["taut", "undamped", "slack", "damped to nothing"])  # fmt: skip
def test_cable_tension_by_strain_and_rate(part, damping):
    (p, _, v_p, _), (q, _, v_q, _) = motion(ONE), motion(TWO)
    d = np.linalg.norm(q - p)
    e, EA, L = (q - p) / d, 30.0, part * d
    rope = cable("rope", (ONE, TWO), length_of(d, part), EA, damping)
    out, model, x = observed_channels(rope)
    faster = e @ (v_q - v_p) - 0.3
    elastic = EA * (d - L) / L if d > L else 0.0
    tension = max(0.0, elastic + damping * faster) if d > L else 0.0
    own = {key: out[f"effectors/rope/{key}"] for key in ("tension", "distance", "length", "energy", "dissipation")}
    assert (part > 1) == (tension == 0.0) or damping == 400.0
    assert own["tension"] == pytest.approx(tension, rel=1e-10)
    assert (own["distance"], own["length"]) == pytest.approx((d, L))
    assert out["effectors/rope/force"] == pytest.approx(np.concatenate([tension * e, -tension * e]), rel=1e-10)
    assert own["energy"] == pytest.approx(EA * (d - L) ** 2 / (2 * L) if d > L else 0.0, rel=1e-10)
    assert own["dissipation"] == pytest.approx((tension - elastic) * faster, rel=1e-10, abs=1e-14)
    supplied = -(tension + elastic**2 / (2 * EA)) * 0.3
    assert out["effectors/rope/supplied"] == pytest.approx(supplied, rel=1e-10, abs=1e-14)
    if tension:
        check_work(model, x, out, rope)


@pytest.mark.parametrize("k", range(6))
def test_sensors_measure_relative_to_moving_marker(k):
    rng = np.random.default_rng(k)
    q, u = random_state(TREE, rng)
    (p, C, v, w), (p2, C2, v2, w2) = (motion_at(where, q, u) for where in (ONE, TWO))
    R, axis, offset, aim = (
        Rotation.random(random_state=k).as_matrix(),
        unit(rng.normal(size=3)),
        *rng.normal(size=(2, 3)),
    )
    bias = np.array([0.01, -0.02, 0.03])
    at, common = {"body": ONE[0], "marker": ONE[1]}, {"bias": bias}
    sensors = {
        "star": Sensor("star", "attitude", **at, reference=R, **common),
        "follow": Sensor(
            "follow", "attitude", **at, reference=R, other=TWO, turning=(tuple(axis), "in.value"), **common
        ),
        "gyro": Sensor("gyro", "rate", **at, **common),
        "place": Sensor("place", "displacement", **at, offset=offset, **common),
        "from": Sensor("from", "displacement", **at, other=TWO, offset=offset, **common),
        "speed": Sensor("speed", "velocity", **at, **common),
        "past": Sensor("past", "velocity", **at, other=TWO, **common),
        "sun": Sensor("sun", "pointing", **at, axis=axis, aim=aim, **common),
        "mate": Sensor("mate", "pointing", **at, other=TWO, axis=axis, **common),
        "echo": Sensor("echo", "value", signal="in.value", **common),
    }
    effectors = [effector for sensor in sensors.values() for effector in sensor.effectors]
    out, *_ = observed_channels(signal("in", [0.0, 2.0], [0.4, 1.4]), *effectors, q=q, u=u)
    turned = C2 @ R @ Rotation.from_rotvec(0.75 * axis).as_matrix()  # about an axis of the reference
    d, relative = p - p2, v - v2 - np.cross(w2, p - p2)
    expected = {
        "star": error_of(R.T @ C),
        "follow": error_of(turned.T @ C),
        "gyro": C.T @ w,
        "place": p - offset,
        "from": C2.T @ d - offset,
        "speed": v,
        "past": C2.T @ relative,
    }
    for name, value in expected.items():
        found = [out[f"effectors/{name}/{letter}"] for letter in "xyz"]
        assert found == pytest.approx(value + bias, abs=1e-11), name
    for name, to in (("sun", unit(aim)), ("mate", unit(p2 - p))):
        angle = np.arccos((C @ axis) @ to)
        assert out[f"effectors/{name}/angle"] == pytest.approx(angle + bias[0], abs=1e-9)
    assert out["effectors/echo/value"] == pytest.approx(0.75 + bias[0])


TIMES, VALUES = np.array([0.5, 1.5, 2.0, 4.0]), np.array([3.0, -1.0, 2.0, 7.0])


def error_of(R):
    """2 sign(q_0) (q_1, q_2, q_3)."""
    return 2.0 * Rotation.from_matrix(R).as_quat(canonical=True)[:3]


PLACES = tuple(f"place{k}" for k in range(6))


def rate(model, t, x):
    """Rates of a state."""
    dx = np.empty_like(x)
    model.rate(t, x, dx, model.table, model.pool, model.work)
    return dx


TOGETHER, APART = (PLACES[0],) * 6, PLACES
