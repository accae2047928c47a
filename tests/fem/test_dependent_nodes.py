"""Connections against the null space of their equations, written out node by node."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import METAL, random_rotation

from femflex.fem import Distributing, Equation, Material, Member, MultiPointConstraint, Rigid, Term, build_structure
from femflex.fem.sections import Circle
from femflex.mesh import Mesh, box

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


def test_a_rigid_arm_in_two_directions_leaves_the_third_to_a_constraint():
    matrix = RNG.normal(size=(1, 6))
    arm = Rigid("n4", "n1", ("x", "z"), AXES)
    s = bars([arm, MultiPointConstraint("n4", ("y",), ("n6",), matrix, AXES)])
    equations = [equation(7, (4, np.append(AXES[1], [0, 0, 0])), (6, -matrix[0]))]
    for k in (0, 2):
        way = np.append(AXES[k], [0, 0, 0])
        equations.append(equation(7, (4, way), (1, -way @ rigid_rows(POINTS[4] - POINTS[1]))))
    check(s, equations, FREE)


def test_a_constraint_that_says_nothing_changes_nothing():
    """A component that follows itself: 0 = 0."""
    itself = np.zeros((1, 6))
    itself[0, 1] = 1.0
    nothing = MultiPointConstraint("n4", ("y",), ("n4",), itself)
    s = bars([nothing])
    assert s.n_dof == FREE
    turning = np.array([[0, 0, 0, 0.3, -0.2, 0.6]])  # nor does a leader that leads by its rotation alone
    s = bars([nothing, MultiPointConstraint("n5", ("z",), ("n2",), turning)])
    check(s, [equation(7, (5, np.eye(6)[2]), (2, -turning[0]))], FREE)


def test_a_constraint_on_rotations_alone_leaves_the_translations_free():
    matrix = RNG.normal(size=(2, 6))
    s = bars([MultiPointConstraint("n4", ("rz", "rx"), ("n0",), matrix, AXES)])
    ways = np.kron(np.eye(2), AXES)[[5, 3]]
    check(s, [equation(7, (4, way), (0, -row)) for way, row in zip(ways, matrix, strict=True)], FREE)


def test_a_node_of_no_weight_has_no_part_in_a_mean_motion():
    place, leading, weights = (0.4, -0.7, 1.1), [1, 2, 4, 6], (0.5, 0.0, 1.3, 0.2)
    some, all_ = (
        bars([Distributing("led", place, w)], groups={"led": nodes})
        for nodes, w in (([1, 4, 6], (0.5, 1.3, 0.2)), (leading, weights))
    )
    np.testing.assert_allclose(motion_of(all_)[7], motion_of(some)[7], atol=1e-12)


def test_an_equation_divides_by_its_first_factor_and_keeps_the_components_apart():
    terms = (Term("n5", "ry", -2.5), Term("n0", "z", 0.7), Term("n2", "rx", 1.1), Term("n5", "rz", 0.4))
    s = bars([Equation(terms)])
    nodes = (5, 0, 2, 5)
    row = np.zeros((7, 6))
    for node, term in zip(nodes, terms, strict=True):
        row[node, COMPONENTS.index(term.component)] += term.factor
    check(s, [row.ravel()], FREE)


def test_a_leader_without_member_moves_on_its_own_and_its_rotation_counts_as_zero():
    """A bare grid point leads by its translation; what it would give by rotating is left out."""
    matrix = RNG.normal(size=(1, 6))
    s = bars([MultiPointConstraint("n4", ("x",), ("bare",), matrix)], [[9.0, 9.0, 9.0]], {"bare": [7]})
    row = equation(8, (4, np.eye(6)[0]), (7, np.append(-matrix[0, :3], [0, 0, 0])))
    check(s, [row], FREE + 3)


def test_nodes_of_solids_follow_by_their_translations_alone():
    """A constraint on rotations of a node that has none is left out, those on its translations are kept."""
    mesh = box(1.0, 1.0, 1.0, 1, 1, 1, "hexahedron20")
    near, far = (mesh.nearest_point(at) for at in ([0, 0, 0], [1, 1, 1]))
    mesh = mesh.with_groups(points={"near": [near], "far": [far]})
    member = Member("volume", "solid", material=Material(70e9, 0.3, 2700.0))
    matrix = np.zeros((2, 6))
    matrix[0, :3], matrix[1, :3] = (0.2, -0.4, 0.1), (1.0, 2.0, 3.0)
    constraint = MultiPointConstraint("far", ("y", "rz"), ("near",), matrix)
    s, whole = (build_structure(mesh, [member], connections=c) for c in ([constraint], []))
    assert s.n_dof == whole.n_dof - 1
    moves = s.translation.toarray().reshape(len(mesh.points), 3, -1)
    np.testing.assert_allclose(moves[far, 1], matrix[0, :3] @ moves[near], atol=1e-13)


def words(connection, more=(), groups=None) -> str:
    with pytest.raises(ValueError) as refusal:
        bars([connection], more, groups)
    return str(refusal.value)


def test_refusals_name_the_connection_the_group_and_what_was_found():
    one = np.zeros((1, 6))
    named = MultiPointConstraint("n1", ("x",), ("line",), one, name="MPC 12")
    assert words(named) == "MPC 12: group 'line' has 7 nodes; name groups of one node"
    plain = MultiPointConstraint("line", ("x",), (), np.zeros((1, 0)))
    assert words(plain) == "the linear connection of group 'line': group 'line' has 7 nodes; name groups of one node"
    bare = Equation((Term("n1", "x", 1.0), Term("bare", "ry", 1.0)))
    assert words(bare, [[9.0, 9, 9]], {"bare": [7]}) == (
        "the equation of n1.x, bare.ry: no member gives the node of group 'bare' a rotation; name another"
    )
    bare = Equation((Term("bare", "z", 1.0),))
    assert words(bare, [[9.0, 9, 9]], {"bare": [7]}) == (
        "the equation of bare.z: no member gives the node of group 'bare' a translation; name another"
    )
    some = Distributing("some", (0.0, 0.0, 0.0))
    assert words(some, [[9.0, 9, 9], [8.0, 9, 9]], {"some": [1, 7, 8]}).startswith(
        "the distributing connection of group 'some' has 3 nodes, 2 of them on no member; name a group"
    )
    assert words(Distributing("four", (0.0, 0, 0), (1.0, 2.0, -1.0, 1.0)), groups={"four": [1, 2, 4, 6]}).startswith(
        "the distributing connection of group 'four' has 4 weights for 4 nodes; give one, not negative, for each"
    )
    assert words(Rigid("n4", (0.0, np.nan, 0.0))) == (
        "reference of the connection to group 'n4' is (0.0, nan, 0.0); give a group or a position"
    )
    assert words(Rigid("n4", "line")).startswith("reference 'line' of the connection to group 'n4' has 7 nodes; name")
    many = bars([Rigid("n4", (0.0, 0.5, 0.0))])
    assert many.mesh.group_points("n4 reference").tolist() == [7]
    with pytest.raises(ValueError) as refusal:
        bars([Rigid("n4", "n1", name="arm"), MultiPointConstraint("n4", ("x",), ("n0",), one + 1.0, name="MPC 3")])
    assert "the rigid connection of group 'n4' to 'arm'" in str(refusal.value)
    assert "MPC 3" in str(refusal.value)


def test_a_circle_names_all_that_are_in_it_and_no_other():
    ring = [Rigid("n4", "n1", name="one"), Rigid("n6", "n4", name="two"), Rigid("n1", "n6", name="three")]
    with pytest.raises(ValueError) as refusal:
        bars([*ring, Rigid("n2", "n0", name="apart")])
    said = str(refusal.value)
    assert all(f"to '{name}'" in said for name in ("one", "two", "three")) and "apart" not in said
    places = [said.index(f"to '{name}'") for name in ("three", "one", "two")]  # of n1, n4 and n6, in this order
    assert places == sorted(places)
    assert said.endswith("depend on each other in a cycle; a node may depend only on nodes that do not depend on it")
