"""Inertia and strain of flat plate elements, whatever fields they are made of.

An element's local dofs are (u, v) of each of the m functions of its in-plane field, then its bending dofs (b), in its
own axes; they follow from its raw dofs by a map X (1|e, 2 m + b, l). Strains: membrane (3), curvature (3) and, where
the plate shears, shear (2); generalised gradients in the order

    g = (u,x  u,y  v,x  v,y  w,x  w,y  kappa_xx  kappa_yy  kappa_xy  [gamma_xz  gamma_yz])

with kappa = (beta_x,x  beta_y,y  beta_x,y + beta_y,x), and beta the rotation of the normal: u(z) = u + z beta.

The quadratic terms of the membrane strains are those of von Karman, w,x^2/2, w,y^2/2 and w,x w,y; the curvatures take

    kappa_ab -> kappa_ab (1 - u,x - v,y)

A surface r = (x + u, y + v, w) with unit normal n bends by n.r,ab = w,ab (1 - |grad w|^2/2) - w,c u_c,ab to third
order. Where it keeps its lengths, u_c,ab = -w,c w,ab and u,x + v,y = -|grad w|^2/2, so that this is
w,ab (1 + |grad w|^2/2), in bends about any axis. Without, a cantilever bent by a tenth of its length goes 1 % too far.

Written by u,x + v,y it brings no strains beside those there are, is sampled where stretch is (the field cancels w'^2
there), and all but leaves a plate alone whose edges keep it from drawing in, up to (thickness / length)^2. Products
kappa_ab w,c as strains of their own would come to the same in free bends, cost six strains in place of three, and
change such plates more. What either lacks is of the size of stretch times kappa, which no theory of thin plates holds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femflex.fem.assembly import Part
from femflex.fem.sections.laminates import PlateSection
from femflex.fem.tables import StrainBlock, StressAt, of

Array = NDArray[np.float64]
Index = NDArray[np.int64]

EVERY = slice(None)


@dataclass(frozen=True, eq=False)
class LocalDofs:
    """Local dofs of elements from their raw dofs (e, l): X (1|e, 2 m + b, l)."""

    dofs: Index
    X: Array
    n_inplane: int  # 2 m

    def over(self, elements: slice) -> LocalDofs:
        """The same of these elements alone."""
        return replace(self, dofs=self.dofs[elements], X=of(self.X, elements))

    def local(self, phi: Array, elements: slice) -> Array:
        """Local dofs per column of phi (n_raw, n): (e, 2 m + b, n)."""
        picked = self.picked()
        if picked is not None:
            column, sign = picked
            local = phi[self.dofs[elements][:, column]]
            return local if (sign == 1.0).all() else local * sign[:, None]
        return np.matmul(of(self.X, elements), phi[self.dofs[elements]])

    def picked(self) -> tuple[Index, Array] | None:
        """Column (2 m + b,) and sign of each local dof, where it is plus or minus a raw dof in all elements alike."""
        if self.X.shape[0] > 1 or (np.count_nonzero(self.X[0], axis=1) != 1).any():
            return None
        column = np.abs(self.X[0]).argmax(axis=1)
        sign = self.X[0][np.arange(len(column)), column]
        return (column, sign) if (np.abs(sign) == 1.0).all() else None

    def in_raw(self, inplane: Array, bending: Array, elements: slice) -> Array:
        """Element matrices (e, l, l) on the raw dofs from the in-plane (e, 2 m, 2 m) and the bending one (e, b, b)."""
        X = of(self.X, elements)
        m = self.n_inplane
        first, second = np.matmul(inplane, X[:, :m]), np.matmul(bending, X[:, m:])
        return np.matmul(X.swapaxes(1, 2), np.concatenate([first, second], axis=1))


def mass_points(middle: Array, area: Array, axes: Array, section: PlateSection) -> tuple[Array, Array, Array]:
    """Masses (e, r q), places (e, r q, 3) and layer heights (r,) of points with the mass and the rotary inertia of a
    plate: its mass on the middle plane, or two halves of it at +- the radius of gyration.

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
    def dofs(self) -> Index:
        """Raw dofs (e, l)."""
        return self.map.dofs

    def shapes(self, phi: Array, elements: slice) -> Array:
        """Displacement of the points per column of phi (n_raw, n): (e, r q, 3, n)."""
        local = self.map.local(phi, elements)
        m, (e, _, n) = self.P.shape[1], local.shape
        u, v = (np.matmul(self.P, local[:, i : 2 * m : 2]) for i in (0, 1))  # (e, q, n)
        w, bx, by = np.matmul(self.bending(elements), local[:, None, 2 * m :]).swapaxes(0, 1)
        layers = [np.stack([u + z * bx, v + z * by, w], axis=2) for z in self.heights]
        own = np.stack(layers, axis=1).reshape(e, -1, 3, n)
        return np.matmul(of(self.axes, elements).swapaxes(1, 2)[:, None], own)

    def scalar_mass(self, elements: slice = EVERY) -> Array:
        """Mass matrices (e, m, m) of one in-plane component."""
        m = self.P.shape[1]
        products = (self.P[:, :, None] * self.P[:, None, :]).reshape(-1, m * m)
        return (self._dm_by_layer(elements).sum(axis=1) @ products).reshape(-1, m, m)

    def bending_mass(self, elements: slice = EVERY) -> Array:
        """Mass matrices (e, b, b) of the bending dofs, with rotary inertia."""
        dm = self._dm_by_layer(elements)
        N = self.bending(elements)
        turning = np.einsum("erq,r->eq", dm, self.heights**2)
        weight = np.stack([dm.sum(axis=1), turning, turning], axis=1)[..., None]
        flat, weighted = N.reshape(len(N), -1, N.shape[3]), (N * weight).reshape(len(dm), -1, N.shape[3])
        return np.matmul(flat.swapaxes(1, 2), weighted)

    def mass(self, elements: slice = EVERY) -> Array:
        """Element mass matrices (e, l, l)."""
        inplane = np.asarray(np.kron(self.scalar_mass(elements), np.eye(2)), np.float64)
        return self.map.in_raw(inplane, self.bending_mass(elements), elements)

    def parts(self) -> tuple[Part, ...]:
        """Element matrices for assembly: u and v alike, and bending, where they do not mix."""
        picked = self.map.picked()
        if picked is None:
            return (Part(self.dofs, self.mass),)
        column, sign = picked
        m = self.P.shape[1]
        inplane = self.dofs[:, column[: 2 * m]].reshape(-1, m, 2)
        signs = np.outer(sign[2 * m :], sign[2 * m :])
        if not (sign[: 2 * m].reshape(m, 2) == sign[:2]).all():
            return (Part(self.dofs, self.mass),)
        return (
            Part(inplane, self.scalar_mass),
            Part(self.dofs[:, column[2 * m :]], lambda elements: self.bending_mass(elements) * signs),
        )

    def _dm_by_layer(self, elements: slice) -> Array:
        return self.dm[elements].reshape(-1, len(self.heights), len(self.P))


