"""Bodies that a joint holds elsewhere than their shapes are clamped, or where the clamp leaves them free to turn."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping

import numpy as np

from femflex.assembly.structures import support_of
from femflex.body import FlexibleBody
from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.case.reduction import CantileverTable
from femflex.case.support import DIRECTIONS
from femflex.warning import PhysicsWarning

DUST = 1e-9  # of a marker's largest motion in the shapes, below which a component of it is rounding


def warn_of_bodies_held_elsewhere(case: Case, bodies: Mapping[str, FlexibleBody]) -> None:
    """Warn of a joint that holds a body at a place that moves in its shapes, with nothing at their clamp.

    Shapes clamped at X and held at Y make a right model, but a stiff one: they know of no bending between the two
    but what a free end at Y does. Static shapes of loads at Y, or a joint at X, make it sound.
    """
    used: set[tuple[str | None, str]] = {(joint.child, joint.child_marker) for joint in case.joints}
    used |= {(joint.parent, joint.parent_marker) for joint in case.joints}
    for joint in case.joints:
        table, body = case.bodies.get(joint.child), bodies.get(joint.child)
        if not isinstance(table, FlexibleTable) or body is None or not isinstance(table.reduction, CantileverTable):
            continue
        clamps = list(table.reduction.clamp)
        held, clamp = body.markers.get(joint.child_marker), body.markers.get(clamps[0])
        at_clamp = any((joint.child, group) in used for group in clamps)
        if held is None or clamp is None or at_clamp or _group(table, joint.child_marker) in table.reduction.loads:
            continue
        distance = float(np.linalg.norm(held.position - clamp.position))
        if np.abs(held.phi).max(initial=0.0) == 0.0:
            continue
        omega = body.omega[np.isfinite(body.omega)]
        first = f"; its first frequency of {omega[0] / (2 * math.pi):.4g} Hz is that of the clamp" if len(omega) else ""
        warnings.warn(
            f"bodies.{joint.child}: its shapes are clamped at {clamps[0]!r}, but joint "
            f"{joint.name or f'{joint.parent}-{joint.child}'!r} holds it at {joint.child_marker!r}, {distance:.4g} m "
            f"away, and nothing is attached to {clamps[0]!r}{first}. Clamp {joint.child_marker!r}, or add its static "
            f"shapes (loads = {{ {_group(table, joint.child_marker)} = [...] }})",
            PhysicsWarning,
            stacklevel=3,
        )


def warn_of_supports_carried_along(case: Case, bodies: Mapping[str, FlexibleBody]) -> None:
    """Warn of a joint at one of several clamped groups whose own components leave some of its motion free.

    The joint turns the body with its marker, and with it the other groups, which the shapes hold still in its frame.
    """
    for joint in case.joints:
        table, body = case.bodies.get(joint.child), bodies.get(joint.child)
        if not isinstance(table, FlexibleTable) or body is None or not isinstance(table.reduction, CantileverTable):
            continue
        clamp, group = table.reduction.clamp, _group(table, joint.child_marker)
        others = [other for other in clamp if other != group]
        marker = body.markers.get(joint.child_marker)
        if not clamp.get(group) or not others or marker is None:
            continue
        support = support_of(clamp[group])
        axes = np.asarray(support.axes)
        rows = np.vstack([axes @ marker.phi, axes @ marker.psi])
        size = np.repeat([np.abs(part).max(initial=0.0) for part in (marker.phi, marker.psi)], 3)
        moves = np.abs(rows).max(axis=1, initial=0.0) > DUST * size
        free = [d for d, moved in zip(DIRECTIONS, moves, strict=True) if d not in support.components and moved]
        if free:
            supports, to = ", ".join(map(repr, others)), joint.parent or "the base frame"
            warnings.warn(
                f"bodies.{joint.child}: its joint to {to} holds it at "
                f"{joint.child_marker!r}, which its clamp leaves free in {', '.join(free)}: the body then moves with "
                f"that marker's own motion, and drags its other supports ({supports}) along, which are to stay where "
                f"they are. Drop child_marker = {joint.child_marker!r}, so that the joint holds the frame in which all "
                f"of its supports are still and the shapes keep that freedom, or clamp "
                f"{', '.join(free)} at {group!r} too",
                PhysicsWarning,
                stacklevel=3,
            )


def _group(table: FlexibleTable, marker: str) -> str:
    entry = table.markers.get(marker)
    return marker if entry is None or entry.group is None else entry.group
