"""[initial], and the elastic state of a body at the start."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from femflex.noun.table import Table, exactly_one, refuse
from femflex.noun.values import Direction, Position, PositiveLength, Quantity, Whole


class InitialTable(Table):
    """Elastic state at t = 0: modal amplitudes, or the displacement of a marker."""

    amplitudes: Annotated[tuple[float, ...] | None, Quantity("kg^0.5 m", (None,))] = None
    """Amplitudes of the first elastic coordinates; the others are zero."""
    rates: Annotated[tuple[float, ...] | None, Quantity("kg^0.5 m/s", (None,))] = None
    """Rates of the first elastic coordinates; the others are zero."""
    marker: str | None = None
    """Marker whose displacement is given."""
    displacement: Position | None = None
    """Displacement of the marker along its undeformed axes; the body is at rest."""
    relative: Annotated[Direction, Quantity("", (3,))] | None = None
    """Displacement as a fraction of `length`, in place of `displacement`."""
    length: PositiveLength | None = None
    """Length that `relative` refers to. Default: the distance from the body's joint to the marker."""
    shape: Literal["modes", "static"] = "modes"
    """Shape of the rest of the body: "modes" of the list below, or "static" as under a force at the marker."""
    modes: Annotated[list[Whole] | None, Field(min_length=1)] = None
    """Numbers (from 1) of the modes used. Default: the lowest ones that can reach the displacement."""

    @model_validator(mode="after")
    def _one_definition(self) -> InitialTable:
        exactly_one(self, ("amplitudes", "displacement", "relative"), required=self.rates is None)
        displaced = self.displacement is not None or self.relative is not None
        if displaced != (self.marker is not None):
            refuse("found a displacement without marker, or a marker without displacement; they belong together")
        if self.modes is not None and (self.shape == "static" or not displaced):
            refuse("found modes, which go with a displacement in shape = 'modes' only")
        if self.length is not None and self.relative is None:
            refuse(
                "found `length` without `relative`; length is the reference of a relative displacement, so give both"
            )
        return self


EQUILIBRIUM, SETTLED = "equilibrium", "settled"
COMPUTED = (EQUILIBRIUM, SETTLED)  # what `from` may say in place of a file


class StartTable(Table):
    """Initial state of the whole craft, in place of the values of joints, bodies and [attitude]."""

    source: str | None = Field(None, alias="from")
    """Initial state of the whole craft: "equilibrium", "settled" or a result file. "equilibrium" is the equilibrium
    nearest to the case's initial state, at the case's rates. "settled" is for a craft that has none, as in surroundings
    that change along its orbit: joints start as the case says, and bodies and springs are bent as the first instant
    would bend them for ever, by heat, gravity and the craft's motion. A result file of the same craft (of `femflex
    equilibrium` or `femflex run`) gives its last row."""
    keep: Annotated[list[str] | None, Field(min_length=1)] = None
    """Joints, or single coordinates such as "drive.angle", whose initial values and rates are exact where loops close.
    The others move to the nearest values that close the loops."""

    @model_validator(mode="after")
    def _has_a_key(self) -> StartTable:
        if self.source is None and self.keep is None:
            refuse(
                "found neither `from` nor `keep`; give `from`, the state at which the craft starts, or `keep`, the "
                "joints whose initial values are exact"
            )
        if self.source not in (None, *COMPUTED) and self.keep is not None:
            refuse(
                f"found `keep` together with from = {self.source!r}, whose last row closes every loop already; remove "
                "`keep`"
            )
        return self
