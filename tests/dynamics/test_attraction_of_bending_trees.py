"""The whole attraction of a centre, and its oblateness, on trees of bending bodies: Kane's equations over their points
of mass, each attracted at its own place; and the energy of these points."""

from dataclasses import replace

import numpy as np
import pytest
from support.pointwise import Jet, Tree, equations
from support.random_systems import random_tree

from femflex.body.mass_points import MassPoints
from femflex.dynamics import compile_system
from femflex.system import Environment, Frame, Orbit, free, spherical

MU, RADIUS, J2 = 4e4, 20.0, 0.3  # m^3/s^2, m, 1: the bodies are metres in size, the orbit some 50 m
ORBIT = {"eccentricity": 0.25, "inclination": 0.6, "node": 0.4, "perigee": 1.1, "true_anomaly": 0.8, "mu": MU}
SEEDS = (4, 28)


def system_of(seed, is_free, oblateness, attraction="auto"):
    """A random tree in orbit, its clouds as its points of mass, and a state."""
    orbit = Orbit(50.0, free=is_free, **ORBIT)
    environment = Environment(attraction=attraction, oblateness=oblateness, radius=RADIUS)
    root = free if is_free else spherical
    system, clouds, (q, u) = random_tree(seed, n_bodies=4, root=root, orbit=orbit, frame=Frame("inertial"))
    bodies = {name: replace(body, mass_points=MassPoints(*clouds[name])) for name, body in system.bodies.items()}
    bare = replace(system, bodies=bodies)
    return replace(bare, environment=environment), clouds, q, u


def place_of_orbit(orbit):
    """Place of O from the centre, by the conic."""
    r = orbit.semi_major_axis * (1 - orbit.eccentricity**2) / (1 + orbit.eccentricity * np.cos(orbit.true_anomaly))
    return orbit.C_NP() @ (r * np.array([np.cos(orbit.true_anomaly), np.sin(orbit.true_anomaly), 0.0]))


def velocity_of_orbit(orbit):
    """Velocity of O, by the hodograph of the conic."""
    speed = np.sqrt(MU / (orbit.semi_major_axis * (1 - orbit.eccentricity**2)))
    nu = orbit.true_anomaly
    return orbit.C_NP() @ (speed * np.array([-np.sin(nu), orbit.eccentricity + np.cos(nu), 0.0]))


def potential(R, oblateness):
    """-mu/r and that of J2, per mass, at places R (p, 3) from the centre."""
    r = np.linalg.norm(R, axis=-1)
    return -MU / r, oblateness * MU * RADIUS**2 / (2 * r**3) * (3 * (R[..., 2] / r) ** 2 - 1)


def attraction(R, oblateness, h=1e-3):
    """Minus the gradient of the whole potential at R (p, 3), by differences of the sixth order."""
    out = np.zeros_like(R)
    for k, weight in ((1, 45), (2, -9), (3, 1)):
        for axis in range(3):
            step = k * h * np.eye(3)[axis]
            change = sum(potential(R + step, oblateness)) - sum(potential(R - step, oblateness))
            out[:, axis] -= weight * change / (60 * h)
    return out


def still(moving):
    return Jet(np.eye(3))


@pytest.mark.parametrize(("seed", "oblateness"), [(4, J2), (28, J2), (28, 0.0)])
@pytest.mark.parametrize("is_free", [True, False])
def test_each_point_of_mass_is_attracted_at_its_own_place(seed, is_free, oblateness):
    system, clouds, q, u = system_of(seed, is_free, oblateness)
    R = place_of_orbit(system.orbit)
    motion = -MU * R / np.linalg.norm(R) ** 3  # of O, on its ellipse

    def force(m, r):
        return m[:, None] * (attraction(R + r, oblateness) - motion)

    udot = np.random.default_rng(seed).normal(size=len(u))
    ours = compile_system(system).residual(0.0, np.concatenate([q, u]), udot)
    theirs = equations(Tree(system, clouds), q, u, udot, still, force, hidden=not is_free) + strain(system, q, u)
    assert ours == pytest.approx(theirs, abs=1e-8 * np.abs(theirs).max())
    linear = compile_system(system_of(seed, is_free, 0.0, "gradient")[0]).residual(0.0, np.concatenate([q, u]), udot)
    assert np.abs(ours - linear).max() > 1e-3 * np.abs(theirs).max()


