"""Directors, known surfaces and rotations about the normal of shells, on meshes without symmetry."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import METAL

from femflex.fem import Member, build_structure
from femflex.fem.sections import Circle
from femflex.fem.sections.laminates import isotropic
from femflex.fem.shell.directors import directors
from femflex.fem.shell.surface import gradient, normals
from femflex.mesh import Mesh, line, rectangle


def fan(*angles: float) -> tuple[np.ndarray, np.ndarray]:
    """Squares that hang together by edges along y, at these angles from the x axis, one after the other."""
    x, points = np.zeros(2), [[0, 0, 0], [0, 1.0, 0]]
    for a in angles:
        x = x + np.array([np.cos(a), np.sin(a)])
        points += [[x[0], 0, x[1]], [x[0], 1.0, x[1]]]
    k = 2 * np.arange(len(angles))[:, None]
    return np.array(points), k + np.array([0, 2, 3, 1])


def test_elements_share_directors_below_the_fold_angle_and_keep_their_own_above():
    """Bends of 10, 25 and 15 degrees: a limit of 20 splits the middle one; shared ones are means of unit normals."""
    bends = np.radians([0, 10, 35, 50])
    points, cells = fan(*bends)
    own = np.stack([-np.sin(bends), 0 * bends, np.cos(bends)], axis=1)
    found = directors(points, {"quad": cells}, np.radians(20))
    mean = own[:-1] + own[1:]
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    left = [own[0], mean[0], own[2], mean[2]]
    right = [mean[0], own[1], mean[2], own[3]]
    assert found.V["quad"][:, [0, 3]] == pytest.approx(np.repeat(np.array(left)[:, None], 2, axis=1))
    assert found.V["quad"][:, [1, 2]] == pytest.approx(np.repeat(np.array(right)[:, None], 2, axis=1))
    assert len(found.node) == 10 + 2 and np.sort(found.node).tolist() == sorted([*range(10), 4, 5])
    assert found.vector[found.number["quad"]] == pytest.approx(found.V["quad"])
    assert found.node[found.number["quad"]].tolist() == cells.tolist()


@pytest.mark.parametrize("back", [0, 1, 2])
def test_an_element_numbered_the_other_way_round_has_the_same_directors_upside_down(back):
    bends = np.radians([0, 10, 15])
    points, cells = fan(*bends)
    plain = directors(points, {"quad": cells}, np.radians(20)).V["quad"]
    turned = cells.copy()
    turned[back] = cells[back][[0, 3, 2, 1]]
    found = directors(points, {"quad": turned}, np.radians(20)).V["quad"]
    assert found[back][[0, 3, 2, 1]] == pytest.approx(-plain[back])
    others = [k for k in range(3) if k != back]
    assert found[others] == pytest.approx(plain[others])


def test_known_normals_keep_the_side_of_every_element():
    points, cells = fan(0.0, 0.1)
    cells[1] = cells[1][[0, 3, 2, 1]]
    exact = np.array([0.3, 0.2, 1.0]) / np.sqrt(1.13)
    found = directors(points, {"quad": cells}, np.radians(20), lambda x: np.tile(exact, (len(x), 1))).V["quad"]
    assert found[0] == pytest.approx(np.tile(exact, (4, 1))) and found[1] == pytest.approx(np.tile(-exact, (4, 1)))


def test_normals_of_a_formula_are_its_gradient():
    x = np.random.default_rng(0).uniform(0.5, 2.0, (20, 3))
    text = "x**2 * y + sin(z) - 3 * y * z"
    exact = np.stack([2 * x[:, 0] * x[:, 1], x[:, 0] ** 2 - 3 * x[:, 2], np.cos(x[:, 2]) - 3 * x[:, 1]], axis=1)
    assert gradient(text, x, 2.0) == pytest.approx(exact, rel=1e-7)
    assert normals(text, x, "g") == pytest.approx(exact / np.linalg.norm(exact, axis=1, keepdims=True), rel=1e-7)


def on_cylinder(angles, lift=(), lengths=(0.0, 0.5, 0.6), **options):
    """Cells on a cylinder of radius 2 about y, of unequal size; nodes lifted off it by these lengths."""
    n, m = len(angles), len(lengths)
    radius = np.full((n, m), 2.0)
    for (i, j), off in lift:
        radius[i, j] += off
    a, y = np.meshgrid(angles, lengths, indexing="ij")
    points = np.stack([radius * np.sin(a), y, radius * np.cos(a)], axis=-1).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n - 1), np.arange(m - 1), indexing="ij"))
    cells = np.stack([i * m + j, (i + 1) * m + j, (i + 1) * m + j + 1, i * m + j + 1], axis=1)
    mesh = Mesh(points, {"quad": cells}, {"surface": {"quad": np.arange(len(cells))}})
    options = {"surface": "x**2 + z**2 - 4", **options}
    return points, build_structure(mesh, [Member("surface", "shell", 0.2, METAL, options)])


ANGLES = np.array([0.0, 0.05, 0.35, 0.5])


def test_nodes_come_to_lie_on_the_surface_and_those_that_moved_are_counted():
    points, s = on_cylinder(ANGLES, [((1, 0), 0.004), ((2, 1), -0.003), ((3, 2), 0.002)])
    radial = points * [1, 0, 1] / np.linalg.norm(points * [1, 0, 1], axis=1, keepdims=True)
    assert s.mesh.points == pytest.approx(2 * radial + points * [0, 1, 0], abs=1e-12)
    assert s.notes[-1] == "3 of 12 nodes of shell on group 'surface' are moved onto its surface, by up to 0.004 m"
    assert not on_cylinder(ANGLES)[1].notes and not on_cylinder(ANGLES, [((1, 1), 3e-11)])[1].notes


def test_a_node_is_far_off_against_the_longest_side_of_its_own_elements():
    """A tenth of 0.6 m at the wide elements in the middle, of 0.5 m at the corners."""
    with pytest.raises(ValueError) as refusal:
        on_cylinder(ANGLES, [((0, 0), 0.055), ((2, 1), 0.0575), ((1, 0), 0.065)])
    assert str(refusal.value) == (
        "shell on group 'surface': 2 of 12 nodes lie off the surface 'x**2 + z**2 - 4', the node at (0, 0, 2.055) m by "
        "0.055 m, over 10% of its element's side; correct the formula or leave it out"
    )
    on_cylinder(ANGLES, [((2, 1), 0.0575)])


def two_folded(h: float, offset=0.0):
    """Two squares folded by 60 degrees."""
    points, cells = fan(0.0, np.radians(60))
    mesh = Mesh(points, {"quad": cells}, {"surface": {"quad": [0, 1]}})
    return build_structure(mesh, [Member("surface", "shell", isotropic(h, METAL), None, {"offset": offset})])


@pytest.mark.parametrize("offset", [0.0, 0.03])
def test_nodes_of_a_fold_follow_the_turn_of_their_surface_by_a_tenth_of_the_shear_stiffness(offset):
    """theta.n against omega = (v,x - u,y) / 2 at the two nodes of the fold: 0.1 G h / 2 (theta.n - omega)^2 A / 4."""
    s = two_folded(0.02, offset)
    drilled = s.strain[1:]
    assert [len(block.dofs) for block in drilled] == [2]
    rng = np.random.default_rng(2)
    x = rng.normal(size=s.n_dof)
    u, turn = ((A @ x).reshape(-1, 3) for A in (s.translation, s.rotation))
    total = 0.0
    for first, angle in ((0, 0.0), (2, np.radians(60))):
        t = np.array([np.cos(angle), 0, np.sin(angle)])
        n = np.cross(t, [0, 1.0, 0])
        for node in (2, 3):
            side = node - 2  # at y = 0 or 1
            ends = [first + side, first + 2 + side]  # along t; the fold's nodes in the other direction
            v_x = (u[ends[1]] - u[ends[0]]) @ [0, 1.0, 0]
            u_y = (u[3] - u[2]) @ t
            total += 0.1 * METAL.G * 0.02 * (turn[node] @ n - (v_x - u_y) / 2) ** 2 / 4
    block = drilled[0]
    g = block.gradients((s.T @ x)[:, None], slice(None))[..., 0]
    eps = np.einsum("sg,eqg->eqs", block.linear_map, g)[..., 0]
    assert np.sum(block.weight * np.ravel(block.elastic)[0] * eps**2) == pytest.approx(total, rel=1e-9)


def test_smooth_shells_turn_about_their_normal_only_where_a_beam_stands_on_them():
    mesh = rectangle(1.0, 1.0, 2, 2, "quad")
    mast = line([[0.5, 0.5, 0], [0.5, 0.5, 1.0]], 1)
    both = mesh.merged(mast, tolerance=1e-9)
    members = [Member("surface", "shell", 0.02, METAL), Member("line", "beam", Circle(0.02), METAL, {"extent": 10.0})]
    alone, joined = build_structure(mesh, members[:1]), build_structure(both, members)
    assert len(alone.strain) == 1 and alone.n_dof == 9 * 5
    (drill,) = joined.strain[2:]
    assert len(drill.dofs) == 4 and np.count_nonzero(drill.weight) == 4
    assert drill.weight.sum() == pytest.approx(4 * 0.25 / 4)
