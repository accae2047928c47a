"""Structure and ModeSet -> FlexibleBody: markers, skin, damping, rank."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.reduction_examples import bent_boom, frame, slender_beam

from femflex.reduction import Damping, cantilever_modes, reduce_structure, rigid_set
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.rigid import rigid_motion, rigid_shapes


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


def test_marker_on_line_of_nodes_uses_nodal_rotation():
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


def test_modal_damping_is_two_zeta_omega(boom):
    modes = cantilever_modes(boom, "start", 4)
    ratios = [0.01, 0.02, 0.03, 0.04]
    one, each = (reduce_structure(boom, modes, damping=Damping(z)).damping for z in (0.005, ratios))
    assert one == pytest.approx(np.diag(2 * 0.005 * modes.omega), abs=1e-9 * modes.omega[-1])
    assert each == pytest.approx(np.diag(2 * np.array(ratios) * modes.omega), abs=1e-9 * modes.omega[-1])


def test_rayleigh_damping_is_in_proportion_to_mass_and_stiffness(boom):
    modes = cantilever_modes(boom, "start", 3)
    D = reduce_structure(boom, modes, damping=Damping(mass=0.1, stiffness=1e-4)).damping
    assert np.diag(D) == pytest.approx(0.1 + 1e-4 * modes.omega**2)


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
