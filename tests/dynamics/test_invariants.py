"""Closed forms of tumbling, energy, momenta, the Jacobi integral, and the limits when terms are switched off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import ellipj
from support.mechanisms import sleigh
from support.random_systems import random_body

from femflex.body import FlexibleBody, Marker, StrainTensors, rigid_body
from femflex.case import read_case
from femflex.dynamics import compile_system
from femflex.integrate import Dop853, integrator
from femflex.pipeline.decisions import build_system
from femflex.reduction import UniformBeam, beam_body
from femflex.reduction.admissible import BeamFunctions
from femflex.system import Environment, Frame, Orbit, System, free, prismatic, revolute, spherical, weld

TIGHT = Dop853(rtol=1e-12, atol=1e-13)


def undamped(n, seed):
    """A random body with n shapes of 3 rad/s and no damping, one marker that moves and one that does not."""
    body, _ = random_body(np.random.default_rng(seed), n)
    stiffness = StrainTensors.linear(9.0 * body.moments.elastic_mass())
    markers = {"tip": body.markers["a"], "end": Marker.at_position(body.markers["b"].position, n_modes=n)}
    return FlexibleBody(body.moments, stiffness, np.zeros((n, n)), markers)


def craft(root, **more):
    """A hub with a welded flexible body, and a second one that turns freely on the first one's moving node."""
    hub = rigid_body(9.0, np.diag([3.0, 5.0, 4.0]), markers={"side": Marker.at_position([0.7, 0, 0])})
    bodies = {"hub": hub, "arm": undamped(5, 0), "leaf": undamped(3, 1)}
    where = {"parent_marker": "tip", "child_marker": "end"}
    joints = (
        root,
        weld("arm", "hub", parent_marker="side", child_marker="end"),
        revolute("leaf", "arm", axis=(0.2, 1.0, 0.3), u0=[0.4], **where),
    )
    delta = {"arm": np.array([0.03, -0.03, 0.13, 0.02, -0.11]), "leaf": np.array([0.07, 0.26, 0.19])}
    return compile_system(System(bodies, joints, delta0=delta, **more))


def test_torque_free_tumbling_matches_elliptic_functions():
    # Landau & Lifshitz, Mechanics, section 37: I1 < I2 < I3 and H^2 > 2 E I2
    I1, I2, I3 = 2.0, 3.0, 4.5
    w1, w3 = 0.5, 0.8
    twice_energy, square = I1 * w1**2 + I3 * w3**2, (I1 * w1) ** 2 + (I3 * w3) ** 2
    assert square > twice_energy * I2
    rate = np.sqrt((I3 - I2) * (square - twice_energy * I1) / (I1 * I2 * I3))
    modulus = (I2 - I1) * (twice_energy * I3 - square) / ((I3 - I2) * (square - twice_energy * I1))
    body = rigid_body(5.0, np.diag([I1, I2, I3]), center_of_mass=[0.3, -0.2, 0.5])
    model = compile_system(System({"body": body}, (free("body", u0=[0, 0, 0, w1, 0, w3]),)))
    times = np.linspace(0.0, 60.0, 61)
    run = TIGHT.solve(model, times, model.x0)
    sn, cn, dn, _ = ellipj(rate * times, modulus)
    middle = np.sqrt((twice_energy * I3 - square) / (I2 * (I3 - I2)))
    expected = np.column_stack([w1 * cn, middle * sn, w3 * dn])
    assert model.observe(times, run.states)["bodies/body/rate"] == pytest.approx(expected, abs=1e-10)


def test_chain_of_rods_conserves_energy_and_momenta():
    """Ten rods on ball joints, thrown: energy and momenta to ten digits although they tangle."""
    n, half = 10, 0.5
    thin = np.diag([1e-3, 1 / 12, 1 / 12])
    ends = {"head": Marker.at_position([-half, 0, 0]), "tail": Marker.at_position([half, 0, 0])}
    bodies = {f"rod{k}": rigid_body(1.0, thin, markers=ends) for k in range(n)}
    joints = [free("rod0", u0=[0.1, 0.2, -0.1, 0.0, 0.4, -0.3])]
    for k in range(1, n):
        where = {"parent_marker": "tail", "child_marker": "head"}
        joints.append(spherical(f"rod{k}", f"rod{k - 1}", u0=[0.2, (-1) ** k * 0.8, 0.5], **where))
    model = compile_system(System(bodies, tuple(joints)))
    times = np.linspace(0.0, 20.0, 41)
    out = model.observe(times, TIGHT.solve(model, times, model.x0).states)
    for name in ("energy", "momentum", "angular_momentum"):
        values = out[f"monitors/{name}"]
        assert values == pytest.approx(np.broadcast_to(values[0], values.shape), abs=1e-9 * np.abs(values[0]).max())


def craft_mass(model):
    return sum(body.moments.mass for body in model.system.bodies.values())


def strong_orbit():
    """A free eccentric orbit only some twenty times as wide as the craft."""
    return Orbit(60.0, 0.35, inclination=0.6, node=0.3, perigee=1.2, true_anomaly=0.5, mu=1080.0, free=True)


