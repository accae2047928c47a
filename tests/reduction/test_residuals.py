"""Residual vectors beside vibration modes, clamped and free, against closed forms of beam statics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from femflex.fem import Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh.generators import line
from femflex.reduction import (
    cantilever_modes,
    craig_bampton,
    free_free_modes,
    load_vectors,
    reduce_structure,
    with_attachment,
)

EI, EA, GJ, LENGTH = 50.0, 1e6, 30.0, 2.0
ALL = ("x", "y", "z", "rx", "ry", "rz")


@pytest.fixture(scope="module")
def beam():
    section = StiffnessSection(EA=EA, EIy=EI, EIz=EI, GJ=GJ, mass_per_length=1.0, ry=0.05, rz=0.05)
    member = Member("line", "beam", section, options={"order": 3, "rotary_inertia": False})
    return build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], 6), [member])


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
def test_a_free_set_with_those_of_its_ends_is_a_clamped_beam_in_statics(beam, modes):
    """P L^3 / 3 EI, M L / EI, P L / EA and M L / GJ of a beam whose clamp is a joint; modes alone are far off."""
    shapes = with_attachment(beam, free_free_modes(beam, modes), (), {"start": ALL, "end": ALL})
    body = reduce_structure(beam, shapes, {"start": "start", "end": "end"})
    n, end, Z = body.n_modes, body.markers["end"], held_still(body)
    r = np.cross(np.eye(3), end.position).T
    rows = np.block([[end.phi, np.eye(3), r], [end.psi, np.zeros((3, 3)), np.eye(3)]]) @ Z
    K = Z[:n].T @ body.strain.V1 @ Z[:n]
    flexibility = rows @ np.linalg.solve(K, rows.T)
    exact = [LENGTH / EA, LENGTH**3 / (3 * EI), LENGTH**3 / (3 * EI), LENGTH / GJ, LENGTH / EI, LENGTH / EI]
    assert np.diag(flexibility) == pytest.approx(exact, rel=1e-5)
    assert flexibility[1, 5] == pytest.approx(LENGTH**2 / (2 * EI), rel=1e-5)


@pytest.mark.parametrize(
    "make",
    [
        lambda s: cantilever_modes(s, "start", 3),
        lambda s: free_free_modes(s, 3),
        lambda s: craig_bampton(s, ["start"], 3),
        lambda s: craig_bampton(s, ["end"], 2, clamp="start"),
    ],
    ids=["cantilever", "free-free", "reference", "clamp and interface"],
)
def test_they_are_orthogonal_to_the_set_and_add_nothing_twice(beam, make):
    modes = make(beam)
    more = with_attachment(beam, modes, (), {"start": ALL, "end": ALL}, load_vectors(beam, (), {"end": ("z", "rx")}))
    again = with_attachment(beam, more, (), {"end": ALL})
    assert again.n_modes == more.n_modes > modes.n_modes - 1
    np.testing.assert_allclose(more.phi.T @ (beam.M @ more.phi), np.eye(more.n_modes), atol=1e-7)
    np.testing.assert_array_equal(more.phi[:, : modes.n_modes], modes.phi)


def test_what_interfaces_hold_is_not_added(beam):
    """Constraint modes of an interface are its static shapes, of a beam clamped at the other end."""
    modes = craig_bampton(beam, ["end"], 2, clamp="start")
    assert with_attachment(beam, modes, (), {"end": ALL}).n_modes == modes.n_modes


def test_frequencies_of_a_clamped_free_set_are_those_of_the_cantilever(beam):
    """Three free-free modes and residual vectors, the start clamped by a joint: 1.8751^2 sqrt(EI / m L^4) to 1e-4."""
    shapes = with_attachment(beam, free_free_modes(beam, 3), (), {"start": ALL})
    body = reduce_structure(beam, shapes, {"start": "start"})
    n, m, Z = body.n_modes, body.moments, held_still(body)
    P = m.second
    turning = np.einsum("abc,bkc->ak", _epsilon(), P[0, :, 1:, :])
    M = np.zeros((n + 6, n + 6))
    M[:n, :n] = m.elastic_mass()
    M[n : n + 3, n : n + 3] = m.mass * np.eye(3)
    M[n + 3 :, n + 3 :] = m.inertia()
    c = m.first[0]
    arm = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
    M[n + 3 :, n : n + 3], M[n : n + 3, n + 3 :] = arm, arm.T
    M[n : n + 3, :n], M[n + 3 :, :n] = m.first[1:].T, turning
    M[:n, n:] = M[n:, :n].T
    K = np.zeros_like(M)
    K[:n, :n] = body.strain.V1
    lowest = np.sqrt(eigh(Z.T @ K @ Z, Z.T @ M @ Z, eigvals_only=True)[0])
    assert lowest == pytest.approx(1.8751040687**2 * np.sqrt(EI / LENGTH**4), rel=1e-4)


def _epsilon():
    e = np.zeros((3, 3, 3))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        e[a, b, c], e[a, c, b] = 1.0, -1.0
    return e
