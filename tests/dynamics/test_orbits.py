"""Free orbits under zonal harmonics and the tides of Sun and Moon; specified orbits that drift at the rates of J2."""

from decimal import Decimal, getcontext

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp
from scipy.special import eval_legendre

from femflex import simulate
from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.effectors import Moon, Sun
from femflex.rotations import dcm_from_angles, dcm_from_quaternion
from femflex.system import (
    EARTH_J2,
    EARTH_RADIUS,
    EARTH_ZONALS,
    MU_EARTH,
    Environment,
    Frame,
    Orbit,
    System,
    free,
    spherical,
    with_effectors,
)
from femflex.system.environment import days_since_j2000

MASS, INERTIA = 100.0, np.diag([10.0, 12.0, 14.0])
DAY = 86400.0
GM = {"sun": 1.32712440018e20, "moon": 4.902800066e12}  # m^3/s^2, JPL DE 430


def craft(orbit, frame="inertial", **environment):
    """A rigid craft at rest in its frame, its centre of mass at O."""
    joint = free("hub") if orbit.free else spherical("hub")
    return System(
        {"hub": rigid_body(MASS, INERTIA)},
        (joint,),
        orbit=orbit,
        frame=Frame(frame),
        environment=Environment(**environment),
    )


def kepler(orbit, times):
    """Places and velocities (t, 3) on the ellipse, by Newton's method for the eccentric anomaly, from the perigee."""
    n, a, e = orbit.mean_motion, orbit.semi_major_axis, orbit.eccentricity
    M = n * times
    E = M + e * np.sin(M)
    for _ in range(50):
        E = E - (E - e * np.sin(E) - M) / (1 - e * np.cos(E))
    root = np.sqrt(1 - e * e)
    R = a * np.column_stack([np.cos(E) - e, root * np.sin(E), 0 * E])
    V = (n * a / (1 - e * np.cos(E)))[:, None] * np.column_stack([-np.sin(E), root * np.cos(E), 0 * E])
    return R @ orbit.C_NP().T, V @ orbit.C_NP().T


def flown(system, duration, rows, rtol=1e-12):
    """Times, places, velocities and channels of a craft on its free orbit."""
    run = simulate(system, duration, integrator="dop853", rtol=rtol, atol=rtol, output_step=duration / rows)
    R, V = kepler(system.orbit, run.times)
    return run.times, R + run["monitors/center_of_mass"], V + run["monitors/momentum"] / MASS, run


def elements(R, V):
    """Osculating a, e, node, perigee and mean anomaly (t,), the angles continuous."""
    r, h = np.linalg.norm(R, axis=1), np.cross(R, V)
    node = np.arctan2(h[:, 0], -h[:, 1])
    k = np.column_stack([np.cos(node), np.sin(node), 0 * node])
    across = np.cross(h / np.linalg.norm(h, axis=1)[:, None], k)
    ecc = np.cross(V, h) / MU_EARTH - R / r[:, None]
    e, a = np.linalg.norm(ecc, axis=1), 1 / (2 / r - (V * V).sum(axis=1) / MU_EARTH)
    perigee = np.arctan2((ecc * across).sum(axis=1), (ecc * k).sum(axis=1))
    E = np.arctan2((R * V).sum(axis=1) / np.sqrt(MU_EARTH * a), 1 - r / a)
    return a, e, np.unwrap(node), np.unwrap(perigee), np.unwrap(E) - (R * V).sum(axis=1) / np.sqrt(MU_EARTH * a)


def mean_rates(times, *values, turns=20):
    """Rates of quantities: change between their means over the first and the last of so many revolutions."""
    per = (len(times) - 1) // turns
    return [(x[-per:].mean() - x[:per].mean()) / (times[-per:].mean() - times[:per].mean()) for x in values]


def test_energy_is_constant_under_zonals():
    orbit = Orbit(EARTH_RADIUS + 900e3, 0.05, 1.1, 0.3, 0.4, free=True)
    _, R, V, _ = flown(craft(orbit, oblateness=EARTH_ZONALS), 10 * orbit.period, 500)
    r = np.linalg.norm(R, axis=1)
    U = -MU_EARTH / r
    for n, J in enumerate(EARTH_ZONALS, 2):
        U += MU_EARTH * J * EARTH_RADIUS**n / r ** (n + 1) * eval_legendre(n, R[:, 2] / r)
    E = (V * V).sum(axis=1) / 2 + U
    assert np.ptp(E) < 1e-10 * np.abs(E).max()
    assert np.ptp((V * V).sum(axis=1) / 2 - MU_EARTH / r) > 1e-4 * np.abs(E).max()  # what the zonals exchange


