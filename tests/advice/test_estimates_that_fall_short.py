"""Motion estimates that cover less than the whole: what they cover, and what is said of the rest."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.advice.motion_estimate import estimate_rigid_motion
from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.system import System, free

RATE = np.array([0.3, -0.2, 0.4])


def springy(stiffness: float) -> FlexibleBody:
    """Two shapes that move a fifth of the mass each."""
    rng = np.random.default_rng(5)
    mass, rho, phi = rng.uniform(0.5, 2, 7), rng.normal(size=(7, 3)), 0.3 * rng.normal(size=(7, 3, 2))
    z = np.concatenate([rho[:, None, :], phi.swapaxes(1, 2)], axis=1)
    moments = MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))
    tip = Marker([0.5, 0.2, 0.1], rng.normal(size=(3, 2)), rng.normal(size=(3, 2)))
    return FlexibleBody(moments, StrainTensors.linear(stiffness * np.eye(2)), np.zeros((2, 2)), {"tip": tip})


def spun(rate) -> System:
    return System({"b": rigid_body(1.0, np.diag([1.0, 2.0, 2.5]))}, (free("b", u0=[*rate, 0, 0, 0]),))


def test_the_whole_motion_of_a_spinning_body_has_its_energy_and_is_not_short():
    found, why = estimate_rigid_motion(spun(RATE), 30.0)
    assert found is not None and (why, found.short) == ("", "")
    assert found.times[0] == 0.0 and found.times[-1] == 30.0 and len(found.states) == len(found.times)
    energy = found.states[:, 7:10] ** 2 @ [1.0, 2.0, 2.5]
    assert energy == pytest.approx(RATE**2 @ [1.0, 2.0, 2.5], rel=1e-4) and np.ptp(found.states[:, 7]) > 0.05
