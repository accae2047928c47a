"""The shapes' own rows: eliminated on the way to the root, solved on the way back.

They stand above the body's six rows [A | p] as a border: row k is [E_k | s_k, 0, Cr_k, pn_k], and Gauss's elimination
of the n elastic unknowns takes V_i (x) V_i / d_i off [A | p]. Where E is the unit matrix (shapes orthonormal over the
mass, no moving node that carries a joint) nothing has to be factorised.
"""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.bodies.added_mass import add_added_block, add_added_rows
from femflex.dynamics.bodies.shapes import columns_times, rows9, turning_of
from femflex.dynamics.bodies.slaves import tie_rows, write_tied_mass
from femflex.dynamics.bodies.stiffening import add_varying_block, write_varying_stiffness
from femflex.dynamics.layout.records import W_ACC, W_M, W_P, W_Q, W_S
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import lane, lane_of, plus, put_lane, reciprocal, transposed
from femflex.kernels.pairs import Pair, dot_four_rows, pair, put_pair
from femflex.kernels.spatial import body_rows, less_outer_at, put_six_rows, six_rows, weighted
from femflex.kernels.vectors import load3, load9


@inner
def write_rows(b: Record, pool: Array, work: Array) -> None:
    """Write [A | p] of the rigid motion, and next to it the elastic rows' coupling [s_k, 0, Cr_k, pn_k]."""
    w = b["work"]
    force, couple = load3(work, w + W_P), load3(work, w + W_P + 4)
    put_six_rows(work, w + W_M, body_rows(pool[b["mass"]], load3(work, w + W_S), load9(work, w + W_Q), force, couple))
    if b["n_slaves"]:
        write_coupling(b, pool, work, b["spread"], 8)
        tie_rows(b, work)
    else:
        write_coupling(b, pool, work, b["border"] + b["row"], b["stride"])
    if b["added"] > 0:
        add_added_rows(b, work)


@inner
def write_coupling(b: Record, pool: Array, work: Array, first: int, stride: int) -> None:
    """Write the rows [s_k, 0, Cr_k, pn_k] of all shapes from work[first], `stride` apart."""
    wide = b["wide"]
    for k in range(0, wide, 4):
        entry = first + k * stride
        turning = turning_of(rows9(work, b["Z"] + k, wide))
        columns = transposed(turning[0], turning[1], turning[2], lane(work, b["pn"] + k))
        for j in range(4):
            put_lane(work, entry + j * stride, lane(pool, b["momentum"] + 4 * (k + j)))
        put_lane(work, entry + 4, columns[0])
        put_lane(work, entry + stride + 4, columns[1])
        put_lane(work, entry + 2 * stride + 4, columns[2])
        put_lane(work, entry + 3 * stride + 4, columns[3])


@inner
def write_elastic_block(b: Record, pool: Array, work: Array, c_d: float, c_k: float) -> None:
    """Write E = Me + c_d D + c_k K into the border, or the factor of Me where nothing is added to it.

    K is the tangent stiffness V1 + 6 V2 d + 6 V3 dd at the state.
    """
    if b["dense"] == 1 or c_d != 0.0 or c_k != 0.0:
        if b["n_slaves"]:
            write_tied_mass(b, pool, work)
        else:
            copy_block(b, pool, work, b["elastic_mass"])
        if b["added"] > 0:
            add_added_block(b, work)
        add_block(b, pool, work, b["damping"], c_d)
        add_block(b, pool, work, b["stiffness"], c_k)
        if b["nonlinear"] and c_k != 0.0:
            write_varying_stiffness(b, pool, work, 6.0, 6.0)
            add_varying_block(b, work, c_k)
    elif b["orthonormal"] == 0:
        copy_block(b, pool, work, b["elastic_factor"])
        for k in range(0, b["row"], 4):
            put_lane(work, b["pivot"] + k, lane(pool, b["elastic_pivot"] + k))


@inner
def copy_block(b: Record, pool: Array, work: Array, block: int) -> None:
    """E = the matrix (n, row) at pool[block]."""
    row, stride, border = b["row"], b["stride"], b["border"]
    for i in range(b["n"]):
        for k in range(0, row, 4):
            put_lane(work, border + stride * i + k, lane(pool, block + row * i + k))


@inner
def add_block(b: Record, pool: Array, work: Array, block: int, c: float) -> None:
    """E + c times the matrix (n, row) at pool[block]."""
    row, stride, border = b["row"], b["stride"], b["border"]
    if c != 0.0:
        for i in range(b["n"]):
            for k in range(0, row, 4):
                entry = border + stride * i + k
                put_lane(work, entry, lane(work, entry) + c * lane(pool, block + row * i + k))


