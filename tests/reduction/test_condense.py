"""Condensed bodies against relaxed bodies and full finite elements, bent and spun."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.sparse.linalg import splu

from femflex import equilibrium, fem
from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors
from femflex.body.symmetric import packed_size
from femflex.fem import Member, build_structure
from femflex.mesh import line
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    condense,
    reduce_structure,
    with_attachment,
    with_derivatives,
)
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.rigid import free_dofs
from femflex.reduction.modes.vibration import load_vectors
from femflex.system import Load, System, weld


def random_body(seed, n=5):
    rng = np.random.default_rng(seed)
    mass, rho, phi = rng.uniform(0.5, 2, 9), rng.normal(size=(9, 3)), rng.normal(size=(9, 3, n))
    z = np.concatenate([rho[:, None], phi.swapaxes(1, 2)], axis=1)
    moments = MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))
    K = rng.normal(size=(n, n))
    strain = StrainTensors(
        K @ K.T + np.eye(n), np.zeros(n), rng.normal(size=packed_size(n, 3)), rng.normal(size=packed_size(n, 4))
    )
    tip = Marker(rng.normal(size=3), rng.normal(size=(3, n)), rng.normal(size=(3, n)))
    return FlexibleBody(moments, strain, np.eye(n), {"tip": tip})


def decoupled_columns(body, free, slaved):
    """Combinations of the shapes: the free ones as they are, the slaved ones without stiffness in common with them."""
    V1 = body.strain.V1
    X = np.eye(body.n_modes)[:, free + slaved]
    X[free, len(free) :] = -np.linalg.solve(V1[np.ix_(free, free)], V1[np.ix_(free, slaved)])
    return X


def relaxed(body, free, slaved, delta):
    """Least energy over the slaved amplitudes near zero, and all amplitudes there."""
    X = decoupled_columns(body, free, slaved)
    S = X[:, len(free) :]

    def all_amplitudes(y):
        return X @ np.concatenate([delta, y])

    minimum = minimize(
        lambda y: body.strain.energy(all_amplitudes(y)),
        np.zeros(len(slaved)),
        jac=lambda y: S.T @ body.strain.force(all_amplitudes(y)),
        hess=lambda y: S.T @ body.strain.tangent(all_amplitudes(y)) @ S,
        method="trust-exact",
        options={"gtol": 1e-15},
    )
    return minimum.fun, all_amplitudes(minimum.x)


@pytest.mark.parametrize("seed", range(3))
def test_condensed_energy_is_exact_to_fourth_order_and_positions_to_second(seed):
    body, free, slaved = random_body(seed), [0, 2, 4], [1, 3]
    small = condense(body, slaved)
    assert small.n_modes == 3 and small.n_shapes == 5 and len(small.slaves) == 2
    direction = np.random.default_rng(seed).normal(size=3)
    energy, place = [], []
    for size in (0.04, 0.02):
        least, amplitudes = relaxed(body, free, slaved, size * direction)
        energy.append(abs(small.strain.energy(size * direction) - least))
        shown = small.marker("tip").phi @ small.amplitudes(size * direction)
        place.append(np.linalg.norm(shown - body.marker("tip").phi @ amplitudes))
    assert np.log2(energy[0] / energy[1]) > 4.5  # what is left out is of fifth order
    assert np.log2(place[0] / place[1]) > 2.6  # of third order


def test_condensed_energy_of_cantilever_and_of_pinned_beam():
    functions = BeamFunctions(y=3, family="polynomial")
    beam = UniformBeam(2.0, 7e6, 40.0, 40.0, 10.0, 1.3)
    free = beam_body(beam, functions, strain="condensed", orthonormal=False)
    whole = beam_body(beam, replace(functions, axial=12), strain="nonlinear", orthonormal=False)
    d = np.array([0.02, -0.01, 0.005])
    held = whole.strain.energy(np.concatenate([d, np.zeros(12)]))
    linear = d @ free.strain.V1 @ d / 2
    assert held > 2 * linear  # bending alone stretches
    x, weight = np.polynomial.legendre.leggauss(40)
    slope, curvature = (functions.fields((x + 1) / 2, 2.0, k)[:, 1] @ d / np.sqrt(2.0 * 1.3) for k in (1, 2))
    bent = 40.0 / 2 * (weight @ (curvature * slope) ** 2)  # kappa^2 = v''^2 (1 + v'^2) of an inextensible beam
    assert free.strain.energy(d) - linear == pytest.approx(bent, rel=1e-5)
    held_ends = beam_body(
        beam, replace(functions, y=1, ends="pinned-pinned", family="characteristic"), strain="condensed"
    )
    a = 0.05 * np.sqrt(2.0 * 1.3 / 2)  # amplitude of 0.05 sin(pi x / L)
    stretch = (np.pi * 0.05 / 2.0) ** 2 / 4
    wanted = 0.5 * 7e6 * stretch**2 * 2.0 + 0.5 * held_ends.omega[0] ** 2 * a**2
    bent = 40.0 / 2 * 0.05**4 * (np.pi / 2) ** 6 * 2.0 / 8
    assert held_ends.strain.energy(np.array([a])) == pytest.approx(wanted + bent, rel=1e-10)


BEND = 0.07  # of the diagonal of the body's box
STRAIGHT = [[0, 0, 0], [1.0, 0, 0]]
KINKED = [[0, 0, 0], [1.0, 0, 0], [1.9, 0.3, 0]]
FOLDED = [[0, 0, 0], [1.0, 0, 0], [1.0, 0.8, 0]]


def member(path, slenderness=100.0, elements=10):
    r = 1.0 / slenderness
    section = fem.sections.StiffnessSection(1e6, 1e6 * r**2, 1.7e6 * r**2, 0.8e6 * r**2, 1.0, ry=r, rz=1.3 * r)
    return build_structure(line(path, elements), [Member("line", "beam", section)])


def bending_force(structure, modes, way):
    """The force at the end that would bend the linear structure by BEND."""
    free, load = free_dofs(structure, modes.held), load_vectors(structure, [], {"end": [way]})[:, 0]
    x = splu(structure.K[free][:, free].tocsc()).solve(load[free])
    moved = marker_rows(structure, "end").translation[:, free] @ x
    return BEND * np.linalg.norm(np.ptp(structure.mesh.points, axis=0)) / np.linalg.norm(moved)


def bent_elements(structure, modes, way, force):
    """Displacement (3,) of the end of all finite elements under that force, by Newton's method in four stages."""
    free, load = free_dofs(structure, modes.held), load_vectors(structure, [], {"end": [way]})[:, 0]
    elastic, x = structure.internal_force, np.zeros(structure.n_dof)
    for part in (0.25, 0.5, 0.75, 1.0):
        for _ in range(30):
            rest = part * force * load - elastic.force(x)
            x[free] += splu(elastic.tangent(x)[free][:, free].tocsc()).solve(rest[free])
            if np.linalg.norm(rest[free]) < 1e-8 * force * np.linalg.norm(load):
                break
    return marker_rows(structure, "end").translation @ x


