"""Bodies that vary with time: their blocks are written anew at every evaluation, before anything reads them.

The function of the user writes the block (`femflex.system.variation`); rows that follow from its moments are derived
here. Kernels read the properties of every body at the places that its record holds, so a body that does not vary costs
nothing.

Material that moves inside a body has momentum, energy and forces by its velocity w = zdot_A y_A (THEORY section 6). The
acceleration of a point is that of the frame and the coordinates, and 2 omega x w + b with b = 2 zdot_A ddot(y)_A +
zddot_A y_A. The integrals are those of `femflex.system.variation`.
"""

from __future__ import annotations

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.inertia import coriolis_couple, totals9, twist_of
from femflex.dynamics.bodies.shapes import (
    put_rows3,
    put_rows9,
    rows3,
    rows9,
    totals3,
    turning_of,
    zero_rows3,
    zero_rows9,
)
from femflex.dynamics.bodies.stiffening import varying_energy, write_varying_stiffness
from femflex.dynamics.layout.records import LENGTH_SLOT, LENGTH_Z, W_OMEGA, W_P, body_of, header_of
from femflex.kernels.compiled import inner
from femflex.kernels.entries import call_user
from femflex.kernels.lanes import lane, offset, plus, put_lane, total, zero_lane
from femflex.kernels.pairs import add_pair, pair_of
from femflex.kernels.profiles import profile_at
from femflex.kernels.vectors import Vector, add, add9, cross, dot, load3, load9, scale, store3, store9
from femflex.system.length_table import HEAD


@inner
def length_motion(t: float, b: Record, table: Table, pool: Array, work: Array) -> Vector:
    """The length of a body that deploys, its rate and its acceleration: by its states, or at t."""
    numbers = offset(pool, b["numbers"])
    if b["free_length"]:
        z, k = header_of(table)["z"], int(numbers[LENGTH_Z])
        return work[z + k], work[z + k + 1], work[z + int(numbers[LENGTH_SLOT])]
    return profile_at(t, HEAD, numbers)


@inner
def write_varying_bodies(t: float, table: Table, pool: Array, work: Array) -> None:
    """Write the properties at t of all bodies that vary, and the total mass."""
    head = header_of(table)
    mass = 0.0
    for i in range(1, head["n_bodies"]):
        b = body_of(table, i)
        if b["varies"]:
            states = offset(work, head["z"])
            call_user(b["write"], t, states, offset(pool, b["numbers"]), offset(pool, b["block"]))
            if b["derived"]:
                derive_rows(b, pool)
        mass += pool[b["mass"]]
    pool[head["mass"]] = mass


@inner
def derive_rows(b: Record, pool: Array) -> None:
    """Write the numbers that follow from a body's moments: transposed first ones, R1[j,a,k], and the elastic mass."""
    wide, first = b["wide"], b["first"]
    for k in range(wide):
        for a in range(3):
            pool[b["momentum"] + 4 * k + a] = pool[first + wide * a + k]
    for j in range(b["n_shapes"]):
        for k in range(0, wide, 4):
            P = rows9(pool, b["second"] + 9 * wide * (j + 1) + k, wide)  # a c k
            put_rows3(pool, b["gyro"] + 3 * wide * j + k, wide, turning_of(P))
            put_lane(pool, b["elastic_mass"] + wide * j + k, P[0] + P[4] + P[8])


DRIFT, KICK, FLOW, TURN, SPEED = 0, 3, 6, 15, 24  # of the undeformed body, see Block.rates
C_DRIFT, C_FLOW = 0, 4  # of what is carried: int w dm, int r w^T dm


@inner
def carry_material(b: Record, pool: Array, work: Array) -> None:
    """Write int w dm, int r w^T dm and int phi_k w^T dm of the placed body."""
    n, wide, delta, rates = b["n_shapes"], b["wide"], b["delta"], b["rates"]
    drift, flow = load3(pool, rates + DRIFT), load9(pool, rates + FLOW)
    if n > 0:
        d_drift, d_flow = zero_rows3(), zero_rows9()
        for k in range(0, wide, 4):
            z = rows9(pool, b["flow"] + k, wide)
            for j in range(n):
                z = plus(z, work[delta + j], rows9(pool, b["flow"] + 9 * wide * (j + 1) + k, wide))
            put_rows9(work, b["carriedZ"] + k, wide, z)
            d = lane(work, delta + k)
            d_drift = plus(d_drift, d, rows3(pool, b["drifts"] + k, wide))
            d_flow = plus(d_flow, d, add9(z, rows9(pool, b["flow0"] + k, wide)))
        drift, flow = add(drift, totals3(d_drift)), add9(flow, totals9(d_flow))
    store3(work, b["carried"] + C_DRIFT, drift)
    store9(work, b["carried"] + C_FLOW, flow)


