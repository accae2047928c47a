"""A deploying body's right-hand side costs at most three times that of the same body at fixed length."""

import time
from dataclasses import replace

import numpy as np
import pytest

from femflex.deployment import DeployingLine, deploying_line
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions
from femflex.system import Profile, System, free

CALLS = 2000


def time_ratio(first_model, second_model):
    """Processor time of one right-hand side over that of the other, the least of some trials in turn."""
    best = {}
    for _ in range(9):
        for k, model in enumerate((first_model, second_model)):
            x, dx, workspace_arrays = model.x0.copy(), np.empty(model.n_x), model.workspace.arrays
            start = time.process_time()
            for _ in range(CALLS):
                model.rate(1.0, x, dx, *workspace_arrays)
            best[k] = min(best.get(k, np.inf), time.process_time() - start)
    return best[0] / best[1]


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 4])
def test_a_deploying_body_costs_at_most_three_times_a_fixed_one(n):
    line = DeployingLine(mass_per_length=1.0, EIy=1.0, EIz=1.0)
    deploying_beam = deploying_line(line, BeamFunctions(y=n, z=n), Profile.polynomial(1.0, 0.3), until=5.0)
    delta = {"beam": 0.01 * np.ones(deploying_beam.body.n_modes)}
    system = System(
        {"beam": deploying_beam.body}, (free("beam"),), varying={"beam": deploying_beam.variation}, delta0=delta
    )
    assert time_ratio(compile_system(system), compile_system(replace(system, varying={}))) < 3.0
