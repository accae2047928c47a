"""Guards against hostile sizes: counts of a mesh file are checked against its length before memory is taken."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from femflex.memory import limited_memory, require_memory

MAX_GENERATED = 2_000_000  # nodes, elements or cards that one line of a deck may generate
MAX_INCLUDE_DEPTH = 10  # levels of files within files
COMPRESSED = 20  # assumed ratio of the data in a compressed file to its size
# Minimum bytes of a node and of an element of Gmsh, as text ("1 0 0 0\n") and binary; 4.1 stores tags separately
MIN_BYTES = {
    ("2.2", False): (8, 8),
    ("2.2", True): (28, 8),
    ("4.1", False): (8, 4),
    ("4.1", True): (32, 16),
}


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


def check_gmsh_counts(nodes: bytes, elements: bytes, kind: tuple[str, bool, int], name: str) -> None:
    """Raise ValueError if the sections $Nodes or $Elements are too short for the counts that they announce.

    nodes, elements  bodies of the sections
    kind             version, whether binary, bytes of a size
    name             of the file
    """
    version, binary, width = kind
    for body, items, min_bytes in zip(
        (nodes, elements), ("nodes", "elements"), MIN_BYTES[version, binary], strict=True
    ):
        announced = _announced_count(body, version, binary, width)
        if announced * min_bytes > len(body):
            raise ValueError(
                f"{name} claims {announced} {items}, and its section of {len(body)} bytes holds at most "
                f"{len(body) // min_bytes}; the file is cut short or damaged. Write it again from its source."
            )
    if version == "4.1":
        _check_node_blocks(nodes, binary, width, name)


def _announced_count(body: bytes, version: str, binary: bool, width: int) -> int:
    """The number of nodes or elements announced at the start of a section."""
    if version == "2.2":
        return int(body.partition(b"\n")[0])
    return _sizes(body, 4, width)[1] if binary else int(body.split(None, 2)[1])


def _sizes(body: bytes, count: int, width: int, offset: int = 0) -> tuple[int, ...]:
    return struct.unpack_from(f"<{count}{'Q' if width == 8 else 'I'}", body, offset)


def _check_node_blocks(body: bytes, binary: bool, width: int, name: str) -> None:
    """Raise ValueError if the blocks hold another number of nodes than announced, or node numbers need too large a
    table."""
    announced, counts, largest = _binary_blocks(body, width) if binary else _text_blocks(body)
    if sum(counts) != announced:
        raise ValueError(
            f"{name} claims {announced} nodes, and the blocks of its section hold {sum(counts)}; the file is damaged. "
            "Write it again from its source."
        )
    require_memory(8.0 * largest, f"{name}: a table of node numbers up to {largest:.4g}", "renumber its nodes.")


def _binary_blocks(body: bytes, width: int) -> tuple[int, list[int], int]:
    """Announced number of nodes, number of nodes in each block, and the largest node number."""
    blocks, announced = _sizes(body, 2, width)
    offset, counts, largest = 4 * width, list[int](), 0
    for _ in range(blocks):
        (parametric,) = struct.unpack_from("<i", body, offset + 8)
        (count,) = _sizes(body, 1, width, offset + 12)
        offset += 12 + width
        tags = np.frombuffer(body, f"<u{width}", count, offset)
        largest = max(largest, int(tags.max(initial=0)))
        _refuse_parametric(parametric)
        offset += count * (width + 24)
        counts.append(count)
    return announced, counts, largest


def _text_blocks(body: bytes) -> tuple[int, list[int], int]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # text that is no number
        try:
            numbers = np.fromstring(body.decode("ascii"), sep=" ")
        except (DeprecationWarning, UnicodeDecodeError):
            raise ValueError("its section of nodes holds text that is no number") from None
    blocks, announced = int(numbers[0]), int(numbers[1])
    offset, counts, largest = 4, list[int](), 0.0
    for _ in range(blocks):
        count = int(numbers[offset + 3])
        largest = max(largest, float(numbers[offset + 4 : offset + 4 + count].max(initial=0.0)))
        _refuse_parametric(numbers[offset + 2])
        offset += 4 + 4 * count
        counts.append(count)
    return announced, counts, int(largest)


def _refuse_parametric(parametric: float) -> None:
    if parametric:
        raise ValueError("its nodes have parametric coordinates; write it again without (Mesh.SaveParametric = 0)")
