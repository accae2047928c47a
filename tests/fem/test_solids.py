"""Solid elements: scikit-fem, beams and plates as references; materials with axes; initial stress; raised cells."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import skfem
from scipy import sparse
from scipy.sparse.linalg import eigsh
from skfem.helpers import ddot, dot, sym_grad, trace
from support.closed_forms import timoshenko_cantilever
from support.element_meshes import SECOND_ORDER, SOLIDS, brick
from support.plate_models import frequencies, random_rotation

from femflex.fem import Anisotropic, Material, Member, Orthotropic, build_structure
from femflex.fem.sections.laminates import isotropic
from femflex.fem.sections.materials import elasticity, isotropic_elasticity
from femflex.mesh import Mesh, box, rectangle
from femflex.mesh.cells import CELL_TYPES
from femflex.warning import PhysicsWarning

pytestmark = [pytest.mark.filterwarnings("ignore:solid on group .* (cells of first order|are a single layer)")]
METAL = Material(70e9, 0.3, 2700.0)


def structure_of(mesh: Mesh, material=METAL, **options):
    return build_structure(mesh, [Member("volume", "solid", material=material, options={"order": 1, **options})])


def nodal(structure, field) -> np.ndarray:
    """Dofs (n_dof, k) that move every node by field(points) (n_p, 3, k)."""
    u = field(structure.mesh.points)
    return structure.translation.T @ u.reshape(-1, u.shape[2])


@pytest.mark.parametrize("cell", SECOND_ORDER)
def test_cantilever_of_second_order_cells_matches_beam(cell):
    """10 x 1 x 1 with nu = 0: the first bending frequency of Timoshenko's beam, k = 5/6."""
    structure = structure_of(brick(cell, (8, 1, 1), (10.0, 1.0, 1.0)), Material(1e6, 0.0, 1.0))
    points = structure.mesh.points
    free = np.flatnonzero(abs(structure.translation.T) @ np.repeat(points[:, 0] > 1e-9, 3))
    K, M = (A[free][:, free].tocsc() for A in (structure.K, structure.M))
    omega = np.sqrt(eigsh(K, 1, M, sigma=0, v0=np.ones(len(free)))[0][0])
    exact = timoshenko_cantilever(10.0, 1e6 / 12, 5 / 6 * 0.5e6, 1.0, 1 / 12)
    assert omega == pytest.approx(exact, rel=0.003 if CELL_TYPES[cell].shape in ("hexahedron", "wedge") else 0.01)


@pytest.mark.parametrize("cell", SECOND_ORDER)
@pytest.mark.parametrize("nu", (0.49, 0.4999))
def test_bending_of_nearly_incompressible_beams(cell, nu):
    """A free beam 20 x 1 x 1, of which a half is meshed: of the material E counts, its shear for 0.1 %."""
    computed = []
    for ratio in (0.3, nu):
        s = structure_of(brick(cell, (10, 1, 1), (10.0, 1.0, 1.0)), Material(1e6, ratio, 1.0))
        middle = 3 * np.flatnonzero(s.mesh.points[:, 0] < 1e-9)
        computed.append(frequencies(s, np.unique(s.translation[middle].tocoo().coords[1]), 4, shift=-1.0)[3])
    assert computed[1] == pytest.approx(computed[0], rel=0.012)


def test_single_clamped_layer_of_nearly_incompressible_bricks_is_warned_of():
    """The clamp holds the contraction across: 1 % of a frequency in truth, 3 % with one layer."""
    computed = []
    for layers in (1, 2):
        mesh = brick("hexahedron20", (10 * layers, layers, layers), (10.0, 1.0, 1.0))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", PhysicsWarning)
            s = structure_of(mesh, Material(1e6, 0.499, 1.0))
        assert [entry for entry in caught if "single layer" in str(entry.message)] == caught
        assert bool(caught) == (layers == 1)
        clamped = 3 * np.flatnonzero(mesh.points[:, 0] < 1e-9)[:, None] + np.arange(3)
        computed.append(frequencies(s, np.unique(s.translation[clamped.ravel()].tocoo().coords[1]), 1)[0])
    assert 1.01 < computed[0] / computed[1] < 1.03


