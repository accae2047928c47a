"""Solid elements of all shapes: patch test, rigid motion, mass, convergence, materials with axes, raised cells."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh, spsolve
from support.closed_forms import timoshenko_cantilever
from support.element_meshes import SECOND_ORDER, SOLIDS, brick, straight_sided
from support.plate_models import random_rotation

from femflex.fem import Anisotropic, Material, Member, Orthotropic, build_structure
from femflex.fem.solid.elastic import elasticity, isotropic_elasticity
from femflex.mesh import Mesh, box
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import sizes

METAL = Material(70e9, 0.3, 2700.0)
pytestmark = pytest.mark.filterwarnings("ignore:solid on group .* cells of first order")


def structure_of(mesh: Mesh, material=METAL, **options):
    return build_structure(mesh, [Member("volume", "solid", material=material, options={"order": 1, **options})])


def nodal(structure, field) -> np.ndarray:
    """Dofs (n_dof, k) that move every node by field(points) (n_p, 3, k)."""
    u = field(structure.mesh.points)
    return structure.translation.T @ u.reshape(-1, u.shape[2])


@pytest.mark.parametrize("cell", SOLIDS)
def test_patch_of_constant_strain(cell):
    """Free inner nodes go with a linear field given on the boundary of a distorted patch, to rounding."""
    check_patch(structure_of(straight_sided(brick(cell, (2, 2, 2), warp=0.1))))


def check_patch(structure):
    """Free inner nodes go with a linear field given on the boundary, to rounding; the energy is that of the strain."""
    mesh = structure.mesh
    H = np.random.default_rng(1).normal(size=(3, 3))
    exact = nodal(structure, lambda x: (x @ H.T)[..., None])[:, 0]
    skin = structure.skin
    inner = np.ones(len(mesh.points), bool)
    inner[[mesh.nearest_point(x) for x in skin.points]] = False
    assert inner.any()
    free = np.flatnonzero(abs(structure.translation.T) @ np.repeat(inner, 3))
    x = np.where(np.isin(np.arange(structure.n_dof), free), 0.0, exact)
    x[free] = spsolve(structure.K[free][:, free].tocsc(), -(structure.K @ x)[free])
    assert np.abs(x - exact).max() < 1e-11 * np.abs(exact).max()
    strain = (H + H.T) / 2
    C = isotropic_elasticity(METAL)
    voigt = np.array([*np.diag(strain), 2 * strain[1, 2], 2 * strain[0, 2], 2 * strain[0, 1]])
    volume = sum(sizes(mesh.points, name, nodes).sum() for name, nodes in mesh.cells.items())
    assert x @ structure.K @ x == pytest.approx(volume * voigt @ C @ voigt, rel=1e-11)


@pytest.mark.parametrize("cell", SECOND_ORDER)
def test_a_cantilever_of_second_order_cells_bends_as_a_beam(cell):
    """10 x 1 x 1 with nu = 0: the first bending frequency of Timoshenko's beam, k = 5/6."""
    structure = structure_of(brick(cell, (8, 1, 1), (10.0, 1.0, 1.0)), Material(1e6, 0.0, 1.0))
    points = structure.mesh.points
    free = np.flatnonzero(abs(structure.translation.T) @ np.repeat(points[:, 0] > 1e-9, 3))
    K, M = (A[free][:, free].tocsc() for A in (structure.K, structure.M))
    omega = np.sqrt(eigsh(K, 1, M, sigma=0, v0=np.ones(len(free)))[0][0])
    exact = timoshenko_cantilever(10.0, 1e6 / 12, 5 / 6 * 0.5e6, 1.0, 1 / 12)
    assert omega == pytest.approx(exact, rel=0.003 if CELL_TYPES[cell].shape in ("hexahedron", "wedge") else 0.01)


def test_green_lagrange_energy_does_not_change_in_finite_rotations():
    C = random_rotation(5)
    for cell in SOLIDS:
        structure = structure_of(brick(cell, (1, 1, 1), warp=0.05))
        x = nodal(structure, lambda p: (p @ C.T - p)[..., None])[:, 0]
        scale = x @ structure.K @ x
        assert abs(structure.internal_force.energy(x)) < 1e-12 * scale


FIBRE = Orthotropic(140e9, 10e9, 9e9, 5e9, 4.5e9, 3.5e9, 0.3, 0.28, 0.4, 1600.0)


def test_orthotropic_material_pulled_along_its_axes_and_turned():
    """Uniaxial stress along axis 1, with the axes turned in the mesh: elongation s/E1, contraction -nu s/E1."""
    A = random_rotation(7)
    s = structure_of(brick("hexahedron20", (1, 1, 1)), FIBRE, axes=[*A[0], *A[1]])
    strain = np.diag([1.0, -0.3, -0.28]) / 140e9
    H = A.T @ strain @ A
    x = nodal(s, lambda p: (p @ H.T)[..., None])[:, 0]
    energy = x @ s.K @ x / 2
    assert energy == pytest.approx(0.48 / 140e9 / 2, rel=1e-10)
    C = elasticity(FIBRE)
    assert np.linalg.inv(C)[3, 3] == pytest.approx(1 / 3.5e9)
    same = elasticity(Anisotropic(C, 1600.0), A)
    np.testing.assert_allclose(same, elasticity(FIBRE, A), rtol=1e-12)
    iso = isotropic_elasticity(METAL)
    np.testing.assert_allclose(elasticity(Anisotropic(iso, 1.0), A), iso, rtol=1e-9, atol=1e-5 * iso.max() * 1e-6)


def test_first_order_cells_are_raised_with_their_boundaries_and_groups():
    mesh = box(1.0, 0.5, 0.2, 3, 2, 1, "hexahedron")
    mesh = mesh.with_groups(points={"set": mesh.group_points("left")})
    s = build_structure(mesh, [Member("volume", "solid", material=METAL)])
    assert "6 hexahedron to hexahedron20" in s.notes[0] and "order = 1" in s.notes[0]
    want = box(1.0, 0.5, 0.2, 3, 2, 1, "hexahedron20")
    assert len(s.mesh.points) == len(want.points)
    for group in ("left", "right", "top"):
        found, known = (m.points[m.group_points(group)] for m in (s.mesh, want))
        assert sorted(map(tuple, np.round(found, 9))) == sorted(map(tuple, np.round(known, 9)))
    assert len(s.mesh.group_points("set")) == len(want.group_points("left"))
    other = build_structure(want, [Member("volume", "solid", material=METAL)])
    assert not other.notes
    a, b = (np.linalg.eigvalsh(x.K.toarray())[-5:] for x in (s, other))
    np.testing.assert_allclose(a, b, rtol=1e-9)
