"""Rigid and distributing interfaces and equations of dofs, against closed forms and members that share nodes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from support.plate_models import frequencies, random_rotation

from femflex.fem import (
    Distributing,
    Equation,
    Material,
    Member,
    PointMass,
    Rigid,
    Term,
    build_structure,
)
from femflex.fem.sections import Circle
from femflex.mesh import Mesh, box, line, rectangle

METAL = Material(70e9, 0.3, 2700.0)
BAR = Circle(0.02)


def beam(group="line", **options):
    return Member(group, "beam", BAR, METAL, options)


def two_bars(gap: float) -> Mesh:
    """Bars from 0 to 1 and from 1 + gap to 2 + gap along x; groups "line", ends "a", "b"."""
    one, other = line(np.array([[0, 0, 0], [1.0, 0, 0]]), 2), line(np.array([[1.0 + gap, 0, 0], [2.0 + gap, 0, 0]]), 2)
    both = one.merged(other)
    a, b = both.nearest_point([1.0, 0, 0]), both.nearest_point([1.0 + gap + 1e-9, 0, 0])
    if gap == 0:
        b = next(k for k in range(len(both.points)) if np.allclose(both.points[k], both.points[a]) and k != a)
    root, tip = both.nearest_point([0, 0, 0]), both.nearest_point([2.0 + gap, 0, 0])
    return both.with_groups(points={"a": [a], "b": [b], "root": [root], "tip": [tip]})


def solved(structure, held, force):
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    x = np.zeros(structure.n_dof)
    x[free] = spsolve(structure.K[free][:, free].tocsc(), force[free])
    return x


def test_bars_joined_rigidly_are_one_bar():
    mesh = two_bars(0.0)
    joined = build_structure(mesh, [beam()], connections=[Rigid("b", "a")])
    whole = build_structure(line(np.array([[0, 0, 0], [2.0, 0, 0]]), 4), [beam()])
    found = [frequencies(s, s.clamped_dofs(g), 4) for s, g in ((joined, "root"), (whole, "start"))]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


@pytest.mark.parametrize("turned", [False, True])
def test_a_rigid_arm_carries_forces_and_moments_over_a_gap(turned):
    """Tip force over bar, rigid arm and bar: w = F sum int M^2 / EI, exact."""
    C = random_rotation(4) if turned else np.eye(3)
    mesh = two_bars(0.5).rotated(C)
    s = build_structure(mesh, [beam()], connections=[Rigid("b", "a")])
    F = np.zeros((len(mesh.points), 3))
    F[mesh.group_points("tip")[0]] = C @ [0, 0, 1.0]
    x = solved(s, s.clamped_dofs("root"), s.translation.T @ F.ravel())
    w = (C.T @ (s.translation @ x).reshape(-1, 3)[mesh.group_points("tip")[0]])[2]
    EI = 70e9 * np.pi * 0.02**4 / 4
    assert w == pytest.approx((2.5**3 - 1.5**3 + 1.0) / (3 * EI), rel=1e-9)


def test_rigid_connection_of_some_components_in_skew_axes_is_a_hinge():
    """All but the rotation about a skew hinge axis follows: a moment about the axis is not passed on."""
    axes = random_rotation(2)
    s = build_structure(two_bars(0.0), [beam()], connections=[Rigid("b", "a", ("x", "y", "z", "ry", "rz"), axes)])
    whole = build_structure(two_bars(0.0), [beam()], connections=[Rigid("b", "a")])
    assert s.n_dof == whole.n_dof + 1
    value, phi = np.linalg.eigh(s.K.toarray())
    assert (np.abs(value[:7]) < 1e-8 * value[-1]).all() and value[7] > 1e-9 * value[-1]
    ends = [s.mesh.group_points(g)[0] for g in "ab"]
    turn = (s.rotation @ phi[:, :7]).reshape(-1, 3, 7)
    difference = turn[ends[1]] - turn[ends[0]]
    assert np.abs(axes[1:] @ difference).max() < 1e-9 and np.abs(axes[0] @ difference).max() > 1e-3


def test_a_distributing_interface_adds_no_stiffness_and_spreads_forces():
    """A plate's edge led to a reference: free frequencies as without; a force on it arrives as resultant."""
    mesh = rectangle(1.0, 0.5, 4, 2, "quad")
    members = [Member("surface", "shell", 0.02, METAL)]
    plain = build_structure(mesh, members)
    # the nodes of an edge lie on a line: two opposite edges are needed
    wide = mesh.with_groups(points={"both": np.union1d(mesh.group_points("left"), mesh.group_points("right"))})
    s = build_structure(wide, members, connections=[Distributing("both", (0.3, 0.1, 0.4), name="hook")])
    assert s.n_dof == plain.n_dof
    np.testing.assert_allclose(*(np.linalg.eigvalsh(a.K.toarray())[6:] for a in (s, plain)), rtol=1e-6)
    hook = s.mesh.group_points("hook")[0]
    force, moment = np.array([1.0, -2.0, 3.0]), np.array([0.5, 0.1, -0.3])
    e = np.zeros((2, len(s.mesh.points), 3))
    e[0, hook], e[1, hook] = force, moment
    f = s.translation.T @ e[0].ravel() + s.rotation.T @ e[1].ravel()
    rng = np.random.default_rng(0)
    u0, w = rng.normal(size=(2, 3))
    points = s.mesh.points
    # work in a rigid motion
    motion = np.linalg.lstsq(
        np.concatenate([plain.translation @ np.eye(plain.n_dof), plain.rotation @ np.eye(plain.n_dof)]),
        np.concatenate([(u0 + np.cross(w, points[:-1])).ravel(), np.tile(w * [1, 1, 0], (len(points) - 1, 1)).ravel()]),
        rcond=None,
    )[0]
    assert f @ motion == pytest.approx(force @ (u0 + np.cross(w, points[hook])) + moment @ w, rel=1e-9)