def test_zonals_move_mean_elements_at_published_rates():
    """J3 the eccentricity (Kaula, Theory of Satellite Geodesy), J4 the node (Vallado, section 9.6). Each alone."""
    _, J3, J4 = EARTH_ZONALS[:3]
    for e, zonals in ((0.1, (0, J3)), (0.001, (0, 0, J4))):
        orbit = Orbit(EARTH_RADIUS + 1500e3, e, 1.0, 0.3, 0.4, free=True)
        R_p, s = EARTH_RADIUS / (orbit.semi_major_axis * (1 - e * e)), np.sin(1.0)
        times, R, V, _ = flown(craft(orbit, oblateness=zonals), 20 * orbit.period, 4000)
        e_rate, node_rate = mean_rates(times, *elements(R, V)[1:3])
        if len(zonals) == 2:
            expected = -1.5 * J3 * R_p**3 * (1 - e * e) * s * (1 - 1.25 * s * s) * np.cos(0.4)
            assert e_rate == pytest.approx(orbit.mean_motion * expected, rel=0.01)
        else:
            expected = 15 / 32 * J4 * R_p**4 * np.cos(1.0) * (8 - 14 * s * s)
            assert node_rate == pytest.approx(orbit.mean_motion * expected, rel=0.005)


def test_secular_rates_are_those_of_a_free_orbit():
    orbit = Orbit(EARTH_RADIUS + 1500e3, 0.1, 1.2, 0.3, 0.4, free=True)
    times, R, V, _ = flown(craft(orbit, oblateness=EARTH_J2), 20 * orbit.period, 4000)
    a, e, node, perigee, M = elements(R, V)
    mean = Orbit(a.mean(), e.mean(), orbit.inclination).with_secular_rates(EARTH_J2, EARTH_RADIUS)
    node_rate, perigee_rate, M_rate = mean_rates(times, node, perigee, M)
    assert mean.node_rate == pytest.approx(node_rate, rel=0.01)
    assert mean.perigee_rate == pytest.approx(perigee_rate, rel=0.01)
    assert mean.anomaly_rate == pytest.approx(M_rate - mean.mean_motion, rel=0.01)


def test_sun_synchronous_and_critical_inclination():
    """98.603 deg at 800 km (Vallado, section 11.4.1); the perigee rests where 5 cos^2 i = 1."""
    orbit = Orbit(EARTH_RADIUS + 800e3, inclination=np.radians(98.603)).with_secular_rates(EARTH_J2, EARTH_RADIUS)
    assert np.degrees(orbit.node_rate * DAY) == pytest.approx(360 / 365.2422, rel=5e-4)
    molniya = Orbit(26.6e6, 0.74, np.radians(63.4349488)).with_secular_rates(EARTH_J2, EARTH_RADIUS)
    assert abs(molniya.perigee_rate) < 1e-8 * abs(molniya.node_rate)


def test_attitude_in_a_drifting_orbital_frame_is_that_of_eulers_equations():
    """Node, perigee and anomaly drift a thousand times faster than about the Earth."""
    kepler_orbit = Orbit(7e6, 0.1, 1.1, 0.3, 0.4)
    n = kepler_orbit.mean_motion
    drift = {"node_rate": 0.09 * n, "perigee_rate": -0.05 * n, "anomaly_rate": 0.07 * n}
    orbit = Orbit(7e6, 0.1, 1.1, 0.3, 0.4, **drift)

    def frame(t):
        """C_NO and the place of O."""
        M, e = (n + drift["anomaly_rate"]) * t, orbit.eccentricity
        E = M
        for _ in range(60):
            E = E - (E - e * np.sin(E) - M) / (1 - e * np.cos(E))
        nu = 2 * np.arctan2(np.sqrt(1 + e) * np.sin(E / 2), np.sqrt(1 - e) * np.cos(E / 2))
        turn = [0.3 + drift["node_rate"] * t, 1.1, 0.4 + drift["perigee_rate"] * t + nu]
        x, y, z = dcm_from_angles(turn, "zxz").T  # outward, in flight direction, normal
        return np.column_stack([z, x, y]), orbit.semi_major_axis * (1 - e * np.cos(E)) * x

    def rates(t, y):
        C, w = y[:9].reshape(3, 3), y[9:]
        r = C.T @ frame(t)[1]
        d = np.linalg.norm(r)
        torque = 3 * MU_EARTH / d**5 * np.cross(r, INERTIA @ r) - np.cross(w, INERTIA @ w)
        skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return np.concatenate([(C @ skew).ravel(), torque / np.diag(INERTIA)])

    run = simulate(craft(orbit, "orbital"), 2 * orbit.period, integrator="dop853", rtol=1e-12, atol=1e-13)
    h = 1e-2
    W = frame(0)[0].T @ (frame(h)[0] - frame(-h)[0]) / (2 * h)
    start = np.concatenate([frame(0)[0].ravel(), [W[2, 1], W[0, 2], W[1, 0]]])  # at rest in the frame
    own = solve_ivp(rates, (0, run.times[-1]), start, "DOP853", run.times, rtol=1e-12, atol=1e-14).y.T
    C_NB = np.array([dcm_from_quaternion(q) for q in run["bodies/hub/attitude"]])
    C_NO = np.array([dcm_from_quaternion(q) for q in run["orbit/attitude"]])
    assert np.abs(C_NB - own[:, :9].reshape(-1, 3, 3)).max() < 1e-6
    assert np.abs(C_NO - np.array([frame(t)[0] for t in run.times])).max() < 1e-9
    assert np.abs(C_NB - C_NO).max() > 0.1


