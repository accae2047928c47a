"""Lines of sight against orbit and Earth rotation, by a program that knows nothing of femflex, and by hand."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import femflex
from femflex.body import rigid_body
from femflex.case import read_case
from femflex.dynamics import compile_system
from femflex.system import EARTH_RADIUS, Frame, Orbit, Sight, System, spherical

CASES = Path(__file__).parents[2] / "cases"
UP = 500e3  # m


def looking(**sight):
    """A craft in an equatorial orbit, its axes normal, up, forward."""
    body = {"craft": rigid_body(10.0, np.eye(3))}
    orbit = Orbit(EARTH_RADIUS + UP)
    sights = (Sight("down", "craft", axis=[0, -2, 0], **sight),)
    return System(body, (spherical("craft"),), orbit=orbit, frame=Frame("orbital"), sights=sights)


def seen(system, times):
    model = compile_system(system)
    return model.observe(times, np.tile(model.x0, (len(times), 1)))


def test_a_station_under_the_craft_is_seen_straight_down_and_runs_away_with_the_earth():
    found = seen(looking(), np.array([0.0, 10.0]))
    assert found["sights/down/error"][0] == pytest.approx(0.0, abs=1e-12)
    assert found["sights/down/range"][0] == pytest.approx(UP, abs=1e-6)
    assert found["sights/down/elevation"][0] == pytest.approx(np.pi / 2, abs=1e-6)
    angle = (Orbit(EARTH_RADIUS + UP).mean_motion - 7.292115e-5) * 10.0  # that the station stays behind
    behind, below = EARTH_RADIUS * np.sin(angle), EARTH_RADIUS * (1 - np.cos(angle)) + UP
    assert found["sights/down/error"][1] == pytest.approx(np.arctan2(behind, below), rel=1e-9)
    assert found["sights/down/range"][1] == pytest.approx(np.hypot(behind, below), rel=1e-12)


def test_a_station_beside_the_track_is_seen_under_the_angle_of_the_triangle():
    latitude = 0.05
    found = seen(looking(latitude=latitude), np.zeros(1))
    beside, below = EARTH_RADIUS * np.sin(latitude), EARTH_RADIUS * (1 - np.cos(latitude)) + UP
    assert found["sights/down/error"][0] == pytest.approx(np.arctan2(beside, below), rel=1e-12)
    elevation = np.pi / 2 - latitude - np.arctan2(beside, below)
    assert found["sights/down/elevation"][0] == pytest.approx(elevation, rel=1e-9)


def test_the_gimbal_of_the_rigid_craft_keeps_its_antenna_on_the_station(tmp_path):
    """The table is made for a straight boom; what is left is the spline between its rows."""
    script = runpy.run_path(str(CASES / "ground_station.py"))
    case = read_case(CASES / "gimbal_antenna.toml")
    with femflex.run(case, tmp_path / "run.h5", without=["flexibility"]) as run:
        assert np.rad2deg(run["sights/station/error"].max()) < 2e-4
        for row in (0, len(run) // 2, len(run) - 1):
            away = np.linalg.norm(script["sight"](float(run.time[row])))
            assert run["sights/station/range"][row] == pytest.approx(away, abs=0.1)


def test_a_sight_needs_an_orbit_a_marker_and_an_axis():
    body = {"craft": rigid_body(10.0, np.eye(3))}
    with pytest.raises(ValueError, match="sight 'down' looks at a station on the Earth; give an orbit"):
        System(body, (spherical("craft"),), sights=(Sight("down", "craft"),))
    with pytest.raises(ValueError, match="marker 'dish' of sight 'down' is not on body 'craft'"):
        System(body, (spherical("craft"),), orbit=Orbit(7e6), sights=(Sight("down", "craft", "dish"),))
    with pytest.raises(ValueError, match=r"axis of sight 'down' is \[0.0, 0.0, 0.0\]; give three numbers, not all"):
        Sight("down", "craft", axis=[0, 0, 0])
