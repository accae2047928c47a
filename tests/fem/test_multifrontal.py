"""Cholesky factors by nested dissection, against scipy's factors and exact products."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from femflex.fem import Material, Member, build_structure
from femflex.fem.eigen import multifrontal
from femflex.fem.eigen.multifrontal import Cholesky, dissection, worthwhile
from femflex.fem.eigen.shift_invert import factorised
from femflex.mesh import box, rectangle
from femflex.reduction.boundary.pivots import negative_pivots

METAL = Material(70e9, 0.3, 2700.0)


def clamped(mesh, member) -> sparse.csr_array:
    s = build_structure(mesh, [member])
    free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("left"))
    return s.K[free][:, free]


def block() -> sparse.csr_array:
    return clamped(box(2.0, 1.0, 1.0, 8, 4, 4, "hexahedron20"), Member("volume", "solid", material=METAL))


def test_solutions_are_those_of_the_matrix_for_one_and_for_many_loads():
    K = block()
    exact = np.random.default_rng(0).normal(size=(K.shape[0], 3))
    factors = Cholesky(K)
    np.testing.assert_allclose(factors.solve(K @ exact), exact, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(factors.solve(K @ exact[:, 0]), exact[:, 0], rtol=1e-8, atol=1e-9)


def test_parts_of_the_order_join_what_lies_below_them_and_cut_the_rest_apart():
    K = block()
    order, parts = dissection(K)
    assert np.array_equal(np.sort(order), np.arange(K.shape[0]))
    assert [p.end for p in parts[:-1]] == [p.begin for p in parts[1:]]
    joined = [k for p in parts for k in p.below]
    assert sorted(joined) == sorted(set(joined))
    top = next(p for p in reversed(parts) if len(p.below) > 1)
    assert top.end - top.begin < 0.1 * K.shape[0]


def test_a_matrix_in_pieces_is_solved():
    K = block()
    both = sparse.block_diag([K, K]).tocsr()
    b = np.random.default_rng(1).normal(size=both.shape[0])
    x = Cholesky(both).solve(b)
    np.testing.assert_allclose(both @ x, b, atol=1e-9 * np.abs(b).max())


def test_what_is_not_positive_definite_is_factorised_with_pivots(monkeypatch):
    monkeypatch.setattr(multifrontal, "FEW_DOFS", 100)
    monkeypatch.setattr(multifrontal, "WIDE", 1.0)
    K = block()
    assert isinstance(factorised(K), Cholesky) and negative_pivots(factorised(K)) == 0
    shifted = (K - 10 * sparse.diags_array(K.diagonal())).tocsr()
    with pytest.raises(np.linalg.LinAlgError):
        Cholesky(shifted)
    b = np.ones(K.shape[0])
    np.testing.assert_allclose(shifted @ factorised(shifted).solve(b), b, atol=1e-8)
    assert negative_pivots(factorised(shifted)) == K.shape[0]


def test_fronts_are_for_solids(monkeypatch):
    monkeypatch.setattr(multifrontal, "FEW_DOFS", 100)
    solid = clamped(box(1.0, 1.0, 1.0, 8, 8, 8, "hexahedron20"), Member("volume", "solid", material=METAL))
    shell = clamped(rectangle(1.0, 1.0, 20, 20, "quad9"), Member("surface", "shell", 0.01, METAL))
    assert worthwhile(solid) and not worthwhile(shell)
