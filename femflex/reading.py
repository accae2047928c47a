"""The boundary round the reading of a file: whatever is wrong with what it holds becomes a sentence."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def reading(path: Path, kind: str, advice: str) -> Iterator[None]:
    """Context in which a file is read: errors become a ValueError that names the file, what it should be, and advice.

    Errors that name the file already, and those of the operating system on it, pass as they are.
    """
    try:
        yield
    except MemoryError:
        raise ValueError(
            f"{path.name} could not be read as {kind}: it asks for more memory than is free, or than a file of "
            f"{path.stat().st_size} bytes can need. {advice}"
        ) from None
    except Exception as error:
        if isinstance(error, OSError) and error.errno is not None and error.filename is not None:
            raise
        if isinstance(error, ValueError | OSError) and path.name in str(error):
            raise
        detail = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
        said = " ".join(f"{type(error).__name__} {detail}".split())[:300]
        raise ValueError(f"{path.name} could not be read as {kind}: {said}. {advice}") from error
