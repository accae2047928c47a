"""Frequencies of published standards: ring, spheres, pipe elbow, thick plate; a composite beam by exact transfer."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from support.closed_forms import mindlin
from support.plate_models import frequencies

from femflex.fem import Material, Member, Structure, build_structure
from femflex.fem.sections import Circle, FullSection, Tube
from femflex.fem.support import symmetry
from femflex.mesh import Mesh, line, rectangle
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.merge import fused

FREE = np.zeros(0, np.int64)


def test_free_ring_in_and_out_of_plane():
    """omega^2 = EI / m R^4 n^2 (n^2 - 1)^2 / (n^2 + 1), out of plane over n^2 + EI / GJ (Timoshenko; code_aster SDLL11
    is such a ring). Straight elements, 48 of them."""
    E, nu, rho, R, r, n = 7.2e10, 0.3, 2700.0, 0.1, 0.0025, 48
    a = 2 * np.pi * np.arange(n) / n
    rows = np.stack([np.arange(n), (np.arange(n) + 1) % n], axis=1)
    mesh = Mesh(
        np.stack([R * np.cos(a), R * np.sin(a), 0 * a], axis=1), {"line": rows}, {"line": {"line": np.arange(n)}}
    )
    s = build_structure(mesh, [Member("line", "beam", Circle(r), Material(E, nu, rho))])
    computed = frequencies(s, FREE, 18, shift=-1e3)
    unit = np.sqrt(E * r**2 / 4 / rho / R**4)
    waves = np.array([2, 3, 4])
    inside = unit * waves * (waves**2 - 1) / np.sqrt(waves**2 + 1)
    outside = unit * waves * (waves**2 - 1) / np.sqrt(waves**2 + 1 + nu)  # EI / GJ = 1 + nu of a round bar
    expected = np.repeat(np.sort([*inside, *outside]), 2)
    np.testing.assert_allclose(computed[6:], expected, rtol=6e-3)
    assert (computed[:6] < 1e-3 * expected[0]).all()


def cube_sphere(n: int) -> Mesh:
    """A unit sphere of six faces of n x n nine-node elements."""
    face, points, cells = rectangle(2.0, 2.0, n, n, "quad9"), [], []
    t = np.tan((face.points[:, :2] - 1) * np.pi / 4)
    for axis in range(3):
        for sign in (1.0, -1.0):
            x = np.zeros((len(t), 3))
            x[:, axis], x[:, (axis + 1) % 3], x[:, (axis + 2) % 3] = sign, t[:, 0], t[:, 1]
            own = face.cells["quad9"] if sign > 0 else face.cells["quad9"][:, CELL_TYPES["quad9"].mirrored]
            cells.append(own + sum(map(len, points)))
            points.append(x / np.linalg.norm(x, axis=1, keepdims=True))
    rows = np.concatenate(cells)
    return fused(Mesh(np.concatenate(points), {"quad9": rows}, {"surface": {"quad9": np.arange(len(rows))}}), 1e-8)


def octant(sphere: Mesh) -> Mesh:
    """The elements in the octant of positive x, y and z, with their points on the three planes as groups."""
    rows = sphere.cells["quad9"]
    rows = rows[(sphere.points[rows].mean(axis=1) > 0).all(axis=1)]
    used, number = np.unique(rows, return_inverse=True)
    points = sphere.points[used]
    planes = {name: np.flatnonzero(np.abs(points[:, k]) < 1e-9) for k, name in enumerate("xyz")}
    return Mesh(points, {"quad9": number.reshape(rows.shape)}, {"surface": {"quad9": np.arange(len(rows))}}, planes)


def test_sphere_and_octant_frequencies_match_lamb():
    """(1 - nu^2) W^4 - [n (n + 1) + 1 + 3 nu] W^2 + n (n + 1) - 2 = 0, W = omega R sqrt(rho / E): a membrane.

    Here h = R / 100.
    """
    whole, nu = cube_sphere(4), 0.3
    part, planes = octant(whole), {name: symmetry(np.eye(3)[k]) for k, name in enumerate("xyz")}
    member = Member("surface", "shell", 0.01, Material(1.0, nu, 1.0))
    full, eighth = build_structure(whole, [member]), build_structure(part, [member], supports=planes)
    of_full = frequencies(full, FREE, 27, shift=-1e-3)[6:]
    of_part = frequencies(eighth, eighth.constrained_dofs(planes), 4, shift=-1e-3)
    for frequency in of_part:
        assert np.abs(of_full / frequency - 1).min() < 1e-5
    assert of_part[0] == pytest.approx(of_full[0], rel=1e-5)

    def lamb(n):
        b, c = n * (n + 1) + 1 + 3 * nu, n * (n + 1) - 2
        return np.sqrt((b - np.sqrt(b * b - 4 * (1 - nu**2) * c)) / 2 / (1 - nu**2))

    expected = np.repeat([lamb(2), lamb(3), lamb(4)], [5, 7, 4])  # 2 n + 1 of each, four of the third
    np.testing.assert_allclose(of_full[:16], expected, rtol=5e-3)
    assert np.ptp(of_full[:2]) < 1e-6 and np.ptp(of_full[2:5]) < 1e-4  # two and three by the symmetry of the mesh


def test_pipe_elbow_clamped_at_both_ends():
    """SDLL14 (VPCS) without legs: quarter circle of 1 m, tube 20 / 16 mm: 44.23, 119, 125, 227 Hz."""
    a = np.linspace(0, np.pi / 2, 25)
    mesh = line(np.stack([np.sin(a), 1 - np.cos(a), 0 * a], axis=1), 24)
    s = build_structure(mesh, [Member("line", "beam", Tube(0.01, 0.002), Material(2.1e11, 0.3, 7800.0))])
    fixed = np.union1d(s.clamped_dofs("start"), s.clamped_dofs("end"))
    np.testing.assert_allclose(frequencies(s, fixed, 4) / (2 * np.pi), [44.23, 119, 125, 227], rtol=0.01)


def test_supported_pipe_elbow_with_straight_legs():
    """code_aster V2.02.014 (SDLL14, VPCS), L = 2 m: 17.9, 24.8, 25.3, 27.0 Hz, upper bounds by Rayleigh's method.

    Legs of 2 m to clamps; at the ends of the elbow, the two displacements across the leg are zero.
    """
    a = np.linspace(0, np.pi / 2, 25)[1:-1]
    elbow = np.stack([np.sin(a), 1 - np.cos(a), 0 * a], axis=1)
    points = np.concatenate([[[-2.0, 0, 0], [0, 0, 0]], elbow, [[1.0, 1.0, 0], [1.0, 3.0, 0]]])
    mesh = Mesh(
        points,
        {"line": np.stack([np.arange(len(points) - 1), np.arange(1, len(points))], axis=1)},
        {"pipe": {"line": np.arange(len(points) - 1)}},
        {"ends": np.array([0, len(points) - 1]), "first": np.array([1]), "last": np.array([len(points) - 2])},
    )
    options = {"order": 6}
    s = build_structure(mesh, [Member("pipe", "beam", Tube(0.01, 0.002), Material(2.1e11, 0.3, 7800.0), options)])
    fixed = s.constrained_dofs({"ends": ("x", "y", "z", "rx", "ry", "rz"), "first": ("y", "z"), "last": ("x", "z")})
    np.testing.assert_allclose(frequencies(s, fixed, 4) / (2 * np.pi), [17.9, 24.8, 25.3, 27.0], rtol=0.02)


def bending(s: Structure, n: int) -> np.ndarray:
    """Frequencies [Hz] of a plate on hard simple supports that does not move in its plane."""
    ways = {"left": ("x", "y", "z", "rx"), "right": ("x", "y", "z", "rx")}
    ways |= {"bottom": ("x", "y", "z", "ry"), "top": ("x", "y", "z", "ry")}
    return frequencies(s, s.constrained_dofs(ways), n) / (2 * np.pi)


@pytest.mark.parametrize(("cell", "n"), [("quad", 24), ("quad9", 8), ("triangle6", 16)])
def test_simply_supported_thick_plate(cell, n):
    """NAFEMS R0015, FV21 and FV52: 10 m square, 1 m thick, E = 200 GPa, 8000 kg/m^3.

    Closed form 45.897, 109.44 twice, 167.89 Hz (as printed for FV52 in the verification manual of Ansys, VMC5).

    The exact solution of Mindlin's plate, shear factor 5 / 6, is 45.91, 109.53, 109.53 and 168.07 Hz.
    """
    mesh = rectangle(10.0, 10.0, n, n, cell)
    s = build_structure(mesh, [Member("surface", "shell", 1.0, Material(200e9, 0.3, 8000.0))])
    computed = bending(s, 4)
    np.testing.assert_allclose(computed, [45.897, 109.44, 109.44, 167.89], rtol=0.015)
    np.testing.assert_allclose(computed, [mindlin(*waves) for waves in ((1, 1), (1, 2), (2, 1), (2, 2))], rtol=0.008)


STIFF = (
    1e3
    * np.array(  # of a box beam of skewed plies [lbf, lbf in, lbf in^2] (Yu and Blair, Thin-Walled Struct. 2012)
        [
            [1368.17, 0, 0, 0, 0, 0],
            [0, 88.56, 0, 0, 0, 0],
            [0, 0, 38.78, 0, 0, 0],
            [0, 0, 0, 16.96, 17.61, -0.351],
            [0, 0, 0, 17.61, 59.12, -0.370],
            [0, 0, 0, -0.351, -0.370, 141.47],
        ]
    )
)
HEAVY = 1e-2 * np.diag([8.538, 8.538, 8.538, 1.4433, 0.40972, 1.0336])


def exact_frequencies(stiffness: np.ndarray, mass: np.ndarray, length: float, n: int) -> list[float]:
    """The first n frequencies of a clamped beam, by the transfer of displacements, rotations, forces and moments.

    u' = gamma - e1 x theta, theta' = kappa, F' = -omega^2 p, M' = -e1 x F - omega^2 q, (p, q) = mass (u, theta).
    """
    cross = np.zeros((3, 3))
    cross[1, 2], cross[2, 1] = -1.0, 1.0  # e1 x
    scale = np.sqrt(np.abs(stiffness).max())

    def end_determinant(omega: float) -> float:
        A = np.zeros((12, 12))
        A[:6, 6:] = np.linalg.inv(stiffness) * scale
        A[:3, 3:6] = -cross
        A[6:, :6] = -(omega**2) * mass / scale
        A[9:, 6:9] = -cross
        return float(np.linalg.det(expm(A * length)[6:, 6:]))  # forces at the end from those at the clamp

    frequencies_found: list[float] = []
    low, step = 1.0, 4.0
    before = end_determinant(low)
    while len(frequencies_found) < n:
        after = end_determinant(low + step)
        if before * after < 0:
            frequencies_found.append(float(brentq(end_determinant, low, low + step, xtol=1e-9)))
        low, before = low + step, after
    return frequencies_found


def test_bend_twist_coupled_box_beam_frequencies():
    """Clamped, 10 in: meshed with the 6 x 6 stiffness against the exact transfer matrix; coupling counts."""
    mesh = line([[0, 0, 0], [10.0, 0, 0]], 10)
    section = FullSection(STIFF, HEAVY)
    s = build_structure(mesh, [Member("line", "beam", section, options={"order": 5})])
    computed = frequencies(s, s.clamped_dofs("start"), 6)
    exact = exact_frequencies(STIFF, HEAVY, 10.0, 6)
    np.testing.assert_allclose(computed, exact, rtol=1e-3)
    alone = exact_frequencies(np.diag(np.diag(STIFF)), HEAVY, 10.0, 1)[0]
    assert abs(exact[0] / alone - 1) > 0.05
