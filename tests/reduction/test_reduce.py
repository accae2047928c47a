"""Structure and ModeSet -> FlexibleBody: markers, skin, damping, rank."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.reduction_examples import bent_boom, frame, slender_beam

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh.generators import line, rectangle
from femflex.reduction import (
    ModalDamping,
    RayleighDamping,
    cantilever_modes,
    craig_bampton,
    free_free_modes,
    nodal,
    reduce_structure,
    rigid_set,
)
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.rigid import lifted, rigid_motion, rigid_shapes
from femflex.warning import PhysicsWarning


@pytest.fixture(scope="module")
def boom():
    return bent_boom()


def test_rigid_motions_store_no_strain_energy_and_move_nodes_rigidly(boom):
    about = np.array([0.3, -1.0, 2.0])
    R = rigid_shapes(boom, about)
    assert np.abs(R.T @ (boom.K @ R)).max() < 1e-13 * np.abs(boom.K).max()
    u, theta = rigid_motion(boom.mesh.points - about)
    assert np.abs((boom.translation @ R).reshape(-1, 3, 6) - u).max() < 1e-12
    assert np.abs((boom.rotation @ R).reshape(-1, 3, 6) - theta).max() < 1e-12
    assert u[0, :, 5] == pytest.approx(np.cross([0, 0, 1], boom.mesh.points[0] - about))


def test_a_lifted_motion_between_nodes_costs_least_energy(boom):
    rng = np.random.default_rng(2)
    n = len(boom.mesh.points)
    x = lifted(boom, rng.standard_normal((n, 3, 1)), rng.standard_normal((n, 3, 1)))[:, 0]
    rows = boom.translation.tocoo().coords[1], boom.rotation.tocoo().coords[1]
    extra = np.setdiff1d(np.arange(boom.n_dof), np.concatenate(rows))
    assert extra.size and np.abs((boom.K @ x)[extra]).max() < 1e-10 * np.abs(boom.K @ x).max()


def test_a_marker_on_one_node_has_the_nodes_own_rows(boom):
    modes = cantilever_modes(boom, "start", 4)
    tip = reduce_structure(boom, modes, {"tip": "end"}).marker("tip")
    node = boom.mesh.group_points("end")[0]
    assert np.array_equal(tip.position, boom.mesh.points[node])
    assert tip.phi == pytest.approx((boom.translation @ modes.phi)[3 * node : 3 * node + 3], abs=1e-15)
    assert tip.psi == pytest.approx((boom.rotation @ modes.phi)[3 * node : 3 * node + 3], abs=1e-15)
    assert np.array_equal(tip.orientation, np.eye(3))


def test_clamps_and_interfaces_are_markers_under_their_own_names(boom):
    body = reduce_structure(boom, craig_bampton(boom, ["start", "end"], 2), {"elbow": "start"})
    assert set(body.markers) == {"start", "end", "elbow", "origin"}
    assert np.abs(body.marker("start").phi).max() < 1e-12


def test_a_marker_on_several_nodes_follows_a_rigid_motion_exactly():
    structure = frame()
    R = rigid_shapes(structure, about=marker_rows(structure, "edge").position)
    rows = marker_rows(structure, "edge")
    assert rows.position == pytest.approx(structure.mesh.points[[0, 1, 3]].mean(axis=0))
    assert rows.translation @ R == pytest.approx(np.eye(3, 6), abs=1e-13)
    assert rows.rotation @ R == pytest.approx(np.eye(3, 6, 3), abs=1e-13)
    assert rows.blind.size == 0


def test_a_marker_on_several_nodes_is_the_least_squares_fit():
    structure = frame()
    x = np.random.default_rng(1).standard_normal(structure.n_dof)
    nodes = structure.mesh.group_points("edge")
    u, X = (structure.translation @ x).reshape(-1, 3)[nodes], structure.mesh.points[nodes]
    d = X - X.mean(axis=0)
    # unknowns (mean, theta) of u = mean + theta x d, as a plain least-squares problem
    A = np.concatenate([np.block([np.eye(3), np.cross(np.eye(3), row).T]) for row in d])
    fit = np.linalg.lstsq(A, u.ravel(), rcond=None)[0]
    rows = marker_rows(structure, "edge")
    assert rows.translation @ x == pytest.approx(fit[:3])
    assert rows.rotation @ x == pytest.approx(fit[3:])


def test_about_the_line_of_its_nodes_a_marker_takes_their_own_rotation():
    structure = slender_beam(n=4, order=3)
    mesh = structure.mesh.with_groups(points={"pair": [1, 3]})
    structure = replace(structure, mesh=mesh)
    x = np.random.default_rng(1).standard_normal(structure.n_dof)
    theta, u = (np.reshape(rows @ x, (-1, 3)) for rows in (structure.rotation, structure.translation))
    rows = marker_rows(structure, "pair")
    arm = mesh.points[3] - mesh.points[1]
    assert (rows.rotation @ x)[0] == pytest.approx((theta[1, 0] + theta[3, 0]) / 2)
    assert (rows.rotation @ x)[1:] == pytest.approx(np.cross(arm, u[3] - u[1])[1:] / (arm @ arm))
    alone = structure.rotation.copy().tolil()
    alone[3 * 3 : 3 * 3 + 3] = 0.0  # as a node of a solid has none
    rows = marker_rows(replace(structure, rotation=alone.tocsr()), "pair")
    assert (rows.rotation @ x)[0] == pytest.approx(theta[1, 0])


def test_a_marker_whose_nodes_cannot_turn_is_warned_of(boom):
    still = replace(boom, rotation=boom.rotation * 0.0)
    still.rotation.eliminate_zeros()
    modes = cantilever_modes(boom, "start", 2)
    with pytest.warns(PhysicsWarning, match="marker 'tip' shows no rotation about 3 of 3 axes"):
        reduce_structure(still, modes, {"tip": "end"})
    reduce_structure(still, modes)  # the clamp itself does not move: no warning


def test_markers_on_unknown_groups_and_on_bare_nodes_are_refused(boom):
    modes = cantilever_modes(boom, "start", 2)
    with pytest.raises(ValueError, match=r"group 'tip' is not in the mesh; it has \['end', 'line', 'start'\]"):
        reduce_structure(boom, modes, {"camera": "tip"})
    mesh = line([[0, 0, 0], [5, 0, 0]], 2).merged(line([[0, 1, 0], [5, 1, 0]], 2))
    mesh = mesh.with_groups(cells={"boom": {"line": [0, 1]}}, points={"camera": [5], "root": [0]})
    structure = build_structure(mesh, [Member("boom", "beam", StiffnessSection(1e6, 10, 10, 10, 1.0, 0.01, 0.01))])
    with pytest.raises(ValueError, match="1 of the 1 nodes of group 'camera' belong to no member"):
        reduce_structure(structure, cantilever_modes(structure, "root", 2), {"camera": "camera"})


@pytest.mark.parametrize("kind", ["triangle6", "quad9"])
def test_an_edge_of_second_order_cells_is_a_place_like_that_of_its_corners(kind):
    mesh, flat = (rectangle(2.0, 1.0, 4, 3, cell) for cell in (kind, {"triangle6": "triangle", "quad9": "quad"}[kind]))
    assert len(mesh.group_points("right")) == 7 and len(flat.group_points("right")) == 4
    metal = Material(70e9, 0.3, 2700.0)
    family = "plate" if kind == "triangle6" else "plate_bfs"
    second, first = (build_structure(m, [Member("surface", family, 0.01, metal)]) for m in (mesh, flat))
    bodies = [reduce_structure(s, cantilever_modes(s, "left", 3), {"edge": "right"}) for s in (second, first)]
    for name in ("position", "phi", "psi"):
        ours, theirs = (np.abs(getattr(body.markers["edge"], name)) for body in bodies)
        assert ours == pytest.approx(theirs, abs=1e-7 * theirs.max())
    middle = np.setdiff1d(mesh.group_points("right"), mesh.group_points("right")[second_corners(mesh)])
    lone = build_structure(mesh.with_groups(points={"amid": middle[:1]}), [Member("surface", family, 0.01, metal)])
    with pytest.raises(ValueError, match="1 of the 1 nodes of group 'amid' belong to no member, or are midside"):
        marker_rows(lone, "amid")


def second_corners(mesh):
    """Which points of the right edge are corners of cells."""
    return ~np.isin(mesh.group_points("right"), mesh.midside_points())


def test_the_skin_moves_with_the_nodes(boom):
    modes = cantilever_modes(boom, "start", 3)
    skin = reduce_structure(boom, modes).skin
    assert skin.shapes.shape == (3, len(skin.points), 3)
    expected = (boom.skin.operator @ modes.phi[:, 1]).reshape(-1, 3)
    assert np.array_equal(skin.shapes[1], expected) and np.abs(expected).max() > 0
    assert reduce_structure(replace(boom, skin_parts=()), modes).skin is None


def test_a_reduced_body_knows_its_kinds_and_frequencies(boom):
    modes = free_free_modes(boom, 3)
    body = reduce_structure(boom, modes)
    assert body.kinds == modes.kinds and np.array_equal(body.omega, modes.omega)
    assert reduce_structure(boom, rigid_set(boom.n_dof)).n_modes == 0


def test_without_any_damping_named_there_is_none(boom):
    assert not reduce_structure(boom, cantilever_modes(boom, "start", 3)).damping.any()


def test_modal_damping_is_two_zeta_omega(boom):
    modes = cantilever_modes(boom, "start", 4)
    ratios = [0.01, 0.02, 0.03, 0.04]
    one, each = (reduce_structure(boom, modes, damping=ModalDamping(z)).damping for z in (0.005, ratios))
    assert one == pytest.approx(np.diag(2 * 0.005 * modes.omega), abs=1e-9 * modes.omega[-1])
    assert each == pytest.approx(np.diag(2 * np.array(ratios) * modes.omega), abs=1e-9 * modes.omega[-1])


def test_modal_damping_of_shapes_that_are_not_modes_damps_the_bodys_own_modes():
    structure = slender_beam(n=2, order=3)
    body = reduce_structure(structure, nodal(structure, "start"), damping=ModalDamping(0.02))
    Me, K, D = body.moments.elastic_mass(), body.strain.V1, body.damping
    n = len(Me)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(Me, K), -np.linalg.solve(Me, D)]])
    roots = np.linalg.eigvals(A)
    low = roots[np.abs(roots) < 200]  # the bending modes; ratio = -Re / |root|
    assert low.size >= 8 and -low.real / np.abs(low) == pytest.approx(0.02, rel=1e-6)


def test_rayleigh_damping_is_in_proportion_to_mass_and_stiffness(boom):
    modes = cantilever_modes(boom, "start", 3)
    D = reduce_structure(boom, modes, damping=RayleighDamping(0.1, 1e-4)).damping
    assert np.diag(D) == pytest.approx(0.1 + 1e-4 * modes.omega**2)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ModalDamping(-0.01), "damping ratio is -0.01; it must be zero or positive"),
        (lambda: ModalDamping(float("nan")), "damping ratio is nan"),
        (
            lambda: RayleighDamping(alpha=-1.0),
            "Rayleigh damping has alpha = -1.0, beta = 0.0; both must be zero or positive",
        ),
        (lambda: ModalDamping([0.1, 0.2]).matrix(np.eye(3), np.eye(3)), "2 damping ratios were given for 3 modes"),
    ],
)
def test_damping_that_cannot_be_is_refused(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


def test_shapes_that_hold_a_rigid_motion_are_refused(boom):
    with pytest.raises(ValueError, match="the shapes contain a rigid motion of the body frame"):
        reduce_structure(slender_beam(n=2), nodal(slender_beam(n=2), ()))
    modes = cantilever_modes(boom, "start", 3)
    moved = replace(modes, phi=modes.phi + 0.0)
    for rigid in (np.arange(1.0, 7.0), np.eye(6)[5]):  # of any kind, and a turn alone
        moved.phi[:, 1] = rigid_shapes(boom) @ rigid
        with pytest.raises(ValueError, match="clamp a group, name a reference interface, or use free-free modes"):
            reduce_structure(boom, moved)


def test_shapes_that_repeat_each_other_are_refused(boom):
    modes = cantilever_modes(boom, "start", 3)
    with pytest.raises(ValueError, match="the 4 shapes are not independent"):
        reduce_structure(boom, modes.picked([0, 1, 2, 1]))


@pytest.mark.parametrize("make", ["cantilever", "free-free", "craig-bampton", "nodal"])
def test_the_usual_sets_pass_the_rank_test(make):
    structure = slender_beam(n=3)
    sets = {
        "cantilever": lambda: cantilever_modes(structure, "start", 20),
        "free-free": lambda: free_free_modes(structure, 20),
        "craig-bampton": lambda: craig_bampton(structure, ["start", "end"], 20),
        "nodal": lambda: nodal(structure, "start"),
    }
    assert reduce_structure(structure, sets[make]()).n_modes >= 20


def test_a_very_stiff_body_moves_like_the_rigid_one(boom):
    """Stiffness up by 1e8: a unit angular acceleration gives elastic coordinates down by as much, inertia unchanged."""
    body = reduce_structure(boom, cantilever_modes(boom, "start", 4))
    stiff_boom = replace(boom, K0=boom.K0 * 1e8)
    stiff = reduce_structure(stiff_boom, cantilever_modes(stiff_boom, "start", 4))
    push = body.moments.first[1:, 2]
    soft_answer = np.linalg.solve(body.strain.V1, push)
    stiff_answer = np.linalg.solve(stiff.strain.V1, stiff.moments.first[1:, 2])
    assert np.linalg.norm(stiff_answer) == pytest.approx(1e-8 * np.linalg.norm(soft_answer), rel=1e-6)
    rigid = reduce_structure(boom, rigid_set(boom.n_dof)).moments
    assert stiff.moments.inertia(stiff_answer) == pytest.approx(rigid.inertia(), rel=1e-6, abs=1e-6)
    assert stiff.moments.inertia() == pytest.approx(rigid.inertia(), rel=1e-13, abs=1e-13)
