"""Newton's correction of the states of effectors, the motion of bodies given."""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.effectors.calling import call_act, evaluate, out_size
from femflex.dynamics.effectors.effector_inputs import write_signals
from femflex.dynamics.lowering.layout import header_of
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset

STEP = 1e-7  # of a state's size: difference for the Jacobian of its rates


@inner
def write_jacobian(t: float, e: Record, table: Table, pool: Array, work: Array) -> None:
    """J (n_z, n_z + 1) of an effector's own states, the last column free: by its own function, or by differences."""
    n, size = e["n_z"], out_size(e)
    z, base, rates = header_of(table)["z"] + e["z"], e["out"], 6 * e["n_markers"] + e["n_freedoms"]
    if e["jacobian"] != 0:
        jacobian = offset(work, e["out"] + size)
        for k in range(n * n):
            jacobian[k] = 0.0
        parameters = offset(pool, e["parameters"])
        call_act(e["jacobian"], t, offset(work, e["seen"]), offset(work, z), parameters, jacobian)
        for i in range(n):
            for j in range(n):
                work[e["matrix"] + (n + 1) * i + j] = jacobian[n * i + j]
        return
    for j in range(n):
        for k in range(n):
            work[e["trial"] + k] = work[z + k]
        step = STEP * max(abs(work[z + j]), pool[e["sizes"] + j])
        work[e["trial"] + j] += step
        evaluate(t, e, offset(work, e["trial"]), base + size, pool, work)
        for i in range(n):
            change = work[base + size + rates + i] - work[base + rates + i]
            work[e["matrix"] + (n + 1) * i + j] = change / step


@inner
def solve_small(a: Array, n: int) -> None:
    """Solve A x = b for [A | b] (n, n + 1) in place, x in the last column; by elimination with row exchanges."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[(n + 1) * i + k]) > abs(a[(n + 1) * best + k]):
                best = i
        for j in range(n + 1):
            a[(n + 1) * k + j], a[(n + 1) * best + j] = a[(n + 1) * best + j], a[(n + 1) * k + j]
        for i in range(k + 1, n):
            factor = a[(n + 1) * i + k] / a[(n + 1) * k + k]
            for j in range(k, n + 1):
                a[(n + 1) * i + j] -= factor * a[(n + 1) * k + j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            a[(n + 1) * k + n] -= a[(n + 1) * k + j] * a[(n + 1) * j + n]
        a[(n + 1) * k + n] /= a[(n + 1) * k + k]


@inner
def correct(t: float, e: Record, c_d: float, out: Array, table: Table, pool: Array, work: Array) -> None:
    """Solve (1 - c_d J) dz = out for the states of one effector, in place."""
    size = e["n_z"]
    write_signals(e, table, work)  # another of its group may have written there
    write_jacobian(t, e, table, pool, work)
    a = offset(work, e["matrix"])
    for j in range(size):
        for k in range(size):
            a[(size + 1) * j + k] = (1.0 if j == k else 0.0) - c_d * a[(size + 1) * j + k]
        a[(size + 1) * j + size] = out[e["z"] + j]
    solve_small(a, size)
    for j in range(size):
        out[e["z"] + j] = a[(size + 1) * j + size]
