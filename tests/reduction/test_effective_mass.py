"""Participation, effective mass and the modal assurance criterion against closed forms and sums."""

from __future__ import annotations

import numpy as np
import pytest
from support.reduction_examples import LENGTH, MASS, bent_boom, slender_beam

from femflex.body import rigid_body
from femflex.reduction import (
    cantilever_modes,
    craig_bampton,
    effective_mass,
    free_free_modes,
    mac,
    mac_of_bodies,
    nodal,
    reduce_structure,
)
from femflex.reduction.boundary.rigid import rigid_shapes


@pytest.fixture(scope="module")
def boom():
    return bent_boom()


def test_effective_masses_of_a_cantilever_are_the_textbook_fractions():
    structure = slender_beam(n=8)
    found = effective_mass(reduce_structure(structure, cantilever_modes(structure, "start", 6)))
    along_z = found.effective[[0, 2, 4], 2] / (MASS * LENGTH)  # EIy is the softer plane: modes 1, 3, 5 bend along z
    assert along_z == pytest.approx([0.613076, 0.188300, 0.064740], abs=1e-5)
    assert found.total[:3] == pytest.approx(MASS * LENGTH)
    assert found.total[4] == pytest.approx(MASS * LENGTH**3 / 3, rel=1e-5)
    assert found.running[-1] == pytest.approx(found.carried)


def test_participation_is_phi_m_r(boom):
    modes = cantilever_modes(boom, "start", 6)
    about = np.array([1.0, -2.0, 0.5])
    found = effective_mass(reduce_structure(boom, modes), about)
    expected = modes.phi.T @ (boom.M @ rigid_shapes(boom, about))
    assert found.participation == pytest.approx(expected, abs=1e-8)  # seen: up to 1.4e-9, of rounding
    assert found.omega == pytest.approx(modes.omega, rel=1e-8)


def test_totals_about_a_point_are_the_rigid_inertia_there(boom):
    about = np.array([1.0, -2.0, 0.5])
    R = rigid_shapes(boom, about)
    found = effective_mass(reduce_structure(boom, cantilever_modes(boom, "start", 2)), about)
    assert found.total == pytest.approx(np.diag(R.T @ (boom.M @ R)), rel=1e-10)


def test_all_modes_together_carry_the_mass_that_moves():
    """Effective masses of a complete set sum to R^T M_:f M_ff^-1 M_f: R: all mass but what the clamp holds still."""
    structure = slender_beam(n=3, order=3)
    modes = nodal(structure, "start")
    found = effective_mass(reduce_structure(structure, modes))
    MR = (structure.M @ rigid_shapes(structure))[modes.phi.argmax(axis=0)]
    Mff = modes.phi.T @ (structure.M @ modes.phi)
    assert found.effective.sum(axis=0) == pytest.approx(np.diag(MR.T @ np.linalg.solve(Mff, MR)), rel=1e-8)


def test_with_many_modes_nearly_all_mass_is_carried(boom):
    few, many = (effective_mass(reduce_structure(boom, cantilever_modes(boom, "start", n))).carried for n in (3, 60))
    assert few.min() < 0.7 and many.min() > 0.95 and many.max() <= 1.0


def test_shapes_that_are_not_modes_are_recombined_first(boom):
    plain = reduce_structure(boom, craig_bampton(boom, ["end"], 5, clamp="start", orthonormal=False))
    made = reduce_structure(boom, craig_bampton(boom, ["end"], 5, clamp="start"))
    assert effective_mass(plain).effective == pytest.approx(effective_mass(made).effective, rel=1e-6, abs=1e-9)


def test_free_free_modes_carry_nothing(boom):
    assert effective_mass(reduce_structure(boom, free_free_modes(boom, 4))).carried.max() < 1e-12


def test_a_rigid_body_has_totals_and_no_modes():
    found = effective_mass(rigid_body(2.0, np.diag([1.0, 2.0, 2.5]), np.array([1.0, 0, 0])))
    assert found.total == pytest.approx([2, 2, 2, 1, 4, 4.5])
    assert found.effective.shape == (0, 6) and not found.carried.any()


def test_mac_of_a_set_with_itself_is_the_identity(boom):
    phi = cantilever_modes(boom, "start", 6).phi
    assert mac(phi, -3 * phi, boom.M) == pytest.approx(np.eye(6), abs=1e-12)


def test_mac_of_turned_shapes_is_the_squared_cosine(boom):
    phi = cantilever_modes(boom, "start", 2).phi
    a = 0.3
    turned = phi @ np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    expected = np.array([[np.cos(a), np.sin(a)], [np.sin(a), np.cos(a)]]) ** 2
    assert mac(phi, turned, boom.M) == pytest.approx(expected, abs=1e-12)
    assert mac(np.eye(3)[:, :2], np.eye(3)[:, 1:]) == pytest.approx(np.array([[0, 0], [1, 0]]))


def test_mac_beside_a_shape_that_moves_nothing_is_zero():
    assert np.array_equal(mac(np.array([[1.0, 0.0], [2.0, 0.0]]), np.array([[1.0], [2.0]])), [[1.0], [0.0]])


def test_mac_of_the_same_beam_on_two_meshes():
    bodies = []
    for n in (16, 20):
        structure = slender_beam(n=n)
        bodies.append(reduce_structure(structure, cantilever_modes(structure, "start", 4)))
    found = mac_of_bodies(*bodies)
    assert np.diag(found).min() > 0.97 and (found - np.diag(np.diag(found))).max() < 0.1
    assert mac_of_bodies(bodies[0], bodies[0]) == pytest.approx(mac_of_bodies(bodies[0], bodies[0]).T)


def test_bodies_that_do_not_lie_on_each_other_are_not_compared():
    a, b = slender_beam(), slender_beam(direction=(0, 1, 0))
    a, b = (reduce_structure(s, cantilever_modes(s, "start", 2)) for s in (a, b))
    with pytest.raises(
        ValueError, match=r"a point of the first is .* m from the nearest of the second, where 0.25\d* m"
    ):
        mac_of_bodies(a, b)
    with pytest.raises(ValueError, match="one of them has none"):
        mac_of_bodies(a, rigid_body(1.0, np.eye(3)))
