"""Root mean squares of stress under random motion, from the covariance of the amplitudes.

A quantity that is linear in the amplitudes y = L z, with independent z of variance 1, has the mean square sum_j
q(L_j)^2.
So has von Mises' stress, whose square is a quadratic form of such quantities (D. J. Segalman et al., An efficient
method for calculating rms von Mises stress in a random vibration environment, Sandia SAND98-0260, 1998).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.body.recovery import (
    FIBRE_STRESS,
    RESULTANTS,
    VON_MISES,
    ply_names,
    ply_stresses,
    quantities,
    resultants,
)
from femflex.body.strain_field import StrainPart

ANGLES = np.arange(0.0, np.pi, np.pi / 36.0)  # around a round section, at which its fibres are looked at
SMALLEST = 1e-14  # of the largest variance: smaller ones are rounding


def root_of(covariance: Array) -> Array:
    """Rows L (r, n) with L^T L equal to a covariance (n, n) of amplitudes, in units of the amplitudes."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    large = values > SMALLEST * values.max(initial=0.0)
    return np.asarray(np.sqrt(values[large])[:, None] * vectors[:, large].T)


def rms_stress(part: StrainPart, covariance: Array) -> dict[str, Array]:
    """Root mean square (p,) of each quantity of a part, in the units of `quantities`, for a covariance (n, n).

    Stress about the mean state, without the initial one; in first order of the amplitudes.
    """
    L = root_of(covariance)
    part = replace(part, stress=np.zeros_like(part.stress), quadratic=np.zeros_like(part.quadratic))
    names, forces = RESULTANTS[part.kind][0], resultants(part, L)
    out = {name: np.sqrt((forces[..., k] ** 2).sum(axis=0)) for k, name in enumerate(names[: forces.shape[2]])}
    stress = ply_stresses(part, L) if part.plies.size else None
    if stress is not None:
        squares = (stress**2).sum(axis=0)
        out |= {name: np.sqrt(squares[:, k, :, c].max(axis=1)) for name, (k, c) in ply_names(part).items()}
    known = quantities([part])
    if FIBRE_STRESS in known:
        fibres = _fibre_squares(part, forces)
        out[FIBRE_STRESS] = np.sqrt(fibres)
        if VON_MISES in known:
            shear = ((forces[..., 3] * part.fibres[:, 3]) ** 2).sum(axis=0)
            out[VON_MISES] = np.sqrt(fibres + 3.0 * shear)
    elif VON_MISES in known:
        out[VON_MISES] = np.sqrt(_von_mises_squares(part, forces, stress))
    return out


def _fibre_squares(part: StrainPart, forces: Array) -> Array:
    """Largest mean square (p,) [Pa^2] of the stress along a line over the fibres of its section."""
    along = forces * part.fibres[:, : forces.shape[2]]
    if forces.shape[2] == 1:
        return np.asarray((along[..., 0] ** 2).sum(axis=0))
    corners = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
    circle = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
    is_round = ~np.isnan(part.fibres[:, 3])

    def largest(directions: Array) -> Array:
        each = [along[..., 0] + a * along[..., 1] + b * along[..., 2] for a, b in directions]
        return np.asarray(np.max([(stress**2).sum(axis=0) for stress in each], axis=0))

    return np.where(is_round, largest(np.vstack([circle, -circle])), largest(corners))


def _von_mises_squares(part: StrainPart, forces: Array, plies: Array | None) -> Array:
    """Largest mean square (p,) [Pa^2] of von Mises' stress over the faces of a plate, or that of a solid."""
    if part.kind == "solid":
        xx, yy, zz, yz, xz, xy = np.moveaxis(forces, 2, 0)
        squares = ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2.0 + 3.0 * (yz**2 + xz**2 + xy**2)
        return np.asarray(squares.sum(axis=0))
    if plies is not None:
        xx, yy, xy = np.moveaxis(plies, -1, 0)
        return np.asarray((xx**2 - xx * yy + yy**2 + 3.0 * xy**2).sum(axis=0).max(axis=(1, 2)))
    h, faces = 2.0 * part.lever, []
    for sign in (1.0, -1.0):
        xx, yy, xy = np.moveaxis(
            forces[..., :3] / h[..., None] + sign * 6.0 * forces[..., 3:6] / h[..., None] ** 2, 2, 0
        )
        faces.append((xx**2 - xx * yy + yy**2 + 3.0 * xy**2).sum(axis=0))
    return np.asarray(np.maximum(*faces))
