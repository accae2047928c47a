"""The arrays that the calls of a compiled model get: its records and numbers, and scratch of the run's own."""

from __future__ import annotations

import threading

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.layout.pool import aligned

ModelArrays = tuple[IntArray, Array, Array]  # table, pool, work


class Workspace:
    """Scratch arrays of one run of a model; every thread that calls with it gets arrays of its own.

    table    records, shared by all and never written to
    numbers  the pool of the model, shared and never written to; where bodies vary with time every thread has a copy,
             in which their blocks are written anew at every evaluation
    arrays   table, pool and work, as every compiled call takes them
    """

    def __init__(self, table: IntArray, numbers: Array, n_work: int, varies: bool) -> None:
        self.table, self.numbers, self.n_work, self.varies = table, numbers, n_work, varies
        self._local = threading.local()

    @property
    def arrays(self) -> ModelArrays:
        """The calling thread's arrays, made at its first call."""
        try:
            arrays: ModelArrays = self._local.arrays
        except AttributeError:
            arrays = self._local.arrays = (self.table, self._pool(), aligned(self.n_work))
        return arrays

    def new_scratch(self) -> Workspace:
        """Scratch arrays for another run of the same model."""
        return Workspace(self.table, self.numbers, self.n_work, self.varies)

    def store_numbers(self) -> None:
        """Make the numbers in the calling thread's pool those of the model, while it is being compiled."""
        self.numbers[:] = self.arrays[1]

    def clear_failed(self) -> None:
        """Clear the calling thread's scratch after an evaluation that failed, since it spoils the next ones."""
        work = self.arrays[2]
        work[np.isnan(work)] = 0.0

    def _pool(self) -> Array:
        if not self.varies:
            return self.numbers
        pool = aligned(len(self.numbers))
        pool[:] = self.numbers
        return pool
