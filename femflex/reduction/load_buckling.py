"""Under how many times a load a structure buckles, and under how many a set of its shapes does.

Both by linear buckling, det(K + lambda K_sigma) = 0 with the stress that the load makes: axial loads bow a boom, loads
in the stiff plane of a strip tip it over. A set buckles later where its shapes hold that stress badly, as vibration
modes do the moments of an end load, or lack part of the shape that the structure buckles in.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from femflex.fem.structure import Structure
from femflex.reduction.buckling import roughly_lowest_ratio
from femflex.reduction.clamps import free_dofs
from femflex.reduction.derivatives import static_response
from femflex.reduction.modeset import ModeSet

Array = NDArray[np.float64]

ROUNDING = 1e-9  # part of its stiffness that a load takes from a shape, below which it takes none


@dataclass(frozen=True)
class LoadBuckling:
    """Least positive multiples of a load at which a structure buckles, and a set of its shapes; inf where never."""

    structure: float
    shapes: float


def load_buckling(structure: Structure, modes: ModeSet, load: Array, either: bool = False) -> LoadBuckling:
    """LoadBuckling of a clamped set under a dead load (n_dof,) on its structure; either: or one the other way.

    A derivative that follows bears load as one that is a coordinate: phi_i.K_sigma(x) phi_k = -theta_ik.f for a static
    answer x = K^-1 f, which is the work of the load on what follows.
    """
    own = structure_buckling(structure, modes, load, either)
    phi = modes.phi
    K = phi.T @ (structure.K @ phi)
    K_sigma = structure.internal_force.geometric_stiffness(phi @ np.linalg.solve(K, phi.T @ load))
    ratios = linalg.eigvalsh(phi.T @ (K_sigma @ phi), K)
    return LoadBuckling(own, multiple(float(min(ratios[0], -ratios[-1]) if either else ratios[0])))


def structure_buckling(structure: Structure, modes: ModeSet, load: Array, either: bool = False) -> float:
    """That of the structure alone, clamped as the set is."""
    free = free_dofs(structure, modes.held)
    K_sigma = structure.internal_force.geometric_stiffness(static_response(structure, modes, load[:, None])[:, 0])
    try:
        return multiple(roughly_lowest_ratio(K_sigma[free][:, free], structure.K[free][:, free], either))
    except (np.linalg.LinAlgError, RuntimeError):
        return np.inf


def multiple(lowest: float) -> float:
    """lambda = -1 / mu of the lowest mu of K_sigma x = mu K x; inf where none is negative but by rounding."""
    return -1.0 / lowest if lowest < -ROUNDING else np.inf
