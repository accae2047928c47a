"""The command line: verbs that parse and print; nothing heavy is imported before one runs."""

from __future__ import annotations

import sys
from typing import NoReturn

from femflex.cli.interrupt import INTERRUPTED, answer_at_once, leave


def main() -> NoReturn:
    """Run the command line and leave the process.

    Exit codes: 0 done, 1 a fault of femflex itself, 2 bad input, 3 the numerics failed, 130 interrupted.
    """
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
