"""Sums over chunks on all processors: whole chunks side by side, as much of their work is not BLAS's."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
from threadpoolctl import ThreadpoolController

from femflex.arrays import Array


def side_by_side(work: Callable[[Iterator[slice]], Array], chunks: Sequence[slice], most: int) -> Array:
    """The sum of work over all chunks (numbers of rows), of any shape, dealt out to as many threads as BLAS has, at
    most so many; BLAS then has one in
    each.

    An interruption ends every thread with the chunk it is at.
    """
    if len(chunks) < 2:
        return work(iter(chunks))
    blas = ThreadpoolController().select(user_api="blas")
    threads = min(len(chunks), most, max((library["num_threads"] for library in blas.info()), default=1))
    stop = Event()

    def own(first: int) -> Iterator[slice]:
        for chunk in chunks[first::threads]:
            if stop.is_set():
                return
            yield chunk

    with blas.limit(limits=1), ThreadPoolExecutor(threads) as pool:
        try:
            parts = [pool.submit(work, own(first)) for first in range(threads)]
            return np.sum([part.result() for part in parts], axis=0)
        finally:
            stop.set()
