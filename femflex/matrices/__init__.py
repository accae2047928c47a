"""Bodies from mass and stiffness matrices of other programs, and Craig-Bampton models for them."""

from __future__ import annotations

import femflex.matrices.arrays
import femflex.matrices.coordinates
import femflex.matrices.market
import femflex.matrices.nastran  # noqa: F401  (each registers its formats)
from femflex.matrices.body import matrix_body
from femflex.matrices.checks import Finding, MatrixReport, StatedMass, check_model
from femflex.matrices.craig_bampton import craig_bampton_model
from femflex.matrices.full import full_model
from femflex.matrices.model import MatrixModel, Recovery
from femflex.matrices.read import Sources, read_matrices, symmetric
from femflex.matrices.write import write_matrices

__all__ = [
    "Finding",
    "MatrixModel",
    "MatrixReport",
    "Recovery",
    "Sources",
    "StatedMass",
    "check_model",
    "craig_bampton_model",
    "full_model",
    "matrix_body",
    "read_matrices",
    "symmetric",
    "write_matrices",
]
