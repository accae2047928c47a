"""Joints with free rotation: spherical and free."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import StrictBool, model_validator

from femflex.arrays import Array
from femflex.noun.names import RotationSet, Sequence_
from femflex.noun.table import refuse
from femflex.noun.values import Angles, Position, Rates, Velocity
from femflex.rotations import is_extrinsic, letters_of
from femflex.system.ball import ball_coordinates
from femflex.system.joints.motions import FreeMotion, ThreeAngles
from femflex.system.joints.noun import Axes, JointNoun
from femflex.system.joints.values import ZERO, Dampers, Springs, TurnDampers, TurnSprings

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Spherical(JointNoun):
    """Free rotation; springs act on the rotation vector."""

    kind: Literal["spherical"]
    """Selects this joint: free rotation."""
    rotation: RotationSet = "euler_parameters"
    """Rotation coordinates: Euler parameters, an angle sequence such as "intrinsic xzy" or "extrinsic xzy", the Gibbs
    vector, or modified Rodrigues parameters (which switch to their shadow set)."""
    rebase: StrictBool = False
    """Measure the rotation from a new reference orientation, between two steps, when the coordinates come near their
    singularity."""
    sequence: Sequence_ = "xyz"
    """Sequence of the initial angles; intrinsic unless it says "extrinsic xyz"."""
    angles: Angles = ZERO
    """Initial angles in the order of the sequence."""
    rates: Rates = ZERO
    """Initial angular rate relative to the parent's marker, in the axes of the child's."""
    stiffness: TurnSprings = ZERO
    """Rotational spring on the rotation vector: one number, or one per axis."""
    damping: TurnDampers = ZERO
    """Rotational damping coefficient: one number, or one per axis."""
    rest: Angles = ZERO
    """Rotation vector without spring torque."""
    motion: ThreeAngles = ThreeAngles()
    """Locked or prescribed angles of the sequence; the coordinates are then these angles."""

    @property
    def turn_axes(self) -> Axes:
        """Axes of the sequence where an angle of it is prescribed."""
        return tuple(AXES[letter] for letter in letters_of(self.sequence)) if self.has_prescribed_angles else ()

    @property
    def ball(self) -> str | None:
        """Its rotation set, where no angle is prescribed."""
        return None if self.has_prescribed_angles else self.rotation

    def ball_coordinates(self) -> Array:
        """The initial coordinates of its rotation set."""
        return ball_coordinates(self.rotation, self.sequence, np.array(self.angles), self.rebase)

    @property
    def has_prescribed_angles(self) -> bool:
        """Whether some angle is prescribed, so that the angles of the sequence are the coordinates."""
        return any(motion is not None for motion in self.motions("angles"))

    @model_validator(mode="after")
    def _prescribed_angles_replace_rotation_set(self) -> Spherical:
        if self.has_prescribed_angles and self.rotation != "euler_parameters":
            refuse(f"found rotation {self.rotation!r} and motion.angles, whose coordinates are those of `sequence`")
        if self.has_prescribed_angles and (self.rebase or is_extrinsic(self.sequence)):
            refuse(
                f"found sequence {self.sequence!r} and rebase = {str(self.rebase).lower()} with motion.angles; "
                "prescribed angles are those of an intrinsic sequence such as 'xyz', and are never re-based"
            )
        for key in ("rates", "stiffness", "damping"):
            if self.has_prescribed_angles and any(getattr(self, key)):
                refuse(
                    f"found {key} with motion.angles; a ball's {key} are about its own axes, so write the joint with "
                    "kind = 'general' and turns"
                )
        return self


class Free(Spherical):
    """Three slides along the axes of the parent's marker and free rotation."""

    kind: Literal["free"]  # type: ignore[assignment]
    """Selects this joint: six degrees of freedom."""
    position: Position = ZERO
    """Initial position relative to the parent's marker, along its axes."""
    velocity: Velocity = ZERO
    """Initial velocity relative to the parent's marker, along its axes."""
    slide_stiffness: Springs = ZERO
    """Spring on the three slides: one number, or one per axis."""
    slide_damping: Dampers = ZERO
    """Damping coefficient of the three slides: one number, or one per axis."""
    slide_rest: Position = ZERO
    """Position without spring force."""
    motion: FreeMotion = FreeMotion()
    """Locked or prescribed slides and angles."""

    @property
    def slide_axes(self) -> Axes:
        """Axes of its slides, in the axes of the parent's marker."""
        return tuple(AXES.values())
