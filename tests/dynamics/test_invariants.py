"""What motion keeps: closed forms of tumbling, energy, momenta and the Jacobi integral of flexible craft."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import ellipj
from support.random_systems import random_body

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate.dop853 import Dop853
from femflex.system import Environment, Frame, Orbit, System, free, revolute, spherical, weld

TIGHT = Dop853(rtol=1e-12, atol=1e-13)


def undamped(n, seed):
    """A random body with n shapes of 3 rad/s and no damping, one marker that moves and one that does not."""
    body, _ = random_body(np.random.default_rng(seed), n)
    stiffness = StrainTensors.linear(9.0 * body.moments.elastic_mass())
    markers = {"tip": body.markers["a"], "end": Marker.rigid(body.markers["b"].position, n_modes=n)}
    return FlexibleBody(body.moments, stiffness, np.zeros((n, n)), markers)


def craft(root, **more):
    """A hub with a welded flexible body, and a second one that turns freely on the first one's moving node."""
    hub = rigid_body(9.0, np.diag([3.0, 5.0, 4.0]), markers={"side": Marker.rigid([0.7, 0, 0])})
    bodies = {"hub": hub, "arm": undamped(5, 0), "leaf": undamped(3, 1)}
    where = {"parent_marker": "tip", "child_marker": "end"}
    joints = (
        root,
        weld("arm", "hub", parent_marker="side", child_marker="end"),
        revolute("leaf", "arm", axis=(0.2, 1.0, 0.3), u0=[0.4], **where),
    )
    delta = {"arm": np.array([0.03, -0.03, 0.13, 0.02, -0.11]), "leaf": np.array([0.07, 0.26, 0.19])}
    return compile_system(System(bodies, joints, delta0=delta, **more))


def test_torque_free_tumbling_follows_jacobis_elliptic_functions():
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


def test_a_spin_about_the_middle_axis_grows_exponentially():
    """Small rates across the spin follow the two exponentials of Euler's linearised equations."""
    I1, I2, I3 = 2.0, 3.0, 4.5
    spin, small = 1.2, 1e-5
    rate = spin * np.sqrt((I2 - I1) * (I3 - I2) / (I1 * I3))
    other = (I2 - I1) * spin / (I3 * rate)  # d w3/dt = -(I2 - I1)/I3 w1 w2
    body = rigid_body(5.0, np.diag([I1, I2, I3]))
    model = compile_system(System({"body": body}, (free("body", u0=[0, 0, 0, small, spin, -other * small]),)))
    times = np.linspace(0.0, 8.0, 17)
    found = model.observe(times, TIGHT.solve(model, times, model.x0).states)["bodies/body/rate"]
    grown = small * np.exp(rate * times)
    assert grown[-1] / small > 40
    assert found[:, 0] == pytest.approx(grown, abs=1e-8)  # what is left out is of the third order, 1e-10
    assert found[:, 2] == pytest.approx(-other * grown, abs=1e-8)


def test_a_chain_of_rods_keeps_its_energy_and_its_momenta():
    """Ten rods on ball joints, thrown: energy and momenta to ten digits although they tangle."""
    n, half = 10, 0.5
    thin = np.diag([1e-3, 1 / 12, 1 / 12])
    ends = {"head": Marker.rigid([-half, 0, 0]), "tail": Marker.rigid([half, 0, 0])}
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


@pytest.mark.parametrize("rotation", ["euler_parameters", "xyz"])
def test_flexible_tumbling_keeps_energy_and_both_momenta(rotation):
    model = craft(free("hub", u0=[0.2, -0.1, 0.3, 0.5, -0.4, 0.6], rotation=rotation))
    times = np.linspace(0.0, 12.0, 25)
    out = model.observe(times, TIGHT.solve(model, times, model.x0).states)
    assert np.ptp(out["monitors/elastic"]) > 0.01 * out["monitors/energy"][0]  # the shapes take part
    for name in ("energy", "momentum", "angular_momentum"):
        values = out[f"monitors/{name}"]
        assert values == pytest.approx(np.broadcast_to(values[0], values.shape), abs=1e-9 * np.abs(values[0]).max())
    straight = out["monitors/center_of_mass"][0] + np.outer(times, out["monitors/momentum"][0] / craft_mass(model))
    assert out["monitors/center_of_mass"] == pytest.approx(straight, abs=1e-8)


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


def test_free_orbit_keeps_energy_and_total_angular_momentum_in_a_strong_gradient():
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


def test_free_orbit_of_a_rigid_body_keeps_the_energy_of_the_second_order_potential():
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


def test_circular_specified_orbit_keeps_the_jacobi_integral():
    orbit = Orbit(20.0, 0.0, inclination=0.6, node=0.3, mu=40.0)
    model = craft(spherical("hub", u0=[0.2, -0.3, 0.1]), orbit=orbit, frame=Frame("orbital"))
    times = np.linspace(0.0, 30.0, 31)
    out = model.observe(times, TIGHT.solve(model, times, model.x0).states)
    jacobi = out["monitors/jacobi"]
    assert np.ptp(out["monitors/energy"]) > 1e-3 * np.abs(jacobi[0])  # energy alone is not kept
    assert jacobi == pytest.approx(np.full(31, jacobi[0]), abs=1e-9 * out["monitors/kinetic"].max())


def planar_beam(n=4):
    """Shapes that bend in the orbital plane: points along the vertical (body y), moving along flight (body z)."""
    s = np.linspace(0.1, 3.0, 12)
    rho = np.column_stack([0 * s, s, 0 * s])
    phi = np.zeros((12, 3, n))
    phi[:, 2, :] = (s[:, None] / 3.0) ** (2 + np.arange(n))
    z, mass = np.concatenate([rho[:, None, :], phi.swapaxes(1, 2)], axis=1), np.full(12, 0.4)
    moments = MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))
    return FlexibleBody(moments, StrainTensors.linear(moments.elastic_mass()), np.zeros((n, n)), {})


def test_pitch_and_bending_in_the_orbital_plane_stay_there_exactly():
    hub = rigid_body(5.0, np.diag([4.0, 2.0, 3.0]))
    bodies = {"hub": hub, "boom": planar_beam()}
    q0 = [np.cos(0.2), np.sin(0.2), 0.0, 0.0]
    joints = (spherical("hub", q0=q0), weld("boom", "hub"))
    delta = {"boom": np.array([0.1, -0.05, 0.02, 0.0])}
    orbit = Orbit(20.0, 0.2, mu=40.0)
    model = compile_system(System(bodies, joints, orbit=orbit, frame=Frame("orbital"), delta0=delta))
    times = np.linspace(0.0, 40.0, 41)
    out = model.observe(times, Dop853(rtol=1e-9, atol=1e-12).solve(model, times, model.x0).states)
    assert np.ptp(out["attitude/angles"][:, 0]) > 0.3
    assert np.ptp(out["bodies/boom/delta"][:, 0]) > 0.05
    assert np.all(out["attitude/angles"][:, 1:] == 0.0)
    assert np.all(out["bodies/hub/rate"][:, 1:] == 0.0)
