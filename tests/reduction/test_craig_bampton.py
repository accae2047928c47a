"""Craig-Bampton sets and lumped masses against the full model and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh, null_space
from support.reduction_examples import (
    CLAMPED_FREE,
    EI_Y,
    LENGTH,
    MASS,
    bent_boom,
    dense_frequencies,
    frame,
    slender_beam,
)

from femflex.reduction import (
    cantilever_modes,
    craig_bampton,
    effective_mass,
    lumped,
    nodal,
    nodal_translations,
    reduce_structure,
)
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
def test_frame_clamped_after_reduction_has_frequencies_of_full_model(interface):
    structure = frame()
    modes = craig_bampton(structure, ["left", "right", "top"], 30, interface=interface)
    assert modes.n_modes == 12 + 30
    held = np.union1d(structure.clamped_dofs("left"), structure.clamped_dofs("right"))
    exact = dense_frequencies(structure, held, 6)
    assert joined_frequencies(structure, modes.phi, held, 6) == pytest.approx(exact, rel=2e-4)


def test_frequencies_converge_from_above_with_fixed_interface_modes():
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


@pytest.mark.parametrize("interface", ["rigid", "nodal"])
@pytest.mark.parametrize("orthonormal", [True, False])
def test_craig_bampton_with_clamped_feet_matches_full_model(interface, orthonormal):
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


def frequencies(body):
    return np.sqrt(eigh(body.strain.V1, body.moments.elastic_mass(), eigvals_only=True))


def test_all_nodal_coordinates_are_the_structure_itself():
    structure = frame(n=2)
    body = reduce_structure(structure, nodal(structure, "feet"))
    assert set(body.kinds) == {"nodal"}
    assert frequencies(body)[:8] == pytest.approx(cantilever_modes(structure, "feet", 8).omega[:8], rel=1e-9)
    free = nodal(structure, "feet").phi.argmax(axis=0)
    assert body.strain.V1 == pytest.approx(structure.K.toarray()[np.ix_(free, free)], rel=1e-12, abs=1e-6)


@pytest.mark.parametrize("make", [bent_boom, frame])
def test_lumping_keeps_the_mass_and_the_stiffness(make):
    structure = make()
    lumps = lumped(structure)
    body = reduce_structure(lumps, nodal_translations(lumps, structure.mesh.groups[-1]))
    total = sum(block.dm.sum() for block in structure.inertia)
    assert body.moments.mass == pytest.approx(total, rel=1e-13)
    assert lumps.M.diagonal().sum() == pytest.approx(3 * total, rel=1e-13)
    assert (lumps.M.diagonal() >= 0).all() and lumps.M.nnz <= lumps.n_dof
    assert lumps.K is structure.K
    n = body.n_modes
    Me = nodal_translations(lumps, structure.mesh.groups[-1]).phi
    assert np.abs(body.moments.elastic_mass() - Me.T @ (lumps.M @ Me)).max() < 1e-13 * total and n > 6


def test_lumped_frequencies_converge_with_the_square_of_the_element_length():
    exact = CLAMPED_FREE[0] ** 2 * np.sqrt(EI_Y / (MASS * LENGTH**4))
    errors = []
    for n in (5, 10, 20):
        structure = lumped(slender_beam(n=n, order=3))
        body = reduce_structure(structure, nodal_translations(structure, "start"))
        errors.append(abs(frequencies(body)[0] / exact - 1))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates == pytest.approx(2.0, abs=0.15)


def test_guyan_with_massless_rotations_is_exact():
    """Rotations without mass follow statically whatever the motion: condensed and full frequencies agree."""
    structure = lumped(bent_boom(n=4, order=3))
    body = reduce_structure(structure, nodal_translations(structure, "start"))
    full = cantilever_modes(structure, "start", 6)
    assert frequencies(body)[:6] == pytest.approx(full.omega, rel=1e-8)


def test_effective_mass_of_all_lumped_modes_is_moving_mass():
    structure = lumped(slender_beam(n=10, order=3))
    body = reduce_structure(structure, nodal_translations(structure, "start"))
    root = MASS * LENGTH / 20  # half an element sits on the clamp
    moving = body.moments.mass - root
    assert effective_mass(body).effective.sum(axis=0)[:3] == pytest.approx(moving, rel=1e-10)
    J = body.moments.inertia()
    assert effective_mass(body).effective.sum(axis=0)[4:] == pytest.approx(np.diag(J)[1:], rel=1e-10)
