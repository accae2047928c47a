"""Tables, pictures and warnings of shells with generic numbers: thick, offset, tapered, warped."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import METAL, random_rotation

from femflex.fem import Member, build_structure
from femflex.fem.sections.laminates import Lamina, Ply, isotropic, layup
from femflex.mesh import Mesh, rectangle

FIBRE = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0, 5e9, 3.5e9)
FOAM = Lamina(2e9, 3e9, 4e8, 0.2, 300.0, 5e8, 2e8)
STACK = layup([Ply(FIBRE, 0.004, 0.3), Ply(FOAM, 0.02, -0.5), Ply(FOAM, 0.005, 1.2)], coupled=True).loaded(3.0)
CELLS = ("quad", "quad9", "triangle6", "triangle")
pytestmark = pytest.mark.filterwarnings(
    "ignore:.*three-node triangles:femflex.warning.PhysicsWarning",
    "ignore:.*elements are longer:femflex.warning.PhysicsWarning",
)


def shell(mesh, section=STACK, **options):
    material = METAL if isinstance(section, float) else None
    return build_structure(mesh, [Member("surface", "shell", section, material, options)])


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize(
    "fields", [{}, {"extra_mass": "2 + x"}, {"thickness": 0.05, "density": 700.0}, {"thickness": "0.02 + 0.01 * y"}]
)
def test_mass_about_the_nodes_is_that_of_the_layers(cell, fields):
    """Rigid motion of a flat shell off its nodes, by mass, first and second moment of the thickness, integrated."""
    mesh, offset = rectangle(1.0, 0.8, 2, 2, cell), 0.03
    s = shell(mesh, offset=offset, **fields)
    x, w = np.polynomial.legendre.leggauss(6)
    x, w = (x + 1) / 2, w / 2
    X, Y = (a.ravel() for a in np.meshgrid(x, 0.8 * x, indexing="ij"))
    area = 0.8 * np.outer(w, w).ravel()
    h = np.broadcast_to(eval(str(fields.get("thickness", 0.029)), {"x": X, "y": Y}), X.shape)
    more = np.broadcast_to(eval(str(fields.get("extra_mass", 0.0)), {"x": X, "y": Y}), X.shape)
    f = h / 0.029
    mean = (0.004 * 1600 + 0.025 * 300) / 0.029
    dense = np.full(X.shape, fields.get("density", mean) / mean)
    edges = np.cumsum([-0.0145, 0.004, 0.02, 0.005])
    rho = (1600, 300, 300)
    m0, m1, m2 = (
        sum(r * (b ** (p + 1) - a ** (p + 1)) / (p + 1) for r, a, b in zip(rho, edges, edges[1:], strict=False))
        for p in range(3)
    )
    centre, rotary = m1 / m0, m2 - m1**2 / m0
    mass = m0 * f * dense + 3.0 + more  # the mass that is no structure lies at the mass centre
    c = centre * f + offset
    second = rotary * f**3 * dense + mass * c**2
    sign = float(np.sign(s.inertia[0].V[0, 0, 2]))
    n = len(s.mesh.points)
    move, turn = np.random.default_rng(1).normal(size=(2, 3))
    turn[2] = 0.0
    v = s.translation.T @ (move + np.cross(turn, s.mesh.points)).ravel() + s.rotation.T @ np.tile(turn, n)
    flat = move + np.cross(turn, np.stack([X, Y, 0 * X], axis=1))
    lever = sign * np.cross(turn, [0, 0, 1.0])
    energy = mass * np.sum(flat**2, axis=1) + 2 * mass * c * (flat @ lever) + second * (lever @ lever)
    assert v @ s.M @ v == pytest.approx(area @ energy, rel=1e-9)
    rho_points = np.concatenate([b.rho.reshape(-1, 3) for b in s.inertia])
    dm = np.concatenate([b.dm.ravel() for b in s.inertia])
    assert dm @ rho_points[:, 2] == pytest.approx(sign * area @ (mass * c), rel=1e-9)
    assert dm @ rho_points[:, 2] ** 2 == pytest.approx(area @ second, rel=1e-9)


@pytest.mark.parametrize("cell", CELLS)
def test_uniform_stretch_and_curvature_store_the_energy_of_the_coupled_section(cell):
    """eps_0 + z kappa through a skew, unsymmetric, offset stack, its x axis turned: [A B; B D] by its plies."""
    C, d, angle = random_rotation(4), -0.017, 0.35
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    s = shell(flat.rotated(C), axis=C @ [1.0, 2.0, 0], angle=angle, offset=d)
    up = float(np.sign(s.inertia[0].V[0, 0] @ C[:, 2]))
    x, y, _ = flat.points.T
    e, k = np.array([1.0, -0.4, 0.7]), np.array([3.0, 2.0, -5.0])  # xx yy, engineering xy
    u = np.stack([e[0] * x + e[2] / 2 * y, e[1] * y + e[2] / 2 * x, -(k[0] * x * x + k[1] * y * y + k[2] * x * y) / 2])
    turn = np.stack([-(k[1] * y + k[2] * x / 2), k[0] * x + k[2] * y / 2, 0 * x])
    v = s.translation.T @ (C @ u).T.ravel() + s.rotation.T @ (C @ turn).T.ravel()
    turned = up * angle + np.arctan2(2, 1)
    z = np.cumsum([-0.0145, 0.004, 0.02, 0.005]) + d
    plies = [(FIBRE, 0.3), (FOAM, -0.5), (FOAM, 1.2)]
    energy = 0.0
    for (one, theta), a, b in zip(plies, z, z[1:], strict=False):
        Q = one.plane_stress(turned + up * theta)
        g, w = np.polynomial.legendre.leggauss(3)
        for at, weight in zip((a + b) / 2 + g * (b - a) / 2, w * (b - a) / 2, strict=True):
            eps = e + up * at * k
            energy += weight * eps @ Q @ eps * 0.8
    if cell not in ("quad", "triangle"):  # those of first order bend to a paraboloid by facets
        assert v @ s.K @ v == pytest.approx(energy, rel=1e-9)
    flat_only = s.translation.T @ (C @ np.stack([u[0], u[1], 0 * x])).T.ravel()
    A = sum(
        (b - a) * one.plane_stress(turned + up * theta) for (one, theta), a, b in zip(plies, z, z[1:], strict=False)
    )
    assert flat_only @ s.K @ flat_only == pytest.approx(0.8 * e @ A @ e, rel=1e-9)


@pytest.mark.parametrize("cell", CELLS)
def test_moderate_rotation_stretches_a_shell_by_the_squares_of_its_slopes_and_of_its_turn(cell):
    """Sanders: E = sym(H) + w,a w,b / 2 + delta omega^2 / 2, omega = (v,x - u,y) / 2, of a homogeneous state."""
    H, slope, sheet = np.array([[0.02, -0.3], [0.15, 0.05]]), np.array([0.2, -0.3]), isotropic(0.02, METAL)
    mesh = rectangle(1.0, 0.8, 2, 2, cell)
    s = shell(mesh, sheet)
    p = mesh.points[:, :2]
    u = np.column_stack([p @ H.T, p @ slope])
    turn = np.tile([slope[1], -slope[0], 0.0], (len(p), 1))
    x = s.translation.T @ u.ravel() + s.rotation.T @ turn.ravel()
    half = ((H[1, 0] - H[0, 1]) / 2) ** 2 / 2
    e = np.array([H[0, 0] + slope[0] ** 2 / 2 + half, H[1, 1] + slope[1] ** 2 / 2 + half])
    eps = np.append(e, H[0, 1] + H[1, 0] + slope[0] * slope[1])
    assert s.internal_force.energy(x) == pytest.approx(0.8 * eps @ sheet.A @ eps / 2, rel=1e-9)


@pytest.mark.parametrize("cell", CELLS)
def test_stiffness_of_an_isotropic_shell_does_not_depend_on_where_its_axis_points(cell):
    """Given by formulas at the nodes of a curved mesh, off its surface, and as one direction."""
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    x, y, _ = flat.points.T
    bowl = Mesh(np.stack([x, y, 0.4 * x * x + 0.3 * x * y], axis=1), flat.cells, flat.cell_groups)
    plain = shell(bowl, 0.03)
    for axis in (("1 + x", "y - 0.3", "0.5"), ("0.2", "1", "x")):
        found = shell(bowl, 0.03, axis=axis)
        np.testing.assert_allclose(found.K.toarray(), plain.K.toarray(), atol=1e-10 * abs(plain.K).max())


def test_values_at_the_points_of_a_mesh_hold_where_the_shell_adds_nodes_of_its_own():
    """Of eight-node quadrilaterals, which get a ninth: linear between the corners, by points or by corners."""
    mesh = rectangle(1.0, 0.8, 2, 1, "quad8")
    x, y, _ = mesh.points.T
    corners = mesh.points[mesh.cells["quad8"][:, :4]]
    by_point = 0.02 + 0.01 * x + 0.005 * y
    by_corner = 0.02 + 0.01 * corners[..., 0] + 0.005 * corners[..., 1]
    exact = shell(mesh, 0.03, thickness="0.02 + 0.01 * x + 0.005 * y")
    for given in (by_point, {"quad8": by_corner}, {"quad9": by_corner}):
        found = shell(mesh, 0.03, thickness=given)
        assert len(found.mesh.points) == len(mesh.points) + 2
        np.testing.assert_allclose(found.K.toarray(), exact.K.toarray(), atol=1e-9 * abs(exact.K).max())
    with pytest.raises(ValueError, match="give a number, a formula of x, y and z, one value for each point of the"):
        shell(mesh, 0.03, thickness=np.ones(len(mesh.points) + 3))


@pytest.mark.parametrize("cell", CELLS)
def test_tension_and_heat_of_a_coupled_shell_pull_as_forces_and_moments_of_its_plies(cell):
    """Virtual work of f0 on a uniform stretch and on a uniform bend: N.e and M.k, in skew axes."""
    C = random_rotation(9)
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    force, heat = np.array([300.0, -120.0, 80.0]), np.array([2e-4, 1e-4, -3e-4])
    s = shell(flat.rotated(C), axis=C[:, 0], prestress=force, thermal_strain=heat)
    up = float(np.sign(s.inertia[0].V[0, 0] @ C[:, 2]))
    x, y, _ = flat.points.T
    N, M = force * [1, 1, up] - STACK.A @ heat, -STACK.B @ heat
    mirror = np.array([1, 1, up])  # the section's angles count about the director
    if up < 0:
        N = force - STACK.A @ heat
    for e in np.eye(3):
        u = np.stack([e[0] * x + e[2] / 2 * y, e[1] * y + e[2] / 2 * x, 0 * x])
        v = s.translation.T @ (C @ u).T.ravel()
        assert s.f0 @ v == pytest.approx(0.8 * N @ (mirror * e), rel=1e-8)
    for k in np.eye(3):
        u = -np.stack([0 * x, 0 * x, k[0] * x * x + k[1] * y * y + k[2] * x * y]) / 2
        turn = np.stack([-(k[1] * y + k[2] * x / 2), k[0] * x + k[2] * y / 2, 0 * x])
        v = s.translation.T @ (C @ u).T.ravel() + s.rotation.T @ (C @ turn).T.ravel()
        assert s.f0 @ v == pytest.approx(0.8 * up * M @ (mirror * k), rel=1e-8)
