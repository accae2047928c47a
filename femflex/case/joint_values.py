"""Types of joint values: axes, and springs and dampers as one number for all three axes or three numbers."""

from __future__ import annotations

from typing import Annotated, Any

from femflex.noun.values import Direction, Quantity, ValueProblem, _Readable


class _OneOrThree(_Readable):
    """A number for all three axes, or three numbers."""

    def __init__(self, unit: str) -> None:
        self.scalar, self.vector = Quantity(unit, least=0.0), Quantity(unit, (3,), least=0.0)

    def read_value(self, value: Any) -> Any:
        if isinstance(value, list):
            return self.vector.read_value(value)
        return (self.scalar.read_value(value),) * 3

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [self.scalar.json_schema(), self.vector.json_schema()], "unit": self.scalar.unit}


class _Axis(_Readable):
    """A direction: three numbers not all zero, or "x", "-y" and so on."""

    def read_value(self, value: Any) -> tuple[float, float, float]:
        if isinstance(value, str):
            if value.lstrip("-") not in ("x", "y", "z") or value.count("-") > 1:
                raise ValueProblem(f"found {value!r}; an axis is three numbers, or one of x, y, z, -x, -y, -z")
            sign = -1.0 if value[0] == "-" else 1.0
            return tuple(sign * (letter == value[-1]) for letter in "xyz")  # type: ignore[return-value]
        axis = Quantity("", (3,)).read_value(value)
        if not any(axis):
            raise ValueProblem(f"found {list(axis)}; an axis needs a direction, such as [0, 0, 1] or 'z'")
        return axis

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [Quantity("", (3,)).json_schema(), {"enum": ["x", "y", "z", "-x", "-y", "-z"]}]}


Axis = Annotated[Direction, _Axis()]
Spring = Annotated[float, Quantity("N/m", least=0.0)]
Damper = Annotated[float, Quantity("N s/m", least=0.0)]
TurnSpring = Annotated[float, Quantity("N m/rad", least=0.0)]
TurnDamper = Annotated[float, Quantity("N m s/rad", least=0.0)]
Springs = Annotated[tuple[float, float, float], _OneOrThree("N/m")]
Dampers = Annotated[tuple[float, float, float], _OneOrThree("N s/m")]
TurnSprings = Annotated[tuple[float, float, float], _OneOrThree("N m/rad")]
TurnDampers = Annotated[tuple[float, float, float], _OneOrThree("N m s/rad")]
ZERO = (0.0, 0.0, 0.0)
