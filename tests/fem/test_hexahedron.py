"""Solid elements against scikit-fem forms, closed forms, and the mass and skin of the body they fill."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from scipy import sparse
from scipy.sparse.linalg import eigsh
from skfem.helpers import ddot, dot, sym_grad, trace
from support.plate_models import frequencies, random_rotation

from femflex.fem import Material, Member, build_structure
from femflex.fem.assembly import assembler
from femflex.fem.sections.laminates import isotropic
from femflex.mesh import Mesh, box, rectangle
from femflex.warning import PhysicsWarning

METAL = Material(70e9, 0.3, 2700.0)
LOCKING = "ignore:solid on group .* cells of first order"


def solid_structure(mesh: Mesh, material: Material = METAL):
    return build_structure(mesh, [Member("volume", "solid", material=material, options={"order": 1})])


def curved(cell: str, n: int = 2, seed: int = 0) -> Mesh:
    """A box 1 x 0.8 x 0.6 bent by a smooth map, and its nodes shaken inside."""
    mesh = box(1.0, 0.8, 0.6, n, n, n, cell)
    x, y, z = mesh.points.T
    points = mesh.points + 0.05 * np.stack([np.sin(3 * y), np.cos(2 * z) * x, x * y], axis=1)
    points += np.random.default_rng(seed).uniform(-0.01, 0.01, points.shape)
    return Mesh(points, dict(mesh.cells), mesh.cell_groups)


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
def test_the_panel_has_the_matrices_and_frequencies_of_scikit_fem_forms(thickness, agreement):
    """The thin panel's lowest frequency is a small difference of large terms: rounding of K, of relative size eps,
    moves it by eps |phi|.|K||phi| / 2 omega^2, 6e-6 (1e-7 to 1.0e-6 seen, by processor); the thick one agrees to 1e-9.
    """
    panel = (6.0, 1.5, thickness, 16, 4, 1)
    M, K, places = scikit_fem_panel(*panel, 2e9, 0.3, 100.0)
    structure = solid_structure(box(*panel, "hexahedron27"), Material(2e9, 0.3, 100.0))
    points, rows = structure.mesh.points, structure.translation
    own = [in_one_order(points, rows @ A @ rows.T) for A in (structure.M, structure.K)]
    other = [in_one_order(places.T[::3], A) for A in (M, K)]
    for mine, theirs in zip(own, other, strict=True):
        assert mine.shape == theirs.shape
        assert abs(mine - theirs).max() < 1e-13 * abs(theirs).max()
    free = clamped_free(points)
    found = []
    for M_, K_ in (own, other):
        K_f, M_f = K_[free][:, free].tocsc(), M_[free][:, free].tocsc()
        value, phi = eigsh(K_f, 10, M_f, sigma=0, v0=np.ones(len(free)))
        found.append(np.sqrt(value))
    rounding = np.einsum("in,in->n", np.abs(phi), abs(K_f) @ np.abs(phi)) * np.finfo(float).eps / value / 2
    error = np.abs(found[0] / found[1] - 1)
    assert (error < (rounding if agreement is None else agreement)).all()
    assert error[0] < 4e-6 and error[1:].max() < 1e-7


def clamped_free(points):
    """Dofs, nodes in the order of `in_one_order`, off the plane x = 0."""
    order = np.lexsort(np.round(points / 1e-9).astype(np.int64).T)
    return np.flatnonzero(np.repeat(points[order, 0] > 1e-9, 3))


@pytest.mark.filterwarnings(LOCKING)
@pytest.mark.parametrize("cell", ["hexahedron27", "hexahedron"])
def test_constant_strain_is_an_equilibrium_on_curved_elements(cell):
    structure = solid_structure(curved(cell))
    mesh = structure.mesh
    grad = np.random.default_rng(1).normal(size=(3, 3))
    d = structure.translation.T @ (mesh.points @ grad.T).ravel()
    strain = (grad + grad.T) / 2
    mu, lam = METAL.G, METAL.E * METAL.nu / (1 + METAL.nu) / (1 - 2 * METAL.nu)
    density = mu * np.sum(strain**2) + lam / 2 * np.trace(strain) ** 2
    volume = structure.inertia[0].dm.sum() / METAL.density
    assert d @ structure.K @ d / 2 == pytest.approx(density * volume, rel=1e-11)
    outer = np.unique(np.concatenate([c.ravel() for n, c in mesh.cells.items() if n.startswith("quad")]))
    inner = np.setdiff1d(np.arange(len(mesh.points)), outer)
    force = structure.translation @ (structure.K @ d)
    assert np.abs(force.reshape(-1, 3)[inner]).max() < 1e-10 * np.abs(force).max()


@pytest.mark.filterwarnings(LOCKING)
@pytest.mark.parametrize("cell", ["hexahedron27", "hexahedron"])
def test_only_rigid_motions_cost_no_energy(cell):
    K = solid_structure(curved(cell, 1)).K.toarray()
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() < 1e-12 * values[-1]
    assert values[6] > 1e-6 * values[-1]


def test_mass_and_inertia_are_those_of_the_turned_box():
    C, a = random_rotation(2), np.array([1.0, 0.4, 0.2])
    structure = solid_structure(box(*a, 2, 1, 1, "hexahedron27").rotated(C))
    block = structure.inertia[0]
    mass = METAL.density * a.prod()
    Q = C.T @ np.einsum("eq,eqa,eqb->ab", block.dm, block.rho, block.rho) @ C
    assert mass * (np.outer(a, a) / 4 + np.diag(a**2) / 12) == pytest.approx(Q, rel=1e-12)
    one = structure.translation.T @ np.tile([1.0, 0, 0], len(structure.mesh.points))
    assert one @ structure.M @ one == pytest.approx(mass, rel=1e-13)


@pytest.mark.filterwarnings(LOCKING)
@pytest.mark.parametrize("cell", ["hexahedron27", "hexahedron"])
def test_matrices_are_sums_over_the_points_of_the_tables(cell):
    structure = solid_structure(curved(cell))
    d = np.random.default_rng(5).normal(size=(structure.n_dof, 2))
    raw = structure.T @ d
    inertia, strain = structure.inertia[0], structure.strain[0]
    u = inertia.shapes(raw, slice(None))
    assert np.einsum("eq,eqam,eqan->mn", inertia.dm, u, u) == pytest.approx(d.T @ structure.M @ d, rel=1e-12)
    eps = np.einsum("sg,eqgn->eqsn", strain.linear_map, strain.gradients(raw, slice(None)))
    V1 = np.einsum("eq,eqsm,st,eqtn->mn", strain.weight, eps, strain.elastic[0, 0], eps)
    assert V1 == pytest.approx(d.T @ structure.K @ d, rel=1e-11)
    assert inertia.mass()[1:3] == pytest.approx(DenseLike(inertia)[1:3], rel=1e-12, abs=1e-12 * inertia.dm.max())


def DenseLike(inertia):
    """Element mass matrices from the points alone."""
    q = inertia.dm.shape[1]
    l = inertia.dofs.shape[1]
    N = np.einsum("qk,ab->qakb", inertia.N, np.eye(3)).reshape(q, 3, l)
    return np.einsum("eq,qal,qam->elm", inertia.dm, N, N)


def test_green_strain_is_zero_in_a_finite_rotation_and_right_in_a_stretch():
    structure = solid_structure(curved("hexahedron27", 1))
    strain, points = structure.strain[0], structure.mesh.points

    def green(F):
        raw = structure.T @ (structure.translation.T @ (points @ (F - np.eye(3)).T).ravel())
        g = strain.gradients(raw[:, None], slice(None))[..., 0]
        return g @ strain.linear_map.T + np.einsum("sgh,eqg,eqh->eqs", strain.quadratic_map, g, g) / 2

    assert np.abs(green(random_rotation(3))).max() < 1e-12
    F = np.eye(3) + 0.3 * np.random.default_rng(6).normal(size=(3, 3))
    E = (F.T @ F - np.eye(3)) / 2
    voigt = [E[0, 0], E[1, 1], E[2, 2], 2 * E[1, 2], 2 * E[0, 2], 2 * E[0, 1]]
    expected = np.broadcast_to(voigt, green(F).shape)
    assert green(F) == pytest.approx(expected, abs=1e-12)


def test_longitudinal_frequencies_converge_with_the_fourth_power_of_the_size():
    """A rod of nu = 0 held at one end, its sides free: omega = (k - 1/2) pi c / L."""
    material = Material(1e9, 0.0, 1e3)
    errors = []
    for n in (3, 6, 12):
        structure = solid_structure(box(1.0, 0.1, 0.1, n, 1, 1, "hexahedron27"), material)
        x = structure.mesh.points[:, 0]
        sideways = np.flatnonzero(np.tile([0, 1, 1], len(x)))
        fixed = np.unique(np.concatenate([sideways, 3 * np.flatnonzero(x == 0)]))
        dofs = structure.translation[fixed].tocoo().coords[1]
        found = frequencies(structure, dofs, 2)
        errors.append(found / (np.array([0.5, 1.5]) * np.pi * 1e3) - 1)
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert orders == pytest.approx(np.full((2, 2), 4.0), abs=0.25)
    assert (np.array(errors) > 0).all()


def test_a_thin_panel_of_solids_is_the_plate():
    """Clamped panel, one layer of 27-node hexahedra against DKMT triangles: model difference of order h."""
    mesh = box(1.0, 0.5, 0.02, 12, 6, 1, "hexahedron27")
    solid = solid_structure(mesh)
    plate = build_structure(rectangle(1.0, 0.5, 24, 12), [Member("surface", "plate", isotropic(0.02, METAL))])
    found = [frequencies(s, s.clamped_dofs("left"), 3) for s in (solid, plate)]
    assert found[0] == pytest.approx(found[1], rel=2e-2)


def test_eight_node_elements_lock_and_say_so():
    mesh = box(1.0, 0.1, 0.02, 10, 1, 1, "hexahedron")
    with pytest.warns(PhysicsWarning, match=r"10 hexahedron cells of first order, up to 5 times .* 9.75 times"):
        locked = solid_structure(mesh)
    free = solid_structure(box(1.0, 0.1, 0.02, 10, 1, 1, "hexahedron27"))
    ratio = [frequencies(s, s.clamped_dofs("left"), 1)[0] for s in (locked, free)]
    assert ratio[0] / ratio[1] > 2  # the square root of the factor the warning shows, 3.1, is its bound
    assert ratio[0] / ratio[1] < 1.05 * np.sqrt(9.75)


@pytest.mark.filterwarnings(LOCKING)
@pytest.mark.parametrize("cell", ["hexahedron27", "hexahedron"])
def test_the_skin_is_closed_points_outwards_and_moves_with_the_nodes(cell):
    structure = solid_structure(box(1.0, 0.4, 0.2, 3, 2, 1, cell))
    skin = structure.skin
    quads = skin.points[skin.cells["quad"]]
    normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]) / 2
    assert np.sum(quads.mean(axis=1) * normal) / 3 == pytest.approx(0.08)  # volume, by the divergence theorem
    assert np.linalg.norm(normal, axis=1).sum() == pytest.approx(2 * (0.4 + 0.2 + 0.08))
    omega = np.array([0.2, -0.3, 0.5])
    d = structure.translation.T @ np.cross(omega, structure.mesh.points).ravel()
    assert (skin.operator @ d).reshape(-1, 3) == pytest.approx(np.cross(omega, skin.points), abs=1e-14)
    sides = np.sort(
        np.stack([skin.cells["quad"], np.roll(skin.cells["quad"], -1, axis=1)], axis=2).reshape(-1, 2), axis=1
    )
    assert (np.unique(sides, axis=0, return_counts=True)[1] == 2).all()


def test_mistakes_are_refused_in_words():
    mesh = box(1.0, 1.0, 1.0, 1, 1, 1, "hexahedron27")
    with pytest.raises(ValueError, match=r"solid on group 'volume' has no material; give one"):
        build_structure(mesh, [Member("volume", "solid")])
    with pytest.raises(ValueError, match=r"has a section; a solid has none"):
        build_structure(mesh, [Member("volume", "solid", 0.1, METAL)])
    with pytest.raises(
        ValueError, match=r"group 'left' holds quad9 cells; the solid family is made of hexahedron, hexa"
    ):
        build_structure(mesh, [Member("left", "solid", material=METAL)])
    mirrored = Mesh(mesh.points * [-1, 1, 1], dict(mesh.cells), mesh.cell_groups)
    with pytest.raises(ValueError, match=r"1 of 1 hexahedron27 elements are turned inside out or folded"):
        solid_structure(mirrored)
    order = [*range(8), *np.random.default_rng(0).permutation(np.arange(8, 27))]
    cells = {"hexahedron27": mesh.cells["hexahedron27"][:, order]}
    with pytest.raises(ValueError, match=r"lies far from the middle of its corners; the nodes must be in VTK's order"):
        solid_structure(Mesh(mesh.points, cells, {"volume": {"hexahedron27": [0]}}))
    with pytest.raises(ValueError, match=r"solid on group 'volume' has no option 'degree'"):
        build_structure(mesh, [Member("volume", "solid", material=METAL, options={"degree": 2})])


def test_matrices_summed_in_pieces_are_those_summed_at_once(monkeypatch):
    """Large meshes are assembled a few elements at a time."""
    mesh = box(2.0, 1.0, 0.5, 3, 2, 2, "hexahedron27")
    once = solid_structure(mesh, Material(2e9, 0.3, 100.0))
    monkeypatch.setattr(assembler, "CHUNK_ENTRIES", 27**2 * 5)
    pieces = solid_structure(mesh, Material(2e9, 0.3, 100.0))
    for whole, part in ((once.M, pieces.M), (once.K0, pieces.K0)):
        assert abs(whole - part).max() < 1e-13 * abs(whole).max()
