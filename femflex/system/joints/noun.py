"""Common parts of all joints of a case: markers, laws, prescribed coordinates, and the Joint that they describe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.noun.table import Name, Table, exactly_one, refuse
from femflex.noun.values import Quantity, ValueProblem, Vector
from femflex.system.joint import Joint
from femflex.system.joint_coordinates import latch_start_problems
from femflex.system.latch import Latch, Threshold
from femflex.system.law import JointLaw, Law, LawTables, read_law
from femflex.system.motion import Motion

Axes = tuple[Vector, ...]
RATES = {"angle": "rate", "angles": "rates", "position": "velocity"}  # key of initial values, key of their rates
SPRINGS = ("stiffness", "damping", "rest")
BALLS = ("spherical", "free")


class ReleaseTable(Table):
    """A signal that rises above, or falls below, a value."""

    signal: str
    """Signal of one number, such as the output "gauge.strain" of a sensor."""
    above: Annotated[float | None, Quantity()] = None
    """Value in SI units above which the joint lets go."""
    below: Annotated[float | None, Quantity()] = None
    """Value in SI units below which the joint lets go."""

    @model_validator(mode="after")
    def _one_limit(self) -> ReleaseTable:
        exactly_one(self, ("above", "below"))
        return self

    @property
    def threshold(self) -> Threshold:
        """The Threshold on the result channel of the signal "NAME.OUTPUT"."""
        return Threshold("effectors/" + self.signal.replace(".", "/", 1), self.above, self.below)


class JointNoun(Table):
    """Keys that all joints share; a joint leads from a marker of the parent to a marker of the child."""

    kind: str
    """Kind of the joint."""
    child: str
    """Body that the joint carries."""
    parent: str | None = None
    """Body that carries the joint. Default: the base frame of [attitude]."""
    child_marker: str = "origin"
    """Marker of the child at the joint."""
    parent_marker: str = "origin"
    """Marker of the parent at the joint; its axes are the joint's axes."""
    name: Name = ""
    """Name in channels and messages. Default: "parent-child"."""
    play: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Assembly tolerance of a loop with redundant constraints, for lengths and axes given with few digits. A misfit up
    to it is moved into the loop's marker and reported; a larger one stops the run. Loops only."""
    laws: Annotated[tuple[JointLaw, ...], LawTables()] = ()
    """[[joints.laws]]: spring and damper tables, stops, friction and latches of single coordinates."""

    release: Annotated[float, Quantity("s", least=0.0)] | None = None
    """Time at which the joint lets go: its translations and rotations are locked until then, and free afterwards. For
    joints that have some, such as general. Default: not locked."""
    release_at: ReleaseTable | None = None
    """Signal at whose value the joint lets go, in place of a time."""

    of_slides: ClassVar[str] = "slide_"  # begins the keys of springs and dampers of slides

    @property
    def ball(self) -> str | None:
        """Rotation set of a joint that turns freely."""
        return None

    @property
    def slide_axes(self) -> Axes:
        """Axes of its slides, in the axes of the parent's marker."""
        return ()

    @property
    def turn_axes(self) -> Axes:
        """Axes of its turns, each turned by those before it."""
        return ()

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every translation and rotation that a law may act on, as in a Joint."""
        axes = (("slide", "m", self.slide_axes), ("angle", "rad", self.turn_axes))
        return {
            name + (str(k + 1) if len(of_kind) > 1 else ""): unit
            for name, unit, of_kind in axes
            for k in range(len(of_kind))
        }

    def ball_coordinates(self) -> Array:
        """The initial coordinates of its rotation set, if it has one."""
        return np.zeros(0)

    def joint(self, folder: Path = Path()) -> Joint:
        """The Joint, of a case in that folder. Raises ValueError where its motion, latches or release do not fit."""
        keys = {"q0": (("position",), ("angle", "angles")), "u0": (("velocity",), ("rate", "rates"))}
        numbers: dict[str, Any] = {key: self._values(*of_both) for key, of_both in keys.items()}
        numbers |= {key: self._values((self.of_slides + key,), (key,)) for key in SPRINGS}
        if self.ball is not None:
            numbers["q0"] = np.concatenate([numbers["q0"][: len(self.slide_axes)], self.ball_coordinates()])
        joint = Joint(
            self.child,
            self.parent,
            self.child_marker,
            self.parent_marker,
            self.name,
            translations=np.reshape(self.slide_axes, (-1, 3)),
            rotations=np.reshape(self.turn_axes, (-1, 3)),
            ball=self.ball,
            rebase=self.ball is not None and getattr(self, "rebase", False),
            kind="general" if self.kind in BALLS and self.ball is None else self.kind,
            play=self.play,
            **numbers,
        )
        joint = self._with_motion(joint, folder)
        latches = tuple(law for law in self.laws if isinstance(law, Latch))
        laws = tuple(law for law in self.laws if isinstance(law, Law))
        joint = _with_checked_latches(replace(joint, laws=laws, latches=latches) if self.laws else joint)
        if self.release is None and self.release_at is None:
            return joint
        if joint.ball is not None or not joint.n_u or joint.prescribed or latches:
            raise ValueError(
                f"found release on a joint of kind {self.kind!r}; a release needs a joint of slides and single turns "
                "without prescribed motion and latches, such as kind = 'general'"
            )
        opens = self.release if self.release_at is None else self.release_at.threshold
        locks = tuple(Latch(coordinate=k, at=float(start), opens=opens) for k, start in enumerate(joint.q0))
        return _with_checked_latches(replace(joint, latches=locks))

    def _values(self, of_slides: Sequence[str], of_turns: Sequence[str]) -> Array:
        """The numbers of the first of the keys that the joint has, for its slides and for its turns; zeros if none."""
        values = []
        n_turns = len(self.turn_axes) if self.ball is None else 3
        for keys, n in ((of_slides, len(self.slide_axes)), (of_turns, n_turns)):
            value = next((getattr(self, key) for key in keys if hasattr(self, key)), ())
            values.append(np.broadcast_to(np.asarray(value if np.size(value) and n else 0.0, float), n))
        return np.concatenate(values)

    def _with_motion(self, joint: Joint, folder: Path) -> Joint:
        """The joint with its prescribed motions."""
        motion = [
            None if m is None else float(joint.q0[k]) if m.locked else m.profile(folder) if m.profile else None
            for k, m in enumerate(self._all_motions())
        ]
        return replace(joint, motion=tuple(motion)) if any(m is not None for m in motion) else joint

    def _all_motions(self) -> tuple[Motion | None, ...]:
        """Motion of each freedom."""
        n_turns = len(self.turn_axes) if self.ball is None else 3
        slides = self.motions("position") or (None,) * len(self.slide_axes)
        return (*slides, *(self.motions("angle") or self.motions("angles") or (None,) * n_turns))

    @model_validator(mode="after")
    def _laws_fit(self) -> JointNoun:
        exactly_one(self, ("release", "release_at"), required=False)
        units, laws = self.coordinates(), []
        for k, table in enumerate(self.laws, start=1):
            try:
                laws.append(read_law(table, units))
            except ValueProblem as problem:
                refuse(f"laws: entry {k}: {problem}")
        vars(self)["laws"] = tuple(laws)
        prescribed = [k for k, motion in enumerate(self._all_motions()) if motion is not None]
        for law in laws:
            if law.freedom in prescribed:
                name = list(units)[law.freedom]
                refuse(f"found a {law.kind} on {name!r}, whose motion is prescribed; it has no effect, so remove it")
        return self

    def motions(self, key: str) -> tuple[Motion | None, ...]:
        """Motion of each coordinate under that key of `motion`; () if all are free."""
        entry = getattr(getattr(self, "motion", None), key, None)
        return entry if isinstance(entry, tuple) else (entry,) if entry is not None else ()

    @model_validator(mode="after")
    def _prescribed_coordinates_have_no_other_keys(self) -> JointNoun:
        for key in RATES:
            prefix = self.of_slides if key == "position" else ""
            for k, motion in enumerate(self.motions(key)):
                if motion is not None:
                    self._refuse_other_keys(key, k, motion, (f"{prefix}stiffness", f"{prefix}damping"))
        return self

    def _refuse_other_keys(self, key: str, k: int, motion: Motion, force_keys: tuple[str, ...]) -> None:
        """Refuse initial values, springs and dampers of coordinate k, which is prescribed."""
        state = "locked" if motion.locked else "prescribed"
        for refused in (key, RATES[key], *force_keys):
            value = getattr(self, refused, 0.0)
            entry = value if isinstance(value, float) else value[k] if k < len(value) else 0.0
            is_present = refused in self.model_fields_set and (entry != 0.0 or isinstance(value, float))
            if not is_present or (refused == key and motion.locked):
                continue
            if refused in force_keys:
                refuse(
                    f"found {refused} for a coordinate that is {state} by motion.{key}; it has no effect, so remove it"
                )
            refuse(
                f"found {refused} for a coordinate that is {state} by motion.{key}; the motion sets its initial value"
            )

    @model_validator(mode="after")
    def _base_has_one_marker(self) -> JointNoun:
        if self.parent is None and self.parent_marker != "origin":
            refuse(f"found parent_marker {self.parent_marker!r} without a parent; the base frame has only its origin")
        return self


def _with_checked_latches(joint: Joint) -> Joint:
    """The joint itself. Raises ValueError if its latches do not fit its initial coordinates."""
    if problems := latch_start_problems(joint):
        raise ValueError("\n".join(problems))
    return joint
