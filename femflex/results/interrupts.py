"""Interrupts (Ctrl-C): work that is finished first, and blocks that are not interrupted."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_unfinished: list[str] = []  # work in progress that an interrupt finishes instead of dropping


def has_work_to_finish() -> bool:
    """Whether work is in progress that an interrupt should finish instead of dropping."""
    return bool(_unfinished)


@contextmanager
def finished_on_interrupt(work: str) -> Iterator[None]:
    """Context of work that an interrupt ends with the part that is done, such as the first frames of a movie."""
    _unfinished.append(work)
    try:
        yield
    finally:
        _unfinished.remove(work)


@contextmanager
def without_interrupts() -> Iterator[None]:
    """Context that delays Ctrl-C until its end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pending: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: pending.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
    if pending:
        if callable(handler):  # which may have to know of an interrupt that it did not see
            handler(signal.SIGINT, None)
        raise KeyboardInterrupt
