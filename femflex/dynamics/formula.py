"""Formulas without branches, written into the compiled caller wherever they are called.

`@formula` leaves a Python function as it is and tells the compiler to run it once per call with symbols in place of
numbers: every + - * / it meets becomes one instruction. So a formula may use loops, comprehensions and other formulas
freely (they are gone when compiled), costs no call, and compiles in no time. With the compiler off it simply runs.

Its arguments are numbers, integers, lanes, pointers to numbers, and tuples of these.
"""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable
from typing import Any, TypeVar

import llvmlite.ir
import numba.core.cgutils
import numba.core.typing.templates
import numba.extending
import numpy as np
from numpy.typing import NDArray

types: Any = numba.types  # these libraries are not annotated throughout
cgutils: Any = numba.core.cgutils
templates: Any = numba.core.typing.templates
extending: Any = numba.extending
ir: Any = llvmlite.ir

Array = NDArray[np.float64]
Lane = Any  # four numbers; with the compiler off an array (4,)
F = TypeVar("F", bound=Callable[..., Any])

WIDTH = 4
NUMBER, INTEGER = ir.DoubleType(), ir.IntType(64)
LANE = ir.VectorType(NUMBER, WIDTH)
NO_LANE = ir.Constant(LANE, ir.Undefined)


class LaneType(types.Type):  # type: ignore[misc]
    """Four numbers in one register."""

    def __init__(self) -> None:
        super().__init__("lane")


lane_type = LaneType()
_NUMBA = {NUMBER: types.float64, INTEGER: types.int64, LANE: lane_type}
_LLVM = {kind: llvm for llvm, kind in _NUMBA.items()}


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
        return self._with("add", self, other)

    def __radd__(self, other: Any) -> Symbol:
        return self._with("add", other, self)

    def __sub__(self, other: Any) -> Symbol:
        return self._with("sub", self, other)

    def __rsub__(self, other: Any) -> Symbol:
        return self._with("sub", other, self)

    def __mul__(self, other: Any) -> Symbol:
        return self._with("mul", self, other)

    def __rmul__(self, other: Any) -> Symbol:
        return self._with("mul", other, self)

    def __truediv__(self, other: Any) -> Symbol:
        return self._with("div", self, other)

    def __rtruediv__(self, other: Any) -> Symbol:
        return self._with("div", other, self)

    def __neg__(self) -> Symbol:
        return self._with("mul", -1.0, self)

    def _decide(self, *_: Any) -> bool:
        raise TypeError("a formula has no branches; compile the function with `inner` instead")

    __bool__ = __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = _decide
    __hash__ = None  # type: ignore[assignment]

    def __getitem__(self, i: Any) -> Symbol:
        return Symbol(self.builder, self.builder.load(self.at(i)))

    def __setitem__(self, i: Any, number: Any) -> None:
        self.builder.store(self.like(number, self.element), self.at(i))

    def at(self, i: Any) -> Any:
        """Address of entry i of a pointer."""
        return self.builder.gep(self.value, [self.like(i, INTEGER)])

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
            first = self.builder.insert_element(NO_LANE, self.like(other, NUMBER), place(0))
            return self.builder.shuffle_vector(first, NO_LANE, places(0, 0, 0, 0))
        return self.builder.sitofp(value, NUMBER)

    def _with(self, name: str, left: Any, right: Any) -> Symbol:
        kinds = [_kind(side) for side in (left, right)]
        kind = LANE if LANE in kinds else NUMBER if NUMBER in kinds or name == "div" else INTEGER
        instruction = getattr(self.builder, name if kind == INTEGER else "f" + name)
        return Symbol(self.builder, instruction(self.like(left, kind), self.like(right, kind)))


def place(i: int) -> Any:
    """Constant i as instructions on lanes take it."""
    return ir.Constant(ir.IntType(32), i)


def places(*numbers: int) -> Any:
    """Constant row of integers, as shuffles take it."""
    return ir.Constant(ir.VectorType(ir.IntType(32), len(numbers)), list(numbers))


def formula(f: F) -> F:
    """The function itself, known to the compiler as a formula."""
    parameters = list(inspect.signature(f).parameters.values())

    @extending.type_callable(f)
    def typer(context: Any) -> Any:
        def typed(*args: Any) -> Any:
            kinds = tuple(types.unliteral(arg) for arg in args)
            scratch = ir.Function(ir.Module(), ir.FunctionType(ir.VoidType(), []), "scratch")
            builder = ir.IRBuilder(scratch.append_basic_block())
            return templates.signature(_type_of(f(*(_symbols(None, builder, kind) for kind in kinds))), *kinds)

        plain = [parameter.replace(annotation=inspect.Parameter.empty) for parameter in parameters]
        typed.__signature__ = inspect.Signature(plain)  # type: ignore[attr-defined]
        return typed

    @extending.lower_builtin(f, types.VarArg(types.Any))
    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        result = f(*(_symbols(context, builder, *pair) for pair in zip(sig.args, args, strict=True)))
        return _value(context, builder, sig.return_type, result)

    return f


def _symbols(context: Any, builder: Any, kind: Any, value: Any = None) -> Any:
    """Symbols of an argument of that type; without a value they only serve to find the result's type."""
    if isinstance(kind, types.BaseTuple):
        parts = [None] * len(kind) if value is None else cgutils.unpack_tuple(builder, value)
        return tuple(_symbols(context, builder, *pair) for pair in zip(kind, parts, strict=True))
    element = _LLVM[kind.dtype] if isinstance(kind, types.CPointer | types.Array) else None
    if value is None:
        value = ir.Constant(element.as_pointer() if element else _LLVM[kind], ir.Undefined)
    elif isinstance(kind, types.Array):
        value = context.make_array(kind)(context, builder, value).data
    return Symbol(builder, value, element)


def _kind(value: Any) -> Any:
    if isinstance(value, Symbol):
        return value.value.type
    return LANE if isinstance(value, np.ndarray) else INTEGER if isinstance(value, int) else NUMBER


def _type_of(result: Any) -> Any:
    if result is None:
        return types.none
    if isinstance(result, tuple):
        return types.BaseTuple.from_types([_type_of(part) for part in result])
    if isinstance(result, Symbol) and result.element is not None:
        return types.CPointer(_NUMBA[result.element])
    return _NUMBA[_kind(result)]


def _value(context: Any, builder: Any, kind: Any, result: Any) -> Any:
    if result is None:
        return context.get_dummy_value()
    if isinstance(result, tuple):
        parts = [_value(context, builder, *pair) for pair in zip(kind, result, strict=True)]
        return context.make_tuple(builder, kind, parts)
    return Symbol(builder, None).like(result, _LLVM[kind]) if not isinstance(result, Symbol) else result.value


def _operate(operation: Any) -> None:
    """Let compiled code that is not itself a formula do arithmetic on lanes."""

    @templates.infer_global(operation)
    class Operation(templates.AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            if lane_type in args and all(arg == lane_type or isinstance(arg, types.Float) for arg in args):
                return templates.signature(lane_type, *args)
            return None

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return operation(*(Symbol(builder, arg) for arg in args)).value

    for pair in ((lane_type, lane_type), (lane_type, types.Float), (types.Float, lane_type)):
        extending.lower_builtin(operation, *pair)(lowered)


for _operation in (operator.add, operator.sub, operator.mul):
    _operate(_operation)
