"""Wheels and control-moment gyros as gyrostats: momentum, energy, Kelvin's stability, nutation, imbalance."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import fresnel
from support.effector_builders import control_moment_gyro, reaction_wheel, signal, with_wheel, without_axial_inertia
from support.random_systems import random_body

from femflex.body import Marker
from femflex.body.flexible import rigid_body
from femflex.dynamics import compile_system
from femflex.effectors import unbalanced_rotor
from femflex.integrate import Dop853
from femflex.studies.linear.linear_model import linear_model
from femflex.studies.linear.poles import poles_of
from femflex.system import Effector, Load, System, free, revolute, weld

FINE = Dop853(rtol=1e-12, atol=1e-13)
J = np.diag([3.0, 4.0, 5.0])


def run(system, end, n=41, method=FINE):
    model = compile_system(system)
    times = np.linspace(0.0, end, n)
    states = method.solve(model, times, model.x0).states
    return times, states, model.observe(times, states)


def hub(inertia=J, **markers):
    tilted = Marker.at_position(
        np.array([0.2, -0.1, 0.3]), np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    )
    return rigid_body(20.0, inertia, markers={"tilted": tilted, **markers})


def balance(seen, times):
    """Energy less work, by the trapezoidal rule of a fine run."""
    power = seen["monitors/supplied"] - seen.get("monitors/dissipation", 0.0)
    return seen["monitors/energy"] - np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(times))])


def flexible_craft(effectors):
    """A free hub with a flexible boom that carries a wheel."""
    boom, _ = random_body(np.random.default_rng(3), 2)
    joints = (
        free("hub", u0=np.array([0.1, 0.0, 0.05, 0.02, -0.03, 0.04])),
        revolute("boom", "hub", child_marker="b", name="hinge", q0=np.array([0.4]), u0=np.array([0.2])),
    )
    return System({"hub": hub(), "boom": boom}, joints, effectors=effectors)


def test_wheels_conserve_momentum_and_balance_energy():
    drive = signal("drive", [0.0, 1.0, 2.0], [0.0, 2.0, -3.0])
    wheels = (
        reaction_wheel("a", "hub", 0.3, marker="tilted", axis=(1, 2, 2), torque="drive.value", initial_speed=30.0),
        reaction_wheel("b", "boom", 0.1, marker="c", speed=40.0, bandwidth=3.0, viscous=0.02, coulomb=0.1),
    )
    times, _, seen = run(flexible_craft((drive, *wheels)), 2.0, 4001)
    H, p = seen["monitors/angular_momentum"], seen["monitors/momentum"]
    assert np.abs(H - H[0]).max() < 1e-10 * np.linalg.norm(H[0])
    assert np.abs(p - p[0]).max() < 1e-11 * np.linalg.norm(p[0])
    E = balance(seen, times)
    brought = np.abs(seen["monitors/energy"] - seen["monitors/energy"][0]).max()
    assert brought > 10.0 and np.abs(E - E[0]).max() < 1e-5 * brought  # of the quadrature
    assert seen["effectors/b/speed"][-1] > 20.0 and seen["effectors/b/dissipation"].max() > 1.0


def test_wheel_equals_rotor_body_on_frictionless_joint():
    """A second formulation: the rotor as a rigid body of its own on a revolute joint."""
    axial, transverse, mass = 0.4, 0.25, 2.0
    wheel = reaction_wheel("wheel", "hub", axial, marker="tilted", axis=(0, 0, 1), initial_speed=50.0)
    carrier = with_wheel(hub(), wheel, mass, transverse)
    start = [0, 0, 0, 0.3, -0.2, 0.1]
    _, _, seen = run(System({"hub": carrier}, (free("hub", u0=start),), effectors=(wheel,)), 3.0)
    rotor = rigid_body(mass, np.diag([transverse, transverse, axial]))
    joints = (free("hub", u0=start), revolute("rotor", "hub", parent_marker="tilted", name="axle", u0=[50.0]))
    _, _, two = run(System({"hub": hub(), "rotor": rotor}, joints), 3.0)
    assert seen["bodies/hub/rate"] == pytest.approx(two["bodies/hub/rate"], abs=1e-9)
    assert seen["bodies/hub/position"] == pytest.approx(two["bodies/hub/position"], abs=1e-9)
    assert seen["effectors/wheel/speed"] == pytest.approx(two["u"][:, 6], rel=1e-10)
    assert seen["monitors/angular_momentum"] == pytest.approx(two["monitors/angular_momentum"], rel=1e-10)
    assert seen["monitors/energy"] == pytest.approx(two["monitors/energy"], rel=1e-10)


@pytest.mark.parametrize(("speed", "stable"), [(0.0, False), (1.9, False), (2.1, True), (-12.0, True), (-1.9, False)])
def test_spin_about_middle_axis_with_rotor_matches_kelvin(speed, stable):
    """Spin w about axis 2 with rotor momentum h there: (J2 w + h - J1 w)(J2 w + h - J3 w) > 0 for stability.

    J = (3, 4, 5), w = 1, J_s = 0.5: h = J_s Om; the two factors change sign at h = -1 and 1.
    """
    wheel = reaction_wheel("wheel", "hub", 0.5, axis=(0, 1, 0), initial_speed=speed)
    body = without_axial_inertia(hub(), wheel)
    system = System({"hub": body}, (free("hub", u0=[0, 0, 0, 1e-6, 1.0, 0]),), effectors=(wheel,))
    h = 0.5 * speed
    square = (4.0 + h - 3.0) * (4.0 + h - 5.0) / (3.0 * 5.0)
    assert (square > 0.0) == stable
    t, _, seen = run(system, 6.0, 121)
    across = seen["bodies/hub/rate"][:, 0]
    expected = 1e-6 * (np.cos if stable else np.cosh)(math.sqrt(abs(square)) * t)
    assert across == pytest.approx(expected, abs=2e-10)


def test_sweep_through_nutation_frequency_matches_lewis():
    """A weak transverse torque cos(phi(t)) with phi'' = a, on a spinning gyrostat: the nutation's complex amplitude
    is the Fresnel integral of the linear sweep (Lewis 1932), exactly for an axisymmetric body."""
    Jt, h, a, f = 4.0, 8.0, 0.05, 1e-6  # nutation at h / Jt = 2 rad/s
    wheel = reaction_wheel("wheel", "hub", 0.5, axis=(0, 0, 1), initial_speed=h / 0.5)

    def push(seen, out):
        """Torque along the body's x axis whose frequency rises by a."""
        phase = 0.5 * seen.parameters[1] * seen.time**2
        for k in range(3):
            out.torque[0, k] = seen.parameters[0] * math.cos(phase) * seen.attitude[0, k, 0]

    shaker = Effector("shaker", push, (("hub", "origin"),), parameters=np.array([f, a]))
    body = without_axial_inertia(hub(np.diag([Jt, Jt, 5.0])), wheel)
    t, _, seen = run(System({"hub": body}, (free("hub"),), effectors=(wheel, shaker)), 80.0, 801)
    w = seen["bodies/hub/rate"]
    nutation = h / Jt
    t0 = nutation / a

    def swept(to, sign):
        """int_0^t exp(sign i a/2 (t - sign t0)^2) dt."""
        S, C = fresnel(math.sqrt(a / math.pi) * np.stack([to - sign * t0, 0 * to - sign * t0]))
        return math.sqrt(math.pi / a) * ((C[0] - C[1]) + sign * 1j * (S[0] - S[1]))

    turn = np.exp(-0.5j * a * t0**2)
    integral = f / (2 * Jt) * (turn * swept(t, 1.0) + turn.conj() * swept(t, -1.0))
    expected = np.exp(1j * nutation * t) * integral
    assert w[:, 0] + 1j * w[:, 1] == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())
    after = f / (2 * Jt) * math.sqrt(2 * math.pi / a)  # amplitude long after the passage, about which it swings
    assert np.abs(w[t > 60.0, 0] + 1j * w[t > 60.0, 1]).mean() == pytest.approx(after, rel=0.12)


