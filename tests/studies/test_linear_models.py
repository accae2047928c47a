"""Linear models: poles, zeros and responses against exact frequencies, simulated motion and differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq
from support.effector_builders import Sensor
from support.hub_beam import exact_frequencies
from support.mechanisms import four_bar

from femflex.body import Marker, rigid_body
from femflex.case.read import parse_case
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions, Damping, UniformBeam, beam_body
from femflex.studies.linear import (
    linear_model,
    poles_of,
    transmission_zeros,
)
from femflex.studies.stability import case_stability
from femflex.system import Environment, Load, Profile, System, prismatic, revolute, spherical, weld

BEAM = UniformBeam(1.0, EA=1e4, EIy=10.0, EIz=1.0, GJ=10.0, mass_per_length=1.0, rotary_inertia=False)
CLAMPED = np.array([brentq(lambda b: np.cos(b) * np.cosh(b) + 1, *ends) for ends in ((1, 3), (4, 5), (7, 8))]) ** 2


def hub_and_beam(damping: float = 0.0, **more) -> System:
    """A hub on an axle at its centre with a unit beam 0.1 from it; damping: of the axle."""
    hub = rigid_body(0.5, 0.1 * np.eye(3), markers={"rim": Marker.at_position([0.1, 0.0, 0.0])})
    beam = beam_body(BEAM, BeamFunctions(y=8, z=0, axial=0, torsion=0))
    axle = revolute("hub", name="axle", damping=np.array([damping]))
    return System(
        {"hub": hub, "beam": beam}, (axle, weld("beam", "hub", parent_marker="rim", child_marker="root")), **more
    )


def test_poles_of_a_hub_with_a_beam_are_exact():
    model = linear_model(hub_and_beam(), ["joints/axle.angle/effort"], ["bodies/hub/rate:z"])
    poles = poles_of(model)
    assert [pole.name for pole in poles[:3]] == ["rotation z", "rotation z", "bending 1"]
    assert [pole.rigid for pole in poles[:3]] == [True, True, False] and not any(pole.value for pole in poles[:2])
    omega = [pole.value.imag for pole in poles[2:5]]
    assert omega == pytest.approx(exact_frequencies(0.1, 0.1, 0.5, True), rel=1e-6)
    assert all(sum(pole.participation.values()) <= 1.0 + 1e-12 for pole in poles)


def test_zeros_are_the_frequencies_of_the_clamped_beam():
    model = linear_model(hub_and_beam(), ["joints/axle.angle/effort"], ["attitude/angles:z"])
    zeros = transmission_zeros(model)
    assert np.abs(zeros[:6:2]) == pytest.approx(CLAMPED, rel=1e-5)
    assert np.abs(zeros.real).max() < 1e-6 * np.abs(zeros).max()


def swinging(strength: float = 0.0) -> System:
    """A hinged arm with a beam under gravity, off its lowest place by a torque, and damped; the hinge rides a slide."""
    arm = rigid_body(1.0, np.diag([0.1, 0.2, 0.2]), [0.3, 0, 0], {"end": Marker.at_position([0.6, 0.0, 0.0])})
    beam = beam_body(BEAM, BeamFunctions(y=2, z=0, axial=0, torsion=0), damping=Damping(0.02))
    return System(
        {"base": rigid_body(1.0, np.eye(3)), "arm": arm, "beam": beam},
        (
            prismatic("base", axis=[0, 1, 0], motion=(strength,), name="ride"),
            revolute("arm", "base", name="hinge", q0=[-1.2], damping=np.array([0.8])),
            weld("beam", "arm", parent_marker="end", child_marker="root"),
        ),
        environment=Environment(gravity=np.array([0.0, -9.81, 0.0])),
        loads=(Load("motor", "arm", torque=np.array([0.0, 0.0, 3.0])),),
    )


INPUTS = ("loads/motor/torque:z", "markers/beam.tip/force:y", "motions/ride.slide")
OUTPUTS = ("q", "bodies/arm/rate:z", "markers/beam.tip/position", "markers/beam.tip/velocity:y")


@pytest.fixture(scope="module")
def arm():
    return linear_model(swinging(), INPUTS, OUTPUTS)


def vars_of(system: System) -> dict:
    """The fields of a system."""
    return {key: getattr(system, key) for key in system.__dataclass_fields__}


def with_motor(system: System, torque: float) -> System:
    """The system with so much more torque."""
    motor = Load("motor", "arm", torque=np.array([0.0, 0.0, 3.0 + torque]))
    return type(system)(**{**vars_of(system), "loads": (motor,)})


def test_difference_to_nonlinear_response_is_of_second_order(arm):
    """A step of torque for half a second: an error that falls four times when the step is halved."""
    steps, errors, end = (0.4, 0.2, 0.1), [], 0.5
    row = [name for name, _ in arm.outputs].index("bodies/arm/rate:z")
    wide = np.zeros((len(arm.A) + 1,) * 2)
    wide[:-1, :-1], wide[:-1, -1] = arm.A, arm.B[:, 0]
    linear = arm.C[row] @ expm(wide * end)[:-1, -1]
    for step in steps:
        model = compile_system(with_motor(arm.model.system, step))
        end_state = solve_ivp(model.state_rate, (0, end), arm.x, rtol=1e-11, atol=1e-13, method="DOP853").y[:, -1]
        rate = model.observe(np.array([end]), end_state[None])["bodies/arm/rate"][0, 2]
        errors.append(abs(rate - linear * step))
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.1) and errors[-1] < 0.05 * abs(linear * steps[-1])


def test_frequency_response_to_a_moving_slide(arm):
    """Small sines of the slide's place below, near and beyond resonances; a period, begun in the steady answer."""
    row = [name for name, _ in arm.outputs].index("bodies/arm/rate:z")
    n, free = len(arm.mass), np.array([1, 2, 3])  # the slide stands first
    for omega in (2.0, 4.5, 9.0, 25.0):
        size = 1e-4 / omega
        sway = -(omega**2) * np.linalg.solve(1j * omega * np.eye(len(arm.A)) - arm.A, arm.B[:, 2])
        x = arm.x.copy()
        x[free] += size * sway[:n].imag
        x[arm.model.n_q + free] += size * sway[n : 2 * n].imag
        shaken = swinging(Profile(np.zeros(1), np.zeros((1, 1)), np.array([[size, omega, 0.0]])))
        model = compile_system(shaken)
        times = 2 * np.pi / omega * np.linspace(0, 1, 33)[:-1]
        motion = solve_ivp(model.state_rate, (0, times[-1]), x, t_eval=times, rtol=1e-9, atol=1e-13, method="DOP853")
        rate = model.observe(times, motion.y.T)["bodies/arm/rate"][:, 2]
        phasor = 2j * np.mean(rate * np.exp(-1j * omega * times)) / size  # of size sin(omega t)
        expected = -(omega**2) * arm.frequency_response(np.array([omega]))[0, row, 2]
        assert phasor == pytest.approx(expected, abs=3e-4 * abs(expected))


