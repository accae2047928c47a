"""Report of the drum of a deploying member: its force from momentum, its power, and the energy lost at the exit.

The drum's force F works on the length L: with chi_A = dz_A/dL at a material point, w = U chi_A y_A,

    F = int chi . (a - f) dm + dV/dL + U |U| kappa / 2 + U^2 kappa / 2,     kappa = m' |chi_A y_A|^2 at the exit

where the integral is over material that is moving. The last two are the momentum flux kappa U^2 while the member
deploys and nothing while it is drawn in (THEORY section 6: Lagrange's equation for L alone yields half of it). F U is
what the change gives to the system and the power kappa |U|^3 / 2 that is lost as material at rest is picked up, or
moving material is stopped. F pushes the member out; at rest, -F is the tension at the exit.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.observe.material import (
    BodyMotion,
    half_speed_rate,
    moving_power,
    shape_form,
    speed_form,
    stiffness_power,
    strain_power,
)
from femflex.dynamics.observe.row import worded
from femflex.system import Block, Channel, LengthTable, System
from femflex.system.variation import COLUMNS


def lengths_of(system: System) -> dict[str, LengthTable]:
    """The tables of the bodies whose properties follow from a length, in tree order."""
    tables = {name: system.varying[name].write for name in system.order if name in system.varying}
    return {name: table for name, table in tables.items() if isinstance(table, LengthTable)}


CHANNELS = {  # as `drum_row` gives their values
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


def section_channels(name: str, table: LengthTable) -> dict[str, Channel]:
    """Channels of the forces in that body's sections, if it has any."""
    if table.sections is None:
        return {}
    stations = tuple(f"{xi:g}" for xi in table.sections.stations)
    text = "{} of {} at stations by their distance from the exit over the length"
    return {
        f"bodies/{name}/{key}": Channel(unit, text.format(meaning, name), (len(stations),), stations)
        for key, (unit, meaning) in table.sections.resultants.items()
    }


def drum_row(
    b: np.void,
    layout: Block,
    table: LengthTable,
    unit: Array,
    motion: BodyMotion,
    length: tuple[float, float, float],
    marker_force: float,
    parts: tuple[str, ...],
    power: float,
) -> tuple[float, ...]:
    """Values of CHANNELS of body record b.

    unit: the pool with the block of a unit rate of the length; length: L, U and its rate; carried: generalised force
    of what stands on markers that move; power: what the change gives to the system.
    """
    L, U, acceleration = length
    block, y, flux, kappa = int(b["block"]), motion.y, 0.0, 0.0
    force = marker_force
    if "pickup" in parts:
        start, zero = block + layout.pickup_shapes, float(unit[block + layout.pickup])
        kappa, flux = shape_form(start, zero, int(b["n_shapes"]), unit, y, y), zero * U * U
    if "flow" in parts:
        force += moving_power(b, unit, motion) + speed_form(b, unit, y, 2.0 * U * motion.dy + acceleration * y)
        force += U * U * half_speed_rate(b, unit, y) + 0.5 * U * abs(U) * kappa
    if "stiffness" in parts:
        delta = y[1 : 1 + int(b["n"])]
        force += stiffness_power(block + layout.stiffness_rate, block + layout.f0_rate, int(b["n"]), unit, delta)
    if "strain" in parts:
        n = int(b["n"])
        force += strain_power(block + layout.strain_rate, n, int(b["n_blocks"]), COLUMNS, unit, y[1 : 1 + n])
    loss = 0.5 * abs(U) ** 3 * kappa if "flow" in parts else 0.0
    torque = 0.0 if table.drum_radius is None else force * table.drum_radius
    return L, U, acceleration, force, power + loss, loss, flux, torque
