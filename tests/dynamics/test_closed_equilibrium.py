"""Equilibria beside loops: a sprung four-bar by its energy, a beam clamped at both ends, its buckling; refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from support.elastica import EI, LENGTH, SECTION, beam
from support.mechanisms import four_bar, sleigh

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.equilibrium import equilibrium
from femflex.dynamics.equilibria.linearised import linearised
from femflex.system import Frame, Load, assembled, prismatic, weld
from femflex.system.segments import FAR as FAR_END

CRANK, COUPLER, ROCKER, BASE = 0.5, 2.0, 1.2, 2.0
STIFF, REST, WEIGHT = (3.0, 7.0), (0.9, 1.1), (4.0, 2.5)  # springs of crank and rocker; forces down on both ends


def linkage(frame=None):
    """The four-bar with springs at both pivots of the ground and a weight at the end of crank and rocker."""
    system = four_bar(CRANK, COUPLER, ROCKER, BASE, speed=0.0)
    joints = [
        replace(j, stiffness=np.array([STIFF[i]]), rest=np.array([REST[i]]))
        if (i := {"crank": 0, "rocker": 1}.get(j.child, -1)) >= 0
        else j
        for j in system.joints
    ]
    loads = tuple(
        Load(name, name, "end", frame="inertial", force=[0, -w, 0])
        for name, w in zip(("crank", "rocker"), WEIGHT, strict=True)
    )
    if frame is not None:
        loads = ()
    return replace(system, joints=tuple(joints), loads=loads, **({} if frame is None else {"frame": frame}))


def rocker_at(crank):
    """The rocker's angle by the closure of the four bars (Freudenstein), on the branch the case starts on."""
    end = CRANK * np.array([np.cos(crank), np.sin(crank)])

    def gap(angle):
        return np.hypot(*(np.array([BASE, 0]) + ROCKER * np.array([np.cos(angle), np.sin(angle)]) - end)) - COUPLER

    return brentq(gap, 0.4, np.pi, xtol=1e-14)


def energy(crank, spin=0.0):
    """Potential energy of the springs and weights, less the kinetic energy of the spin about z."""
    rocker = rocker_at(crank)
    out = 0.5 * STIFF[0] * (crank - REST[0]) ** 2 + 0.5 * STIFF[1] * (rocker - REST[1]) ** 2
    if spin == 0.0:
        return out + WEIGHT[0] * CRANK * np.sin(crank) + WEIGHT[1] * ROCKER * np.sin(rocker)
    A = CRANK * np.array([np.cos(crank), np.sin(crank)])
    B = np.array([BASE, 0]) + ROCKER * np.array([np.cos(rocker), np.sin(rocker)])
    middles = ((A / 2, CRANK), ((A + B) / 2, COUPLER), ((np.array([BASE, 0]) + B) / 2, ROCKER))
    return out - sum(0.5 * spin**2 * (m @ m + length**2 / 12) for m, length in middles)  # bars of 1 kg


