"""[[joints]]: how a body hangs from another, or from the base frame."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, model_validator

from femflex.case.base import Table, refuse
from femflex.case.rotation import RotationSet, Sequence_
from femflex.case.values import (
    Angle,
    Angles,
    Direction,
    Length,
    Position,
    Quantity,
    Rate,
    Rates,
    ValueProblem,
    Velocity,
    _Readable,
)


class _OneOrThree(_Readable):
    """A number for all three axes, or three numbers."""

    def __init__(self, unit: str) -> None:
        self.one, self.three = Quantity(unit, least=0.0), Quantity(unit, (3,), least=0.0)

    def read(self, value: Any) -> Any:
        if isinstance(value, list):
            return self.three.read(value)
        return (self.one.read(value),) * 3

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [self.one.json_schema(), self.three.json_schema()], "unit": self.one.unit}


class _Axis(_Readable):
    """A direction: three numbers not all zero, or "x", "-y" and so on."""

    def read(self, value: Any) -> tuple[float, float, float]:
        if isinstance(value, str):
            if value.lstrip("-") not in ("x", "y", "z") or value.count("-") > 1:
                raise ValueProblem(f"found {value!r}; an axis is three numbers, or one of x, y, z, -x, -y, -z")
            sign = -1.0 if value[0] == "-" else 1.0
            return tuple(sign * (letter == value[-1]) for letter in "xyz")  # type: ignore[return-value]
        found = Quantity("", (3,)).read(value)
        if not any(found):
            raise ValueProblem(f"found {list(found)}; an axis needs a direction, such as [0, 0, 1] or 'z'")
        return found

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [Quantity("", (3,)).json_schema(), {"enum": ["x", "y", "z", "-x", "-y", "-z"]}]}


Axis = Annotated[Direction, _Axis()]
Spring = Annotated[float, Quantity("N/m", least=0.0)]
Damper = Annotated[float, Quantity("N s/m", least=0.0)]
TurnSpring = Annotated[float, Quantity("N m/rad", least=0.0)]
TurnDamper = Annotated[float, Quantity("N m s/rad", least=0.0)]
Springs = Annotated[tuple[float, float, float], _OneOrThree("N/m")]
Dampers = Annotated[tuple[float, float, float], _OneOrThree("N s/m")]
TurnSprings = Annotated[tuple[float, float, float], _OneOrThree("N m/rad")]
TurnDampers = Annotated[tuple[float, float, float], _OneOrThree("N m s/rad")]
ZERO = (0.0, 0.0, 0.0)
SLIDE_KEYS = ("position", "velocity", "slide_stiffness", "slide_damping", "slide_rest")
TURN_KEYS = ("angles", "rates", "stiffness", "damping", "rest")


class JointTable(Table):
    """What every joint says: it leads from a marker of the parent to a marker of the child."""

    kind: str
    child: str
    parent: str | None = None
    """The body it hangs from; none: the base frame of [attitude]."""
    child_marker: str = "origin"
    parent_marker: str = "origin"
    name: str = ""
    """Left out: "parent-child"."""

    @model_validator(mode="after")
    def _base_has_one_marker(self) -> JointTable:
        if self.parent is None and self.parent_marker != "origin":
            refuse(f"found parent_marker {self.parent_marker!r} without a parent; the base frame has only its origin")
        return self


class Weld(JointTable):
    """No freedom."""

    kind: Literal["weld"]


class Revolute(JointTable):
    """One turn about an axis of the parent's marker."""

    kind: Literal["revolute"]
    axis: Axis = (0.0, 0.0, 1.0)
    angle: Angle = 0.0
    """At t = 0."""
    rate: Rate = 0.0
    stiffness: TurnSpring = 0.0
    damping: TurnDamper = 0.0
    rest: Angle = 0.0
    """Angle at which the spring is free."""


class Prismatic(JointTable):
    """One slide along an axis of the parent's marker."""

    kind: Literal["prismatic"]
    axis: Axis = (1.0, 0.0, 0.0)
    position: Length = 0.0
    """At t = 0."""
    velocity: Annotated[float, Quantity("m/s")] = 0.0
    stiffness: Spring = 0.0
    damping: Damper = 0.0
    rest: Length = 0.0


class Cylindrical(JointTable):
    """A slide and a turn along one axis of the parent's marker."""

    kind: Literal["cylindrical"]
    axis: Axis = (0.0, 0.0, 1.0)
    position: Length = 0.0
    velocity: Annotated[float, Quantity("m/s")] = 0.0
    angle: Angle = 0.0
    rate: Rate = 0.0
    slide_stiffness: Spring = 0.0
    slide_damping: Damper = 0.0
    slide_rest: Length = 0.0
    stiffness: TurnSpring = 0.0
    damping: TurnDamper = 0.0
    rest: Angle = 0.0


