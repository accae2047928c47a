"""Section forces and stresses at points of bodies that a case names: channels of the run, of the amplitudes alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array
from femflex.case.problems import CaseError, Problem
from femflex.system.channel import Channel

if TYPE_CHECKING:
    from femflex.body.recovery import NearestPoint
    from femflex.case import Case
    from femflex.system import System


@dataclass(frozen=True, eq=False)
class Recovered:
    """Channels by path, and the point with the quantity of each and the path of the amplitudes it follows from."""

    channels: dict[str, Channel]
    points: dict[str, tuple[NearestPoint, str]]

    def values(self, seen: Mapping[str, Array]) -> dict[str, Array]:
        """The channels (n_t, ...) at some instants (n_t,) [s], from the others there."""
        return {path: point.values(np.asarray(seen[source])) for path, (point, source) in self.points.items()}


def recovered(case: Case, system: System) -> Recovered:
    """What the tables [bodies.<name>.recovery] of a case name, `recovery/BODY.PLACE/QUANTITY`.

    Raises CaseError with all quantities that a body does not have, and bodies without elements to recover stress from.
    """
    channels: dict[str, Channel] = {}
    points: dict[str, tuple[NearestPoint, str]] = {}
    problems: list[Problem] = []
    for name, table in case.bodies.items():
        for place, entry in table.recovery.items():
            where = f"bodies.{name}.recovery.{place}"
            try:
                found = _points(system, name, entry)
            except ValueError as error:
                problems.append(Problem(where, str(error)))
                continue
            for point, owner in found:
                path = f"recovery/{name}.{place}/{point.name}"
                at = ", ".join(f"{c:.4g}" for c in point.position)
                channels[path] = Channel(point.unit, f"{point.name} of {owner} at ({at}) m of its frame")
                points[path] = point, f"bodies/{owner}/delta"
    if problems:
        raise CaseError(case.path.name, problems)
    return Recovered(channels, points)


def _points(system: System, name: str, entry: Any) -> list[tuple[NearestPoint, str]]:
    """The point of each quantity, with its body: of one that is cut into segments, the segment it lies in."""
    from femflex.body.recovery import NearestPoint, quantities

    own = [each for each in system.bodies if each == name or each.startswith(f"{name}.")]
    parts = {each: getattr(system.bodies[each], "strain_field", ()) for each in own}
    known = {key for field in parts.values() for key in quantities(field)}
    if not known:
        raise ValueError("found a body without elements or functions that strain; take it out")
    if unknown := [each for each in entry.quantities or () if each not in known]:
        raise ValueError(f"found the quantity {unknown[0]!r}, which the body does not have; it has {sorted(known)}")
    found = []
    for quantity in entry.quantities or sorted(known):
        each = [
            (NearestPoint.find(field, quantity, entry.position), owner)
            for owner, field in parts.items()
            if quantity in quantities(field)
        ]
        away = [float(np.linalg.norm(point.position - np.asarray(entry.position))) for point, _ in each]
        found.append(each[int(np.argmin(away))])
    return found
