"""Pairs of lanes: eight numbers, force or acceleration (3), one more, couple or angular acceleration (3), one more."""

from __future__ import annotations

from typing import Any

from femflex.arrays import Array
from femflex.kernels.formula import formula
from femflex.kernels.lanes import Lane, cross_lane, entry, lane, lane_of, put_lane, total, totals, zero_lane
from femflex.kernels.vectors import Vector

Pair = tuple[Lane, ...]

SLOTS = (0, 1, 2, 4, 5, 6)  # where the components of force and couple stand among the eight


@formula
def pair(a: Array, i: int) -> Pair:
    """The two lanes at a[i : i + 8]."""
    return lane(a, i), lane(a, i + 4)


@formula
def put_pair(a: Array, i: int, v: Pair) -> None:
    """Write two lanes to a[i : i + 8]."""
    put_lane(a, i, v[0])
    put_lane(a, i + 4, v[1])


@formula
def zero_pair() -> Pair:
    """Two lanes of zeros."""
    return zero_lane(), zero_lane()


@formula
def pair_of(f: Vector, m: Vector) -> Pair:
    """(f, 0; m, 0)."""
    return lane_of(f[0], f[1], f[2], 0.0), lane_of(m[0], m[1], m[2], 0.0)


@formula
def add_pair(a: Array, i: int, v: Pair) -> None:
    """Add two lanes to a[i : i + 8]."""
    put_lane(a, i, lane(a, i) + v[0])
    put_lane(a, i + 4, lane(a, i + 4) + v[1])


def six_of(v: Pair) -> list[Any]:
    """The six components; inside formulas."""
    return [entry(v[slot // 4], slot % 4) for slot in SLOTS]


@formula
def lane_vector(v: Lane) -> tuple[float, float, float]:
    """The three-vector in a lane."""
    return tuple(entry(v, i) for i in range(3))  # type: ignore[return-value]


@formula
def dot_pair(a: Pair, b: Pair) -> float:
    """a . b."""
    return total(a[0] * b[0] + a[1] * b[1])


@formula
def dot_four_rows(a: Array, i: int, stride: int, v: Pair) -> Lane:
    """v . row of four rows of eight, `stride` apart."""
    products = [lane(a, i + j * stride) * v[0] + lane(a, i + j * stride + 4) * v[1] for j in range(4)]
    return totals(products[0], products[1], products[2], products[3])


@formula
def wrench_at_origin(F: Pair, r: Vector) -> Pair:
    """Force and couple at the origin, of a force and couple at r."""
    return F[0], F[1] + cross_lane(lane_of(r[0], r[1], r[2], 0.0), F[0])
