"""Disturbance of a reaction wheel: harmonics of its speed, with amplitudes that grow with its square.

    F_i = C_i Om^2 at the frequency h_i Om

Imbalance is the harmonic 1: U_s Om^2 turns with the rotor, and so does U_d Om^2. Radial harmonics of tests, whose x and
y have unknown phases, are two independent lines (R. A. Masterson, D. W. Miller, R. L. Grogan, Development and
validation of reaction wheel disturbance models: empirical model, J. Sound Vib. 249, 2002).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array, ComplexArray
from femflex.disturbances.disturbance import Line, MarkerDisturbance, perpendicular, range_of
from femflex.noun.problems import suggestion_text
from femflex.noun.table import refuse
from femflex.noun.units import UnitError, to_si
from femflex.noun.values import Direction, Quantity, ValueProblem, _Readable, counted_noun
from femflex.system.columns import HEAD, csv_rows, finite

FORCE, TORQUE = "kg m", "kg m^2"
PER_SPEED = {FORCE: "N s^2/rad^2", TORQUE: "N m s^2/rad^2"}
COLUMNS = {
    "harmonic": "",
    "radial_force": FORCE,
    "axial_force": FORCE,
    "radial_torque": TORQUE,
    "axial_torque": TORQUE,
}
TURN = 2.0 * math.pi


class Coefficients(_Readable):
    """Amplitudes per squared speed, in kg m (N s^2/rad^2) or kg m^2; texts may also be in N/rpm^2 or N m/rpm^2."""

    def __init__(self, unit: str) -> None:
        self.unit, self.plain = unit, Quantity(unit, (None,), least=0.0)

    def read_value(self, value: Any) -> tuple[float, ...]:
        """The coefficients in SI."""
        if isinstance(value, list | tuple):
            value = [per_speed(entry, self.unit) if isinstance(entry, str) else entry for entry in value]
        coefficients: tuple[float, ...] = self.plain.read_value(value)
        return coefficients

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the list."""
        return self.plain.json_schema()


def per_speed(text: str, unit: str) -> float:
    """A coefficient in SI of a text in kg m or N/rpm^2 (kg m^2 or N m/rpm^2). Raises UnitError.

    >>> round(per_speed("1 N/rpm^2", "kg m"), 3), per_speed("1 g cm", "kg m")
    (91.189, 1e-05)
    """
    try:
        return to_si(text, PER_SPEED[unit])
    except UnitError:
        return to_si(text, unit)


