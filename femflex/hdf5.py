"""HDF5 files: read without following links and with a check of their size, and written by way of memory."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from femflex.memory import require_proportion
from femflex.writing import atomic_file, refuse_special

if TYPE_CHECKING:
    import h5py

DAMAGED = "is cut short or damaged, as after an incomplete copy; copy it again, or make it again from its source"


def open_hdf5(path: Path, kind: str = "HDF5 file") -> h5py.File:
    """An HDF5 file, called `kind` in messages, open for reading (also while a run is writing it).

    Raises FileNotFoundError; ValueError for a file of another format, one that is cut short or damaged, one with links
    or with data in other files, which are not followed, and one that would expand to far more than its own size.
    """
    import h5py

    refuse_special(path)
    if not path.exists():
        raise FileNotFoundError(f"{kind} {path} does not exist")
    if not h5py.is_hdf5(path):
        raise ValueError(f"{path} is no {kind}: it is not in the HDF5 format, or its beginning is damaged")
    try:
        file = h5py.File(path, "r", locking=False)
    except OSError as error:
        raise ValueError(f"{path} {DAMAGED}") from error
    try:
        _check_members(file, path)
    except BaseException:
        file.close()
        raise
    return file


def _check_members(file: h5py.File, path: Path) -> None:
    import h5py

    links, external, sizes = list[str](), list[str](), list[int]()

    def link(name: bytes, info: Any) -> None:
        if info.type != h5py.h5l.TYPE_HARD:
            links.append(name.decode(errors="replace"))

    def member(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            sizes.append(item.nbytes)
            if item.external or item.is_virtual:
                external.append(name)

    try:
        file.id.links.visit(link, info=True)
        file.visititems(member)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        raise ValueError(f"{path} {DAMAGED}") from error
    if names := links or external:
        kind = "a link" if links else "data outside the file"
        raise ValueError(f"{path}: {names[0]} is {kind}, which is not followed; write a file that holds all its data")
    require_proportion(path, sum(sizes))


@contextmanager
def atomic_hdf5(path: str | Path, force: bool = False) -> Iterator[h5py.File]:
    """Context with an HDF5 file in memory, written to `path` at the end; HDF5 itself does not survive a full disk."""
    import h5py

    with atomic_file(path, force) as part, h5py.File(part, "w", driver="core", backing_store=False) as file:
        yield file
        file.flush()
        part.write_bytes(file.id.get_file_image())
