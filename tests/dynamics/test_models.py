"""A compiled model called from Python: its matrices belong together, and states of another size are refused."""

from __future__ import annotations

import numpy as np
import pytest
from support.random_systems import random_tree

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.system import System, revolute


@pytest.fixture
def model():
    return compile_system(System({"wheel": rigid_body(2.0, np.diag([3.0, 4.0, 5.0]))}, (revolute("wheel"),)))


@pytest.mark.parametrize("verb", ["state_rate", "residual", "gather", "bias", "mass_matrix"])
def test_a_state_that_is_too_short_is_refused_with_its_size(model, verb):
    more = (np.zeros(1),) if verb in ("residual", "gather") else ()
    with pytest.raises(ValueError, match=r"a state of this model has 2 numbers \(q, u, z\); found 1"):
        getattr(model, verb)(0.0, np.zeros(1), *more)


def test_the_rate_of_a_state_balances_the_residual():
    system, _, state = random_tree(3)
    model, x = compile_system(system), np.concatenate(state)
    rate = model.state_rate(0.3, x)[model.n_q : model.n_q + model.n_u]
    M, h = model.mass_matrix(0.3, x), model.bias(0.3, x)
    assert model.residual(0.3, x, rate) == pytest.approx(np.zeros(model.n_u), abs=1e-9 * np.abs(h).max())
    assert M @ rate == pytest.approx(-h, abs=1e-9 * np.abs(h).max()) and M.T == pytest.approx(M)
