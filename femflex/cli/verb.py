"""Common parts of all verbs: exit codes, errors without traceback, short warnings."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable
from typing import Any, TypeVar

import typer

from femflex.cli.errors import BAD_INPUT, FAILED, meaning
from femflex.cli.warning_output import gather_warnings, print_warnings

__all__ = ["BAD_INPUT", "EXAMPLES", "FAILED", "INTERRUPTED", "print_error", "verb"]

INTERRUPTED = 130

F = TypeVar("F", bound=Callable[..., Any])
EXAMPLES: dict[str, str] = {}  # verb -> example for its help


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
