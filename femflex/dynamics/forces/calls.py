"""Calls of force terms by the equations (see `femflex.dynamics.force_terms`): by address, with fixed signatures.

APPLY    apply(t, q, u, at, first, last, table, pool, work)
         Subtracts the forces of items first to last - 1 from the bias wrenches and the elastic bias of the placed
         bodies (`push_on_body`), and adds them to W_TAU of their joints. Items with states write the rates of these
         behind `zdot` of the header.
RESIST   resist(t, q, u, c_d, c_k, at, n, table, pool, work)
         Adds c_d D + c_k K of its n items to W_RESIST along the freedoms of joints, each slope where it is positive:
         what implicit integrators hold against motion. An approximation is enough.
RELAX    relax(t, given, c_d, out, at, n, table, pool, work)
         out (n_z,): (1 - c_d J)^-1 (zdot - given) of the states of its items, after `apply` at the same state.
REPORT   report(t, q, u, at, n, row, account, table, pool, work)
         Writes what is reported of its n items into `row`, in the order of the term's channels, and adds to `account`
         (see A_*): the stored energy, the power that is lost for good, and the power that comes in from outside.

`at` is where the term's own records begin in the table. The state is placed; u points to (n_u,), the states z stand
behind `z` of the header in the work array.
"""

from __future__ import annotations

from femflex.arrays import Array, Table
from femflex.dynamics.lowering.layout import W_RESIST, body_of, header_of, term_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import INTEGER, INTEGERS, NUMBERS, REAL, VOID, caller

_OWN = (INTEGERS, NUMBERS, NUMBERS)  # table, pool, work
APPLY = VOID(REAL, NUMBERS, NUMBERS, INTEGER, INTEGER, INTEGER, *_OWN)
RESIST = VOID(REAL, NUMBERS, NUMBERS, REAL, REAL, INTEGER, INTEGER, *_OWN)
RELAX = VOID(REAL, NUMBERS, REAL, NUMBERS, INTEGER, INTEGER, *_OWN)
REPORT = VOID(REAL, NUMBERS, NUMBERS, INTEGER, INTEGER, NUMBERS, NUMBERS, *_OWN)

# numbers of `account`: where positions and velocities are counted from (inertial components); what terms add
A_SHIFT, A_DRIFT, A_ENERGY, A_DISSIPATION, A_SUPPLIED, A_SIZE = 0, 3, 6, 7, 8, 9

call_apply, call_resist, call_relax, call_report = (caller(kind) for kind in (APPLY, RESIST, RELAX, REPORT))


@inner
def apply_terms(t: float, q: Array, u: Array, table: Table, pool: Array, work: Array) -> None:
    """Put the forces of all force terms on the placed bodies."""
    for i in range(header_of(table)["n_terms"]):
        term = term_of(table, i)
        call_apply(term["apply"], t, q, u, term["at"], 0, term["n"], table, pool, work)


@inner
def write_resistance(
    t: float, q: Array, u: Array, c_d: float, c_k: float, table: Table, pool: Array, work: Array
) -> None:
    """Write c_d D + c_k K of all force terms along the freedoms of every joint."""
    head = header_of(table)
    for i in range(1, head["n_bodies"]):
        for k in range(6):
            work[body_of(table, i)["work"] + W_RESIST + k] = 0.0
    for i in range(head["n_terms"]):
        term = term_of(table, i)
        if term["resist"] != 0:
            call_resist(term["resist"], t, q, u, c_d, c_k, term["at"], term["n"], table, pool, work)
