"""Memory that a mesh needs: reported before it is allocated, and refused where it exceeds the free memory."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from femflex.warning import PhysicsWarning

REPORTED_ABOVE = 1e9  # bytes from which the need is reported
LARGEST_EXPANSION = 100  # times its own size that a compressed file may hold
MARGIN = 2e9  # bytes in addition to the mesh's own, for libraries loaded on the way
CGROUP = Path("/sys/fs/cgroup")


def free_memory() -> float:
    """Bytes that can be allocated without swapping; infinity where the system does not say."""
    return min(_system_memory(), _container_memory())


def require_memory(need: float, subject: str, remedy: str) -> None:
    """Raise ValueError where `what` needs more bytes than are free; warn of more than a GB.

    what    subject of the sentence, such as "boom.inp: reading it"
    remedy  what to do instead
    """
    free = free_memory()
    if need > free:
        raise ValueError(f"{subject} takes about {_gigabytes(need)}, and {_gigabytes(free)} are free; {remedy}")
    if need > REPORTED_ABOVE:
        warnings.warn(
            f"{subject} takes about {_gigabytes(need)} of memory; {_gigabytes(free)} are free",
            PhysicsWarning,
            stacklevel=3,
        )


def require_proportion(path: Path, need: float) -> None:
    """Raise ValueError where a file expands to `need` bytes: over a GB, and more than 100 times its own size."""
    if need > max(REPORTED_ABOVE, LARGEST_EXPANSION * path.stat().st_size):
        raise ValueError(
            f"{path} has {path.stat().st_size} bytes and unfolds to {_gigabytes(need)}, more than "
            f"{LARGEST_EXPANSION} times as much; write sparse matrices, or without compression"
        )


@contextmanager
def limited_memory(need: float) -> Iterator[None]:
    """Context in which allocating much more than `need` bytes raises MemoryError, on systems that can do so.

    So a wrong count in a file ends its reading at once, in whichever library it is used.
    """
    try:
        import resource

        used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    except (ImportError, OSError, ValueError):
        yield
        return
    allowed = int(used + min(free_memory(), MARGIN + need, 2.0**60))
    if soft != resource.RLIM_INFINITY and soft <= allowed:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (allowed, hard))
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


def _container_memory() -> float:
    """Bytes that the limit of the container leaves free."""
    try:
        limit = (CGROUP / "memory.max").read_text().strip()
        used = int((CGROUP / "memory.current").read_text())
        return float("inf") if limit == "max" else max(0.0, float(int(limit) - used))
    except (OSError, ValueError):
        return float("inf")


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"
