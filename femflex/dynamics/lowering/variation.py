"""Bodies that vary with time, lowered: their block in the pool, and the offsets of what kernels read in it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femflex.body import FlexibleBody
from femflex.dynamics.lowering.bodies import take_monomials
from femflex.dynamics.lowering.pool import Pool, Scratch
from femflex.dynamics.lowering.unit_block import WORKED
from femflex.dynamics.lowering.writers import function_address
from femflex.system.length_table import LengthTable
from femflex.system.variation import PLACE, Block, Variation


def lower_variation(
    record: np.void,
    name: str,
    body: FlexibleBody,
    variation: Variation,
    states: Sequence[str],
    slot: int,
    pool: Pool,
    scratch: Scratch,
) -> None:
    """Point the record of a body to the block that its function writes, part by part.

    states: names of z; slot: place behind them for the acceleration of its length, if that is free.
    """
    written = variation.whole or body
    layout = Block(written, variation.varies)
    block = pool.add_unshared(layout.constant_block(written))
    record["varies"], record["block"], record["dense"] = 1, block, 1
    state_indices = [float(list(states).index(state)) for state in variation.states]
    numbers = np.concatenate([state_indices, variation.numbers])
    if isinstance(variation.write, LengthTable):
        record["unit"] = pool.add_unshared(np.zeros(WORKED + layout.size)) + WORKED
    if isinstance(variation.write, LengthTable) and isinstance(variation.write.length, str):
        pickup = layout.pickup if "pickup" in variation.acting else -1
        strain = layout.strain_rate if "strain" in variation.acting else -1
        numbers[7:12] = 1, list(states).index(variation.write.length), slot, pickup, strain
        record["free_length"] = 1
        record["accel_all"] = scratch.take(int(record["wide"]))
    record["numbers"] = pool.add_unshared(numbers)
    record["write"] = function_address(name, variation.write, len(states), len(numbers), layout.size)
    parts, wide = variation.acting, int(record["wide"])
    if "mass" in parts:
        record["derived"], record["orthonormal"] = 1, 0
        record["mass"], record["first"], record["second"] = (
            block + layout.mass,
            block + layout.first,
            block + layout.second,
        )
        record["momentum"] = pool.add_unshared(np.zeros(4 * wide))
        record["gyro"] = pool.add_unshared(np.zeros(3 * wide * body.n_shapes))
        record["elastic_mass"] = pool.add_unshared(np.zeros(wide * body.n_shapes))
    if "flow" in parts:
        record["flows"] = 1
        offsets = {
            "rates": layout.rates,
            "drifts": layout.drift,
            "kicks": layout.kick,
            "flow0": layout.flow0,
            "turn0": layout.turn0,
        }
        offsets |= {"flow": layout.flow, "turn": layout.turn, "speeds": layout.speed}
        for key, offset in offsets.items():
            record[key] = block + offset
        record["carried"], record["carriedZ"] = scratch.take(13), scratch.take(9 * wide)
    if "stiffness" in parts:
        record["diagonal"] = 0
        for key, frozen, offset in (("stiffness", "V1", layout.stiffness), ("f0", "f0", layout.f0)):
            if frozen not in variation.frozen:
                record[key] = block + offset
    if "damping" in parts:
        record["damping"], record["diagonal"] = block + layout.damping, 0
    if "strain" in parts:
        if not record["nonlinear"]:
            take_monomials(record, scratch)
        record["curved"] = block + layout.strain
    for marker, offset in layout.markers.items():
        first = block + offset
        if f"marker/{marker}" in parts:
            pool.varying_markers[name, marker] = (first, first + PLACE, first + PLACE + 9 * layout.wide)
