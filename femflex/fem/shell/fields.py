"""Strains of shell elements over their dofs: a surface with directors (Naghdi's shell), sampled by `tying`.

x(r, s, z) = sum h_k (x_k + z V_k), displacement u + z eta with eta = sum h_k theta_k x V_k. Covariant strains,
g_a = x,a and d = sum h_k V_k:

    e_ab = (g_a.u,b + g_b.u,a) / 2      kappa_ab = (g_a.eta,b + g_b.eta,a + d,a.u,b + d,b.u,a) / 2
    gamma_a = g_a.eta + d.u,a

all zero in rigid motions. They are turned into the frame t_1, t_2, n of each point, t_1 the section's x axis laid into
the surface. Rows come as those of plates (`femflex.fem.plate.strain`):

    g = (u,x  u,y  v,x  v,y  w,x  w,y  kappa_xx  kappa_yy  kappa_xy  gamma_xz  gamma_yz)

with u,x = e_11, v,y = e_22, u,y and v,x = e_12 -+ omega, omega = (t_2.u,1 - t_1.u,2) / 2, and w,x, w,y = n.u,1, n.u,2.
Quadratic strain is J. L. Sanders' for moderate rotations (Q. Appl. Math. 21 (1963) 21):

    E_ab = e_ab + w,a w,b / 2 + delta_ab omega^2 / 2
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.fem.plate.frames import in_plane
from femflex.fem.shell.tying import inlayer, shear
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import quadrature

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ROWS = 11


@dataclass(frozen=True, eq=False)
class ShellGeometry:
    """Elements of one cell type: nodes x (e, k, 3), directors V (e, k, 3), the section's x axis (3,), or at the nodes
    (e, k, 3), and the elastic matrix of membrane strains A (3, 3), which incompatible modes of four-node elements
    use."""

    cell: str
    x: Array
    V: Array
    axis: Array
    A: Array

    def over(self, elements: slice | Index) -> ShellGeometry:
        """These elements alone."""
        axis = self.axis if self.axis.ndim == 1 else self.axis[elements]
        return ShellGeometry(self.cell, self.x[elements], self.V[elements], axis, self.A)


@dataclass(frozen=True, eq=False)
class _Base:
    """Base vectors at points of elements: g, d_a (e, q, 2, 3), d (e, q, 3); shape functions h (q, k), dh (q, k, 2)."""

    h: Array
    dh: Array
    g: Array
    d: Array
    d_a: Array


def _base(geometry: ShellGeometry, points: Array) -> _Base:
    cell = CELL_TYPES[geometry.cell]
    h, dh = cell.interpolation(points), cell.gradients(points)
    x = geometry.x - geometry.x[:, :1]
    g = np.einsum("qka,eki->eqai", dh, x)
    return _Base(h, dh, g, np.einsum("qk,eki->eqi", h, geometry.V), np.einsum("qka,eki->eqai", dh, geometry.V))


def areas(geometry: ShellGeometry, points: Array) -> tuple[Array, Array]:
    """Area (e, q) per unit cell and unit normals (e, q, 3) at points (q, 2)."""
    base = _base(geometry, points)
    normal = np.cross(base.g[:, :, 0], base.g[:, :, 1])
    area = np.linalg.norm(normal, axis=2)
    return area, normal / area[..., None]


def gradient_rows(geometry: ShellGeometry, points: Array) -> Array:
    """Rows (e, q, 11, 6 k) at points (q, 2) of the unit cell; dofs: translations of all nodes, then rotations."""
    base = _base(geometry, points)
    e, q = base.d.shape[:2]
    k = base.h.shape[1]
    frame, inverse = _frames(geometry, base)
    rows = np.zeros((e, q, ROWS, 6 * k))
    strain = _inlayer(geometry, points, base, inverse)
    if geometry.cell == "quad9":
        strain = strain + _mean_lost(geometry)
    if geometry.cell == "quad":
        strain[:, :, :, 0] += _incompatible(geometry, points, strain[:, :, :, 0])
    gamma = _shear(geometry, points)
    rows[:, :, 9:11] = np.einsum("eqxa,eqal->eqxl", inverse, gamma)
    rows[:, :, 6:9] = strain[:, :, :, 1]
    # displacement derivatives along the frame's axes, du/dx_a = sum_alpha inverse[a, alpha] dh_alpha
    dN = np.einsum("eqxa,qka->eqxk", inverse, base.dh)
    along = np.einsum("eqci,eqxk->eqcxki", frame, dN).reshape(e, q, 3, 2, 3 * k)
    omega = np.zeros((e, q, 6 * k))
    omega[..., : 3 * k] = (along[:, :, 1, 0] - along[:, :, 0, 1]) / 2
    rows[:, :, 0], rows[:, :, 3] = strain[:, :, 0, 0], strain[:, :, 1, 0]
    rows[:, :, 1] = strain[:, :, 2, 0] / 2 - omega
    rows[:, :, 2] = strain[:, :, 2, 0] / 2 + omega
    rows[:, :, 4:6, : 3 * k] = along[:, :, 2]
    return rows


def _frames(geometry: ShellGeometry, base: _Base) -> tuple[Array, Array]:
    """Frames (e, q, 3, 3) with rows t_1, t_2, n, and dr^alpha/dx_a (e, q, 2, 2): row a, column alpha."""
    normal = np.cross(base.g[:, :, 0], base.g[:, :, 1])
    normal = normal / np.linalg.norm(normal, axis=2, keepdims=True)
    if geometry.axis.ndim == 1:
        first = in_plane(geometry.axis, normal.reshape(-1, 3)).reshape(normal.shape)
    else:
        first = np.einsum("qk,eki->eqi", base.h, geometry.axis)
        first = first - np.sum(first * normal, axis=2, keepdims=True) * normal
        first = first / np.linalg.norm(first, axis=2, keepdims=True)
    frame = np.stack([first, np.cross(normal, first), normal], axis=2)
    jacobian = np.einsum("eqxi,eqai->eqax", frame[:, :, :2], base.g)  # dx_x/dr^a
    return frame, np.linalg.inv(jacobian)


def _covariant(base: _Base, V: Array) -> tuple[Array, Array, Array]:
    """Rows of e and kappa (rr, ss, 2 rs) (e, q, 3, 6 k) and of gamma (rt, st) (e, q, 2, 6 k)."""
    g, d, d_a, h, dh = base.g, base.d, base.d_a, base.h, base.dh
    e, q = d.shape[:2]
    k = h.shape[1]
    u = np.einsum("eqai,qkb->eqabki", g, dh).reshape(e, q, 2, 2, 3 * k)  # g_a . u,b
    turned = np.einsum("eqai,qkb->eqabki", d_a, dh).reshape(e, q, 2, 2, 3 * k)  # d,a . u,b
    arm = np.cross(V[:, None, :, None], g[:, :, None])  # g_a . (theta x V) = theta . (V x g_a): (e, q, k, a, 3)
    eta = np.einsum("eqkai,qkb->eqabki", arm, dh).reshape(e, q, 2, 2, 3 * k)  # g_a . eta,b
    membrane, bending, gamma = (np.zeros((e, q, n, 6 * k)) for n in (3, 3, 2))
    for out, given, at in ((membrane, u, 0), (bending, turned, 0), (bending, eta, 3 * k)):
        own = slice(at, at + 3 * k)
        out[:, :, 0, own], out[:, :, 1, own] = given[:, :, 0, 0], given[:, :, 1, 1]
        out[:, :, 2, own] = given[:, :, 0, 1] + given[:, :, 1, 0]
    gamma[..., : 3 * k] = np.einsum("eqi,qka->eqaki", d, dh).reshape(e, q, 2, 3 * k)
    gamma[..., 3 * k :] = np.einsum("eqkai,qk->eqaki", arm, h).reshape(e, q, 2, 3 * k)
    return membrane, bending, gamma


def _inlayer(geometry: ShellGeometry, points: Array, base: _Base, inverse: Array, tie: bool = True) -> Array:
    """Membrane and bending rows (e, q, 3, 2, 6 k) along the frames at points, tied where the cell asks for it."""
    tying = inlayer(geometry.cell) if tie else None
    own = _base(geometry, tying.at) if tying is not None else base
    both = np.concatenate(_covariant(own, geometry.V)[:2], axis=3)
    covariant = both if tying is None else _tied(tying.weights(points), both)
    return _cartesian(inverse, covariant).reshape(*covariant.shape[:3], 2, -1)


def _mean_lost(geometry: ShellGeometry) -> Array:
    """Constant rows (e, 1, 3, 2, 6 k) that give tied strains the mean over the element that untied ones have.

    In elements that are no parallelograms tying alone changes it, and patches of constant stress would not be exact.
    """
    points, weight = quadrature("quad", 3)
    base = _base(geometry, points)
    _, inverse = _frames(geometry, base)
    area = areas(geometry, points)[0] * weight
    lost = _inlayer(geometry, points, base, inverse, tie=False) - _inlayer(geometry, points, base, inverse)
    mean = np.einsum("eq,eqcbl->ecbl", area / area.sum(axis=1, keepdims=True), lost)
    return mean[:, None]


def _shear(geometry: ShellGeometry, points: Array) -> Array:
    tying = shear(geometry.cell)
    return _tied(tying.weights(points), _covariant(_base(geometry, tying.at), geometry.V)[2])


def _tied(weights: Array, rows: Array) -> Array:
    """Rows (e, q, c, l) from those at tying points (e, t, d, l), weights (q, c, t, d)."""
    q, c, t, d = weights.shape
    flat = rows.reshape(len(rows), t * d, -1)
    return np.matmul(weights.reshape(q * c, t * d), flat).reshape(len(rows), q, c, -1)


def _cartesian(inverse: Array, covariant: Array) -> Array:
    """Engineering strains (e, q, 3, l) along frames from covariant ones rr, ss, 2 rs; inverse (e, q, a, alpha)."""
    return np.einsum("eqcd,eqdl->eqcl", strain_transform(inverse), covariant)


def strain_transform(inverse: Array) -> Array:
    """T (..., 3, 3) [1, m, m^2]: strains (11, 22, 2 12) from covariant (rr, ss, 2 rs), inverse (..., a, alpha) =
    dr^alpha/dx_a."""
    a, b = inverse[..., 0, :], inverse[..., 1, :]
    rows = [
        [a[..., 0] ** 2, a[..., 1] ** 2, a[..., 0] * a[..., 1]],
        [b[..., 0] ** 2, b[..., 1] ** 2, b[..., 0] * b[..., 1]],
        [2 * a[..., 0] * b[..., 0], 2 * a[..., 1] * b[..., 1], a[..., 0] * b[..., 1] + a[..., 1] * b[..., 0]],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _incompatible(geometry: ShellGeometry, points: Array, membrane: Array) -> Array:
    """What the modes r for rr, s for ss and r, s for rs of four-node elements add to the membrane rows, (e, q, 3, l).

    Their amplitudes are those of least energy (J. C. Simo and M. S. Rifai, Int. J. Num. Meth. Engng 29 (1990) 1595), so
    that the rows found are over the nodal dofs alone. In its own plane the element then bends without locking.
    """
    centre = np.array([[0.5, 0.5]])
    _, inverse = _frames(geometry, _base(geometry, centre))
    area0, _ = areas(geometry, centre)
    area, _ = areas(geometry, points)
    r, s = points.T - 0.5
    modes = np.zeros((len(points), 3, 4))
    modes[:, 0, 0], modes[:, 1, 1], modes[:, 2, 2], modes[:, 2, 3] = r, s, r, s
    M = np.einsum("ecd,qdm->eqcm", strain_transform(inverse)[:, 0], modes) * (area0 / area)[..., None, None]
    weighted = np.einsum("cd,eqdm->eqcm", geometry.A, M) * area[..., None, None]  # equal weights of 2 by 2 points
    stiff = np.einsum("eqcm,eqcn->emn", M, weighted)
    load = np.einsum("eqcm,eqcl->eml", weighted, membrane)
    amplitude = -np.linalg.solve(stiff, load)
    return np.einsum("eqcm,eml->eqcl", M, amplitude)
