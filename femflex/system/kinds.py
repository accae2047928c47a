"""The usual kinds of joints: weld, revolute, prismatic, cylindrical, universal, spherical, free, and plain turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.rotations import EULER_PARAMETERS, letters_of
from femflex.system.joint import Joint


def weld(child: str, parent: str | None = None, **where: object) -> Joint:
    """A joint without freedom."""
    return Joint(child, parent, kind="weld", **where)  # type: ignore[arg-type]


def revolute(child: str, parent: str | None = None, axis: object = (0, 0, 1), **where: object) -> Joint:
    """One turn about an axis of the parent's marker."""
    return Joint(child, parent, rotations=_rows(axis), kind="revolute", **where)  # type: ignore[arg-type]


def prismatic(child: str, parent: str | None = None, axis: object = (1, 0, 0), **where: object) -> Joint:
    """One slide along an axis of the parent's marker."""
    return Joint(child, parent, translations=_rows(axis), kind="prismatic", **where)  # type: ignore[arg-type]


def cylindrical(child: str, parent: str | None = None, axis: object = (0, 0, 1), **where: object) -> Joint:
    """A slide and a turn along one axis of the parent's marker."""
    return Joint(child, parent, translations=_rows(axis), rotations=_rows(axis), kind="cylindrical", **where)  # type: ignore[arg-type]


def universal(child: str, parent: str | None = None, axes: object = ((1, 0, 0), (0, 1, 0)), **where: object) -> Joint:
    """Two successive turns, the second about an axis that the first has turned."""
    return Joint(child, parent, rotations=_rows(axes), kind="universal", **where)  # type: ignore[arg-type]


def spherical(child: str, parent: str | None = None, rotation: str = EULER_PARAMETERS, **where: object) -> Joint:
    """Free rotation by the coordinates of a rotation set, such as "euler_parameters" or "intrinsic xzy"."""
    return Joint(child, parent, ball=rotation, kind="spherical", **where)  # type: ignore[arg-type]


def free(child: str, parent: str | None = None, rotation: str = EULER_PARAMETERS, **where: object) -> Joint:
    """Three slides and free rotation."""
    return Joint(child, parent, translations=np.eye(3), ball=rotation, kind="free", **where)  # type: ignore[arg-type]


def turns(
    child: str, parent: str | None = None, sequence: str = "xyz", slides: ArrayLike = (), **where: object
) -> Joint:
    """Slides along given axes, then three successive turns about the axes of a sequence: each freedom by itself.

    The joint to hold, or to specify, single rotations or all of a body that would otherwise be free.
    """
    axes = np.eye(3)[["xyz".index(axis) for axis in letters_of(sequence)]]
    return Joint(child, parent, translations=np.reshape(slides, (-1, 3)), rotations=axes, kind="general", **where)  # type: ignore[arg-type]


JOINTS = {f.__name__: f for f in (weld, revolute, prismatic, cylindrical, universal, spherical, free)}


def _rows(axes: object) -> Array:
    return np.atleast_2d(np.asarray(axes, float))
