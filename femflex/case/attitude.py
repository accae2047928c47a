"""[attitude]: the initial attitude of the craft."""

from __future__ import annotations

from typing import Literal

from pydantic import StrictBool, model_validator

from femflex.noun.names import RotationSet, Sequence_
from femflex.noun.table import Table, refuse
from femflex.noun.values import Angle, Angles, Position, Rates, Velocity

BodyAxis = Literal["x", "y", "z", "-x", "-y", "-z"]


class AttitudeTable(Table):
    """Initial attitude of the root body relative to a frame, free or prescribed.

    From the orbital frame pitch turns about x0, yaw about y0, roll about z0, in the order of `sequence`; from other
    frames `angles` are about the axes of the sequence. In the nominal attitude
    (all angles zero) the body axes named in `nominal_axes` lie along x0, y0, z0.
    """

    frame: Literal["orbital", "inertial", "spinning"] | None = None
    """Reference frame of the attitude. Default: orbital if there is an orbit, else inertial."""
    spin: Rates | None = None
    """Angular rate of the spinning frame, in its own axes."""
    ephemeris: str | None = None
    """AEM of CCSDS with quaternions, relative to the case file: the attitude is prescribed along it, in the inertial
    frame. t = 0 is environment.epoch, by default its first epoch."""
    held: StrictBool = False
    """Prescribe the initial attitude in the frame for the whole run."""
    root: str | None = None
    """Root body of the tree. Default: the one body without a joint."""
    nominal_axes: tuple[BodyAxis, BodyAxis, BodyAxis] | None = None
    """Body axes along x0, y0, z0 in the nominal attitude, such as ["y", "-z", "-x"]."""
    marker: str | None = None
    """Marker of the root body whose axes lie along x0, y0, z0 in the nominal attitude, in place of nominal_axes."""
    sequence: Sequence_ = "xzy"
    """Sequence of the turns, intrinsic unless it says "extrinsic xzy". "xzy" is pitch, roll, yaw."""
    angles: Angles | None = None
    """The three initial angles in the order of the sequence."""
    pitch: Angle | None = None
    """Initial pitch angle from the orbital frame, about x0, the orbit normal. Default: zero."""
    yaw: Angle | None = None
    """Initial yaw angle from the orbital frame, about y0, the outward vertical. Default: zero."""
    roll: Angle | None = None
    """Initial roll angle from the orbital frame, about z0, the flight direction. Default: zero."""
    rates: Rates | None = None
    """Initial angular rate relative to the frame, along the libration axes. Default: at rest in the frame."""
    rotation: RotationSet = "euler_parameters"
    """Rotation coordinates of the root body: Euler parameters, an angle sequence, the Gibbs vector (rodrigues) or
    modified Rodrigues parameters."""
    rebase: StrictBool = False
    """Measure the rotation from a new reference orientation, between two steps, when the coordinates come near their
    singularity."""
    position: Position | None = None
    """Initial position of the root body in the frame, where it is free to move. Default: the frame's origin; in a free
    orbit the centre of mass of the whole craft starts there."""
    velocity: Velocity | None = None
    """Initial velocity of the root body relative to the frame, in its axes. Default: at rest; in a free orbit the
    centre of mass is at rest."""

    @model_validator(mode="after")
    def _consistent(self) -> AttitudeTable:
        orbital_angles = [key for key in ("pitch", "yaw", "roll") if getattr(self, key) is not None]
        if orbital_angles and self.angles is not None:
            refuse(f"found angles and {', '.join(orbital_angles)} together; give one or the other")
        if orbital_angles and len(set(self.sequence[-3:])) < 3:
            refuse(
                f"found {', '.join(orbital_angles)} with sequence {self.sequence!r}, which turns about one axis "
                f"twice; give angles"
            )
        if self.nominal_axes is not None and self.marker is not None:
            refuse("found nominal_axes and marker together; give one of them")
        if self.nominal_axes is not None and _triple_product(self.nominal_axes) != 1:
            refuse(
                f"found nominal_axes {list(self.nominal_axes)}; the three body axes must form a right-handed set, "
                f"such as ['y', '-z', '-x']"
            )
        if (self.frame == "spinning") != (self.spin is not None):
            refuse("found spin without frame = 'spinning', or the frame without spin; a spinning frame needs both")
        moving = [key for key in ("rates", "velocity") if getattr(self, key) is not None and any(getattr(self, key))]
        if self.held and moving:
            refuse(f"found held = true together with {' and '.join(moving)}; a held attitude is at rest in its frame")
        if self.ephemeris is not None:
            given = sorted(self.model_fields_set - {"ephemeris", "frame", "root", "nominal_axes", "marker", "position"})
            if given or self.frame not in (None, "inertial"):
                refuse(
                    f"found ephemeris together with {', '.join(given) or 'frame'}; its attitude is prescribed, in the "
                    "inertial frame: leave the others out"
                )
        if self.held and self.rebase:
            refuse("found held = true together with rebase; a held attitude has no coordinates to be re-based")
        return self

    def turn_angles(self) -> tuple[float, float, float]:
        """The three angles in the order of the sequence [rad]."""
        if self.angles is not None:
            return self.angles
        angles = {"x": self.pitch or 0.0, "y": self.yaw or 0.0, "z": self.roll or 0.0}
        return tuple(angles[axis] for axis in self.sequence[-3:])  # type: ignore[return-value]


def _triple_product(axes: tuple[str, ...]) -> int:
    """Determinant of the matrix whose rows are these signed unit vectors."""
    order = ["xyz".index(axis[-1]) for axis in axes]
    if len(set(order)) < 3:
        return 0
    parity = 1 if order in ([0, 1, 2], [1, 2, 0], [2, 0, 1]) else -1
    return parity * (-1) ** sum(axis[0] == "-" for axis in axes)
