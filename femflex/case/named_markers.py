"""Check that the markers to which a case refers are on their bodies."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from femflex.case.body import BodyTable, FileTable, FlexibleTable
from femflex.case.matrices import MatricesTable
from femflex.case.outline import Outline
from femflex.case.tree import bodies_without_joint
from femflex.noun.problems import Problem, suggestion_text


def known_markers(body: BodyTable | None) -> set[str] | None:
    """Marker names of a body as far as the case file defines them; None if only a body file does."""
    if body is None or isinstance(body, FileTable):
        return None
    names = {"origin", *body.markers}
    if isinstance(body, FlexibleTable | MatricesTable):
        names |= {*getattr(body.reduction, "clamp", {}), *getattr(body.reduction, "interfaces", [])}
    return names | set(body.built_in_markers())


def marker_problems(outline: Outline, folder: Path) -> Iterator[Problem]:
    """Problems of joints, loads, sights, attitude and initial states whose markers are not on their bodies."""
    references: list[tuple[str, str | None, str | None]] = []
    for key_path, joint in [*outline.joints.items(), *outline.loops.items()]:
        if joint is not None:
            references.append((f"{key_path}.child_marker", joint.child, joint.child_marker))
            if joint.parent != joint.child:
                references.append((f"{key_path}.parent_marker", joint.parent, joint.parent_marker))
    for key_path, load in outline.loads.items():
        if load is not None:
            if load.body not in outline.bodies:
                yield Problem(
                    f"{key_path}.body",
                    f"found {load.body!r}, which is not a body; {suggestion_text(load.body, outline.bodies)}",
                )
            references.append((f"{key_path}.marker", load.body, load.marker))
    references += [
        (f"{key_path}.marker", sight.body, sight.marker)
        for key_path, sight in outline.sights.items()
        if sight is not None
    ]
    for key_path, mounted in outline.mounted.items():
        pairs = (
            () if mounted is None else (("body", "marker"), ("other_body", "other_marker"), ("parent", "parent_marker"))
        )
        for role, marker_key in pairs:
            body_name = getattr(mounted, role, None)
            if body_name is not None and body_name not in outline.bodies:
                yield Problem(
                    f"{key_path}.{role}",
                    f"found {body_name!r}, which is not a body; {suggestion_text(body_name, outline.bodies)}",
                )
            references.append((f"{key_path}.{marker_key}", body_name, getattr(mounted, marker_key, None)))
    for key_path, item in outline.between.items():
        if item is not None:
            references += [
                (f"{key_path}.marker", item.body, item.marker),
                (f"{key_path}.parent_marker", item.parent, item.parent_marker),
            ]
    for name, body in outline.bodies.items():
        if body is not None and body.initial is not None:
            references.append((f"bodies.{name}.initial.marker", name, body.initial.marker))
    loose = bodies_without_joint(outline)
    if outline.attitude is not None and loose:
        references.append(("attitude.marker", outline.attitude.root or loose[0], outline.attitude.marker))
    for key_path, owner, marker in references:
        names = known_markers(outline.bodies.get(owner or ""))
        if marker is not None and names is not None and marker not in names:
            text = f"found {marker!r}, which is no marker of body {owner!r}; {suggestion_text(marker, names)}"
            yield Problem(key_path, text + _group_hint(outline.bodies.get(owner or ""), owner, marker, folder))


def _group_hint(body: BodyTable | None, owner: str | None, marker: str, folder: Path) -> str:
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
