"""Effectors: what functions do at markers and along joints (see femflex.system.effector)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import inner
from femflex.dynamics.arithmetic.entries import caller, entry
from femflex.dynamics.arithmetic.lanes import beyond
from femflex.dynamics.arithmetic.vectors import (
    UNIT,
    ZERO,
    Vector,
    add,
    cross,
    dot,
    load3,
    load9,
    product,
    store3,
    store9,
    sub,
    transpose,
    turn,
    turn_back,
)
from femflex.dynamics.bodies.shapes import markers_motion
from femflex.dynamics.effectors.acting import ACT, N_ACCOUNTS, act_address, given_size, seen_size
from femflex.dynamics.force_terms.registry import ForceTerm, Records
from femflex.dynamics.forces.calls import (
    A_DISSIPATION,
    A_ENERGY,
    A_SUPPLIED,
    APPLY,
    RELAX,
    REPORT,
)
from femflex.dynamics.forces.push import push
from femflex.dynamics.lowering.layout import (
    W_CIN,
    W_OMEGA,
    W_POS,
    W_TAU,
    W_VEL,
    body_of,
    header_of,
    record_reader,
)
from femflex.dynamics.lowering.pool import Pool, Scratch, put_marker
from femflex.dynamics.reports.observe import origin
from femflex.system import Channel, Controller, Effector, System
from femflex.system.effector import ACCOUNTS
from femflex.system.evaluation import evaluation_order

Array = NDArray[np.float64]
Table = NDArray[np.int64]
Record = np.void

EFFECTOR = np.dtype(
    [
        (name, "i8")
        for name in (
            "n_markers", "n_freedoms", "n_inputs", "n_z", "n_channels",
            "act", "jacobian",  # addresses; 0: none
            "markers", "freedoms", "inputs",  # table: PORT and HANDLE records, places of inputs from that of z
            "z",  # place of its first state in z
            "parameters", "sizes",  # pool
            "same",  # an effector before it whose only marker is its own; -1: none
            "seen", "out",  # work: what is seen; what is written, twice
            "trial", "matrix",  # work (n_z,), (n_z, n_z + 1): for Newton's method
        )
    ]
)  # fmt: skip
PORT = np.dtype(
    [
        (name, "i8")
        for name in (
            "body", "place", "shape", "spin", "bends",  # as for marker P of a joint
            "motion",  # work: place from the body's origin, body components (3); tangent T of its own turn (9)
        )
    ]
)  # fmt: skip
HANDLE = np.dtype([(name, "i8") for name in ("body", "freedom", "q", "u")])
N_EFFECTOR, N_PORT, N_HANDLE = (len(record.names or ()) for record in (EFFECTOR, PORT, HANDLE))

effector_at, port_at, handle_at = (record_reader(record) for record in (EFFECTOR, PORT, HANDLE))
call_act = caller(ACT)

XYZ = ("x", "y", "z")
NEVER = 1e300  # s, the first sample of a controller that is switched off
STEP = 1e-7  # of a state's size: difference for the Jacobian of its rates


@inner
def see_marker(
    e: Record, k: int, p: Record, shift: Vector, drift: Vector, table: Table, pool: Array, work: Array
) -> None:
    """Write the motion of marker k of an effector, inertial components, and what pushing at it needs."""
    b, m, seen = body_of(table, p["body"]), e["n_markers"], e["seen"]
    w = b["work"]
    C_iN, omega = load9(work, w + W_CIN), load3(work, w + W_OMEGA)
    r, C_iM, v = load3(pool, p["place"]), load9(pool, p["place"] + 3), ZERO
    rate = omega
    if p["bends"]:
        moved, v, bend, T, turning, _, _ = markers_motion(pool, p["place"], p["shape"], p["spin"], p["bends"], b, work)
        r, C_iM, rate = add(r, moved), product(bend, C_iM), add(omega, turning)
        store9(work, p["motion"] + 3, T)
    v = add(load3(work, w + W_VEL), add(cross(omega, r), v))
    store3(work, p["motion"], r)
    store3(work, seen + 3 * k, sub(add(load3(work, w + W_POS), turn_back(C_iN, r)), shift))
    store9(work, seen + 3 * m + 9 * k, product(transpose(C_iN), C_iM))
    store3(work, seen + 12 * m + 3 * k, sub(turn_back(C_iN, v), drift))
    store3(work, seen + 15 * m + 3 * k, turn_back(C_iN, rate))


@inner
def see_as(e: Record, other: Record, table: Table, work: Array) -> None:
    """Copy what another effector of one marker has just seen of the same marker."""
    own, far = port_at(table, e["markers"]), port_at(table, other["markers"])
    for k in range(18):
        work[e["seen"] + k] = work[other["seen"] + k]
    for k in range(12):
        work[own["motion"] + k] = work[far["motion"] + k]


@inner
def see(
    i: int,
    first: int,
    q: Array,
    u: Array,
    at: int,
    shift: Vector,
    drift: Vector,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """Write what effector i sees at the placed state; those from `first` on have seen it. shift, drift: of `origin`."""
    e = effector_at(table, at + N_EFFECTOR * i)
    if e["same"] >= first:
        see_as(e, effector_at(table, at + N_EFFECTOR * e["same"]), table, work)
    else:
        for k in range(e["n_markers"]):
            see_marker(e, k, port_at(table, e["markers"] + N_PORT * k), shift, drift, table, pool, work)
    here, n = e["seen"] + 18 * e["n_markers"], e["n_freedoms"]
    for k in range(n):
        handle = handle_at(table, e["freedoms"] + N_HANDLE * k)
        work[here + k], work[here + n + k] = q[handle["q"]], u[handle["u"]]
    z = header_of(table)["z"]
    for k in range(e["n_inputs"]):
        work[here + 2 * n + k] = work[z + table[e["inputs"] + k]]


@inner
def out_size(e: Record) -> int:
    """Numbers that an effector writes."""
    return 6 * e["n_markers"] + e["n_freedoms"] + e["n_z"] + e["n_channels"] + N_ACCOUNTS


@inner
def evaluate(t: float, e: Record, z: Array, out: int, pool: Array, work: Array) -> None:
    """Call an effector's function on what it sees and its states z (n_z,); its numbers go to place `out` of work."""
    for k in range(out_size(e)):
        work[out + k] = 0.0
    call_act(e["act"], t, beyond(work, e["seen"]), z, beyond(pool, e["parameters"]), beyond(work, out))


