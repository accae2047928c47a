"""The linear equations of motion in their second-order form, and over their real modes.

    M v' + (D + G) v + K q + R z = Q u,    q' = v + W q

q are increments of coordinates, v their rates, z the further states (of effectors, and of prescribed motions). With
q = Phi eta and v = Phi nu, where (K + K^T) Phi / 2 = M Phi diag(omega^2) and Phi^T M Phi = 1,

    nu' + Phi^T (D + G) Phi nu + Phi^T K Phi eta + Phi^T R z = Phi^T Q u,    eta' = nu + Phi^T M W Phi eta
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from femflex.arrays import Array
from femflex.studies.linear.linear_model import LinearModel


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """Matrices of n coordinates, m further states and n_in inputs, in SI.

    mass, damping, gyroscopic, stiffness, turning  M, D (symmetric), G (skew), K, W (n, n)
    coupling (n, m)  R;  forces (n, n_in)  Q
    modes    (n, n)  Phi, columns by rising omega^2
    """

    mass: Array
    damping: Array
    gyroscopic: Array
    stiffness: Array
    turning: Array
    coupling: Array
    forces: Array
    modes: Array

    def over_modes(self) -> SecondOrder:
        """The same equations over the modes, so that the mass is 1."""
        Phi = self.modes
        square = {key: Phi.T @ getattr(self, key) @ Phi for key in ("damping", "gyroscopic", "stiffness")}
        return SecondOrder(
            np.eye(len(Phi)),
            **square,
            turning=Phi.T @ self.mass @ self.turning @ Phi,
            coupling=Phi.T @ self.coupling,
            forces=Phi.T @ self.forces,
            modes=np.eye(len(Phi)),
        )


def second_order(model: LinearModel) -> SecondOrder:
    """The second-order form of a linear model."""
    n, M = len(model.mass), model.mass
    DG, K = model.damping, model.stiffness
    _, modes = eigh((K + K.T) / 2, (M + M.T) / 2)
    return SecondOrder(
        M,
        (DG + DG.T) / 2,
        (DG - DG.T) / 2,
        K,
        model.A[:n, :n],
        -M @ model.A[n : 2 * n, 2 * n :],
        M @ model.B[n : 2 * n],
        np.asarray(modes),
    )
