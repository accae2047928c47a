"""The work array is scratch: whatever stands there before a call, its answer is the same to the last bit."""

import numpy as np
import pytest
from support.prescribed_systems import held_tree
from support.random_loops import random_loops
from support.random_systems import random_tree

from femflex.dynamics import compile_system

SYSTEMS = {"tree": random_tree, "held": held_tree, "loops": lambda seed: random_loops(seed, 2)}


def answers(model, x, spoil):
    """Rates, residual, and the state brought back onto its constraints, each after the work array was spoiled."""
    spoil(model.work)
    rates = model.state_rate(0.3, x)
    spoil(model.work)
    residual = model.residual(0.3, x, np.ones(model.n_u))
    back = x.copy()
    if model.project is not None:
        spoil(model.work)
        model.project(0.3, back, model.table, model.pool, model.work)
    return rates, residual, back


@pytest.mark.parametrize("seed", [2, 11])
@pytest.mark.parametrize("kind", SYSTEMS)
def test_what_stood_in_the_work_array_changes_no_bit(kind, seed):
    system, _, state = SYSTEMS[kind](seed)
    model, x = compile_system(system), np.concatenate(state)
    clean = answers(model, x, lambda work: None)
    assert all(np.isfinite(part).all() for part in clean)
    rng = np.random.default_rng(seed)
    for filled in (np.nan, np.inf, 1e300, rng.normal(size=model.work.size)):
        spoiled = answers(model, x, lambda work, filled=filled: np.copyto(work, filled))
        assert all(np.array_equal(a, b) for a, b in zip(clean, spoiled, strict=True))
