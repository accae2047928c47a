"""Words of a case file for rotations: angle sequences and rotation sets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from femflex.noun.problems import suggestion_text
from femflex.noun.values import ValueProblem, _Readable, value_text

LETTERS = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz")
SEQUENCES = (
    *LETTERS,
    *(f"intrinsic {letters}" for letters in LETTERS),
    *(f"extrinsic {letters}" for letters in LETTERS),
)
SETS = ("euler_parameters", "rodrigues", "modified_rodrigues", *SEQUENCES)


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


Sequence_ = Annotated[str, OneOf(SEQUENCES, LETTERS)]
RotationSet = Annotated[str, OneOf(SETS, SETS[: len(SETS) - len(SEQUENCES) + len(LETTERS)])]
