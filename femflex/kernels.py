"""Decorators of compiled kernels and their parts: linked and kept on disk, or by plain Numba where that cannot be."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

from femflex.numba_interfaces import plain

__all__ = ["part_options", "plain", "stored"]

_njit: Any = numba.njit  # numba's own annotations do not cover all of it


def stored(signature: Any, **options: Any) -> Callable[[Any], Any]:
    """Decorator like `numba.njit` of one signature, with the machine code read from disk or written there.

    With the compiler off the plain function is returned. Where Numba's inner interfaces are not the expected ones
    (`numba_interfaces`) the function is compiled in every process.
    """
    if plain():
        made: Callable[[Any], Any] = _njit(signature, **options)
        return made
    from femflex.kernel_cache import kept
    from femflex.kernel_linking import KernelCompiler

    return kept(signature, pipeline_class=KernelCompiler, **options)


def part_options() -> dict[str, Any]:
    """Options of `numba.njit` for functions that only other compiled functions call."""
    options: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    if not plain():
        from femflex.kernel_linking import PartCompiler

        options["pipeline_class"] = PartCompiler
    return options