def test_closed_loop_is_linearised_about_the_given_state():
    other_state = compile_system(four_bar(speed=0.0, start=(1.6, 0.1, 1.9))).x0
    linear_at_state, expected, linear_at_start = (
        linear_model(four_bar(speed=0.0, start=start), ["joints/drive.angle/effort"], ["bodies/rocker/rate:z"], at=0.0,
                     state=x)
        for start, x in (((0.3, 0.4, 1.6), other_state), ((1.6, 0.1, 1.9), other_state), ((0.3, 0.4, 1.6), None))
    )  # fmt: skip
    assert linear_at_state.A == pytest.approx(expected.A) and linear_at_state.B == pytest.approx(expected.B)
    assert linear_at_state.C == pytest.approx(expected.C) and linear_at_state.D == pytest.approx(expected.D)
    assert np.abs(linear_at_state.C - linear_at_start.C).max() > 0.1


HINGE = """
title = "a wheel on a sprung axle"
[run]
duration = "1 s"
[bodies.wheel]
kind = "rigid"
mass = 3
inertia = [2, 2, 2]
[[joints]]
kind = "revolute"
child = "wheel"
name = "axle"
stiffness = 8
damping = 1
"""


def test_root_locus_of_a_damped_hinge_is_a_circle():
    """s = -d / 2 J +- i sqrt(k / J - (d / 2 J)^2): |s| stays at 2 rad/s."""
    vary = '[stability.vary."joints.0.damping"]\nbetween = ["0 N m s", "6 N m s"]\npoints = 4\n'
    locus = case_stability(parse_case(HINGE + vary)).result
    real = -np.array([0.0, 2.0, 4.0, 6.0]) / 4.0
    for branch, side in zip(locus.branches.T, np.sign(locus.branches[0].imag), strict=True):
        assert branch == pytest.approx(real + side * 1j * np.sqrt(4.0 - real**2), abs=1e-8)
    assert locus.name == "joints.0.damping" and locus.values == pytest.approx([0.0, 2.0, 4.0, 6.0])