class Universal(JointTable):
    """Two successive turns, the second about an axis that the first has turned."""

    kind: Literal["universal"]
    axes: tuple[Axis, Axis] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    angles: Annotated[tuple[float, float], Quantity("rad", (2,))] = (0.0, 0.0)
    rates: Annotated[tuple[float, float], Quantity("rad/s", (2,))] = (0.0, 0.0)
    stiffness: Annotated[tuple[float, float], Quantity("N m/rad", (2,), least=0.0)] = (0.0, 0.0)
    damping: Annotated[tuple[float, float], Quantity("N m s/rad", (2,), least=0.0)] = (0.0, 0.0)
    rest: Annotated[tuple[float, float], Quantity("rad", (2,))] = (0.0, 0.0)

    @model_validator(mode="after")
    def _axes_differ(self) -> Universal:
        (a, b, c), (d, e, f) = self.axes
        if b * f - c * e == 0 and c * d - a * f == 0 and a * e - b * d == 0:
            refuse(
                f"found axes {list(self.axes[0])} and {list(self.axes[1])}, which are parallel; two turns about "
                f"one axis are one turn, so use revolute"
            )
        return self


class Spherical(JointTable):
    """Free rotation; springs act on the rotation vector."""

    kind: Literal["spherical"]
    rotation: RotationSet = "euler_parameters"
    """Coordinates that describe the rotation: Euler parameters, an angle sequence such as "intrinsic xzy" or
    "extrinsic xzy", Gibbs' vector, or modified Rodrigues parameters (which switch to their shadow)."""
    rebase: StrictBool = False
    """Count them from a new reference orientation, between two steps, whenever they near their singularity."""
    sequence: Sequence_ = "xyz"
    """Of the initial angles, intrinsic unless it says "extrinsic xyz"."""
    angles: Angles = ZERO
    rates: Rates = ZERO
    """Rate relative to the parent's marker, components of the child's."""
    stiffness: TurnSprings = ZERO
    damping: TurnDampers = ZERO
    rest: Angles = ZERO
    """Rotation vector at which the springs are free."""


class Free(Spherical):
    """Three slides along the axes of the parent's marker and free rotation."""

    kind: Literal["free"]  # type: ignore[assignment]
    position: Position = ZERO
    velocity: Velocity = ZERO
    slide_stiffness: Springs = ZERO
    slide_damping: Dampers = ZERO
    slide_rest: Position = ZERO


Many = tuple[float, ...]
Lengths = Annotated[Many, Quantity("m", (None,))]
Speeds = Annotated[Many, Quantity("m/s", (None,))]
AngleList = Annotated[Many, Quantity("rad", (None,))]
RateList = Annotated[Many, Quantity("rad/s", (None,))]
SpringList = Annotated[Many, Quantity("N/m", (None,), least=0.0)]
DamperList = Annotated[Many, Quantity("N s/m", (None,), least=0.0)]
TurnSpringList = Annotated[Many, Quantity("N m/rad", (None,), least=0.0)]
TurnDamperList = Annotated[Many, Quantity("N m s/rad", (None,), least=0.0)]


class General(JointTable):
    """Up to three slides along axes of the parent's marker, then up to three successive turns, each with its own."""

    kind: Literal["general"]
    slides: Annotated[list[Axis], Field(max_length=3)] = Field(default_factory=list)
    turns: Annotated[list[Axis], Field(max_length=3)] = Field(default_factory=list)
    position: Lengths = ()
    velocity: Speeds = ()
    slide_stiffness: SpringList = ()
    slide_damping: DamperList = ()
    slide_rest: Lengths = ()
    angles: AngleList = ()
    rates: RateList = ()
    stiffness: TurnSpringList = ()
    damping: TurnDamperList = ()
    rest: AngleList = ()

    @model_validator(mode="after")
    def _as_many_as_axes(self) -> General:
        for axes, keys in (("slides", SLIDE_KEYS), ("turns", TURN_KEYS)):
            wanted = len(getattr(self, axes))
            for key in keys:
                if len(getattr(self, key)) not in (0, wanted):
                    refuse(f"found {len(getattr(self, key))} values in {key} and {wanted} {axes}; give as many of both")
        return self

    def padded(self, key: str) -> list[float]:
        """The values of a key, zeros when left out."""
        axes = self.slides if key in SLIDE_KEYS else self.turns
        return list(getattr(self, key)) or [0.0] * len(axes)


Joint = Annotated[
    Weld | Revolute | Prismatic | Cylindrical | Universal | Spherical | Free | General, Field(discriminator="kind")
]
