"""Files that appear whole: written under another name and moved into place."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from femflex.results.destination import check_destination
from femflex.results.interrupts import PARTS


@contextmanager
def placed(path: str | Path, force: bool = False) -> Iterator[Path]:
    """A name in the folder of `path` to write to, of the same suffix; what is there moves to `path` at the end.

    An interrupt (Ctrl-C) moves what was written so far; any other error removes it. Raises the OSErrors of
    `check_destination`: an existing file is refused unless `force`.
    """
    path = Path(path)
    check_destination(path, force)
    part = path.with_name(f"{path.stem}.{os.getpid()}.part{path.suffix}")  # other processes have their own
    PARTS.add(part)
    try:
        yield part
    except KeyboardInterrupt:
        if part.exists() and part.stat().st_size:
            os.replace(part, path)
        raise
    except BaseException as error:
        part.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno and error.filename in (None, str(part)):
            error.filename = str(path)  # a full disk names no file
        raise
    else:
        os.replace(part, path)
    finally:
        PARTS.discard(part)
