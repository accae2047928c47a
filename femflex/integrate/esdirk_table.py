"""Coefficients of the method ARK4(3)6L[2]SA-ESDIRK: order 4, stiffly accurate, L-stable, embedded order 3.

Source: C. A. Kennedy, M. H. Carpenter, Additive Runge-Kutta schemes for convection-diffusion-reaction equations,
Applied Numerical Mathematics 44 (2003) 139-181, implicit part; exact fractions.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from femflex.arrays import Array

STAGES = [
    "0",
    "1/4 1/4",
    "8611/62500 -1743/31250 1/4",
    "5012029/34652500 -654441/2922500 174375/388108 1/4",
    "15267082809/155376265600 -71443401/120774400 730878875/902184768 2285395/8070912 1/4",
    "82889/524892 0 15625/83664 69875/102672 -2260/8211 1/4",
]
EMBEDDED = "4586570599/29645900160 0 178811875/945068544 814220225/1159782912 -3700637/11593932 61727/225920"


def fractions(row: str) -> list[Fraction]:
    """The six exact coefficients of a row."""
    entries = [Fraction(text) for text in row.split()]
    return entries + [Fraction(0)] * (6 - len(entries))


def _guesses(c: Array) -> Array:
    """Weights of the earlier stages' accelerations whose sum is the first guess of each stage's.

    The polynomial of degree 2 at most through the last three earlier stages, taken at the stage's time.
    """
    weights = np.zeros((6, 6))
    for s in range(1, 6):
        nodes = range(max(0, s - 3), s)
        for j in nodes:
            weights[s, j] = np.prod([(c[s] - c[i]) / (c[j] - c[i]) for i in nodes if i != j])
    return weights


A = np.array([[float(a) for a in fractions(row)] for row in STAGES])
C = A.sum(axis=1)
ERROR = A[5] - np.array([float(b) for b in fractions(EMBEDDED)])
GUESS = _guesses(C)
GAMMA = 0.25
