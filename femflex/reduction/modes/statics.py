"""Static responses of a structure with the supports of a set, clamped or free."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.supported import supported
from femflex.reduction.modes.vibration import ModeSet


def static_response(structure: Structure, modes: ModeSet, load: Array) -> Array:
    """Displacements (n_dof, k) under loads (n_dof, k) with the set's supports, factorised once for all (`supported`).

    Without clamps the load is balanced by uniform and rotational acceleration (inertia relief), and the frame is placed
    as the set places it: on its reference group, or at the mean motion for free-free modes.
    """
    supports = supported(structure, modes.held)
    x = supports.answers(load)
    if modes.held.size or not modes.reference:
        return x
    rows = marker_rows(structure, modes.reference)
    mean_motion = np.concatenate([rows.translation.toarray(), rows.rotation.toarray()])
    return x - supports.R @ np.linalg.lstsq(mean_motion @ supports.R, mean_motion @ x, rcond=None)[0]
