"""Allocation of numbers and scratch in the pool: one after another, from whole lanes."""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, IntArray
from femflex.body import Marker
from femflex.dynamics.layout.records import BENDS, STAYS, TURNS, VARIES
from femflex.kernels.lanes import padded
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
    def from_values(cls, values: object) -> Piece:
        """The flattened values."""
        numbers = np.ascontiguousarray(values, float).ravel()
        return cls(numbers, numbers.tobytes())

    @classmethod
    def from_rows(cls, values: object) -> Piece:
        """An array whose last axis is filled up with zeros to whole lanes."""
        values = np.asarray(values, float)
        n = values.shape[-1]
        wide = np.zeros((*values.shape[:-1], padded(n)))
        wide[..., :n] = values
        return cls.from_values(wide)


MARKERS: WeakKeyDictionary[Marker, tuple[Piece, Piece, Piece, int]] = WeakKeyDictionary()  # of markers lowered before


class Pool:
    """Numbers laid one after another from whole lanes; `put` returns a piece's offset, and lays equal ones once."""

    def __init__(self) -> None:
        self._pieces: list[tuple[int, Array]] = []  # place and numbers
        self._positions: dict[bytes, int] = {}
        self.size = 0
        self.varying_markers: dict[tuple[str, str], tuple[int, int, int]] = {}  # (body, marker): place, phi, psi

    def add(self, values: object) -> int:
        """Place of the flattened values, or of a piece."""
        piece = values if isinstance(values, Piece) else Piece.from_values(values)
        if piece.key not in self._positions:
            self._positions[piece.key] = self.add_unshared(piece.numbers)
        return self._positions[piece.key]

    def add_unshared(self, values: object) -> int:
        """Place of the flattened values, shared with no others: they may be changed later."""
        piece, position = np.ascontiguousarray(values, float).ravel(), self.size
        self._pieces.append((position, piece))
        self.size += padded(piece.size)
        return position

    def array(self) -> Array:
        """All pieces in one array."""
        out = aligned(self.size)
        for position, piece in self._pieces:
            out[position : position + piece.size] = piece
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


def add_marker(body: str | None, name: str, system: System, pool: Pool) -> tuple[int, int, int, int]:
    """Places of position, axes and beam's axis, phi, psi, and how the marker moves: STAYS, BENDS or TURNS, and VARIES.

    TURNS: as a section of a beam. body None: the origin of the base frame.
    """
    marker = BASE_ORIGIN if body is None else system.bodies[body].marker(name)
    data, phi, psi, bends = marker_pieces(marker)
    if body is not None and (body, name) in pool.varying_markers:
        turns = TURNS if marker.axis.any() and marker.phi.shape[1] else BENDS
        return (*pool.varying_markers[body, name], VARIES + turns)
    return pool.add(data), pool.add(phi), pool.add(psi), bends


BASE_ORIGIN = Marker.at_position(np.zeros(3))


def marker_pieces(marker: Marker) -> tuple[Piece, Piece, Piece, int]:
    """Position with axes and beam's axis, phi, psi, and how the marker moves; of one and the same marker only once."""
    if marker not in MARKERS:
        bends = BENDS if np.any(marker.phi) or np.any(marker.psi) else STAYS
        data = np.concatenate([marker.position, marker.orientation.ravel(), marker.axis])
        turns = bends and marker.axis.any()
        pieces = Piece.from_values(data), Piece.from_rows(marker.phi), Piece.from_rows(marker.psi)
        MARKERS[marker] = (*pieces, TURNS if turns else bends)
    return MARKERS[marker]
