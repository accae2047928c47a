"""A process that has compiled kernels begins again with those it has put on disk.

What a compiler makes of a kernel in the process that compiles it rounds differently in the last digit from what later
processes load: parts shared by several kernels are bound to other copies there. A resumed run would not be that of an
uninterrupted one, bit for bit.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from femflex.cli import interrupt

if TYPE_CHECKING:
    from femflex.pipeline import Prepared

AGAIN = "FEMFLEX_BEGAN_AGAIN"


@contextmanager
def compilation_seen() -> Iterator[Callable[[], bool]]:
    """Whether a kernel that is kept on disk has been compiled inside, and not loaded."""
    from numba.core import event

    recorded: Any = event.install_recorder("numba:compile")
    with recorded as recorder:
        yield lambda: any(_kept(found.data.get("dispatcher")) for _, found in recorder.buffer)


def _kept(dispatcher: Any) -> bool:
    return hasattr(getattr(dispatcher, "_cache", None), "cache_path")


@contextmanager
def warnings_told_after() -> Iterator[None]:
    """Keep warnings back until what is inside is done, so that a process that begins again tells them once."""
    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            yield
    finally:
        for found in caught:
            warnings.showwarning(found.message, found.category, found.filename, found.lineno)


def load_kernels(prepared: Prepared) -> None:
    """Have everything compiled that the run will call."""
    prepared.model.observe(prepared.times[:1], prepared.model.x0[None])
    getattr(prepared.integrator, "filler", lambda model: None)(prepared.model)


def begin_again() -> None:
    """Replace this process by a new one of the same command, once; do nothing where it is not ours to replace."""
    if not interrupt.answering() or os.name != "posix" or AGAIN in os.environ:
        return
    sys.stdout.flush()
    sys.stderr.flush()
    os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], {**os.environ, AGAIN: "1"})