def place_of_O(orbit, nu):
    """Position and velocity of O, inertial components, from the conic's equations."""
    p = orbit.semi_major_axis * (1 - orbit.eccentricity**2)
    r, speed = p / (1 + orbit.eccentricity * np.cos(nu)), np.sqrt(orbit.mu / p)
    position = r * np.array([np.cos(nu), np.sin(nu), 0 * nu])
    velocity = speed * np.array([-np.sin(nu), orbit.eccentricity + np.cos(nu), 0 * nu])
    return (orbit.C_NP() @ position).T, (orbit.C_NP() @ velocity).T


def test_free_orbit_conserves_energy_and_angular_momentum():
    orbit = strong_orbit()
    model = craft(free("hub", u0=[0.05, -0.1, 0.1, 0.5, -0.4, 0.6]), orbit=orbit)
    times = np.linspace(0.0, 30.0, 31)
    out = model.observe(times, TIGHT.solve(model, times, model.x0).states)
    assert np.ptp(out["monitors/gravity"]) > 1.0  # J: of the order of everything else
    assert out["monitors/energy"] == pytest.approx(np.full(31, out["monitors/energy"][0]), rel=1e-9)
    mass = craft_mass(model)
    R, V = place_of_O(orbit, out["orbit/true_anomaly"])
    R, V = R + out["monitors/center_of_mass"], V + out["monitors/momentum"] / mass
    spin = out["monitors/angular_momentum"]
    total = spin + mass * np.cross(R, V)
    assert np.ptp(spin, axis=0).max() > 1.0  # N m s: orbit and attitude exchange it
    assert total == pytest.approx(np.broadcast_to(total[0], total.shape), abs=1e-9 * np.abs(total).max())


def test_rigid_body_in_free_orbit_conserves_energy():
    # everything from the channels' positions and rates: T + U of eq. (6), U = -mu m/a0 - mu (tr J - 3 l.J l)/(2 a0^3)
    orbit, J, mass = strong_orbit(), np.diag([3.0, 5.0, 6.0]), 2.0
    body = rigid_body(mass, J)
    joint = free("body", u0=[0.02, -0.1, 0.05, 0.3, 0.5, -0.2])
    by_gradient = Environment(attraction="gradient")
    model = compile_system(System({"body": body}, (joint,), orbit=orbit, environment=by_gradient))
    times = np.linspace(0.0, 20.0, 21)
    states = TIGHT.solve(model, times, model.x0).states
    out = model.observe(times, states)
    R, V = place_of_O(orbit, out["orbit/true_anomaly"])
    R, V = R + out["bodies/body/position"], V + out["monitors/momentum"] / mass
    a0, rate = np.linalg.norm(R, axis=1), out["bodies/body/rate"]
    l = Rotation.from_quat(np.roll(out["bodies/body/attitude"], -1, axis=1)).inv().apply(R / a0[:, None])
    kinetic = 0.5 * mass * (V**2).sum(1) + 0.5 * (rate @ J * rate).sum(1)
    potential = -orbit.mu * mass / a0 - orbit.mu / (2 * a0**3) * (np.trace(J) - 3 * (l @ J * l).sum(1))
    assert np.ptp(potential) > 1.0
    assert kinetic + potential == pytest.approx(np.full(21, kinetic[0] + potential[0]), rel=1e-10)
    moved = kinetic + potential - out["monitors/energy"]  # the monitor leaves out the Kepler energy of O
    assert moved == pytest.approx(np.full(21, -orbit.mu * mass / (2 * orbit.semi_major_axis)), rel=1e-10)


def test_circular_orbit_conserves_jacobi_integral():
    orbit = Orbit(20.0, 0.0, inclination=0.6, node=0.3, mu=40.0)
    model = craft(spherical("hub", u0=[0.2, -0.3, 0.1]), orbit=orbit, frame=Frame("orbital"))
    times = np.linspace(0.0, 30.0, 31)
    out = model.observe(times, TIGHT.solve(model, times, model.x0).states)
    jacobi = out["monitors/jacobi"]
    assert np.ptp(out["monitors/energy"]) > 1e-3 * np.abs(jacobi[0])  # energy alone is not kept
    assert jacobi == pytest.approx(np.full(31, jacobi[0]), abs=1e-9 * out["monitors/kinetic"].max())


CASES = Path(__file__).parents[2] / "cases"
CART, BOB, LENGTH, INERTIA, WEIGHT = 3.0, 2.0, 0.7, 0.3, 9.81


def cart(**more) -> System:
    """A pendulum on a cart that slides along x; gravity along -y, the angle from x."""
    joints = (
        prismatic("cart", axis=[1, 0, 0], name="rail", u0=[0.4]),
        revolute("bob", "cart", name="pin", q0=[-0.9], u0=[1.3]),
    )
    bodies = {"cart": rigid_body(CART, np.eye(3)), "bob": rigid_body(BOB, INERTIA * np.eye(3), [LENGTH, 0, 0])}
    gravity = Environment(gravity=np.array([0.0, -WEIGHT, 0.0]))
    return System(bodies, joints, environment=gravity, **{"momenta": True, **more})


