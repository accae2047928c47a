"""Processes that work side by side, each with the modules that it needs already loaded."""

from __future__ import annotations

import multiprocessing
from multiprocessing.context import BaseContext

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
    forkserver.ensure_running()
    return context
