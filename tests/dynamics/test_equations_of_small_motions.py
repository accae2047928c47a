"""The matrices behind small motions and Newton's steps, against the equations that they stand for."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import null_space, subspace_angles

from femflex.dynamics.equilibria.balance import newton_step, stiff_answers, unbalanced_forces
from femflex.dynamics.equilibria.rigid_motions import KnownMotion
from femflex.dynamics.equilibria.small_motions import _eigen, _Modal, _one_of_each, known_with_states, spectrum
from femflex.dynamics.equilibria.states import StateEquations

N, M_Z = 4, 3  # coordinates, states of effectors


def positive(rng, n, least=0.3):
    A = rng.normal(size=(n, n))
    return A @ A.T + least * np.eye(n)


def equations(seed=1):
    """M, D, K and states of effectors, all of their matrices full and without symmetry but M's; sizes of the states."""
    rng = np.random.default_rng(seed)
    D, K, R = rng.normal(size=(N, N)), rng.normal(size=(N, N)), rng.normal(size=(N, M_Z))
    K[1] *= 1e3
    K[:, 1] *= 1e3  # one stiff coordinate
    z = StateEquations(R, *(rng.normal(size=(M_Z, n)) for n in (N, N, M_Z)), ("a", "b", "c"))
    return positive(rng, N), D, K, z, np.array([0.5, 20.0, 3.0])


