"""Sections and lay-ups against integrals over their own area or thickness, with generic numbers."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Orthotropic
from femflex.fem.sections import Box, Circle, FullSection, GivenSection, ISection, Rectangle, Tube
from femflex.fem.sections.laminates import Lamina, PlateSection, Ply, layup

AT = np.array([0.3, 1.1, 2.0])
MATERIAL = Material(70e9, 0.28, 2700.0, 31e9)


@pytest.mark.parametrize("section", [Rectangle(0.2, 0.5), Box(0.2, 0.5, 0.03), ISection(0.2, 0.5, 0.04, 0.03)])
def test_stress_at_the_extreme_fibres_of_oblong_sections(section):
    """1/A, y / int y^2, z / int z^2 by sums over a raster of cells; no shear stress of a torque."""
    y, z = (a.ravel() for a in np.meshgrid((np.arange(800) + 0.5) / 4000 - 0.1, (np.arange(1000) + 0.5) / 2000 - 0.25))
    inside = np.ones(y.shape, bool)
    if isinstance(section, Box):
        inside = (np.abs(y) > 0.07) | (np.abs(z) > 0.22)
    if isinstance(section, ISection):
        inside = (np.abs(y) < 0.015) | (np.abs(z) > 0.21)
    dA = 0.1 / 800_000
    A, yy, zz = (np.sum(f[inside]) * dA for f in (np.ones_like(y), y * y, z * z))
    found = section.fibres(AT, 1.0)
    assert found.shape == (3, 4) and np.isnan(found[:, 3]).all()
    assert found[:, :3] == pytest.approx(np.tile([1 / A, 0.1 / yy, 0.25 / zz], (3, 1)), rel=1e-5)


def test_stress_at_the_outside_of_round_sections():
    """Also of a torque: radius over polar moment."""
    for section, inner in ((Circle(0.3), 0.0), (Tube(0.3, 0.1), 0.2)):
        A, J = np.pi * (0.09 - inner**2), np.pi / 2 * (0.3**4 - inner**4)
        assert section.fibres(AT, 1.0) == pytest.approx(np.tile([1 / A, 0.6 / J, 0.6 / J, 0.3 / J], (3, 1)), rel=1e-12)
    tapered = Circle("0.3 - 0.1 * s / L").fibres(AT, 2.5)
    assert tapered[:, 0] == pytest.approx(1 / (np.pi * (0.3 - 0.04 * AT) ** 2))


def test_shear_stiffness_of_shapes_is_cowpers_or_that_of_their_walls():
    """k G A: Cowper's table (J. Appl. Mech. 33 (1966) 335) at nu = 0.3 to three figures, and thin walls by hand."""
    metal = Material(70e9, 0.3, 2700.0)
    for section, ky, kz in (
        (Rectangle(0.2, 0.5), 0.850, 0.850),
        (Circle(0.3), 0.886, 0.886),
        (Tube(0.3, 0.3 * (1 - 1e-9)), 0.886, 0.886),  # closed: the circle's
        (Tube(0.3, 0.0003), 0.531, 0.531),  # 2 (1 + nu) / (4 + 3 nu) of thin tubes
        (Tube(0.3, 0.15), 0.6993, 0.6993),  # half as wide inside: see below
    ):
        r = section.resultants(metal, AT, np.ones(3))
        A = r.EA / metal.E
        if isinstance(section, Tube) and section.thickness == 0.15:
            ky = kz = 6 * 1.3 * 1.25**2 / ((7 + 1.8) * 1.25**2 + (20 + 3.6) * 0.25)
        assert r.GAy / (metal.G * A) == pytest.approx(np.full(3, ky), rel=1.2e-3)
        assert r.GAz / (metal.G * A) == pytest.approx(np.full(3, kz), rel=1.2e-3)
    box = Box(0.2, 0.5, 0.03).resultants(MATERIAL, AT, np.ones(3))
    assert (box.GAy[0], box.GAz[0]) == pytest.approx((31e9 * 2 * 0.2 * 0.03, 31e9 * 2 * 0.5 * 0.03))
    beam = ISection(0.2, 0.5, 0.04, 0.03).resultants(MATERIAL, AT, np.ones(3))
    assert (beam.GAy[1], beam.GAz[1]) == pytest.approx((31e9 * 5 / 6 * 2 * 0.2 * 0.04, 31e9 * 0.5 * 0.03))
    given = GivenSection(0.1, 2e-3, 1e-3, 1e-4).resultants(MATERIAL, AT, np.ones(3))
    assert (given.GAy[2], given.GAz[2]) == pytest.approx((31e9 * 5 / 6 * 0.1, 31e9 * 5 / 6 * 0.1))


