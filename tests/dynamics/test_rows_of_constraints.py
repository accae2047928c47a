"""Rows of constraints: multipliers of rows that depend on each other, rates of users' rows, sentences on them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from support.random_systems import random_tree

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.constraints.assemble import clearance_text
from femflex.dynamics.constraints.conflicts import competing_motions_text
from femflex.dynamics.constraints.discs import flat_disc_text, tilts
from femflex.dynamics.constraints.excess import count_passage
from femflex.dynamics.constraints.moved_start import MovedValue, moved_start
from femflex.dynamics.constraints.reach import weighed_rows
from femflex.dynamics.constraints.user import Rows
from femflex.dynamics.lowering import tie_layout as at
from femflex.rotations import dcm_from_angles, dcm_from_quaternion
from femflex.system import System, free, knife_edge, revolute, rolling_disc, velocity_rows


@pytest.mark.parametrize("seed", [1, 6])
def test_of_rows_that_depend_on_each_other_the_smallest_multipliers_hold_the_motion(seed):
    """Seven rows of rank 4 in two constraints; each row is measured by its own length, the square root of a M^-1 a."""
    system, _, (q, u) = random_tree(seed, n_bodies=4)
    rng, n = np.random.default_rng(seed), len(u)
    A = rng.normal(size=(7, 4)) @ rng.normal(size=(4, n)) * np.array([1.0, 30.0, 0.2, 1.0, 5.0, 1.0, 2.0])[:, None]
    drift = rng.normal(size=n)  # A drift t is what the rows ask for

    def some(rows):
        return lambda t, q: (A[rows], A[rows] @ drift * t)

    constraints = velocity_rows("one", 3, some(slice(0, 3))), velocity_rows("two", 4, some(slice(3, 7)))
    closed = System(system.bodies, system.joints, constraints=constraints)
    tree, model = compile_system(system), compile_system(closed)
    x, t = np.concatenate([q, u]), 0.4
    M, h = tree.mass_matrix(t, x), tree.bias(t, x)
    inverse = np.linalg.inv(M)
    S = np.diag(1 / np.sqrt(np.diag(A @ inverse @ A.T)))
    r = A @ drift + A @ inverse @ h
    lambdas = S @ np.linalg.pinv(S @ A @ inverse @ A.T @ S, rcond=1e-9) @ S @ r
    seen = {path: value[0] for path, value in model.observe(np.array([t]), x[None]).items()}
    found = np.concatenate([seen["constraints/one/multipliers"], seen["constraints/two/multipliers"]])
    np.testing.assert_allclose(found, lambdas, atol=1e-8 * np.abs(lambdas).max())
    udot = model.state_rate(t, x)[len(q) :]
    np.testing.assert_allclose(udot, inverse @ (A.T @ lambdas - h), atol=1e-8 * np.abs(udot).max())
    assert seen["monitors/constraint_rank"] == 4.0
    assert seen["monitors/constraint_velocity"] == pytest.approx(np.abs(A @ (u - drift * t)).max())
    assert model.constraints.redundant(t, x) == 3
    text = "7 constraint rows, of which 3 are redundant; of all possible reactions the smallest are given."
    assert model.constraints.text(t, x) == text
    assert [model.constraints.name_of_row(k) for k in (2, 3)] == ["one", "two"]
    targets = A @ rng.normal(size=n)
    root = np.linalg.cholesky(M).T
    nearest = np.linalg.solve(root, np.linalg.pinv(A @ np.linalg.inv(root), rcond=1e-9) @ targets)
    W = weighed_rows(model, t, x)
    np.testing.assert_allclose(W @ W.T, A @ inverse @ A.T, atol=1e-10 * np.abs(W @ W.T).max())
    step, rank = model.constraints.nearest(t, x, targets)
    np.testing.assert_allclose(step, nearest, atol=1e-8 * np.abs(nearest).max())
    assert rank == 4


def test_users_rows_change_at_the_rates_of_their_functions_along_the_motion():
    """A(t, q) u - b(t, q) at a fixed u: its rate is that of A and b alone."""
    B = np.array([[0.5, -2.0, 1.0], [3.0, 0.2, -0.7]])

    def function(t, q):
        return B * np.cos(q[0] + 2 * t) + np.outer([1.0, -1.0], q), np.array([np.sin(3 * t) * q[1], t * q[2] ** 2])

    N = np.array([[1.0, 0.3, 0.0], [0.0, 2.0, -0.5], [0.4, 0.0, 1.0]])
    rows = Rows("mine", function, 2, 3, 3, lambda q, u: N @ u)
    t, q, u, out = 0.7, np.array([0.4, -1.1, 0.8]), np.array([0.3, 0.9, -0.6]), np.full(10, 7.0)
    rows.write(t, q, u, out)
    A, b = function(t, q)
    dq = N @ u
    dA = -B * np.sin(q[0] + 2 * t) * (dq[0] + 2) + np.outer([1.0, -1.0], dq)
    db = np.array([3 * np.cos(3 * t) * q[1] + np.sin(3 * t) * dq[1], q[2] ** 2 + 2 * t * q[2] * dq[2]])
    np.testing.assert_array_equal(out[:6].reshape(2, 3), A)
    np.testing.assert_array_equal(out[6:8], b)
    np.testing.assert_allclose(out[8:], dA @ u - db, rtol=1e-9)


@pytest.mark.parametrize(
    ("A", "b", "text"),
    [
        (np.ones((2, 2)), np.ones(2), "'mine' gave A of shape (2, 2) and b of shape (2,); expected (2, 3) and (2,)"),
        (np.ones((2, 3)), np.ones(3), "gave A of shape (2, 3) and b of shape (3,); expected (2, 3) and (2,)"),
        (np.array([[1.0, 2, 3], [4, np.nan, 6]]), np.array([7.0, 8]),
         "gave numbers that are not finite in row 1 at t = 0.5 s: A = [4.0, nan, 6.0], b = 8"),
        (np.array([[1.0, 2, 3], [4, 5, 6]]), np.array([np.inf, 8]),
         "in row 0 at t = 0.5 s: A = [1.0, 2.0, 3.0], b = inf"),
    ],
)  # fmt: skip
def test_users_rows_of_another_shape_or_without_a_number_are_refused(A, b, text):
    with pytest.raises(ValueError) as error:
        Rows("mine", lambda t, q: (A, b), 2, 3, 3, lambda q, u: u).checked(0.5, np.zeros(3))
    assert text in str(error.value)


def test_users_rows_of_a_ball_see_four_coordinates_and_tie_three_rates():
    """A = 2 (x, y, z) of a quaternion (w, x, y, z) as a row, q and u each of a length of its own."""

    def function(t, q):
        assert q.shape == (5,)
        return np.append(2 * q[1:4], q[4])[None], np.array([q[0]])

    def rates(q, u):
        assert u.shape == (4,)
        w, v = q[0], q[1:4]
        return np.concatenate([[-v @ u[:3] / 2], (w * u[:3] + np.cross(v, u[:3])) / 2, u[3:]])

    rows, out = Rows("mine", function, 1, 5, 4, rates), np.zeros(6)
    q, u = np.array([0.8, 0.2, -0.4, 0.4, 1.5]), np.array([0.3, -0.7, 0.2, 0.9])
    rows.write(0.0, np.append(q, 9.0), np.append(u, 9.0), out)
    dq = rates(q, u)
    np.testing.assert_allclose(out[:5], [0.4, -0.8, 0.8, 1.5, 0.8], rtol=1e-15)
    assert out[5] == pytest.approx(2 * dq[1:4] @ u[:3] + dq[4] * u[3] - dq[0], rel=1e-9)


def planar_chain():
    """A turntable with three bars in a row; the first and the last are locked, two loops tie bars to the turntable."""
    angles = {"a": 0.3, "b": -0.5, "c": 0.9}
    heading, place, ends = 0.0, np.zeros(3), {}
    for name, angle in angles.items():
        heading += angle
        place = place + np.array([np.cos(heading), np.sin(heading), 0.0])
        ends[name] = place
    marks = {f"at_{name}": Marker.rigid(end) for name, end in ends.items()}
    bar = rigid_body(1.0, [0.1, 0.2, 0.2], markers={"end": Marker.rigid([1.0, 0.0, 0.0])})
    bodies = {"table": rigid_body(5.0, [1.0] * 3, markers=marks), "a": bar, "b": bar, "c": bar, "off": bar}
    joints = (
        revolute("table", name="spin", motion=(0.2,)),
        revolute("a", "table", name="ja", motion=(0.3,)),
        revolute("b", "a", name="jb", parent_marker="end", q0=[-0.5]),
        revolute("c", "b", name="jc", parent_marker="end", motion=(0.9,)),
        revolute("off", "table", name="joff", motion=(1.0,)),
    )
    loops = (
        revolute("c", "table", name="far", parent_marker="at_c", child_marker="end"),
        revolute("b", "table", name="near", parent_marker="at_b", child_marker="end"),
    )
    return System(bodies, joints, loops=loops)


def test_motions_between_the_ends_of_a_loop_and_rows_on_the_same_freedoms_compete_with_it():
    model = compile_system(planar_chain())
    texts = {name: competing_motions_text(model.constraints, 0.0, model.x0, name) for name in ("far", "near")}
    assert texts == {
        "far": " together with the prescribed motions of 'ja.angle', 'jc.angle' and loop 'near'",
        "near": " together with the prescribed motion of 'ja.angle' and loop 'far'",
    }
    alone = System(planar_chain().bodies, planar_chain().joints, loops=planar_chain().loops[1:])
    one = compile_system(alone)
    text = competing_motions_text(one.constraints, 0.0, one.x0, "near")
    assert text == " together with the prescribed motion of 'ja.angle'"


def test_play_is_offered_where_digits_that_were_left_out_may_have_opened_the_loops():
    """Markers reach 40 m from their bodies' origins: gaps up to a ten-thousandth of that, angles times their length."""
    bodies = {"a": rigid_body(1.0, [1.0] * 3, markers={"far": Marker.rigid([24.0, 0.0, 32.0])})}
    system, loop = System(bodies, (free("a"),)), object()
    for gaps, loops, text in (
        ([1e-3, 1e-4], (loop,), ", or give the loop `play` of 1e-02 m: the loop is overconstrained"),
        ([1e-5, 2e-6], (loop,), ", or give the loop `play` of 1e-04 m: the loop is overconstrained"),
        ([1e-3, 2.1e-4], (loop,), ""),
        ([1e-3, 1e-4], (), ""),
    ):
        held = SimpleNamespace(lengths=np.array([1.0, 20.0]), system=SimpleNamespace(loops=loops, bodies=system.bodies,
                                                                                     constraints=()))  # fmt: skip
        assert clearance_text(held, np.array(gaps)) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (MovedValue("h.angle", "rad", 0.5, 0.5000001), "h.angle 28.6478898 -> 28.6478955 deg"),
        (MovedValue("s.slide", "m", 2.0, -3.25), "s.slide 2 -> -3.25 m"),
        (MovedValue("s.slide", "m", 0.0, 0.0012345678), "s.slide 0 -> 0.001235 m"),
        (MovedValue("h.angle_rate", "rad/s", -7.0, -7.002), "h.angle_rate -7 -> -7.002 rad/s"),
        (MovedValue("h.angle_rate", "rad/s", 1000.0, 1000.0002), "h.angle_rate 1000 -> 1000.0002 rad/s"),
    ],
)
def test_a_value_that_was_moved_is_printed_with_as_many_digits_as_show_it(value, text):
    assert str(value) == text


