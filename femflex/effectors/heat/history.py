"""Temperatures of a group over time from a file, such as those of a thermal analysis, and the strain that they induce.

The temperatures are the same over the whole group, and linear between the times of the file.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import model_validator

from femflex.arrays import Array
from femflex.effectors.heat.strained import ThermalStrain, moment_channels, moment_stiffness, strain_channels
from femflex.effectors.signal import step_of
from femflex.noun.table import refuse
from femflex.noun.values import Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.columns import column_of
from femflex.system.effector import Effector

COLUMNS = ("temperature", "across_y", "across_z", "difference")
OF_LINES, OF_SURFACES = ("across_y", "across_z"), ("difference",)


class TemperatureHistory(ThermalStrain, heading="thermal"):
    """Temperatures of a group over time, from a CSV file, and the strain that they induce.

    Channels: temperature, and thermal moments; of surfaces per width.
    """

    kind: Literal["history"]
    """Selects temperatures from a file."""
    file: str
    """CSV file with a head such as "time [s],temperature [K]". Before its first time and after its last one the
    temperatures stay."""
    temperature: str = "temperature"
    """Column of the mean temperature."""
    across_y: str | None = None
    """Column of the amplitude of temperature across a tube, along y of its patches. Default: zero."""
    across_z: str | None = None
    """The same along z. Default: zero."""
    diameter: Annotated[float, Quantity("m", above=0.0)] | None = None
    """Diameter of tubes, with across_y or across_z."""
    difference: str | None = None
    """Column of the temperature of the front less that of the back of a plate. Default: zero."""
    thickness: Annotated[float, Quantity("m", above=0.0)] | None = None
    """Thickness of the plate, with `difference`."""

    label = "thermal"
    derived = ("count", "patches", "components", "expansion_", "scale", "table")

    @model_validator(mode="after")
    def _keys_fit(self) -> TemperatureHistory:
        self.check_material()
        across = self.across_y or self.across_z
        if bool(across) != (self.diameter is not None):
            refuse("a temperature across tubes goes with their diameter; give across_y or across_z, and diameter")
        if (self.difference is None) != (self.thickness is None):
            refuse("a difference between the sides goes with the thickness of the plate; give both")
        return self

    def needed_properties(self) -> tuple[str, ...]:
        """The expansion."""
        return ("expansion",)

    def files(self) -> tuple[tuple[str, str], ...]:
        """Its file."""
        return (("file", self.file),)

    def numbers(self) -> dict[str, ArrayLike]:
        """Its fields; the others follow from the body and the file."""
        return super().numbers() | dict.fromkeys(self.derived, 0.0)

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError for a file or a group that does not fit."""
        patches, induced = self.induced(context)
        tube = patches.dimension == 1
        for key in OF_SURFACES if tube else OF_LINES:
            if getattr(self, key) is not None:
                what = "lines" if tube else "surfaces"
                raise ValueError(f"group {self.group or 'all'!r} of body {self.body!r} consists of {what}; drop {key}")
        keys = ("temperature", *(OF_LINES if tube else OF_SURFACES))
        times, columns = self._columns(context, keys)
        k, scale = len(patches.size), self.diameter / 2 if self.diameter else self.thickness or 1.0
        values = self.numbers() | {
            "count": len(times), "patches": k, "components": len(keys), "scale": scale,
            "expansion_": self.property_value("expansion"),
        }  # fmt: skip
        head = np.concatenate([np.ravel(np.asarray(values[key], float)) for key in self.number_sizes()])[:-1]
        return Effector(
            name,
            self.act,
            channels=strain_channels(induced) | {"temperature": "K"} | moment_channels(induced),
            accounts=self.accounts,
            exerts=self.exerts,
            strained=(self.body, self.group or "all"),
            n_strains=k * len(keys),
            parameters=np.concatenate([head, times, *columns, moment_stiffness(induced).ravel()]),
            breaks=np.unique(times),
            kind=self.label,
        )

    def _columns(self, context: Context, keys: tuple[str, ...]) -> tuple[Array, list[Array]]:
        times, columns = np.zeros(0), []
        for key in keys:
            column = getattr(self, key)
            if column is not None:
                first, values = column_of(context.folder / self.file, column, "K")
                times = np.array(first)
            columns.append(np.zeros(len(times)) if column is None else np.array(values))
        if len(times) < 2 or np.any(np.diff(times) <= 0.0):
            raise ValueError(f"the times of {self.file} must rise, and be at least two; found {len(times)}")
        if not np.all(columns[0] > 0.0):
            raise ValueError(f"{self.file} has {columns[0].min():g} K for {self.temperature}; it must be positive")
        return times, columns


P, _, _ = TemperatureHistory.places()


@TemperatureHistory.kernel
def temperature_history(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Strain of every component, the same in all patches, and its rate."""
    p = parameters
    n, m, c = int(p[P.count]), int(p[P.patches]), int(p[P.components])
    step = step_of(t, p, P.table, n)
    between = 0 <= step < n - 1
    first = P.table + n + max(step, 0)
    share, span = 0.0, 1.0
    if between:
        span = p[P.table + step + 1] - p[P.table + step]
        share = (t - p[P.table + step]) / span
    stiffness = P.table + n * (c + 1)
    for i in range(c):
        value, rate = p[first + n * i], 0.0
        if between:
            rise = p[first + n * i + 1] - value
            value, rate = value + share * rise, rise / span
        if i == 0:
            out[2 * m * c] = value
            value -= p[P.reference_temperature]
        factor = p[P.expansion_] * (1.0 if i == 0 else 1.0 / p[P.scale])
        for k in range(m):
            out[c * k + i], out[c * (m + k) + i] = factor * value, factor * rate
            if i > 0:
                place = (c - 1) * k + i - 1
                out[2 * m * c + 1 + place] = factor * value * p[stiffness + place]
