"""Keeps compiled kernels on disk honest.

Numba looks only at the file of the function it has cached, not at the files of what that function calls. So a folder of
kernels is stamped with a digest of all its sources, and its cached kernels are dropped when the stamp no longer fits:
after an upgrade in place, or an edit.
"""

from __future__ import annotations

import contextlib
import hashlib
from pathlib import Path

STAMP = "kernels.digest"


def drop_stale_kernels(folder: Path, *others: Path) -> None:
    """Delete the kernels that Numba keeps below a package folder when any source there has changed since.

    others: folders whose numbers are compiled in.

    A folder that cannot be written is left alone: Numba then keeps its kernels elsewhere, by path and content.
    """
    sources = [path for below in (folder, *others) for path in sorted(below.rglob("*.py"))]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
    cache = folder / "__pycache__"
    stamp = cache / STAMP
    if stamp.exists() and stamp.read_text() == digest:
        return
    with contextlib.suppress(OSError):
        for index in folder.rglob("*.nbi"):
            index.unlink()
        cache.mkdir(exist_ok=True)
        stamp.write_text(digest)
