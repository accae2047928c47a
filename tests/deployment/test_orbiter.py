"""The source's example: a beam deploys from the Orbiter along the orbit normal, librations held."""

import numpy as np
import pytest
from support.members import solved
from support.orbit_beam import held_beam

from femflex.body import rigid_body
from femflex.deployment import DeployingLine, deploying_line
from femflex.reduction import BeamFunctions
from femflex.reduction.beams.beam_functions import bending_characteristic
from femflex.system import EARTH_RADIUS, Frame, Orbit, Profile, System, weld

ORBITER, BEAM, LENGTH, EI = 79710.0, 129.0, 33.0, 436 * 9.80665
ORBIT = Orbit(EARTH_RADIUS + 331e3)

SMALL = 0.001  # of the length: the independent solution is linear in the deflection

_first = bending_characteristic("clamped-free", 1)


def orbiter(length, until, n=3, EI=EI, tip=0.04):
    """The Orbiter held in the orbital frame (x orbit normal, y up, z forward), its beam along the normal."""
    line = DeployingLine(mass_per_length=BEAM / LENGTH, EIy=EI, EIz=EI, direction=(1, 0, 0), orientation=(0, 1, 0))
    made = deploying_line(line, BeamFunctions(y=n, z=n), length, until=until, stock=LENGTH)
    marker, first = made.body.marker("tip"), float(length(0.0)[0])
    rows = marker.phi[1:, : 2 * n]
    delta = np.zeros(2 * n)
    delta[:2] = np.linalg.solve(rows[:, :2], [tip * first, tip * first])
    bodies = {"orbiter": rigid_body(ORBITER, np.diag([8646050.0, 1091430.0, 8286760.0])), "beam": made.body}
    return System(bodies, (weld("orbiter"), weld("beam", "orbiter")), varying={"beam": made.variation}, orbit=ORBIT,
                  frame=Frame("orbital"), delta0={"beam": delta})  # fmt: skip


def alone(length, times, EI=EI, tip=0.04, count=8):
    """The independent solution of the same."""
    first = float(length(0.0)[0])

    def shape(xi):
        return tip * first * _first(xi)[:, 0] / _first(np.ones(1))[0, 0]

    total = ORBITER + BEAM
    return held_beam(length, shape, times, EI, BEAM / LENGTH, total, ORBIT.mean_motion, count)


def tip_of(seen):
    """Deflection (n_t, 2) up and forward."""
    return seen["markers/beam.tip/deflection"][:, 1:]


@pytest.mark.slow
def test_the_tip_moves_as_an_independent_solution_says():
    length, times = Profile.smooth_step(0.0, 100.0, 20.0, 33.0), np.linspace(0, 120, 49)
    found = tip_of(solved(orbiter(length, 120.0, tip=SMALL), times, 1e-9)[2])
    exact = alone(length, times, tip=SMALL, count=6)
    assert np.abs(found - exact).max() < 1e-3 * np.abs(exact).max()


def strategies(first, end):
    """Two ways of equal duration from a first length to 33 m: smooth, and a constant rate with short ramps."""
    return {
        "smooth": Profile.smooth_step(0.0, end, first, 33.0),
        "trapezoid": Profile.trapezoid(0.0, end, first, 33.0, end / 15.0),
    }


READINGS = pytest.mark.parametrize("reading", [436 * 9.80665, 436.0], ids=["kgf m^2", "N m^2"])


@pytest.mark.slow
@READINGS
@pytest.mark.parametrize("strategy", ["smooth", "trapezoid"])
def test_both_strategies_and_readings_against_the_independent_solution(strategy, reading):
    length, times = strategies(15.0, 300.0)[strategy], np.linspace(0, 400, 161)
    found = tip_of(solved(orbiter(length, 400.0, EI=reading, tip=SMALL), times, 1e-9)[2])
    exact = alone(length, times, EI=reading, tip=SMALL, count=6)
    assert np.abs(found - exact).max() < 1e-3 * np.abs(exact).max()


@pytest.mark.slow
@READINGS
def test_sentences_of_fig_5(reading):
    """Which sentences on Fig. 5 hold, under both readings of EI: 5 m to 33 m in 1500 s, 4 % of the initial length.

    Borne out: the frequency falls gradually and becomes steady; both strategies reach the same steady amplitude. Not
    borne out: an amplitude that is much larger during deployment than after it. In metres it grows as sqrt(L) and is
    largest when deployed; relative to the length it falls as 1 / sqrt(L), and only so is it larger during deployment.
    """
    times, peaks = np.linspace(0, 2500, 5001), {}
    for name, profile in strategies(5.0, 1500.0).items():
        tip = tip_of(solved(orbiter(profile, 2500.0, EI=reading, n=2), times, 1e-9)[2])
        size, L = np.linalg.norm(tip, axis=1), profile(times)[0]
        crossings = np.flatnonzero(np.diff(np.sign(tip[:, 1])))
        periods, ends = 2 * np.diff(times[crossings]), times[crossings[1:]]
        during, settled = periods[ends < 1500], periods[ends > 1600]
        assert during[-3:].mean() > 5 * during[:3].mean()
        assert np.ptp(settled) < 0.2 * settled.mean()
        peaks[name] = size[times > 1600].max()
        assert size[times < 1500].max() < 1.05 * peaks[name]
        assert (size / L)[times < 750].max() > 2.0 * (size / L)[times > 1600].max()
    assert peaks["smooth"] == pytest.approx(peaks["trapezoid"], rel=1e-3)
    assert peaks["smooth"] == pytest.approx(0.04 * 5 * np.sqrt(2) * np.sqrt(33 / 5), rel=0.01)  # E / omega stays
