"""Whether a structure is curved as far as its bending goes: how soft its shapes become when they are bent one way.

With the amplitude q of a shape held and all else relaxed, V = k q^2 / 2 + c q^3 + e q^4 to fourth order, c being zero
of what is flat. Its tangent stiffness k + 6 c q + 12 e q^2 then falls to one side: below zero where it snaps through.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.fem.structure import Structure
from femflex.reduction.derivatives import static_response
from femflex.reduction.modes import answers_to_clamps
from femflex.reduction.modeset import ModeSet

Array = NDArray[np.float64]

REACH = 0.1  # displacement over size up to which it is looked at
LOOKED_AT = 3  # of the lowest vibration shapes
FAR = 1e3  # displacement over size at which the quartic energy is read off: there it is all of the energy but rounding


def softest(structure: Structure, modes: ModeSet) -> float:
    """The least tangent stiffness of low shapes over that at rest: 1 flat, below 0 it snaps.

    Of the lowest vibration shapes and, in a clamped set, the static answer to an acceleration along its rise: the
    lowest shapes of an arch may all be of those that leave its crown where it is.
    """
    lowest = [k for k, kind in enumerate(modes.kinds) if kind in ("vibration", "free-free")][:LOOKED_AT]
    if not lowest:
        return 1.0
    phi, elastic = modes.phi[:, lowest], structure.internal_force
    if modes.held.size and rise(structure):
        phi = np.column_stack([phi, answers_to_clamps(structure, modes)[1] @ _risen(structure)[1]])
    k = np.einsum("in,in->n", phi, structure.K @ phi)
    bent = elastic.second_derivative(phi, phi)
    relaxed = np.einsum("in,in->n", bent, static_response(structure, modes, bent))
    along = np.einsum("in,in->n", bent, phi)
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    ratios = [1.0]
    for number, shape in enumerate(phi.T):
        far = FAR * size / np.abs(structure.translation @ shape).max()
        even = (elastic.energy(far * shape) + elastic.energy(-far * shape)) / 2 - k[number] * far**2 / 2
        quartic = even / far**4 - (relaxed[number] - along[number] ** 2 / k[number]) / 8
        q = np.linspace(-1.0, 1.0, 401) * far / FAR * REACH
        ratios.append(float((1 + (along[number] * q + 12 * quartic * q**2) / k[number]).min()))
    return min(ratios)


def rise(structure: Structure) -> float:
    """How far the mesh stands off the plane, or the line, that lies best in it [m]; zero of a straight line."""
    return _risen(structure)[0]


def _risen(structure: Structure) -> tuple[float, Array]:
    """The rise of the mesh [m], and its direction (3,)."""
    centred = structure.mesh.points - structure.mesh.points.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    spans = np.ptp(centred @ axes.T, axis=0)
    standing = np.flatnonzero(spans > 1e-9 * spans.max())
    if len(standing) < 2:
        return 0.0, np.zeros(3)
    least = int(standing[np.argmin(spans[standing])])
    return float(spans[least]), axes[least]
