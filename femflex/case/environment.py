"""[environment]: uniform gravity on the ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from femflex.case.base import Table
from femflex.case.values import Quantity, ValueProblem, Vector, _Readable


@dataclass(frozen=True)
class GravityValue(_Readable):
    """Acceleration of free fall: a number, downwards along -z, or a vector. Reads into inertial components."""

    strength = Quantity("m/s^2")
    direction = Quantity("m/s^2", (3,))

    def read(self, value: Any) -> Vector:
        """(3,) [m/s^2]."""
        if isinstance(value, list):
            return self.direction.read(value)
        g = self.strength.read(value)
        if g < 0.0:
            raise ValueProblem(
                f"found {g:g} m/s^2; a single number is the strength of gravity along -z and is not negative, another "
                'direction takes three numbers, such as [0, 0, "9.81 m/s^2"]'
            )
        return (0.0, 0.0, -g)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the two forms."""
        return {"anyOf": [self.strength.json_schema(), self.direction.json_schema()], "unit": "m/s^2"}


class EnvironmentTable(Table):
    """What surrounds the craft beside its orbit."""

    gravity: Annotated[Vector, GravityValue()] = (0.0, 0.0, 0.0)
    """Uniform gravity on the ground: a number acts along -z, three components are along inertial axes. Zero in orbit.
    """
