"""Values of a deck that a case replaces: name of a property or material -> values in SI."""

from __future__ import annotations

from typing import Any

from femflex.noun.units import UnitError
from femflex.noun.values import Quantity, ValueProblem, _Readable, value_text

UNITS_OF = {
    "E": ("Pa",), "E1": ("Pa",), "E2": ("Pa",), "E3": ("Pa",), "G": ("Pa",), "G12": ("Pa",), "G13": ("Pa",),
    "G23": ("Pa",), "density": ("kg/m^3",), "A": ("m^2",), "I1": ("m^4",), "I2": ("m^4",), "J": ("m^4",),
    "thickness": ("m",), "nonstructural_mass": ("kg/m", "kg/m^2"), "K1": ("N/m",), "K2": ("N/m",), "K3": ("N/m",),
    "K4": ("N m",), "K5": ("N m",), "K6": ("N m",),
}  # fmt: skip


class OverrideValues(_Readable):
    """Name -> key -> value; texts with units are read by the key."""

    def read_value(self, value: Any) -> dict[str, dict[str, float]]:
        """The values in SI. Raises ValueProblem."""
        if not isinstance(value, dict):
            raise ValueProblem(
                f"found {value_text(value)}; expected tables such as {{ pid_3 = {{ thickness = '2 mm' }} }}"
            )
        overrides: dict[str, dict[str, float]] = {}
        for name, table in value.items():
            if not isinstance(table, dict):
                raise ValueProblem(f"found {value_text(table)} for {name!r}; expected a table of values")
            overrides[name] = {key: _number(name, key, number_text) for key, number_text in table.items()}
        return overrides

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the tables."""
        number = {"anyOf": [{"type": "number"}, {"type": "string"}]}
        return {
            "type": "object",
            "additionalProperties": {"type": "object", "additionalProperties": number},
        }


def _number(name: str, key: str, value: Any) -> float:
    base = key.split("_")[0] if key.startswith("thickness_") else key
    problem: Exception | None = None
    for unit in UNITS_OF.get(base, ("",)):
        try:
            return float(Quantity(unit).read_value(value))
        except (ValueProblem, UnitError) as error:
            problem = problem or error
    raise ValueProblem(f"{name}.{key}: {problem}")