def test_values_moved_at_the_start_come_by_their_part_of_the_largest_of_their_unit():
    names = [("a", "m"), ("b", "m"), ("c", "rad"), ("d", "rad"), ("e", "m")]
    rates = [("a_rate", "m/s"), ("c_rate", "rad/s")]
    given = np.array([100.0, 1.0, 0.2, 0.1, 5.0, 0.0, 3.0])
    started = np.array([100.0 + 5e-8, 3.0, 0.21, 0.1, 5.0 + 3e-7, 1e-13, 3.0 - 6e-9])
    system = SimpleNamespace(
        coordinate_names=lambda: names, velocity_names=lambda: rates, initial_state=lambda: given,
    )  # fmt: skip
    found = moved_start(SimpleNamespace(system=system, constraints=object(), x0=started))
    assert [one.name for one in found] == ["c", "b", "e", "c_rate"]  # 5e-2, 2e-2, 3e-9, 2e-9; a is 5e-10, a_rate 1e-13
    assert (found[1].given, found[1].started, found[1].unit) == (1.0, 3.0, "m")
    assert moved_start(SimpleNamespace(system=system, constraints=None, x0=started)) == []


def test_the_tilt_of_a_disc_is_the_angle_of_its_axis_to_the_planes_normal():
    C, D = dcm_from_angles([0.3, -0.4, 0.8], "xyz"), dcm_from_angles([-0.2, 0.5, 0.1], "xyz")
    coin = rigid_body(1.0, [1.0] * 3, markers={"hub": Marker.rigid([0.1, 0.2, 0.3], C)})
    table = rigid_body(9.0, [1.0] * 3, markers={"top": Marker.rigid([0.0, 0.1, 0.0], D)})
    normal, axis = np.array([0.1, 0.2, 1.0]), np.array([1.0, -0.5, 0.3])
    discs = (
        knife_edge("blade", "table", [1, 0, 0], marker="top"),
        rolling_disc("first", "coin", 0.4, marker="hub", parent="table", parent_marker="top", axis=axis, normal=normal),
        rolling_disc("second", "coin", 0.4, marker="hub", axis=[0.2, 1.0, 0.1], normal=[0.0, 0.3, 1.0]),
    )
    system = System({"coin": coin, "table": table}, (free("coin"), free("table")), constraints=discs)
    model = compile_system(system)
    found = tilts(model.constraints, 0.0, model.x0)

    def angle(a, b):
        return np.arccos(abs(a @ b) / np.linalg.norm(a) / np.linalg.norm(b))

    seen = model.observe(np.zeros(1), model.x0[None])  # the start has brought the discs into touch
    coin, table = (dcm_from_quaternion(seen[f"bodies/{name}/attitude"][0]) for name in ("coin", "table"))
    wanted = {
        "first": angle(coin @ C @ axis, table @ D @ normal),
        "second": angle(coin @ C @ [0.2, 1.0, 0.1], np.array([0.0, 0.3, 1.0])),
    }
    assert found == pytest.approx(wanted)
    assert flat_disc_text(model.constraints, 0.0, model.x0, 0.9 * min(wanted.values())) == ""
    least = min(wanted, key=wanted.get)
    text = flat_disc_text(model.constraints, 0.0, model.x0, 1.1 * wanted[least])
    assert text.startswith(f"disc {least!r} lies flat on its plane: its axis is within {wanted[least]:.2g} rad of the")


