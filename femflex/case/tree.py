"""The tree of joints: bodies that exist, one parent each, no cycle, and one root."""

from __future__ import annotations

from collections.abc import Iterator

from femflex.case.outline import Outline
from femflex.case.problems import Problem, listed, near

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


def tree(outline: Outline) -> Iterator[Problem]:
    """Joints name bodies that exist, every body is the child of one joint at most, and no body of itself."""
    parent: dict[str, str | None] = {}
    for where, joint in outline.joints.items():
        if joint is None:
            continue
        for role, name in (("child", joint.child), ("parent", joint.parent)):
            if name is not None and name not in outline.bodies:
                yield Problem(f"{where}.{role}", f"found {name!r}, which is not a body; {near(name, outline.bodies)}")
        if joint.child == joint.parent:
            yield Problem(where, f"found body {joint.child!r} joined to itself; parent and child must differ")
        elif joint.child in parent:
            yield Problem(
                where, f"found body {joint.child!r} as the child of a second joint; in a tree every body has one parent"
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


def loose_bodies(outline: Outline) -> list[str]:
    """Bodies that are the child of no joint."""
    held = {joint.child for joint in outline.joints.values() if joint is not None}
    return [name for name in outline.bodies if name not in held]


def root(outline: Outline) -> Iterator[Problem]:
    """One body is the root: that of [attitude], or those whose joints hang from the base frame."""
    if any(joint is None for joint in outline.joints.values()) or outline.attitude is None or not outline.bodies:
        return
    loose, named = loose_bodies(outline), outline.attitude.root
    if named is not None and named not in outline.bodies:
        yield Problem("attitude.root", f"found {named!r}, which is not a body; {near(named, outline.bodies)}")
        return
    if named is not None and named not in loose:
        yield Problem("attitude.root", f"found {named!r}, which already has a joint; the root body has none")
        return
    extra = [name for name in loose if name != (named or loose[0])] if loose else []
    if extra and (named is not None or len(outline.joints) > 0):
        candidates = extra if named is not None else loose
        yield Problem(
            "bodies",
            f"found {listed(candidates)} without a joint; only the root body may have none, join the others to a "
            "parent in [[joints]]",
        )
    elif extra:
        yield Problem(
            "joints", f"found no joints for the bodies {listed(loose)}; join all but the root body to a parent"
        )
    if not loose:
        given = [key for key in ROOT_KEYS if key in outline.attitude.model_fields_set]
        if given:
            yield Problem(
                f"attitude.{given[0]}",
                "this key sets the root body's joint, but every body already has one; set it in [[joints]], "
                "or leave the root body's joint out",
            )
    yield from _orbit_roots(outline, loose)


def _orbit_roots(outline: Outline, loose: list[str]) -> Iterator[Problem]:
    if outline.orbit is None or outline.orbit.kind == "none":
        return
    based = {where: joint for where, joint in outline.joints.items() if joint is not None and joint.parent is None}
    if (loose and based) or len(based) > 1:
        where = next(iter(based))
        yield Problem(
            where,
            "found a second body joined to the base frame; an orbiting craft has one root body, so give this "
            "joint a parent",
        )
        return
    for where, joint in based.items():
        slides = SLIDING.get(joint.kind, len(getattr(joint, "slides", ())))
        if outline.orbit.kind == "specified" and slides:
            yield Problem(
                f"{where}.kind",
                f"found {joint.kind!r} for the root body; on a specified orbit the centre of mass "
                f"fixes its translation, so use spherical, weld, revolute or universal, or orbit.kind = 'free'",
            )
        if outline.orbit.kind == "free" and slides != 3:
            yield Problem(
                f"{where}.kind",
                f"found {joint.kind!r} for the root body; on a free orbit it moves freely, so use "
                f"free, or orbit.kind = 'specified'",
            )
