"""What an interrupt (Ctrl-C) must not lose."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_held: list[str] = []  # what has been begun and is worth ending well


def has_work_to_finish() -> bool:
    """Whether something has been begun that an interrupt should end well instead of dropping."""
    return bool(_held)


@contextmanager
def finished_on_interrupt(what: str) -> Iterator[None]:
    """Work that an interrupt ends with what there is of it, such as the frames of a movie."""
    _held.append(what)
    try:
        yield
    finally:
        _held.remove(what)


@contextmanager
def without_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back until what is inside is done."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pending: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: pending.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pending:
        raise KeyboardInterrupt
