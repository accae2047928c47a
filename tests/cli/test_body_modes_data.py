"""What `femflex modes --json` prints of one body, in units."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.cli.modes import modes_data
from femflex.reduction import BeamFunctions, UniformBeam, beam_body


def test_frequencies_are_in_hertz():
    """3.516 sqrt(EI / m L^4) / 2 pi of a cantilever, in both planes."""
    beam = UniformBeam(2.0, EA=1e6, EIy=4.0, EIz=1.0, GJ=1.0, mass_per_length=0.25, rotary_inertia=False)
    found = modes_data(beam_body(beam, BeamFunctions(y=1, z=1)), None)
    assert list(found["frequency_hz"]) == pytest.approx(3.516015 / (2 * np.pi) * np.array([0.5, 1.0]), rel=1e-6)
    assert found["mass_kg"] == pytest.approx(0.5)