def test_unbalanced_rotor_bearing_force():
    mass, Us, Ud, speed = 3.0, 2e-4, 3e-5, 100.0
    rotor = unbalanced_rotor(mass, 0.02, 0.015, Us, Ud)
    assert rotor.moments.first[0] == pytest.approx([Us, 0, 0])
    assert rotor.moments.inertia()[0, 2] == pytest.approx(-Ud)
    post = rigid_body(1.0, np.eye(3), markers={"origin": Marker.at_position(np.zeros(3))})
    joints = (weld("post"), revolute("rotor", "post", name="axle", u0=[speed]))
    _, _, seen = run(System({"post": post, "rotor": rotor}, joints, reactions=True), 0.1, 11)
    angle = seen["q"][:, 0]
    push = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    force, torque = seen["joints/axle/force"], seen["joints/axle/torque"]
    assert np.abs(force) == pytest.approx(np.abs(Us * speed**2 * push), abs=1e-9)
    assert np.linalg.norm(torque, axis=1) == pytest.approx(Ud * speed**2, rel=1e-9)


def test_gimbals_conserve_momentum_and_balance_energy():
    h = 25.0
    keys = {"marker": "tilted", "gimbal_axis": (0, 1, 0), "spin_axis": (1, 0, 0)}
    for more in (
        {"rates": ["rate.value"]},
        {"rates": ["rate.value"], "gimbal_inertia": 0.2, "bandwidth": 20.0},
        {"angles": [0.5, "rate.value"], "inner_axis": (0, 0, 1), "gain": 2.0, "initial_angles": [0.1, 0.0]},
        {"free": True, "gimbal_inertia": 0.2, "stiffness": 3.0, "damping": 0.4, "initial_angles": [0.3]},
    ):
        rate = signal("rate", [0.0, 1.0], [0.0, 0.6], "smooth")
        cmg = control_moment_gyro("cmg", "hub", h, **keys, **more)
        times, _, seen = run(flexible_craft((rate, cmg)), 1.5, 3001)
        H = seen["monitors/angular_momentum"]
        assert np.abs(H - H[0]).max() < 1e-10 * np.linalg.norm(H[0])
        E = balance(seen, times)
        assert np.abs(E - E[0]).max() < 1e-5 * max(
            1.0, np.abs(seen["monitors/energy"] - seen["monitors/energy"][0]).max()
        )
        assert np.abs(seen["effectors/cmg/motor1"]).max() > 0.1


