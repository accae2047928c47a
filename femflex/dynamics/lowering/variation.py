"""Bodies that vary with time, lowered: their block in the pool, and the places of what the kernels read in it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femflex.body import FlexibleBody
from femflex.dynamics.lowering.bodies import take_monomials
from femflex.dynamics.lowering.pool import Pool, Scratch
from femflex.dynamics.lowering.unit_block import WORKED
from femflex.dynamics.lowering.writers import address_of
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
    at = Block(written, variation.varies)
    block = pool.put_own(at.laid(written))
    record["varies"], record["block"], record["dense"] = 1, block, 1
    known = [float(list(states).index(state)) for state in variation.states]
    numbers = np.concatenate([known, variation.numbers])
    if isinstance(variation.write, LengthTable):
        record["unit"] = pool.put_own(np.zeros(WORKED + at.size)) + WORKED
    if isinstance(variation.write, LengthTable) and isinstance(variation.write.length, str):
        pickup = at.pickup if "pickup" in variation.acting else -1
        strain = at.strain_rate if "strain" in variation.acting else -1
        numbers[7:12] = 1, list(states).index(variation.write.length), slot, pickup, strain
        record["free_length"] = 1
        record["accel_all"] = scratch.take(int(record["wide"]))
    record["numbers"] = pool.put_own(numbers)
    record["write"] = address_of(name, variation.write, len(states), len(numbers), at.size)
    parts, wide = variation.acting, int(record["wide"])
    if "mass" in parts:
        record["derived"], record["orthonormal"] = 1, 0
        record["mass"], record["first"], record["second"] = block + at.mass, block + at.first, block + at.second
        record["momentum"] = pool.put_own(np.zeros(4 * wide))
        record["gyro"] = pool.put_own(np.zeros(3 * wide * body.n_shapes))
        record["elastic_mass"] = pool.put_own(np.zeros(wide * body.n_shapes))
    if "flow" in parts:
        record["flows"] = 1
        places = {"rates": at.rates, "drifts": at.drift, "kicks": at.kick, "flow0": at.flow0, "turn0": at.turn0}
        places |= {"flow": at.flow, "turn": at.turn, "speeds": at.speed}
        for key, place in places.items():
            record[key] = block + place
        record["carried"], record["carriedZ"] = scratch.take(13), scratch.take(9 * wide)
    if "stiffness" in parts:
        record["diagonal"] = 0
        for key, frozen, place in (("stiffness", "V1", at.stiffness), ("f0", "f0", at.f0)):
            if frozen not in variation.frozen:
                record[key] = block + place
    if "damping" in parts:
        record["damping"], record["diagonal"] = block + at.damping, 0
    if "strain" in parts:
        if not record["nonlinear"]:
            take_monomials(record, scratch)
        record["curved"] = block + at.strain
    for marker, place in at.markers.items():
        first = block + place
        if f"marker/{marker}" in parts:
            pool.varying_markers[name, marker] = (first, first + PLACE, first + PLACE + 9 * at.wide)