def test_solids_take_moments_through_a_rigid_face():
    """A block on a rigid end face with a reference in its middle, twisted: T L / G J of the square bar."""
    mesh = box(4.0, 1.0, 1.0, 6, 2, 2, "hexahedron20")
    s = build_structure(
        mesh,
        [Member("volume", "solid", material=METAL)],
        connections=[Rigid("right", (4.0, 0.5, 0.5), ("x", "y", "z"), name="end")],
    )
    end = s.mesh.group_points("end")[0]
    e = np.zeros((len(s.mesh.points), 3))
    e[end, 0] = 1.0
    held = s.clamped_dofs("left")
    x = solved(s, held, s.rotation.T @ e.ravel())
    turn = (s.rotation @ x).reshape(-1, 3)[end, 0]
    J = 0.1406  # of a unit square (Saint-Venant); ends that cannot warp are a little stiffer
    assert 0.9 * 4.0 / (METAL.G * J) < turn < 4.0 / (METAL.G * J)


def test_a_mass_on_a_bare_reference_node_moves_with_the_group():
    """A mass with inertia on an arm: the same as a point mass with offset at the node itself."""
    mesh = line(np.array([[0, 0, 0], [1.0, 0, 0]]), 4)
    inertia = np.diag([0.1, 0.2, 0.15])
    points = np.concatenate([mesh.points, [[1.0, 0.2, 0.3]]])
    more = Mesh(points, mesh.cells, mesh.cell_groups, {**mesh.point_groups, "load": [len(mesh.points)]})
    arm = build_structure(more, [beam()], [PointMass("load", 3.0, inertia)], connections=[Rigid("load", "end")])
    known = build_structure(mesh, [beam()], [PointMass("end", 3.0, inertia, (0.0, 0.2, 0.3))])
    found = [frequencies(s, s.clamped_dofs("start"), 4) for s in (arm, known)]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


def test_an_equation_makes_a_gear():
    """rx of one bar's end = -2 rx of the other's: stiffness of the train."""
    mesh = two_bars(0.5)
    s = build_structure(mesh, [beam()], connections=[Equation((Term("b", "rx", 1.0), Term("a", "rx", 2.0)))])
    e = np.zeros((len(mesh.points), 3))
    e[mesh.group_points("tip")[0], 0] = 1.0
    held = np.union1d(s.clamped_dofs("root"), s.held_dofs({"b": ("x", "y", "z", "ry", "rz")}))
    held = np.union1d(held, s.held_dofs({"a": ("x", "y", "z", "ry", "rz")}))
    x = solved(s, held, s.rotation.T @ e.ravel())
    turn = (s.rotation @ x).reshape(-1, 3)[mesh.group_points("tip")[0], 0]
    GJ = METAL.G * np.pi * 0.02**4 / 2
    assert turn == pytest.approx(1 / GJ + 4 / GJ, rel=1e-9)
