"""Effectors: forces of functions at markers and along joints (see femflex.system.effector)."""

from __future__ import annotations

from dataclasses import replace

from femflex.arrays import Array, Record, Table
from femflex.dynamics.bodies.added_mass import take_added_mass
from femflex.dynamics.forces.added_mass import write_added_masses
from femflex.dynamics.forces.effector_calls import apply_forces, correct, evaluate_effector, strain_accounts
from femflex.dynamics.forces.effector_functions import N_ACCOUNTS
from femflex.dynamics.forces.effector_records import CRAFT, N_EFFECTOR, PLACE, effector_at, lowered
from femflex.dynamics.forces.force_term import ForceTerm, Records
from femflex.dynamics.forces.forces import APPLY, RELAX, REPORT, account_of
from femflex.dynamics.forces.gravity import reference_motion
from femflex.dynamics.layout.pool import Pool, Scratch
from femflex.dynamics.layout.records import (
    A_DISSIPATION,
    A_ENERGY,
    A_SUPPLIED,
    ORBIT_FREE,
    ORBIT_NONE,
    W_CIN,
    W_POS,
    W_VEL,
    body_of,
    header_of,
)
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry
from femflex.kernels.vectors import add, dot, load3, load9, store3, turn_back
from femflex.system import Channel, Controller, Effector, System
from femflex.system.effector import ACCOUNTS
from femflex.system.evaluation import evaluation_order

XYZ = ("x", "y", "z")
NEVER = 1e300  # s, the first sample of a controller that is switched off


@inner
def place_craft(table: Table, work: Array) -> None:
    """Write place and velocity, inertial components, of the craft behind the orbit's state.

    They are those of the root body's origin on a free orbit, and of O, where the centre of mass is, on a specified one.
    """
    head, b = header_of(table), body_of(table, 1)
    if head["orbit"] == ORBIT_NONE:
        return
    o, w = head["orbit_state"], b["work"]
    place, velocity = load3(work, o + PLACE), load3(work, o + PLACE + 3)
    if head["orbit"] == ORBIT_FREE:
        place = add(place, load3(work, w + W_POS))
        velocity = add(velocity, turn_back(load9(work, w + W_CIN), load3(work, w + W_VEL)))
    store3(work, o + CRAFT, place)
    store3(work, o + CRAFT + 3, velocity)


@entry(APPLY)
def apply(
    t: float, q: Array, u: Array, records: int, first: int, last: int, table: Table, pool: Array, work: Array
) -> None:
    """Put the forces of effectors on bodies and joints, and write the rates of their states."""
    origin = reference_motion(table, pool, work)
    place_craft(table, work)
    for i in range(first, last):
        evaluate_effector(t, q, u, i, first, records, origin, table, pool, work)
        apply_forces(i, first, last, records, table, pool, work)


@entry(RELAX)
def relax(
    t: float, zdot: Array, c_d: float, out: Array, records: int, n: int, table: Table, pool: Array, work: Array
) -> None:
    """Newton's correction of the states of each effector by its own Jacobian, the motion of bodies given."""
    for i in range(n):
        e = effector_at(table, records + N_EFFECTOR * i)
        if e["n_z"] > 0:
            correct(t, e, c_d, out, table, pool, work)


@entry(REPORT)
def report(
    t: float, q: Array, u: Array, records: int, n: int, row: Array, table: Table, pool: Array, work: Array
) -> None:
    """Forces, torques, efforts, channels, power and accounts of every effector."""
    position, account = 0, account_of(table, work)
    origin = reference_motion(table, pool, work)
    place_craft(table, work)
    for i in range(n):
        e = effector_at(table, records + N_EFFECTOR * i)
        evaluate_effector(t, q, u, i, 0, records, origin, table, pool, work)
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
            row[position + k] = work[out + k]
        position += 6 * m + f
        channels = out + 6 * m + f + e["n_z"]
        for k in range(e["n_channels"]):
            row[position + k] = work[channels + k]
        position += e["n_channels"]
        row[position] = power
        for k in range(N_ACCOUNTS):
            row[position + 1 + k] = work[channels + e["n_channels"] + k]
        if e["strained"] > 0:
            given, stored, supplied = strain_accounts(e, table, pool, work)
            row[position] += given
            row[position + 1] += stored
            row[position + 3] += supplied
        account[A_ENERGY] += row[position + 1]
        account[A_DISSIPATION] += row[position + 2]
        account[A_SUPPLIED] += row[position + 3]
        position += 1 + N_ACCOUNTS


