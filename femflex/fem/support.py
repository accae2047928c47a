"""Supports of node groups: the components of displacement and rotation that are zero, in global axes or their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.noun.values import Quantity, ValueProblem, Vector, _Readable, value_text

Rows = tuple[tuple[float, float, float], ...]

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")  # of a node: three translations, three rotations
GLOBAL: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SQUARE = 1e-6  # cosine between two axes of a support that passes for rounding


@dataclass(frozen=True)
class Support:
    """Components of a group's nodes that are zero, along the support's own axes.

    components  of "x", "y", "z", "rx", "ry", "rz", along the rows of `axes`
    axes        (3, 3) rows: directions of the support's x, y and z axes in global components, at right angles
    """

    components: tuple[str, ...]
    axes: Rows = GLOBAL

    def __post_init__(self) -> None:
        unknown = [c for c in self.components if c not in COMPONENTS]
        if unknown:
            raise ValueError(f"components {unknown} are not of a node; name some of {list(COMPONENTS)}")
        object.__setattr__(self, "components", tuple(self.components))
        rows = np.asarray(self.axes, float)
        if rows.shape != (3, 3) or not np.isfinite(rows).all() or not np.linalg.norm(rows, axis=1).all():
            raise ValueError(
                f"axes of a support are {self.axes!r}; give three directions of three components, not zero"
            )
        unit = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        if np.abs(unit @ unit.T - np.eye(3)).max() > SQUARE:
            raise ValueError(f"axes of a support, {rows.tolist()}, are not at right angles; give orthogonal directions")
        object.__setattr__(self, "axes", tuple(tuple(float(value) for value in row) for row in unit))

    @property
    def is_clamped(self) -> bool:
        """Whether all six components are zero."""
        return set(self.components) == set(COMPONENTS)

    def projectors(self) -> tuple[Array, Array]:
        """Projectors (3, 3) on the directions of displacement, and of rotation, that are zero."""
        rows, zero = np.asarray(self.axes), np.array([c in self.components for c in COMPONENTS])
        moves, turns = rows[zero[:3]], rows[zero[3:]]
        return moves.T @ moves, turns.T @ turns


Supports = Mapping[str, Sequence[str] | Support]  # group -> components along global axes, or a Support


def symmetry(normal: ArrayLike) -> Support:
    """Support of a plane of symmetry with this normal (3,): no displacement along it, no rotation about the plane's
    own axes."""
    return Support(("x", "ry", "rz"), _axes_with(normal))


def antisymmetry(normal: ArrayLike) -> Support:
    """Support of a plane of antisymmetry with this normal (3,): no displacement in the plane, no rotation about it."""
    return Support(("y", "z", "rx"), _axes_with(normal))


def as_support(value: Sequence[str] | Support) -> Support:
    """The Support of components along global axes, or the one given."""
    return value if isinstance(value, Support) else Support(tuple(value))


def _axes_with(normal: ArrayLike) -> Rows:
    """Axes whose x lies along the normal (3,)."""
    direction = np.asarray(normal, float)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise ValueError(f"the normal of a plane is {normal!r}; give three components, not all zero")
    x = direction / np.linalg.norm(direction)
    y = np.cross(np.eye(3)[np.argmin(np.abs(x))], x)
    y /= np.linalg.norm(y)
    rows = np.stack([x, y, np.cross(x, y)])
    return tuple((float(a), float(b), float(c)) for a, b, c in rows)


class ClampValue(_Readable):
    """Group names, or group name -> support. Read as group -> Support; a name alone has all six components clamped."""

    forms = (
        '["x", "y", "z"], { symmetry = [0, 0.6, 0.8] }, or { components = ["x", "ry"], axes = [[...], [...], [...]] }'
    )

    def read_value(self, value: Any) -> dict[str, Support]:
        """Group -> its Support."""
        if isinstance(value, str):
            value = [value]
        if isinstance(value, list) and all(isinstance(name, str) for name in value):
            return dict.fromkeys(value, Support(COMPONENTS))
        if not isinstance(value, dict):
            raise ValueProblem(
                f'found {value_text(value)}; expected a group name, a list of them, or {{group = ["x", "y", "z"]}}'
            )
        return {group: self._support(group, support) for group, support in value.items()}

    def _support(self, group: str, value: Any) -> Support:
        if isinstance(value, Support):
            return value
        try:
            if isinstance(value, list) and value:
                return Support(tuple(value))
            direction = Quantity("", (3,))
            if isinstance(value, dict) and set(value) == {"components", "axes"}:
                return Support(tuple(value["components"]), Quantity("", (3, 3)).read_value(value["axes"]))
            if isinstance(value, dict) and set(value) == {"symmetry"}:
                return symmetry(direction.read_value(value["symmetry"]))
            if isinstance(value, dict) and set(value) == {"antisymmetry"}:
                return antisymmetry(direction.read_value(value["antisymmetry"]))
        except ValueError as error:
            raise ValueProblem(f"found {value_text(value)} at group {group!r}: {error}") from None
        raise ValueProblem(f"found {value_text(value)} at group {group!r}; a support is {self.forms}")

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the forms."""
        vector = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
        components = {"type": "array", "items": {"enum": list(COMPONENTS)}, "minItems": 1}
        axes = {"type": "array", "items": vector, "minItems": 3, "maxItems": 3}
        tables: list[dict[str, dict[str, Any]]] = [
            {"symmetry": vector | {"description": "Normal of a plane of symmetry."}},
            {"antisymmetry": vector | {"description": "Normal of a plane of antisymmetry."}},
            {
                "components": components | {"description": "Displacements and rotations along `axes` that are zero."},
                "axes": axes | {"description": "Three directions at right angles to each other."},
            },
        ]
        closed = {"type": "object", "additionalProperties": False}
        support = [components, *({**closed, "properties": table, "required": sorted(table)} for table in tables)]
        names = {"type": "array", "items": {"type": "string"}}
        of_groups = {"type": "object", "additionalProperties": {"anyOf": support}}
        return {"anyOf": [{"type": "string"}, names, of_groups]}


Clamp = Annotated[dict[str, Support], ClampValue()]
