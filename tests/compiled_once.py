"""Modules and kernels that are not on disk yet, compiled by several processes, each by one of them."""

from __future__ import annotations

import compileall
import importlib
import multiprocessing
import os
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "femflex"
LONGEST = "femflex.dynamics.constraints.residual"  # begun first, so that no process waits for it at the end


def kernel_modules() -> list[str]:
    """Names of the modules of femflex that define kernels."""
    files = [path for path in PACKAGE.rglob("*.py") if "\n@kernel" in path.read_text(encoding="utf-8")]
    names = [".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts) for path in sorted(files)]
    return sorted(names, key=lambda name: name != LONGEST)


def compile_kernels(processes: int | str) -> None:
    """Import every module with kernels once in one of so many processes, which leaves its kernels on disk.

    The modules themselves are compiled first, for tests begin many processes, and not every machine lets these write.
    """
    processes = processes if isinstance(processes, int) else os.cpu_count() or 1  # "auto" and "logical"
    compileall.compile_dir(PACKAGE, quiet=2, workers=processes)
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        for _ in pool.imap_unordered(imported, kernel_modules(), chunksize=1):
            pass


def imported(name: str) -> str:
    """Import a module; its name."""
    importlib.import_module(name)
    return name
