"""Strain of flat plate elements, whatever fields they are made of.

Strains: membrane (3), curvature (3) and, where the plate shears, shear (2); generalised gradients in the order

    g = (u,x  u,y  v,x  v,y  w,x  w,y  kappa_xx  kappa_yy  kappa_xy  [gamma_xz  gamma_yz])

with kappa = (beta_x,x  beta_y,y  beta_x,y + beta_y,x), and beta the rotation of the normal: u(z) = u + z beta.

The quadratic terms of the membrane strains are those of von Karman, w,x^2/2, w,y^2/2 and w,x w,y; the curvatures take

    kappa_ab -> kappa_ab (1 - u,x - v,y)

A surface r = (x + u, y + v, w) with unit normal n bends by n.r,ab = w,ab (1 - |grad w|^2/2) - w,c u_c,ab to third
order. Where it keeps its lengths, u_c,ab = -w,c w,ab and u,x + v,y = -|grad w|^2/2, so that this is
w,ab (1 + |grad w|^2/2), in bends about any axis. Without, a cantilever bent by a tenth of its length goes 1 % too far.

Written by u,x + v,y it adds no strains to those there are, is sampled where stretch is (the field cancels w'^2
there), and all but leaves a plate alone whose edges keep it from drawing in, up to (thickness / length)^2. Products
kappa_ab w,c as strains of their own would come to the same in free bends, cost six strains in place of three, and
change such plates more. What either lacks is of the size of stretch times kappa, which no theory of thin plates holds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import Part
from femflex.fem.plate.blocks import EVERY, LocalDofs
from femflex.fem.tables import StrainBlock, StressAt, of


@dataclass(frozen=True, eq=False)
class ThinPlates:
    """Elements that leave out transverse shear, and what it takes to estimate what that does.

    where    the member
    corners  (e, c)       nodes
    axes     (1|e, 3, 3)  rows e1, e2, normal
    area     (e,)
    dN       (e, 2, c)    shape functions of the corners by x and y, in the middle
    kappa    elements -> (1|e, c, 3, b)  curvature at the corners
    S        (1|e, 2, 2)  shear stiffness of the section in the elements' axes
    remedy   what to do instead
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
    fine      elements -> PlateStrain       of these elements alone, over points enough for stress on squares of slopes
    tied      elements -> PlateStrain, ...  of these elements alone: the strain at the points where stretch is sampled,
                                            then what its linear part lacks there
    stress    (1|e, 1, s)                   initial membrane forces, moments and shear forces
    linear    whether squares of the slopes are left out
    thin      what is known of plates that leave out transverse shear; None of others

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
        """Quadratic strain from g, (6|8, 9|11, 9|11) [1, m]: von Karman's, and the curvature of plates bent far."""
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
        m, dP = self.dP.shape[3], of(self.dP, elements)
        inplane = [np.matmul(dP, local[:, :, i : 2 * m : 2]) for i in (0, 1)]
        if not local[:, :, 2 * m :].any():  # shapes in the plane
            g = np.concatenate(inplane, axis=2)
            return np.pad(g, ((0, 0), (0, 0), (0, self.linear_map.shape[1] - 4), (0, 0)))[:, :, :most]
        bending = [np.matmul(rows(elements), local[:, :, 2 * m :]) for rows in self._bending_rows(most)]
        return np.concatenate([*inplane, *bending], axis=2)[:, :, :most]

    def rows(self, elements: slice, most: int | None = None) -> Array:
        """Generalised gradients (e|1, q, 9|11, l) [1/m, 1/m^2] per raw dof of the element, m and rad alike, or the
        first `most` of them."""
        X, m = of(self.map.X, elements)[:, None], self.dP.shape[3]
        inplane = [np.matmul(of(self.dP, elements), X[:, :, i : 2 * m : 2]) for i in (0, 1)]
        bending = [np.matmul(rows(elements), X[:, :, 2 * m :]) for rows in self._bending_rows(most)]
        e = max(len(part) for part in (*inplane, *bending))
        parts = [np.broadcast_to(part, (e, *part.shape[1:])) for part in (*inplane, *bending)]
        return np.concatenate(parts, axis=2)[:, :, :most]

    def _bending_rows(self, most: int | None) -> tuple[Callable[[slice], Array], ...]:
        """The makers of the rows among the first `most` that bending has a part in."""
        if most is None or most > 6:
            return self.slopes, self.bending
        return (self.slopes,) if most > 4 else ()

    def sampled(self, elements: slice) -> PlateStrain:
        """See StrainBlock."""
        return self.tied(elements)[0]

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock; initial stress in a block of its own."""
        parts = tuple(replace(part, stress=0.0 * part.stress) for part in self.tied(elements))
        if stress is None and not self.stress.any():
            return parts
        fine = self.fine(elements)
        initial = fine.stress if stress is None else stress(fine)
        return (*parts, replace(fine, elastic=0.0 * fine.elastic, stress=initial)) if initial.any() else parts

    def corner_moments(self, phi: Array) -> Array:
        """Moments (e, c, 3, n) [N m/m] at the corners of thin plates, per column of phi (n_raw, n)."""
        assert self.thin is not None
        local = self.map.local(phi, EVERY)[:, None, 2 * self.dP.shape[3] :]
        return np.matmul(self.elastic[:, :, 3:6, 3:6], np.matmul(self.thin.kappa(EVERY), local))

    def membrane_stiffness(self, elements: slice = EVERY) -> Array:
        """Stiffness matrices (e, 2 m, 2 m) of the in-plane dofs."""
        dP = of(self.dP, elements)
        B = np.zeros((*dP.shape[:2], 3, dP.shape[3], 2))
        B[:, :, 0, :, 0] = B[:, :, 2, :, 1] = dP[:, :, 0]
        B[:, :, 1, :, 1] = B[:, :, 2, :, 0] = dP[:, :, 1]
        B = B.reshape(*dP.shape[:2], 3, -1)
        return self._stiffness(B, of(self.elastic, elements)[:, :, :3, :3], elements)

    def bending_stiffness(self, elements: slice = EVERY) -> Array:
        """Stiffness matrices (e, b, b) [N/m, N, N m] of the bending dofs."""
        return self._stiffness(self.bending(elements), of(self.elastic, elements)[:, :, 3:, 3:], elements)

    def stiffness(self, elements: slice = EVERY) -> Array:
        """Element stiffness matrices (e, l, l) [N/m, N, N m] of the linear strain."""
        return self.map.in_raw(self.membrane_stiffness(elements), self.bending_stiffness(elements), elements)

    def parts(self) -> tuple[Part, ...]:
        """Element matrices for assembly: membrane and bending apart where they do not mix."""
        picked = self.map.picked()
        if picked is None:
            return (Part(self.dofs, self.stiffness),)
        column, sign = picked
        signs = np.outer(sign, sign)
        m = self.map.n_inplane
        return (
            Part(self.dofs[:, column[:m]], lambda elements: self.membrane_stiffness(elements) * signs[:m, :m]),
            Part(self.dofs[:, column[m:]], lambda elements: self.bending_stiffness(elements) * signs[m:, m:]),
        )

    def _stiffness(self, B: Array, C: Array, elements: slice) -> Array:
        weight = self.weight[elements]
        stress = np.matmul(C * weight[:, :, None, None], B)
        flat = B.reshape(len(B), -1, B.shape[3])
        return np.matmul(flat.swapaxes(1, 2), stress.reshape(len(weight), -1, B.shape[3]))
