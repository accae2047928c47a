"""The general joint: any slides, then any turns."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from femflex.noun.table import refuse
from femflex.noun.values import Axis, Quantity, counted_noun
from femflex.system.joints.motions import GeneralMotion
from femflex.system.joints.noun import Axes, JointNoun

SLIDE_KEYS = ("position", "velocity", "slide_stiffness", "slide_damping", "slide_rest")
TURN_KEYS = ("angles", "rates", "stiffness", "damping", "rest")
Many = tuple[float, ...]
Lengths = Annotated[Many, Quantity("m", (None,))]
Speeds = Annotated[Many, Quantity("m/s", (None,))]
AngleList = Annotated[Many, Quantity("rad", (None,))]
RateList = Annotated[Many, Quantity("rad/s", (None,))]
SpringList = Annotated[Many, Quantity("N/m", (None,), least=0.0)]
DamperList = Annotated[Many, Quantity("N s/m", (None,), least=0.0)]
TurnSpringList = Annotated[Many, Quantity("N m/rad", (None,), least=0.0)]
TurnDamperList = Annotated[Many, Quantity("N m s/rad", (None,), least=0.0)]


class General(JointNoun):
    """Up to three slides along axes of the parent's marker, then up to three successive turns, each with its own."""

    kind: Literal["general"]
    """Selects this joint: slides, then turns, along axes of your choice."""
    slides: Annotated[list[Axis], Field(max_length=3)] = Field(default_factory=list)
    """Axes of the slides, at most three, in the axes of the parent's marker."""
    turns: Annotated[list[Axis], Field(max_length=3)] = Field(default_factory=list)
    """Axes of the turns, at most three; each is turned by those before it."""
    position: Lengths = ()
    """Initial value of each slide. Default: zero."""
    velocity: Speeds = ()
    """Initial rate of each slide. Default: zero."""
    slide_stiffness: SpringList = ()
    """Spring on each slide. Default: none."""
    slide_damping: DamperList = ()
    """Damping coefficient of each slide. Default: none."""
    slide_rest: Lengths = ()
    """Value of each slide without spring force. Default: zero."""
    angles: AngleList = ()
    """Initial value of each turn. Default: zero."""
    rates: RateList = ()
    """Initial rate of each turn. Default: zero."""
    stiffness: TurnSpringList = ()
    """Rotational spring on each turn. Default: none."""
    damping: TurnDamperList = ()
    """Rotational damping coefficient of each turn. Default: none."""
    rest: AngleList = ()
    """Angle of each turn without spring torque. Default: zero."""
    motion: GeneralMotion = GeneralMotion()
    """Locked or prescribed translations and rotations."""

    @property
    def slide_axes(self) -> Axes:
        """Axes of its slides, in the axes of the parent's marker."""
        return tuple(self.slides)

    @property
    def turn_axes(self) -> Axes:
        """Axes of its turns, each turned by those before it."""
        return tuple(self.turns)

    @model_validator(mode="after")
    def _as_many_as_axes(self) -> General:
        for axes, keys in (("slides", SLIDE_KEYS), ("turns", TURN_KEYS)):
            n_axes = len(getattr(self, axes))
            for key in keys:
                if len(getattr(self, key)) not in (0, n_axes):
                    values_text = counted_noun(len(getattr(self, key)), "value", "values")
                    refuse(
                        f"found {values_text} in {key} and {counted_noun(n_axes, axes[:-1], axes)}; give as "
                        "many of both"
                    )
            n_motions = len(self.motions(keys[0]))
            if n_motions not in (0, n_axes):
                motions = f"{counted_noun(n_motions, 'motion', 'motions')} in motion.{keys[0]}"
                refuse(f"found {motions} and {counted_noun(n_axes, axes[:-1], axes)}; give as many of both")
        return self
