"""Formulas without branches, written into the compiled caller wherever they are called.

`@formula` leaves a Python function as it is and makes the compiler run it once per call with symbols in place of
numbers: every + - * / it meets becomes one instruction. So a formula may use loops, comprehensions and other formulas
freely (they are gone when compiled), costs no call, and compiles in no time. With the compiler off it simply runs.

Its arguments are numbers, integers, lanes, pointers to numbers, and tuples of these.
"""

from __future__ import annotations

import inspect
import operator
from collections.abc import Callable
from typing import Any, TypeVar

import numba.core.cgutils
import numba.core.typing.templates

from femflex.kernels.pointers import pointer_to
from femflex.kernels.symbols import INTEGER, LANE, NUMBER, Symbol, extending, ir, kind_of, lane_type, types

cgutils: Any = numba.core.cgutils
templates: Any = numba.core.typing.templates

F = TypeVar("F", bound=Callable[..., Any])

_NUMBA = {NUMBER: types.float64, INTEGER: types.int64, LANE: lane_type}
_LLVM = {kind: llvm for llvm, kind in _NUMBA.items()}


def formula(f: F) -> F:
    """The function itself, known to the compiler as a formula."""
    parameters = list(inspect.signature(f).parameters.values())
    signatures: dict[Any, Any] = {}  # types of the arguments -> signature

    @extending.type_callable(f)
    def typer(context: Any) -> Any:
        def typed(*args: Any) -> Any:
            kinds = tuple(types.unliteral(arg) for arg in args)
            if kinds not in signatures:
                scratch = ir.Function(ir.Module(), ir.FunctionType(ir.VoidType(), []), "scratch")
                builder = ir.IRBuilder(scratch.append_basic_block())
                result = f(*(_symbols(None, builder, kind) for kind in kinds))
                signatures[kinds] = templates.signature(_type_of(result), *kinds)
            return signatures[kinds]

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
        value = ir.Constant(pointer_to(element) if element else _LLVM[kind], ir.Undefined)
    elif isinstance(kind, types.Array):
        value = context.make_array(kind)(context, builder, value).data
    return Symbol(builder, value, element)


def _type_of(result: Any) -> Any:
    if result is None:
        return types.none
    if isinstance(result, tuple):
        return types.BaseTuple.from_types([_type_of(part) for part in result])
    if isinstance(result, Symbol) and result.element is not None:
        return types.CPointer(_NUMBA[result.element])
    return _NUMBA[kind_of(result)]


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
