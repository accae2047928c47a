"""Forces and torques at markers, constant or tabulated in time: the table [[loads]] and the object."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, field_serializer, model_validator

from femflex.arrays import Array
from femflex.noun.table import Name, Table, refuse
from femflex.noun.values import Quantity, _Readable, counted_noun
from femflex.system.load_file import read_load_file


class _SteadyOrRows(_Readable):
    """Three numbers, or one row of three per time."""

    def __init__(self, unit: str) -> None:
        self.steady, self.rows = Quantity(unit, (3,)), Quantity(unit, (None, 3))

    def read_value(self, value: Any) -> Array:
        nested = isinstance(value, list | tuple) and isinstance(next(iter(value), None), list | tuple | np.ndarray)
        return np.array((self.rows if nested else self.steady).read_value(value))

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [self.steady.json_schema(), self.rows.json_schema()], "unit": self.steady.unit}


class Load(Table):
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
    force: Annotated[Array, _SteadyOrRows("N")] = Field(default_factory=lambda: np.zeros(3))
    """Force: three components, or one row of three per time."""
    torque: Annotated[Array, _SteadyOrRows("N m")] = Field(default_factory=lambda: np.zeros(3))
    """Torque: three components, or one row of three per time."""
    times: Annotated[Array, Quantity("s", (None,))] | None = None
    """Times of the rows. Default: the load is constant. Between the times it is linear, outside of them zero; a
    repeated time is a jump."""
    table: str | None = None
    """CSV file with columns "time [s]", "fx [N]", ..., "tz [N m]", in place of times, force and torque."""

    __eq__, __hash__ = object.__eq__, object.__hash__  # by identity: its values are arrays

    @model_validator(mode="after")
    def _rows_fit(self) -> Load:
        set_keys = self.model_fields_set
        present = [key for key in ("force", "torque", "times") if key in set_keys and getattr(self, key) is not None]
        if self.table is not None:
            if present:
                refuse(f"found table and {', '.join(present)} together; the CSV file holds them all")
            return self
        if "force" not in present and "torque" not in present:
            refuse("found neither force nor torque nor table; give at least one")
        for key in ("force", "torque"):
            self._check_rows(key, key in present)
        if self.times is not None:
            vars(self)["times"] = np.array(self.times)
            if len(self.times) < 2:
                refuse(f"found times {list(self.times)}; a table needs at least two")
            for before, after in pairwise(self.times):
                if after < before:
                    refuse(f"found time {after:g} s after {before:g} s; times must not be decreasing")
        return self

    def _check_rows(self, key: str, is_present: bool) -> None:
        value = getattr(self, key)
        if self.times is None:
            if value.ndim > 1:
                rows = counted_noun(len(value), "row", "rows")
                refuse(f"found {rows} in {key} without times; give the time of every row")
        elif not is_present:
            vars(self)[key] = np.zeros((len(self.times), 3))
        elif value.ndim == 1:
            refuse(f"found times with a constant {key}; give one row of {key} per time, {len(self.times)} of them")
        elif len(value) != len(self.times):
            rows, times = counted_noun(len(value), "row", "rows"), counted_noun(len(self.times), "time", "times")
            refuse(f"found {rows} in {key} and {times}; give as many of both")

    @field_serializer("force", "torque", "times")
    def _listed(self, value: Array | None) -> Any:
        return None if value is None else value.tolist()

    def __repr_args__(self) -> Any:
        """Its values with all digits, by which bodies are known that were built for it."""
        return self.model_dump().items()

    def read_from(self, folder: Path = Path()) -> Load:
        """The load with the rows of its CSV file in that folder; itself without one. Raises ValueError, OSError."""
        if self.table is None:
            return self
        times, force, torque = read_load_file(folder / self.table)
        return self.model_copy(update={"times": times, "force": force, "torque": torque, "table": None})

    def steady(self, force: ArrayLike = 0.0, torque: ArrayLike = 0.0) -> Load:
        """The load with these constant components instead of its own, or with none."""
        values = {"force": force, "torque": torque}
        steady = {key: np.broadcast_to(np.asarray(value, float), 3) for key, value in values.items()}
        return self.model_copy(update={**steady, "times": None})

    @property
    def conservative(self) -> bool:
        """Whether it is a force alone, constant in inertial axes, such as a weight."""
        return self.times is None and self.frame == "inertial" and not self.torque.any()
