"""Words of a case file for rotations: angle sequences and rotation sets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from femflex.noun.problems import suggestion_text
from femflex.noun.values import ValueProblem, _Readable, value_text
from femflex.rotations import ANGLE_SEQUENCES, NAMED_SEQUENCES, ROTATION_SETS


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
