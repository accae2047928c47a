"""Functions of femflex that write the properties of varying bodies (see femflex.system.variation)."""

from __future__ import annotations

from femflex.arrays import Array
from femflex.kernels.entries import USER, Entry, entry


@entry(USER)
def tanks(t: float, z: Array, numbers: Array, block: Array) -> None:
    """Moments of a dry body and of the propellant in its tanks, each of which grows with the mass in it.

    numbers: for every tank the place of its mass in z; -1; the size of the block; the dry block; for every tank the
    block of a unit of mass.
    """
    n = 0
    while numbers[n] >= 0.0:
        n += 1
    size, first = int(numbers[n + 1]), n + 2
    for i in range(size):
        block[i] = numbers[first + i]
    for k in range(n):
        mass, unit = z[int(numbers[k])], first + (k + 1) * size
        for i in range(size):
            block[i] += mass * numbers[unit + i]


WRITERS = {"tanks": tanks}


def writer(word: str) -> Entry:
    """The function of that word.

    Raises ValueError with the known words when there is none.
    """
    if word not in WRITERS:
        raise ValueError(f"femflex has no function {word!r} that writes a varying body; it has {', '.join(WRITERS)}")
    return WRITERS[word]
