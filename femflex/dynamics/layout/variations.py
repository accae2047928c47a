"""Bodies that vary with time, lowered: their block in the pool, and the function that writes it."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numba.core.errors
import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.dynamics.layout.bodies import take_monomials
from femflex.dynamics.layout.pool import Pool, Scratch
from femflex.dynamics.layout.written_blocks import write_by_length, writer
from femflex.kernels.entries import USER, first_line, plain_address, plain_array
from femflex.system.length_table import LengthTable
from femflex.system.variation import PLACE, Block, Variation

WORKED = 4  # numbers before the block; the first: force along the length by what acts on its markers and points of mass


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
        numbers[7:10] = 1, list(states).index(variation.write.length), slot
        record["free_length"] = 1
    record["numbers"] = pool.add_unshared(numbers)
    record["write"] = function_address(name, variation.write, len(states), len(numbers), layout.size)
    parts, wide = variation.acting, int(record["wide"])
    record["accel_all"] = scratch.take(wide)
    rates = ("pickup", "pickup"), ("growth", "growth"), ("stiffness_rate", "stiffness"), ("f0_rate", "stiffness")
    for key, part in (*rates, ("strain_rate", "strain")):
        record[key] = block + getattr(layout, key) if part in parts else 0
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


_numba: Any = numba  # its annotations do not cover what is used here
_KNOWN: dict[
    tuple[Any, int, int, int], tuple[int, Any]
] = {}  # function and sizes -> its address, and what keeps it alive


def function_address(
    name: str, write: Callable[..., Any] | LengthTable | str, n_z: int, n_numbers: int, n_block: int
) -> int:
    """Return the address of the function of body `name` for compiled code; it is compiled once in a process.

    Raises ValueError where Numba cannot compile it.
    """
    if isinstance(write, LengthTable):
        return write_by_length.address
    if isinstance(write, str):
        return writer(write).address
    key = (write, n_z, n_numbers, n_block)
    if key not in _KNOWN:
        _KNOWN[key] = _compiled(name, write, n_z, n_numbers, n_block)
    return _KNOWN[key][0]


def _compiled(name: str, write: Callable[..., Any], n_z: int, n_numbers: int, n_block: int) -> tuple[int, Any]:
    if hasattr(write, "address"):
        _check_signature(name, write)
        pointers: Any = write.ctypes  # type: ignore[attr-defined]
        if _numba.config.DISABLE_JIT:
            return plain_address(lambda t, *arrays: pointers(t, *(_pointer_to(a) for a in arrays))), write
        return int(write.address), write
    interpreted = bool(_numba.config.DISABLE_JIT)
    compiled = write if interpreted or hasattr(write, "py_func") else _numba.njit(write)
    array, nan = plain_array if interpreted else _numba.carray, np.nan

    def guarded_write(t: float, z: Any, numbers: Any, block: Any) -> None:
        try:
            compiled(t, array(z, (n_z,)), array(numbers, (n_numbers,)), array(block, (n_block,)))
        except Exception:  # see `guarded`
            array(block, (n_block,))[:] = nan

    if interpreted:
        return plain_address(guarded_write), write
    try:
        callback = _numba.cfunc(USER)(guarded_write)
    except numba.core.errors.NumbaError as error:
        raise ValueError(
            f"the function that writes the properties of body {name!r} cannot be compiled: {first_line(error)}. "
            "It takes (t, z, numbers, block), a number and three arrays of numbers, and writes into the last; use what "
            "Numba compiles"
        ) from error
    return int(callback.address), callback


def _check_signature(name: str, write: Any) -> None:
    signature = getattr(write, "_sig", USER)
    if signature != USER:
        raise ValueError(
            f"the compiled function that writes the properties of body {name!r} has the signature {signature}; compile "
            f"it for {USER}"
        )


def _pointer_to(a: Array) -> Any:
    return a.ctypes.data_as(ctypes.c_void_p)