def test_stress_of_nearly_incompressible_solid():
    """The force at small displacements is K x, in finite rotations nothing; K of a constant strain is exact."""
    for cell in SECOND_ORDER:
        s = structure_of(brick(cell, (1, 1, 1), warp=0.05), Material(1e6, 0.499, 1.0))
        C = random_rotation(5)
        x = nodal(s, lambda p, C=C: (p @ C.T - p)[..., None])[:, 0]
        assert abs(s.internal_force.energy(x)) < 1e-10 * (x @ s.K @ x)
        small = 1e-9 * np.random.default_rng(0).normal(size=s.n_dof)
        np.testing.assert_allclose(
            s.internal_force.force(small), s.K @ small, rtol=1e-6, atol=1e-6 * np.abs(s.K @ small).max()
        )
        strain = nodal(s, lambda p: (p @ np.diag([1.0, 0.0, 0.0]))[..., None])[:, 0]
        volume = sum(block.weight.sum() for block in s.strain)
        assert strain @ s.K @ strain == pytest.approx(isotropic_elasticity(Material(1e6, 0.499, 1.0))[0, 0] * volume)
        stress = [
            (b.elastic @ b.linear_map @ b.gradients((s.T @ small)[:, None], slice(None)))[..., 0] for b in s.strain
        ]
        work = [(b.linear_map @ b.gradients((s.T @ strain)[:, None], slice(None)))[..., 0] for b in s.strain]
        computed = sum(
            np.einsum("eq,eqs,eqs->", b.weight, p, w) for b, p, w in zip(s.strain, stress, work, strict=True)
        )
        assert computed == pytest.approx(strain @ s.K @ small, rel=1e-9)


def test_energy_is_invariant_under_rotation():
    C = random_rotation(5)
    for cell in SOLIDS:
        structure = structure_of(brick(cell, (1, 1, 1), warp=0.05))
        x = nodal(structure, lambda p: (p @ C.T - p)[..., None])[:, 0]
        scale = x @ structure.K @ x
        assert abs(structure.internal_force.energy(x)) < 1e-12 * scale


FIBRE = Orthotropic(140e9, 10e9, 9e9, 5e9, 4.5e9, 3.5e9, 0.3, 0.28, 0.4, 1600.0)


def test_orthotropic_material_along_rotated_axes():
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


def test_first_order_cells_are_raised_with_groups():
    mesh = box(1.0, 0.5, 0.2, 3, 2, 1, "hexahedron")
    mesh = mesh.with_groups(points={"set": mesh.group_points("left")})
    s = build_structure(mesh, [Member("volume", "solid", material=METAL)])
    assert "6 hexahedron to hexahedron20" in s.notes[0] and "order = 1" in s.notes[0]
    want = box(1.0, 0.5, 0.2, 3, 2, 1, "hexahedron20")
    assert len(s.mesh.points) == len(want.points)
    for group in ("left", "right", "top"):
        computed, reference = (m.points[m.group_points(group)] for m in (s.mesh, want))
        assert sorted(map(tuple, np.round(computed, 9))) == sorted(map(tuple, np.round(reference, 9)))
    assert len(s.mesh.group_points("set")) == len(want.group_points("left"))
    other = build_structure(want, [Member("volume", "solid", material=METAL)])
    assert not other.notes
    a, b = (np.linalg.eigvalsh(x.K.toarray())[-5:] for x in (s, other))
    np.testing.assert_allclose(a, b, rtol=1e-9)


def test_large_brick_meshes_stay_first_order():
    """One layer of 100 x 20 bricks by default, 40 x 8 of second order: the same plate."""
    large, small = box(1.0, 0.2, 0.02, 100, 20, 1, "hexahedron"), box(1.0, 0.2, 0.02, 40, 8, 1, "hexahedron")
    kept, up = (build_structure(mesh, [Member("volume", "solid", material=METAL)]) for mesh in (large, small))
    assert kept.n_dof == 3 * 101 * 21 * 2 and "2000 hexahedra" in kept.notes[0] and "order = 2" in kept.notes[0]
    computed, other = (frequencies(s, s.clamped_dofs("left"), 3) for s in (kept, up))
    assert computed == pytest.approx(other, rel=0.004)


def solid_structure(mesh: Mesh, material: Material = METAL):
    return build_structure(mesh, [Member("volume", "solid", material=material, options={"order": 1})])


def scikit_fem_panel(L, W, T, nx, ny, nz, E, nu, rho):
    """M, K and nodes of the same box by scikit-fem forms on vector ElementHex2, 27 quadrature points."""
    lines = (np.linspace(0, L, nx + 1), np.linspace(0, W, ny + 1), np.linspace(0, T, nz + 1))
    basis = skfem.Basis(skfem.MeshHex.init_tensor(*lines), skfem.ElementVector(skfem.ElementHex2()), intorder=4)
    lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)

    @skfem.BilinearForm
    def stiffness(u, v, _):
        return lam * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * mu * ddot(sym_grad(u), sym_grad(v))

    @skfem.BilinearForm
    def mass(u, v, _):
        return rho * dot(u, v)

    return mass.assemble(basis), stiffness.assemble(basis), basis.doflocs


