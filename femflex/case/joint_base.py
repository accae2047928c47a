"""Keys that all joints share: markers, laws, and prescribed coordinates."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from femflex.noun.table import Name, Table, exactly_one, refuse
from femflex.noun.values import Quantity, ValueProblem
from femflex.system.law import JointLaw, LawTables, read_law
from femflex.system.motion import Motion

SLIDE_SPRINGS, SPRINGS = ("slide_stiffness", "slide_damping"), ("stiffness", "damping")
# key of `motion`, key of the initial value, keys that must not act on a prescribed coordinate
PRESCRIBED_KEYS = (
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
    def _one_limit(self) -> ReleaseTable:
        exactly_one(self, ("above", "below"))
        return self


class JointTable(Table):
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

    def coordinates(self) -> dict[str, str]:
        """Name and unit of every translation and rotation that a law may act on."""
        return {}

    @model_validator(mode="after")
    def _laws_fit(self) -> JointTable:
        exactly_one(self, ("release", "release_at"), required=False)
        units, laws = self.coordinates(), []
        for k, table in enumerate(self.laws, start=1):
            try:
                laws.append(read_law(table, units))
            except ValueProblem as problem:
                refuse(f"laws: entry {k}: {problem}")
        vars(self)["laws"] = tuple(laws)
        slides = sum(unit == "m" for unit in units.values())
        prescribed = [
            *(self.motions("position") or (None,) * slides),
            *(self.motions("angle") or self.motions("angles")),
        ]
        for law in laws:
            if law.freedom < len(prescribed) and prescribed[law.freedom] is not None:
                name = list(units)[law.freedom]
                refuse(f"found a {law.kind} on {name!r}, whose motion is prescribed; it has no effect, so remove it")
        return self

    def motions(self, key: str) -> tuple[Motion | None, ...]:
        """Motion of each coordinate under that key of `motion`; () if all are free."""
        entry = getattr(getattr(self, "motion", None), key, None)
        return entry if isinstance(entry, tuple) else (entry,) if entry is not None else ()

    @model_validator(mode="after")
    def _prescribed_coordinates_have_no_other_keys(self) -> JointTable:
        for key, initial_key, force_keys in PRESCRIBED_KEYS:
            for k, motion in enumerate(self.motions(key)):
                if motion is not None:
                    self._refuse_other_keys(key, k, motion, initial_key, force_keys)
        return self

    def _refuse_other_keys(
        self, key: str, k: int, motion: Motion, initial_key: str, force_keys: tuple[str, ...]
    ) -> None:
        """Refuse initial values, springs and dampers of coordinate k, which is prescribed."""
        state = "locked" if motion.locked else "prescribed"
        for refused in (initial_key, RATES[initial_key], *force_keys):
            value = getattr(self, refused, 0.0)
            entry = value if isinstance(value, float) else value[k] if k < len(value) else 0.0
            is_present = refused in self.model_fields_set and (entry != 0.0 or isinstance(value, float))
            if not is_present or (refused == initial_key and motion.locked):
                continue
            if refused in force_keys:
                refuse(
                    f"found {refused} for a coordinate that is {state} by motion.{key}; it has no effect, so remove it"
                )
            refuse(
                f"found {refused} for a coordinate that is {state} by motion.{key}; the motion sets its initial value"
            )

    @model_validator(mode="after")
    def _base_has_one_marker(self) -> JointTable:
        if self.parent is None and self.parent_marker != "origin":
            refuse(f"found parent_marker {self.parent_marker!r} without a parent; the base frame has only its origin")
        return self
