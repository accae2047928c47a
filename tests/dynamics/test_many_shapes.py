"""Bodies with more shapes than a lane holds: the equations against material points, and the ways their mass can be."""

from dataclasses import replace

import numpy as np
import pytest
from support.pointwise import Jet, Tree, equations
from support.random_systems import random_body, random_state, random_tree

from femflex.body import MassMoments
from femflex.dynamics import compile_system

COUNTS = (0, 4, 5, 8, 9)


def many_shapes(seed, moving_markers):
    """A random system whose bodies have up to nine shapes, its clouds and a state."""
    system, _, _ = random_tree(seed, n_bodies=4)
    rng = np.random.default_rng(seed)
    counts = rng.permutation(COUNTS)
    pairs = {name: random_body(rng, int(n), moving_markers) for name, n in zip(system.bodies, counts, strict=False)}
    system = replace(system, bodies={name: body for name, (body, _) in pairs.items()})
    return system, {name: cloud for name, (_, cloud) in pairs.items()}, random_state(system, rng)


def orthonormal(body):
    """The body with other shapes of the same span, orthonormal over the mass."""
    n, moments = body.n_modes, body.moments
    T = np.eye(1 + n)
    T[1:, 1:] = np.linalg.inv(np.linalg.cholesky(moments.elastic_mass())).T
    second = np.einsum("AaBb,AC,BD->CaDb", moments.second, T, T)
    return replace(body, moments=MassMoments(moments.mass, T.T @ moments.first, second))


def elastic_rows(system, q, u):
    """f0 + V1 delta + D ddelta at the elastic rows."""
    out, iq, iu = np.zeros(len(u)), 0, 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        iq, iu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        out[iu : iu + n] = body.strain.f0 + body.strain.V1 @ q[iq : iq + n] + body.damping @ u[iu : iu + n]
        iq, iu = iq + n, iu + n
    return out


@pytest.mark.sampled(2)
@pytest.mark.parametrize("moving_markers", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_residual_equals_kanes_equations_over_material_points(seed, moving_markers):
    system, clouds, (q, u) = many_shapes(seed, moving_markers)
    model = compile_system(system)
    udot = np.random.default_rng(seed).normal(size=model.n_u)
    ours = model.residual(0.0, np.concatenate([q, u]), udot)
    still = Jet(np.eye(3))
    theirs = equations(Tree(system, clouds), q, u, udot, lambda moving: still, lambda m, r: np.zeros((len(m), 3)))
    theirs = theirs + elastic_rows(system, q, u)
    assert ours == pytest.approx(theirs, rel=1e-11, abs=1e-11 * np.abs(theirs).max())


@pytest.mark.parametrize("shapes", ["any", "orthonormal"])
@pytest.mark.parametrize("moving_markers", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_recursion_solves_the_equations_however_the_elastic_block_is_factorised(seed, moving_markers, shapes):
    system, _, (q, u) = many_shapes(seed, moving_markers)
    if shapes == "orthonormal":
        system = replace(system, bodies={name: orthonormal(body) for name, body in system.bodies.items()})
    model = compile_system(system)
    x = np.concatenate([q, u])
    udot = model.state_rate(0.0, x)[model.n_q :]
    scale = np.abs(model.bias(0.0, x)).max()
    assert model.residual(0.0, x, udot) == pytest.approx(np.zeros(model.n_u), abs=1e-10 * scale)


def test_an_answer_does_not_depend_on_what_was_left_in_the_scratch_array_and_repeats_bit_for_bit():
    system, _, (q, u) = many_shapes(3, True)
    model = compile_system(system)
    x = np.concatenate([q, u])
    first = model.state_rate(0.0, x), model.residual(0.0, x, u), model.observe(np.zeros(1), x[None])
    model.work[:] = np.nan
    again = model.state_rate(0.0, x), model.residual(0.0, x, u), model.observe(np.zeros(1), x[None])
    assert np.array_equal(first[0], again[0])
    assert np.array_equal(first[1], again[1])
    assert all(np.array_equal(first[2][path], again[2][path]) for path in first[2])


def test_a_state_that_is_not_a_number_shows_in_the_rate():
    system, _, (q, u) = many_shapes(3, True)
    model = compile_system(system)
    for j in range(model.n_x):
        x = np.concatenate([q, u])
        x[j] = np.nan
        assert np.isnan(model.state_rate(0.0, x)).any(), f"entry {j} of the state is NaN and the rate hides it"
