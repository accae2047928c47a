"""Joints of successive slides and turns: weld, revolute, prismatic, cylindrical and universal."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from femflex.noun.table import refuse
from femflex.noun.values import Angle, Axis, Length, Quantity, Rate
from femflex.system.joints.motions import AngleMotion, CylinderMotion, PositionMotion, TwoAngles
from femflex.system.joints.noun import Axes, JointNoun
from femflex.system.joints.values import Damper, Spring, TurnDamper, TurnSpring


class Weld(JointNoun):
    """No freedom."""

    kind: Literal["weld"]
    """Selects this joint: no degree of freedom."""


class Revolute(JointNoun):
    """One turn about an axis of the parent's marker."""

    kind: Literal["revolute"]
    """Selects this joint: one turn."""
    axis: Axis = (0.0, 0.0, 1.0)
    """Axis of the turn, in the axes of the parent's marker."""
    angle: Angle = 0.0
    """Angle at t = 0."""
    rate: Rate = 0.0
    """Rate of the angle at t = 0."""
    stiffness: TurnSpring = 0.0
    """Rotational spring about the axis."""
    damping: TurnDamper = 0.0
    """Rotational damping coefficient about the axis."""
    rest: Angle = 0.0
    """Angle without spring torque."""
    motion: AngleMotion = AngleMotion()
    """Motion of a locked or prescribed angle. Default: free."""

    @property
    def turn_axes(self) -> Axes:
        """Axes of its turns, each turned by those before it."""
        return (self.axis,)


class Prismatic(JointNoun):
    """One slide along an axis of the parent's marker."""

    kind: Literal["prismatic"]
    """Selects this joint: one slide."""
    axis: Axis = (1.0, 0.0, 0.0)
    """Axis of the slide, in the axes of the parent's marker."""
    position: Length = 0.0
    """Slide at t = 0."""
    velocity: Annotated[float, Quantity("m/s")] = 0.0
    """Rate of the slide at t = 0."""
    stiffness: Spring = 0.0
    """Spring along the slide."""
    damping: Damper = 0.0
    """Damping coefficient along the slide."""
    rest: Length = 0.0
    """Slide without spring force."""
    motion: PositionMotion = PositionMotion()
    """Motion of a locked or prescribed slide. Default: free."""

    of_slides: ClassVar[str] = ""

    @property
    def slide_axes(self) -> Axes:
        """Axes of its slides, in the axes of the parent's marker."""
        return (self.axis,)


class Cylindrical(JointNoun):
    """A slide and a turn along one axis of the parent's marker."""

    kind: Literal["cylindrical"]
    """Selects this joint: one slide and one turn along one axis."""
    axis: Axis = (0.0, 0.0, 1.0)
    """Axis of slide and turn, in the axes of the parent's marker."""
    position: Length = 0.0
    """Slide at t = 0."""
    velocity: Annotated[float, Quantity("m/s")] = 0.0
    """Rate of the slide at t = 0."""
    angle: Angle = 0.0
    """Angle at t = 0."""
    rate: Rate = 0.0
    """Rate of the angle at t = 0."""
    slide_stiffness: Spring = 0.0
    """Spring along the slide."""
    slide_damping: Damper = 0.0
    """Damping coefficient along the slide."""
    slide_rest: Length = 0.0
    """Slide without spring force."""
    stiffness: TurnSpring = 0.0
    """Rotational spring about the axis."""
    damping: TurnDamper = 0.0
    """Rotational damping coefficient about the axis."""
    rest: Angle = 0.0
    """Angle without spring torque."""
    motion: CylinderMotion = CylinderMotion()
    """Motion of a locked or prescribed slide or angle. Default: free."""

    @property
    def slide_axes(self) -> Axes:
        """Axes of its slides, in the axes of the parent's marker."""
        return (self.axis,)

    @property
    def turn_axes(self) -> Axes:
        """Axes of its turns, each turned by those before it."""
        return (self.axis,)


class Universal(JointNoun):
    """Two successive turns, the second about an axis that the first has turned."""

    kind: Literal["universal"]
    """Selects this joint: two successive turns."""
    axes: tuple[Axis, Axis] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    """Axes of the two turns, in the axes of the parent's marker; the first turns the second."""
    angles: Annotated[tuple[float, float], Quantity("rad", (2,))] = (0.0, 0.0)
    """Two angles at t = 0."""
    rates: Annotated[tuple[float, float], Quantity("rad/s", (2,))] = (0.0, 0.0)
    """Rates of the two angles at t = 0."""
    stiffness: Annotated[tuple[float, float], Quantity("N m/rad", (2,), least=0.0)] = (0.0, 0.0)
    """Rotational springs of the two turns."""
    damping: Annotated[tuple[float, float], Quantity("N m s/rad", (2,), least=0.0)] = (0.0, 0.0)
    """Rotational damping coefficients of the two turns."""
    rest: Annotated[tuple[float, float], Quantity("rad", (2,))] = (0.0, 0.0)
    """Angles without spring torque."""
    motion: TwoAngles = TwoAngles()
    """Motions of locked or prescribed angles. Default: free."""

    @property
    def turn_axes(self) -> Axes:
        """Axes of its turns, each turned by those before it."""
        return self.axes

    @model_validator(mode="after")
    def _axes_differ(self) -> Universal:
        (a, b, c), (d, e, f) = self.axes
        if b * f - c * e == 0 and c * d - a * f == 0 and a * e - b * d == 0:
            refuse(
                f"found axes {list(self.axes[0])} and {list(self.axes[1])}, which are parallel; two turns about "
                f"one axis are one turn, so use revolute"
            )
        return self
