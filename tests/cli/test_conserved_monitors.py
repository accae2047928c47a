"""Which monitors of a run are printed as ones that ought to be constant."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.cli.run_report import conserved_monitors
from femflex.system import Frame, Load, System, free, revolute

ENERGY, SPIN = "monitors/energy", "monitors/angular_momentum"
BODY = {"hub": rigid_body(1.0, np.diag([1.0, 2.0, 2.5]))}
DEAD = Load("pull", "hub", "origin", frame="inertial", force=np.array([1.0, 0.0, 0.0]))


class Empty(dict):
    """A run without an orbit, with all of its terms."""

    without: tuple[str, ...] = ()


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
