"""Static stretch of condensed bodies under accelerations, at markers: the part that no coordinate holds.

Stretch is no coordinate of a condensed body. What bending brings about follows; what spin, acceleration and weight
stretch by themselves does not, though a boom of length L that spins at Om about its root grows by m Om^2 L^3 / 3 EA.
Far below the frequencies of stretch it is static, and linear in the field of acceleration of the body's own mass (mode
acceleration method, R. L. Bisplinghoff, H. Ashley and R. L. Halfman, Aeroelasticity, 1955).

All of the answer beyond the shapes counts, the bending of sheets in their own planes too: as a plate set at 60 degrees
is spun up, that takes three quarters of the stretch at its corner back.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import FlexibleBody
from femflex.fem.structure import Structure
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.inertia.accelerations import loads_of_linear_accelerations
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.statics import static_response

HELD = 1e-8  # share of an answer's strain energy below which the coordinates hold it


def with_static_stretch(
    structure: Structure, modes: ModeSet, body: FlexibleBody, free: IntArray, places: dict[str, str]
) -> FlexibleBody:
    """The body, whose coordinates are the shapes `free` (n,), numbers, of the set, with the static stretch of its
    markers.

    places: marker -> mesh group. The field is that of the undeformed places: on a plate bent by four
    thicknesses the rest of the effect of spin adds 0.1 % of the draw-in of its corner.
    """
    x = stretching_answers(structure, modes, modes.phi[:, free])
    if not x.any():
        return body
    moved = {name: marker_rows(structure, group).translation @ x for name, group in places.items()}
    stretch = {name: rows.reshape(3, 4, 3) for name, rows in moved.items()}
    return replace(
        body, markers={key: replace(m, stretch=stretch.get(key, m.stretch)) for key, m in body.markers.items()}
    )


def with_stretch_of_slaved(body: FlexibleBody, whole: FlexibleBody, n: int) -> FlexibleBody:
    """The same of a straight beam on functions, condensed from a whole whose shapes from n on are slaved."""
    V1, m = whole.strain.V1, whole.n_modes
    uniform, linear = whole.moments.first[1 : 1 + m], whole.moments.second[0][:, 1 : 1 + m]
    work = np.concatenate([uniform[:, None], linear.swapaxes(0, 1)], axis=1).reshape(m, 12)
    x = np.linalg.solve(V1, work)
    x[:n] -= np.linalg.solve(V1[:n, :n], work[:n])
    stretch = {key: (marker.phi[:, :m] @ x).reshape(3, 4, 3) for key, marker in whole.markers.items()}
    return replace(body, markers={key: replace(marker, stretch=stretch[key]) for key, marker in body.markers.items()})


def stretching_answers(structure: Structure, modes: ModeSet, phi: Array) -> Array:
    """Static displacements (n_dof, 12) [m, rad] in 12 fields z_a e_b of force per mass, beyond those of shapes phi."""
    load = loads_of_linear_accelerations(structure)
    whole = static_response(structure, modes, load)
    x = whole - phi @ np.linalg.solve(phi.T @ (structure.K @ phi), phi.T @ load)
    energy, size = (np.einsum("in,in->n", part, structure.K @ part) for part in (x, whole))
    x[:, energy <= HELD * size] = 0.0
    return np.asarray(x)
