"""Values that joints are written with: axes, springs and dampers, one number for all three axes or three."""

from __future__ import annotations

from typing import Annotated, Any

from femflex.case.values import Direction, Quantity, ValueProblem, _Readable


class _OneOrThree(_Readable):
    """A number for all three axes, or three numbers."""

    def __init__(self, unit: str) -> None:
        self.one, self.three = Quantity(unit, least=0.0), Quantity(unit, (3,), least=0.0)

    def read(self, value: Any) -> Any:
        if isinstance(value, list):
            return self.three.read(value)
        return (self.one.read(value),) * 3

    def json_schema(self) -> dict[str, Any]:
        return {"anyOf": [self.one.json_schema(), self.three.json_schema()], "unit": self.one.unit}


class _Axis(_Readable):
    """A direction: three numbers not all zero, or "x", "-y" and so on."""

    def read(self, value: Any) -> tuple[float, float, float]:
        if isinstance(value, str):
            if value.lstrip("-") not in ("x", "y", "z") or value.count("-") > 1:
                raise ValueProblem(f"found {value!r}; an axis is three numbers, or one of x, y, z, -x, -y, -z")
            sign = -1.0 if value[0] == "-" else 1.0
            return tuple(sign * (letter == value[-1]) for letter in "xyz")  # type: ignore[return-value]
        found = Quantity("", (3,)).read(value)
        if not any(found):
            raise ValueProblem(f"found {list(found)}; an axis needs a direction, such as [0, 0, 1] or 'z'")
        return found

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
