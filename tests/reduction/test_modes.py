"""Cantilever and free-free sets against closed forms; attachment shapes; the sentences for structures not held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.reduction_examples import (
    ALUMINIUM,
    CLAMPED_FREE,
    EI_Y,
    EI_Z,
    FREE_FREE,
    LENGTH,
    MASS,
    bent_boom,
    dense_frequencies,
    frame,
    slender_beam,
)

from femflex.fem import Member, build_structure
from femflex.fem.eigen.modes import lowest_modes
from femflex.fem.sections import StiffnessSection, Tube
from femflex.mesh.generators import line, rectangle
from femflex.reduction import ModeSet, cantilever_modes, free_free_modes, reduce_structure, rigid_set, with_attachment
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.modes.vibration import ritz


def closed_form(roots, EI):
    return roots**2 * np.sqrt(EI / (MASS * LENGTH**4))


def both_planes(roots):
    return np.sort(np.concatenate([closed_form(roots, EI_Y), closed_form(roots, EI_Z)]))


def test_cantilever_frequencies_are_the_closed_form():
    modes = cantilever_modes(slender_beam(), "start", 8)
    assert modes.omega == pytest.approx(both_planes(CLAMPED_FREE), rel=2e-9)
    assert modes.kinds == ("vibration",) * 8
    assert modes.groups == ("start",)


def test_free_free_frequencies_are_the_closed_form_and_rigid_modes_are_left_out():
    modes = free_free_modes(slender_beam(direction=(1, 2, -0.5)), 6)
    assert modes.omega == pytest.approx(both_planes(FREE_FREE), rel=2e-9)
    assert modes.kinds == ("free-free",) * 6


def test_free_free_modes_move_neither_the_centre_of_mass_nor_angular_momentum():
    structure = bent_boom()
    body = reduce_structure(structure, free_free_modes(structure, 7))
    P = body.moments.second[0, :, 1:, :]  # b, k, c of int rho_b phi_kc dm
    angular = np.stack([P[1, :, 2] - P[2, :, 1], P[2, :, 0] - P[0, :, 2], P[0, :, 1] - P[1, :, 0]])
    scale = np.sqrt(body.moments.mass)
    assert np.abs(body.moments.first[1:]).max() < 1e-12 * scale
    assert np.abs(angular).max() < 1e-11 * scale


def test_shapes_are_m_orthonormal_with_the_largest_translation_positive():
    structure = bent_boom()
    for modes in (cantilever_modes(structure, "start", 9), free_free_modes(structure, 9)):
        assert np.abs(modes.phi.T @ (structure.M @ modes.phi) - np.eye(9)).max() < 1e-12
        moved = structure.translation @ modes.phi
        assert np.all(moved.max(axis=0) >= (1 - 1e-6) * np.abs(moved).max(axis=0))


def test_a_support_may_hold_some_components_alone():
    structure = slender_beam()
    held = {"start": ("x", "y", "z", "rx"), "end": ("y", "z")}
    pinned = np.arange(1, 5) * np.pi
    assert cantilever_modes(structure, held, 8).omega == pytest.approx(both_planes(pinned), rel=5e-8)


def test_a_round_boom_keeps_its_pairs_whole():
    structure = build_structure(line([[0, 0, 0], [1, 1, 4]], 6), [Member("line", "beam", Tube(0.1, 0.005), ALUMINIUM)])
    modes = cantilever_modes(structure, "start", 3)
    assert modes.n_modes == 4
    assert "3 modes requested, 4 kept" in modes.note
    assert modes.omega[2] == pytest.approx(modes.omega[3], rel=1e-9)


@pytest.mark.parametrize("n", [4, 6])
def test_attachment_shapes_stand_beside_the_modes(n):
    structure = bent_boom()
    modes = cantilever_modes(structure, "start", n)
    more = with_attachment(structure, modes)
    assert np.array_equal(more.phi[:, :n], modes.phi)
    assert more.kinds[n:] == ("attachment",) * 6
    K, M = (more.phi.T @ (A @ more.phi) for A in (structure.K, structure.M))
    assert np.abs(M - np.eye(n + 6)).max() < 1e-11
    assert np.abs(K / np.outer(more.omega, more.omega) - np.eye(n + 6)).max() < 1e-9


def test_attachment_shapes_complete_the_static_answer_to_their_loads():
    structure = bent_boom()
    modes = cantilever_modes(structure, "start", 3)
    more = with_attachment(structure, modes, directions=("z",), loads={"end": ("x", "ry")})
    assert more.n_modes == 6 and more.groups == ("start", "end")
    end = structure.mesh.group_points("end")[0]
    inertia = structure.M @ rigid_shapes(structure)[:, 2]
    force = structure.translation.toarray()[3 * end]
    moment = structure.rotation.toarray()[3 * end + 1]
    free = np.setdiff1d(np.arange(structure.n_dof), modes.held)
    for load in (inertia, force, moment):
        exact = np.linalg.solve(structure.K[free][:, free].toarray(), load[free])
        reduced = more.phi[free] @ ((more.phi.T @ load) / more.omega**2)
        assert np.linalg.norm(reduced - exact) < 1e-8 * np.linalg.norm(exact)
    without = modes.phi[free] @ ((modes.phi.T @ inertia) / modes.omega**2)
    exact = np.linalg.solve(structure.K[free][:, free].toarray(), inertia[free])
    assert np.linalg.norm(without - exact) > 1e-4 * np.linalg.norm(exact)


def test_attachment_shapes_want_a_clamp_and_known_directions():
    structure = bent_boom()
    with pytest.raises(ValueError, match=r"need a clamp; this set has none. Give a cantilever set"):
        with_attachment(structure, free_free_modes(structure, 3))
    with pytest.raises(ValueError, match=r"directions \['pitch'\] are not known; name some of \['x', 'y', 'z', 'rx'"):
        with_attachment(structure, cantilever_modes(structure, "start", 3), directions=("pitch",))


def test_confined_to_all_its_modes_a_structure_keeps_its_frequencies():
    structure = frame()
    modes = cantilever_modes(structure, "feet", 8)
    mixed = modes.phi @ np.linalg.qr(np.random.default_rng(0).standard_normal((8, 8)))[0]
    omega, shapes = ritz(structure, mixed)
    assert omega == pytest.approx(modes.omega, rel=1e-10)
    assert np.abs(np.abs(shapes.T @ (structure.M @ modes.phi)) - np.eye(8)).max() < 1e-7


def test_frequencies_of_a_frame_agree_with_a_dense_solution():
    structure = frame()
    held = structure.clamped_dofs("feet")
    assert cantilever_modes(structure, "feet", 8).omega == pytest.approx(
        dense_frequencies(structure, held, 8), rel=1e-10
    )


def test_dependent_shapes_are_refused():
    structure = frame()
    phi = cantilever_modes(structure, "feet", 3).phi
    with pytest.raises(ValueError, match="the 4 shapes are not independent in the mass they move"):
        ritz(structure, np.column_stack([phi, phi[:, 0]]))


def test_an_unclamped_structure_is_told_how_many_rigid_motions_remain():
    sentence = (
        r"the structure, clamped nowhere, has 6 rigid motions without stiffness. "
        r"Clamp one of its groups, \['bars', 'edge', 'feet', 'left', 'right', 'top'\]"
    )
    with pytest.raises(ValueError, match=sentence):
        cantilever_modes(frame(), (), 4)


def test_a_half_clamped_structure_is_told_how_many_rigid_motions_remain():
    sentence = (
        r"clamped at \['left'\], has 3 rigid motions without stiffness. Clamp one of its other groups, \['bars', 'edge'"
    )
    with pytest.raises(ValueError, match=sentence):
        cantilever_modes(frame(), {"left": ("x", "y", "z")}, 4)
    with pytest.raises(ValueError, match=r"clamped at \['feet'\], has 1 rigid motion without stiffness"):
        cantilever_modes(frame(), {"feet": ("x", "y", "z")}, 4)


def test_parts_that_do_not_touch_are_named():
    mesh = line([[0, 0, 0], [1, 0, 0]], 3).merged(line([[2, 0, 0], [3, 1, 0]], 3))
    mesh = mesh.with_groups(points={"root": [0]})
    structure = build_structure(mesh, [Member("line", "beam", Tube(0.1, 0.005), ALUMINIUM)])
    sentence = r"has 6 rigid motions without stiffness|12 motions without stiffness, of which 6 are rigid"
    with pytest.raises(ValueError, match=sentence) as refusal:
        free_free_modes(structure, 4)
    assert "It falls into 2 parts that share no node (in addition to the largest: " in str(refusal.value)


def test_a_mechanism_is_called_one():
    structure = slender_beam(n=3, order=3)
    twist = np.unique(structure.rotation[::3].tocoo().coords[1])  # rotations about x, along the beam
    keep = np.ones(structure.n_dof)
    keep[twist] = 0.0
    loose = replace(structure, K0=(structure.K.multiply(keep[:, None]).multiply(keep)).tocsr())
    told = (
        r"has 3 motions without stiffness, of which 0 are rigid. It is a mechanism \(the node at \(.*\) turns about \("
    )
    with pytest.raises(ValueError, match=told):
        cantilever_modes(loose, "start", 2)


def test_a_plate_that_hangs_on_a_boom_by_one_node_is_told_where_it_is_loose():
    """It has no stiffness against a turn about its own normal; two nodes hold it."""
    boom, sheet = line([[-1.0, 0, 0], [0, 0, 0]], 2), rectangle(1.0, 0.6, 2, 2, "triangle")
    members = [Member("line", "beam", Tube(0.02, 0.001), ALUMINIUM), Member("surface", "plate", 0.003, ALUMINIUM)]
    structure = build_structure(boom.merged(sheet, tolerance=1e-6), members)
    told = r"has 1 motion without stiffness, of which 0 are rigid. It is a mechanism \(the node at \(.*\) moves along"
    with pytest.raises(ValueError, match=told):
        cantilever_modes(structure, "start", 2)


def test_more_modes_than_dofs_and_unknown_groups_are_refused():
    structure = slender_beam(n=1, order=3)
    with pytest.raises(ValueError, match="50 modes were requested, but only"):
        cantilever_modes(structure, "start", 50)
    with pytest.raises(ValueError, match="request at least one"):
        cantilever_modes(structure, "start", 0)
    with pytest.raises(ValueError, match=r"group 'root' is not in the mesh; it has \['end', 'line', 'start'\]"):
        cantilever_modes(structure, "root", 1)


def test_sets_check_their_own_sizes_and_can_be_picked_from():
    with pytest.raises(ValueError, match="a set of 2 shapes needs as many kinds and frequencies; found 1 and 2"):
        ModeSet(np.zeros((5, 2)), ("vibration",), np.zeros(2))
    modes = cantilever_modes(slender_beam(), "start", 4)
    picked = modes.picked([3, 0])
    assert np.array_equal(picked.omega, modes.omega[[3, 0]]) and np.array_equal(picked.phi, modes.phi[:, [3, 0]])
    assert rigid_set(7).n_modes == 0


def test_modes_of_two_equal_free_beams_come_in_fours():
    """Twice 6 motions without strain, and each bending frequency four times: by beam and by plane."""
    mesh = line([[0, 0, 0], [1.0, 0, 0]], 8)
    twice = mesh.merged(mesh.moved([0, 1.0, 0]))
    section = StiffnessSection(1e6, 100.0, 100.0, 90.0, 1.0, ry=1e-6, rz=1e-6)
    structure = build_structure(twice, [Member("line", "beam", section)])
    found = lowest_modes(structure.K, structure.M, 8, free=True)
    assert found.null.shape[1] == 12
    assert found.omega[:8] == pytest.approx(np.repeat([4.7300407, 7.8532046], 4) ** 2 * 10.0, rel=2e-3)
