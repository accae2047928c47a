"""Ways to an equilibrium: shares of the outer forces one after the other, and steps down from an unstable one."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from femflex.dynamics.equilibria import character, elastic_response, rigid_motions, stable_state
from femflex.dynamics.equilibria import equilibrium as module
from femflex.dynamics.equilibria.character import WAYS, _slice_shares

FIRST, LEAST = module.FIRST, module.LEAST


@pytest.fixture
def way(monkeypatch):
    """The shares tried, how it ends, and Newton's steps in all; q is the share that is balanced there.

    reach: shares apart from which Newton's method does not get there; up_to: the last share that has an equilibrium
    """

    def go(reach=1.0, up_to=1.0, iterations=4, rest=True, least=True, preload=None):
        tried = []

        def balance(problem, q, share):
            tried.append(share)
            balanced = {0.0: rest, LEAST: least}.get(share, abs(share - q[0]) <= reach and share <= up_to)
            return SimpleNamespace(q=np.array([share]), balanced=balanced, iterations=iterations, share=share)

        bent = None if preload is None else SimpleNamespace(q=np.array([preload]), balanced=True, iterations=70)
        monkeypatch.setattr(module, "balance", balance)
        monkeypatch.setattr(module, "_about_preload", lambda problem, q: bent)
        monkeypatch.setattr(module, "finely_balanced", lambda problem, found: found)
        monkeypatch.setattr(module, "_as_equilibrium", lambda problem, found, count: (found.q[0], count))
        monkeypatch.setattr(module, "_failed", lambda problem, q, *rest: RuntimeError(q[0], *rest))
        try:
            return tried, *module._nearest(None, np.zeros(1))
        except RuntimeError as error:
            return tried, error.args

    return go


def test_what_is_found_at_once_needs_no_shares(way):
    assert way() == ([1.0], 1.0, 4)
    assert way(reach=0.3, preload=0.7) == ([1.0], 0.7, 4 + 70)


@pytest.mark.parametrize(("iterations", "after"), [(6, [0.25, 0.75, 0.5, 1.0, 0.75, 1.0]), (7, [0.25, 0.5, 0.75, 1.0])])
def test_shares_grow_in_steps_that_double_after_quick_ones_and_are_halved_where_they_are_too_long(
    way, iterations, after
):
    tried = [1.0, 0.0, LEAST, *after]
    assert way(reach=0.4, iterations=iterations) == (tried, 1.0, iterations * len(tried))


def test_it_ends_at_the_last_share_that_has_an_equilibrium(way):
    tried, (q, share, count, last) = way(reach=0.3, up_to=0.6)
    assert q == share and 0.6 - 2 * LEAST < share <= 0.6 and count == 4 * len(tried)
    assert last.share == tried[-1] > 0.6 and tried[-1] - share < 2 * LEAST
    assert way(reach=0.1, rest=False)[0] == [1.0, 0.0] and way(reach=0.1, rest=False)[1][:3] == (0.0, 0.0, 8)
    tried, (q, share, count, last) = way(reach=0.1, least=False)
    assert (tried, q, share, count, last.share) == ([1.0, 0.0, LEAST], 0.0, 0.0, 12, LEAST)


@pytest.mark.parametrize(("begun", "valley"), [(0.3, 1.0), (-0.2, -1.0), (1e-6, 1.0)])
@pytest.mark.parametrize(("stiffness", "sideways"), [(4.0, 0.0), (1e-3, 0.05), (4e-5, 0.0)])
def test_steps_off_an_unstable_equilibrium_lead_into_the_nearer_valley_of_its_side(
    monkeypatch, begun, valley, stiffness, sideways
):
    """V = cos pi x + k (y - b)^2 / 2, an unstable equilibrium at rest between valleys 2 apart; no step is over 0.1.

    Growth below 0.3 % of the unstable equilibrium's own is none: k above 9e-5 counts, 4e-5 does not.
    """
    level = 0.05 if stiffness < 9e-5 else sideways
    moves, down = [], stable_state._down

    def gradient(q):
        return np.array([-np.pi * np.sin(np.pi * q[0]), stiffness * (q[1] - level)])

    def resistance(problem, q):
        values = np.array([-(np.pi**2) * np.cos(np.pi * q[0]), stiffness])
        return gradient(q), np.diag(values), values, np.eye(2)

    def recorded(problem, q, g, K, move):
        moves.append(np.abs(move).max())
        return down(problem, q, g, K, move)

    problem = SimpleNamespace(shape=lambda q: q, ties=lambda q: None)
    monkeypatch.setattr(stable_state, "_resistance", resistance)
    monkeypatch.setattr(stable_state, "_moved", lambda problem, q, K, move: q + move)
    monkeypatch.setattr(stable_state, "unbalanced_forces", lambda problem, q, share, A: (gradient(q), None))
    monkeypatch.setattr(stable_state, "_down", recorded)
    found = stable_state.stable_state_below(problem, np.zeros(2), np.array([begun, 0.1]))
    assert found == pytest.approx([valley, sideways], abs=stable_state.NEAR)
    assert max(moves) == pytest.approx(stable_state.LONGEST) and moves[0] < stable_state.LONGEST
    assert moves[-1] < 0.5 * stable_state.LONGEST  # the last are Newton's own


def test_bodies_with_a_preload_are_tried_undeformed_and_at_once(monkeypatch):
    """Of five coordinates the second and third are those of a body's shapes; without a preload nothing is tried."""
    tried = []

    def balance(problem, q, share):
        tried.append((q.tolist(), share))
        return SimpleNamespace(balanced=len(tried) == 1)

    records = [{"qe": 0, "n": 5}, {"qe": 1, "n": 2}]  # the first is the ground's
    monkeypatch.setattr(module, "balance", balance)
    monkeypatch.setattr(module, "body_records", lambda table: records)
    q = np.array([0.5, 0.6, 0.7, 0.8, 0.9])

    def found(f0):
        body = SimpleNamespace(strain=SimpleNamespace(f0=np.array(f0)))
        model = SimpleNamespace(table=None, system=SimpleNamespace(bodies={"wire": body}))
        return module._about_preload(SimpleNamespace(full=model), q)

    assert found([0.0, 0.0]) is None and tried == []
    assert found([0.0, 3.0]).balanced and found([0.0, 3.0]) is None  # the second is out of balance
    assert tried == [([0.5, 0.0, 0.0, 0.8, 0.9], 1.0)] * 2 and q[1] == 0.6


