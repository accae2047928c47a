"""Effectors that femflex brings, at markers of a tumbling flexible tree: each against its own formula over the jets of
the markers, and what the markers' forces do along every coordinate against virtual work."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.pointwise import Jet, Tree
from support.random_systems import random_state, random_tree

from femflex.dynamics import compile_system
from femflex.system import Effector, Profile, Sensor, Supply, reaction_wheel, tank, thruster
from femflex.system.blocks import attitude_feedback, block, state_space
from femflex.system.cable import cable
from femflex.system.gimbals import control_moment_gyro
from femflex.system.separation import separation_spring
from femflex.system.signal import signal

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


def seen(*effectors, z0=None, t=T, q=Q, u=U):
    """What a model of the tree with these effectors reports at (t, q, u), its states at their start, and the model."""
    model = compile_system(replace(TREE, effectors=effectors, z0=z0 or {}))
    x = np.concatenate([q, u, model.parts(model.x0)[2]])
    return {path: v[0] for path, v in model.observe(np.array([t]), x[None]).items()}, model, x


def rates_of_states(model, x, t=T):
    return model.state_rate(t, x)[model.n_q + model.n_u :]


def check_work(model, x, out, effector):
    """The equations hold what force and torque at the markers do along every coordinate, and their power is told."""
    force, torque = (out[f"effectors/{effector.name}/{key}"].reshape(-1, 3) for key in ("force", "torque"))
    n, power = model.n_u, 0.0
    expected = np.zeros(n)
    for where, F, M in zip(effector.markers, force, torque, strict=True):
        V, W = partial_motion(where)
        expected += V @ F + W @ M
        _, _, v, w = motion(where)
        power += F @ v + M @ w
    push = bare().residual(T, x[: model.n_q + n], np.zeros(n)) - model.residual(T, x, np.zeros(n))
    assert push == pytest.approx(expected, abs=1e-11 * max(1.0, np.abs(expected).max()))
    assert out[f"effectors/{effector.name}/power"] == pytest.approx(power, rel=1e-10)
    assert np.count_nonzero(np.abs(expected) > 1e-6) > 3


@cache
def bare():
    return compile_system(TREE)


@pytest.mark.parametrize("z", [1.0, -60.0, 79.7, 80.3], ids=["slow", "backwards", "at its limit", "beyond it"])
@pytest.mark.parametrize("mode", ["torque", "speed", "too fast", "signal"])
def test_a_wheel_on_a_bending_body_obeys_the_balance_of_its_rotor(mode, z):
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
    out, model, x = seen(source, wheel, z0={"w.momentum": h})
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
    assert not own["force"].any()
    assert own["energy"] == pytest.approx(h * h / (2 * J), rel=1e-12)
    assert own["dissipation"] == pytest.approx(friction * z, rel=1e-11)
    assert own["supplied"] == pytest.approx(motor * z, rel=1e-10, abs=1e-12)
    assert rates_of_states(model, x) == pytest.approx([tau], rel=1e-10)
    check_work(model, x, out, wheel)


G, S = unit([1.0, 2.0, -1.0]), unit(np.cross([1.0, 2.0, -1.0], [0.3, 0.1, 1.0]))
INNER = np.cross(G, S)


COMMANDS = {"rates": [0.9]}, {"angles": ["in.value"], "gain": 2.5}, {"rates": ["in.value"], "max_rate": 0.25}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_gimbal_that_follows_its_command_receives_what_turns_the_rotor(command):
    keys = {"gimbal_axis": G, "spin_axis": S, "initial_angles": [0.8]}
    gyro = control_moment_gyro("c", ONE[0], 7.0, marker=ONE[1], **keys, **command)
    out, model, x = seen(signal("in", [0.0, 2.0], [0.4, 1.4]), gyro)
    value = 0.4 + 0.5 * T
    rate = 0.9 if command.get("rates") == [0.9] else 2.5 * (value - 0.8) if "gain" in command else 0.25
    check_gyro(out, model, x, gyro, [0.8], [rate])


@pytest.mark.parametrize("first", ["in.value", 0.75])
def test_a_rotor_in_two_gimbals_turns_with_both_and_each_motor_takes_its_part(first):
    keys = {"gimbal_axis": G, "spin_axis": S, "inner_axis": INNER, "initial_angles": [0.8, -0.3], "gain": 2.0}
    gyro = control_moment_gyro(
        "c", ONE[0], 7.0, marker=ONE[1], angles=["in.value", "other.value"], max_rate=1.1, **keys
    )
    sources = signal("in", [0.0, 2.0], [0.4, 1.4]), signal("other", [0.0, 1.0], [-0.2, 0.3])
    out, model, x = seen(*sources, gyro)
    rates = np.clip([2.0 * (0.75 - 0.8), 2.0 * (-0.2 + 0.5 * T + 0.3)], -1.1, 1.1)
    check_gyro(out, model, x, gyro, [0.8, -0.3], rates)


def check_gyro(out, model, x, gyro, angles, rates):
    """Forces from the rate of change of h s along the motion of marker and gimbals, by differences."""
    _, C, _, omega = motion(ONE)

    def axes(step):
        A = Rotation.from_rotvec(step * omega).as_matrix() @ C
        first = Rotation.from_rotvec((angles[0] + step * rates[0]) * G)
        inner, spin = first.apply(INNER), first.apply(S)
        if len(angles) == 2:
            spin = Rotation.from_rotvec((angles[1] + step * rates[1]) * inner).apply(spin)
        return A @ G, A @ inner, A @ spin

    change = 7.0 * (axes(1e-5)[2] - axes(-1e-5)[2]) / 2e-5
    outer, inner, spin = axes(0.0)
    assert out["effectors/c/torque"] == pytest.approx(-change, abs=1e-7)
    assert [out[f"effectors/c/momentum_{k}"] for k in "xyz"] == pytest.approx(7.0 * spin, abs=1e-12)
    power = 0.0
    for k, (axis, rate) in enumerate(zip((outer, inner), rates, strict=False), start=1):
        assert out[f"effectors/c/rate{k}"] == pytest.approx(rate, rel=1e-12)
        assert out[f"effectors/c/motor{k}"] == pytest.approx(axis @ change, abs=1e-7)
        power += rate * (axis @ change)
    assert out["effectors/c/supplied"] == pytest.approx(power, abs=1e-7)
    assert out["effectors/c/energy"] == 0.0
    assert rates_of_states(model, x) == pytest.approx(rates, rel=1e-12)
    check_work(model, x, out, gyro)


@pytest.mark.parametrize("max_torque", [1e3, 0.05])
def test_a_heavy_gimbal_is_turned_by_its_motor_against_the_rotor(max_torque):
    J, h, p = 0.3, 7.0, 0.5
    keys = {"gimbal_axis": G, "spin_axis": S, "rates": [0.6], "initial_angles": [0.8]}
    keys |= {"gimbal_inertia": J, "bandwidth": 4.0, "max_torque": max_torque}
    gyro = control_moment_gyro("c", ONE[0], h, marker=ONE[1], **keys)
    out, model, x = seen(gyro, z0={"c.momentum": p})
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
def test_a_thruster_pushes_from_one_body_and_draws_its_mass_from_another(kind, lag):
    more, level = KINDS[kind]
    axis, turn, full, impulse, k = np.array([0.3, 1.0, -2.0]), np.array([0.1, -0.2, 0.05]), 3.0, 40.0, 0.7
    constants = [signal(name, [0.0], [v]) for name, v in (("in", 0.55), ("low", 0.45), ("high", 1.7))]
    jet = thruster("jet", ONE[0], full, marker=ONE[1], axis=axis, misalignment=turn, lag=lag, specific_impulse=impulse,
                   supply=Supply("fuel", *TWO, k), **more)  # fmt: skip
    fuel = tank("fuel", 5.0, ["jet"])
    thrust = 1.9 if lag else full * level
    z0 = {"jet.lagged": 1.9} if lag else {}
    out, model, x = seen(*constants, jet, fuel, z0=z0)
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
    empty, model, x = seen(*constants, jet, fuel, z0={**z0, "fuel.feed": 0.0})
    assert empty["effectors/jet/thrust"] == 0.0 and not empty["effectors/jet/force"].any()
    assert rates_of_states(model, x) == pytest.approx([*([-1.9 / lag] if lag else []), 0.0, 0.0, 0.0])


def test_a_tank_gives_to_all_of_its_thrusters():
    jets = [thruster(f"jet{k}", *ONE[:1], 1.0 + k, marker=ONE[1], profile=([0.0], [1.0]), specific_impulse=50.0,
                     supply=Supply("fuel", *TWO)) for k in range(3)]  # fmt: skip
    _, model, x = seen(*jets, tank("fuel", 5.0, ["jet0", "jet1", "jet2"]))
    assert rates_of_states(model, x)[0] == pytest.approx(-6.0 / (9.80665 * 50.0))


def length_of(distance, part):
    """A growing length that is that part of the distance at T."""
    return Profile.polynomial(part * distance - 0.3 * T, 0.3)


@pytest.mark.parametrize(("part", "damping"), [(0.8, 2.0), (0.8, 0.0), (1.2, 2.0), (0.999, 400.0)],
                         ids=["taut", "undamped", "slack", "damped to nothing"])  # fmt: skip
def test_a_cable_between_two_bodies_pulls_by_strain_and_rate(part, damping):
    (p, _, v_p, _), (q, _, v_q, _) = motion(ONE), motion(TWO)
    d = np.linalg.norm(q - p)
    e, EA, L = (q - p) / d, 30.0, part * d
    rope = cable("rope", (ONE, TWO), length_of(d, part), EA, damping)
    out, model, x = seen(rope)
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


def test_a_row_of_points_is_pulled_together_where_its_parts_are_taut():
    where = [(name, marker) for name in TREE.order[:3] for marker in ("a", "b")][:5]
    at = [motion(one) for one in where]
    gaps = [at[k + 1][0] - at[k][0] for k in range(4)]
    d = np.array([np.linalg.norm(gap) for gap in gaps])
    natural, EA, c = d * [0.8, 1.3, 0.9, 0.7], 20.0, 0.6
    total = natural.sum()
    told = {"tension": "N", "tension_end": "N", "slack": "1"}
    numbers = np.array([4.0, EA, c, total, *natural])
    accounts = ("energy", "dissipation")
    chain = Effector("chain", "cable_chain", tuple(where), channels=told, accounts=accounts, parameters=numbers)
    out, model, x = seen(chain)
    force, N, energy, lost = np.zeros((5, 3)), np.zeros(4), 0.0, 0.0
    for k in (0, 2, 3):  # the second is slack
        e, faster = gaps[k] / d[k], gaps[k] @ (at[k + 1][2] - at[k][2]) / d[k]
        S = EA * (d[k] - natural[k]) / natural[k]
        N[k] = max(0.0, S + c * total / natural[k] * faster)
        force[k] += N[k] * e
        force[k + 1] -= N[k] * e
        energy += S * (d[k] - natural[k]) / 2
        lost += (N[k] - S) * faster
    assert out["effectors/chain/force"] == pytest.approx(force.ravel(), rel=1e-10, abs=1e-12)
    assert (out["effectors/chain/tension"], out["effectors/chain/tension_end"]) == pytest.approx((N[0], N[3]))
    assert N[0] != pytest.approx(N[3])
    assert out["effectors/chain/slack"] == pytest.approx(natural[1] / total)
    assert (out["effectors/chain/energy"], out["effectors/chain/dissipation"]) == pytest.approx((energy, lost))
    check_work(model, x, out, chain)


@pytest.mark.parametrize("part", [1.4, 0.9])
def test_a_separation_spring_pushes_and_never_pulls(part):
    p, q = motion(ONE)[0], motion(TWO)[0]
    d = np.linalg.norm(q - p)
    spring = separation_spring("apart", (ONE, TWO), 12.0, part * d)
    out, model, x = seen(spring)
    push = 12.0 * max(0.0, part * d - d) * (q - p) / d
    assert out["effectors/apart/force"] == pytest.approx(np.concatenate([-push, push]), rel=1e-11)
    assert out["effectors/apart/distance"] == pytest.approx(d)
    assert out["effectors/apart/energy"] == pytest.approx(6.0 * max(0.0, part * d - d) ** 2)
    if part > 1:
        check_work(model, x, out, spring)


@pytest.mark.parametrize("k", range(6))
def test_sensors_measure_one_marker_from_another_that_moves_too(k):
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
    out, *_ = seen(signal("in", [0.0, 2.0], [0.4, 1.4]), *effectors, q=q, u=u)
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


@pytest.mark.parametrize("axis", [*np.eye(3), -np.eye(3)[0], unit([2.0, -1.0, 0.5]), unit([0.3, 2.0, -1.0]),
                                  unit([0.4, -0.5, 2.0]), unit([1.0, 2.2, 2.0])])  # fmt: skip
@pytest.mark.parametrize("angle", [1e-5, 2.9, 3.5])
def test_a_star_sensor_gives_any_error_by_the_shorter_way(axis, angle):
    _, C, _, _ = motion(ONE)
    error = Rotation.from_rotvec(angle * axis)
    sensor = Sensor("star", "attitude", ONE[0], ONE[1], reference=C @ error.inv().as_matrix())
    out, *_ = seen(*sensor.effectors)
    sign = 1.0 if angle < np.pi else -1.0
    expected = 2.0 * sign * np.sin(angle / 2) * axis
    assert [out[f"effectors/star/{letter}"] for letter in "xyz"] == pytest.approx(expected, abs=1e-12)


TIMES, VALUES = np.array([0.5, 1.5, 2.0, 4.0]), np.array([3.0, -1.0, 2.0, 7.0])


@pytest.mark.parametrize("t", [0.1, 0.5, 0.8, 1.5, 1.9, 2.0, 3.5, 4.0, 5.0])
def test_signals_hold_lead_on_or_go_smoothly_between_their_times(t):
    kinds = ("steps", "linear", "smooth")
    out, *_ = seen(*(signal(kind, TIMES, VALUES, kind) for kind in kinds), t=t)
    k = np.clip(np.searchsorted(TIMES, t, side="right") - 1, 0, 3)
    inside = TIMES[0] <= t < TIMES[-1]
    rise, span = (VALUES[k + 1] - VALUES[k], TIMES[k + 1] - TIMES[k]) if inside else (0.0, 1.0)
    s = (t - TIMES[k]) / span if inside else 0.0
    smooth = np.polynomial.Polynomial([0, 0, 0, 10, -15, 6])
    expected = {
        "steps": (VALUES[k], 0.0),
        "linear": (np.interp(t, TIMES, VALUES), rise / span),
        "smooth": (VALUES[k] + rise * smooth(s), rise / span * smooth.deriv()(s)),
    }
    for kind, (value, rate) in expected.items():
        assert out[f"effectors/{kind}/value"] == pytest.approx(value, abs=1e-13), kind
        assert out[f"effectors/{kind}/rate"] == pytest.approx(rate, abs=1e-12), kind


@pytest.mark.parametrize("scaled", [False, True])
def test_a_continuous_block_is_its_matrices(scaled):
    rng = np.random.default_rng(2)
    A, B, C, D = (rng.normal(size=shape) for shape in ((3, 3), (3, 2), (4, 3), (4, 2)))
    given, z = np.array([0.7, -1.3]), rng.normal(size=3)
    y = C @ z + D @ given
    limits = np.abs(y) * [0.9, 1.5, 0.4, 0.7]
    inputs = [signal(f"in{k}", [0.0], [v]) for k, v in enumerate(given)]
    law = block("law", state_space(A, B, C, D), ["in0.value", "in1.value"], list("abcd"), limit=limits, scaled=scaled)
    out, model, x = seen(*inputs, law, z0={f"law.x{k + 1}": v for k, v in enumerate(z)})
    found = [out[f"effectors/law/{name}"] for name in "abcd"]
    assert found == pytest.approx(0.4 * y if scaled else np.clip(y, -limits, limits), rel=1e-12)
    assert rates_of_states(model, x) == pytest.approx(A @ z + B @ given, rel=1e-12)


@pytest.mark.parametrize("holds", [False, True])
def test_attitude_feedback_opposes_error_and_rate_and_carries_the_momentum(holds):
    rng = np.random.default_rng(8)
    e, omega, H = rng.normal(size=(3, 3))
    P, D, J = rng.normal(size=(3, 3, 3))
    names = [f"s{k}" for k in range(9 if holds else 6)]
    inputs = [signal(name, [0.0], [v]) for name, v in zip(names, [*e, *omega, *H], strict=False)]
    taken = [f"{name}.value" for name in names]
    law = attitude_feedback("law", taken[:3], taken[3:6], P, D, inertia=J, momentum=taken[6:], limit=2.0)
    out, *_ = seen(*inputs, law)
    torque = -P @ e - D @ omega + np.cross(omega, J @ omega + (H if holds else 0.0))
    assert np.abs(torque).max() > 2.0 > np.abs(torque).min()
    assert [out[f"effectors/law/{letter}"] for letter in "xyz"] == pytest.approx(np.clip(torque, -2.0, 2.0))


def error_of(R):
    """2 sign(q_0) (q_1, q_2, q_3)."""
    return 2.0 * Rotation.from_matrix(R).as_quat(canonical=True)[:3]