@dataclass(frozen=True, eq=False)
class PlateStrain:
    """Points of strain of plates.

    weight    (e, q)          area
    elastic   (1|e, 1, s, s)  diag(A, D[, S])
    map       LocalDofs
    dP        (1|e, q, 2, m)  in-plane shape functions by x and y
    slopes    elements -> (1|e, q, 2, b)    w,x  w,y
    bending   elements -> (1|e, q, 3|5, b)  kappa (3) [gamma (2)]
    fine      elements -> PlateStrain       of these elements alone, over enough points for fourth powers of the slopes
    tied      elements -> PlateStrain, ...  of these elements alone: the strain at the points where stretch is sampled,
                                            then what its linear part lacks there
    stress    (1|e, 1, s)                   initial membrane forces, moments and shear forces
    linear    whether squares of the slopes are left out

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

    @property
    def dofs(self) -> Index:
        """Raw dofs (e, l)."""
        return self.map.dofs

    @property
    def linear_map(self) -> Array:
        """Linear strain from g, (6|8, 9|11)."""
        n = self.elastic.shape[2]
        linear = np.zeros((n, n + 3))
        linear[0, 0] = linear[1, 3] = linear[2, 1] = linear[2, 2] = 1.0
        linear[3:, 6:] = np.eye(n - 3)
        return linear

    @property
    def quadratic_map(self) -> Array:
        """Quadratic strain from g, (6|8, 9|11, 9|11): von Karman's, and the curvature of plates bent far."""
        n = self.elastic.shape[2]
        quadratic = np.zeros((n, n + 3, n + 3))
        if self.linear:
            return quadratic
        quadratic[0, 4, 4] = quadratic[1, 5, 5] = quadratic[2, 4, 5] = quadratic[2, 5, 4] = 1.0
        for strain, kappa in zip((3, 4, 5), (6, 7, 8), strict=True):
            quadratic[strain, kappa, [0, 3]] = quadratic[strain, [0, 3], kappa] = -1.0
        return quadratic

    def gradients(self, phi: Array, elements: slice, most: int | None = None) -> Array:
        """Generalised gradients per column of phi (n_raw, n): (e, q, 9|11, n)."""
        local = self.map.local(phi, elements)[:, None]
        m, dP = self.dP.shape[3], of(self.dP, elements)
        inplane = [np.matmul(dP, local[:, :, i : 2 * m : 2]) for i in (0, 1)]
        wanted = (self.slopes, self.bending) if most is None or most > 6 else (self.slopes,)
        bending = [np.matmul(rows(elements), local[:, :, 2 * m :]) for rows in wanted]
        return np.concatenate([*inplane, *bending], axis=2)[:, :, :most]

    def rows(self, elements: slice) -> Array:
        """Generalised gradients per raw dof: (e|1, q, 9|11, l)."""
        X, m = of(self.map.X, elements)[:, None], self.dP.shape[3]
        inplane = [np.matmul(of(self.dP, elements), X[:, :, i : 2 * m : 2]) for i in (0, 1)]
        bending = [np.matmul(rows(elements), X[:, :, 2 * m :]) for rows in (self.slopes, self.bending)]
        e = max(len(part) for part in (*inplane, *bending))
        return np.concatenate([np.broadcast_to(part, (e, *part.shape[1:])) for part in (*inplane, *bending)], axis=2)

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

    def membrane_stiffness(self, elements: slice = EVERY) -> Array:
        """Stiffness matrices (e, 2 m, 2 m) of the in-plane dofs."""
        dP = of(self.dP, elements)
        B = np.zeros((*dP.shape[:2], 3, dP.shape[3], 2))
        B[:, :, 0, :, 0] = B[:, :, 2, :, 1] = dP[:, :, 0]
        B[:, :, 1, :, 1] = B[:, :, 2, :, 0] = dP[:, :, 1]
        B = B.reshape(*dP.shape[:2], 3, -1)
        return self._stiffness(B, of(self.elastic, elements)[:, :, :3, :3], elements)

    def bending_stiffness(self, elements: slice = EVERY) -> Array:
        """Stiffness matrices (e, b, b) of the bending dofs."""
        return self._stiffness(self.bending(elements), of(self.elastic, elements)[:, :, 3:, 3:], elements)

    def stiffness(self, elements: slice = EVERY) -> Array:
        """Element stiffness matrices of the linear strain (e, l, l)."""
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
