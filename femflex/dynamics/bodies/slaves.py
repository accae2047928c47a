"""Condensed bodies (quadratic manifold): the amplitudes eta = (delta, y) of all shapes over few coordinates delta.

Slaved amplitudes y_s = 1/2 delta.A_s delta, A_s symmetric, hold the in-plane and axial response to bending. With the
tie D = dy/d(delta) = delta^T A and Y = (1, D): d(eta)/dt = Y ddelta, and the accelerations of all shapes are
Y ddot(delta) + g with the drift g_s = ddelta.A_s ddelta. Moments, markers and loads know all shapes; the rows over
shapes become rows over coordinates by Y^T here, and the recursion knows only these.
"""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.bodies.shapes import rows3, rows9, totals3, turning_of, write_columns, zero_rows3
from femflex.dynamics.layout.records import W_P
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import lane, plus, put_lane, total, zero_lane
from femflex.kernels.pairs import Pair, add_pair, pair, pair_of, put_pair, zero_pair
from femflex.kernels.vectors import Matrix, Vector


@inner
def write_slaves(b: Record, pool: Array, work: Array) -> None:
    """Write the tie D (n_slaves, row), and amplitudes, rates and drift of the slaved shapes from the coordinates."""
    n, row, delta, ddelta = b["n"], b["row"], b["delta"], b["ddelta"]
    for s in range(b["n_slaves"]):
        A, D = b["slaves"] + s * n * row, b["tie"] + s * row
        y, rate, drift = zero_lane(), zero_lane(), zero_lane()
        for k in range(0, row, 4):
            tie, tie_rate = zero_lane(), zero_lane()
            for j in range(n):
                column = lane(pool, A + j * row + k)
                tie = tie + work[delta + j] * column
                tie_rate = tie_rate + work[ddelta + j] * column
            put_lane(work, D + k, tie)
            y = y + 0.5 * (tie * lane(work, delta + k))
            rate = rate + tie * lane(work, ddelta + k)
            drift = drift + tie_rate * lane(work, ddelta + k)
        work[delta + n + s] = total(y)
        work[ddelta + n + s] = total(rate)
        work[b["drift"] + n + s] = total(drift)


@inner
def add_drift_forces(b: Record, pool: Array, work: Array) -> None:
    """Add the inertia forces of the slaved shapes' drift to the bias wrench and the bias of all shapes."""
    wide, drift = b["wide"], b["drift"]
    ds, h = zero_rows3(), zero_rows3()
    for k in range(0, wide, 4):
        g = lane(work, drift + k)
        ds = plus(ds, g, rows3(pool, b["first"] + k, wide))
        h = plus(h, g, turning_of(rows9(work, b["Z"] + k, wide)))
        force = lane(work, b["pn"] + k)
        for j in range(b["n"], b["n_shapes"]):
            force = force + work[drift + j] * lane(pool, b["elastic_mass"] + wide * j + k)
        put_lane(work, b["pn"] + k, force)
    add_pair(work, b["work"] + W_P, pair_of(totals3(ds), totals3(h)))


@inner
def tie_columns(b: Record, work: Array, out: int) -> None:
    """Columns (6, row) over the coordinates at work[out] from those over all shapes at work[b["columns"]]."""
    n, row, wide = b["n"], b["row"], b["wide"]
    for r in range(6):
        start = b["columns"] + r * wide
        for k in range(0, row, 4):
            v = lane(work, start + k)
            for s in range(b["n_slaves"]):
                v = v + work[start + n + s] * lane(work, b["tie"] + s * row + k)
            put_lane(work, out + r * row + k, v)
        for k in range(n, row):
            work[out + r * row + k] = 0.0


@inner
def tie_rows(b: Record, work: Array) -> None:
    """Write the coupling rows of the border from those over all shapes at work[b["spread"]]."""
    n, row, stride, spread = b["n"], b["row"], b["stride"], b["spread"]
    for k in range(row):
        v = zero_pair()
        if k < n:
            v = tied_row(b, work, k, spread)
        put_pair(work, b["border"] + stride * k + row, v)


@inner
def tied_row(b: Record, work: Array, k: int, spread: int) -> Pair:
    """Row k of the coordinates: that of its own shape, and of the slaved ones as much as they follow."""
    v = pair(work, spread + 8 * k)
    for s in range(b["n_slaves"]):
        v = plus(v, work[b["tie"] + s * b["row"] + k], pair(work, spread + 8 * (b["n"] + s)))
    return v


@inner
def write_tied_mass(b: Record, pool: Array, work: Array) -> None:
    """Write E = Y^T Me Y into the border.

    E = Me_ff + D^T W + W^T D with W_s = Me_sf + 1/2 Me_ss D, one slaved shape after the other.
    """
    n, row, wide, stride, border, tie = b["n"], b["row"], b["wide"], b["stride"], b["border"], b["tie"]
    Me, W = b["elastic_mass"], b["pull"]
    for i in range(n):
        for k in range(0, row, 4):
            put_lane(work, border + stride * i + k, lane(pool, Me + wide * i + k))
    for s in range(b["n_slaves"]):
        mass_row, D = Me + wide * (n + s), tie + s * row
        for k in range(0, row, 4):
            pull = lane(pool, mass_row + k)
            for j in range(b["n_slaves"]):
                pull = pull + (0.5 * pool[mass_row + n + j]) * lane(work, tie + j * row + k)
            put_lane(work, W + k, pull)
        for i in range(n):
            for k in range(0, row, 4):
                entry = border + stride * i + k
                E = lane(work, entry) + work[D + i] * lane(work, W + k) + work[W + i] * lane(work, D + k)
                put_lane(work, entry, E)


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
