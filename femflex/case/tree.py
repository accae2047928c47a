"""The tree of joints: bodies that exist, one parent each, no cycle, and one root."""

from __future__ import annotations

from collections.abc import Iterator

from femflex.case.outline import Outline
from femflex.noun.problems import Problem, quoted_names, unknown_name

SLIDING = {"prismatic": 1, "cylindrical": 1, "free": 3}
ROOT_KEYS = (
    "held",
    "root",
    "nominal_axes",
    "marker",
    "angles",
    "pitch",
    "yaw",
    "roll",
    "rates",
    "rotation",
    "position",
    "velocity",
)


def tree_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of joints whose bodies do not exist, bodies with two joints, and cycles."""
    parent: dict[str, str | None] = {}
    for key_path, joint in outline.joints.items():
        if joint is None:
            continue
        for role, name in (("child", joint.child), ("parent", joint.parent)):
            yield from unknown_name(f"{key_path}.{role}", name, outline.bodies)
        if joint.child == joint.parent:
            yield Problem(key_path, f"found body {joint.child!r} joined to itself; parent and child must differ")
        elif joint.child in parent:
            yield Problem(
                key_path,
                f"found body {joint.child!r} as the child of a second joint; in a tree every body has one parent",
            )
        else:
            parent[joint.child] = joint.parent
    for body in parent:
        path = [body]
        while (up := parent.get(path[-1])) is not None and up not in path:
            path.append(up)
        if up == body and body == min(path):
            loop = " -> ".join([*reversed(path), path[-1]])
            yield Problem("joints", f"found a cycle of bodies, {loop}; one body of it must be joined to the base frame")


def bodies_without_joint(outline: Outline) -> list[str]:
    """Bodies that are the child of no joint."""
    children = {joint.child for joint in outline.joints.values() if joint is not None}
    return [name for name in outline.bodies if name not in children]


def root_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of the root body: that of [attitude], or those whose joints have no parent."""
    if any(joint is None for joint in outline.joints.values()) or outline.attitude is None or not outline.bodies:
        return
    loose, root_name = bodies_without_joint(outline), outline.attitude.root
    yield from unknown_name("attitude.root", root_name, outline.bodies)
    if root_name is not None and root_name not in outline.bodies:
        return
    if root_name is not None and root_name not in loose:
        yield Problem("attitude.root", f"found {root_name!r}, which already has a joint; the root body has none")
        return
    extra = [name for name in loose if name != (root_name or loose[0])] if loose else []
    if extra and (root_name is not None or len(outline.joints) > 0):
        candidates = extra if root_name is not None else loose
        yield Problem(
            "bodies",
            f"found {quoted_names(candidates)} without a joint; only the root body may have none, join the others to a "
            "parent in [[joints]]",
        )
    elif extra:
        yield Problem(
            "joints", f"found no joints for the bodies {quoted_names(loose)}; join all but the root body to a parent"
        )
    if not loose:
        present = [key for key in ROOT_KEYS if key in outline.attitude.model_fields_set]
        if present:
            yield Problem(
                f"attitude.{present[0]}",
                "this key sets the root body's joint, but every body already has one; set it in [[joints]], "
                "or leave the root body's joint out",
            )
    yield from _orbit_root_problems(outline, loose)


def _orbit_root_problems(outline: Outline, loose: list[str]) -> Iterator[Problem]:
    if outline.orbit is None or outline.orbit.kind == "none":
        return
    based = {
        key_path: joint for key_path, joint in outline.joints.items() if joint is not None and joint.parent is None
    }
    if (loose and based) or len(based) > 1:
        key_path = next(iter(based))
        yield Problem(
            key_path,
            "found a second body joined to the base frame; an orbiting craft has one root body, so give this "
            "joint a parent",
        )
        return
    for key_path, joint in based.items():
        slides = SLIDING.get(joint.kind, len(getattr(joint, "slides", ())))
        if outline.orbit.kind == "specified" and slides:
            yield Problem(
                f"{key_path}.kind",
                f"found {joint.kind!r} for the root body; on a specified orbit the centre of mass "
                f"fixes its translation, so use spherical, weld, revolute or universal, or orbit.kind = 'free'",
            )
        if outline.orbit.kind == "free" and slides != 3:
            yield Problem(
                f"{key_path}.kind",
                f"found {joint.kind!r} for the root body; on a free orbit it moves freely, so use "
                f"free, or orbit.kind = 'specified'",
            )
