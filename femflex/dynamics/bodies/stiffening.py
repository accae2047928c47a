"""Nonlinear strain: the stiffness that varies with the elastic coordinates, K2 and K3 of eq. (8), by packed monomials.

c2 V2 d + c3 V3 dd is one symmetric matrix. Its entries k <= l, packed, are sums over the monomials d_i and d_i d_j
(i <= j), which force, energy and tangent share: one product of a table with the row of monomials,

    force    (3 V2 d + 2 V3 dd) d      energy  1/2 d (2 V2 d + V3 dd) d      tangent  6 V2 d + 6 V3 dd

The table (`femflex.system.variation.strain_table`) lies in blocks of COLUMNS entries, eight lanes, monomial by
monomial, so that the sums of a block stay in registers.
"""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.kernels.compiled import inner
from femflex.kernels.formula import formula
from femflex.kernels.lanes import Lanes, lane, plus, put_lane, zero_lane
from femflex.system.variation import COLUMNS


@formula
def eight_lanes(a: Array, i: int) -> Lanes:
    """The eight lanes at a[i : i + 32]."""
    return tuple(lane(a, i + 4 * r) for r in range(8))


@formula
def put_eight(a: Array, i: int, v: Lanes) -> None:
    """Write eight lanes to a[i : i + 32]."""
    for r in range(8):
        put_lane(a, i + 4 * r, v[r])


@formula
def eight_zero_lanes() -> Lanes:
    """Eight lanes of zeros."""
    return tuple(zero_lane() for _ in range(8))


@inner
def write_varying_stiffness(b: Record, pool: Array, work: Array, c2: float, c3: float) -> None:
    """Write c2 V2 d + c3 V3 dd, packed over k <= l."""
    n, delta, first = b["n"], b["delta"], b["monomials"]
    entry = first + n
    for i in range(n):
        work[first + i] = c2 * work[delta + i]
        scaled = c3 * work[delta + i]
        for j in range(i, n):
            work[entry] = scaled * work[delta + j]
            entry += 1
    count = entry - first
    table = b["curved"]
    for block in range(b["n_blocks"]):
        sums = eight_zero_lanes()
        for m in range(count):
            sums = plus(sums, work[first + m], eight_lanes(pool, table + COLUMNS * m))
        put_eight(work, b["varying"] + COLUMNS * block, sums)
        table += COLUMNS * count


@inner
def add_varying_force(b: Record, work: Array, x: Array, first: int, c: float, out: Array, at: int, step: int) -> None:
    """Add c times the written matrix times the numbers at x[first:] to out[at], out[at + step] and so on."""
    n, entry = b["n"], b["varying"]
    for k in range(n):
        d = c * x[first + k]
        force = work[entry] * d
        for l in range(k + 1, n):
            K = work[entry + l - k]
            force += c * K * x[first + l]
            out[at + step * l] += K * d
        out[at + step * k] += force
        entry += n - k


@inner
def add_varying_block(b: Record, work: Array, c: float) -> None:
    """Add c times the written matrix to the elastic block of the border."""
    n, entry = b["n"], b["varying"]
    for k in range(n):
        for l in range(k, n):
            K = c * work[entry]
            work[b["border"] + b["stride"] * k + l] += K
            if l > k:
                work[b["border"] + b["stride"] * l + k] += K
            entry += 1


@inner
def varying_energy(b: Record, work: Array) -> float:
    """1/2 d K d of the written matrix K."""
    n, delta, entry = b["n"], b["delta"], b["varying"]
    total = 0.0
    for k in range(n):
        for l in range(k, n):
            total += (0.5 if l == k else 1.0) * work[entry] * work[delta + k] * work[delta + l]
            entry += 1
    return total
