"""Craig–Bampton sets against the full model, free and held at the interfaces in turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh, null_space
from support.reduction_examples import bent_boom, dense_frequencies, frame

from femflex.reduction import cantilever_modes, craig_bampton, reduce_structure
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.rigid import rigid_shapes


def joined_frequencies(structure, phi, held, n):
    """Frequencies of the body frame and the shapes together, with dofs held as a joint would hold them."""
    shapes = np.column_stack([rigid_shapes(structure), phi])
    N = null_space(shapes[held], rcond=1e-9)
    K, M = (N.T @ shapes.T @ (A @ shapes) @ N for A in (structure.K, structure.M))
    eigenvalues = eigh(K, M, eigvals_only=True)
    return np.sqrt(np.maximum(eigenvalues[:n], 0))


@pytest.mark.parametrize("interface", ["rigid", "nodal"])
def test_a_frame_clamped_at_its_feet_after_reduction_has_the_full_models_frequencies(interface):
    structure = frame()
    modes = craig_bampton(structure, ["left", "right", "top"], 30, interface=interface)
    assert modes.n_modes == 12 + 30
    held = np.union1d(structure.clamped_dofs("left"), structure.clamped_dofs("right"))
    exact = dense_frequencies(structure, held, 6)
    assert joined_frequencies(structure, modes.phi, held, 6) == pytest.approx(exact, rel=2e-4)


def test_the_error_falls_as_fixed_interface_modes_are_added_and_from_above():
    structure = frame()
    held = structure.clamped_dofs("right")  # not the reference: the frame swings from the other foot
    exact = dense_frequencies(structure, held, 4)
    errors = []
    for n in (5, 15, 45):
        phi = craig_bampton(structure, ["left", "right"], n).phi
        errors.append(joined_frequencies(structure, phi, held, 4) / exact - 1)
        assert np.all(errors[-1] > -1e-9)  # confined to fewer shapes, frequencies can only rise
    assert errors[2].max() < 1e-4 and errors[2].max() < errors[1].max() / 2 < errors[0].max() / 4


def test_all_fixed_interface_modes_make_it_exact():
    structure = bent_boom(n=3, order=3)
    inner = structure.n_dof - 12
    modes = craig_bampton(structure, ["start", "end"], inner)
    held = structure.clamped_dofs("end")
    assert joined_frequencies(structure, modes.phi, held, 8) == pytest.approx(
        dense_frequencies(structure, held, 8), rel=1e-8
    )


def test_the_first_interface_stays_with_the_body_frame():
    structure = frame()
    modes = craig_bampton(structure, ["top", "left"], 4)
    body = reduce_structure(structure, modes)
    assert np.abs(body.marker("top").phi).max() < 1e-12 and np.abs(body.marker("top").psi).max() < 1e-12
    assert np.abs(body.marker("left").phi).max() > 0.01


def test_a_single_interface_as_reference_leaves_cantilever_modes():
    structure = bent_boom()
    modes = craig_bampton(structure, "start", 5)
    assert modes.omega == pytest.approx(cantilever_modes(structure, "start", 5).omega, rel=1e-12)
    assert modes.kinds == ("vibration",) * 5


def test_beside_a_clamp_every_interface_keeps_its_six_motions():
    structure = frame()
    modes = craig_bampton(structure, "top", 7, clamp="feet", orthonormal=False)
    assert modes.kinds == ("constraint",) * 6 + ("vibration",) * 7
    assert np.isnan(modes.omega[:6]).all() and modes.groups == ("feet", "top")
    top = marker_rows(structure, "top")
    assert np.abs(top.translation @ modes.phi[:, :3] - np.eye(3)).max() < 1e-12
    assert np.abs(top.rotation @ modes.phi[:, 3:6] - np.eye(3)).max() < 1e-12
    assert np.abs(top.translation @ modes.phi[:, 6:]).max() == 0.0


@pytest.mark.parametrize("interface", ["rigid", "nodal"])
@pytest.mark.parametrize("orthonormal", [True, False])
def test_clamped_feet_stay_where_they_are_and_the_rest_vibrates_as_the_full_model_does(interface, orthonormal):
    structure = frame()
    modes = craig_bampton(structure, "top", 30, clamp="feet", interface=interface, orthonormal=orthonormal)
    for foot in ("left", "right"):
        rows = marker_rows(structure, foot)
        assert np.abs(rows.translation @ modes.phi).max() == 0.0 and np.abs(rows.rotation @ modes.phi).max() == 0.0
    K, M = (modes.phi.T @ (A @ modes.phi) for A in (structure.K, structure.M))
    found = np.sqrt(eigh(K, M, eigvals_only=True)[:6])
    exact = dense_frequencies(structure, structure.clamped_dofs("feet"), 6)
    assert np.all(found > exact * (1 - 1e-9)) and found == pytest.approx(exact, rel=2e-4)
    if orthonormal:
        assert modes.omega[:6] == pytest.approx(found, rel=1e-9)


def test_orthonormal_or_not_the_frequencies_are_the_same():
    structure = frame()
    plain = craig_bampton(structure, "top", 7, clamp="feet", orthonormal=False)
    K, M = (plain.phi.T @ (A @ plain.phi) for A in (structure.K, structure.M))
    made = craig_bampton(structure, "top", 7, clamp="feet")
    assert made.omega == pytest.approx(np.sqrt(eigh(K, M, eigvals_only=True)), rel=1e-9)
    assert np.abs(made.phi.T @ (structure.M @ made.phi) - np.eye(13)).max() < 1e-10
    assert made.kinds == ("craig-bampton",) * 13


def test_without_modes_it_is_static_condensation():
    structure = frame()
    shapes = craig_bampton(structure, ["left", "right"], 0, clamp="top", orthonormal=False)
    inner = np.setdiff1d(np.arange(structure.n_dof), [*structure.clamped_dofs("feet"), *structure.clamped_dofs("top")])
    assert shapes.n_modes == 12
    residual = (structure.K @ shapes.phi)[inner]
    assert np.abs(residual).max() < 1e-9 * np.abs(structure.K).max()  # interior forces vanish
    assert np.abs(shapes.phi[structure.clamped_dofs("top")]).max() == 0.0
    unit = [marker_rows(structure, foot) for foot in ("left", "right")]
    moved = np.concatenate([part @ shapes.phi for rows in unit for part in (rows.translation, rows.rotation)])
    assert moved == pytest.approx(np.eye(12), abs=1e-12)  # one motion of one foot each


def test_a_rigid_interface_of_several_nodes_moves_as_one_piece():
    structure = frame()
    modes = craig_bampton(structure, ["top", "edge"], 4, orthonormal=False)
    assert modes.n_modes == 6 + 4
    nodes = structure.mesh.group_points("edge")
    u = (structure.translation @ modes.phi).reshape(-1, 3, modes.n_modes)[nodes]
    X = structure.mesh.points[nodes]
    stretch = np.einsum("ik,ikn->in", X[1:] - X[0], u[1:] - u[0])
    assert np.abs(stretch).max() < 1e-12


def test_an_interface_that_cannot_hold_the_body_frame_is_refused():
    structure = bent_boom()
    bare = replace(structure, rotation=structure.rotation * 0.0)
    bare.rotation.eliminate_zeros()
    with pytest.raises(ValueError, match="interface 'start' cannot hold the body frame"):
        craig_bampton(bare, ["start", "end"], 2)


def test_questions_without_an_answer_are_refused():
    structure = frame()
    with pytest.raises(ValueError, match="needs at least one interface group"):
        craig_bampton(structure, [], 3)
    with pytest.raises(ValueError, match="interface is 'soft'; it is 'rigid' or 'nodal'"):
        craig_bampton(structure, ["left"], 3, interface="soft")
    with pytest.raises(ValueError, match="rigid interfaces 'left' and 'edge' share 1 nodes"):
        craig_bampton(structure, ["left", "edge"], 3)
    with pytest.raises(ValueError, match="group 'foot' is not in the mesh"):
        craig_bampton(structure, ["foot"], 3)
    with pytest.raises(ValueError, match=r"reference 'edge' has nodes that belong to no interface \(left, right\)"):
        craig_bampton(structure, ["left", "right"], 3, reference="edge")
