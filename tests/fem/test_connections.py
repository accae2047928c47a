"""Connections against closed forms, members that share nodes, and the null space of their equations."""

from __future__ import annotations

import numpy as np
import pytest
from support.closed_forms import static_solution
from support.plate_models import METAL, frequencies, random_rotation

from femflex.fem import (
    Distributing,
    Equation,
    Member,
    MultiPointConstraint,
    PointMass,
    Rigid,
    Term,
    build_structure,
)
from femflex.fem.sections import Circle
from femflex.mesh import Mesh, box, line

BAR = Circle(0.02)


def beam(group="line", **options):
    return Member(group, "beam", BAR, METAL, options)


def two_bars(gap: float) -> Mesh:
    """Bars from 0 to 1 and from 1 + gap to 2 + gap along x; groups "line", ends "a", "b"."""
    first, second = (
        line(np.array([[0, 0, 0], [1.0, 0, 0]]), 2),
        line(np.array([[1.0 + gap, 0, 0], [2.0 + gap, 0, 0]]), 2),
    )
    merged = first.merged(second)
    a, b = merged.nearest_point([1.0, 0, 0]), merged.nearest_point([1.0 + gap + 1e-9, 0, 0])
    if gap == 0:
        b = next(k for k in range(len(merged.points)) if np.allclose(merged.points[k], merged.points[a]) and k != a)
    root, tip = merged.nearest_point([0, 0, 0]), merged.nearest_point([2.0 + gap, 0, 0])
    return merged.with_groups(points={"a": [a], "b": [b], "root": [root], "tip": [tip]})


@pytest.mark.parametrize("turned", [False, True])
def test_rigid_arm_across_gap(turned):
    """Tip force over bar, rigid arm and bar: w = F sum int M^2 / EI, exact."""
    C = random_rotation(4) if turned else np.eye(3)
    mesh = two_bars(0.5).rotated(C)
    s = build_structure(mesh, [beam()], connections=[Rigid("b", "a")])
    F = np.zeros((len(mesh.points), 3))
    F[mesh.group_points("tip")[0]] = C @ [0, 0, 1.0]
    x = static_solution(s, s.translation.T @ F.ravel(), s.clamped_dofs("root"))
    w = (C.T @ (s.translation @ x).reshape(-1, 3)[mesh.group_points("tip")[0]])[2]
    EI = 70e9 * np.pi * 0.02**4 / 4
    assert w == pytest.approx((2.5**3 - 1.5**3 + 1.0) / (3 * EI), rel=1e-9)


def test_partial_rigid_connection_in_skew_axes_is_a_hinge():
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


def test_moment_on_solid_through_rigid_face():
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
    fixed = s.clamped_dofs("left")
    x = static_solution(s, s.rotation.T @ e.ravel(), fixed)
    turn = (s.rotation @ x).reshape(-1, 3)[end, 0]
    J = 0.1406  # of a unit square (Saint-Venant); ends that cannot warp are a little stiffer
    assert 0.9 * 4.0 / (METAL.G * J) < turn < 4.0 / (METAL.G * J)


def test_mass_on_reference_node_without_member():
    """A mass with inertia on an arm: the same as a point mass with offset at the node itself."""
    mesh = line(np.array([[0, 0, 0], [1.0, 0, 0]]), 4)
    inertia = np.diag([0.1, 0.2, 0.15])
    points = np.concatenate([mesh.points, [[1.0, 0.2, 0.3]]])
    more = Mesh(points, mesh.cells, mesh.cell_groups, {**mesh.point_groups, "load": [len(mesh.points)]})
    arm = build_structure(more, [beam()], [PointMass("load", 3.0, inertia)], connections=[Rigid("load", "end")])
    reference = build_structure(mesh, [beam()], [PointMass("end", 3.0, inertia, (0.0, 0.2, 0.3))])
    computed = [frequencies(s, s.clamped_dofs("start"), 4) for s in (arm, reference)]
    np.testing.assert_allclose(computed[0], computed[1], rtol=1e-9)


def test_equation_models_gear():
    """rx of one bar's end = -2 rx of the other's: stiffness of the train."""
    mesh = two_bars(0.5)
    s = build_structure(mesh, [beam()], connections=[Equation((Term("b", "rx", 1.0), Term("a", "rx", 2.0)))])
    e = np.zeros((len(mesh.points), 3))
    e[mesh.group_points("tip")[0], 0] = 1.0
    fixed = np.union1d(s.clamped_dofs("root"), s.constrained_dofs({"b": ("x", "y", "z", "ry", "rz")}))
    fixed = np.union1d(fixed, s.constrained_dofs({"a": ("x", "y", "z", "ry", "rz")}))
    x = static_solution(s, s.rotation.T @ e.ravel(), fixed)
    turn = (s.rotation @ x).reshape(-1, 3)[mesh.group_points("tip")[0], 0]
    GJ = METAL.G * np.pi * 0.02**4 / 2
    assert turn == pytest.approx(1 / GJ + 4 / GJ, rel=1e-9)


RNG = np.random.default_rng(5)


