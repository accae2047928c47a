"""Nonlinear strain of a straight beam on admissible functions: stretch by its slopes, curvature of large bends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.body import StrainTensors
from femflex.reduction.beam_functions import gauss
from femflex.reduction.strain import packed_cubic, packed_quartic
from femflex.reduction.uniform_beam import BeamFunctions, UniformBeam

Array = NDArray[np.float64]


def beam_strain(beam: UniformBeam, functions: BeamFunctions, X: Array, V1: Array, following: bool) -> StrainTensors:
    """Strain tensors over the functions times X (count, n), with V1 (n, n) as it is.

    The axis stretches by eps = u' + 1/2 (u'^2 + v'^2 + w'^2 + (I_p / A) theta'^2), I_p / A = ry^2 + rz^2, against EA.

    following: stretch is to follow bending (reduction.condense). Then u' is as small as v'^2: its square is left out,
    and what an inextensible beam's curvature has at fourth order comes in, kappa^2 = v''^2 + w''^2 + (v'v'' + w'w'')^2
    (between unequal bending stiffnesses the mixed term takes their geometric mean).
    """
    xi, weight = gauss(2 * functions.most + 24)
    slope, curvature = (functions.fields(xi, beam.length, derivative) @ X for derivative in (1, 2))
    slope[:, 3] *= np.sqrt(beam.ry**2 + beam.rz**2)
    dx, n = weight * beam.length, X.shape[1]
    sideways = slope[:, 1:] if following else slope
    stretched = np.concatenate([slope[:, 0], 0.5 * pairs(sideways, sideways)], axis=1)
    total = weighted_square(stretched, dx * beam.EA * beam.taper.axial(xi))
    if following:
        stiffness = np.sqrt([beam.EIz, beam.EIy])[:, None]
        bent = pairs(slope[:, 1:3] * stiffness, curvature[:, 1:3])
        total[n:, n:] += weighted_square(bent, dx * beam.taper.bending(xi))
    return StrainTensors(V1, np.zeros(n), packed_cubic(total, n), packed_quartic(total[n:, n:], n))


def pairs(a: Array, b: Array) -> Array:
    """Symmetric part of sum_r a_ri b_rj for i <= j, (p, n(n+1)/2), of rows (p, r, n)."""
    product = np.einsum("pri,prj->pij", a, b, optimize=True)
    i, j = np.triu_indices(a.shape[2])
    return np.asarray(0.5 * (product[:, i, j] + product[:, j, i]))


def weighted_square(columns: Array, weight: Array) -> Array:
    """columns^T diag(weight) columns."""
    return np.asarray(columns.T @ (weight[:, None] * columns))
