"""Linear buckling in few coordinates."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from femflex.arrays import Array

STIFF = 1e3  # stiffness that fixes a marker, over the sum of that of all coordinates
ROUNDING = 1e-9  # magnitude of an eigenvalue below which it is zero


def lowest_of_few(K_sigma: Array, K: Array, constraint: Array | None) -> tuple[float, Array]:
    """Lowest eigenvalue mu [1] of K_sigma x = mu (K + C) x, 0 within rounding, and its shape x (n,), x.(K + C) x = 1.

    All matrices (n, n) [N/m, N, N m]; C is the constraint, taken as stiff.
    """
    K = K if constraint is None else K + STIFF * np.trace(K) / np.trace(constraint) * constraint
    mu, x = linalg.eigh(K_sigma, K, subset_by_index=[0, 0])
    return float(mu[0]) if abs(mu[0]) > ROUNDING else 0.0, x[:, 0]