def inertia(crank, h=1e-5):
    """Kinetic energy of the bars over half the square of the crank's rate."""

    def places(angle):
        rocker = rocker_at(angle)
        A = CRANK * np.array([np.cos(angle), np.sin(angle)])
        B = np.array([BASE, 0]) + ROCKER * np.array([np.cos(rocker), np.sin(rocker)])
        return A / 2, (A + B) / 2, (np.array([BASE, 0]) + B) / 2, angle, np.arctan2(*(B - A)[::-1]), rocker

    ahead, behind = places(crank + h), places(crank - h)
    rates = [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
    lengths = (CRANK, COUPLER, ROCKER)
    return sum(v @ v for v in rates[:3]) + sum(
        length**2 / 12 * w**2 for length, w in zip(lengths, rates[3:], strict=True)
    )


@pytest.mark.parametrize("spin", [0.0, 0.8])
def test_a_sprung_four_bar_rests_where_its_energy_is_least_and_swings_about_it(spin):
    system = linkage(Frame("spinning", np.array([0, 0, spin])) if spin else None)
    found = equilibrium(system)
    crank = found.q[0]
    least = minimize_scalar(energy, (crank - 0.05, crank, crank + 0.05), args=(spin,), tol=1e-12)
    slope = (energy(crank + 1e-5, spin) - energy(crank - 1e-5, spin)) / 2e-5
    assert abs(slope) < 1e-8
    assert crank == pytest.approx(least.x, abs=1e-6)
    assert found.stable and found.residual < 1e-9 and len(found.eigenvalues) == 2
    h = 1e-4
    curve = (energy(crank + h, spin) - 2 * energy(crank, spin) + energy(crank - h, spin)) / h**2
    omega = np.sqrt(curve / inertia(crank))  # one freedom in a plane: the spin's gyroscopic forces do nothing
    assert np.abs(found.eigenvalues.imag) == pytest.approx(np.full(2, omega), rel=1e-5)
    seen = found.model.observe(np.zeros(1), found.x[None])
    assert seen["monitors/constraint_position"][0] < 1e-12
    assert found.model.state_rate(0.0, found.x) == pytest.approx(np.zeros(found.model.n_x), abs=1e-7)


def clamped(k, end, push=0.0):
    """The beam of k segments, welded at its root, its tip held by a cut joint; pushed along its axis."""
    wall = rigid_body(1.0, np.eye(3), markers={"far": Marker.rigid([LENGTH, 0, 0])})
    load = Load("push", "beam", "tip", frame="inertial", force=np.array([-push, 0, 0]))
    joints = [weld("wall"), weld("beam", "wall", child_marker="root")]
    return assembled({"wall": wall, "beam": beam(k)}, joints, [load], loops=[end])


FAR = {"child": "beam", "parent": "wall", "parent_marker": "far", "child_marker": "tip", "name": "closing"}


def test_a_beam_clamped_at_both_ends_by_a_loop_has_the_frequencies_of_the_closed_form():
    roots = np.array([brentq(lambda x: np.cos(x) - 1 / np.cosh(x), a, b) for a, b in ((4.6, 4.9), (7.7, 8.0))])
    wanted = (roots / LENGTH) ** 2 * np.sqrt(EI / SECTION.mass_per_length)
    errors = []
    for k in (4, 8):
        model = compile_system(clamped(k, weld(**FAR)))
        omega = np.sort(np.abs(linearised(model, 0.0, model.x0).eigenvalues().imag))[::2]
        assert omega[[0, 2]] == pytest.approx(omega[[1, 3]], rel=1e-6)  # the section is round
        assert model.max_frequency == pytest.approx(omega.max(), rel=1e-4)  # of the whole, with its loop
        errors.append(np.abs(omega[[0, 2]] / wanted - 1).max())
    assert errors[1] < 2e-3 and errors[1] < errors[0] / 3


def buckling(k):
    """Where the square of the lowest frequency vanishes, over four times the load of hinged ends, and the verdicts."""
    critical, shares = 4 * np.pi**2 * EI / LENGTH**2, (0.95, 1.15)
    found = [equilibrium(clamped(k, prismatic(**FAR, axis=[1, 0, 0]), share * critical)) for share in shares]
    assert all(one.residual < 1e-9 for one in found)
    low, high = (float((one.eigenvalues[:2] ** 2).real.mean()) for one in found)
    return shares[0] - low * (shares[1] - shares[0]) / (high - low), [one.stable for one in found]


@pytest.mark.slow
def test_a_beam_clamped_at_both_ends_buckles_at_four_times_the_load_of_hinged_ends():
    (coarse, _), (fine, stable) = buckling(8), buckling(16)
    assert stable == [True, False]
    assert (4 * fine - coarse) / 3 == pytest.approx(1.0, abs=2e-3)  # the error falls with the square of the segments
    assert abs(fine - 1) < abs(coarse - 1) / 3


def test_a_frame_held_at_both_ends_carries_its_load_as_statics_says():
    """A beam clamped at both ends under a force F across its middle sags F L^3 / (192 EI)."""
    wall = rigid_body(1.0, np.eye(3), markers={"far": Marker.rigid([LENGTH, 0, 0])})
    joints = [weld("wall"), weld("beam", "wall", child_marker="root")]
    load = Load("weight", "beam.4", FAR_END, frame="inertial", force=np.array([0, 0, -1.0]))
    system = assembled({"wall": wall, "beam": beam(8)}, joints, loops=[weld(**FAR)])
    found = equilibrium(replace(system, loads=(load,)))
    seen = found.model.observe(np.zeros(1), found.x[None])
    sag = 2 * seen["monitors/elastic"][0]  # twice the work over the force
    assert sag == pytest.approx(LENGTH**3 / (192 * EI), rel=5e-3)
    assert seen["loops/closing/force"][0, 2] == pytest.approx(0.5, rel=1e-6)
    assert abs(seen["loops/closing/torque"][0, 1]) == pytest.approx(LENGTH / 8, rel=5e-3)


def test_nonholonomic_constraints_and_loops_in_motion_are_refused():
    with pytest.raises(ValueError, match="'blade': nonholonomic constraints restrict velocities"):
        equilibrium(sleigh(0.5))
    model = compile_system(sleigh(0.5))
    with pytest.raises(ValueError, match="linear equations cannot be found with them"):
        linearised(model, 0.0, model.x0)
    moving = compile_system(four_bar())
    with pytest.raises(ValueError, match=r"the loops \['closure'\] are in motion"):
        linearised(moving, 0.0, moving.x0)


def test_a_linkage_that_nothing_holds_is_neutral():
    system = four_bar(speed=0.0)
    found = equilibrium(system)
    assert len(found.neutral) == 1 and found.stable