XYZ = "xyz"


TURNED = np.array([[np.cos(0.3), -np.sin(0.3), 0.0], [np.sin(0.3), np.cos(0.3), 0.0], [0.0, 0.0, 1.0]])
SOFT_BEAM = UniformBeam(1.0, EA=1e4, EIy=10.0, EIz=7.0, GJ=10.0, mass_per_length=1.0, rotary_inertia=False)


def spinner(load: float = 0.6, effort: float = 0.0, gain: float = 0.0) -> System:
    """A ball-jointed hub with a beam under gravity, an accelerometer with a lag on it, and a sprung wheel."""
    hub = rigid_body(2.0, np.array([[0.5, 0.02, 0], [0.02, 0.4, 0.03], [0, 0.03, 0.6]]), [0.0, 0.02, 0.05])
    hub = replace(hub, markers={**hub.markers, "rim": Marker.at_position([0.2, 0.1, 0.0], TURNED)})
    wheel = rigid_body(0.3, np.diag([0.02, 0.01, 0.01]))
    beam = beam_body(SOFT_BEAM, BeamFunctions(y=1, z=1, axial=0, torsion=0))
    gauge = Sensor("gauge", "acceleration", "hub", "rim", bandwidth=4.0, bias=np.array([gain, 0, 0]))
    return System(
        {"hub": hub, "beam": beam, "wheel": wheel},
        (
            spherical("hub", rotation="euler_parameters", stiffness=3.0, damping=0.2),
            weld("beam", "hub", parent_marker="rim", child_marker="root"),
            revolute("wheel", "hub", name="axle", axis=[1, 2, 2], stiffness=[0.8], rest=[effort / 0.8]),
        ),
        environment=Environment(gravity=np.array([0.3, -1.0, -9.0])),
        loads=(Load("motor", "hub", "rim", "marker", torque=np.array([0.0, load, 0.0])),),
        effectors=gauge.effectors,
    )


