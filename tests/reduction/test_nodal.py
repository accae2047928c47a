"""No reduction and lumped masses: the same body by other coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from support.reduction_examples import ALUMINIUM, CLAMPED_FREE, EI_Y, LENGTH, MASS, bent_boom, frame, slender_beam

from femflex.fem import Member, PointMass, build_structure
from femflex.fem.connections import Rigid
from femflex.fem.sections import Tube
from femflex.mesh.generators import line, rectangle
from femflex.reduction import cantilever_modes, effective_mass, lumped, nodal, nodal_translations, reduce_structure
from femflex.reduction import reduce as reduce_module
from femflex.reduction.modes.nodal import is_lumped


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


def test_a_uniform_beam_lumps_half_of_each_element_to_each_end():
    structure = lumped(slender_beam(n=4, order=3))
    share = MASS * LENGTH / 4 * np.array([0.5, 1, 1, 1, 0.5])
    assert structure.inertia[0].dm[:, 0] == pytest.approx(share, rel=1e-12)
    assert np.array_equal(structure.inertia[0].rho[:, 0], structure.mesh.points)


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


def test_point_masses_stay_where_they_are():
    mesh = line([[0, 0, 0], [4, 0, 0]], 4)
    member = Member("line", "beam", Tube(0.05, 0.002), ALUMINIUM)
    bare, loaded = (lumped(build_structure(mesh, [member], masses)) for masses in ((), [PointMass("end", 3.0)]))
    added = loaded.inertia[0].dm[:, 0] - bare.inertia[0].dm[:, 0]
    assert added == pytest.approx([0, 0, 0, 0, 3.0], abs=1e-12)


def test_all_modes_of_a_lumped_cantilever_carry_all_its_moving_mass():
    structure = lumped(slender_beam(n=10, order=3))
    body = reduce_structure(structure, nodal_translations(structure, "start"))
    root = MASS * LENGTH / 20  # half an element sits on the clamp
    moving = body.moments.mass - root
    assert effective_mass(body).effective.sum(axis=0)[:3] == pytest.approx(moving, rel=1e-10)
    J = body.moments.inertia()
    assert effective_mass(body).effective.sum(axis=0)[4:] == pytest.approx(np.diag(J)[1:], rel=1e-10)


def test_nodes_tied_to_another_keep_their_lumped_mass():
    """A plate tied rigidly to a node away from it has six dofs: the rigid-body mass matrix of its lumps about it."""
    mesh, place = rectangle(2.0, 1.0, 3, 2), np.array([-0.5, 0.2, 0.7])
    plate = Member("surface", "plate", 0.02, ALUMINIUM)
    tied = lumped(build_structure(mesh, [plate], connections=[Rigid("surface", tuple(place), name="hub")]))
    loose = lumped(build_structure(mesh, [plate])).inertia[0]
    m, r = loose.dm[:, 0], loose.rho[:, 0] - place
    turned = np.cross(np.eye(3), r[:, None, :]).swapaxes(1, 2)  # columns e_k x r
    rigid = np.concatenate([np.broadcast_to(np.eye(3), turned.shape), turned], axis=2)
    carry = np.flatnonzero(tied.M.diagonal())
    assert len(carry) == 6
    M = tied.M.toarray()[np.ix_(carry, carry)]
    assert M == pytest.approx(np.einsum("n,nij,nik->jk", m, rigid, rigid), abs=1e-11 * m.sum())
    assert set(carry) <= set(nodal_translations(tied, ()).phi.any(axis=1).nonzero()[0])


def test_a_structure_is_lumped_when_every_mass_of_it_moves_with_one_node():
    mesh, beam = line([[0, 0, 0], [1.0, 0, 0]], 2), Member("line", "beam", Tube(0.05, 0.002), ALUMINIUM)
    light, arm = PointMass("end", 3.0), PointMass("end", 2.0, offset=(0.0, 0.1, 0.0))
    for masses in ((), (light,), (light, arm)):
        structure = build_structure(mesh, [beam], masses)
        assert is_lumped(lumped(structure)) and not is_lumped(structure)
    loose = [Member("all", "nodes")]
    points = mesh.with_groups(points={"all": [0, 1, 2]})
    assert is_lumped(build_structure(points, loose, [light])) and not is_lumped(build_structure(points, loose, [arm]))


def test_linear_bodies_know_how_they_shorten_but_for_lumped_and_very_many_coordinates(monkeypatch):
    structure = slender_beam(n=3, order=3)
    modes = cantilever_modes(structure, "start", 3)
    monkeypatch.setattr(reduce_module, "MANY", 3)
    assert reduce_structure(structure, modes).foreshortening is not None
    assert reduce_structure(lumped(structure), modes).foreshortening is None
    assert reduce_structure(structure, cantilever_modes(structure, "start", 4)).foreshortening is None
    assert reduce_structure(structure, modes, strain="nonlinear").foreshortening is None
