"""Induced strain of a body, as of heat or piezoelectric layers: the forces of unit strains on its coordinates.

Over each patch of a group the free strain e is uniform and has a few components: stretch along the middle line or
surface, and gradients of it across. It is an initial stress sigma0 = -C e, so that with amplitudes e_c the energy of
the body contains

    V = sum over c of e_c (f0_c . delta + delta . V1_c delta / 2),   f0_c = -int B0^T C e,   V1_c = 2 int sigma_c . B

where sigma_c is the stress that is left once the structure has deformed freely, as far as its coordinates and their
strain do not represent this deformation themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray

LINES = ("stretch", "gradient_y", "gradient_z")
SURFACES = ("stretch", "gradient")


@dataclass(frozen=True, eq=False)
class InducedStrain:
    """Forces of unit strains over the patches of one group (`femflex.body.Patches`) on the elastic coordinates.

    components  of lines LINES: stretch [1], and its gradients along the patch's axes y and z [1/m]; of surfaces
                SURFACES: the same stretch in all directions of the surface, and its gradient along the normal
    axes        (k, 3, 3)     of each patch: rows tangent, y, z of lines; two tangents and the normal of surfaces
    f0          (k, c, n)     generalised force
    V1          (k, c, n, n)  change of stiffness
    stiffness   (k, c)        force and moment per strain: EA, EI; of surfaces per width, of both directions together
    """

    components: tuple[str, ...]
    axes: Array
    f0: Array
    V1: Array
    stiffness: Array

    def with_coordinates(self, chosen: IntArray) -> InducedStrain:
        """The same over the chosen coordinates (m,) alone."""
        return replace(self, f0=self.f0[..., chosen], V1=self.V1[..., chosen, :][..., chosen])


def patch_axes(dimension: int, normals: Array) -> Array:
    """Axes (k, 3, 3) of patches with normals, or tangents, (k, 3), as of `InducedStrain.axes`."""
    unit = normals / np.linalg.norm(normals, axis=1)[:, None]
    z = np.cross(unit, np.eye(3)[np.abs(unit).argmin(axis=1)])
    z /= np.linalg.norm(z, axis=1)[:, None]
    y = np.cross(z, unit)
    return np.stack([unit, y, z] if dimension == 1 else [y, z, unit], axis=1)


def unit_strains(kind: str, names: Sequence[str], patch: Array, axes: Array) -> Array:
    """Strains (p, c, s) of unit components at points of a line or a plate.

    kind   "line" or "plate" (`StrainPart`); names: of its strains
    patch  (p, 3, 3) axes of the patch of each point; axes: (p, 3, 3) of the member there, as rows x, y, z
    """
    p = len(patch)
    if kind == "line":
        out = np.zeros((p, len(LINES), len(names)))
        out[:, 0, 0] = 1.0
        if len(names) > 1:  # a rod or a tether has no moments
            across = np.einsum("pia,pja->pij", patch[:, 1:], axes[:, 1:])  # patch's y and z over the section's
            out[:, 1:, 1], out[:, 1:, 2] = -across[:, :, 0], across[:, :, 1]  # eps = y g_y + z g_z = -y k_z + z k_y
        return out
    out = np.zeros((p, len(SURFACES), len(names)))
    out[:, 0, :2] = 1.0
    if len(names) > 3:
        out[:, 1, 3:5] = np.sign(np.einsum("pa,pa->p", patch[:, 2], axes[:, 2]))[:, None]  # eps = z kappa
    return out
