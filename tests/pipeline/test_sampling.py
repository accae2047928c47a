"""What a run says of its controllers."""

from __future__ import annotations

import numpy as np

from femflex.body import rigid_body
from femflex.pipeline.prepared import sampling
from femflex.system import Controller, System, weld


def test_controllers_are_listed_by_period():
    torque = {"torque": "N m"}
    pilots = tuple(
        Controller(name, lambda t, seen, memory: (np.zeros(1), memory), period, commands=torque)
        for name, period in (("a", 1.0), ("b", 0.5), ("c", 1.0))
    )
    system = System({"hub": rigid_body(1.0, np.eye(3))}, (weld("hub"),), effectors=pilots)
    assert sampling(system) == [
        "Controllers a, c are called every 1 s, their commands constant between.",
        "Controller b is called every 0.5 s, its command constant between.",
    ]