@inner
def act_at(
    t: float,
    q: Array,
    u: Array,
    i: int,
    first: int,
    at: int,
    shift: Vector,
    drift: Vector,
    table: Table,
    pool: Array,
    work: Array,
) -> None:
    """See, call, and keep the rates of states of effector i; those from `first` on have done so."""
    head, e = header_of(table), effector_at(table, at + N_EFFECTOR * i)
    see(i, first, q, u, at, shift, drift, table, pool, work)
    evaluate(t, e, beyond(work, head["z"] + e["z"]), e["out"], pool, work)
    rates = e["out"] + 6 * e["n_markers"] + e["n_freedoms"]
    for k in range(e["n_z"]):
        work[head["zdot"] + e["z"] + k] = work[rates + k]


@entry(APPLY)
def apply(t: float, q: Array, u: Array, at: int, first: int, last: int, table: Table, pool: Array, work: Array) -> None:
    """Put the forces of effectors on bodies and joints, and write the rates of their states."""
    shift, drift = origin(table, pool, work)
    for i in range(first, last):
        e = effector_at(table, at + N_EFFECTOR * i)
        act_at(t, q, u, i, first, at, shift, drift, table, pool, work)
        m, out = e["n_markers"], e["out"]
        for k in range(m):
            p = port_at(table, e["markers"] + N_PORT * k)
            b = body_of(table, p["body"])
            C_iN = load9(work, b["work"] + W_CIN)
            force, torque = turn(C_iN, load3(work, out + 3 * k)), turn(C_iN, load3(work, out + 3 * m + 3 * k))
            r, T = load3(work, p["motion"]), UNIT
            if p["bends"]:
                T = load9(work, p["motion"] + 3)
            push(b, force, torque, r, T, p["bends"], p["shape"], p["spin"], pool, work)
        for k in range(e["n_freedoms"]):
            handle = handle_at(table, e["freedoms"] + N_HANDLE * k)
            tau = body_of(table, handle["body"])["work"] + W_TAU + handle["freedom"]
            work[tau] += work[out + 6 * m + k]


