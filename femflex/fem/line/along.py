"""Quantities that vary along a member: numbers, tables or formulas of the arc length s."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

Array = NDArray[np.float64]
Along = float | str | Sequence[ArrayLike] | Array  # a number, a formula of s and L, or a table (s, values)

OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: getattr(np, name)
    for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "arctan", "sqrt", "exp", "log", "abs")
} | {"min": np.minimum, "max": np.maximum}


def varies(value: Along) -> bool:
    """Whether the quantity is a table or a formula rather than a number."""
    return not isinstance(value, (int, float, np.number))


def along(value: Along, s: Array, length: Array | float) -> Array:
    """The quantity at arc lengths s [m] of a member whose whole arc length is `length` [m], in the shape of s.

    A table (s, values) is interpolated by a monotone cubic (PCHIP): through its points, C1, without overshoot, linear
    between two points; error O(h^3) for smooth data, O(h^2) at its extrema. A formula is
    arithmetic of s, L (the whole arc length) and pi with the functions in FUNCTIONS.
    Raises ValueError on a formula or table that is not understood, is short of s, or is not finite.
    """
    if isinstance(value, str):
        found = formula(value, {"s": s, "L": np.asarray(length, float), "pi": np.float64(np.pi)})
    elif isinstance(value, (int, float, np.number)):
        found = np.asarray(value, float)
    else:
        found = table(value, s)
    found = np.broadcast_to(found, s.shape)
    bad = ~np.isfinite(found)
    if bad.any():
        at, what = s[bad].flat[0], found[bad].flat[0]
        raise ValueError(f"{value!r} is {what} at s = {at:.6g} m; it must be finite along the whole member")
    return found


def table(rows: Sequence[ArrayLike] | Array, s: Array) -> Array:
    """Values at s of a table (s, values) by monotone cubic interpolation."""
    if len(rows) != 2 or np.shape(rows[0]) != np.shape(rows[1]) or np.ndim(rows[0]) != 1 or np.size(rows[0]) < 2:
        raise ValueError(f"a table along a member is (s, values), two rows of equal length, at least 2; got {rows!r}")
    at, values = np.asarray(rows[0], float), np.asarray(rows[1], float)
    if not (np.isfinite(at).all() and np.isfinite(values).all()):
        raise ValueError(
            f"a table along a member holds numbers that are not finite: s {at.tolist()}, {values.tolist()}"
        )
    if not (np.diff(at) > 0).all():
        raise ValueError(f"arc lengths of a table along a member must increase; got {at.tolist()} m")
    slack = 1e-9 * (at[-1] - at[0])
    if s.min() < at[0] - slack or s.max() > at[-1] + slack:
        raise ValueError(
            f"a table covers s = {at[0]:g} to {at[-1]:g} m, but the member is used from {s.min():.6g} to "
            f"{s.max():.6g} m; extend the table over the whole arc length"
        )
    return np.asarray(PchipInterpolator(at, values)(np.clip(s, at[0], at[-1])), float)


def formula(text: str, names: dict[str, Any]) -> Array:
    """Value of an arithmetic formula of the names; nothing but arithmetic is ever run."""
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        raise ValueError(f"formula {text!r} cannot be read: {error.msg} at character {error.offset}") from None
    with np.errstate(all="ignore"):  # what is not finite is reported by the caller
        return np.asarray(_value(tree, names, text), float)


def _value(node: ast.expr, names: dict[str, Any], text: str) -> Any:
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as number):
            return np.float64(number)
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, names, text)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _value(operand, names, text)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_value(left, names, text), _value(right, names, text))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            try:
                return FUNCTIONS[name](*(_value(arg, names, text) for arg in args))
            except TypeError:
                raise ValueError(f"formula {text!r}: {name} does not take {len(args)} arguments") from None
    raise ValueError(
        f"formula {text!r} holds {ast.unparse(node)!r}; it may use the names {sorted(names)}, numbers, "
        f"+ - * / ** and {', '.join(FUNCTIONS)}"
    )
