"""Shells whose thickness, density, axes and layers vary, are offset or stressed: closed forms, beams, plies."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from support.closed_forms import static_solution
from support.plate_models import frequencies, random_rotation

from femflex.body.recovery import named
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.fem.sections.laminates import Lamina, Ply, isotropic, layup
from femflex.mesh import Mesh, annulus, line, rectangle
from femflex.reduction.beams.strain_points import strain_field

pytestmark = [
    pytest.mark.filterwarnings(
        "ignore:.*three-node triangles:femflex.warning.PhysicsWarning",
        "ignore:.*elements are longer:femflex.warning.PhysicsWarning",
    )
]
METAL = Material(70e9, 0.0, 2700.0)


TAPER = "0.02 * (1 - 0.5 * x)"  # from 20 mm to 10 mm over 1 m


CELLS = ("quad", "quad9", "triangle6")


def shell(mesh: Mesh, section=0.02, material=METAL, **options):
    return build_structure(mesh, [Member("surface", "shell", section, material, options)])


def taper(p):
    return 0.02 * (1 - 0.5 * p[..., 0])


def ways(mesh: Mesh):
    """One taper as a formula, at the points of the mesh, and at the corners of elements."""
    corners = {
        kind: mesh.points[rows][:, : 3 if "triangle" in kind else 4]
        for kind, rows in mesh.group_cells("surface").items()
    }
    return {
        "formula": TAPER,
        "points": taper(mesh.points),
        "corners": {kind: taper(places) for kind, places in corners.items()},
    }


@pytest.mark.parametrize("cell", CELLS)
def test_deflection_of_tapered_strip(cell):
    """w = int F (L - x)^2 / (E b h^3 / 12) dx under a tip force; the three ways to give the taper agree."""
    mesh, b = rectangle(1.0, 0.1, 20 if cell == "quad" else 10, 1, cell), 0.1
    x = np.linspace(0, 1, 20001)
    reference = np.trapezoid((1 - x) ** 2 / (70e9 * b * (0.02 * (1 - 0.5 * x)) ** 3 / 12), x)
    for name, thickness in ways(mesh).items():
        s = shell(mesh, thickness=thickness)
        tip = s.mesh.group_points("right")
        F = np.zeros((len(s.mesh.points), 3))
        F[tip, 2] = 1 / len(tip)
        u = static_solution(s, s.translation.T @ F.ravel(), s.clamped_dofs("left"))
        assert (s.translation @ u).reshape(-1, 3)[tip, 2].mean() == pytest.approx(reference, rel=0.004), name
        move = s.translation.T @ np.tile([0, 0, 1.0], len(s.mesh.points))
        assert move @ s.M @ move == pytest.approx(2700 * 0.015 * b, rel=1e-9)
    part = strain_field(s, u[:, None], False)[0]
    stress, moment = (named(part, name, np.ones((1, 1)))[0] for name in ("von_mises", "moment_xx"))
    inner = part.places[:, 0] < 0.7
    expected = 6 * np.abs(moment) / taper(part.places) ** 2
    np.testing.assert_allclose(stress[inner], expected[inner], rtol=0.02)


@pytest.mark.parametrize("cell", CELLS)
def test_frequencies_of_tapered_strip_match_beam(cell):
    s = shell(rectangle(1.0, 0.1, 16 if cell == "quad" else 10, 1, cell), thickness=TAPER, density="2000 + 1000 * x")
    section = Rectangle(0.1, "0.02 * (1 - 0.5 * s)")
    thin = build_structure(
        line([[0, 0, 0], [1.0, 0, 0]], 8), [Member("line", "beam", section, METAL, {"orientation": (0, 1, 0)})]
    )
    plain = shell(rectangle(1.0, 0.1, 16 if cell == "quad" else 10, 1, cell), thickness=TAPER)
    bends = [frequencies(a, a.clamped_dofs("left" if a is plain else "start"), 2) for a in (plain, thin)]
    assert bends[0][0] == pytest.approx(bends[1][0], rel=3e-3)
    move = s.translation.T @ np.tile([0, 0, 1.0], len(s.mesh.points))
    assert move @ s.M @ move == pytest.approx(0.1 * 0.02 * (2000 + 1000 / 2 - 0.5 * 1000 - 0.5 * 1000 / 3), rel=1e-9)


@pytest.mark.parametrize("cell", ["quad", "quad9"])
def test_section_angle_and_axes_of_ring(cell):
    """An angle as an option, and the axis along formulas: stiff along the hoop is radial turned by a right angle."""
    lamina = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0)
    mesh = rectangle(1.0, 0.6, 3, 2, cell)
    a, b = (shell(mesh, layup([Ply(lamina, 0.002, t)]), None, angle=u) for t, u in ((0.4, 0.0), (0.0, 0.4)))
    np.testing.assert_allclose(a.K.toarray(), b.K.toarray(), atol=1e-9 * abs(a.K).max())
    ring, hoop = annulus(1.0, 1.3, 2, 16, cell), layup([Ply(lamina, 0.002, np.pi / 2)])
    computed = [
        build_structure(ring, [Member("surface", "shell", section, None, {"axis": axis})])
        for section, axis in ((hoop, ("x", "y", "0")), (layup([Ply(lamina, 0.002)]), ("-y", "x", "0")))
    ]
    np.testing.assert_allclose(computed[0].K.toarray(), computed[1].K.toarray(), atol=1e-9 * abs(computed[0].K).max())
    straight = build_structure(ring, [Member("surface", "shell", hoop, None, {"axis": (1, 0, 0)})])
    assert abs(straight.K - computed[0].K).max() > 0.1 * abs(computed[0].K).max()


def test_polar_orthotropic_ring_matches_lekhnitskii():
    """u = c1 r^k + c2 r^-k, k^2 = E_theta / E_r, under pressure p at the inner edge; nu = 0."""
    Er, Et, a, b, h = 10e9, 40e9, 1.0, 2.0, 0.01
    section = layup([Ply(Lamina(Er, Et, 5e9, 0.0, 1600.0), h)])
    mesh = annulus(a, b, 6, 40, "quad9")
    s = build_structure(mesh, [Member("surface", "shell", section, None, {"axis": ("x", "y", "0")})])
    k = np.sqrt(Et / Er)
    system = Er * np.array([[k * a ** (k - 1), -k * a ** (-k - 1)], [k * b ** (k - 1), -k * b ** (-k - 1)]])
    c = np.linalg.solve(system, [-1e6, 0.0])
    inner = mesh.group_cells("inner")["line3"]
    F = np.zeros((len(s.mesh.points), 3))
    for n0, n1, n2 in inner:
        length = 2 * np.pi * a / len(inner)
        for node, share in ((n0, 1 / 6), (n1, 1 / 6), (n2, 2 / 3)):
            F[node] += 1e6 * h * length * share * s.mesh.points[node] / np.linalg.norm(s.mesh.points[node])
    K = s.K + 1e-6 * abs(s.K).max() * (s.M / abs(s.M).max())  # holds rigid motions, which the load does not move
    u = (s.translation @ spsolve(K.tocsc(), s.translation.T @ F.ravel())).reshape(-1, 3)
    r = np.linalg.norm(s.mesh.points[:, :2], axis=1)
    radial = np.sum(u * s.mesh.points, axis=1) / r
    np.testing.assert_allclose(radial, c[0] * r**k + c[1] * r**-k, rtol=5e-3)


FIBRE = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0, 5e9, 3.5e9)


FOAM = Lamina(2e9, 3e9, 4e8, 0.2, 300.0, 5e8, 2e8)


STACK = layup([Ply(FIBRE, 0.004, 0.3), Ply(FOAM, 0.02, -0.5), Ply(FOAM, 0.005, 1.2)], coupled=True).with_added_mass(3.0)


CELLS_SHELL_TABLES = ("quad", "quad9", "triangle6", "triangle")


def shell_shell_tables(mesh, section=STACK, **options):
    material = METAL if isinstance(section, float) else None
    return build_structure(mesh, [Member("surface", "shell", section, material, options)])


@pytest.mark.parametrize("cell", CELLS_SHELL_TABLES)
@pytest.mark.parametrize(
    "fields", [{}, {"extra_mass": "2 + x"}, {"thickness": 0.05, "density": 700.0}, {"thickness": "0.02 + 0.01 * y"}]
)
def test_mass_of_layers_about_nodes(cell, fields):
    """Rigid motion of a flat shell off its nodes, by mass, first and second moment of the thickness, integrated."""
    mesh, offset = rectangle(1.0, 0.8, 2, 2, cell), 0.03
    s = shell_shell_tables(mesh, offset=offset, **fields)
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


@pytest.mark.parametrize("cell", CELLS_SHELL_TABLES)
def test_energy_of_coupled_section(cell):
    """eps_0 + z kappa through a skew, unsymmetric, offset stack, its x axis turned: [A B; B D] by its plies."""
    C, d, angle = random_rotation(4), -0.017, 0.35
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    s = shell_shell_tables(flat.rotated(C), axis=C @ [1.0, 2.0, 0], angle=angle, offset=d)
    up = float(np.sign(s.inertia[0].V[0, 0] @ C[:, 2]))
    x, y, _ = flat.points.T
    e, k = np.array([1.0, -0.4, 0.7]), np.array([3.0, 2.0, -5.0])  # xx yy, engineering xy
    u = np.stack([e[0] * x + e[2] / 2 * y, e[1] * y + e[2] / 2 * x, -(k[0] * x * x + k[1] * y * y + k[2] * x * y) / 2])
    turn = np.stack([-(k[1] * y + k[2] * x / 2), k[0] * x + k[2] * y / 2, 0 * x])
    v = s.translation.T @ (C @ u).T.ravel() + s.rotation.T @ (C @ turn).T.ravel()
    section_angle = up * angle + np.arctan2(2, 1)
    z = np.cumsum([-0.0145, 0.004, 0.02, 0.005]) + d
    plies = [(FIBRE, 0.3), (FOAM, -0.5), (FOAM, 1.2)]
    energy = 0.0
    for (lamina, theta), a, b in zip(plies, z, z[1:], strict=False):
        Q = lamina.plane_stress(section_angle + up * theta)
        g, w = np.polynomial.legendre.leggauss(3)
        for at, weight in zip((a + b) / 2 + g * (b - a) / 2, w * (b - a) / 2, strict=True):
            eps = e + up * at * k
            energy += weight * eps @ Q @ eps * 0.8
    if cell not in ("quad", "triangle"):  # those of first order bend to a paraboloid by facets
        assert v @ s.K @ v == pytest.approx(energy, rel=1e-9)
    flat_only = s.translation.T @ (C @ np.stack([u[0], u[1], 0 * x])).T.ravel()
    A = sum(
        (b - a) * lamina.plane_stress(section_angle + up * theta)
        for (lamina, theta), a, b in zip(plies, z, z[1:], strict=False)
    )
    assert flat_only @ s.K @ flat_only == pytest.approx(0.8 * e @ A @ e, rel=1e-9)


@pytest.mark.parametrize("cell", CELLS_SHELL_TABLES)
def test_shell_stretch_under_moderate_rotation(cell):
    """Sanders: E = sym(H) + w,a w,b / 2 + delta omega^2 / 2, omega = (v,x - u,y) / 2, of a homogeneous state."""
    H, slope, sheet = np.array([[0.02, -0.3], [0.15, 0.05]]), np.array([0.2, -0.3]), isotropic(0.02, METAL)
    mesh = rectangle(1.0, 0.8, 2, 2, cell)
    s = shell_shell_tables(mesh, sheet)
    p = mesh.points[:, :2]
    u = np.column_stack([p @ H.T, p @ slope])
    turn = np.tile([slope[1], -slope[0], 0.0], (len(p), 1))
    x = s.translation.T @ u.ravel() + s.rotation.T @ turn.ravel()
    half = ((H[1, 0] - H[0, 1]) / 2) ** 2 / 2
    e = np.array([H[0, 0] + slope[0] ** 2 / 2 + half, H[1, 1] + slope[1] ** 2 / 2 + half])
    eps = np.append(e, H[0, 1] + H[1, 0] + slope[0] * slope[1])
    assert s.internal_force.energy(x) == pytest.approx(0.8 * eps @ sheet.A @ eps / 2, rel=1e-9)


@pytest.mark.parametrize("cell", CELLS_SHELL_TABLES)
def test_prestress_and_thermal_strain_of_coupled_shell(cell):
    """Virtual work of f0 on a uniform stretch and on a uniform bend: N.e and M.k, in skew axes."""
    C = random_rotation(9)
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    force, heat = np.array([300.0, -120.0, 80.0]), np.array([2e-4, 1e-4, -3e-4])
    s = shell_shell_tables(flat.rotated(C), axis=C[:, 0], prestress=force, thermal_strain=heat)
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