@inner
def write_jacobian(t: float, e: Record, table: Table, pool: Array, work: Array) -> None:
    """J (n_z, n_z + 1) of an effector's own states, the last column free: by its own function, or by differences."""
    n, size = e["n_z"], out_size(e)
    z, base, rates = header_of(table)["z"] + e["z"], e["out"], 6 * e["n_markers"] + e["n_freedoms"]
    if e["jacobian"] != 0:
        own = beyond(work, e["out"] + size)
        for k in range(n * n):
            own[k] = 0.0
        given = beyond(pool, e["parameters"])
        call_act(e["jacobian"], t, beyond(work, e["seen"]), beyond(work, z), given, own)
        for i in range(n):
            for j in range(n):
                work[e["matrix"] + (n + 1) * i + j] = own[n * i + j]
        return
    for j in range(n):
        for k in range(n):
            work[e["trial"] + k] = work[z + k]
        step = STEP * max(abs(work[z + j]), pool[e["sizes"] + j])
        work[e["trial"] + j] += step
        evaluate(t, e, beyond(work, e["trial"]), base + size, pool, work)
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


@entry(RELAX)
def relax(
    t: float, given: Array, c_d: float, out: Array, at: int, n: int, table: Table, pool: Array, work: Array
) -> None:
    """Newton's correction of the states of each effector by its own Jacobian, the motion of bodies given."""
    for i in range(n):
        e = effector_at(table, at + N_EFFECTOR * i)
        size = e["n_z"]
        if size > 0:
            write_jacobian(t, e, table, pool, work)
            a = beyond(work, e["matrix"])
            for j in range(size):
                for k in range(size):
                    a[(size + 1) * j + k] = (1.0 if j == k else 0.0) - c_d * a[(size + 1) * j + k]
                a[(size + 1) * j + size] = out[e["z"] + j]
            solve_small(a, size)
            for j in range(size):
                out[e["z"] + j] = a[(size + 1) * j + size]


@entry(REPORT)
def report(
    t: float, q: Array, u: Array, at: int, n: int, row: Array, account: Array, table: Table, pool: Array, work: Array
) -> None:
    """Forces, torques, efforts, channels, power and accounts of every effector."""
    here = 0
    shift, drift = origin(table, pool, work)
    for i in range(n):
        e = effector_at(table, at + N_EFFECTOR * i)
        act_at(t, q, u, i, 0, at, shift, drift, table, pool, work)
        m, f, out = e["n_markers"], e["n_freedoms"], e["out"]
        speeds = e["seen"] + 18 * m + f
        power = 0.0
        for k in range(m):
            force, torque = load3(work, out + 3 * k), load3(work, out + 3 * m + 3 * k)
            velocity, rate = load3(work, e["seen"] + 12 * m + 3 * k), load3(work, e["seen"] + 15 * m + 3 * k)
            power += dot(force, velocity) + dot(torque, rate)
        for k in range(f):
            power += work[out + 6 * m + k] * work[speeds + k]
        for k in range(6 * m + f):
            row[here + k] = work[out + k]
        here += 6 * m + f
        channels = out + 6 * m + f + e["n_z"]
        for k in range(e["n_channels"]):
            row[here + k] = work[channels + k]
        here += e["n_channels"]
        row[here] = power
        for k in range(N_ACCOUNTS):
            row[here + 1 + k] = work[channels + e["n_channels"] + k]
        account[A_ENERGY] += row[here + 1]
        account[A_DISSIPATION] += row[here + 2]
        account[A_SUPPLIED] += row[here + 3]
        here += 1 + N_ACCOUNTS


