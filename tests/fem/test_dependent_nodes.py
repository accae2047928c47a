"""Connections against the null space of their equations, written out node by node."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import METAL, random_rotation

from femflex.fem import Distributing, Equation, Member, MultiPointConstraint, Rigid, Term, build_structure
from femflex.fem.sections import Circle
from femflex.mesh import Mesh

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
def test_nodes_on_a_rigid_arm_follow_along_skew_axes_and_nothing_else(components):
    s = bars([Rigid("two", "n1", components, AXES)], groups={"two": [4, 6]})
    own = np.kron(np.eye(2), AXES)
    equations = []
    for node in (4, 6):
        arm = rigid_rows(POINTS[node] - POINTS[1])
        for name in components:
            way = own[COMPONENTS.index(name)]
            equations.append(equation(7, (node, way), (1, -way @ arm)))
    check(s, equations, FREE)


def test_a_mean_motion_has_the_weights_of_its_nodes_and_the_arm_from_their_weighted_centre():
    """Weighted least squares over the rigid motions of the leading nodes, by the normal equations of the six."""
    weights, leading, place = (0.5, 2.0, 1.3, 0.2), [1, 2, 4, 6], np.array([0.4, -0.7, 1.1])
    s = bars([Distributing("four", tuple(place), weights, "hook")], groups={"four": leading})
    assert s.mesh.group_points("hook").tolist() == [7] and s.mesh.points[7] == pytest.approx(place)
    rows = [rigid_rows(POINTS[k] - place)[:3] for k in leading]
    normal = sum(w * r.T @ r for w, r in zip(weights, rows, strict=True))
    fit = [np.linalg.solve(normal, w * r.T) for w, r in zip(weights, rows, strict=True)]
    equations = []
    for k, way in enumerate(np.eye(6)):
        terms = [(node, np.append(-one[k], [0, 0, 0])) for node, one in zip(leading, fit, strict=True)]
        equations.append(equation(8, (7, way), *terms))
    check(s, equations, FREE + 6)


def test_a_general_constraint_takes_translations_and_rotations_of_several_leaders():
    components, leaders = ("z", "rx", "y"), (0, 2, 5)
    matrix = RNG.normal(size=(3, 18))
    s = bars([MultiPointConstraint("n4", components, ("n0", "n2", "n5"), matrix, AXES)])
    own = np.kron(np.eye(2), AXES)
    equations = []
    for row, name in zip(matrix.reshape(3, 3, 6), components, strict=True):
        terms = [(node, -part) for node, part in zip(leaders, row, strict=True)]
        equations.append(equation(7, (4, own[COMPONENTS.index(name)]), *terms))
    check(s, equations, FREE)


def test_two_constraints_at_right_angles_at_one_node_hold_together():
    """Each has a leader and factors of its own; the second also drags the node by its third component."""
    first, second = RNG.normal(size=(1, 6)), RNG.normal(size=(1, 12))
    second[0, 6:] = np.append(0.3 * AXES[2], [0, 0, 0])
    s = bars([
        MultiPointConstraint("n4", ("x",), ("n0",), first, AXES),
        MultiPointConstraint("n4", ("y",), ("n2", "n4"), second, AXES),
    ])  # fmt: skip
    along = [np.append(AXES[k], [0, 0, 0]) for k in (0, 1)]
    equations = [
        equation(7, (4, along[0]), (0, -first[0])),
        equation(7, (4, along[1]), (2, -second[0, :6]), (4, -second[0, 6:])),
    ]
    check(s, equations, FREE)


def test_an_equation_divides_by_its_first_factor_and_keeps_the_components_apart():
    terms = (Term("n5", "ry", -2.5), Term("n0", "z", 0.7), Term("n2", "rx", 1.1), Term("n5", "rz", 0.4))
    s = bars([Equation(terms)])
    nodes = (5, 0, 2, 5)
    row = np.zeros((7, 6))
    for node, term in zip(nodes, terms, strict=True):
        row[node, COMPONENTS.index(term.component)] += term.factor
    check(s, [row.ravel()], FREE)
