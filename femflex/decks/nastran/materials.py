"""Materials: MAT1, MAT2, MAT8, MAT9, in SI, with PARAM,WTMASS and the overrides of the case."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from femflex.arrays import Array
from femflex.decks.nastran.bulk import Bulk, ByNumber
from femflex.decks.nastran.card import Card
from femflex.fem.sections.laminates import Lamina
from femflex.fem.sections.materials import Anisotropic, Material

RIGID_SHEAR = 1e4  # transverse shear modulus for a blank field (rigid), relative to the largest modulus in the plane
NOT_ELASTIC = {
    "MAT4": "heat conduction is left out",
    "MAT5": "heat conduction is left out",
    "MAT10": "fluid elements are left out; the mass of the fluid is missing",
    "MATS1": "plasticity is left out; the material stays linear",
    "MATT1": "dependence on temperature is left out; the values of MAT1 are used",
    "MATT2": "dependence on temperature is left out; the values of MAT2 are used",
    "MATT8": "dependence on temperature is left out; the values of MAT8 are used",
    "MATT9": "dependence on temperature is left out; the values of MAT9 are used",
    "MATHP": "hyperelasticity is left out",
}


@dataclass(frozen=True, eq=False)
class Elastic:
    """A material by number: kind 1, 2, 8 or 9 and its values in SI."""

    number: int
    kind: int
    values: dict[str, float]
    card: Card
    matrix: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def density(self) -> float:
        """[kg/m^3]"""
        return self.values["density"]

    def plane_stress(self) -> Array:
        """Q (3, 3) [Pa] between (11, 22, 12) stresses and strains in the plane. Raises ValueError for MAT9."""
        v = self.values
        if self.kind == 1:
            E, nu, G = v["E"], v["nu"], v["G"]
            if abs(1 - nu**2) < 1e-12:
                raise ValueError(f"{self.card} has Poisson's ratio {nu}; plates need one between -1 and 0.5")
            return np.array([[E, nu * E, 0], [nu * E, E, 0], [0, 0, G * (1 - nu**2)]]) / (1 - nu**2)
        if self.kind == 2:
            return self.matrix
        if self.kind == 8:
            E1, E2, nu, G = v["E1"], v["E2"], v["nu12"], v["G12"]
            scale = 1 - nu**2 * E2 / E1 if E1 else 1.0
            return np.array([[E1, nu * E2, 0], [nu * E2, E2, 0], [0, 0, G * scale]]) / scale
        raise ValueError(f"{self.card} is a material of solids; plates take MAT1, MAT2 or MAT8")

    def shear(self) -> Array:
        """G (2, 2) [Pa] between transverse shear stresses and strains, from this material alone."""
        v = self.values
        if self.kind == 1:
            return v["G"] * np.eye(2)
        if self.kind == 8:
            rigid = RIGID_SHEAR * max(v["E1"], v["E2"], v["G12"])
            return np.diag([v["G13"] or rigid, v["G23"] or rigid])
        if self.kind == 2:
            return self.matrix[:2, :2]  # where MID3 names a MAT2, G11, G12 and G22 are those of transverse shear
        raise ValueError(f"{self.card} is a material of solids; plates take MAT1, MAT2 or MAT8")

    def lamina(self) -> Lamina:
        """The material as a ply. Raises ValueError if it cannot be one."""
        v = self.values
        if self.kind == 1:
            return Lamina(E1=v["E"], E2=v["E"], G12=v["G"], nu12=v["nu"], density=v["density"])
        if self.kind == 8:
            G13, G23 = np.diag(self.shear())
            return Lamina(**{key: v[key] for key in ("E1", "E2", "G12", "nu12", "density")}, G13=G13, G23=G23)
        raise ValueError(f"{self.card} cannot be a ply here; plies take MAT1 or MAT8")

    def solid(self) -> Material | Anisotropic:
        """The material for solids. Raises ValueError for those of plates."""
        v = self.values
        if self.kind == 1:
            if not math.isclose(v["G"], v["E"] / (2 * (1 + v["nu"])), rel_tol=1e-2):
                return Anisotropic(_isotropic(v["E"], v["nu"], v["G"]), v["density"])
            return Material(E=v["E"], nu=v["nu"], density=v["density"])
        if self.kind == 9:
            return Anisotropic(self.matrix, v["density"])
        raise ValueError(f"{self.card} is a material of plates; solids take MAT1 or MAT9")

    def bar(self) -> tuple[float, float, float]:
        """E [Pa], G [Pa] and density for bars. Raises ValueError for others than MAT1."""
        if self.kind != 1:
            raise ValueError(f"{self.card} cannot be the material of bars; they take MAT1")
        return self.values["E"], self.values["G"], self.values["density"]


class Materials:
    """The materials of a deck by number."""

    def __init__(self, bulk: Bulk) -> None:
        self._bulk = bulk
        self._materials: ByNumber[Elastic] = ByNumber(bulk, "material", "it has")
        for name, read in (("MAT1", _mat1), ("MAT2", _mat2), ("MAT8", _mat8), ("MAT9", _mat9)):
            self._materials.read_cards(name, lambda card, read=read: self._elastic(card, read))  # type: ignore[misc]
        for name, consequence in NOT_ELASTIC.items():
            for card in bulk.cards_named(name, use=False):
                bulk.findings.unused(name, consequence, card.location)

    def _elastic(self, card: Card, read: Callable[[Card, float, float], Read]) -> Elastic:
        number = card.integer(0)
        p, rho = self._bulk.units.pressure, self._bulk.units.density * self._bulk.wtmass
        kind, values, matrix = read(card, p, rho)
        changed = self._bulk.override([f"mat_{number}"], values, str(card))
        if kind == 1 and (changed["E"], changed["nu"]) != (values["E"], values["nu"]) and changed["G"] == values["G"]:
            changed["G"] = changed["E"] / (2 * (1 + changed["nu"]))
        if changed["density"] < 0:
            raise ValueError(f"{card} has density {changed['density']:.6g} kg/m^3; it cannot be negative")
        return Elastic(number, kind, changed, card, matrix)

    def __call__(self, number: int) -> Elastic:
        """The material with this number. Raises ValueError if the deck has none."""
        if (material := self._materials(number)) is None:
            raise ValueError(f"names material {number}, which has an error")
        return material

    def all_materials(self) -> list[Elastic]:
        """All materials."""
        return self._materials.values()


Read = tuple[int, dict[str, float], Array]
NO_MATRIX = np.zeros((0, 0))


def _mat1(card: Card, p: float, rho: float) -> Read:
    """Two of E, G and nu are given; the third is that of an isotropic material."""
    E, G, nu = card.has(1), card.has(2), card.has(3)
    e, g, n = card.real(1, 0.0) * p, card.real(2, 0.0) * p, card.real(3, 0.0)
    if E and nu and not G:
        g = e / (2 * (1 + n))
    elif E and G and not nu:
        n = e / (2 * g) - 1 if g else 0.0
    elif G and nu and not E:
        e = 2 * g * (1 + n)
    elif E and not G and not nu:
        g, n = 0.0, 0.0
    if not e > 0 and not g > 0:
        raise ValueError(f"{card} has neither E nor G; give one of them")
    return 1, {"E": e, "G": g, "nu": n, "density": card.real(4, 0.0) * rho}, NO_MATRIX


def _mat2(card: Card, p: float, rho: float) -> Read:
    a, b, c, d, e, f = (card.real(k, 0.0) * p for k in range(1, 7))
    return 2, {"density": card.real(7, 0.0) * rho}, np.array([[a, b, c], [b, d, e], [c, e, f]])


def _mat8(card: Card, p: float, rho: float) -> Read:
    names = (("E1", 1), ("E2", 2), ("G12", 4), ("G13", 5), ("G23", 6))
    values = {name: card.real(k, 0.0) * p for name, k in names}
    return 8, {**values, "nu12": card.real(3, 0.0), "density": card.real(7, 0.0) * rho}, NO_MATRIX


def _mat9(card: Card, p: float, rho: float) -> Read:
    """Components are 11, 22, 33, 12, 23, 31 on the card and 11, 22, 33, 23, 31, 12 in the returned matrix."""
    C = np.zeros((6, 6))
    C[np.triu_indices(6)] = [value * p for value in card.reals(1, 21)]
    C = C + np.triu(C, 1).T
    order = [0, 1, 2, 4, 5, 3]
    return 9, {"density": card.real(22, 0.0) * rho}, C[np.ix_(order, order)]


def _isotropic(E: float, nu: float, G: float) -> Array:
    """Elastic matrix of a MAT1 whose G differs from E / (2 (1 + nu))."""
    C = np.zeros((6, 6))
    C[:3, :3] = E * nu / ((1 + nu) * (1 - 2 * nu))
    C[range(3), range(3)] += E / (1 + nu)
    C[range(3, 6), range(3, 6)] = G
    return C
