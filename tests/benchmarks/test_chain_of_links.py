"""Case b: equal error, process CPU seconds, one thread each, median ratio of interleaved pairs."""

import time

import numpy as np
import pytest
from support.chain_of_links import DURATION, TIP_AT_END, exudyn_run, femflex_model

from femflex.integrate import Dop853, Esdirk4

ERROR = 1.5e-4  # m, at which both are compared
STEP = 2e-3  # s, at which Exudyn reaches it fastest
ENDS = np.array([0.0, DURATION])
ADAPTIVE = Esdirk4(rtol=7e-4, atol=7e-5)


def femflex_run(model, method):
    begin = time.process_time()
    solution = method.solve(model, ENDS, model.x0)
    spent = time.process_time() - begin
    return spent, model.observe(ENDS, solution.states)["markers/link7.tip/position"][-1]


def test_tip_of_case_b_is_that_of_an_independent_program():
    model = femflex_model()
    assert femflex_run(model, Dop853(rtol=1e-8, atol=1e-8))[1] == pytest.approx(TIP_AT_END, abs=1e-7)


@pytest.mark.benchmark
def test_case_b_runs_faster_than_exudyns_generalised_alpha_at_equal_error():
    method = ADAPTIVE
    pytest.importorskip("exudyn")
    model = femflex_model()
    converged = femflex_run(model, Dop853(rtol=1e-11, atol=1e-12))[1]
    assert converged == pytest.approx(TIP_AT_END, abs=1e-8)
    femflex_run(model, method)
    ratios = []
    for _ in range(5):
        (theirs, tip_theirs), (ours, tip_ours) = exudyn_run(STEP), femflex_run(model, method)
        errors = [np.abs(tip - converged).max() for tip in (tip_theirs, tip_ours)]
        assert max(errors) < ERROR
        ratios.append(theirs / ours)
    details = f"errors {errors[0]:.1e} and {errors[1]:.1e} m; pairs {np.round(ratios, 1)}"
    print(f"\ncase b: Exudyn generalised alpha / femflex {method.name} = {np.median(ratios):.1f} ({details})")
    assert np.median(ratios) >= 10