def test_wheel_and_body_exchange_momentum():
    """About one axis: (J - J_s) dw/dt = -tau and J_s d(Om + w)/dt = tau; w and Om are known."""
    torque = 0.3
    wheel = reaction_wheel("wheel", "hub", 0.5, axis=(0, 0, 1), torque=torque, initial_speed=20.0)
    body = without_axial_inertia(hub(), wheel)
    _, _, seen = run(System({"hub": body}, (free("hub", u0=[0, 0, 0, 0, 0, 0.1]),), effectors=(wheel,)), 5.0)
    t = np.linspace(0.0, 5.0, 41)
    assert seen["effectors/wheel/speed"] == pytest.approx(20.0 + torque * t / 0.5 + torque * t / 4.5, rel=1e-11)
    assert seen["bodies/hub/rate"][:, 2] == pytest.approx(0.1 - torque * t / 4.5, abs=1e-11)
    H = seen["monitors/angular_momentum"]
    assert H[0] == pytest.approx([0, 0, 5.0 * 0.1 + 0.5 * 20.0], rel=1e-14)
    assert np.abs(H - H[0]).max() < 1e-11 * np.linalg.norm(H[0])


def test_gimbal_torque_is_h_times_rate():
    """h ds/dt across both axes on a heavy body, and the motor torque h g.(omega x s) of a turning one."""
    cmg = control_moment_gyro("cmg", "hub", 10.0, gimbal_axis=(0, 0, 1), spin_axis=(1, 0, 0), rates=[0.2])
    big = rigid_body(1e9, np.eye(3) * 1e12)
    t, _, seen = run(System({"hub": big}, (free("hub"),), effectors=(cmg,)), 4.0)
    angle = 0.2 * t
    expected = -10.0 * 0.2 * np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    assert seen["effectors/cmg/torque"] == pytest.approx(expected, abs=1e-9)
    turning = System({"hub": big}, (free("hub", u0=[0, 0, 0, 0, 0.3, 0]),), effectors=(cmg,))
    seen = run(turning, 1.0, 2)[2]
    assert seen["effectors/cmg/motor1"][0] == pytest.approx(10.0 * np.dot([0, 0, 1], np.cross([0, 0.3, 0], [1, 0, 0])))


