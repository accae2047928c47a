"""Right-hand side of case a with nonlinear strain against the linear one: median of interleaved pairs."""

from dataclasses import replace
from timeit import timeit

import numpy as np
import pytest
from support.hub_and_panels import femflex_model

from femflex.body.symmetric import packed_size
from femflex.dynamics import compile_system

CALLS = 20000


def seconds_of(model):
    """Time of a rate."""
    arguments = (0.0, model.x0, np.empty(model.n_x), model.table, model.pool, model.work)
    return timeit(lambda: model.rate(*arguments), number=CALLS) / CALLS


@pytest.mark.benchmark
def test_nonlinear_rate_of_case_a_costs_at_most_two_and_a_half_linear_ones():
    linear, rng = femflex_model(), np.random.default_rng(1)
    bodies = dict(linear.system.bodies)
    for name in ("east", "west"):  # tables of their own: every coefficient is read
        V2, V3 = (rng.normal(size=packed_size(10, degree)) for degree in (3, 4))
        bodies[name] = replace(bodies[name], strain=replace(bodies[name].strain, V2=V2, V3=V3))
    curved = compile_system(replace(linear.system, bodies=bodies))
    pairs = [(seconds_of(curved), seconds_of(linear)) for _ in range(9)]
    ratio = float(np.median([a / b for a, b in pairs]))
    print(f"\nnonlinear rate {1e6 * min(a for a, _ in pairs):.2f} us, linear {1e6 * min(b for _, b in pairs):.2f} us")
    print(f"nonlinear / linear = {ratio:.2f}")
    assert ratio <= 2.5