@inner
def add_flow_forces(b: Record, pool: Array, work: Array) -> None:
    """Add the inertia forces of moving material to the bias wrench and the elastic bias."""
    w, n, wide, delta, ddelta, rates = b["work"], b["n_shapes"], b["wide"], b["delta"], b["ddelta"], b["rates"]
    omega = load3(work, w + W_OMEGA)
    drift, flow = load3(work, b["carried"] + C_DRIFT), load9(work, b["carried"] + C_FLOW)
    kick, turn = load3(pool, rates + KICK), load9(pool, rates + TURN)  # int b dm, int r b^T dm
    if n > 0:
        d_kick, d_turn = zero_rows3(), zero_rows9()
        for k in range(0, wide, 4):
            B = rows9(pool, b["turn"] + k, wide)  # int phi_k b^T dm
            for j in range(n):
                block = 9 * wide * (j + 1) + k
                B = plus(B, 2.0 * work[ddelta + j], rows9(pool, b["flow"] + block, wide))
                B = plus(B, work[delta + j], rows9(pool, b["turn"] + block, wide))
            Z = rows9(work, b["carriedZ"] + k, wide)
            d, dd = lane(work, delta + k), 2.0 * lane(work, ddelta + k)
            d_kick = plus(d_kick, dd, rows3(pool, b["drifts"] + k, wide))
            d_kick = plus(d_kick, d, rows3(pool, b["kicks"] + k, wide))
            d_turn = plus(d_turn, dd, rows9(pool, b["flow0"] + k, wide))
            d_turn = plus(d_turn, d, add9(B, rows9(pool, b["turn0"] + k, wide)))
            force = B[0] + B[4] + B[8] - dot(scale(2.0, omega), turning_of(Z))
            put_lane(work, b["pn"] + k, lane(work, b["pn"] + k) + force)
        kick, turn = add(kick, totals3(d_kick)), add9(turn, totals9(d_turn))
    force = add(kick, scale(2.0, cross(omega, drift)))
    add_pair(work, w + W_P, pair_of(force, add(twist_of(turn), scale(2.0, coriolis_couple(omega, flow)))))


@inner
def flow_motion(b: Record, pool: Array, work: Array) -> tuple[Vector, Vector, float]:
    """Momentum and angular momentum about the origin of the moving material, and the energy of w and the shapes' rates.

    The energy is int w . (phi_k ddelta_k + w/2) dm.
    """
    n, wide, delta, ddelta = b["n_shapes"], b["wide"], b["delta"], b["ddelta"]
    energy = zero_lane()
    for k in range(0, wide, 4):
        Z = rows9(work, b["carriedZ"] + k, wide)
        speed = lane(pool, b["speeds"] + k)  # with rho: counted once, for it stands once in the table
        for j in range(n):
            speed = speed + (0.5 * work[delta + j]) * lane(pool, b["speeds"] + wide * (j + 1) + k)
        energy = energy + lane(work, ddelta + k) * (Z[0] + Z[4] + Z[8]) + lane(work, delta + k) * speed
    drift, flow = load3(work, b["carried"] + C_DRIFT), load9(work, b["carried"] + C_FLOW)
    return drift, twist_of(flow), total(energy) + 0.5 * pool[b["rates"] + SPEED]


@inner
def shape_motion(b: Record, pool: Array, work: Array) -> tuple[Vector, Vector, float, float]:
    """Momentum and angular momentum that the shapes' rates add, their own kinetic energy, and the strain energy.

    Material that moves inside the body counts with the shapes.
    """
    row, wide, delta, ddelta = b["row"], b["wide"], b["delta"], b["ddelta"]
    ds, h = zero_rows3(), zero_rows3()
    kinetic, strain = zero_lane(), zero_lane()
    for k in range(0, wide, 4):
        d = lane(work, ddelta + k)
        ds = plus(ds, d, rows3(pool, b["first"] + k, wide))
        h = plus(h, d, turning_of(rows9(work, b["Z"] + k, wide)))
        inertia = zero_lane()
        for j in range(b["n_shapes"]):
            inertia = inertia + work[ddelta + j] * lane(pool, b["elastic_mass"] + wide * j + k)
        kinetic = kinetic + 0.5 * d * inertia
    for k in range(0, row, 4):
        force = zero_lane()
        for j in range(b["n"]):
            force = force + work[delta + j] * lane(pool, b["stiffness"] + row * j + k)
        strain = strain + lane(work, delta + k) * (lane(pool, b["f0"] + k) + 0.5 * force)
    energy = total(strain)
    if b["nonlinear"]:
        write_varying_stiffness(b, pool, work, 2.0, 1.0)
        energy += varying_energy(b, work)
    p, turning, motion = totals3(ds), totals3(h), total(kinetic)
    if b["flows"]:
        drift, flow, of_flow = flow_motion(b, pool, work)
        p, turning, motion = add(p, drift), add(turning, flow), motion + of_flow
    return p, turning, motion, energy
