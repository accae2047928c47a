"""Initial values that stay exactly as given when loops close: those of whole joints, or of single coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches

from femflex.system.joint import Joint


def keepable_names(joint: Joint) -> dict[str, list[int]]:
    """Return every name that may be kept, and the freedoms of the joint under it; a ball only as a whole."""
    single = len(joint.translations) + (len(joint.rotations) if joint.ball is None else 0)
    names = {joint.label: list(range(joint.n_u))} if joint.n_u else {}
    return names | {name: [k] for k, name in enumerate(joint.freedom_names()[:single])}


def kept_coordinates(keep: Sequence[str], joint: Joint) -> list[int]:
    """Freedoms of the joint whose initial values stay as given."""
    names = keepable_names(joint)
    return sorted({k for name in keep for k in names.get(name, ())})


def keep_problems(keep: Sequence[str], joints: Sequence[Joint]) -> list[str]:
    """Return sentences on names under which nothing can be kept."""
    keepable = [name for joint in joints for name in keepable_names(joint)]
    out = []
    for name in keep:
        if name not in keepable:
            matches = get_close_matches(name, keepable, n=1)
            hint = f"did you mean {matches[0]!r}? " if matches else ""
            out.append(
                f"keep names {name!r}, which is no joint that moves and no slide or turn of one; {hint}"
                f"known are {', '.join(keepable)}"
            )
    return out
