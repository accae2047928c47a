"""Functions of effectors as compiled code calls them: `act(seen, out)` behind a fixed signature of pointers.

ACT  act(t, seen, z, parameters, out)
     seen and out hold numbers one after another in the order of the fields of Seen and of Given; for a Jacobian, out
     is J (n_z, n_z)

A function is compiled once in a process for the sizes of its arrays, which are constants then: what it does not use is
gone, and a call costs some nanoseconds. What is compiled stays alive with the function.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numba.core.errors
import numpy as np

from femflex.arrays import Array
from femflex.kernels.entries import ACT, Entry, first_line, plain_address, plain_array
from femflex.kernels.lanes import offset
from femflex.system import Effector

Sizes = tuple[int, int, int, int, int, int]  # markers, freedoms, inputs, states, parameters, channels
N_ACCOUNTS = 4

_numba: Any = numba  # its annotations do not cover what is used here
# function, sizes and kind -> its address, and what keeps it alive
_COMPILED: dict[tuple[Any, Sizes, bool], tuple[int, Any]] = {}


class EffectorInput(NamedTuple):
    """Arguments that a function of an effector reads (see femflex.system.effector)."""

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


class EffectorOutput(NamedTuple):
    """Results that a function of an effector writes."""

    force: Array
    torque: Array
    effort: Array
    zdot: Array
    channel: Array
    energy: Array
    dissipation: Array
    supplied: Array
    mass_flow: Array


def input_size(n_markers: int, n_freedoms: int, n_inputs: int) -> int:
    """Numbers of Seen that are laid out together: all but time, z and parameters."""
    return 18 * n_markers + 2 * n_freedoms + n_inputs


def output_size(n_markers: int, n_freedoms: int, n_z: int, n_channels: int) -> int:
    """Numbers of Given."""
    return 6 * n_markers + n_freedoms + n_z + n_channels + N_ACCOUNTS


def act_address(name: str, function: Any, sizes: Sizes, jacobian: bool = False) -> int:
    """Return the address of the function of effector `name`, or of its Jacobian, for compiled code.

    Raises ValueError where Numba cannot compile it.
    """
    if isinstance(function, Entry):
        return function.address
    key = (function, sizes, jacobian)
    if key not in _COMPILED:
        try:
            _COMPILED[key] = _compiled(function, sizes, jacobian)
        except numba.core.errors.NumbaError as error:
            what = "(seen, J) and writes into J" if jacobian else "(seen, out) and writes into the arrays of out"
            raise ValueError(
                f"the function of effector {name!r} cannot be compiled: {first_line(error)}. It takes {what}; use what "
                "Numba compiles, or a Controller, which calls any Python function at given instants"
            ) from error
    return _COMPILED[key][0]


def _compiled(function: Callable[..., Any], sizes: Sizes, jacobian: bool) -> tuple[int, Any]:
    interpreted = bool(_numba.config.DISABLE_JIT)
    inner = function if interpreted or hasattr(function, "py_func") else _numba.njit(error_model="numpy")(function)
    callable_ = (_jacobian if jacobian else _act)(inner, sizes, plain_array if interpreted else _numba.carray)
    callable_ = guarded(callable_, sizes[3] ** 2 if jacobian else output_size(*sizes[:2], sizes[3], sizes[5]))
    if interpreted:
        return plain_address(callable_), callable_
    compiled = _numba.cfunc(ACT)(callable_)
    return int(compiled.address), compiled


def guarded(function: Callable[..., None], n: int) -> Callable[..., None]:
    """The function of a number and arrays or pointers, whose last one, the output of n numbers, is NaN if it raises.

    Compiled callers cannot catch an exception: the integrator stops at NaN, and `user_function_fault` names the cause.
    """
    interpreted, nan = bool(_numba.config.DISABLE_JIT), np.nan
    compiled = function if interpreted else _numba.njit(error_model="numpy")(function)
    array = plain_array if interpreted else _numba.carray

    def called(t: float, seen: Any, z: Any, parameters: Any, out: Any) -> None:
        try:
            compiled(t, seen, z, parameters, out)
        except Exception:
            array(out, (n,))[:] = nan

    return called


def plain_call(function: Callable[..., Any], sizes: Sizes, jacobian: bool = False) -> Callable[..., None]:
    """Return the function of an effector, or its Jacobian, as plain Python over arrays. It raises the exceptions of the
    user's code, and IndexError outside the arrays.
    """
    return (_jacobian if jacobian else _act)(getattr(function, "py_func", function), sizes, plain_array)


def call_sizes(effector: Effector) -> Sizes:
    """Return the lengths of the arrays that an effector's function reads and writes."""
    counted = (effector.markers, effector.freedoms, effector.inputs, effector.states, effector.parameters)
    return *map(len, counted), len(effector.channels)  # type: ignore[return-value]


def _input_maker(sizes: Sizes, array: Any) -> Any:
    """Return the function that makes an `EffectorInput` of the model's numbers, compiled where arrays are addresses."""
    m, f, n, n_z, n_p, _ = sizes

    def make_input(t: float, seen: Any, z: Any, parameters: Any) -> EffectorInput:
        return EffectorInput(
            t,
            array(seen, (m, 3)),
            array(offset(seen, 3 * m), (m, 3, 3)),
            array(offset(seen, 12 * m), (m, 3)),
            array(offset(seen, 15 * m), (m, 3)),
            array(offset(seen, 18 * m), (f,)),
            array(offset(seen, 18 * m + f), (f,)),
            array(offset(seen, 18 * m + 2 * f), (n,)),
            array(z, (n_z,)),
            array(parameters, (n_p,)),
        )

    return make_input if array is plain_array else _numba.njit(make_input)


def _act(inner: Any, sizes: Sizes, array: Any) -> Callable[..., None]:
    """Return the function of signature ACT that passes arrays to an effector's function."""
    m, f, _, n_z, _, c = sizes
    make_input = _input_maker(sizes, array)
    effort, accounts = 6 * m, 6 * m + f + n_z + c

    def called(t: float, seen: Any, z: Any, parameters: Any, out: Any) -> None:
        inner(
            make_input(t, seen, z, parameters),
            EffectorOutput(
                array(out, (m, 3)),
                array(offset(out, 3 * m), (m, 3)),
                array(offset(out, effort), (f,)),
                array(offset(out, effort + f), (n_z,)),
                array(offset(out, effort + f + n_z), (c,)),
                array(offset(out, accounts), (1,)),
                array(offset(out, accounts + 1), (1,)),
                array(offset(out, accounts + 2), (1,)),
                array(offset(out, accounts + 3), (1,)),
            ),
        )

    return called


def _jacobian(inner: Any, sizes: Sizes, array: Any) -> Callable[..., None]:
    """Return the function of signature ACT that passes arrays to an effector's Jacobian."""
    n_z = sizes[3]
    make_input = _input_maker(sizes, array)

    def called(t: float, seen: Any, z: Any, parameters: Any, out: Any) -> None:
        inner(make_input(t, seen, z, parameters), array(out, (n_z, n_z)))

    return called
