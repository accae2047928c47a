"""The usual kinds of joints: weld, revolute, prismatic, cylindrical, universal, spherical, free, and plain turns.

Keyword arguments that all share are those of `Joint`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, TypedDict, TypeVar, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.noun.problems import suggestion_text
from femflex.rotations import EULER_PARAMETERS, letters_of
from femflex.system.joint import Joint
from femflex.system.latch import Latch
from femflex.system.law import Law
from femflex.system.profile import Profile

_Make = TypeVar("_Make", bound=Callable[..., Joint])


class JointOptions(TypedDict, total=False):
    """Options that every kind of joint takes besides its axes; see `Joint`."""

    child_marker: str
    parent_marker: str
    name: str
    stiffness: ArrayLike
    damping: ArrayLike
    rest: ArrayLike
    motion: tuple[Profile | float | None, ...]
    laws: tuple[Law, ...]
    latches: tuple[Latch, ...]
    q0: ArrayLike
    u0: ArrayLike
    play: float
    rebase: bool


def _with_options(make: _Make) -> _Make:
    """The function, with the options of a joint in the signature that `help` and editors show."""
    signature, joint = inspect.signature(make), inspect.signature(Joint).parameters
    options = [joint[name].replace(kind=inspect.Parameter.KEYWORD_ONLY) for name in JointOptions.__annotations__]
    options = [option.replace(default=()) if option.annotation == "Array" else option for option in options]
    shown = [*list(signature.parameters.values())[:-1], *options]

    @wraps(make)
    def kind(*arguments: Any, **named: Any) -> Joint:
        known = [parameter.name for parameter in shown]
        for name in named.keys() - set(known):
            raise TypeError(f"{make.__name__}() has no argument {name!r}; {suggestion_text(name, known)}")
        return make(*arguments, **named)

    kind.__signature__ = signature.replace(parameters=shown)  # type: ignore[attr-defined]
    return cast(_Make, kind)


@_with_options
def weld(child: str, parent: str | None = None, **options: Unpack[JointOptions]) -> Joint:
    """A joint without a degree of freedom."""
    return Joint(child, parent, kind="weld", **options)  # type: ignore[arg-type]


@_with_options
def revolute(
    child: str, parent: str | None = None, axis: ArrayLike = (0, 0, 1), **options: Unpack[JointOptions]
) -> Joint:
    """One rotation about an axis of the parent's marker; stiffness [N m/rad], damping [N m s/rad], q0 [rad]."""
    return Joint(child, parent, rotations=_rows(axis), kind="revolute", **options)  # type: ignore[arg-type]


@_with_options
def prismatic(
    child: str, parent: str | None = None, axis: ArrayLike = (1, 0, 0), **options: Unpack[JointOptions]
) -> Joint:
    """One translation along an axis of the parent's marker; stiffness [N/m], damping [N s/m], q0 [m]."""
    return Joint(child, parent, translations=_rows(axis), kind="prismatic", **options)  # type: ignore[arg-type]


@_with_options
def cylindrical(
    child: str, parent: str | None = None, axis: ArrayLike = (0, 0, 1), **options: Unpack[JointOptions]
) -> Joint:
    """A translation along an axis of the parent's marker and a rotation about it."""
    return Joint(child, parent, translations=_rows(axis), rotations=_rows(axis), kind="cylindrical", **options)  # type: ignore[arg-type]


@_with_options
def universal(
    child: str, parent: str | None = None, axes: ArrayLike = ((1, 0, 0), (0, 1, 0)), **options: Unpack[JointOptions]
) -> Joint:
    """Two successive rotations, the second about an axis that the first has turned."""
    return Joint(child, parent, rotations=_rows(axes), kind="universal", **options)  # type: ignore[arg-type]


@_with_options
def spherical(
    child: str, parent: str | None = None, rotation: str = EULER_PARAMETERS, **options: Unpack[JointOptions]
) -> Joint:
    """Free rotation by the coordinates of a rotation set, such as "euler_parameters" or "intrinsic xzy"."""
    return Joint(child, parent, ball=rotation, kind="spherical", **options)  # type: ignore[arg-type]


@_with_options
def free(
    child: str, parent: str | None = None, rotation: str = EULER_PARAMETERS, **options: Unpack[JointOptions]
) -> Joint:
    """Three translations and free rotation by the coordinates of a rotation set."""
    return Joint(child, parent, translations=np.eye(3), ball=rotation, kind="free", **options)  # type: ignore[arg-type]


@_with_options
def turns(
    child: str,
    parent: str | None = None,
    sequence: str = "xyz",
    slides: ArrayLike = (),
    **options: Unpack[JointOptions],
) -> Joint:
    """Slides along given axes, then three successive turns about the axes of a sequence: each freedom by itself.

    The joint to hold, or to specify, single rotations or all of a body that would otherwise be free.
    """
    axes = np.eye(3)[["xyz".index(axis) for axis in letters_of(sequence)]]
    return Joint(child, parent, translations=np.reshape(slides, (-1, 3)), rotations=axes, kind="general", **options)  # type: ignore[arg-type]


JOINTS = {f.__name__: f for f in (weld, revolute, prismatic, cylindrical, universal, spherical, free)}


def _rows(axes: ArrayLike) -> Array:
    return np.atleast_2d(np.asarray(axes, float))
