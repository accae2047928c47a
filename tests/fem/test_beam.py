"""Beams against closed forms: characteristic equations of uniform and tapered beams, and exact statics."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import iv, jv
from support.closed_forms import static_solution

from femflex.fem import Material, Member, PointMass, Structure, build_structure
from femflex.fem.sections import Circle, Rectangle, StiffnessSection, Tube
from femflex.mesh import Mesh, line
from femflex.reduction import cantilever_modes

E, RHO, L = 70e9, 2700.0, 10.0


ALUMINIUM = Material(E, 0.33, RHO)


OBLIQUE = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])


CANTILEVER = [1.8751040687119611, 4.694091132974175, 7.854757438237613, 10.995540734875467, 14.13716839104647]


FREE_FREE = [4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464]


def boom(n: int, direction=OBLIQUE, start=(3.0, -1.0, 2.0), cell: str = "line") -> Mesh:
    return line([start, np.asarray(start) + L * np.asarray(direction)], n, cell)


def beam(mesh: Mesh, section, point_masses=(), **options) -> Structure:
    return build_structure(mesh, [Member("line", "beam", section, ALUMINIUM, options)], point_masses)


def modes(structure: Structure, clamped=()) -> tuple[np.ndarray, np.ndarray]:
    """All frequencies [rad/s] and shapes with the clamped dofs held, from one dense solution."""
    free = np.setdiff1d(np.arange(structure.n_dof), clamped)
    K, M = (matrix.toarray()[np.ix_(free, free)] for matrix in (structure.K, structure.M))
    value, vector = eigh(K, M)
    shapes = np.zeros((structure.n_dof, len(free)))
    shapes[free] = vector
    return np.sqrt(np.abs(value)), shapes


def bending(beta_L, I: float, A: float) -> np.ndarray:
    return np.asarray(beta_L) ** 2 / L**2 * np.sqrt(E * I / (RHO * A))


def two_planes(roots, b: float, h: float, count: int) -> np.ndarray:
    return np.sort(np.concatenate([bending(roots, b * h**3 / 12, b * h), bending(roots, h * b**3 / 12, b * h)]))[:count]


@pytest.mark.parametrize(("order", "n", "count"), [(3, 75, 8), (5, 8, 8), (6, 4, 6), (8, 2, 6)])
def test_oblique_cantilever_frequencies_match_closed_form(order, n, count):
    structure = beam(boom(n), Rectangle(0.02, 0.03), order=order, rotary_inertia=False)
    # by inverse iteration: many short elements put rounding of the highest axial wave into a dense solution
    omega = cantilever_modes(structure, "start", count).omega
    assert omega[:count] == pytest.approx(two_planes(CANTILEVER, 0.02, 0.03, count), rel=1e-6)


def test_free_beam_frequencies_match_closed_form():
    omega, _ = modes(beam(boom(6), Rectangle(0.02, 0.03), order=6, rotary_inertia=False))
    assert omega[:6].max() < 1e-3 * omega[6]  # sqrt of rounding: K holds EA beside EI / L^2
    assert omega[6:12] == pytest.approx(two_planes(FREE_FREE, 0.02, 0.03, 6), rel=1e-6)


def test_pinned_beam_with_rotary_inertia_matches_rayleigh():
    """omega^2 = EI k^4 / (rho A (1 + r^2 k^2)), k = n pi / L, r^2 = I / A, in both planes."""
    b, h = 0.3, 0.5
    structure = beam(boom(6, [1, 0, 0], (0, 0, 0)), Rectangle(b, h), order=7)
    pins = [structure.clamped_dofs("start", ["x", "y", "z", "rx"]), structure.clamped_dofs("end", ["y", "z"])]
    omega, _ = modes(structure, np.concatenate(pins))
    k = np.arange(1, 4) * np.pi / L
    for r2 in (b**2 / 12, h**2 / 12):
        for expected in k**2 * np.sqrt(E * r2 / RHO / (1 + r2 * k**2)):
            assert np.abs(omega / expected - 1).min() < 1e-7


@pytest.mark.parametrize("rotary", [True, False])
def test_axial_and_torsional_frequencies_match_rod_theory(rotary):
    """(n - 1/2) pi c / L with c^2 = E / rho, and G J / rho I_p; rotary inertia off leaves torsion its own."""
    structure = beam(boom(6, [0, 1, 0]), Rectangle(0.1, 0.2), order=8, rotary_inertia=rotary)
    clamp, tip = structure.clamped_dofs("start"), structure.mesh.group_points("end")[0]
    omega, phi = modes(structure, clamp)
    p = Rectangle(0.1, 0.2).properties(np.zeros(1), 1.0)
    speed = {"translation": np.sqrt(E / RHO), "rotation": np.sqrt(ALUMINIUM.G * p.J[0] / (RHO * (p.Iy + p.Iz)[0]))}
    for kind, c in speed.items():
        along = np.abs((getattr(structure, kind) @ phi)[3 * tip + 1])
        computed = omega[along > 1e-3 * along.max()][:3]
        assert computed == pytest.approx((np.arange(3) + 0.5) * np.pi * c / L, rel=1e-8)


def test_frequency_error_of_cubic_beam():
    structure = beam(boom(12), Circle(0.1), rotary_inertia=False)
    omega, _ = modes(structure, structure.clamped_dofs("start"))
    for mode in range(3):
        error = omega[2 * mode] / bending(CANTILEVER[mode], np.pi / 4 * 1e-4, np.pi * 1e-2) - 1
        assert error == pytest.approx((CANTILEVER[mode] / 12) ** 4 / 1440, rel=0.1)


def test_line3_cell_is_two_elements():
    with_line3, with_lines = (
        modes(beam(boom(n, cell=cell), Circle(0.1)))[0] for n, cell in ((4, "line3"), (8, "line"))
    )
    assert with_line3[6:20] == pytest.approx(with_lines[6:20], rel=1e-9)


def tip_mass_root(mass: float, inertia: float, guess: tuple[float, float]) -> float:
    """beta L of a cantilever with a tip mass (over the beam's m L) and tip inertia (over m L^3), from its boundary
    conditions w''' = -mass beta^4 w and w'' = inertia beta^4 w' at x = 1, for w = a(cosh - cos) + b(sinh - sin)."""

    def determinant(k: float) -> float:
        C, c, S, s = np.cosh(k), np.cos(k), np.sinh(k), np.sin(k)
        shear = [S - s + mass * k * (C - c), C + c + mass * k * (S - s)]
        moment = [C + c - inertia * k**3 * (S + s), S + s - inertia * k**3 * (C - c)]
        return float(shear[0] * moment[1] - shear[1] * moment[0])

    return brentq(determinant, *guess, xtol=1e-14)


@pytest.mark.parametrize(("mass", "inertia"), [(0.5, 0.0), (3.0, 0.0), (0.5, 0.02)])
def test_beam_with_tip_mass_and_inertia_matches_closed_form(mass, inertia):
    A, I = np.pi * 1e-2, np.pi / 4 * 1e-4
    m = RHO * A
    tip = PointMass("end", mass * m * L, inertia * m * L**3 * np.eye(3) if inertia else None)
    structure = beam(boom(6), Circle(0.1), [tip], order=6, rotary_inertia=False)
    omega, _ = modes(structure, structure.clamped_dofs("start"))
    grid = np.linspace(0.3, 8.0, 400)
    roots = []
    for a, b in pairwise(grid):
        try:
            roots.append(tip_mass_root(mass, inertia, (a, b)))
        except ValueError:  # no change of sign here
            continue
    for root in roots[:2]:
        assert np.abs(omega / bending(root, I, A) - 1).min() < 1e-6
    assert omega[0] == pytest.approx(bending(roots[0], I, A), rel=1e-6)


def test_offset_tip_mass():
    """A light cantilever of tip stiffness K with a mass m a rigid distance d beyond its end: omega^-2 = m r.K^-1 r."""
    mesh = line([[0, 0, 0], [1.0, 0, 0]], 1)
    light = Member("line", "beam", StiffnessSection(1e9, 1e5, 1e5, 1e5, 1e-4))
    structure = build_structure(mesh, [light], [PointMass("end", 5.0, offset=(0.7, 0, 0))])
    omega, _ = modes(structure, structure.clamped_dofs("start"))
    K, r = 1e5 * np.array([[12.0, -6.0], [-6.0, 4.0]]), np.array([1.0, 0.7])
    assert omega[0] == pytest.approx(1 / np.sqrt(5.0 * r @ np.linalg.solve(K, r)), rel=1e-5)  # the arm weighs 2e-5 of m


@pytest.mark.parametrize(("power", "order_of_bessel"), [(1, 1), (2, 2)], ids=["wedge", "cone"])
def test_pointed_cantilever_frequencies_match_kirchhoff(power, order_of_bessel):
    """Wedge (A ~ x, I ~ x^3), cone (A ~ x^2, I ~ x^4): J_n I_n+1 + I_n J_n+1 = 0 at z, omega ~ z^2/4."""
    n = order_of_bessel
    roots, grid = [], np.linspace(1.0, 16.0, 200)
    values = jv(n, grid) * iv(n + 1, grid) + iv(n, grid) * jv(n + 1, grid)
    for i in np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:])):
        roots.append(brentq(lambda z: jv(n, z) * iv(n + 1, z) + iv(n, z) * jv(n + 1, z), grid[i], grid[i + 1]))
    section = Rectangle(0.1, "0.2*(1 - s/L)") if power == 1 else Circle("0.1*(1 - s/L)")
    p0 = Rectangle(0.1, 0.2).properties(np.zeros(1), 1.0) if power == 1 else Circle(0.1).properties(np.zeros(1), 1.0)
    structure = beam(boom(6, [1, 0, 0]), section, order=7, rotary_inertia=False)
    omega, _ = modes(structure, structure.clamped_dofs("start"))
    for z in roots[:3]:
        expected = z**2 / 4 * np.sqrt(E * p0.Iy[0] / (RHO * p0.A[0] * L**4))
        assert np.abs(omega / expected - 1).min() < 1e-6


E_BEAM_TABLES, NU, RHO_BEAM_TABLES, L_BEAM_TABLES = 70e9, 0.3, 2700.0, 4.0


ALUMINIUM_BEAM_TABLES = Material(E_BEAM_TABLES, NU, RHO_BEAM_TABLES)


SECTION = Rectangle(0.06, 0.1)


PROPERTIES = SECTION.properties(np.zeros(1), 1.0)


A, IY, IZ, J = (float(getattr(PROPERTIES, name)[0]) for name in ("A", "Iy", "Iz", "J"))


def boom_beam_tables(n: int, direction=OBLIQUE, start=(3.0, -1.0, 2.0)) -> Mesh:
    return line([start, np.asarray(start) + L_BEAM_TABLES * np.asarray(direction)], n)


def beam_beam_tables(mesh: Mesh, section=SECTION, point_masses=(), **options) -> Structure:
    return build_structure(mesh, [Member("line", "beam", section, ALUMINIUM_BEAM_TABLES, options)], point_masses)


def deflection(structure: Structure, load: np.ndarray, group: str = "end") -> tuple[np.ndarray, np.ndarray]:
    """Displacement and rotation of the loaded node under a force (3,) and moment (3,) there, clamped at the start."""
    node = structure.mesh.group_points(group)[0]
    rows = [operator[3 * node : 3 * node + 3] for operator in (structure.translation, structure.rotation)]
    force = rows[0].T @ load[:3] + rows[1].T @ load[3:]
    u = static_solution(structure, force, structure.clamped_dofs("start"))
    return rows[0] @ u, rows[1] @ u


def axes(y: np.ndarray, x: np.ndarray = OBLIQUE) -> np.ndarray:
    y = y - (y @ x) * x
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


@pytest.mark.parametrize(("n", "order"), [(1, 3), (5, 3), (2, 6)])
def test_tip_deflection_along_section_axes(n, order):
    """F L^3 / 3EI and M L / EI, F L^2 / 2EI both ways, N L / EA, T L / GJ; the section's y along the orientation."""
    orientation = np.array([0.3, 0.1, 1.0])
    C = axes(orientation)
    structure = beam_beam_tables(boom_beam_tables(n), order=order, orientation=orientation.tolist())
    N, Fy, Fz, T, My, Mz = load = np.array([5e3, 70.0, -110.0, 40.0, 30.0, -20.0])
    u, theta = deflection(structure, np.concatenate([C.T @ load[:3], C.T @ load[3:]]))
    expected_u = [
        N * L_BEAM_TABLES / (E_BEAM_TABLES * A),
        Fy * L_BEAM_TABLES**3 / (3 * E_BEAM_TABLES * IZ) + Mz * L_BEAM_TABLES**2 / (2 * E_BEAM_TABLES * IZ),
        Fz * L_BEAM_TABLES**3 / (3 * E_BEAM_TABLES * IY) - My * L_BEAM_TABLES**2 / (2 * E_BEAM_TABLES * IY),
    ]
    expected_theta = [
        T * L_BEAM_TABLES / (ALUMINIUM_BEAM_TABLES.G * J),
        My * L_BEAM_TABLES / (E_BEAM_TABLES * IY) - Fz * L_BEAM_TABLES**2 / (2 * E_BEAM_TABLES * IY),
        Mz * L_BEAM_TABLES / (E_BEAM_TABLES * IZ) + Fy * L_BEAM_TABLES**2 / (2 * E_BEAM_TABLES * IZ),
    ]
    assert C @ u == pytest.approx(expected_u, rel=1e-8)
    assert C @ theta == pytest.approx(expected_theta, rel=1e-8)


def test_angle_frame_deflection_matches_closed_form():
    """Load F out of the plane at the end of arms a, b: F (a^3 + b^3) / 3EI + F a b^2 / GJ, and in the plane across b:
    F b^3 / 3EI + F a b^2 / EI from the first arm's end rotation, F a / EA from its stretch."""
    a, b, F = 3.0, 2.0, 50.0
    structure = beam_beam_tables(line([[0, 0, 0], [a, 0, 0], [a, b, 0]], 5), Tube(0.05, 0.005))
    p = Tube(0.05, 0.005).properties(np.zeros(1), 1.0)
    EI, GJ, EA = E_BEAM_TABLES * p.Iy[0], ALUMINIUM_BEAM_TABLES.G * p.J[0], E_BEAM_TABLES * p.A[0]
    out = deflection(structure, np.array([0, 0, F, 0, 0, 0]))[0][2]
    assert out == pytest.approx(F * (a**3 + b**3) / (3 * EI) + F * a * b**2 / GJ, rel=1e-8)
    across = deflection(structure, np.array([F, 0, 0, 0, 0, 0]))[0][0]
    assert across == pytest.approx(F * b**3 / (3 * EI) + F * a * b**2 / EI + F * a / EA, rel=1e-8)


def test_mass_of_varying_section_equals_integral():
    """A frustum's mass and centre: radius r0 to r1."""
    r0, r1 = 0.1, 0.04
    structure = beam_beam_tables(boom_beam_tables(2, [1, 0, 0], (0, 0, 0)), Circle(f"{r0} + ({r1} - {r0})*s/L"))
    (block,) = structure.inertia
    volume = np.pi * L_BEAM_TABLES / 3 * (r0**2 + r0 * r1 + r1**2)
    assert block.dm.sum() == pytest.approx(RHO_BEAM_TABLES * volume, rel=1e-13)
    centre = L_BEAM_TABLES / 4 * (r0**2 + 2 * r0 * r1 + 3 * r1**2) / (r0**2 + r0 * r1 + r1**2)
    assert np.einsum("eqa,eq->a", block.rho, block.dm) / block.dm.sum() == pytest.approx([centre, 0, 0], abs=1e-13)
