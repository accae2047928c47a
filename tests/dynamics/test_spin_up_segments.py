"""The spin-up beam cut into segments (VALIDATION row A): steady stretch, frequencies, and the lag on the way."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from support.discrete_rod import EA, EI, LENGTH, MASS, OM, TS, spin, tip_of_rod
from support.elastica import beam

from femflex import fem
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.linear.equilibrium import equilibrium
from femflex.system import Frame, Profile, assembled, revolute, weld

GYRATION = np.sqrt(6e-4 / 1.2)
SECTION = fem.sections.StiffnessSection(EA, EI, EI, 1.2e4, MASS, ry=GYRATION, rz=GYRATION)


def spun(k: int, rate: float, section=SECTION):
    """Equilibrium of the beam in a frame that spins about z."""
    frame = Frame("spinning", np.array([0, 0, rate]))
    return equilibrium(assembled({"beam": beam(k, 0, section)}, [weld("beam", child_marker="root")], frame=frame))


@pytest.mark.parametrize("rate", [OM, 60.0])
def test_steady_stretch_of_segments_is_pure_tension(rate):
    wave = np.sqrt(MASS * rate**2 / EA)
    exact = np.tan(wave * LENGTH) / wave - LENGTH
    assert rate != OM or exact == pytest.approx(5.143e-4, rel=1e-4)  # as printed
    errors = []
    for k in (2, 4, 8):
        found = spun(k, rate)
        stretch = found.model.observe(np.zeros(1), found.x[None])["markers/beam.tip/deflection"][0]
        assert stretch[1:] == pytest.approx(0.0, abs=1e-12)
        errors.append(abs(stretch[0] / exact - 1))
    assert found.stable and errors[0] < 1e-3  # the coarsest are not: too limp for so fast a spin
    assert np.polyfit(np.log([2, 4, 8]), np.log(errors), 1)[0] == pytest.approx(-2.0, abs=0.1)


@pytest.mark.slow
def test_flap_frequency_in_spin_matches_published():
    thin = fem.sections.StiffnessSection(2.8e9, EI, EI, 1.2e4, MASS, ry=1e-3, rz=1e-3)
    unit = np.sqrt(EI / (MASS * LENGTH**4))
    errors = []
    for k in (8, 16):
        found = np.sort(spun(k, 2.0 * unit, thin).eigenvalues.imag)
        pair = found[found > 0][:2] / unit  # lag, then flap
        assert pair[1] ** 2 - pair[0] ** 2 == pytest.approx(4.0, rel=1e-4)  # gamma^2
        errors.append(abs(pair[1] / 4.1373 - 1))
    assert errors[1] < 3e-4 and errors[1] < 0.35 * errors[0] + 2e-5  # four digits are printed


@cache
def lag(k: int) -> float:
    """Largest lag of the tip while the root is spun up [m]."""
    times = np.linspace(0, 20, 201)
    early = OM / TS * (times**2 / 2 + (TS / 2 / np.pi) ** 2 * (np.cos(2 * np.pi * times / TS) - 1))
    turn = Profile.spline(times, np.where(times < TS, early, OM * (times - TS / 2)), 5)
    assert float(turn(3.21)[2]) == pytest.approx(spin(3.21)[1], rel=1e-5)
    hinge = revolute("beam", child_marker="root", axis=[0, 0, 1], motion=(turn,))
    model = compile_system(assembled({"beam": beam(k, 0, SECTION)}, [hinge]))
    run = integrator("esdirk4", rtol=1e-7, atol=1e-9).solve(model, np.linspace(0, 8, 1601), model.x0)
    return float(-model.observe(run.times, run.states)["markers/beam.tip/deflection"][:, 1].min())


@pytest.mark.slow
def test_sixteen_segments_lag_in_spin_up():
    values = [lag(k) for k in (4, 8, 16)]
    assert np.log2((values[0] - values[1]) / (values[1] - values[2])) == pytest.approx(2.0, abs=0.05)
    limit = values[2] + (values[2] - values[1]) / 3
    assert values[2] == pytest.approx(limit, rel=1e-3) and limit == pytest.approx(0.573798, rel=5e-5)


@pytest.mark.slow
def test_discrete_rod_program_has_same_lag():
    coarse, fine = (float(-tip_of_rod(n, 7.5)[:, 1].min()) for n in (10, 20))
    assert fine + (fine - coarse) / 3 == pytest.approx(lag(16) + (lag(16) - lag(8)) / 3, rel=1e-4)
