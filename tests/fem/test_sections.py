"""Section properties against integrals over the outline, closed forms, and finite elements for torsion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve
from skfem import Basis, ElementQuad2, MeshQuad
from skfem.models.poisson import laplace, unit_load

from femflex.fem.sections import Box, Circle, GivenSection, ISection, Rectangle, Tube
from femflex.fem.sections.materials import Material
from femflex.fem.sections.section import Outline

STATION = np.zeros(1)
SHAPES = [
    Rectangle(0.2, 0.5),
    Box(0.2, 0.5, 0.03),
    Circle(0.3),
    Tube(0.3, 0.02),
    ISection(0.2, 0.5, 0.04, 0.03),
    GivenSection(0.1, 2e-3, 1e-3, 1e-4),
]


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


@pytest.mark.parametrize("section", [SHAPES[0], SHAPES[4]], ids=["rectangle", "I"])
def test_second_moments_are_integrals_over_the_drawn_outline(section):
    p = section.properties(STATION, 1.0)
    assert (p.A[0], p.Iy[0], p.Iz[0], 0, 0) == pytest.approx(
        area_moments(section.outline(STATION, 1.0)), rel=1e-13, abs=1e-16
    )


def test_hollow_sections_are_differences_of_solid_ones():
    box, outer, inner = (
        s.properties(STATION, 1.0) for s in (Box(0.2, 0.5, 0.03), Rectangle(0.2, 0.5), Rectangle(0.14, 0.44))
    )
    tube, disc, bore = (s.properties(STATION, 1.0) for s in (Tube(0.3, 0.02), Circle(0.3), Circle(0.28)))
    for name in ("A", "Iy", "Iz"):
        assert getattr(box, name) == pytest.approx(getattr(outer, name) - getattr(inner, name), rel=1e-13)
        assert getattr(tube, name) == pytest.approx(getattr(disc, name) - getattr(bore, name), rel=1e-13)
    assert tube.J == pytest.approx(disc.J - bore.J, rel=1e-13)
    assert disc.J == pytest.approx(np.pi / 2 * 0.3**4)


def test_a_thin_tube_does_not_lose_digits():
    p = Tube(1.0, 1e-9).properties(STATION, 1.0)
    assert p.A == pytest.approx(2 * np.pi * (1 - 0.5e-9) * 1e-9, rel=1e-7)  # R - r loses nine digits of sixteen
    assert p.Iy == pytest.approx(np.pi * 1e-9, rel=1e-7)


@pytest.mark.parametrize(
    ("ratio", "published"), [(1.0, 0.1406), (1.5, 0.196), (2.0, 0.229), (4.0, 0.281), (10.0, 0.312)]
)
def test_rectangle_torsion_is_timoshenkos_table(ratio, published):
    J = Rectangle(1.0, ratio).properties(STATION, 1.0).J[0] / ratio
    assert J == pytest.approx(published, abs=6e-4)


def test_rectangle_torsion_to_ten_digits():
    """The square's constant, and the strip's limit a b^3/3 (1 - 0.630249 b/a), where the series' rest is tiny."""
    assert Rectangle(1.0, 1.0).properties(STATION, 1.0).J[0] == pytest.approx(0.1405770149553, rel=1e-10)
    n = np.arange(1, 200001, 2.0)
    direct = 3 * (1 / 3 - 64 / np.pi**5 / 3 * (np.tanh(n * np.pi * 3 / 2) / n**5).sum())
    assert Rectangle(3.0, 1.0).properties(STATION, 1.0).J[0] == pytest.approx(direct, rel=1e-12)
    assert Rectangle(1.0, 1000.0).properties(STATION, 1.0).J[0] == pytest.approx(1000 / 3 * (1 - 0.630249e-3), rel=1e-9)


def test_rectangle_torsion_is_prandtls_stress_function():
    J = quarter_torsion((np.linspace(0, 1, 16), np.linspace(0, 1.5, 24)), lambda c: c[0] > -1)
    assert Rectangle(2.0, 3.0).properties(STATION, 1.0).J[0] == pytest.approx(J, rel=1e-6)


@pytest.mark.parametrize(("b", "h", "t"), [(2, 3, 0.1), (2, 2, 0.2), (1, 3, 0.1), (2, 2, 0.4)])
def test_box_torsion_is_prandtls_stress_function(b, h, t):
    y, z = b / 2 - t, h / 2 - t
    grids = graded((0, y, 20), (y, b / 2, 12)), graded((0, z, 20), (z, h / 2, 12))
    J = quarter_torsion(
        grids, lambda c: (c[0] > y) | (c[1] > z), lambda u, v: (u < y + 1e-9) & (v < z + 1e-9), 4 * y * z
    )
    assert Box(b, h, t).properties(STATION, 1.0).J[0] == pytest.approx(J, rel=3e-4)


@pytest.mark.parametrize(
    ("b", "h", "f", "w", "error"), [(1, 1.5, 0.1, 0.07, 0.01), (1, 2, 0.05, 0.1, 0.01), (1, 1, 0.1, 0.1, 0.02)]
)
def test_i_section_torsion_is_prandtls_stress_function(b, h, f, w, error):
    grids = graded((0, w / 2, 6), (w / 2, b / 2, 40)), graded((0, h / 2 - f, 40), (h / 2 - f, h / 2, 10))
    J = quarter_torsion(grids, lambda c: (c[0] < w / 2) | (c[1] > h / 2 - f))
    assert ISection(b, h, f, w).properties(STATION, 1.0).J[0] == pytest.approx(J, rel=error)


def test_torsion_of_stout_and_thick_i_sections_is_roarks_formula():
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


def test_resultants_are_moduli_times_properties():
    material = Material(70e9, 0.3, 2700.0)
    section = ISection(0.2, 0.5, 0.04, 0.03)
    p, r = section.properties(STATION, 1.0), section.resultants(material, STATION, STATION)
    stiffness = np.array([70e9 * p.A, 70e9 * p.Iy, 70e9 * p.Iz, material.G * p.J, 2700 * p.A])
    assert np.array([r.EA, r.EIy, r.EIz, r.GJ, r.mass]) == pytest.approx(stiffness, rel=1e-14)
    assert np.array([r.ry2, r.rz2, r.polar2]) == pytest.approx(np.array([p.Iy, p.Iz, p.polar]) / p.A, rel=1e-14)
