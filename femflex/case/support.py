"""Supports of a clamp: components of a group's nodes that are zero, along global axes, own axes, or of a plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from femflex.noun.values import Quantity, ValueProblem, value_text

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
FORMS = '["x", "y", "z"], { symmetry = [0, 0.6, 0.8] }, or { components = ["x", "ry"], axes = [[...], [...], [...]] }'
SQUARE = 1e-6  # cosine between two axes that counts as rounding
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class SkewSupport:
    """A support that is not along the global axes.

    kind        "axes", "symmetry" or "antisymmetry"
    components  zero along the rows of `vectors`, for "axes"
    vectors     three axes, or the normal of the plane
    """

    kind: str
    components: tuple[str, ...]
    vectors: tuple[Vector, ...]


def read_support(group: str, value: Any) -> tuple[str, ...] | SkewSupport:
    """Clamped components along global axes, or the support of a group. Raises ValueProblem for anything else."""
    if not isinstance(value, dict):
        return _components(group, value)
    keys = set(value)
    for kind in ("symmetry", "antisymmetry"):
        if keys == {kind}:
            normal = _vector(group, kind, value[kind])
            return SkewSupport(kind, (), (normal,))
    if keys != {"components", "axes"}:
        raise ValueProblem(f"found {value_text(value)} at group {group!r}; a support is {FORMS}")
    axes = value["axes"]
    if not isinstance(axes, list) or len(axes) != 3:
        raise ValueProblem(f"found axes {value_text(axes)} at group {group!r}; give three directions at right angles")
    rows = tuple(_vector(group, "axes", row) for row in axes)
    if any(abs(_cosine(rows[i], rows[j])) > SQUARE for i, j in ((0, 1), (1, 2), (2, 0))):
        raise ValueProblem(
            f"found axes {value_text(axes)} at group {group!r}, which are not at right angles to each other"
        )
    return SkewSupport("axes", _components(group, value["components"]), rows)


def support_schema() -> dict[str, Any]:
    """JSON Schema of the three forms."""
    vector = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
    components = {"type": "array", "items": {"enum": list(DIRECTIONS)}, "minItems": 1}
    axes = {"type": "array", "items": vector, "minItems": 3, "maxItems": 3}
    tables: list[dict[str, dict[str, Any]]] = [
        {"symmetry": vector | {"description": "Normal of a plane of symmetry."}},
        {"antisymmetry": vector | {"description": "Normal of a plane of antisymmetry."}},
        {
            "components": components | {"description": "Displacements and rotations along `axes` that are zero."},
            "axes": axes | {"description": "Three directions at right angles to each other."},
        },
    ]
    return {
        "anyOf": [
            components,
            *(
                {"type": "object", "properties": table, "required": sorted(table), "additionalProperties": False}
                for table in tables
            ),
        ]
    }


def _components(group: str, value: Any) -> tuple[str, ...]:
    wrong = [c for c in value if c not in DIRECTIONS] if isinstance(value, list) else [value]
    if wrong or not value:
        raise ValueProblem(f"found {value_text(value)} at group {group!r}; name components of {', '.join(DIRECTIONS)}")
    return tuple(value)


def _vector(group: str, key: str, value: Any) -> Vector:
    try:
        x, y, z = Quantity("", (3,)).read_value(value)
    except ValueProblem as problem:
        raise ValueProblem(f"{problem}, for {key} at group {group!r}") from None
    if not (x or y or z):
        raise ValueProblem(f"found {value_text(value)} for {key} at group {group!r}; a direction is not all zero")
    return x, y, z


def _cosine(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(p * q for p, q in zip(a, b, strict=True)) / (math.hypot(*a) * math.hypot(*b))
