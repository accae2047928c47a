"""Case a: equal error, process CPU seconds, one thread each, median ratio of interleaved pairs."""

import time

import numpy as np
import pytest
from support.hub_and_panels import DURATION, TIP_AT_END, exudyn_run, femflex_model

from femflex.integrate import Dop853

ERROR = 2e-5  # m, at which both are compared
ENDS = np.array([0.0, DURATION])


def femflex_run(model, rtol):
    begin = time.process_time()
    solution = Dop853(rtol=rtol, atol=rtol).solve(model, ENDS, model.x0)
    spent = time.process_time() - begin
    return spent, model.observe(ENDS, solution.states)["markers/east.corner/position"][-1]


def test_tip_of_case_a_is_that_of_an_independent_program():
    model = femflex_model()
    converged = femflex_run(model, 1e-12)[1]
    # rounding of K of bricks 12 times as wide as thick shifts the first frequency by 1e-7 to 1.2e-6, by processor, in
    # either program; the tip by 6e-6 m
    assert converged == pytest.approx(TIP_AT_END, abs=2e-5)
    assert femflex_run(model, 1e-9)[1] == pytest.approx(converged, abs=1e-6)


@pytest.mark.benchmark
def test_case_a_runs_twenty_times_faster_than_exudyn_at_equal_error():
    pytest.importorskip("exudyn")
    model = femflex_model()
    femflex_run(model, 1e-4)
    ratios = []
    for _ in range(5):
        (theirs, tip_theirs), (ours, tip_ours) = exudyn_run(5e-3), femflex_run(model, 1e-4)
        assert np.abs(tip_theirs - TIP_AT_END).max() < ERROR
        assert np.abs(tip_ours - TIP_AT_END).max() < ERROR
        ratios.append(theirs / ours)
    print(f"\ncase a: Exudyn RK44 / femflex = {np.median(ratios):.1f} (pairs {np.round(ratios, 1)})")
    assert np.median(ratios) >= 20


@pytest.mark.benchmark
def test_compiled_integrator_is_five_times_faster_than_scipys_on_the_same_function():
    from scipy.integrate import solve_ivp

    model = femflex_model()
    dx = np.empty(model.n_x)

    def rate(t, x):
        model.rate(t, x, dx, model.table, model.pool, model.work)
        return dx.copy()

    ratios = []
    femflex_run(model, 1e-6)
    for _ in range(5):
        begin = time.process_time()
        theirs = solve_ivp(rate, ENDS, model.x0, method="DOP853", rtol=1e-6, atol=1e-6, t_eval=ENDS)
        middle = time.process_time()
        ours = Dop853(rtol=1e-6, atol=1e-6).solve(model, ENDS, model.x0)
        ratios.append((middle - begin) / (time.process_time() - middle))
        assert ours.states[-1] == pytest.approx(theirs.y[:, -1], abs=1e-4)
    print(f"\nscipy DOP853 / femflex = {np.median(ratios):.1f}")
    assert np.median(ratios) >= 5
