"""The command line: verbs that parse and print; nothing heavy is imported before one runs."""

from __future__ import annotations

import gc
import os
import sys
from typing import NoReturn

LEAST_MEMORY = 500_000_000  # bytes of address space


def main() -> NoReturn:
    """Run the command line and leave the process.

    Exit codes: 0 done, 1 a fault of femflex itself, 2 bad input, 3 the numerics failed, 130 interrupted.
    """
    gc.set_threshold(50_000)  # importing and reading make few circles; looking for them took a tenth of the time
    _check_folder()
    _check_memory_limit()
    from femflex.cli.interrupt import INTERRUPTED, answer_at_once, leave  # after it: Python's own modules fail there

    answer_at_once()
    try:
        from femflex.cli.app import app

        app()
    except KeyboardInterrupt:
        leave()
    except SystemExit as end:
        if end.code == INTERRUPTED:
            leave()
        raise
    sys.exit(0)


def _check_folder() -> None:
    """Leave where the working folder has been removed, in which the libraries fail one after the other."""
    try:
        os.getcwd()
    except OSError:
        print("femflex: the working folder does not exist any more; change to one that does", file=sys.stderr)
        sys.exit(2)


def _check_memory_limit() -> None:
    """Leave under a limit of memory (ulimit -v) so low that the threads of libraries would wait for ever for theirs."""
    try:
        from resource import RLIM_INFINITY, RLIMIT_AS, getrlimit
    except ImportError:  # Windows
        return
    limit = getrlimit(RLIMIT_AS)[0]
    if limit != RLIM_INFINITY and limit < LEAST_MEMORY:
        print(
            f"femflex: the limit of memory (ulimit -v) is {limit / 1e6:.0f} MB, and the libraries alone take about "
            f"{LEAST_MEMORY / 1e6:.0f} MB; raise it to 1200 MB or more",
            file=sys.stderr,
        )
        sys.exit(3)
