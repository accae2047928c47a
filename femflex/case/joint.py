"""[[joints]]: how a body hangs from another, or from the base frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, model_validator

from femflex.case.base import Table, refuse
from femflex.case.law import Laws, read_laws
from femflex.case.motion import (
    AngleMotion,
    CylinderMotion,
    FreeMotion,
    GeneralMotion,
    Motion,
    PositionMotion,
    ThreeAngles,
    TwoAngles,
)
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
from femflex.rotations import is_extrinsic


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
SLIDE_SPRINGS, SPRINGS = ("slide_stiffness", "slide_damping"), ("stiffness", "damping")
# key of `motion`, key of the initial value, what must not act on a held coordinate
HELD_KEYS = (
    ("angle", "angle", SPRINGS),
    ("angles", "angles", SPRINGS),
    ("position", "position", SLIDE_SPRINGS),
)
RATES = {"angle": "rate", "angles": "rates", "position": "velocity"}


def _numbered(name: str, n: int, unit: str) -> dict[str, str]:
    """Names as a Joint gives them: "angle" for one, "angle1" and so on for several."""
    return {name + (str(k + 1) if n > 1 else ""): unit for k in range(n)}


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
    laws: Annotated[tuple[Mapping[str, Any], ...], Laws()] = ()
    """[[joints.laws]]: spring and damper tables, stops, friction and latches of single slides and turns."""

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every slide and turn that a law may act on."""
        return {}

    @model_validator(mode="after")
    def _laws_fit(self) -> JointTable:
        try:
            laws, latches = read_laws(self.laws, self.coordinates())
        except ValueProblem as problem:
            refuse(str(problem))
        slides = sum(unit == "m" for unit in self.coordinates().values())
        held = [*(self.motions("position") or (None,) * slides), *(self.motions("angle") or self.motions("angles"))]
        names = list(self.coordinates())
        for kind, k in [*((law.kind, law.freedom) for law in laws), *(("latch", latch.freedom) for latch in latches)]:
            if k < len(held) and held[k] is not None:
                refuse(f"found a {kind} on {names[k]!r}, which is held by motion; it would do nothing, so drop it")
        return self

    def motions(self, key: str) -> tuple[Motion | None, ...]:
        """Motion of each coordinate under that key of `motion`; () when all are free."""
        found = getattr(getattr(self, "motion", None), key, None)
        return found if isinstance(found, tuple) else (found,) if found is not None else ()

    @model_validator(mode="after")
    def _held_freedoms_are_only_held(self) -> JointTable:
        for key, begins, others in HELD_KEYS:
            for k, motion in enumerate(self.motions(key)):
                if motion is not None:
                    self._refuse_beside(key, k, motion, begins, others)
        return self

    def _refuse_beside(self, key: str, k: int, motion: Motion, begins: str, others: tuple[str, ...]) -> None:
        """Refuse initial values, springs and dampers of coordinate k, which is held."""
        held = "locked" if motion.locked else "specified"
        for other in (begins, RATES[begins], *others):
            value = getattr(self, other, 0.0)
            entry = value if isinstance(value, float) else value[k] if k < len(value) else 0.0
            given = other in self.model_fields_set and (entry != 0.0 or isinstance(value, float))
            if not given or (other == begins and motion.locked):
                continue
            if other in others:
                refuse(
                    f"found {other} for a coordinate that is {held} by motion.{key}; it would do nothing, so drop it"
                )
            refuse(f"found {other} for a coordinate that is {held} by motion.{key}; the motion says where it begins")

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
    motion: AngleMotion = AngleMotion()
    """Of a locked or specified angle."""

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every slide and turn that a law may act on."""
        return {"angle": "rad"}


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
    motion: PositionMotion = PositionMotion()
    """Of a locked or specified slide."""

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every slide and turn that a law may act on."""
        return {"slide": "m"}

    @model_validator(mode="after")
    def _held_slides_have_no_spring(self) -> Prismatic:
        for k, motion in enumerate(self.motions("position")):
            if motion is not None:
                self._refuse_beside("position", k, motion, "position", SPRINGS)
        return self


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
    motion: CylinderMotion = CylinderMotion()

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every slide and turn that a law may act on."""
        return {"slide": "m", "angle": "rad"}


class Universal(JointTable):
    """Two successive turns, the second about an axis that the first has turned."""

    kind: Literal["universal"]
    axes: tuple[Axis, Axis] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    angles: Annotated[tuple[float, float], Quantity("rad", (2,))] = (0.0, 0.0)
    rates: Annotated[tuple[float, float], Quantity("rad/s", (2,))] = (0.0, 0.0)
    stiffness: Annotated[tuple[float, float], Quantity("N m/rad", (2,), least=0.0)] = (0.0, 0.0)
    damping: Annotated[tuple[float, float], Quantity("N m s/rad", (2,), least=0.0)] = (0.0, 0.0)
    rest: Annotated[tuple[float, float], Quantity("rad", (2,))] = (0.0, 0.0)
    motion: TwoAngles = TwoAngles()

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every slide and turn that a law may act on."""
        return {"angle1": "rad", "angle2": "rad"}

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
    motion: ThreeAngles = ThreeAngles()
    """Of locked or specified angles of the sequence; the coordinates are then these angles."""

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every slide and turn that a law may act on."""
        return {f"angle{k}": "rad" for k in (1, 2, 3)} if self.turning else {}

    @property
    def turning(self) -> bool:
        """Whether some angle is held, so that the angles of the sequence are the coordinates."""
        return any(motion is not None for motion in self.motions("angles"))

    @model_validator(mode="after")
    def _held_angles_replace_the_ball(self) -> Spherical:
        if self.turning and self.rotation != "euler_parameters":
            refuse(f"found rotation {self.rotation!r} beside motion.angles, whose coordinates are those of `sequence`")
        if self.turning and (self.rebase or is_extrinsic(self.sequence)):
            refuse(
                f"found sequence {self.sequence!r} and rebase = {str(self.rebase).lower()} beside motion.angles; held "
                "angles are those of an intrinsic sequence such as 'xyz', and are never re-based"
            )
        for key in ("rates", "stiffness", "damping"):
            if self.turning and any(getattr(self, key)):
                refuse(
                    f"found {key} beside motion.angles; a ball's {key} are about its own axes, so write the joint with "
                    "kind = 'general' and turns"
                )
        return self


class Free(Spherical):
    """Three slides along the axes of the parent's marker and free rotation."""

    kind: Literal["free"]  # type: ignore[assignment]
    position: Position = ZERO
    velocity: Velocity = ZERO
    slide_stiffness: Springs = ZERO
    slide_damping: Dampers = ZERO
    slide_rest: Position = ZERO
    motion: FreeMotion = FreeMotion()

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every slide and turn that a law may act on."""
        return {f"slide{k}": "m" for k in (1, 2, 3)} | super().coordinates()


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
    motion: GeneralMotion = GeneralMotion()

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every slide and turn that a law may act on."""
        return {**_numbered("slide", len(self.slides), "m"), **_numbered("angle", len(self.turns), "rad")}

    @model_validator(mode="after")
    def _as_many_as_axes(self) -> General:
        for axes, keys in (("slides", SLIDE_KEYS), ("turns", TURN_KEYS)):
            wanted = len(getattr(self, axes))
            for key in keys:
                if len(getattr(self, key)) not in (0, wanted):
                    refuse(f"found {len(getattr(self, key))} values in {key} and {wanted} {axes}; give as many of both")
            found = len(self.motions(keys[0]))
            if found not in (0, wanted):
                refuse(f"found {found} motions in motion.{keys[0]} and {wanted} {axes}; give as many of both")
        return self

    def padded(self, key: str) -> list[float]:
        """The values of a key, zeros when left out."""
        axes = self.slides if key in SLIDE_KEYS else self.turns
        return list(getattr(self, key)) or [0.0] * len(axes)


Joint = Annotated[
    Weld | Revolute | Prismatic | Cylindrical | Universal | Spherical | Free | General, Field(discriminator="kind")
]
