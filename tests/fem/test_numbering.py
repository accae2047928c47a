"""Numbers of dofs: ties, supports of second-order groups, twists, and sums on raw and on independent dofs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg, sparse
from support.plate_models import METAL, random_rotation

from femflex.fem import Member, Support, antisymmetry, build_structure, symmetry
from femflex.fem.assembly import Assembler, Part
from femflex.fem.assembly.conditions import conditions
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.assembly.support_dofs import held_columns
from femflex.fem.sections import CableSection, Circle, Rectangle
from femflex.mesh import Mesh, line, rectangle

TIES = {
    "a chain": [(0, 1, 2.0), (1, 2, -3.0), (2, 4, 0.5)],
    "followers of two dofs": [(0, 1, 2.0), (2, 3, 5.0), (1, 3, 7.0)],
    "a ring that fits": [(0, 1, 2.0), (1, 2, 3.0), (0, 2, 6.0), (4, 3, -1.0)],
    "a ring that does not": [(0, 1, 2.0), (1, 2, 3.0), (0, 2, 5.0), (4, 3, -1.5)],
    "a tie to one that is zero": [(0, 1, 2.0), (0, 1, 3.0), (1, 4, 2.5), (2, 3, 4.0)],
}


@pytest.mark.parametrize("name", TIES)
def test_ties_leave_the_solutions_of_their_equations(name):
    numbering = Numbering(1)
    numbering.extra(7)
    C = np.zeros((len(TIES[name]), 7))
    for row, (first, second, factor) in zip(C, TIES[name], strict=True):
        numbering.tie(first + 1, second + 1, factor)
        row[second + 1] += 1.0
        row[first + 1] -= factor
    T, known = numbering.independent().toarray(), linalg.null_space(C)
    assert T.shape == known.shape
    assert np.abs(C @ T).max() < 1e-12 and np.linalg.matrix_rank(T) == known.shape[1]


@pytest.mark.parametrize("cell", ["line", "line3"])
def test_a_clamp_of_all_of_a_line_leaves_nothing_to_move(cell):
    """With the bubbles of both halves of second-order cells."""
    s = build_structure(line([[0, 0, 0], [1, 2, 2]], 3, cell), [Member("line", "beam", Circle(0.02), METAL)])
    assert np.array_equal(s.clamped_dofs("line"), np.arange(s.n_dof))


@pytest.mark.parametrize(("cell", "order"), [("line", 1), ("line", 2), ("line", 6), ("line3", 2), ("line3", 5)])
def test_a_clamp_of_all_of_a_rope_leaves_nothing_to_move(cell, order):
    member = Member("line", "tether", CableSection(1e5, 0.1), None, {"order": order, "prestress": 1.0})
    s = build_structure(line([[0, 0, 0], [1, 2, 2]], 3, cell), [member])
    assert np.array_equal(s.clamped_dofs("line"), np.arange(s.n_dof))
    assert s.n_dof == 3 * (3 * order + 1)  # polynomials of that order, continuous


def test_triangles_of_a_membrane_share_the_functions_of_their_sides():
    """Nodes and sides, whichever way round the triangles run along them; a clamp of the edge holds its sides."""
    film = [Member("surface", "membrane", 1e-4, METAL, {"prestress": 20.0})]
    s = build_structure(rectangle(1.0, 1.0, 2, 3), film)
    nodes, triangles, rim = 12, 12, 10
    sides = (3 * triangles + rim) // 2
    assert s.n_dof == 3 * (nodes + sides)
    assert len(s.clamped_dofs("left")) == 3 * (4 + 3) and len(s.clamped_dofs("left", ("y",))) == 4 + 3


def test_directions_of_supports_at_one_node_add_up_however_close():
    """Held along x and along a direction 15 degrees from it: free across the plane of the two alone."""
    c, n = np.cos(np.radians(15)), np.sin(np.radians(15))
    close = Support(("x",), ((c, n, 0), (-n, c, 0), (0, 0, 1.0)))
    mesh = line([[0, 0, 0], [1, 2, 2]], 2).with_groups(points={"a": [1], "b": [1]})
    for supports, count in (({"a": ("x",), "b": close}, 2), ({"a": close, "b": ("z", "x")}, 3), ({"b": close}, 1)):
        s = build_structure(mesh, [Member("line", "beam", Circle(0.02), METAL)], supports=supports)
        held = s.held_dofs(supports)
        assert len(held) == count
        free = np.setdiff1d(np.arange(s.n_dof), held)
        moves = s.translation.toarray()[3:6][:, free]
        assert np.abs([c, n, 0] @ moves).max() < 1e-12
        assert np.linalg.matrix_rank(moves) == 3 - count


@pytest.mark.parametrize("seed", range(6))
def test_columns_that_rows_set_to_zero_are_those_of_their_null_space(seed):
    """Rows on several apart groups of columns, some of full rank, some not: all zero, or none where some are free."""
    rng = np.random.default_rng(seed)
    blocks = [rng.normal(size=(2, 2)), [[1.5]], rng.normal(size=(3, 2)), np.zeros((1, 2))]
    if seed % 2:
        blocks.insert(seed // 2, rng.normal(size=(1, 2)))
    A = linalg.block_diag(*blocks)
    A = A[rng.permutation(len(A))][:, rng.permutation(A.shape[1])]
    found, kept = held_columns(sparse.csr_array(A)), linalg.null_space(A)
    seen = np.flatnonzero(np.abs(A).max(axis=0) > 0)
    if np.abs(kept[seen]).max(initial=0.0) > 1e-9:
        assert found is None
    else:
        assert found.tolist() == seen.tolist()


def test_halves_of_curved_edges_lie_on_their_group_and_their_chords_too():
    mesh = rectangle(1.0, 1.0, 1, 1, "quad9")
    (found,) = conditions(mesh, {"left": ("x",)})
    low, middle, high = (mesh.nearest_point([0, y, 0]) for y in (0, 0.5, 1.0))
    across = mesh.nearest_point([1.0, 0, 0])
    assert found.contains(np.array([[low, middle], [high, middle], [low, across]])).tolist() == [True, True, False]
    assert found.contains(np.array([[low, high]])).tolist() == [True]  # plates take the corners of second-order cells


def test_a_group_of_points_or_of_single_point_cells_has_no_edges_of_its_own():
    base = rectangle(1.0, 1.0, 1, 1, "quad")
    two = np.array([base.nearest_point([0, 0, 0]), base.nearest_point([1, 1, 0])])
    dots = Mesh(base.points, {**base.cells, "vertex": two[:, None]}, {**base.cell_groups, "dots": {"vertex": [0, 1]}})
    dots = dots.with_groups(points={"two": two})
    for group in ("two", "dots"):
        (found,) = conditions(dots, {group: ("x",)})
        assert found.edges is None and found.contains(two[None]).tolist() == [True]


def test_a_twist_at_a_point_is_held_by_a_full_clamp_alone():
    """A corner of a plate of rectangles: w, two slopes, u, v and the twist."""
    s = build_structure(rectangle(1.0, 0.7, 2, 2, "quad"), [Member("surface", "plate_bfs", 0.01, METAL)])
    corner = "bottom_left"
    assert len(s.clamped_dofs(corner)) == 6
    assert len(s.clamped_dofs(corner, ("rx", "ry", "rz"))) == 2
    assert len(s.clamped_dofs(corner, ("x", "y", "z"))) == 3
    assert len(s.clamped_dofs(corner, ("z", "rx", "ry"))) == 3


@pytest.mark.parametrize(("family", "cell"), [("plate", "triangle"), ("plate_bfs", "quad"), ("shell", "quad9")])
def test_skew_supports_leave_the_motions_that_fulfil_them(family, cell):
    """Against the null space of the same conditions on a structure that knows nothing of them."""
    C = random_rotation(21)
    mesh = rectangle(1.0, 0.7, 2, 2, cell).rotated(C)
    c, n = np.cos(0.6), np.sin(0.6)
    in_plane = np.array([[c, n, 0], [-n, c, 0], [0, 0, 1.0]]) @ C.T
    supports = {
        "bottom_left": Support(("x", "ry"), tuple(map(tuple, in_plane))),
        "bottom_right": Support(("y", "z"), tuple(map(tuple, random_rotation(23)))),
        "top_right": Support(("z", "x", "y"), tuple(map(tuple, random_rotation(24)))),
    }
    member = [Member("surface", family, 0.02, METAL)]
    s, plain = build_structure(mesh, member, supports=supports), build_structure(mesh, member)
    held = s.held_dofs(supports)
    free = np.setdiff1d(np.arange(s.n_dof), held)
    rows, moves = [], []
    for group, support in supports.items():
        node = mesh.group_points(group)[0]
        for name in support.components:
            way = np.array(support.axes)["xyz".index(name[-1])]
            for one, into in ((s, rows), (plain, moves)):
                operator = one.rotation if name[0] == "r" else one.translation
                into.append(way @ operator.toarray()[3 * node : 3 * node + 3])
    assert np.abs(np.array(rows)[:, free]).max() < 1e-12
    kept = linalg.null_space(np.array(moves))
    assert len(free) == kept.shape[1]
    K = kept.T @ plain.K @ kept
    M = kept.T @ plain.M @ kept
    exact = np.sqrt(np.abs(linalg.eigh(K, M, eigvals_only=True)))
    own = np.sqrt(np.abs(linalg.eigh(s.K[free][:, free].toarray(), s.M[free][:, free].toarray(), eigvals_only=True)))
    assert own[1:] == pytest.approx(exact[1:], rel=1e-6)


@pytest.mark.parametrize("slope", [0.4, -2.0])
def test_the_order_of_supports_at_a_corner_does_not_matter(slope):
    """A plate that meets a plane of symmetry at a flat or at a steep angle, whose corner slides on another support."""
    flat = rectangle(1.0, 0.8, 2, 2)
    x, y, _ = flat.points.T
    mesh = Mesh(np.stack([x, y, slope * x], axis=1), flat.cells, flat.cell_groups, flat.point_groups)
    both = {"left": symmetry((1, 0, 0)), "bottom": ("y",), "top": antisymmetry((0, 1, 0))}
    found = []
    for names in (list(both), list(both)[::-1], ["bottom", "top", "left"]):
        supports = {name: both[name] for name in names}
        s = build_structure(mesh, [Member("surface", "plate", 0.02, METAL)], supports=supports)
        free = np.setdiff1d(np.arange(s.n_dof), s.held_dofs(supports))
        K, M = (A[free][:, free].toarray() for A in (s.K, s.M))
        found.append(linalg.eigh(K, M, eigvals_only=True))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)
    np.testing.assert_allclose(found[2], found[0], rtol=1e-6)


def test_one_assembler_keeps_raw_and_independent_numbers_apart():
    """Two parts on the same numbers, of independent dofs and of raw ones that follow three others each."""
    rng = np.random.default_rng(0)
    T = np.zeros((12, 8))
    T[:4, 4:] = np.eye(4)
    T[4:8] = rng.normal(size=(4, 8))
    T[8:, :4] = np.eye(4)
    first, second = rng.normal(size=(2, 1, 4, 4))
    one, other = np.array([[0, 1, 2, 3]]), np.array([[4, 5, 6, 7]])
    whole = np.zeros((12, 12))
    whole[:4, :4], whole[4:8, 4:8] = first[0], second[0]
    assembler = Assembler(sparse.csr_array(T))
    for _ in range(2):
        found = assembler.total([Part(one, first.__getitem__), Part(other, second.__getitem__)])
        assert found.toarray() == pytest.approx(T.T @ whole @ T, abs=1e-12)


def test_an_assembler_takes_parts_without_elements():
    none = Part(np.zeros((0, 4), np.int64), lambda elements: np.zeros((0, 4, 4)))
    found = Assembler(sparse.eye_array(6, format="csr")).total([none])
    assert found.shape == (6, 6) and found.nnz == 0


def test_elements_that_turn_in_planes_are_summed_as_the_product_of_matrices():
    """Nodes with three rotations on two dofs or on three, translations between others, several elements of each."""
    rng = np.random.default_rng(4)
    T = np.zeros((36, 33))  # six nodes: 3 translations, 3 rotations each
    column = 0
    for node in range(6):
        T[6 * node : 6 * node + 3, column : column + 3] = np.eye(3)
        flat = node not in (1, 4, 5)
        T[6 * node + 3 : 6 * node + 6, column + 3 : column + 5 + (not flat)] = (
            np.linalg.qr(rng.normal(size=(3, 3)))[0][:, :2] if flat else np.eye(3)
        )
        column += 5 + (not flat)
    pairs = np.array([[0, 2], [2, 3], [3, 0], [0, 1], [1, 4], [4, 5], [5, 2], [2, 0], [0, 3]])
    apart = np.concatenate([6 * pairs[:, :, None] + k + np.arange(3) for k in (0, 3)], axis=1).reshape(9, 12)
    mixed = np.concatenate([6 * pairs[:, :1] + np.arange(6), 6 * pairs[:, 1:] + np.arange(6)], axis=1)
    T = T[:, :column]
    for dofs in (apart, mixed, mixed[:, [0, 3, 4, 5, 7, 9, 10, 11]], mixed[:, [3, 4, 5, 9, 10, 11]]):
        values = rng.normal(size=(9, dofs.shape[1], dofs.shape[1]))
        whole = np.zeros((36, 36))
        for rows, matrix in zip(dofs, values, strict=True):
            np.add.at(whole, np.ix_(rows, rows), matrix)
        found = Assembler(sparse.csr_array(T)).total([Part(dofs, values.__getitem__)])
        assert found.toarray() == pytest.approx(T.T @ whole @ T, abs=1e-12)


def released_end(C, components):
    mesh = line([[0, 0, 0], [1.0, 0, 0], [1.6, 0.8, 0.3]], 3).rotated(C)
    inner = mesh.nearest_point(C @ np.array([1.0, 0, 0]))
    far = np.flatnonzero((mesh.cells["line"] == inner).any(axis=1))
    mesh = mesh.with_groups({"rest": {"line": np.setdiff1d(np.arange(len(mesh.cells["line"])), far[-1:])},
                             "last": {"line": far[-1:]}}, {"inner": [inner]})  # fmt: skip
    up = {"orientation": C @ [0.1, 0.2, 1.0], "extent": 2.0}
    members = [
        Member("rest", "beam", Rectangle(0.02, 0.03), METAL, up),
        Member("last", "beam", Rectangle(0.02, 0.03), METAL, {**up, "release": components, "release_at": "inner"}),
    ]
    return build_structure(mesh, members)


@pytest.mark.parametrize("components", ["ry", ["y", "rx", "rz"], ["x", "z"]])
def test_a_released_end_moves_on_its_own_along_its_elements_axes(components):
    """One more motion per component, and no more stiffness: frequencies do not depend on the axes."""
    n = 1 if isinstance(components, str) else len(components)
    s, turned = released_end(np.eye(3), components), released_end(random_rotation(31), components)
    plain = released_end(np.eye(3), ["x"]).n_dof - 1
    assert s.n_dof == plain + n
    value, other = (linalg.eigh(one.K.toarray(), one.M.toarray(), eigvals_only=True) for one in (s, turned))
    np.testing.assert_allclose(value, other, rtol=1e-6, atol=1e-10 * value[-1])
    assert (np.abs(value[: 6 + n]) < 1e-4 * value[6 + n]).all()


def turn_of(arms, moves) -> np.ndarray:
    """The rotation (3,) of points with these arms (k, 3) that move so (k, 3)."""
    rows = np.concatenate([np.cross(np.eye(3), arm).T for arm in arms])
    return np.linalg.lstsq(rows, moves.ravel(), rcond=None)[0]


@pytest.mark.parametrize("components", [("y",), ("x", "rz"), ("ry", "z", "rx")])
def test_an_end_follows_its_node_in_all_but_what_is_released_along_its_own_axes(components):
    """Of two elements of the member, in different directions, the second is released; its drawn end shows how."""
    points = np.array([[0, 0, 0], [1.0, 0.2, 0.1], [1.5, 1.0, 0.3], [1.4, 1.6, 1.2]])
    groups = {"rest": {"line": [2]}, "last": {"line": [0, 1]}}
    mesh = Mesh(points, {"line": [[2, 3], [2, 1], [0, 1]]}, groups, {"joint": [1]})
    up = {"orientation": (0.2, -0.1, 1.0), "extent": 9.0}
    release = {**up, "release": list(components), "release_at": "joint"}
    section = Rectangle(0.02, 0.03)
    s = build_structure(
        mesh, [Member("rest", "beam", section, METAL, up), Member("last", "beam", section, METAL, release)]
    )
    x_axis = (points[1] - points[2]) / np.linalg.norm(points[1] - points[2])
    y_axis = np.array(up["orientation"]) - np.dot(up["orientation"], x_axis) * x_axis
    axes = np.stack([x_axis, y_axis / np.linalg.norm(y_axis), np.cross(x_axis, y_axis) / np.linalg.norm(y_axis)])
    first, part = len(s.skin_parts[0]().points), s.skin_parts[1]().points
    there = np.flatnonzero(
        (np.abs((part - points[1]) @ x_axis) < 1e-9) & (np.linalg.norm(part - points[1], axis=1) < 0.1)
    )
    v = np.random.default_rng(0).normal(size=s.n_dof)
    drawn = (s.skin.operator @ v).reshape(-1, 3)[first + there]
    u, turn = ((A @ v).reshape(-1, 3)[1] for A in (s.translation, s.rotation))
    own = turn_of(part[there] - points[1], drawn - drawn.mean(axis=0))
    apart = np.concatenate([axes @ (drawn.mean(axis=0) - u), axes @ (own - turn)])
    free = np.isin(["x", "y", "z", "rx", "ry", "rz"], components)
    assert np.abs(apart[~free]).max() < 1e-10 and np.abs(apart[free]).min() > 1e-3


def test_refused_releases_name_what_is_missing():
    def words(**options):
        mesh = line([[0, 0, 0], [1.0, 0, 0]], 2).with_groups(points={"far": [2]})
        mesh = Mesh(np.concatenate([mesh.points, [[9.0, 9, 9]]]), mesh.cells, mesh.cell_groups, {"away": [3]})
        with pytest.raises(ValueError) as refusal:
            build_structure(mesh, [Member("line", "beam", Rectangle(0.02, 0.02), METAL, options)])
        return str(refusal.value)

    assert words(release=["x", "q"], release_at="away") == (
        "beam on group 'line' has release ['x', 'q']; name some of ['x', 'y', 'z', 'rx', 'ry', 'rz']"
    )
    assert words(release=[], release_at="away").startswith("beam on group 'line' has release []; name some")
    assert words(release="rx") == (
        "beam on group 'line' has release without release_at; name the point group of the released ends"
    )
    assert words(release="rx", release_at="away") == (
        "beam on group 'line': no element ends at a node of release_at = 'away'"
    )
