"""Files that appear whole: they are written beside their destination and moved there at the end.

Only regular files are replaced.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from stat import S_ISBLK, S_ISCHR, S_ISFIFO, S_ISREG, S_ISSOCK

PARTS: set[Path] = set()  # unfinished files and folders beside their destination; of no use before they are moved
SPECIAL = {S_ISFIFO: "a pipe", S_ISSOCK: "a socket", S_ISCHR: "a device", S_ISBLK: "a device"}


def check_destination(path: Path, force: bool) -> None:
    """Raise the OSError that says why a new file cannot be written at this path, if it cannot.

    A file that exists is refused unless `force`; a folder, pipe, socket, device or link to nothing always is.
    """
    refuse_special(path)
    if path.exists() and not force:
        raise FileExistsError(f"{path} exists; choose another name, or force to overwrite it")
    folder = link_target(path).parent
    if not folder.is_dir():
        raise FileNotFoundError(f"folder {folder} does not exist; make it, or choose another for {path.name}")
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"folder {folder} cannot be written to; choose another for {path.name}")


def refuse_special(path: Path) -> None:
    """Raise OSError where a path leads to something that is neither a regular file nor a free name."""
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder; give the name of a file")
    if path.is_symlink() and not path.exists():
        raise FileNotFoundError(f"{path} is a link to {os.readlink(path)}, where no file is; remove it")
    if path.exists() and not S_ISREG(mode := path.stat().st_mode):
        kind = next((text for is_kind, text in SPECIAL.items() if is_kind(mode)), "special")
        raise OSError(f"{path} is {kind}, not a regular file, so it is neither read nor replaced; choose a file")


def link_target(path: Path) -> Path:
    """The file that a path leads to: links are followed, so that they stay and the file behind them is replaced."""
    return Path(os.path.realpath(path)) if path.is_symlink() else path


def move_into_place(part: Path, path: Path) -> None:
    """Move a finished file to its destination, unless that is neither a regular file nor free. Raises OSError."""
    refuse_special(path)
    os.replace(part, link_target(path))


@contextmanager
def atomic_file(path: str | Path, force: bool = False, keep_interrupted: bool = False) -> Iterator[Path]:
    """Context with a file of the same name, in a folder beside `path`, to write to; it is moved to `path` at the end.

    Any error removes it. An interrupt (Ctrl-C) removes it too, unless `keep_interrupted`: then the part written is
    moved. Raises the OSErrors of `check_destination`, and those of writing with `path` as the name of the file.
    """
    path = Path(path)
    check_destination(path, force)
    folder = Path(tempfile.mkdtemp(prefix=".femflex-", suffix=".part", dir=link_target(path).parent))
    part = folder / path.name
    PARTS.add(folder)
    try:
        yield part
        move_into_place(part, path)
    except KeyboardInterrupt:
        if keep_interrupted and part.exists() and part.stat().st_size:
            move_into_place(part, path)
        raise
    except OSError as error:
        if error.errno and error.filename in (None, str(part)):
            error.filename = str(path)  # a full disk names no file
        raise
    finally:
        remove_part(folder)


def remove_part(part: Path) -> None:
    """Remove an unfinished file or folder."""
    if part.is_dir():
        shutil.rmtree(part, ignore_errors=True)
    else:
        part.unlink(missing_ok=True)
    PARTS.discard(part)
