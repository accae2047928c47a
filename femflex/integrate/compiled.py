"""Decorators that compile the kernels, and the argument types that kernels share.

Division follows IEEE rules (no Python exceptions inside). Fused multiply-add is the only optimisation that may change
results, so these repeat bit for bit. With the compiler off the decorators return the plain Python functions.
"""

from __future__ import annotations

from typing import Any

import numba
import numba.types

from femflex.kernels.compiled import part_options, stored

types: Any = numba.types  # numba's own annotations do not cover its types and first-class functions
njit: Any = numba.njit

VECTOR, TABLE = types.float64[::1], types.float64[:, ::1]
INDICES = types.int64[::1]
REAL, INTEGER = types.float64, types.int64
SPAN = types.UniTuple(REAL, 3)  # end of a smooth interval, and the limits within which the model may be asked
ENDED = types.UniTuple(INTEGER, 2)  # how a kernel call ended, and the number of rows it wrote

shared: Any = njit(error_model="numpy", fastmath={"contract"})  # a part that Python calls as well
_PART = part_options()
part: Any = njit(error_model="numpy", fastmath={"contract"}, **_PART)  # of a kernel; only other kernels call it
summing: Any = njit(error_model="numpy", fastmath={"contract", "reassoc"}, **_PART)  # a part that may reorder its sums


def kernel(signature: Any) -> Any:
    """Decorator of a kernel: compiled for this one signature, stored on disk, and free of the interpreter's lock."""
    return stored(signature, loop=True, error_model="numpy", fastmath={"contract"}, nogil=True)
