"""Types of joint values: springs and dampers as one number for all three axes or three numbers."""

from __future__ import annotations

from typing import Annotated, Any

from femflex.noun.values import Quantity, _Readable


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


Spring = Annotated[float, Quantity("N/m", least=0.0)]
Damper = Annotated[float, Quantity("N s/m", least=0.0)]
TurnSpring = Annotated[float, Quantity("N m/rad", least=0.0)]
TurnDamper = Annotated[float, Quantity("N m s/rad", least=0.0)]
Springs = Annotated[tuple[float, float, float], _OneOrThree("N/m")]
Dampers = Annotated[tuple[float, float, float], _OneOrThree("N s/m")]
TurnSprings = Annotated[tuple[float, float, float], _OneOrThree("N m/rad")]
TurnDampers = Annotated[tuple[float, float, float], _OneOrThree("N m s/rad")]
ZERO = (0.0, 0.0, 0.0)
