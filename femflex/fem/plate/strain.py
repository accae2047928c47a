"""Strain of flat plate elements, independent of their fields.

Strains: membrane (3), curvature (3) and, where the plate shears, shear (2); generalised gradients in the order

    g = (u,x  u,y  v,x  v,y  w,x  w,y  kappa_xx  kappa_yy  kappa_xy  [gamma_xz  gamma_yz])

with kappa = (beta_x,x  beta_y,y  beta_x,y + beta_y,x), and beta the rotation of the normal: u(z) = u + z beta.

The quadratic terms of the membrane strains are those of von Karman, w,x^2/2, w,y^2/2 and w,x w,y; the curvatures take

    kappa_ab -> kappa_ab (1 - u,x - v,y)

A surface r = (x + u, y + v, w) with unit normal n bends by n.r,ab = w,ab (1 - |grad w|^2/2) - w,c u_c,ab to third
order. Where lengths do not change, u_c,ab = -w,c w,ab and u,x + v,y = -|grad w|^2/2, so that this is
w,ab (1 + |grad w|^2/2), for bending about any axis. Without this term a cantilever deflected by a tenth of its length
deflects 1 % too far.

Expressed by u,x + v,y the term adds no strains to the existing ones and is sampled at the points of the stretch (where
the field cancels w'^2). It hardly changes a plate whose edges cannot be drawn in, by about (thickness / length)^2.
Products kappa_ab w,c as separate strains would give the same in free bending, but need six strains instead of three,
and change such plates more. The error of both is of the order of stretch times kappa, which theories of thin plates
neglect.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import ElementMatrices
from femflex.fem.plate.blocks import ALL_ELEMENTS, LocalDofs
from femflex.fem.tables import StrainBlock, StressAt, rows_of_elements


@dataclass(frozen=True, eq=False)
class ThinPlates:
    """Elements without transverse shear, and the data to estimate the error that this causes.

    where    the member
    corners  (e, c)       nodes
    axes     (1|e, 3, 3)  rows e1, e2, normal
    area     (e,)
    dN       (e, 2, c)    shape functions of the corners by x and y, in the middle
    kappa    elements -> (1|e, c, 3, b)  curvature at the corners
    S        (1|e, 2, 2)  shear stiffness of the section in the elements' axes
    remedy   advice for the warning
    """

    where: str
    corners: IntArray
    axes: Array
    area: Array
    dN: Array
    kappa: Callable[[slice], Array]
    S: Array
    remedy: str


@dataclass(frozen=True, eq=False)
class PlateStrain:
    """Points of strain of plates.

    weight    (e, q)          area
    elastic   (1|e, 1, s, s)  diag(A, D[, S])
    map       LocalDofs
    dP        (1|e, q, 2, m)  in-plane shape functions by x and y
    slopes    elements -> (1|e, q, 2, b)    w,x  w,y
    bending   elements -> (1|e, q, 3|5, b)  kappa (3) [gamma (2)]
    fine      elements -> PlateStrain       of these elements, with enough points for stress on squares of slopes
    tied      elements -> PlateStrain, ...  of these elements: the strain at the points where stretch is sampled, then
                                            the corrections of its linear part
    stress    (1|e, 1, s)                   initial membrane forces, moments and shear forces
    linear    whether squares of the slopes are left out
    thin      data of plates without transverse shear; None for others

    Squares of the slopes are of higher degree than the in-plane field can cancel: over enough points for their own
    squares, plates that bend without stretching would be far too stiff (membrane locking; a strip of 5000 thicknesses
    on ten elements by half). So stretch is sampled where the in-plane field can make it vanish. Initial stress, whose
    work on the squares does not lock, keeps the fine points.
    """

    weight: Array
    elastic: Array
    map: LocalDofs
    dP: Array
    slopes: Callable[[slice], Array]
    bending: Callable[[slice], Array]
    fine: Callable[[slice], PlateStrain]
    tied: Callable[[slice], tuple[PlateStrain, ...]]
    stress: Array
    linear: bool = False
    thin: ThinPlates | None = None

    @property
    def dofs(self) -> IntArray:
        """Numbers (e, l) of raw dofs."""
        return self.map.dofs

    @property
    def linear_map(self) -> Array:
        """Linear strain from g, (6|8, 9|11) [1, m]."""
        n = self.elastic.shape[2]
        linear = np.zeros((n, n + 3))
        linear[0, 0] = linear[1, 3] = linear[2, 1] = linear[2, 2] = 1.0
        linear[3:, 6:] = np.eye(n - 3)
        return linear

    @property
    def quadratic_map(self) -> Array:
        """Quadratic strain from g, (6|8, 9|11, 9|11) [1, m]: von Karman's terms, and the curvature at large
        deflections."""
        n = self.elastic.shape[2]
        quadratic = np.zeros((n, n + 3, n + 3))
        if self.linear:
            return quadratic
        quadratic[0, 4, 4] = quadratic[1, 5, 5] = quadratic[2, 4, 5] = quadratic[2, 5, 4] = 1.0
        for strain, kappa in zip((3, 4, 5), (6, 7, 8), strict=True):
            quadratic[strain, kappa, [0, 3]] = quadratic[strain, [0, 3], kappa] = -1.0
        return quadratic

    def gradients(self, phi: Array, elements: slice, most: int | None = None) -> Array:
        """Generalised gradients (e, q, 9|11, n) [1, 1/m] per column of phi (n_raw, n)."""
        local = self.map.local(phi, elements)[:, None]
        m, dP = self.dP.shape[3], rows_of_elements(self.dP, elements)
        inplane = [np.matmul(dP, local[:, :, i : 2 * m : 2]) for i in (0, 1)]
        if not local[:, :, 2 * m :].any():  # shapes in the plane
            g = np.concatenate(inplane, axis=2)
            return np.pad(g, ((0, 0), (0, 0), (0, self.linear_map.shape[1] - 4), (0, 0)))[:, :, :most]
        bending = [np.matmul(rows(elements), local[:, :, 2 * m :]) for rows in self._bending_rows(most)]
        return np.concatenate([*inplane, *bending], axis=2)[:, :, :most]

    def rows(self, elements: slice, most: int | None = None) -> Array:
        """Generalised gradients (e|1, q, 9|11, l) [1/m, 1/m^2] per raw dof of the element, m and rad alike, or the
        first `most` of them."""
        X, m = rows_of_elements(self.map.X, elements)[:, None], self.dP.shape[3]
        inplane = [np.matmul(rows_of_elements(self.dP, elements), X[:, :, i : 2 * m : 2]) for i in (0, 1)]
        bending = [np.matmul(rows(elements), X[:, :, 2 * m :]) for rows in self._bending_rows(most)]
        e = max(len(part) for part in (*inplane, *bending))
        parts = [np.broadcast_to(part, (e, *part.shape[1:])) for part in (*inplane, *bending)]
        return np.concatenate(parts, axis=2)[:, :, :most]

    def _bending_rows(self, most: int | None) -> tuple[Callable[[slice], Array], ...]:
        """The functions that compute the rows of the first `most` gradients to which bending contributes."""
        if most is None or most > 6:
            return self.slopes, self.bending
        return (self.slopes,) if most > 4 else ()

    def sampled(self, elements: slice) -> PlateStrain:
        """See StrainBlock."""
        return self.tied(elements)[0]

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock; initial stress has a separate block."""
        parts = tuple(replace(part, stress=0.0 * part.stress) for part in self.tied(elements))
        if stress is None and not self.stress.any():
            return parts
        fine = self.fine(elements)
        initial = fine.stress if stress is None else stress(fine)
        return (*parts, replace(fine, elastic=0.0 * fine.elastic, stress=initial)) if initial.any() else parts

    def corner_moments(self, phi: Array) -> Array:
        """Moments (e, c, 3, n) [N m/m] at the corners of thin plates, per column of phi (n_raw, n)."""
        assert self.thin is not None
        local = self.map.local(phi, ALL_ELEMENTS)[:, None, 2 * self.dP.shape[3] :]
        return np.matmul(self.elastic[:, :, 3:6, 3:6], np.matmul(self.thin.kappa(ALL_ELEMENTS), local))

    def membrane_stiffness(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Stiffness matrices (e, 2 m, 2 m) of the in-plane dofs."""
        dP = rows_of_elements(self.dP, elements)
        B = np.zeros((*dP.shape[:2], 3, dP.shape[3], 2))
        B[:, :, 0, :, 0] = B[:, :, 2, :, 1] = dP[:, :, 0]
        B[:, :, 1, :, 1] = B[:, :, 2, :, 0] = dP[:, :, 1]
        B = B.reshape(*dP.shape[:2], 3, -1)
        return self._stiffness(B, rows_of_elements(self.elastic, elements)[:, :, :3, :3], elements)

    def bending_stiffness(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Stiffness matrices (e, b, b) [N/m, N, N m] of the bending dofs."""
        return self._stiffness(self.bending(elements), rows_of_elements(self.elastic, elements)[:, :, 3:, 3:], elements)

    def stiffness(self, elements: slice = ALL_ELEMENTS) -> Array:
        """Element stiffness matrices (e, l, l) [N/m, N, N m] of the linear strain."""
        return self.map.in_raw(self.membrane_stiffness(elements), self.bending_stiffness(elements), elements)

    def parts(self) -> tuple[ElementMatrices, ...]:
        """Element matrices for assembly; membrane and bending are separate parts where they do not couple."""
        signed = self.map.signed_columns()
        if signed is None:
            return (ElementMatrices(self.dofs, self.stiffness),)
        column, sign = signed
        signs = np.outer(sign, sign)
        m = self.map.n_inplane
        return (
            ElementMatrices(
                self.dofs[:, column[:m]], lambda elements: self.membrane_stiffness(elements) * signs[:m, :m]
            ),
            ElementMatrices(
                self.dofs[:, column[m:]], lambda elements: self.bending_stiffness(elements) * signs[m:, m:]
            ),
        )

    def _stiffness(self, B: Array, C: Array, elements: slice) -> Array:
        weight = self.weight[elements]
        stress = np.matmul(C * weight[:, :, None, None], B)
        flat = B.reshape(len(B), -1, B.shape[3])
        return np.matmul(flat.swapaxes(1, 2), stress.reshape(len(weight), -1, B.shape[3]))