# --- Sun and Moon ----------------------------------------------------------------------------------------------------


def places_of(date):
    """Vectors to Sun and Moon from the Earth's centre [m] by the channels of their surroundings."""
    system = craft(Orbit(7e6), epoch=days_since_j2000(date))
    run = simulate(with_effectors(system, {"sun": Sun(kind="sun"), "moon": Moon(kind="moon")}), 1.0)
    return {
        name: run[f"effectors/{name}/distance"][0] * np.array([run[f"effectors/{name}/{axis}"][0] for axis in "xyz"])
        for name in ("sun", "moon")
    }


def test_place_of_the_moon():
    """Meeus, Astronomical Algorithms, example 47.a: 1992 April 12, 0 h TD, 58.7 s ahead of UTC."""
    x, y, z = places_of("1992-04-11T23:59:01Z")["moon"]
    c, s = np.cos(np.radians(23.440636)), np.sin(np.radians(23.440636))
    y, z = c * y + s * z, c * z - s * y
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(133.162655, abs=0.1)
    assert np.degrees(np.arctan2(z, np.hypot(x, y))) == pytest.approx(-3.229126, abs=0.1)
    assert np.sqrt(x * x + y * y + z * z) == pytest.approx(368409.7e3, rel=3e-3)


@pytest.mark.parametrize("name", ["sun", "moon"])
def test_tide_is_the_difference_of_two_attractions(name):
    """In forty digits, at the craft and at the Earth's centre."""
    getcontext().prec = 40
    date, orbit = "2031-05-06T07:08:09", Orbit(6.8e6, 0.01, 0.9, 2.0, 1.0, free=True)
    s = [Decimal(float(x)) for x in places_of(date)[name]]
    r = [Decimal(float(x)) for x in kepler(orbit, np.zeros(1))[0][0]]

    def toward(d):
        return [Decimal(GM[name]) * x / sum(x * x for x in d).sqrt() ** 3 for x in d]

    there, centre = toward([s[k] - r[k] for k in range(3)]), toward(s)
    expected = [float(there[k] - centre[k]) for k in range(3)]
    residuals = []
    for bodies in ((name,), ()):
        model = compile_system(craft(orbit, third_bodies=bodies, epoch=days_since_j2000(date)))
        residuals.append(model.residual(0.0, model.x0, np.zeros(6))[:3])
    np.testing.assert_allclose(
        (residuals[1] - residuals[0]) / MASS, expected, rtol=0, atol=1e-12 * np.abs(expected).max()
    )


@pytest.mark.parametrize(
    ("bodies", "year", "inclination"),
    [  # deg after a year, Soop, Handbook of Geostationary Orbits: Sun 0.27, Moon 0.478 to 0.674 by its node, together
        (("sun",), 2006, 0.27),
        (("moon",), 2006, 0.674),
        (("moon",), 2015, 0.478),
        (("sun", "moon"), 2006, 0.944),
        (("sun", "moon"), 2015, 0.748),
    ],
)
def test_inclination_of_a_geostationary_orbit(bodies, year, inclination):
    orbit = Orbit(42164.17e3, 1e-6, free=True)
    system = craft(orbit, third_bodies=bodies, epoch=days_since_j2000(f"{year}-01-01"))
    _, R, V, _ = flown(system, 365.25 * DAY, 500, rtol=1e-9)
    h = np.cross(R[-1], V[-1])
    assert np.degrees(np.arccos(h[2] / np.linalg.norm(h))) == pytest.approx(
        inclination, abs=0.02
    )  # terms of half a year and of months


def test_energy_changes_by_the_work_of_moving_tides():
    orbit = Orbit(42164.17e3, 1e-6, free=True)
    system = craft(orbit, third_bodies=("sun", "moon"), epoch=0.0)
    times, _, _, run = flown(system, 10 * DAY, 2000)
    energy = run["monitors/energy"] - run["monitors/energy"][0]
    work = cumulative_simpson(run["monitors/supplied"], x=times, initial=0)
    assert np.abs(energy - work).max() < 1e-5 * np.abs(energy).max()


def test_ball_at_rest_on_an_orbit_stays_and_its_run_ends():
    """Gravity exerts no torque on equal inertias: what remains is rounding, which must not set the tolerances."""
    craft = System(
        {"ball": rigid_body(100.0, np.eye(3))}, [spherical("ball")], orbit=Orbit(7e6), frame=Frame("inertial")
    )
    run = simulate(craft, 1000.0)
    np.testing.assert_allclose(run["bodies/ball/attitude"], [[1.0, 0.0, 0.0, 0.0]] * len(run.times), atol=1e-12)
