"""Units of a case file: strings with a unit become SI numbers, with a check of their dimension.

No other module converts units. The unit registry (pint) is loaded for the first string with a unit: only the common
units, and all of pint's units when another one occurs. Unlike in pint an angle counts as a dimension: "30 deg" is no
length ratio, and "2 Hz" no angular rate (2 cycles a second are 12.6 rad/s).
"""

from __future__ import annotations

import contextlib
import difflib
import re
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pint import UnitRegistry

# Names of the quantities of units, for messages; the keys are also the units of case keys.
NOUNS = {
    "": "plain number",
    "m": "length",
    "m^2": "area",
    "m^3": "volume",
    "m^4": "second moment of area",
    "m^6": "warping constant",
    "kg": "mass",
    "kg/m": "mass per length",
    "kg m": "static imbalance or moment of inertia per length",
    "kg/m^2": "mass per area",
    "kg/m^3": "density",
    "kg m^2": "moment of inertia",
    "s": "time",
    "1/s": "rate per second",
    "Hz": "frequency",
    "rad": "angle",
    "rad/s": "angular rate",
    "m/s": "velocity",
    "m/s^2": "acceleration",
    "m/s^3": "jerk",
    "rad/s^2": "angular acceleration",
    "rad/s^3": "angular jerk",
    "N": "force",
    "N m": "torque",
    "N m^2": "flexural rigidity",
    "N/m": "stiffness or force per length",
    "N m/rad": "rotational stiffness",
    "N s/m": "damping",
    "N m s/rad": "rotational damping",
    "N m s": "angular momentum",
    "Pa": "pressure or elastic modulus",
    "Pa/m": "pressure per depth",
    "Pa s/m": "pressure per velocity",
    "K": "temperature",
    "kg/mol": "molar mass",
    "A m^2": "magnetic moment",
    "N m s/(rad T^2)": "eddy current coefficient",
    "m^3/s^2": "gravitational parameter",
    "N s^2/rad^2": "force over squared speed",
    "N m s^2/rad^2": "torque over squared speed",
    "N^2/Hz": "spectral density of a force",
    "N^2 m^2/Hz": "spectral density of a torque",
    "m^2/s^4/Hz": "spectral density of an acceleration",
    "kg^0.5 m": "modal amplitude",
    "kg^0.5 m/s": "modal rate",
}
EXAMPLES = {"m": "33 m", "rad": "30 deg", "rad/s": "2 deg/s", "N m^2": "4275.7 N m^2", "s": "2 h", "": "0.3"}

LONGEST = 120  # characters of a number with its unit
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(.*)", re.DOTALL)
_UNIT = re.compile(r"[A-Za-zµμΩ°%²³·*/()\s\d^.-]*")
_JOINED = re.compile(r"\b([mkMµμ]?)Nm(?=s?\b)")  # of a torque, which pint takes for a measure of yarn
_EXPONENT = re.compile(r"(?:\^|\*\*)\s*\(?\s*-?\d{1,2}(?:\.\d{1,3})?(?:/\d)?\s*\)?(?!\s*(?:\^|\*\*|\d))")


class UnitError(ValueError):
    """A string with a unit cannot be read, or has another dimension than expected."""


def to_si(text: str, unit: str) -> float:
    """The number in the SI unit `unit` (a key of NOUNS) that a string such as "30 deg" stands for.

    >>> to_si("4 %", "")
    0.04

    Raises UnitError with what was found and what is expected.
    """
    value, given_unit = split_quantity(text, unit or "")
    if not given_unit and unit:
        raise UnitError(
            f"found {text!r} without a unit; give a number (in {unit}) or a string such as {example(unit)!r}"
        )
    factor, base = _scale(given_unit)
    unit_factor, expected = _scale(unit)
    if base == expected or base == tuple(pair for pair in expected if pair != ("radian", -1)):
        return value * factor / unit_factor
    raise UnitError(
        f"found {text!r}, which is {describe(base)}; expected {quantity_noun(unit)}, such as "
        f"{example(unit)!r}{_hint(base, unit)}"
    )


def to_base(text: str) -> tuple[float, str]:
    """Number and base unit ("kg", "m", "s", "rad" and their powers) of any string with a unit.

    >>> to_base("2 km")
    (2000.0, 'm')
    """
    value, given_unit = split_quantity(text)
    factor, base = _scale(given_unit)
    return value * factor, _base_text(base)


def split_quantity(text: str, unit: str = "m") -> tuple[float, str]:
    """The number and the unit's text of a string such as "33 m".

    >>> split_quantity("-1.5e3 N m^2")
    (-1500.0, 'N m^2')
    """
    if len(text) > LONGEST:
        raise UnitError(
            f"found {text[:40]!r}... of {len(text)} characters; a number with its unit has at most {LONGEST}"
        )
    match = _NUMBER.fullmatch(text)
    if match is None:
        found_text = "a number, then its unit, such as" if unit else "a number such as"
        raise UnitError(f"found {text!r}, which does not begin with a number; write {found_text} {example(unit)!r}")
    if re.match(r",\d", match[2]):
        raise UnitError(f"found {text!r} with a decimal comma; write a point, as in {text.replace(',', '.', 1)!r}")
    return float(match[1]), match[2].strip()


def example(unit: str) -> str:
    """A string a user could write for a value with that unit."""
    return EXAMPLES.get(unit, f"1 {unit}")


