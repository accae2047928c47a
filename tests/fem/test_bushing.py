"""Springs and bushings inside structures: their stiffness, rigid motion without force, and what is refused."""

import numpy as np
import pytest

from femflex.fem import Bushing, Material, Member, PointMass, build_structure, spring
from femflex.fem.sections import CableSection, Circle
from femflex.mesh import Mesh
from femflex.reduction import cantilever_modes, reduce_structure, strain_tensors
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


def test_to_the_body_frame_it_resists_all_motion_of_its_node():
    k = np.array([1e3, 0.0, 2e3, 0.0, 50.0, 0.0])
    with_it = two_beams((0, 0, 0), Bushing("tip", None, k[:3], k[3:]))
    added = (with_it.K - two_beams((0, 0, 0)).K).toarray()
    rows = node_rows(with_it, "tip")
    assert added == pytest.approx(rows.T @ np.diag(k) @ rows, abs=1e-9 * k.max())
    first = two_beams((0, 0, 0), Bushing("root", None, k[:3], k[3:]))  # the node whose numbers begin at zero
    rows = node_rows(first, "root")
    assert (first.K - two_beams((0, 0, 0)).K).toarray() == pytest.approx(rows.T @ np.diag(k) @ rows, abs=1e-9 * k.max())


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


def test_it_is_part_of_bodies_strain_and_picture():
    structure = two_beams((0.5, 0, 0), Bushing("a", "b", (1e5, 1e5, 1e5), (1e3, 1e3, 1e3)))
    modes = cantilever_modes(structure, ["root"], 4)
    body = reduce_structure(structure, modes, turning=())
    assert np.diag(body.strain.V1) == pytest.approx(modes.omega**2)
    assert body.skin.cells["line"].shape == (1, 2)
    phi, d = modes.phi, 1e-3 * np.random.default_rng(0).standard_normal(modes.n_modes)
    energy = structure.internal_force.energy(phi @ d)
    assert strain_tensors(structure, phi).energy(d) == pytest.approx(energy, rel=1e-9)


def test_strings_and_solids_take_springs_along_the_line_alone():
    mesh = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [1.5, 0, 0], [2, 0, 0]]), {"line": np.array([[0, 1], [2, 3]])},
                {"cords": {"line": [0, 1]}}, {"a": [1], "b": [2]})  # fmt: skip
    cords = [Member("cords", "tether", CableSection(1e5, 0.1), None, {"prestress": 10.0})]
    found = build_structure(mesh, cords, bushings=[spring("a", "b", 30.0)])
    assert (found.K - build_structure(mesh, cords).K).diagonal().max() == pytest.approx(30.0)
    with pytest.raises(ValueError, match=r"nodes without rotation .* cannot resist rotation"):
        build_structure(mesh, cords, bushings=[Bushing("a", "b", rotation=(1.0, 0, 0))])
    with pytest.raises(ValueError, match="cannot be compared off the line"):
        build_structure(mesh, cords, bushings=[Bushing("a", "b", (0.0, 1.0, 0.0))])


def test_a_bushing_from_a_beam_to_a_string_cannot_resist_rotation():
    mesh = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [1.5, 0, 0], [2, 0, 0]]), {"line": np.array([[0, 1], [2, 3]])},
                {"bar": {"line": [0]}, "cord": {"line": [1]}}, {"a": [1], "b": [2]})  # fmt: skip
    members = [Member("bar", *BEAM), Member("cord", "tether", CableSection(1e5, 0.1), None, {"prestress": 10.0})]
    for ends in (("a", "b"), ("b", "a")):
        with pytest.raises(ValueError, match=f"bushing at group '{ends[0]}': nodes without rotation .* cannot resist"):
            build_structure(mesh, members, bushings=[Bushing(*ends, rotation=(1.0, 0, 0))])
    for ends in (("a", "b"), ("b", "a")):
        found = build_structure(mesh, members, bushings=[spring(*ends, 30.0)])
        x = np.random.default_rng(0).normal(size=found.n_dof)
        u = (found.translation @ x).reshape(4, 3)[:, 0]
        added = x @ (found.K - build_structure(mesh, members).K) @ x
        assert added == pytest.approx(30.0 * (u[2] - u[1]) ** 2, rel=1e-4)


def on_one_beam_alone(bushing):
    return build_structure(two_beams((0, 0, 0)).mesh, [Member("first", *BEAM)], bushings=[bushing])


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Bushing("a", "b"), "has no stiffness"),
        (lambda: Bushing("a", "b", (-1.0, 0, 0)), "none negative"),
        (lambda: Bushing("a", "b", (1.0, 0, 0), axes=np.ones((3, 3))), "not at right angles"),
        (lambda: Bushing("a", "b", (1.0, 0, 0), at=(1.0, 0)), "give a place by three coordinates"),
        (lambda: two_beams((0, 0, 0), Bushing("both", None, (1.0, 0, 0))), "group 'both' has 2 nodes"),
        (lambda: on_one_beam_alone(Bushing("tip", None, (1.0, 0, 0))), "belongs to no member"),
    ],
)
def test_what_cannot_be_is_refused(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()
