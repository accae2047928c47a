"""One compiled model in many threads at once, each with scratch arrays of its own."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from support.random_loops import random_loops
from support.random_systems import random_tree
from test_varying_bodies import random_varying

from femflex.dynamics import compile_system
from femflex.integrate import integrator

SYSTEMS = {
    "tree": lambda: random_tree(3)[::2],
    "loops": lambda: random_loops(2, 2)[::2],
    "varying": lambda: random_varying(3)[:5:4],
}


def trajectory(model, x0, method):
    """States of a run, and what is observed of them."""
    times = np.linspace(0, 0.5, 400)
    states = integrator(method).solve(model, times, x0).states
    return states, model.observe(times[::40], states[::40])


@pytest.mark.parametrize("kind", SYSTEMS)
def test_threads_share_a_model_and_get_the_bits_of_one(kind):
    system, state = SYSTEMS[kind]()
    model = compile_system(system)
    starts = [model.x0 if kind == "loops" else np.concatenate(state) * [1.0, 1.0 + 1e-3 * k][1] for k in range(4)]
    for x0 in starts:
        for first in model.renormalise:
            x0[first : first + 4] /= np.linalg.norm(x0[first : first + 4])
    alone = [trajectory(model, x0, "dop853") for x0 in starts]
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(lambda x0: trajectory(model, x0, "dop853"), starts * 3))
    for k, (states, seen) in enumerate(together):
        assert np.array_equal(states, alone[k % 4][0])
        assert all(np.array_equal(seen[path], alone[k % 4][1][path]) for path in seen)


def test_a_model_keeps_its_numbers_whatever_runs():
    system, *_, state = random_varying(3)
    model = compile_system(system)
    table, numbers = model.table.copy(), model.workspace.numbers.copy()
    trajectory(model, np.concatenate(state), "dop853")
    assert np.array_equal(model.table, table)
    assert np.array_equal(model.workspace.numbers, numbers)
    assert not np.array_equal(model.pool, numbers)  # the thread's own, at another time


def test_runs_have_scratch_of_their_own():
    model = compile_system(random_loops(2, 2)[0])
    one, other = model.for_run(), model.for_run()
    assert one.table is model.table and one.workspace.numbers is model.workspace.numbers
    assert one.work is not other.work and one.constraints.own[2] is one.work
