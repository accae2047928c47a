"""Linear elastic materials of decks, as materials of solids, plies, plates and bars, in SI."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.fem.sections.laminates import Lamina
from femflex.fem.sections.materials import Anisotropic, Material, Orthotropic

RIGID_SHEAR = 1e4  # transverse shear modulus that is not given (rigid), relative to the largest modulus in the plane


@dataclass(frozen=True, eq=False)
class Elastic:
    """A linear elastic material.

    name, label  in overrides, and in errors
    location     of its card or keyword
    values       density [kg/m^3]; E, G and nu, or E1, E2, nu12, G12, G13, G23, or also E3, nu13, nu23; moduli [Pa]
    matrix       in place of moduli: (3, 3) in plane stress, or (6, 6), in the order 11, 22, 33, 23, 13, 12 [Pa]
    """

    name: str
    label: str
    location: object
    values: dict[str, float]
    matrix: Array | None = None

    @property
    def density(self) -> float:
        """[kg/m^3]"""
        return self.values["density"]

    @property
    def isotropic(self) -> bool:
        """Whether the material is isotropic."""
        return "E" in self.values

    def plane_stress(self) -> Array:
        """Q (3, 3) [Pa] between (11, 22, 12) stresses and strains in the plane. Raises ValueError for materials of
        solids."""
        if self.matrix is not None:
            self._require(self.matrix.shape == (3, 3), "plates", "MAT1, MAT2 or MAT8")
            return self.matrix
        E1, E2, nu, G = self._in_plane()
        scale = 1 - nu**2 * E2 / E1 if E1 else 1.0
        if abs(scale) < 1e-12:
            raise ValueError(f"{self.label} has Poisson's ratio {nu}; plates need one between -1 and 0.5")
        return np.array([[E1, nu * E2, 0], [nu * E2, E2, 0], [0, 0, G * scale]]) / scale

    def shear(self) -> Array:
        """G (2, 2) [Pa] between transverse shear stresses and strains, from this material alone."""
        if self.matrix is not None:  # where MID3 names a MAT2, G11, G12 and G22 are those of transverse shear
            return self.plane_stress()[:2, :2]
        if self.isotropic:
            return self.values["G"] * np.eye(2)
        rigid = RIGID_SHEAR * max(self.values[key] for key in ("E1", "E2", "G12"))
        return np.diag([self.values[key] or rigid for key in ("G13", "G23")])

    def lamina(self) -> Lamina:
        """The material as a ply. Raises ValueError if it cannot be one."""
        if self.matrix is None:
            E1, E2, nu, G = self._in_plane()
            G13, G23 = np.diag(self.shear())
            return Lamina(E1=E1, E2=E2, G12=G, nu12=nu, density=self.density, G13=G13, G23=G23)
        self._require(self.matrix.shape == (6, 6), "plies", "MAT1 or MAT8")
        S = np.linalg.inv(self.matrix)
        E1, E2 = 1 / S[0, 0], 1 / S[1, 1]
        shear = {"G12": 1 / S[5, 5], "G13": 1 / S[4, 4], "G23": 1 / S[3, 3]}
        return Lamina(E1=E1, E2=E2, nu12=-S[0, 1] * E1, density=self.density, **shear)

    def solid(self) -> Material | Orthotropic | Anisotropic:
        """The material for solids. Raises ValueError for those of plates."""
        v = self.values
        if self.matrix is not None and self.matrix.shape == (6, 6):
            return Anisotropic(self.matrix, self.density)
        if "E3" in v:
            return Orthotropic(**v)
        self._require(self.isotropic, "solids", "MAT1 or MAT9, ENGINEERING CONSTANTS, ORTHO or ISOTROPIC")
        E, nu, G = v["E"], v["nu"], v["G"]
        if math.isclose(G, E / (2 * (1 + nu)), rel_tol=1e-2):
            return Material(E=E, nu=nu, density=self.density)
        C = np.zeros((6, 6))
        C[:3, :3] = E * nu / ((1 + nu) * (1 - 2 * nu))
        C[range(3), range(3)] += E / (1 + nu)
        C[range(3, 6), range(3, 6)] = G
        return Anisotropic(C, self.density)

    def bar(self) -> tuple[float, float, float]:
        """E [Pa], G [Pa] and density for bars, along axis 1."""
        if self.isotropic:
            return self.values["E"], self.values["G"], self.density
        lamina = self.lamina()
        return lamina.E1, lamina.G12, self.density

    def _in_plane(self) -> list[float]:
        return [self.values[key] for key in (("E", "E", "nu", "G") if self.isotropic else ("E1", "E2", "nu12", "G12"))]

    def _require(self, fits: bool, what: str, others: str) -> None:
        if not fits:
            raise ValueError(f"{self.label} cannot be the material of {what}; they take {others}")
