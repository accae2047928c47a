"""Names of the coordinates and quasi-velocities of a joint."""

from __future__ import annotations

from collections.abc import Sized
from typing import TYPE_CHECKING

from femflex.rotations import EULER_PARAMETERS
from femflex.system.ball import ball_names

if TYPE_CHECKING:
    from femflex.system.joint import Joint

Names = list[tuple[str, str]]  # name and unit


def coordinate_names(joint: Joint) -> Names:
    """Name and unit of each coordinate."""
    return _motion_names(joint)


def velocity_names(joint: Joint) -> Names:
    """Return name and unit of each quasi-velocity; those of a ball are the components of its rate."""
    if joint.ball is None:
        return [(f"{name}_rate", unit + "/s") for name, unit in _motion_names(joint)]
    slides = _motion_names(joint)[: len(joint.translations)]
    return [(f"{n}_rate", u + "/s") for n, u in slides] + [(f"{joint.label}.omega_{a}", "rad/s") for a in "xyz"]


def _motion_names(joint: Joint) -> Names:
    slides = [(f"{joint.label}.slide{_number(j, joint.translations)}", "m") for j in range(len(joint.translations))]
    if joint.ball is None:
        turns = [(f"{joint.label}.angle{_number(j, joint.rotations)}", "rad") for j in range(len(joint.rotations))]
        return slides + turns
    if joint.ball == EULER_PARAMETERS:
        return slides + [(f"{joint.label}.e{j}", "1") for j in range(4)]
    reference = [(f"{joint.label}.reference_e{j}", "1") for j in range(4)] if joint.rebase else []
    return slides + [(f"{joint.label}.{name}", unit) for name, unit in ball_names(joint.ball)] + reference


def _number(j: int, axes: Sized) -> str:
    return "" if len(axes) == 1 else str(j + 1)
