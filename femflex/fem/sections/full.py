"""Beam sections by full 6 x 6 stiffness and mass: composite blades, where stretch, shear, twist and bending couple."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.fem.sections.materials import Material
from femflex.fem.sections.section import Outline, Resultants, ellipse

SYMMETRIC = 1e-6  # of the largest entry, by which a matrix may differ from its transpose


@dataclass(frozen=True, eq=False)
class FullSection:
    """A section by its stiffness and mass per length, about the node line; no material is used.

    stiffness  (6, 6) over (eps, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z): forces N, V_y, V_z, moments M_x, M_y, M_z
               [N, N m, N m^2] (the order of VABS and BeamDyn, x along the beam)
    mass       (6, 6) over velocities (u, v, w) and rates (x, y, z) [kg/m, kg, kg m]
    radius     of the round bar that is drawn [m]; without it an ellipse of the stiffness's radii of gyration
    """

    stiffness: ArrayLike
    mass: ArrayLike
    radius: float | None = None

    def __post_init__(self) -> None:
        for name in ("stiffness", "mass"):
            K = np.asarray(getattr(self, name), float)
            if K.shape != (6, 6) or not np.isfinite(K).all():
                raise ValueError(f"{name} of a full section must be 6 x 6 finite numbers; found shape {K.shape}")
            if np.abs(K - K.T).max() > SYMMETRIC * np.abs(K).max():
                raise ValueError(f"{name} of a full section is not symmetric; give the matrix about one point")
            object.__setattr__(self, name, (K + K.T) / 2)
        if not np.linalg.eigvalsh(self._scaled())[0] > 0:
            raise ValueError(
                "stiffness of a full section is not positive definite: the strain energy must be positive in "
                "every strain"
            )
        M = np.asarray(self.mass, float)
        if not M[0, 0] > 0 or np.abs(M[[1, 2], [1, 2]] - M[0, 0]).max() > SYMMETRIC * M[0, 0]:
            raise ValueError(
                f"mass of a full section has {np.diag(M)[:3].tolist()} kg/m on its diagonal; these must be equal and "
                "positive"
            )
        y, z, yy, zz, yz = self._moments()
        if min(yy - y * y, zz - z * z) < 0 or (yy - y * y) * (zz - z * z) < (yz - y * z) ** 2:
            raise ValueError("mass of a full section has moments of inertia that no distribution of mass has")

    @property
    def couples_shear(self) -> bool:
        """Whether the beam shears where its options do not say."""
        return True

    @property
    def varies(self) -> bool:
        """Whether anything changes along the member."""
        return False

    def resultants(self, material: Material | None, s: Array, length: Array | float) -> Resultants:
        """Stiffness and mass per length as `Resultants`; the material, if any, is not used."""
        K, M = np.asarray(self.stiffness, float), np.asarray(self.mass, float)
        ones = np.ones(np.shape(s))
        EA, GAy, GAz, GJ, EIy, EIz = (value * ones for value in np.diag(K))
        y, z, yy, zz, yz = self._moments()
        return Resultants(
            EA, GJ, EIy, EIz, M[0, 0] * ones, (zz - z * z) * ones, (yy - y * y) * ones, (EIy + EIz) / EA, GAy, GAz,
            coupled=np.broadcast_to(K, (*np.shape(s), 6, 6)),
            centre=np.broadcast_to([y, z], (*np.shape(s), 2)),
            product=(yz - y * z) * ones,
        )  # fmt: skip

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        K = np.asarray(self.stiffness, float)
        ones = np.ones(np.shape(s))
        if self.radius is not None:
            return ellipse(self.radius * ones, self.radius * ones)
        return ellipse(2 * np.sqrt(K[5, 5] / K[0, 0]) * ones, 2 * np.sqrt(K[4, 4] / K[0, 0]) * ones)

    def _moments(self) -> tuple[float, float, float, float, float]:
        """y and z of the mass centre, means of y^2, z^2 and y z over the mass, about the node line."""
        M = np.asarray(self.mass, float)
        m = M[0, 0]
        return -M[0, 5] / m, M[0, 4] / m, M[5, 5] / m, M[4, 4] / m, -M[4, 5] / m

    def _scaled(self) -> Array:
        K = np.asarray(self.stiffness, float)
        size = np.sqrt(np.maximum(np.diag(K), 0.0))
        return K / np.where(size > 0, size, 1.0) / np.where(size > 0, size, 1.0)[:, None]
