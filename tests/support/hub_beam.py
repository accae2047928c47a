"""The exact frequency equation of a planar rigid hub with one beam, pinned or free.

Unit beam (EI = m' = L = 1) on a hub of mass m and inertia J about its centre, attached at distance r from it. In
vibration at beta^2 the beam's whole deflection w(x) solves w'''' = beta^4 w with a free tip, and at the root
w(0) = y + r theta, w'(0) = theta. Virtual work of hub and beam, after two integrations by parts, leaves

    -beta^4 m y + w'''(0) = 0                      (free hub; y = 0 on a pinned one)
    -beta^4 J theta - w''(0) + r w'''(0) = 0
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq


def frequency_equation(beta, r, J, m, pinned):
    """Determinant of end and hub conditions over cos, sin, exp(-beta x), exp(-beta (1 - x)), scaled by beta^-k."""
    c, s, e = np.cos(beta), np.sin(beta), np.exp(-beta)
    w, w1, w2, w3 = (
        np.array([[1, 0, 1, e], [0, 1, -1, e], [-1, 0, 1, e], [0, -1, -1, e]]) * beta ** np.arange(4)[:, None]
    )
    tip = np.array([[-c, -s, e, 1], [s, -c, -e, 1]])  # w'' and w''' at x = 1
    y = w - r * w1
    hub = y if pinned else (-(beta**4) * m * y + w3) / beta**3
    moment = (-(beta**4) * J * w1 - w2 + r * w3) / beta**3
    return np.linalg.det(np.array([*tip, hub, moment]))


def exact_frequencies(r, J, m, pinned, n=3):
    betas = np.linspace(0.2, 16, 3000)
    values = [frequency_equation(b, r, J, m, pinned) for b in betas]
    changes = np.flatnonzero(np.diff(np.sign(values)) != 0)[:n]
    arguments = (r, J, m, pinned)
    roots = [
        brentq(frequency_equation, betas[i], betas[i + 1], args=arguments, xtol=1e-15, rtol=1e-15) for i in changes
    ]
    return np.array(roots) ** 2
