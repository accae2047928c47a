"""Memory that a mesh needs: stated before it is taken, refused where it exceeds what is free."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from femflex.warning import PhysicsWarning

STATED = 1e9  # bytes from which the need is reported
MOST_UNFOLDED = 100  # times its own size that a compressed file may hold
MARGIN = 2e9  # bytes in addition to the mesh's own, for libraries loaded on the way
CGROUP = Path("/sys/fs/cgroup")


def free_memory() -> float:
    """Bytes that can be taken without swapping; infinity where the system does not say."""
    return min(_system_memory(), _group_memory())


def require_memory(need: float, what: str, remedy: str) -> None:
    """Raise ValueError where `what` needs more bytes than are free; warn of more than a GB.

    what    subject of the sentence, such as "boom.inp: reading it"
    remedy  what to do instead
    """
    free = free_memory()
    if need > free:
        raise ValueError(f"{what} takes about {_gigabytes(need)}, and {_gigabytes(free)} are free; {remedy}")
    if need > STATED:
        warnings.warn(
            f"{what} takes about {_gigabytes(need)} of memory; {_gigabytes(free)} are free",
            PhysicsWarning,
            stacklevel=3,
        )


def require_proportion(path: Path, need: float) -> None:
    """Raise ValueError where a file unfolds to `need` bytes: over a GB, and more than 100 times its own size."""
    if need > max(STATED, MOST_UNFOLDED * path.stat().st_size):
        raise ValueError(
            f"{path} has {path.stat().st_size} bytes and unfolds to {_gigabytes(need)}, more than "
            f"{MOST_UNFOLDED} times as much; write sparse matrices, or without compression"
        )


@contextmanager
def limited_memory(need: float) -> Iterator[None]:
    """Context in which asking for much more memory than `need` bytes raises MemoryError, on systems that can do so.

    So a wrong count in a file ends its reading at once, whichever library has believed it.
    """
    try:
        import resource

        used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    except (ImportError, OSError, ValueError):
        yield
        return
    most = int(used + min(free_memory(), MARGIN + need, 2.0**60))
    if soft != resource.RLIM_INFINITY and soft <= most:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _system_memory() -> float:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return float("inf")


def _group_memory() -> float:
    """What a container leaves, of its own limit."""
    try:
        limit = (CGROUP / "memory.max").read_text().strip()
        used = int((CGROUP / "memory.current").read_text())
        return float("inf") if limit == "max" else max(0.0, float(int(limit) - used))
    except (OSError, ValueError):
        return float("inf")


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"
