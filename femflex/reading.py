"""Context for reading a file: whatever is wrong with its contents becomes a readable error."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from traceback import walk_tb

from femflex.extras import MissingExtra

# texts of Python's int and float
NO_NUMBER = re.compile(r"(?:invalid literal for int\(\) with base \d+|could not convert string to float): (.+)")

POINTER = b"version https://git-lfs"  # first bytes of the text that Git stores in place of a large file


def refuse_pointer(path: Path) -> None:
    """Raise ValueError where a file is a pointer of Git LFS in place of the file itself."""
    with open(path, "rb") as opened:
        if opened.read(len(POINTER)) == POINTER:
            raise ValueError(f"{path.name} is a pointer of Git LFS, not the file itself; fetch it with: git lfs pull")


@contextmanager
def reading(path: Path, kind: str, advice: str) -> Iterator[None]:
    """Context in which a file is read: errors become a ValueError that names the file, what it should be, and advice.

    Errors that name the file already, and those of the operating system on it, pass as they are.
    """
    try:
        yield
    except MemoryError:
        raise ValueError(
            f"{path.name} could not be read as {kind}: it needs more memory than is free, or than a file of "
            f"{path.stat().st_size} bytes can need. {advice}"
        ) from None
    except (Warning, MissingExtra):  # of femflex; warnings where the caller turns them into errors
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno is not None and error.filename is not None:
            raise
        if isinstance(error, ValueError | OSError) and path.name in str(error):
            raise
        raise ValueError(f"{path.name} could not be read as {kind}: {error_text(error)}. {advice}") from error


def error_text(error: BaseException, otherwise: str = "its contents are not those of this format") -> str:
    """Text of an error, such as one raised in reading a file: femflex's own, or `otherwise` instead of a library's."""
    if number := NO_NUMBER.search(str(error)):
        return f"it has {number[1]} where a number belongs"
    frames = [frame for frame, _ in walk_tb(error.__traceback__)]
    is_own = bool(frames) and str(frames[-1].f_globals.get("__name__", "")).startswith("femflex.")
    if is_own and isinstance(error, ValueError | RuntimeError) and error.args:
        return " ".join(str(error.args[0]).split())[:300].rstrip(". ")
    return otherwise
