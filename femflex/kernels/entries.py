"""Compiled functions that others call by their address: one caller serves all of them, and is compiled once.

`@entry(signature)` keeps a function on disk like a kernel, but compiles it only when its address is first needed.
`caller(signature)` is how other compiled code calls whatever stands at an address: the first argument is the address,
which models keep in their tables. Arguments are numbers, integers and pointers. With the compiler off an address is a
number under which the plain function is known, and pointers are arrays.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from typing import Any

import numba
import numba.core.typing.templates
import numpy as np

from femflex.arrays import Array
from femflex.kernels.compiled import plain, stored
from femflex.kernels.symbols import extending, ir, types

templates: Any = numba.core.typing.templates
_numba: Any = numba  # its annotations do not cover what is used here

NUMBERS, INTEGERS = types.CPointer(types.float64), types.CPointer(types.int64)  # pointers to the first of some
REAL, INTEGER, VOID = types.float64, types.int64, types.void
VECTOR, MATRIX = types.float64[::1], types.float64[:, ::1]
ARRAYS, POINTERS = (types.int64[::1], VECTOR, VECTOR), (INTEGERS, NUMBERS, NUMBERS)  # table, pool and work of a model

USER = VOID(REAL, NUMBERS, NUMBERS, NUMBERS)  # of functions that users hand over: t, and three arrays
ACT = VOID(REAL, NUMBERS, NUMBERS, NUMBERS, NUMBERS)  # of effectors: t, what is seen, states, parameters, what is given
LAW_FUNCTION = VOID(REAL, REAL, NUMBERS, NUMBERS)  # of laws of joints: coordinate, rate, parameters, what is given

_PLAIN: dict[int, Callable[..., Any]] = {}  # by address, with the compiler off


class Entry:
    """A function of one fixed signature that is called by its address.

    writes_all: whether it writes all its results, so that these are not set to zero beforehand.
    """

    def __init__(self, function: Callable[..., Any], signature: Any, writes_all: bool = False) -> None:
        self.function, self.signature, self.writes_all = function, signature, writes_all
        self.__name__ = function.__name__
        self._compiled: Any = None  # the compiled function, alive as long as its address is used

    def __reduce__(self) -> tuple[Any, ...]:
        """An entry is the one that its module has under the function's name, also in another process."""
        return _entry_named, (self.function.__module__, self.function.__qualname__)

    @cached_property
    def address(self) -> int:
        """Return its address in this process; it is compiled, or read from disk, at the first request."""
        if _numba.config.DISABLE_JIT:
            return plain_address(self.function)
        if plain():
            self._compiled = _numba.cfunc(self.signature, error_model="numpy")(self.function)
            return int(self._compiled.address)
        self._compiled = compiled = stored(self.signature, error_model="numpy", no_cpython_wrapper=True)(self.function)
        result = compiled.get_compile_result(self.signature)
        return int(result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name))


def _entry_named(module: str, name: str) -> Entry:
    named: Entry = getattr(import_module(module), name)
    return named


def entry(signature: Any) -> Callable[[Callable[..., Any]], Entry]:
    """Decorator of a function that is called by its address."""
    return lambda function: Entry(function, signature)


def plain_address(function: Callable[..., Any]) -> int:
    """An address for a plain function, for code that runs with the compiler off."""
    address = 1 + len(_PLAIN)
    _PLAIN[address] = function
    return address


def caller(signature: Any) -> Callable[..., Any]:
    """Return the compiled function (address, *arguments) that calls the function at the address."""

    def call(address: int, *arguments: Any) -> Any:
        return _PLAIN[int(address)](*arguments)

    names = ["address", *(f"a{k}" for k in range(len(signature.args)))]
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD

    @extending.type_callable(call)
    def typer(context: Any) -> Any:
        def typed(*_: Any) -> Any:
            return templates.signature(signature.return_type, types.int64, *signature.args)

        typed.__signature__ = inspect.Signature([inspect.Parameter(name, kind) for name in names])  # type: ignore[attr-defined]
        return typed

    @extending.lower_builtin(call, types.VarArg(types.Any))
    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        argument_types = [context.get_value_type(argument) for argument in signature.args]
        function = ir.FunctionType(context.get_value_type(signature.return_type), argument_types)
        result = builder.call(builder.inttoptr(args[0], function.as_pointer()), args[1:])
        return context.get_dummy_value() if signature.return_type == types.void else result

    return call


call_user = caller(USER)


def first_line(error: Exception) -> str:
    """Return the most telling line of a compiler's message."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return next((line for line in lines if not line.startswith("Failed in")), lines[0] if lines else "no reason given")


def plain_array(numbers: Array, shape: tuple[int, ...]) -> Array:
    """The first numbers as an array of that shape, as `numba.carray` gives them."""
    return numbers[: int(np.prod(shape))].reshape(shape)