@pytest.mark.parametrize(("stiffness", "found"), [(4.0, True), (-4.0, False)])
def test_where_no_step_goes_down_what_resists_is_the_equilibrium(monkeypatch, stiffness, found):
    values = np.array([9.0, stiffness])
    problem = SimpleNamespace(shape=lambda q: q, ties=lambda q: None)
    monkeypatch.setattr(stable_state, "_resistance", lambda problem, q: (np.ones(2), None, values, np.eye(2)))
    monkeypatch.setattr(stable_state, "_moved", lambda problem, q, K, move: q + move)
    monkeypatch.setattr(stable_state, "_down", lambda *about: None)
    to = stable_state.stable_state_below(problem, np.zeros(2), np.zeros(2))
    if found:
        assert to == pytest.approx([0.0, stable_state.FIRST])
    else:
        assert to is None
    monkeypatch.setattr(stable_state, "_down", lambda problem, q, g, K, move: q + move)  # down for ever
    assert stable_state.stable_state_below(problem, np.zeros(2), np.zeros(2)) is None


@pytest.mark.parametrize(("reach", "halvings"), [(0.5, 0), (0.3, 1), (0.07, 3), (0.0, None)])
def test_a_step_is_halved_until_its_end_pushes_back_by_half_of_what_it_began_with_at_most(monkeypatch, reach, halvings):
    """The force g of 2 along a step of 0.4 becomes -1.01 at its end where that is beyond the reach."""
    monkeypatch.setattr(stable_state, "_moved", lambda problem, q, K, move: q + move)

    def forces(problem, to, share, A):
        return np.array([0.0, 0.99 if to[1] <= reach else 1.01]), None

    monkeypatch.setattr(stable_state, "unbalanced_forces", forces)
    problem, move = SimpleNamespace(ties=lambda q: None), np.array([0.0, 0.4])
    to = stable_state._down(problem, np.zeros(2), np.array([0.0, -2.0]), None, move)
    if halvings is None:
        assert to is None
    else:
        assert to == pytest.approx(move / 2**halvings)


@pytest.mark.parametrize(
    ("near", "residual", "stable", "found"),
    [(1.0, 1e-12, True, True), (None, 0.0, True, False), (1.0, 1e-3, True, False), (1.0, 1e-12, False, False)],
)
def test_an_unstable_equilibrium_is_left_for_one_that_is_in_balance_and_stable(
    monkeypatch, near, residual, stable, found
):
    unstable = SimpleNamespace(q=np.zeros(1), iterations=5, verdict="unstable: it falls")
    after = SimpleNamespace(q=near, residual=residual, iterations=3)
    monkeypatch.setattr(module, "stable_state_below", lambda problem, q, begun: near)
    monkeypatch.setattr(module, "balance", lambda problem, q, share: after)
    monkeypatch.setattr(module, "_as_equilibrium", lambda problem, *about: SimpleNamespace(stable=stable, about=about))
    if found:
        assert module._beyond(None, unstable, np.zeros(1)).about == (after, 8, unstable)
        return
    with pytest.raises(module.EquilibriumError) as caught:
        module._beyond(None, unstable, np.zeros(1))
    assert caught.value.last is unstable and str(caught.value) == (
        "the equilibrium that was found is unstable: it falls, and no stable one was found from it. Start from another "
        "state, lower the loads, or let a damped run come to rest"
    )


