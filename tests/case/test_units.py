"""Strings with units become SI numbers."""

from __future__ import annotations

import math

import pint
import pytest

from femflex.noun.units import COMMON_UNITS, LONG_NAMES, NOUNS, UnitError, example, to_base, to_si

COMPLETE: pint.UnitRegistry = pint.UnitRegistry()
COMPLETE.define("@alias revolution = rev")


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [
        ("33 m", "m", 33.0),
        ("331 km", "m", 331e3),
        ("-1.5e2 mm", "m", -0.15),
        ("30 deg", "rad", math.pi / 6),
        ("30°", "rad", math.pi / 6),
        ("2 deg/s", "rad/s", math.radians(2)),
        ("1 rev/s", "rad/s", 2 * math.pi),
        ("30 rpm", "rad/s", math.pi),
        ("436 kgf m^2", "N m^2", 436 * 9.80665),
        ("4275.7 N m^2", "N m^2", 4275.7),
        ("1 N*m**2", "N m^2", 1.0),
        ("1 J", "N m", 1.0),
        ("0.4 Nm", "N m", 0.4),
        ("3 mNm", "N m", 3e-3),
        ("2 kNm/deg", "N m/rad", 2e3 * 180 / math.pi),
        ("20 Nms", "N m s", 20.0),
        ("70 GPa", "Pa", 70e9),
        ("2.7 g/cm^3", "kg/m^3", 2700.0),
        ("5 N m", "N m/rad", 5.0),
        ("1 N m/deg", "N m/rad", 180 / math.pi),
        ("0.5 %", "", 0.005),
        ("0.3", "", 0.3),
        ("2 h", "s", 7200.0),
        ("1 ft", "m", 0.3048),
        ("3 km/h", "m/s", 3 / 3.6),
        ("3 kg^(1/2) m", "kg^0.5 m", 3.0),
    ],
)
def test_a_string_with_a_unit_becomes_the_si_number(text: str, unit: str, number: float):
    assert to_si(text, unit) == pytest.approx(number, rel=1e-14)


@pytest.mark.parametrize(
    "text", ["9 m^9^9^9^9", "1 m**9**9", "1 m^999999999", "2 " + "m" * 100, "3 m; import os", "3 m @ s", "3 m +"]
)
def test_a_unit_is_never_more_than_a_unit(text: str):
    with pytest.raises(UnitError, match="cannot be read"):
        to_si(text, "m")


@pytest.mark.parametrize("unit", [unit for unit in NOUNS if unit])
def test_every_unit_of_the_schema_is_its_own_example(unit: str):
    assert math.isfinite(to_si(example(unit), unit))
    assert to_si(f"1 {unit}", unit) == 1.0


@pytest.mark.parametrize("unit", [*COMMON_UNITS, *LONG_NAMES, "mN", "µrad", "kW", "GJ", "mHz", "slug", "arcsec"])
def test_units_have_the_size_of_the_complete_registry(unit: str) -> None:
    expected = COMPLETE.Quantity(1.0, COMPLETE.parse_units(unit)).to_base_units().magnitude
    assert to_base(f"1 {unit}")[0] == pytest.approx(expected, rel=1e-15)