class Effectors(ForceTerm):
    """The effectors of a system; controllers act through the effectors that take their commands."""

    folder = "effectors"
    apply, report, relax = apply, report, relax

    def items(self, system: System) -> list[str]:
        return [effector.name for effector in acting_effectors(system)]

    def lower(self, system: System, head: Record, bodies: Records, pool: Pool, scratch: Scratch, at: int) -> Table:
        effectors = acting_effectors(system)
        head["relaxes"] = int(any(effector.states for effector in effectors))
        wet = {body for effector in effectors if effector.adds_mass for body, _ in effector.markers}
        if wet:
            head["add_mass"], head["wet"], head["n_wet"] = write_added_masses.address, at, len(effectors)
        for record, name in zip(bodies[1:], system.order, strict=True):
            if name in wet:
                take_added_mass(record, scratch)
        return lowered(effectors, system, bodies, head, pool, scratch, at)

    def channels(self, system: System) -> dict[str, Channel]:
        return {
            path: channel
            for effector in acting_effectors(system)
            for path, channel in channels_of_effector(effector).items()
        }

    def without_item(self, system: System, item: str) -> System:
        if item in self.others(system):  # its commands stay as they were at the start
            changed = (
                replace(e, start=NEVER) if isinstance(e, Controller) and e.name == item else e for e in system.effectors
            )
            return replace(system, effectors=tuple(changed))
        remaining = tuple(effector for effector in system.effectors if effector.name != item)
        removed = {name for effector in system.effectors if effector.name == item for name, _ in effector.state_names()}
        return replace(system, effectors=remaining, z0={k: v for k, v in system.z0.items() if k not in removed})

    def fixed(self, system: System) -> list[str]:
        used = {name for effector in acting_effectors(system) for name in effector.inputs}
        return [
            effector.name
            for effector in acting_effectors(system)
            if any(name in used for name in signal_names(effector))
        ]

    def others(self, system: System) -> list[str]:
        return [effector.name for effector in system.controllers]

    def breaks(self, system: System) -> list[Array]:
        return [effector.breaks for effector in acting_effectors(system)]


def acting_effectors(system: System) -> list[Effector]:
    """The effectors of a system that are not controllers, in their order of evaluation."""
    return evaluation_order([effector for effector in system.effectors if isinstance(effector, Effector)])


def signal_names(effector: Effector) -> list[str]:
    """Return the full names of an effector's states and channels, which others may take as inputs."""
    return [*(name for name, _ in effector.state_names()), *(f"{effector.name}.{c}" for c in effector.channels)]


def channels_of_effector(effector: Effector) -> dict[str, Channel]:
    """The channels that `report` writes of one effector; unused accounts, and what it does not exert, are zero."""
    m, f, name = len(effector.markers), len(effector.freedoms), effector.name
    out = {}
    for key, unit in (("force", "N"), ("torque", "N m")) if m else ():
        where = ", ".join(f"{body}.{marker}" for body, marker in effector.markers)
        names = XYZ if m == 1 else tuple(f"{body}.{marker}.{a}" for body, marker in effector.markers for a in XYZ)
        exerted = key in effector.exerts
        out[key] = Channel(unit, f"{key} of {name} at {where}", (3 * m,), names, "inertial", exerted)
    if f:
        text = f"force or torque of {name} along its degrees of freedom"
        out["effort"] = Channel("N, N m", text, (f,), effector.freedoms, reported="effort" in effector.exerts)
    hidden = [*effector.zeros, *list(effector.channels)[: 2 * effector.n_strains]]
    for channel, unit in effector.channels.items():
        out[channel] = Channel(unit, f"{channel} of {effector.kind} {name}", reported=channel not in hidden)
    out["power"] = Channel("W", f"power that {name} gives to the motion", reported=effector.acts)
    for account, (unit, what) in ACCOUNTS.items():
        out[account] = Channel(unit, f"{what} by {name}", reported=account in effector.accounts)
    return {f"effectors/{name}/{key}": channel for key, channel in out.items()}
