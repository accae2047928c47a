"""Where a new file may be written."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path


def check_space(path: Path, need: int) -> None:
    """Raise OSError where the disk of `path` has less room than `need` bytes; HDF5 may crash when a disk gets full."""
    free = shutil.disk_usage(path.parent).free
    if need > free:
        text = f"{path} cannot be written: it takes {need / 1e6:.3g} MB, and {free / 1e6:.3g} MB are free"
        error = OSError(text)
        error.errno = errno.ENOSPC
        raise error


def check_destination(path: Path, force: bool) -> None:
    """Raise the OSError that says why a new file cannot be written there, if so."""
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder; give the name of a file")
    if path.exists() and not force:
        raise FileExistsError(f"{path} exists; choose another name, or force to overwrite it")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"folder {path.parent} does not exist; make it, or choose another for {path.name}")
    if not os.access(path.parent, os.W_OK):
        raise PermissionError(f"folder {path.parent} cannot be written to; choose another for {path.name}")
