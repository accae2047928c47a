"""Solutions with tangents of bent structures, positive or not."""

import numpy as np
import pytest
from scipy import sparse
from support.nonlinear_models import METAL

from femflex.fem import Member, build_structure
from femflex.mesh import rectangle
from femflex.reduction import cantilever_modes
from femflex.reduction.boundary.clamps import free_dofs
from femflex.reduction.boundary.pivots import factors, negative_pivots, solved


@pytest.mark.parametrize("share", [-0.5, 0.5, 1.5, 4.0])
def test_tangents_beyond_buckling_are_solved_as_dense_ones_are(share):
    """A plate pressed between two edges by so many times what buckles it has as many negative eigenvalues as pivots."""
    plate = build_structure(rectangle(1.0, 0.6, 8, 5, "quad"), [Member("surface", "plate_bfs", 0.01, METAL)])
    shapes = cantilever_modes(plate, {"left": ("x", "y", "z", "rx", "ry", "rz"), "right": ("z", "rx", "ry", "rz")}, 2)
    free = free_dofs(plate, shapes.held)
    pressed = -plate.mesh.points[:, 0] @ plate.translation[0::3]
    K, rest = plate.internal_force.tangent(1e-4 * pressed)[free][:, free].toarray(), plate.K[free][:, free].toarray()
    first = -1.0 / np.linalg.eigvals(np.linalg.solve(rest, K - rest)).real.min()
    K = rest + share * first * (K - rest)
    b = np.random.default_rng(0).normal(size=(len(free), 3))
    assert solved(sparse.csr_array(K), b) == pytest.approx(np.linalg.solve(K, b), rel=1e-6, abs=1e-9)
    negative = int(np.sum(np.linalg.eigvalsh(K) < 0.0))
    assert (share > 1.0) == (negative > 0) and negative_pivots(factors(sparse.csr_array(K))) == negative


def test_rows_are_exchanged_where_a_pivot_on_the_diagonal_is_nothing():
    for small in (0.0, 1e-14):
        K = np.array([[small, 1.0, 0.0], [1.0, small, 2.0], [0.0, 2.0, 3.0]])
        b = np.array([[1.0], [2.0], [3.0]])
        np.testing.assert_allclose(solved(sparse.csr_array(K), b), np.linalg.solve(K, b), rtol=1e-10, atol=1e-12)
