"""Joints: the attachment of a body to its parent, or to the base frame.

A joint leads from marker P on the parent to marker Q on the child: first the translations along axes fixed in P, then
the rotations. Rotations are either successive turns about given axes (revolute, universal), whose rates are the
quasi-velocities, or a ball (spherical, free), whose quasi-velocity is the angular rate of Q relative to P in Q
components while its coordinates follow a chosen rotation set (see femflex.rotations).

A re-based ball counts its coordinates from a reference orientation R instead of P, C_PQ = C_PR C_RQ(coordinates), and
the four Euler parameters of C_PR, constant between changes, follow its coordinates in q: a row of q says all.
"""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import dataclass, field, replace

import numpy as np

from femflex.arrays import Array
from femflex.rotations import EULER_PARAMETERS
from femflex.summary import Rows, Summarised, listed
from femflex.system.ball import ball_coordinates, ball_names, check_ball, singular_start
from femflex.system.gimbal_lock import locked_start_text
from femflex.system.joint_coordinates import OPEN, SHUT, check_laws, started_motion
from femflex.system.latch import Latch
from femflex.system.law import Law
from femflex.system.profile import Profile

Names = list[tuple[str, str]]  # name and unit


def _no_axes() -> Array:
    return np.zeros((0, 3))


@dataclass(frozen=True, eq=False, repr=False)
class Joint(Summarised):
    """A joint between a parent's marker and a child's marker; parent None is the base frame.

    translations (n_t, 3)  unit axes of sliding, components of the parent's marker
    rotations    (n_r, 3)  unit axes of successive turns, n_r <= 3; none for a ball
    ball         name of the rotation set of a ball joint, or None
    rebase       whether a ball's coordinates move to a new reference orientation when they near their singularity
    stiffness    (n_u,)    spring per quasi-coordinate, translations first [N/m, N m/rad]
    damping      (n_u,)    damper per quasi-coordinate [N s/m, N m s/rad]
    rest         (n_u,)    coordinate at which the spring is free (for a ball: rotation vector)
    laws         nonlinear springs, dampers, stops and friction of single translations and rotations
    latches      what locks single translations and rotations when they reach a place
    play         of a cut joint: misfit up to which its loop may stand open where rows follow from others [m]; an angle
                 counts by the bodies' size
    motion       (n_u,)    per freedom None (free), a number (locked there) or a Profile (specified); () all free
    q0, u0       initial coordinates (n_q,) and quasi-velocities (n_u,); the reference of a ball may be
                           left out, and those of prescribed freedoms are their motion's

    A ball's rotation is free as a whole; to hold a part of it write it as successive turns (`turns`).
    """

    child: str
    parent: str | None = None
    child_marker: str = "origin"
    parent_marker: str = "origin"
    name: str = ""
    translations: Array = field(default_factory=_no_axes)
    rotations: Array = field(default_factory=_no_axes)
    ball: str | None = None
    rebase: bool = False
    stiffness: Array = field(default_factory=lambda: np.zeros(0))
    damping: Array = field(default_factory=lambda: np.zeros(0))
    rest: Array = field(default_factory=lambda: np.zeros(0))
    motion: tuple[Profile | float | None, ...] = ()
    laws: tuple[Law, ...] = ()
    latches: tuple[Latch, ...] = ()
    q0: Array = field(default_factory=lambda: np.zeros(0))
    u0: Array = field(default_factory=lambda: np.zeros(0))
    kind: str = "weld"
    play: float = 0.0

    def __post_init__(self) -> None:
        check_ball(self.ball, self.rebase, self.label)
        if self.ball is not None and len(self.rotations):
            raise ValueError(f"joint {self.label!r} has both a ball and turning axes; give one of them")
        set_ = object.__setattr__
        set_(self, "translations", _unit_rows(self.translations, "translation", self.label))
        set_(self, "rotations", _unit_rows(self.rotations, "rotation", self.label))
        if len(self.translations) > 3 or len(self.rotations) > 3:
            raise ValueError(
                f"joint {self.label!r} has {len(self.translations)} translations and {len(self.rotations)} rotations; "
                "at most three of each"
            )
        if len(self.translations) > 1 and np.linalg.matrix_rank(self.translations) < len(self.translations):
            raise ValueError(
                f"translation axes of joint {self.label!r} depend on each other: {self.translations.tolist()}"
            )
        for key, size in (("stiffness", self.n_u), ("damping", self.n_u), ("rest", self.n_u), ("u0", self.n_u)):
            set_(self, key, _sized(getattr(self, key), size, key, self.label))
        q0 = np.asarray(self.q0, float)
        if self.rebase and q0.shape == (self.n_q - 4,):
            q0 = np.concatenate([q0, [1.0, 0.0, 0.0, 0.0]])
        set_(self, "q0", self._rest_coordinates() if q0.size == 0 else _sized(q0, self.n_q, "q0", self.label))
        for key in ("stiffness", "damping"):
            if np.any(getattr(self, key) < 0):
                raise ValueError(f"{key} of joint {self.label!r} is negative: {getattr(self, key).tolist()}")
        if not (np.isfinite(self.play) and self.play >= 0.0):
            raise ValueError(f"play of joint {self.label!r} is {self.play} m; expected a length, zero for none")
        motion = tuple(Profile.constant(m) if isinstance(m, int | float) else m for m in self.motion)
        set_(self, "motion", motion)
        names = [name.rpartition(".")[2] for name in self.freedom_names()]
        set_(self, "laws", tuple(law.with_freedom_of(names) for law in self.laws))
        set_(self, "latches", tuple(latch.with_freedom_of(names) for latch in self.latches))
        q0, u0 = started_motion(self)
        set_(self, "q0", q0)
        set_(self, "u0", u0)
        check_laws(self)

    def summary(self) -> tuple[str, Rows]:
        """Return a text: the bodies that it connects, its freedoms and their laws."""
        rows = [("parent", f"{self.parent or 'base frame'}, marker {self.parent_marker}")]
        rows += [("child", f"{self.child}, marker {self.child_marker}")]
        rows += [("freedoms", listed(self.freedom_names()))] if self.n_u else []
        numbers = {"stiffness": self.stiffness, "damping": self.damping, "q0": self.q0, "u0": self.u0}
        rows += [(key, ", ".join(f"{x:.6g}" for x in value)) for key, value in numbers.items() if value.any()]
        rows += [("specified", listed([self.freedom_names()[k] for k in self.prescribed]))] if self.prescribed else []
        rows += [("laws", listed(self.law_names()))] if self.laws else []
        rows += [("latches", str(len(self.latches)))] if self.latches else []
        return f"{self.kind.capitalize()} joint {self.label!r}", rows

    @property
    def label(self) -> str:
        """The joint's name, or "parent-child"."""
        return self.name or f"{self.parent or 'base'}-{self.child}"

    @property
    def n_q(self) -> int:
        """Number of coordinates."""
        turns = len(self.rotations) if self.ball is None else (4 if self.ball == EULER_PARAMETERS else 3)
        return len(self.translations) + turns + (4 if self.rebase else 0)

    @property
    def n_u(self) -> int:
        """Number of quasi-velocities, the joint's degrees of freedom."""
        return len(self.translations) + (len(self.rotations) if self.ball is None else 3)

    @property
    def prescribed(self) -> dict[int, Profile]:
        """The freedoms that are locked or specified, by number, with their motion."""
        return {k: profile for k, profile in enumerate(self.motion) if isinstance(profile, Profile)}

    @property
    def locking(self) -> tuple[Latch, ...]:
        """The latches that lock by an impact."""
        return tuple(latch for latch in self.latches if latch.rigid)

    def law_names(self) -> list[str]:
        """Name of each law: its own, or as in "hinge.stop", numbered when there are several."""
        plain = [law.name or f"{self.label}.{law.kind}" for law in self.laws]
        return [f"{n}{plain[: k + 1].count(n)}" if plain.count(n) > 1 else n for k, n in enumerate(plain)]

    def state_names(self) -> list[tuple[str, str]]:
        """Name and unit of each state of its latches: when it locked (-1: it has not), and the energy that was lost."""
        names = [f"{self.label}.latch{'' if len(self.latches) == 1 else k + 1}" for k in range(len(self.latches))]
        return [pair for name in names for pair in ((f"{name}_time", "s"), (f"{name}_loss", "J"))]

    def initial_states(self) -> Array:
        """Return the initial states of its latches (2 n_latches,): open, except for latches that wait to be opened."""
        return np.array([OPEN if latch.opens is None else SHUT for latch in self.latches]).ravel()

    def freedom_names(self) -> list[str]:
        """Return the name of each quasi-coordinate, as in "hinge.angle"; a ball's are those of its rates."""
        return [name.removesuffix("_rate") for name, _ in self.velocity_names()]

    def coordinate_names(self) -> list[tuple[str, str]]:
        """Name and unit of each coordinate."""
        return coordinate_names(self)

    def velocity_names(self) -> list[tuple[str, str]]:
        """Name and unit of each quasi-velocity."""
        return velocity_names(self)

    def with_initial(self, q0: Array | None = None, u0: Array | None = None) -> Joint:
        """A copy with other initial coordinates (n_q,) or quasi-velocities (n_u,)."""
        return replace(
            self,
            q0=self.q0 if q0 is None else np.asarray(q0, float),
            u0=self.u0 if u0 is None else np.asarray(u0, float),
        )

    def ball_slice(self) -> slice:
        """Return the slice of the coordinates of the ball in q of the joint, without those of its reference."""
        first = len(self.translations)
        return slice(first, first + (4 if self.ball == EULER_PARAMETERS else 3))

    def singular_start(self) -> str | None:
        """Return the message that the joint starts at the singularity of its set or turns, "" if it does not."""
        if self.ball is None:
            return locked_start_text(self)
        return singular_start(self.ball, self.q0[self.ball_slice()], self.label)

    def _rest_coordinates(self) -> Array:
        ball = np.zeros(len(self.rotations))
        if self.ball is not None:
            ball = ball_coordinates(self.ball, "xyz", np.zeros(3), self.rebase)
        return np.concatenate([np.zeros(len(self.translations)), ball])


def _unit_rows(axes: Array, what: str, label: str) -> Array:
    axes = np.asarray(axes, float).reshape(-1, 3)
    length = np.linalg.norm(axes, axis=1, keepdims=True)
    if np.any(length == 0) or not np.all(np.isfinite(axes)):
        raise ValueError(f"a {what} axis of joint {label!r} has no direction: {axes.tolist()}")
    return axes / length


def _sized(value: Array, size: int, key: str, label: str) -> Array:
    value = np.asarray(value, float)
    if value.size == 0:
        return np.zeros(size)
    if value.ndim == 0:
        return np.full(size, float(value))
    if value.shape != (size,):
        raise ValueError(f"{key} of joint {label!r} has {value.size} values; the joint needs {size}")
    return value


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
