"""Common parts of all verbs: exit codes, errors without traceback, short warnings."""

from __future__ import annotations

import dis
import errno
import functools
import logging
import os
import sys
import warnings
from collections.abc import Callable
from types import TracebackType
from typing import Any, TypeVar

import typer

from femflex.warning import CacheWarning, PhysicsWarning, grouped_texts

FAULT, BAD_INPUT, FAILED = 1, 2, 3
FULL = {errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG}  # the disk, not the user
NO_MEMORY = ("failed to map segment", "annot allocate memory", "can't start new thread")  # texts of the system
NUMERICAL = {"LinAlgError", "ArpackError", "ArpackNoConvergence", "IntegrationError"}
SINGULAR = (
    "the numerics failed: a matrix of the model is singular, or has entries that are not finite. Check for coordinates "
    "that describe the same motion, for masses and stiffnesses of zero or many orders apart, and for units"
)
PACKAGE = __name__.partition(".")[0]
RAISE = dis.opmap["RAISE_VARARGS"]
INTERRUPTED = 130
F = TypeVar("F", bound=Callable[..., Any])
EXAMPLES: dict[str, str] = {}  # verb -> example for its help


def meaning(error: Exception) -> tuple[int, list[str]]:
    """Exit code and sentences of an error."""
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    kind = type(error).__name__
    if kind == "CaseError":
        return BAD_INPUT, text.splitlines()
    if _is_of_memory(error):
        message = text if raised_by_femflex(error) else ""
        return FAILED, [
            message or "there is not enough memory for this; take a coarser mesh, fewer modes or fewer rows of output"
        ]
    if isinstance(error, OSError):
        return FAILED if error.errno in FULL else BAD_INPUT, [_os_text(error)]
    if kind in NUMERICAL:
        return FAILED, [text if raised_by_femflex(error) else SINGULAR]
    if raised_by_femflex(error):
        if isinstance(error, ArithmeticError | RuntimeError):
            return FAILED, [text]
        if isinstance(error, ValueError | KeyError):
            return BAD_INPUT, [text]
    return FAULT, [
        f"this is a fault of femflex itself: {kind} in {_source_line(error)}",
        "please report it with the case and the lines that FEMFLEX_TRACEBACK=1 in the environment prints",
    ]


def _is_of_memory(error: BaseException | None) -> bool:
    """Whether an error, or one that led to it, says that there is no memory: Python's, the system's or the loader's."""
    while error is not None:
        if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
            return True
        if isinstance(error, ImportError | OSError | RuntimeError) and any(text in str(error) for text in NO_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False


def raised_by_femflex(error: BaseException) -> bool:
    """Whether a `raise` in femflex raised the error, and not a library or Python itself."""
    innermost = _innermost(error.__traceback__)
    if innermost is None or not _is_of_femflex(innermost):
        return False
    return innermost.tb_frame.f_code.co_code[innermost.tb_lasti] == RAISE


def _innermost(trace: TracebackType | None) -> TracebackType | None:
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace


def _is_of_femflex(trace: TracebackType) -> bool:
    return str(trace.tb_frame.f_globals.get("__name__", "")).partition(".")[0] == PACKAGE


def _source_line(error: BaseException) -> str:
    """Module and line of femflex nearest to where the error was raised."""
    line_text, trace = PACKAGE, error.__traceback__
    while trace is not None:
        if _is_of_femflex(trace):
            line_text = f"{trace.tb_frame.f_globals['__name__']}, line {trace.tb_lineno}"
        trace = trace.tb_next
    return line_text


def _os_text(error: OSError) -> str:
    hint = " (--force)" if isinstance(error, FileExistsError) else ""
    if error.filename is not None and error.strerror:
        return f"{error.filename}: {error.strerror[0].lower()}{error.strerror[1:]}{hint}"
    if raised_by_femflex(error):
        return f"{error}{hint}"
    reason = os.strerror(error.errno).lower() if error.errno else "it is damaged, or not in the format expected"
    return f"a file could not be read or written: {reason}{hint}"


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
    """Print the warnings gathered and not printed yet."""
    GATHERED.print_pending()


def verb(example: str) -> Callable[[F], F]:
    """Make a function a verb: a user's mistake is one sentence and exit code 2, never a traceback.

    Set FEMFLEX_TRACEBACK=1 to see where an error came from.
    """

    def decorate(function: F) -> F:
        @functools.wraps(function)
        def wrapped(*args: Any, **kwargs: Any) -> Any:
            gather_warnings()
            try:
                return function(*args, **kwargs)
            except BrokenPipeError:  # the reader of the output left, such as `head`
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                raise typer.Exit(0) from None
            except KeyboardInterrupt as interrupt:
                print_error(str(interrupt) or "interrupted")
                raise typer.Exit(INTERRUPTED) from None
            except (typer.Exit, typer.Abort):
                raise
            except Exception as error:
                if os.environ.get("FEMFLEX_TRACEBACK"):
                    raise
                code, sentences = meaning(error)
                for sentence in sentences:
                    print_error(sentence)
                raise typer.Exit(code) from None
            finally:
                print_warnings()

        EXAMPLES[function.__name__] = f"Example: {example}"
        return wrapped  # type: ignore[return-value]

    return decorate


def print_error(text: str) -> None:
    """Say something on standard error, after the warnings that wait."""
    print_warnings()
    print(f"femflex: {text}", file=sys.stderr)
