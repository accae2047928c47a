"""Inertia of flat plate elements, independent of their fields.

An element's local dofs are (u, v) of each of the m functions of its in-plane field, then its bending dofs (b), in its
own axes; a map X (1|e, 2 m + b, l) gives them from its raw dofs. beta is the rotation of the normal:
u(z) = u + z beta.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import ElementMatrices
from femflex.fem.sections.laminates import PlateSection
from femflex.fem.tables import rows_of_elements

ALL_ELEMENTS = slice(None)


@dataclass(frozen=True, eq=False)
class LocalDofs:
    """Map X (1|e, 2 m + b, l) from the raw dofs (e, l) of elements to their local dofs."""

    dofs: IntArray
    X: Array
    n_inplane: int  # 2 m

    def of_elements(self, elements: slice) -> LocalDofs:
        """The map of these elements."""
        return replace(self, dofs=self.dofs[elements], X=rows_of_elements(self.X, elements))

    def local(self, phi: Array, elements: slice) -> Array:
        """Local dofs per column of phi (n_raw, n): (e, 2 m + b, n)."""
        signed = self.signed_columns()
        if signed is not None:
            column, sign = signed
            local = phi[self.dofs[elements][:, column]]
            return local if (sign == 1.0).all() else local * sign[:, None]
        return np.matmul(rows_of_elements(self.X, elements), phi[self.dofs[elements]])

    def signed_columns(self) -> tuple[IntArray, Array] | None:
        """Column (2 m + b,) and sign of each local dof, if it is plus or minus one raw dof in all elements; else
        None."""
        if self.X.shape[0] > 1 or (np.count_nonzero(self.X[0], axis=1) != 1).any():
            return None
        column = np.abs(self.X[0]).argmax(axis=1)
        sign = self.X[0][np.arange(len(column)), column]
        return (column, sign) if (np.abs(sign) == 1.0).all() else None

    def in_raw(self, inplane: Array, bending: Array, elements: slice) -> Array:
        """Element matrices (e, l, l) on the raw dofs from the in-plane (e, 2 m, 2 m) and the bending ones (e, b, b)."""
        X = rows_of_elements(self.X, elements)
        m = self.n_inplane
        first, second = np.matmul(inplane, X[:, :m]), np.matmul(bending, X[:, m:])
        return np.matmul(X.swapaxes(1, 2), np.concatenate([first, second], axis=1))


def mass_points(middle: Array, area: Array, axes: Array, section: PlateSection) -> tuple[Array, Array, Array]:
    """Masses (e, r q) [kg], positions (e, r q, 3) [m] and layer heights (r,) [m] of points with the mass and the rotary
    inertia of a plate: its mass on the middle plane, or two halves of it at +- the radius of gyration.

    middle (e, q, 3) and area (e, q) are the quadrature points of the middle plane.
    """
    radius = np.sqrt(section.rotary / section.mass) if section.mass > 0 else 0.0
    heights = np.array([radius, -radius]) if radius > 0 else np.zeros(1)
    offset = heights[:, None, None] * axes[:, None, None, 2]
    rho = middle[:, None] + offset
    dm = np.repeat(area[:, None] * (section.mass / len(heights)), len(heights), axis=1)
    return dm.reshape(len(area), -1), rho.reshape(len(area), -1, 3), heights


@dataclass(frozen=True, eq=False)
class PlateInertia:
    """Points of mass through the thickness of plates: on the middle plane, or a pair at +- the radius of gyration.

    dm        (e, r q)      layer by layer
    rho       (e, r q, 3)
    map       LocalDofs
    axes      (1|e, 3, 3)   rows e1, e2, normal
    heights   (r,)          of the layers [m]
    P         (q, m)        in-plane shape functions
    bending   elements -> (1|e, 3, q, b)  w, beta_x, beta_y
    """

    dm: Array
    rho: Array
    map: LocalDofs
    axes: Array
    heights: Array
    P: Array
    bending: Callable[[slice], Array]

    @property
    def dofs(self) -> IntArray:
        """Numbers (e, l) of raw dofs."""
        return self.map.dofs

    def shapes(self, phi: Array, elements: slice) -> Array:
        """Displacement (e, r q, 3, n) [m] of the points per column of phi (n_raw, n)."""
        local = self.map.local(phi, elements)
        m = self.P.shape[1]
        u, v = (np.matmul(self.P, local[:, i : 2 * m : 2]) for i in (0, 1))  # (e, q, n)
        w, bx, by = np.matmul(self.bending(elements), local[:, None, 2 * m :]).swapaxes(0, 1)
        layers = [np.stack([u + z * bx, v + z * by, w], axis=2) for z in self.heights]
        return np.matmul(rows_of_elements(self.axes, elements).swapaxes(1, 2)[:, None], np.concatenate(layers, axis=1))

    def scalar_mass(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Mass matrices (e, m, m) of one in-plane component."""
        m = self.P.shape[1]
        products = (self.P[:, :, None] * self.P[:, None, :]).reshape(-1, m * m)
        return (self._dm_by_layer(elements).sum(axis=1) @ products).reshape(-1, m, m)

    def bending_mass(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Mass matrices (e, b, b) [kg, kg m, kg m^2] of the bending dofs, with rotary inertia."""
        dm = self._dm_by_layer(elements)
        N = self.bending(elements)
        turning = np.einsum("erq,r->eq", dm, self.heights**2)
        weight = np.stack([dm.sum(axis=1), turning, turning], axis=1)[..., None]
        flat, weighted = N.reshape(len(N), -1, N.shape[3]), (N * weight).reshape(len(dm), -1, N.shape[3])
        return np.matmul(flat.swapaxes(1, 2), weighted)

    def mass(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Element mass matrices (e, l, l) [kg, kg m, kg m^2]."""
        inplane = np.asarray(np.kron(self.scalar_mass(elements), np.eye(2)), np.float64)
        return self.map.in_raw(inplane, self.bending_mass(elements), elements)

    def parts(self) -> tuple[ElementMatrices, ...]:
        """Element matrices for assembly; u, v and bending are separate parts where they do not couple."""
        signed = self.map.signed_columns()
        if signed is None:
            return (ElementMatrices(self.dofs, self.mass),)
        column, sign = signed
        m = self.P.shape[1]
        inplane = self.dofs[:, column[: 2 * m]].reshape(-1, m, 2)
        signs = np.outer(sign[2 * m :], sign[2 * m :])
        if not (sign[: 2 * m].reshape(m, 2) == sign[:2]).all():
            return (ElementMatrices(self.dofs, self.mass),)
        return (
            ElementMatrices(inplane, self.scalar_mass),
            ElementMatrices(self.dofs[:, column[2 * m :]], lambda elements: self.bending_mass(elements) * signs),
        )

    def _dm_by_layer(self, elements: slice) -> Array:
        return self.dm[elements].reshape(-1, len(self.heights), len(self.P))
