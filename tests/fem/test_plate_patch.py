"""Plate elements reproduce constant strain, store no energy in rigid motion, and carry the mass of a slab."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import METAL, bent_mesh, displaced, flexural_rigidity, plate_structure, random_rotation

from femflex.fem.sections.laminates import Lamina, Ply, sandwich
from femflex.mesh import Mesh, rectangle

H = 0.01
SHIFT = np.array([1.0, 2.0, 3.0])
TURNS = [np.eye(3), random_rotation(3), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])]
FAMILIES = [("plate", "dkmt"), ("plate", "dkt"), ("plate_bfs", None)]


def patch(family: str, element: str | None, turn: np.ndarray):
    mesh = bent_mesh("triangle", 4) if family == "plate" else rectangle(1.2, 0.9, 4, 3, "quad")
    mesh = mesh.rotated(turn)
    return plate_structure(mesh, H, family, axis=turn[:, 0], **({"element": element} if element else {}))


def exact_bending(structure, turn):
    """Dofs of w = (k1 x^2 + k2 y^2)/2 + k3 x y with no shear, local x, y; twist dofs of BFS carry w,xy."""
    k1, k2, k3 = 0.7, -0.4, 0.3

    def u(x):
        x, y, _ = (x @ turn).T
        return np.outer(k1 * x**2 / 2 + k2 * y**2 / 2 + k3 * x * y, turn[:, 2])

    def theta(x):
        x, y, _ = (x @ turn).T
        return np.stack([k2 * y + k3 * x, -(k1 * x + k3 * y), 0 * x], axis=1) @ turn.T

    d = displaced(structure, u, theta)
    D = flexural_rigidity(H)
    energy = D / 2 * (k1**2 + k2**2 + 2 * METAL.nu * k1 * k2 + 2 * (1 - METAL.nu) * k3**2) * 1.2 * 0.9
    return d, energy


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize(("family", "element"), FAMILIES)
def test_constant_curvature_is_an_equilibrium_with_the_exact_energy(family, element, turn):
    structure = patch(family, element, turn)
    d, energy = exact_bending(structure, turn)
    if family == "plate_bfs":  # the twist is w,xy in the element's own axes
        block = structure.inertia[0]
        e1, e2, normal = block.axes[0] @ turn
        raw = np.zeros(structure.T.shape[0])
        raw[block.dofs[:, 32:36]] = normal[2] * e1[:2] @ np.array([[0.7, 0.3], [0.3, -0.4]]) @ e2[:2]
        d += structure.T.T @ raw
    assert d @ structure.K @ d / 2 == pytest.approx(energy, rel=1e-9)
    force = structure.K @ d
    nodes = np.setdiff1d(np.arange(len(structure.mesh.points)), rim_nodes(structure.mesh, turn))
    rows = (3 * nodes[:, None] + np.arange(3)).ravel()
    inner = np.concatenate([structure.translation[rows] @ force, structure.rotation[rows] @ force])
    assert np.abs(inner).max() < 1e-9 * np.abs(force).max()


def rim_nodes(mesh: Mesh, turn: np.ndarray) -> np.ndarray:
    x, y, _ = (mesh.points @ turn).T
    on = (np.abs(x) < 1e-9) | (np.abs(x - 1.2) < 1e-9) | (np.abs(y) < 1e-9) | (np.abs(y - 0.9) < 1e-9)
    return np.flatnonzero(on)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize(("family", "element"), FAMILIES)
def test_constant_membrane_strain_is_an_equilibrium_with_the_exact_energy(family, element, turn):
    structure = patch(family, element, turn)
    grad = np.array([[0.3, 0.1], [0.4, -0.2]])
    d = displaced(structure, lambda x: (x @ turn)[:, :2] @ grad.T @ turn[:, :2].T, lambda x: np.zeros_like(x))
    strain = np.array([0.3, -0.2, 0.5])
    plane = METAL.E / (1 - METAL.nu**2) * np.array([[1, METAL.nu, 0], [METAL.nu, 1, 0], [0, 0, (1 - METAL.nu) / 2]])
    assert d @ structure.K @ d / 2 == pytest.approx(H / 2 * strain @ plane @ strain * 1.08, rel=1e-10)
    force = structure.K @ d
    nodes = np.setdiff1d(np.arange(len(structure.mesh.points)), rim_nodes(structure.mesh, turn))
    inner = structure.translation[(3 * nodes[:, None] + np.arange(3)).ravel()] @ force
    assert np.abs(inner).max() < 1e-9 * np.abs(force).max()


@pytest.mark.parametrize(("family", "element"), FAMILIES)
def test_the_in_plane_field_is_quadratic(family, element):
    """u = a x^2 + b x y + c y^2 lies in the space: the least energy with these corner displacements is no lower."""
    structure = patch(family, element, np.eye(3))
    block = structure.strain[0]
    rng = np.random.default_rng(0)
    coefficients = rng.normal(size=(2, 3))
    dofs = np.zeros(structure.T.shape[0])
    field = quadratic_field(structure, coefficients)
    dofs[: len(field)] = field
    x = quadrature_places(structure, family)
    g = block.gradients(dofs[:, None], slice(None))[..., :4, 0]
    (a, b, c), (p, q, r) = coefficients
    exact = np.stack(
        [2 * a * x[..., 0] + b * x[..., 1], b * x[..., 0] + 2 * c * x[..., 1],
         2 * p * x[..., 0] + q * x[..., 1], q * x[..., 0] + 2 * r * x[..., 1]], axis=-1,
    )  # fmt: skip
    assert g == pytest.approx(exact, rel=1e-10, abs=1e-12)


def quadratic_field(structure, coefficients):
    """Raw dofs of the field: nodal values, and on sides the middle's distance from the chord."""
    mesh, block = structure.mesh, structure.strain[0]
    corners = corner_nodes(structure)
    c = corners.shape[1]
    raw = np.zeros(structure.T.shape[0])

    def u(x):
        monomials = np.stack([x[..., 0] ** 2, x[..., 0] * x[..., 1], x[..., 1] ** 2], axis=-1)
        return monomials @ coefficients.T

    x = mesh.points[corners]
    for i in range(c):
        raw[block.dofs[:, 3 * i : 3 * i + 2]] = u(x[:, i])
        j = (i + 1) % c
        middle = u((x[:, i] + x[:, j]) / 2) - (u(x[:, i]) + u(x[:, j])) / 2
        raw[block.dofs[:, 6 * c + 2 * i : 6 * c + 2 * i + 2]] = middle
    return raw  # the bubble of a rectangle is of higher degree: zero


