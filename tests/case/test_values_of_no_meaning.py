"""Values that are numbers or words of the right type and yet mean nothing are refused where they stand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from femflex.case import CaseError
from femflex.case.connection import RegionTable
from femflex.case.controller import LowPassTable, PdTable, PulsesTable
from femflex.case.measure import ExpectTable, MeasureTable
from femflex.case.orbit import OrbitTable
from femflex.case.read import parse_case
from femflex.case.run import PicturesTable
from femflex.case.stability import AxisTable
from femflex.case.sweep import VaryTable
from femflex.case.thruster import ThrusterTable
from femflex.case.wheel import CableTable, GyroTable
from femflex.system.blocks import observer

PULSES = {"kind": "pulses", "inputs": ["a.x"], "outputs": ["on"], "period": 0.5}
PD = {"kind": "pd", "inputs": ["a.x", "a.y"], "stiffness": 1, "damping": 2}
LOW_PASS = {"kind": "low_pass", "inputs": ["a.x"], "frequency": 2}
GYRO = {"body": "a", "momentum": 3}
CABLE = {"body": "a", "parent": "b", "length": 2, "EA": 5}
JET = {"body": "a", "thrust": 2, "command": "a.x"}
WEIGHT = {"of": "body_mass", "body": "a"}


@pytest.mark.parametrize(
    ("table", "given", "found"),
    [
        (PulsesTable, PULSES | {"full": 0}, "found 0; it must be above 0"),
        (PulsesTable, PULSES | {"full": [1, -2]}, "entry 2: found -2; it must be above 0"),
        (PdTable, PD | {"limit": 0}, "found 0; it must be above 0"),
        (PdTable, PD | {"limit": [3, -1]}, "entry 2: found -1; it must be above 0"),
        (PdTable, PD | {"scaled": "yes"}, "should be a valid boolean"),
        (LowPassTable, LOW_PASS | {"order": True}, "found true .*; expected a whole number"),
        (LowPassTable, LOW_PASS | {"order": 3}, "found 3 .*; it must be at most 2"),
        (ThrusterTable, JET | {"switched": 1}, "should be a valid boolean"),
        (GyroTable, GYRO | {"rates": ["0.1 kg"]}, "found '0.1 kg', which is a mass; expected an angular rate"),
        (GyroTable, GYRO | {"angles": ["a.x", "30 degq"]}, "unit 'degq' in 'degq' is not known; did you mean 'deg'"),
        (GyroTable, GYRO | {"rates": [True]}, "found true .*; expected an angular rate, a number in rad/s"),
        (CableTable, CABLE | {"masses": 0}, "found 0; it must be at least 1"),
        (CableTable, CABLE | {"masses": 501}, "found 501 .*; it must be at most 500"),
        (RegionTable, {"points": [2, 0]}, "found 0; it must be at least 1"),
        (RegionTable, {"points": [True]}, "found true .*; expected a whole number"),
        (VaryTable, {"between": ["1 kg", True]}, "found true .*; expected a number or a string such as '3 kg'"),
        (VaryTable, {"normal": [[1], 2]}, r"found \[1\] \(a list\); expected a number or a string"),
        (AxisTable, {"between": [False, 2]}, "found false .*; expected a number or a string such as '3 kg'"),
        (ExpectTable, WEIGHT | {"above": "3 s"}, "found above in s; body_mass is in kg"),
        (ExpectTable, {"of": "system_frequency", "below": "3 m"}, "found below in m; system_frequency is in Hz"),
        (MeasureTable, {"channel": "c", "start": 3, "end": 2}, "found start = 3 s after end = 2 s; start comes first"),
        (PicturesTable, {"start": 3, "end": 3}, "found a movie from start = 3 s to end = 3 s"),
    ],
)  # fmt: skip
def test_a_value_without_a_meaning_is_refused_with_what_was_found(table: Any, given: dict[str, Any], found: str):
    with pytest.raises(ValidationError, match=found):
        TypeAdapter(table).validate_python(given)


def test_values_that_mean_something_are_read_as_they_are():
    assert GyroTable(**GYRO, rates=["6 rpm", "a.x", 2]).rates == [pytest.approx(0.2 * np.pi), "a.x", 2.0]  # type: ignore[arg-type]
    assert GyroTable(**GYRO, angles=["2nd.value", "-.5 rad"]).angles == ["2nd.value", -0.5]  # type: ignore[arg-type]
    assert PulsesTable(**PULSES, full=[1, 2.5]).full == (1.0, 2.5)  # type: ignore[arg-type]
    assert (PdTable(**PD, limit=3).limit, PdTable(**PD).limit) == ((3.0,), None)  # type: ignore[arg-type]
    assert [LowPassTable(**LOW_PASS, order=order).order for order in (1, 2)] == [1, 2]  # type: ignore[arg-type]
    assert [CableTable(**CABLE, masses=masses).masses for masses in (1, 500)] == [1, 500]  # type: ignore[arg-type]
    for unit, of in (("Hz", "mode_frequency"), ("rad/s", "mode_frequency"), ("rpm", "system_frequency")):
        ExpectTable(of=of, body="a" if of == "mode_frequency" else None, above=f"3 {unit}")  # type: ignore[arg-type]
    MeasureTable(channel="c", start=2.0, end=2.0)


ORBITING = """
[run]
orbits = 0.5
[orbit]
semi_major_axis = "7000 km"
[bodies.bus]
kind = "rigid"
mass = 3
inertia = [1, 1, 1]
[expect]
late = { channel = "attitude/angles", of = "value", at = "AT s", above = 0 }
"""


def test_the_end_of_a_run_that_is_counted_in_orbits_is_known():
    half = np.pi * np.sqrt(7e6**3 / 3.986004418e14)
    orbit = OrbitTable(semi_major_axis=7e6, eccentricity=0.01)
    assert orbit.period == pytest.approx(2 * half, rel=1e-12)
    parse_case(ORBITING.replace("AT", str(half - 1)))
    with pytest.raises(CaseError, match=rf"expect.late.at: found {half + 1:g} s; the run lasts from 0 to {half:g} s"):
        parse_case(ORBITING.replace("AT", str(half + 1)))
    with pytest.raises(CaseError, match=r"expect.late.at: found -1 s; the run lasts from 0"):
        parse_case(ORBITING.replace("AT", "-1"))


GAINS = {"A": np.eye(3), "B": np.ones((3, 2)), "C": np.ones((1, 3)), "K": np.ones((2, 3)), "L": np.ones((3, 1))}


@pytest.mark.parametrize(
    ("name", "shape", "said"),
    [
        ("A", (1, 3), r"A has shape \(1, 3\); with 1 states"),
        ("B", (1, 2), r"B has shape \(1, 2\); with 3 states .*, 1 inputs .* and 2 outputs .* it needs \(3, 2\)"),
        ("C", (1, 1), r"C has shape \(1, 1\); .* it needs \(1, 3\)"),
        ("K", (2, 1), r"feedback has shape \(2, 1\); .* it needs \(2, 3\)"),
        ("L", (1, 1), r"correction has shape \(1, 1\); .* it needs \(3, 1\)"),
    ],
)
def test_matrices_of_an_observer_are_not_stretched_to_fit(name: str, shape: tuple[int, int], said: str):
    made = observer(*GAINS.values())
    assert (made.A.shape, made.B.shape, made.C.shape, made.D.shape) == ((3, 3), (3, 1), (2, 3), (2, 1))
    np.testing.assert_allclose(made.A, np.eye(3) - 2 - 1)
    with pytest.raises(ValueError, match=f"matrices of an observer do not fit: {said}"):
        observer(*(GAINS | {name: np.ones(shape)}).values())
