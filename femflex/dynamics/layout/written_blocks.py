"""Functions of femflex that write the blocks of varying bodies: those that follow from a length, and those with tanks.

See `femflex.system.length_table` and `femflex.system.variation`.
"""

from __future__ import annotations

from femflex.arrays import Array
from femflex.kernels.compiled import inner
from femflex.kernels.entries import USER, Entry, entry
from femflex.kernels.lanes import lane, put_lane
from femflex.kernels.profiles import profile_at
from femflex.kernels.vectors import Vector
from femflex.system.length_table import HEAD, WIDTH


@inner
def power(s: float, p: int) -> float:
    """s^p for a whole p of any sign."""
    value, factor = 1.0, s if p >= 0 else 1.0 / s
    for _ in range(abs(p)):
        value *= factor
    return value


@inner
def write_block(length: Vector, numbers: Array, block: Array) -> None:
    """Write the block at a length, its rate and its acceleration."""
    L, rate, acceleration = length
    n_pieces, n_terms, n_runs, n_values = int(numbers[0]), int(numbers[1]), int(numbers[2]), int(numbers[3])
    origins = HEAD + int(numbers[6])
    terms = origins + 2 * n_pieces
    runs = terms + 3 * n_terms
    piece = 0
    while piece + 1 < n_pieces and numbers[origins + piece + 1] <= L:
        piece += 1
    s = (L - numbers[origins + piece]) / numbers[origins + n_pieces + piece]
    value, last_term, factor = runs + 4 * n_runs + n_values * piece, -1, 0.0
    for r in range(n_runs):
        run = runs + 4 * r
        target, count, term, added = int(numbers[run]), int(numbers[run + 1]), int(numbers[run + 2]), numbers[run + 3]
        if term != last_term:
            exponents, last_term = terms + 3 * term, term
            factor = power(s, int(numbers[exponents])) * power(rate, int(numbers[exponents + 1]))
            factor *= power(acceleration, int(numbers[exponents + 2]))
        if added > 0.0:
            for k in range(0, WIDTH * count, WIDTH):
                put_lane(block, target + k, lane(block, target + k) + factor * lane(numbers, value + k))
        else:
            for k in range(0, WIDTH * count, WIDTH):
                put_lane(block, target + k, factor * lane(numbers, value + k))
        value += WIDTH * count


@entry(USER)
def write_by_length(t: float, z: Array, numbers: Array, block: Array) -> None:
    """Write the block of a LengthTable whose length is a profile in time, or a state."""
    if numbers[7] > 0.0:
        k = int(numbers[8])
        write_block((z[k], z[k + 1], z[int(numbers[9])]), numbers, block)
    else:
        write_block(profile_at(t, HEAD, numbers), numbers, block)


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
