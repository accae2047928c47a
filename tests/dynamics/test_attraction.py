"""Attraction of the central body beyond its gradient: against own integrations of points, and by invariants."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.rotations import quaternion_from_dcm
from femflex.system import EARTH_J2, EARTH_RADIUS, MU_EARTH, Environment, Frame, Orbit, System, free, spherical
from femflex.system.attraction import is_integrated, reach

REACH = 1e4  # m: two points at this distance from the middle, one there
MASS = 300.0  # kg, a sixth of it in each of the two, the rest in the middle: as six points of its inertia have it
RODS = np.array([[0, REACH, 0], [0, 0, 0], [0, -REACH, 0]])
DM = MASS * np.array([1 / 6, 4 / 6, 1 / 6])
ORBIT = {"inclination": 0.5, "node": 0.3, "perigee": 0.2}


def rod(pitch=0.2, environment=None, is_free=True, **orbit):
    """A rigid rod in orbit, at rest in its frame but for a pitch, and the orbit."""
    inertia = MASS / 3 * REACH**2 * np.diag([1.0, 1e-9, 1.0])  # not zero along it: it is to turn about itself too
    c, s = np.cos(pitch), np.sin(pitch)
    start = quaternion_from_dcm(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]))
    joint = free("rod", q0=np.concatenate([np.zeros(3), start])) if is_free else spherical("rod", q0=start)
    path = Orbit.from_perigee(400e3, free=is_free, **{**ORBIT, **orbit})
    body = rigid_body(MASS, inertia)
    return System({"rod": body}, (joint,), orbit=path, frame=Frame("orbital"), environment=environment or Environment())


def acceleration(r, J2):
    """Of a point at r (..., 3) from the centre."""
    d = np.linalg.norm(r, axis=-1, keepdims=True)
    z = r[..., 2:]
    pole = np.array([0, 0, 1.0])
    oblate = -1.5 * J2 * MU_EARTH * EARTH_RADIUS**2 / d**5 * ((1 - 5 * (z / d) ** 2) * r + 2 * z * pole)
    return -MU_EARTH * r / d**3 + oblate


@pytest.mark.parametrize("J2", [0.0, EARTH_J2])
def test_a_free_rod_moves_as_its_own_points_do(J2):
    system = rod(environment=Environment(oblateness=J2))
    model = compile_system(system)
    times = np.linspace(0, system.orbit.period, 201)
    solution = Dop853(rtol=1e-12, atol=1e-12).solve(model, times, model.x0)
    seen = model.observe(times, solution.states)
    first = compile_system(system).observe(times[:1], model.x0[None])
    C_NB = np.array([rotated(q) for q in seen["bodies/rod/attitude"]])
    where, V = kepler(system.orbit, times)
    e0 = C_NB[0][:, 1]
    omega = rotated(first["bodies/rod/attitude"][0]) @ first["bodies/rod/rate"][0]
    start = np.concatenate([where[0], V[0], e0, np.cross(omega, e0)])

    def rates(t, y):
        R, V, e, de = y.reshape(4, 3)
        a = acceleration(R + np.outer([1, 0, -1], e) * REACH, J2)
        pull = (a[0] - a[2]) / (2 * REACH)
        dde = pull - (pull @ e) * e - (de @ de) * e
        return np.concatenate([V, DM @ a / MASS, de, dde])

    own = solve_ivp(rates, (0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-10).y.T
    assert np.abs(C_NB[:, :, 1] - own[:, 6:9]).max() < 1e-8
    moved = seen["bodies/rod/position"]
    assert np.abs(moved - (own[:, :3] - where)).max() < 1e-6 * max(1.0, np.abs(moved).max())
    energy = seen["monitors/energy"]
    assert np.abs(energy - energy[0]).max() < 1e-9 * np.abs(seen["monitors/kinetic"]).max()


def own_pitch(system, times, pitch):
    """Pitch of the rod about O on its circle, from the torque of its own points."""
    a = system.orbit.semi_major_axis

    def rates(t, y):
        e = np.array([np.cos(y[0]), np.sin(y[0])])  # along the vertical, and the direction of motion
        R = np.array([a, 0.0]) + np.outer([1, -1], e) * REACH
        f = -MU_EARTH * R / np.linalg.norm(R, axis=1)[:, None] ** 3
        return [y[1], (f[0] - f[1]) @ [-e[1], e[0]] / (2 * REACH)]

    return solve_ivp(rates, (0, times[-1]), [pitch, 0.0], "DOP853", times, rtol=1e-12, atol=1e-14).y[0]


@pytest.mark.parametrize(("attraction", "error"), [("auto", 1e-8), ("gradient", 1.0)])
def test_on_a_specified_orbit_the_torque_is_that_of_the_points(attraction, error):
    system = rod(0.5, Environment(attraction=attraction), is_free=False, inclination=0.0)
    model = compile_system(system)
    times = np.linspace(0, system.orbit.period, 101)
    states = Dop853(rtol=1e-12, atol=1e-14).solve(model, times, model.x0).states
    found = model.observe(times, states)["attitude/angles"][:, 0]
    off = np.abs(found - own_pitch(system, times, 0.5)).max()
    assert off < error
    assert attraction == "auto" or off > 1e-6  # what the gradient leaves out is seen


def test_it_can_be_left_out():
    system = rod(0.5, is_free=False)
    model, plain = compile_system(system), compile_system(rod(0.5, Environment(attraction="gradient"), is_free=False))
    without = model.without("attraction/exact")
    assert np.array_equal(without.state_rate(0.0, model.x0), plain.state_rate(0.0, model.x0))
    assert not np.array_equal(model.state_rate(0.0, model.x0), plain.state_rate(0.0, model.x0))


def test_it_is_integrated_from_a_stated_size_on():
    assert is_integrated(rod())
    found = reach(rod())
    assert found.ratio == pytest.approx(REACH / 6778137.0)
    assert found.error == pytest.approx(1.5 * found.ratio)
    small = System({"hub": rigid_body(10.0, np.eye(3))}, (spherical("hub"),), orbit=Orbit.from_perigee(400e3))
    assert not is_integrated(small)


@pytest.mark.parametrize(("change", "sentence"), [({"attraction": "full"}, "known are"), ({"radius": 0.0}, "positive")])
def test_an_environment_that_cannot_be_is_refused(change, sentence):
    with pytest.raises(ValueError, match=sentence):
        Environment(**change)


def rotated(q):
    """C_NB of scalar-first Euler parameters."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def kepler(orbit, times):
    """Places and velocities (t, 3) on a circular orbit."""
    n, a, C = orbit.mean_motion, orbit.semi_major_axis, orbit.C_NP()
    plane = np.column_stack([np.cos(n * times), np.sin(n * times), 0 * times])
    across = np.column_stack([-np.sin(n * times), np.cos(n * times), 0 * times])
    return a * plane @ C.T, n * a * across @ C.T
