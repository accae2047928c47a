"""Lumped areas of composite beams: PBCOMP with SECTION 1 to 5."""

from __future__ import annotations

from typing import NamedTuple

from femflex.decks.nastran.card import Card

# Signs of y and z of each area that an area of the card stands for, by SECTION: both axes, y, z, the centre, none.
MIRRORED = {
    1: ((1, 1), (-1, 1), (-1, -1), (1, -1)),
    2: ((1, 1), (1, -1)),
    3: ((1, 1), (-1, 1)),
    4: ((1, 1), (-1, -1)),
    5: ((1, 1),),
}
# Codes that no public deck or program confirms. An MSC deck of a circle of eight areas confirms 1 (its fractions add up
# to one when every area counts four times, those on an axis too); in result files all areas are listed with 5.
UNPROVEN = {
    2: "symmetric about the y axis: each area again at -z",
    3: "symmetric about the z axis: each area again at -y",
    4: "symmetric about the centre: each area again at -y, -z",
}
WHOLE = 1e-3  # by which the fractions may differ from one together


class LumpedArea(NamedTuple):
    """A part of a section's area at y, z [units of the deck], as a fraction of the whole, and its material."""

    y: float
    z: float
    fraction: float
    material: int


def lumped_parts(card: Card, symmetry: int) -> list[LumpedArea]:
    """The areas of a PBCOMP, with those that its symmetry adds.

    Raises ValueError for an unknown symmetry, no areas, or fractions that are not one together.
    """
    if symmetry not in MIRRORED:
        raise ValueError(f"{card} has SECTION {symmetry}; it is 0 to 5")
    parts = []
    for k in range(16, len(card.fields), 8):
        if not any(card.has(i) for i in range(k, k + 4)):
            continue
        y, z, fraction = (card.real(i, 0.0) for i in (k, k + 1, k + 2))
        material = card.integer(k + 3, card.integer(1))
        parts += [LumpedArea(sy * y, sz * z, fraction, material) for sy, sz in MIRRORED[symmetry]]
    total = sum(one.fraction for one in parts)
    if not parts or abs(total - 1) > WHOLE:
        raise ValueError(
            f"{card} has {len(parts)} lumped areas, those by symmetry included, whose fractions C add up to "
            f"{total:.6g}; they must add up to 1"
        )
    return parts
