"""[jitter]: the outputs that `femflex jitter` judges, and the frequencies over which it does."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from femflex.noun.table import Name, Table, refuse
from femflex.noun.values import Direction, Quantity

Kind = Literal["pointing", "rotation", "displacement", "velocity", "acceleration"]


class JitterOutput(Table):
    """An output: the small motion of a marker, or any channel."""

    kind: Kind | None = None
    """Motion of the marker, inertial and in its axes. pointing: turn of an axis about the two directions across it."""
    body: str | None = None
    """Body that carries the instrument."""
    marker: str = "origin"
    """Marker of the instrument."""
    axis: Direction = (1.0, 0.0, 0.0)
    """Line of sight in the marker's axes, with kind = "pointing"."""
    channel: str | None = None
    """Channel with its component instead, such as "joints/hinge/torque:y"."""
    parts: dict[str, float] = Field(default_factory=dict)
    """Sum of other outputs with factors, such as { "primary:y" = 2, "secondary:y" = -1 } (an optical model)."""
    limit: Annotated[float, Quantity("rad", above=0.0)] | None = None
    """Largest allowed value of three standard deviations, of outputs that are angles."""

    @model_validator(mode="after")
    def _one_source(self) -> JitterOutput:
        present = [key for key in ("body", "channel", "parts") if getattr(self, key)]
        if len(present) != 1:
            refuse(f"found {' and '.join(present) or 'none of body, channel and parts'}; give one of them")
        if (self.kind is not None) != (self.body is not None):
            refuse("found one of kind and body alone; they go together")
        return self


class JitterTable(Table):
    """Outputs and frequencies of `femflex jitter`."""

    outputs: Annotated[dict[Name, JitterOutput], Field(min_length=1)]
    """Outputs by name."""
    band: Annotated[tuple[float, float], Quantity("Hz", (2,), above=0.0)] | None = None
    """Lowest and highest frequency that counts. Default: a tenth of the lowest vibration to three times the highest."""
    stress: list[str] = Field(default_factory=list)
    """Bodies whose random stress is computed too, such as the root mean square of von Mises' stress."""
    loss_factor: Annotated[float, Quantity("", least=0.0, below=1.0)] = 0.0
    """Structural damping: the stiffness of flexible bodies times 1 + i loss_factor, in addition to their damping."""

    @model_validator(mode="after")
    def _band_rises(self) -> JitterTable:
        if self.band is not None and not self.band[0] < self.band[1]:
            refuse(f"found band = {list(self.band)} Hz; the second must be above the first")
        return self
