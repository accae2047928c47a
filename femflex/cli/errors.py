"""Meaning of an error to the user: bad input, failed numerics, or a fault of femflex itself.

A user's mistake is an error that femflex raises: its innermost frame belongs to a module of femflex (known by its name,
so that links, archives and the working folder do not matter) and stands at a `raise`. A built-in error that a function
of Python or of a library raised on the way is a fault.
"""

from __future__ import annotations

import dis
import errno
import os
from types import TracebackType

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
