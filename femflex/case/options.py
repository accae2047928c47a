"""Options of a member in a case: numbers in the units of its family, or texts with a unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from femflex.fem.option import OPTIONS, Option
from femflex.noun.table import refuse
from femflex.noun.units import UnitError
from femflex.noun.values import Quantity, ValueProblem


def read_options(family: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The options with their quantities in SI. Names the family does not have are reported where it is built."""
    import femflex.fem  # noqa: F401  # registers the families

    declared = OPTIONS.get(family, {})
    return {
        name: _option_value(name, declared[name], value) if name in declared else value
        for name, value in options.items()
    }


def _option_value(name: str, option: Option, value: Any) -> Any:
    if option.unit is None:
        return value
    if option.field and isinstance(value, dict):
        return _formula(name, option, value)
    try:
        return _option_quantities(option)[-1 if isinstance(value, list) else 0].read_value(value)
    except (ValueProblem, UnitError) as problem:
        refuse(f"{name}: {problem}")


def _formula(name: str, option: Option, value: Mapping[str, Any]) -> Any:
    """The text of a formula, or as many texts as the option has numbers."""
    formula, counts = value.get("formula"), option.shapes
    texts = [formula] if isinstance(formula, str) else formula
    if set(value) != {"formula"} or not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
        refuse(f'{name}: found {dict(value)!r}; a field is a number, or {{ formula = "..." }} of x, y and z')
    if (0 if isinstance(formula, str) else len(texts)) not in counts:
        refuse(f"{name}: found {len(texts)} formulas; it takes {' or '.join(str(max(n, 1)) for n in counts)}")
    return formula if isinstance(formula, str) else tuple(texts)


def _option_quantities(option: Option) -> list[Quantity]:
    """Quantities that the option may be, a single number first."""
    assert option.unit is not None
    return [Quantity(option.unit, (n,) if n else ()) for n in sorted(option.shapes)]


def add_options(schema: dict[str, Any]) -> None:
    """Add the options of each family to a member's JSON Schema, with their meanings, units and defaults."""
    import femflex.fem  # noqa: F401

    schema["allOf"] = [
        {
            "if": {"properties": {"family": {"const": family}}},
            "then": {"properties": {"options": _options_schema(options)}},
        }
        for family, options in OPTIONS.items()
    ]


def _formula_schema(option: Option) -> dict[str, Any]:
    text = {"type": "string", "description": "arithmetic of x, y and z of the mesh, in SI"}
    texts = {"type": "array", "items": text, "minItems": max(option.shapes), "maxItems": max(option.shapes)}
    formulas = text if option.shapes == (0,) else texts | {"description": "one formula for each component"}
    return {
        "type": "object",
        "properties": {"formula": formulas},
        "required": ["formula"],
        "additionalProperties": False,
    }


def _options_schema(options: Mapping[str, Option]) -> dict[str, Any]:
    properties = {}
    for name, option in options.items():
        annotations: dict[str, Any] = {"description": option.meaning}
        if option.default is not None:
            annotations["default"] = list(option.default) if isinstance(option.default, tuple) else option.default
        kinds = [] if option.unit is None else [kind.json_schema() for kind in _option_quantities(option)]
        if option.field:
            kinds.append(_formula_schema(option))
        properties[name] = ({} if not kinds else kinds[0] if len(kinds) == 1 else {"anyOf": kinds}) | annotations
    return {"type": "object", "properties": properties, "additionalProperties": False}
