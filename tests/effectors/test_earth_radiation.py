"""Albedo and infrared of the Earth on surfaces, against closed forms and integrals over the ground."""

from __future__ import annotations

import numpy as np
import pytest

import femflex
from femflex import Frame, Orbit, System, rigid_body, simulate
from femflex.body import Skin
from femflex.dynamics import compile_system
from femflex.effectors import EarthRadiation, Optical, Sun, Surface
from femflex.studies.torque_budget import torque_budget
from femflex.system import spherical, universal, with_effectors

RADIUS, LIGHT = 6378137.0, 299792458.0
QUADRATURE = 6e-3  # its stated error, of the largest force


def plate(normal) -> Skin:
    """A square of 1 m^2 with that normal."""
    n = np.array(normal, float)
    a = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    a /= np.linalg.norm(a)
    b = np.cross(n, a)
    return Skin(np.array([-a - b, a - b, a + b, b - a]) / 2, {"quad": np.array([[0, 1, 2, 3]])}, np.zeros((0, 12, 3)))


def ball(centre=(0.0, 0.0, 0.0), n=24) -> Skin:
    """A sphere of radius 1 m."""
    u, v = np.linspace(0, 2 * np.pi, 2 * n + 1)[:-1], np.linspace(0, np.pi, n + 1)
    points = np.stack(
        [np.outer(np.sin(v), np.cos(u)), np.outer(np.sin(v), np.sin(u)), np.outer(np.cos(v), 1 + 0 * u)], axis=-1
    )
    k = np.arange(2 * n * (n + 1)).reshape(n + 1, 2 * n)
    right = np.roll(k, -1, axis=1)
    quads = np.stack([k[:-1], k[1:], right[1:], right[:-1]], axis=-1).reshape(-1, 4)
    return Skin(points.reshape(-1, 3) + np.array(centre), {"quad": quads}, np.zeros((0, 6 * n * (n + 1), 3)))


BLACK = Optical()


def force(skin, altitude, optical=BLACK, sun=None, **radiation):
    """Force (3,), inertial, on a body above the X axis of its equatorial orbit."""
    nouns = {"skin": Surface(body="hub", front=optical), "earth": EarthRadiation(**radiation)}
    if sun is not None:
        nouns["sun"] = Sun(kind="sun", direction=sun)
    body = rigid_body(1.0, np.diag([1.0, 1.1, 1.2]), skin=skin)
    craft = System({"hub": body}, [spherical("hub")], orbit=Orbit(RADIUS + altitude), frame=Frame("inertial"))
    return simulate(with_effectors(craft, nouns), 1e-3)["effectors/earth_hub/force"][0]


@pytest.mark.parametrize("altitude", [300e3, 3000e3, 35786e3])
def test_infrared_on_plates(altitude):
    """Plates that face the nadir, and that stand upright: radiance M / pi over a disc of sine R / r.

    Along the normal of the first M/c [2/3 (1 + specular)(1 - (1 - (R/r)^2)^(3/2)) + 2/3 diffuse (R/r)^2]. The second
    sees M/pi [atan(1/sqrt(H^2 - 1)) - sqrt(H^2 - 1)/H^2], H = r/R, of which the diffuse share adds 2/3 (Howell 2010).
    """
    P, x = 237.0 / LIGHT, RADIUS / (RADIUS + altitude)
    for specular, diffuse in ((0.0, 0.0), (0.7, 0.2)):
        optical = Optical(specular=specular, diffuse=diffuse)
        exact = 2 / 3 * ((1 + specular) * (1 - (1 - x * x) ** 1.5) + diffuse * x * x)
        found = force(plate((-1, 0, 0)), altitude, optical, albedo=0.0) / P
        np.testing.assert_allclose(found, [exact, 0, 0], atol=1e-9)
        np.testing.assert_allclose(force(plate((1, 0, 0)), altitude, optical, albedo=0.0), 0.0, atol=1e-20)
    black, white = (
        force(plate((0, 0.6, 0.8)), altitude, Optical(diffuse=share), albedo=0.0) / P for share in (0.0, 1.0)
    )
    level = np.sqrt(1 / x**2 - 1)
    flux = (np.arctan(1 / level) - level * x**2) / np.pi
    np.testing.assert_allclose(white - black, -2 / 3 * flux * np.array([0, 0.6, 0.8]), atol=QUADRATURE * x**2)


