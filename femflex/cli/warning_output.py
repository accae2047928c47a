"""Warnings and long compiling on standard error: each once, and those of one effect on several bodies as one line."""

from __future__ import annotations

import logging
import sys
import warnings
from typing import Any

from femflex.warning import CacheWarning, PhysicsWarning, grouped_texts


class WarningGroups:
    """Warnings that wait until the work in hand is done, so that those of one effect can be reported together."""

    def __init__(self) -> None:
        self._all: dict[str, Warning] = {}
        self._waiting: list[Warning] = []

    def add(self, message: Warning) -> None:
        """Take up a warning, unless its text was reported already."""
        if str(message) not in self._all:
            self._all[str(message)] = message
            self._waiting.append(message)

    @property
    def texts(self) -> list[str]:
        """One line for each effect, of all of them in the order in which they came."""
        return grouped_texts(self._all.values())

    def print_pending(self) -> None:
        """Print the waiting warnings."""
        waiting, self._waiting = self._waiting, []
        for line in grouped_texts(waiting):
            print(f"femflex: warning: {line}", file=sys.stderr)


GATHERED = WarningGroups()


def gather_warnings() -> None:
    """Gather the warnings of femflex from now on, and drop all others."""
    global GATHERED
    gathered = GATHERED = WarningGroups()

    def show(message: Warning | str, category: type[Warning], *_: Any) -> None:
        if issubclass(category, CacheWarning | PhysicsWarning):
            gathered.add(message if isinstance(message, Warning) else category(message))

    warnings.simplefilter("ignore")
    warnings.simplefilter("always", PhysicsWarning)
    warnings.simplefilter("always", CacheWarning)
    warnings.showwarning = show  # type: ignore[assignment]
    _print_log("femflex.kernels.cache")


class _Printed(logging.Handler):
    """Handler that prints what is logged on standard error."""

    def emit(self, record: logging.LogRecord) -> None:
        print(f"femflex: {record.getMessage()}", file=sys.stderr, flush=True)


def _print_log(name: str) -> None:
    """Print what a part of femflex says of work that takes long."""
    logger = logging.getLogger(name)
    logger.setLevel(logging.INFO)
    if not logger.handlers:
        logger.addHandler(_Printed())


def warnings_so_far() -> list[str]:
    """The warnings of this command so far, those of one effect on several bodies as one."""
    return GATHERED.texts


def print_warnings() -> None:
    """Print the warnings that wait."""
    GATHERED.print_pending()
