"""Full sectional stiffness of beams about the node line, from resultants and the places of centroid and shear centre.

Strains at a point (y, z) of the section from those at the node line (x along the beam):

    eps' = eps + z kappa_y - y kappa_z      gamma_y' = gamma_y - z kappa_x      gamma_z' = gamma_z + y kappa_x

Axial force acts at the centroid, shear forces act at the shear centre.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.fem.sections.section import Resultants

PLACES = ("offset", "shear_centre", "mass_centre")


def shears(section: Any, options: dict[str, Any]) -> bool:
    """Whether the beam shears: as its options say, or where its section couples shear or its centres lie apart."""
    if options["shear"] is not None:
        return bool(options["shear"])
    apart = any(np.any(options[name]) for name in PLACES[:2] if options[name] is not None)
    return bool(getattr(section, "couples_shear", False)) or apart


def full_stiffness(resultants: Resultants, options: dict[str, Any], where: str) -> Array:
    """Stiffness (e, q, 6, 6) [N, N m, N m^2] over (eps, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z) about the node
    line.

    Raises ValueError when the section does not know its shear stiffness.
    """
    centroid = _place(options["offset"])
    centre = centroid + _place(options["shear_centre"])
    if resultants.coupled is not None:
        X = transformed(centroid, centroid)
        return np.asarray(X.T @ resultants.coupled @ X)
    if resultants.GAy is None or resultants.GAz is None:
        raise ValueError(
            f"{where} has shear deformation (option shear, or a centroid or shear centre off the node line), but its "
            "section has no shear stiffness; give GAy and GAz"
        )
    r = resultants
    assert r.GAy is not None and r.GAz is not None
    X = transformed(centroid, centre)
    diagonal = np.stack(np.broadcast_arrays(r.EA, r.GAy, r.GAz, r.GJ, r.EIy, r.EIz), axis=-1)
    return np.asarray(X.T @ (diagonal[..., None] * X))


def transformed(centroid: Array, shear_centre: Array) -> Array:
    """X (6, 6) [1]: strains at the centroid and the shear centre (2,) from those at the node line."""
    X = np.eye(6)
    X[0, 4], X[0, 5] = centroid[1], -centroid[0]
    X[1, 3], X[2, 3] = -shear_centre[1], shear_centre[0]
    return X


def mass_centre(resultants: Resultants, options: dict[str, Any]) -> Array:
    """Mass centre (e, q, 2) [m] or (2,) from the node line."""
    own = _place(options["offset"]) + _place(options["mass_centre"])
    return own if resultants.centre is None else own + resultants.centre


def _place(given: Any) -> Array:
    return np.zeros(2) if given is None else np.asarray(given, float)
