"""A controller whose answer is refused ends the run; what was computed is kept."""

from __future__ import annotations

import numpy as np
import pytest

import femflex
from femflex.case.read import parse_case
from femflex.results import open_run
from femflex.system import Controller, reaction_wheel, tank, thruster
from femflex.system.thruster import Supply

CASE = """
[run]
duration = 10
output_step = 0.1
[bodies.hub]
kind = "rigid"
mass = 10
inertia = [1, 1, 1]
"""


def law(t, sensors, memory):
    return (np.nan if t > 5.0 else 0.1), memory


@pytest.mark.parametrize("eventful", [False, True])
def test_rows_up_to_a_command_that_is_not_finite_are_kept(tmp_path, eventful):
    pilot = Controller("pilot", law, 0.5, commands={"u": "N m"})
    wheel = reaction_wheel("wheel", "hub", 0.1, torque="pilot.u")
    supply = Supply("tank", "hub")
    jet = thruster("jet", "hub", 1e-3, profile=([0.0], [1.0]), specific_impulse=200.0, supply=supply)
    more = (jet, tank("tank", 1.0, ["jet"])) if eventful else ()
    with pytest.raises(ValueError, match=r"the command of controller 'pilot' at t = 5.5 s is not finite"):
        femflex.run(parse_case(CASE), tmp_path / "run.h5", effectors=(pilot, wheel, *more))
    with open_run(tmp_path / "run.h5") as run:
        assert not run.complete and run.time[-1] == pytest.approx(5.5)
        assert "is not finite" in str(run.attributes["ended"])
