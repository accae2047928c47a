"""Lock of a result file against a second writer.

It is an advisory lock of the operating system on an empty file next to the result file, `.<name>.lock`. The system
releases it when the process ends, in whatever way, so that a killed run never blocks the next one. Readers take no
lock. Where the file system has no locks (some network folders) or the system has no `fcntl` (Windows), two writers are
not prevented.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Self

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


class FileLock:
    """The right to write a result file, until it is released; a context manager.

    Raises BlockingIOError when another writer has it, in this process or in another one.
    """

    def __init__(self, path: str | Path) -> None:
        self._handle = -1
        self.path = Path(path)
        target = Path(os.path.realpath(self.path))
        self._lock_file = target.with_name(f".{target.name}.lock")
        while fcntl is not None and not self._try_lock():
            pass

    def _try_lock(self) -> bool:
        """Take the lock; return whether it is on the file that exists now, and not on one that was just deleted."""
        handle = os.open(self._lock_file, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            raise BlockingIOError(
                f"{self.path} is being written by another run; wait until it ends, stop it, or choose another file"
            ) from None
        except OSError:  # a file system without locks
            os.close(handle)
            return True
        self._handle = handle
        try:
            current = os.stat(self._lock_file)
        except FileNotFoundError:
            current = None
        if current is not None and os.path.samestat(current, os.fstat(handle)):
            return True
        self._close()
        return False

    def release(self) -> None:
        """Release the lock; a second call does nothing."""
        if self._handle >= 0:
            with contextlib.suppress(OSError):
                self._lock_file.unlink()  # while it is locked: a writer that waits sees that the file is gone
            self._close()

    def _close(self) -> None:
        os.close(self._handle)
        self._handle = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.release()

    def __del__(self) -> None:
        self.release()
