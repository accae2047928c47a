"""Check that Numba's internal interfaces are those by which femflex compiles and stores its kernels.

femflex links the parts of a kernel into one piece and stores its machine code (`linking`, `cache`). Both
use classes of Numba that may change without notice. Where these are not the expected ones, every kernel is compiled by
plain `numba.njit`: the numbers are the same to rounding, but every process compiles anew and takes more time. The
environment variable FEMFLEX_PLAIN_NUMBA=1 selects plain Numba.
"""

from __future__ import annotations

import importlib
import os
from functools import cache
from typing import Any

NEEDED = {  # module -> attribute, and the members that it must have
    "numba.core.codegen": (
        (
            "JITCodeLibrary",
            (
                "_optimize_final_module",
                "_finalize_final_module",
                "_finalize_dynamic_globals",
                "_verify_declare_only_symbols",
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
