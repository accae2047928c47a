"""Ratios of speed against scipy's implementation of the same method, driving the same compiled function."""

import time

import numpy as np
import pytest
from support.integrate_models import chain
from support.scipy_integrators import integrator

from femflex.integrate import Dop853


@pytest.mark.benchmark
@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_at_equal_tolerance_it_is_at_least_five_times_faster_than_scipys(rtol):
    n = 27
    model, x0 = chain(np.linspace(1, 2, n), np.linspace(3, 1, n + 1), cubic=0.3), np.sin(np.arange(2.0 * n))
    times = np.linspace(0, 100, 201)
    exact = Dop853(rtol=1e-13, atol=1e-14).solve(model, times, x0).states
    spent = {"dop853": [], "scipy_dop853": []}
    for _ in range(5):
        for name, seconds in spent.items():
            method, begin = integrator(name, rtol=rtol, atol=rtol), time.process_time()
            x = method.solve(model, times, x0)
            seconds.append(time.process_time() - begin)
            assert np.abs(x.states - exact).max() < 1e4 * rtol
    ours, theirs = (np.array(spent[name]) for name in ("dop853", "scipy_dop853"))
    print(f"\nrtol {rtol:g}: scipy / femflex = {np.median(theirs / ours):.1f}")
    assert np.median(theirs / ours) >= 5
