"""Motion of a body's markers by its elastic coordinates: rows over shapes (phi, psi) times coordinates and rates.

Columns G and Phi (6, row) of a marker give the acceleration at a body's origin for that of each shape.
"""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.layout.records import TURNS, VARIES
from femflex.kernels.compiled import inner
from femflex.kernels.formula import formula
from femflex.kernels.lanes import Lane, Lanes, lane, plus, put_lane, total, totals, zero_lane
from femflex.kernels.pairs import Pair, six_of
from femflex.kernels.section_turns import section_drift, section_slope, section_vector
from femflex.kernels.turns import moving_vector_turn
from femflex.kernels.vectors import ZERO, Matrix, Vector, add, cross, load3, product, scale, turn


@inner
def write_columns(work: Array, out: int, pool: Array, shape: int, spin: int, row: int, T: Matrix, arm: Vector) -> None:
    """Columns (6, row) of a marker seen at a point `arm` away from it: (phi + (T psi) x arm, T psi)."""
    for k in range(0, row, 4):
        rotations = turn(T, rows3(pool, spin + k, row))
        put_rows3(work, out + k, row, add(rows3(pool, shape + k, row), cross(rotations, arm)))
        put_rows3(work, out + 3 * row + k, row, rotations)


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


@formula
def rows3(a: Array, i: int, row: int) -> Lanes:
    """Lanes at the same place of three rows: a vector of four shapes at once."""
    return lane(a, i), lane(a, i + row), lane(a, i + 2 * row)


@formula
def put_rows3(a: Array, i: int, row: int, v: Lanes) -> None:
    """Write lanes at the same place of three rows."""
    for r in range(3):
        put_lane(a, i + r * row, v[r])


@formula
def rows9(a: Array, i: int, row: int) -> Lanes:
    """Lanes at the same place of nine rows: a matrix of four shapes at once."""
    return tuple(lane(a, i + r * row) for r in range(9))


@formula
def put_rows9(a: Array, i: int, row: int, m: Lanes) -> None:
    """Write lanes at the same place of nine rows."""
    for r in range(9):
        put_lane(a, i + r * row, m[r])


@formula
def zero_rows3() -> Lanes:
    """Three lanes of zeros."""
    return tuple(zero_lane() for _ in range(3))


@formula
def zero_rows9() -> Lanes:
    """Nine lanes of zeros."""
    return tuple(zero_lane() for _ in range(9))


@formula
def totals3(v: Lanes) -> Vector:
    """Sum over the four shapes of each component."""
    return total(v[0]), total(v[1]), total(v[2])


@formula
def turning_of(z: Lanes) -> Lanes:
    """Cr_a = eps_abc Z[b,c] of four shapes."""
    return z[5] - z[7], z[6] - z[2], z[1] - z[3]


@inner
def copy_shape_coordinates(b: Record, q: Array, u: Array, work: Array) -> None:
    """Copy the elastic coordinates and rates to whole lanes."""
    n = b["n"]
    for k in range(n):
        work[b["delta"] + k] = q[b["qe"] + k]
        work[b["ddelta"] + k] = u[b["ue"] + k]
    for k in range(n, b["wide"]):
        work[b["delta"] + k] = 0.0
        work[b["ddelta"] + k] = 0.0


@inner
def combined(a: Array, rows: int, row: int, work: Array, y: int) -> Vector:
    """Three rows at a[rows] times the row at work[y]."""
    v = zero_rows3()
    for k in range(0, row, 4):
        v = plus(v, lane(work, y + k), rows3(a, rows + k, row))
    return totals3(v)


@inner
def marker_velocity(pool: Array, marker: int, shape: int, bends: int, carrier: Record, work: Array) -> Vector:
    """Velocity of a marker relative to its carrier, in its components."""
    wide = carrier["wide"]
    v = combined(pool, shape, wide, work, carrier["ddelta"])
    if bends >= VARIES:
        v = add(v, add(load3(pool, marker + 16), combined(pool, shape + 3 * wide, wide, work, carrier["delta"])))
    return v


@inner
def varying_bias(pool: Array, rows: int, carrier: Record, work: Array) -> Vector:
    """2 phidot ddelta + phiddot delta of rows (3,wide) behind which their rates stand."""
    wide = carrier["wide"]
    twice = scale(2.0, combined(pool, rows + 3 * wide, wide, work, carrier["ddelta"]))
    return add(twice, combined(pool, rows + 6 * wide, wide, work, carrier["delta"]))


@inner
def markers_motion(
    pool: Array, marker: int, shape: int, spin: int, bends: int, carrier: Record, work: Array
) -> tuple[Vector, Vector, Matrix, Matrix, Vector, Vector, Vector]:
    """Displacement and velocity of a marker, its turn exp(skew(theta)), the tangent T, rate; bias accelerations.

    theta = psi delta, or what `section_turns` makes of it, and T psi gives the rate. The biases are of the turn and of
    the displacement, the second zero unless shapes follow others or the marker varies with time.

    All relative to the carrier, in its components.
    """
    wide, delta, ddelta = carrier["wide"], carrier["delta"], carrier["ddelta"]
    displacement, velocity = (
        combined(pool, shape, wide, work, delta),
        marker_velocity(pool, marker, shape, bends, carrier, work),
    )
    theta, dtheta = combined(pool, spin, wide, work, delta), combined(pool, spin, wide, work, ddelta)
    lift, swing = ZERO, ZERO
    if bends >= VARIES:
        dtheta = add(dtheta, combined(pool, spin + 3 * wide, wide, work, delta))
        lift = add(load3(pool, marker + 19), varying_bias(pool, shape, carrier, work))
        swing = varying_bias(pool, spin, carrier, work)
    if bends == TURNS or bends == VARIES + TURNS:
        e = load3(pool, marker + 12)
        F, extra = section_slope(e, theta), section_drift(e, theta, dtheta)
        bend, T, rate, bias = moving_vector_turn(section_vector(e, theta), turn(F, dtheta))
        bias = add(bias, turn(T, extra))
        T = product(T, F)
    else:
        bend, T, rate, bias = moving_vector_turn(theta, dtheta)
    if bends >= VARIES:
        bias = add(bias, turn(T, swing))
    if carrier["n_slaves"]:
        lift = add(lift, combined(pool, shape, wide, work, carrier["drift"]))
        bias = add(bias, turn(T, combined(pool, spin, wide, work, carrier["drift"])))
    return displacement, velocity, bend, T, rate, bias, lift
