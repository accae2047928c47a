"""Points that represent the mass of a beam's section, with its second moments."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array


def section_points(rz2: Array, ry2: Array, rotary: bool = True, product: Array | None = None) -> tuple[Array, Array]:
    """Offsets (..., k, 3) from the line in axes of the section, x along the beam, and their shares of its mass (k,).

    rz2, ry2 (...): squared radii of gyration, int y^2 dm and int z^2 dm per mass [m^2]; product: int y z dm per mass.

    Four points at (+-sqrt(2) rz, 0) and (0, +-sqrt(2) ry) have these moments. Without rotary the section has no inertia
    in bending, but still p = ry2 + rz2 in twist: int o o^T dm = p/2 diag(-1, 1, 1), the inertia diag(p, 0, 0), by
    points on all three axes, those along x with negative mass. Rigid rotations of the body and elastic slopes then both
    have no rotary inertia; without it for slopes only, the two would differ in mass.
    """
    o = np.zeros_like(rz2)
    if rotary and product is not None:
        moments = np.stack([np.stack([rz2, product], axis=-1), np.stack([product, ry2], axis=-1)], axis=-2)
        value, axes = np.linalg.eigh(moments)
        arms = np.sqrt(2 * np.maximum(value, 0.0))[..., None, :] * axes  # columns: the two principal arms
        flat = [(o, sign * arms[..., 0, k], sign * arms[..., 1, k]) for k in (0, 1) for sign in (1, -1)]
        share = np.full(4, 0.25)
    elif rotary:
        a, b = np.sqrt(2 * rz2), np.sqrt(2 * ry2)
        flat = [(o, a, o), (o, -a, o), (o, o, b), (o, o, -b)]
        share = np.full(4, 0.25)
    else:
        a = np.sqrt((rz2 + ry2) / 2)
        flat = [(a, o, o), (-a, o, o), (o, a, o), (o, -a, o), (o, o, a), (o, o, -a)]
        share = np.array([-0.5, -0.5, 0.5, 0.5, 0.5, 0.5])
    return np.stack([np.stack(point, axis=-1) for point in flat], axis=-2), share
