"""Equilibria against closed forms: elastica, buckling, gravity gradient, steady spin, with and without loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from support.elastica import EI, LENGTH, MATTIASSON, SECTION, beam, cantilever, elastica
from support.mechanisms import four_bar

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import equilibrium
from femflex.linear.settled import settled
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.rotations import dcm_from_angles, quaternion_from_dcm
from femflex.system import (
    Frame,
    Load,
    Orbit,
    System,
    assembled,
    free,
    prismatic,
    revolute,
    spherical,
    weld,
)
from femflex.system.segments import FAR as FAR_END


def tip(found) -> np.ndarray:
    """Deflection of the beam's tip [m]."""
    return found.model.observe(np.zeros(1), found.x[None])["markers/beam.tip/deflection"][0]


def bent(ratio: float, k: int) -> tuple[float, float]:
    """w/L and u/L under a tip load with that P L^2 / EI."""
    found = equilibrium(cantilever(k, [0, 0.6 * ratio * EI / LENGTH**2, 0.8 * ratio * EI / LENGTH**2]))
    assert found.residual < 1e-9 and found.stable and not found.neutral
    u, y, z = tip(found)
    assert y / z == pytest.approx(0.75, rel=1e-6)  # no direction is preferred
    return float(np.hypot(y, z) / LENGTH), float(-u / LENGTH)


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", MATTIASSON)
def test_sixteen_segments_match_elastica(ratio):
    assert elastica(ratio) == pytest.approx(MATTIASSON[ratio], abs=6e-6)  # the quadrature is right
    assert bent(ratio, 16) == pytest.approx(MATTIASSON[ratio], rel=1e-3)


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", [2, 10])
def test_elastica_error_falls_with_square_of_segments(ratio):
    numbers = np.array([4, 8, 16])
    errors = [np.abs(np.array(bent(ratio, k)) - elastica(ratio)).max() for k in numbers]
    slope = np.polyfit(np.log(numbers), np.log(errors), 1)[0]
    assert slope == pytest.approx(-2.0, abs=0.15)


@pytest.mark.parametrize(("share", "stable"), [(0.98, True), (1.02, False)])
def test_column_buckles_at_euler_load(share, stable):
    critical = np.pi**2 * EI / (4 * LENGTH**2)
    found = equilibrium(cantilever(12, [-share * critical, 0, 0]))
    assert found.stable is stable
    assert ("stable" if stable else "unstable: a small motion grows monotonically") in found.verdict
    assert tip(found)[1:] == pytest.approx(0.0, abs=1e-9)