def in_one_order(points, matrix):
    """The matrix with its dofs, three in a row per node, in the order of the nodes' places."""
    order = np.lexsort(np.round(points / 1e-9).astype(np.int64).T)
    dofs = (3 * order[:, None] + np.arange(3)).ravel()
    return sparse.csr_array(matrix)[dofs][:, dofs]


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("thickness", "agreement"), [(0.03, None), (0.6, 1e-9)])
def test_panel_matches_scikit_fem(thickness, agreement):
    """The thin panel's lowest frequency is a small difference of large terms: rounding of K, of relative size eps,
    moves it by eps |phi|.|K||phi| / 2 omega^2, 6e-6 (1e-7 to 1.0e-6 seen, by processor); the thick one agrees to 1e-9.
    """
    panel = (6.0, 1.5, thickness, 8, 2, 1)
    M, K, places = scikit_fem_panel(*panel, 2e9, 0.3, 100.0)
    structure = solid_structure(box(*panel, "hexahedron27"), Material(2e9, 0.3, 100.0))
    points, rows = structure.mesh.points, structure.translation
    own = [in_one_order(points, rows @ A @ rows.T) for A in (structure.M, structure.K)]
    other = [in_one_order(places.T[::3], A) for A in (M, K)]
    for mine, theirs in zip(own, other, strict=True):
        assert mine.shape == theirs.shape
        assert abs(mine - theirs).max() < 1e-13 * abs(theirs).max()
    free = clamped_free(points)
    computed = []
    for M_, K_ in (own, other):
        K_f, M_f = K_[free][:, free].tocsc(), M_[free][:, free].tocsc()
        value, phi = eigsh(K_f, 10, M_f, sigma=0, v0=np.ones(len(free)))
        computed.append(np.sqrt(value))
    rounding = np.einsum("in,in->n", np.abs(phi), abs(K_f) @ np.abs(phi)) * np.finfo(float).eps / value / 2
    error = np.abs(computed[0] / computed[1] - 1)
    assert (error < (rounding if agreement is None else agreement)).all()
    assert error[0] < 4e-6 and error[1:].max() < 1e-7


def clamped_free(points):
    """Dofs, nodes in the order of `in_one_order`, off the plane x = 0."""
    order = np.lexsort(np.round(points / 1e-9).astype(np.int64).T)
    return np.flatnonzero(np.repeat(points[order, 0] > 1e-9, 3))


def test_thin_solid_panel_matches_plate():
    """Clamped panel, one layer of 27-node hexahedra against DKMT triangles: model difference of order h."""
    mesh = box(1.0, 0.5, 0.02, 12, 6, 1, "hexahedron27")
    solid = solid_structure(mesh)
    plate = build_structure(rectangle(1.0, 0.5, 24, 12), [Member("surface", "plate", isotropic(0.02, METAL))])
    computed = [frequencies(s, s.clamped_dofs("left"), 3) for s in (solid, plate)]
    assert computed[0] == pytest.approx(computed[1], rel=2e-2)


@pytest.mark.parametrize("cell", ["tetra10", "hexahedron20", "wedge15", "pyramid13"])
def test_prestress_and_thermal_strain_of_skew_material(cell):
    """Virtual work of f0 on a gradient H is sigma : H times the volume, sigma less what free strain would need."""
    A, sigma = random_rotation(15), np.array([3e5, -1e5, 2e5, 4e4, -6e4, 8e4])
    options = {"axes": [*A[0], *(A[1] + 0.3 * A[0])], "prestress": sigma, "thermal_strain": 2e-6}
    s = build_structure(brick(cell, (1, 1, 1)), [Member("volume", "solid", material=FIBRE, options=options)])
    own = np.diag([1.0, 1, 1]) * 2e-6  # the same in all axes
    heat = elasticity(FIBRE) @ np.array([*np.diag(own), 0, 0, 0])
    tensor = A.T @ np.array([[heat[0], heat[5], heat[4]], [heat[5], heat[1], heat[3]], [heat[4], heat[3], heat[2]]]) @ A
    xx, yy, zz, yz, xz, xy = sigma
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - tensor
    volume = sum(block.weight.sum() for block in s.strain)
    for k in range(9):
        H = np.zeros(9)
        H[k] = 1.0
        H = H.reshape(3, 3)
        x = s.translation.T @ (s.mesh.points @ H.T).ravel()
        assert s.f0 @ x == pytest.approx(volume * np.sum(tensor * H), abs=1e-8 * np.abs(tensor).max())
