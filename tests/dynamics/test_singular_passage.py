"""A parallelogram of four bars runs through its flat configuration, where its loop loses rank and branches meet.

On its branch crank and rocker turn alike and the coupler does not turn: all its points run along circles of one radius,
the kinetic energy is that of a constant moment of inertia, and the exact motion is a constant rate.
"""

from dataclasses import replace

import numpy as np
import pytest
from support.mechanisms import four_bar

from femflex.dynamics import compile_system
from femflex.dynamics.constraints.singular_passage import passage
from femflex.integrate import Dop853, Esdirk4
from femflex.pipeline.guard import warn_of_passage
from femflex.warning import PhysicsWarning

RATE = 3.0


def parallelogram(start=1.0):
    """Two bars of 0.5 m turning alike under a coupler as long as their base."""
    system = four_bar(crank=0.5, coupler=2.0, rocker=0.5, base=2.0, start=(start, -start, start))
    rates = {"crank": RATE, "coupler": -RATE, "rocker": RATE}
    return replace(
        system,
        joints=tuple(j if j.child == "ground" else j.with_initial(u0=[rates[j.child]]) for j in system.joints),
    )


@pytest.mark.parametrize("start", [1.0, 0.0], ids=["before", "in it"])
@pytest.mark.parametrize("method", [Dop853(), Esdirk4()], ids=lambda method: method.name)
def test_a_parallelogram_keeps_its_rate_through_nineteen_flat_configurations(method, start):
    model = compile_system(parallelogram(start))
    times = np.linspace(0.0, 20.0, 401)
    solution = method.solve(model, times, model.x0)
    seen = model.observe(times, solution.states)
    q = seen["q"]
    assert q[:, 0] == pytest.approx(start + RATE * times, abs=1e-6)
    assert np.abs(q[:, 0] - q[:, 1]).max() < 1e-9  # the same branch throughout
    assert np.ptp(seen["monitors/energy"]) < 1e-8 * seen["monitors/energy"][0]
    assert seen["monitors/constraint_position"].max() < 1e-10
    assert solution.steps.accepted < 10_000


def test_the_passage_is_noted_with_its_time():
    model = compile_system(parallelogram())
    Dop853().solve(model, np.linspace(0.0, 1.0, 11), model.x0)
    found = passage(model.constraints)
    assert found.t == pytest.approx((np.pi - 1.0) / RATE, abs=0.01)
    assert found.least < 100 * found.lost and found.count == 1


@pytest.mark.parametrize("rows", [11, 2001])
def test_all_passages_are_counted_and_the_first_are_told_with_their_times(rows):
    model = compile_system(parallelogram())
    Dop853(max_step=0.1).solve(model, np.linspace(0.0, 20.0, rows), model.x0)  # 0.3 rad: short against half a turn
    found = passage(model.constraints)
    assert found.count == 19
    assert found.first == pytest.approx([(k * np.pi - 1.0) / RATE for k in (1, 2, 3)], abs=0.06)  # of steps of 0.1 s
    said = r"at least 19 singular configurations, the first near t = 0\.71\d, 1\.\d\d, 2\.81 s"
    with pytest.warns(PhysicsWarning, match=said):
        warn_of_passage(model)


@pytest.mark.parametrize("method", [Dop853(), Esdirk4()], ids=lambda method: method.name)
def test_long_steps_never_count_too_many(method):
    """Near a singular configuration the step size follows from rounding, and so does which long steps come after it."""
    model = compile_system(parallelogram())
    method.solve(model, np.linspace(0.0, 20.0, 11), model.x0)  # of nearly half a turn and more
    assert 5 <= passage(model.constraints).count <= 19


@pytest.mark.parametrize("play", [0.0, 2e-6, 2e-5])
def test_a_four_bar_without_singular_configurations_notes_none(play):
    """Not with play either, whose rows are left out from a larger part on."""
    system = four_bar()
    model = compile_system(replace(system, loops=tuple(replace(loop, play=play) for loop in system.loops)))
    Dop853().solve(model, np.linspace(0.0, 10.0, 11), model.x0)
    assert passage(model.constraints) is None