def mark_same(records: Records, given: Sequence[Effector]) -> None:
    """Note the last effector before each whose only marker is its own, so that its motion is found once."""
    before: dict[tuple[str, str], int] = {}
    for i, effector in enumerate(given):
        records["same"][i] = -1
        if len(effector.markers) == 1:
            records["same"][i] = before.get(effector.markers[0], -1)
            before[effector.markers[0]] = i


class Effectors(ForceTerm):
    """The effectors of a system; controllers act through the effectors that take their commands."""

    folder = "effectors"
    apply, report, relax = apply, report, relax

    def items(self, system: System) -> list[str]:
        return [effector.name for effector in acting(system)]

    def lower(self, system: System, head: Record, bodies: Records, pool: Pool, scratch: Scratch, at: int) -> Table:
        given = acting(system)
        head["relaxes"] = int(any(effector.states for effector in given))
        records, behind = np.zeros(len(given), EFFECTOR), []
        here = at + N_EFFECTOR * len(given)
        names = [name for name, _ in system.state_names()]
        for record, effector in zip(records, given, strict=True):
            lower_own(record, effector, names, pool, scratch)
        mark_same(records, given)
        places = signal_places(given, records, names, int(head["z"]))
        for record, effector in zip(records, given, strict=True):
            parts = {
                "markers": lowered_markers(effector, system, pool, scratch),
                "freedoms": lowered_freedoms(effector, system, bodies),
                "inputs": np.array([places[name] for name in effector.inputs], np.int64),
            }
            for key, part in parts.items():
                record[key] = here
                behind.append(part.view(np.int64).ravel())
                here += part.nbytes // 8
        return np.concatenate([records.view(np.int64).ravel(), *behind])

    def channels(self, system: System) -> dict[str, Channel]:
        return {path: channel for effector in acting(system) for path, channel in own_channels(effector).items()}

    def without(self, system: System, item: str) -> System:
        if item in self.others(system):  # its commands stay as they were at the start
            changed = (
                replace(e, start=NEVER) if isinstance(e, Controller) and e.name == item else e for e in system.effectors
            )
            return replace(system, effectors=tuple(changed))
        left = tuple(effector for effector in system.effectors if effector.name != item)
        gone = {name for effector in system.effectors if effector.name == item for name, _ in effector.state_names()}
        return replace(system, effectors=left, z0={k: v for k, v in system.z0.items() if k not in gone})

    def fixed(self, system: System) -> list[str]:
        taken = {name for effector in acting(system) for name in effector.inputs}
        return [effector.name for effector in acting(system) if any(name in taken for name in signal_names(effector))]

    def others(self, system: System) -> list[str]:
        return [effector.name for effector in system.controllers]

    def breaks(self, system: System) -> list[Array]:
        return [effector.breaks for effector in acting(system)]

    def resists(self, system: System) -> bool:
        return any("dissipation" in effector.accounts for effector in acting(system))


def acting(system: System) -> list[Effector]:
    """The effectors of a system that are not controllers, in their order of evaluation."""
    return evaluation_order([effector for effector in system.effectors if isinstance(effector, Effector)])


def signal_names(effector: Effector) -> list[str]:
    """Full names of what others may take from an effector: its states and its channels."""
    return [*(name for name, _ in effector.state_names()), *(f"{effector.name}.{c}" for c in effector.channels)]


