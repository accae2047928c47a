"""`motion` of every kind of joint: which of its coordinates are locked or specified, and how they move."""

from __future__ import annotations

from typing import Annotated

from femflex.case.base import Table
from femflex.case.motion import Motion, MotionOf, MotionsOf

Angle = Annotated[Motion | None, MotionOf("rad")]
Position = Annotated[Motion | None, MotionOf("m")]
Motions = tuple[Motion | None, ...]


class AngleMotion(Table):
    """How the angle moves."""

    angle: Angle = None


class PositionMotion(Table):
    """How the slide moves."""

    position: Position = None


class CylinderMotion(Table):
    """How slide and angle move."""

    position: Position = None
    angle: Angle = None


class TwoAngles(Table):
    """How the two angles move."""

    angles: Annotated[Motions, MotionsOf("rad", 2)] = ()


class ThreeAngles(Table):
    """How the three angles of the joint's sequence move."""

    angles: Annotated[Motions, MotionsOf("rad", 3)] = ()


class FreeMotion(ThreeAngles):
    """How the three slides, and the three angles of the joint's sequence, move."""

    position: Annotated[Motions, MotionsOf("m", 3)] = ()


class GeneralMotion(Table):
    """How slides and turns move."""

    position: Annotated[Motions, MotionsOf("m")] = ()
    angles: Annotated[Motions, MotionsOf("rad")] = ()
