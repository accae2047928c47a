"""A hub with a beam: the transcendental equation; the slewed panel of full finite elements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from support.full_solution import FullModel, Reduced, static_path
from support.hub_beam import exact_frequencies

from femflex.assembly import build_mesh, build_modes, build_structure_of
from femflex.case import read_case
from femflex.fem import Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh.generators import line
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_attachment,
    with_derivatives,
)
from femflex.reduction.boundary.rigid import rigid_shapes

HUBS = [(0.0, 1.0, 1.0), (0.1, 0.1, 0.5), (0.1, 0.01, 0.1), (0.5, 5.0, 10.0), (0.0, 1e-3, 1e-2)]  # r, J, m
BEAM = UniformBeam(1.0, EA=1e4, EIy=10.0, EIz=1.0, GJ=10.0, mass_per_length=1.0, rotary_inertia=False)


def hub_frequencies(body, r, J, m, pinned, n=3):
    """Frequencies of the hub (x, y, theta; in-plane) with a body at (r, 0), from the body's moments alone."""
    P, first, mass = body.moments.second, body.moments.first, body.moments.mass
    s, turning = first[1:, 1], P[0, 0, 1:, 1] - P[0, 1, 1:, 0]  # int phi_y dm, int (x phi_y - y phi_x) dm
    k = body.n_modes
    M, K = np.zeros((k + 2, k + 2)), np.zeros((k + 2, k + 2))
    M[0, 0] = m + mass
    M[0, 1] = M[1, 0] = first[0, 0] + r * mass
    M[1, 1] = J + body.moments.inertia()[2, 2] + 2 * r * first[0, 0] + r**2 * mass
    M[0, 2:] = M[2:, 0] = s
    M[1, 2:] = M[2:, 1] = turning + r * s
    M[2:, 2:], K[2:, 2:] = body.moments.elastic_mass(), body.strain.V1
    rigid = 1 if pinned else 2
    M, K = M[2 - rigid :, 2 - rigid :], K[2 - rigid :, 2 - rigid :]
    scale = np.outer(*2 * [1 / np.sqrt(np.diag(M))])
    eigenvalues = eigh(K * scale, M * scale, eigvals_only=True)
    assert np.all(np.abs(eigenvalues[:rigid]) < 1e-6 * eigenvalues[rigid])
    return np.sqrt(eigenvalues[rigid : rigid + n])


def fe_beam(n=8, order=6):
    section = StiffnessSection(EA=1e4, EIy=10.0, EIz=1.0, GJ=10.0, mass_per_length=1.0, ry=1e-6, rz=1e-6)
    member = Member("line", "beam", section, options={"order": order, "rotary_inertia": False})
    return build_structure(line([[0, 0, 0], [1, 0, 0]], n), [member])


def in_plane(structure, modes, n):
    """The first n of the modes that bend in the plane x-y."""
    sideways = np.abs(structure.translation @ modes.phi)[1::3].max(axis=0)
    return modes.picked(np.flatnonzero(sideways > 1e-3 * sideways.max())[:n])


def vibration_and_static(structure):
    """Eight cantilever modes and the two static shapes of a root that accelerates along y and about z."""
    return with_attachment(
        structure, in_plane(structure, cantilever_modes(structure, "start", 24), 8), directions=("y", "rz")
    )


def test_the_transcendental_equation_has_the_known_limits():
    clamped = np.array([1.87510406871196, 4.69409113297417, 7.85475743823761]) ** 2
    pinned_free = np.array([3.92660231204792, 7.06858274562873, 10.2101761228130]) ** 2
    free_free = np.array([4.73004074486270, 7.85320462409584, 10.9956078380017]) ** 2
    assert exact_frequencies(0.3, 1e9, 1e9, False) == pytest.approx(clamped, rel=1e-6)
    assert exact_frequencies(0.0, 1e-10, 1.0, True) == pytest.approx(pinned_free, rel=1e-6)
    assert exact_frequencies(0.0, 1e-11, 1e-9, False) == pytest.approx(free_free, rel=1e-6)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("pinned", [True, False], ids=["pinned", "free"])
@pytest.mark.parametrize(("r", "J", "m"), HUBS)
def test_ten_finite_element_shapes_give_three_hub_beam_frequencies(r, J, m, pinned):
    structure = fe_beam()
    body = reduce_structure(structure, vibration_and_static(structure))
    assert body.n_modes == 10
    assert hub_frequencies(body, r, J, m, pinned) == pytest.approx(exact_frequencies(r, J, m, pinned), rel=1e-9)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("pinned", [True, False], ids=["pinned", "free"])
@pytest.mark.parametrize(("r", "J", "m"), HUBS)
@pytest.mark.parametrize(
    ("functions", "tolerance"),
    [(BeamFunctions(y=10, static=True), 1e-9), (BeamFunctions(y=10, family="polynomial"), 1e-6)],
    ids=["characteristic", "polynomial"],
)
def test_ten_admissible_functions_give_three_hub_beam_frequencies(functions, tolerance, r, J, m, pinned):
    body = beam_body(BEAM, functions)
    exact = exact_frequencies(r, J, m, pinned)
    assert hub_frequencies(body, r, J, m, pinned) == pytest.approx(exact, rel=tolerance)


CASE = Path(__file__).parents[2] / "cases" / "panel_slew_hard.toml"


@pytest.mark.slow
def test_slewed_panel_with_both_nonlinear_forms_matches_full_elements():
    """Under the inertia of an angular acceleration, to 0.66 m of 6 m; what the set leaves out grows with the bend."""
    case = read_case(CASE)
    table = case.bodies["panel_east"]
    structure, modes = build_modes(
        build_structure_of(case, "panel_east", table, build_mesh(case, "panel_east", table)), table
    )
    full, load = FullModel(structure, modes.held), -structure.M @ rigid_shapes(structure)[:, 4]
    corner = structure.mesh.group_points("tip_corner")[0]
    row = structure.translation[[3 * corner + 2]].toarray()[0]
    soft = row[full.free] @ static_path(full, load[full.free], [1e-6])[0] / 1e-6
    factors = np.array([0.22, 0.44, 0.66]) / soft
    exact = static_path(full, load[full.free], factors) @ row[full.free]
    assert exact[-1] > 0.1 * 6.0
    shapes = with_derivatives(structure, modes)
    body = reduce_structure(structure, shapes, strain="nonlinear")
    d = static_path(Reduced(body.strain), shapes.phi.T @ load, factors)
    np.testing.assert_allclose(d @ (shapes.phi.T @ row), exact, rtol=2e-3)
    body = reduce_structure(structure, shapes, strain="condensed")
    n = body.n_modes
    d = static_path(Reduced(body.strain), shapes.phi[:, :n].T @ load, factors)  # the load does not move the followers
    np.testing.assert_allclose(d @ (shapes.phi[:, :n].T @ row), exact, rtol=2e-3)
