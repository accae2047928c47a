"""Cholesky factors by nested dissection, against scipy's factors and exact products."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from femflex.fem import Material, Member, build_structure
from femflex.fem.eigen.multifrontal import Cholesky
from femflex.mesh import box

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
