"""Materials: MAT1, MAT2, MAT8, MAT9, in SI, with PARAM,WTMASS and the overrides of the case."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.decks.materials import Elastic
from femflex.decks.nastran.bulk import Bulk, ByNumber
from femflex.decks.nastran.card import Card

ORTHOTROPIC = {"E1": 1, "E2": 2, "G12": 4, "G13": 5, "G23": 6}  # fields of MAT8
DENSITY = {"MAT1": 4, "MAT2": 7, "MAT8": 7, "MAT9": 22}


class Materials:
    """The materials of a deck by number."""

    def __init__(self, bulk: Bulk) -> None:
        self._bulk = bulk
        self._materials: ByNumber[Elastic] = ByNumber(bulk, "material", "it has")
        for name in DENSITY:
            self._materials.read_cards(name, self._elastic)

    def _elastic(self, card: Card) -> Elastic:
        name, p, matrix = f"mat_{card.integer(0)}", self._bulk.units.pressure, None
        values: dict[str, float] = {}
        if card.name == "MAT1":
            values = _isotropic(card, p)
        elif card.name == "MAT8":
            values = {key: card.real(k, 0.0) * p for key, k in ORTHOTROPIC.items()} | {"nu12": card.real(3, 0.0)}
        else:
            matrix = _matrix(card) * p
        values["density"] = card.real(DENSITY[card.name], 0.0) * self._bulk.units.density * self._bulk.wtmass
        changed = self._bulk.override([name], values, str(card))
        if "E" in values and changed["G"] == values["G"] and any(changed[k] != values[k] for k in ("E", "nu")):
            changed["G"] = changed["E"] / (2 * (1 + changed["nu"]))
        if changed["density"] < 0:
            raise ValueError(f"{card} has density {changed['density']:.6g} kg/m^3; it cannot be negative")
        return Elastic(name, str(card), card.location, changed, matrix)

    def __call__(self, number: int) -> Elastic:
        """The material with this number. Raises ValueError if the deck has none."""
        if (material := self._materials(number)) is None:
            raise ValueError(f"names material {number}, which has an error")
        return material

    def bar(self, number: int) -> tuple[float, float, float]:
        """E [Pa], G [Pa] and density of a material of bars. Raises ValueError for others than MAT1."""
        material = self(number)
        if not material.isotropic:
            raise ValueError(f"{material.label} cannot be the material of bars; they take MAT1")
        return material.bar()

    def all_materials(self) -> list[Elastic]:
        """All materials."""
        return self._materials.values()


def _isotropic(card: Card, p: float) -> dict[str, float]:
    """Two of E, G and nu are given; the third is that of an isotropic material."""
    has_E, has_G, has_nu = (card.has(k) for k in (1, 2, 3))
    E, G, nu = card.real(1, 0.0) * p, card.real(2, 0.0) * p, card.real(3, 0.0)
    if has_E and has_nu and not has_G:
        G = E / (2 * (1 + nu))
    elif has_E and has_G and not has_nu:
        nu = E / (2 * G) - 1 if G else 0.0
    elif has_G and has_nu and not has_E:
        E = 2 * G * (1 + nu)
    if not E > 0 and not G > 0:
        raise ValueError(f"{card} has neither E nor G; give one of them")
    return {"E": E, "G": G, "nu": nu}


def _matrix(card: Card) -> Array:
    """The symmetric matrix of MAT2 (3, 3), or of MAT9 (6, 6), whose order on the card is 11, 22, 33, 12, 23, 31."""
    n = 3 if card.name == "MAT2" else 6
    C = np.zeros((n, n))
    C[np.triu_indices(n)] = card.reals(1, n * (n + 1) // 2)
    C = C + np.triu(C, 1).T
    order = [0, 1, 2, 4, 5, 3] if n == 6 else [0, 1, 2]
    return C[np.ix_(order, order)]
