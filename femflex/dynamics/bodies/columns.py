"""Columns G and Phi (6, row) of a marker at a body's origin: the acceleration there for that of each shape."""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.bodies.shapes import put_rows3, rows3
from femflex.dynamics.bodies.slaves import tie_columns
from femflex.kernels.compiled import inner
from femflex.kernels.formula import formula
from femflex.kernels.lanes import Lane, Lanes, lane, plus, totals, zero_lane
from femflex.kernels.pairs import Pair, six_of
from femflex.kernels.vectors import Matrix, Vector, add, cross, turn


@inner
def write_columns(work: Array, out: int, pool: Array, shape: int, spin: int, row: int, T: Matrix, arm: Vector) -> None:
    """Columns (6, row) of a marker seen at a point `arm` away from it: (phi + (T psi) x arm, T psi)."""
    for k in range(0, row, 4):
        rotations = turn(T, rows3(pool, spin + k, row))
        put_rows3(work, out + k, row, add(rows3(pool, shape + k, row), cross(rotations, arm)))
        put_rows3(work, out + 3 * row + k, row, rotations)


@inner
def write_marker_columns(
    carrier: Record, work: Array, out: int, pool: Array, shape: int, spin: int, T: Matrix, arm: Vector
) -> None:
    """Columns (6, row) over the coordinates of the marker's carrier, as `write_columns`."""
    if carrier["n_slaves"]:
        write_columns(work, carrier["columns"], pool, shape, spin, carrier["wide"], T, arm)
        tie_columns(carrier, work, out)
    else:
        write_columns(work, out, pool, shape, spin, carrier["row"], T, arm)


@formula
def six_lanes(a: Array, i: int, row: int) -> Lanes:
    """Lanes at the same place of six rows."""
    return tuple(lane(a, i + r * row) for r in range(6))


@inner
def columns_times(work: Array, columns: int, row: int, rates: int) -> Pair:
    """Six rows times the row of rates: acceleration (3), 0, (3), 0."""
    v = zero_columns()
    for k in range(0, row, 4):
        v = plus(v, lane(work, rates + k), six_lanes(work, columns + k, row))
    return six_totals(v)


@formula
def zero_columns() -> Lanes:
    """Six lanes of zeros."""
    return tuple(zero_lane() for _ in range(6))


@formula
def six_totals(v: Lanes) -> Pair:
    """Sums over the four shapes of each of six components, (3), 0, (3), 0."""
    return totals(v[0], v[1], v[2], zero_lane()), totals(v[3], v[4], v[5], zero_lane())


@formula
def wrench_times_columns(F: Pair, columns: Lanes) -> Lane:
    """F . Phi_j for four columns."""
    numbers = six_of(F)
    first = numbers[0] * columns[0]
    for r in range(1, 6):
        first = first + numbers[r] * columns[r]
    return first