def points_of_mass():
    rng = np.random.default_rng(3)
    dm, y, z = rng.uniform(0.1, 1.0, 6), rng.normal(size=6), rng.normal(size=6)
    M = np.zeros((6, 6))
    for m, b, c in zip(dm, y, z, strict=True):
        rows = np.array([[1, 0, 0, 0, c, -b], [0, 1, 0, -c, 0, 0], [0, 0, 1, b, 0, 0]])  # v + omega x (0, y, z)
        M += m * rows.T @ rows
    return M, dm, y, z


def stiff() -> np.ndarray:
    rows = np.random.default_rng(9).normal(size=(9, 6)) * [1e3, 800.0, 700.0, 30.0, 20.0, 40.0]
    return rows.T @ rows


def test_a_full_section_reads_its_mass_as_that_of_points():
    M, dm, y, z = points_of_mass()
    K = stiff()
    r = FullSection(K, M).resultants(None, AT, np.ones(3))
    m, Y, Z = dm.sum(), dm @ y / dm.sum(), dm @ z / dm.sum()
    assert r.mass == pytest.approx(np.full(3, m))
    assert r.centre == pytest.approx(np.tile([Y, Z], (3, 1)))
    assert r.ry2 == pytest.approx(np.full(3, dm @ (z - Z) ** 2 / m))
    assert r.rz2 == pytest.approx(np.full(3, dm @ (y - Y) ** 2 / m))
    assert r.product == pytest.approx(np.full(3, dm @ ((y - Y) * (z - Z)) / m))
    assert r.coupled == pytest.approx(np.tile(K, (3, 1, 1)))
    names = ("EA", "GAy", "GAz", "GJ", "EIy", "EIz")
    assert [getattr(r, name)[1] for name in names] == pytest.approx(np.diag(K))
    assert r.polar2 == pytest.approx(np.full(3, (K[4, 4] + K[5, 5]) / K[0, 0]))
    plain, bar = (FullSection(K, M, radius).outline(AT, 1.0).points for radius in (None, 0.25))
    assert np.abs(plain[2]).max(axis=0) == pytest.approx(2 * np.sqrt([K[5, 5] / K[0, 0], K[4, 4] / K[0, 0]]))
    assert np.linalg.norm(bar, axis=2) == pytest.approx(np.full((3, 24), 0.25))


CARBON = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0, 5e9, 3e9)
FOAM = Lamina(2e8, 3e8, 4e7, 0.2, 90.0, 5e7, 2e7)
STACK = [Ply(CARBON, 1.1e-3, 0.3), Ply(FOAM, 4e-3, -0.8), Ply(CARBON, 0.7e-3, 1.2), Ply(FOAM, 2e-3, 0.1)]


def through_the_thickness(stack, shift=0.0, order=4):
    """A, B, D, mass and its first two moments of a stack by Gauss points in every ply, z from its middle + shift."""
    g, w = np.polynomial.legendre.leggauss(order)
    z0 = shift - sum(ply.thickness for ply in stack) / 2
    A, B, D = np.zeros((3, 3, 3))
    mass = np.zeros(3)
    for ply in stack:
        Q = ply.lamina.plane_stress(ply.angle)
        for at, weight in zip(z0 + ply.thickness * (g + 1) / 2, w * ply.thickness / 2, strict=True):
            A, B, D = A + weight * Q, B + weight * at * Q, D + weight * at**2 * Q
            mass = mass + weight * ply.lamina.density * np.array([1, at, at**2])
        z0 += ply.thickness
    return A, B, D, mass


