"""Elastic matrices of solid materials along their own axes, in the order xx, yy, zz, yz, xz, xy."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.fem.sections.materials import Anisotropic, Material, Orthotropic

VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
PARALLEL = 1e-6  # sine of the angle below which two directions are one


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
