"""Linear buckling in few coordinates."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from femflex.arrays import Array

STIFF = 1e3  # times the stiffness of all coordinates: what holds a marker in its place
ROUNDING = 1e-9  # part of its stiffness that a load takes from a shape, below which it takes none


def lowest_of_few(K_sigma: Array, K: Array, held: Array | None) -> tuple[float, Array]:
    """Lowest eigenvalue mu [1] of K_sigma x = mu (K + held) x, 0 within rounding, and its shape x (n,), x.(K + held) x
    = 1.

    All matrices (n, n) [N/m, N, N m]; held is taken as stiff.
    """
    K = K if held is None else K + STIFF * np.trace(K) / np.trace(held) * held
    mu, x = linalg.eigh(K_sigma, K, subset_by_index=[0, 0])
    return float(mu[0]) if abs(mu[0]) > ROUNDING else 0.0, x[:, 0]
