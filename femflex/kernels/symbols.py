"""Symbols: numbers, integers, lanes and pointers of code being compiled; arithmetic on them writes instructions."""

from __future__ import annotations

from typing import Any

import llvmlite.ir
import numba.extending
import numpy as np

from femflex.kernels import pointers

types: Any = numba.types  # these libraries are not annotated throughout
extending: Any = numba.extending
ir: Any = llvmlite.ir

WIDTH = 4
NUMBER, INTEGER = ir.DoubleType(), ir.IntType(64)
LANE = ir.VectorType(NUMBER, WIDTH)
NO_LANE = ir.Constant(LANE, ir.Undefined)


class LaneType(types.Type):  # type: ignore[misc]
    """Four numbers in one register."""

    def __init__(self) -> None:
        super().__init__("lane")


lane_type = LaneType()


@extending.register_model(LaneType)
class _LaneModel(extending.models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, LANE)


class Symbol:
    """A number, integer, lane or pointer of the code being compiled; arithmetic on it writes instructions.

    builder and value are llvmlite's; element is the type that a pointer points to.
    """

    __array_ufunc__ = None  # constant lanes leave arithmetic to the symbol

    def __init__(self, builder: Any, value: Any, element: Any = None) -> None:
        self.builder, self.value, self.element = builder, value, element

    def __add__(self, other: Any) -> Symbol:
        return self._instruction("add", self, other)

    def __radd__(self, other: Any) -> Symbol:
        return self._instruction("add", other, self)

    def __sub__(self, other: Any) -> Symbol:
        return self._instruction("sub", self, other)

    def __rsub__(self, other: Any) -> Symbol:
        return self._instruction("sub", other, self)

    def __mul__(self, other: Any) -> Symbol:
        return self._instruction("mul", self, other)

    def __rmul__(self, other: Any) -> Symbol:
        return self._instruction("mul", other, self)

    def __truediv__(self, other: Any) -> Symbol:
        return self._instruction("div", self, other)

    def __rtruediv__(self, other: Any) -> Symbol:
        return self._instruction("div", other, self)

    def __neg__(self) -> Symbol:
        return self._instruction("mul", -1.0, self)

    def _decide(self, *_: Any) -> bool:
        raise TypeError("a formula has no branches; compile the function with `inner` instead")

    __bool__ = __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = _decide
    __hash__ = None  # type: ignore[assignment]

    def __getitem__(self, i: Any) -> Symbol:
        return Symbol(self.builder, pointers.load(self.builder, self.address_of(i), self.element))

    def __setitem__(self, i: Any, number: Any) -> None:
        pointers.store(self.builder, self.like(number, self.element), self.address_of(i))

    def address_of(self, i: Any) -> Any:
        """Address of entry i of a pointer."""
        return pointers.address(self.builder, self.value, self.like(i, INTEGER), self.element)

    def like(self, other: Any, kind: Any) -> Any:
        """The value of a symbol or constant as an integer, number or lane."""
        if not isinstance(other, Symbol):
            if kind == LANE:
                return ir.Constant(LANE, [float(part) for part in np.broadcast_to(other, WIDTH)])
            return ir.Constant(kind, float(other) if kind == NUMBER else int(other))
        value = other.value
        if value.type == kind:
            return value
        if kind == LANE:
            first = self.builder.insert_element(NO_LANE, self.like(other, NUMBER), index(0))
            return self.builder.shuffle_vector(first, NO_LANE, indices(0, 0, 0, 0))
        return self.builder.sitofp(value, NUMBER)

    def _instruction(self, name: str, left: Any, right: Any) -> Symbol:
        kinds = [kind_of(side) for side in (left, right)]
        kind = LANE if LANE in kinds else NUMBER if NUMBER in kinds or name == "div" else INTEGER
        instruction = getattr(self.builder, name if kind == INTEGER else "f" + name)
        return Symbol(self.builder, instruction(self.like(left, kind), self.like(right, kind)))


def kind_of(value: Any) -> Any:
    """LLVM type of a symbol or constant."""
    if isinstance(value, Symbol):
        return value.value.type
    return LANE if isinstance(value, np.ndarray) else INTEGER if isinstance(value, int) else NUMBER


def index(i: int) -> Any:
    """Constant i as instructions on lanes take it."""
    return ir.Constant(ir.IntType(32), i)


def indices(*numbers: int) -> Any:
    """Constant row of integers, as shuffles take it."""
    return ir.Constant(ir.VectorType(ir.IntType(32), len(numbers)), list(numbers))
