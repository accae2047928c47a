"""Digest of everything that a compiled kernel depends on.

Numba looks only at the file of the function it has cached, not at the files of what that function calls. Here the key
of a stored kernel holds the sources that it can be compiled from: its own file and all that this file imports,
directly or through others. It also holds the versions of the compilers, and the processor. The layout of the tables
that kernels read is part of those sources.
"""

from __future__ import annotations

import hashlib
import inspect
import platform
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np

PACKAGE = Path(__file__).resolve().parents[1]
COMPILERS = [f"kernels/{name}.py" for name in ("compiled", "cache", "linking")]  # all need them
OPTIONS = (  # of Numba, from NUMBA_... variables, that change the code
    "BOUNDSCHECK",
    "DEBUGINFO_DEFAULT",
    "LOOP_VECTORIZE",
    "OPT",
    "SLP_VECTORIZE",
)
# imports at module level; those inside functions cannot reach compiled code, and those for types alone are indented
IMPORT = re.compile(r"^(?:from femflex([\w.]*) import (\([^)]*\)|[^\n]*)|import femflex([\w.]*))", re.MULTILINE)


def sources_of(file: Path) -> list[Path]:
    """The sources that a kernel in this file can be compiled from, sorted.

    A kernel defined outside femflex depends on all files in its own folder.
    """
    roots = [file] if file.is_relative_to(PACKAGE) else sorted(file.parent.glob("*.py"))
    sources, todo = set(), [*roots, *(PACKAGE / name for name in COMPILERS)]
    while todo:
        source = todo.pop()
        if source not in sources:
            sources.add(source)
            todo.extend(imported_files(source))
    return sorted(sources)


@cache
def imported_files(file: Path) -> tuple[Path, ...]:
    """Files of femflex that a file imports at module level."""
    names = set()
    for package, imported, module in IMPORT.findall(file.read_text(encoding="utf-8", errors="replace")):
        parts = re.sub(r"#[^\n]*", "", imported).strip("() \n").split(",")
        names |= {f"{package}.{part.split()[0]}" for part in parts if part.strip()} or {module}
    return tuple({path for name in names if (path := _file_of(name.strip("."))) is not None})


def _file_of(name: str) -> Path | None:
    """The file of a module, or of the module that defines a name; None for a name of the package itself."""
    path = PACKAGE.joinpath(*name.split("."))
    for module in (path, path.parent):
        for file in (module.with_suffix(".py"), module / "__init__.py"):
            if file.is_file() and module != PACKAGE:
                return file
    return None


def versions_digest() -> str:
    """Digest of the versions of what compiles the kernels, as the name of a folder."""
    versions = (numba.__version__, llvmlite.__version__, np.__version__, platform.python_implementation(), sys.version)
    return hashlib.sha256(repr(versions).encode()).hexdigest()[:32]


def kernel_digest(function: Any, signature: Any, target: tuple[Any, ...]) -> str:
    """Digest of one kernel: function, sources, signature, and the target (triple, processor, its features)."""
    file = Path(inspect.getfile(function)).resolve()
    inside = file.is_relative_to(PACKAGE)
    location = function.__module__ if inside else (str(file), function.__code__.co_firstlineno)
    options = [(name, str(getattr(numba.config, name, None))) for name in OPTIONS]
    identity = (location, function.__qualname__, _digest_of_sources(file), str(signature), target, options)
    return hashlib.sha256(repr(identity).encode()).hexdigest()[:32]


@cache
def _digest_of_sources(file: Path) -> str:
    digest = hashlib.sha256()
    for source in sources_of(file):
        name = source.relative_to(PACKAGE) if source.is_relative_to(PACKAGE) else source
        digest.update(f"{name} {_digest_of_file(source)}\n".encode())
    return digest.hexdigest()


@cache
def _digest_of_file(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()
