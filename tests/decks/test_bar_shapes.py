"""Sections of bars: shapes of PBARL by integrals over a raster and by walls; beams of skew sections."""

from __future__ import annotations

from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest
from support.nastran_decks import STEEL, frequencies, read_deck_of_cards

from femflex.decks.nastran.bar_properties import bar_shape

N = 600  # cells of the raster along each side
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
def test_area_and_second_moments_by_integration(kind):
    dim, inside = INSIDE[kind]
    at = (np.arange(N) + 0.5) / N * 1.2 - 0.6
    y, z = np.meshgrid(at, at, indexing="ij")
    dA = np.where(inside(y, z), (1.2 / N) ** 2, 0.0)
    A = dA.sum()
    y0, z0 = (dA * y).sum() / A, (dA * z).sum() / A
    expected = [A, (dA * (y - y0) ** 2).sum(), (dA * (z - z0) ** 2).sum()]
    computed = bar_shape(kind, dim)
    assert [computed.A, computed.Iz, computed.Iy] == pytest.approx(expected, rel=0.01)
    assert computed.Iyz == pytest.approx((dA * (y - y0) * (z - z0)).sum(), abs=0.01 * expected[1])


def test_torsion_of_round_and_closed_shapes():
    assert bar_shape("TUBE", [0.5, 0.4]).J == pytest.approx(np.pi / 2 * (0.5**4 - 0.4**4))
    thin = bar_shape("BOX", [1.0, 1.0, 0.001, 0.001])
    assert thin.J == pytest.approx(0.999**3 * 0.001)  # Bredt: 4 A^2 t / s = a^3 t


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
def test_torsion_of_open_shapes_by_walls(kind, dim, strips):
    assert bar_shape(kind, dim).J == pytest.approx(sum(b * t**3 for b, t in strips) / 3, rel=5e-3)


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
def test_shear_areas_by_walls(kind, dim, upright, across):
    shape = bar_shape(kind, dim)
    assert [shape.ky * shape.A, shape.kz * shape.A] == pytest.approx([upright, across], rel=1e-9)


NORMAL, ACROSS, TURNED = 8e-7, 3e-7, radians(25.0)  # principal moments [m^4], and the angle to the first axis


def beam(folder: Path, *, turned: float, moments: tuple[float, float, float], more: str, n: int = 4) -> np.ndarray:
    """Frequencies of a cantilever of CBEAM along x whose section's y axis is turned about x from the basic y axis."""
    y = f"0.,{cos(turned):.14f},{sin(turned):.14f}"
    I1, I2, I12 = moments
    cards = [f"GRID,{k + 1},,{0.25 * k},0.,0." for k in range(n + 1)]
    cards += [f"CBEAM,{k + 1},3,{k + 1},{k + 2},{y}" for k in range(n)]
    cards += [f"PBEAM,3,1,1.E-3,{I1:.14E},{I2:.14E},{I12:.14E},9.E-7,6.", ",,,,,,,,", more, STEEL, "SPC1,1,123456,1"]
    return frequencies(read_deck_of_cards(folder, *cards), 6)


def places(y: float, z: float, turned: float) -> tuple[float, float]:
    """Components of a point of the section along axes that are turned by an angle."""
    return cos(turned) * y + sin(turned) * z, cos(turned) * z - sin(turned) * y


@pytest.mark.parametrize(("mass", "centroid"), [((0.03, -0.01), (0.0, 0.0)), ((0.0, 0.0), (0.02, 0.012))])
def test_skew_section_equals_one_along_principal_axes(tmp_path: Path, mass, centroid):
    """Nonstructural mass or neutral axis off the shear centre, as components along the element's axes."""
    mean, half = (NORMAL + ACROSS) / 2, (NORMAL - ACROSS) / 2
    skew = (mean + half * cos(2 * TURNED), mean - half * cos(2 * TURNED), half * sin(2 * TURNED))

    def places_of(turned: float) -> str:
        m, c = places(*mass, turned), places(*centroid, turned)
        return f",0.5,0.5,,,,,,,{m[0]:.12f},{m[1]:.12f},,,{c[0]:.12f},{c[1]:.12f}"

    def lines(turned: float) -> str:
        words = places_of(turned).split(",")[1:]
        return "," + ",".join(words[:8]) + "\n," + ",".join(words[8:])

    given = beam(tmp_path, turned=0.0, moments=skew, more=lines(0.0))
    principal = beam(tmp_path, turned=TURNED, moments=(NORMAL, ACROSS, 0.0), more=lines(TURNED))
    assert given == pytest.approx(principal, rel=1e-8)
    plain = beam(tmp_path, turned=0.0, moments=skew, more=",0.5,0.5")
    assert abs(given / plain - 1).max() > 1e-3
