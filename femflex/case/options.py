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
    try:
        return _kinds(option)[-1 if isinstance(value, list) else 0].read(value)
    except (ValueProblem, UnitError) as problem:
        refuse(f"{name}: {problem}")


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


def _table(known: Mapping[str, Option]) -> dict[str, Any]:
    properties = {}
    for name, option in known.items():
        about: dict[str, Any] = {"description": option.meaning}
        if option.default is not None:
            about["default"] = list(option.default) if isinstance(option.default, tuple) else option.default
        kinds = [] if option.unit is None else [kind.json_schema() for kind in _kinds(option)]
        properties[name] = ({} if not kinds else kinds[0] if len(kinds) == 1 else {"anyOf": kinds}) | about
    return {"type": "object", "properties": properties, "additionalProperties": False}