def test_linear_model_is_the_derivative_of_rates_and_outputs():
    system = spinner()
    model = compile_system(system)
    n_q, n_u = model.n_q, model.n_u
    rng = np.random.default_rng(5)
    turn = np.array([0.9, 0.2, -0.3, 0.25])
    x = model.x0 + 0.2 * rng.normal(size=model.n_x)
    x[:4] = turn / np.linalg.norm(turn)
    outputs = ["effectors/gauge/y", "markers/beam.tip/position:z", "bodies/hub/rate:x"]
    linear = linear_model(system, ["loads/motor/torque:y", "joints/axle.angle/effort"], outputs, at=0.7, state=x)
    names = [name for name, _ in system.velocity_names()]
    assert [name for name, _ in linear.states] == [
        *(name.removesuffix("_rate").replace("omega_", "turn_") for name in names),
        *names,
        *(f"gauge.lagged_{a}" for a in XYZ),
    ]
    units = [unit for _, unit in linear.states]
    assert units[:3] == ["rad"] * 3 and units[n_u : n_u + 3] == ["rad/s"] * 3 and units[-3:] == ["m/s"] * 3
    assert (
        units[names.index("beam.delta1_rate")] == "kg^1/2 m"
        and units[n_u + names.index("beam.delta1_rate")] == "kg^1/2 m/s"
    )
    assert linear.inputs == (("loads/motor/torque:y", "N m"), ("joints/axle.angle/effort", "N m"))
    assert [unit for _, unit in linear.outputs] == ["m/s^2", "m", "rad/s"] and linear.t == 0.7 and linear.about is None

    def displaced(dxi: np.ndarray) -> np.ndarray:
        """Increments: rotation vector in body axes of the ball, the others as they are."""
        q, u, z = x[:n_q].copy(), x[n_q : n_q + n_u] + dxi[n_u : 2 * n_u], x[n_q + n_u :] + dxi[2 * n_u :]
        s, v = np.cos(np.linalg.norm(dxi[:3]) / 2), dxi[:3] / 2
        a, b = x[0], x[1:4]
        q[:4] = np.concatenate([[a * s - b @ v], a * v + s * b + np.cross(b, v)])
        q[4:] += dxi[3:n_u]
        return np.concatenate([q, u, z])

    def flow(model, x):
        """Rates of increments (dxi' = du + W dxi comes by hand below), velocities and states; outputs."""
        rate = model.state_rate(0.7, x)
        channels = model.observe(np.array([0.7]), x[None])
        output_values = [
            channels["effectors/gauge/y"][0],
            channels["markers/beam.tip/position"][0][2],
            channels["bodies/hub/rate"][0][0],
        ]
        return rate[n_q:], np.array(output_values, float)

    h, n = 1e-6, 2 * n_u + 3
    below, C = np.zeros((n_u + 3, n)), np.zeros((3, n))
    for k in range(n):
        ends = [flow(model, displaced(s * h * np.eye(n)[k])) for s in (1, -1)]
        below[:, k], C[:, k] = ((ends[0][i] - ends[1][i]) / (2 * h) for i in (0, 1))
    assert linear.A[n_u:] == pytest.approx(below, abs=3e-7 * np.abs(below).max())
    assert linear.C == pytest.approx(C, abs=3e-7 * np.abs(C).max())
    w = x[n_q : n_q + 3]
    W = np.zeros((n_u, n_u))
    W[:3, :3] = np.array([[0, w[2], -w[1]], [-w[2], 0, w[0]], [w[1], -w[0], 0]])
    assert linear.A[:n_u] == pytest.approx(np.hstack([W, np.eye(n_u), np.zeros((n_u, 3))]), abs=1e-6)
    for k, (load, effort) in enumerate(((0.5, 0.0), (0.0, 0.5))):
        ends = [flow(compile_system(spinner(0.6 + s * load, s * effort)), x) for s in (1, -1)]
        assert linear.B[:n_u, k] == pytest.approx(np.zeros(n_u), abs=1e-12)
        wanted = ends[0][0] - ends[1][0]
        assert linear.B[n_u:, k] == pytest.approx(wanted, abs=1e-7 * np.abs(wanted).max())
        assert linear.D[:, k] == pytest.approx(ends[0][1] - ends[1][1], abs=1e-7)
    assert linear.y0 == pytest.approx(flow(model, x)[1], rel=1e-12)
    part = linear.selected(["joints/axle.angle/effort"], ["bodies/hub/rate:x", "effectors/gauge/y"])
    assert part.y0 == pytest.approx(linear.y0[[2, 0]]) and part.inputs == linear.inputs[1:]
