"""`motion` of every kind of joint: its locked or prescribed coordinates, and their motion."""

from __future__ import annotations

from typing import Annotated, Any

from femflex.noun.table import Table
from femflex.noun.units import UnitError
from femflex.noun.values import ValueProblem, _Readable, counted_noun, value_text
from femflex.system.motion import LOCKED, Motion, MotionOf


class MotionsOf(_Readable):
    """A list of motions of coordinates with one unit; n of them, or any number."""

    def __init__(self, unit: str, n: int | None = None) -> None:
        self.coordinate_motion, self.n = MotionOf(unit), n

    def read_value(self, value: Any) -> tuple[Motion | None, ...]:
        """One motion per coordinate, None when free."""
        if value == LOCKED and self.n is not None:
            return (Motion(locked=True),) * self.n
        if not isinstance(value, list):
            raise ValueProblem(f"found {value_text(value)}; expected a list with a motion for every coordinate")
        if self.n is not None and len(value) != self.n:
            raise ValueProblem(
                f"found {counted_noun(len(value), 'motion', 'motions')}; expected {self.n}, 'free' among them"
            )
        out = []
        for k, entry in enumerate(value):
            try:
                out.append(self.coordinate_motion.read_value(entry))
            except (ValueProblem, UnitError) as problem:
                raise ValueProblem(f"entry {k + 1}: {problem}") from None
        return tuple(out)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of a list."""
        size = {} if self.n is None else {"minItems": self.n, "maxItems": self.n}
        return {"type": "array", "items": self.coordinate_motion.json_schema()} | size


Angle = Annotated[Motion | None, MotionOf("rad")]
Position = Annotated[Motion | None, MotionOf("m")]
Motions = tuple[Motion | None, ...]


class AngleMotion(Table):
    """Motion of the angle."""

    angle: Angle = None
    """Motion of the angle: "free", "locked", a value, or a profile over time."""


class PositionMotion(Table):
    """Motion of the slide."""

    position: Position = None
    """Motion of the slide: "free", "locked", a value, or a profile over time."""


class CylinderMotion(Table):
    """Motion of slide and angle."""

    position: Position = None
    """Motion of the slide: "free", "locked", a value, or a profile over time."""
    angle: Angle = None
    """Motion of the angle: "free", "locked", a value, or a profile over time."""


class TwoAngles(Table):
    """Motion of the two angles."""

    angles: Annotated[Motions, MotionsOf("rad", 2)] = ()
    """Motion of each of the two angles: "free", "locked", a value, or a profile over time."""


class ThreeAngles(Table):
    """Motion of the three angles of the joint's sequence."""

    angles: Annotated[Motions, MotionsOf("rad", 3)] = ()
    """Motion of each of the three angles: "free", "locked", a value, or a profile over time."""


class FreeMotion(ThreeAngles):
    """Motion of the three slides, and of the three angles of the joint's sequence."""

    position: Annotated[Motions, MotionsOf("m", 3)] = ()
    """Motion of each of the three slides: "free", "locked", a value, or a profile over time."""


class GeneralMotion(Table):
    """Motion of translations and rotations."""

    position: Annotated[Motions, MotionsOf("m")] = ()
    """Motion of each slide: "free", "locked", a value, or a profile over time."""
    angles: Annotated[Motions, MotionsOf("rad")] = ()
    """Motion of each turn: "free", "locked", a value, or a profile over time."""
