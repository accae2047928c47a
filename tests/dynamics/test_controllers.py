"""Sensors and controllers: blocks against their transfer functions, samples against recursions, order of evaluation."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from support.effector_builders import Sensor, reaction_wheel, signal, thruster

from femflex.body.flexible import rigid_body
from femflex.dynamics import compile_system
from femflex.effectors import (
    Allocation,
    AttitudeFeedback,
    LowPass,
    Observer,
    Pd,
    Pid,
    Pulses,
    Sampling,
    strain_sensor,
)
from femflex.effectors.sensor import noise_numbers
from femflex.integrate import Dop853
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import Context, Effector, System, free, revolute, spherical, weld

FINE = Dop853(rtol=1e-12, atol=1e-13)
J = 5.0


def run(system, times, method=FINE):
    model = compile_system(system)
    states = method.solve(model, np.asarray(times), model.x0).states
    return model.observe(np.asarray(times), states)


def axle(*effectors, q0=0.3, u0=0.1):
    """A body of inertia 5 on an axle."""
    joint = revolute("body", name="axle", q0=[q0], u0=[u0])
    return System({"body": rigid_body(1.0, np.diag([4.0, 4.0, J]))}, (joint,), effectors=effectors)


def push(seen, out):
    """Torque about the axle."""
    out.effort[0] = seen.input[0]


def motor(command):
    return Effector("motor", push, freedoms=("axle.angle",), inputs=(command,))


ANGLE = Sensor("angle", "joint", freedom="axle.angle")
TURN = {"inputs": ["angle.coordinate", "angle.rate"], "outputs": ["torque"]}


def test_pd_and_pid_match_characteristic_equations():
    t = np.linspace(0.0, 4.0, 41)
    keys = {**TURN, "stiffness": 3.0, "damping": 4.0}
    for law, states in ((Pd(**keys), 0), (Pid(**keys, integral=1.0), 1)):
        seen = run(axle(*ANGLE.effectors, law.controller("law"), motor("law.torque")), t)
        A = np.array([[0.0, 1.0, 0.0], [-3.0 / J, -4.0 / J, -states / J], [1.0, 0.0, 0.0]])
        exact = np.array([expm(A * s) @ [0.3, 0.1, 0.0] for s in t])
        assert seen["q"][:, 0] == pytest.approx(exact[:, 0], abs=1e-10)


def test_continuous_and_sampled_filter_response_to_ramp():
    ramp = signal("ramp", [0.0, 2.0], [0.0, 2.0])
    w = 2 * math.pi * 0.3
    continuous = LowPass(inputs=["ramp.value"], frequency=0.3).controller("lp")
    sampled = LowPass(inputs=["ramp.value"], frequency=0.3, period=0.1).controller("slp")
    t = np.linspace(0.0, 1.95, 40)
    seen = run(axle(ramp, continuous, sampled), t)
    assert seen["effectors/lp/y"] == pytest.approx(t - (1 - np.exp(-w * t)) / w, abs=1e-11)
    x, expected = 0.0, []
    for k in range(20):
        expected.append(x)
        x = math.exp(-w * 0.1) * x + (1 - math.exp(-w * 0.1)) * 0.1 * k
    assert seen["effectors/slp/y"][1::2] == pytest.approx(expected, abs=1e-13)


def test_sampled_sensor_and_law_match_discrete_recursion():
    """Sensor, then law, at the same instants: the recursion of the double integrator with held torque."""
    period, kp, kd = 0.25, 3.0, 4.0
    sensor = replace(ANGLE, sampling=Sampling(period))
    law = Pd(**TURN, stiffness=kp, damping=kd, period=period).controller("law")
    for order in (slice(None), slice(None, None, -1)):
        parts = (*sensor.effectors, law, motor("law.torque"))[order]
        seen = run(axle(*parts), np.arange(9) * period)
        theta, omega = 0.3, 0.1
        for k in range(9):
            assert seen["q"][k, 0] == pytest.approx(theta, abs=1e-10)
            held = -kp * theta - kd * omega
            theta, omega = theta + omega * period + held / J * period**2 / 2, omega + held / J * period


def test_observer_and_state_feedback_eigenvalues():
    A, B, C = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1 / J]]), np.array([[1.0, 0.0]])
    K, L = np.array([[6.0, 8.0]]), np.array([[7.0], [12.0]])
    matrices = {
        key: value.tolist()
        for key, value in zip(("A", "B", "C", "feedback", "correction"), (A, B, C, K, L), strict=True)
    }
    law = Observer(inputs=["angle.coordinate"], outputs=["torque"], **matrices).controller("law")
    model = compile_system(axle(*ANGLE.effectors, law, motor("law.torque")))
    from femflex.linear.equations import linearised

    x = np.zeros(model.n_x)
    expected = np.concatenate([np.linalg.eigvals(A - B @ K), np.linalg.eigvals(A - L @ C)])
    found = linearised(model, 0.0, x).eigenvalues()
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(expected), abs=1e-6)


def test_sensor_delay_bias_quantum_and_noise():
    """A joint turning at 1 rad/s: what is known at t is the sample of the delay before, with its bias and steps."""
    still = axle(q0=0.0, u0=1.0)

    def sampled_angle(**keys):
        bias = keys.pop("bias", 0.0)
        sensor = replace(ANGLE, bias=bias, sampling=Sampling(0.1, **keys))
        return run(replace(still, effectors=sensor.effectors), [0.0, *t])["effectors/angle/coordinate"][1:]

    t = np.arange(0.01, 2.0, 0.02)
    k = np.floor(t / 0.1 + 1e-9)
    assert sampled_angle() == pytest.approx(0.1 * k, abs=1e-11)
    assert sampled_angle(bias=0.5, quantum=0.037) == pytest.approx(0.037 * np.round((0.1 * k + 0.5) / 0.037), abs=1e-11)
    assert sampled_angle(delay=0.2) == pytest.approx(0.1 * np.maximum(k - 2, 0), abs=1e-11)
    late = np.floor((t - 0.16) / 0.1 + 1e-9)
    assert sampled_angle(delay=0.16) == pytest.approx(0.1 * np.maximum(late, 0), abs=1e-11)
    noisy = sampled_angle(noise=0.3, seed=7)
    numbers = np.array([noise_numbers(7, "angle", int(j), 2)[0] for j in k])
    assert noisy == pytest.approx(0.1 * k + 0.3 * numbers, abs=1e-11)
    assert np.array_equal(noisy, sampled_angle(noise=0.3, seed=7)) and not np.allclose(
        noisy, sampled_angle(noise=0.3, seed=8)
    )


def test_accelerometer_with_lag():
    jet = thruster("jet", "hub", 2.0, profile=([0.5], [1.0]))
    sensor = Sensor("accel", "acceleration", "hub", bandwidth=8.0)
    system = System({"hub": rigid_body(4.0, np.eye(3))}, (free("hub"),), effectors=(jet, *sensor.effectors))
    t = np.linspace(0.0, 2.0, 21)
    late = np.maximum(t - 0.5, 0.0)
    assert run(system, t)["effectors/accel/x"] == pytest.approx(0.5 * (1 - np.exp(-8.0 * late)), abs=1e-10)


def test_displacement_velocity_and_strain_sensors_of_beam():
    beam = UniformBeam(length=4.0, EA=1e6, EIy=50.0, EIz=60.0, GJ=40.0, mass_per_length=0.5)
    body = beam_body(beam, BeamFunctions(y=2, z=0))
    assert body.strain_field
    parts = (
        *Sensor("tip", "displacement", "beam", "tip", ("beam", "root"), offset=np.array([4.0, 0, 0])).effectors,
        *Sensor("speed", "velocity", "beam", "tip", ("beam", "root")).effectors,
        strain_sensor("gauge", "beam", body, np.zeros(3), "curvature_z", Sampling(0.05)),
    )
    system = System(
        {"beam": body}, (weld("beam", child_marker="root"),), delta0={"beam": np.array([0.01, 0.0])}, effectors=parts
    )
    t = np.arange(0.025, 1.0, 0.05)
    seen = run(system, np.concatenate([[0.0], t]))
    deflection, velocity = seen["markers/beam.tip/deflection"], seen["markers/beam.tip/velocity"]
    assert seen["effectors/tip/y"] == pytest.approx(deflection[:, 1], abs=1e-12)
    assert seen["effectors/speed/y"] == pytest.approx(velocity[:, 1], abs=1e-12)
    w, x = body.omega[0], 0.01
    at_samples = x * np.cos(w * (t - 0.025))
    row = 2.0 * (1.8751041 / 4.0) ** 2 / math.sqrt(0.5 * 4.0)  # curvature of the first mode at the root
    assert seen["effectors/gauge/strain"][1:] == pytest.approx(row * at_samples, abs=2e-3 * row * x)
    with pytest.raises(ValueError, match="measures the strain 'curvature' of body 'beam', which has axial"):
        strain_sensor("gauge", "beam", body, np.zeros(3), "curvature", Sampling(0.05))


def test_quaternion_feedback_with_four_wheels():
    """The gyroscopic torque cancelled, every axis is J e'' + D e' + P e = 0 for a turn about one axis."""
    inertia = np.diag([3.0, 4.0, 5.0])
    axes = np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, 1, 1, 1]]) / math.sqrt(3)
    sensors = (Sensor("star", "attitude", "hub"), Sensor("gyro", "rate", "hub"))
    P, D = 0.5 * np.diag(inertia), 1.2 * np.diag(inertia)
    xyz = lambda name: [f"{name}.{a}" for a in "xyz"]  # noqa: E731
    hold = AttitudeFeedback(
        error="star", rate="gyro", stiffness=P.tolist(), damping=np.diag(D).tolist(), inertia=inertia.tolist()
    )
    law = hold.controller("law", Context({"star": sensors[0].noun, "gyro": sensors[1].noun}))
    effect = (-axes).tolist()
    share = Allocation(inputs=xyz("law"), outputs=[f"w{k}" for k in range(4)], effect=effect).controller("share")
    wheels = [reaction_wheel(f"wheel{k}", "hub", 1e-6, axis=axes[:, k], torque=f"share.w{k}") for k in range(4)]
    effectors = (*sensors[0].effectors, *sensors[1].effectors, law, share, *wheels)
    e = 0.01
    joint = spherical("hub", q0=np.array([math.cos(e / 2), math.sin(e / 2), 0, 0]))
    t = np.linspace(0.0, 8.0, 41)
    seen = run(System({"hub": rigid_body(5.0, inertia)}, (joint,), effectors=effectors), t)
    s = np.roots([1.0, 1.2, 0.5])
    exact = e * ((s[1] * np.exp(s[0] * t) - s[0] * np.exp(s[1] * t)) / (s[1] - s[0])).real
    assert seen["effectors/star/x"] == pytest.approx(exact, abs=2e-7)
    torque = np.array([seen[f"effectors/wheel{k}/motor"] for k in range(4)])
    assert -(axes @ torque)[0] == pytest.approx(seen["effectors/law/x"], abs=1e-12)
    assert np.linalg.norm(torque, axis=0) == pytest.approx(
        np.linalg.norm([seen[f"effectors/law/{a}"] for a in "xyz"], axis=0) / math.sqrt(4 / 3), abs=1e-12
    )


def test_pulse_modulation_gives_exact_impulse():
    """On for demand / full of each period: impulse exact, and pulses that are too short left out."""
    demand = signal("demand", [0.0, 0.5, 1.0, 1.5, 2.0], [0.6, 0.05, 3.0, -1.0, 0.4], "steps")
    valve = Pulses(inputs=["demand.value"], outputs=["on"], full=2.0, period=0.5, minimum_on=0.05).effectors("valve")[0]
    jet = thruster("jet", "hub", 2.0, command="valve.on", switched=True)
    system = System({"hub": rigid_body(4.0, np.eye(3))}, (free("hub"),), effectors=(demand, valve, jet))
    t = np.linspace(0.0, 2.5, 51)
    seen = run(system, t)
    p = seen["monitors/momentum"][:, 0]
    on = [(0.0, 0.15), (1.0, 1.5), (2.0, 2.1)]
    expected = sum(2.0 * np.clip(t - a, 0.0, b - a) for a, b in on)
    assert p == pytest.approx(expected, abs=1e-12)