def corner_nodes(structure):
    """Corners (e, c) of the elements in the order of their raw dofs."""
    block = structure.strain[0]
    c = 3 if block.dofs.shape[1] == 24 else 4
    node = np.full(structure.T.shape[0], -1)
    points = np.arange(len(structure.mesh.points))
    node[structure.numbering.translation_of(points)[:, 0]] = points
    return node[block.dofs[:, 0 : 3 * c : 3]]


def quadrature_places(structure, family):
    """Places (e, q, 2) of the strain points, from the reference rules."""
    x = structure.mesh.points[corner_nodes(structure)][..., :2]
    if family == "plate":
        from femflex.fem.plate.triangles import area_points

        return np.einsum("qi,eia->eqa", area_points(2)[0], x)
    points, _ = np.polynomial.legendre.leggauss(4)
    xi, eta = (grid.ravel() for grid in np.meshgrid(points, points, indexing="ij"))
    s, t = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
    return np.einsum("qi,eia->eqa", (1 + np.outer(xi, s)) * (1 + np.outer(eta, t)) / 4, x)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize(("family", "element"), FAMILIES)
def test_only_rigid_motions_cost_no_energy(family, element, turn):
    structure = patch(family, element, turn)
    K = structure.K.toarray()
    scale = np.sqrt(np.abs(np.diag(K)))
    values = np.linalg.eigvalsh(K / np.outer(scale, scale))
    assert np.abs(values[:6]).max() < 1e-11
    assert values[6] > 1e-7
    omega = np.array([0.3, -0.5, 0.7])
    d = displaced(structure, lambda x: np.cross(omega, x) + SHIFT, lambda x: np.broadcast_to(omega, x.shape))
    assert np.abs(structure.K @ d).max() < 1e-8 * np.abs(K).max()


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize(("family", "element"), FAMILIES)
def test_a_plate_has_the_mass_and_inertia_of_its_slab(family, element, turn):
    structure = patch(family, element, turn)
    a, b, mass = 1.2, 0.9, METAL.density * H * 1.2 * 0.9
    block = structure.inertia[0]
    Q = np.einsum("eq,eqa,eqb->ab", block.dm, block.rho, block.rho)
    Q_local = turn.T @ Q @ turn
    exact = mass * np.array([[a * a / 3, a * b / 4, 0], [a * b / 4, b * b / 3, 0], [0, 0, H * H / 12]])
    assert block.dm.sum() == pytest.approx(mass, rel=1e-13)
    assert Q_local == pytest.approx(exact, rel=1e-12, abs=1e-13 * mass)
    one = displaced(structure, lambda x: np.broadcast_to(turn[:, 2], x.shape), lambda x: np.zeros_like(x))
    assert one @ structure.M @ one == pytest.approx(mass, rel=1e-12)
    spin = turn[:, 0]  # about local x: a rotation that flat plates can take at their nodes
    d = displaced(structure, lambda x: np.cross(spin, x), lambda x: np.broadcast_to(spin, x.shape))
    if family == "plate_bfs":  # a rigid rotation has no twist, so extra dofs stay zero
        assert np.abs(structure.T[np.unique(block.dofs[:, 32:])] @ d).max() == 0.0
    assert d @ structure.M @ d == pytest.approx(mass * (b * b / 3 + H * H / 12), rel=1e-12)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize(("family", "element"), FAMILIES)
