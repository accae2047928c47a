"""Modes, effective masses and residual vectors against closed forms."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from support.reduction_examples import (
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

from femflex.body.slices import shape_names
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.fem.sections.laminates import isotropic
from femflex.mesh import Mesh
from femflex.mesh.generators import line, rectangle
from femflex.mesh.second_order import raise_order
from femflex.reduction import (
    cantilever_modes,
    effective_mass,
    free_free_modes,
    mac_of_bodies,
    nodal,
    reduce_structure,
    with_attachment,
)
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.mode_warnings import half_wave_text, warn_of_few_elements
from femflex.warning import PhysicsWarning


def closed_form(roots, EI):
    return roots**2 * np.sqrt(EI / (MASS * LENGTH**4))


def both_planes(roots):
    return np.sort(np.concatenate([closed_form(roots, EI_Y), closed_form(roots, EI_Z)]))


def test_cantilever_frequencies_are_the_closed_form():
    modes = cantilever_modes(slender_beam(), "start", 8)
    assert modes.omega == pytest.approx(both_planes(CLAMPED_FREE), rel=2e-9)
    assert modes.kinds == ("vibration",) * 8
    assert modes.groups == ("start",)


def test_free_free_frequencies_match_closed_form_without_rigid_modes():
    modes = free_free_modes(slender_beam(direction=(1, 2, -0.5)), 6)
    assert modes.omega == pytest.approx(both_planes(FREE_FREE), rel=2e-9)
    assert modes.kinds == ("free-free",) * 6


def test_free_free_modes_have_no_linear_or_angular_momentum():
    structure = bent_boom()
    body = reduce_structure(structure, free_free_modes(structure, 7))
    P = body.moments.second[0, :, 1:, :]  # b, k, c of int rho_b phi_kc dm
    angular = np.stack([P[1, :, 2] - P[2, :, 1], P[2, :, 0] - P[0, :, 2], P[0, :, 1] - P[1, :, 0]])
    scale = np.sqrt(body.moments.mass)
    assert np.abs(body.moments.first[1:]).max() < 1e-12 * scale
    assert np.abs(angular).max() < 1e-11 * scale


def test_attachment_shapes_complete_static_response_to_loads():
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


def test_frequencies_of_a_frame_agree_with_a_dense_solution():
    structure = frame()
    held = structure.clamped_dofs("feet")
    assert cantilever_modes(structure, "feet", 8).omega == pytest.approx(
        dense_frequencies(structure, held, 8), rel=1e-10
    )


@pytest.fixture(scope="module")
def boom():
    return bent_boom()


def test_effective_masses_of_a_cantilever_are_the_textbook_fractions():
    structure = slender_beam(n=8)
    body = reduce_structure(structure, cantilever_modes(structure, "start", 6))
    found, order = effective_mass(body), ("1st", "2nd", "3rd")
    assert shape_names(body, found.shapes) == tuple(f"{n} bending {axis}" for n in order for axis in "zy")
    along_z = found.effective[[0, 2, 4], 2] / (MASS * LENGTH)  # EIy is the softer plane: modes 1, 3, 5 bend along z
    assert along_z == pytest.approx([0.613076, 0.188300, 0.064740], abs=1e-5)
    assert found.total[:3] == pytest.approx(MASS * LENGTH)
    assert found.total[4] == pytest.approx(MASS * LENGTH**3 / 3, rel=1e-5)
    assert found.running[-1] == pytest.approx(found.carried_fraction)


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


def test_mac_of_the_same_beam_on_two_meshes():
    bodies = []
    for n in (16, 20):
        structure = slender_beam(n=n)
        bodies.append(reduce_structure(structure, cantilever_modes(structure, "start", 4)))
    found = mac_of_bodies(*bodies)
    assert np.diag(found).min() > 0.97 and (found - np.diag(np.diag(found))).max() < 0.1
    assert mac_of_bodies(bodies[0], bodies[0]) == pytest.approx(mac_of_bodies(bodies[0], bodies[0]).T)


EI, EA, GJ, SPAN = 50.0, 1e6, 30.0, 2.0
ALL = ("x", "y", "z", "rx", "ry", "rz")


@pytest.fixture(scope="module")
def beam():
    section = StiffnessSection(EA=EA, EIy=EI, EIz=EI, GJ=GJ, mass_per_length=1.0, ry=0.05, rz=0.05)
    member = Member("line", "beam", section, options={"order": 3, "rotary_inertia": False})
    return build_structure(line([[0, 0, 0], [SPAN, 0, 0]], 6), [member])


def held_still(body):
    """Columns (n + 6, m) of elastic and rigid motions in which the marker of the start does not move."""
    start = body.markers["start"]
    r, n = start.position, body.n_modes
    turned = np.cross(np.eye(3), r)  # e_k x r in row k
    rows = np.block([[start.phi[:, :n], np.eye(3), turned.T], [start.psi[:, :n], np.zeros((3, 3)), np.eye(3)]])
    _, sigma, V = np.linalg.svd(rows)
    assert sigma[-1] > 1e-9
    return V[6:].T


@pytest.mark.parametrize("modes", [1, 3])
def test_free_free_set_with_static_shapes_of_ends_matches_clamped_beam(beam, modes):
    """P L^3 / 3 EI, M L / EI, P L / EA and M L / GJ of a beam whose clamp is a joint; modes alone are far off."""
    shapes = with_attachment(beam, free_free_modes(beam, modes), (), {"start": ALL, "end": ALL})
    body = reduce_structure(beam, shapes, {"start": "start", "end": "end"})
    n, end, Z = body.n_modes, body.markers["end"], held_still(body)
    r = np.cross(np.eye(3), end.position).T
    rows = np.block([[end.phi, np.eye(3), r], [end.psi, np.zeros((3, 3)), np.eye(3)]]) @ Z
    K = Z[:n].T @ body.strain.V1 @ Z[:n]
    flexibility = rows @ np.linalg.solve(K, rows.T)
    exact = [SPAN / EA, SPAN**3 / (3 * EI), SPAN**3 / (3 * EI), SPAN / GJ, SPAN / EI, SPAN / EI]
    assert np.diag(flexibility) == pytest.approx(exact, rel=1e-5)
    assert flexibility[1, 5] == pytest.approx(SPAN**2 / (2 * EI), rel=1e-5)


@pytest.mark.parametrize("n", [4, 14])
def test_warning_of_coarse_four_node_plates(n):
    """A square cantilever plate: modes with fewer than seven elements in a half-wave, against nine-node elements."""
    section, frequencies, said = isotropic(0.05, Material(200e9, 0.3, 8000.0)), [], []
    for mesh in (rectangle(10.0, 10.0, n, n, "quad"), rectangle(10.0, 10.0, 8, 8, "quad9")):
        s = build_structure(mesh, [Member("surface", "shell", section)])
        modes = cantilever_modes(s, "left", 6)
        frequencies.append(modes.omega)
        with warnings.catch_warnings(record=True) as given:
            warnings.simplefilter("always")
            warn_of_few_elements(s, modes)
        said.append("".join(str(one.message) for one in given))
        assert "elements in a half-wave of each mode" in half_wave_text(s, modes)
    error = np.abs(frequencies[0] / frequencies[1] - 1)
    assert not said[1]
    if n == 4:
        assert error[2:].min() > 0.05 and "6 of 6 modes" in said[0] and "second order" in said[0]
    else:
        assert error.max() < 0.02 and not said[0]


@pytest.mark.filterwarnings("ignore:shell on group")
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_warning_of_coarse_three_node_shells(share):
    """A strip with three-node elements, all or the half at its root, against nine-node ones: 2 % off are counted."""
    squares, exact = rectangle(1.0, 0.2, 8, 2, "quad"), rectangle(1.0, 0.2, 16, 4, "quad9")
    triangles = squares.cells["quad"][:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    groups, left = {"surface": {"triangle": np.arange(len(triangles))}}, {"left": squares.group_points("left")}
    mesh = Mesh(squares.points, {"triangle": triangles}, groups, left)
    mesh = raise_order(mesh, {"triangle": np.flatnonzero(mesh.points[triangles].mean(axis=1)[:, 0] > 1 - share)})
    section = isotropic(0.004, Material(70e9, 0.3, 2700.0))
    s, fine = (build_structure(m, [Member("surface", "shell", section)]) for m in (mesh, exact))
    modes = cantilever_modes(s, "left", 6)
    error = modes.omega / cantilever_modes(fine, "left", 6).omega - 1
    with pytest.warns(PhysicsWarning, match="shell elements of type triangle:") as given:
        warn_of_few_elements(s, modes)
    assert error[2] > 0.3  # torsion
    assert int(str(given[0].message).split(" of 6 modes")[0].split()[-1]) >= np.count_nonzero(error > 0.03) >= 4
