"""Formulas of the arc length or of positions: of their syntax tree only arithmetic is evaluated."""

from __future__ import annotations

import ast
import operator
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from femflex.arrays import Array

LONGEST = 2000  # characters; longer input must be a table
OPERATORS: dict[type[ast.operator] | type[ast.unaryop], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
OF_ONE: dict[str, Callable[..., Any]] = {
    name: getattr(np, name)
    for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "arctan", "sqrt", "exp", "log", "abs")
}
OF_SEVERAL: dict[str, Callable[..., Any]] = {  # two or more
    "min": lambda *values: np.minimum.reduce(np.broadcast_arrays(*values)),
    "max": lambda *values: np.maximum.reduce(np.broadcast_arrays(*values)),
}


def formula(text: str, s: Array, length: Array | float) -> Array:
    """Value of an arithmetic formula of the arc lengths s [m], the whole arc length L [m] and pi, in the shape of s.

    Raises ValueError for all but arithmetic, for a wrong number of arguments, and where a part of the formula is not
    finite at some s: a division by zero, an overflow, the root of a negative number.
    """
    return evaluate_formula(text, {"s": s, "L": np.asarray(length, float), "pi": np.float64(np.pi)})


def formula_of_position(text: str, x: Array) -> Array:
    """Value of an arithmetic formula of x, y and z [m] and pi at positions x (..., 3), in the shape of one coordinate.

    Raises ValueError as `formula` does.
    """
    return evaluate_formula(text, {"x": x[..., 0], "y": x[..., 1], "z": x[..., 2], "pi": np.float64(np.pi)})


def evaluate_formula(text: str, names: Mapping[str, Any]) -> Array:
    """Value of an arithmetic formula of these names, in the shape of the first of them and the unit that the formula
    gives."""
    if len(text) > LONGEST:
        raise ValueError(
            f"formula {_quoted(text)} has {len(text)} characters; at most {LONGEST} are read. Give a table instead."
        )
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):  # values that are not finite are reported
            warnings.simplefilter("ignore")  # warnings about Python's grammar
            tree = ast.parse(text.strip(), mode="eval").body
            return np.array(np.broadcast_to(_value(tree, text, names), _shape(names)))
    except (RecursionError, MemoryError):
        raise ValueError(f"formula {_quoted(text)} nests too deeply; write it with fewer parentheses.") from None
    except SyntaxError as error:
        position = f" at character {error.offset}" if error.offset else ""
        raise ValueError(f"formula {_quoted(text)} cannot be read: {error.msg}{position}") from None


def _shape(names: Mapping[str, Any]) -> tuple[int, ...]:
    return np.shape(next(iter(names.values())))


def _value(node: ast.expr, text: str, names: Mapping[str, Any]) -> Array:
    """The value of a part of a formula."""
    operands: Sequence[ast.expr] = ()
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            operation: Callable[..., Any] = partial(_float, number)
        case ast.Name(id=name) if name in names:
            operation = partial(names.__getitem__, name)
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            operation, operands = OPERATORS[type(op)], [operand]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            operation, operands = OPERATORS[type(op)], [left, right]
        case ast.Call(func=ast.Name(id=name), args=operands, keywords=[]) if name in {**OF_ONE, **OF_SEVERAL}:
            operation, least = (
                (OF_ONE[name], "1 argument") if name in OF_ONE else (OF_SEVERAL[name], "2 arguments or more")
            )
            if len(operands) < 2 if name in OF_SEVERAL else len(operands) != 1:
                raise ValueError(f"formula {_quoted(text)}: {name} takes {least}; found {len(operands)}")
        case _:
            raise ValueError(
                f"formula {_quoted(text)} holds {_source_text(text, node)}; it may use the names {sorted(names)}, "
                f"numbers, + - * / ** and {', '.join([*OF_ONE, *OF_SEVERAL])}"
            )
    value = np.asarray(operation(*(_value(operand, text, names) for operand in operands)), float)
    bad = np.broadcast_to(~np.isfinite(value), shape := _shape(names))
    if bad.any():
        where = ", ".join(f"{key} = {x[bad].flat[0]:.6g} m" for key, x in names.items() if np.shape(x) == shape)
        raise ValueError(
            f"formula {_quoted(text)}: {_source_text(text, node)} is {np.broadcast_to(value, shape)[bad].flat[0]} at "
            f"{where}; it must be finite along the whole member"
        )
    return value


def _float(number: float) -> float:
    try:
        return float(number)
    except OverflowError:  # a whole number above 1.8e308
        return np.inf


def _source_text(text: str, node: ast.expr) -> str:
    return _quoted(ast.get_source_segment(text.strip(), node) or text)


def _quoted(text: str) -> str:
    """A formula in quotes, cut where it is long."""
    return repr(text if len(text) <= 80 else text[:77] + "...")
