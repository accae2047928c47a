"""Beam sections against integrals over the outline, published constants, and finite elements for torsion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve
from skfem import Basis, ElementQuad2, MeshQuad
from skfem.models.poisson import laplace, unit_load

from femflex.fem import Material
from femflex.fem.sections import Box, Circle, FullSection, GivenSection, ISection, Rectangle, Tube
from femflex.fem.sections.section import Outline

STATION = np.zeros(1)


SHAPES = (Rectangle(0.2, 0.5), ISection(0.2, 0.5, 0.04, 0.03))


def area_moments(outline: Outline) -> tuple[float, float, float, float, float]:
    """A, int z^2, int y^2, int y, int z of the filled outline by exact three-point quadrature on its triangles."""
    corners = outline.points[0][outline.triangles]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    assert (area > 0).all()  # counterclockwise
    middle = (corners + np.roll(corners, 1, axis=1)) / 2
    y, z = (np.einsum("t,tk->", area / 3, middle[..., i]) for i in (0, 1))
    yy, zz = (np.einsum("t,tk->", area / 3, middle[..., i] ** 2) for i in (0, 1))
    return area.sum(), zz, yy, y, z


def quarter_torsion(grids, inside, hole=None, hole_area=0.0) -> float:
    """J of a doubly symmetric section from Prandtl's stress function on its quarter y, z > 0 (biquadratic elements).

    -laplace phi = 2, phi = 0 on the outline, phi constant round a hole: J = 2 int phi + 2 phi_hole A_hole.
    """
    mesh = MeshQuad.init_tensor(*grids)
    mesh = mesh.remove_elements(np.flatnonzero(~inside(mesh.p[:, mesh.t].mean(1))))
    basis = Basis(mesh, ElementQuad2())
    stiffness, load = laplace.assemble(basis), 2 * unit_load.assemble(basis)
    facets = mesh.boundary_facets()
    y, z = mesh.p[:, mesh.facets[:, facets]].mean(1)
    cut = (y > 1e-14) & (z > 1e-14)  # the rest are lines of symmetry
    on_hole = cut & hole(y, z) if hole else np.zeros_like(cut)
    outer = basis.get_dofs(facets[cut & ~on_hole]).all()
    tied = basis.get_dofs(facets[on_hole]).all() if hole else np.zeros(0, int)
    free = np.setdiff1d(np.arange(len(load)), [*outer, *tied])
    rows = np.concatenate([free, tied])
    cols = np.concatenate([np.arange(len(free)), np.full(len(tied), len(free))])
    size = len(free) + bool(hole)
    T = sparse.csr_array((np.ones(len(rows)), (rows, cols)), shape=(len(load), size))
    reduced = T.T @ load
    if hole:
        reduced[-1] += 2 * hole_area / 4
    return 4 * reduced @ spsolve((T.T @ stiffness @ T).tocsc(), reduced)


def graded(*pieces: tuple[float, float, int]) -> np.ndarray:
    return np.unique(np.concatenate([np.linspace(a, b, n + 1) for a, b, n in pieces]))


@pytest.mark.parametrize("section", SHAPES, ids=["rectangle", "I"])
def test_second_moments_equal_outline_integrals(section):
    p = section.properties(STATION, 1.0)
    assert (p.A[0], p.Iy[0], p.Iz[0], 0, 0) == pytest.approx(
        area_moments(section.outline(STATION, 1.0)), rel=1e-13, abs=1e-16
    )


def test_hollow_sections_equal_differences_of_solid_ones():
    box, outer, inner = (
        s.properties(STATION, 1.0) for s in (Box(0.2, 0.5, 0.03), Rectangle(0.2, 0.5), Rectangle(0.14, 0.44))
    )
    tube, disc, bore = (s.properties(STATION, 1.0) for s in (Tube(0.3, 0.02), Circle(0.3), Circle(0.28)))
    for name in ("A", "Iy", "Iz"):
        assert getattr(box, name) == pytest.approx(getattr(outer, name) - getattr(inner, name), rel=1e-13)
        assert getattr(tube, name) == pytest.approx(getattr(disc, name) - getattr(bore, name), rel=1e-13)
    assert tube.J == pytest.approx(disc.J - bore.J, rel=1e-13)
    assert disc.J == pytest.approx(np.pi / 2 * 0.3**4)


def test_rectangle_torsion_to_ten_digits():
    """The square's constant, and the strip's limit a b^3/3 (1 - 0.630249 b/a), where the series' rest is tiny."""
    assert Rectangle(1.0, 1.0).properties(STATION, 1.0).J[0] == pytest.approx(0.1405770149553, rel=1e-10)
    n = np.arange(1, 200001, 2.0)
    direct = 3 * (1 / 3 - 64 / np.pi**5 / 3 * (np.tanh(n * np.pi * 3 / 2) / n**5).sum())
    assert Rectangle(3.0, 1.0).properties(STATION, 1.0).J[0] == pytest.approx(direct, rel=1e-12)
    assert Rectangle(1.0, 1000.0).properties(STATION, 1.0).J[0] == pytest.approx(1000 / 3 * (1 - 0.630249e-3), rel=1e-9)


