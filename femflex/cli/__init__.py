"""The command line: verbs that parse and print; nothing heavy is imported before one runs."""

from __future__ import annotations

import os
import sys
from typing import NoReturn

INTERRUPTED = 130


def main() -> NoReturn:
    """Run the command line and leave the process.

    Exit codes: 0 done, 1 a fault of femflex itself, 2 bad input, 3 the numerics failed, 130 interrupted.
    """
    try:
        from femflex.cli.app import app

        app()
    except KeyboardInterrupt:
        _leave_at_once()
    except SystemExit as end:
        if end.code == INTERRUPTED:
            _leave_at_once()
        raise
    sys.exit(0)


def _leave_at_once() -> NoReturn:
    """Leave without the tenth of a second that unloading compiled code takes; files are closed already."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(INTERRUPTED)
