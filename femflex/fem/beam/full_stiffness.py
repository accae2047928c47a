"""Full sectional stiffness of beams about the node line, from resultants and the positions of centroid and shear
centre.

Strains at a point (y, z) of the section from those at the node line (x along the beam):

    eps' = eps + z kappa_y - y kappa_z      gamma_y' = gamma_y - z kappa_x      gamma_z' = gamma_z + y kappa_x

Axial force acts at the centroid, shear forces act at the shear centre.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.fem.sections.section import Resultants

CENTRES = ("offset", "shear_centre", "mass_centre")


def shears(section: Any, options: dict[str, Any]) -> bool:
    """Whether the beam has shear deformation: by its options, or because its section couples shear or has eccentric
    centres."""
    if options["shear"] is not None:
        return bool(options["shear"])
    eccentric = any(np.any(options[name]) for name in CENTRES[:2] if options[name] is not None)
    return bool(getattr(section, "couples_shear", False)) or eccentric


def full_stiffness(resultants: Resultants, options: dict[str, Any], where: str) -> Array:
    """Stiffness (e, q, 6, 6) [N, N m, N m^2] over (eps, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z) about the node
    line.

    Raises ValueError when the section has no shear stiffness.
    """
    centroid = _position(options["offset"])
    centre = centroid + _position(options["shear_centre"])
    if resultants.coupled is not None:
        X = strain_transform(centroid, centroid)
        return np.asarray(X.T @ resultants.coupled @ X)
    if resultants.GAy is None or resultants.GAz is None:
        raise ValueError(
            f"{where} has shear deformation (option shear, or a centroid or shear centre off the node line), but its "
            "section has no shear stiffness; give GAy and GAz"
        )
    r = resultants
    assert r.GAy is not None and r.GAz is not None
    X = strain_transform(centroid, centre)
    diagonal = np.stack(np.broadcast_arrays(r.EA, r.GAy, r.GAz, r.GJ, r.EIy, r.EIz), axis=-1)
    return np.asarray(X.T @ (diagonal[..., None] * X))


def strain_transform(centroid: Array, shear_centre: Array) -> Array:
    """X (6, 6) [1]: strains at the centroid and the shear centre (2,) from those at the node line."""
    X = np.eye(6)
    X[0, 4], X[0, 5] = centroid[1], -centroid[0]
    X[1, 3], X[2, 3] = -shear_centre[1], shear_centre[0]
    return X


def mass_centre(resultants: Resultants, options: dict[str, Any]) -> Array:
    """Mass centre (e, q, 2) [m] or (2,) from the node line."""
    offset = _position(options["offset"]) + _position(options["mass_centre"])
    return offset if resultants.centre is None else offset + resultants.centre


def _position(value: Any) -> Array:
    return np.zeros(2) if value is None else np.asarray(value, float)
