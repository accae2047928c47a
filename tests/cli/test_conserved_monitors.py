"""Which monitors of a run are printed as ones that ought to be constant."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.cli.run_report import change_line, conserved_monitors
from femflex.system import Frame, Load, System, free, revolute

ENERGY, SPIN = "monitors/energy", "monitors/angular_momentum"
BODY = {"hub": rigid_body(1.0, np.diag([1.0, 2.0, 2.5]))}
DEAD = Load("pull", "hub", "origin", frame="inertial", force=np.array([1.0, 0.0, 0.0]))


class Empty(dict):
    """A run without an orbit, with all of its terms."""

    without: tuple[str, ...] = ()

    def unit(self, path: str) -> str:
        return "N m s"


@pytest.mark.parametrize(
    ("system", "kept"),
    [
        (System(BODY, (free("hub"),)), [ENERGY, SPIN]),
        (System(BODY, (free("hub"),), (DEAD,)), [ENERGY]),
        (System(BODY, (revolute("hub"),)), [ENERGY]),
        (System(BODY, (revolute("hub", damping=1.0),)), []),
        (System(BODY, (free("hub"),), frame=Frame("spinning", np.array([0.0, 0.0, 1.0]))), [SPIN]),
    ],
    ids=["free", "pulled", "hinged", "damped", "spinning frame"],
)
def test_what_the_forces_and_joints_leave_constant(system: System, kept: list[str]):
    run: Any = Empty()
    assert conserved_monitors(run, system) == kept


def test_a_momentum_of_zero_has_no_part_of_its_size():
    """A craft whose momentum is zero changes it by rounding alone; that is no 100 %."""
    run: Any = Empty({SPIN: np.array([[0.0, 0.0, 0.0], [1e-14, 0.0, 0.0]])})
    assert change_line(run, SPIN) == "monitor     angular momentum changed by up to 1.000e-14 N m s"
    run[SPIN] = run[SPIN] + np.array([0.0, 0.0, 2.0])
    assert change_line(run, SPIN).endswith("1.000e-14 N m s, 5.00e-15 of its size")
