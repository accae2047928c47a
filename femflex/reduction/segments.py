"""Reduce the segments of a cut member to floating bodies that can be welded end to end."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker
from femflex.fem.line.segments import ENDS, FAR, NEAR, Segment
from femflex.fem.structure import Structure, build_structure
from femflex.mesh.regions import WHOLE_GROUPS
from femflex.reduction.modes.craig_bampton import craig_bampton
from femflex.reduction.modes.damping import Damping
from femflex.reduction.modes.vibration import ModeSet
from femflex.reduction.reduce import reduce_structure
from femflex.reduction.strain.initial_stress import relaxed


def chord_modes(structure: Structure, n: int = 0) -> ModeSet:
    """The set of a segment between its ends: six static shapes and the n lowest modes with both ends fixed.

    The body frame follows the chord, the line between the ends, so that a segment bent by an angle theta errs by
    theta^2/24 of its length, a quarter of what it would in a frame that follows one end; with k segments the error of
    large deflections falls as 1/k^2.
    """
    return craig_bampton(structure, (NEAR, FAR), n, reference=ENDS)


def reduce_segments(
    segments: Sequence[Segment],
    markers: Mapping[str, str] | None = None,
    modes: Callable[[Structure], ModeSet] = chord_modes,
    damping: Damping | None = None,
    strain: Literal["linear", "nonlinear", "condensed"] = "linear",
    patches: Sequence[str] = (),
) -> tuple[FlexibleBody, ...]:
    """One FlexibleBody per segment, in the frame of the whole mesh, with markers NEAR and FAR at its ends.

    markers  name -> group of the whole mesh; each belongs to the first segment that contains the whole group
    modes    shapes of a segment's Structure (see chord_modes, which is the default)
    strain, patches  see `reduce_structure`; a segment has the patches of the groups that it is part of
    The first segment's "origin" is rigidly connected to its near end.
    Raises ValueError for a group that no segment contains.
    """
    groups = dict(markers or {})
    segment_markers = [{NEAR: NEAR, FAR: FAR} for _ in segments]
    for name, group in groups.items():
        candidates = [j for j, segment in enumerate(segments) if group in segment.groups]
        if not candidates:
            raise ValueError(
                f"marker {name!r} needs group {group!r}, whose points are on several of the {len(segments)} segments, "
                "or off the member; name a group of points of one segment"
            )
        segment_markers[candidates[0]][name] = group
    bodies = []
    for segment, of_segment in zip(segments, segment_markers, strict=True):
        structure = build_structure(segment.mesh, segment.members, segment.point_masses)
        structure = relaxed(structure)  # welded end to end, it has no supports
        shapes = modes(structure)
        own = [group for group in patches if group in WHOLE_GROUPS or group in segment.mesh.cell_groups]
        bodies.append(reduce_structure(structure, shapes, of_segment, damping, strain, patches=own))
    first = bodies[0]
    bodies[0] = replace(first, markers={**first.markers, "origin": rigidly_offset(first.markers[NEAR], np.zeros(3))})
    return tuple(bodies)


def rigidly_offset(marker: Marker, position: Array) -> Marker:
    """A marker at another undeformed position (3,) [m], rigidly connected to the given marker."""
    arm = position - marker.position
    phi = marker.phi + np.cross(marker.psi, arm, axisa=0, axisb=0, axisc=0)
    return Marker(position, phi, marker.psi, axis=marker.axis)