@pytest.mark.parametrize("seed", SEEDS)
def test_the_gradient_pulls_a_free_tree_about_its_centre_and_its_quadrupole_moves_that(seed):
    system, clouds, q, u = system_of(seed, True, 0.0, "gradient")
    points = Tree(system, clouds).points(q, u, 0 * u, Jet(np.eye(3)))
    m, r = np.array([p[0] for p in points]), np.array([p[1].v for p in points])
    R, c = place_of_orbit(system.orbit), m @ r / m.sum()

    def second(at):
        """Energy of the second order of points at fixed attitude, their centre of mass at a place."""
        a0 = np.linalg.norm(at)
        return -MU / a0**3 * (m @ (1.5 * ((r - c) @ at / a0) ** 2 - 0.5 * np.einsum("pi,pi->p", r - c, r - c)))

    h = 1e-3
    pull = np.array([(second(R + c - h * e) - second(R + c + h * e)) / (2 * h) for e in np.eye(3)])
    a0, l = np.linalg.norm(R + c), (R + c) / np.linalg.norm(R + c)
    centre = MU * R / np.linalg.norm(R) ** 3 - MU * (R + c) / a0**3 + pull / m.sum()

    def force(m, r):
        return m[:, None] * (centre - MU / a0**3 * (r - c - 3 * np.outer((r - c) @ l, l)))

    udot = np.random.default_rng(seed).normal(size=len(u))
    ours = compile_system(system).residual(0.0, np.concatenate([q, u]), udot)
    theirs = equations(Tree(system, clouds), q, u, udot, still, force) + strain(system, q, u)
    assert ours == pytest.approx(theirs, abs=1e-7 * np.abs(theirs).max())


def strain(system, q, u):
    """f0 + V1 delta + D ddelta at the elastic rows."""
    out, iq, iu = np.zeros(len(u)), 0, 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        iq, iu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        out[iu : iu + n] = body.strain.f0 + body.strain.V1 @ q[iq : iq + n] + body.damping @ u[iu : iu + n]
        iq, iu = iq + n, iu + n
    return out


@pytest.mark.parametrize("oblateness", [0.0, J2])
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("is_free", [True, False])
def test_the_energy_beyond_the_gradient_is_that_of_all_points(seed, is_free, oblateness):
    system, clouds, q, u = system_of(seed, is_free, oblateness)
    points = Tree(system, clouds).points(q, u, 0 * u, Jet(np.eye(3)))
    m, r = np.array([p[0] for p in points]), np.array([p[1].v for p in points])
    O, c = place_of_orbit(system.orbit), m @ r / m.sum()
    if is_free:  # linear about the centre of mass
        R, d = O + c, r - c
    else:  # whose place O is
        R, d = O, r - c
    a0 = np.linalg.norm(R)
    le, ee = d @ R / a0**2, np.einsum("pi,pi->p", d, d) / a0**2
    central, oblate = potential(R + d, oblateness)
    energy = m @ (central + MU / a0 * (1 - le - ee / 2 + 1.5 * le**2) + oblate)
    if not is_free and oblateness:  # a specified orbit takes what acts at O
        at_O = attraction(R[None], oblateness)[0] + MU * R / a0**3
        energy += m @ (d @ at_O) - m.sum() * potential(R, oblateness)[1]
    out = compile_system(system).observe(np.zeros(1), np.concatenate([q, u])[None])
    seen = {key: out[f"monitors/{key}"][0] for key in ("energy", "kinetic", "elastic", "spring", "gravity", "momentum")}
    found = seen["energy"] - seen["kinetic"] - seen["elastic"] - seen["spring"] - seen["gravity"]
    found -= is_free * velocity_of_orbit(system.orbit) @ seen["momentum"]  # of the motion of O
    assert found == pytest.approx(energy, abs=1e-7 * (m @ np.abs(oblate) + m.sum() * MU / a0 * np.abs(le).max()))


def test_energy_of_points_and_orbit_stays_while_a_free_tree_falls():
    system, _, q, u = system_of(28, True, J2)
    damped = {name: replace(body, damping=0 * body.damping) for name, body in system.bodies.items()}
    model, x, h = compile_system(replace(system, bodies=damped)), np.concatenate([q, u]), 1e-5
    rate = model.state_rate(0.0, x)
    out = model.observe(np.array([-h, h]), np.array([x - h * rate, x + h * rate]))
    changes = {key: np.diff(out[f"monitors/{key}"])[0] / (2 * h) for key in ("energy", "kinetic", "gravity")}
    assert changes["energy"] == pytest.approx(0.0, abs=1e-6 * max(abs(changes["kinetic"]), abs(changes["gravity"])))