POINTS = np.array([
    [0.0, 0.1, 0.2], [1.0, 0.3, -0.1], [1.7, 1.1, 0.4],  # one bent bar
    [2.0, -0.5, 0.3], [2.9, 0.2, 0.8], [3.1, 1.4, 0.1], [4.2, 1.0, -0.7],  # and another
])  # fmt: skip


CELLS = np.array([[0, 1], [1, 2], [3, 4], [4, 5], [5, 6]])


NAMES = {f"n{k}": [k] for k in range(7)}


AXES = random_rotation(8)


COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")


def bars(connections=(), more=(), groups=None):
    points = np.concatenate([POINTS, np.reshape(more, (-1, 3))])
    mesh = Mesh(points, {"line": CELLS}, {"line": {"line": np.arange(5)}}, {**NAMES, **(groups or {})})
    return build_structure(mesh, [Member("line", "beam", Circle(0.02), METAL)], connections=connections)


def motion_of(structure) -> np.ndarray:
    """Rows (n_points, 6, n_dof) of translations and rotations of the nodes."""
    n = len(structure.mesh.points)
    moves, turns = (A.toarray().reshape(n, 3, -1) for A in (structure.translation, structure.rotation))
    return np.concatenate([moves, turns], axis=1)


def check(structure, equations: list[np.ndarray], free: int) -> None:
    """Every motion fulfils the equations (6 n_points,), and no other motion is lost: free dofs less their rank."""
    rows = motion_of(structure).reshape(-1, structure.n_dof)
    C = np.array(equations)
    assert np.abs(C @ rows).max() < 1e-12
    assert structure.n_dof == free - np.linalg.matrix_rank(C)
    assert np.linalg.matrix_rank(structure.T.toarray()) == structure.n_dof


def equation(n: int, *terms: tuple[int, np.ndarray]) -> np.ndarray:
    row = np.zeros((n, 6))
    for node, factors in terms:
        row[node] += factors
    return row.ravel()


def rigid_rows(r: np.ndarray) -> np.ndarray:
    """(6, 6): motion of a point at r from the motion of the point it is fixed to."""
    cross = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    return np.block([[np.eye(3), -cross], [np.zeros((3, 3)), np.eye(3)]])


FREE = bars().n_dof


@pytest.mark.parametrize("components", [("y",), ("x", "z", "rx"), ("rz", "rx"), ("y", "x", "z", "ry"), COMPONENTS])
def test_rigid_connection_along_skew_axes(components):
    s = bars([Rigid("two", "n1", components, AXES)], groups={"two": [4, 6]})
    own = np.kron(np.eye(2), AXES)
    equations = []
    for node in (4, 6):
        arm = rigid_rows(POINTS[node] - POINTS[1])
        for name in components:
            way = own[COMPONENTS.index(name)]
            equations.append(equation(7, (node, way), (1, -way @ arm)))
    check(s, equations, FREE)


def test_distributing_connection_with_weights():
    """Weighted least squares over the rigid motions of the leading nodes, by the normal equations of the six."""
    weights, leading, place = (0.5, 2.0, 1.3, 0.2), [1, 2, 4, 6], np.array([0.4, -0.7, 1.1])
    s = bars([Distributing("four", tuple(place), weights, name="hook")], groups={"four": leading})
    assert s.mesh.group_points("hook").tolist() == [7] and s.mesh.points[7] == pytest.approx(place)
    rows = [rigid_rows(POINTS[k] - place)[:3] for k in leading]
    normal = sum(w * r.T @ r for w, r in zip(weights, rows, strict=True))
    fit = [np.linalg.solve(normal, w * r.T) for w, r in zip(weights, rows, strict=True)]
    equations = []
    for k, way in enumerate(np.eye(6)):
        terms = [
            (node, np.append(-coefficients[k], [0, 0, 0])) for node, coefficients in zip(leading, fit, strict=True)
        ]
        equations.append(equation(8, (7, way), *terms))
    check(s, equations, FREE + 6)


def test_multi_point_constraint_with_several_leaders():
    components, leaders = ("z", "rx", "y"), (0, 2, 5)
    matrix = RNG.normal(size=(3, 18))
    s = bars([MultiPointConstraint("n4", components, ("n0", "n2", "n5"), matrix, AXES)])
    own = np.kron(np.eye(2), AXES)
    equations = []
    for row, name in zip(matrix.reshape(3, 3, 6), components, strict=True):
        terms = [(node, -part) for node, part in zip(leaders, row, strict=True)]
        equations.append(equation(7, (4, own[COMPONENTS.index(name)]), *terms))
    check(s, equations, FREE)


def test_equation_with_factors_and_components():
    terms = (Term("n5", "ry", -2.5), Term("n0", "z", 0.7), Term("n2", "rx", 1.1), Term("n5", "rz", 0.4))
    s = bars([Equation(terms)])
    nodes = (5, 0, 2, 5)
    row = np.zeros((7, 6))
    for node, term in zip(nodes, terms, strict=True):
        row[node, COMPONENTS.index(term.component)] += term.factor
    check(s, [row.ravel()], FREE)
