"""Where lowering lays numbers and scratch: one after another, from whole lanes."""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, IntArray
from femflex.body import Marker
from femflex.dynamics.arithmetic.lanes import padded
from femflex.dynamics.lowering.layout import BENDS, STAYS, TURNS, VARIES
from femflex.system import System


def aligned(size: int) -> Array:
    """Zeros (size,) that begin at a whole cache line, so that no lane straddles two."""
    spare = np.zeros(size + 8)
    start = -(spare.ctypes.data // 8) % 8
    return spare[start : start + size]


class Piece(NamedTuple):
    """Numbers (n,) that a pool is to lay, and the bytes by which it knows equal ones."""

    numbers: Array
    key: bytes

    @classmethod
    def of(cls, values: object) -> Piece:
        """The flattened values."""
        numbers = np.ascontiguousarray(values, float).ravel()
        return cls(numbers, numbers.tobytes())

    @classmethod
    def of_rows(cls, values: object) -> Piece:
        """An array whose last axis is filled up with zeros to whole lanes."""
        values = np.asarray(values, float)
        n = values.shape[-1]
        wide = np.zeros((*values.shape[:-1], padded(n)))
        wide[..., :n] = values
        return cls.of(wide)


MARKERS: WeakKeyDictionary[Marker, tuple[Piece, Piece, Piece, int]] = WeakKeyDictionary()  # of markers lowered before


class Pool:
    """Numbers laid one after another from whole lanes; `put` says where a piece went, and lays equal ones only once."""

    def __init__(self) -> None:
        self._pieces: list[tuple[int, Array]] = []  # place and numbers
        self._known: dict[bytes, int] = {}
        self.size = 0
        self.varying_markers: dict[tuple[str, str], tuple[int, int, int]] = {}  # (body, marker): place, phi, psi

    def put(self, values: object) -> int:
        """Place of the flattened values, or of a piece."""
        piece = values if isinstance(values, Piece) else Piece.of(values)
        if piece.key not in self._known:
            self._known[piece.key] = self.put_own(piece.numbers)
        return self._known[piece.key]

    def put_own(self, values: object) -> int:
        """Place of the flattened values, shared with no others: they may be changed later."""
        piece, place = np.ascontiguousarray(values, float).ravel(), self.size
        self._pieces.append((place, piece))
        self.size += padded(piece.size)
        return place

    def array(self) -> Array:
        """All pieces in one array."""
        out = aligned(self.size)
        for place, piece in self._pieces:
            out[place : place + piece.size] = piece
        return out


class Scratch:
    """Hands out places in the work array, from whole lanes."""

    def __init__(self) -> None:
        self.size = 0

    def take(self, count: int) -> int:
        """Place of that many doubles."""
        start, self.size = self.size, self.size + padded(count)
        return start


def length_of(parts: list[NDArray[np.void] | IntArray]) -> int:
    """Number of integers in arrays of records or integers."""
    return sum(part.nbytes // 8 for part in parts)


def put_marker(body: str | None, name: str, system: System, pool: Pool) -> tuple[int, int, int, int]:
    """Places of position, axes and beam's axis, phi, psi, and how the marker moves: STAYS, BENDS or TURNS, and VARIES.

    TURNS: as a section of a beam. body None: the origin of the base frame.
    """
    marker = FIXED if body is None else system.bodies[body].marker(name)
    place, phi, psi, bends = marker_pieces(marker)
    if body is not None and (body, name) in pool.varying_markers:
        turns = TURNS if marker.axis.any() and marker.phi.shape[1] else BENDS
        return (*pool.varying_markers[body, name], VARIES + turns)
    return pool.put(place), pool.put(phi), pool.put(psi), bends


FIXED = Marker.at(np.zeros(3))


def marker_pieces(marker: Marker) -> tuple[Piece, Piece, Piece, int]:
    """Position with axes and beam's axis, phi, psi, and how the marker moves; of one and the same marker only once."""
    if marker not in MARKERS:
        bends = BENDS if np.any(marker.phi) or np.any(marker.psi) else STAYS
        place = np.concatenate([marker.position, marker.orientation.ravel(), marker.axis])
        turns = bends and marker.axis.any()
        pieces = Piece.of(place), Piece.of_rows(marker.phi), Piece.of_rows(marker.psi)
        MARKERS[marker] = (*pieces, TURNS if turns else bends)
    return MARKERS[marker]
