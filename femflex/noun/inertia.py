"""Inertia matrices of a case file, with the check that a distribution of mass can have them."""

from __future__ import annotations

from typing import Annotated, Any

from femflex.noun.values import Matrix, Quantity, ValueProblem, _Readable


class Inertia(_Readable):
    """Three principal moments, or a symmetric 3 x 3 matrix (off-diagonal entries are minus the products of inertia)."""

    moments, matrix = Quantity("kg m^2", (3,)), Quantity("kg m^2", (3, 3))

    def read_value(self, value: Any) -> Matrix:
        """The matrix, with the check that a distribution of mass can have it."""
        if isinstance(value, list) and value and not isinstance(value[0], list):
            a, b, c = self.moments.read_value(value)
            rows: Matrix = ((a, 0.0, 0.0), (0.0, b, 0.0), (0.0, 0.0, c))
        else:
            rows = self.matrix.read_value(value)
        _check_inertia(rows)
        return rows

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both forms."""
        return {"anyOf": [self.moments.json_schema(), self.matrix.json_schema()], "unit": "kg m^2"}


def _check_inertia(rows: Matrix) -> None:
    import numpy as np

    J = np.array(rows)
    if np.abs(J - J.T).max() > 1e-9 * np.abs(J).max():
        i, j = np.unravel_index(np.argmax(np.abs(J - J.T)), (3, 3))
        raise ValueProblem(
            f"found an inertia that is not symmetric: entry ({i + 1}, {j + 1}) is {J[i, j]:g}, ({j + 1}, {i + 1}) "
            f"is {J[j, i]:g} kg m^2"
        )
    smallest, middle, largest = np.linalg.eigvalsh(J)
    principal = f"{smallest:.7g}, {middle:.7g}, {largest:.7g} kg m^2"
    if smallest < 0 or largest <= 0:
        raise ValueProblem(
            f"found an inertia that is not positive definite, with principal moments {principal}; check signs and "
            f"entries"
        )
    if smallest + middle < largest * (1 - 1e-9):
        raise ValueProblem(
            f"found an inertia that breaks the triangle inequality, with principal moments {principal}; "
            "the two smaller must sum to at least the largest"
        )


InertiaMatrix = Annotated[Matrix, Inertia()]
