"""Rods, springs, bushings and point masses: matrices and energies written out by hand, and masses that swing."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import METAL, random_rotation

from femflex.fem import Bushing, Material, Member, PointMass, ScalarSpring, build_structure, spring
from femflex.fem.sections import CableSection, Circle
from femflex.mesh import Mesh, line
from femflex.reduction import cantilever_modes

POINTS = np.array([[0.0, 0.2, 0.1], [1.0, -0.3, 0.4], [0.3, 1.5, 0.2], [-0.4, 0.3, 2.0], [0.0, 0.0, -1.0]])


BARS = np.array([[0, 1], [2, 1], [3, 0], [2, 3], [4, 0]])  # the last runs nearly along z


SPAN = POINTS[BARS[:, 1]] - POINTS[BARS[:, 0]]


LENGTH = np.linalg.norm(SPAN, axis=1)


NAMES = {f"n{k}": [k] for k in range(5)}


def truss(section=None, material=None):
    mesh = Mesh(POINTS, {"line": BARS}, {"line": {"line": np.arange(5)}}, NAMES)
    return build_structure(mesh, [Member("line", "rod", section or CableSection(2e6, 0.7), material)])


def test_truss_matrices():
    """EA / L t t^T between the ends; m L / 6 (2, 1) in all three directions."""
    K, M = np.zeros((2, 15, 15))
    for (a, b), span, length in zip(BARS, SPAN, LENGTH, strict=True):
        row = np.zeros((5, 3))
        row[b], row[a] = span / length, -span / length
        K += 2e6 / length * np.outer(row, row)
        for i, j, share in ((a, a, 2), (b, b, 2), (a, b, 1), (b, a, 1)):
            M[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += 0.7 * length / 6 * share * np.eye(3)
    s = truss()
    U = s.translation.toarray()
    assert U.T @ K @ U == pytest.approx(s.K.toarray(), abs=1e-12 * K.max())
    assert U.T @ M @ U == pytest.approx(s.M.toarray(), abs=1e-14 * M.max())
    assert s.n_dof == 15 and abs(s.rotation).sum() == 0


def test_energy_of_truss_at_large_displacements():
    """Green's strain of a chord is (l^2 - L^2) / 2 L^2, whatever the rotation."""
    s = truss()
    u = 0.5 * np.random.default_rng(2).normal(size=(5, 3))
    moved = (POINTS + u)[BARS]
    now = np.sum((moved[:, 1] - moved[:, 0]) ** 2, axis=1)
    eps = (now - LENGTH**2) / (2 * LENGTH**2)
    assert s.internal_force.energy(s.translation.T @ u.ravel()) == pytest.approx(np.sum(1e6 * LENGTH * eps**2))


def grid(bushings=(), rotations=True):
    """Bare nodes."""
    mesh = Mesh(POINTS, {}, {}, {**NAMES, "all": np.arange(5), "two": [0, 1]})
    return build_structure(mesh, [Member("all", "nodes", options={"rotations": rotations})], bushings=bushings)


@pytest.mark.parametrize("stiffness", [250.0, -80.0])
def test_scalar_spring_stiffness(stiffness):
    """k c c^T with factors of translations and rotations of three nodes; k of either sign."""
    terms = (
        ("n3", "translation", (0.3, -1.0, 0.2)),
        ("n1", "rotation", (0.0, 2.0, -0.7)),
        ("n3", "rotation", (1.0, 0.4, 0.0)),
    )
    s = grid([ScalarSpring(terms, stiffness)])
    move, turn = np.zeros((2, 5, 3))
    move[3], turn[1], turn[3] = terms[0][2], terms[1][2], terms[2][2]
    row = s.translation.T @ move.ravel() + s.rotation.T @ turn.ravel()
    assert s.K.toarray() == pytest.approx(stiffness * np.outer(row, row), abs=1e-12)
    assert s.n_dof == 30 and grid(rotations=False).n_dof == 15


C = random_rotation(6)


