"""Base class of every table of a case file, and small types that many tables share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

from pydantic import BaseModel, ConfigDict, StringConstraints, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from femflex.noun.names import PATTERN
from femflex.noun.values import Angles, Matrix, Quantity, ValueProblem, _Readable, value_text

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)  # pydantic has no public name for it

Name = Annotated[str, StringConstraints(pattern=rf"^{PATTERN}$")]  # becomes a path in the result file


class _Checked(ModelMetaclass):
    """Class of tables: an object made in Python gets the same checks, and the same sentences, as one read of a case."""

    def __call__(cls, *arguments: Any, **keys: Any) -> Any:
        """The table with these values, in the order of its keys (`kind` aside) or by key."""
        fields: dict[str, FieldInfo] = cls.model_fields  # type: ignore[attr-defined]
        names = [field.alias or name for name, field in fields.items() if name != "kind"]
        if len(arguments) > len(names) or keys.keys() & set(names[: len(arguments)]):
            raise TypeError(f"{cls.__name__} takes {', '.join(names)}, each once; by order, or by key")
        keys = cls.from_python(keys | dict(zip(names, arguments, strict=False)))  # type: ignore[attr-defined]
        try:
            return super().__call__(**keys)
        except ValidationError as error:
            from femflex.noun.sentences import schema_problems

            problems = schema_problems(cls, keys, error)  # type: ignore[arg-type]
            named = [repr(keys[key]) for key in ("name", "group") if isinstance(keys.get(key), str)]
            label = " ".join([cls.__name__, *named[:1]])
            text = "\n".join(f"{label}: {problem}" for problem in problems)
        raise ValueError(text)


class Table(BaseModel, metaclass=_Checked):
    """A table of the case file: its keys are known, its values typed and in SI, and it does not change once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True, protected_namespaces=())

    @classmethod
    def from_python(cls, keys: dict[str, Any]) -> dict[str, Any]:
        """The keys of a case file for those of a call in Python, which some classes take in other forms too."""
        return keys


def refuse(text: str) -> NoReturn:
    """Raise `text` as a problem from inside a validator of a table."""
    raise PydanticCustomError("conflict", "{text}", {"text": text})


def exactly_one(table: Table, keys: Sequence[str], required: bool = True) -> str | None:
    """The one of the keys that is present in the table; a problem if there are several, or none though required."""
    present = [key for key in keys if getattr(table, key) is not None]
    if len(present) > 1:
        refuse(f"found {' and '.join(present)} together; give one of them")
    if required and not present:
        refuse(f"found none of {', '.join(keys)}; give one of them")
    return present[0] if present else None


@dataclass(frozen=True)
class OrientationValue(_Readable):
    """Axes of a marker in its body: a 3 x 3 matrix, turns, or two directions. Read as C_BM, rows of a matrix."""

    def read_value(self, value: Any) -> Matrix:
        """C_BM (3, 3): its columns are the marker's axes in body components."""
        if isinstance(value, list):
            return _orthonormal(Quantity("", (3, 3)).read_value(value))
        if isinstance(value, dict) and set(value) <= {"sequence", "angles"} and "angles" in value:
            return _matrix_of_angles(value.get("sequence", "xyz"), value["angles"])
        if isinstance(value, dict) and len(value) == 2 and set(value) <= {"x", "y", "z"}:
            return _matrix_of_directions({axis: Quantity("", (3,)).read_value(v) for axis, v in value.items()})
        raise ValueProblem(
            f'found {value_text(value)}; expected a 3 x 3 matrix, {{sequence = "xyz", angles = [...]}}, or the '
            f"directions of two "
            "axes such as {x = [1, 1, 0], y = [0, 0, 1]}"
        )

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the three forms."""
        direction = Quantity("", (3,)).json_schema()
        turns = {
            "sequence": {"type": "string", "description": "Sequence of the turns. Default: xyz."},
            "angles": Quantity("rad", (3,)).json_schema() | {"description": "The three angles, in that order."},
        }
        return {
            "anyOf": [
                Quantity("", (3, 3)).json_schema(),
                {"type": "object", "properties": turns, "required": ["angles"], "additionalProperties": False},
                {
                    "type": "object",
                    "properties": {
                        axis: direction | {"description": f"Direction of the marker's {axis} axis in the body."}
                        for axis in "xyz"
                    },
                    "minProperties": 2,
                    "maxProperties": 2,
                    "additionalProperties": False,
                },
            ]
        }


Orientation = Annotated[Matrix, OrientationValue()]


def _rows(C: Any) -> Matrix:
    return tuple(tuple(float(c) for c in row) for row in C)  # type: ignore[return-value]


def _orthonormal(rows: Matrix) -> Matrix:
    import numpy as np

    C = np.array(rows)
    if np.abs(C @ C.T - np.eye(3)).max() > 1e-6 or np.linalg.det(C) < 0:
        raise ValueProblem(
            f"found a matrix that is not a rotation (C C^T differs from 1 by {np.abs(C @ C.T - np.eye(3)).max():.1e}, "
            f"determinant {np.linalg.det(C):.4g}); its columns must be perpendicular unit vectors, right-handed"
        )
    u, _, vh = np.linalg.svd(C)  # the matrix may be rounded: take the nearest rotation
    return _rows(u @ vh)


def _matrix_of_angles(sequence: Any, angles: Any) -> Matrix:
    from femflex.rotations import NAMED_SEQUENCES, dcm_from_angles

    if not isinstance(sequence, str) or sequence not in NAMED_SEQUENCES:
        raise ValueProblem(f"found sequence {value_text(sequence)}; known are {', '.join(NAMED_SEQUENCES)}")
    return _rows(dcm_from_angles(Quantity("rad", (3,)).read_value(angles), sequence))


def _matrix_of_directions(directions: dict[str, Any]) -> Matrix:
    import numpy as np

    (first, a), (second, b) = directions.items()
    i, j = "xyz".index(first), "xyz".index(second)
    a, b = np.array(a), np.array(b)
    if not np.linalg.norm(np.cross(a, b)) > 1e-9 * np.linalg.norm(a) * np.linalg.norm(b):
        raise ValueProblem(
            f"found directions {first} = {a.tolist()} and {second} = {b.tolist()}; they must not be parallel or zero"
        )
    C = np.zeros((3, 3))
    C[:, i] = a / np.linalg.norm(a)
    b = b - C[:, i] * (C[:, i] @ b)
    C[:, j] = b / np.linalg.norm(b)
    k = 3 - i - j
    C[:, k] = np.cross(C[:, i], C[:, j]) * (1.0 if (j - i) % 3 == 1 else -1.0)
    return _rows(C)


__all__ = ["Angles", "Name", "Orientation", "Table", "exactly_one", "refuse"]
