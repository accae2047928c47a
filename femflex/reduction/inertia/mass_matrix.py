"""Mass moments of shapes: those that a mass matrix determines, and those that need a distribution of the mass.

A mass matrix M over translations u_i and rotations theta_i of nodes gives exactly, with the rigid motions R,

    mass, centre of mass, inertia at rest    R^T M R
    int phi_k dm,  int rho x phi_k dm        R^T M phi
    elastic mass                             phi^T M phi

The other second moments P[A, a, B, b] = int z_Aa z_Bb dm depend on which mass moves in which direction. A mass matrix
determines this if it is the sum of a scalar part, m_ij 1 on the translations of nodes i and j, as of all elements with
scalar shape functions (solids, consistent or lumped), and of rigid masses attached to nodes, with offset S_i = int s dm
and Q_i = int s s^T dm about the node. With z_A = a_A + G_A s, G_0 = 1 and G_k = skew(theta_k),

    P[A, a, B, b] = sum_ij m_ij a_iAa a_jBb + sum_i [ a_A (G_B S)^T + (G_A S) a_B^T + G_A Q G_B^T ]_iab

(THEORY section 3). Other mass matrices (consistent beams and shells) are lumped into such a sum by rows; then

    P[0, a, k, b]   its symmetric part is that of the rigid masses and (E rho)^T M phi_k of the others, with the linear
                    displacement E rho of all nodes, whose rotations follow from K; its skew part is that of
                    int rho x phi_k dm
    P[k, a, l, b]   is that of the lumped mass, with the shapes recombined so that P[k, a, l, a] is the elastic mass
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg, sparse

from femflex.arrays import Array
from femflex.body import MassMoments
from femflex.fem.eigen.shift_invert import factorise
from femflex.fem.matrix_structure import MatrixStructure
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.inertia.moments import point_moments

EXACT = 1e-9  # entry of the mass matrix that is not of the sum above, over the geometric mean of its two diagonal ones
HEAVY = 0.5  # part of a shape's elastic mass in the lumped one, above which that determines its directions
PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
SKEW = np.cross(np.eye(3)[:, None], np.eye(3)[None])  # eps_cab: component b of e_c x e_a, and cyclic


@dataclass(frozen=True, eq=False)
class NodalMass:
    """A mass matrix as a scalar part and rigid masses at nodes.

    points  (n, 3)       all nodes
    scalar  (n, n)       m_ij
    offset  (n, 3)       S_i [kg m]
    second  (n, 3, 3)    Q_i [kg m^2]
    rows    translation and rotation (3 n, n_dof) of the nodes
    rest    largest entry of the matrix that is not of this sum, over the geometric mean of its diagonal ones
    """

    points: Array
    scalar: sparse.csr_array
    offset: Array
    second: Array
    rows: tuple[sparse.csr_array, sparse.csr_array]
    rest: float

    @property
    def exact(self) -> bool:
        """Whether the mass matrix is such a sum to rounding."""
        return self.rest <= EXACT

    def moments(self, phi: Array) -> MassMoments:
        """Mass moments, units as there, over the shapes phi (n_dof, n); the sum of this file's heading."""
        a = self._translations(phi)
        ma = (self.scalar @ a.reshape(len(a), -1)).reshape(a.shape)
        first, second = self.of_rigid_masses(phi)
        return MassMoments(float(self.scalar.sum()), ma.sum(axis=0).T + first, _gram(a, ma) + second)

    def of_rigid_masses(self, phi: Array) -> tuple[Array, Array]:
        """First (1 + n, 3) [kg m] and second moments (1 + n, 3, 1 + n, 3) [kg m^2] of offsets and inertias of the rigid
        masses."""
        k = phi.shape[1]
        at = np.flatnonzero(self.offset.any(axis=1) | self.second.any(axis=(1, 2)))
        theta = (self.rows[1] @ phi).reshape(len(self.points), 3, k)[at]
        turned = _rotated_offsets(theta, self.offset[at])
        cross = _gram(self._translations(phi)[at], turned)
        value, axes = np.linalg.eigh(self.second[at])
        second = cross + cross.transpose(2, 3, 0, 1)
        for q in range(3):
            arm = _rotated_offsets(theta, axes[:, :, q])
            second = second + _gram(arm, arm * value[:, q, None, None])
        return turned.sum(axis=0).T, second

    def of_scalar_part(self, M: sparse.csr_array) -> sparse.csr_array:
        """The mass matrix M (n_dof, n_dof) without the offsets and inertias of the rigid masses."""
        t, r = self.rows
        J = np.trace(self.second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - self.second
        cross = t.T @ _blocks(np.einsum("cab,ic->iab", SKEW, self.offset)) @ r
        return sparse.csr_array(M - cross - cross.T - r.T @ _blocks(J) @ r)

    def _translations(self, phi: Array) -> Array:
        """Places and translations (node, axis, 1 + n)."""
        moved = (self.rows[0] @ phi).reshape(len(self.points), 3, phi.shape[1])
        return np.concatenate([self.points[:, :, None], moved], axis=2)


@dataclass(frozen=True, eq=False)
class PointMasses:
    """Masses dm (p,) at places rho (p, 3) which the dofs move by rows (3 p, n_dof)."""

    dm: Array
    rho: Array
    rows: sparse.csr_array
    exact: bool = False

    def moments(self, phi: Array) -> MassMoments:
        """See `NodalMass.moments`, with its shapes and units."""
        return point_moments(self.dm, self.rho, (self.rows @ phi).reshape(len(self.dm), 3, phi.shape[1]))


@dataclass(frozen=True, eq=False)
class KnownMoments:
    """Mass moments over (rho, the displacement of every unit dof), as a reduced model can bring them along."""

    of_dofs: MassMoments
    exact: bool = True

    def moments(self, phi: Array) -> MassMoments:
        """See `NodalMass.moments`, with its shapes and units."""
        k = phi.shape[1]
        X = np.zeros((len(phi) + 1, k + 1))
        X[0, 0], X[1:, 1:] = 1.0, phi
        second = np.einsum("iajb,ik,jl->kalb", self.of_dofs.second, X, X, optimize=True)
        return MassMoments(self.of_dofs.mass, X.T @ self.of_dofs.first, second)


Distribution = NodalMass | PointMasses | KnownMoments  # an assumed one of the mass; `exact` if it is that of the matrix


@dataclass(frozen=True, eq=False)
class MatrixMoments:
    """Mass moments from a mass matrix, and the part of them that the matrix determines.

    moments   MassMoments
    exact     whether all of them are those of the matrix
    missed    largest part of a shape's elastic mass that the distribution has too much or too little of, before it is
              fitted to the matrix; nan where nothing is known of the distribution
    """

    moments: MassMoments
    exact: bool
    missed: float


def matrix_moments(structure: MatrixStructure, phi: Array, distribution: Distribution | None = None) -> MatrixMoments:
    """Mass moments (units of `MassMoments`) of shapes phi (n_dof, n) of given matrices.

    distribution: that of the mass, for models whose dofs are not those of all nodes; by default that of the nodes. The
    default misses most of some shapes of reduced models: then the symmetric part of int rho phi_k dm counts as zero,
    and int phi_k phi_l dm as equal along the three axes.
    """
    distribution = distribution or nodal_mass(structure)
    near = distribution.moments(phi)
    if distribution.exact:
        return MatrixMoments(near, True, 0.0)
    R = rigid_shapes(structure)
    MR = structure.M @ R
    G, h, Me = R.T @ MR, MR.T @ phi, phi.T @ (structure.M @ phi)
    n = phi.shape[1]
    part = _parts(near.second[1:, :, 1:], (Me + Me.T) / 2)
    known = not structure.scalars.size or bool((part[0] > HEAVY).all())  # else most of the nodes are elsewhere
    first = np.concatenate([_offset_of(G[:3, 3:])[None], h[:3].T])
    second = np.zeros((1 + n, 3, 1 + n, 3))
    second[0, :, 0] = _second_of((G[3:, 3:] + G[3:, 3:].T) / 2)
    mixed = np.einsum("cab,ck->akb", SKEW, h[3:]) / 2
    if known and isinstance(distribution, NodalMass):
        given = distribution.of_rigid_masses(phi)[1][0, :, 1:]
        mixed = mixed + _symmetric_moments(structure, phi, distribution.of_scalar_part(structure.M))
    else:
        given = near.second[0, :, 1:] * known
    mixed = mixed + (given + given.transpose(2, 1, 0)) / 2
    second[0, :, 1:], second[1:, :, 0] = mixed, mixed.transpose(1, 2, 0)
    second[1:, :, 1:] = _fitted(near.second[1:, :, 1:], Me, part if known else (0.0 * part[0], part[1]))
    missed = float(np.abs(part[0] - 1.0).max(initial=0.0)) if known else np.nan
    return MatrixMoments(MassMoments(float(np.trace(G[:3, :3])) / 3, first, second), False, missed)


def nodal_mass(structure: MatrixStructure) -> NodalMass:
    """The NodalMass closest to the mass matrix of a structure, by rows; exact if the matrix is such a sum."""
    n = len(structure.mesh.points)
    t, r = structure.translation, structure.rotation
    Mtt, Mtr, Mrr = (sparse.csr_array(a @ structure.M @ b.T) for a, b in ((t, t), (t, r), (r, r)))
    present = (np.asarray(t.multiply(t).sum(axis=1)).ravel() > 0.5).reshape(n, 3)
    total = sum((Mtt[a::3][:, a::3] for a in range(3)), sparse.csr_array((n, n))).tocoo()
    i, j = total.coords
    number = np.maximum((present[i] & present[j]).sum(axis=1), 1)
    scalar = sparse.csr_array(sparse.coo_array((total.data / number, (i, j)), shape=(n, n)))
    offset = _offset_of(_row_sums(Mtr, n))
    J = _row_sums(Mrr, n)
    J = (J + J.swapaxes(1, 2)) / 2
    keep = sparse.diags_array(present.ravel().astype(float))
    of_nodes = (keep @ sparse.kron(scalar, sparse.eye_array(3)) @ keep).tocsr()
    skew = np.einsum("cab,ic->iab", SKEW, offset)
    parts = [Mtt - of_nodes, Mtr - _blocks(skew), Mrr - _blocks(J), structure.M[structure.scalars]]
    size = [np.sqrt(np.maximum(matrix.diagonal(), 0.0)) for matrix in (Mtt, Mrr, structure.M)]
    sizes = [(size[0], size[0]), (size[0], size[1]), (size[1], size[1]), (size[2][structure.scalars], size[2])]
    rest = max(_largest(part, *rows_and_columns) for part, rows_and_columns in zip(parts, sizes, strict=True))
    return NodalMass(structure.mesh.points, scalar, offset, _second_of(J), (t, r), rest)


def _largest(part: sparse.csr_array, left: Array, right: Array) -> float:
    """Largest entry over the sizes of its row and column."""
    entries = part.tocoo()
    size = left[entries.coords[0]] * right[entries.coords[1]]
    value = np.abs(entries.data)
    least = 1e-300 + 1e-12 * max(float(np.max(left, initial=0.0) * np.max(right, initial=0.0)), 0.0)
    return float(np.max(value / np.maximum(size, least), initial=0.0))


def _row_sums(matrix: sparse.csr_array, n: int) -> Array:
    """Sums (n, 3, 3) over the nodes of the columns."""
    return np.asarray(matrix @ np.tile(np.eye(3), (n, 1))).reshape(n, 3, 3)


def _blocks(blocks: Array) -> sparse.csr_array:
    n = len(blocks)
    rows = np.repeat(np.arange(3 * n), 3)
    columns = (3 * np.arange(n)[:, None, None] + np.arange(3)[None, None]).repeat(3, axis=1).ravel()
    return sparse.csr_array(sparse.coo_array((blocks.ravel(), (rows, columns)), shape=(3 * n, 3 * n)))


def _offset_of(block: Array) -> Array:
    """S (..., 3) of blocks B_ab = eps_cab S_c (..., 3, 3), by their skew parts."""
    return np.einsum("cab,...ab->...c", SKEW, block) / 2


def _second_of(J: Array) -> Array:
    """int s s^T dm = tr(J)/2 1 - J of inertias (..., 3, 3)."""
    return np.trace(J, axis1=-2, axis2=-1)[..., None, None] / 2 * np.eye(3) - J


def _gram(a: Array, b: Array) -> Array:
    """sum_i a_iAa b_iBb of (node, axis, 1 + n): (1 + n, 3, 1 + n, 3)."""
    k = a.shape[2]
    flat = a.reshape(len(a), 3 * k).T @ b.reshape(len(b), 3 * k)
    return np.asarray(flat.reshape(3, k, 3, k).transpose(1, 0, 3, 2))


def _rotated_offsets(theta: Array, s: Array) -> Array:
    """G_A s of nodes: s itself, then theta_k x s; (node, axis, 1 + n)."""
    return np.concatenate([s[:, :, None], np.cross(theta, s[:, :, None], axis=1)], axis=2)


def _symmetric_moments(structure: MatrixStructure, phi: Array, M: sparse.csr_array) -> Array:
    """Symmetric part (3, n, 3) of int rho_a phi_kb dm of M, by linear displacements E rho of the nodes."""
    X = structure.mesh.points
    u = np.zeros((len(X), 3, len(PAIRS)))
    for column, (a, b) in enumerate(PAIRS):
        u[:, a, column] += X[:, b] / 2
        u[:, b, column] += X[:, a] / 2
    T = structure.translation
    moved = np.diff(T.tocsc().indptr) > 0
    x = np.zeros((structure.n_dof, len(PAIRS)))
    x[moved] = (T.T @ u.reshape(-1, len(PAIRS)))[moved]  # the columns of T are orthonormal
    rest = np.flatnonzero(~moved)
    if rest.size:
        K = structure.K[rest]
        own = K[:, rest]
        own = own + sparse.diags_array(np.maximum(1e-10 * own.diagonal(), 1e-300 + 1e-14 * own.diagonal().max()))
        x[rest] = -factorise(sparse.csr_array(own)).solve(np.ascontiguousarray(K[:, moved] @ x[moved]))
    value = x.T @ (M @ phi)
    out = np.zeros((3, phi.shape[1], 3))
    for column, (a, b) in enumerate(PAIRS):
        out[a, :, b] = out[b, :, a] = value[column]
    return out


def _parts(near: Array, Me: Array) -> tuple[Array, Array]:
    """Parts (n,) of the elastic mass Me that second moments (n, 3, n, 3) contain, for combinations (n, n) of shapes.

    In these combinations x of shapes both are diagonal, x^T Me x = 1 and x^T tr(near) x = diag(parts).
    """
    if not len(Me):
        return np.zeros(0), np.zeros((0, 0))
    trace = np.einsum("kala->kl", near)
    part, x = linalg.eigh((trace + trace.T) / 2, Me)
    return part, x


def _fitted(near: Array, Me: Array, parts: tuple[Array, Array]) -> Array:
    """Second moments (n, 3, n, 3) of shapes near the given ones, with the traces Me (n, n).

    Combinations with a part lambda > HEAVY are rescaled by lambda^-1/2; the others (twist of a line of nodes) get what
    is missing equally along the three axes.
    """
    part, x = parts
    if not len(part):
        return near
    heavy = part > HEAVY
    back = np.linalg.inv(x)
    C = x * np.where(heavy, 1 / np.sqrt(np.where(heavy, part, 1.0)), part > 0) @ back  # shapes phi C
    second = np.einsum("iajb,ik,jl->kalb", near, C, C, optimize=True)
    light = (back.T * np.where(heavy, 0.0, 1.0 - np.maximum(part, 0.0))) @ back
    return np.asarray(second + np.einsum("kl,ab->kalb", light, np.eye(3) / 3))
