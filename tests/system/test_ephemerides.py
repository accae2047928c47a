"""Orbits and attitudes of ephemeris files: against Kepler's ellipse, SGP4's own numbers, and runs written out."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

import femflex
from femflex.export import export_run
from femflex.results import open_run
from femflex.rotations import dcm_from_quaternion
from femflex.system.ccsds import Ephemeris, oem_text, read_aem, read_oem
from femflex.system.ephemeris_orbit import osculating_elements, starting_elements
from femflex.system.orbit import MU_EARTH, Orbit

ELEMENTS = dict(semi_major_axis=7e6, eccentricity=0.02, inclination=0.9, node=0.4, perigee=0.7, true_anomaly=-0.5)
CRAFT = """
title = "a rigid craft in orbit"
[run]
duration = "{duration} s"
output_step = "20 s"
[orbit]
kind = "{kind}"
{orbit}
[environment]
epoch = 2026-03-20T14:46:00Z
[attitude]
{attitude}
[bodies.hub]
kind = "rigid"
mass = 200
inertia = [60, 20, 70]
"""
KEPLER = "\n".join(f"{key} = {value}" for key, value in ELEMENTS.items())
PITCHED = 'pitch = "4 deg"\nroll = "2 deg"'


def kepler(t):
    """Positions and velocities (n, 3) of the ellipse, by bisection of Kepler's equation."""
    a, e, nu0 = (ELEMENTS[key] for key in ("semi_major_axis", "eccentricity", "true_anomaly"))
    E0 = 2 * np.arctan(np.sqrt((1 - e) / (1 + e)) * np.tan(nu0 / 2))
    M = E0 - e * np.sin(E0) + np.sqrt(MU_EARTH / a**3) * t
    low, high = M - 1, M + 1
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (np.where(middle - e * np.sin(middle) < M, *pair) for pair in ((middle, low), (high, middle)))
    E, root, n = low, np.sqrt(1 - e * e), np.sqrt(MU_EARTH / a**3)
    plane = a * np.column_stack([np.cos(E) - e, root * np.sin(E)])
    speed = a * n / (1 - e * np.cos(E))[:, None] * np.column_stack([-np.sin(E), root * np.cos(E)])
    P = Orbit(**ELEMENTS).C_NP()[:, :2]
    return plane @ P.T, speed @ P.T


def written(folder, name, text):
    (folder / name).write_text(text)
    return folder / name


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """An orbit ephemeris of the ellipse, and a run on it with its messages."""
    folder = tmp_path_factory.mktemp("ephemerides")
    t = np.arange(-300.0, 6301.0, 60.0)
    days = 9575.0 + (14 * 60 + 46 - 12 * 60) / 1440.0 + t / 86400.0  # from 2026-03-20, 12:00
    written(folder, "ellipse.oem", oem_text(Ephemeris(days, np.hstack(kepler(t)), "EME2000"), "craft", "1"))
    case = written(folder, "kepler.toml", CRAFT.format(duration=6000, kind="specified", orbit=KEPLER, attitude=PITCHED))
    with femflex.run(case, folder / "kepler.h5") as run:
        export_run(run, folder / "kepler.oem")
        export_run(run, folder / "kepler.aem")
    return folder


def test_osculating_elements_are_those_of_the_ellipse(folder):
    r, v = kepler(np.array([0.0]))
    assert osculating_elements(r[0], v[0]) == pytest.approx(ELEMENTS, rel=1e-12)
    circle = osculating_elements(np.array([7e6, 0, 0]), np.array([0, np.sqrt(MU_EARTH / 7e6), 0]))
    assert circle["eccentricity"] < 1e-12 and circle["true_anomaly"] == circle["perigee"] == 0.0
    elements, _ = starting_elements(folder / "ellipse.oem", 9575.0 + 166 / 1440.0)
    assert elements == pytest.approx(ELEMENTS, rel=1e-6)


def test_run_follows_an_ephemeris_as_the_ellipse(folder):
    """Radius, orbital frame and librations, which feel rate and acceleration of the frame; and a free orbit from it."""
    for kind, accuracy in (("specified", 2e-7), ("free", 1e-6)):
        text = CRAFT.format(duration=6000, kind=kind, orbit='ephemeris = "ellipse.oem"', attitude=PITCHED)
        with (
            femflex.run(written(folder, f"{kind}.toml", text), folder / f"{kind}.h5") as run,
            open_run(folder / "kepler.h5") as expected,
        ):
            position = kepler(run.time)[0]
            radius = np.linalg.norm(position, axis=1)
            assert run["orbit/radius"] == pytest.approx(radius, rel=3e-9 if kind == "specified" else 1e-7)
            librations = expected["attitude/angles"]
            assert np.abs(librations).max() > 0.1
            assert run["attitude/angles"] == pytest.approx(librations, abs=accuracy * 10)
            C, D = (dcm_from_quaternion(r["orbit/attitude"]) for r in (run, expected))
            assert C == pytest.approx(D, abs=accuracy)
            if kind == "specified":
                turn = np.exp(1j * run["orbit/true_anomaly"]) / np.exp(1j * expected["orbit/true_anomaly"])
                assert np.abs(turn - 1).max() < 1e-5