@inner
def refer_to_hinge(b: Record, work: Array) -> None:
    """Change unknowns from the body's own acceleration to that of marker Q's carrier, which moves by the columns G.

    B - A G replaces B, and E - G^T B - B^T G + G^T A G = E - G^T N - N^T G with N = B - A G / 2 replaces E.
    """
    n, row, stride, G, N = b["n"], b["row"], b["stride"], b["G"], b["N"]
    rows = six_rows(work, b["work"] + W_M)
    for k in range(n):
        entry = b["border"] + stride * k + row
        B = pair(work, entry)
        A_G = weighted(rows, work, G + k, row)  # (A G_k, p . G_k)
        put_pair(work, entry, (B[0] - A_G[0], B[1] - A_G[1]))
        put_pair(work, N + 8 * k, (B[0] - 0.5 * A_G[0], B[1] - 0.5 * A_G[1]))
    for i in range(n):
        for k in range(i // 4 * 4, row, 4):
            entry = b["border"] + stride * i + k
            E = lane(work, entry)
            for r in range(6):
                slot = r if r < 3 else r + 1
                g = lane(work, G + row * r + k)
                column = N + 8 * k + slot
                h = lane_of(work[column], work[column + 8], work[column + 16], work[column + 24])
                E = E - work[N + 8 * i + slot] * g - work[G + row * r + i] * h
            put_lane(work, entry, E)


@inner
def eliminate_elastic(b: Record, work: Array, stiff: bool) -> None:
    """Take the elastic unknowns out of [A | p], leaving rows Y = E^-1 [B^T, pn] in the border."""
    n, row, stride, border = b["n"], b["row"], b["stride"], b["border"]
    changing = b["dense"] == 1 or stiff
    plain = b["orthonormal"] == 1 and not changing
    rows = six_rows(work, b["work"] + W_M)
    for i in range(n):
        entry = border + stride * i + row
        if plain:
            V = pair(work, entry)
        else:
            if changing:
                factorise_row(b, work, i)
            V = reduced_row(b, work, i)
            put_pair(work, entry, V)
            d = work[b["pivot"] + i]
            V = (d * V[0], d * V[1])
        rows = less_outer_at(rows, work, entry, V)
    put_six_rows(work, b["work"] + W_M, rows)
    if not plain:
        substitute_back(b, work)


@inner
def factorise_row(b: Record, work: Array, i: int) -> None:
    """Row i of E less its part along the rows above, and the reciprocal of its pivot (NaN when not positive)."""
    row, stride, border, pivot = b["row"], b["stride"], b["border"], b["pivot"]
    first = i // 4 * 4
    for k in range(first, row, 4):
        E = lane(work, border + stride * i + k)
        for j in range(i):
            above = border + stride * j
            E = E - (work[above + i] * work[pivot + j]) * lane(work, above + k)
        put_lane(work, border + stride * i + k, E)
    work[pivot + i] = reciprocal(work[border + stride * i + i])


@inner
def reduced_row(b: Record, work: Array, i: int) -> Pair:
    """V_i: the coupling of row i less its part along the rows above."""
    row, stride, border, pivot = b["row"], b["stride"], b["border"], b["pivot"]
    V = pair(work, border + stride * i + row)
    for j in range(i):
        above = border + stride * j
        V = plus(V, -work[above + i] * work[pivot + j], pair(work, above + row))
    return V


@inner
def substitute_back(b: Record, work: Array) -> None:
    """Rows Y = E^-1 [B^T, pn] in place of V."""
    n, row, stride, border, pivot = b["n"], b["row"], b["stride"], b["border"], b["pivot"]
    for i in range(n - 1, -1, -1):
        row_start = border + stride * i
        Y = pair(work, row_start + row)
        for j in range(i + 1, n):
            Y = plus(Y, -work[row_start + j], pair(work, border + stride * j + row))
        d = work[pivot + i]
        put_pair(work, row_start + row, (d * Y[0], d * Y[1]))


@inner
def accelerate_shapes(b: Record, work: Array, out: Array) -> None:
    """Write the elastic accelerations -(Y a + E^-1 pn); the body's own acceleration follows its marker Q."""
    w, row, stride, accel = b["work"], b["row"], b["stride"], b["accel"]
    acc = pair(work, w + W_ACC)
    for k in range(0, row, 4):
        put_lane(work, accel + k, -1.0 * dot_four_rows(work, b["border"] + stride * k + row, stride, acc))
    for k in range(b["n"]):
        out[b["ue"] + k] = work[accel + k]
    if b["own_bends"]:
        put_pair(work, w + W_ACC, plus(acc, -1.0, columns_times(work, b["G"], row, accel)))
