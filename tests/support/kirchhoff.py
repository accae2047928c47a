"""Kirchhoff's rod in space: an inextensible cantilever under a dead load at its tip, by shooting."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root


def tip_of_rod(length, GJ, EIy, EIz, force):
    """Displacement (3,) of the tip and its frame (3, 3), columns the section's axes; x along the straight rod.

    m' + kappa x m + e_x x R^T F = 0, m = diag(GJ, EIy, EIz) kappa in axes of the section, R' = R skew(kappa).
    """
    stiffness = np.array([GJ, EIy, EIz])

    def bent(moment, share):
        def derivative(s, y):
            R, m = y[:9].reshape(3, 3), y[9:12]
            kappa = m / stiffness
            n = R.T @ (share * force)
            turned = R @ np.array([[0, -kappa[2], kappa[1]], [kappa[2], 0, -kappa[0]], [-kappa[1], kappa[0], 0]])
            return np.concatenate([turned.ravel(), -np.cross(kappa, m) - np.cross([1.0, 0, 0], n), R[:, 0]])

        start = np.concatenate([np.eye(3).ravel(), moment, np.zeros(3)])
        return solve_ivp(derivative, (0, length), start, rtol=1e-10, atol=1e-12).y[:, -1]

    guess = np.zeros(3)
    for share in (0.25, 0.5, 0.75, 1.0):
        found = root(lambda moment, share=share: bent(moment, share)[9:12], guess, tol=1e-11)
        assert found.success
        guess = found.x
    end = bent(guess, 1.0)
    return end[12:] - [length, 0, 0], end[:9].reshape(3, 3)