def test_forces_that_loops_carry_are_left_out_of_those_on_shapes(monkeypatch):
    """Rows of joints 0, 3 and 4 are balanced by multipliers; coordinate 5 is prescribed, and 1 and 2 are elastic."""
    rng = np.random.default_rng(6)
    A, multipliers, own = rng.normal(size=(2, 6)), rng.normal(size=(3, 2, 2)), np.zeros((3, 2, 6))
    own[:, :, [1, 2]], own[:, :, 5] = rng.normal(size=(3, 2, 2)), 3.0
    left = own + multipliers @ A  # of every time, without and with the jump
    jumps, states = rng.normal(size=(3, 6)), np.zeros((3, 9))

    def residual(t, x, rate):
        return left[int(t), 0 if np.array_equal(rate, np.ones(6)) else 1]

    model = SimpleNamespace(n_u=6, system=None, residual=residual, constraints=SimpleNamespace(matrix=lambda t, x: A))
    monkeypatch.setattr(elastic_response, "elastic_places", lambda model: (None, np.array([1, 2])))
    monkeypatch.setattr(elastic_response, "slack_of_loops", lambda system: 1e-12)
    monkeypatch.setattr(elastic_response, "held_freedoms", lambda model: np.arange(6) == 5)
    force, impulse = elastic_response.unmodelled_response(model, np.arange(3.0), states, np.ones((3, 6)), jumps)
    shapes = np.isin(np.arange(6), [1, 2])
    np.testing.assert_allclose(force, np.where(shapes, -own[:, 0], 0.0), atol=1e-12)
    np.testing.assert_allclose(impulse, np.where(shapes, own[:, 0] - own[:, 1], 0.0), atol=1e-12)
    model.constraints = None
    force, _ = elastic_response.unmodelled_response(model, np.arange(3.0), states, np.ones((3, 6)), jumps)
    np.testing.assert_allclose(force, np.where(shapes, -left[:, 0], 0.0), atol=1e-12)


@pytest.mark.parametrize(("part", "still"), [(0.0, True), (0.9e-6, True), (1.1e-6, False), (1.0, False)])
def test_a_field_stands_still_where_its_stiffness_is_nothing_beside_its_inertia_in_the_spin(part, still):
    """In usual sizes of 2 m and 0.5 rad, spinning at 3 rad/s."""
    M, field, sizes = np.diag([4.0, 8.0]), np.array([1.0, 2.0]), np.array([2.0, 0.5])
    largest = 9.0 * 8.0  # of 2 x 4 x 1 and 0.5 x 8 x 2, times the rate squared
    K = np.array([[0.0, part * largest / 2.0 / 2.0], [0.0, 0.0]])
    assert rigid_motions._still(field, (M, None, K), 3.0, sizes) == still


@pytest.mark.parametrize("count", [1, 4])
def test_points_at_one_place_have_no_line_and_flap_along_the_axis(count):
    points, motion = np.tile([0.3, -0.2, 0.5], (count, 1)), np.zeros((3, count, 3))
    axis = np.array([0.0, 3.0, 4.0])
    motion[0] = 2.0 * axis / 5.0
    motion[1] = [3.0, 0.0, 0.0]
    motion[2] = [0.0, 1.6, -0.2]
    found = _slice_shares(points, motion + 0j, axis)
    wanted = np.zeros((3, len(WAYS)))
    along = (motion[:, 0] @ axis / 5.0) ** 2
    wanted[:, WAYS.index("flap")] = along
    wanted[:, WAYS.index("lag")] = (motion[:, 0] ** 2).sum(axis=1) - along
    np.testing.assert_allclose(found, wanted, atol=1e-12)


@pytest.mark.parametrize(("lengths", "stretched"), [((1.0, 3.9), True), ((1.0, 4.1), False), ((2.0, 4.1), True)])
def test_energy_of_stretch_and_of_bending_counts_by_the_length_it_is_stored_over(lengths, stretched):
    """A beam stretched by 2 at one point of stiffness 5 and bent by 1 at another, energy 20 to 5 per length."""
    rows = np.zeros((2, 6, 1))
    stiffness = np.diag([5.0, 7.0, 7.0, 5.0, 7.0, 7.0])
    first_bend = character.MEMBRANE["line"]
    rows[0, 0], rows[1, first_bend] = 2.0, 1.0
    stiffness[first_bend, first_bend] = 5.0
    part = SimpleNamespace(kind="line", linear=np.eye(6), rows=rows, elastic=stiffness, weight=np.array(lengths, float))
    shapes = np.array([[1.0, 1j, -2.0]])
    assert character._stretched(SimpleNamespace(strain_field=[part]), shapes).tolist() == [stretched] * 3
    part.kind = "solid"
    assert character._stretched(SimpleNamespace(strain_field=[part]), shapes).all()
    assert character._stretched(SimpleNamespace(strain_field=[]), shapes).all()
