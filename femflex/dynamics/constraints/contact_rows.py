"""Rows of nonholonomic constraints between two markers: a disc that rolls on a plane, and a knife edge."""

from __future__ import annotations

import math

from femflex.arrays import Array, Record
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.records import W_CIN
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import ZERO, Vector, add, cross, dot, load3, load9, scale, store3, sub, turn


@inner
def put_force(r: int, e: Vector, d: Vector, rho: Vector, P: Record, Q: Record, work: Array) -> None:
    """The row of a force e on Q's body and -e on P's at one point: d + rho from P, rho from Q; inertial components."""
    C_P, C_Q = load9(work, P["work"] + W_CIN), load9(work, Q["work"] + W_CIN)
    reaction = scale(-1.0, e)
    store3(work, r + layout.R_FP, turn(C_P, reaction))
    store3(work, r + layout.R_TP, turn(C_P, cross(add(d, rho), reaction)))
    store3(work, r + layout.R_FQ, turn(C_Q, e))
    store3(work, r + layout.R_TQ, turn(C_Q, cross(rho, e)))


@inner
def put_values(r: int, gap: float, bias: float, work: Array) -> None:
    """Write a row's position residual (zero for one of velocities alone) and its bias Adot u - bdot."""
    work[r + layout.R_GAP], work[r + layout.R_BIAS] = gap, bias


@inner
def contact_arm(n: Vector, a: Vector, dn: Vector, da: Vector, radius: float) -> tuple[Vector, Vector, float]:
    """From a disc's centre to its lowest point, its rate, and the centre's height over the plane.

    rho = -R m/|m|, m = n - (n.a) a, of the plane's normal n and the disc's axis a; height R |m|.
    """
    cosine = dot(n, a)
    m = sub(n, scale(cosine, a))
    dm = sub(sub(dn, scale(dot(dn, a) + dot(n, da), a)), scale(cosine, da))
    length = math.sqrt(dot(m, m))
    down = scale(1.0 / length, m)
    turning = scale(1.0 / length, sub(dm, scale(dot(down, dm), down)))
    return scale(-radius, down), scale(-radius, turning), radius * length


@inner
def write_disc(c: Record, P: Record, Q: Record, row: int, pool: Array, work: Array) -> None:
    """Write three rows: the disc's lowest point moves with the plane through P, and stays at its height above it."""
    p, q = c["motion_P"], c["motion_Q"]
    C = load9(work, p + layout.M_C)
    a = turn(load9(work, q + layout.M_C), load3(pool, c["axis"]))
    n = turn(C, load3(pool, c["axis"] + 3))
    omega_P, omega_Q = load3(work, p + layout.M_O), load3(work, q + layout.M_O)
    rho, drho, height = contact_arm(n, a, cross(omega_P, n), cross(omega_Q, a), pool[c["axis"] + 6])
    d = sub(load3(work, q + layout.M_R), load3(work, p + layout.M_R))
    dd = sub(load3(work, q + layout.M_V), load3(work, p + layout.M_V))
    slip = sub(add(dd, cross(omega_Q, rho)), cross(omega_P, add(d, rho)))
    bias = sub(cross(omega_Q, drho), cross(omega_P, add(dd, drho)))
    tangent = turn(C, perpendicular_unit(load3(pool, c["axis"] + 3)))
    for k in range(3):
        e = n
        if k == 1:
            e = tangent
        elif k == 2:
            e = cross(n, tangent)
        r = row + layout.ROW_SIZE * k
        put_force(r, e, d, rho, P, Q, work)
        swept = dot(e, bias) + dot(cross(omega_P, e), slip)
        put_values(r, dot(n, d) - height if k == 0 else 0.0, swept, work)


@inner
def perpendicular_unit(n: Vector) -> Vector:
    """A unit vector across n."""
    e = cross(n, (1.0, 0.0, 0.0)) if abs(n[0]) < 0.7 else cross(n, (0.0, 1.0, 0.0))
    return scale(1.0 / math.sqrt(dot(e, e)), e)


@inner
def write_edge(c: Record, P: Record, Q: Record, row: int, pool: Array, work: Array) -> None:
    """One row: Q moves relative to P's body only along and about the blade, not in the direction e fixed in Q."""
    p, q = c["motion_P"], c["motion_Q"]
    e = turn(load9(work, q + layout.M_C), load3(pool, c["axis"]))
    omega_P, omega_Q = load3(work, p + layout.M_O), load3(work, q + layout.M_O)
    d = sub(load3(work, q + layout.M_R), load3(work, p + layout.M_R))
    dd = sub(load3(work, q + layout.M_V), load3(work, p + layout.M_V))
    put_force(row, e, d, ZERO, P, Q, work)
    bias = dot(cross(omega_Q, e), sub(dd, cross(omega_P, d))) - dot(e, cross(omega_P, dd))
    put_values(row, 0.0, bias, work)
