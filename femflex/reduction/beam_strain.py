"""Nonlinear strain of a straight beam on admissible functions: stretch of the axis by its slopes, and by twist."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.body import StrainTensors
from femflex.reduction.beam_functions import gauss
from femflex.reduction.strain import packed_cubic, packed_quartic
from femflex.reduction.uniform_beam import BeamFunctions, UniformBeam

Array = NDArray[np.float64]


def beam_strain(beam: UniformBeam, functions: BeamFunctions, X: Array, V1: Array) -> StrainTensors:
    """Strain tensors over the functions times X (count, n), with V1 (n, n) as it is.

    eps = u' + 1/2 (u'^2 + v'^2 + w'^2 + (I_p / A) theta'^2) at the axis, with EA; I_p / A = ry^2 + rz^2. Gauss points
    are enough for products of four slopes.
    """
    xi, weight = gauss(2 * functions.most + 24)
    slope = functions.fields(xi, beam.length, 1) @ X
    slope[:, 3] *= np.sqrt(beam.ry**2 + beam.rz**2)
    scale = np.sqrt(weight * beam.length * beam.EA * beam.taper.axial(xi))
    n = X.shape[1]
    i, j = np.triu_indices(n)
    pairs = 0.5 * np.einsum("pai,paj->pij", slope, slope, optimize=True)[:, i, j]
    columns = np.concatenate([slope[:, 0], pairs], axis=1) * scale[:, None]
    total = columns.T @ columns
    return StrainTensors(V1, np.zeros(n), packed_cubic(total, n), packed_quartic(total[n:, n:], n))
