"""Lumped areas of composite beams: PBCOMP with SECTION 1 to 5."""

from __future__ import annotations

from typing import NamedTuple

from femflex.decks.nastran.card import Card

# Signs of y and z of the areas that one area of the card represents, by SECTION: symmetry about both axes, y, z, the
# centre, or none.
MIRRORED = {
    1: ((1, 1), (-1, 1), (-1, -1), (1, -1)),
    2: ((1, 1), (1, -1)),
    3: ((1, 1), (-1, 1)),
    4: ((1, 1), (-1, -1)),
    5: ((1, 1),),
}
# Codes without confirmation by a public deck or program. An MSC deck with a circle of eight areas confirms 1: its
# fractions add up to one if every area counts four times, also those on an axis. Result files list all areas with 5.
UNCONFIRMED = {
    2: "symmetric about the y axis: each area again at -z",
    3: "symmetric about the z axis: each area again at -y",
    4: "symmetric about the centre: each area again at -y, -z",
}
FRACTION_TOLERANCE = 1e-3  # permitted difference of the sum of the fractions from one


class LumpedArea(NamedTuple):
    """A part of a section's area at y, z [units of the deck], as a fraction of the total, and its material."""

    y: float
    z: float
    fraction: float
    material: int


def lumped_parts(card: Card, symmetry: int) -> list[LumpedArea]:
    """The areas of a PBCOMP, with those that its symmetry adds.

    Raises ValueError for an unknown symmetry, no areas, or fractions whose sum is not one.
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
    total = sum(area.fraction for area in parts)
    if not parts or abs(total - 1) > FRACTION_TOLERANCE:
        raise ValueError(
            f"{card} has {len(parts)} lumped areas, those by symmetry included, whose fractions C add up to "
            f"{total:.6g}; they must add up to 1"
        )
    return parts
