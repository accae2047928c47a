"""Flat arrays of a compiled system: one integer table of records, one pool of numbers, one scratch array.

table  header record, then one BODY record per body (record 0 is the base frame), then one LOAD record per load
pool   constants: moments, shapes at markers, axes, springs, load tables, orbit
work   scratch, one block per body: the offsets W_* below, then arrays whose place the record holds

Kernels read the records through `header`, `bodies_of` and `loads_of`; every array they touch is a plain slice of these.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.vectors import inner

Table = NDArray[np.int64]

HEADER = np.dtype(
    [
        (name, "i8")
        for name in (
            "n_bodies",  # records, the base included
            "n_loads",
            "n_markers",
            "n_q",
            "n_u",
            "orbit",  # ORBIT_*
            "frame",  # FRAME_*
            "orbit_data",  # pool: mu, a, e, n, mean anomaly at t = 0, C_NP (9)
            "frame_data",  # pool: rate of a spinning frame (3)
            "mass",  # pool: total mass
            "state",  # work: a state x = (q, u)
            "orbit_state",  # work: radius, rate, acceleration of the true anomaly, true anomaly, C_NO (9), position (3), velocity (3), inertial
            "angle_axes",  # pool: axis numbers of the reported attitude angles (3)
            "total",  # work: centre of mass (3), uniform field (3)
            "kept",  # pool: 1 or 0 for every term of femflex.dynamics.ledger; read by reduced models alone
        )
    ]
)

BODY = np.dtype(
    [
        (name, "i8")
        for name in (
            "parent",
            "n",  # elastic coordinates
            "q", "u",  # first joint coordinate and quasi-velocity
            "qe", "ue",  # first elastic coordinate and rate
            "n_slide", "n_turn", "ball",  # BALL_*
            "hidden",  # 1: three slides eliminated by the centre of mass
            "welded", "welded_at",  # 1: nothing moves at this joint; pool: C_ip (9), r (3)
            "full",  # 1: six free motions of a root body along orthonormal columns, without springs
            "n_h",  # columns of H, hidden ones included
            "axes",  # pool: slides then turns (3 each); for an angle set: axis numbers (3)
            "spring", "damper", "rest",  # pool (n_slide + n_turn | 3)
            "sprung",  # 1: the joint has springs or dampers
            "mass", "first", "second", "gyro",  # pool: m, s (1+n,3), P, R1 (n,3,n)
            "stiffness", "damping", "f0",  # pool: V1 (n,n), D (n,n), f0 (n)
            "diagonal",  # 1: V1 and D are diagonal
            "elastic_mass", "elastic_factor",  # pool (n,n)
            "orthonormal",  # 1: Me is the unit matrix to rounding
            "place", "shape", "spin",  # pool, marker P on the parent: position (3) and C_pP (9); phi (3,n_p); psi (3,n_p)
            "bends",  # 1: marker P moves with the parent's elastic coordinates
            "own_place", "own_shape", "own_spin",  # the same for marker Q on this body
            "own_bends",
            "dense",  # 1: the elastic block changes with the motion and is factorised
            "work",  # first of this body's block
            "Z", "B", "Y", "pn", "E", "G", "Phi",  # work
        )
    ]
)  # fmt: skip

LOAD = np.dtype(
    [
        (name, "i8")
        for name in (
            "body",
            "frame",  # LOAD_FRAME_*
            "place", "shape", "spin", "bends",  # as for marker P
            "n_times",  # 0: constant
            "times", "values",  # pool (n_times,), (n_times | 1, 6): force, torque
        )
    ]
)  # fmt: skip

MARKER = np.dtype([(name, "i8") for name in ("body", "place", "shape", "spin", "bends")])  # as in LOAD

ORBIT_NONE, ORBIT_SPECIFIED, ORBIT_FREE = 0, 1, 2
FRAME_INERTIAL, FRAME_ORBITAL, FRAME_SPINNING = 0, 1, 2
BALL_NONE, BALL_QUATERNION, BALL_ANGLES = 0, 1, 2
LOAD_BODY, LOAD_MARKER, LOAD_INERTIAL, LOAD_ORBITAL = 0, 1, 2, 3

W_CIP = 0  # C_ip (9): parent components to body components
W_CIN = 9  # C_iN (9): inertial components to body components
W_R = 18  # body origin from the parent's origin, parent components (3)
W_POS = 21  # body origin, inertial components (3)
W_OMEGA = 24  # rate of the body, body components (3)
W_BIAS = 27  # acceleration of origin and rate that does not depend on udot, body components (6)
W_ACC = 33  # acceleration of origin and rate (6)
W_P = 39  # bias wrench on the body at its origin (6)
W_RQ = 45  # marker Q from the body origin (3)
W_RP = 48  # marker P from the parent's origin (3)
W_S = 51  # first moment s y (3)
W_Q = 54  # second moment Q_ab (9)
W_A = 63  # rigid inertia, then articulated inertia, 6 x 6
W_H = 99  # joint columns H, 6 x 6 (column c at W_H + 6 c)
W_U = 135  # articulated inertia times H, as H
W_D = 171  # factors of H^T U, 6 x 6
W_TAU = 207  # joint forces (6)
W_VEL = 213  # velocity of the origin, body components (3)
W_CPQ = 216  # C_PQ (9)
W_FIXED = 225  # first of the arrays whose place the record holds


N_HEADER, N_BODY, N_LOAD, N_MARKER = (len(record.names or ()) for record in (HEADER, BODY, LOAD, MARKER))


@inner
def header_of(table: Table) -> np.void:
    """The header record."""
    return table[:N_HEADER].view(HEADER)[0]


def body_records(table: Table) -> NDArray[np.void]:
    """The body records; record 0 is the base frame."""
    return table[N_HEADER : N_HEADER + N_BODY * table[0]].view(BODY)


bodies_of = inner(body_records)  # the same for compiled callers


@inner
def loads_of(table: Table) -> NDArray[np.void]:
    """The load records."""
    start = N_HEADER + N_BODY * table[0]
    return table[start : start + N_LOAD * table[1]].view(LOAD)


@inner
def markers_of(table: Table) -> NDArray[np.void]:
    """The records of markers whose motion is reported."""
    start = N_HEADER + N_BODY * table[0] + N_LOAD * table[1]
    return table[start : start + N_MARKER * table[2]].view(MARKER)
