"""Quantities and expectations of runs with known channels, against their definitions."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.case import parse_case
from femflex.measures.evaluate import fitted_frequencies, measured_unit, measured_value
from femflex.measures.measure import MeasureTable
from femflex.measures.verdicts import run_verdicts
from femflex.results import Run, RunWriter, open_run
from femflex.system import Channel

Channels = dict[str, tuple[Channel, np.ndarray]]
LONG = np.linspace(0.0, 50.0, 2001)
ANGLES = [0.1 * np.sin(1.58 * LONG), 0.02 * np.cos(1.9266 * LONG + 0.3) + 0.05 * np.sin(0.5687 * LONG), 0 * LONG]
SHORT = np.array([0.0, 1.0, 2.0, 4.0, 5.0])  # not evenly spaced


@pytest.fixture(scope="module")
def write_run(tmp_path_factory: pytest.TempPathFactory) -> Callable[[np.ndarray, Channels], Run]:
    """Writes a run with these channels and opens it."""

    def write(time: np.ndarray, channels: Channels) -> Run:
        path: Path = tmp_path_factory.mktemp("run") / "run.h5"
        with RunWriter(path, {name: channel for name, (channel, _) in channels.items()}, {"boom": BOOM}, {}) as writer:
            writer.write_block(time, {name: values for name, (_, values) in channels.items()})
            writer.finish(complete=True)
        return open_run(path)

    return write


BOOM = rigid_body(3.0, np.eye(3))


@pytest.fixture(scope="module")
def swinging(write_run) -> Run:
    """Fifty seconds of known sines."""
    angles = Channel("rad", "angles", (3,), ("pitch", "roll", "yaw"))
    energy = Channel("J", "energy", (), ())
    return write_run(
        LONG,
        {"attitude/angles": (angles, np.stack(ANGLES, axis=1)), "monitors/energy": (energy, 5.0 + 1e-6 * LONG)},
    )


@pytest.fixture(scope="module")
def few_instants(write_run) -> Run:
    """Five instants of a number, of a vector in a plane, and of coordinates of different units."""
    plane = np.array([[3, 4], [0, -5], [6, 8], [0, 0], [-3, 4]], float)
    return write_run(
        SHORT,
        {
            "x": (Channel("N", "number", (), ()), np.array([1.0, -3, 2, -1, 0.5])),
            "r": (Channel("m", "vector", (2,), ("a", "b")), plane),
            "mixed": (Channel("m, rad", "coordinates", (2,), ("slide", "turn")), plane),
        },
    )


def measure(run: Run, mean_motion: float | None = 0.5, **table: Any) -> float:
    return measured_value(MeasureTable.model_validate(table), run, mean_motion=mean_motion)


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
def test_numbers_and_vectors_are_reduced_by_definition(
    few_instants: Run, table: dict[str, Any], of_x: float, of_r: float
):
    """Of a vector the magnitude counts; change and drift are magnitudes of its difference."""
    assert measure(few_instants, channel="x", **table) == pytest.approx(of_x, rel=1e-12)
    assert measure(few_instants, channel="r", **table) == pytest.approx(of_r, rel=1e-12)


def test_sines_have_the_amplitudes_and_frequencies_they_were_made_of(swinging: Run):
    pitch = {"channel": "attitude/angles", "component": "pitch"}
    roll = {"of": "frequency", "channel": "attitude/angles", "component": "roll", "tones": 2, "per_orbit": True}
    assert measure(swinging, of="rms", **pitch) == pytest.approx(0.1 / math.sqrt(2), rel=2e-2)
    assert measure(swinging, of="value", at=10.0, **pitch) == pytest.approx(0.1 * math.sin(15.8), rel=1e-3)
    assert measure(swinging, of="range", **pitch) == pytest.approx(0.2, rel=1e-3)
    assert measure(swinging, of="frequency", **pitch) == pytest.approx(1.58 / (2 * math.pi), rel=1e-9)
    assert measure(swinging, tone=1, **roll) == pytest.approx(0.5687 / 0.5, rel=1e-10)
    assert measure(swinging, tone=2, **roll) == pytest.approx(1.9266 / 0.5, rel=1e-10)
    assert measure(swinging, of="drift", channel="monitors/energy") == pytest.approx(5e-5, rel=1e-6)
    assert measure(swinging, of="body_mass", body="boom") == 3.0


def test_close_tones_are_separated_in_rising_order():
    omega = np.array([1.0, 1.3, 1.31])
    t = np.linspace(0, 900, 9001)
    signal = sum(a * np.cos(w * t + p) for a, w, p in zip((1, 0.3, 0.5), omega, (0.1, 2.0, 1.0), strict=True))
    np.testing.assert_allclose(2 * np.pi * fitted_frequencies(t, signal + 7.0, 3), omega, rtol=1e-9)


@pytest.mark.parametrize(
    ("table", "unit"),
    [
        ({"of": "frequency", "channel": "x"}, "Hz"),
        ({"of": "frequency", "channel": "x", "per_orbit": True}, "per orbit"),
        ({"of": "body_mass", "body": "boom"}, "kg"),
        ({"of": "peak", "channel": "x"}, "N"),
        ({"of": "drift", "channel": "x", "relative": True}, "1"),
        ({"of": "peak", "channel": "mixed", "component": "turn"}, "rad"),
        ({"of": "peak", "channel": "mixed", "component": 0}, "m"),
    ],
)
def test_unit_is_that_of_the_measured_column(few_instants: Run, table: dict[str, Any], unit: str):
    assert measured_unit(MeasureTable.model_validate(table), few_instants) == unit


HEAD = '[run]\nduration = 50\n[bodies.boom]\nkind = "rigid"\nmass = 3\ninertia = [1, 1, 1]\n'
PEAK = 'of = "peak"\nchannel = "attitude/angles"\ncomponent = "pitch"\n'
DRIFT = 'of = "drift"\nchannel = "monitors/energy"\n'


@pytest.mark.parametrize(
    ("table", "holds"),
    [
        (PEAK + 'value = "5.7296 deg"\ntolerance = "0.01 deg"', True),
        (PEAK + 'value = "5.7 deg"\ntolerance = "0.01 deg"', False),
        (PEAK + "value = 0.2\nrelative_tolerance = 0.55", True),  # of the expected value
        (PEAK + "value = 0.25\nrelative_tolerance = 0.55", False),
        (PEAK + "value = 0.1\ntolerance = 0.05\nabove = 0.12", False),  # all bounds count
        (DRIFT + 'below = "1 uJ"', False),
        (DRIFT + 'below = "1 mJ"\nabove = "49 uJ"', True),
        ('of = "body_mass"\nbody = "boom"\nabove = 2.9\nbelow = "3.1 kg"', True),
        ('of = "body_mass"\nbody = "boom"\nabove = 3', False),
    ],
)
def test_expectations_hold_in_their_units_and_bounds(swinging: Run, table: str, holds: bool):
    (verdict,) = run_verdicts(parse_case(f"{HEAD}[expect.one]\n{table}\n"), swinging)
    assert verdict.holds is holds, str(verdict)


@pytest.mark.parametrize("size", ['perigee_altitude = "1000 km"', "semi_major_axis = 9222671.25"])
def test_frequency_per_orbit_counts_in_the_mean_motion_of_an_ellipse(swinging: Run, size: str):
    """Perigee at 6378.137 + 1000 km, e = 0.2: a = 7378.137 / 0.8 km, n = sqrt(mu / a^3)."""
    n = math.sqrt(3.986004418e14 / (7378137.0 / 0.8) ** 3)
    orbit = f'[orbit]\nkind = "specified"\neccentricity = 0.2\n{size}\n'
    frequency_table = (
        PEAK.replace("peak", "frequency") + f"per_orbit = true\nvalue = {1.58 / n}\nrelative_tolerance = 1e-6\n"
    )
    (verdict,) = run_verdicts(parse_case(f"{HEAD}{orbit}[expect.one]\n{frequency_table}"), swinging)
    assert verdict.holds and verdict.measured == pytest.approx(1.58 / n, rel=1e-8)
