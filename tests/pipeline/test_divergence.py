"""A run that has run away ends with the first row that no craft reaches."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Block
from femflex.integrate import resume as head
from femflex.pipeline.guard import MotionGuard, first_overflow
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import System, prismatic, revolute, weld


def block(times, states):
    """Rows with the integrator standing at the last one."""
    resume = np.zeros(head.HEAD + states.shape[1])
    resume[head.T], resume[head.N_X], resume[head.HEAD :] = times[-1], states.shape[1], states[-1]
    return Block(times, states, resume)


def test_the_first_row_that_is_too_fast_is_the_one_told_of():
    model = compile_system(System({"wheel": rigid_body(1.0, np.eye(3))}, (revolute("wheel"),)))
    times = np.arange(5.0)
    states = np.column_stack([times, [1.0, 9e4, 2e5, 3e5, 4e5]])  # 1e5 rad/s is the bound
    error = MotionGuard(model).divergence(block(times, states))
    assert error is not None and error.times.tolist() == [2.0] and np.array_equal(error.states, states[2:3])
    assert "is 2e+05 rad/s, beyond 100000 rad/s" in str(error) and error.coordinate == 1
    assert MotionGuard(model).divergence(block(times[:2], states[:2])) is None


def test_the_coordinate_that_is_farthest_beyond_its_own_bound_is_named():
    """Of a slide at 2e5 m/s and a wheel at 1.5e5 rad/s the wheel is over its bound, though the slide is faster."""
    bodies = {"cart": rigid_body(1.0, np.eye(3)), "wheel": rigid_body(1.0, np.eye(3))}
    model = compile_system(System(bodies, (prismatic("cart", name="ride"), revolute("wheel", "cart", name="axle"))))
    states = np.array([[0.0, 0.0, 2e5, 1.5e5]])
    error = MotionGuard(model).divergence(block(np.zeros(1), states))
    assert error is not None and "axle" in str(error) and "is 1.5e+05 rad/s" in str(error) and error.coordinate == 3


def test_the_elastic_coordinate_that_moved_farthest_is_named():
    beam = UniformBeam(2.0, 1e6, 20.0, 30.0, 20.0, 0.5)
    body = beam_body(beam, BeamFunctions(y=2, z=2))
    model = compile_system(System({"boom": body}, (weld("boom", child_marker="root"),)))
    for k in range(4):
        states = np.zeros((1, 8))
        states[0, k] = 1e6
        error = MotionGuard(model).divergence(block(np.zeros(1), states))
        assert error is not None and error.coordinate == k
        assert "the motion diverges: body 'boom' is displaced by" in str(error)


@pytest.mark.parametrize("rows", [0, 2])
def test_the_state_beyond_the_last_row_counts(rows):
    """Motion that runs away between the last row of a block and where its integrator stands, with rows or without."""
    model = compile_system(System({"wheel": rigid_body(1.0, np.eye(3))}, (revolute("wheel"),)))
    times = np.arange(float(rows))
    states = np.column_stack([times, np.full(rows, 10.0)])
    made = block(np.append(times, rows + 0.5), np.vstack([states, [[7.0, 2.5e5]]]))
    error = MotionGuard(model).divergence(Block(times, states, made.resume))
    assert error is not None and error.t == rows + 0.5 and error.states.tolist() == [[7.0, 2.5e5]]
    assert "is 2.5e+05 rad/s" in str(error)
    made.resume[-1] = 9e4
    assert MotionGuard(model).divergence(Block(times, states, made.resume)) is None


@pytest.mark.parametrize("bad", [(2, 5), (4, 1), (3, 3)])
def test_the_first_row_that_overflows_is_reported_of_by_its_channel(bad):
    """Channels with one and with three columns; the largest state is named, whatever its sign."""
    times = np.arange(6.0)
    states = np.column_stack([times, -100.0 - times, 50.0 + times])
    one, three = np.ones(6), np.ones((6, 3))
    one[bad[0] :], three[bad[1] :, 1] = np.nan, np.inf
    seen = {"a/fine": np.ones((6, 2)), "b/one": one, "c/three": three}
    error = first_overflow(seen, block(times, states))
    k = min(bad)
    assert error is not None and error.times.tolist() == [float(k)] and np.array_equal(error.states, states[k : k + 1])
    assert (
        str(error).startswith(f"{'b/one' if bad[0] <= bad[1] else 'c/three'} is not finite") and error.coordinate == 1
    )
    assert first_overflow({"a/fine": np.ones((6, 2))}, block(times, states)) is None


@pytest.mark.parametrize(
    ("said", "end"),
    [("the boom came to its end", " The boom came to its end."), ("", "which no craft reaches. Check ")],
)
def test_a_run_that_has_run_away_says_what_its_model_says_of_the_row_or_else_what_to_check(monkeypatch, said, end):
    model = compile_system(System({"wheel": rigid_body(1.0, np.eye(3))}, (revolute("wheel"),)))
    rows = []
    monkeypatch.setattr(type(model), "diagnosis", lambda self, t, x: (rows.append((t, *x)), (said, None))[1])
    error = MotionGuard(model).divergence(block(np.arange(3.0), np.array([[0.0, 1.0], [1.0, 2e5], [2.0, 3e5]])))
    assert end in str(error) and str(error).endswith(".") and ("Check" in str(error)) == (not said)
    assert rows == [(1.0, 1.0, 2e5)]
