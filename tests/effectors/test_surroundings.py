"""Sun, field and air at a craft on its orbit, and their forces on surfaces, against almanacs and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.special import erf, ive

import femflex
from femflex import Frame, Orbit, System, fem, rigid_body, simulate
from femflex.body import Marker, Skin
from femflex.dynamics import compile_system
from femflex.effectors import (
    AirDrag,
    Atmosphere,
    EddyCurrents,
    MagneticDipole,
    MagneticField,
    Nrlmsis,
    Optical,
    Sensor,
    SolarPressure,
    Sun,
    Surface,
    TorqueRod,
)
from femflex.mesh import rectangle
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, cantilever_modes, reduce_structure
from femflex.rotations import dcm_from_quaternion
from femflex.system import Environment, free, spherical, universal, weld, with_effectors
from femflex.system.environment import days_since_j2000

RADIUS, AU = 6378137.0, 1.495978707e11
PRESSURE = 1361.0 / 299792458.0
CENTRE_BODY = rigid_body(100.0, np.diag([10.0, 12.0, 14.0]))


def on_orbit(nouns, duration=1.0, body=CENTRE_BODY, orbit=None, epoch=0.0, rates=(0.0, 0.0, 0.0), **options):
    """A run of one rigid body, at rest in inertial axes, on its orbit."""
    orbit = orbit or Orbit(RADIUS + 500e3, inclination=0.9)
    joint = free("hub", u0=[0, 0, 0, *rates]) if orbit.free else spherical("hub", u0=rates)
    craft = System({"hub": body}, [joint], orbit=orbit, frame=Frame("inertial"), environment=Environment(epoch=epoch))
    return simulate(with_effectors(craft, nouns), duration, **options)


def vector(run, path, row=0):
    return np.array([run[f"effectors/{path}/{axis}"][row] for axis in "xyz"])


@pytest.mark.parametrize(
    ("date", "ascension", "declination", "distance"),
    [  # equinoxes, solstice and perihelion: Astronomical Almanac 2026
        ("2026-03-20T14:46:00Z", 0.0, 0.0, None),
        ("2026-06-21T08:25:00Z", 90.0, 23.436, None),
        ("2026-09-23T00:05:00Z", 180.0, 0.0, None),
        ("2026-01-03T17:16:00Z", None, None, 0.98330),
    ],
)
def test_sun_of_a_date(date, ascension, declination, distance):
    run = on_orbit({"sun": Sun(kind="sun")}, epoch=days_since_j2000(date))
    x, y, z = vector(run, "sun")
    if distance is not None:
        assert run["effectors/sun/distance"][0] / AU == pytest.approx(distance, abs=2e-5)
        return
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(ascension, abs=0.01)
    assert np.degrees(np.arcsin(z)) == pytest.approx(declination, abs=0.01)


def test_eclipse_of_a_circular_orbit_is_conical():
    """Penumbra and umbra begin where the discs touch: c = b + a and c = b - a, seen from the craft."""
    orbit, radius = Orbit(RADIUS + 500e3), RADIUS + 500e3
    run = on_orbit(
        {"sun": Sun(kind="sun", direction=(1, 0, 0))}, orbit.period, orbit=orbit, output_step=orbit.period / 20000
    )
    angle = 2 * np.pi * run.times / orbit.period
    seen = run["effectors/sun/visible"]
    a, b = np.arcsin(6.957e8 / AU), np.arcsin(RADIUS / radius)  # of sun and Earth
    for limit, level in ((b + a, 1.0 - 1e-9), (b - a, 1e-9)):
        # the centre of the Earth is seen at pi - angle from the sun; the sun's parallax moves it by radius / AU
        first = np.pi - limit
        assert angle[np.argmax(seen < level)] == pytest.approx(first, abs=6e-4)
    assert seen[np.searchsorted(angle, np.pi - b)] == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(
    ("date", "r", "theta", "phi", "field"),
    [  # radius [km], colatitude, longitude [deg]; B_r, B_theta, B_phi [nT] by ppigrf 2.1 of IAGA's working group
        ("2012-07-01", 6871.2, 40.0, 10.0, (-35320.79, -16202.75, 280.45)),
        ("2012-07-01", 6600.0, 150.0, 200.0, (50311.15, -10132.79, 10068.71)),
        ("2026-03-20T12:00:00", 7000.0, 95.0, -60.0, (-410.05, -18388.55, -4827.49)),
        ("2026-03-20T12:00:00", 42164.0, 90.0, 0.0, (-4.824, -98.553, -14.734)),
    ],
)
def test_field_of_a_place(date, r, theta, phi, field):
    """The place is put over its longitude by the Earth rotation angle of 2000 and the precession in right ascension."""
    days = days_since_j2000(date)
    turn = 2 * np.pi * (0.7790572732640 + 1.00273781191135448 * days)
    turn += np.radians((0.014506 + 4612.156534 * days / 36525) / 3600)
    longitude, latitude = np.radians(phi) + turn, np.radians(90 - theta)
    orbit = Orbit(r * 1e3, inclination=np.pi / 2, node=longitude, true_anomaly=latitude)
    run = on_orbit({"field": MagneticField(kind="magnetic_field")}, orbit=orbit, epoch=days)
    c, s, cl, sl = np.cos(latitude), np.sin(latitude), np.cos(longitude), np.sin(longitude)
    axes = np.array([[c * cl, c * sl, s], [s * cl, s * sl, -c], [-sl, cl, 0.0]])
    np.testing.assert_allclose(1e9 * axes @ vector(run, "field"), field, atol=2e-5 * np.linalg.norm(field) + 1e-3)


def test_vector_sensor_shows_the_field_in_its_axes():
    nouns = {"field": MagneticField(kind="magnetic_field", degree=1)}
    nouns["meter"] = Sensor(kind="vector", body="hub", signal="field")
    run = on_orbit(nouns, 600.0, rates=(0.01, 0.02, -0.03))
    measured = np.stack([run[f"effectors/meter/{axis}"] for axis in "xyz"], axis=1)
    field = np.stack([run[f"effectors/field/{axis}"] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(np.linalg.norm(measured, axis=1), np.linalg.norm(field, axis=1), rtol=1e-9)
    assert np.abs(measured[-1] - field[-1]).max() > 1e-6
    q = run["bodies/hub/attitude"][-1]
    C = dcm_from_quaternion(q)
    np.testing.assert_allclose(C.T @ field[-1], measured[-1], atol=1e-12)


def test_air_of_a_free_orbit_is_that_at_the_craft():
    """J2 takes the craft 200 km along from the ellipse; the table's exponential from 400 to 450 km at its height."""
    orbit = Orbit(RADIUS + 430e3, inclination=0.9, free=True)
    craft = System(
        {"hub": CENTRE_BODY},
        [free("hub")],
        orbit=orbit,
        frame=Frame("inertial"),
        environment=Environment(oblateness=1.0826e-3),
    )
    run = simulate(with_effectors(craft, {"air": Atmosphere(kind="atmosphere")}), 5 * orbit.period, output_step=60.0)
    vertical = dcm_from_quaternion(run["orbit/attitude"])[:, :, 1]
    place = run["orbit/radius"][:, None] * vertical + run["bodies/hub/position"]
    assert np.linalg.norm(run["bodies/hub/position"][-1]) > 100e3
    r, sine2 = np.linalg.norm(place, axis=1), (place[:, 2] / np.linalg.norm(place, axis=1)) ** 2
    f = 1 / 298.257223563
    height = (r - RADIUS * (1 - f) / np.sqrt((1 - f) ** 2 + (1 - (1 - f) ** 2) * sine2)) / 1e3
    inside = (height > 400) & (height < 450)
    assert inside.sum() > 50
    exact = 3.725e-12 * np.exp(-(height - 400) / 58.515)
    np.testing.assert_allclose(run["effectors/air/density"][inside], exact[inside], rtol=1e-9)
    wind = np.stack([run[f"effectors/air/{axis}"] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(wind, np.cross([0, 0, 7.292115e-5], place), rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("version", ["00", "2.1"])
def test_nrlmsis_along_an_orbit_is_that_of_pymsis(version):
    """Place, geodetic coordinates and Earth rotation angle are written here; the table is within 1 % of the model."""
    pymsis = pytest.importorskip("pymsis", reason="pymsis is not installed")
    a, e, inclination, epoch = RADIUS + 450e3, 0.045, 1.5, days_since_j2000("2024-05-10T17:00:00Z")
    orbit = Orbit(a, e, inclination=inclination, node=0.3)
    air = Nrlmsis(kind="nrlmsis", version=version, f107=180.0, f107_mean=165.0, ap=20.0)
    run = on_orbit({"air": air}, 2 * orbit.period, orbit=orbit, epoch=epoch, output_step=60.0)
    mean = run.times * 2 * np.pi / orbit.period
    E = mean.copy()
    for _ in range(20):
        E -= (E - e * np.sin(E) - mean) / (1 - e * np.cos(E))
    X, Y = a * (np.cos(E) - e), a * np.sqrt(1 - e**2) * np.sin(E)
    x, y, z = X, Y * np.cos(inclination), Y * np.sin(inclination)
    turn = 2 * np.pi * (0.7790572732640 + 1.00273781191135448 * (epoch + run.times / 86400)) - 0.3
    turn += np.radians(4612.156534 * epoch / 36525 / 3600)
    longitude = np.degrees(np.arctan2(y, x) - turn) % 360
    level, e2 = np.hypot(x, y), 6.69437999014e-3  # WGS 84
    latitude = np.arctan2(z, level)
    for _ in range(20):
        N = RADIUS / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
        latitude = np.arctan2(z + e2 * N * np.sin(latitude), level)
    height = level * np.cos(latitude) + z * np.sin(latitude) - RADIUS * np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    dates = np.datetime64("2024-05-10T17:00:00") + (1e3 * run.times).astype("timedelta64[ms]")
    n = len(dates)
    exact = pymsis.calculate(
        dates,
        longitude,
        np.degrees(latitude),
        height / 1e3,
        np.full(n, 180.0),
        np.full(n, 165.0),
        np.full((n, 7), 20.0),
        version=version,
    )
    assert height.min() < 160e3 and height.max() > 740e3
    np.testing.assert_allclose(run["effectors/air/density"], exact[:, 0], rtol=0.01)
    np.testing.assert_allclose(run["effectors/air/temperature"], exact[:, 10], rtol=0.003)
    species = np.array([28.0134, 31.9988, 15.9994, 4.0026, 1.00794, 39.948, 14.0067, 15.9994, 30.0061])  # g/mol
    numbers = np.nan_to_num(exact[:, 1:10])
    np.testing.assert_allclose(
        run["effectors/air/molar_mass"], 1e-3 * numbers @ species / numbers.sum(axis=1), rtol=0.01
    )


# --- light -----------------------------------------------------------------------------------------------------------


def ball(n: int) -> Skin:
    """The faces of a cube of n x n squares each, on the unit sphere."""
    side = np.linspace(-np.pi / 4, np.pi / 4, n + 1)
    a, b = (np.tan(g).ravel() for g in np.meshgrid(side, side, indexing="ij"))
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    points, cells = [], []
    for axis in range(3):
        for sign in (1, -1):
            face = np.roll(np.stack([np.full_like(a, sign), a, sign * b], axis=1), axis, axis=1)
            cells.append(quads + sum(map(len, points)))
            points.append(face / np.linalg.norm(face, axis=1)[:, None])
    return Skin(np.concatenate(points), {"quad": np.concatenate(cells)}, np.zeros((0, 6 * len(a), 3)))


def force_of_sun(body, surface, direction):
    """Sum of forces (3,) over the pressure of the light, at the start."""
    nouns = {"sun": Sun(kind="sun", direction=direction, eclipse=False), "skin": surface, "light": SolarPressure()}
    craft = with_effectors(System({"hub": body}, [free("hub")]), nouns)
    run = simulate(craft, 1e-3)
    return run["effectors/light_hub/force"][0].reshape(-1, 3).sum(axis=0) / PRESSURE


def test_light_on_a_sphere_converges_to_the_closed_form():
    """P pi r^2 (1 + 4 diffuse / 9), whatever the specular share; the error falls with the square of the facets."""
    errors = []
    for n in (4, 8, 16):
        body = rigid_body(1.0, np.eye(3), skin=ball(n))
        surface = Surface(body="hub", front=Optical(specular=0.3, diffuse=0.45))
        force = force_of_sun(body, surface, (0.36, 0.48, 0.8))
        exact = -np.pi * (1 + 4 * 0.45 / 9) * np.array([0.36, 0.48, 0.8])
        errors.append(np.linalg.norm(force - exact) / np.pi)
    assert errors[2] < 4e-3
    assert errors[0] / errors[1] > 3.5 and errors[1] / errors[2] > 3.5


@pytest.mark.parametrize("incidence", [0.0, 0.7, 1.3])
def test_light_on_plate_and_tube(incidence):
    """A flat panel by the formula of one facet; a tube, across the light P 2 r L (1 + specular/3 + pi diffuse/6)."""
    s = np.array([np.sin(incidence), 0.0, np.cos(incidence)])
    specular, diffuse = 0.5, 0.2
    optical = Optical(specular=specular, diffuse=diffuse, emissivity=0.6)
    sheet = fem.build_structure(
        rectangle(2.0, 0.5, 4, 2), [fem.Member("surface", "plate", 0.01, fem.Material(1e9, 0.3, 100))]
    )
    panel = reduce_structure(sheet, cantilever_modes(sheet, ["left"], 2), patches=["surface"])
    surface = Surface(body="hub", group="surface", front=optical, back=Optical(emissivity=0.3))
    force = force_of_sun(panel, surface, s)
    c, n = np.cos(incidence), np.array([0, 0, 1.0])
    recoil = (1 - specular - diffuse) * 2 / 3 * (0.6 - 0.3) / 0.9
    exact = -c * ((1 - specular) * s + (2 * (specular * c + diffuse / 3) + recoil) * n)
    np.testing.assert_allclose(force, exact, atol=1e-9)
    boom = beam_body(UniformBeam(3.0, 1e5, 1e3, 1e3, 1e3, 1.0, ry=0.05, rz=0.05), BeamFunctions(z=2), patches=["all"])
    force = force_of_sun(boom, Surface(body="hub", front=optical, diameter=0.1), s)
    angle = np.linspace(0, 2 * np.pi, 2001)[:-1]
    outward = np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    lit = np.maximum(outward @ s, 0.0)
    facets = -lit[:, None] * ((1 - specular) * s + 2 * (specular * lit + diffuse / 3)[:, None] * outward)
    np.testing.assert_allclose(force, facets.mean(axis=0) * np.pi * 0.1 * 3.0, atol=1e-6)
    if incidence == 0.0:
        assert -force[2] == pytest.approx(0.3 * (1 + specular / 3 + np.pi * diffuse / 6))


def test_light_follows_a_bent_panel():
    """A strip bent in its first mode, w' = w_tip phi'(x) / phi(L) of a cantilever beam, facet by facet."""
    length, tip = 4.0, 0.18
    sheet = fem.build_structure(
        rectangle(length, 0.5, 16, 1), [fem.Member("surface", "plate", 0.01, fem.Material(1e9, 0.0, 100))]
    )
    panel = reduce_structure(
        sheet, cantilever_modes(sheet, ["left"], 1), {"root": "left", "tip": "right"}, patches=["surface"]
    )
    amplitude = tip / panel.markers["tip"].phi[2, 0]
    nouns = {"sun": Sun(kind="sun", direction=(0.6, 0, 0.8)), "light": SolarPressure()}
    nouns["skin"] = Surface(body="panel", group="surface", front=Optical(specular=0.8, diffuse=0.1))
    craft = System({"panel": panel}, [weld("panel", child_marker="root")], delta0={"panel": np.array([amplitude])})
    force = simulate(with_effectors(craft, nouns), 1e-6)["effectors/light_panel/force"][0]
    x = np.linspace(0.0, length, 4001)
    x = (x[1:] + x[:-1]) / 2
    k, sigma = 1.8751040687119611 / length, 0.7340955137589128
    at_tip = np.cosh(k * length) - np.cos(k * length) - sigma * (np.sinh(k * length) - np.sin(k * length))
    slope = k * (np.sinh(k * x) + np.sin(k * x) - sigma * (np.cosh(k * x) - np.cos(k * x)))
    angle = slope * tip / at_tip
    n = np.stack([-np.sin(angle), 0 * x, np.cos(angle)], axis=1)
    s = np.array([0.6, 0.0, 0.8])
    c = n @ s
    facets = -c[:, None] * (0.2 * s + 2 * (0.8 * c + 0.1 / 3)[:, None] * n)
    exact = facets.mean(axis=0) * 0.5 * length * PRESSURE
    flat = -0.8 * (0.2 * s + 2 * (0.8 * 0.8 + 0.1 / 3) * np.array([0, 0, 1.0])) * 0.5 * length * PRESSURE
    assert np.linalg.norm(exact - flat) > 0.02 * np.linalg.norm(flat)
    np.testing.assert_allclose(force.reshape(-1, 3).sum(axis=0), exact, atol=3e-4 * np.linalg.norm(exact))


# --- air -------------------------------------------------------------------------------------------------------------


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("normal", "tangential"), [(1.0, 1.0), (0.0, 0.0)])
def test_drag_of_a_sphere(normal, tangential):
    """Diffuse and specular reflection (Schaaf and Chambre 1961): the wall's temperature counts for the diffuse part."""
    body = rigid_body(100.0, np.eye(3), skin=ball(16))
    orbit = Orbit(RADIUS + 400e3)
    air = Atmosphere(kind="atmosphere", density=1e-11, temperature=900.0, rotation=0.0)
    drag = AirDrag(normal_accommodation=normal, tangential_accommodation=tangential, wall_temperature=400.0)
    run = on_orbit({"atmosphere": air, "skin": Surface(body="hub"), "air": drag}, body=body, orbit=orbit)
    speed = np.sqrt(3.986004418e14 / orbit.semi_major_axis)
    s = speed / np.sqrt(2 * 8.31446261815324 / 0.016 * 900.0)
    C = (2 * s**2 + 1) / (np.sqrt(np.pi) * s**3) * np.exp(-(s**2)) + (4 * s**4 + 4 * s**2 - 1) / (2 * s**4) * erf(s)
    C += normal * 2 * np.sqrt(np.pi) / (3 * s) * np.sqrt(400.0 / 900.0)
    force = run["effectors/air_hub/force"][0]
    exact = 0.5e-11 * speed**2 * C * np.pi
    np.testing.assert_allclose(force, [0, -exact, 0], atol=6e-3 * exact)


AIR, WALL, DENSITY = 1100.0, 350.0, 1e-11  # K, K, kg/m^3


def force_of_air(body, surface, drag, attitude):
    """Force and wind in the axes of a body at rest in an attitude, on a circular orbit in still air."""
    air = Atmosphere(kind="atmosphere", density=DENSITY, temperature=AIR, rotation=0.0)
    joint, frame = spherical("hub", q0=attitude), Frame("inertial")
    craft = System({"hub": body}, [joint], orbit=Orbit(RADIUS + 400e3), frame=frame)
    run = simulate(with_effectors(craft, {"atmosphere": air, "skin": surface, "air": drag}), 1e-6)
    C = dcm_from_quaternion(run["bodies/hub/attitude"][0]).T
    wind = C @ [0, -np.sqrt(3.986004418e14 / (RADIUS + 400e3)), 0]
    return C @ run["effectors/air_hub/force"][0].reshape(-1, 3).sum(axis=0), wind


def maxwellian_side(wind, n, normal, tangential):
    """Force per area and density on a side, by integrals over the velocities of molecules that fly toward it."""
    c = np.sqrt(2 * 8.31446261815324 / 0.016 * AIR)
    U, along = -wind @ n, wind - (wind @ n) * n
    flux, pressure = (
        quad(
            lambda u, k=k: u**k * np.exp(-(((u - U) / c) ** 2)) / (c * np.sqrt(np.pi)),
            0,
            abs(U) + 9 * c,
            points=[abs(U)],
        )[0]
        for k in (1, 2)
    )
    diffuse = flux * np.sqrt(np.pi * 8.31446261815324 / 0.016 * WALL / 2)
    return -((2 - normal) * pressure + normal * diffuse) * n + tangential * flux * along


@pytest.mark.parametrize(("attitude", "normal", "tangential"), [
    ((0.3, -0.8, 0.4, 0.2), 1.0, 1.0), ((0.9, 0.1, -0.3, 0.5), 0.9, 0.8), ((0.7, 0.7, 0.02, 0.0), 1.0, 1.0),
])  # fmt: skip
def test_lift_and_drag_of_plate_and_tube(attitude, normal, tangential):
    """Both sides of a plate at incidence; a tube across the wind by Bessel functions (Schaaf and Chambre 1961)."""
    attitude = np.array(attitude) / np.linalg.norm(attitude)
    drag = AirDrag(normal_accommodation=normal, tangential_accommodation=tangential, wall_temperature=WALL)
    film = [fem.Member("surface", "plate", 0.01, fem.Material(1e9, 0.3, 100))]
    sheet = fem.build_structure(rectangle(2.0, 0.5, 4, 2), film)
    panel = reduce_structure(sheet, cantilever_modes(sheet, ["left"], 2), patches=["surface"])
    force, wind = force_of_air(panel, Surface(body="hub", group="surface"), drag, attitude)
    n = np.array([0.0, 0.0, 1.0])
    exact = DENSITY * sum(maxwellian_side(wind, side, normal, tangential) for side in (n, -n))
    np.testing.assert_allclose(force, exact, atol=1e-9 * np.linalg.norm(exact))
    boom = beam_body(UniformBeam(3.0, 1e5, 1e3, 1e3, 1e3, 1.0, ry=0.05, rz=0.05), BeamFunctions(z=2), patches=["all"])
    force, wind = force_of_air(boom, Surface(body="hub", diameter=0.1), drag, attitude)
    if normal == tangential == 1.0:
        across = wind * [0, 1, 1]
        s = np.linalg.norm(across) / np.sqrt(2 * 8.31446261815324 / 0.016 * AIR)
        C = np.sqrt(np.pi) / s * ((s**2 + 1.5) * ive(0, s**2 / 2) + (s**2 + 0.5) * ive(1, s**2 / 2))
        C += np.pi**1.5 / (4 * s) * np.sqrt(WALL / AIR)
        np.testing.assert_allclose(force[1:], 0.5 * DENSITY * C * 0.3 * np.linalg.norm(across) * across[1:], rtol=3e-5)


def test_drag_lowers_a_free_orbit():
    """da per revolution = -2 pi C A / m rho a^2 for a circular orbit in still air of constant density."""
    body = rigid_body(50.0, np.eye(3), markers={"middle": Marker.at_position(np.zeros(3))}, skin=ball(8))
    orbit = Orbit(RADIUS + 400e3, free=True)
    air = Atmosphere(kind="atmosphere", density=4e-11, rotation=0.0)
    nouns = {"atmosphere": air, "skin": Surface(body="hub"), "air": AirDrag()}
    run = on_orbit(nouns, orbit.period, body=body, orbit=orbit, rtol=1e-11)
    mu, a = 3.986004418e14, orbit.semi_major_axis
    force = np.linalg.norm(run["effectors/air_hub/force"][0])
    C_A = force / (0.5 * 4e-11 * mu / a)
    position, velocity = run["bodies/hub/position"][-1], run["markers/hub.middle/velocity"][-1]
    angle = 2 * np.pi * run.times[-1] / orbit.period
    place = a * np.array([np.cos(angle), np.sin(angle), 0]) + position
    speed = np.sqrt(mu / a) * np.array([-np.sin(angle), np.cos(angle), 0]) + velocity
    semi_major = 1 / (2 / np.linalg.norm(place) - speed @ speed / mu)
    assert semi_major - a == pytest.approx(-2 * np.pi * C_A / 50.0 * 4e-11 * a**2, rel=5e-3)


def test_density_and_wind_of_the_table():
    """Vallado's example: 747.2119 km, 2.1219854e-14 kg/m^3 [2.1219854e-4 kg/km^3]; the air turns with the Earth."""
    orbit = Orbit(RADIUS + 747.2119e3)
    run = on_orbit({"air": Atmosphere(kind="atmosphere")}, orbit=orbit)
    assert run["effectors/air/density"][0] == pytest.approx(2.1219854e-14, rel=1e-5)
    np.testing.assert_allclose(vector(run, "air"), [0, 7.292115e-5 * orbit.semi_major_axis, 0], rtol=1e-9)


# --- magnetism -------------------------------------------------------------------------------------------------------


def test_magnetic_torques():
    """m x B of a rod at its limit and of a dipole; eddy currents take the energy out that they account for."""
    nouns = {
        "field": MagneticField(kind="magnetic_field"),
        "rod": TorqueRod(body="hub", axis=(0, 3, 0), command=80.0, max_moment=30.0),
        "rest": MagneticDipole(body="hub", moment=(0.5, 0.0, -0.2)),
        "shell": EddyCurrents(body="hub", coefficient=4e4),
    }
    run = on_orbit(nouns, 300.0, rates=(0.0, 0.3, 0.1), rtol=1e-10)
    B = vector(run, "field")
    np.testing.assert_allclose(run["effectors/rod/torque"][0], np.cross([0, 30.0, 0], B), atol=1e-12)
    np.testing.assert_allclose(run["effectors/rest/torque"][0], np.cross([0.5, 0, -0.2], B), atol=1e-12)
    w = np.array([0.0, 0.3, 0.1])
    np.testing.assert_allclose(run["effectors/shell/torque"][0], 4e4 * np.cross(np.cross(w, B), B), atol=1e-12)
    assert (run["effectors/shell/dissipation"] >= 0).all()


def detumbling(duration: float, inclination: float, days: float) -> np.ndarray:
    """Rate (3,) after a time in cases/magnetic_detumbling.toml: Euler's equations in the dipole field, m = -k dB/dt.

    The coefficients of degree one in 2025 and 2030 are those of the model's table [nT].
    """
    years = (2000 + days / 365.25 - 2025) / 5
    dipole = np.array([-1410.3, 4545.5, -29350.0]) * (1 - years) + np.array([-1360.3, 4438.0, -29287.0]) * years
    turn = 2 * np.pi * (0.7790572732640 + 1.00273781191135448 * days)
    turn += np.radians((0.014506 + 4612.156534 * days / 36525) / 3600)
    radius, J = RADIUS + 500e3, np.array([3.0, 3.5, 2.5])
    n = np.sqrt(3.986004418e14 / radius**3)

    def field(t):
        a, e = n * t, turn + 7.292115e-5 * t
        r = np.array([np.cos(a), np.sin(a) * np.cos(inclination), np.sin(a) * np.sin(inclination)])
        c, s = np.cos(e), np.sin(e)
        m = np.array([c * dipole[0] - s * dipole[1], s * dipole[0] + c * dipole[1], dipole[2]])
        return 1e-9 * (6371.2e3 / radius) ** 3 * (3 * (m @ r) * r - m)

    def slope(t, y):
        C, w = y[:9].reshape(3, 3), y[9:]
        B, change = C.T @ field(t), C.T @ (field(t + 0.5) - field(t - 0.5))
        m = np.clip(-3e6 * (change - np.cross(w, B)), -15.0, 15.0)
        return np.concatenate([(C @ np.cross(np.eye(3), w)).ravel(), (np.cross(m, B) - np.cross(w, J * w)) / J])

    start = np.concatenate([np.eye(3).ravel(), np.radians([4.0, -3.0, 3.5])])
    return solve_ivp(slope, (0, duration), start, rtol=1e-9, atol=1e-11, method="DOP853").y[9:, -1]


def test_b_dot_slows_a_tumbling_satellite():
    """The first quarter of an hour of the shipped case, with its filter, against the law without one."""
    case = femflex.read_case("cases/magnetic_detumbling.toml")
    run = simulate(femflex.build_system(case), 900.0, rtol=1e-9)
    exact = detumbling(900.0, np.radians(97.4), days_since_j2000("2026-03-20T12:00:00Z"))
    assert np.linalg.norm(exact) == pytest.approx(0.0667701, rel=1e-4)  # the [expect] of the case
    np.testing.assert_allclose(run["bodies/craft/rate"][-1], exact, atol=2e-3)


def test_small_motions_of_a_ball_behind_its_pivot():
    """Light pushes a ball of radius 1 m, its centre 2 m from the pivot: omega^2 = F d / J, F = P pi r^2."""
    ball_skin = ball(16)
    skin = Skin(ball_skin.points - np.array([2.0, 0.0, 0.0]), ball_skin.cells, ball_skin.shapes)
    J = np.diag([1e-3, 4e-3, 4e-3])
    body = rigid_body(1.0, J, skin=skin)
    nouns = {"sun": Sun(kind="sun", direction=(1, 0, 0)), "skin": Surface(body="hub"), "light": SolarPressure()}
    craft = with_effectors(System({"hub": body}, [universal("hub", axes=((0, 1, 0), (0, 0, 1)))]), nouns)
    found = femflex.equilibrium(craft)
    assert found.share == 1.0
    model = compile_system(craft)
    assert not [path for path in model.without("solar_pressure").channels if path.startswith("effectors/light")]
    omega = np.sqrt(PRESSURE * np.pi * 2.0 / 4e-3)
    np.testing.assert_allclose(np.sort(np.abs(found.eigenvalues.imag)), omega, rtol=6e-3)
