"""The shell elements of Nastran: number of corners, and the fields of the card that have the values."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Kind:
    """A shell element: corners, whether it may have middle nodes, and the fields (from 0) of its values."""

    corners: int
    middles: bool
    theta: int
    offset: int
    thickness: tuple[int, ...]
    relative: int = 9  # TFLAG


KINDS = {
    "CQUAD4": Kind(4, False, 6, 7, (10, 11, 12, 13)),
    "CQUADR": Kind(4, False, 6, 7, (10, 11, 12, 13)),
    "CQUAD4K": Kind(4, False, 6, 7, (10, 11, 12, 13)),  # MYSTRAN's thin plates
    "CTRIA3K": Kind(3, False, 5, 6, (10, 11, 12)),
    "CTRIA3": Kind(3, False, 5, 6, (10, 11, 12)),
    "CTRIAR": Kind(3, False, 5, 6, (10, 11, 12)),
    "CQUAD8": Kind(4, True, 14, 15, (10, 11, 12, 13), 16),
    "CTRIA6": Kind(3, True, 8, 9, (10, 11, 12), 13),
    "CSHEAR": Kind(4, False, -1, -1, ()),
}
