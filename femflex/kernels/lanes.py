"""Lanes: four numbers that live in one register, loaded from and stored to flat arrays.

Rows over shapes are padded with zeros to whole lanes, so loops over them have no remainder and dot products are exact.
A three-vector in a lane leaves the fourth place free. With the compiler off a lane is an array (4,).
"""

from __future__ import annotations

import math
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.kernels import pointers
from femflex.kernels.formula import formula
from femflex.kernels.symbols import LANE, NUMBER, WIDTH, Symbol, index, indices, ir

Lane = Any
Lanes = tuple[Lane, ...]
A = TypeVar("A", bound=NDArray[Any])

ZEROS = np.zeros(WIDTH)


def padded(n: int) -> int:
    """Return the least multiple of the width that is at least n."""
    return -(-n // WIDTH) * WIDTH


@formula
def offset(a: A, i: int) -> A:
    """a[i:], as a pointer when compiled.

    Nothing is checked that is read through it, and it keeps nothing alive: the array must be an argument of the
    kernel, or held by the caller of the function that uses the pointer.
    """
    if isinstance(a, Symbol):
        return Symbol(a.builder, a.address_of(i), a.element)
    return a[i:]  # type: ignore[return-value]


@formula
def pointer(a: A) -> A:
    """The array a, as a pointer when compiled."""
    return offset(a, 0)


@formula
def lane(a: Array, i: int) -> Lane:
    """a[i : i + 4]."""
    if isinstance(a, Symbol):
        return Symbol(a.builder, pointers.load(a.builder, a.address_of(i), LANE, align=8))
    return a[i : i + WIDTH].copy()


@formula
def put_lane(a: Array, i: int, v: Lane) -> None:
    """a[i : i + 4] = v."""
    if isinstance(a, Symbol):
        pointers.store(a.builder, a.like(v, LANE), a.address_of(i), align=8)
    else:
        a[i : i + WIDTH] = v


@formula
def zero_lane() -> Lane:
    """Four zeros."""
    return ZEROS


@formula
def plus(v: Lanes, s: float, w: Lanes) -> Lanes:
    """v + s w."""
    return tuple(a + s * b for a, b in zip(v, w, strict=True))


@formula
def lane_of(x: float, y: float, z: float, w: float) -> Lane:
    """(x, y, z, w)."""
    parts: tuple[Any, ...] = (x, y, z, w)
    symbols = [part for part in parts if isinstance(part, Symbol)]
    if not symbols:
        return np.array(parts)
    builder, v = symbols[0].builder, ir.Constant(LANE, [0.0] * WIDTH)
    for i, part in enumerate(parts):
        v = builder.insert_element(v, symbols[0].like(part, NUMBER), index(i))
    return Symbol(builder, v)


def entry(v: Lane, i: int) -> float:
    """v[i]; inside formulas."""
    if isinstance(v, Symbol):
        return Symbol(v.builder, v.builder.extract_element(v.value, index(i)))  # type: ignore[return-value]
    return v[i]


@formula
def fourth(v: Lane) -> float:
    """The fourth number."""
    return entry(v, 3)


@formula
def with_fourth(v: Lane, w: float) -> Lane:
    """(v0, v1, v2, w)."""
    if isinstance(v, Symbol):
        return Symbol(v.builder, v.builder.insert_element(v.value, v.like(w, NUMBER), index(3)))
    return np.array([v[0], v[1], v[2], w])


def shuffled(a: Lane, b: Lane, *order: int) -> Lane:
    """Numbers of a (0 to 3) and b (4 to 7) in that order; inside formulas."""
    if isinstance(a, Symbol):
        return Symbol(a.builder, a.builder.shuffle_vector(a.value, a.like(b, LANE), indices(*order)))
    return np.concatenate([a, b])[list(order)]


@formula
def total(v: Lane) -> float:
    """v0 + v1 + v2 + v3."""
    pairs = v + shuffled(v, v, 2, 3, 2, 3)
    return entry(pairs, 0) + entry(pairs, 1)


@formula
def totals(a: Lane, b: Lane, c: Lane, d: Lane) -> Lane:
    """(total of a, of b, of c, of d)."""
    ab = shuffled(a, b, 0, 4, 2, 6) + shuffled(a, b, 1, 5, 3, 7)
    cd = shuffled(c, d, 0, 4, 2, 6) + shuffled(c, d, 1, 5, 3, 7)
    return shuffled(ab, cd, 0, 1, 4, 5) + shuffled(ab, cd, 2, 3, 6, 7)


@formula
def transposed(a: Lane, b: Lane, c: Lane, d: Lane) -> tuple[Lane, Lane, Lane, Lane]:
    """The columns of the matrix with rows a, b, c, d."""
    ab, AB = shuffled(a, b, 0, 4, 2, 6), shuffled(a, b, 1, 5, 3, 7)
    cd, CD = shuffled(c, d, 0, 4, 2, 6), shuffled(c, d, 1, 5, 3, 7)
    first, third = shuffled(ab, cd, 0, 1, 4, 5), shuffled(ab, cd, 2, 3, 6, 7)
    return first, shuffled(AB, CD, 0, 1, 4, 5), third, shuffled(AB, CD, 2, 3, 6, 7)


@formula
def cross_lane(a: Lane, b: Lane) -> Lane:
    """a x b of three-vectors in lanes."""
    next_a, next_b = shuffled(a, a, 1, 2, 0, 3), shuffled(b, b, 1, 2, 0, 3)
    v = a * next_b - next_a * b
    return shuffled(v, v, 1, 2, 0, 3)


@formula
def reciprocal(d: float) -> float:
    """1/d, and NaN for a pivot d that is not positive."""
    if isinstance(d, Symbol):
        positive = d.builder.fcmp_ordered(">", d.value, ir.Constant(NUMBER, 0.0))
        return Symbol(d.builder, d.builder.select(positive, (1.0 / d).value, ir.Constant(NUMBER, math.nan)))
    return 1.0 / d if d > 0.0 else math.nan


@formula
def sine(x: float) -> float:
    """sin x."""
    return _function("sin", x)


@formula
def cosine(x: float) -> float:
    """cos x."""
    return _function("cos", x)


@formula
def root(x: float) -> float:
    """Square root of x."""
    return _function("sqrt", x)


def _function(name: str, x: Any) -> Any:
    if isinstance(x, Symbol):
        call = x.builder.module.declare_intrinsic(f"llvm.{name}", [NUMBER])
        return Symbol(x.builder, x.builder.call(call, [x.like(x, NUMBER)]))
    return getattr(math, name)(x)
