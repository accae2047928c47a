"""A body from points and matrices alone, against sums over the matrices written out in numpy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh

from femflex.reduction import body_from_matrices
from femflex.warning import PhysicsWarning


def random_system(n=12, k=4, lumped=False, seed=11):
    """Nodes, a consistent (or lumped) mass alike along the axes, a stiffness with six rigid motions, clamped shapes."""
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((n, 3))
    scalar = np.diag(rng.random(n) + 0.5)
    if not lumped:
        A = rng.standard_normal((n, n)) * 0.2
        scalar = scalar + A @ A.T
    M = np.kron(scalar, np.eye(3))
    K = np.zeros((3 * n, 3 * n))
    for i in range(n):
        for j in range(i):  # springs between all pairs
            d = X[i] - X[j]
            row = np.zeros(3 * n)
            row[3 * i : 3 * i + 3], row[3 * j : 3 * j + 3] = d, -d
            K += rng.random() * np.outer(row, row)
    held = np.arange(9)
    free = np.arange(9, 3 * n)
    eigenvalues, V = eigh(K[np.ix_(free, free)], M[np.ix_(free, free)])
    phi = np.zeros((3 * n, k))
    phi[free] = V[:, :k]
    assert held.size == 9
    return X, M, K, phi, np.sqrt(eigenvalues[:k])


@pytest.mark.parametrize("lumped", [False, True])
def test_moments_are_the_nodal_sums_of_the_mass_matrix(lumped):
    X, M, K, phi, omega = random_system(lumped=lumped)
    m = body_from_matrices(X, sparse.csr_array(M), sparse.csr_array(K), phi, omega=omega).moments
    scalar, shapes = M[::3, ::3], [X, *(column.reshape(-1, 3) for column in phi.T)]
    assert m.mass == pytest.approx(scalar.sum())
    for A, za in enumerate(shapes):
        assert m.first[A] == pytest.approx(scalar.sum(axis=0) @ za)
        for B, zb in enumerate(shapes):
            assert m.second[A, :, B, :] == pytest.approx(za.T @ scalar @ zb)


def test_kinetic_energy_is_that_of_the_given_mass_matrix():
    """T from the moments against v^T M v / 2 with every node's velocity v + omega x r + phi ddelta."""
    X, M, K, phi, _ = random_system()
    m = body_from_matrices(X, M, K, phi).moments
    rng = np.random.default_rng(0)
    v, w, delta, rate = rng.standard_normal(3), rng.standard_normal(3), rng.standard_normal(4), rng.standard_normal(4)
    r, dr = X + (phi @ delta).reshape(-1, 3), (phi @ rate).reshape(-1, 3)
    nodal = (v + np.cross(w, r) + dr).ravel()
    y = np.append(1.0, delta)
    coupling = sum(
        y[A] * np.cross(np.eye(3)[b], np.eye(3)[c]) * m.second[A, b, 1:, c][:, None]
        for A in range(5)
        for b in range(3)
        for c in range(3)
    )  # k, axis
    T = 0.5 * m.mass * v @ v + v @ np.cross(w, y @ m.first) + v @ (rate @ m.first[1:])
    T += 0.5 * w @ m.inertia(delta) @ w + w @ (rate @ coupling) + 0.5 * rate @ m.elastic_mass() @ rate
    assert T == pytest.approx(0.5 * nodal @ M @ nodal, rel=1e-12)


def test_stiffness_frequencies_and_kinds():
    X, M, K, phi, omega = random_system()
    body = body_from_matrices(X, M, K, phi, omega=omega)
    assert np.diag(body.strain.V1) == pytest.approx(omega**2)
    assert body.moments.elastic_mass() == pytest.approx(np.eye(4), abs=1e-12)
    assert body.kinds == ("vibration",) * 4 and np.array_equal(body.omega, omega)
    assert body_from_matrices(X, M, K, phi).kinds == ("nodal",) * 4


def test_markers_and_skin_follow_the_nodes():
    X, M, K, phi, _ = random_system()
    body = body_from_matrices(X, M, K, phi, markers={"face": [4, 7, 9, 11]}, cells={"triangle": np.array([[4, 7, 9]])})
    delta = np.array([0.3, -0.2, 0.1, 0.5])
    u, d = (phi @ delta).reshape(-1, 3)[[4, 7, 9, 11]], X[[4, 7, 9, 11]]
    face = body.marker("face")
    assert face.position == pytest.approx(d.mean(axis=0))
    assert face.phi @ delta == pytest.approx(u.mean(axis=0))
    d = d - d.mean(axis=0)
    residual = u - face.phi @ delta - np.cross(face.psi @ delta, d)
    assert np.cross(d, residual).sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)  # the fit's normal equations
    assert np.einsum("n,npa->pa", delta, body.skin.shapes) == pytest.approx((phi @ delta).reshape(-1, 3))
    assert list(body.skin.cells) == ["triangle"]


def test_a_marker_on_one_node_of_translations_is_warned_of():
    X, M, K, phi, _ = random_system()
    with pytest.warns(PhysicsWarning, match="marker 'tip' shows no rotation about 3 of 3 axes"):
        body = body_from_matrices(X, M, K, phi, markers={"tip": [8]})
    assert not body.marker("tip").psi.any()


def test_arrays_that_do_not_fit_are_refused():
    X, M, K, phi, _ = random_system()
    with pytest.raises(ValueError, match="M is 36 x 36, but 11 nodes with three translations need 33 x 33"):
        body_from_matrices(X[1:], M, K, phi)
    with pytest.raises(ValueError, match=r"phi has shape \(33, 4\); shapes over 12 nodes have 36 rows"):
        body_from_matrices(X, M, K, phi[3:])


def test_a_mass_that_differs_along_the_axes_is_refused():
    X, M, K, phi, _ = random_system()
    M = M.copy()
    M[0, 0] += 0.01
    with pytest.raises(ValueError, match="the mass matrix is not alike along the three axes"):
        body_from_matrices(X, M, K, phi)


def test_shapes_with_a_rigid_motion_are_refused():
    X, M, K, phi, _ = random_system()
    phi = phi.copy()
    phi[:, 2] = np.cross([0.1, 0.2, 0.3], X).ravel() + np.tile([1.0, 0, 0], len(X))
    with pytest.raises(ValueError, match="the shapes contain a rigid motion of the body frame"):
        body_from_matrices(X, M, K, phi)