def test_modal_equations_are_those_of_coordinates_rates_and_states():
    M, D, K, z, sizes = equations()
    modal, rng = _Modal.of(M, D, K, z, sizes), np.random.default_rng(2)
    x, v, states = rng.normal(size=(N, 1)), rng.normal(size=(N, 1)), rng.normal(size=(M_Z, 1))
    np.testing.assert_allclose(modal.phi.T @ M @ modal.phi, np.eye(N), atol=1e-11)

    def whole(position, rate, z):
        found = modal.state(position, rate)
        found[2 * N :] = z / sizes[:, None]
        return found

    pulled = -np.linalg.solve(M, K @ x + D @ v + z.R @ states)
    rates = z.F_x @ x + z.F_u @ v + z.F_z @ states
    np.testing.assert_allclose(modal.A @ whole(x, v, states), whole(v, pulled, rates), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(modal.shapes(whole(x, v, states)), x, atol=1e-12)
    bare, none = np.zeros((0, 0)), np.zeros((M_Z, 0))
    alone = _Modal.of(bare, bare, bare, StateEquations(none.T, none, none, z.F_z, z.names), sizes)
    np.testing.assert_allclose(alone.A, np.diag(1 / sizes) @ z.F_z @ np.diag(sizes))


def test_the_spectrum_is_that_of_the_companion_matrix_by_rising_size():
    M, D, K, _, _ = equations(3)
    inverse = np.linalg.inv(M)
    companion = np.block([[np.zeros((N, N)), np.eye(N)], [-inverse @ K, -inverse @ D]])
    found = spectrum(M, D, K)
    wanted = np.linalg.eigvals(companion)
    assert list(np.abs(found)) == sorted(np.abs(found))
    for value in wanted:
        assert np.abs(found - value).min() < 1e-8 * abs(value)


def invariant(modal, count):
    """Real states that span an invariant space of `count` pairs of eigenvalues or single ones, and these values."""
    values, V = np.linalg.eig(modal.A)
    order = np.argsort(values.real)
    taken, columns = [], []
    for k in order:
        if values[k].imag < 0 or len(taken) >= count:
            continue
        taken += [values[k]] + ([values[k].conj()] if values[k].imag > 0 else [])
        columns += [V[:, k].real] + ([V[:, k].imag] if values[k].imag > 0 else [])
    return np.linalg.qr(np.array(columns).T)[0], np.array(taken)


def test_of_directions_those_are_left_alone_that_the_equations_map_among_themselves():
    modal = _Modal.of(*equations(5))
    R, _ = invariant(modal, 3)
    stray = np.random.default_rng(1).normal(size=(len(modal.A), 1))
    kept = modal.left_alone(np.linalg.qr(np.hstack([R, stray]))[0])
    assert kept.shape == R.shape and subspace_angles(kept, R).max() < 1e-7
    assert modal.left_alone(np.linalg.qr(stray)[0]).shape[1] == 0


def test_motions_beyond_an_invariant_space_are_eigenvectors_of_the_whole():
    modal = _Modal.of(*equations(5))
    R, taken = invariant(modal, 3)
    values, states, owners = _eigen(modal, R)
    assert len(values) == len(modal.A) - len(taken) == len(owners)
    np.testing.assert_allclose(modal.A @ states, states * values, atol=1e-6 * np.abs(modal.A).max())
    every = np.linalg.eigvals(modal.A)
    for value in values:
        assert np.abs(every - value).min() < 1e-8 and np.abs(taken - value).min() > 1e-6
    none, empty, names = _eigen(modal, np.eye(len(modal.A)))
    assert none.shape == (0,) and empty.shape == (len(modal.A), 0) and names == []


def test_a_motion_is_owned_by_the_state_that_takes_most_of_it():
    M, D, K, z, sizes = equations(7)
    K, D = positive(np.random.default_rng(0), N), 0.02 * np.eye(N)
    slight = StateEquations(0.01 * z.R, 0.01 * z.F_x, 0.01 * z.F_u, np.diag([-7.0, -0.3, -40.0]), z.names)
    values, _, owners = _eigen(_Modal.of(M, D, K, slight, sizes), np.zeros((2 * N + M_Z, 0)))
    for value, owner in zip(values, owners, strict=True):
        mine = {"a": -7.0, "b": -0.3, "c": -40.0}
        assert (abs(value - mine[owner]) < 0.1 * abs(mine[owner])) if owner else abs(value.imag) > 0.1
    assert sorted(owners) == [""] * 8 + ["a", "b", "c"]


def test_states_at_rest_come_first_then_those_that_drift():
    """0 -> 1 -> 2 is a chain: the first stays, the second pushes the first, the third the second; 3 stays by itself."""
    n = 2 * N + M_Z
    J = np.diag(np.concatenate([np.zeros(4), -np.arange(1.0, n - 3)]))
    J[0, 1], J[1, 2] = 2.0, 0.5
    T = np.linalg.qr(np.random.default_rng(3).normal(size=(n, n)))[0]
    modal = replace(_Modal.of(*equations()), A=T @ J @ T.T)
    steps = modal.rests(np.zeros((n, 0)))
    assert [one.shape[1] for one in steps] == [2, 1, 1]
    for one, wanted in zip(steps, (T[:, [0, 3]], T[:, [1]], T[:, [2]]), strict=True):
        assert subspace_angles(one, wanted).max() < 1e-9
    beyond = modal.rests(T[:, [3]])
    assert [one.shape[1] for one in beyond] == [1, 1, 1] and not modal.rests(np.eye(n))


@pytest.mark.parametrize("chain", [0.0, 2.0])
def test_known_motions_are_those_left_alone_and_rests_that_drift_where_others_push_them(chain):
    """Field 4 is a motion that the effectors leave alone, field 7 one that they do not; 0 to 3 stay, or 1 pushes 0."""
    n, own, rng = 2 * N + M_Z, np.array([0, 2, 3, 5]), np.random.default_rng(3)
    modal, fields = _Modal.of(*equations()), np.zeros((6, 2))
    fields[own] = rng.normal(size=(N, 2))
    columns = rng.normal(size=(n, n))
    columns[:, [4, 7]] = np.vstack([modal.inverse @ fields[own], np.zeros((n - N, 2))])
    J = np.diag(np.concatenate([np.zeros(4), -np.arange(1.0, n - 3)]))
    J[0, 1], J[5, 7] = chain, 0.3
    order = [4, 7, 0, 1, 2, 3, 5, 6, 8, 9, 10]
    T = np.linalg.qr(columns[:, order])[0][:, np.argsort(order)]  # orthonormal, the span of 4 and that of 4 and 7 kept
    modal = replace(modal, A=T @ J @ T.T)
    fields[own, 1] = modal.phi @ T[:N, 7]
    given = tuple(KnownMotion(name, 0j, True, fields[:, k] + 0j) for k, name in enumerate(("moves", "is hindered")))
    Z = rng.normal(size=(6, N))
    R, motions = known_with_states(modal, T[:, [4, 7]], given, own, Z)
    assert subspace_angles(R, T[:, :5]).max() < 1e-9 and R.shape == (n, 5)
    assert motions[0] is given[0] and len(motions) == (5 if chain == 0.0 else 4)
    rests = T[:, [0, 2, 3] if chain else [0, 1, 2, 3]]
    field = Z @ modal.phi @ rests[:N]
    shapes = np.column_stack([one.shape for one in motions[1:]])
    np.testing.assert_allclose(shapes @ shapes.T, field @ field.T, atol=1e-10 * np.abs(field @ field.T).max())
    assert {(one.eigenvalue, one.drifts) for one in motions[1:]} == {(0j, chain > 0.0)}
    assert known_with_states(modal, np.eye(n), given, own, Z)[1] == given


def test_a_state_bears_the_name_of_the_motion_it_makes_or_of_its_largest_own_state():
    modal, own = _Modal.of(*equations()), np.array([0, 2, 3, 5])
    field = np.arange(1.0, 7.0)
    drift = KnownMotion("drift", 0j, True, np.array([5, 0, -1, 2, 0, 1]) + 0j)
    motions = (drift, KnownMotion("turn", 0j, True, field + 0j))
    state = np.concatenate([-2.0 * modal.inverse @ field[own], np.zeros(N), [0.1, -0.3, 0.2]])
    assert modal.named(state, motions, own) == "turn"
    assert modal.named(state, motions[:1], own) == "b"
    assert modal.named(np.concatenate([np.zeros(2 * N), [0.1, 0.2, -0.3]]), motions, own) == "c"


def test_of_pairs_the_upper_stands_and_of_real_ones_the_larger_half():
    values = np.array([-1 + 2j, -1 - 2j, -3.0, 0.5, -0.2, 0.1 + 9j, 0.1 - 9j, -8.0, -0.4 + 2j, -0.4 - 2j])
    assert list(_one_of_each(values, False)) == [3, 4, 8, 0, 5]
    assert list(_one_of_each(values, True)) == [3, 4, 2, 7, 8, 0, 5]
    assert list(_one_of_each(values[[2, 3, 4]], False)) == [1, 2]


NAMES = [(f"c{k}_rate", "1") for k in range(7)]


def problem_of(E, R, **more):
    system = SimpleNamespace(velocity_names=lambda: NAMES)
    full = SimpleNamespace(system=system)
    return SimpleNamespace(directions=lambda A: (E, R), full=full, energy_of_spin=0.0, **more)


def neutral_stiffness(seed=4):
    """K (7, 7) with one neutral direction, most of it along coordinate 5, of mixed signs otherwise."""
    rng = np.random.default_rng(seed)
    v = rng.normal(size=7)
    v[5] = 4.0
    v /= np.linalg.norm(v)
    U = null_space(v[None])
    Q = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    return U @ Q @ np.diag([9.0, 4.0, -1.5, 0.7, 3.0, 6.0]) @ Q.T @ U.T, v


def test_a_step_balances_the_forces_and_is_the_least_along_what_nothing_resists():
    K, v = neutral_stiffness()
    unit, rng = np.eye(7), np.random.default_rng(8)
    E, R = unit[:, [0, 2, 6]], unit[:, [1, 3, 4, 5]]
    g = K @ rng.normal(size=7)
    found = newton_step(problem_of(E, R), K, g, 1.0, np.zeros((0, 7)))
    np.testing.assert_allclose(K @ found.move, -g, atol=1e-9)
    assert (R.T @ found.move) @ (R.T @ v) == pytest.approx(0.0, abs=1e-9)
    assert found.neutral == ("c5",) and found.directions.shape == (7, 1)
    assert abs(found.directions[:, 0] @ v) == pytest.approx(np.linalg.norm(found.directions))
    assert np.linalg.norm(R.T @ found.directions) == pytest.approx(1.0)
    S = R.T @ K @ R - R.T @ K @ E @ np.linalg.solve(E.T @ K @ E, E.T @ K @ R)
    assert found.stiffest == pytest.approx(np.abs(np.linalg.eigvalsh(S)).max())
    loud = newton_step(problem_of(E, R), K, g, 2e9, np.zeros((0, 7)))  # rounding of forces of 2e9: all below 2
    sizes = np.abs(np.linalg.eigvalsh(S))
    assert len(loud.neutral) == int((sizes < 2.0).sum()) > 1


def test_with_the_inertia_resistance_is_stiffness_per_inertia():
    """A small body resists with 1e-8 of the largest stiffness; its inertia is as small. One more resists nothing."""
    K, M = np.diag([1.0, 1e-8, 0.5, 0.0]), np.diag([1.0, 2e-8, 3.0, 1.0])
    turn = np.eye(4)
    turn[:2, :2] = [[1.0, 0.0], [1e-9, 1.0]]
    unit = np.eye(7)
    E, R = unit[:, 4:], unit[:, :4]
    whole = np.eye(7)
    whole[:4, :4] = turn.T @ K @ turn
    inertia = np.eye(7)
    inertia[:4, :4] = turn.T @ M @ turn
    g = np.array([0.3, 2e-8, 0.1, 0.0, 1.0, 2.0, 3.0])
    plain = newton_step(problem_of(E, R), whole, g, 1e-3, np.zeros((0, 7)))
    assert set(plain.neutral) == {"c1", "c3"}
    fine = newton_step(problem_of(E, R), whole, g, 1e-3, np.zeros((0, 7)), inertia)
    assert fine.neutral == ("c3",)
    np.testing.assert_allclose(whole @ fine.move, -g, rtol=1e-6, atol=1e-15)


def test_forces_left_over_are_those_that_multipliers_do_not_carry():
    rng = np.random.default_rng(11)
    inner, outer, A = rng.normal(size=7), rng.normal(size=7), rng.normal(size=(2, 7))
    problem = SimpleNamespace(forces=lambda q: (inner, outer), slack=1e-9)
    g, lambdas = unbalanced_forces(problem, np.zeros(3), 0.3, A)
    Z = null_space(A)
    np.testing.assert_allclose(g, Z @ (Z.T @ (inner + 0.3 * outer)), atol=1e-12)
    np.testing.assert_allclose(g + lambdas @ A, inner + 0.3 * outer)
    bare, none = unbalanced_forces(problem, np.zeros(3), 0.3, np.zeros((0, 7)))
    np.testing.assert_allclose(bare, inner + 0.3 * outer)
    assert none.shape == (0,)


def test_what_is_far_stiffer_than_the_outer_forces_gives_way_by_its_own_compliance():
    """Own stiffness in sizes: 1, 50, 1e5 and 4e5 J; outer forces of at most 2 J times the share; K is any at q."""
    unit, rng = np.eye(5), np.random.default_rng(6)
    sizes = np.array([1.0, 2.0, 0.5, 10.0, 1.0])
    own = np.diag(np.array([1.0, 50.0, 1e5, 4e5, 0.0]) / sizes**2)
    K = positive(rng, 5)
    problem = SimpleNamespace(
        directions=lambda A: (unit[:, :4], unit[:, 4:]), own_stiffness=(own, None), sizes=sizes,
        forces=lambda q: (np.zeros(5), np.array([0.5, -2.0, 1.0, 0.0, 1.0])),
    )  # fmt: skip

    def wanted(which):
        D = unit[:, which]
        return D @ np.linalg.inv(D.T @ K @ D) @ D.T

    np.testing.assert_allclose(stiff_answers(problem, None, 1.0, np.zeros((0, 5)), K), wanted([2, 3]), atol=1e-12)
    problem.forces = lambda q: (np.zeros(5), np.array([0.5, -200.0, 1.0, 0.0, 1.0]))  # 1e3 times 200 J
    np.testing.assert_allclose(stiff_answers(problem, None, 1.0, np.zeros((0, 5)), K), wanted([3]), atol=1e-12)
    np.testing.assert_allclose(stiff_answers(problem, None, 0.1, np.zeros((0, 5)), K), wanted([2, 3]), atol=1e-12)
    problem.own_stiffness = (np.diag(np.array([1e4, 5e5, 3e4, 9e5, 0.0]) / sizes**2), None)
    np.testing.assert_allclose(
        stiff_answers(problem, None, 0.01, np.zeros((0, 5)), K), 0.0
    )  # none above 100 of the least
