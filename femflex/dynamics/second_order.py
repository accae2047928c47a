"""The equations of motion (9) as implicit integrators and studies ask for them: residual, linear solve, kinematics.

Compiled apart from `rate`, and only when first asked for.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from femflex.dynamics.equations import place
from femflex.dynamics.forces import write_forces
from femflex.dynamics.inertia import accelerate_uniformly, zero_forces
from femflex.dynamics.kinematics import advance_coordinates, coordinate_rates
from femflex.dynamics.layout import W_A, W_ACC, W_BIAS, W_CIN, W_CIP, W_H, W_P, W_R, W_TAU, bodies_of, header_of
from femflex.dynamics.recursion import accelerate, carry_acceleration, reduce_to_root
from femflex.dynamics.vectors import accumulate3, add, cross, inner, load3, load9, scale, store3, turn, turn_back

Array = NDArray[np.float64]
Table = NDArray[np.int64]

_vector = types.float64[::1]
_own = (types.int64[::1], _vector, _vector)  # table, pool, work
RESIDUAL = types.void(types.float64, _vector, _vector, _vector, _vector, *_own)
SOLVE = types.void(types.float64, _vector, _vector, _vector, types.float64, types.float64, types.float64, *_own)
KINEMATIC = types.void(types.float64, _vector, _vector, _vector, *_own)
ADVANCE = types.void(_vector, _vector, _vector, *_own)


@njit(KINEMATIC, cache=True)
def kinematic(t: float, q: Array, u: Array, dq: Array, table: Table, pool: Array, work: Array) -> None:
    """dq/dt = N(q) u."""
    bodies = bodies_of(table)
    for i in range(1, len(bodies)):
        coordinate_rates(bodies[i], q, u, dq, pool)


@njit(ADVANCE, cache=True)
def advance(q: Array, increment: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = q o exp(increment): the coordinates after unit time at the constant quasi-velocity `increment` (n_u,)."""
    bodies = bodies_of(table)
    for i in range(1, len(bodies)):
        advance_coordinates(bodies[i], q, increment, out, pool)


@inner
def joined(q: Array, u: Array, table: Table, work: Array) -> Array:
    """The state x = (q, u) in the scratch array."""
    head = header_of(table)
    x = work[head["state"] : head["state"] + head["n_q"] + head["n_u"]]
    x[: head["n_q"]] = q
    x[head["n_q"] :] = u
    return x


