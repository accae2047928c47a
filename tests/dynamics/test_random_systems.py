"""Properties that every system has, over a table of random ones: trees, orbits, condensed strain, prescribed motion,
loops and effectors, with springs, dampers and loads. The second formulation is Kane's equations over material points.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from support.random_systems import KINDS
from support.random_table import SYSTEMS, Problem

from femflex.dynamics.motion.freedoms import free_directions, usual_sizes
from femflex.dynamics.motion.increments import advanced
from femflex.integrate import integrator
from femflex.linear.equations import linearised

TREES = [name for name in SYSTEMS if "loop" not in name and name != "effectors"]
OF_POINTS = [name for name in SYSTEMS if name not in ("effectors", "free orbit")]  # test_attraction.py has its gravity


@cache
def problem(name: str) -> Problem:
    return SYSTEMS[name]()


def terms(model, t, x):
    """The terms of the equation of motion at one instant, name -> (n_u,)."""
    return {name: rows[0] for name, rows in model.terms(np.array([t]), x[None]).items()}


def largest(rows) -> float:
    return max(np.abs(row).max() for row in rows.values())


def constraint_forces(rows):
    """Forces (n_u,) that hold loops and prescribed coordinates."""
    found = [row for name, row in rows.items() if name.startswith(("loops/", "drives/"))]
    return -np.sum(found, axis=0) if found else np.zeros(len(rows["inertia"]))


def test_table_has_every_joint():
    kinds = {joint.kind for name in SYSTEMS for joint in problem(name).system.joints}
    assert {kind.__name__ for kind in KINDS} <= kinds


@pytest.mark.sampled(8)
@pytest.mark.parametrize("name", [name for name in TREES if name in OF_POINTS])
def test_residual_is_kanes_equations_over_points(name):
    p = problem(name)
    udot = np.random.default_rng(1).normal(size=p.model.n_u)
    theirs, rows = p.kane(udot), p.prescribed
    ours = p.model.residual(p.t, p.x, udot)
    free = np.setdiff1d(np.arange(p.model.n_u), rows)
    assert ours[rows] == pytest.approx((udot - p.udot)[rows], abs=1e-10 * np.abs(p.udot).max(initial=1))
    udot[rows] = p.udot[rows]
    ours, theirs = p.model.residual(p.t, p.x, udot), p.kane(udot)
    assert ours[free] == pytest.approx(theirs[free], rel=1e-10, abs=1e-10 * np.abs(theirs).max(initial=1))


@pytest.mark.sampled(8)
@pytest.mark.parametrize("name", OF_POINTS)
def test_recursion_satisfies_kanes_equations_with_constraint_forces(name):
    p = problem(name)
    left, rows = p.kane(p.udot), terms(p.model, p.t, p.x)
    size = largest(rows)
    assert left == pytest.approx(constraint_forces(rows), abs=1e-10 * size)
    if p.system.loops:
        A, _, swept = p.rows(p.u)
        assert p.model.x0[: p.model.n_q] == pytest.approx(p.q, abs=1e-11)  # already closed
        assert A @ p.udot == pytest.approx(-swept, abs=1e-10 * max(1.0, (np.abs(A) @ np.abs(p.udot)).max()))
        multipliers = np.linalg.lstsq(A.T, left, rcond=1e-10)[0]
        assert A.T @ multipliers == pytest.approx(left, abs=1e-9 * size)


@pytest.mark.parametrize("name", SYSTEMS)
def test_terms_sum_to_zero(name):
    p = problem(name)
    rows = terms(p.model, p.t, p.x)
    assert {"inertia", "coriolis_centrifugal", "joint_springs", "joint_dampers", "loads/push", "loads/pull"} <= set(
        rows
    )
    assert np.abs(sum(rows.values())).max() < 1e-11 * largest(rows)


@pytest.mark.parametrize("name", SYSTEMS)
def test_mass_matrix_and_bias_agree_with_rate(name):
    p = problem(name)
    M, h, rows = p.model.mass_matrix(p.t, p.x), p.model.bias(p.t, p.x), terms(p.model, p.t, p.x)
    free = np.setdiff1d(np.arange(p.model.n_u), p.prescribed)
    left = M @ p.udot + h - constraint_forces(rows)
    assert left[free] == pytest.approx(0.0, abs=1e-10 * largest(rows))
    assert rows["inertia"][free] == pytest.approx((M @ p.udot)[free], abs=1e-9 * largest(rows)) or p.prescribed
    inner = M[np.ix_(free, free)]
    assert inner == pytest.approx(inner.T, abs=1e-10 * np.abs(M).max()) and np.linalg.eigvalsh(inner).min() > 0


def difference(function, at, directions, sizes):
    """Columns of central differences of order four of function(at + increment)."""
    return np.column_stack(
        [
            (function(at - 2 * h * e) - 8 * function(at - h * e) + 8 * function(at + h * e) - function(at + 2 * h * e))
            / (12 * h)
            for e, h in zip(directions, sizes, strict=True)
        ]
    )


@pytest.mark.parametrize("name", [*(name for name in TREES if "prescribed" not in name), "effectors"])
def test_linear_equations_are_derivatives_of_residual(name):
    p = problem(name)
    model, n = p.model, p.model.n_u
    rng = np.random.default_rng(3)
    udot, eye, zero, z = rng.normal(size=n), np.eye(n), np.zeros(n), model.parts(p.x)[2]
    ours = linearised(model, p.t, p.x, udot)
    sizes = 1e-3 * usual_sizes(model)
    K = difference(
        lambda d: model.residual(p.t, np.concatenate([advanced(model, p.q, d), p.u, z]), udot), zero, eye, sizes
    )
    D = difference(lambda u: model.residual(p.t, np.concatenate([p.q, u, z]), udot), p.u, eye, np.ones(n))
    for found, wanted in ((ours.M, model.mass_matrix(p.t, p.x)), (ours.D, D), (ours.K, K)):
        assert found == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize("name", ["loop", "two loops"])
def test_linear_equations_of_loops_are_derivatives_at_constant_multipliers(name):
    p = problem(name)
    model, still = p.model, np.zeros(p.model.n_u)
    x = np.concatenate([p.q, still])
    ours = linearised(model, 0.0, x)
    _, Z = free_directions(model, 0.0, x)
    G = model.constraints.matrix(0.0, x)
    assert np.abs(G @ Z).max() < 1e-9 * np.abs(G).max()
    multipliers = np.linalg.lstsq(G.T, model.bias(0.0, x), rcond=None)[0]

    def static_residual(d):
        moved = np.concatenate([advanced(model, p.q, d), still])
        return model.bias(0.0, moved) - model.constraints.matrix(0.0, moved).T @ multipliers

    K = Z.T @ difference(static_residual, still, np.eye(len(still)), 1e-3 * usual_sizes(model)) @ Z
    assert ours.M == pytest.approx(Z.T @ model.mass_matrix(0.0, x) @ Z, abs=1e-8 * np.abs(ours.M).max())
    assert ours.K == pytest.approx(K, abs=1e-6 * np.abs(K).max())


@pytest.mark.parametrize("name", ["tree 1", "condensed", "prescribed", "two loops", "effectors"])
def test_energy_changes_by_supplied_less_dissipated_power(name):
    p = problem(name)
    times = np.linspace(p.t, p.t + 0.2, 81)
    states = integrator("dop853", rtol=1e-11, atol=1e-12).solve(p.model, times, p.x).states
    seen = p.model.observe(times, states)
    power = seen["monitors/supplied"] - seen["monitors/dissipation"] + seen.get("monitors/drive_power", 0.0)
    energy = seen["monitors/energy"]
    work = CubicSpline(times, power).antiderivative()(times)
    assert np.ptp(energy) > 1e-3
    assert energy - energy[0] == pytest.approx(work, abs=1e-6 * np.abs(work).max())


@pytest.mark.parametrize("name", ["tree 1", "condensed", "two loops"])
def test_energy_is_constant_without_dissipation_and_loads(name):
    p = problem(name)
    dampers = [
        key for key in terms(p.model, p.t, p.x) if key in ("damping", "joint_dampers") or key.startswith("loads/")
    ]
    model, times = p.model.without(*dampers), np.linspace(0.0, 0.3, 16)
    energy = model.observe(times, integrator("dop853", rtol=1e-12, atol=1e-13).solve(model, times, p.x).states)[
        "monitors/energy"
    ]
    assert energy == pytest.approx(np.full(16, energy[0]), abs=1e-9 * np.abs(energy[0]))


@pytest.mark.parametrize("name", SYSTEMS)
def test_without_removes_its_row_alone(name):
    """The remaining terms sum to zero, no other force changes, and the accelerations follow."""
    p = problem(name)
    full = terms(p.model, p.t, p.x)
    size, following = largest(full), ("inertia", "loops/", "drives/", "effectors/")
    for row in full:
        if row.startswith(following):
            continue
        less = p.model.without(row)
        left = terms(less, p.t, p.x)
        assert set(full) - set(left) == {row}, row
        assert np.abs(sum(left.values())).max() < 1e-10 * size, row
        for key in left:
            if not key.startswith(following):
                assert left[key] == pytest.approx(full[key], abs=1e-11 * size), (row, key)
        udot = less.parts(less.state_rate(p.t, p.x))[1]
        if np.abs(full[row]).max() > 1e-3 * size and not p.prescribed and not p.system.loops:
            assert np.abs(udot - p.udot).max() > 1e-6
        if not p.prescribed and not p.system.loops:
            pushed = p.model.mass_matrix(p.t, p.x) @ (udot - p.udot)
            assert pushed == pytest.approx(full[row], abs=1e-9 * size), row


@pytest.mark.parametrize("name", TREES)
def test_implicit_solve_inverts_mass_damping_and_tangent_stiffness(name):
    p = problem(name)
    model, own, c_m, c_d, c_k = p.model, p.model.workspace.arrays, 2.0, 0.3, 0.7
    S, iq, iu = c_m * model.mass_matrix(p.t, p.x), 0, 0
    for body_name in p.system.order:
        joint, body = p.system.joint_of(body_name), p.system.bodies[body_name]
        own_rows = slice(iu, iu + joint.n_u)
        S[own_rows, own_rows] += np.diag(c_d * joint.damping + c_k * joint.stiffness)
        iq, iu, n = iq + joint.n_q, iu + joint.n_u, body.n_modes
        s = slice(iu, iu + n)
        S[s, s] += c_d * body.damping + c_k * body.strain.tangent(p.q[iq : iq + n])
        iq, iu = iq + n, iu + n
    rhs, out = np.random.default_rng(2).normal(size=model.n_u), np.empty(model.n_u)
    model.second_order.solve(p.t, p.q.copy(), rhs, out, c_m, c_d, c_k, *own)
    assert S @ out == pytest.approx(rhs, abs=1e-8)


@pytest.mark.parametrize("name", [name for name in SYSTEMS if "condensed" not in name])  # their scratch is not all free
def test_scratch_array_changes_no_bit(name):
    p = problem(name)

    def answers(filled):
        found = []
        for call in (
            lambda: p.model.state_rate(p.t, p.x),
            lambda: p.model.residual(p.t, p.x, np.ones(p.model.n_u)),
            lambda: np.concatenate([np.ravel(v) for v in p.model.observe(np.array([p.t]), p.x[None]).values()]),
        ):
            p.model.work[:] = filled
            found.append(call())
        return found

    for a, b in zip(answers(0.0), answers(np.nan), strict=True):
        assert np.array_equal(a, b)
        assert np.isfinite(a).all()
