"""Report of bodies that vary with time: their mass, and the power that the change supplies to the system.

The power belongs to whatever drives the change, and nothing else in the balance of energy holds it:

    flow       int w . (a - f) dm of moving material, a its acceleration and f gravity; what is lost as material is
               picked up or stopped is taken off, for d/dt int w.w/2 dm is what the rates of `speed` say
    markers    of joints, loads, springs and effectors at markers that move with time, by the velocity of these
    stiffness  energy of strain that changes at a fixed shape
    growth     energy of motion, and of weight, that arriving mass has at the velocity of its place

Of bodies whose change does not follow from a length, loads, springs, effectors and loops at markers that move are not
counted; nor is gravity of an orbit on arriving mass.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.observe.drum import CHANNELS, N_CHANGES, drum_channels, drum_values, gather_changes, lengths_of
from femflex.dynamics.observe.sections import acting_forces, section_channels, section_report, section_values
from femflex.dynamics.report import Observation, Report
from femflex.system import Channel, System


class Variations(Report):
    """Bodies that vary, in tree order, with their drums and the forces in their sections; then the power of all."""

    def channels(self, system: System) -> dict[str, Channel]:
        out: dict[str, Channel] = {}
        for name in varying_names(system):
            out[f"bodies/{name}/mass"] = Channel("kg", f"mass of {name}")
            out[f"bodies/{name}/power"] = Channel("W", f"power that the change of {name} gives to the system")
            if table := lengths_of(system).get(name):
                out |= drum_channels(name, table) | section_channels(name, table)
        if out:
            out["monitors/variation_power"] = Channel("W", "power that bodies which vary with time give to the system")
        if lengths_of(system):
            out["monitors/pickup_loss"] = Channel("W", "power lost where stowed material is picked up or stopped")
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        model, names, lengths = seen.model, varying_names(seen.system), lengths_of(seen.system)
        order, times = [1 + seen.system.order.index(name) for name in names], seen.times
        acting = {name: [acting_forces(seen, name, j) for j in range(len(times))] for name in lengths}
        changes = np.zeros((len(times), 1 + len(seen.system.order), N_CHANGES))
        sections: dict[str, list[dict[str, Array]]] = {name: [] for name in lengths}
        for j, (t, x) in enumerate(zip(times, seen.states, strict=True)):
            gather_changes(model, float(t), x, changes[j])
            for k, name in zip(order, names, strict=True):
                if name in lengths:
                    at_length = changes[j, k, 2], changes[j, k, 3], changes[j, k, 4]
                    sections[name].append(section_report(model, k, lengths[name], at_length, acting[name][j]))
        total, loss = np.zeros((2, len(times)))
        for k, name in zip(order, names, strict=True):
            power, drum = changes[:, k, 1], list[Array]()
            if name in lengths:
                drum = drum_values(lengths[name], changes[:, k].T)
                of_drum = dict(zip(CHANNELS, drum, strict=True))
                power = of_drum["drum_power"] - of_drum["pickup_loss"]
                loss = loss + of_drum["pickup_loss"]
            total = total + power
            yield from (changes[:, k, 0], power, *drum)
            if name in lengths:
                yield from section_values(lengths[name], sections[name])
        yield total
        if lengths:
            yield loss


def varying_names(system: System) -> list[str]:
    """Names of the bodies that vary, in tree order."""
    return [name for name in system.order if name in system.varying]
