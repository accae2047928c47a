"""Quantities measured on made-up signals with known answers, and what expectations make of them."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from femflex.case import parse_case
from femflex.case.evaluate import column_unit, measured
from femflex.case.measure import MeasureTable
from femflex.case.tones import crossing_frequency, fitted_frequencies
from femflex.case.verdicts import judged

TIME = np.linspace(0.0, 50.0, 2001)
ANGLES = np.stack(
    [0.1 * np.sin(1.58 * TIME), 0.02 * np.cos(1.9266 * TIME + 0.3) + 0.05 * np.sin(0.5687 * TIME), 0 * TIME], axis=1
)


class Signals:
    """A run of known signals."""

    time = TIME

    def __getitem__(self, path: str):
        return {"attitude/angles": ANGLES, "monitors/energy": 5.0 + 1e-6 * TIME}[path]

    def names(self, path: str):
        return ("pitch", "roll", "yaw") if path == "attitude/angles" else ()

    def unit(self, path: str):
        return "rad" if path == "attitude/angles" else "J"

    def bodies(self):
        return {"boom": SimpleNamespace(omega=np.array([2 * math.pi, np.nan]), mass=3.0)}


def measure(**table: object) -> float:
    return measured(MeasureTable(**table), Signals(), mean_motion=0.5)  # type: ignore[arg-type]


def test_reductions_of_a_sine_are_those_of_the_textbook():
    pitch = {"channel": "attitude/angles", "component": "pitch"}
    assert measure(of="peak", **pitch) == pytest.approx(0.1, rel=1e-3)
    assert measure(of="rms", **pitch) == pytest.approx(0.1 / math.sqrt(2), rel=2e-2)
    assert measure(of="value", at=10.0, **pitch) == pytest.approx(0.1 * math.sin(15.8), rel=1e-3)
    assert measure(of="value", **pitch) == ANGLES[-1, 0]
    assert measure(of="maximum", start=49.0, **pitch) == ANGLES[TIME >= 49, 0].max()
    assert measure(of="range", **pitch) == pytest.approx(0.2, rel=1e-3)
    assert measure(of="peak", channel="attitude/angles") == np.linalg.norm(ANGLES, axis=1).max()


def test_drift_is_relative_when_asked():
    assert measure(of="drift", channel="monitors/energy") == pytest.approx(5e-5, rel=1e-6)
    assert measure(of="drift", channel="monitors/energy", relative=True) == pytest.approx(1e-5, rel=1e-4)


def test_a_frequency_is_found_by_crossings_and_by_a_fit_of_two_tones():
    assert 2 * math.pi * measure(of="frequency", channel="attitude/angles", component=0) == pytest.approx(
        1.58, rel=1e-9
    )
    roll = {"of": "frequency", "channel": "attitude/angles", "component": "roll", "tones": 2}
    assert measure(tone=1, per_orbit=True, **roll) == pytest.approx(0.5687 / 0.5, rel=1e-10)
    assert measure(tone=2, per_orbit=True, **roll) == pytest.approx(1.9266 / 0.5, rel=1e-10)


def test_three_close_tones_are_distinguished():
    omega = np.array([1.0, 1.3, 1.31])
    t = np.linspace(0, 900, 9001)
    signal = sum(a * np.cos(w * t + p) for a, w, p in zip((1, 0.3, 0.5), omega, (0.1, 2.0, 1.0), strict=True))
    np.testing.assert_allclose(2 * np.pi * fitted_frequencies(t, signal + 7.0, 3), omega, rtol=1e-9)


def test_a_signal_without_two_crossings_has_no_frequency():
    with pytest.raises(ValueError, match="crosses its mean upwards 0 times"):
        crossing_frequency(TIME, TIME**2 * -1.0)


def test_quantities_of_bodies():
    assert measure(of="mode_frequency", body="boom") == 1.0
    assert measure(of="body_mass", body="boom") == 3.0
    with pytest.raises(ValueError, match="mode 2 of body 'boom' has no natural frequency; 1 of its modes have one"):
        measure(of="mode_frequency", body="boom", mode=2)
    with pytest.raises(KeyError, match="did you mean 'boom'"):
        measure(of="body_mass", body="bom")


def test_a_component_that_is_not_there_is_answered():
    with pytest.raises(KeyError, match="did you mean 'pitch'"):
        measure(channel="attitude/angles", component="pich")
    with pytest.raises(KeyError, match=r"which has 3 \(from 0\)"):
        measure(channel="attitude/angles", component=3)
    with pytest.raises(KeyError, match="is a scalar"):
        measure(channel="monitors/energy", component=0)
    with pytest.raises(ValueError, match="no instant of the run"):
        measure(channel="monitors/energy", start=60.0)


EXPECTATIONS = """
[run]
duration = 50
[bodies.boom]
kind = "rigid"
mass = 3
inertia = [1, 1, 1]
[expect]
peak = { of = "peak", channel = "attitude/angles", component = "pitch", value = "5.7296 deg", tolerance = "0.01 deg" }
rate = { of = "mode_frequency", body = "boom", value = "6.2832 rad/s", relative_tolerance = 1e-4 }
drift = { of = "drift", channel = "monitors/energy", below = "1 uJ" }
mass = { of = "body_mass", body = "boom", above = 2.9, below = "3.1 kg" }
"""


def test_expectations_hold_in_the_units_they_are_given_in():
    verdicts = {v.name: v for v in judged(parse_case(EXPECTATIONS), Signals())}
    assert {name: v.holds for name, v in verdicts.items()} == {"peak": True, "rate": True, "drift": False, "mass": True}
    assert "does not hold" in str(verdicts["drift"]) and "expected below 1e-06" in str(verdicts["drift"])


@pytest.mark.parametrize(
    "size", ['perigee_altitude = "1000 km"', "semi_major_axis = 9222671.25"], ids=["by perigee", "by half axis"]
)
def test_a_frequency_per_orbit_is_counted_in_the_mean_motion_of_an_ellipse(size: str):
    """Perigee at 6378.137 + 1000 km, e = 0.2: a = 7378.137 / 0.8 km, n = sqrt(mu / a^3)."""
    n = math.sqrt(3.986004418e14 / (7378137.0 / 0.8) ** 3)
    orbit = f'[orbit]\nkind = "specified"\neccentricity = 0.2\n{size}\n'
    measure = 'of = "frequency", channel = "attitude/angles", component = "pitch", per_orbit = true'
    table = f"pitch = {{ {measure}, value = {1.58 / n}, relative_tolerance = 1e-6 }}\n"
    text = EXPECTATIONS.split("[expect]")[0] + orbit + "[expect]\n" + table
    (verdict,) = judged(parse_case(text), Signals())
    assert verdict.holds and verdict.found == pytest.approx(1.58 / n, rel=1e-8)


@pytest.mark.parametrize(("value", "holds"), [(0.5, False), (0.8, True), (1.5, True), (2.5, False)])
def test_a_relative_tolerance_is_a_part_of_the_expected_value(value: float, holds: bool):
    """1 Hz was found: 0.5 and 2.5 times 1 +- 0.55 leave it out, 0.8 and 1.5 times that hold it."""
    table = f'rate = {{ of = "mode_frequency", body = "boom", value = "{value} Hz", relative_tolerance = 0.55 }}'
    (verdict,) = judged(parse_case(EXPECTATIONS.split("[expect]")[0] + "[expect]\n" + table), Signals())
    assert verdict.holds is holds


def test_an_expectation_in_another_dimension_is_refused():
    text = EXPECTATIONS.replace('"5.7296 deg", tolerance = "0.01 deg"', '"5 m", tolerance = "1 m"')
    with pytest.raises(ValueError, match=r"expect.peak.value: found a number in m; the quantity is in rad"):
        judged(parse_case(text), Signals())


def test_a_column_of_several_units_is_reported_in_its_own():
    class Mixed:
        """A run whose coordinates have units of their own."""

        def unit(self, path: str) -> str:
            return "m, rad, rad"

        def names(self, path: str) -> tuple[str, ...]:
            return ("slide", "turn", "swing")

    def told(component):
        named = {} if component is None else {"component": component}
        table = MeasureTable(of="value", channel="q", **named)
        return column_unit(table, Mixed())  # type: ignore[arg-type]

    found = [told("slide"), told("swing"), told(1), told(0), told(None)]
    assert found == ["m", "rad", "rad", "m", "m, rad"]


class Short:
    """Five instants, not evenly spaced, of a number and of a vector in a plane."""

    time = np.array([0.0, 1.0, 2.0, 4.0, 5.0])

    def __getitem__(self, path: str):
        plane = [[3, 4], [0, -5], [6, 8], [0, 0], [-3, 4]]
        return {"x": np.array([1.0, -3, 2, -1, 0.5]), "r": np.array(plane, float)}[path]

    def names(self, path: str):
        return ("a", "b") if path == "r" else ()

    def unit(self, path: str):
        return {"x": "N", "r": "m"}[path]


@pytest.mark.parametrize(
    ("table", "of_x", "of_r"),
    [
        ({"of": "value"}, 0.5, 5.0),
        ({"of": "value", "at": 3.0}, 0.5, 5.0),  # halfway between 2 and -1, and between 10 and 0
        ({"of": "value", "at": 3.5}, -0.25, 2.5),
        ({"of": "change"}, -0.5, 6.0),
        ({"of": "change", "start": 1.0, "end": 4.0}, 2.0, 5.0),
        ({"of": "peak"}, 3.0, 10.0),
        ({"of": "maximum"}, 2.0, 10.0),
        ({"of": "minimum"}, -3.0, 0.0),
        ({"of": "minimum", "start": 2.0}, -1.0, 0.0),
        ({"of": "minimum", "end": 2.0}, -3.0, 5.0),
        ({"of": "range"}, 5.0, 10.0),
        ({"of": "mean"}, -0.1, 5.0),
        ({"of": "rms"}, math.sqrt(15.25 / 5), math.sqrt(175 / 5)),
        ({"of": "drift"}, 4.0, math.sqrt(90)),
        ({"of": "drift", "relative": True}, 4.0 / 3, math.sqrt(0.9)),
        ({"of": "drift", "start": 2.0}, 3.0, 10.0),
    ],
)
def test_a_number_and_a_vector_are_reduced_by_hand(table: dict[str, object], of_x: float, of_r: float):
    """Of a vector the magnitude counts; change and drift are magnitudes of its difference."""
    for channel, expected in (("x", of_x), ("r", of_r)):
        one = MeasureTable(channel=channel, **table)  # type: ignore[arg-type]
        assert measured(one, Short(), None) == pytest.approx(expected, rel=1e-12), channel  # type: ignore[arg-type]
    second = MeasureTable(channel="r", component="b", **table)  # type: ignore[arg-type]
    if table == {"of": "mean"}:
        assert measured(second, Short(), None) == pytest.approx(11 / 5)  # type: ignore[arg-type]
