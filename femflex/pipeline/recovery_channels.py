"""Channels of section forces and stresses at points of bodies that a case names, recovered from the amplitudes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array
from femflex.noun.problems import CaseError, Problem
from femflex.system.channel import Channel

if TYPE_CHECKING:
    from femflex.body.recovery import NearestPoint
    from femflex.case import Case
    from femflex.system import System


@dataclass(frozen=True, eq=False)
class RecoveryChannels:
    """Channels by path; and for each its point and quantity, with the path of the amplitudes that give its values."""

    channels: dict[str, Channel]
    points: dict[str, tuple[NearestPoint, str]]

    def values(self, channels: Mapping[str, Array]) -> dict[str, Array]:
        """The recovery channels (n_t, ...) at instants (n_t,) [s], from the channels of amplitudes there."""
        return {path: point.values(np.asarray(channels[source])) for path, (point, source) in self.points.items()}


def recovery_channels(case: Case, system: System) -> RecoveryChannels:
    """The channels of the tables [bodies.<name>.recovery] of a case, `recovery/BODY.PLACE/QUANTITY`.

    Raises CaseError for quantities that a body does not have, and for bodies without elements to recover stress from.
    """
    channels: dict[str, Channel] = {}
    points: dict[str, tuple[NearestPoint, str]] = {}
    problems: list[Problem] = []
    for name, table in case.bodies.items():
        for point_name, entry in table.recovery.items():
            where = f"bodies.{name}.recovery.{point_name}"
            try:
                nearest = _points(system, name, entry)
            except ValueError as error:
                problems.append(Problem(where, str(error)))
                continue
            for point, owner in nearest:
                path = f"recovery/{name}.{point_name}/{point.name}"
                position = ", ".join(f"{c:.4g}" for c in point.position)
                channels[path] = Channel(point.unit, f"{point.name} of {owner} at ({position}) m of its frame")
                points[path] = point, f"bodies/{owner}/delta"
    if problems:
        raise CaseError(case.path.name, problems)
    return RecoveryChannels(channels, points)


def _points(system: System, name: str, entry: Any) -> list[tuple[NearestPoint, str]]:
    """The nearest point for each quantity, with its body or, for a body cut into segments, its segment."""
    from femflex.body.recovery import NearestPoint, quantities

    body_names = [body_name for body_name in system.bodies if body_name == name or body_name.startswith(f"{name}.")]
    parts = {body_name: getattr(system.bodies[body_name], "strain_field", ()) for body_name in body_names}
    available = {key for field in parts.values() for key in quantities(field)}
    if not available:
        raise ValueError("found a body without elements or functions that strain; take it out")
    if unknown := [body_name for body_name in entry.quantities or () if body_name not in available]:
        raise ValueError(f"found the quantity {unknown[0]!r}, which the body does not have; it has {sorted(available)}")
    points = []
    for quantity in entry.quantities or sorted(available):
        body_name = [
            (NearestPoint.find(field, quantity, entry.position), owner)
            for owner, field in parts.items()
            if quantity in quantities(field)
        ]
        away = [float(np.linalg.norm(point.position - np.asarray(entry.position))) for point, _ in body_name]
        points.append(body_name[int(np.argmin(away))])
    return points
