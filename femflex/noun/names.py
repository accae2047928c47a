"""Names of bodies, markers, joints, loads and the like, which become paths of the result file.

A name holds ASCII letters and digits, `_` and `-`, and points inside. So it is a component of an HDF5 path and
an entry of a list of the command line as it stands.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

from femflex.noun.problems import suggestion_text
from femflex.noun.values import ValueProblem, _Readable, value_text
from femflex.rotations import ANGLE_SEQUENCES, NAMED_SEQUENCES, ROTATION_SETS

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


@dataclass(frozen=True)
class OneOf(_Readable):
    """One of some words; a message lists `listed` of them if another word is not similar to any."""

    words: tuple[str, ...]
    listed: tuple[str, ...]

    def read_value(self, value: Any) -> str:
        """The word itself."""
        if isinstance(value, str) and value in self.words:
            return value
        hint = suggestion_text(str(value), self.words)
        if not hint.startswith("did you mean"):
            hint = suggestion_text("", self.listed) + "; intrinsic unless it says so, such as 'extrinsic xyz'"
        raise ValueProblem(f"found {value_text(value)}; {hint}")

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the words."""
        return {"type": "string", "enum": list(self.words)}


Sequence_ = Annotated[str, OneOf(NAMED_SEQUENCES, ANGLE_SEQUENCES)]
RotationSet = Annotated[str, OneOf(ROTATION_SETS, tuple(name for name in ROTATION_SETS if " " not in name))]
