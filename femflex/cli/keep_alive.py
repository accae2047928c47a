"""A progress bar that beats on while one long step gives it nothing to show."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock, Thread

BEAT = 0.5  # seconds


@contextmanager
def keep_alive(bar: Callable[[float], None]) -> Iterator[Callable[[float], None]]:
    """A function that reports progress to the bar, which repeats its last value at every beat."""
    reached, lock, over = [0.0], Lock(), Event()

    def tell(now: float) -> None:
        with lock:
            reached[0] = now
            bar(now)

    def beat() -> None:
        while not over.wait(BEAT):
            with lock:
                bar(reached[0])

    thread = Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield tell
    finally:
        over.set()
        thread.join()
