"""Numbers in readable form: units of length and time, round limits, and the clock."""

from __future__ import annotations

import math
from dataclasses import dataclass

LENGTHS = ((1.0, "m"), (1e-2, "cm"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm"))  # metres in one
ROUND = ((1.0, 5), (1.2, 4), (1.5, 5), (2.0, 4), (2.5, 5), (3.0, 6), (4.0, 4), (5.0, 5), (6.0, 6), (8.0, 4), (10.0, 5))
PREFIXES = ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
ARCSECOND = math.pi / 648000.0  # rad
RPM = 30.0 / math.pi  # revolutions per minute in one rad/s
ROUNDING = 1e-9  # strain, curvature [1/m] and energy density [J/m^k] below which nothing is shown


@dataclass(frozen=True)
class Bar:
    """A colour bar from zero to `top` with `parts` intervals, in `unit`; `factor` converts SI units to it.

    signed  from -top to top, with twice as many intervals;  title  of the bar, in lines
    """

    factor: float
    unit: str
    top: float
    parts: int
    signed: bool = False
    title: str = "elastic\ndisplacement"

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the largest number on it."""
        return (-self.top if self.signed else 0.0), self.top

    @property
    def steps(self) -> int:
        """Number of intervals on it."""
        return 2 * self.parts if self.signed else self.parts

    @property
    def form(self) -> str:
        """The format of the numbers along it."""
        step = self.top / self.parts
        return f"%.{next(d for d in range(20) if math.isclose(round(step, d), step, rel_tol=1e-9))}f"


def length_unit(largest: float) -> tuple[float, str]:
    """Factor and name of the unit in which a length [m] reads well: km from 10 km, cm only from 2 cm to 2 m.

    >>> length_unit(6.8e6), length_unit(33.0), length_unit(0.3), length_unit(0.004)
    ((0.001, 'km'), (1.0, 'm'), (100.0, 'cm'), (1000.0, 'mm'))
    """
    if largest >= 1e4:
        return 1e-3, "km"
    if largest >= 2.0:
        return 1.0, "m"
    if largest >= 2e-2:
        return 1e2, "cm"
    for metres, name in LENGTHS[2:]:
        if largest >= metres:
            return 1.0 / metres, name
    return 1e9, "nm"


def colour_bar(largest: float) -> Bar:
    """The bar from zero to a round number at or above that length [m].

    >>> bar = colour_bar(0.137)
    >>> bar.factor, bar.unit, bar.top, bar.parts
    (100.0, 'cm', 15.0, 5)
    """
    factor, unit = length_unit(largest)
    return Bar(factor, unit, *round_above(largest * factor))


def strain_bar(largest: float, unit: str, signed: bool, title: str) -> Bar:
    """The bar to a round number at or above that strain ("1"), curvature ("1/m") or energy density ("J/m", ...).

    >>> strain_bar(3.1e-4, "1", True, "axial strain")
    Bar(factor=1000000.0, unit='µε', top=400.0, parts=4, signed=True, title='axial strain')
    """
    largest = max(largest, ROUNDING)
    factor, unit_text = (1e6, "µε") if unit == "1" else (1.0, unit) if largest >= 0.05 else (1e3, "1/km")
    if unit.startswith(("J", "Pa", "N")):
        prefix_factor, prefix = next(step for step in PREFIXES if largest >= step[0])
        factor, unit_text = 1.0 / prefix_factor, prefix + unit
    top, n_parts = round_above(largest * factor)
    return Bar(factor, unit_text, top, 2 if signed and n_parts % 2 == 0 and n_parts > 4 else n_parts, signed, title)


def round_above(value: float) -> tuple[float, int]:
    """A round number at or above the value, and the parts that a scale up to it is divided into."""
    power = 10.0 ** math.floor(math.log10(value))
    top, n_parts = next((top, n_parts) for top, n_parts in ROUND if top * power >= value * (1 - 1e-9))
    return top * power, n_parts


def round_below(value: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above the value.

    >>> round_below(37.0), round_below(0.6)
    (20.0, 0.5)
    """
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))


def clock(t: float, duration: float) -> str:
    """Time of a picture as text, of one width over a run of that duration [s]; 0 for a single state.

    >>> clock(12.3456, 20.0), clock(754.2, 3000.0), clock(7384.0, 20000.0), clock(0.0, 0.0)
    ('12.35 s', '12 min 34.2 s', '2 h 03 min 04 s', '0 s')
    """
    if duration == 0:
        return f"{t:g} s"
    if duration < 600:
        decimals = max(0, 3 - math.floor(math.log10(max(duration, 1e-9)) + 1e-9))
        return f"{t:.{min(decimals, 9)}f} s"
    if duration < 7200:
        minutes, seconds = divmod(round(t, 1), 60)
        return f"{minutes:.0f} min {seconds:04.1f} s"
    minutes, seconds = divmod(round(t), 60)
    return f"{minutes // 60} h {minutes % 60:02d} min {seconds:02d} s"


def time_unit(duration: float) -> tuple[float, str]:
    """Seconds per unit, and name, of the unit for a time axis of that length [s].

    >>> time_unit(300.0), time_unit(3000.0), time_unit(20000.0)
    ((1.0, 's'), (60.0, 'min'), (3600.0, 'h'))
    """
    if duration < 1200:
        return 1.0, "s"
    if duration < 7200:
        return 60.0, "min"
    return (3600.0, "h") if duration < 4 * 86400 else (86400.0, "days")
