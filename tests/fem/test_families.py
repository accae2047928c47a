"""Element families of one table: patch tests, rigid motion, mass, stress, drawn surface, derivatives of the energy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import lsqr, spsolve
from support.element_families import FAMILIES, PLACE, patch_of, rough_of

from femflex.body.recovery import named
from femflex.fem import Structure
from femflex.reduction.beams.strain_points import strain_field
from femflex.reduction.boundary.rigid import rigid_shapes

pytestmark = pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
NAMES = tuple(FAMILIES)
ALL = slice(None)


def inner_nodes(s: Structure) -> np.ndarray:
    """Mask of the nodes that lie inside a patch."""
    x, y, _ = (s.mesh.points @ PLACE).T
    if any(cell.startswith(("tetra", "pyramid", "wedge", "hexa")) for cell in s.mesh.cells):
        inner = np.ones(len(x), bool)
        inner[[s.mesh.nearest_point(p) for p in s.skin.points]] = False
        return inner
    inner = np.abs(x * (x - 1)) > 1e-9
    return inner if "line" in s.mesh.cells and len(s.mesh.cells) == 1 else inner & (np.abs(y * (y - 0.8)) > 1e-9)


def uniform(s: Structure, state) -> np.ndarray:
    """Dofs (n_dof,) of a state of uniform strain."""
    local = s.mesh.points @ PLACE
    u, theta = state.u(local) @ PLACE.T, state.theta(local) @ PLACE.T
    rows = sparse.vstack([s.translation, s.rotation]).tocsr()
    return lsqr(rows, np.concatenate([u.ravel(), theta.ravel()]), atol=1e-15, btol=1e-15)[0]


@pytest.mark.parametrize("name", NAMES)
def test_uniform_strain_patch(name):
    """Inner nodes left free take the places of a uniform strain that is given on the boundary."""
    s = patch_of(name)
    inner = np.repeat(inner_nodes(s), 3)
    assert inner.any()
    free = np.flatnonzero(abs(s.translation.T) @ inner + abs(s.rotation.T) @ inner)
    for state in FAMILIES[name].states:
        exact = uniform(s, state)
        x = np.where(np.isin(np.arange(s.n_dof), free), 0.0, exact)
        K, f = s.K[free][:, free], -(s.K @ x)[free]
        # a straight rod is free to move sideways: the least motion
        x[free] = np.linalg.lstsq(K.toarray(), f, rcond=None)[0] if name == "rod" else spsolve(K.tocsc(), f)
        assert np.abs(x - exact).max() < 1e-9 * np.abs(exact).max()
        assert x @ s.K @ x == pytest.approx(state.energy, rel=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_rigid_motion_and_rotated_axes(name):
    both = [rough_of(name), rough_of(name, turned=True)]
    for s in both:
        R = rigid_shapes(s, about=s.mesh.points.mean(axis=0))
        assert R.shape[1] == 6
        assert np.abs(s.K0 @ R).max() < 1e-10 * abs(s.K0).max() * np.abs(R).max()
    a, b = ((s.K, s.M, s.K @ s.M, s.K @ s.K) for s in both)
    for A, B in zip(a, b, strict=True):  # invariants of a change of axes
        assert B.trace() == pytest.approx(A.trace(), rel=1e-10)
        assert sparse.linalg.norm(B) == pytest.approx(sparse.linalg.norm(A), rel=1e-10)


@pytest.mark.parametrize("name", [name for name in NAMES if name.split()[0] in ("solid", "shell", "plate", "beam")])
def test_elements_have_no_mechanisms(name):
    """No motions without strain but the six rigid ones, and a mass matrix that is positive definite."""
    s = rough_of(name)
    K = s.K.toarray()
    scale = np.sqrt(np.diag(K))
    value = np.linalg.eigvalsh(K / np.outer(scale, scale))
    assert np.abs(value[:6]).max() < 1e-10 and value[6] > 1e-8
    assert np.linalg.eigvalsh(s.M.toarray())[0] > 0


@pytest.mark.parametrize("name", NAMES)
def test_mass_and_inertia_of_families(name):
    """Rigid motions by the mass matrix and by the points of mass, and the mass of the patch."""
    s = patch_of(name)
    R = rigid_shapes(s, about=np.zeros(3))
    expected, second = np.zeros((6, 6)), np.zeros((3, 3))
    for block in s.inertia:
        rho, dm = block.rho.reshape(-1, 3), block.dm.ravel()
        moves = np.concatenate([np.tile(np.eye(3), (len(rho), 1, 1)), np.cross(np.eye(3)[None], rho[:, None])], axis=1)
        expected += np.einsum("p,pai,pbi->ab", dm, moves, moves)
        second += PLACE.T @ np.einsum("p,pi,pj->ij", dm, rho, rho) @ PLACE
    assert expected[0, 0] == pytest.approx(FAMILIES[name].mass, rel=1e-9)
    assert R.T @ s.M @ R == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected.max())
    if FAMILIES[name].second is not None:
        assert second == pytest.approx(FAMILIES[name].second, rel=1e-9, abs=1e-9 * second.max())


@pytest.mark.parametrize("name", NAMES)
def test_matrices_equal_sums_over_table_points(name):
    s = rough_of(name)
    d = np.random.default_rng(5).normal(size=(s.n_dof, 3))
    raw, M, V = s.T @ d, np.zeros((3, 3)), np.zeros((3, 3))
    for block in s.inertia:
        z = block.shapes(raw, ALL)
        M += np.einsum("eqak,eqal,eq->kl", z, z, block.dm)
    for block in s.strain:
        eps = np.einsum("sg,eqgn->eqsn", block.linear_map, block.gradients(raw, ALL))
        elastic = np.broadcast_to(block.elastic, (*block.weight.shape, *block.elastic.shape[2:]))
        V += np.einsum("eqsk,eqst,eqtl,eq->kl", eps, elastic, eps, block.weight, optimize=True)
    assert d.T @ s.M @ d == pytest.approx(M, rel=1e-10, abs=1e-10 * np.abs(M).max())
    assert d.T @ s.K0 @ d == pytest.approx(V, rel=1e-10, abs=1e-10 * np.abs(V).max())


@pytest.mark.parametrize("name", [name for name in NAMES if FAMILIES[name].stress is not None])
def test_stress_of_uniform_strain_matches_hooke(name):
    s = patch_of(name)
    x = uniform(s, FAMILIES[name].states[0])
    for part in strain_field(s, x[:, None], nonlinear=False):
        name_of_stress = "fibre_stress" if part.kind == "line" else "von_mises"
        assert named(part, name_of_stress, np.ones((1, 1)))[0] == pytest.approx(FAMILIES[name].stress, rel=1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_skin_encloses_body_and_follows_rigid_motion(name):
    s = patch_of(name)
    skin = s.skin
    R = rigid_shapes(s, about=np.zeros(3))
    moved = (skin.operator @ R).reshape(-1, 3, 6)
    expected = np.concatenate(
        [np.tile(np.eye(3), (len(skin.points), 1, 1)), np.cross(np.eye(3)[None], skin.points[:, None])], 1
    )
    assert moved == pytest.approx(expected.swapaxes(1, 2), abs=1e-11)
    if FAMILIES[name].volume is None:
        return
    volume, area = 0.0, np.zeros(3)
    for rows in skin.cells.values():  # four-sided faces are bilinear: the mean of both diagonals
        for way in (0, 1) if rows.shape[1] == 4 else (0,):
            for k in range(1, rows.shape[1] - 1):
                a, b, c = skin.points[np.roll(rows, way, axis=1)[:, [0, k, k + 1]]].swapaxes(0, 1)
                share = 0.5 if rows.shape[1] == 4 else 1.0
                area += share * np.cross(b - a, c - a).sum(axis=0)
                volume += share * np.einsum("fi,fi->", a, np.cross(b, c)) / 6
    assert area == pytest.approx(np.zeros(3), abs=1e-12)
    assert volume == pytest.approx(FAMILIES[name].volume, rel=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_force_and_tangent_are_derivatives_of_the_energy(name):
    """The energy is of degree 4 along a line: a five-point difference is exact but for rounding."""
    s = rough_of(name)
    V, (x, way) = s.internal_force, np.random.default_rng(1).normal(size=(2, s.n_dof))
    x, way = (0.1 * v / np.abs(s.translation @ v).max() for v in (x, way))
    at, weight = np.array([-2, -1, 1, 2]) * 1e-3, np.array([1, -8, 8, -1]) / 12e-3
    slope = weight @ [V.energy(x + t * way) for t in at]
    assert V.force(x) @ way == pytest.approx(slope, abs=1e-8 * np.abs(V.force(x)) @ np.abs(way))
    change = sum(w * V.force(x + t * way) for w, t in zip(weight, at, strict=True))
    push = V.tangent(x) @ way
    np.testing.assert_allclose(push, change, atol=1e-8 * np.abs(push).max())
