"""Worker processes that run at the same time, each with the modules that it needs already loaded."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
from multiprocessing.connection import wait
from multiprocessing.context import BaseContext
from threading import Thread

# A process of Python removes the semaphores of workers that an interrupt ended, and would warn of it.
QUIET_REMOVAL = "ignore:resource_tracker:UserWarning"
SERVER = "forkserver"  # copies one process that has the modules; a copy of this one could hold locks of its threads


def usable_cores() -> int:
    """Number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def worker_context(modules: list[str]) -> BaseContext:
    """The context that starts worker processes which have these modules loaded.

    Where the system can copy a process, a server process starts now and loads the modules, and every worker is a copy
    of it. Elsewhere each worker loads them itself. Call this early: the modules then load while the caller works.
    """
    if SERVER not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    from multiprocessing import forkserver, resource_tracker

    context = multiprocessing.get_context(SERVER)
    context.set_forkserver_preload(modules)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    sys.warnoptions.append(QUIET_REMOVAL)  # these processes get the options when they start
    try:
        resource_tracker.ensure_running()  # first, for it ends with SIGINT let through
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])  # Ctrl-C is the caller's; workers end with it
        forkserver.ensure_running()
    finally:
        sys.warnoptions.remove(QUIET_REMOVAL)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    return context


def end_worker_server() -> None:
    """End the process that workers are copies of: loading its modules, it would hold pipes of this one open."""
    forkserver = sys.modules.get("multiprocessing.forkserver")
    pid = getattr(getattr(forkserver, "_forkserver", None), "_forkserver_pid", None)
    if pid is not None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def end_with_parent() -> None:
    """End this worker process when its parent has ended, in whatever way."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        Thread(target=_end_after, args=(parent.sentinel,), daemon=True).start()


def _end_after(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
