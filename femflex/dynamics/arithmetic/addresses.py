"""Calls of a function by its address from compiled code.

The address is a number in the table, so that one compiled call serves every model, whatever functions the user gives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.compiled import inner
from femflex.dynamics.arithmetic.symbols import extending, ir, types

Array = NDArray[np.float64]

_CALLED: dict[int, Callable[[float, Array, Array, Array], object]] = {}  # used with the compiler off
_numba: Any = numba  # its annotations do not cover what is used here


def known_at(address: int, function: Callable[[float, Array, Array, Array], object]) -> None:
    """Say what stands at an address, for code that runs with the compiler off."""
    _CALLED[address] = function


@extending.intrinsic
def _call(context: Any, address: Any, t: Any, a: Any, b: Any, out: Any) -> Any:
    """Call of void(double, double*, double*, double*) at an address."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        real = ir.DoubleType()
        kind = ir.FunctionType(ir.VoidType(), [real, *[real.as_pointer()] * 3])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.void(types.int64, types.float64, a, b, out), generate


_call_at: Any = _call

if _numba.config.DISABLE_JIT:

    def call_at(address: int, t: float, a: Array, b: Array, out: Array) -> None:
        """Call the function at an address with t and the beginnings of three arrays."""
        _CALLED[int(address)](t, a, b, out)

else:

    @inner
    def call_at(address: int, t: float, a: Array, b: Array, out: Array) -> None:
        """Call the function at an address with t and the beginnings of three arrays."""
        _call_at(address, t, a, b, out)