def motion(system: System, times: np.ndarray) -> dict:
    """Every channel of a motion from the initial state."""
    model = compile_system(system)
    return model.observe(times, Dop853(rtol=1e-12, atol=1e-13).solve(model, times, model.x0).states)


def test_momenta_of_pendulum_on_cart():
    times = np.linspace(0, 2, 9)
    seen = motion(cart(), times)
    (_, angle), (speed, rate) = seen["q"].T, seen["u"].T
    across = -BOB * LENGTH * np.sin(angle)
    wanted = np.stack([(CART + BOB) * speed + across * rate, across * speed + (INERTIA + BOB * LENGTH**2) * rate], 1)
    assert seen["momenta"] == pytest.approx(wanted, rel=1e-11)
    assert seen["monitors/hamiltonian"] == pytest.approx(seen["monitors/energy"], rel=1e-11)
    assert np.ptp(seen["momenta"][:, 0]) < 1e-9  # nothing acts along the rail


def test_hamiltonian_in_circular_orbit_is_jacobi_integral():
    system = replace(build_system(read_case(CASES / "orbiter_roll5.toml")), momenta=True)
    assert system.orbit is not None
    seen = motion(system, np.linspace(0, system.orbit.period / 2, 7))
    jacobi = seen["monitors/jacobi"]
    assert seen["monitors/hamiltonian"] == pytest.approx(jacobi, rel=1e-9) and np.ptp(jacobi) < 1e-6 * abs(jacobi[0])


def test_hamiltonian_in_spinning_frame():
    spin = np.array([0.0, 0.0, 0.7])
    body = rigid_body(5.0, np.diag([1.0, 2.0, 2.5]))
    craft = System(
        {"hub": body}, (free("hub", u0=[0.1, 0, 0, 0.2, 0.1, 0]),), frame=Frame("spinning", spin), momenta=True
    )
    seen = motion(craft, np.linspace(0, 5, 6))
    H = seen["monitors/angular_momentum"] + np.cross(seen["monitors/center_of_mass"], seen["monitors/momentum"])
    assert seen["monitors/hamiltonian"] == pytest.approx(seen["monitors/energy"] - H @ spin, rel=1e-10)
    assert np.ptp(seen["monitors/hamiltonian"]) < 1e-9


def boom_craft(**more):
    beam = UniformBeam(length=12.0, EA=1e6, EIy=900.0, EIz=900.0, GJ=700.0, mass_per_length=0.5)
    boom = beam_body(beam, BeamFunctions(y=2, z=2))
    from femflex.body import rigid_body

    hub = rigid_body(60.0, np.diag([30.0, 40.0, 50.0]))
    joints = (free("hub", u0=[0, 0, 0, 0.1, 0.3, -0.2]), revolute("boom", "hub", stiffness=40.0))
    return System({"hub": hub, "boom": boom}, joints, delta0={"boom": np.array([0.3, 0, 0.1, 0])}, **more)


def test_without_flexibility_is_limit_of_stiff_bodies():
    model = compile_system(boom_craft())
    rigid = model.without("flexibility")
    assert rigid.n_u == 7 and rigid.omitted == ("flexibility",) and model.n_u == 11
    assert [body.n_modes for body in rigid.system.bodies.values()] == [0, 0]
    moments = model.system.bodies["boom"].moments
    assert rigid.system.bodies["boom"].moments.inertia() == pytest.approx(moments.inertia(), rel=1e-15)
    differences = []
    for stiffer in (1e2, 1e4):  # started in the spinning boom's shape of rest, so that it hardly vibrates
        body = replace(
            model.system.bodies["boom"], strain=StrainTensors.linear(stiffer * model.system.bodies["boom"].strain.V1)
        )
        stiff = compile_system(replace(model.system, bodies={**model.system.bodies, "boom": body}, delta0={}))
        times = np.linspace(0, 2, 5)
        runs = [integrator("dop853", rtol=1e-9, atol=1e-10).solve(m, times, m.x0).states[-1] for m in (stiff, rigid)]
        differences.append(np.abs(runs[0][:8] - runs[1][:8]).max())
    assert differences[1] < 1e-3 and differences[0] / differences[1] > 30  # the compliance


def test_sleigh_without_centrifugal_force_turns_in_place():
    """Nothing pulls the mass ahead of the blade forward: m vdot = 0 and J omegadot = -m a v omega with v = 0."""
    model = compile_system(sleigh(1.7))
    less, times = model.without("coriolis_centrifugal"), np.linspace(0, 3, 13)
    u = integrator("dop853").solve(less, times, less.x0).states[:, model.n_q :]
    assert u == pytest.approx(np.tile([0, 0, 0, 0, 0, 1.7], (13, 1)), abs=1e-10)
    assert integrator("dop853").solve(model, times, model.x0).states[-1, -1] < 1.0
