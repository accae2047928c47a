"""Lay-ups and plate sections against integrals over their thickness, the stresses of bending, and invariants."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material
from femflex.fem.sections.laminates import Lamina, PlateSection, Ply, isotropic, layup, sandwich

METAL = Material(70e9, 0.3, 2700.0)


CARBON = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0, 5e9, 3e9)


def test_plain_sheet_stiffness():
    h = 0.004
    section = isotropic(h, METAL)
    plane = METAL.E / (1 - METAL.nu**2) * np.array([[1, 0.3, 0], [0.3, 1, 0], [0, 0, 0.35]])
    assert section.A == pytest.approx(plane * h, rel=1e-13)
    assert section.D == pytest.approx(plane * h**3 / 12, rel=1e-13)
    assert section.S == pytest.approx(5 / 6 * METAL.G * h * np.eye(2), rel=1e-13, abs=1e-6)
    assert (section.mass, section.rotary, section.thickness) == pytest.approx((10.8, 2700 * h**3 / 12, h))


def test_sandwich_stiffness():
    t, c, G = 2e-4, 0.02, (1e8, 4e7)
    section = sandwich(Ply(Lamina.isotropic(METAL), t), c, Lamina.core(48.0, *G))
    faces = METAL.E / (1 - METAL.nu**2) * ((c + 2 * t) ** 3 - c**3) / 12
    assert section.D[0, 0] == pytest.approx(faces, rel=1e-12)
    d = c + t
    assert np.diag(section.S) == pytest.approx([g * d**2 / c for g in G], rel=2 * (t / d) ** 2 + 1e-4)
    assert section.mass == pytest.approx(2 * t * 2700 + c * 48)
    assert section.rotary == pytest.approx(48 * c**3 / 12 + 2700 * ((c + 2 * t) ** 3 - c**3) / 12)
    assert section.thickness == pytest.approx(c + 2 * t)


@pytest.mark.parametrize("angle", [0.5, -0.8, 2.0])
def test_skew_ply_equals_rotated_tensor(angle):
    """Stresses of single strains in x and y: strain into the axes of the fibres as a tensor, Hooke's law, and back."""
    along = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])  # rows: fibres, across them
    nu21 = CARBON.nu12 * CARBON.E2 / CARBON.E1
    for k, strain in enumerate([[[1, 0], [0, 0]], [[0, 0], [0, 1]], [[0, 0.5], [0.5, 0]]]):
        (e1, half), (_, e2) = along @ np.array(strain, float) @ along.T
        s1 = (CARBON.E1 * e1 + CARBON.nu12 * CARBON.E2 * e2) / (1 - CARBON.nu12 * nu21)
        s2 = (CARBON.nu12 * CARBON.E2 * e1 + CARBON.E2 * e2) / (1 - CARBON.nu12 * nu21)
        s12 = CARBON.G12 * 2 * half
        stress = along.T @ np.array([[s1, s12], [s12, s2]]) @ along
        computed = CARBON.plane_stress(angle)[:, k]
        assert computed == pytest.approx([stress[0, 0], stress[1, 1], stress[0, 1]], rel=1e-12)
    shear = along.T @ np.diag([CARBON.G13, CARBON.G23]) @ along
    assert CARBON.transverse_shear(angle) == pytest.approx(shear, rel=1e-12)
    section = layup([Ply(CARBON, 1e-3, angle)])
    assert section.A == pytest.approx(1e-3 * CARBON.plane_stress(angle), rel=1e-12)
    assert isotropic(1e-3, METAL).rotated(angle).A == pytest.approx(isotropic(1e-3, METAL).A, rel=1e-9, abs=1e-3)


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
    for computed, expected, size in ((section.A, A, a), (section.B, B, np.sqrt(a * d)), (section.D, D, d)):
        assert computed == pytest.approx(expected, rel=1e-9, abs=1e-9 * size)
    assert (section.mass, section.centre) == pytest.approx((m, first / m), rel=1e-9)
    assert section.rotary == pytest.approx(second - first**2 / m, rel=1e-9)
    assert section.thickness == pytest.approx(sum(ply.thickness for ply in stack))


def test_unsymmetric_stack_equals_thickness_integrals():
    check(layup(STACK, coupled=True), STACK)


def test_shifted_stack():
    check(layup(STACK, coupled=True).shifted(0.013), STACK, 0.013)
    check(layup(STACK, coupled=True).shifted(0.02).shifted(-0.033), STACK, -0.013)


def test_rotated_and_inverted_stack():
    turned = [Ply(ply.lamina, ply.thickness, ply.angle + 0.45) for ply in STACK]
    check(layup(STACK, coupled=True).rotated(0.45), turned)
    over = [Ply(ply.lamina, ply.thickness, -ply.angle) for ply in STACK[::-1]]
    check(layup(STACK, coupled=True).turned_over(), over)
    computed, expected = layup(STACK, coupled=True).turned_over().S, layup(over, coupled=True).S
    assert computed == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected.max())
    check(layup(STACK, coupled=True).shifted(0.01).turned_over(), over, -0.01)


def test_shear_stiffness_of_unsymmetric_stack():
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
