"""Static answers of a structure with the supports of a set, clamped or free."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.fem.eigen.modes import factorised
from femflex.fem.structure import Structure
from femflex.reduction.bent_states import over_mass
from femflex.reduction.clamps import free_dofs
from femflex.reduction.markers import marker_rows
from femflex.reduction.modeset import ModeSet
from femflex.reduction.rigid import independent_columns, rigid_shapes

Array = NDArray[np.float64]

SOFT = 1e-7  # spring to the ground that lets a free stiffness be factorised, over the lowest eigenvalue of the set


def static_response(structure: Structure, modes: ModeSet, load: Array) -> Array:
    """Displacements (n_dof, k) under loads (n_dof, k) with the set's supports.

    Without clamps the load is balanced by uniform and rotational acceleration, and the frame is placed as the set
    places it: on its reference group, or at the mean motion for free-free modes.
    """
    free = free_dofs(structure, modes.held)
    x = np.zeros_like(load)
    if modes.held.size:
        x[free] = factorised(structure.K[free][:, free]).solve(np.ascontiguousarray(load[free]))
        return x
    R = rigid_shapes(structure)
    R = R[:, independent_columns(R)]
    MR = structure.M @ R
    load = load - MR @ np.linalg.solve(R.T @ MR, R.T @ load)
    lowest = float(over_mass(structure, modes).min())
    x = factorised(structure.K + SOFT * lowest * structure.M).solve(np.ascontiguousarray(load))
    if modes.reference:
        rows = marker_rows(structure, modes.reference)
        place = np.concatenate([rows.translation.toarray(), rows.rotation.toarray()])
        return x - R @ np.linalg.lstsq(place @ R, place @ x, rcond=None)[0]
    return x - R @ np.linalg.solve(R.T @ MR, MR.T @ x)
