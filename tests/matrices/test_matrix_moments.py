"""Mass moments from mass matrices: against the elements that made them, and against points of mass written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from support.matrix_examples import boom, brick

from femflex.fem.matrix_structure import structure_from_matrices
from femflex.matrices import check_model, craig_bampton_model, full_model, matrix_body
from femflex.mesh import Mesh
from femflex.reduction import cantilever_modes, craig_bampton, free_free_modes, reduce_structure
from femflex.reduction.inertia.mass_matrix import matrix_moments, nodal_mass
from femflex.reduction.matrices import reduce_matrices
from femflex.warning import PhysicsWarning


@pytest.mark.parametrize("free", [False, True])
def test_moments_of_solids_equal_those_of_elements(free):
    s = brick()
    given = full_model(s).structure()
    modes = [
        free_free_modes(structure, 5) if free else cantilever_modes(structure, "left", 5) for structure in (s, given)
    ]
    reference = reduce_structure(s, modes[0], turning=())
    computed = reduce_matrices(given, modes[1], turning=())
    a, b = reference.moments, computed.body.moments
    assert computed.body.omega == pytest.approx(reference.omega, rel=1e-9)
    assert b.mass == pytest.approx(a.mass, rel=1e-12)
    assert b.first == pytest.approx(a.first, abs=1e-9 * np.abs(a.first).max())
    assert b.second == pytest.approx(a.second, abs=1e-9 * np.abs(a.second).max())


def rigid_nodes(offset=True, seed=3):
    """Four nodes with a scalar mass between them and rigid masses with offset; their matrix and random motions."""
    rng = np.random.default_rng(seed)
    X = rng.standard_normal((4, 3))
    A = rng.standard_normal((4, 4))
    scalar = A @ A.T + 4 * np.eye(4)
    points = [(rng.random(5), 0.3 * rng.standard_normal((5, 3)) * offset) for _ in range(4)]
    M = np.zeros((24, 24))
    t = 6 * np.arange(4)[:, None] + np.arange(3)
    for a in range(3):
        M[np.ix_(t[:, a], t[:, a])] += scalar
    for i, (dm, s) in enumerate(points):
        for m, arm in zip(dm, s, strict=True):
            N = np.concatenate([np.eye(3), np.cross(np.eye(3), arm).T], axis=1)  # e_c x arm in column c
            M[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] += m * N.T @ N
    return X, scalar, points, M


def test_moments_of_masses_at_nodes_by_points():
    X, scalar, points, M = rigid_nodes()
    dofs = np.stack(np.divmod(np.arange(24), 6), axis=1)
    s = structure_from_matrices(Mesh(X, {}), dofs, sparse.csr_array(M), sparse.csr_array(np.eye(24)))
    assert nodal_mass(s).rest < 1e-12
    phi = np.random.default_rng(1).standard_normal((24, 3))
    computed = matrix_moments(s, phi)
    assert computed.exact
    u, theta = (phi.reshape(4, 6, 3)[:, part] for part in (slice(0, 3), slice(3, 6)))
    z = np.concatenate([X[:, :, None], u], axis=2)
    second = np.einsum("ij,iaA,jbB->AaBb", scalar, z, z)
    first = np.einsum("ij,jaA->Aa", scalar, z)
    for i, (dm, arms) in enumerate(points):
        for m, arm in zip(dm, arms, strict=True):
            r = np.column_stack([X[i] + arm, u[i] + np.cross(theta[i], arm[:, None], axis=0)])
            second += m * np.einsum("aA,bB->AaBb", r, r)
            first += m * r.T
    assert computed.moments.second == pytest.approx(second, rel=1e-11, abs=1e-11)
    assert computed.moments.first == pytest.approx(first, rel=1e-11, abs=1e-11)
    assert computed.moments.mass == pytest.approx(scalar.sum() + sum(dm.sum() for dm, _ in points))
    assert computed.moments.elastic_mass() == pytest.approx(phi.T @ M @ phi, rel=1e-11)


def test_moments_of_beams_from_their_mass_matrix():
    s = boom(n=24)
    given = full_model(s).structure()
    reference = reduce_structure(s, cantilever_modes(s, "root", 4), {"tip": "tip"}).moments
    computed = reduce_matrices(given, cantilever_modes(given, "root", 4), {"tip": "tip"})
    b = computed.body.moments
    assert b.first == pytest.approx(reference.first, rel=1e-9, abs=1e-9)
    assert b.inertia() == pytest.approx(reference.inertia(), rel=1e-9, abs=1e-9)
    assert b.elastic_mass() == pytest.approx(np.eye(4), abs=1e-9)
    cross = lambda m: np.einsum("abc,akb->kc", EPSILON, m.second[0, :, 1:])  # noqa: E731
    assert cross(b) == pytest.approx(cross(reference), abs=1e-9 * np.abs(cross(reference)).max())
    error = np.abs(b.second - reference.second)
    assert error[0, :, 1:].max() < 1e-4 * np.abs(reference.second[0, :, 1:]).max()
    assert error[1:, :, 1:].max() < 2e-3  # (k h)^2 / 12 of the second bending pair, of unit mass


EPSILON = np.cross(np.eye(3)[:, None], np.eye(3)[None])


@pytest.mark.parametrize("interfaces", [["root", "tip"], ["root"]])
def test_reduced_model_without_moments_keeps_its_rigid_motions(interfaces):
    s = boom()
    modes = craig_bampton(s, interfaces, 3)
    model = craig_bampton_model(reduce_structure(s, modes), interfaces)
    with pytest.warns(PhysicsWarning, match="distribution of mass"):
        plain = matrix_body(replace(model, moments=None, recovery=None)).body
    whole = matrix_body(model).body
    assert plain.moments.first == pytest.approx(whole.moments.first, abs=1e-9)
    assert plain.moments.inertia() == pytest.approx(whole.moments.inertia(), abs=1e-9)
    assert plain.moments.elastic_mass() == pytest.approx(whole.moments.elastic_mass(), abs=1e-9)


@pytest.mark.parametrize(("part", "factor"), [("mass", 1.01), ("first", 0.99), ("second", 1.01)])
def test_moments_of_another_mass_matrix_are_refused(part, factor):
    s = boom()
    model = craig_bampton_model(reduce_structure(s, craig_bampton(s, ["root"], 3)), ["root"])
    assert check_model(model).errors == ()
    other = replace(model.moments, **{part: factor * getattr(model.moments, part)})
    (error,) = check_model(replace(model, moments=other)).errors
    assert f"moments_{part}" in error and "mass matrix" in error and "0.01" in error
