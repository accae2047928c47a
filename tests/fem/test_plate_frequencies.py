"""Plates against closed forms and published values: frequencies, energies of uniform states, orthotropic sections."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.linalg import eigh
from scipy.sparse.linalg import spsolve
from support.closed_forms import mindlin
from support.plate_models import (
    CELL,
    METAL,
    flexural_rigidity,
    frequencies,
    plate_structure,
    random_rotation,
    simply_supported,
    supported_square,
)

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections.laminates import Lamina, Ply, orthotropic, sandwich
from femflex.mesh import rectangle

SUPPORTED = np.pi**2 * np.array([2.0, 5.0, 5.0, 8.0])


# Cantilever square plate, nu = 0.3: plate_bfs on 16, 32 and 64 squares a side, extrapolated with the orders observed,
# 1.7 to 2.3 (the corners of the clamp are singular). Leissa (1973) prints upper bounds 3.4917, 8.5246, 21.429.
CANTILEVER = np.array([3.4710, 8.5062, 21.2839])


def mindlin_supported(h: float) -> float:
    """First frequency omega of a simply supported unit square of METAL with shear factor 5/6 (Mindlin 1951)."""
    return 2 * np.pi * mindlin(1, 1, 1.0, h, METAL.E, METAL.nu, METAL.density)


@pytest.mark.slow
def test_triangles_at_advised_size():
    """26 sides to the half wave of the highest mode wanted: 5e-4 on the first three distinct frequencies."""
    assert supported_square("plate", 1e-4, 52) == pytest.approx(SUPPORTED, rel=5e-4)


@pytest.mark.parametrize(("family", "n"), [("plate", 16), ("plate_bfs", 8)])
def test_square_cantilever_plate(family, n):
    h = 1e-3
    structure = plate_structure(rectangle(1.0, 1.0, n, n, CELL[family]), h, family)
    scale = np.sqrt(METAL.density * h / flexural_rigidity(h))
    computed = frequencies(structure, structure.clamped_dofs("left"), 3) * scale
    assert computed == pytest.approx(CANTILEVER, rel=5e-4)
    assert (computed < [3.4917, 8.5246, 21.429]).all()


def free_square_by_ritz(n, nu=0.3):
    """omega a^2 sqrt(rho h/D) of a thin free square plate, from products of n Legendre polynomials each way."""
    x, weight = legendre.leggauss(n + 4)
    p = [np.stack([legendre.legval(x, legendre.legder(np.eye(n)[k], d)) for k in range(n)]) for d in range(3)]

    def product(a, b):
        return (p[a] * weight) @ p[b].T

    M = np.kron(product(0, 0), product(0, 0))
    mixed = np.kron(product(2, 0), product(0, 2))
    K = np.kron(product(2, 2), product(0, 0)) + np.kron(product(0, 0), product(2, 2)) + nu * (mixed + mixed.T)
    K += 2 * (1 - nu) * np.kron(product(1, 1), product(1, 1))
    return 4 * np.sqrt(eigh(K, M, eigvals_only=True)[3:])  # on a square of side 2


def test_free_square_plate_matches_ritz():
    ritz, h = free_square_by_ritz(16)[:6], 1e-4
    assert ritz == pytest.approx([13.468, 19.596, 24.270, 34.801, 34.801, 61.093], abs=6e-4)  # Leissa & Narita 1984
    scale, errors = np.sqrt(METAL.density * h / flexural_rigidity(h)), []
    for n in (10, 20):
        structure = plate_structure(rectangle(1.0, 1.0, n, n, "quad"), h, "plate_bfs")
        errors.append(frequencies(structure, np.zeros(0, int), 12, shift=-1.0)[6:] * scale / ritz - 1)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.2)
    assert np.abs(errors[1]).max() < 2e-5


@pytest.mark.parametrize(("family", "n"), [("plate", 24), ("plate_bfs", 10)])
def test_nafems_free_plate(family, n):
    """NAFEMS R0015, FV12 prints 1.622, 2.360, 2.922 Hz; the thin limit of the second is 2.359496.

    So the printed 2.360 is 2.3595 rounded once more: one unit of the last digit is allowed here, and the converged
    values are held by the Ritz solution below.
    """
    steel = Material(200e9, 0.3, 8000.0)
    structure = build_structure(rectangle(10.0, 10.0, n, n, CELL[family]), [Member("surface", family, 0.05, steel)])
    computed = frequencies(structure, np.zeros(0, int), 12, shift=-1.0) / (2 * np.pi)
    assert computed[:6] == pytest.approx(np.zeros(6), abs=0.02)
    assert computed[6:9] == pytest.approx([1.622, 2.360, 2.922], abs=1e-3)
    hertz = free_square_by_ritz(16)[:6] / (2 * np.pi * 100) * np.sqrt(200e9 * 0.05**3 / 12 / 0.91 / 400)
    assert hertz[1] == pytest.approx(2.359496, abs=5e-7)
    assert computed[6:] == pytest.approx(hertz, rel=1.5e-3 if family == "plate" else 5e-4)


@pytest.mark.parametrize("h", [0.05, 0.1, 0.2])
def test_thick_plates_match_mindlin(h):
    errors = []
    for n in (8, 16):
        structure = plate_structure(rectangle(1.0, 1.0, n, n), h)
        computed = frequencies(structure, simply_supported(structure), 2)
        errors.append(computed[0] / mindlin_supported(h) - 1)
    assert abs(errors[1]) < 2e-3
    assert np.abs(errors[0] / errors[1]) == pytest.approx(4, rel=0.15)
    assert abs((4 * errors[1] - errors[0]) / 3) < 1e-4  # Richardson: the limit is Mindlin's


def test_shear_of_thin_and_thick_elements():
    thin = supported_square("plate", 0.1, 12, element="dkt")[0]
    thick = supported_square("plate", 0.1, 12, element="dkmt")[0]
    kirchhoff = 2 * np.pi**2 / np.sqrt(1 + 2 * np.pi**2 * 0.01 / 12)  # with rotary inertia
    mindlin = mindlin_supported(0.1) * np.sqrt(METAL.density * 0.1 / flexural_rigidity(0.1))
    assert thick / thin == pytest.approx(mindlin / kirchhoff, rel=1e-3)
    same = [supported_square("plate", 1e-5, 6, element=e) for e in ("dkt", "dkmt")]
    assert same[0] == pytest.approx(same[1], rel=1e-7)


@pytest.mark.parametrize(("family", "n", "error"), [("plate", 32, 3e-3), ("plate_bfs", 12, 3e-4)])
def test_orthotropic_plate(family, n, error):
    """omega^2 rho h = D11 k^4 + 2(D12 + 2 D66) k^2 l^2 + D22 l^4, k = m pi/a, l = n pi/b (Leissa 1969, 9.2)."""
    a, b, h = 1.0, 0.8, 2e-4
    section = orthotropic(h, 140e9, 10e9, 5e9, 0.3, 1600.0)
    structure = plate_structure(rectangle(a, b, n, n, CELL[family]), section, family)
    D = section.D

    def exact(m, k):
        p, q = m * np.pi / a, k * np.pi / b
        stiffness = D[0, 0] * p**4 + 2 * (D[0, 1] + 2 * D[2, 2]) * p**2 * q**2 + D[1, 1] * q**4
        return np.sqrt(stiffness / section.mass)

    expected = np.sort([exact(m, k) for m in (1, 2, 3) for k in (1, 2, 3, 4)])[:4]
    assert frequencies(structure, simply_supported(structure), 4) == pytest.approx(expected, rel=error)


@pytest.mark.parametrize("family", ["plate", "plate_bfs"])
def test_orthotropic_plate_in_any_position(family):
    section = orthotropic(1e-3, 140e9, 10e9, 5e9, 0.3, 1600.0, angle=0.3)
    mesh = rectangle(1.0, 0.8, 6, 5, CELL[family])
    for seed, same in ((2, section), (3, section.rotated(-0.6))):  # angles turn about the normal with positive z
        turn = random_rotation(seed)
        assert (turn[2, 2] > 0) == (same is section)
        structures = [
            plate_structure(mesh, section, family),
            plate_structure(mesh.rotated(turn), same, family, axis=turn[:, 0]),
        ]
        computed = [frequencies(s, s.clamped_dofs("left"), 6) for s in structures]
        assert computed[0] == pytest.approx(computed[1], rel=1e-8)


def test_shear_of_sandwich_plate():
    """Simply supported: 1/omega^2 = mass (1/(D k^4) + 1/(S k^2)) with k^2 = pi^2 (m^2 + n^2), rotary inertia small."""
    section = sandwich(Ply(Lamina.isotropic(METAL), 2e-4), 0.02, Lamina.core(48.0, 4e7))
    mesh = rectangle(1.0, 1.0, 32, 32)
    structure = plate_structure(mesh, section)
    computed = frequencies(structure, simply_supported(structure), 1)[0]
    k2 = 2 * np.pi**2
    exact = np.sqrt(1 / section.mass / (1 / (section.D[0, 0] * k2**2) + 1 / (section.S[0, 0] * k2)))
    assert exact / np.sqrt(section.D[0, 0] * k2**2 / section.mass) < 0.995  # the core matters
    rotary = 1 - section.rotary / section.mass * k2 / 2
    assert computed == pytest.approx(exact * rotary, rel=5e-4)


def test_thick_orthotropic_cantilever_matches_nine_node_shells():
    """Two formulations of transverse shear, with shear moduli one to twenty, under a line load at the end."""
    thick = orthotropic(0.2, 30e9, 10e9, 5e9, 0.3, 1600.0, 0.6, G13=4e9, G23=2e8)
    computed = []
    for family, mesh in (("plate", rectangle(1.0, 0.8, 10, 8)), ("shell", rectangle(1.0, 0.8, 5, 4, "quad9"))):
        s = build_structure(mesh, [Member("surface", family, thick)])
        free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("left"))
        points = s.mesh.points
        edge = s.mesh.group_points("right")
        edge = edge[np.argsort(points[edge, 1])]
        w = np.full(len(edge), 1.0) if family == "plate" else np.resize([2.0, 4.0], len(edge))
        w[[0, -1]] /= 2
        F = np.zeros((len(points), 3))
        F[edge, 2] = w / w.sum()
        x = np.zeros(s.n_dof)
        x[free] = spsolve(s.K[free][:, free].tocsc(), (s.translation.T @ F.ravel())[free])
        u = (s.translation @ x).reshape(-1, 3)[:, 2]
        computed.append([u[s.mesh.nearest_point([1.0, y, 0])] for y in (0, 0.4, 0.8)])
    assert computed[0] == pytest.approx(computed[1], rel=0.02)
