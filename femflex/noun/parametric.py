"""Tables whose numbers a kernel reads by name."""

from __future__ import annotations

import math
import types
import typing
from collections import namedtuple
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.noun.table import Table
from femflex.noun.values import Quantity

UNLIMITED = 1e300  # in place of a limit that is not given


class Parametric(Table):
    """A table whose fields with numbers are the parameters of a kernel, one after another.

    derived   names of numbers in addition to those of its fields, which `numbers` returns
    """

    derived: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def number_sizes(cls) -> dict[str, int]:
        """Number of values of each of its numbers, in their order."""
        sizes = {}
        for name, field in cls.model_fields.items():
            quantity = _quantity(field.metadata) or _quantity([field.annotation])
            if quantity is not None and None not in quantity.shape:
                sizes[name] = math.prod(size for size in quantity.shape if size is not None)
        return sizes | dict.fromkeys(cls.derived, 1)

    @classmethod
    def parameter_places(cls) -> Any:
        """Offsets of its numbers in `parameters`: a named tuple."""
        sizes = cls.number_sizes()
        return offsets("Parameters", dict(zip(sizes, np.cumsum([0, *sizes.values()]).tolist(), strict=False)))

    def numbers(self) -> dict[str, ArrayLike]:
        """Values of its numbers by name; one that is not given is UNLIMITED. Nouns with `derived` numbers add these."""
        values = {name: getattr(self, name) for name in self.number_sizes() if name not in self.derived}
        return {name: UNLIMITED if value is None else value for name, value in values.items()}

    def parameters(self) -> Array:
        """Its numbers (n,), one after another."""
        numbers = self.numbers()
        return np.concatenate([np.zeros(0), *(np.ravel(numbers[name]).astype(float) for name in self.number_sizes())])


def offsets(name: str, places: Mapping[str, int]) -> Any:
    """The places by name, as a named tuple, whose numbers compiled functions can read."""
    return namedtuple(name, list(places))(**places)


def _quantity(annotations: Sequence[Any]) -> Quantity | None:
    """The Quantity in a field's annotation, inside Annotated and unions."""
    for annotation in annotations:
        if isinstance(annotation, Quantity):
            return annotation
        if typing.get_origin(annotation) in (typing.Annotated, typing.Union, types.UnionType):
            if (inner := _quantity(typing.get_args(annotation))) is not None:
                return inner
    return None
