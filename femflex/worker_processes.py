"""Processes that work side by side, each with the modules that it needs already loaded."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
from multiprocessing.connection import wait
from multiprocessing.context import BaseContext
from threading import Thread

SERVER = "forkserver"  # copies one process that has the modules; a copy of this one could hold locks of its threads


def started(modules: list[str]) -> BaseContext:
    """How worker processes are started, which have these modules loaded.

    Where the system can copy a process, one that loads them is begun now, and every worker is a copy of it; elsewhere
    each worker loads them itself. Called early, the loading takes place while the caller does other things.
    """
    if SERVER not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    from multiprocessing import forkserver

    context = multiprocessing.get_context(SERVER)
    context.set_forkserver_preload(modules)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])  # Ctrl-C is the caller's; workers end with it
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    return context


def end() -> None:
    """End the process that workers are copies of: loading its modules, it would hold pipes of this one open."""
    forkserver = sys.modules.get("multiprocessing.forkserver")
    pid = getattr(getattr(forkserver, "_forkserver", None), "_forkserver_pid", None)
    if pid is not None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def end_with_parent() -> None:
    """Let this worker process end when the one that began it has, however that ended."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        Thread(target=_end_after, args=(parent.sentinel,), daemon=True).start()


def _end_after(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