def test_messages_of_a_run_are_its_motion_and_come_back(folder):
    orbit, attitude = read_oem(folder / "kepler.oem"), read_aem(folder / "kepler.aem")
    with open_run(folder / "kepler.h5") as run:
        r, v = kepler(run.time)
        assert orbit.values[:, :3] == pytest.approx(r, rel=1e-12, abs=1e-3)
        assert orbit.values[3:-3, 3:] == pytest.approx(v[3:-3], abs=1e-4)
        assert attitude.values == pytest.approx(run["bodies/hub/attitude"], abs=1e-14)
        followed = CRAFT.format(duration=6000, kind="specified", orbit=KEPLER, attitude='ephemeris = "kepler.aem"')
        with femflex.run(written(folder, "followed.toml", followed), folder / "followed.h5") as other:
            C, D = (dcm_from_quaternion(r["bodies/hub/attitude"]) for r in (run, other))
            assert C == pytest.approx(D, abs=1e-9)
            assert other["bodies/hub/rate"][5:-5] == pytest.approx(run["bodies/hub/rate"][5:-5], abs=1e-8)


AEM = """CCSDS_AEM_VERS = 1.0
ORIGINATOR = X
META_START
REF_FRAME_A = {a}
REF_FRAME_B = {b}
ATTITUDE_DIR = {direction}
TIME_SYSTEM = UTC
ATTITUDE_TYPE = QUATERNION
QUATERNION_TYPE = {order}
META_STOP
DATA_START
2026-079T14:46:00.5 {numbers}
DATA_STOP
"""


def test_other_forms_of_a_quaternion_are_one_attitude(tmp_path):
    q = np.array([0.8, 0.1, -0.2, np.sqrt(1 - 0.69)])  # scalar first, of C_AB with A inertial
    forms = (
        ("EME2000", "SC_BODY_1", "A2B", "LAST", np.roll(q, -1)),
        ("EME2000", "SC_BODY_1", "A2B", "FIRST", q),
        ("SC_BODY_1", "EME2000", "B2A", "LAST", np.roll(q, -1)),
        ("SC_BODY_1", "EME2000", "A2B", "FIRST", q * [1, -1, -1, -1]),
    )
    for a, b, direction, order, numbers in forms:
        text = AEM.format(a=a, b=b, direction=direction, order=order, numbers=" ".join(f"{n:.17g}" for n in numbers))
        message = read_aem(written(tmp_path, "a.aem", text))
        assert message.values[0] == pytest.approx(q, abs=1e-15), (a, direction, order)
        assert message.days[0] == pytest.approx(9575.0 + (166 * 60 + 0.5) / 86400.0, abs=1e-11)


ISS = """ISS
1 25544U 98067A   08264.51782528 -.00002182  00000-0 -11606-4 0  2927
2 25544  51.6416 247.4627 0006703 130.5360 325.0288 15.72125391563537
"""
VANGUARD = """1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753
2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667
"""
START = [7022.46529266e3, -1400.08296755e3, 0.03995155e3], [1.893841015e3, 6.405893759e3, 4.534807250e3]
LATER = [-7154.03120202e3, -3783.17682504e3, -3536.19412294e3]  # after 360 minutes


@pytest.mark.skipif(find_spec("sgp4") is None, reason="sgp4 is not installed")
def test_two_line_elements_are_followed_as_sgp4_verifies_them(tmp_path):
    """Numbers of tcppver.out (Vallado et al., Revisiting Spacetrack Report #3) for satellite 5, in TEME axes."""
    path = written(tmp_path, "vanguard.tle", VANGUARD)
    elements, epoch = starting_elements(path, None)
    assert elements == pytest.approx(osculating_elements(*np.array(START)), rel=1e-7)
    assert elements["semi_major_axis"] != pytest.approx(8.6e6, rel=1e-4)  # as their mean motion would give
    assert epoch == pytest.approx(178.78495062 - 0.5, abs=1e-8)
    text = CRAFT.format(duration=21600, kind="specified", orbit='ephemeris = "vanguard.tle"', attitude=PITCHED)
    case = written(tmp_path, "case.toml", text.replace("[environment]\nepoch = 2026-03-20T14:46:00Z\n", ""))
    with femflex.run(case, tmp_path / "run.h5") as run:
        C = dcm_from_quaternion(run["orbit/attitude"])
        position = C[:, :, 1] * run["orbit/radius"][:, None]
        assert position[0] == pytest.approx(START[0], abs=0.1) and position[-1] == pytest.approx(LATER, abs=0.1)
    assert starting_elements(written(tmp_path, "iss.tle", ISS), None)[0]["inclination"] == pytest.approx(
        0.9013, abs=2e-3
    )