@pytest.mark.parametrize("axes", [None, 3.0 * C])
def test_bushing_between_distant_nodes(axes):
    """Energy of random motions: each node takes the middle along rigidly; x from the first to the second."""
    k = np.array([2e3, 5e2, 5e2, 40.0, 7.0, 7.0] if axes is None else [2e3, 5e2, 8e2, 40.0, 9.0, 7.0])
    s = grid([Bushing("n3", "n1", k[:3], k[3:], axes)])
    middle, ends = (POINTS[3] + POINTS[1]) / 2, (3, 1)
    x = np.random.default_rng(4).normal(size=s.n_dof)
    u, turn = ((A @ x).reshape(5, 3) for A in (s.translation, s.rotation))
    there = [u[n] + np.cross(turn[n], middle - POINTS[n]) for n in ends]
    move, twist = there[1] - there[0], turn[1] - turn[3]
    if axes is None:
        t = POINTS[1] - POINTS[3]
        t /= np.linalg.norm(t)
        squares = [(move @ t) ** 2, move @ move - (move @ t) ** 2, 0, (twist @ t) ** 2]
        squares += [twist @ twist - (twist @ t) ** 2, 0]
    else:
        squares = [*(C @ move) ** 2, *(C @ twist) ** 2]
    assert x @ s.K @ x == pytest.approx(k @ squares, rel=1e-12)
    assert s.skin.points[s.skin.cells["line"][0]] == pytest.approx(POINTS[[3, 1]])
    assert (s.skin.operator @ x).reshape(2, 3) == pytest.approx(u[[3, 1]])


BEAM = ("beam", Circle(0.05), METAL)


def two_beams(gap, *bushings, masses=()):
    """Two beams along x, the second begins at `gap` (3,) from the end of the first."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]])
    points[2:] += np.add([1, 0, 0], gap)
    cells, groups = {"line": np.array([[0, 1], [2, 3]])}, {"first": {"line": [0]}, "second": {"line": [1]}}
    named = {"root": [0], "a": [1], "b": [2], "tip": [3], "both": [1, 2]}
    mesh = Mesh(points, cells, groups, named)
    return build_structure(mesh, [Member(g, *BEAM) for g in groups], masses, bushings=bushings)


def test_frequency_of_masses_on_spring():
    """Two stiff short beams, a soft spring along the line between them, the second mass free along it."""
    structure = two_beams((0.5, 0, 0), spring("a", "b", 40.0), masses=[PointMass("tip", 1e4)])
    fixed = {"root": ("x", "y", "z", "rx", "ry", "rz"), "b": ("y", "z", "rx", "ry", "rz")}
    mass = structure.inertia[1].dm.sum() + 1e4
    computed = cantilever_modes(structure, fixed, 1).omega[0]
    assert computed == pytest.approx(np.sqrt(40.0 / mass), rel=1e-6)


BEAM_POINT_MASS = Member("line", "beam", Circle(0.05), Material(70e9, 0.3, 2700.0))


def random_inertia(seed: int) -> np.ndarray:
    r = np.random.default_rng(seed).normal(size=(5, 3))
    return (r**2).sum() * np.eye(3) - r.T @ r


def boom() -> Mesh:
    return line([[0, 0, 0], [1.0, 2.0, 3.0]], 3)


def test_mass_matrix_of_offset_point_mass():
    """m, m r x, J + m (r.r 1 - r r^T) on the node's six dofs, and nothing elsewhere."""
    mesh, r, J, m = boom(), np.array([0.1, -0.4, 0.2]), random_inertia(3), 4.0
    bare, loaded = (
        build_structure(mesh, [BEAM_POINT_MASS]),
        build_structure(mesh, [BEAM_POINT_MASS], [PointMass("end", m, J, r)]),
    )
    added = (loaded.M - bare.M).toarray()
    node = mesh.group_points("end")[0]
    rows = [op.toarray()[3 * node : 3 * node + 3] for op in (loaded.translation, loaded.rotation)]
    D = np.concatenate(rows)
    cross = np.cross(np.eye(3), r)  # rows e_i x r
    expected = np.block([[m * np.eye(3), m * cross.T], [m * cross, J + m * (r @ r * np.eye(3) - np.outer(r, r))]])
    assert D @ added @ D.T == pytest.approx(expected, rel=1e-11, abs=1e-11)
    assert np.abs(added - D.T @ expected @ D).max() < 1e-11
    rho, dm = loaded.inertia[-1].rho[0], loaded.inertia[-1].dm[0]
    assert dm @ rho / m == pytest.approx(mesh.points[node] + r)
