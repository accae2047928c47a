"""What linear strain leaves out is reported for the worst instants of a run, in whichever block they come."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from support.spin_up import KANE

from femflex.advice.stiffening import StiffeningWatch, attached_masses
from femflex.dynamics import compile_system
from femflex.system import System, free, weld
from femflex.warning import PhysicsWarning

GAINS = [[-0.30, 0.10], [-0.64, 0.69], [-0.10, 0.05]]  # parts of the lowest shape's stiffness, two rows a block


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (0, 2, 1)])
def test_the_largest_stiffening_and_softening_of_all_blocks_are_told(order):
    """sqrt(1.69) = 1.3: 30 % up, at the spin of its own row; sqrt(0.36) = 0.6: 40 % down."""
    guard = StiffeningWatch(compile_system(System({"beam": KANE.body("linear", y=2)}, (KANE.joint(),))))
    guard._whole = {"beam": "beam"}
    for block in order:
        guard._ignored = SimpleNamespace(gains=lambda seen, k=block: {"beam": np.array(GAINS[k])})
        guard.watch({"bodies/beam/rate": np.array([[0.0, 0.0, 1.0 + block], [0.0, 0.0, 10.0 + block]])})
    with pytest.warns(PhysicsWarning) as told:
        guard.warn()
    texts = [str(one.message) for one in told]
    assert any("turned at up to 11 rad/s: a stiffening of 30% of" in text for text in texts)
    assert any("falls by 40%" in text for text in texts)
    assert len(texts) == 2


def test_what_hangs_at_a_marker_has_the_mass_of_all_that_hangs_on_it():
    body = KANE.body("linear", y=1)
    bodies = dict.fromkeys(("a", "b", "c", "d"), body)
    joints = [free("a"), *(weld(child, parent, parent_marker="tip") for child, parent in ("ba", "cb", "dc"))]
    system = System(bodies, tuple(joints))
    mass = body.moments.mass
    assert attached_masses(system, "a") == pytest.approx({"tip": 3 * mass})
    assert attached_masses(system, "b") == pytest.approx({"tip": 2 * mass}) and attached_masses(system, "d") == {}
