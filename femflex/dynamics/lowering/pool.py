"""Where lowering lays numbers and scratch: one after another, from whole lanes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.body import Marker
from femflex.dynamics.arithmetic.lanes import padded
from femflex.dynamics.lowering.layout import BENDS, STAYS, TURNS, VARIES
from femflex.system import System

Array = NDArray[np.float64]


def aligned(size: int) -> Array:
    """Zeros (size,) that begin at a whole cache line, so that no lane straddles two."""
    spare = np.zeros(size + 8)
    start = -(spare.ctypes.data // 8) % 8
    return spare[start : start + size]


class Pool:
    """Numbers laid one after another from whole lanes; `put` says where a piece went, and lays equal ones only once."""

    def __init__(self) -> None:
        self._pieces: list[Array] = []
        self._known: dict[bytes, int] = {}
        self.size = 0
        self.varying_markers: dict[tuple[str, str], tuple[int, int, int]] = {}  # (body, marker): place, phi, psi

    def put(self, values: object) -> int:
        """Place of the flattened values."""
        piece = np.ascontiguousarray(values, float).ravel()
        key = piece.tobytes()
        if key not in self._known:
            self._known[key] = self.put_own(piece)
        return self._known[key]

    def put_own(self, values: object) -> int:
        """Place of the flattened values, shared with no others: they may be changed later."""
        piece, place = np.ascontiguousarray(values, float).ravel(), self.size
        self._pieces.append(np.concatenate([piece, np.zeros(padded(piece.size) - piece.size)]))
        self.size += padded(piece.size)
        return place

    def put_rows(self, values: object) -> int:
        """Place of an array whose last axis is filled up with zeros to whole lanes."""
        values = np.asarray(values, float)
        width = padded(values.shape[-1]) - values.shape[-1]
        return self.put(np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, width)]))

    def array(self) -> Array:
        """All pieces in one array."""
        out = aligned(self.size)
        if self._pieces:
            out[: self.size] = np.concatenate(self._pieces)
        return out


class Scratch:
    """Hands out places in the work array, from whole lanes."""

    def __init__(self) -> None:
        self.size = 0

    def take(self, count: int) -> int:
        """Place of that many doubles."""
        start, self.size = self.size, self.size + padded(count)
        return start


def length_of(parts: list[NDArray[np.void] | NDArray[np.int64]]) -> int:
    """Number of integers in arrays of records or integers."""
    return sum(part.nbytes // 8 for part in parts)


def put_marker(body: str | None, name: str, system: System, pool: Pool) -> tuple[int, int, int, int]:
    """Places of position, axes and beam's axis, phi, psi, and how the marker moves: STAYS, BENDS or TURNS, and VARIES.

    TURNS: as a section of a beam. body None: the origin of the base frame.
    """
    marker = Marker.rigid(np.zeros(3)) if body is None else system.bodies[body].marker(name)
    bends = BENDS if np.any(marker.phi) or np.any(marker.psi) else STAYS
    if bends and marker.axis.any():
        bends = TURNS
    if body is not None and (body, name) in pool.varying_markers:
        turns = TURNS if marker.axis.any() and marker.phi.shape[1] else BENDS
        return (*pool.varying_markers[body, name], VARIES + turns)
    place = pool.put(np.concatenate([marker.position, marker.orientation.ravel(), marker.axis]))
    return place, pool.put_rows(marker.phi), pool.put_rows(marker.psi), bends
