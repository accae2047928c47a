"""Formulas of the arc length: they are parsed into a list of operations of known arity, and evaluated by these only."""

from __future__ import annotations

import ast
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from femflex.arrays import Array

Operation = Callable[..., Any]

LONGEST = 2000  # characters; longer input must be a table
NAMES = ("s", "L", "pi")
OPERATORS: dict[type[ast.operator] | type[ast.unaryop], Operation] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
    ast.USub: lambda a: -a,
    ast.UAdd: lambda a: a,
}
OF_ONE: dict[str, Operation] = {
    name: getattr(np, name)
    for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "arctan", "sqrt", "exp", "log", "abs")
}
OF_SEVERAL: dict[str, Operation] = {  # two or more
    "min": lambda *values: np.minimum.reduce(np.broadcast_arrays(*values)),
    "max": lambda *values: np.maximum.reduce(np.broadcast_arrays(*values)),
}


@dataclass(frozen=True)
class Step:
    """One operation on the last `arity` values; `node` is the part of the formula that it evaluates."""

    node: ast.expr
    operation: Operation
    arity: int


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
    shape = np.shape(next(iter(names.values())))
    values: list[Any] = []
    with np.errstate(all="ignore"):  # values that are not finite are reported below
        for step in _steps(text, tuple(names)):
            first = len(values) - step.arity
            value = np.asarray(step.operation(names, *values[first:]), float)
            _check_finite(text, step.node, value, names, shape)
            values[first:] = [value]
    return np.array(np.broadcast_to(values[0], shape))


def _steps(text: str, names: tuple[str, ...] = NAMES) -> list[Step]:
    """The operations of a formula, each after those of its operands; without recursion, however deep it nests."""
    steps: list[Step] = []
    nodes: list[ast.expr] = [_tree(text)]
    while nodes:
        node = nodes.pop()
        operation, operands = _operation(node, text, names)
        steps.append(Step(node, operation, len(operands)))
        nodes += operands
    return steps[::-1]


def _tree(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise ValueError(
            f"formula {_quoted(text)} has {len(text)} characters; at most {LONGEST} are read. Give a table instead."
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about Python's grammar
            return ast.parse(text.strip(), mode="eval").body
    except (RecursionError, MemoryError):
        raise ValueError(f"formula {_quoted(text)} nests too deeply; write it with fewer parentheses.") from None
    except SyntaxError as error:
        position = f" at character {error.offset}" if error.offset else ""
        raise ValueError(f"formula {_quoted(text)} cannot be read: {error.msg}{position}") from None
    except ValueError as error:  # a null character
        raise ValueError(f"formula {_quoted(text)} cannot be read: {error}") from None


def _operation(node: ast.expr, text: str, allowed: tuple[str, ...]) -> tuple[Operation, list[ast.expr]]:
    """Return the function that a node applies to the values of its operands, and the operands; the first argument of
    the function is the dictionary of names."""
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as number):
            return lambda names: _float(number), []
        case ast.Name(id=name) if name in allowed:
            return lambda names: names[name], []
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            return _without_names(OPERATORS[type(op)]), [operand]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return _without_names(OPERATORS[type(op)]), [left, right]
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in OF_ONE or name in OF_SEVERAL:
            _check_arity(name, len(args), text)
            return _without_names(OF_ONE[name] if name in OF_ONE else OF_SEVERAL[name]), args
    raise ValueError(
        f"formula {_quoted(text)} holds {_source_text(text, node)}; it may use the names {sorted(allowed)}, numbers, "
        f"+ - * / ** and {', '.join([*OF_ONE, *OF_SEVERAL])}"
    )


def _without_names(operation: Operation) -> Operation:
    return lambda names, *values: operation(*values)


def _float(number: float) -> float:
    try:
        return float(number)
    except OverflowError:  # a whole number above 1.8e308
        return np.inf


def _check_arity(name: str, count: int, text: str) -> None:
    if name in OF_ONE and count != 1:
        raise ValueError(f"formula {_quoted(text)}: {name} takes 1 argument; found {count}")
    if name in OF_SEVERAL and count < 2:
        raise ValueError(f"formula {_quoted(text)}: {name} takes 2 arguments or more; found {count}")


def _check_finite(text: str, node: ast.expr, found: Array, names: Mapping[str, Any], shape: tuple[int, ...]) -> None:
    bad = np.broadcast_to(~np.isfinite(found), shape)
    if bad.any():
        bad_value = np.broadcast_to(found, shape)[bad].flat[0]
        where = ", ".join(
            f"{key} = {value[bad].flat[0]:.6g} m" for key, value in names.items() if np.shape(value) == shape
        )
        raise ValueError(
            f"formula {_quoted(text)}: {_source_text(text, node)} is {bad_value} at {where}; it must be finite along "
            "the whole member"
        )


def _source_text(text: str, node: ast.expr) -> str:
    return _quoted(ast.get_source_segment(text.strip(), node) or text)


def _quoted(text: str) -> str:
    """A formula in quotes, cut where it is long."""
    return repr(text if len(text) <= 80 else text[:77] + "...")
