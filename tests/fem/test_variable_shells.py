"""Shells whose thickness, density and axes vary over their surface: closed forms, beams, and equal ways to say it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from support.plate_models import frequencies

from femflex.body.recovery import named
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.fem.sections.laminates import Lamina, Ply, layup
from femflex.mesh import Mesh, annulus, line, rectangle
from femflex.reduction.beams.strain_points import strain_field

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
def test_a_tapered_strip_bends_as_the_integral_of_its_curvature(cell):
    """w = int F (L - x)^2 / (E b h^3 / 12) dx under a tip force; the three ways to give the taper agree."""
    mesh, b = rectangle(1.0, 0.1, 20 if cell == "quad" else 10, 1, cell), 0.1
    x = np.linspace(0, 1, 20001)
    known = np.trapezoid((1 - x) ** 2 / (70e9 * b * (0.02 * (1 - 0.5 * x)) ** 3 / 12), x)
    for name, thickness in ways(mesh).items():
        s = shell(mesh, thickness=thickness)
        tip = s.mesh.group_points("right")
        F = np.zeros((len(s.mesh.points), 3))
        F[tip, 2] = 1 / len(tip)
        free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("left"))
        u = np.zeros(s.n_dof)
        u[free] = spsolve(s.K[free][:, free].tocsc(), (s.translation.T @ F.ravel())[free])
        assert (s.translation @ u).reshape(-1, 3)[tip, 2].mean() == pytest.approx(known, rel=0.004), name
        move = s.translation.T @ np.tile([0, 0, 1.0], len(s.mesh.points))
        assert move @ s.M @ move == pytest.approx(2700 * 0.015 * b, rel=1e-9)
        assert np.linalg.eigvalsh(s.M.toarray())[0] > 0
    part = strain_field(s, u[:, None], False)[0]
    stress, moment = (named(part, name, np.ones((1, 1)))[0] for name in ("von_mises", "moment_xx"))
    inner = part.places[:, 0] < 0.7
    expected = 6 * np.abs(moment) / taper(part.places) ** 2
    np.testing.assert_allclose(stress[inner], expected[inner], rtol=0.02)


@pytest.mark.parametrize("cell", CELLS)
def test_a_tapered_strip_vibrates_as_a_tapered_beam(cell):
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


def test_a_stretched_laminate_is_the_thicker_laminate_off_its_nodes_too():
    """All plies stretch alike, the offset and the mass that is no structure stay."""
    one = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0)
    plies = [(0.001, 0.3), (0.002, -0.5), (0.001, 1.2)]
    section, thicker = (layup([Ply(one, f * t, a) for t, a in plies], coupled=True).loaded(2.0) for f in (1.0, 1.7))
    mesh = rectangle(1.0, 0.6, 3, 2, "quad9")
    a = shell(mesh, section, None, thickness=1.7 * 0.004, offset=0.01)
    b = shell(mesh, thicker, None, offset=0.01)
    np.testing.assert_allclose(a.K.toarray(), b.K.toarray(), atol=1e-12 * abs(b.K).max())
    np.testing.assert_allclose(a.M.toarray(), b.M.toarray(), atol=1e-12 * abs(b.M).max())


@pytest.mark.parametrize("cell", ["quad", "quad9"])
def test_an_angle_is_that_of_the_section_and_axes_follow_a_ring(cell):
    """An angle as an option, and the axis along formulas: stiff along the hoop is radial turned by a right angle."""
    one = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0)
    mesh = rectangle(1.0, 0.6, 3, 2, cell)
    a, b = (shell(mesh, layup([Ply(one, 0.002, t)]), None, angle=u) for t, u in ((0.4, 0.0), (0.0, 0.4)))
    np.testing.assert_allclose(a.K.toarray(), b.K.toarray(), atol=1e-9 * abs(a.K).max())
    ring, hoop = annulus(1.0, 1.3, 2, 16, cell), layup([Ply(one, 0.002, np.pi / 2)])
    found = [
        build_structure(ring, [Member("surface", "shell", section, None, {"axis": axis})])
        for section, axis in ((hoop, ("x", "y", "0")), (layup([Ply(one, 0.002)]), ("-y", "x", "0")))
    ]
    np.testing.assert_allclose(found[0].K.toarray(), found[1].K.toarray(), atol=1e-9 * abs(found[0].K).max())
    straight = build_structure(ring, [Member("surface", "shell", hoop, None, {"axis": (1, 0, 0)})])
    assert abs(straight.K - found[0].K).max() > 0.1 * abs(found[0].K).max()


def test_a_polar_orthotropic_ring_pulled_outwards_moves_as_lekhnitskii_says():
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


def test_strain_points_have_the_stiffness_of_their_own_element():
    """Energy of a bent tapered strip over its strain points, against its stiffness matrix."""
    s = shell(rectangle(1.0, 0.1, 20, 1, "quad"), thickness="0.02 * (1 - 0.9 * x)")
    x = s.mesh.points[:, 0]
    bent = np.zeros((len(x), 3))
    bent[:, 2] = x**2
    turned = np.zeros((len(x), 3))
    turned[:, 1] = -2 * x
    u = s.translation.T @ bent.ravel() + s.rotation.T @ turned.ravel()
    (part,) = strain_field(s, u[:, None], False)
    energy = float(part.energy(np.ones((1, 1)))[0] @ part.weight)
    known = (
        2.0**2 / 2 * 70e9 * 0.1 / 12 * np.trapezoid((0.02 * (1 - 0.9 * np.linspace(0, 1, 20001))) ** 3, dx=1 / 20000)
    )
    assert energy == pytest.approx(known, rel=0.01) and float(u @ s.K @ u / 2) == pytest.approx(known, rel=0.01)
