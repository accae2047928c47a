"""What every joint of a case says: where it leads from and to, its laws, and which coordinates are held."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import model_validator

from femflex.case.base import Name, Table, exactly_one, refuse
from femflex.case.law import Laws, read_laws
from femflex.case.motion import Motion
from femflex.case.values import Quantity, ValueProblem

SLIDE_SPRINGS, SPRINGS = ("slide_stiffness", "slide_damping"), ("stiffness", "damping")
# key of `motion`, key of the initial value, what must not act on a held coordinate
HELD_KEYS = (
    ("angle", "angle", SPRINGS),
    ("angles", "angles", SPRINGS),
    ("position", "position", SLIDE_SPRINGS),
)
RATES = {"angle": "rate", "angles": "rates", "position": "velocity"}


class ReleaseTable(Table):
    """A signal that rises above, or falls below, a value."""

    signal: str
    """Signal of one number, such as the output "gauge.strain" of a sensor."""
    above: Annotated[float | None, Quantity()] = None
    """Value in SI units above which the joint lets go."""
    below: Annotated[float | None, Quantity()] = None
    """Value in SI units below which the joint lets go."""

    @model_validator(mode="after")
    def _fits(self) -> ReleaseTable:
        exactly_one(self, ("above", "below"))
        return self


class JointTable(Table):
    """What every joint says: it leads from a marker of the parent to a marker of the child."""

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
    laws: Annotated[tuple[Mapping[str, Any], ...], Laws()] = ()
    """[[joints.laws]]: spring and damper tables, stops, friction and latches of single coordinates."""

    release: Annotated[float, Quantity("s", least=0.0)] | None = None
    """Time at which the joint lets go: its slides and turns are locked until then, and free afterwards. For joints of
    slides and turns, such as general. Default: not locked."""
    release_at: ReleaseTable | None = None
    """Signal at whose value the joint lets go, in place of a time."""

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every slide and turn that a law may act on."""
        return {}

    @model_validator(mode="after")
    def _laws_fit(self) -> JointTable:
        exactly_one(self, ("release", "release_at"), required=False)
        try:
            laws, latches = read_laws(self.laws, self.coordinates())
        except ValueProblem as problem:
            refuse(str(problem))
        slides = sum(unit == "m" for unit in self.coordinates().values())
        held = [*(self.motions("position") or (None,) * slides), *(self.motions("angle") or self.motions("angles"))]
        names = list(self.coordinates())
        for kind, k in [*((law.kind, law.freedom) for law in laws), *(("latch", latch.freedom) for latch in latches)]:
            if k < len(held) and held[k] is not None:
                refuse(f"found a {kind} on {names[k]!r}, whose motion is prescribed; it has no effect, so remove it")
        return self

    def motions(self, key: str) -> tuple[Motion | None, ...]:
        """Motion of each coordinate under that key of `motion`; () when all are free."""
        found = getattr(getattr(self, "motion", None), key, None)
        return found if isinstance(found, tuple) else (found,) if found is not None else ()

    @model_validator(mode="after")
    def _held_freedoms_are_only_held(self) -> JointTable:
        for key, begins, others in HELD_KEYS:
            for k, motion in enumerate(self.motions(key)):
                if motion is not None:
                    self._refuse_with_motion(key, k, motion, begins, others)
        return self

    def _refuse_with_motion(self, key: str, k: int, motion: Motion, begins: str, others: tuple[str, ...]) -> None:
        """Refuse initial values, springs and dampers of coordinate k, which is held."""
        held = "locked" if motion.locked else "prescribed"
        for other in (begins, RATES[begins], *others):
            value = getattr(self, other, 0.0)
            entry = value if isinstance(value, float) else value[k] if k < len(value) else 0.0
            given = other in self.model_fields_set and (entry != 0.0 or isinstance(value, float))
            if not given or (other == begins and motion.locked):
                continue
            if other in others:
                refuse(f"found {other} for a coordinate that is {held} by motion.{key}; it has no effect, so remove it")
            refuse(f"found {other} for a coordinate that is {held} by motion.{key}; the motion sets its initial value")

    @model_validator(mode="after")
    def _base_has_one_marker(self) -> JointTable:
        if self.parent is None and self.parent_marker != "origin":
            refuse(f"found parent_marker {self.parent_marker!r} without a parent; the base frame has only its origin")
        return self