def quantity_noun(unit: str) -> str:
    """Quantity that a unit measures, with its article: "a length"."""
    word = NOUNS.get(unit, f"quantity in {unit}")
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}"


def describe(base: tuple[tuple[str, float], ...]) -> str:
    """Quantity that a base unit measures, or the unit itself if it has no name here."""
    for unit in NOUNS:
        if _scale(unit)[1] == base:
            return quantity_noun(unit)
    return f"a quantity in {_base_text(base)}"


# The units that cases are written in, as pint defines them: all of pint's take a third of a second to load.
COMMON_DEFINITIONS = """
nano- = 1e-9 = n-
micro- = 1e-6 = µ- = μ- = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
pi = 3.1415926535897932384626433832795028841971693993751 = π
meter = [length] = m = metre
second = [time] = s = sec
kilogram = [mass] = kg
gram = 1e-3 * kilogram = g
radian = [] = rad
degree = π / 180 * radian = deg = °
percent = 0.01 = %
minute = 60 * second = min
hour = 60 * minute = h = hr
day = 24 * hour
newton = kilogram * meter / second ** 2 = N
pascal = newton / meter ** 2 = Pa
joule = newton * meter = J
watt = joule / second = W
hertz = 1 / second = Hz
kelvin = [temperature] = K
turn = 2 * π * radian = _ = rev = revolution
revolutions_per_minute = turn / minute = rpm
"""


@cache
def _registry(complete: bool) -> UnitRegistry[Any]:
    """The registry of the common units, or of all units of pint."""
    from pint import UnitRegistry

    units: UnitRegistry[Any] = UnitRegistry() if complete else UnitRegistry(None)
    if complete:
        units.define("@alias revolution = rev")
    else:
        units.load_definitions(COMMON_DEFINITIONS.strip().splitlines())
    return units


def _unit_in_base(unit: str) -> Any:
    """A quantity of 1 in that unit, in base units.

    Raises pint.UndefinedUnitError.
    """
    import pint

    with contextlib.suppress(pint.UndefinedUnitError):
        return _registry(False).Quantity(1.0, _registry(False).parse_units(unit)).to_base_units()
    units = _registry(True)
    if units.Quantity(0.0, units.parse_units(unit)).to_base_units().magnitude:
        raise UnitError(f"unit {unit!r} counts from another zero; give an absolute temperature, such as '293.15 K'")
    return units.Quantity(1.0, units.parse_units(unit)).to_base_units()


@cache
def _scale(unit: str) -> tuple[float, tuple[tuple[str, float], ...]]:
    """Factor to base SI and the base units with their powers, sorted."""
    import pint

    stripped = _EXPONENT.sub("", unit)
    if len(unit) > 60 or not _UNIT.fullmatch(unit) or "^" in stripped or "**" in stripped:
        raise UnitError(f"unit {unit!r} cannot be read; write it like 'N m^2', 'kg/m' or 'deg/s'")
    try:
        quantity = _unit_in_base(_JOINED.sub(r"\1N m ", unit))
    except pint.UndefinedUnitError as error:
        names = error.unit_names
        name = names if isinstance(names, str) else next(iter(names))
        matches = difflib.get_close_matches(name, [*COMMON_UNITS, *LONG_NAMES], n=1, cutoff=0.6)
        hint = f"; did you mean {matches[0]!r}?" if matches else "; common units are " + ", ".join(COMMON_UNITS)
        raise UnitError(f"unit {name!r} in {unit!r} is not known{hint}") from None
    except UnitError:
        raise
    except Exception:  # pint has no common base for what its parser raises
        raise UnitError(f"unit {unit!r} cannot be read; write it like 'N m^2', 'kg/m' or 'deg/s'") from None
    items: Any = quantity.unit_items()
    return float(quantity.magnitude), tuple(sorted((str(name), float(power)) for name, power in items if power))


COMMON_UNITS = (
    *(
        "m",
        "mm",
        "cm",
        "km",
        "inch",
        "ft",
        "kg",
        "g",
        "tonne",
        "lb",
        "s",
        "min",
        "h",
        "day",
        "rad",
        "deg",
        "rev",
        "rpm",
    ),
    *("N", "kN", "kgf", "lbf", "Pa", "kPa", "MPa", "GPa", "psi", "Hz", "J", "%"),
)
LONG_NAMES = (
    "metre",
    "millimetre",
    "second",
    "minute",
    "hour",
    "kilogram",
    "gram",
    "radian",
    "degree",
    "newton",
    "pascal",
)

_SYMBOLS = {"kilogram": "kg", "meter": "m", "second": "s", "radian": "rad", "kelvin": "K", "ampere": "A"}


def _base_text(base: tuple[tuple[str, float], ...]) -> str:
    """Text of a base unit: (("kilogram", 1), ("second", -2)) -> "kg s^-2"."""
    return " ".join(_SYMBOLS.get(n, n) + ("" if p == 1 else f"^{p:g}") for n, p in base)


def _hint(base: tuple[tuple[str, float], ...], unit: str) -> str:
    if unit == "rad/s" and base == (("second", -1.0),):
        return "; cycles per second are written 'rev/s'"
    if "N" in unit and base == _scale(unit.replace("N", "kg"))[1]:
        return "; a force in kilograms is written 'kgf'"
    return ""