def signal_places(given: list[Effector], records: Records, names: list[str], z: int) -> dict[str, int]:
    """Where every state, and every channel of these effectors, stands from place z of the work array."""
    places = {
        f"{effector.name}.{channel}": int(r["out"] + 6 * r["n_markers"] + r["n_freedoms"] + r["n_z"]) + k - z
        for effector, r in zip(given, records, strict=True)
        for k, channel in enumerate(effector.channels)
    }
    return places | {name: k for k, name in enumerate(names)}


def own_channels(effector: Effector) -> dict[str, Channel]:
    """What `report` writes of one effector."""
    m, f, name = len(effector.markers), len(effector.freedoms), effector.name
    path = f"effectors/{name}"
    out = {}
    for key, unit, what in (("force", "N", "force"), ("torque", "N m", "torque")) if m else ():
        where = ", ".join(f"{body}.{marker}" for body, marker in effector.markers)
        names = XYZ if m == 1 else tuple(f"{body}.{marker}.{a}" for body, marker in effector.markers for a in XYZ)
        out[f"{path}/{key}"] = Channel(unit, f"{what} of {name} at {where}", (3 * m,), names, "inertial")
    if f:
        out[f"{path}/effort"] = Channel(
            "N, N m", f"force or torque of {name} along its degrees of freedom", (f,), effector.freedoms
        )
    for channel, unit in effector.channels.items():
        out[f"{path}/{channel}"] = Channel(unit, f"{channel} of {name}")
    out[f"{path}/power"] = Channel("W", f"power that {name} gives to the motion")
    for account, (unit, what) in ACCOUNTS.items():
        out[f"{path}/{account}"] = Channel(unit, f"{what} by {name}")
    return out


def lower_own(record: Record, effector: Effector, names: list[str], pool: Pool, scratch: Scratch) -> None:
    """Counts, addresses and places of one effector's own numbers."""
    m, f, n = len(effector.markers), len(effector.freedoms), len(effector.states)
    record["n_markers"], record["n_freedoms"], record["n_inputs"] = m, f, len(effector.inputs)
    record["n_z"], record["n_channels"] = n, len(effector.channels)
    sizes = (m, f, len(effector.inputs), n, len(effector.parameters), len(effector.channels))
    record["act"] = act_address(effector.name, effector.act, sizes)
    if effector.jacobian is not None:
        record["jacobian"] = act_address(effector.name, effector.jacobian, sizes, jacobian=True)
    record["z"] = names.index(effector.state_names()[0][0]) if n else 0
    record["parameters"], record["sizes"] = pool.put(effector.parameters), pool.put(effector.sizes)
    record["seen"] = scratch.take(seen_size(m, f, len(effector.inputs)))
    record["out"] = scratch.take(2 * max(given_size(m, f, n, len(effector.channels)), n * n))
    record["trial"], record["matrix"] = scratch.take(n), scratch.take(n * (n + 1))


def lowered_markers(effector: Effector, system: System, pool: Pool, scratch: Scratch) -> Records:
    """PORT records of an effector's markers."""
    records = np.zeros(len(effector.markers), PORT)
    for record, (body, marker) in zip(records, effector.markers, strict=True):
        record["body"], record["motion"] = 1 + system.order.index(body), scratch.take(12)
        places = put_marker(body, marker, system, pool)
        record["place"], record["shape"], record["spin"], record["bends"] = places
    return records


def lowered_freedoms(effector: Effector, system: System, bodies: Records) -> Records:
    """HANDLE records of an effector's slides and turns, whose joints then carry forces."""
    records = np.zeros(len(effector.freedoms), HANDLE)
    for i, name in enumerate(system.order, start=1):
        for k, freedom in enumerate(system.joint_of(name).freedom_names()):
            for record, wanted in zip(records, effector.freedoms, strict=True):
                if freedom == wanted:
                    record["body"], record["freedom"] = i, k
                    record["q"], record["u"] = bodies[i]["q"] + k, bodies[i]["u"] + k
                    bodies[i]["sprung"], bodies[i]["full"] = 1, 0
    return records
