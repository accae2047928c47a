"""Names of bodies, markers, joints, loads and the like, which become paths of the result file.

A name holds ASCII letters and digits, `_` and `-`, and points inside. So it is a component of an HDF5 path and
an entry of a list of the command line as it stands.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import pairwise

PATTERN = r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*"
ALLOWED = "letters, digits, - and _ (ASCII), with points only inside"


def name_problems(kind: str, names: Iterable[str]) -> list[str]:
    """Sentences on names of one kind ("body", "joint") that are not allowed."""
    return [
        f"found the name {name!r} of a {kind}; a name holds {ALLOWED}"
        for name in names
        if not re.fullmatch(PATTERN, name, re.ASCII)
    ]


def prefix_problems(kind: str, names: Iterable[str]) -> list[str]:
    """Sentences on names that continue another one after a point, as "boom.tip" does "boom".

    The results call a marker "body.marker", a segment "body.1" and a slide or turn "joint.angle".
    """
    ordered = sorted(set(names), key=lambda name: name.split("."))
    return [
        f"found the names {short!r} and {long!r} of two of the {kind}; what follows the point would be read as a part "
        f"of {short!r}, so rename one of them"
        for short, long in pairwise(ordered)
        if long.startswith(short + ".")
    ]
