"""Nonlinear strain in the compiled equations, against the tensors' own forms and against the energy."""

from dataclasses import replace

import numpy as np
import pytest
from support.random_systems import random_tree
from test_terms import along, one

from femflex.body.symmetric import packed_size
from femflex.dynamics import compile_system
from femflex.integrate import integrator


def curved(system, rng, size=0.5):
    """The system with random V2 and V3 on every flexible body."""

    def bent(body):
        n = body.n_modes
        V2, V3 = (size * rng.normal(size=packed_size(n, degree)) for degree in (3, 4))
        return replace(body, strain=replace(body.strain, V2=V2, V3=V3)) if n else body

    return replace(system, bodies={name: bent(body) for name, body in system.bodies.items()})


def random_curved(seed, n_bodies=4, **more):
    """A compiled random tree with nonlinear strain, its straight twin, and a state."""
    system, _, (q, u) = random_tree(seed, n_bodies=n_bodies, **more)
    x = np.concatenate([q, u])
    return compile_system(curved(system, np.random.default_rng(seed))), compile_system(system), x


def elastic_places(system):
    """(body, places in q, places in u) of every flexible body."""
    iq = iu = 0
    for name in system.order:
        joint, body = system.joint_of(name), system.bodies[name]
        iq, iu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        yield body, slice(iq, iq + n), slice(iu, iu + n)
        iq, iu = iq + n, iu + n


@pytest.mark.parametrize("seed", range(6))
def test_residual_carries_the_force_of_the_strain_tensors(seed):
    model, straight, x = random_curved(seed)
    found = model.bias(0.0, x) - straight.bias(0.0, x)
    expected = np.zeros(model.n_u)
    for body, q, u in elastic_places(model.system):
        expected[u] = body.strain.force(x[q]) - body.strain.f0 - body.strain.V1 @ x[q]
    assert np.abs(expected).max() > 1e-3
    assert found == pytest.approx(expected, abs=1e-11 * max(1.0, np.abs(model.bias(0.0, x)).max()))
    udot = model.state_rate(0.0, x)[model.n_q :]
    assert model.residual(0.0, x, udot) == pytest.approx(np.zeros(model.n_u), abs=1e-9 * np.abs(found).max())


@pytest.mark.parametrize("seed", range(4))
def test_implicit_solve_has_the_tangent_stiffness_of_the_state(seed):
    model, _, x = random_curved(seed)
    rhs = np.random.default_rng(seed).normal(size=model.n_u)
    out, q = np.empty(model.n_u), x[: model.n_q].copy()
    model.second_order.solve(0.0, q, rhs, out, 2.0, 0.3, 0.7, model.table, model.pool, model.work)
    S = 2.0 * model.mass_matrix(0.0, np.r_[q, np.zeros(model.n_u)])
    for body, at, u in elastic_places(model.system):
        S[u, u] += 0.3 * body.damping + 0.7 * body.strain.tangent(q[at])
    assert S @ out == pytest.approx(rhs, abs=1e-9)


def test_terms_keep_the_orders_of_the_stiffness_apart_and_sum_to_zero():
    model, _, x = random_curved(5)
    found, twice = one(model, x), x.copy()
    for _, q, _ in elastic_places(model.system):
        twice[q] *= 2
    larger = one(model, twice)
    for name, factor in (("elastic", 2), ("elastic_K2", 4), ("elastic_K3", 8)):
        assert np.abs(found[name]).max() > 1e-3
        assert larger[name] == pytest.approx(factor * found[name], rel=1e-12)
    assert np.abs(sum(found.values())).max() < 1e-12 * max(np.abs(row).max() for row in found.values())
    pull = sum(found[name] for name in ("elastic", "elastic_K2", "elastic_K3", "prestress"))
    assert x[model.n_q :] @ pull == pytest.approx(along(model, x, "monitors/elastic"), rel=1e-8)


@pytest.mark.parametrize("short, name", [("K2", "elastic_K2"), ("K3", "elastic_K3")])
def test_either_part_of_the_stiffness_can_be_switched_off(short, name):
    model, _, x = random_curved(5)
    less = model.without(short)
    assert less.omitted == (name,)
    M = model.mass_matrix(0.0, x)
    pushed = M @ (less.state_rate(0.0, x) - model.state_rate(0.0, x))[model.n_q :]
    assert pushed == pytest.approx(one(model, x)[name], abs=1e-9 * np.abs(M).max())
    assert name not in one(less, x)


@pytest.mark.parametrize("method, drift", [("dop853", 1e-9), ("generalized_alpha", 1e-6)])
def test_energy_is_kept_along_a_run_at_large_deflection(method, drift):
    model, straight, x = random_curved(4, n_bodies=3)
    model, straight = model.without("damping", "prestress"), straight.without("damping", "prestress")
    times = np.linspace(0, 2, 41)
    states = integrator(method, rtol=1e-10, atol=1e-10).solve(model, times, x).states
    energy = model.observe(times, states)["monitors/energy"]
    assert np.ptp(energy) < drift * np.abs(energy).max()
    other = integrator("dop853", rtol=1e-10, atol=1e-10).solve(straight, times, x).states
    assert np.abs(other[-1] - states[-1]).max() > 1e-2  # and the strain matters


def test_one_mode_with_cubic_stiffness_swings_as_duffings_equation():
    from scipy.special import ellipk

    from femflex.body import FlexibleBody, MassMoments, StrainTensors
    from femflex.system import System, weld

    k, cubic, a = 4.0, 3.0, 1.7  # x'' + k x + cubic x^3 = 0
    moments = MassMoments(1.0, np.array([[0, 0, 0], [1.0, 0, 0]]), np.zeros((2, 3, 2, 3)))
    moments.second[1, 0, 1, 0] = 1.0
    strain = StrainTensors(np.array([[k]]), np.zeros(1), np.zeros(1), np.array([cubic / 2]))
    body = FlexibleBody(moments, strain, np.zeros((1, 1)), {})
    model = compile_system(System({"beam": body}, (weld("beam"),), delta0={"beam": np.array([a])}))
    omega = np.sqrt(k + cubic * a**2)
    period = 4 / omega * ellipk(cubic * a**2 / (2 * omega**2))
    end = integrator("dop853", rtol=1e-12, atol=1e-12).solve(model, np.array([0.0, period]), model.x0).states[-1]
    assert end == pytest.approx([a, 0.0], abs=1e-9)
    assert model.max_frequency == pytest.approx(np.sqrt(k + 3 * cubic * a**2), rel=1e-5)
