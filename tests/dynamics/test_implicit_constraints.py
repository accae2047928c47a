"""Implicit integrators on models with constraints: order, agreement with the explicit method, the loop's gap."""

import numpy as np
import pytest
from support.mechanisms import flexible_four_bar, four_bar, sleigh

from femflex.dynamics import compile_system
from femflex.integrate import Dop853, Esdirk4, GeneralizedAlpha

METHODS = [(Esdirk4, 4), (GeneralizedAlpha, 2)]


@pytest.mark.parametrize(("method", "order"), METHODS)
@pytest.mark.parametrize("system", [four_bar(speed=3.0), sleigh(1.7)], ids=["four_bar", "sleigh"])
def test_order_is_kept_with_constraints(method, order, system):
    end, times = 1.0, np.array([0.0, 1.0])
    model = compile_system(system)
    exact = Dop853(rtol=1e-13, atol=1e-14).solve(model, times, model.x0).states[-1]
    counts, errors = np.array([40, 80, 160]) * (4 // order) ** 2, []
    for n in counts:
        states = method(step=end / n, rtol=1e-12, atol=1e-13).solve(model, times, model.x0).states
        errors.append(np.linalg.norm(states[-1] - exact))
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(order, abs=0.2)


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("method", "order"), METHODS)
def test_flexible_four_bar_closes_and_moves_as_with_the_explicit_method(method, order):
    model = compile_system(flexible_four_bar())
    times = np.linspace(0, 0.5, 26)
    exact = Dop853().solve(model, times, model.x0).states
    solution = method(rtol=1e-7, atol=1e-8).solve(model, times, model.x0)
    out = model.observe(times, solution.states)
    assert out["monitors/constraint_position"].max() < 1e-11
    assert out["monitors/constraint_velocity"].max() < 1e-11
    assert solution.states[:, :3] == pytest.approx(exact[:, :3], abs=1e-4)