def test_infrared_on_a_sphere():
    """Outwards M/c (R/r)^2 pi r^2 (1 + 4/9 diffuse), as the flux is M (R/r)^2."""
    optical = Optical(specular=0.2, diffuse=0.5)
    exact = 420.0 / LIGHT * (RADIUS / (RADIUS + 500e3)) ** 2 * np.pi * (1 + 4 * 0.5 / 9)
    found = force(ball(), 500e3, optical, albedo=0.0, infrared="420 W/m^2")
    np.testing.assert_allclose(found, [exact, 0, 0], atol=6e-3 * exact)


def reflected(altitude, angle, normal):
    """Force (3,) per pressure of sunlight on a black plate of 1 m^2, by an integral over the ground in sight.

    angle  of the sun from the zenith, X, towards Y
    """
    r, n = 1 + altitude / RADIUS, np.array(normal, float)
    s = np.array([np.cos(angle), np.sin(angle), 0.0])

    edges = np.linspace(0, 1, 401) ** 2 * (1 - 1 / r)  # of cosines, from the nadir on
    c, width = 1 - (edges[1:] + edges[:-1])[:, None] / 2, np.diff(edges)[:, None]
    azimuth, sine = (np.arange(720) + 0.5) * np.pi / 360, np.sqrt(1 - c * c)
    ground = np.stack([c + 0 * azimuth, sine * np.cos(azimuth), sine * np.sin(azimuth)], axis=-1)
    ray = ground - [r, 0, 0]
    distance = np.linalg.norm(ray, axis=-1)
    ray /= distance[..., None]
    cosines = np.maximum(ground @ s, 0) * -np.einsum("abi,abi->ab", ground, ray) * np.maximum(ray @ n, 0)
    return -np.einsum("ab,abi->i", cosines / (np.pi * distance**2) * width * np.pi / 360, ray)


@pytest.mark.parametrize("altitude", [500e3, 6000e3])
@pytest.mark.parametrize("angle", [0, 40, 90, 100])
def test_albedo_on_plates(altitude, angle):
    """From the subsolar point to beyond the terminator; without infrared, of a sun at 1 au."""
    angle, P = np.radians(angle), 1361.0 / LIGHT
    s = (np.cos(angle), np.sin(angle), 0.0)
    for normal in ((-1, 0, 0), (-0.6, 0, 0.8), (0, 0.8, 0.6)):
        found = force(plate(normal), altitude, sun=s, albedo=0.3, infrared=0.0) / (0.3 * P)
        largest = (RADIUS / (RADIUS + altitude)) ** 2
        np.testing.assert_allclose(found, reflected(altitude, angle, normal), atol=QUADRATURE * largest)


def test_night_reflects_nothing():
    """Where the sun is more than acos(R/r) below the horizon of the nadir."""
    dip = np.arccos(RADIUS / (RADIUS + 500e3))
    for beyond, dark in ((0.01, True), (-0.2, False)):
        angle = np.pi / 2 + dip + beyond
        found = force(plate((-1, 0, 0)), 500e3, sun=(np.cos(angle), 0, np.sin(angle)), infrared=0.0)
        assert (np.linalg.norm(found) == 0.0) == dark


@pytest.mark.slow
def test_small_motions_and_budget_of_a_ball_above_its_pivot():
    """Infrared pushes a ball 2 m above its pivot away from the Earth: omega^2 = F d / J, F = M/c (R/r)^2 pi r^2.

    Beside it stands the gravity gradient, of 4e-3 of that stiffness.
    """
    J = np.diag([4e-3, 1e-3, 4e-3])
    body = rigid_body(1.0, J, skin=ball((0.0, 2.0, 0.0), 16))
    nouns = {"skin": Surface(body="hub"), "earth": EarthRadiation(albedo=0.0)}
    orbit = Orbit(RADIUS + 500e3)
    joint = universal("hub", axes=((1, 0, 0), (0, 0, 1)))
    craft = with_effectors(System({"hub": body}, [joint], orbit=orbit, frame=Frame("orbital")), nouns)
    F = 237.0 / LIGHT * (RADIUS / (RADIUS + 500e3)) ** 2 * np.pi
    found = femflex.equilibrium(craft)
    omega = np.sort(np.abs(found.eigenvalues.imag))
    np.testing.assert_allclose(omega, np.sqrt(F * 2.0 / 4e-3), rtol=1e-2)
    assert "effectors/earth_hub" not in compile_system(craft).without("earth_radiation").channels
    turned = with_effectors(System({"hub": body}, [spherical("hub")], orbit=orbit, frame=Frame("inertial")), nouns)
    run = simulate(turned, 100.0, output_step=10.0)
    budget = torque_budget(run.model, run.times, run.motion.states, run)
    source = next(each for each in budget.sources if each.name == "effectors/earth_hub")
    assert source.mean_force == pytest.approx(F, rel=2e-2)