class WheelDisturbance(MarkerDisturbance):
    """A reaction wheel by its imbalance and its harmonics, at a speed or over a range of speeds."""

    kind: Literal["wheel"] = "wheel"
    """Selects this disturbance: a reaction wheel."""
    wheel: str | None = None
    """Wheel of [wheels] whose momentum follows the speed, so that modes split gyroscopically."""
    axis: Direction = (0.0, 0.0, 1.0)
    """Spin axis, in the marker's axes."""
    inertia: Annotated[float, Quantity("kg m^2", least=0.0)] = 0.0
    """Axial inertia of the rotor where the case has no such wheel: its momentum splits modes. Default: no momentum."""
    speed: Annotated[float, Quantity("rad/s", above=0.0)] | None = None
    """Speed of the wheel."""
    speeds: Annotated[tuple[float, float], Quantity("rad/s", (2,), above=0.0)] | None = None
    """Lowest and highest speed, instead of one speed."""
    static_imbalance: Annotated[float, Quantity("kg m", least=0.0)] = 0.0
    """Static imbalance U_s: a force U_s Om^2 that turns with the rotor."""
    dynamic_imbalance: Annotated[float, Quantity("kg m^2", least=0.0)] = 0.0
    """Dynamic imbalance U_d: a torque U_d Om^2 that turns with the rotor."""
    harmonics: Annotated[tuple[float, ...], Quantity("", (None,), above=0.0)] = ()
    """Frequencies of the harmonics over the speed."""
    radial_force: Annotated[tuple[float, ...], Coefficients(FORCE)] = ()
    """Force across the axis of each harmonic over the squared speed, in each of two directions; also "1e-8 N/rpm^2"."""
    axial_force: Annotated[tuple[float, ...], Coefficients(FORCE)] = ()
    """Force along the axis of each harmonic over the squared speed."""
    radial_torque: Annotated[tuple[float, ...], Coefficients(TORQUE)] = ()
    """Torque across the axis of each harmonic over the squared speed, in each of two directions."""
    axial_torque: Annotated[tuple[float, ...], Coefficients(TORQUE)] = ()
    """Torque along the axis of each harmonic over the squared speed."""
    table: str | None = None
    """CSV file with the columns "harmonic", "radial_force [N/rpm^2]", "axial_force [...]", "radial_torque [...]" and
    "axial_torque [...]", in place of the lists."""

    @model_validator(mode="after")
    def _rows_fit(self) -> WheelDisturbance:
        range_of(self.speed, self.speeds, ("speed", "speeds"))
        columns = {key: len(getattr(self, key)) for key in COLUMNS if key != "harmonic" and getattr(self, key)}
        if self.table is not None and (columns or self.harmonics):
            refuse("found table and lists of harmonics together; the CSV file holds them all")
        for key, count in columns.items():
            if count != len(self.harmonics):
                counted = counted_noun(count, "entry", "entries")
                refuse(f"found {counted} in {key} and {len(self.harmonics)} harmonics; give as many")
        if not (columns or self.table or self.static_imbalance or self.dynamic_imbalance):
            refuse("found no imbalance, no harmonics and no table; give at least one")
        return self

    def read_from(self, folder: Path) -> Self:
        """The disturbance with the rows of its CSV file in that folder. Raises ValueError, OSError."""
        if self.table is None:
            return self
        columns = read_harmonics(folder / self.table)
        lists = {"harmonics" if key == "harmonic" else key: tuple(values) for key, values in columns.items()}
        return self.model_copy(update={**lists, "table": None})

    @property
    def rates(self) -> tuple[float, float] | None:
        """Range of speeds [rad/s]."""
        return self.speeds

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz] of the harmonics over the range of speeds."""
        orders = [*self.harmonics, *[1.0] * bool(self.static_imbalance or self.dynamic_imbalance)]
        low, high = self.speeds or (self.speed or 0.0,) * 2
        return min(orders) * low * 0.999 / TURN, max(orders) * high * 1.001 / TURN

    def lines(self, rate: float | None, highest: float) -> list[Line]:
        """The lines at a speed [rad/s], by default its own: imbalance, then the harmonics, up to a frequency [Hz]."""
        rate = rate or self.speed or 0.0
        first, second = perpendicular(np.array(self.axis))
        axis, none = np.array(self.axis) / np.linalg.norm(self.axis), np.zeros(3)
        turning, square = first - 1j * second, rate**2
        out = []

        def add(order: float, force: Array | ComplexArray, torque: Array | ComplexArray) -> None:
            amplitude = np.asarray(square * np.concatenate([force, torque]), complex)
            if amplitude.any() and order * rate / TURN <= highest:
                out.append(Line(order, order * rate / TURN, amplitude))

        add(1.0, self.static_imbalance * turning, none)
        add(1.0, none, self.dynamic_imbalance * turning)
        empty = (0.0,) * len(self.harmonics)
        for k, order in enumerate(self.harmonics):
            C = {key: (getattr(self, key) or empty)[k] for key in COLUMNS if key != "harmonic"}
            for direction in (first, second):
                add(order, C["radial_force"] * direction, none)
                add(order, none, C["radial_torque"] * direction)
            add(order, C["axial_force"] * axis, none)
            add(order, none, C["axial_torque"] * axis)
        return out


def read_harmonics(path: Path) -> dict[str, Array]:
    """Columns (n,) in SI of a table of harmonics, with a head such as "harmonic,radial_force [N/rpm^2]".

    Raises ValueError with the line and column of what cannot be read.
    """
    if not path.is_file():
        raise ValueError(f"found file {path.name!r}, which does not exist; names are relative to the case file")
    rows = csv_rows(path)
    heads = [HEAD.fullmatch(cell) for cell in (rows[0][1] if rows else [])]
    names, factors = [], []
    for cell, head in zip(rows[0][1] if rows else [], heads, strict=True):
        name = head[1].lower() if head else cell.strip()
        if name not in COLUMNS or head is None:
            raise ValueError(f"column {cell.strip()!r} of {path.name} is not known; {suggestion_text(name, COLUMNS)}")
        try:
            unit = COLUMNS[name]
            factors.append(per_speed(f"1 {head[2] or unit}", unit) if unit else 1.0)
        except (UnitError, ValueProblem) as error:
            raise ValueError(f"column {name!r} of {path.name}: {error}") from None
        names.append(name)
    if "harmonic" not in names or len(names) < 2 or len(rows) < 2:
        raise ValueError(f"{path.name} needs a column harmonic, a column of amplitudes, and at least one row")
    out = {}
    for j, (name, factor) in enumerate(zip(names, factors, strict=True)):
        values = []
        for line, row in rows[1:]:
            if len(row) != len(names):
                raise ValueError(f"line {line} of {path.name} has {len(row)} entries; its head names {len(names)}")
            values.append(factor * finite(row[j], name, line, path.name))
        out[name] = np.array(values)
    if not (out["harmonic"] > 0.0).all():
        raise ValueError(f"{path.name} has a harmonic of {out['harmonic'].min():g}; harmonics are above 0")
    return out
