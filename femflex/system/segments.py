"""Bodies cut into segments: the segments of a line member become bodies of a System, welded end to end.

Segment k of the body "boom" is the body "boom.k", counted from the near end. Joints, loads and markers go on naming
"boom": each goes to the segment that holds the marker.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from femflex.body import FlexibleBody, Marker
from femflex.noun.table import Table
from femflex.system.constraint import KnifeEdge, RollingDisc, VelocityRows
from femflex.system.effector import Effector
from femflex.system.joint import Joint
from femflex.system.kinds import weld
from femflex.system.load import Load
from femflex.system.sight import Sight
from femflex.system.spring import Spring

NEAR, FAR = ".near", ".far"  # markers at the ends of a segment


@dataclass(frozen=True, eq=False)
class Segments:
    """A body cut into segments, from near to far end: bodies in one common frame, with markers NEAR and FAR."""

    bodies: tuple[FlexibleBody, ...]

    def __post_init__(self) -> None:
        if not self.bodies:
            raise ValueError("a body cut into segments needs at least one; found none")
        for j, body in enumerate(self.bodies, start=1):
            for end in (NEAR, FAR):
                if end not in body.markers:
                    raise ValueError(f"segment {j} has no marker {end!r}; segments come from reduction.reduce_segments")

    @property
    def markers(self) -> dict[str, Marker]:
        """Markers by name; "origin" is that of the first segment, tied to its near end."""
        markers = {"origin": self.bodies[0].markers["origin"]}
        for body in self.bodies:
            markers |= {
                name: marker for name, marker in body.markers.items() if name != "origin" and not name.startswith(".")
            }
        return markers

    def holder(self, marker: str) -> int:
        """Return the number (from 0) of the segment with a marker. Raises KeyError with the known names."""
        if marker == "origin":
            return 0
        for j, body in enumerate(self.bodies):
            if marker in body.markers:
                return j
        raise KeyError(f"marker {marker!r} is not on the body; its markers are {sorted(self.markers)}")

    def marker(self, name: str) -> Marker:
        """The marker of that name."""
        return self.bodies[self.holder(name)].markers[name]

    def with_marker(self, name: str, marker: Marker, near_marker: str) -> Segments:
        """A copy with a marker on the segment that holds the marker `near_marker`."""
        j = self.holder(near_marker)
        bodies = list(self.bodies)
        bodies[j] = replace(bodies[j], markers={**bodies[j].markers, name: marker})
        return Segments(tuple(bodies))

    def with_body(self, marker: str, body: FlexibleBody) -> Segments:
        """Return a copy in which the segment with a marker is another body."""
        bodies = list(self.bodies)
        bodies[self.holder(marker)] = body
        return Segments(tuple(bodies))


Part = FlexibleBody | Segments
Tie = TypeVar("Tie", Joint, RollingDisc, KnifeEdge, VelocityRows, Spring, Sight)


def segment_name(body: str, j: int) -> str:
    """Name of segment j, counted from 0, of a body.

    >>> segment_name("boom", 0)
    'boom.1'
    """
    return f"{body}.{j + 1}"


def marker_label(segments: Mapping[str, tuple[str, ...]], body: str, marker: str) -> str:
    """Return the name of a marker in results: "boom.tip" also when it is on a segment of the boom."""
    owner = next((name for name, parts in segments.items() if body in parts), body)
    return f"{owner}.{marker}"


def with_segments(
    parts: Mapping[str, Part], joints: Sequence[Joint], loads: Sequence[Load] = ()
) -> tuple[dict[str, FlexibleBody], tuple[Joint, ...], tuple[Load, ...], dict[str, tuple[str, ...]]]:
    """Bodies, joints and loads with every cut body as welded segments, and the names of its segments.

    Raises KeyError when a joint or load names a marker that a cut body does not have.
    """
    cut = {name: part for name, part in parts.items() if isinstance(part, Segments)}
    names = {name: tuple(segment_name(name, j) for j in range(len(part.bodies))) for name, part in cut.items()}
    bodies: dict[str, FlexibleBody] = {}
    for name, part in parts.items():
        if isinstance(part, Segments):
            bodies |= dict(zip(names[name], part.bodies, strict=True))
        else:
            bodies[name] = part
    new_joints: list[Joint] = []
    for joint in joints:
        changes = {"name": joint.label} if {joint.child, joint.parent} & set(cut) else {}
        if joint.parent in cut:
            changes["parent"] = names[joint.parent][cut[joint.parent].holder(joint.parent_marker)]
        if joint.child in cut:
            clamped = cut[joint.child].holder(joint.child_marker)
            changes["child"] = names[joint.child][clamped]
            new_joints.append(replace(joint, **changes))  # type: ignore[arg-type]
            new_joints += welds(names[joint.child], clamped)
        else:
            new_joints.append(replace(joint, **changes) if changes else joint)  # type: ignore[arg-type]
    acting = tuple(
        load.model_copy(update={"body": body_with_marker(parts, load.body, load.marker)}) if load.body in cut else load
        for load in loads
    )
    return bodies, tuple(new_joints), acting, names


def with_segment_names(tie: Tie, parts: Mapping[str, Part]) -> Tie:
    """Return a loop, constraint, spring or sight with the segments of its markers in place of cut bodies."""
    changes: dict[str, Any] = {"name": tie.label} if isinstance(tie, Joint) else {}
    body = ("child", "child_marker") if isinstance(tie, Joint) else ("body", "marker")
    for key, marker in (body, ("parent", "parent_marker")):
        name: str = getattr(tie, key, None) or ""
        if isinstance(part := parts.get(name), Segments):
            changes[key] = segment_name(name, part.holder(getattr(tie, marker)))
    return tie.model_copy(update=changes) if isinstance(tie, Table) else replace(tie, **changes)


def effector_at_segments(effector: Effector, parts: Mapping[str, Part]) -> Effector:
    """Return an effector at the segments of its markers, in place of cut bodies."""
    markers = tuple((body_with_marker(parts, body, marker), marker) for body, marker in effector.markers)
    return effector if markers == effector.markers else replace(effector, markers=markers)


def body_with_marker(parts: Mapping[str, Part], body: str, marker: str) -> str:
    """Return the name of the body with a marker: a segment's, where the body is cut. Raises KeyError."""
    part = parts.get(body)
    return segment_name(body, part.holder(marker)) if isinstance(part, Segments) else body


def body_of_part(part: Part, marker: str) -> FlexibleBody:
    """Return the body with a marker: the whole, or a segment. Raises KeyError."""
    return part.bodies[part.holder(marker)] if isinstance(part, Segments) else part


def with_body_of_part(part: Part, marker: str, body: FlexibleBody) -> Part:
    """Return the part in which the body with a marker is another one."""
    return part.with_body(marker, body) if isinstance(part, Segments) else body


def welds(names: Sequence[str], clamped: int) -> list[Joint]:
    """Return welds between neighbours, leading away from the segment that is attached."""
    outward = [
        weld(names[j], names[j - 1], child_marker=NEAR, parent_marker=FAR) for j in range(clamped + 1, len(names))
    ]
    back = [weld(names[j], names[j + 1], child_marker=FAR, parent_marker=NEAR) for j in range(clamped - 1, -1, -1)]
    return [*outward, *back]
