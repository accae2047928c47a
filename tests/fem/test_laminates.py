"""Lay-ups and plate sections against integrals over their thickness, the stresses of bending, and invariants."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material
from femflex.fem.sections.laminates import Lamina, Ply, isotropic, layup, sandwich

METAL = Material(70e9, 0.3, 2700.0)


CARBON = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0, 5e9, 3e9)


def test_plain_sheet_has_the_textbook_stiffness():
    h = 0.004
    section = isotropic(h, METAL)
    plane = METAL.E / (1 - METAL.nu**2) * np.array([[1, 0.3, 0], [0.3, 1, 0], [0, 0, 0.35]])
    assert section.A == pytest.approx(plane * h, rel=1e-13)
    assert section.D == pytest.approx(plane * h**3 / 12, rel=1e-13)
    assert section.S == pytest.approx(5 / 6 * METAL.G * h * np.eye(2), rel=1e-13, abs=1e-6)
    assert (section.mass, section.rotary, section.thickness) == pytest.approx((10.8, 2700 * h**3 / 12, h))


def test_sandwich_bends_by_its_faces_and_shears_by_its_core():
    t, c, G = 2e-4, 0.02, (1e8, 4e7)
    section = sandwich(Ply(Lamina.isotropic(METAL), t), c, Lamina.core(48.0, *G))
    faces = METAL.E / (1 - METAL.nu**2) * ((c + 2 * t) ** 3 - c**3) / 12
    assert section.D[0, 0] == pytest.approx(faces, rel=1e-12)
    d = c + t
    assert np.diag(section.S) == pytest.approx([g * d**2 / c for g in G], rel=2 * (t / d) ** 2 + 1e-4)
    assert section.mass == pytest.approx(2 * t * 2700 + c * 48)
    assert section.rotary == pytest.approx(48 * c**3 / 12 + 2700 * ((c + 2 * t) ** 3 - c**3) / 12)
    assert section.thickness == pytest.approx(c + 2 * t)


def test_a_quasi_isotropic_lay_up_stretches_alike_in_all_directions():
    angles = np.deg2rad([0, 60, -60, -60, 60, 0])
    A = layup([Ply(CARBON, 1e-3, angle) for angle in angles]).A
    assert A[0, 0] == pytest.approx(A[1, 1], rel=1e-12)
    assert A[2, 2] == pytest.approx((A[0, 0] - A[0, 1]) / 2, rel=1e-12)
    assert abs(A[0, 2]) < 1e-9 * A[0, 0]


@pytest.mark.parametrize("angle", [0.5, -0.8, 2.0])
def test_a_skew_ply_answers_as_the_turned_tensor_of_its_own_axes(angle):
    """Stresses of single strains in x and y: strain into the axes of the fibres as a tensor, Hooke's law, and back."""
    along = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])  # rows: fibres, across them
    nu21 = CARBON.nu12 * CARBON.E2 / CARBON.E1
    for k, strain in enumerate([[[1, 0], [0, 0]], [[0, 0], [0, 1]], [[0, 0.5], [0.5, 0]]]):
        (e1, half), (_, e2) = along @ np.array(strain, float) @ along.T
        s1 = (CARBON.E1 * e1 + CARBON.nu12 * CARBON.E2 * e2) / (1 - CARBON.nu12 * nu21)
        s2 = (CARBON.nu12 * CARBON.E2 * e1 + CARBON.E2 * e2) / (1 - CARBON.nu12 * nu21)
        s12 = CARBON.G12 * 2 * half
        stress = along.T @ np.array([[s1, s12], [s12, s2]]) @ along
        found = CARBON.plane_stress(angle)[:, k]
        assert found == pytest.approx([stress[0, 0], stress[1, 1], stress[0, 1]], rel=1e-12)
    shear = along.T @ np.diag([CARBON.G13, CARBON.G23]) @ along
    assert CARBON.transverse_shear(angle) == pytest.approx(shear, rel=1e-12)
    section = layup([Ply(CARBON, 1e-3, angle)])
    assert section.A == pytest.approx(1e-3 * CARBON.plane_stress(angle), rel=1e-12)
    assert isotropic(1e-3, METAL).turned(angle).A == pytest.approx(isotropic(1e-3, METAL).A, rel=1e-9, abs=1e-3)
