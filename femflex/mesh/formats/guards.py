"""Guards against hostile sizes: counts of a mesh file are checked against its length before memory is taken."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from femflex.memory import limited_memory, require_memory

MAX_GENERATED = 2_000_000  # nodes, elements or cards that one line of a deck may generate
MAX_INCLUDE_DEPTH = 10  # levels of files within files
COMPRESSED = 20  # assumed ratio of the data in a compressed file to its size


@contextmanager
def memory_guard(path: Path, memory_per_byte: float) -> Iterator[None]:
    """Context in which a file is read with at most the memory that its size allows, plus a margin."""
    memory = memory_per_byte * path.stat().st_size
    require_memory(memory, f"{path.name}: reading it", "take a coarser mesh, or free some memory.")
    with limited_memory(COMPRESSED * memory):
        yield


def check_count(count: int, location: str) -> None:
    """Raise ValueError, before memory is allocated, if a line of a deck generates too many items."""
    if count > MAX_GENERATED:
        raise ValueError(
            f"{location}: the line generates {count} nodes, elements or cards; at most {MAX_GENERATED} are read of one "
            "line. Correct the number, or write the items out."
        )


def check_include_depth(depth: int, location: str) -> None:
    """Raise ValueError if files of a deck include each other without end."""
    if depth >= MAX_INCLUDE_DEPTH:
        raise ValueError(
            f"{location}: files include each other more than {MAX_INCLUDE_DEPTH} deep; take the line out, or put the "
            "files into one."
        )
