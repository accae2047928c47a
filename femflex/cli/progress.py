"""Progress on standard error: shown after two seconds, with the time left; silent if that is no terminal."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from threading import Event, Lock, Thread
from types import TracebackType
from typing import Any, Self, TypeVar

from femflex.cli.verb import print_warnings

PATIENCE = 2.0  # seconds
BEAT = 0.5  # seconds


def on_terminal() -> bool:
    """Whether standard error is a terminal."""
    return sys.stderr.isatty()


class Bar:
    """A progress bar over a range, such as simulated time in s, drawn only when the work takes long."""

    def __init__(self, text: str, end: float = 1.0, start: float = 0.0, unit: str = "s") -> None:
        self._text, self._end, self._first, self._unit = text, end, start, unit
        self._began = time.perf_counter()
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Self:
        print_warnings()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, position: float, end: float | None = None) -> None:
        """Report the position, and the end if it was not known before."""
        self._end = self._end if end is None else end
        if self._bar is None:
            if time.perf_counter() - self._began < PATIENCE or not on_terminal():
                return
            self._start_bar()
        text = f"{position:.6g} of {self._end:.6g} {self._unit}"
        self._bar.update(self._task, completed=position - self._first, total=self._end - self._first, text=text)

    def _start_bar(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (TextColumn(self._text), BarColumn(), TextColumn("{task.fields[text]}"), TimeRemainingColumn())
        self._bar = Progress(*columns, console=Console(stderr=True, force_terminal=True), transient=True)
        self._task = self._bar.add_task(self._text, total=self._end - self._first, text="")
        self._bar.start()


class Patience:
    """Prints the present task if it takes longer than two seconds; the text may change meanwhile."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._timer = threading.Timer(PATIENCE, self._print_text)
        self._timer.daemon = True
        self._printed = ""

    def __enter__(self) -> Self:
        if on_terminal():
            self._timer.start()
        return self

    def __call__(self, text: str) -> None:
        """Set the text of the present task."""
        self.text = text
        if self._printed and self._printed != text:
            self._print_text()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._timer.cancel()
        print_warnings()

    def _print_text(self) -> None:
        self._printed = self.text
        print(f"{self.text} ...", file=sys.stderr, flush=True)


T = TypeVar("T")


def until_interrupt(items: Iterator[T], work: str, *errors: type[Exception]) -> tuple[list[T], BaseException | None]:
    """The items until Ctrl-C or one of these errors breaks them off, and the error if there was one.

    work: what an interrupt finishes from the first item on, such as "a study"
    """
    from femflex.results.interrupts import finished_on_interrupt

    done: list[T] = []
    endings: tuple[type[BaseException], ...] = (KeyboardInterrupt, *errors)
    with ExitStack() as keeping:
        try:
            for item in items:
                if not done:
                    keeping.enter_context(finished_on_interrupt(work))
                done.append(item)
        except endings as error:
            return done, error
    return done, None


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
