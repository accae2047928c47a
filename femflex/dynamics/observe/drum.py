"""Report of the drum of a deploying member: its force from momentum, its power, and the energy lost at the exit.

The drum's force F works on the length L: with chi_A = dz_A/dL at a material point, w = U chi_A y_A,

    F = int chi . (a - f) dm + dV/dL + U |U| kappa / 2 + U^2 kappa / 2,     kappa = m' |chi_A y_A|^2 at the exit

where the integral is over material that is moving. The last two are the momentum flux kappa U^2 while the member
deploys and nothing while it is drawn in (THEORY section 6: Lagrange's equation for L alone yields half of it). F U is
what the change gives to the system and the power kappa |U|^3 / 2 that is lost as material at rest is picked up, or
moving material is stopped. F pushes the member out; at rest, -F is the tension at the exit.
"""

from __future__ import annotations

from contextlib import nullcontext
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, Table
from femflex.dynamics.bodies.varying import length_motion
from femflex.dynamics.constraints.free_lengths import add_constraint_work, write_unit_blocks
from femflex.dynamics.forces.marker_forces import clear_work_per_length
from femflex.dynamics.layout.records import body_of, body_records, header_of
from femflex.dynamics.observe.row import worded
from femflex.dynamics.rate.drum_force import call_drum_force, change_power, exit_density, growth_power
from femflex.kernels.compiled import kernel
from femflex.kernels.entries import ARRAYS, MATRIX, REAL, VOID
from femflex.kernels.lanes import pointer
from femflex.kernels.vectors import load3
from femflex.system import Channel, LengthTable, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

PREPARE, CHANGES = VOID(REAL, *ARRAYS), VOID(REAL, MATRIX, *ARRAYS)
N_CHANGES = 8  # numbers of a body, as `gather_changes` writes them


MASS_ALONE = {"mass", "growth", "damping"}  # parts whose change has no power but that of arriving mass


@kernel(PREPARE)
def prepare_lengths(t: float, table: Table, pool: Array, work: Array) -> None:
    """Before forces are written: write the blocks of unit rates of lengths, and clear the work per length."""
    write_unit_blocks(t, pointer(table), pointer(pool), pointer(work))
    clear_work_per_length(pointer(table), pointer(pool))


@kernel(CHANGES)
def write_lengths(t: float, out: Array, table: Table, pool: Array, work: Array) -> None:
    """Write length, rate, acceleration, drum force and exit densities of bodies with a length to out[:, 2:]."""
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    head = header_of(records)
    if head["left_out"] == 0:
        add_constraint_work(records, numbers, scratch)
    for i in range(1, head["n_bodies"]):
        b = body_of(records, i)
        if b["unit"] > 0:
            L, U, acceleration = length_motion(t, b, records, numbers, scratch)
            out[i, 2], out[i, 3], out[i, 4] = L, U, acceleration
            out[i, 5] = call_drum_force(head["drum_force"], i, U, acceleration, records, numbers, scratch)
            if b["flows"] and b["pickup"] > 0:
                out[i, 6], out[i, 7] = exit_density(b, numbers, scratch), numbers[b["pickup"] + b["unit"] - b["block"]]


@kernel(CHANGES)
def write_powers(t: float, out: Array, table: Table, pool: Array, work: Array) -> None:
    """Write the power of bodies that vary without a length to out[:, 1], but for that of arriving mass."""
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    for i in range(1, header_of(records)["n_bodies"]):
        if body_of(records, i)["varies"] and body_of(records, i)["unit"] == 0:
            out[i, 1] = change_power(i, records, numbers, scratch)


@kernel(CHANGES)
def add_growth_powers(t: float, out: Array, table: Table, pool: Array, work: Array) -> None:
    """Add the power of arriving mass to out[:, 1]."""
    records, numbers, scratch = pointer(table), pointer(pool), pointer(work)
    head = header_of(records)
    for i in range(1, head["n_bodies"]):
        b = body_of(records, i)
        if b["growth"] > 0 and b["unit"] == 0:
            out[i, 1] += growth_power(b, load3(numbers, head["gravity"]), numbers, scratch)


def gather_changes(model: Model, t: float, x: Array, out: Array) -> None:
    """Write the changes of the bodies at the state x (n_x,) to out (n_bodies, N_CHANGES), which is zero beforehand.

    They are mass, power of the change; length, rate, acceleration, drum force, exit densities: kappa and that of a
    member that is not deflected. Those of bodies with a length have no power, all others nothing after the power.
    Motion and joint forces stay in the work array.
    """
    bodies, variations = body_records(model.table), model.system.varying.values()
    has_lengths = bool(bodies["unit"].any())
    udot = np.array(model.parts(model.state_rate(t, x))[1])
    if has_lengths:
        prepare_lengths(t, *model.workspace.arrays)
    with nullcontext() if model.constraints is None or model.reduced else model.constraints.pushed():
        model.residual(t, x, udot)
    out[1:, 0] = model.pool[bodies["mass"][1:]]
    if has_lengths:
        write_lengths(t, out, *model.workspace.arrays)
    if any(set(variation.acting) - MASS_ALONE for variation in variations):
        write_powers(t, out, *model.workspace.arrays)
    if bodies["growth"].any():
        add_growth_powers(t, out, *model.workspace.arrays)


def lengths_of(system: System) -> dict[str, LengthTable]:
    """The tables of the bodies whose properties follow from a length, in tree order."""
    tables = {name: system.varying[name].write for name in system.order if name in system.varying}
    return {name: table for name, table in tables.items() if isinstance(table, LengthTable)}


CHANNELS = {  # as `drum_values` gives their values
    "length": Channel("m", "deployed length of {name}"),
    "length_rate": Channel("m/s", "rate of the deployed length of {name}"),
    "length_acceleration": Channel("m/s^2", "acceleration of the deployed length of {name}"),
    "drum_force": Channel("N", "force of its drum on {name}, positive outwards; minus the tension at the exit"),
    "drum_power": Channel("W", "power of the drum of {name}"),
    "pickup_loss": Channel("W", "power lost where stowed material of {name} is picked up or stopped"),
    "exit_flux": Channel("N", "momentum flux of {name} at the exit; a part of moving_mass and specified_motion"),
    "drum_torque": Channel("N m", "torque of the drum of {name}"),
}


def drum_channels(name: str, table: LengthTable) -> dict[str, Channel]:
    """Channels of the drum of that body; without a radius it reports no torque."""
    return {
        f"bodies/{name}/{key}": worded(channel, {"name": name}, reported=key != "drum_torque" or has_radius)
        for has_radius in [table.drum_radius is not None]
        for key, channel in CHANNELS.items()
    }


def drum_values(table: LengthTable, changes: Array) -> list[Array]:
    """Values (n_t,) of CHANNELS from what `gather_changes` has written of a body, (N_CHANGES, n_t)."""
    _, _, L, U, acceleration, force, kappa, density = changes
    torque = 0.0 * force if table.drum_radius is None else force * table.drum_radius
    return [L, U, acceleration, force, force * U, 0.5 * np.abs(U) ** 3 * kappa, density * U**2, torque]
