"""Small librations of the Orbiter on a circular orbit against the textbook's linear formulas (VALIDATION row D)."""

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.rotations import dcm_from_angles, quaternion_from_dcm
from femflex.system import Frame, Orbit, System, spherical

PITCH, YAW, ROLL = 8646050.0, 1091430.0, 8286760.0  # kg m^2 about the orbit normal, the vertical, the flight direction
NOMINAL = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # body axes x, y, z along flight, normal, vertical


def orbiter(angles=(0.0, 0.0, 0.0), rotation="euler_parameters", **orbit):
    """The Orbiter with flight, normal and vertical on its x, y, z axes, turned by (pitch, roll, yaw)."""
    body = rigid_body(
        79710.0, np.diag([ROLL, PITCH, YAW]), markers={"nominal": Marker.at_position(np.zeros(3), NOMINAL)}
    )
    start = np.asarray(angles) if rotation == "xzy" else quaternion_from_dcm(dcm_from_angles(angles, "xzy"))
    joint = spherical("orbiter", child_marker="nominal", rotation=rotation, q0=start)
    path = Orbit(perigee_altitude=331e3, **orbit)
    return compile_system(System({"orbiter": body}, (joint,), orbit=path, frame=Frame("orbital"))), path


def test_libration_eigenvalues_match_formulas():
    model, path = orbiter(rotation="xzy")
    step, x = 1e-5, model.x0
    columns = []
    for j in range(model.n_x):
        scale = step if j < model.n_q else step * path.mean_motion
        e = np.eye(model.n_x)[j] * scale
        columns.append((model.state_rate(0.0, x + e) - model.state_rate(0.0, x - e)) / (2 * scale))
    found = np.sort(np.abs(np.linalg.eigvals(np.column_stack(columns)).imag))[::2] / path.mean_motion
    k_r, k_y = (PITCH - YAW) / ROLL, (PITCH - ROLL) / YAW
    squares = np.roots([1.0, -(1 + 3 * k_r + k_r * k_y), 4 * k_r * k_y])
    expected = np.sort(np.sqrt([*squares, 3 * (ROLL - YAW) / PITCH]))
    assert expected == pytest.approx([0.5687, 1.5801, 1.9266], abs=5e-5)  # as printed in VALIDATION
    assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("rotation", ["euler_parameters", "xzy"])
def test_small_pitch_libration_frequency(rotation):
    model, path = orbiter((1e-4, 0, 0), rotation)
    times = np.linspace(0, 5 * path.period, 20001)
    solution = Dop853(rtol=1e-12, atol=1e-15).solve(model, times, model.x0)
    angles = model.observe(times, solution.states)["attitude/angles"]
    before = np.flatnonzero(np.diff(np.sign(angles[:, 0])))
    crossings = times[before] - angles[before, 0] * np.diff(times)[before] / np.diff(angles[:, 0])[before]
    frequency = np.pi / np.polyfit(np.arange(len(crossings)), crossings, 1)[0]
    assert frequency / path.mean_motion == pytest.approx(np.sqrt(3 * (ROLL - YAW) / PITCH), rel=1e-6)


@pytest.mark.parametrize("eccentricity", [0.0, 0.3])
def test_pure_pitch_leaves_yaw_and_roll_zero(eccentricity):
    model, path = orbiter((np.radians(30), 0, 0), eccentricity=eccentricity)
    times = np.linspace(0, 2 * path.period, 201)
    states = Dop853(rtol=1e-9, atol=1e-12).solve(model, times, model.x0).states
    angles = model.observe(times, states)["attitude/angles"]
    assert np.abs(angles[:, 0]).max() > 0.5
    assert np.all(angles[:, 1:] == 0.0)


@pytest.mark.parametrize("turns", [1, 3])
def test_orbit_follows_kepler(turns):
    model, path = orbiter(eccentricity=0.4, true_anomaly=1.0, inclination=0.5, node=0.3, perigee=2.0)
    times = np.linspace(0, turns * path.period, 4 * turns + 1)
    out = model.observe(times, np.tile(model.x0, (len(times), 1)))
    nu, radius = out["orbit/true_anomaly"], out["orbit/radius"]
    conic = path.semi_major_axis * (1 - 0.16) / (1 + 0.4 * np.cos(nu))
    assert radius == pytest.approx(conic, rel=1e-13)
    assert nu[0] == pytest.approx(1.0, abs=1e-13)
    assert nu[-1] == pytest.approx(1.0 + 2 * np.pi * turns, abs=1e-12)
    E = 2 * np.arctan(np.sqrt(0.6 / 1.4) * np.tan(nu / 2))
    mean = np.unwrap(E - 0.4 * np.sin(E))
    assert np.diff(mean) == pytest.approx(np.full(4 * turns, np.pi / 2), abs=1e-12)  # equal times, equal areas
