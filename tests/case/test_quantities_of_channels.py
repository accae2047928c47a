"""Quantities of channels with several unequal entries, over part of the run, against their definitions row by row."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femflex.case import parse_case
from femflex.case.evaluate import column_unit, measured, measured_unit
from femflex.case.measure import MeasureTable
from femflex.case.tones import crossing_frequency, fitted_frequencies
from femflex.case.verdicts import judged, judged_diagram, judged_modes

TIME = np.cumsum([0.0, 0.3, 0.2, 0.5, 0.1, 0.4, 0.25, 0.35])  # 0, 0.3, 0.5, 1.0, 1.1, 1.5, 1.75, 2.1
RANDOM = np.random.default_rng(4)
CHANNELS = {
    "scalar": 1.5 - RANDOM.normal(size=8),
    "vector": RANDOM.normal(size=(8, 3)) - 0.7,
    "dyad": RANDOM.normal(size=(8, 2, 2)),
    "mixed": RANDOM.normal(size=(8, 3)),
}
NAMES = {"vector": ("x", "y", "z"), "mixed": ("slide", "angle", "delta1")}
UNITS = {"scalar": "N", "vector": "m", "dyad": "1", "mixed": "m, rad, kg^1/2 m"}


class Rows(dict):
    """Channels by path, as a run has them."""

    time = TIME

    def names(self, path: str) -> tuple[str, ...]:
        return NAMES.get(path, ())

    def unit(self, path: str) -> str:
        return UNITS[path]

    def bodies(self) -> dict[str, Any]:
        return BODIES


BODIES = {
    "boom": SimpleNamespace(moments=SimpleNamespace(mass=3.5), omega=np.array([2.0, 5.0, np.nan])),
    "mast.1": SimpleNamespace(moments=SimpleNamespace(mass=1.25), omega=np.array([1.0])),
    "mast.2": SimpleNamespace(moments=SimpleNamespace(mass=0.5), omega=np.array([1.0])),
    "hub": SimpleNamespace(mass=40.0, omega=np.zeros(0)),
}
RUN = Rows(CHANNELS)


def value(**table: Any) -> float:
    return measured(MeasureTable.model_validate(table), RUN)


def between(start: float, end: float) -> list[int]:
    return [k for k, t in enumerate(TIME) if start - 1e-6 <= t <= end + 1e-6]


@pytest.mark.parametrize(("start", "end"), [(0.0, 2.1), (0.5, 1.5), (0.4, 1.4), (1.0, 2.1), (0.0, 1.1)])
def test_quantities_of_part_of_a_run_follow_their_definitions(start: float, end: float):
    rows = between(start, end)
    span = {"start": start, "end": end}
    x = [CHANNELS["scalar"][k] for k in rows]
    v = [CHANNELS["vector"][k] for k in rows]
    sizes = [math.hypot(*one) for one in v]
    y = [one[1] for one in v]
    assert value(of="peak", channel="scalar", **span) == pytest.approx(max(abs(a) for a in x))
    assert value(of="maximum", channel="scalar", **span) == pytest.approx(max(x))
    assert value(of="minimum", channel="vector", component="y", **span) == pytest.approx(min(y))
    assert value(of="range", channel="vector", component=1, **span) == pytest.approx(max(y) - min(y))
    assert value(of="mean", channel="vector", **span) == pytest.approx(sum(sizes) / len(sizes))
    assert value(of="rms", channel="scalar", **span) == pytest.approx(math.sqrt(sum(a * a for a in x) / len(x)))
    assert value(of="change", channel="scalar", **span) == pytest.approx(x[-1] - x[0])
    assert value(of="change", channel="vector", **span) == pytest.approx(math.dist(v[-1], v[0]))
    away = [math.dist(one, v[0]) for one in v]
    assert value(of="drift", channel="vector", **span) == pytest.approx(max(away))
    assert value(of="drift", channel="vector", relative=True, **span) == pytest.approx(max(away) / max(sizes))
    assert value(of="drift", channel="scalar", **span) == pytest.approx(max(abs(a - x[0]) for a in x))
    assert value(of="value", channel="scalar", **span) == pytest.approx(x[-1])
    assert value(of="value", channel="vector", **span) == pytest.approx(sizes[-1])
    dyads = [CHANNELS["dyad"][k] for k in rows]
    assert value(of="peak", channel="dyad", **span) == pytest.approx(max(math.hypot(*one.ravel()) for one in dyads))


def test_a_value_between_two_rows_lies_on_the_line_between_them():
    t = 0.62
    expected = CHANNELS["vector"][2, 2] + (t - 0.5) / 0.5 * (CHANNELS["vector"][3, 2] - CHANNELS["vector"][2, 2])
    assert value(of="value", channel="vector", component="z", at=t) == pytest.approx(expected)


@pytest.mark.parametrize("size", [1e8, 1e-8])
def test_ends_of_a_span_are_met_within_rounding_of_their_size(size: float):
    """Instants of three years, and of a hundred-millionth of a second, a few roundings off the ends."""
    run = Rows(scalar=np.array([1.0, 2.0, 3.0, 5.0]))
    run.time = size * (np.array([0.9, 1.0 - 4e-16, 2.0 + 8e-16, 2.1]))
    span = {"channel": "scalar", "start": size, "end": 2 * size}
    for of, expected in (("minimum", 2.0), ("maximum", 3.0)):
        assert measured(MeasureTable.model_validate({"of": of, **span}), run) == expected


def test_a_span_without_rows_is_told_with_both_ends():
    with pytest.raises(ValueError, match=r"between start = 0.51 s and end = 0.9 s"):
        value(of="peak", channel="scalar", start=0.51, end=0.9)


def test_a_frequency_of_several_components_asks_for_one():
    with pytest.raises(ValueError, match="one component of 'vector'"):
        value(of="frequency", channel="vector")
    table = MeasureTable.model_validate({"of": "frequency", "channel": "s", "per_orbit": True})
    waves = Rows({"s": np.array([-1.0, 1.0] * 4)})
    with pytest.raises(ValueError, match="needs an orbit"):
        measured(table, waves)


@pytest.mark.parametrize("per_orbit", [False, True])
def test_a_frequency_is_that_of_the_wave_per_second_or_per_orbit(per_orbit: bool):
    run = Rows({"wave": 0.3 + np.sin(2 * np.pi * 0.7 * np.linspace(0, 10, 400) + 0.4)})
    run.time = np.linspace(0, 10, 400)  # type: ignore[misc]
    n = 0.11  # rad/s
    found = measured(
        MeasureTable.model_validate({"of": "frequency", "channel": "wave", "per_orbit": per_orbit}), run, mean_motion=n
    )
    assert found == pytest.approx(0.7 * 2 * np.pi / n if per_orbit else 0.7, rel=1e-4)


def test_quantities_of_bodies_and_of_bodies_in_segments():
    assert value(of="body_mass", body="boom") == 3.5
    assert value(of="body_mass", body="hub") == 40.0
    assert value(of="body_mass", body="mast") == 1.75
    assert value(of="mode_frequency", body="boom", mode=2) == pytest.approx(5.0 / (2 * math.pi))
    with pytest.raises(ValueError, match="mode 3 of body 'boom' has no natural frequency; 2 of its modes have one"):
        value(of="mode_frequency", body="boom", mode=3)
    with pytest.raises(KeyError, match="body 'bom' is not in the run; did you mean 'boom'"):
        value(of="body_mass", body="bom")


@pytest.mark.parametrize(
    ("table", "unit"),
    [
        ({"of": "frequency", "channel": "scalar"}, "Hz"),
        ({"of": "frequency", "channel": "scalar", "per_orbit": True}, "per orbit"),
        ({"of": "mode_frequency", "body": "boom"}, "Hz"),
        ({"of": "body_mass", "body": "boom"}, "kg"),
        ({"of": "peak", "channel": "scalar"}, "N"),
        ({"of": "drift", "channel": "scalar", "relative": True}, "1"),
        ({"of": "peak", "channel": "mixed", "component": "angle"}, "rad"),
        ({"of": "peak", "channel": "mixed", "component": 2}, "kg^1/2 m"),
        ({"of": "peak", "channel": "mixed"}, "m, rad, kg^1/2 m"),
        ({"of": "peak", "channel": "vector", "component": "z"}, "m"),
    ],
)
def test_a_quantity_has_the_unit_of_its_column(table: dict[str, Any], unit: str):
    assert measured_unit(MeasureTable.model_validate(table), RUN) == unit


def test_a_column_of_a_channel_with_fewer_units_than_names_has_them_all(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(UNITS, "mixed", "m, rad, m")
    monkeypatch.setitem(NAMES, "mixed", ("a", "b", "c", "d"))
    assert column_unit(MeasureTable.model_validate({"channel": "mixed", "component": "b"}), RUN) == "m, rad"


@pytest.mark.parametrize("shift", [0.1, 2.0, 3.9])
def test_the_frequency_by_crossings_is_exact_to_the_cubic_between_rows(shift: float):
    time = np.sort(np.concatenate([np.linspace(0, 12, 240), np.linspace(0.01, 11.9, 77)]))  # unequal steps
    signal = 2.0 + 0.3 * np.sin(2 * np.pi * 0.5 * time + shift)
    assert crossing_frequency(time, signal) == pytest.approx(0.5, rel=3e-4)


def test_fitted_frequencies_rise_whatever_the_amplitudes():
    time = np.linspace(3.0, 43.0, 900)
    signal = 5.0 + 0.2 * np.cos(2 * np.pi * 0.31 * time) + 3.0 * np.sin(2 * np.pi * 1.13 * time + 0.3)
    signal += 1.0 * np.cos(2 * np.pi * 0.77 * time - 1.0)
    np.testing.assert_allclose(fitted_frequencies(time, signal, 3), [0.31, 0.77, 1.13], rtol=1e-8)


HEAD = "[run]\nduration = 3\n[bodies.boom]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"


@pytest.mark.parametrize(
    ("given", "found", "holds", "text"),
    [
        ("value = '2 m'\ntolerance = '0.5 mm'", 2.0004, True, "2 +- 0.0005"),
        ("value = '2 m'\ntolerance = '0.5 mm'", 1.9994, False, "2 +- 0.0005"),
        ("value = -2\nrelative_tolerance = 1e-3", -2.0019, True, "-2 +- 0.002"),
        ("value = -2\nrelative_tolerance = 1e-3", -2.0021, False, "-2 +- 0.002"),
        ("above = '1 cm'\nbelow = 3", 0.02, True, "above 0.01, below 3"),
        ("above = '1 cm'\nbelow = 3", 0.01, False, "above 0.01, below 3"),
        ("above = '1 cm'\nbelow = 3", 3.0, False, "above 0.01, below 3"),
        ("above = 1", 0.9, False, "above 1"),
        ("below = 1", 1.1, False, "below 1"),
        ("value = 1\ntolerance = 0.5\nabove = 1.2", 1.1, False, "1 +- 0.5, above 1.2"),
    ],
)
def test_an_answer_is_judged_by_all_of_its_bounds(given: str, found: float, holds: bool, text: str):
    case = parse_case(HEAD + f"[expect.tip]\nof = 'value'\nchannel = 'length'\n{given}\n")
    run = Rows({"length": np.full(8, found)})
    run.unit = lambda path: "m"  # type: ignore[method-assign]
    (verdict,) = judged(case, run)
    assert (verdict.holds, verdict.expected) == (holds, text)
    assert str(verdict) == f"tip: {found:.10g} m, expected {text}: {'holds' if holds else 'does not hold'}"


def test_frequencies_of_the_craft_and_of_a_diagram_are_asked_by_their_names():
    text = HEAD + "[campbell]\nspeeds = '0:3 rad/s:4'\naxis = 'z'\n".replace("'z'", "[0, 0, 1]")
    text += "[expect.first]\nof = 'system_frequency'\nbranch = 'boom bending y'\nvalue = '3 Hz'\ntolerance = '0.1 Hz'\n"
    text += "[expect.third]\nof = 'system_frequency'\nmode = 3\nbelow = '12 rad/s'\n"
    text += (
        "[expect.spun]\nof = 'campbell_frequency'\nbranch = 'flap'\nspeed = 2\nvalue = '20 rad/s'\ntolerance = 0.01\n"
    )
    case = parse_case(text)
    asked: list[Any] = []

    def frequency(*which: Any) -> float:
        asked.append(which)
        return {("boom bending y",): 3.05, (3,): 2.0, ("flap", 2.0): 3.18}[which]

    known = SimpleNamespace(frequency=frequency)
    first, third = judged_modes(case, known)
    assert (first.name, first.found, first.holds, first.unit) == ("first", 3.05, True, "Hz")
    assert (third.name, third.holds) == ("third", False)  # 2 Hz are 12.57 rad/s
    assert re.fullmatch(r"below 1.9098\d+", third.expected)
    (spun,) = judged_diagram(case, known)
    assert spun.holds and spun.expected.startswith("3.18309")
    assert asked == [("boom bending y",), (3,), ("flap", 2.0)]


@pytest.mark.parametrize(
    ("unit", "given", "told"),
    [
        ("m", "'3 kg'", "found a number in kg; the quantity is in m"),
        ("1", "'3 m'", "found a number in m; the quantity is in 1"),
        ("kg^1/2 m", "'3 m'", "found a number in m; the quantity is in kg"),
        ("Hz", "'3 m'", "found a number in m; the quantity is in Hz"),
    ],
)
def test_an_answer_in_another_unit_is_refused_with_both(unit: str, given: str, told: str):
    case = parse_case(HEAD + f"[expect.tip]\nof = 'peak'\nchannel = 'c'\nbelow = {given}\n")
    run = Rows({"c": np.ones(8)})
    run.unit = lambda path: unit  # type: ignore[method-assign]
    with pytest.raises(ValueError, match=f"expect.tip.below: {re.escape(told)}"):
        judged(case, run)


@pytest.mark.parametrize(
    ("unit", "given"), [("kg^1/2 m", "'3 kg^0.5 m'"), ("furlong-ish thing", "'3 m'"), ("1", "'300 %'")]
)
def test_an_answer_in_the_unit_of_the_channel_or_in_one_that_is_not_read_is_taken(unit: str, given: str):
    case = parse_case(HEAD + f"[expect.tip]\nof = 'peak'\nchannel = 'c'\nbelow = {given}\n")
    run = Rows({"c": np.ones(8)})
    run.unit = lambda path: unit  # type: ignore[method-assign]
    (verdict,) = judged(case, run)
    assert verdict.holds and verdict.expected == "below 3"
