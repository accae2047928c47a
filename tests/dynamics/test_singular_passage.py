"""A parallelogram of four bars runs through its flat configuration, where its loop loses rank and branches meet.

On its branch crank and rocker turn alike and the coupler does not turn: all its points run along circles of one radius,
the kinetic energy is that of a constant moment of inertia, and the exact motion is a constant rate.
"""

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import four_bar

from femflex.dynamics import compile_system
from femflex.dynamics.constraints.singular_passage import passage
from femflex.integrate import Dop853, Esdirk4

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
    t, least, lost = passage(model.constraints)
    assert t == pytest.approx((np.pi - 1.0) / RATE, abs=0.01)
    assert least < 100 * lost


def test_a_four_bar_without_singular_configurations_notes_none():
    model = compile_system(four_bar())
    Dop853().solve(model, np.linspace(0.0, 10.0, 11), model.x0)
    assert passage(model.constraints) is None
