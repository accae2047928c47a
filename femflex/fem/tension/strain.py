"""Strain blocks of members whose only transverse stiffness is that of their tension."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.family import SkinPart
from femflex.fem.tables import DenseStrain

PRINCIPAL = {1: "tension", 3: "lowest principal stress resultant"}  # by number of strains
UNITS = {1: "N", 3: "N/m"}


@dataclass(frozen=True, eq=False)
class TensionStrain(DenseStrain):
    """A strain block of a tether, eps (s = 1), or of a membrane, eps_xx, eps_yy, gamma_xy (s = 3).

    group, family  of its member
    places (e, q, 3)  positions of its points [m]
    shape_functions (q, m)  of each component of their displacement
    smoothing (q, q)  least-squares fit by polynomials of the degree of the displacement's gradient: the stress of stiff
                      lines and sheets in large rotation oscillates about these
    viscosity         internal (Kelvin-Voigt) damping: stress C viscosity d eps/dt in addition to C eps [s]
    """

    group: str = ""
    family: str = ""
    places: Array = field(default_factory=lambda: np.zeros((1, 1, 3)))
    shape_functions: Array = field(default_factory=lambda: np.zeros((1, 1)))
    smoothing: Array = field(default_factory=lambda: np.eye(1))
    viscosity: float = 0.0

    def smoothed_stress(self) -> Array:
        """Initial stress at the points (e, q, s) [N or N/m], smoothed in every element."""
        return self.smoothing @ np.broadcast_to(self.stress, (*self.weight.shape, self.stress.shape[-1]))

    def lowest_tension(self) -> Array:
        """Tension [N] or lowest principal stress resultant [N/m] of the initial stress at the points (e, q).

        It is that of the second Piola-Kirchhoff stress, whose relative difference from the true one is of the size of
        the strain.
        """
        return lowest_principal(self.smoothed_stress())

    def deflected(self, raw: Array) -> TensionStrain:
        """The block about raw displacements (n_raw,), exact: strains and stress from there, gradients as before.

        With g = g_e + G d the strain is eps_e + (L + Q g_e) G d + 1/2 G d.Q G d: the rows (L + Q g_e) G follow G.
        """
        s, n = self.linear_map.shape
        g = self.gradients(raw[:, None], slice(None))[..., 0]
        Qg = np.einsum("sgh,eqh->eqsg", self.quadratic_map, g)
        eps = np.matmul(self.linear_map + Qg / 2, g[..., None])
        rows = np.matmul(self.linear_map + Qg, self.G)
        G = np.concatenate([np.broadcast_to(self.G, (*rows.shape[:2], *self.G.shape[2:])), rows], axis=2)
        u = np.einsum("qm,emc->eqc", self.shape_functions, raw[self.dofs].reshape(len(self.dofs), -1, 3))
        return replace(
            self,
            stress=self.stress + np.matmul(self.elastic, eps)[..., 0],
            linear_map=np.concatenate([np.zeros((s, n)), np.eye(s)], axis=1),
            quadratic_map=np.pad(self.quadratic_map, ((0, 0), (0, s), (0, s))),
            G=G,
            places=self.places + u,
        )


def lowest_principal(stress: Array) -> Array:
    """Lowest principal value (...) of stresses [N or N/m] (..., 1) of a line or (..., 3) of a sheet."""
    if stress.shape[-1] == 1:
        return np.asarray(stress[..., 0])
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    return np.asarray((xx + yy) / 2 - np.hypot((xx - yy) / 2, xy))


def interpolated_skin(kind: str, pieces: IntArray, parts: Sequence[tuple[Array, IntArray, Array]]) -> SkinPart:
    """The skin of elements with drawn points x (e, p, 3), dofs (e, m, 3) and shape functions (p, m) of each part.

    pieces (k, n): the cells of that kind among the p points of every element.
    """
    points, cells, rows, cols, values, start = [], [], [], [], [], 0
    for x, dofs, N in parts:
        number = start + np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])
        start += number.size
        points.append(x.reshape(-1, 3))
        cells.append(number[:, pieces].reshape(-1, pieces.shape[1]))
        shape = (*number.shape, N.shape[1], 3)
        rows.append(np.broadcast_to(3 * number[:, :, None, None] + np.arange(3), shape).ravel())
        cols.append(np.broadcast_to(dofs[:, None], shape).ravel())
        values.append(np.broadcast_to(N[None, :, :, None], shape).ravel())
    triplets = np.concatenate(rows), np.concatenate(cols), np.concatenate(values)
    return SkinPart(np.concatenate(points), {kind: np.concatenate(cells)}, *triplets)


def least_squares(values: Array, weight: Array) -> Array:
    """Matrix (q, q) [1] that fits point values by functions with these values (q, k), in the mean with weights (q,)."""
    weighted = values.T * weight
    return np.asarray(values @ np.linalg.solve(weighted @ values, weighted))
