"""Strains of shell elements over their dofs: a surface with directors (Naghdi's shell), sampled by `tying`.

x(r, s, z) = sum h_k (x_k + z V_k), displacement u + z eta with eta = sum h_k theta_k x V_k. Covariant strains,
g_a = x,a and d = sum h_k V_k:

    e_ab = (g_a.u,b + g_b.u,a) / 2      kappa_ab = (g_a.eta,b + g_b.eta,a + d,a.u,b + d,b.u,a) / 2
    gamma_a = g_a.eta + d.u,a

all zero in rigid motions. They are transformed to the frame t_1, t_2, n of each point, t_1 the section's x axis
projected onto the surface. The rows have the order of plates (`femflex.fem.plate.strain`):

    g = (u,x  u,y  v,x  v,y  w,x  w,y  kappa_xx  kappa_yy  kappa_xy  gamma_xz  gamma_yz)

with u,x = e_11, v,y = e_22, u,y and v,x = e_12 -+ omega, omega = (t_2.u,1 - t_1.u,2) / 2, and w,x, w,y = n.u,1, n.u,2.
Quadratic strain is J. L. Sanders' for moderate rotations (Q. Appl. Math. 21 (1963) 21):

    E_ab = e_ab + w,a w,b / 2 + delta_ab omega^2 / 2
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.plate.frames import in_plane
from femflex.fem.shell.tying import Products, products
from femflex.fem.tables import element_chunks
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import quadrature

ROWS = 11
MIDDLE = np.array([[0.5, 0.5]])  # of four-sided cells
CHUNK_VALUES = 350_000  # doubles in the rows of elements computed at once: few enough to stay in cache


@dataclass(frozen=True, eq=False)
class ShellGeometry:
    """Elements of one cell type: nodes x (e, k, 3) [m], directors V (e, k, 3), the section's x axis (3,), or at the
    nodes (e, k, 3), and the elastic matrix of membrane strains A (3, 3), which incompatible modes of four-node
    elements use."""

    cell: str
    x: Array
    V: Array
    axis: Array
    A: Array

    def of_elements(self, elements: slice | IntArray) -> ShellGeometry:
        """The geometry (k, ...) [m] of these k elements."""
        axis = self.axis if self.axis.ndim == 1 else self.axis[elements]
        return ShellGeometry(self.cell, self.x[elements], self.V[elements], axis, self.A)


@dataclass(frozen=True, eq=False)
class _Base:
    """Base vectors at points of elements: g (e, q, 2, 3), d (e, q, 3); shape functions h (q, k), dh (q, k, 2)."""

    h: Array
    dh: Array
    g: Array
    d: Array


def _base(geometry: ShellGeometry, points: Array) -> _Base:
    cell = CELL_TYPES[geometry.cell]
    h, dh = cell.interpolation(points), cell.gradients(points)
    x = geometry.x - geometry.x[:, :1]
    g = np.einsum("qka,eki->eqai", dh, x)
    return _Base(h, dh, g, np.einsum("qk,eki->eqi", h, geometry.V))


def areas(geometry: ShellGeometry, points: Array) -> tuple[Array, Array]:
    """Area (e, q) per unit cell and unit normals (e, q, 3) at points (q, 2)."""
    normal, area = _normals(_base(geometry, points))
    return area, normal / area[..., None]


def _normals(base: _Base) -> tuple[Array, Array]:
    """Normals g_1 x g_2 (e, q, 3) and their lengths (e, q), the area per unit cell."""
    normal = np.cross(base.g[:, :, 0], base.g[:, :, 1])
    return normal, np.linalg.norm(normal, axis=2)


def gradient_rows(geometry: ShellGeometry, points: Array) -> Array:
    """Rows (e, q, 11, 6 k) at points (q, 2) of the unit cell; dofs: translations of all nodes, then rotations."""
    e, k = geometry.x.shape[:2]
    rows = np.zeros((e, len(points), ROWS, 6 * k))
    for chunk in element_chunks(e, rows[:1].size, CHUNK_VALUES):
        _fill_rows(geometry.of_elements(chunk), points, rows[chunk])
    return rows


def _fill_rows(geometry: ShellGeometry, points: Array, rows: Array) -> None:
    """Write the rows of `gradient_rows` of a few elements into rows (e, q, 11, 6 k), which is zero."""
    base = _base(geometry, points)
    e, q = base.d.shape[:2]
    k = base.h.shape[1]
    frame, inverse = _frames(geometry, base)
    tied = products(geometry.cell, points)
    covariant = _inlayer(geometry, tied.inlayer)
    if geometry.cell == "quad9":
        covariant += _mean_correction(geometry, base)
    strain = np.matmul(strain_transform(inverse), covariant)
    if geometry.cell == "quad":
        strain[..., : 6 * k] += _incompatible(geometry, points, base, inverse, strain[..., : 6 * k])
    membrane, bending = strain[..., : 6 * k], strain[..., 6 * k :]
    rows[:, :, 6:9] = bending
    np.matmul(inverse, _shear(geometry, tied), out=rows[:, :, 9:11])
    # displacement derivatives along the frame's axes, du/dx_a = sum_alpha inverse[a, alpha] dh_alpha
    dN = np.matmul(inverse, base.dh.swapaxes(1, 2))  # (e, q, 2, k)
    turn = dN[:, :, 0, :, None] * frame[:, :, None, 1] - dN[:, :, 1, :, None] * frame[:, :, None, 0]
    omega = np.zeros((e, q, 6 * k))
    omega[..., : 3 * k] = turn.reshape(e, q, 3 * k) / 2
    half = membrane[:, :, 2] / 2
    rows[:, :, 0], rows[:, :, 3] = membrane[:, :, 0], membrane[:, :, 1]
    rows[:, :, 1], rows[:, :, 2] = half - omega, half + omega
    rows[:, :, 4:6, : 3 * k] = (dN[..., None] * frame[:, :, None, None, 2]).reshape(e, q, 2, 3 * k)


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


def _inlayer(geometry: ShellGeometry, tied: Array) -> Array:
    """Covariant membrane and bending rows (e, q, 3, 12 k) of products (q, 3, k, k): rr, ss, 2 rs.

    e over u is the product with x, kappa over u that with V, and kappa over theta = theta_k . (V_k x (e over u)_k).
    """
    q, _, k, _ = tied.shape
    flat = tied.reshape(-1, k)
    rows = np.zeros((len(geometry.x), q, 3, 4, 3 * k))
    membrane = np.matmul(flat, geometry.x - geometry.x[:, :1]).reshape(-1, q, 3, k, 3)
    rows[..., 0, :] = membrane.reshape(-1, q, 3, 3 * k)
    rows[..., 2, :] = np.matmul(flat, geometry.V).reshape(-1, q, 3, 3 * k)
    rows[..., 3, :] = _cross_rows(geometry.V, membrane)
    return rows.reshape(-1, q, 3, 12 * k)


def _shear(geometry: ShellGeometry, tied: Products) -> Array:
    """Covariant shear rows (e, q, 2, 6 k): gamma over u is the product with V, over theta that with x, crossed."""
    q, _, k, _ = tied.slope.shape
    rows = np.zeros((len(geometry.x), q, 2, 2, 3 * k))
    x = geometry.x - geometry.x[:, :1]
    rows[..., 0, :] = np.matmul(tied.slope.reshape(-1, k), geometry.V).reshape(-1, q, 2, 3 * k)
    rows[..., 1, :] = _cross_rows(geometry.V, np.matmul(tied.turn.reshape(-1, k), x).reshape(-1, q, 2, k, 3))
    return rows.reshape(-1, q, 2, 6 * k)


def _cross_rows(V: Array, rows: Array) -> Array:
    """V_k x rows (e, q, c, k, 3) as (e, q, c, 3 k), V (e, k, 3); three times as fast as np.cross."""
    product = np.empty_like(rows)
    v = V[:, None, None]
    for i, j, l in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[..., i] = v[..., j] * rows[..., l] - v[..., l] * rows[..., j]
    return product.reshape(*rows.shape[:3], -1)


def _mean_correction(geometry: ShellGeometry, base_at_points: _Base) -> Array:
    """Covariant rows (e, q, 3, 12 k) at points that give the tied strains the element mean of the untied ones.

    Tying changes this mean in elements that are not parallelograms, so that patches of constant stress would not be
    exact. The mean is of strains along the elements' axes, so that it does not depend on those of the section.
    """
    points, weight = quadrature("quad", 3)
    tied = products(geometry.cell, points)
    base = _base(geometry, points)
    middle = _base(geometry, MIDDLE)
    inverse = _element_axes_inverse(geometry, base, middle)
    share = _normals(base)[1] * weight
    share = (share / share.sum(axis=1, keepdims=True))[..., None, None]
    e, q = share.shape[:2]
    weighted = (strain_transform(inverse) * share).swapaxes(1, 2).reshape(e, 3, 3 * q)
    difference = _inlayer(geometry, tied.untied - tied.inlayer).reshape(e, 3 * q, -1)
    return np.asarray(
        np.matmul(_from_element_axes(geometry, base_at_points, middle), np.matmul(weighted, difference)[:, None])
    )


def _element_axes_inverse(geometry: ShellGeometry, base: _Base, middle: _Base) -> Array:
    """dr^alpha/dx_a (e, q, 2, 2) along axes of the elements: their r direction at the middle projected onto the
    surface."""
    return _frames(replace(geometry, axis=np.broadcast_to(middle.g[:, :, 0], geometry.x.shape)), base)[1]


def _from_element_axes(geometry: ShellGeometry, base: _Base, middle: _Base) -> Array:
    """Covariant strains (e, q, 3, 3) of strains along the elements' own axes [1, m, m^2]."""
    return strain_transform(np.asarray(np.linalg.inv(_element_axes_inverse(geometry, base, middle)), float))


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


