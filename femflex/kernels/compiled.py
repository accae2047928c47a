"""Decorators of compiled kernels and their parts: linked and stored on disk, or plain Numba where that is not possible.

Importing a module compiles nothing. A kernel is compiled, or read from disk, when it is first called, or first passed
to another kernel. Division follows IEEE rules (no Python exceptions inside). The compiler may reorder and fuse sums,
which it does the same way every time: results repeat bit for bit.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable
from functools import cache
from typing import Any

import numba

__all__ = ["FAST", "compile_ahead", "inner", "kernel", "part_options", "plain", "stored"]

_config: Any = numba.config
_njit: Any = numba.njit  # numba's own annotations do not cover all of it

FAST = {"contract", "arcp", "nsz", "reassoc"}  # everything that keeps NaN and infinity honest
NEEDED = {  # module -> attribute, and the members that it must have
    "numba.core.codegen": (
        (
            "JITCodeLibrary",
            (
                "_optimize_final_module",
                "_optimize_functions",
                "add_llvm_module",
                "finalize",
                "enable_object_caching",
                "get_pointer_to_function",
            ),
        ),
    ),
    "numba.core.compiler": (
        ("Compiler", ("define_pipelines",)),
        ("CompileResult", ("_reduce", "_rebuild")),
    ),
    "numba.core.caching": (("_Cache", ("load_overload", "save_overload")),),
    "numba.core.serialize": (("dumps", ()),),
    "numba.core.dispatcher": (
        (
            "Dispatcher",
            ("enable_caching", "disable_compile", "_compile_for_args", "get_call_template", "get_compile_result"),
        ),
    ),
}


# Check that Numba's internal interfaces are those by which femflex compiles and stores its kernels.
#
# femflex links the parts of a kernel into one piece and stores its machine code (`linking`, `cache`). Both use
# classes of Numba that may change without notice. Where these are not the expected ones, every kernel is compiled by
# plain `numba.njit`: the numbers are the same to rounding, but every process compiles anew and takes more time. The
# environment variable FEMFLEX_PLAIN_NUMBA=1 selects plain Numba.


@cache
def missing_interface() -> str:
    """The first of Numba's internal interfaces that is absent; the variable's name where it is set; "" for none."""
    if os.environ.get("FEMFLEX_PLAIN_NUMBA", "0") not in ("", "0"):
        return "FEMFLEX_PLAIN_NUMBA"
    for module, classes in NEEDED.items():
        try:
            numba_module: Any = importlib.import_module(module)
        except ImportError:
            return module
        for name, attributes in classes:
            if not hasattr(numba_module, name):
                return f"{module}.{name}"
            for attribute in attributes:
                if not hasattr(getattr(numba_module, name), attribute):
                    return f"{module}.{name}.{attribute}"
    return ""


def plain() -> bool:
    """Whether kernels are compiled by plain `numba.njit`."""
    return bool(missing_interface())


def stored(signature: Any, loop: bool = False, **options: Any) -> Callable[[Any], Any]:
    """Decorator like `numba.njit` of one signature, with the machine code read from disk or written there.

    loop  whether it is the loop of an integrator, whose parts stay functions (see `linking`)

    With the compiler off the plain function is returned. Where Numba's inner interfaces are not the expected ones the
    function is compiled in every process.
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
