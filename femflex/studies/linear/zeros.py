"""Transmission zeros of a linear model: frequencies at which an input does not affect any output."""

from __future__ import annotations

import numpy as np

from femflex.arrays import ComplexArray
from femflex.studies.linear.space import StateSpace

FARTHEST = 1e3  # times the largest pole: zeros beyond it are zeros at infinity, split by rounding
SINGULAR = 1e-12  # of the largest singular value of G(s0) below which inputs or outputs depend on each other


def transmission_zeros(model: StateSpace) -> ComplexArray:
    """Finite transmission zeros [1/s] of a model with as many inputs as outputs, by rising size.

    With s = s0 + 1 / w the model becomes one whose feedthrough is G(s0), so that its zeros are the eigenvalues
    w of -R + R B G(s0)^-1 C R, R = (s0 - A)^-1; those at infinity become w = 0. Uncontrollable and unobservable
    poles are among them. Raises ValueError where inputs and outputs differ in number, or depend on each other.
    """
    if len(model.inputs) != len(model.outputs) or not model.inputs:
        raise ValueError(
            f"transmission zeros need as many inputs as outputs; found {len(model.inputs)} and {len(model.outputs)}. "
            "Choose some of them (--inputs, --outputs)"
        )
    size = float(np.abs(model.eigenvalues()).max(initial=0.0)) or 1.0
    s0 = 1.2345 * size  # to the right of all poles
    R = np.linalg.inv(s0 * np.eye(len(model.A)) - model.A)
    G = model.D + model.C @ R @ model.B
    scale_in = np.linalg.norm(G, axis=0)
    sigma = np.linalg.svd(G / np.where(scale_in > 0, scale_in, 1.0), compute_uv=False)
    if not sigma[-1] > SINGULAR * sigma[0]:
        raise ValueError(
            "the transfer matrix is singular at all frequencies, so there are no transmission zeros; choose other "
            "inputs or outputs"
        )
    w = np.asarray(np.linalg.eigvals(-R + R @ model.B @ np.linalg.solve(G, model.C @ R)), complex)
    zeros = s0 + 1.0 / w[np.abs(w) > 1.0 / (FARTHEST * size)]
    zeros = zeros[np.abs(zeros) < FARTHEST * size]
    return zeros[np.argsort(np.abs(zeros), kind="stable")]
