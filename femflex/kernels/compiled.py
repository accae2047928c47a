"""Decorators of compiled kernels and their parts: linked and stored on disk, or plain Numba where that is not possible.

Importing a module compiles nothing. A kernel is compiled, or read from disk, when it is first called, or first passed
to another kernel. Division follows IEEE rules (no Python exceptions inside). The compiler may reorder and fuse sums,
which it does the same way every time: results repeat bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

from femflex.kernels.numba_interfaces import plain

__all__ = ["FAST", "compile_ahead", "inner", "kernel", "part_options", "plain", "stored"]

_config: Any = numba.config
_njit: Any = numba.njit  # numba's own annotations do not cover all of it

FAST = {"contract", "arcp", "nsz", "reassoc"}  # everything that keeps NaN and infinity honest


def stored(signature: Any, loop: bool = False, **options: Any) -> Callable[[Any], Any]:
    """Decorator like `numba.njit` of one signature, with the machine code read from disk or written there.

    loop  whether it is the loop of an integrator, whose parts stay functions (see `linking`)

    With the compiler off the plain function is returned. Where Numba's inner interfaces are not the expected ones
    (`numba_interfaces`) the function is compiled in every process.
    """
    if plain():
        decorator: Callable[[Any], Any] = _njit(signature, **options)
        return decorator
    from femflex.kernels.cache import cached_kernel
    from femflex.kernels.linking import KernelCompiler, LoopCompiler

    return cached_kernel(signature, pipeline_class=LoopCompiler if loop else KernelCompiler, **options)


def compile_ahead(*kernels: Any) -> None:
    """Start a second process that compiles those of the kernels that are not on disk.

    The first call of one of them waits until it is on disk.
    """
    if not (plain() or _config.DISABLE_JIT):
        from femflex.kernels.cache import compile_ahead as begin

        begin(kernels)


def part_options() -> dict[str, Any]:
    """Options of `numba.njit` for functions that only other compiled functions call."""
    options: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    if not plain():
        from femflex.kernels.linking import PartCompiler

        options["pipeline_class"] = PartCompiler
    return options


inner = _njit(fastmath=FAST, error_model="numpy", **part_options())  # a part: only compiled code calls it


def kernel(signature: Any) -> Any:
    """Decorator of a kernel: compiled for this one signature and stored on disk; free of the interpreter's lock."""
    return stored(signature, error_model="numpy", nogil=True)
