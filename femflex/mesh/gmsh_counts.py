"""Counts that a .msh file claims, checked against the bytes that are there before anything is made of them."""

from __future__ import annotations

import struct
import warnings

import numpy as np

from femflex.memory import require_memory

# Fewest bytes of a node and of an element, as text ("1 0 0 0\n") and binary; in 4.1 tags and positions are apart
LEAST = {
    ("2.2", False): (8, 8),
    ("2.2", True): (28, 8),
    ("4.1", False): (8, 4),
    ("4.1", True): (32, 16),
}


def check_counts(nodes: bytes, elements: bytes, kind: tuple[str, bool, int], name: str) -> None:
    """Raise ValueError where the sections $Nodes or $Elements cannot hold what they claim.

    nodes, elements  bodies of the sections
    kind             version, whether binary, bytes of a size
    name             of the file
    """
    version, binary, width = kind
    for body, what, least in zip((nodes, elements), ("nodes", "elements"), LEAST[version, binary], strict=True):
        claimed = _claimed(body, version, binary, width)
        if claimed * least > len(body):
            raise ValueError(
                f"{name} claims {claimed} {what}, and its section of {len(body)} bytes holds at most "
                f"{len(body) // least}; the file is cut short or damaged. Write it again from its source."
            )
    if version == "4.1":
        _check_node_blocks(nodes, binary, width, name)


def _claimed(body: bytes, version: str, binary: bool, width: int) -> int:
    """The number of nodes or elements that a section begins with."""
    if version == "2.2":
        return int(body.partition(b"\n")[0])
    return _sizes(body, 4, width)[1] if binary else int(body.split(None, 2)[1])


def _sizes(body: bytes, count: int, width: int, at: int = 0) -> tuple[int, ...]:
    return struct.unpack_from(f"<{count}{'Q' if width == 8 else 'I'}", body, at)


def _check_node_blocks(body: bytes, binary: bool, width: int, name: str) -> None:
    """Nodes of all blocks are as many as the section claims, and their numbers can be held as a table."""
    claimed, counts, largest = _binary_blocks(body, width) if binary else _text_blocks(body)
    if sum(counts) != claimed:
        raise ValueError(
            f"{name} claims {claimed} nodes, and the blocks of its section hold {sum(counts)}; the file is damaged. "
            "Write it again from its source."
        )
    require_memory(8.0 * largest, f"{name}: a table of node numbers up to {largest:.4g}", "renumber its nodes.")


def _binary_blocks(body: bytes, width: int) -> tuple[int, list[int], int]:
    """Number of nodes claimed, numbers of them in the blocks, and the largest node number."""
    blocks, claimed = _sizes(body, 2, width)
    at, counts, largest = 4 * width, list[int](), 0
    for _ in range(blocks):
        (parametric,) = struct.unpack_from("<i", body, at + 8)
        (count,) = _sizes(body, 1, width, at + 12)
        at += 12 + width
        tags = np.frombuffer(body, f"<u{width}", count, at)
        largest = max(largest, int(tags.max(initial=0)))
        _refuse_parametric(parametric)
        at += count * (width + 24)
        counts.append(count)
    return claimed, counts, largest


def _text_blocks(body: bytes) -> tuple[int, list[int], int]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # text that is no number
        try:
            numbers = np.fromstring(body.decode("ascii"), sep=" ")
        except (DeprecationWarning, UnicodeDecodeError):
            raise ValueError("its section of nodes holds text that is no number") from None
    blocks, claimed = int(numbers[0]), int(numbers[1])
    at, counts, largest = 4, list[int](), 0.0
    for _ in range(blocks):
        count = int(numbers[at + 3])
        largest = max(largest, float(numbers[at + 4 : at + 4 + count].max(initial=0.0)))
        _refuse_parametric(numbers[at + 2])
        at += 4 + 4 * count
        counts.append(count)
    return claimed, counts, int(largest)


def _refuse_parametric(parametric: float) -> None:
    if parametric:
        raise ValueError("its nodes have parametric coordinates; write it again without (Mesh.SaveParametric = 0)")
