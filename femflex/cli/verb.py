"""What all verbs share: exit codes, errors without traceback, neat warnings."""

from __future__ import annotations

import errno
import functools
import os
import sys
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import typer

BAD_INPUT, FAILED, INTERRUPTED = 2, 3, 130
FULL = {errno.ENOSPC, errno.EDQUOT, errno.EIO}  # the disk, not the user

F = TypeVar("F", bound=Callable[..., Any])
EXAMPLES: dict[str, str] = {}  # verb -> example for its help


def verb(example: str) -> Callable[[F], F]:
    """Make a function a verb: a user's mistake is one sentence and exit code 2, never a traceback.

    Set FEMFLEX_TRACEBACK=1 to see where an error came from.
    """

    def decorate(function: F) -> F:
        @functools.wraps(function)
        def wrapped(*args: Any, **kwargs: Any) -> Any:
            _show_warnings_neatly()
            try:
                return function(*args, **kwargs)
            except BrokenPipeError:  # the reader of the output left, such as `head`
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                raise typer.Exit(0) from None
            except KeyboardInterrupt as stop:
                complain(str(stop) or "interrupted")
                raise typer.Exit(INTERRUPTED) from None
            except (ValueError, KeyError, OSError, ArithmeticError, MemoryError, RuntimeError) as error:
                if isinstance(error, typer.Exit) or os.environ.get("FEMFLEX_TRACEBACK"):
                    raise
                raise typer.Exit(_told(error)) from None

        EXAMPLES[function.__name__] = f"Example: {example}"
        return wrapped  # type: ignore[return-value]

    return decorate


def complain(text: str) -> None:
    """Say something on standard error."""
    print(f"femflex: {text}", file=sys.stderr)


def _told(error: Exception) -> int:
    """Say what an error means to the user, and return the exit code."""
    if type(error).__name__ == "CaseError":
        for line in str(error).splitlines():
            complain(line)
        return BAD_INPUT
    if isinstance(error, MemoryError):
        complain("there is not enough memory for this; take a coarser mesh, fewer modes or fewer rows of output")
        return FAILED
    if isinstance(error, OSError):
        complain(_os_text(error) + (" (--force)" if isinstance(error, FileExistsError) else ""))
        return FAILED if error.errno in FULL else BAD_INPUT
    ours = _raised_here(error)
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    if type(error).__name__ == "IntegrationError" or (isinstance(error, ArithmeticError | RuntimeError) and ours):
        complain(text)
        return FAILED
    if type(error).__name__ == "LinAlgError":
        complain(f"the numerics failed: {text}")
        return FAILED
    if isinstance(error, ValueError | KeyError) and ours:
        complain(text)
        return BAD_INPUT
    traceback.print_exception(error)
    complain("this is a fault of femflex itself; please report it with the lines above")
    return 1


def _raised_here(error: BaseException) -> bool:
    """Whether femflex itself raised it, and not a library that was handed something unforeseen."""
    frame = error.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    package = str(Path(__file__).resolve().parents[1])
    return frame is not None and frame.tb_frame.f_code.co_filename.startswith(package)


def _os_text(error: OSError) -> str:
    if error.filename is not None and error.strerror:
        return f"{error.filename}: {error.strerror[0].lower()}{error.strerror[1:]}"
    return str(error)


def _show_warnings_neatly() -> None:
    """Tell each physics warning once, however often the bodies it is about are built."""
    from femflex.warning import PhysicsWarning

    told: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *_: Any) -> None:
        if issubclass(category, PhysicsWarning) and str(message) not in told:
            told.add(str(message))
            complain(f"warning: {message}")

    warnings.simplefilter("ignore")
    warnings.simplefilter("always", PhysicsWarning)
    warnings.showwarning = show  # type: ignore[assignment]
