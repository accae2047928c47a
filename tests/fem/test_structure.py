"""Structures: shared nodes, assembly, matrices that are given, and stress that settles."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from support.nonlinear_models import STRUCTURES, random_state
from support.plate_models import METAL, random_rotation

from femflex.fem import Material, Member, build_structure
from femflex.fem.deflected import RelaxedStrain, settled_stress, with_settled_stress
from femflex.fem.matrix_structure import SCALAR, structure_from_matrices
from femflex.fem.sections import Circle
from femflex.mesh import Mesh, line

MATERIAL = Material(70e9, 0.3, 2700.0)


def cross_mesh() -> Mesh:
    """Two booms that share the node (1, 0, 0), and a point that belongs to neither."""
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 3, 0], [5, 5, 5]]
    lines = [[0, 1], [1, 2], [1, 3]]
    groups = {"long": {"line": [0, 1]}, "side": {"line": [2]}, "all": {"line": [0, 1, 2]}}
    return Mesh(np.array(points, float), {"line": np.array(lines)}, groups, {"root": [0], "away": [4], "joint": [1]})


def test_dofs_of_shared_and_loose_nodes():
    mesh = cross_mesh()
    single = build_structure(mesh, [Member("all", "beam", Circle(0.02), MATERIAL)])
    divided = build_structure(mesh, [Member(g, "beam", Circle(0.02), MATERIAL) for g in ("long", "side")])
    assert single.n_dof == divided.n_dof == 4 * 6 + 3 * 5
    assert np.linalg.eigvalsh(single.M.toarray()) == pytest.approx(np.linalg.eigvalsh(divided.M.toarray()), rel=1e-9)
    for operator in (single.translation, single.rotation):
        rows = operator.toarray()
        assert np.abs(rows[12:]).max() == 0.0
        assert rows[:12] @ rows[:12].T == pytest.approx(np.eye(12))
    assert abs(single.translation @ single.rotation.T).max() == 0.0


def matrices():
    """A modal coordinate, displacements of two points along skew axes, a rotation of one, in no order."""
    rng = np.random.default_rng(3)
    dofs = np.array([[2, 1], [SCALAR, 0], [0, 2], [2, 0], [0, 4], [2, 2], [0, 0]])
    A = rng.normal(size=(3, 7, 7))
    M, K, D = (sparse.csr_array(a @ a.T) for a in A)
    mesh = Mesh(rng.normal(size=(3, 3)), {"line": [[0, 2]]}, {"wire": {"line": [0]}}, {"far": [2]})
    frames = np.stack([random_rotation(k) for k in (41, 42, 43)])
    return mesh, dofs, M, K, D, frames


def test_matrix_structure_with_own_axes():
    mesh, dofs, M, K, D, frames = matrices()
    recovery = (np.array([[9.0, 8, 7], [6, 5, 4]]), sparse.csr_array(np.random.default_rng(1).normal(size=(6, 7))))
    s = structure_from_matrices(mesh, dofs, M, K, D, frames, recovery)
    x = np.random.default_rng(2).normal(size=7)
    u, turn = np.zeros((3, 3)), np.zeros((3, 3))
    for value, (point, component) in zip(x, dofs, strict=True):
        if point >= 0:
            (u if component < 3 else turn)[point] += value * frames[point][component % 3]
    assert (s.translation @ x).reshape(3, 3) == pytest.approx(u)
    assert (s.rotation @ x).reshape(3, 3) == pytest.approx(turn)
    assert s.scalars.tolist() == [1] and np.array_equal(s.places_of_dofs, dofs)
    for computed, given in ((s.M, M), (s.K0, K), (s.D, D)):
        assert computed.toarray() == pytest.approx(given.toarray())
    assert s.skin.points == pytest.approx(np.concatenate([mesh.points, recovery[0]]))
    assert s.skin.cells["line"].tolist() == [[0, 2]] and s.skin.cells["vertex"].tolist() == [[3], [4]]
    moved = (s.skin.operator @ x).reshape(-1, 3)
    assert moved[[0, 2]] == pytest.approx(u[[0, 2]]) and moved[3:].ravel() == pytest.approx(recovery[1] @ x)
    plain = structure_from_matrices(Mesh(mesh.points, {}), dofs, M, K)
    assert plain.D is None and plain.skin.cells["vertex"].ravel().tolist() == [0, 1, 2]
    assert (plain.translation @ x).reshape(3, 3)[2] == pytest.approx(x[[3, 0, 5]])


@pytest.mark.parametrize("name", ["prestressed plate", "hot bfs", "prestressed solid", "pretensioned beam", "bfs"])
def test_settled_stress(name):
    """f0 gains K0 x, whatever the elements' own points; the energy gains the work of that stress."""
    s = STRUCTURES[name]()
    x, d = random_state(s, 1e-4), random_state(s, 1e-3, seed=1)
    computed = with_settled_stress(s, x)
    assert computed.f0 == pytest.approx(s.f0 + s.K0 @ x, abs=1e-7 * np.abs(s.K0 @ x).max())
    V, W = s.internal_force, computed.internal_force
    gained = W.energy(d) - V.energy(d)
    linear = (W.energy(1e-3 * d) - W.energy(-1e-3 * d)) / 2e-3
    assert linear == pytest.approx(computed.f0 @ d, rel=1e-5)
    assert np.isfinite(gained)
    for block, own in zip(computed.strain, s.strain, strict=True):
        assert isinstance(block, RelaxedStrain)
        np.testing.assert_array_equal(block.stiffness(), own.stiffness())
        eps = np.einsum("sg,eqg->eqs", own.linear_map, own.gradients((s.T @ x)[:, None], slice(None))[..., 0])
        stress = np.broadcast_to(own.stress, eps.shape) + np.matmul(own.elastic, eps[..., None])[..., 0]
        size = np.abs(stress).max(axis=(0, 1))
        assert np.abs(block.stress - stress).max(axis=(0, 1)) == pytest.approx(0 * size, abs=1e-6 * size.max())
        part = block.sampled(slice(1, 2))
        assert part.stress == pytest.approx(settled_stress(own.sampled(slice(1, 2)), s.T @ x), abs=1e-6 * size.max())


def test_fully_relaxed_stress_is_zero():
    """Free to stretch, a hot bar keeps rounding alone, which counts as nothing."""
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 3)
    s = build_structure(mesh, [Member("line", "beam", Circle(0.02), METAL, {"thermal_strain": 1e-4})])
    x = s.translation.T @ (mesh.points * [1e-4, 0, 0]).ravel()
    assert s.stressed and not with_settled_stress(s, x).stressed
    assert with_settled_stress(s, 0.999 * x).stressed
