"""Functions of effectors as compiled code calls them: `act(seen, out)` behind a fixed signature of pointers.

ACT  act(t, sizes, seen, z, parameters, out)
     sizes (N_SIZES,), then numbers one after another in the order of the fields of Seen and of Given; for a Jacobian,
     out is J (n_z, n_z)

A function is compiled once in a process; what is compiled stays alive with it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numba.core.errors
import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.arithmetic.entries import INTEGERS, NOTHING, NUMBERS, REAL, known

Array = NDArray[np.float64]

ACT = NOTHING(REAL, INTEGERS, NUMBERS, NUMBERS, NUMBERS, NUMBERS)
N_SIZES = 6  # markers, freedoms, inputs, states, parameters, channels
N_ACCOUNTS = 4

_numba: Any = numba  # its annotations do not cover what is used here
_KNOWN: dict[tuple[Any, bool], tuple[int, Any]] = {}  # function and kind -> its address, and what keeps it alive


class Seen(NamedTuple):
    """What a function of an effector reads (see femflex.system.effector)."""

    time: float
    position: Array
    attitude: Array
    velocity: Array
    rate: Array
    coordinate: Array
    speed: Array
    input: Array
    z: Array
    parameters: Array


class Given(NamedTuple):
    """What a function of an effector writes."""

    force: Array
    torque: Array
    effort: Array
    zdot: Array
    channel: Array
    energy: Array
    dissipation: Array
    supplied: Array
    mass_flow: Array


def seen_size(n_markers: int, n_freedoms: int, n_inputs: int) -> int:
    """Numbers of Seen that are laid out together: all but time, z and parameters."""
    return 18 * n_markers + 2 * n_freedoms + n_inputs


def given_size(n_markers: int, n_freedoms: int, n_z: int, n_channels: int) -> int:
    """Numbers of Given."""
    return 6 * n_markers + n_freedoms + n_z + n_channels + N_ACCOUNTS


if _numba.config.DISABLE_JIT:

    def array_of(numbers: Array, n: int) -> Array:
        """The first n numbers behind a pointer."""
        return numbers[:n]

else:

    @_numba.njit
    def array_of(numbers: Array, n: int) -> Array:
        """The first n numbers behind a pointer."""
        return _numba.carray(numbers, (n,))


@_numba.njit
def seen_of(t: float, sizes: Any, seen: Any, z: Any, parameters: Any) -> Seen:
    """What is seen, as arrays."""
    m, f, n = sizes[0], sizes[1], sizes[2]
    a = array_of(seen, 18 * m + 2 * f + n)
    return Seen(
        t,
        a[: 3 * m].reshape((m, 3)),
        a[3 * m : 12 * m].reshape((m, 3, 3)),
        a[12 * m : 15 * m].reshape((m, 3)),
        a[15 * m : 18 * m].reshape((m, 3)),
        a[18 * m : 18 * m + f],
        a[18 * m + f : 18 * m + 2 * f],
        a[18 * m + 2 * f : 18 * m + 2 * f + n],
        array_of(z, sizes[3]),
        array_of(parameters, sizes[4]),
    )


@_numba.njit
def given_of(sizes: Any, out: Any) -> Given:
    """What is written, as arrays."""
    m, f, n, c = sizes[0], sizes[1], sizes[3], sizes[5]
    b = array_of(out, 6 * m + f + n + c + 4)
    e = 6 * m + f + n + c
    return Given(
        b[: 3 * m].reshape((m, 3)),
        b[3 * m : 6 * m].reshape((m, 3)),
        b[6 * m : 6 * m + f],
        b[6 * m + f : 6 * m + f + n],
        b[6 * m + f + n : e],
        b[e : e + 1],
        b[e + 1 : e + 2],
        b[e + 2 : e + 3],
        b[e + 3 : e + 4],
    )


@_numba.njit
def matrix_of(sizes: Any, out: Any) -> Array:
    """The matrix that a Jacobian writes."""
    return array_of(out, sizes[3] * sizes[3]).reshape((sizes[3], sizes[3]))


def act_address(name: str, function: Callable[..., Any], jacobian: bool = False) -> int:
    """Where compiled code calls the function of effector `name`, or its Jacobian.

    Raises ValueError where Numba cannot compile it.
    """
    key = (function, jacobian)
    if key not in _KNOWN:
        try:
            _KNOWN[key] = _made(function, jacobian)
        except numba.core.errors.NumbaError as error:
            what = "(seen, J) and writes into J" if jacobian else "(seen, out) and writes into the arrays of out"
            raise ValueError(
                f"the function of effector {name!r} cannot be compiled: {first_line(error)}. It takes {what}; use what "
                "Numba compiles, or a Controller, which calls any Python function at given instants"
            ) from error
    return _KNOWN[key][0]


def _made(function: Callable[..., Any], jacobian: bool) -> tuple[int, Any]:
    inner = function if hasattr(function, "py_func") else _numba.njit(function)
    view = matrix_of if jacobian else given_of

    def called(t: float, sizes: Any, seen: Any, z: Any, parameters: Any, out: Any) -> None:
        inner(seen_of(t, sizes, seen, z, parameters), view(sizes, out))

    if _numba.config.DISABLE_JIT:
        return known(called), called
    made = _numba.cfunc(ACT)(called)
    return int(made.address), made


def first_line(error: Exception) -> str:
    """The line of a compiler's message that says most."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return next((line for line in lines if not line.startswith("Failed in")), lines[0] if lines else "no reason given")
