"""Elastic materials, and their elastic matrices in the order xx, yy, zz, yz, xz, xy."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import model_validator

from femflex.arrays import Array
from femflex.noun.table import Table
from femflex.noun.values import Quantity

Modulus = Annotated[float, Quantity("Pa", above=0.0)]
Density = Annotated[float, Quantity("kg/m^3", least=0.0)]
Poisson = Annotated[float, Quantity("", above=-1.0, below=0.5)]

VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
PARALLEL = 1e-6  # sine of the angle below which two directions are one


class Material(Table):
    """An isotropic linear elastic material."""

    kind: Literal["isotropic"] = "isotropic"
    """Selects this material: isotropic."""
    E: Modulus
    """Elastic (Young's) modulus."""
    nu: Poisson = 0.3
    """Poisson's ratio."""
    density: Density
    """Mass per volume."""
    G: Modulus = None  # type: ignore[assignment]
    """Shear modulus. Default: E / 2(1 + nu)."""

    @model_validator(mode="after")
    def _shears(self) -> Material:
        if self.G is None:
            vars(self)["G"] = self.E / (2.0 * (1.0 + self.nu))
        return self


@dataclass(frozen=True)
class Orthotropic:
    """An orthotropic linear elastic material for solids, along its own axes 1, 2 and 3.

    E1, E2, E3        Young's moduli [N/m^2]
    G12, G13, G23     shear moduli [N/m^2]
    nu12, nu13, nu23  Poisson's ratios: pull along the first axis, contraction along the second
    density           [kg/m^3]
    """

    E1: float
    E2: float
    E3: float
    G12: float
    G13: float
    G23: float
    nu12: float
    nu13: float
    nu23: float
    density: float

    def __post_init__(self) -> None:
        for constant in fields(self):
            value = getattr(self, constant.name)
            if (
                not math.isfinite(value)
                or (constant.name[0] in "EG" and value <= 0)
                or (constant.name == "density" and value < 0)
            ):
                raise ValueError(
                    f"{constant.name} of an orthotropic material is {value}; moduli are positive, the density is not "
                    "negative, all are finite"
                )
        _require_positive(self.elasticity(), "nu12, nu13 and nu23 of an orthotropic material")

    def elasticity(self) -> Array:
        """Elastic matrix (6, 6) [N/m^2] along its axes, order 11, 22, 33, 23, 13, 12."""
        return np.asarray(np.linalg.inv(self._compliance()))

    def _compliance(self) -> Array:
        S = np.diag([1 / self.E1, 1 / self.E2, 1 / self.E3, 1 / self.G23, 1 / self.G13, 1 / self.G12])
        S[0, 1] = S[1, 0] = -self.nu12 / self.E1
        S[0, 2] = S[2, 0] = -self.nu13 / self.E1
        S[1, 2] = S[2, 1] = -self.nu23 / self.E2
        return S


@dataclass(frozen=True, eq=False)
class Anisotropic:
    """A linear elastic material for solids by its elastic matrix C (6, 6) [N/m^2], order 11, 22, 33, 23, 13, 12, of
    engineering shears, along its own axes; density [kg/m^3]."""

    C: ArrayLike
    density: float

    def __post_init__(self) -> None:
        C = np.asarray(self.C, float)
        if C.shape != (6, 6) or not np.isfinite(C).all() or not np.allclose(C, C.T, rtol=1e-6, atol=0.0):
            raise ValueError("the elastic matrix of an anisotropic material must be 6 x 6, symmetric and finite")
        _require_positive(C, "the constants of an anisotropic material")
        if not math.isfinite(self.density) or self.density < 0:
            raise ValueError(f"density is {self.density} kg/m^3; it must be finite and cannot be negative")

    def elasticity(self) -> Array:
        """Elastic matrix (6, 6) [N/m^2] along its axes."""
        C = np.asarray(self.C, float)
        return (C + C.T) / 2


def _require_positive(C: Array, what: str) -> None:
    smallest = float(np.linalg.eigvalsh(C)[0])
    if not smallest > 0:
        raise ValueError(
            f"{what} make an elastic matrix that is not positive definite (least eigenvalue {smallest:.3g} N/m^2); the "
            "strain energy must be positive in every strain, so correct the constants"
        )


def elasticity(material: Material | Orthotropic | Anisotropic, axes: Array | None = None) -> Array:
    """Elastic matrix (6, 6) [N/m^2] of the material whose axes are the rows of axes (3, 3), in mesh axes."""
    if isinstance(material, Material):
        return isotropic_elasticity(material)
    C = material.elasticity()
    if axes is None:
        return C
    R = strain_rotation(axes)
    return np.asarray(R.T @ C @ R)


def isotropic_elasticity(material: Material) -> Array:
    """Elastic matrix (6, 6) [N/m^2]: lambda and mu from E and nu, shears with the material's G."""
    E, nu = material.E, material.nu
    lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / (2 * (1 + nu))
    C = np.diag([2 * mu] * 3 + [material.G] * 3)
    C[:3, :3] += lam
    return C


def strain_rotation(axes: Array) -> Array:
    """R (6, 6): engineering strains along the rows of axes (3, 3) from those in mesh axes, eps' = axes eps axes^T."""
    R = np.zeros((6, 6))
    for row, (i, j) in enumerate(VOIGT):
        for column, (a, b) in enumerate(VOIGT):
            value = axes[i, a] * axes[j, b] + (axes[i, b] * axes[j, a] if a != b else 0.0)
            R[row, column] = value / (2 if a != b else 1) * (2 if i != j else 1)
    return R


def material_axes(directions: ArrayLike, where: str) -> Array:
    """Axes (3, 3) as rows from two directions (6,): the first along axis 1, the second in the plane of axes 1 and 2.

    Raises ValueError when these are not two different directions.
    """
    vectors = np.asarray(directions, float)
    if vectors.shape != (6,) or not np.isfinite(vectors).all():
        raise ValueError(
            f"{where} has axes {directions!r}; give six numbers: a direction of axis 1, then one of axis 2"
        )
    first, second = vectors[:3], vectors[3:]
    size = np.linalg.norm(first) * np.linalg.norm(second)
    third = np.cross(first, second)
    if not size or np.linalg.norm(third) < PARALLEL * size:
        raise ValueError(
            f"{where} has axes {vectors.tolist()}, whose directions are parallel or zero; give two that differ"
        )
    x, z = first / np.linalg.norm(first), third / np.linalg.norm(third)
    return np.stack([x, np.cross(z, x), z])
