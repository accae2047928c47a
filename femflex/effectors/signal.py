"""Signals: numbers over time that effectors and controllers take as inputs."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.effectors.noun import EffectorNoun
from femflex.kernels.compiled import inner
from femflex.noun.table import refuse
from femflex.noun.units import UnitError, to_si
from femflex.noun.values import Plain, Quantity, counted_noun
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector

Kind = Literal["steps", "linear", "smooth"]


class Signal(EffectorNoun, heading="signals"):
    """A number over time that effectors and controllers take as an input, as "<name>.value".

    Channels: value and rate.
    """

    times: Annotated[tuple[float, ...], Quantity("s", (None,))]
    """Times, rising. Before the first and after the last the value stays."""
    values: tuple[Plain, ...]
    """Value at each time, in SI units; or texts with a unit, such as "30 deg", where `unit` is given."""
    kind: Kind = "linear"
    """Between two times: stays, is linear, or goes from rest to rest as a polynomial of degree 5."""
    unit: str = "1"
    """SI unit of the value, such as "rad"; the result file states it."""

    n_markers = 0
    gives_signals = True
    channels = {"value": "1", "rate": "1/s"}
    derived = ("steps", "linear", "count", "table")

    @model_validator(mode="before")
    @classmethod
    def _values_in_unit(cls, data: Any) -> Any:
        """The table with its texts as numbers in `unit`."""
        if not isinstance(data, dict) or not isinstance(data.get("values"), list | tuple):
            return data
        unit = data.get("unit", "")
        try:
            values = [to_si(v, str(unit)) if isinstance(v, str) else v for v in data["values"]]
        except UnitError as problem:
            refuse(f"values: {problem}" + ("" if unit else "; or give `unit`, such as 'rad' for angles"))
        return data | {"values": values}

    @model_validator(mode="after")
    def _times_and_values_match(self) -> Signal:
        if len(self.times) != len(self.values):
            times, values = (
                counted_noun(len(self.times), "time", "times"),
                counted_noun(len(self.values), "value", "values"),
            )
            refuse(f"found {times} and {values}; give as many of both")
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            refuse(f"found times {list(self.times)}; they must rise")
        return self

    def signals(self, name: str, context: Context, path: tuple[str, ...] = ()) -> list[str]:
        """Its value."""
        return ["value"]

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name."""
        head = [float(self.kind == "steps"), float(self.kind == "linear"), float(len(self.times))]
        return Effector(
            name,
            self.act,
            channels={"value": self.unit, "rate": f"{self.unit}/s" if self.unit != "1" else "1/s"},
            parameters=np.array([*head, *self.times, *self.values]),
            breaks=np.array(self.times),
            kind=self.label,
            silent=partial(constant_signal, name, 0.0),
        )


def constant_signal(name: str, value: float) -> Effector:
    """A signal that stays at a value."""
    return Signal(times=(0.0,), values=(value,)).effector(name)


P, _, OUT = Signal.places()


@inner
def step_of(t: float, p: Array, first: int, n: int) -> int:
    """Number of the last of n rising times p[first + k] that is not after t, -1 before the first."""
    low, high = -1, n
    while high - low > 1:
        middle = (low + high) // 2
        if p[first + middle] <= t:
            low = middle
        else:
            high = middle
    return low


@Signal.kernel
def signal(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Before the first time and after the last the value stays.

    Smooth pieces are s^3 (10 - 15 s + 6 s^2): rate and acceleration vanish at both ends.
    """
    p, table = parameters, P.table
    n = int(p[P.count])
    k = step_of(t, p, table, n)
    value, rate = p[table + n + max(k, 0)], 0.0
    if 0 <= k < n - 1 and p[P.steps] == 0.0:
        span, rise = p[table + k + 1] - p[table + k], p[table + n + k + 1] - p[table + n + k]
        s = (t - p[table + k]) / span
        if p[P.linear] > 0.0:
            value, rate = value + rise * s, rise / span
        else:
            value += rise * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
            rate = rise / span * 30.0 * s * s * (1.0 - s) * (1.0 - s)
    out[OUT.value], out[OUT.rate] = value, rate
