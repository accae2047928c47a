"""Solid elements of all shapes: patch test, rigid motion, mass, convergence, materials with axes, raised cells."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh, spsolve
from support.element_meshes import SECOND_ORDER, SOLIDS, brick, mixed_bricks, straight_sided
from support.plate_models import random_rotation

from femflex.fem import Anisotropic, Material, Member, Orthotropic, build_structure
from femflex.fem.solid.elastic import elasticity, isotropic_elasticity
from femflex.mesh import Mesh, box, read_mesh, write_mesh
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import sizes
from femflex.warning import PhysicsWarning

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


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("seed", range(3))
def test_random_meshes_of_mixed_cells_pass_the_patch_test(seed, order):
    mesh = mixed_bricks(seed=seed)
    assert all(len(mesh.cells[kind]) for kind in ("hexahedron", "wedge", "pyramid", "tetra"))
    check_patch(structure_of(mesh, order=order))


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


@pytest.mark.parametrize("cell", SOLIDS)
def test_rigid_motion_costs_nothing_and_axes_do_not_matter(cell):
    mesh = brick(cell, (1, 1, 1), warp=0.1)
    structure = structure_of(mesh)

    def motion(x):
        return np.stack([*(np.broadcast_to(e, x.shape) for e in np.eye(3)), *(np.cross(e, x) for e in np.eye(3))], -1)

    rigid = nodal(structure, motion)
    assert np.abs(structure.K @ rigid).max() < 1e-10 * abs(structure.K).max()
    volume = sum(sizes(mesh.points, name, nodes).sum() for name, nodes in mesh.cells.items())
    np.testing.assert_allclose(np.diag(rigid.T @ structure.M @ rigid)[:3], METAL.density * volume, rtol=1e-10)
    C = random_rotation(3)
    turned = structure_of(mesh.rotated(C).moved([30.0, -20.0, 10.0]))
    u = np.random.default_rng(2).normal(size=(len(mesh.points), 3, 1))
    for A, B in ((structure.K, turned.K), (structure.M, turned.M)):
        x, y = nodal(structure, lambda _: u), nodal(turned, lambda _: np.einsum("ij,njk->nik", C, u))
        assert (y.T @ B @ y).item() == pytest.approx((x.T @ A @ x).item(), rel=1e-10)


@pytest.mark.parametrize("cell", SOLIDS)
def test_mass_and_rank_are_those_of_the_body(cell):
    """M = sum over the points of mass; no cell has motions without strain but the six rigid ones."""
    structure = structure_of(brick(cell, (1, 1, 1), warp=0.05))
    total = np.zeros((3, 3))
    for block in structure.inertia:
        assert (block.dm > 0).all()
        total += np.einsum("eq,eqi,eqj->ij", block.dm, block.rho, block.rho)
    x = nodal(structure, lambda p: np.einsum("ni,jk->njik", p, np.eye(3)).reshape(-1, 3, 9))
    second = (x.T @ structure.M @ x).reshape(3, 3, 3, 3)
    np.testing.assert_allclose(second[:, 0, :, 0], total, rtol=1e-10)
    value = np.linalg.eigvalsh(structure.K.toarray())
    assert (value[:6] < 1e-9 * value[-1]).all() and value[6] > 1e-6 * value[-1]


def timoshenko_cantilever(L, EI, kGA, m, mr2) -> float:
    """First circular frequency of a clamped-free Timoshenko beam: root of the determinant of its transfer matrix."""

    def determinant(omega):
        A = np.array([  # w, theta, M, V along x
            [0, 1, 0, 1 / kGA],
            [0, 0, 1 / EI, 0],
            [0, -mr2 * omega**2, 0, -1],
            [-m * omega**2, 0, 0, 0],
        ])  # fmt: skip
        return np.linalg.det(expm(A * L)[2:, 2:])

    euler = 3.516015 * np.sqrt(EI / m) / L**2
    return float(brentq(determinant, 0.5 * euler, 1.001 * euler))


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


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"E2": -1.0}, "E2 of an orthotropic material is -1.0"),
        ({"nu12": 5.0}, "not positive definite"),
    ],
)
def test_impossible_materials_are_refused(change, found):
    from dataclasses import replace

    with pytest.raises(ValueError, match=found):
        replace(FIBRE, **change)
    with pytest.raises(ValueError, match="6 x 6"):
        Anisotropic(np.eye(3), 1.0)


def test_axes_of_a_material_are_checked():
    mesh = brick("hexahedron", (1, 1, 1))
    with pytest.raises(ValueError, match="parallel or zero"):
        structure_of(mesh, FIBRE, axes=[1, 0, 0, 2, 0, 0])
    with pytest.raises(ValueError, match="six numbers"):
        structure_of(mesh, FIBRE, axes=[1, 0, 0])


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


def mixed_mesh() -> Mesh:
    """Hexahedra, a pyramid on one of them, tetrahedra on that, a wedge next to them: linear cells of all shapes."""
    points = np.array([
        [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [0.4, 0.5, 1.7],
        [1.3, 0.5, 1.6], [0.5, 1.8, 0.1], [0.5, 1.7, 1.1],
    ])  # fmt: skip
    cells = {
        "hexahedron": [[0, 1, 2, 3, 4, 5, 6, 7]],
        "pyramid": [[4, 5, 6, 7, 8]],
        "tetra": [[5, 6, 8, 9]],
        "wedge": [[2, 3, 10, 6, 7, 11]],
    }
    found = {name: np.array(rows) for name, rows in cells.items()}
    for name, nodes in found.items():
        if sizes(points, name, nodes)[0] < 0:
            found[name] = nodes[:, CELL_TYPES[name].mirrored]
    return Mesh(points, found, {"volume": {name: np.arange(1) for name in found}})


def test_the_skin_of_a_mixed_mesh_is_closed():
    s = build_structure(mixed_mesh(), [Member("volume", "solid", material=METAL)])
    total = np.zeros(3)
    volume = 0.0
    for cell in s.skin.cells.values():
        for one in cell:
            p = s.skin.points[one]
            for k in range(1, len(one) - 1):
                area = np.cross(p[k] - p[0], p[k + 1] - p[0]) / 2
                total += area
                volume += area @ p[[0, k, k + 1]].mean(axis=0) / 3
    assert np.abs(total).max() < 1e-12
    assert volume == pytest.approx(sum(np.abs(sizes(s.mesh.points, n, c)).sum() for n, c in s.mesh.cells.items()))


def test_a_mesh_inside_out_is_flipped_with_a_warning_and_one_bad_cell_is_named(tmp_path):
    mesh = box(1.0, 1.0, 1.0, 2, 1, 1, "hexahedron")
    cells = dict(mesh.cells)
    cells["hexahedron"] = cells["hexahedron"][:, CELL_TYPES["hexahedron"].mirrored]
    write_mesh(tmp_path / "out.vtu", Mesh(mesh.points, cells, mesh.cell_groups))
    with pytest.warns(PhysicsWarning, match="all 2 cells of type hexahedron are inside out"):
        found = read_mesh(tmp_path / "out.vtu")
    assert sizes(found.points, "hexahedron", found.cells["hexahedron"]).sum() == pytest.approx(1.0)
    cells["hexahedron"] = np.concatenate([mesh.cells["hexahedron"][:1], cells["hexahedron"][1:]])
    bad = Mesh(mesh.points, cells, mesh.cell_groups)
    with pytest.raises(ValueError, match=r"1 of 2 hexahedron elements .* \(element 1 at \(0.75, 0.5, 0.5\) m"):
        structure_of(bad)
    with pytest.raises(ValueError, match="order 3"):
        structure_of(mesh, order=3)
