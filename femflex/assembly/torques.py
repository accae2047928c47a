"""Refuse torques at markers whose nodes have no rotation: such a torque would not deform the body."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress

import numpy as np

from femflex.arrays import Array
from femflex.case.body import BodyTable
from femflex.case.case import Case
from femflex.fem import Structure
from femflex.noun.problems import CaseError, Problem
from femflex.reduction.boundary.markers import MarkerRows, marker_rows
from femflex.system import Load

NEGLIGIBLE = 1e-9  # share of a torque about axes without rotation that is rounding of its direction


def check_torques(case: Case, name: str, groups: Mapping[str, str], structure: Structure) -> None:
    """Raise CaseError for torques on a body about axes about which their markers have no rotation.

    groups: mesh group of each marker. In frames that do not rotate with the body a torque may point along any axis: it
    is refused only if the marker has no rotation at all.
    """
    problems = []
    for load in torque_loads(case, name):
        if load.marker in groups:
            rows = marker_rows(structure, groups[load.marker])
            if text := _lost_torque_text(load, rows, case.bodies[name]):
                problems.append(Problem(f"loads[{load.name}].torque", text))
    if problems:
        raise CaseError(case.path.name, problems)


def torque_loads(case: Case, name: str) -> Iterator[Load]:
    """The loads on a body that have a torque. Loads that cannot be read are reported by `problems_of_loads`."""
    for load in case.loads:
        with suppress(ValueError, OSError):
            if load.body == name and (torque_load := load.read_from(case.path.parent)).torque.any():
                yield torque_load


def _lost_torque_text(load: Load, rows: MarkerRows, table: BodyTable) -> str:
    """The message on a torque about axes about which its marker has no rotation; empty if there is none."""
    blind = rows.blind
    if not blind.shape[1]:
        return ""
    axes = np.eye(3)
    if load.frame == "marker" and (entry := table.markers.get(load.marker)) is not None and entry.orientation:
        axes = np.array(entry.orientation)
    along = np.atleast_2d(load.torque) @ axes.T @ blind
    if load.frame not in ("body", "marker"):
        along = along if blind.shape[1] == 3 else 0.0 * along
    largest = float(np.linalg.norm(along, axis=1).max())
    if largest <= NEGLIGIBLE * float(np.linalg.norm(np.atleast_2d(load.torque), axis=1).max()):
        return ""
    reason = "shows no rotation" if blind.shape[1] == 3 else f"shows no rotation about {_axes(blind)}"
    return (
        f"found {largest:.4g} N m at marker {load.marker!r} of body {load.body!r}, which {reason}: its nodes have no "
        "rotational degrees of freedom and lie at one point or on one line, so the torque would deform nothing. Name a "
        f"group of several nodes around this point (markers.{load.marker} = {{ group = ... }})"
    )


def _axes(blind: Array) -> str:
    blind = blind * np.sign(blind[np.abs(blind).argmax(axis=0), np.arange(blind.shape[1])])
    return " and ".join(f"[{', '.join(f'{x + 0.0:.3g}' for x in axis)}]" for axis in np.round(blind.T, 12))
