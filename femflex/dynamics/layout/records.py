"""Flat arrays of a compiled system: one integer table of records, one pool of numbers, one scratch array.

table  header record, then one BODY record per body (record 0 is the base frame), the reported markers, the freedoms
       that are held, the records of force terms, one TERM record per force term, and what `constraint_layout` describes
pool   numbers: moments, shapes at markers, axes, springs, load tables, orbit; constants, but for the blocks of bodies
       that vary with time, which are written anew at every evaluation (see varying)
work   scratch, one block per body: the offsets W_* below, then arrays whose place the record holds

Kernels read the records through `header_of`, `body_of`, `term_of` and `marker_of`. Rows over shapes are as long as
`row` says, the numbers past n are zero; rows and blocks begin at whole lanes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba.np.numpy_support
import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Table
from femflex.kernels.compiled import inner
from femflex.kernels.pointers import address
from femflex.kernels.symbols import INTEGER, extending, types

HEADER = np.dtype(
    [
        (name, "i8")
        for name in (
            "n_bodies",  # records, the base included
            "n_markers",
            "n_q",
            "n_u",
            "n_z",  # states in addition to coordinates and velocities
            "z", "zdot",  # work (n_z,) each: the states, taken from behind the velocities, and their rates
            "relaxes",  # 1: states have rates of their own
            "moved_u",  # work (n_u,): velocities at which these are tried
            "orbit",  # ORBIT_*
            "frame",  # FRAME_*
            "orbit_data",  # pool: mu, a, e, n, mean anomaly, C_NP (9) at t = 0; mu by a and n; node's, perigee's rate;
            # whether it follows profiles of its position, and where these are (3)
            "frame_data",  # pool: rate of a spinning frame (3)
            "weighs", "gravity",  # 1: uniform gravity acts; pool: its acceleration, inertial components (3)
            "mass",  # pool: total mass
            "orbit_state",  # work: radius, rate of O (3), C_NO (9), place, velocity, alpha of O (3), anomaly; craft (6)
            "angle_axes",  # pool: axis numbers of the reported attitude angles (3), C_QL (9)
            "total",  # work: centre of mass (3); uniform field, or that in which the centre of mass stays at O (3)
            "placing", "loading",  # addresses of stages of femflex.dynamics.rate.rate
            "left_out",  # address of a stage in place of both, 0 where all terms act
            "left_forces",  # work: (n_u,) that it writes, and its own room
            "kept",  # pool: 1 or 0 for every row of femflex.dynamics.ledger.rows; read by that stage alone
            "n_holds", "holds",  # HOLD records and where in the table they begin
            "n_terms", "terms",  # TERM records and where in the table they begin
            "account",  # work (A_SIZE): see A_*
            "held_q", "held_u",  # work (n_q,), (n_u,): the state with prescribed freedoms at their values
            "known", "flags", "drives",  # work (n_u,): their accelerations; 1 where held; forces that hold them
            "closing",  # table: where records of constraints begin (see constraint_layout)
            "constrain",  # address of CONSTRAIN, 0 without constraints
            "add_mass",  # address of ADD_MASS (femflex.dynamics.bodies.added_mass), 0 where no effector adds mass
            "wet", "n_wet",  # table: EFFECTOR records, of which some add mass
            "n_varying",  # bodies whose properties depend on time
            "n_free",  # of these, ones whose length is free; their accelerations stand behind z
            "solve_lengths", "step_lengths",  # addresses of LENGTHS and LENGTH_STEPS, 0 without free lengths
            "drum_force",  # address (femflex.dynamics.rate.drum_force), 0 where no body has one
            "lack", "needs",  # work (n_u,), (n_free, n_free + 1) and 3: for these accelerations, see free_lengths
        )
    ]
)  # fmt: skip

BODY = np.dtype(
    [
        (name, "i8")
        for name in (
            "parent",
            "n",  # elastic coordinates
            "row",  # n padded to whole lanes: length of rows over coordinates
            "n_slaves",  # shapes that follow the coordinates, see slaves; 0: every shape is a coordinate
            "n_shapes",  # n + n_slaves
            "wide",  # n_shapes padded to whole lanes: length of rows over shapes
            "q", "u",  # first joint coordinate and quasi-velocity
            "qe", "ue",  # first elastic coordinate and rate
            "n_slide", "n_turn", "ball",  # BALL_*
            "hidden",  # 1: three slides eliminated by the centre of mass
            "welded", "welded_at",  # 1: nothing moves at this joint; pool: C_ip (9), r (3)
            "full",  # 1: six free motions of a root body along orthonormal columns, without springs
            "n_h",  # columns of H, hidden ones included
            "axes",  # pool: slides then turns (3 each); for an angle set: intrinsic axis numbers (3)
            "reference",  # of a re-based ball: place in q of its reference's Euler parameters (4); else 0
            "spring", "damper", "rest",  # pool (n_slide + n_turn | 3)
            "sprung",  # 1: the joint has springs, dampers or laws
            "lawful",  # 1: it has laws
            "held",  # 1: some of the joint's freedoms are held, now or at times
            "known", "flags", "drives",  # work (n_u of the joint): the header's, from this joint on
            "mass",  # pool: m, s (3) and Q (9) of the undeformed body
            "first",  # pool: s_k (3,wide)
            "momentum",  # pool: the same, (wide,4)
            "second",  # pool: P[A,a,c,k] (1+n_shapes,3,3,wide), A = 0 for the position rho
            "gyro",  # pool: R1 (n_shapes,3,wide)
            "stiffness", "damping", "f0",  # pool: V1, D^T (n,row), f0 (row)
            "diagonal",  # 1: V1 and D are diagonal
            "nonlinear",  # 1: strain is nonlinear, with V2 and V3
            "curved", "n_blocks",  # pool: their table (n_blocks,n+pairs,32), see stiffening
            "own_stiffness", "own_damping",  # pool: their diagonals (row)
            "elastic_mass",  # pool: Me (n_shapes,wide)
            "slaves",  # pool: A (n_slaves,n,row)
            "elastic_factor", "elastic_pivot",  # pool: U (n,row) and 1/d (n) of Me = U^T diag(1/d) U
            "orthonormal",  # 1: Me is the unit matrix to rounding
            "place",  # pool, marker P on the parent: position (3), C_pP (9), axis of the beam whose section it is (3)
            "shape", "spin",  # pool: its phi, psi (3,wide_p)
            "bends",  # STAYS, BENDS, TURNS: how marker P moves with the parent's elastic coordinates
            "own_place", "own_shape", "own_spin",  # the same for marker Q on this body
            "own_bends",
            "dense",  # 1: the elastic block changes with the motion and is factorised
            "work",  # first of this body's block
            "delta", "ddelta",  # work (wide): amplitudes of the shapes, coordinates first, and their rates
            "accel",  # work (row): accelerations of the coordinates
            "Z",  # work (3,3,wide)
            "pn",  # work (wide): bias of all shapes; once the border is written, of the coordinates
            "border",  # work (row, stride): rows [E | s_k, 0, Cr_k, pn_k]
            "stride",  # row + 8
            "pivot",  # work (n): reciprocal pivots of the eliminated E
            "G",  # work (6,row): columns of marker Q
            "N",  # work (row,8): scratch of refer_to_hinge
            "drift", "tie", "pull",  # work, condensed bodies: g (wide), D (n_slaves,row), W (row)
            "columns", "spread",  # work, condensed bodies: columns of a marker (6,wide), coupling rows (wide,8)
            "monomials", "varying",  # work: d_i, d_i d_j (n+pairs); the stiffness they make up (pairs)
            "Phi",  # work (6,row_p): columns of marker P
            "added",  # work: mass added at markers (see femflex.dynamics.bodies.added_mass); 0: none
            "varies",  # 1: a function writes properties of this body at every evaluation, see varying
            "write", "numbers", "block",  # its address; pool: its constants, and what it writes
            "derived",  # 1: moments vary, so rows that follow from them are written anew
            "flows",  # 1: material moves inside the body, see flow
            "rates",  # pool: drift, kick (3), flow, turn (9) of the undeformed body, speed, its rate
            "drifts", "kicks",  # pool (3,wide)
            "flow0", "turn0", "flow", "turn",  # pool (9,wide) twice, (1+n_shapes,9,wide) twice
            "speeds",  # pool (1+n_shapes,wide)
            "carried",  # work: int w dm (3), 0, int r w^T dm (9), of the material's velocity w
            "carriedZ",  # work (3,3,wide): int phi_k w^T dm
            "free_length",  # 1: its length is a state, whose acceleration follows from the force on it
            "unit",  # pool: its block at a unit rate of the length
            "accel_all",  # work (wide): accelerations of all shapes
            "pickup", "growth",  # pool: density at the exit, arriving mass (see Block); 0: none, as for the next ones
            "stiffness_rate", "f0_rate", "strain_rate",  # pool: rates of V1 and f0, of the table of V2 and V3
        )
    ]
)  # fmt: skip

HOLD = np.dtype(
    [
        (name, "i8")
        for name in (
            "q", "u",  # the freedom's place in the state
            "profile",  # pool: its motion (see profiles)
            "latch",  # -1, or place in z of a latch's time: the freedom stays where it is from then on
        )
    ]
)  # fmt: skip

TERM = np.dtype(
    [
        (name, "i8")
        for name in (
            "apply", "report", "resist", "relax",  # addresses of its calls (see dynamics.forces.forces); 0: none
            "at", "n",  # table: where its own records begin; its items
            "energy",  # ENERGY_*
            "reported",  # numbers that `report` writes
        )
    ]
)  # fmt: skip

MARKER = np.dtype([(name, "i8") for name in ("body", "place", "shape", "spin", "bends")])  # as for marker P

ORBIT_NONE, ORBIT_SPECIFIED, ORBIT_FREE = 0, 1, 2
FRAME_INERTIAL, FRAME_ORBITAL, FRAME_SPINNING = 0, 1, 2
STAYS, BENDS, TURNS = 0, 1, 2  # a marker: not at all; by exp(psi delta); as a section of a beam (`section_turns`)
LENGTH_Z, LENGTH_SLOT, LENGTH_DRUM_MASS = 8, 9, 12  # numbers of a LengthTable
VARIES = 4  # added: its place and its rows change with time, and their rates stand behind them
BALL_NONE, BALL_QUATERNION, BALL_ANGLES, BALL_EXTRINSIC, BALL_RODRIGUES, BALL_MODIFIED = 0, 1, 2, 3, 4, 5
# account of reports: where positions and velocities count from (inertial components); what terms add
A_SHIFT, A_DRIFT, A_ENERGY, A_DISSIPATION, A_SUPPLIED, A_SIZE = 0, 3, 6, 7, 8, 9
ENERGY_SPRING, ENERGY_LOAD, ENERGY_EFFECTOR = 0, 1, 2  # what the stored energy of a force term counts to

W_CIP = 0  # C_ip: parent components to body components, three rows of four
W_ACC = 12  # acceleration of the origin (3), 0, of the rate (3), 1
W_BIAS = 20  # the part of it that does not depend on udot (3), 0, (3), 0
W_P = 28  # bias wrench on the body at its origin: force (3), 0, couple (3), 0
W_M = 36  # rows [A | p] of the rigid, then articulated inertia and bias: six of (A_r1..3, 0, A_r4..6, p_r)
W_H = 84  # joint columns H: six of (3), 0, (3), 0
W_U = 132  # articulated inertia times H and what remains of the joint force, as H
W_PIVOT = 180  # reciprocals of H^T U (6)
W_TAU = 186  # joint forces (6)
W_CIN = 192  # C_iN (9): inertial components to body components
W_CPQ = 201  # C_PQ (9)
W_R = 210  # body origin from the parent's origin, parent components (3)
W_POS = 213  # body origin, inertial components (3)
W_VEL = 216  # velocity of the origin, body components (3)
W_OMEGA = 219  # rate of the body, body components (3)
W_S = 222  # first moment s y (3)
W_Q = 225  # second moment Q_ab (9)
W_RESIST = 234  # c_d damping + c_k stiffness of laws along the joint's freedoms (6)
W_NEAR = 240  # of a ball: least angle that was left to its set's singularity, and when
W_FIXED = 244  # first of the arrays whose place the record holds

N_HEADER, N_BODY, N_TERM, N_MARKER, N_HOLD = (len(record.names or ()) for record in (HEADER, BODY, TERM, MARKER, HOLD))


def header_record(table: Table) -> np.void:
    """The header as Python reads and changes it."""
    record: np.void = table[:N_HEADER].view(HEADER)[0]
    return record


def body_records(table: Table) -> NDArray[np.void]:
    """The body records; record 0 is the base frame."""
    return table[N_HEADER : N_HEADER + N_BODY * table[0]].view(BODY)


def record_reader(record: np.dtype[Any]) -> Callable[[Table, int], np.void]:
    """A function of (table, i) that gives the record at table[i], known to the compiler."""
    kind = numba.np.numpy_support.from_dtype(record)

    def read_record(table: Table, i: int) -> np.void:
        return table[i : i + len(record.names or ())].view(record)[0]

    @extending.type_callable(read_record)
    def typer(context: Any) -> Any:
        return lambda table, i: kind

    @extending.lower_builtin(read_record, types.CPointer, types.Integer)
    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.bitcast(address(builder, args[0], args[1], INTEGER), context.get_value_type(kind))

    return read_record


_header, _body, _term, _marker, _hold = (record_reader(record) for record in (HEADER, BODY, TERM, MARKER, HOLD))


@inner
def header_of(table: Table) -> np.void:
    """The header record."""
    return _header(table, 0)


@inner
def body_of(table: Table, i: int) -> np.void:
    """Body record i; record 0 is the base frame."""
    return _body(table, N_HEADER + N_BODY * i)


@inner
def term_of(table: Table, i: int) -> np.void:
    """TERM record i."""
    return _term(table, header_of(table)["terms"] + N_TERM * i)


@inner
def marker_of(table: Table, i: int) -> np.void:
    """Record i of the markers whose motion is reported."""
    return _marker(table, N_HEADER + N_BODY * table[0] + N_MARKER * i)


@inner
def hold_of(table: Table, i: int) -> np.void:
    """Return record i of the prescribed freedoms."""
    return _hold(table, header_of(table)["holds"] + N_HOLD * i)
