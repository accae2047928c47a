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


def test_unknown_and_impossible_shapes_are_refused():
    with pytest.raises(ValueError, match=r"section type 'STAR' is not known; known are ROD, TUBE"):
        shape_of("STAR", [1.0])
    with pytest.raises(ValueError, match=r"section type BAR has 1 dimensions; it needs 2"):
        shape_of("BAR", [1.0])
    with pytest.raises(ValueError, match=r"section type TUBE with dimensions \[0.1, 0.2\] has no area"):
        shape_of("TUBE", [0.1, 0.2])
    assert len(SHAPES) == 20
