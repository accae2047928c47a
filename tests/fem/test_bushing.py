"""Springs and bushings inside structures: their stiffness, rigid motion without force, and what is refused."""

import numpy as np
import pytest

from femflex.fem import Bushing, Material, Member, PointMass, build_structure, spring
from femflex.fem.sections import Circle
from femflex.mesh import Mesh
from femflex.reduction import cantilever_modes
from femflex.reduction.boundary.rigid import rigid_shapes

METAL = Material(7e10, 0.3, 2700.0)
BEAM = ("beam", Circle(0.05), METAL)


def two_beams(gap, *bushings, masses=()):
    """Two beams along x, the second begins at `gap` (3,) from the end of the first."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0]])
    points[2:] += np.add([1, 0, 0], gap)
    cells, groups = {"line": np.array([[0, 1], [2, 3]])}, {"first": {"line": [0]}, "second": {"line": [1]}}
    named = {"root": [0], "a": [1], "b": [2], "tip": [3], "both": [1, 2]}
    mesh = Mesh(points, cells, groups, named)
    return build_structure(mesh, [Member(g, *BEAM) for g in groups], masses, bushings=bushings)


def node_rows(structure, group):
    """Rows (6, n_dof) of the displacement and rotation of a group's node."""
    node = structure.mesh.group_points(group)[0]
    return np.concatenate([op.toarray()[3 * node : 3 * node + 3] for op in (structure.translation, structure.rotation)])


def test_at_one_place_it_resists_relative_motion_along_its_axes():
    k = np.array([2e6, 3e5, 4e4, 5e3, 6e2, 7e1])
    C = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    with_it = two_beams((0, 0, 0), Bushing("a", "b", k[:3], k[3:], C))
    added = (with_it.K - two_beams((0, 0, 0)).K).toarray()
    relative = node_rows(with_it, "b") - node_rows(with_it, "a")
    own = np.kron(np.eye(2), C) @ relative
    assert added == pytest.approx(own.T @ np.diag(k) @ own, abs=1e-9 * k.max())


@pytest.mark.parametrize("gap", [(0, 0, 0), (0.1, 0, 0), (0.1, -0.2, 0.3)])
def test_rigid_motion_costs_nothing(gap):
    structure = two_beams(gap, Bushing("a", "b", (1e5, 2e5, 3e5), (1e3, 2e3, 3e3)))
    R = rigid_shapes(structure)
    assert np.abs(structure.K @ R).max() < 1e-9 * abs(structure.K).max()


@pytest.mark.parametrize("gap", [(0, 0, 0), (0.1, -0.2, 0.3)])
def test_displacements_are_compared_at_its_place(gap):
    """That of a node is u + theta x (at - x)."""
    k, at = np.array([2e6, 3e5, 4e4, 5e3, 6e2, 7e1]), np.array([1.3, 0.4, -0.2])
    with_it = two_beams(gap, Bushing("a", "b", k[:3], k[3:], np.eye(3), at))
    rows = []
    for group, sign in (("a", -1.0), ("b", 1.0)):
        arm = at - with_it.mesh.points[with_it.mesh.group_points(group)[0]]
        u, theta = np.split(node_rows(with_it, group), 2)
        rows.append(sign * np.concatenate([u + np.cross(theta.T, arm).T, theta]))
    relative = rows[0] + rows[1]
    added = (with_it.K - two_beams(gap).K).toarray()
    assert added == pytest.approx(relative.T @ np.diag(k) @ relative, abs=1e-9 * k.max())
    assert np.abs(with_it.K @ rigid_shapes(with_it)).max() < 1e-9 * abs(with_it.K).max()


def test_a_spring_makes_masses_swing_at_the_root_of_stiffness_over_mass():
    """Two stiff short beams, a soft spring along the line between them, the second mass free along it."""
    structure = two_beams((0.5, 0, 0), spring("a", "b", 40.0), masses=[PointMass("tip", 1e4)])
    held = {"root": ("x", "y", "z", "rx", "ry", "rz"), "b": ("y", "z", "rx", "ry", "rz")}
    mass = structure.inertia[1].dm.sum() + 1e4
    found = cantilever_modes(structure, held, 1).omega[0]
    assert found == pytest.approx(np.sqrt(40.0 / mass), rel=1e-6)