def test_matrices_are_sums_over_the_points_of_the_tables(family, element, turn):
    structure = patch(family, element, turn)
    rng = np.random.default_rng(5)
    d = rng.normal(size=(structure.n_dof, 3))
    raw = structure.T @ d
    every = slice(None)
    inertia, strain = structure.inertia[0], structure.strain[0]
    u = inertia.shapes(raw, every)
    assert np.einsum("eq,eqam,eqan->mn", inertia.dm, u, u) == pytest.approx(d.T @ structure.M @ d, rel=1e-11)
    eps = np.einsum("sg,eqgn->eqsn", strain.linear_map, strain.gradients(raw, every))
    C = np.broadcast_to(strain.elastic, (len(strain.weight), 1, *strain.elastic.shape[2:]))
    V1 = np.einsum(
        "eq,eqsm,eqst,eqtn->mn", strain.weight, eps, np.broadcast_to(C, (*strain.weight.shape, *C.shape[2:])), eps
    )
    assert V1 == pytest.approx(d.T @ structure.K @ d, rel=1e-11)
    part = slice(3, 7)
    assert inertia.shapes(raw, part) == pytest.approx(u[part], rel=1e-13)
    assert inertia.mass()[part] == pytest.approx(inertia.mass(part), rel=1e-13)


def test_quadratic_strains_are_those_of_von_karman():
    strain = patch("plate", "dkmt", np.eye(3)).strain[0]
    g = np.zeros(11)
    g[4:6] = 0.3, -0.2  # slopes of w
    quadratic = np.einsum("sgh,g,h->s", strain.quadratic_map, g, g) / 2
    assert quadratic == pytest.approx([0.045, 0.02, -0.06, 0, 0, 0, 0, 0])
    d = displaced(
        patch("plate", "dkmt", np.eye(3)),
        lambda x: np.stack([0 * x[:, 0], 0 * x[:, 0], 0.3 * x[:, 0] - 0.2 * x[:, 1]], axis=1),
        lambda x: np.broadcast_to([-0.2, -0.3, 0.0], x.shape),
    )
    structure = patch("plate", "dkmt", np.eye(3))
    at_points = structure.strain[0].gradients((structure.T @ d)[:, None], slice(None))[..., 0]
    assert at_points == pytest.approx(np.broadcast_to(g, at_points.shape), abs=1e-12)


def test_a_massless_radius_of_gyration_leaves_one_layer_of_points():
    section = sandwich(Ply(Lamina(1e9, 1e9, 4e8, 0.25, 0.0), 1e-3), 0.01, Lamina.core(0.0, 1e7)).loaded(2.0)
    structure = plate_structure(rectangle(1.0, 1.0, 2, 2), section)
    block = structure.inertia[0]
    assert block.dm.shape == (8, 12)
    assert block.rho[..., 2] == pytest.approx(0.0)
    assert block.dm.sum() == pytest.approx(2.0)