@pytest.mark.parametrize(("b", "h", "t"), [(2, 3, 0.1), (2, 2, 0.2), (1, 3, 0.1), (2, 2, 0.4)])
def test_box_torsion_matches_prandtl(b, h, t):
    y, z = b / 2 - t, h / 2 - t
    grids = graded((0, y, 20), (y, b / 2, 12)), graded((0, z, 20), (z, h / 2, 12))
    J = quarter_torsion(
        grids, lambda c: (c[0] > y) | (c[1] > z), lambda u, v: (u < y + 1e-9) & (v < z + 1e-9), 4 * y * z
    )
    assert Box(b, h, t).properties(STATION, 1.0).J[0] == pytest.approx(J, rel=3e-4)


@pytest.mark.parametrize(
    ("b", "h", "f", "w", "error"), [(1, 1.5, 0.1, 0.07, 0.01), (1, 2, 0.05, 0.1, 0.01), (1, 1, 0.1, 0.1, 0.02)]
)
def test_i_section_torsion_matches_prandtl(b, h, f, w, error):
    grids = graded((0, w / 2, 6), (w / 2, b / 2, 40)), graded((0, h / 2 - f, 40), (h / 2 - f, h / 2, 10))
    J = quarter_torsion(grids, lambda c: (c[0] < w / 2) | (c[1] > h / 2 - f))
    assert ISection(b, h, f, w).properties(STATION, 1.0).J[0] == pytest.approx(J, rel=error)


def test_torsion_of_thick_i_sections_matches_roark():
    """Formulas for Stress and Strain, torsional constants: K = 2 K_1 + K_2 + 2 alpha D^4, by its letters."""
    for b, h, f, w in ((0.1, 0.3, 0.06, 0.05), (0.2, 0.3, 0.03, 0.05), (0.2, 0.5, 0.04, 0.03)):
        a, b_half, c, d = b, f, (h - 2 * f) / 2, w  # flange a x b, web 2 c x d
        K1 = a * b_half**3 * (1 / 3 - 0.21 * b_half / a * (1 - b_half**4 / (12 * a**4)))
        K2 = 2 / 3 * c * d**3
        t, t1 = min(b_half, d), max(b_half, d)
        D = (b_half**2 + d**2 / 4) / b_half  # inscribed circle, fillet radius 0
        expected = 2 * K1 + K2 + 2 * 0.15 * t / t1 * D**4
        assert ISection(b, h, f, w).properties(STATION, 1.0).J[0] == pytest.approx(expected, rel=1e-12)


def test_dimensions_vary_along_the_member():
    s = np.linspace(0, 5, 11)
    taper = Tube("0.2 - 0.02*s", ([0.0, 5.0], [0.01, 0.005]))
    assert taper.varies
    p = taper.properties(s, 5.0)
    for i in range(11):
        here = Tube(0.2 - 0.02 * s[i], 0.01 - 0.001 * s[i]).properties(STATION, 1.0)
        assert (p.A[i], p.Iy[i], p.J[i]) == pytest.approx((here.A[0], here.Iy[0], here.J[0]), rel=1e-13)
    assert not Tube(0.2, 0.01).varies


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
    computed = section.fibres(AT, 1.0)
    assert computed.shape == (3, 4) and np.isnan(computed[:, 3]).all()
    assert computed[:, :3] == pytest.approx(np.tile([1 / A, 0.1 / yy, 0.25 / zz], (3, 1)), rel=1e-5)


def test_stress_at_the_outside_of_round_sections():
    """Also of a torque: radius over polar moment."""
    for section, inner in ((Circle(0.3), 0.0), (Tube(0.3, 0.1), 0.2)):
        A, J = np.pi * (0.09 - inner**2), np.pi / 2 * (0.3**4 - inner**4)
        assert section.fibres(AT, 1.0) == pytest.approx(np.tile([1 / A, 0.6 / J, 0.6 / J, 0.3 / J], (3, 1)), rel=1e-12)
    tapered = Circle("0.3 - 0.1 * s / L").fibres(AT, 2.5)
    assert tapered[:, 0] == pytest.approx(1 / (np.pi * (0.3 - 0.04 * AT) ** 2))


def test_shear_stiffness_of_shapes():
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


def test_mass_matrix_of_full_section():
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