def test_free_gimbal_measures_the_rate_of_its_body():
    """Rate gyro: J g'' + c g' + k g = h W cos g on a body that turns at W across spin and gimbal axis."""
    h, J_g, k, c, W = 8.0, 0.05, 3.0, 0.6, 0.2
    keys = {"gimbal_axis": (0, 0, 1), "spin_axis": (1, 0, 0), "gimbal_inertia": J_g}
    gyro = control_moment_gyro("gyro", "hub", h, **keys, free=True, stiffness=k, damping=c)
    system = System(
        {"hub": rigid_body(1e9, np.eye(3) * 1e12)}, (free("hub", u0=[0, 0, 0, 0, W, 0]),), effectors=(gyro,)
    )
    t, _, seen = run(system, 6.0, 61)
    exact = solve_ivp(
        lambda _, y: [y[1], (h * W * math.cos(y[0]) - k * y[0] - c * y[1]) / J_g],
        (0.0, 6.0),
        [0.0, 0.0],
        t_eval=t,
        rtol=1e-11,
        atol=1e-12,
    ).y[0]
    assert seen["effectors/gyro/angle"] == pytest.approx(exact, abs=1e-8)
    settled = seen["effectors/gyro/angle"][-1]
    assert k * settled == pytest.approx(h * W * math.cos(settled), rel=1e-6)


def test_free_gimbal_appears_in_the_linear_equations():
    """A gimbal on a heavy body at rest is a damped oscillator, J g'' + c g' + k g = 0."""
    J_g, k, c = 0.05, 3.0, 0.1
    gyro = control_moment_gyro("gyro", "hub", 1e-6, gimbal_inertia=J_g, free=True, stiffness=k, damping=c)
    system = System({"hub": rigid_body(1e9, np.eye(3) * 1e12)}, (free("hub"),), effectors=(gyro,))
    poles = [pole.value for pole in poles_of(linear_model(system, inputs=[])) if abs(pole.value) > 1e-3]
    decay = c / (2.0 * J_g)
    assert poles == pytest.approx([complex(-decay, math.sqrt(k / J_g - decay**2))], rel=1e-6)


PUBLISHED = np.array(
    [1.98708924e-3, 2.26086385e-4, -1.60335529e-5]
)  # modified Rodrigues parameters; imbalance: 0.6, 10, 101 %


def test_three_unbalanced_wheels_turn_the_craft_as_published():
    """Fully coupled imbalance of J. Alcorn, C. Allard and H. Schaub (J. Guidance 41, 2018), with the numbers of
    Basilisk's test of it: static 0.048 kg m, dynamic 0.0154 kg m^2, motors for half of the time, one at its limit.

    Its rotors, thin discs with a product of inertia, are no material bodies; some transverse inertia, the same about
    all axes of the craft, is therefore taken from the hub and given to them.
    """
    rpm, mass, moved = 2.0 * np.pi / 60.0, 12.0, 0.006
    axial, offset, product = 100.0 / (6000.0 * rpm), 0.048 / mass, 0.0154
    transverse = axial / 2.0 + moved
    rotor = rigid_body(
        mass, [[axial, 0, product], [0, transverse, 0], [product, 0, transverse]], np.array([0, offset, 0])
    )
    markers, joints, loads = {}, [free("hub", u0=[0, 0, 0, 0.08, 0.01, 0])], []
    on = np.array([0.0, 0.05, 0.05 + 1e-9, 1.0])
    for k, (speed, torque) in enumerate([(500, 0.2), (200, 0.1), (-150, -0.2)]):
        axis = np.eye(3)[k]
        across = np.array([[0, 0, 1], [0, 0, -1], [0, 1, 0]])[k]
        markers[f"w{k}"] = Marker.at_position(0.1 * axis, np.column_stack([axis, across, np.cross(axis, across)]))
        joints.append(revolute(f"rotor{k}", "hub", (1, 0, 0), parent_marker=f"w{k}", u0=[speed * rpm]))
        for body, along in ((f"rotor{k}", np.eye(3)[0]), ("hub", -axis)):
            rows = np.outer([1, 1, 0, 0], torque * along)
            loads.append(Load(name=f"motor of {body} {k}".replace(" ", "_"), body=body, times=on, torque=rows))
    hub = rigid_body(750.0, np.diag([900.0, 800, 600]) - 2 * moved * np.eye(3), np.array([-2e-4, 1e-4, 0.1]), markers)
    bodies = {"hub": hub} | {f"rotor{k}": rotor for k in range(3)}
    _, _, seen = run(System(bodies, tuple(joints), loads=tuple(loads)), 0.1, 11)
    q = seen["bodies/hub/attitude"][-1]
    assert q[1:] / (1.0 + q[0]) == pytest.approx(PUBLISHED, abs=2e-11)