@inner
def gather_residual(udot: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """Add the inertia forces of udot to the written biases and gather them on the coordinates."""
    bodies = bodies_of(table)
    head = header_of(table)
    total = (0.0, 0.0, 0.0)
    hidden = False
    for i in range(1, len(bodies)):
        b = bodies[i]
        parent = bodies[b["parent"]]
        w, n = b["work"], b["n"]
        hidden = hidden or b["hidden"] == 1
        a, alpha = load3(work, w + W_BIAS), load3(work, w + W_BIAS + 3)
        if b["parent"] > 0:
            carry_acceleration(b, parent, work, udot, 0)
            a = add(a, load3(work, w + W_ACC))
            alpha = add(alpha, load3(work, w + W_ACC + 3))
        first = 3 if b["hidden"] else 0
        for k in range(first, b["n_h"]):
            d = udot[b["u"] + k - first]
            a = add(a, scale(d, load3(work, w + W_H + 6 * k)))
            alpha = add(alpha, scale(d, load3(work, w + W_H + 6 * k + 3)))
        if b["own_bends"]:
            G = b["G"]
            for k in range(n):
                d = -udot[b["ue"] + k]
                a = add(a, (d * work[G + k], d * work[G + n + k], d * work[G + 2 * n + k]))
                alpha = add(alpha, (d * work[G + 3 * n + k], d * work[G + 4 * n + k], d * work[G + 5 * n + k]))
        acc = w + W_ACC
        store3(work, acc, a)
        store3(work, acc + 3, alpha)
        B, p = b["B"], w + W_P
        for r in range(6):
            sum_r = 0.0
            for c in range(6):
                sum_r += work[w + W_A + 6 * r + c] * work[acc + c]
            for k in range(n):
                sum_r += work[B + r * n + k] * udot[b["ue"] + k]
            work[p + r] += sum_r
        for k in range(n):
            sum_k = 0.0
            for r in range(6):
                sum_k += work[B + r * n + k] * work[acc + r]
            for j in range(n):
                sum_k += pool[b["elastic_mass"] + k * n + j] * udot[b["ue"] + j]
            work[b["pn"] + k] += sum_k
        total = add(total, turn_back(load9(work, w + W_CIN), load3(work, p)))
    if hidden:
        a_c = scale(-1.0 / pool[head["mass"]], total)
        for i in range(1, len(bodies)):
            accelerate_uniformly(bodies[i], turn(load9(work, bodies[i]["work"] + W_CIN), a_c), pool, work)
    for j in range(1, len(bodies)):
        b = bodies[len(bodies) - j]
        w, n = b["work"], b["n"]
        p, first = w + W_P, 3 if b["hidden"] else 0
        for k in range(first, b["n_h"]):
            total_k = -work[w + W_TAU + k - first]
            for r in range(6):
                total_k += work[w + W_H + 6 * k + r] * work[p + r]
            out[b["u"] + k - first] = total_k
        for k in range(n):
            total_k = work[b["pn"] + k]
            if b["own_bends"]:
                for r in range(6):
                    total_k -= work[b["G"] + r * n + k] * work[p + r]
            out[b["ue"] + k] = total_k
        if b["parent"] > 0:
            parent = bodies[b["parent"]]
            C = load9(work, w + W_CIP)
            f, m = turn_back(C, load3(work, p)), turn_back(C, load3(work, p + 3))
            accumulate3(work, parent["work"] + W_P, f)
            accumulate3(work, parent["work"] + W_P + 3, add(m, cross(load3(work, w + W_R), f)))
            if b["bends"]:
                n_p, Phi = parent["n"], b["Phi"]
                for k in range(n_p):
                    work[parent["pn"] + k] += (
                        f[0] * work[Phi + k] + f[1] * work[Phi + n_p + k] + f[2] * work[Phi + 2 * n_p + k]
                        + m[0] * work[Phi + 3 * n_p + k] + m[1] * work[Phi + 4 * n_p + k] + m[2] * work[Phi + 5 * n_p + k]
                    )  # fmt: skip


@njit(RESIDUAL, cache=True)
def residual(t: float, q: Array, u: Array, udot: Array, out: Array, table: Table, pool: Array, work: Array) -> None:
    """out = M(q, t) udot + h(q, u, t) - Q of eq. (9), in O(n).

    With an eliminated root translation M is M - M_v^T M_vv^-1 M_v and forces work through displacements relative to O.
    """
    x = joined(q, u, table, work)
    place(t, x, table, pool, work)
    write_forces(t, x, table, pool, work)
    gather_residual(udot, out, table, pool, work)


@njit(SOLVE, cache=True)
def solve(
    t: float,
    q: Array,
    rhs: Array,
    out: Array,
    c_m: float,
    c_d: float,
    c_k: float,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """out = (c_m M + c_d D + c_k K)^-1 rhs with M at q, D and K of shapes, springs and dampers; O(n)."""
    bodies = bodies_of(table)
    x = joined(q, rhs, table, work)
    place(t, x, table, pool, work)
    for i in range(1, len(bodies)):
        b = bodies[i]
        zero_forces(b, work)
        for k in range(6):
            work[b["work"] + W_BIAS + k] = 0.0
        for k in range(b["n_h"] - (3 if b["hidden"] else 0)):
            work[b["work"] + W_TAU + k] = rhs[b["u"] + k] / c_m
        for k in range(b["n"]):
            work[b["pn"] + k] = -rhs[b["ue"] + k] / c_m
    reduce_to_root(table, pool, work, c_d / c_m, c_k / c_m, True)
    accelerate(table, work, out, 0)


@dataclass(frozen=True)
class SecondOrderCalls:
    """The calls that implicit integrators use, over the model's own arrays."""

    n_q: int
    n_u: int
    residual: Any = field(default=residual)
    solve: Any = field(default=solve)
    kinematic: Any = field(default=kinematic)
    advance: Any = field(default=advance)