def _incompatible(geometry: ShellGeometry, points: Array, base: _Base, inverse: Array, membrane: Array) -> Array:
    """Rows (e, q, 3, l) that the modes r for rr, s for ss and r, s for rs of four-node elements add to the membrane
    rows.

    Their amplitudes are those of least energy (J. C. Simo and M. S. Rifai, Int. J. Num. Meth. Engng 29 (1990) 1595), so
    that the rows refer to the nodal dofs only, and the element bends in its plane without locking. The modes are along
    the elements' axes, and are transformed to those of the points, dr^alpha/dx_a = inverse (e, q, 2, 2).
    """
    middle = _base(geometry, MIDDLE)
    to_element_axes = strain_transform(_element_axes_inverse(geometry, middle, middle))
    from_element_axes = np.matmul(strain_transform(inverse), _from_element_axes(geometry, base, middle))
    area0, area = _normals(middle)[1], _normals(base)[1]
    r, s = points.T - 0.5
    modes = np.zeros((len(points), 3, 4))
    modes[:, 0, 0], modes[:, 1, 1], modes[:, 2, 2], modes[:, 2, 3] = r, s, r, s
    M = (
        np.matmul(from_element_axes, np.einsum("ecd,qdm->eqcm", to_element_axes[:, 0], modes))
        * (area0 / area)[..., None, None]
    )
    weighted = np.matmul(geometry.A, M) * area[..., None, None]  # equal weights of 2 by 2 points
    e, q = area.shape
    flat = weighted.reshape(e, 3 * q, 4).swapaxes(1, 2)
    mode_stiffness = np.matmul(flat, M.reshape(e, 3 * q, 4))
    load = np.matmul(flat, membrane.reshape(e, 3 * q, -1))
    amplitude = -np.linalg.solve(mode_stiffness, load)
    return np.asarray(np.matmul(M, amplitude[:, None]))
