"""Plate sections against closed forms, invariants of lay-ups, and the sentences on impossible ones."""

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


def test_turning_a_section_is_turning_its_plies():
    plies = [Ply(CARBON, 1e-3, angle) for angle in (0.2, 1.1, 0.2)]
    turned = layup(plies).turned(0.7)
    again = layup([Ply(CARBON, 1e-3, ply.angle + 0.7) for ply in plies])
    for name in ("A", "D"):
        expected = getattr(again, name)
        assert getattr(turned, name) == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())
    along = layup([Ply(CARBON, 1e-3, angle) for angle in (0.0, np.pi / 2, 0.0)])
    across = layup([Ply(CARBON, 1e-3, angle) for angle in (np.pi / 2, 0.0, np.pi / 2)])
    assert along.turned(np.pi / 2).S == pytest.approx(across.S, rel=1e-9, abs=1e-3)
    sheet, angle = Lamina(1e10, 1e10, 3e9, 0.3, 1.0, 5e9, 2e9), 0.7
    expected = 5 / 6 * 1e-3 * sheet.transverse_shear(angle)
    assert layup([Ply(sheet, 1e-3)]).turned(angle).S == pytest.approx(expected, rel=1e-9)


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


def test_shear_stiffness_of_skew_plies_follows_from_the_stresses_of_bending():
    """As for the cross-ply, with both shear stresses: d(sigma)/dx + d(tau)/dz = 0 for forces along x, d/dy along y."""
    angles = [0.4, -0.9, 0.4]
    section = layup([Ply(CARBON, 1e-3, angle) for angle in angles])
    edges = np.linspace(-1.5e-3, 1.5e-3, 6001)
    z, dz = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
    ply = np.minimum(((z + 1.5e-3) / 1e-3).astype(int), 2)
    Q = np.array([CARBON.plane_stress(angle) for angle in angles])[ply]
    soft = np.array([np.linalg.inv(CARBON.transverse_shear(angle)) for angle in angles])[ply]
    D = np.einsum("p,pij->ij", z**2 * dz, Q)
    tau = []
    for moment, rows in (([1, 0, 0], [0, 2]), ([0, 1, 0], [2, 1])):  # sigma_xx, sigma_xy; then sigma_xy, sigma_yy
        change = (Q @ np.linalg.solve(D, moment))[:, rows] * z[:, None]
        tau.append(np.cumsum(change * dz[:, None], axis=0) - change * dz[:, None] / 2)
    flexibility = [[np.einsum("pa,pab,pb,p->", a, soft, b, dz) for b in tau] for a in tau]
    assert section.S == pytest.approx(np.linalg.inv(flexibility), rel=1e-4)
    assert abs(section.S[0, 1]) > 0.02 * section.S[0, 0]  # the two directions do act on each other
