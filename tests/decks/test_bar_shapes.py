"""Shapes of PBARL: area and second moments against integrals over a raster of the shape itself."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.decks.nastran.bar_shapes import SHAPES, shape_of

N = 1200  # cells of the raster along each side
# Shape -> dimensions and whether a point (y, z) lies inside, as the figures of the manuals show them.
INSIDE = {
    "BAR": ([0.4, 1.0], lambda y, z: (abs(y) < 0.5) & (abs(z) < 0.2)),
    "BOX": ([0.6, 1.0, 0.1, 0.05], lambda y, z: (abs(y) < 0.5) & (abs(z) < 0.3) & ~((abs(y) < 0.4) & (abs(z) < 0.25))),
    "I": ([1.0, 0.8, 0.5, 0.1, 0.2, 0.15], lambda y, z: ((y < -0.3) & (y > -0.5) & (abs(z) < 0.4))
          | ((y > 0.35) & (y < 0.5) & (abs(z) < 0.25)) | ((abs(y) < 0.5) & (abs(z) < 0.05))),
    "T": ([0.8, 1.0, 0.2, 0.1], lambda y, z: ((y > 0.3) & (y < 0.5) & (abs(z) < 0.4))
          | ((y > -0.5) & (y < 0.5) & (abs(z) < 0.05))),
    "L": ([0.8, 1.0, 0.2, 0.1], lambda y, z: ((abs(y + 0.4) < 0.1) & (abs(z) < 0.4))
          | ((abs(y) < 0.5) & (z < -0.3) & (z > -0.4))),
    "CHAN": ([0.6, 1.0, 0.1, 0.2], lambda y, z: (abs(y) < 0.5) & (abs(z) < 0.3) & ~((abs(y) < 0.3) & (z > -0.2))),
    "Z": ([0.3, 0.1, 0.6, 1.0], lambda y, z: ((abs(y) < 0.5) & (abs(z) < 0.05))
          | ((y > 0.3) & (y < 0.5) & (z > 0) & (z < 0.35)) | ((y < -0.3) & (y > -0.5) & (z < 0) & (z > -0.35))),
    "ROD": ([0.5], lambda y, z: y**2 + z**2 < 0.25),
    "TUBE": ([0.5, 0.3], lambda y, z: (y**2 + z**2 < 0.25) & (y**2 + z**2 > 0.09)),
    "TUBE2": ([0.5, 0.2], lambda y, z: (y**2 + z**2 < 0.25) & (y**2 + z**2 > 0.09)),
    "BOX1": ([0.6, 1.0, 0.2, 0.1, 0.05, 0.15],
             lambda y, z: (abs(y) < 0.5) & (abs(z) < 0.3) & ~((y < 0.3) & (y > -0.4) & (z > -0.25) & (z < 0.15))),
    "I1": ([0.6, 0.1, 0.7, 1.0], lambda y, z: ((abs(y) > 0.35) & (abs(y) < 0.5) & (abs(z) < 0.35))
           | ((abs(y) < 0.5) & (abs(z) < 0.05))),
    "H": ([0.6, 0.3, 1.0, 0.2], lambda y, z: ((abs(y) < 0.5) & (abs(z) > 0.3) & (abs(z) < 0.45))
          | ((abs(y) < 0.1) & (abs(z) < 0.3))),
    "T1": ([1.0, 0.5, 0.2, 0.1], lambda y, z: ((abs(y) < 0.5) & (z > 0.4) & (z < 0.5))
           | ((abs(y) < 0.1) & (z > -0.1) & (z < 0.4))),
    "T2": ([0.8, 1.0, 0.2, 0.1], lambda y, z: ((y < -0.3) & (y > -0.5) & (abs(z) < 0.4))
           | ((abs(y) < 0.5) & (abs(z) < 0.05))),
    "CHAN1": ([0.4, 0.1, 0.6, 1.0], lambda y, z: (abs(y) < 0.5) & (abs(z) < 0.25) & ~((abs(y) < 0.3) & (z > -0.15))),
    "CHAN2": ([0.1, 0.2, 1.0, 0.6], lambda y, z: (abs(y) < 0.5) & (abs(z) < 0.3) & ~((y > -0.3) & (abs(z) < 0.2))),
    "CROSS": ([0.6, 0.2, 1.0, 0.1], lambda y, z: ((abs(y) < 0.5) & (abs(z) < 0.1))
              | ((abs(y) < 0.05) & (abs(z) < 0.4))),
    "HAT": ([0.8, 0.1, 0.4, 0.2], lambda y, z: ((y > 0.3) & (y < 0.4) & (abs(z) < 0.2))
            | ((abs(y) < 0.4) & (abs(z) > 0.1) & (abs(z) < 0.2))
            | ((y < -0.3) & (y > -0.4) & (abs(z) > 0.1) & (abs(z) < 0.4))),
    "HEXA": ([0.2, 0.8, 0.6], lambda y, z: (abs(y) < 0.3) & (abs(z) < 0.4 - 0.2 * abs(y) / 0.3)),
}  # fmt: skip


@pytest.mark.parametrize("kind", INSIDE)
def test_area_and_second_moments_are_the_integrals(kind):
    dim, inside = INSIDE[kind]
    at = (np.arange(N) + 0.5) / N * 1.2 - 0.6
    y, z = np.meshgrid(at, at, indexing="ij")
    dA = np.where(inside(y, z), (1.2 / N) ** 2, 0.0)
    A = dA.sum()
    y0, z0 = (dA * y).sum() / A, (dA * z).sum() / A
    wanted = [A, (dA * (y - y0) ** 2).sum(), (dA * (z - z0) ** 2).sum()]
    found = shape_of(kind, dim)
    assert [found.A, found.I1, found.I2] == pytest.approx(wanted, rel=0.01)
    assert found.I12 == pytest.approx((dA * (y - y0) * (z - z0)).sum(), abs=0.01 * wanted[1])


def test_torsion_of_round_and_closed_shapes():
    assert shape_of("TUBE", [0.5, 0.4]).J == pytest.approx(np.pi / 2 * (0.5**4 - 0.4**4))
    thin = shape_of("BOX", [1.0, 1.0, 0.001, 0.001])
    assert thin.J == pytest.approx(0.999**3 * 0.001)  # Bredt: 4 A^2 t / s = a^3 t


def test_every_shape_is_compared():
    assert set(INSIDE) == set(SHAPES)


@pytest.mark.parametrize(
    ("kind", "dim", "strips"),
    [
        ("I", [1.0, 0.8, 0.8, 0.02, 0.02, 0.02], [0.8, 0.98, 0.8]),
        ("I1", [0.78, 0.02, 0.96, 1.0], [0.8, 0.98, 0.8]),
        ("H", [0.76, 0.04, 1.0, 0.02], [1.0, 0.76, 1.0]),
        ("T", [0.8, 1.0, 0.02, 0.02], [0.8, 0.99]),
        ("T1", [0.8, 0.98, 0.02, 0.02], [0.8, 0.98]),
        ("T2", [0.8, 1.0, 0.02, 0.02], [0.8, 0.99]),
        ("CHAN", [0.5, 1.0, 0.02, 0.02], [0.49, 0.98, 0.49]),
        ("CHAN1", [0.48, 0.02, 0.96, 1.0], [0.49, 0.98, 0.49]),
        ("CHAN2", [0.02, 0.02, 0.5, 1.0], [0.49, 0.98, 0.49]),
        ("Z", [0.48, 0.02, 0.96, 1.0], [0.49, 0.98, 0.49]),
        ("L", [0.5, 1.0, 0.02, 0.02], [0.49, 0.99]),
        ("CROSS", [0.48, 0.02, 1.0, 0.02], [1.0, 0.48]),
        ("HAT", [0.8, 0.02, 0.4, 0.2], [0.4, 0.76, 0.76, 0.2, 0.2]),
    ],
)
def test_thin_open_shapes_twist_as_their_strips(kind, dim, strips):
    """J = sum b t^3 / 3 along the middle lines."""
    assert shape_of(kind, dim).J == pytest.approx(sum(strips) * 0.02**3 / 3, rel=0.02)


@pytest.mark.parametrize(
    ("kind", "dim", "strips"),
    [  # length and thickness of each wall along its middle line
        ("I", [1.0, 0.8, 0.6, 0.016, 0.02, 0.03], [(0.8, 0.02), (0.6, 0.03), (0.975, 0.016)]),
        ("I1", [0.77, 0.03, 0.96, 1.0], [(0.8, 0.02), (0.8, 0.02), (0.98, 0.03)]),
        ("H", [0.76, 0.04, 1.0, 0.03], [(1.0, 0.02), (1.0, 0.02), (0.76, 0.03)]),
        ("T", [0.8, 1.0, 0.02, 0.03], [(0.8, 0.02), (0.99, 0.03)]),
        ("T1", [0.8, 0.97, 0.02, 0.03], [(0.8, 0.03), (0.97, 0.02)]),
        ("T2", [0.8, 1.0, 0.02, 0.03], [(0.8, 0.02), (0.99, 0.03)]),
        ("CHAN", [0.5, 1.0, 0.03, 0.02], [(0.485, 0.02), (0.485, 0.02), (0.98, 0.03)]),
        ("CHAN1", [0.47, 0.03, 0.96, 1.0], [(0.485, 0.02), (0.485, 0.02), (0.98, 0.03)]),
        ("CHAN2", [0.02, 0.03, 0.5, 1.0], [(0.485, 0.02), (0.485, 0.02), (0.98, 0.03)]),
        ("Z", [0.47, 0.03, 0.96, 1.0], [(0.485, 0.02), (0.485, 0.02), (0.98, 0.03)]),
        ("L", [0.5, 1.0, 0.02, 0.03], [(0.485, 0.02), (0.99, 0.03)]),
        ("CROSS", [0.47, 0.03, 1.0, 0.02], [(1.0, 0.03), (0.47, 0.02)]),
    ],
)
def test_walls_of_their_own_thickness_each_add_their_torsion(kind, dim, strips):
    assert shape_of(kind, dim).J == pytest.approx(sum(b * t**3 for b, t in strips) / 3, rel=5e-3)


@pytest.mark.parametrize(
    ("kind", "dim", "upright", "across"),
    [  # area of the walls along y and along z that carry shear, from one outer face to the other; 5/6 where they bend
        ("BAR", [0.4, 1.0], 5 / 6 * 0.4, 5 / 6 * 0.4),
        ("BOX", [0.6, 1.0, 0.02, 0.03], 2 * 0.03, 2 * 0.02 * 0.6),
        ("BOX1", [0.6, 1.0, 0.01, 0.02, 0.03, 0.04], 0.03 + 0.04, (0.01 + 0.02) * 0.6),
        ("I", [1.0, 0.8, 0.6, 0.016, 0.02, 0.03], 0.016, 5 / 6 * (0.8 * 0.02 + 0.6 * 0.03)),
        ("H", [0.76, 0.04, 1.0, 0.03], 5 / 6 * 0.04, 0.03 * 0.8),
        ("T", [0.8, 1.0, 0.02, 0.03], 0.03, 5 / 6 * 0.8 * 0.02),
        ("T1", [0.8, 0.97, 0.02, 0.03], 5 / 6 * 0.8 * 0.03, 0.02 * 0.97),
        ("T2", [0.8, 1.0, 0.02, 0.03], 0.03, 5 / 6 * 0.8 * 0.02),
        ("CHAN", [0.5, 1.0, 0.03, 0.02], 0.03, 5 / 6 * 2 * 0.5 * 0.02),
        ("CHAN2", [0.02, 0.03, 0.5, 1.0], 5 / 6 * 2 * 0.5 * 0.02, 0.03),
        ("Z", [0.47, 0.03, 0.96, 1.0], 0.03, 5 / 6 * 2 * 0.47 * 0.02),
        ("L", [0.5, 1.0, 0.02, 0.03], 5 / 6 * 0.03, 5 / 6 * 0.02 * 0.5),
        ("CROSS", [0.47, 0.03, 1.0, 0.02], 5 / 6 * 0.03, 5 / 6 * 0.02 * 0.5),
        ("HAT", [0.8, 0.02, 0.4, 0.2], 2 * 0.8 * 0.02, 5 / 6 * (0.4 + 2 * 0.2) * 0.02),
    ],
)
def test_the_walls_along_a_direction_carry_its_shear(kind, dim, upright, across):
    made = shape_of(kind, dim)
    assert [made.K1 * made.A, made.K2 * made.A] == pytest.approx([upright, across], rel=1e-9)


def test_thin_walled_tubes_of_four_thicknesses_twist_as_bredt_says():
    a, b = 0.6 - 0.02, 1.0 - 0.02
    J = shape_of("BOX1", [0.6, 1.0, 0.01, 0.03, 0.02, 0.02]).J
    assert J == pytest.approx(4 * (a * b) ** 2 / (a / 0.01 + a / 0.03 + 2 * b / 0.02), rel=1e-6)


def test_shear_centres_of_thin_shapes_lie_where_their_flows_meet():
    """T and L: where the legs meet; channel: e = 3 b^2 / (h + 6 b) from the web, on the side without flanges."""
    t = 1e-4
    for kind, along, sign in (("T", 0, 1.0), ("T1", 1, 1.0), ("T2", 0, -1.0)):
        dim = [1.0, 1.0 - t, t, t] if kind == "T1" else [1.0, 1.0, t, t]
        centre = shape_of(kind, dim).shear_centre
        assert centre[along] == pytest.approx(sign * 0.25, rel=2e-3) and centre[1 - along] == 0.0
    for kind, dim, along in (
        ("CHAN", [0.5, 1.0, t, t], 1),
        ("CHAN1", [0.5 - t, t, 1.0 - 2 * t, 1.0], 1),
        ("CHAN2", [t, t, 0.5, 1.0], 0),
    ):
        e, centroid = 3 * 0.25 / (1.0 + 3.0), 0.5**2 / 2.0
        centre = shape_of(kind, dim).shear_centre
        assert centre[along] == pytest.approx(-(e + centroid), rel=2e-3) and centre[1 - along] == 0.0
    assert shape_of("L", [0.5, 1.0, t, t]).shear_centre == pytest.approx((-1.0 / 3, -0.25 / 3), rel=2e-3)
    unequal = shape_of("I", [1.0, 0.8, 0.4, t, t, t])  # closer to the wider flange, by their second moments
    centroid = (0.4 - 0.8) * 0.5 / 2.2
    assert unequal.shear_centre[0] == pytest.approx(-0.5 + 0.4**3 / (0.4**3 + 0.8**3) - centroid, rel=2e-3)


def test_round_shapes_shear_as_their_areas_let_them():
    """Shear factors of Nastran's manual: 0.9 of a solid circle, 0.5 of a thin tube."""
    for kind, dim, factor in (("ROD", [0.5], 0.9), ("TUBE", [0.5, 0.0], 0.9), ("TUBE", [0.5, 0.49], 0.5)):
        made = shape_of(kind, dim)
        assert made.K1 == made.K2 == factor and made.J == pytest.approx(2 * made.I1)


def test_unknown_and_impossible_shapes_are_refused():
    with pytest.raises(ValueError, match=r"section type 'STAR' is not known; known are ROD, TUBE"):
        shape_of("STAR", [1.0])
    with pytest.raises(ValueError, match=r"section type BAR has 1 dimensions; it needs 2"):
        shape_of("BAR", [1.0])
    with pytest.raises(ValueError, match=r"section type TUBE with dimensions \[0.1, 0.2\] has no area"):
        shape_of("TUBE", [0.1, 0.2])
    assert len(SHAPES) == 20
