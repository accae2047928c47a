"""Beam sections by full 6 x 6 stiffness and mass: composite blades, where stretch, shear, twist and bending couple."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import field_serializer, model_validator

from femflex.arrays import Array
from femflex.fem.sections.materials import Material
from femflex.fem.sections.section import Outline, Resultants, ellipse
from femflex.noun.table import Table, refuse
from femflex.noun.values import PositiveLength, Quantity

SYMMETRIC = 1e-6  # of the largest entry, by which a matrix may differ from its transpose


class FullSection(Table):
    """A beam by full 6 x 6 stiffness and mass per length about its node line, such as a composite blade."""

    kind: Literal["full"] = "full"
    """Selects this section: by full matrices."""
    stiffness: Annotated[Array, Quantity("", (6, 6))]
    """Stiffness in SI over axial strain, shear strains along y and z, twist rate, curvatures about y and z."""
    mass: Annotated[Array, Quantity("", (6, 6))]
    """Mass per length in SI over velocities along x, y, z and rates about x, y, z."""
    radius: PositiveLength | None = None
    """Radius of the round bar that is drawn. Default: an ellipse with the stiffness's radii of gyration."""

    __eq__, __hash__ = object.__eq__, object.__hash__  # by identity: its values are arrays

    @model_validator(mode="after")
    def _matrices_fit(self) -> FullSection:
        for name in ("stiffness", "mass"):
            K = np.asarray(getattr(self, name), float)
            if np.abs(K - K.T).max() > SYMMETRIC * np.abs(K).max():
                refuse(f"{name} of a full section is not symmetric; give the matrix about one point")
            vars(self)[name] = (K + K.T) / 2
        if not np.linalg.eigvalsh(self._scaled())[0] > 0:
            refuse(
                "stiffness of a full section is not positive definite: the strain energy must be positive in "
                "every strain"
            )
        M = np.asarray(self.mass, float)
        if not M[0, 0] > 0 or np.abs(M[[1, 2], [1, 2]] - M[0, 0]).max() > SYMMETRIC * M[0, 0]:
            refuse(
                f"mass of a full section has {np.diag(M)[:3].tolist()} kg/m on its diagonal; these must be equal and "
                "positive"
            )
        y, z, yy, zz, yz = self._moments()
        if min(yy - y * y, zz - z * z) < 0 or (yy - y * y) * (zz - z * z) < (yz - y * z) ** 2:
            refuse("mass of a full section has moments of inertia that no distribution of mass has")
        return self

    @field_serializer("stiffness", "mass")
    def _listed(self, value: Array) -> Any:
        return value.tolist()

    @property
    def couples_shear(self) -> bool:
        """Whether the beam shears where its options do not say."""
        return True

    @property
    def varies(self) -> bool:
        """Whether anything changes along the member."""
        return False

    def resultants(self, material: Material | None, s: Array, length: Array | float) -> Resultants:
        """Stiffness and mass per length as `Resultants`, in SI; the material, if any, is not used."""
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