def check(section: PlateSection, stack, shift=0.0):
    A, B, D, (m, first, second) = through_the_thickness(stack, shift)
    a, d = np.abs(A).max(), np.abs(D).max()
    for found, expected, size in ((section.A, A, a), (section.B, B, np.sqrt(a * d)), (section.D, D, d)):
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * size)
    assert (section.mass, section.centre) == pytest.approx((m, first / m), rel=1e-9)
    assert section.rotary == pytest.approx(second - first**2 / m, rel=1e-9)
    assert section.thickness == pytest.approx(sum(ply.thickness for ply in stack))


def test_an_unsymmetric_stack_is_its_integrals_over_the_thickness():
    check(layup(STACK, coupled=True), STACK)


def test_a_stack_moved_off_its_nodes_is_integrated_from_there():
    check(layup(STACK, coupled=True).shifted(0.013), STACK, 0.013)
    check(layup(STACK, coupled=True).shifted(0.02).shifted(-0.033), STACK, -0.013)


def test_a_stack_turned_in_its_plane_and_turned_over():
    turned = [Ply(ply.lamina, ply.thickness, ply.angle + 0.45) for ply in STACK]
    check(layup(STACK, coupled=True).turned(0.45), turned)
    over = [Ply(ply.lamina, ply.thickness, -ply.angle) for ply in STACK[::-1]]
    check(layup(STACK, coupled=True).turned_over(), over)
    found, expected = layup(STACK, coupled=True).turned_over().S, layup(over, coupled=True).S
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected.max())
    check(layup(STACK, coupled=True).shifted(0.01).turned_over(), over, -0.01)


def test_shear_stiffness_of_an_unsymmetric_stack_follows_from_the_stresses_of_bending():
    """Moments alone: strains and curvatures of no membrane force; tau by summing d(sigma)/dx from the lower face."""
    A, B, D, _ = through_the_thickness(STACK)
    edges = np.cumsum([0.0, *(ply.thickness for ply in STACK)])
    z = np.linspace(0, edges[-1], 20001)
    z, dz = (z[1:] + z[:-1]) / 2, np.diff(z)
    ply = np.clip(np.searchsorted(edges, z) - 1, 0, 3)
    Q = np.array([p.lamina.plane_stress(p.angle) for p in STACK])[ply]
    soft = np.array([np.linalg.inv(p.lamina.transverse_shear(p.angle)) for p in STACK])[ply]
    z = z - edges[-1] / 2
    flexible = np.linalg.inv(np.block([[A, B], [B, D]]))
    tau = []
    for moment, rows in (([1, 0, 0], [0, 2]), ([0, 1, 0], [2, 1])):
        strain, kappa = np.split(flexible @ np.concatenate([np.zeros(3), moment]), 2)
        change = np.einsum("pij,pj->pi", Q, strain + z[:, None] * kappa)[:, rows]
        tau.append(np.cumsum(change * dz[:, None], axis=0) - change * dz[:, None] / 2)
    flexibility = [[np.einsum("pa,pab,pb,p->", a, soft, b, dz) for b in tau] for a in tau]
    expected = np.linalg.inv(flexibility)
    assert layup(STACK, coupled=True).S == pytest.approx(expected, rel=2e-3, abs=2e-3 * expected.max())


def orthotropic(**values):
    given = dict(E1=1.4e11, E2=1e10, E3=8e9, G12=5e9, G13=4e9, G23=3e9, nu12=0.3, nu13=0.25, nu23=0.4, density=1600.0)
    return Orthotropic(**{**given, **values})


def test_an_orthotropic_solid_answers_single_stresses_with_its_constants():
    """Strains of a unit stress along each axis, by the definitions of Young's modulus and Poisson's ratio."""
    S = np.linalg.inv(orthotropic().elasticity())
    expected = np.zeros((6, 6))
    expected[:3, 0] = 1 / 1.4e11, -0.3 / 1.4e11, -0.25 / 1.4e11
    expected[:3, 1] = -0.3 / 1.4e11, 1 / 1e10, -0.4 / 1e10
    expected[:3, 2] = -0.25 / 1.4e11, -0.4 / 1e10, 1 / 8e9
    expected[3, 3], expected[4, 4], expected[5, 5] = 1 / 3e9, 1 / 4e9, 1 / 5e9  # 23, 13, 12
    np.testing.assert_allclose(S, expected, atol=1e-10 * expected.max())
