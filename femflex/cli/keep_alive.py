"""A progress bar that keeps moving during one long step without progress of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock, Thread

BEAT = 0.5  # seconds


@contextmanager
def keep_alive(bar: Callable[[float], None]) -> Iterator[Callable[[float], None]]:
    """Yield a function that reports progress to the bar; the bar repeats its last value at every beat."""
    last_value, lock, finished = [0.0], Lock(), Event()

    def report(value: float) -> None:
        with lock:
            last_value[0] = value
            bar(value)

    def beat() -> None:
        while not finished.wait(BEAT):
            with lock:
                bar(last_value[0])

    thread = Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield report
    finally:
        finished.set()
        thread.join()