def counted(times, pivots):
    """Configurations passed, by pivots at these times, and when the first of them were."""
    work = np.zeros(at.NOTE_SIZE)
    for t, part in zip(times, pivots, strict=True):
        getattr(count_passage, "py_func", count_passage)(t, part, 0, work)
    n = int(work[at.N_COUNT])
    return n, list(work[at.N_FIRST : at.N_FIRST + min(n, at.NOTED)])


def test_a_pivot_whose_square_falls_to_zero_between_three_states_is_a_passage_at_its_vertex():
    times = np.array([0.0, 0.3, 0.8, 1.0, 1.7, 2.1])
    assert counted(times, np.abs(times - 0.77)) == (1, pytest.approx([0.77]))
    assert counted(times, 0.01 * np.abs(times - 1.45)) == (1, pytest.approx([1.45]))
    # above zero by d: the square at the vertex is d^2, counted up to a tenth of the larger one next to it, 0.47^2 + d^2
    for d, n in ((0.15, 1), (0.17, 0)):
        assert counted(times, np.sqrt((times - 0.77) ** 2 + d**2))[0] == n
    again = np.repeat(times, 2)  # states that do not go on in time are left out
    assert counted(again, np.abs(again - 0.77)) == (1, pytest.approx([0.77]))
    assert counted(times, 2.0 - np.abs(times - 0.77))[0] == 0  # a highest value
    assert counted(times, times + 0.1)[0] == 0
    every = np.arange(0.0, 6.0, 0.13)
    n, first = counted(every, np.abs(np.sin(np.pi * (every - 0.21))))
    assert n == 6 and first == pytest.approx([0.21, 1.21, 2.21], abs=0.02)
