"""[[loads]]: forces and torques at markers, constant or tabulated."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import model_validator

from femflex.noun.table import Name, Table, refuse
from femflex.noun.values import Quantity, Vector, _Readable, counted_noun


class _SteadyOrTable(_Readable):
    """Three numbers, or one row of three per time."""

    def __init__(self, unit: str) -> None:
        self.steady, self.rows = Quantity(unit, (3,)), Quantity(unit, (None, 3))

    def read_value(self, value: object) -> object:
        nested = isinstance(value, list) and value and isinstance(value[0], list)
        return (self.rows if nested else self.steady).read_value(value)

    def json_schema(self) -> dict[str, object]:
        return {"anyOf": [self.steady.json_schema(), self.rows.json_schema()], "unit": self.steady.unit}


Rows = tuple[Vector, ...]


class LoadTable(Table):
    """A force and a torque at a marker of a body.

    Constant when `times` and `table` are left out; else linear between the times, zero before the first and after the
    last. A repeated time is a jump.
    """

    name: Name
    """Name in channels and messages."""
    body: str
    """Body on which the load acts."""
    marker: str = "origin"
    """Marker at which it acts."""
    frame: Literal["body", "marker", "inertial", "orbital"] = "body"
    """Axes of the components: those of the body, of the marker (turned by deformation), inertial or orbital axes."""
    force: Annotated[Vector | Rows | None, _SteadyOrTable("N")] = None
    """Force: three components, or one row of three per time."""
    torque: Annotated[Vector | Rows | None, _SteadyOrTable("N m")] = None
    """Torque: three components, or one row of three per time."""
    times: Annotated[tuple[float, ...] | None, Quantity("s", (None,))] = None
    """Times of the rows. Default: the load is constant. Between the times it is linear, outside of them zero; a
    repeated time is a jump."""
    table: str | None = None
    """CSV file with columns "time [s]", "fx [N]", ..., "tz [N m]", in place of times, force and torque."""

    @model_validator(mode="after")
    def _rows_fit(self) -> LoadTable:
        present = [key for key in ("force", "torque", "times") if getattr(self, key) is not None]
        if self.table is not None:
            if present:
                refuse(f"found table and {', '.join(present)} together; the CSV file holds them all")
            return self
        if "force" not in present and "torque" not in present:
            refuse("found neither force nor torque nor table; give at least one")
        for key in ("force", "torque"):
            self._check_rows(key)
        if self.times is not None:
            if len(self.times) < 2:
                refuse(f"found times {list(self.times)}; a table needs at least two")
            falls = [k for k, (a, b) in enumerate(pairwise(self.times)) if b < a]
            if falls:
                k = falls[0]
                refuse(f"found time {self.times[k + 1]:g} s after {self.times[k]:g} s; times must not decrease")
        return self

    def _check_rows(self, key: str) -> None:
        value = getattr(self, key)
        if value is None:
            return
        rows = isinstance(value[0], tuple)
        if rows and self.times is None:
            refuse(
                f"found {counted_noun(len(value), 'row', 'rows')} in {key} without times; give the time of every row"
            )
        if not rows and self.times is not None:
            refuse(f"found times with a constant {key}; give one row of {key} per time, {len(self.times)} of them")
        if rows and self.times is not None and len(value) != len(self.times):
            rows_found, times = counted_noun(len(value), "row", "rows"), counted_noun(len(self.times), "time", "times")
            refuse(f"found {rows_found} in {key} and {times}; give as many of both")
