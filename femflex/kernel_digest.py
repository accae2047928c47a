"""Digest of everything that a compiled kernel depends on.

Numba looks only at the file of the function it has cached, not at the files of what that function calls. Here the key
of a stored kernel holds all sources that any kernel of femflex can be compiled from, the versions of the compilers, and
the processor. The layout of the tables that kernels read is part of those sources.
"""

from __future__ import annotations

import hashlib
import inspect
import platform
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np

PACKAGE = Path(__file__).resolve().parent
SOURCES = (  # closed under import: `tests/test_kernel_cache.py`
    "dynamics",
    "integrate",
    "system",
    "body",
    "reduction/strain/strain_kernel.py",
    "rotations.py",
    "summary.py",
    "warning.py",
    "kernel_cache.py",
    "kernel_digest.py",
    "kernel_linking.py",
    "kernels.py",
    "numba_interfaces.py",
)
OPTIONS = (  # of Numba, from NUMBA_... variables, that change the code
    "BOUNDSCHECK",
    "DEBUGINFO_DEFAULT",
    "LOOP_VECTORIZE",
    "OPT",
    "SLP_VECTORIZE",
)


def source_files() -> list[Path]:
    """Sources that the kernels of femflex are compiled from."""
    return [file for name in SOURCES for file in _python_files(PACKAGE / name)]


@cache
def sources_digest() -> str:
    """Digest of the kernel sources and of the versions of what compiles them, as the name of a folder."""
    versions = (numba.__version__, llvmlite.__version__, np.__version__, platform.python_implementation(), sys.version)
    return _digest(source_files(), versions)[:32]


def kernel_digest(function: Any, signature: Any, target: tuple[Any, ...]) -> str:
    """Digest of one kernel: function, signature, and the target (triple, processor, its features).

    A kernel defined outside femflex depends on the files in its own folder as well.
    """
    file = Path(inspect.getfile(function)).resolve()
    inside = file.is_relative_to(PACKAGE)
    place, own = (function.__module__, []) if inside else (str(file), sorted(file.parent.glob("*.py")))
    options = [(name, str(getattr(numba.config, name, None))) for name in OPTIONS]
    what = (place, function.__qualname__, function.__code__.co_firstlineno, str(signature), target, options)
    return _digest(own, what)[:32]


def _python_files(place: Path) -> list[Path]:
    return [place] if place.suffix == ".py" else sorted(place.rglob("*.py"))


def _digest(files: Iterable[Path], what: Any) -> str:
    found = hashlib.sha256(repr(what).encode())
    for file in files:
        content = file.read_bytes()
        found.update(f"{file.name} {len(content)}\n".encode())
        found.update(content)
    return found.hexdigest()
