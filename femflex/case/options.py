"""Options of a member in a case: numbers of its family's units, or texts with a unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from femflex.case.base import refuse
from femflex.case.units import UnitError
from femflex.case.values import Quantity, ValueProblem
from femflex.fem.option import OPTIONS, Option


def read_options(family: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """The options with their quantities in SI. Names the family does not have are reported where it is built."""
    import femflex.fem  # noqa: F401  # registers the families

    known = OPTIONS.get(family, {})
    return {name: _read(name, known[name], value) if name in known else value for name, value in given.items()}


def _read(name: str, option: Option, value: Any) -> Any:
    if option.unit is None:
        return value
    if option.field and isinstance(value, dict):
        return _formula(name, option, value)
    try:
        return _kinds(option)[-1 if isinstance(value, list) else 0].read(value)
    except (ValueProblem, UnitError) as problem:
        refuse(f"{name}: {problem}")


def _formula(name: str, option: Option, value: Mapping[str, Any]) -> Any:
    """The text of a formula, or as many texts as the option has numbers."""
    found, counts = value.get("formula"), option.shapes
    texts = [found] if isinstance(found, str) else found
    if set(value) != {"formula"} or not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
        refuse(f'{name}: found {dict(value)!r}; a field is a number, or {{ formula = "..." }} of x, y and z')
    if (0 if isinstance(found, str) else len(texts)) not in counts:
        refuse(f"{name}: found {len(texts)} formulas; it takes {' or '.join(str(max(n, 1)) for n in counts)}")
    return found if isinstance(found, str) else tuple(texts)


def _kinds(option: Option) -> list[Quantity]:
    """What the option may be, one number alone first."""
    assert option.unit is not None
    return [Quantity(option.unit, (n,) if n else ()) for n in sorted(option.shapes)]


def add_options(schema: dict[str, Any]) -> None:
    """Add to a member's JSON Schema what options each family has, with their meanings, units and defaults."""
    import femflex.fem  # noqa: F401

    schema["allOf"] = [
        {
            "if": {"properties": {"family": {"const": family}}},
            "then": {"properties": {"options": _table(known)}},
        }
        for family, known in OPTIONS.items()
    ]


def _formula_schema(option: Option) -> dict[str, Any]:
    text = {"type": "string", "description": "arithmetic of x, y and z of the mesh, in SI"}
    each = {"type": "array", "items": text, "minItems": max(option.shapes), "maxItems": max(option.shapes)}
    found = text if option.shapes == (0,) else each | {"description": "one formula for each component"}
    return {
        "type": "object",
        "properties": {"formula": found},
        "required": ["formula"],
        "additionalProperties": False,
    }


def _table(known: Mapping[str, Option]) -> dict[str, Any]:
    properties = {}
    for name, option in known.items():
        about: dict[str, Any] = {"description": option.meaning}
        if option.default is not None:
            about["default"] = list(option.default) if isinstance(option.default, tuple) else option.default
        kinds = [] if option.unit is None else [kind.json_schema() for kind in _kinds(option)]
        if option.field:
            kinds.append(_formula_schema(option))
        properties[name] = ({} if not kinds else kinds[0] if len(kinds) == 1 else {"anyOf": kinds}) | about
    return {"type": "object", "properties": properties, "additionalProperties": False}
