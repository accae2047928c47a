"""What a run says of frequencies and bends: numbers that do not depend on the run."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.advice.deflections import SWUNG, DeflectionWatch
from femflex.advice.stiffening import attached_masses, lowest_frequency
from femflex.body import rigid_body
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import System, weld
from femflex.warning import PhysicsWarning

BEAM = UniformBeam(2.0, EA=1e6, EIy=10.0, EIz=3.0, GJ=10.0, mass_per_length=0.01, rotary_inertia=False)


def test_the_frequency_of_a_light_boom_is_that_of_what_hangs_at_its_tip():
    """sqrt(3 EI / (M + 33/140 m) L^3) of Rayleigh; two bodies in a row hang there, one at its root does not count."""
    boom, lump = beam_body(BEAM, BeamFunctions(y=4, z=4, tip=True)), rigid_body(3.0, np.eye(3))
    joints = [weld("boom", child_marker="root"), weld("first", "boom", parent_marker="tip")]
    joints += [weld("second", "first"), weld("third", "boom", parent_marker="root")]
    system = System({"boom": boom, "first": lump, "second": lump, "third": lump}, tuple(joints))
    hung = attached_masses(system, "boom")
    assert hung == {"tip": 6.0, "root": 3.0}
    exact = np.sqrt(3 * 3.0 / ((6.0 + 33 / 140 * 0.02) * 2.0**3))
    assert lowest_frequency(boom, hung) == pytest.approx(exact, rel=1e-5)
    assert lowest_frequency(boom, {}) == pytest.approx(3.516015 * np.sqrt(3.0 / 0.01) / 4, rel=1e-5)


@pytest.mark.parametrize(("bend", "told"), [(0.7, False), (1.1, True)])
def test_a_condensed_body_bent_by_more_than_its_strain_holds_is_told_of(bend, told, recwarn):
    body = beam_body(BEAM, BeamFunctions(y=2, z=1), strain="condensed")
    seen = DeflectionWatch("boom", 1, body, "cut it into segments")
    state = np.zeros((2, 1 + body.n_modes))
    first = int(np.argmax(np.abs(body.markers["tip"].phi[1, : body.n_modes])))
    state[1, 1 + first] = bend * SWUNG * seen.size / np.abs(body.markers["tip"].phi[1, first])
    seen.moved(state)
    assert (SWUNG < seen.reached < 1.6 * SWUNG) if told else (0.6 * SWUNG < seen.reached < SWUNG)  # as it draws in
    seen.warn("was")
    texts = [str(one.message) for one in recwarn if one.category is PhysicsWarning]
    assert [f"condensed strain is valid up to about {SWUNG:.0%}" in text for text in texts] == [True] * told
