"""Modules and kernels that are not on disk yet, compiled on all processors before the tests begin."""

from __future__ import annotations

import compileall
import contextlib
import importlib
import multiprocessing
import os
from pathlib import Path
from typing import Any

from femflex.kernels import cache, linking
from femflex.kernels.cache import is_pending

PACKAGE = Path(__file__).resolve().parents[2] / "femflex"


def kernel_modules() -> list[str]:
    """Names of the modules of femflex that define kernels."""
    files = [path for path in PACKAGE.rglob("*.py") if "\n@kernel" in path.read_text(encoding="utf-8")]
    return [".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts) for path in sorted(files)]


def compile_kernels(processes: int | str) -> None:
    """Leave every kernel on disk, compiled on so many processors.

    The modules themselves are compiled first, for tests begin many processes, and not every machine lets these write.
    """
    processes = processes if isinstance(processes, int) else os.cpu_count() or 1  # "auto" and "logical"
    compileall.compile_dir(PACKAGE, quiet=2, workers=processes)
    alone = multiprocessing.get_context("spawn").Process(target=import_kernels, args=(processes,))
    alone.start()
    alone.join()
    if alone.exitcode:
        raise RuntimeError("the kernels cannot be compiled; import femflex.dynamics to see why")


def import_kernels(processes: int) -> None:
    """Compile every kernel that is not on disk.

    Kernels share their parts: this process translates each part once, and copies of it make machine code of the
    kernels, so many at a time. Several processes that compiled whole kernels would each translate the parts.
    """
    if hasattr(os, "fork"):
        _emit_in_copies(processes)
    for name in kernel_modules():
        for kernel in vars(importlib.import_module(name)).values():
            if is_pending(kernel):
                with contextlib.suppress(_Elsewhere):
                    kernel.get_compile_result(kernel.declared)
    while _copies:
        _wait_for_one()


class _Elsewhere(Exception):  # not an error: a copy of this process goes on with the kernel
    pass


_copies: set[int] = set()


def _wait_for_one() -> None:
    process, status = os.wait()
    _copies.discard(process)
    if status:
        raise RuntimeError(f"a kernel could not be compiled; status {status}")


def _emit_in_copies(processes: int) -> None:
    """Let kernels be optimised, emitted and kept by copies of this process, which end with that."""
    library: Any = linking._KernelLibrary
    storage: Any = cache.KernelCache
    emit, store = library.finalize, storage.save_overload

    def emit_elsewhere(self: Any) -> None:
        while len(_copies) >= processes:
            _wait_for_one()
        copy = os.fork()
        if copy:
            _copies.add(copy)
            raise _Elsewhere
        emit(self)

    def store_and_end(self: Any, signature: Any, data: Any) -> None:
        store(self, signature, data)
        os._exit(0)

    library.finalize, storage.save_overload = emit_elsewhere, store_and_end