def craft(pitch: float) -> System:
    """The Orbiter of VALIDATION row D, pitched."""
    axes = Marker.at_position(np.zeros(3), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    body = rigid_body(79710.0, np.diag([8286760.0, 8646050.0, 1091430.0]), markers={"nominal": axes})
    start = quaternion_from_dcm(dcm_from_angles([pitch, 0.1, -0.1], "xzy"))
    return System(
        {"craft": body},
        (spherical("craft", child_marker="nominal", q0=start),),
        orbit=Orbit(perigee_altitude=331e3),
        frame=Frame("orbital"),
    )


def test_gravity_gradient_equilibrium_and_librations():
    found = equilibrium(craft(0.3))
    seen = found.model.observe(np.zeros(1), found.x[None])
    assert seen["attitude/angles"][0] == pytest.approx(0.0, abs=1e-8)
    n = found.model.system.orbit.mean_motion
    assert np.abs(found.eigenvalues.imag)[::2] / n == pytest.approx([0.5687, 1.5801, 1.9266], abs=5e-5)
    assert found.stable


def test_horizontal_attitude_is_unstable_equilibrium():
    found = equilibrium(craft(1.4))
    seen = found.model.observe(np.zeros(1), found.x[None])
    assert seen["attitude/angles"][0][0] == pytest.approx(np.pi / 2, abs=1e-8)
    assert not found.stable and found.growth > 1e-3 * 1.0


def test_sprung_rod_on_spinning_hub_matches_scalar_equation():
    m, J, arm, R, k, rest, rate = 2.0, np.diag([0.02, 0.5, 0.5]), 1.2, 0.7, 40.0, -0.6, 3.0
    rod = rigid_body(m, J, [arm, 0, 0])
    joints = (weld("hub"), revolute("rod", "hub", axis=[0, 1, 0], parent_marker="rim", stiffness=[k], rest=[rest]))
    hub = rigid_body(10.0, np.eye(3), markers={"rim": Marker.at_position([R, 0, 0])})
    found = equilibrium(System({"hub": hub, "rod": rod}, joints, frame=Frame("spinning", np.array([0, 0, rate]))))

    def moment(angle, step=1e-5):
        def energy(a):
            spin = m * (R + arm * np.cos(a)) ** 2 + 0.02 * np.sin(a) ** 2 + 0.5 * np.cos(a) ** 2
            return k * (a - rest) ** 2 / 2 - rate**2 * spin / 2

        return (energy(angle + step) - energy(angle - step)) / (2 * step)

    angle = brentq(moment, -1.0, 0.5)
    assert found.x[0] == pytest.approx(angle, abs=1e-8)
    stiffness = (moment(angle + 1e-4) - moment(angle - 1e-4)) / 2e-4
    assert np.abs(found.eigenvalues.imag).max() == pytest.approx(np.sqrt(stiffness / (0.5 + m * arm**2)), rel=1e-5)


def test_unresisted_coordinates_are_neutral():
    tumbler = rigid_body(3.0, np.diag([1.0, 2.0, 2.5]))
    found = equilibrium(System({"tumbler": tumbler}, (free("tumbler", q0=[1, 2, 3, 1, 0, 0, 0]),)))
    assert len(found.neutral) == 6 and found.x[:3] == pytest.approx([1, 2, 3]) and found.stable
    axle = equilibrium(System({"wheel": tumbler}, (revolute("wheel", q0=[0.4]),)))
    assert axle.neutral == ("base-wheel.angle",) and axle.x[0] == 0.4
    assert "neutral along base-wheel.angle" in axle.verdict


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
def test_sprung_four_bar_rests_at_least_energy(spin):
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
    wall = rigid_body(1.0, np.eye(3), markers={"far": Marker.at_position([LENGTH, 0, 0])})
    load = Load("push", "beam", "tip", frame="inertial", force=np.array([-push, 0, 0]))
    joints = [weld("wall"), weld("beam", "wall", child_marker="root")]
    return assembled({"wall": wall, "beam": beam(k)}, joints, [load], loops=[end])


FAR = {"child": "beam", "parent": "wall", "parent_marker": "far", "child_marker": "tip", "name": "closing"}


def test_beam_clamped_at_both_ends_by_loop_has_exact_frequencies():
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
    """Return the load of zero lowest frequency, over four times that of hinged ends, and the verdicts."""
    critical, shares = 4 * np.pi**2 * EI / LENGTH**2, (0.95, 1.15)
    found = [equilibrium(clamped(k, prismatic(**FAR, axis=[1, 0, 0]), share * critical)) for share in shares]
    assert all(one.residual < 1e-9 for one in found)
    low, high = (float((one.eigenvalues[:2] ** 2).real.mean()) for one in found)
    return shares[0] - low * (shares[1] - shares[0]) / (high - low), [one.stable for one in found]


@pytest.mark.slow
def test_beam_clamped_at_both_ends_buckles_at_exact_load():
    (coarse, _), (fine, stable) = buckling(8), buckling(16)
    assert stable == [True, False]
    assert (4 * fine - coarse) / 3 == pytest.approx(1.0, abs=2e-3)  # the error falls with the square of the segments
    assert abs(fine - 1) < abs(coarse - 1) / 3


def test_statically_indeterminate_beam_reactions():
    """A beam clamped at both ends under a force F across its middle sags F L^3 / (192 EI)."""
    wall = rigid_body(1.0, np.eye(3), markers={"far": Marker.at_position([LENGTH, 0, 0])})
    joints = [weld("wall"), weld("beam", "wall", child_marker="root")]
    load = Load("weight", "beam.4", FAR_END, frame="inertial", force=np.array([0, 0, -1.0]))
    system = assembled({"wall": wall, "beam": beam(8)}, joints, loops=[weld(**FAR)])
    found = equilibrium(replace(system, loads=(load,)))
    seen = found.model.observe(np.zeros(1), found.x[None])
    sag = 2 * seen["monitors/elastic"][0]  # twice the work over the force
    assert sag == pytest.approx(LENGTH**3 / (192 * EI), rel=5e-3)
    assert seen["loops/closing/force"][0, 2] == pytest.approx(0.5, rel=1e-6)
    assert abs(seen["loops/closing/torque"][0, 1]) == pytest.approx(LENGTH / 8, rel=5e-3)


def test_settled_shapes_carry_the_inertia_of_a_hub_that_a_torque_accelerates():
    """A beam on a hub with the acceleration a bends by 11 m a L^5 / (120 EI); the hub starts as it is told."""
    hub, length, mass, torque = 40.0, 6.0, 0.5, 2.0
    uniform = UniformBeam(length, 1e6, 300.0, 300.0, 200.0, mass, rotary_inertia=False)
    body = beam_body(uniform, BeamFunctions(y=4))
    craft = System(
        {"hub": rigid_body(10.0, hub * np.eye(3)), "beam": body},
        (revolute("hub", q0=[0.3], u0=[1e-5]), weld("beam", "hub", child_marker="root")),
        (Load("motor", "hub", torque=[0, 0, torque]),),
    )
    start = settled(craft)
    model = compile_system(start)
    deflection = model.observe(np.zeros(1), model.x0[None])["markers/beam.tip/deflection"][0]
    a = torque / (hub + mass * length**3 / 3)
    assert deflection[1] == pytest.approx(-11 * mass * a * length**5 / (120 * 300.0), rel=1e-4)
    assert (start.joint_of("hub").q0[0], start.joint_of("hub").u0[0]) == (0.3, 1e-5)


def test_settled_springs_of_a_loop_are_those_of_its_equilibrium():
    model = compile_system(settled(linkage()))
    assert model.x0[: model.n_q] == pytest.approx(equilibrium(linkage()).q, abs=1e-9)
