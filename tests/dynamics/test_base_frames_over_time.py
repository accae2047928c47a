"""The base frame at any time: on ellipses from circles to long ones, several turns on, and in a skew spin."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from support.pointwise import Jet, Tree, equations, skew
from support.random_systems import random_tree

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.system import Frame, Orbit, System, free, spherical, weld

ORBIT = Orbit(7e6, 0.0, inclination=0.7, node=0.3, perigee=-0.9, true_anomaly=0.6, mu=5e20)
PERIOD = ORBIT.period


def true_anomaly(orbit, t):
    """By bisection of Kepler's equation, counted on beyond a turn."""
    e, nu0 = orbit.eccentricity, orbit.true_anomaly
    E0 = 2 * np.arctan(np.sqrt((1 - e) / (1 + e)) * np.tan(nu0 / 2))
    M = E0 - e * np.sin(E0) + orbit.mean_motion * t
    turns = np.floor((M + np.pi) / (2 * np.pi))
    M -= 2 * np.pi * turns
    E = brentq(lambda E: E - e * np.sin(E) - M, -np.pi - 1e-9, np.pi + 1e-9, xtol=1e-14, rtol=1e-15)
    return 2 * np.arctan2(np.sqrt(1 + e) * np.sin(E / 2), np.sqrt(1 - e) * np.cos(E / 2)) + 2 * np.pi * turns


@pytest.mark.parametrize("e", [0.0, 0.3, 0.79, 0.81, 0.97])
def test_o_goes_along_its_ellipse_as_kepler_says(e):
    orbit = replace(ORBIT, eccentricity=e)
    model = compile_system(System({"hub": rigid_body(3.0, np.eye(3))}, (spherical("hub"),), orbit=orbit))
    times = PERIOD * np.array([-1.3, -0.2, 0.0, 0.01, 0.2, 0.4, 0.55, 0.9, 1.0, 3.7])
    seen = model.observe(times, np.tile(model.x0, (len(times), 1)))
    nu = np.array([true_anomaly(orbit, t) for t in times])
    radius = orbit.semi_major_axis * (1 - e**2) / (1 + e * np.cos(nu))
    assert seen["orbit/true_anomaly"] == pytest.approx(nu, abs=1e-10)
    assert seen["orbit/radius"] == pytest.approx(radius, rel=1e-10)
    C_NO = Rotation.from_quat(seen["orbit/attitude"], scalar_first=True).as_matrix()
    in_plane = np.stack([0 * nu, 0 * nu, 1 + 0 * nu, np.cos(nu), np.sin(nu), 0 * nu, -np.sin(nu), np.cos(nu), 0 * nu])
    expected = orbit.C_NP() @ in_plane.T.reshape(-1, 3, 3).swapaxes(1, 2)  # normal, vertical, flight direction
    assert expected == pytest.approx(C_NO, abs=1e-10)


@pytest.mark.parametrize("part", [-0.2, 2.6])
@pytest.mark.parametrize(("e", "is_free"), [(0.3, False), (0.85, False), (0.3, True)])
def test_the_equations_later_are_those_of_an_orbit_that_starts_there(part, e, is_free):
    orbit = replace(ORBIT, eccentricity=e, free=is_free)
    there = replace(orbit, true_anomaly=true_anomaly(orbit, part * PERIOD))
    root = free if is_free else spherical
    system, _, (q, u) = random_tree(4, n_bodies=3, orbit=orbit, frame=Frame("orbital"), root=root)
    x = np.concatenate([q, u])
    later = compile_system(system).residual(part * PERIOD, x, np.cos(u))
    at_once = compile_system(replace(system, orbit=there)).residual(0.0, x, np.cos(u))
    assert later == pytest.approx(at_once, abs=1e-9 * np.abs(at_once).max())
    start = compile_system(system).residual(0.0, x, np.cos(u))
    assert np.abs(start - at_once).max() > 1e-3 * np.abs(at_once).max()


@pytest.mark.parametrize("t", [1.7, -40.0])
def test_a_frame_spins_about_its_skew_axis_from_the_inertial_axes_on(t):
    rate = np.array([0.3, -0.5, 0.7])
    system, clouds, (q, u) = random_tree(28, n_bodies=3, frame=Frame("spinning", rate))
    C = Rotation.from_rotvec(rate * t).as_matrix()

    def base(moving):
        W = skew(rate)
        return Jet(C, C @ W, C @ W @ W) if moving else Jet(C)

    udot = np.random.default_rng(3).normal(size=len(u))
    tree = Tree(system, clouds)
    theirs = equations(tree, q, u, udot, base, lambda m, r: np.zeros((len(m), 3)))
    iq = iu = 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        iq, iu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        strain = body.strain.f0 + body.strain.V1 @ q[iq : iq + n] + body.damping @ u[iu : iu + n]
        theirs[iu : iu + n] += strain
        iq, iu = iq + n, iu + n
    model, x = compile_system(system), np.concatenate([q, u])
    assert model.residual(t, x, udot) == pytest.approx(theirs, abs=1e-10 * np.abs(theirs).max())
    tree.points(q, u, udot, base(True))
    seen = model.observe(np.array([t]), x[None])
    for name in system.order:
        C_NB, place = tree.frames[name]
        found = Rotation.from_quat(seen[f"bodies/{name}/attitude"][0], scalar_first=True).as_matrix()
        assert found == pytest.approx(C_NB.v, abs=1e-12)
        assert seen[f"bodies/{name}/position"][0] == pytest.approx(place.v, abs=1e-11)


def test_a_body_welded_to_a_frame_that_does_not_spin_rests():
    system = System({"hub": rigid_body(3.0, np.eye(3))}, (weld("hub"),), frame=Frame("spinning", np.zeros(3)))
    seen = compile_system(system).observe(np.array([3.0]), np.zeros((1, 0)))
    assert not seen["bodies/hub/rate"].any()
    assert seen["bodies/hub/attitude"][0] == pytest.approx([1.0, 0, 0, 0], abs=1e-15)
