"""Addresses of the functions that write the properties of varying bodies (`femflex.system.variation`)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numba
import numba.core.errors
import numpy as np

from femflex.arrays import Array
from femflex.dynamics.lowering.by_length import write_by_length
from femflex.dynamics.lowering.tanks import writer
from femflex.kernels.entries import USER, plain_address, plain_array
from femflex.system.length_table import LengthTable

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
            f"the function that writes the properties of body {name!r} cannot be compiled: {_first_line(error)}. "
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


def _first_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return next((line for line in lines if not line.startswith("Failed in")), lines[0] if lines else "no reason given")
