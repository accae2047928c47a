"""Prescribed freedoms: joint coordinates that follow a given motion or have latched, and the forces that this needs.

The state keeps their places, so nothing is renumbered. Before anything is computed the state is copied with s(t) and
sdot(t) in it; sddot enters the recursion as a known acceleration (eq. 5), and the force that the specification needs
is what the hinge's wrench does along the freedom, less springs and other laws of the joint.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.layout.records import W_ACC, W_BIAS, W_H, W_M, W_PIVOT, W_TAU, W_U, body_of, header_of, hold_of
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import fourth, offset, plus, with_fourth
from femflex.kernels.pairs import dot_pair, pair, put_pair
from femflex.kernels.profiles import profile_at
from femflex.kernels.spatial import rows_times, six_rows


@inner
def prescribed_state(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> tuple[Array, Array]:
    """Return (q, u) with prescribed freedoms at their values, z copied; write flags and known accelerations."""
    head = header_of(table)
    new_q, new_u, z = offset(work, head["held_q"]), offset(work, head["held_u"]), offset(work, head["z"])
    for k in range(head["n_q"]):
        new_q[k] = q[k]
    for k in range(head["n_u"]):
        new_u[k] = u[k]
        work[head["flags"] + k] = work[head["known"] + k] = work[head["drives"] + k] = 0.0
    for j in range(head["n_holds"]):
        entry = hold_of(table, j)
        s, ds, dds, flag = q[entry["q"]], 0.0, 0.0, 1.0
        if entry["latch"] < 0:
            s, ds, dds = profile_at(t, entry["profile"], pool)
        elif z[entry["latch"]] < 0.0:
            ds, flag = u[entry["u"]], 0.0
        new_q[entry["q"]], new_u[entry["u"]] = s, ds
        work[head["flags"] + entry["u"]], work[head["known"] + entry["u"]] = flag, dds
    return new_q, new_u


@inner
def is_prescribed_now(b: Record, k: int, work: Array) -> bool:
    """Return whether freedom k of a joint that may be prescribed is so now."""
    return work[b["flags"] + k] != 0.0


@inner
def add_known_accelerations(table: Table, work: Array) -> None:
    """Add the accelerations of prescribed freedoms to the bodies' bias accelerations."""
    for i in range(1, header_of(table)["n_bodies"]):
        b = body_of(table, i)
        if b["held"]:
            w, hidden = b["work"], 3 if b["hidden"] else 0
            bias = pair(work, w + W_BIAS)
            for k in range(b["n_h"] - hidden):
                bias = plus(bias, work[b["known"] + k], pair(work, w + W_H + 8 * (k + hidden)))
            put_pair(work, w + W_BIAS, bias)


@inner
def write_prescribed_columns(b: Record, work: Array) -> None:
    """Before the joint's freedoms are eliminated: U = A h and h . p - tau of those held, whose pivots become 0."""
    w = b["work"]
    rows = six_rows(work, w + W_M)
    hidden = 3 if b["hidden"] else 0
    for k in range(b["n_h"]):
        prescribed = k >= hidden and is_prescribed_now(b, k - hidden, work)
        work[w + W_PIVOT + k] = 0.0 if prescribed else 1.0
        if prescribed:
            U = rows_times(rows, pair(work, w + W_H + 8 * k))
            force = fourth(U[1]) - (work[w + W_TAU + k - hidden] if b["sprung"] else 0.0)
            put_pair(work, w + W_U + 8 * k, (U[0], with_fourth(U[1], force)))


@inner
def accelerate_prescribed(b: Record, work: Array, out: Array) -> None:
    """Once the body's acceleration is known: write sddot of prescribed freedoms and the forces that it needs."""
    w = b["work"]
    acc = pair(work, w + W_ACC)
    hidden = 3 if b["hidden"] else 0
    for k in range(hidden, b["n_h"]):
        if is_prescribed_now(b, k - hidden, work):
            out[b["u"] + k - hidden] = work[b["known"] + k - hidden]
            work[b["drives"] + k - hidden] = dot_pair(acc, pair(work, w + W_U + 8 * k))


@inner
def write_prescribed_rows(udot: Array, out: Array, table: Table, work: Array) -> None:
    """Write udot - sddot on the rows of prescribed freedoms of out, in place of their equations of motion."""
    head = header_of(table)
    for k in range(head["n_u"]):
        if work[head["flags"] + k] != 0.0:
            out[k] = udot[k] - work[head["known"] + k]
