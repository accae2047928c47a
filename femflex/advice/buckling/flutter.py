"""Under how much of a load that follows it an elastic body begins to sway, or to give way.

(K + lambda G - omega^2 M) x = 0 with G not symmetric, for the work of a following load depends on the path. Two of the
omega^2 meet and turn complex (flutter, Beck's column at 20.05 EI/L^2), or one passes zero (the body gives way). Without
damping: a little of it, inside the material, may bring a flutter at half the load (Ziegler, 1952).
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from femflex.arrays import Array

MOST = 8.0  # times the load, up to which it is looked for
STEPS = 80
COMPLEX = 1e-4  # imaginary over real part of omega^2, from which it counts
HALVINGS = 20


def first_flutter(K: Array, G: Array, M: Array) -> float:
    """Least positive lambda up to MOST from which on omega^2 of (K + lambda G, M) is not real and positive, else inf.

    K and M (m, m) symmetric and positive.
    """
    L = linalg.cholesky(M, lower=True)
    A, B = (linalg.solve_triangular(L, linalg.solve_triangular(L, X, lower=True).T, lower=True).T for X in (K, G))

    def steady(share: float) -> bool:
        squares = np.linalg.eigvals(A + share * B)
        return bool(np.all(squares.real > 0.0) and np.all(np.abs(squares.imag) <= COMPLEX * squares.real))

    low = 0.0
    for high in MOST * np.arange(1, STEPS + 1) / STEPS:
        if steady(high):
            low = high
            continue
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if steady(middle) else (low, middle)
        return float(high)
    return np.inf