def bent_body(structure, modes, way, force):
    """The same of a condensed body, and the body."""
    body = reduce_structure(
        structure, with_derivatives(structure, modes), {"root": "start", "tip": "end"}, strain="condensed"
    )
    push = Load("push", "body", "tip", frame="inertial", force=force * np.eye(3)["xyz".index(way)])
    state = equilibrium(System({"body": body}, (weld("body", child_marker="root"),), (push,)))
    return body.markers["tip"].phi @ body.amplitudes(state.q), body


def error(structure, modes, way):
    modes = with_attachment(structure, modes, (), {"end": [way]})
    force = bending_force(structure, modes, way)
    exact = bent_elements(structure, modes, way, force)
    found, body = bent_body(structure, modes, way, force)
    return np.linalg.norm(found - exact) / np.linalg.norm(exact), body


@pytest.mark.slow
@pytest.mark.sampled(2)
@pytest.mark.parametrize("count", [4, 12, 24])
@pytest.mark.parametrize("attachment", [(), ("x", "y", "z")])
def test_random_sets_of_straight_beam_match_full_elements(count, attachment):
    structure, rng = member(STRAIGHT), np.random.default_rng(count)
    every = cantilever_modes(structure, "start", 40)
    modes = every.picked(np.sort(rng.choice(40, count, replace=False)))
    if attachment:
        modes = with_attachment(structure, modes, attachment)
    off, _ = error(structure, modes, "z")
    assert off < 1e-3


@pytest.mark.sampled(2)
@pytest.mark.parametrize("path, way", [(KINKED, "y"), (KINKED, "z"), (FOLDED, "z")])
@pytest.mark.parametrize("count, attachment", [(4, ("x", "y", "z")), (18, ())])
def test_deflection_of_folded_members_matches_full_elements(path, way, count, attachment):
    structure = member(path)
    modes = cantilever_modes(structure, "start", count)
    if attachment:
        modes = with_attachment(structure, modes, attachment)
    off, _ = error(structure, modes, way)
    assert off < 1e-3


@pytest.mark.slow
def test_slender_folded_members_do_not_lock_with_more_modes():
    """L/r = 1000: with derivatives that carry no coordinate along, twelve modes were 45 % too stiff."""
    structure = member(KINKED, 1000.0)
    for count in (4, 12, 18):
        assert error(structure, cantilever_modes(structure, "start", count), "z")[0] < 1e-3
