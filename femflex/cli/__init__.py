"""The command line: verbs that parse and print; the physics is elsewhere. Nothing heavy is imported before a verb runs."""

from __future__ import annotations

import sys
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line and leave the process.

    Exit codes: 0 done, 1 a fault of femflex itself, 2 bad input, 3 the numerics failed, 130 interrupted.
    """
    try:
        from femflex.cli.app import app

        app()
    except KeyboardInterrupt:
        sys.exit(130)
    sys.exit(0)
