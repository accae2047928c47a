"""Markers that the parts of a case name are on their bodies."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from femflex.case.body import BodyTable, FileTable, FlexibleTable
from femflex.case.matrices import MatricesTable
from femflex.case.outline import Outline
from femflex.case.problems import Problem, near
from femflex.case.tree import loose_bodies


def known_markers(body: BodyTable | None) -> set[str] | None:
    """Marker names of a body as far as the case file tells; None when only its file knows."""
    if body is None or isinstance(body, FileTable):
        return None
    known = {"origin", *body.markers}
    if isinstance(body, FlexibleTable | MatricesTable):
        known |= {*getattr(body.reduction, "clamp", {}), *getattr(body.reduction, "interfaces", [])}
    return known | set(body.own_markers())


def markers(outline: Outline, folder: Path) -> Iterator[Problem]:
    """Markers of joints, loads, sights, attitude and initial states are on their bodies."""
    places: list[tuple[str, str | None, str | None]] = []
    for where, joint in [*outline.joints.items(), *outline.loops.items()]:
        if joint is not None:
            places.append((f"{where}.child_marker", joint.child, joint.child_marker))
            if joint.parent != joint.child:
                places.append((f"{where}.parent_marker", joint.parent, joint.parent_marker))
    for where, load in outline.loads.items():
        if load is not None:
            if load.body not in outline.bodies:
                yield Problem(
                    f"{where}.body", f"found {load.body!r}, which is not a body; {near(load.body, outline.bodies)}"
                )
            places.append((f"{where}.marker", load.body, load.marker))
    places += [(f"{where}.marker", one.body, one.marker) for where, one in outline.sights.items() if one is not None]
    for where, one in outline.mounted.items():
        pairs = () if one is None else (("body", "marker"), ("other_body", "other_marker"), ("parent", "parent_marker"))
        for role, marker_key in pairs:
            named = getattr(one, role, None)
            if named is not None and named not in outline.bodies:
                yield Problem(f"{where}.{role}", f"found {named!r}, which is not a body; {near(named, outline.bodies)}")
            places.append((f"{where}.{marker_key}", named, getattr(one, marker_key, None)))
    for where, item in outline.between.items():
        if item is not None:
            places += [
                (f"{where}.marker", item.body, item.marker),
                (f"{where}.parent_marker", item.parent, item.parent_marker),
            ]
    for name, body in outline.bodies.items():
        if body is not None and body.initial is not None:
            places.append((f"bodies.{name}.initial.marker", name, body.initial.marker))
    loose = loose_bodies(outline)
    if outline.attitude is not None and loose:
        places.append(("attitude.marker", outline.attitude.root or loose[0], outline.attitude.marker))
    for where, owner, marker in places:
        known = known_markers(outline.bodies.get(owner or ""))
        if marker is not None and known is not None and marker not in known:
            text = f"found {marker!r}, which is no marker of body {owner!r}; {near(marker, known)}"
            yield Problem(where, text + _as_group(outline.bodies.get(owner or ""), owner, marker, folder))


def _as_group(body: BodyTable | None, owner: str | None, marker: str, folder: Path) -> str:
    """The advice to declare a marker whose name is that of a group of the body's mesh."""
    if not isinstance(body, FlexibleTable) or body.mesh is None or not os.path.isfile(folder / body.mesh):
        return ""
    from femflex.mesh import read_mesh

    try:
        groups = {*read_mesh(folder / body.mesh).groups, *body.groups}
    except (ValueError, OSError):  # reported where the mesh is read
        return ""
    if marker not in groups:
        return ""
    return f". {body.mesh} has a group of that name: declare it, markers.{marker} = {{}} in [bodies.{owner}]"
